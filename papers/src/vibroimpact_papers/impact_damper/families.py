"""Families of invariant circles along the frequency, from their birth until they break.

Each circle is a function u of its phase phi with H(u(phi)) = u(phi + rho), H the half map, solved
with exact derivatives; it need not attract.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np
import xarray as xr

from vibroimpact._core.types import Floats
from vibroimpact.branches.continue_orbit import continue_orbit
from vibroimpact.branches.point import BifurcationPoint
from vibroimpact.simulation.simulator import Simulator
from vibroimpact.tori.branch import CircleBranch
from vibroimpact.tori.circle import Circle
from vibroimpact.tori.continue_circle import STEPS, continue_circle
from vibroimpact.tori.find import find_circle
from vibroimpact_papers.impact_damper import ParameterSet
from vibroimpact_papers.impact_damper.datasets import attributes
from vibroimpact_papers.impact_damper.panel_results import PanelResult
from vibroimpact_papers.impact_damper.plan import Plan, damper_of
from vibroimpact_papers.impact_damper.planes import START, frequencies
from vibroimpact_papers.impact_damper.resonances import orbit_at

PHASES = 721  # of a circle in a file
BORN = 5.4e-5  # relative: distance of the first circle from the point where it is born
KEPT = 1500  # simulated points of a panel in a file
SETTLED, LONGEST, REPEATS = 40_000, 64, 1e-7  # impacts; half periods of a locked motion; relative


@dataclass(frozen=True, eq=False)
class Family:
    """The circles of a set along omega, and at the frequencies of the paper.

    Attributes
    ----------
    set
        Name of the set.
    branch
        The family, from where it is born to where it breaks.
    at_panels
        By panel the circle there, or why there is none.
    locked
        By panel without a circle the rotation number p/q of the locked motion there.
    """

    set: str
    branch: CircleBranch = field(repr=False)
    at_panels: Mapping[str, Circle] = field(repr=False)
    locked: Mapping[str, tuple[int, int]]

    @property
    def span(self) -> tuple[float, float]:
        """Return the range of omega of the family."""
        values = self.branch.values
        return float(values.min()), float(values.max())

    @property
    def leading(self) -> Floats:
        """Return the leading normal multiplier of each circle, with its sign; else its modulus."""
        first = [c.normal_multipliers[0] for c in self.branch.circles]
        return np.array([z.real if abs(z.imag) < 1e-12 else abs(z) for z in first])

    @property
    def least_angles(self) -> Floats:
        """Return sin of the least angle of each circle and its stable directions."""
        return np.array([c.least_angle for c in self.branch.circles])

    @property
    def end(self) -> str:
        """Return why the family ends at its lowest frequency."""
        first, last = self.branch.ends
        values = self.branch.values
        return str(first if values[0] < values[-1] else last)


def family_of(
    chosen: ParameterSet, results: Mapping[str, PanelResult], plan: Plan
) -> Family | None:
    """Find the circles at the panels of a set, and follow the smoothest. Cost: some 10 s."""
    names = [n for n, r in results.items() if r.panel.set == chosen.name]
    found = {n: find_circle(damper_of(chosen, results[n].omega), START) for n in names}
    smooth = [c for c in found.values() if c.converged and c.nodes <= plan.family_nodes]
    if not smooth:
        return None
    start = min(smooth, key=lambda c: c.nodes)
    shown = [*frequencies(chosen), *plan.sweeps[chosen.name].grid()]
    branch = continue_circle(
        start, "omega", (min(shown), max(shown)), most_nodes=plan.family_nodes, progress=False,
        steps=replace(
            STEPS, first=plan.family_step, least=plan.family_step / 10.0,
            largest=4.0 * plan.family_step, points=plan.family_points,
        ),
    )  # fmt: skip
    locked = {n: locked_at(chosen, results[n].omega) for n, c in found.items() if not c.converged}
    return Family(chosen.name, branch, found, {n: pq for n, pq in locked.items() if pq})


def locked_at(chosen: ParameterSet, omega: float) -> tuple[int, int] | None:
    """Return p/q of a periodic motion: q half periods, in which it goes round p times.

    p is the step from a point to its image in the order of the angles about the symmetric orbit.
    """
    damper = damper_of(chosen, omega)
    motion = Simulator(damper, START)
    motion.settle(SETTLED)
    part = motion.record(LONGEST + 1)
    sign = np.where(part.side > 0, 1.0, -1.0)
    x = np.column_stack([part.position[:, 0] * sign, part.velocity[:, 0] * sign])
    if len(x) <= LONGEST or np.any(part.side[1:] == part.side[:-1]):
        return None
    again = np.abs(x - x[0]).max(axis=1)
    returns = np.flatnonzero(again[1:] < REPEATS * np.abs(x).max())
    if not returns.size or returns[0] == 0:
        return None
    q = int(returns[0]) + 1
    state = orbit_at(chosen, omega, damper.half_clearance).state
    middle = np.array([state.position[0], state.velocity[0]])
    size = np.ptp(x[:q], axis=0)
    angles = np.arctan2(*((x[:q] - middle) / size).T)
    place = np.argsort(np.argsort(angles))
    steps = {int(step) for step in np.diff([*place, place[0]]) % q}
    return (min(p := steps.pop(), q - p), q) if len(steps) == 1 else None


def circle_fold(chosen: ParameterSet, critical: float, side: int) -> BifurcationPoint | None:
    """Return the fold in which circles born at a Neimark-Sacker point end, if they do nearby."""
    reach = critical * BORN
    low, high = critical - 80.0 * reach, critical + 80.0 * reach
    orbit = orbit_at(chosen, high, chosen.parameters.half_clearance)
    points = [p for p in continue_orbit(orbit, "omega", (low, high), inadmissible=True, progress=False).special_points
              if p.kind == "NS"]  # fmt: skip
    if not points:
        return None
    circle = find_circle(damper_of(chosen, critical + side * reach), points[0])
    if not circle.converged:
        return None
    bounds = critical - 8.0 * reach, critical + 8.0 * reach
    family = continue_circle(circle, "omega", bounds, most_nodes=101, progress=False,
                             steps=replace(STEPS, first=0.05, largest=0.15, points=14))  # fmt: skip
    return next((e for e in family.special_points if e.kind == "SN"), None)


# --- data -----------------------------------------------------------------------------------------


def family_data(
    family: Family, chosen: ParameterSet, results: Mapping[str, PanelResult], plan: Plan
) -> xr.Dataset:
    """Return a family with its circles at the panels and the simulated points there."""
    shown = [n for n, c in family.at_panels.items() if c.converged]
    phi = np.linspace(0.0, 1.0, PHASES)
    curves = np.array([family.at_panels[n].states(phi) for n in shown])
    clouds = [results[n].found[-1].points[:KEPT] for n in shown]
    most = max(len(c) for c in clouds)
    simulated = np.full((len(shown), most, 2), np.nan)
    for row, cloud in zip(simulated, clouds, strict=True):
        row[: len(cloud)] = cloud
    branch = family.branch
    return xr.Dataset(
        {
            "circle": (("panel", "phi", "coordinate"), curves[..., [0, 2]]),
            "simulated": (("panel", "point", "coordinate"), simulated),
            "panel_omega": ("panel", [results[n].omega for n in shown]),
            "panel_rotation": ("panel", [family.at_panels[n].rotation_number for n in shown]),
            "rotation": ("circle_omega", branch.rotation_numbers),
            "leading": ("circle_omega", family.leading),
            "least_angle": ("circle_omega", family.least_angles),
            "roughness": ("circle_omega", [c.roughness for c in branch.circles]),
            "locked_omega": ("lock", [results[n].omega for n in family.locked]),
            "locked_p": ("lock", [p for p, _ in family.locked.values()]),
            "locked_q": ("lock", [q for _, q in family.locked.values()]),
        },
        coords={"panel": shown, "phi": phi, "circle_omega": branch.values,
                "coordinate": ["x1", "v1"]},
        attrs=attributes(f"families-{family.set}", chosen, plan),
    )  # fmt: skip
