"""Plan of the figures: every start, step, settling time and number of points, in one place."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from types import MappingProxyType

import numpy as np
from numpy.typing import NDArray

from vibroimpact.machines.impact_damper import ImpactDamper
from vibroimpact_papers.impact_damper import ParameterSet

BRANCH = 1  # sign in (14) of the orbits that are stable somewhere: the branch of the paper
STARTS = ("down", "up", "fixed point")


@dataclass(frozen=True, slots=True)
class Sweep:
    """Values of omega along which the attractor of one set is followed."""

    low: float
    high: float
    step: float

    def grid(self, more: tuple[float, ...] = ()) -> NDArray[np.float64]:
        """Return the steps and the frequencies of the panels, increasing."""
        count = round((self.high - self.low) / self.step)
        steps = np.round(self.low + self.step * np.arange(count + 1), 12)
        return np.union1d(steps, [omega for omega in more if self.low <= omega <= self.high])


@dataclass(frozen=True, slots=True)
class Plan:
    """Numbers that determine the figures; none of them is fitted to the paper.

    Attributes
    ----------
    sweeps
        Range and step of omega for each set. Each range holds every panel of the set and the
        ends of the circles.
    sweep_settle, sweep_points
        Impacts discarded and section points kept at each step.
    panel_settle, panel_max_settle, panel_points
        First and longest settling, and points, of the classification of a panel, which starts from
        the state that the sweep reached.
    perturbation
        Radians added to the phase of the theoretical fixed point.
    path_points
        Frequencies along a path of multipliers.
    circle_offsets, circle_settle, circle_points
        Distances from each Neimark-Sacker point at which the circle is measured, waiting in times
        in which a deviation from it falls by e, and impacts measured.
    plane_points, plane_settle, plane_periods
        Grid of the plane (omega, half_clearance) of each set; forcing periods settled and observed
        there and in the basins.
    strong, strong_points
        Range of omega and grid of the plane with the curves of bifurcations, for each set in it.
    family_nodes, family_points, family_step
        Most nodes of a circle of a family, most circles each way, and the first step, as a share
        of the range.
    tongues
        Weak resonances p/q of which the tongues are followed, for each set.
    unfolded
        Set, kind and approximate frequency of the strong resonances that are unfolded.
    spectrum_points, spectrum_impacts
        Frequencies along a route at which all Lyapunov exponents are estimated, and impacts.
    basin_points, basin_settle
        Starts along each side of the basins, and forcing periods settled.
    transient_starts, transient_periods
        Grid of starts at Fig. 4(f); forcing periods after which those that have not settled are
        counted.
    figures
        Figures of the paper to make.
    """

    sweeps: Mapping[str, Sweep] = field(
        default_factory=lambda: MappingProxyType(
            {
                "A": Sweep(0.92, 1.2, 0.001),
                "B": Sweep(0.92, 1.03, 0.0005),
                "C": Sweep(0.41, 0.448, 0.0002),
            }
        )
    )
    sweep_settle: int = 4000
    sweep_points: int = 300
    panel_settle: int = 8000
    panel_max_settle: int = 512_000
    panel_points: int = 4000
    perturbation: float = 0.01
    path_points: int = 301
    circle_offsets: int = 5
    circle_settle: float = 7.0
    circle_points: int = 4000
    plane_points: tuple[int, int] = (220, 150)
    plane_settle: float = 400.0
    plane_periods: float = 50.0
    strong: Mapping[str, tuple[float, float]] = field(
        default_factory=lambda: MappingProxyType(
            {"A": (0.6, 1.2), "B": (0.65, 1.25), "C": (0.355, 0.53)}
        )
    )
    strong_points: tuple[int, int] = (200, 150)
    family_nodes: int = 255
    family_points: int = 14
    family_step: float = 0.03
    tongues: Mapping[str, tuple[tuple[int, int], ...]] = field(
        default_factory=lambda: MappingProxyType({"A": ((2, 9), (1, 5)), "B": ((1, 5),)})
    )
    unfolded: tuple[tuple[str, str, float], ...] = (
        ("A", "R4", 0.978),
        ("A", "R4", 0.928),
        ("C", "R4", 0.413),
        ("C", "R3", 0.445),
        ("C", "R2", 0.4999),
        ("C", "R1", 0.3622),
    )
    spectrum_points: int = 28
    spectrum_impacts: int = 1500
    basin_points: int = 120
    basin_settle: float = 2000.0
    transient_starts: tuple[int, int] = (20, 15)
    transient_periods: tuple[int, ...] = (1400, 10_000, 20_000)
    figures: tuple[str, ...] = ("2", "3", "4", "5")

    @property
    def classification(self) -> dict[str, int]:
        """Return the arguments of `classify`."""
        return {
            "settle_events": self.panel_settle,
            "most_settle_events": self.panel_max_settle,
            "points": self.panel_points,
        }

    def attributes(self) -> dict[str, str | int | float]:
        """Return the numbers for the attributes of a dataset."""
        return {
            "start_down": "theoretical fixed point at the highest omega, perturbed",
            "start_up": "last state of the way down, at the lowest omega",
            "start_fixed_point": "theoretical fixed point at the omega of the panel, perturbed",
            "perturbation_of_phase": self.perturbation,
            "sweep_settle_impacts": self.sweep_settle,
            "sweep_points": self.sweep_points,
            **{f"panel_{key}": value for key, value in self.classification.items()},
            "circle_offsets": self.circle_offsets,
            "circle_settle": self.circle_settle,
            "circle_points": self.circle_points,
            "plane_points": "{} x {}".format(*self.plane_points),
            "plane_settle_periods": self.plane_settle,
            "plane_periods": self.plane_periods,
            "strong_points": "{} x {}".format(*self.strong_points),
            "family_nodes": self.family_nodes,
            "family_points": self.family_points,
            "family_step": self.family_step,
            "spectrum_points": self.spectrum_points,
            "spectrum_impacts": self.spectrum_impacts,
            "basin_points": self.basin_points,
            "basin_settle_periods": self.basin_settle,
            "transient_starts": "{} x {}".format(*self.transient_starts),
            "transient_periods": ", ".join(map(str, self.transient_periods)),
            **{
                f"sweep_{name}": f"[{s.low}, {s.high}] in steps of {s.step}"
                for name, s in self.sweeps.items()
            },
            **{f"strong_{name}": f"[{low}, {high}]" for name, (low, high) in self.strong.items()},
        }


def damper_of(chosen: ParameterSet, omega: float) -> ImpactDamper:
    """Return the damper of a set at a frequency."""
    return ImpactDamper(**asdict(chosen.parameters), omega=omega)
