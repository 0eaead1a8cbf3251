"""Atlas: all curves of bifurcations that can be reached from one orbit in the plane of two parameters.

Method      branches of the orbit along both parameters, with those with which they go on, give the first
            bifurcations; every one that is not on a curve
            already is followed; from points of codimension two the other curves of the same orbit through the point,
            and those that begin there (switch_curve.py), are followed in turn, level by level
            A solution is on a curve if it or one of its images, brought to the chord of the two nearest points, lies
            within DISTANCE_OF_CHORD of the chord's length                                          (1)
            Points of two curves are one where their parameters agree to
            SAME_PARAMETERS_OF_RANGE of the ranges and their names fit                             (2)
Assumes     what curves and switching assume. Curves that none of this reaches (isolas, orbits of other families) are
            not in the atlas
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field

import numpy as np

from vibroimpact._core.checks import check_count, check_flag, check_kind, check_progress
from vibroimpact._core.errors import InvalidParameterError
from vibroimpact._core.lazy import xr
from vibroimpact._core.progress import ProgressOption, ProgressReport, Reporter, interruptible
from vibroimpact._core.types import Floats
from vibroimpact.bifurcations.augmented import Bounds
from vibroimpact.bifurcations.continue_bifurcation import (
    continue_bifurcation,
    names_of_two,
    ranges,
)
from vibroimpact.bifurcations.curve import BifurcationCurve, of_curves, with_units_of
from vibroimpact.bifurcations.emanating import uninterrupted
from vibroimpact.bifurcations.kinds import WEAK
from vibroimpact.bifurcations.of_orbits import OrbitPlane
from vibroimpact.bifurcations.switch_curve import switch_curve
from vibroimpact.branches.continue_orbit import continue_orbit
from vibroimpact.branches.kinds import BP
from vibroimpact.branches.point import BifurcationPoint, NotFound
from vibroimpact.continuation import Steps
from vibroimpact.model.parameters import parameter_value
from vibroimpact.normal_forms.kind import PointKind
from vibroimpact.orbits.find import converged
from vibroimpact.orbits.orbit import Orbit
from vibroimpact.results.result import Result

DISTANCE_OF_CHORD = 0.1  # this is the distance of (1), relative to the length of the chord
# This is the distance of (2), relative to the ranges of the parameters.
SAME_PARAMETERS_OF_RANGE = 1e-6


@dataclass(frozen=True, eq=False)
class Atlas(Result):
    """Curves of bifurcations in the plane of two parameters, and the points at which they meet.

    Attributes
    ----------
    names, bounds
        The two parameters and their ranges.
    curves
        :class:`BifurcationCurve`, those of the orbit itself first.
    failures
        Sentences: points at which a curve that theory knows was not found.
    complete
        Whether the search ended by itself: not by an interruption or at its greatest number of curves.
    """

    names: tuple[str, str]
    bounds: tuple[Bounds, Bounds]
    curves: tuple[BifurcationCurve, ...] = field(repr=False)
    failures: tuple[str, ...] = field(repr=False)
    complete: bool

    @property
    def points(self) -> tuple[tuple[tuple[int, BifurcationPoint], ...], ...]:
        """Points of codimension two in order of the first parameter: each as (number of the curve, its point there).

        Those that several curves share occur once, with the point on every one of them.
        """
        found: list[list[tuple[int, BifurcationPoint]]] = []
        for k, curve in enumerate(self.curves):
            for point in curve.special_points:
                known = next((item for item in found if self._same(item[0][1], point)), None)
                if known:
                    known.append((k, point))
                else:
                    found.append([(k, point)])
        return tuple(tuple(item) for item in sorted(found, key=lambda item: self._at(item[0][1])))

    def _at(self, point: BifurcationPoint) -> tuple[float, float]:
        return point.parameters[self.names[0]], point.parameters[self.names[1]]

    def _same(self, first: BifurcationPoint, second: BifurcationPoint) -> bool:
        """Condition (2)."""
        widths = [high - low for low, high in self.bounds]
        near = all(
            abs(a - b) <= SAME_PARAMETERS_OF_RANGE * width
            for a, b, width in zip(self._at(first), self._at(second), widths, strict=True)
        )
        return near and first.record == second.record

    def to_dataset(self) -> xr.Dataset:
        """Convert to one xarray dataset: points and special points of all curves, with the number of the curve."""
        data = super().to_dataset().assign(of_curves(self.curves, self.names))
        data = with_units_of(self.curves, self.names, data)
        data = data.assign(curve_orbit=("curves", [_symbol(curve) for curve in self.curves]))
        return data.assign_attrs(failures="\n".join(self.failures))

    def __len__(self) -> int:
        return len(self.curves)

    def __repr__(self) -> str:
        end = "" if self.complete else ", not complete"
        lines = [f"Atlas of {len(self)} curves in {self.names[0]} and {self.names[1]}{end}"]
        lines += [
            f"  {k}: {curve.kind} of {_symbol(curve)}, {len(curve.special_points)} special points"
            for k, curve in enumerate(self.curves)
        ]
        lines += [
            f"  {item[0][1].kind} at {', '.join(f'{x:.9g}' for x in self._at(item[0][1]))}: curves "
            + ", ".join(str(k) for k, _ in item)
            for item in self.points
            if item[0][1].record != WEAK
        ]
        return "\n".join([*lines, *(f"  {failure}" for failure in self.failures)])


def _symbol(curve: BifurcationCurve) -> str:
    symbol: str = curve.orbit(0).symbol
    return symbol


@interruptible
def bifurcation_atlas(
    orbit: Orbit,
    parameters: tuple[str, str],
    bounds: tuple[Bounds, Bounds],
    *,
    touches: bool = False,
    depth: int = 1,
    most_curves: int = 40,
    steps: Steps | None = None,
    inadmissible: bool = False,
    progress: ProgressOption = True,
) -> Atlas:
    """Follow all curves of bifurcations that can be reached from an orbit.

    Parameters
    ----------
    orbit
        A converged orbit.
    parameters, bounds
        As for :func:`~vibroimpact.continue_bifurcation`.
    touches
        Also follow grazing and vanishing impact speeds.
    depth
        How many times curves of orbits of a multiple period, which begin at points of codimension two, are followed:
        0 for the orbit's own curves only.
    most_curves
        Number of curves after which the search stops.
    steps
        Step lengths of the curves, number of points of each.
    inadmissible
        By default the branches on which curves begin follow what exists, as in :func:`~vibroimpact.continue_orbit`,
        through changes of the sequence. True takes those of the orbit's own sequence, motions or not.
    progress
        True shows it on standard error after 2 s; a function gets a :class:`~vibroimpact.ProgressReport` after
        every curve, which it describes.

    Returns
    -------
    Atlas
        After ``KeyboardInterrupt`` with the curves so far.

    Raises
    ------
    InvalidParameterError
        As for :func:`~vibroimpact.continue_bifurcation`; ``depth`` below 0, ``most_curves`` below 1.

    Notes
    -----
    Curves that are reached twice are followed once. Cost: that of its curves, 10 to 100 ms a point.

    Examples
    --------
    >>> import vibroimpact as vi
    >>> damper = vi.ImpactDamper(mass_ratio=0.1, omega_n=0.5, zeta=0.045, restitution=0.8,
    ...                          half_clearance=5.0, omega=1.0)
    >>> atlas = vi.bifurcation_atlas(vi.symmetric_orbits(damper)[0], ("omega", "half_clearance"),
    ...                              ((0.9, 1.05), (4.5, 5.5)), depth=0)
    >>> [curve.kind for curve in atlas.curves]
    ['NS', 'NS']
    """
    start = converged(orbit)
    names = names_of_two(parameters)
    values = parameter_value(start.system, names[0]), parameter_value(start.system, names[1])
    inside = ranges(names, values, bounds)
    check_flag("touches", touches)
    check_count("depth", depth, 0)
    check_count("most_curves", most_curves, 1)
    check_flag("inadmissible", inadmissible)
    check_progress(progress)
    check_kind("steps", steps, (Steps, type(None)), "Steps, or None")
    complete = True
    with Reporter(progress, "atlas") as report:
        search = _Search(names, inside, touches, most_curves, steps, inadmissible, report)
        try:
            search.from_orbit(start)
            search.level(depth)
        except KeyboardInterrupt:
            complete = False
            search.failures.append("interrupted: the curves until then are kept")
        except _Enough:
            complete = False
    return Atlas(names, inside, tuple(search.curves), tuple(search.failures), complete)


class _Enough(Exception):  # noqa: N818 - it ends a search
    """The greatest number of curves is reached."""


@dataclass
class _Search:
    """Curves found so far."""

    names: tuple[str, str]
    bounds: tuple[Bounds, Bounds]
    touches: bool
    most_curves: int
    steps: Steps | None
    inadmissible: bool
    report: Reporter
    curves: list[BifurcationCurve] = field(default_factory=list)
    failures: list[str] = field(default_factory=list)
    done: int = 0  # curves whose points have been followed to other curves of the same orbit,
    switched: int = 0  # and to those that begin there

    def _tell(self, told: ProgressReport) -> None:
        """Tell how far the present branch or curve is."""
        self.report.say(f"{len(self.curves)} curves; {told}", len(self.curves))

    def from_orbit(self, orbit: Orbit) -> None:
        """Curves through the bifurcations of the branches along both parameters."""
        for name, pair in zip(self.names, self.bounds, strict=True):
            branch = continue_orbit(
                orbit, name, pair, inadmissible=self.inadmissible, progress=self._tell
            )
            for part in (branch, *branch.others):
                uninterrupted(part.curve)
                for point in part.special_points:
                    self._follow(point, point.record)

    def level(self, left: int) -> None:
        """Curves through and from the points of the curves so far; ``left`` levels of switching."""
        while self.done < len(self.curves):
            curve = self.curves[self.done]
            self.done += 1
            for point in curve.special_points:
                for kind in point.record.curves:
                    self._follow(point, kind)
        if left == 0:
            return
        here = self.curves[self.switched :]
        self.switched = len(self.curves)
        for curve in here:
            for point in curve.special_points:
                if point.record.begins and not self._seen(point):
                    self._switch(point)
        if len(self.curves) > self.switched:
            self.level(left - 1)

    def _follow(self, point: BifurcationPoint, kind: PointKind) -> None:
        """Follow one kind of curve through a point, unless there is one."""
        wanted = kind.of_map(symmetric=point.orbit.symmetric)
        followed = wanted.critical or (self.touches and wanted.touch and wanted.begins)
        if not followed or wanted == BP:
            return
        if any(curve.record == wanted and _is_on(curve, point.orbit) for curve in self.curves):
            return
        try:
            curve = continue_bifurcation(
                point,
                self.names,
                self.bounds,
                kind=wanted.label,
                steps=self.steps,
                progress=self._tell,
            )
        except InvalidParameterError as error:
            self.failures.append(f"{wanted.label} at {point.label}: {error}")
            return
        self._add(curve)

    def _switch(self, point: BifurcationPoint) -> None:
        found = switch_curve(point, self.bounds, steps=self.steps, progress=self._tell)
        if isinstance(found, NotFound):
            if not getattr(point.normal_form, "switchable", ()):
                return  # theory has none
            self.failures.append(repr(found))
            return
        for curve in found:
            if isinstance(curve, NotFound):
                self.failures.append(repr(curve))
                continue
            middle = curve.orbit(len(curve) // 2)
            known = (other for other in self.curves if other.kind == curve.kind)
            if not any(_is_on(other, middle) for other in known):
                self._add(curve)

    def _seen(self, point: BifurcationPoint) -> bool:
        """Whether an earlier curve has the same point and orbit."""
        for curve in self.curves:
            for other in curve.special_points:
                if other is point:
                    return False
                same = other.record == point.record and np.allclose(
                    list(other.parameters.values()),
                    list(point.parameters.values()),
                    atol=0.0,
                    rtol=SAME_PARAMETERS_OF_RANGE,
                )
                if same and other.orbit.symbol == point.orbit.symbol:
                    return True
        return False

    def _add(self, curve: BifurcationCurve) -> None:
        self.curves.append(curve)
        count = len(self.curves)
        last = f"{curve.kind} of {_symbol(curve)}, {len(curve)} points"
        self.report.say(f"{count} curves, {last}", count)
        uninterrupted(curve.curve)
        if len(self.curves) >= self.most_curves:
            raise _Enough


def _is_on(curve: BifurcationCurve, orbit: Orbit) -> bool:
    """Condition (1)."""
    plane = curve.problem.equations
    if not isinstance(plane, OrbitPlane) or plane.signature != orbit.signature:
        return False
    a = tuple(parameter_value(orbit.system, name) for name in curve.names)
    z = plane.packed(orbit.states, orbit.durations)
    sizes = np.append(plane.sizes, [high - low for low, high in curve.bounds])
    nodes = (
        np.array([np.append(*curve.problem.parts(Z, p)[::2]) for Z, p in _places(curve)]) / sizes
    )
    images = plane.images(z, a, np.zeros_like(z), nodes[0, : len(z)] * plane.sizes)
    return any(_near_chord(nodes, np.append(image, a) / sizes) for image, _ in images)


def _places(curve: BifurcationCurve) -> Iterator[tuple[Floats, float]]:
    yield from zip(curve.curve.z, curve.curve.parameter.tolist(), strict=True)


def _near_chord(nodes: Floats, at: Floats) -> bool:
    """Whether a point lies near the chord of two neighbouring nodes."""
    k = int(np.argmin(np.linalg.norm(nodes - at, axis=1)))
    for i, j in ((k - 1, k), (k, k + 1)):
        if i < 0 or j >= len(nodes):
            continue
        chord = nodes[j] - nodes[i]
        length = float(np.linalg.norm(chord))
        share = float(np.clip((at - nodes[i]) @ chord / length**2, 0.0, 1.0)) if length else 0.0
        if (
            np.linalg.norm(nodes[i] + share * chord - at)
            <= DISTANCE_OF_CHORD * length + SAME_PARAMETERS_OF_RANGE
        ):
            return True
    return False
