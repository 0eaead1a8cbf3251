"""The true strong resonances of each set: bifurcation curves in the plane of two parameters.

A resonance is a point in the plane (omega, half_clearance); along the frequency alone it is only
passed nearby. The curves are those of the symmetric orbit, whose resonances are those of its half
map, with multipliers nu.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
import xarray as xr
from matplotlib.path import Path

from vibroimpact.bifurcations.augmented import Bounds
from vibroimpact.bifurcations.continue_bifurcation import continue_bifurcation
from vibroimpact.bifurcations.curve import BifurcationCurve
from vibroimpact.bifurcations.tongue import Tongue, tongue
from vibroimpact.bifurcations.tongue_region import region_of
from vibroimpact.branches.continue_orbit import continue_orbit
from vibroimpact.branches.point import BifurcationPoint
from vibroimpact.continuation import Steps
from vibroimpact.orbits.orbit import Orbit
from vibroimpact.results.files import dataset_of, result_of
from vibroimpact.sweeps.analyses.plane import plane
from vibroimpact_papers.impact_damper import ParameterSet
from vibroimpact_papers.impact_damper.datasets import attributes
from vibroimpact_papers.impact_damper.plan import BRANCH, Plan, damper_of
from vibroimpact_papers.impact_damper.planes import REACH, START, frequencies
from vibroimpact_papers.impact_damper.symmetric_bifurcations import (
    Bifurcation,
    nus_of,
    orbits_by_sign,
)
from vibroimpact_papers.judged import Claim

AXES = ("omega", "half_clearance")
FOLLOWED = ("NS", "SN", "BP")
ANGLES = {"R1": 0.0, "R2": 180.0, "R3": 120.0, "R4": 90.0}  # of nu, in degrees
# Points are exact whatever the tolerance: these are wide enough for pictures.
CURVES = Steps(first=0.1, largest=2.0, tolerance=1e-6, points=600)
SIDES = Steps(first=0.3, largest=4.0, tolerance=1e-3, points=600)  # of tongues
MET = 1e-3  # of the range of both parameters: a side meets a tip
SAME = 5e-4  # relative: two points of one kind at one clearance


@dataclass(frozen=True, eq=False)
class Resonances:
    """Bifurcation curves of the symmetric orbit of a set, over a plane of simulated motions.

    Attributes
    ----------
    set
        Name of the set.
    bounds
        Ranges of omega and half_clearance.
    curves
        Neimark-Sacker, fold and symmetry-breaking curves that cross the clearance of the set.
    plane
        Motions on a grid of both parameters.
    tongues
        Tongues of locked orbits that begin on the Neimark-Sacker curves.
    """

    set: str
    bounds: tuple[Bounds, Bounds]
    curves: tuple[BifurcationCurve, ...] = field(repr=False)
    plane: xr.Dataset = field(repr=False)
    tongues: tuple[Tongue, ...] = field(repr=False, default=())

    @property
    def torus(self) -> tuple[BifurcationCurve, ...]:
        """Return the Neimark-Sacker curves."""
        return tuple(c for c in self.curves if c.kind == "NS")

    @cached_property
    def strong(self) -> tuple[BifurcationPoint, ...]:
        """Return the strong resonances of the half map, on Neimark-Sacker curves."""
        found = (p for c in self.torus for p in c.special_points if p.kind in ANGLES)
        return tuple(sorted(found, key=lambda p: (p.kind, *p.parameters.values())))

    @property
    def angles(self) -> tuple[float, float]:
        """Return the least and the largest angle of nu on the curves, in degrees."""
        every = np.concatenate([360.0 * c.angle[~c.neutral] for c in self.torus])
        return float(np.nanmin(every)), float(np.nanmax(every))

    def named(self, kind: str, omega: float) -> BifurcationPoint | None:
        """Return the strong resonance of a kind that is nearest to a frequency."""
        of_kind = [p for p in self.strong if p.kind == kind]
        return min(of_kind, key=lambda p: abs(p.parameters["omega"] - omega), default=None)

    def other_tips(self, one: Tongue) -> list[BifurcationPoint]:
        """Return the weak resonances other than the tip that a side of a tongue meets."""
        return other_tips(one, self.curves, self.bounds)

    def between_sides(self, one: Tongue) -> list[str]:
        """Return the motion of every machine of the plane between the sides of a tongue."""
        motion = self.plane["motion"].transpose(*AXES)
        names = dict(
            zip(motion.attrs["flag_values"], motion.attrs["flag_meanings"].split(), strict=True)
        )
        places = np.stack(np.meshgrid(*(motion[name].values for name in AXES), indexing="ij"), -1)
        inside = Path(region_of(one).corners).contains_points(places.reshape(-1, 2))
        return [names[code] for code in motion.values.ravel()[inside]]


@dataclass(frozen=True, slots=True)
class Distance:
    """Distance of a bifurcation point of the paper from the nearest strong resonance.

    Attributes
    ----------
    set, what
        Set, and "printed" or "computed".
    omega, half_clearance
        The point.
    angle
        Angle of nu there, in degrees; NaN where the pair is real.
    nearest
        The resonance that is nearest in relative parameters; None without one in the plane.
    by_angle
        "R1" to "R4", whose angle is nearest, and how far away it is, in degrees.
    """

    set: str
    what: str
    omega: float
    half_clearance: float
    angle: float
    nearest: BifurcationPoint | None
    by_angle: tuple[str, float]

    @property
    def in_omega(self) -> float:
        """Return omega of the resonance minus that of the point."""
        return self.nearest.parameters["omega"] - self.omega if self.nearest else math.nan

    @property
    def in_clearance(self) -> float:
        """Return half_clearance of the resonance minus that of the point."""
        at = self.nearest.parameters["half_clearance"] if self.nearest else math.nan
        return at - self.half_clearance

    @property
    def relative(self) -> float:
        """Return the distance in both parameters, each relative to its value at the point."""
        return math.hypot(self.in_omega / self.omega, self.in_clearance / self.half_clearance)


def resonances_of(chosen: ParameterSet, plan: Plan) -> Resonances:
    """Follow every curve of a set, and compute its plane. Cost: some 10 s."""
    own = chosen.parameters.half_clearance
    bounds = plan.strong[chosen.name], (REACH[0] * own, REACH[1] * own)
    curves = tuple(_curves(chosen, bounds))
    tongues = tuple(_tongues(curves, bounds, plan.tongues.get(chosen.name, ())))
    return Resonances(chosen.name, bounds, curves, _plane(chosen, bounds, plan), tongues)


def _tongues(
    curves: Sequence[BifurcationCurve], bounds: tuple[Bounds, Bounds],
    wanted: Sequence[tuple[int, int]],
) -> Iterator[Tongue]:  # fmt: skip
    """Follow the tongue of every weak resonance that is wanted, one with two tips from the first."""
    done: set[BifurcationPoint] = set()
    for point in _weak(curves):
        if point.resonance in wanted and point not in done:
            found = tongue(point, steps=SIDES, progress=False)
            if isinstance(found, Tongue):
                done.update(other_tips(found, curves, bounds))
                yield found


def _weak(curves: Iterable[BifurcationCurve]) -> Iterator[BifurcationPoint]:
    """Yield the weak resonances on Neimark-Sacker curves."""
    yield from (p for c in curves if c.kind == "NS" for p in c.special_points if p.kind == "WEAK")


def other_tips(
    one: Tongue, curves: Sequence[BifurcationCurve], bounds: tuple[Bounds, Bounds]
) -> list[BifurcationPoint]:
    """Return the weak resonances of the same angle, but the tip, that a side meets.

    It may end there, or go on as a side of the tongue that begins there.
    """
    spans = np.ptp(np.array(bounds), axis=1)
    passed = np.concatenate([side.values for side in one.sides])

    def met(point: BifurcationPoint) -> bool:
        at = np.array([point.parameters[name] for name in AXES])
        return bool((np.abs(passed - at) < MET * spans).all(axis=1).any())

    return [p for p in _weak(curves)
            if p.resonance == one.resonance and p is not one.tip and met(p)]  # fmt: skip


def _curves(chosen: ParameterSet, bounds: tuple[Bounds, Bounds]) -> list[BifurcationCurve]:
    """Follow a curve through each bifurcation point at the clearance of the set.

    Folds that do not pass that clearance are followed from where they meet a Neimark-Sacker curve.
    """
    own = chosen.parameters.half_clearance
    known = min(max(frequencies(chosen)), bounds[0][1])  # the orbit exists at the paper's sections
    branch = continue_orbit(
        orbit_at(chosen, known, own), "omega", bounds[0], inadmissible=True, progress=False
    )
    found: list[BifurcationCurve] = []
    for point in branch.special_points:
        if point.kind not in FOLLOWED:
            continue
        passed = (w for c in found if c.kind == point.kind for w in _crossings(c, own))
        if not any(abs(w / point.parameter - 1.0) < SAME for w in passed):
            found.append(continue_bifurcation(point, AXES, bounds, steps=CURVES, progress=False))
    meetings = [p for c in found if c.kind == "NS" for p in c.special_points if p.kind == "LPNS"]
    if meetings and not any(c.kind == "SN" for c in found):
        found.append(
            continue_bifurcation(meetings[0], AXES, bounds, kind="SN", steps=CURVES, progress=False)
        )
    return found


def _crossings(curve: BifurcationCurve, clearance: float) -> Iterable[float]:
    """Yield the frequencies at which a curve passes a clearance, linear between its points."""
    omega, at = curve.values.T
    for i in np.flatnonzero((at[1:] - clearance) * (at[:-1] - clearance) <= 0.0):
        share = (clearance - at[i]) / (at[i + 1] - at[i]) if at[i + 1] != at[i] else 0.0
        yield float(omega[i] + share * (omega[i + 1] - omega[i]))


def _plane(chosen: ParameterSet, bounds: tuple[Bounds, Bounds], plan: Plan) -> xr.Dataset:
    across, up = plan.strong_points
    return plane(
        damper_of(chosen, bounds[0][0]),
        over={"omega": np.linspace(*bounds[0], across),
              "half_clearance": np.linspace(*bounds[1], up)},
        start=START, settle_periods=plan.plane_settle, periods=plan.plane_periods, progress=False,
    )[["motion"]]  # fmt: skip


# --- distances ------------------------------------------------------------------------------------


def distances(
    found: Resonances, chosen: ParameterSet, claims: Sequence[Claim],
    points: Sequence[Bifurcation],
) -> tuple[Distance, ...]:  # fmt: skip
    """Return how far the printed and the computed bifurcation points of a set are from resonance."""
    computed = [b.omega for b in points if b.kind == "NS" and b.admissible]
    rows = [("printed", w) for w in printed_omegas(chosen.name, claims)]
    rows += [("computed", w) for w in computed]
    return tuple(_distance(found, chosen, what, omega) for what, omega in rows)


def printed_omegas(name: str, claims: Sequence[Claim]) -> list[float]:
    """Return the printed critical frequencies of a set."""
    printed = (
        c.printed["omega"] for c in claims if c.kind == "neimark_sacker_omega" and c.set == name
    )
    return [omega for omega in printed if isinstance(omega, float)]


def _distance(found: Resonances, chosen: ParameterSet, what: str, omega: float) -> Distance:
    own = chosen.parameters.half_clearance
    angle = half_angle(orbit_at(chosen, omega, own))
    here = np.array([omega, own])

    def away(p: BifurcationPoint) -> float:
        at = np.array([p.parameters[name] for name in AXES])
        return float(np.linalg.norm((at - here) / here))

    nearest = min(found.strong, key=away, default=None)
    return Distance(found.set, what, omega, own, angle, nearest, nearest_by_angle(angle))


def nearest_by_angle(degrees: float) -> tuple[str, float]:
    """Return the strong resonance whose angle is nearest to one of nu, and how far away it is, in degrees."""
    away = {kind: abs(abs(degrees) - angle) for kind, angle in ANGLES.items()}
    kind = min(away, key=away.__getitem__)
    return kind, away[kind]


def orbit_at(chosen: ParameterSet, omega: float, clearance: float) -> Orbit:
    """Return the orbit of the paper's branch at a point of the plane."""
    damper = replace(damper_of(chosen, omega), half_clearance=clearance)
    return orbits_by_sign(damper)[BRANCH]


def half_angle(orbit: Orbit) -> float:
    """Return the angle of the outermost complex pair of nu, in degrees; NaN without a pair."""
    upper = [complex(v) for v in nus_of(orbit) if v.imag > 0.0]
    return math.degrees(np.angle(max(upper, key=abs))) if upper else math.nan


# --- data -----------------------------------------------------------------------------------------


def resonance_data(
    found: Resonances, chosen: ParameterSet, plan: Plan, claims: Sequence[Claim],
) -> tuple[xr.Dataset, ...]:  # fmt: skip
    """Return the plane with the frequencies of the paper, and one dataset for each curve."""
    figure = f"strong-{found.set}"
    data = found.plane.copy()
    shown = [w for w in frequencies(chosen) if found.bounds[0][0] <= w <= found.bounds[0][1]]
    data["paper_omega"] = "panel", shown
    data["printed_omega"] = "claim", printed_omegas(found.set, claims)
    data.attrs = attributes(figure, chosen, plan) | {
        "start_position": list(START.position),
        "start_velocity": list(START.velocity),
        "start_phase": START.phase,
    }
    curves = [curve_data(c, f"{figure}-{i}", chosen, plan) for i, c in numbered(found.curves)]
    sides = [
        curve_data(side, f"{figure}-tongue{i}{letter}", chosen, plan).assign_attrs(
            tongue=one.tip.label, radius=one.radius
        )
        for i, one in enumerate(found.tongues, 1)
        for letter, side in zip("ab", one.sides, strict=True)
    ]
    return data, *curves, *sides


def tongues_from(
    curves: Sequence[BifurcationCurve], sides: Sequence[xr.Dataset]
) -> Iterator[Tongue]:
    """Yield the tongues of files: each tip is on one of the curves, both sides follow one another."""
    tips = {p.label: p for c in curves if c.kind == "NS" for p in c.special_points}
    for first, second in zip(sides[::2], sides[1::2], strict=True):
        yield Tongue(
            tips[str(first.attrs["tongue"])],
            (result_of(first), result_of(second)),
            float(first.attrs["radius"]),
        )


def numbered(curves: Sequence[BifurcationCurve]) -> Iterable[tuple[str, BifurcationCurve]]:
    """Yield the kind of each curve with its number among those of its kind."""
    for i, curve in enumerate(curves):
        number = sum(c.kind == curve.kind for c in curves[: i + 1])
        yield f"{curve.kind}{number}", curve


def curve_data(curve: BifurcationCurve, name: str, chosen: ParameterSet, plan: Plan) -> xr.Dataset:
    """Return a curve as the library stores it, with the attributes of every file."""
    data = dataset_of(curve)
    kept = dict(data.attrs)
    data.attrs = attributes(name, chosen, plan) | kept
    return data
