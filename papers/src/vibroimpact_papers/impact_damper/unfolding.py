"""The neighbourhood of a strong resonance 1:4 or 1:3: portraits predicted and simulated, sector by sector.

Method      theory: the flow of unfolding_flows.py by Runge-Kutta steps; simulation: every fourth or
            third iterate of the half map H, started on the centre manifold and brought back to z
            by its second-order terms
"""

from __future__ import annotations

import cmath
import math
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
import xarray as xr

from vibroimpact._core.types import Complexes, Floats
from vibroimpact.bifurcations.curve import BifurcationCurve, CodimensionTwoPoint
from vibroimpact.bifurcations.switch_curve import switch_curve
from vibroimpact.closed_forms.symmetric_orbits import SymmetricOrbit
from vibroimpact.continuation import Steps
from vibroimpact.normal_forms.strong_resonance import OneToFour, OneToThree
from vibroimpact.simulation.simulator import Simulator
from vibroimpact_papers.impact_damper import ParameterSet
from vibroimpact_papers.impact_damper.datasets import attributes
from vibroimpact_papers.impact_damper.plan import Plan
from vibroimpact_papers.impact_damper.resonances import AXES, orbit_at
from vibroimpact_papers.impact_damper.unfolding_flows import Flow, Place, along, flow_at, solutions

REACH = 1.6  # half-width of the window of both parameters, in those of the sectors
STEP = 1e-6  # relative, of differences in the parameters
RADII = (0.12, 0.75, 1.6)  # of starts, in units of the flow
ANGLES = 4  # of starts on each radius, within a quarter or a third of a turn
FOLDS = Steps(first=0.3, largest=4.0, tolerance=1e-3, points=200)  # for a picture
BEYOND_WINDOW = 4.0  # fold curves are followed so many windows far
PARTS = 500  # points of a trajectory
BEYOND = 3.0  # a trajectory ends where |z| exceeds so many units


@dataclass(frozen=True, eq=False)
class Sector:
    """One sector around the point: its parameters and trajectories, shape (starts, PARTS)."""

    words: str
    mu: complex
    omega: float
    half_clearance: float
    predicted: Complexes = field(repr=False)
    simulated: Complexes = field(repr=False)
    periodic: Complexes = field(repr=False)


@dataclass(frozen=True, eq=False)
class Unfolded:
    """A resonance with its sectors, and the fold curves that begin there."""

    set: str
    point: CodimensionTwoPoint
    flow: Flow
    sectors: tuple[Sector, ...]
    folds: tuple[BifurcationCurve, ...] = field(repr=False)


def unfolded(chosen: ParameterSet, point: CodimensionTwoPoint) -> Unfolded:
    """Return the portraits around a point. Cost: some seconds."""
    form = point.normal_form
    assert isinstance(form, OneToFour | OneToThree)
    flow = flow_at(form)
    made = tuple(_sector(chosen, point, flow, place) for place in flow.places())
    folds: tuple[BifurcationCurve, ...] = ()
    if isinstance(form, OneToFour) and form.folds_exist:
        at = [point.parameters[name] for name in AXES]
        w, h = (BEYOND_WINDOW * half for half in reach(at, made))
        bounds = (at[0] - w, at[0] + w), (at[1] - h, at[1] + h)
        switched = switch_curve(point, bounds, steps=FOLDS)
        folds = switched if isinstance(switched, tuple) else ()
    return Unfolded(chosen.name, point, flow, made, folds)


def reach(at: Sequence[float], made: Sequence[Sector]) -> tuple[float, float]:
    """Return the half-widths of the window around a point."""
    away = np.abs(np.array([[s.omega, s.half_clearance] for s in made]) - at).max(axis=0)
    return REACH * float(away[0]), REACH * float(away[1])


def parameters_at(
    chosen: ParameterSet, start: Sequence[float], root: complex, mu: complex
) -> tuple[float, float]:
    """Return omega and half_clearance at which log(nu / root) is mu, by Newton's method."""
    a = np.array(start)
    for _ in range(20):
        here = mu_at(chosen, root, *a)
        slopes = [(mu_at(chosen, root, *(a + step)) - here) / step.sum()
                  for step in np.diag(STEP * a)]  # fmt: skip
        matrix = np.array([[s.real for s in slopes], [s.imag for s in slopes]])
        change = np.linalg.solve(matrix, [(mu - here).real, (mu - here).imag])
        a = a + change
        if np.all(np.abs(change) < 1e-13 * np.abs(a)):
            break
    return float(a[0]), float(a[1])


def mu_at(chosen: ParameterSet, root: complex, omega: float, clearance: float) -> complex:
    """Return log(nu / root) of the multiplier next to a root of one."""
    nus = orbit_at(chosen, omega, clearance).half_multipliers
    return cmath.log(complex(nus[np.argmin(np.abs(nus - root))]) / root)


def iterated(
    form: OneToFour | OneToThree,
    orbit: SymmetricOrbit,
    z: complex,
    every: int,
    count: int,
    limit: float,
) -> Complexes:
    """Return z of every so-many-th iterate of the half map from a start on the centre manifold."""
    at = orbit.state
    middle = np.array([at.position[0], *at.velocity, at.phase])
    x1, v1, v2, phase = map(float, middle + form.points(np.array([z]))[0])
    start = orbit.damper.on_stop("A", x1=x1, v1=v1, v2=v2, phase=phase % (2.0 * math.pi))
    part = Simulator(orbit.damper, start).record(every * (count - 1))
    sign = np.where(part.side > 0, 1.0, -1.0)[:, None]
    turned = part.phase + np.where(part.side > 0, 0.0, math.pi)
    x = np.column_stack([part.position[:, :1] * sign, part.velocity * sign, turned]) - middle
    x[:, 3] = np.remainder(x[:, 3] + math.pi, 2.0 * math.pi) - math.pi
    found = np.full(count, np.nan + 0j)
    kept = x[every - 1 :: every]
    found[0], found[1 : 1 + len(kept)] = z, coordinate_of(form, kept)
    gone = np.flatnonzero(np.abs(found) > limit)
    if gone.size:
        found[gone[0] :] = np.nan
    return found


def coordinate_of(form: OneToFour | OneToThree, x: Floats) -> Complexes:
    """Return z of displacements from the fixed point."""
    linear: Complexes = x @ form.p.conj()
    z = linear
    for _ in range(4):
        bent = np.real(np.outer(z**2, form.h20)) + np.outer(np.abs(z) ** 2, form.h11)
        z = linear - bent @ form.p.conj()
    return z


def _sector(
    chosen: ParameterSet, point: CodimensionTwoPoint, flow: Flow, place: Place
) -> Sector:  # fmt: skip
    words, mu = place
    start = [point.parameters[name] for name in AXES]
    omega, clearance = parameters_at(chosen, start, flow.root, mu)
    orbit = orbit_at(chosen, omega, clearance)
    q, limit = flow.order, BEYOND * flow.unit
    turn = np.exp(1j * (2.0 * math.pi / q) * np.arange(q * ANGLES) / ANGLES)
    starts = np.concatenate([r * flow.unit * turn for r in RADII])
    every = q * max(1, round(flow.length / flow.size / PARTS / q))
    predicted = solutions(flow, mu, starts, float(every), PARTS, limit)
    part = [r * flow.unit * turn[:ANGLES] for r in RADII]
    runs = [iterated(flow.form, orbit, complex(z), every, PARTS, limit)
            for z in np.concatenate(part)]  # fmt: skip
    # The half map commutes with no turn by the root; the q points of an orbit are shown by turning it.
    simulated = np.array([run * flow.root**k for run in runs for k in range(q)])
    return Sector(words, mu, omega, clearance, predicted, simulated, flow.periodic(mu))


# --- data -----------------------------------------------------------------------------------------


def unfolding_data(one: Unfolded, number: int, chosen: ParameterSet, plan: Plan) -> xr.Dataset:
    """Return the portraits, and the curves in the window around the point."""
    at = np.array([one.point.parameters[name] for name in AXES])
    flow = one.flow
    lines = [_line(chosen, one, mus) for mus in flow.lines()]
    torus = [_line(chosen, one, along(flow.size, d)) for d in (1j, -1j)]  # mu imaginary: exact
    scaled = flow.form.scaled
    z = ("sector", "start", "time")
    return xr.Dataset(
        {
            "words": ("sector", [s.words for s in one.sectors]),
            "mu_real": ("sector", [s.mu.real for s in one.sectors]),
            "mu_imag": ("sector", [s.mu.imag for s in one.sectors]),
            "sector_at": (("sector", "parameter"),
                          [[s.omega, s.half_clearance] for s in one.sectors]),
            "predicted_real": (z, _stacked([s.predicted.real for s in one.sectors])),
            "predicted_imag": (z, _stacked([s.predicted.imag for s in one.sectors])),
            "simulated_real": (z, _stacked([s.simulated.real for s in one.sectors])),
            "simulated_imag": (z, _stacked([s.simulated.imag for s in one.sectors])),
            "periodic_real": (("sector", "point"), _periodic(one, "real")),
            "periodic_imag": (("sector", "point"), _periodic(one, "imag")),
            "torus": (("on_torus", "parameter"), _joined(torus)),
            "folds": (("on_fold", "parameter"), _joined([c.values for c in one.folds])),
            "half_lines": (("on_line", "parameter"), _joined(lines)),
        },
        coords={"parameter": list(AXES)},
        attrs=attributes(f"unfolding-{one.set}-{number}", chosen, plan)
        | {"point_omega": float(at[0]), "point_half_clearance": float(at[1]),
           "resonance": f"1:{flow.order}", "scaled_real": scaled.real, "scaled_imag": scaled.imag,
           "unit": flow.unit, "size_of_mu": flow.size},
    )  # fmt: skip


def _line(chosen: ParameterSet, one: Unfolded, mus: Complexes) -> Floats:
    """Return the parameters at values of mu, from the point on."""
    rows = [tuple(one.point.parameters[name] for name in AXES)]
    for mu in mus:
        rows.append(parameters_at(chosen, rows[-1], one.flow.root, complex(mu)))
    return np.array(rows)


def _joined(parts: Sequence[Floats]) -> Floats:
    """Join curves with a gap between them."""
    gap = np.full((1, 2), np.nan)
    return np.concatenate([rows for part in parts for rows in (part, gap)] or [gap])


def _stacked(parts: Sequence[Floats]) -> Floats:
    return np.array(parts, dtype=np.float32).astype(np.float64)


def _periodic(one: Unfolded, part: str) -> Floats:
    """Return the points of period four or three of every sector, at most eight."""
    found = np.full((len(one.sectors), 8), np.nan)
    for row, sector in zip(found, one.sectors, strict=True):
        row[: len(sector.periodic)] = getattr(sector.periodic, part)
    return found
