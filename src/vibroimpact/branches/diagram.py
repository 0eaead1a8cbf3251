"""Branch diagrams: all branches that can be reached from an orbit, and the attractors behind.

Method      From the branch of the orbit, branches are switched (switch.py) once at every point of
            kind PD, BP, GR or ZERO next to which orbits are admissible, breadth first, but points
            whose own orbit is admissible before those next to admissible orbits on one side only:
              - points at one parameter value (SAME_JUNCTION_OF_RANGE) that share their loop (same_orbit.py), up
                to its first impact and the mirror image, are one junction; a loop at PD or BP may
                be a double one, one at ZERO is that of the grazing orbit;                     (1)
              - a branch that holds the same orbit as a known one, in the same sense, at a common
                value of the parameter is not new. Compared are the orbits at PROBE_SHARES of its points
                with those that Newton's method finds between neighbouring points of the known
                branch that enclose the value, within SAME_ORBIT_RELATIVE.                          (2)
            The attractors are those of a bifurcation_sweep, upwards and then back.
Accuracy    of the branches, continuation; (1) and (2) the tolerances stated
Fails       a junction where no branch was found is listed with its reason
Reference   theory.md, "Branches"
"""

from __future__ import annotations

import heapq
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from typing import NamedTuple, TypedDict

import numpy as np

from vibroimpact._core.checks import (
    check_count,
    check_index,
    check_memory,
    check_progress,
)
from vibroimpact._core.lazy import xr
from vibroimpact._core.progress import ProgressOption, ProgressReport, Reporter, interruptible
from vibroimpact._core.types import Bounds, Count, Floats
from vibroimpact.branches.branch import Branch, place_of
from vibroimpact.branches.continue_orbit import continue_orbit
from vibroimpact.branches.point import BifurcationPoint, NotFound
from vibroimpact.branches.same_orbit import Loop, junction_of, same_branch, same_loop
from vibroimpact.branches.stop_rules import StopWhen, inadmissible
from vibroimpact.branches.switch import switch_branch
from vibroimpact.compile.prescribed import PHASE
from vibroimpact.continuation import Steps
from vibroimpact.model.system import mechanism_of
from vibroimpact.orbits.find import converged
from vibroimpact.orbits.orbit import Orbit
from vibroimpact.results.result import Result, rows
from vibroimpact.simulation.places import AtPhase, AtStop

Say = Callable[[str], object]

SWEPT_POINTS = 60  # section points kept at every value of the sweep
# Junctions at values that are so near, relative to the range, are one.
SAME_JUNCTION_OF_RANGE = 1e-7
# States at one junction agree so well, relative to their size: square roots halve the digits.
JUNCTION_OF_STATES = 1e-4
BYTES_PER_VALUE = 2**14  # a value of the sweep has some hundred section points, up and down
STOP_WHEN = inadmissible()


class Reached(NamedTuple):
    """Result of switching at a special point."""

    # number of the branch and label of the point
    branch: Count
    label: str
    # number of the branch that was found there or was known; None where there is none
    to: int | None
    how: str  # "new"; "known", "mirror image"; or the reason why there is none


@dataclass(frozen=True, eq=False)
class Diagram(Result):
    """Branches reachable from an orbit.

    Attributes
    ----------
    parameter, bounds
        The parameter and its range.
    branches
        Number 0 is that of the orbit; each of the others was found at a special point of an
        earlier one.
    reached
        :class:`Reached`, one for every special point that was tried, in this order.
    untried
        (branch, label) of the junctions left when ``depth`` or ``most_branches`` was reached, or by an
        interruption.
    attractors
        Section points of the sweep, dims "direction", the parameter, "point"; None if not
        requested.
    interrupted
        Whether ``KeyboardInterrupt`` ended it; the results until then are kept.
    """

    parameter: str
    bounds: Bounds
    branches: tuple[Branch, ...] = field(repr=False)
    reached: tuple[Reached, ...] = field(metadata=rows("reached"), repr=False)
    untried: tuple[tuple[Count, str], ...] = field(repr=False)
    attractors: xr.Dataset | None = field(repr=False)
    interrupted: bool = False

    @property
    def failed(self) -> tuple[Reached, ...]:
        """Points at which no branch was found, with the reason."""
        return tuple(r for r in self.reached if r.to is None)

    def origin(self, index: int) -> Reached | None:
        """Return the special point at which a branch was found; None for number 0."""
        check_index("index", index, len(self.branches))
        return next((r for r in self.reached if r.to == index and r.how == "new"), None)

    def to_dataset(self) -> xr.Dataset:
        """Convert attractors and tree to a dataset; see :meth:`Branch.to_dataset` for branches."""
        symbols = np.array([branch.symbol for branch in self.branches], dtype=object)
        tree = super().to_dataset().assign(symbol=("branch", symbols))
        return tree if self.attractors is None else tree.merge(self.attractors)

    def __repr__(self) -> str:
        low, high = self.bounds
        lines = [
            f"Diagram: {len(self.branches)} branches, {self.parameter} {low:.8g} to {high:.8g}"
        ]
        lines += [f"  {self._line(k)}" for k in range(len(self.branches))]
        lines += [f"  no branch at {r.label} of {r.branch}: {r.how}" for r in self.failed]
        if self.untried:
            left = ", ".join(f"{label} of {branch}" for branch, label in self.untried)
            lines.append(f"  not tried: {left}")
        if self.interrupted:
            lines.append("  interrupted")
        return "\n".join(lines)

    def _line(self, number: int) -> str:
        branch, origin = self.branches[number], self.origin(number)
        start = f"from {origin.label} of {origin.branch}" if origin else "from the orbit"
        kind = ", symmetric" if branch.family.signature.symmetric else ""
        points = " ".join(point.label for point in branch.special_points) or "no special point"
        low, high = branch.extent
        return (
            f"{number}: {branch.symbol}{kind}, {start}, {low:.6g} to {high:.6g}, "
            f"{branch.stable_share:.0%} of it stable; {points}"
        )


@interruptible
def branch_diagram(
    orbit: Orbit,
    parameter: str,
    bounds: tuple[float, float],
    *,
    depth: int = 2,
    most_branches: int = 20,
    points: int = 200,
    steps: Steps | None = None,
    stop_when: StopWhen | None = STOP_WHEN,
    progress: ProgressOption = True,
) -> Diagram:
    """Follow all branches that can be reached from an orbit by switching at special points.

    Parameters
    ----------
    orbit, parameter, bounds, steps
        As for :func:`~vibroimpact.continue_orbit`.
    depth
        Largest number of switches from the orbit's branch to any other, >= 0.
    most_branches
        Largest number of branches, >= 1.
    points
        Values of the parameter in the brute-force sweep, each way; 0 for no sweep.
    stop_when
        As for :func:`~vibroimpact.continue_orbit`, for every branch. By default
        ``vi.stop.inadmissible()``: parts far from admissible orbits are not followed, nor anything
        beyond them; ``None`` follows all to the end of the range.
    progress
        True shows it on standard error after 2 s; a function gets a :class:`~vibroimpact.ProgressReport` after
        every panel of points, with the branch and its origin; at the start of a branch with the number of
        points left to try; and before the sweep.

    Returns
    -------
    Diagram
        Without branches from points that are not admissible: the orbits that begin there are not
        either. One branch stands for its mirror image too. ``KeyboardInterrupt`` ends it with the
        results so far.

    Raises
    ------
    InvalidParameterError
        As for :func:`~vibroimpact.continue_orbit`; counts out of range.

    Notes
    -----
    Cost: that of every branch, a second or two for the impact damper, and 1 ms per value of the
    sweep. The sweep shows only the attractors that a single motion reaches.

    Examples
    --------
    >>> import vibroimpact as vi
    >>> damper = vi.ImpactDamper(mass_ratio=0.1, omega_n=0.5, zeta=0.045, restitution=0.8,
    ...                          half_clearance=5.0, omega=0.72)
    >>> diagram = vi.branch_diagram(vi.symmetric_orbits(damper)[0], "omega", (0.69, 0.73),
    ...                             points=0)
    >>> [branch.symbol for branch in diagram.branches]
    ['1-1-1', '1-1-1']
    """
    for name, value, least in (
        ("depth", depth, 0),
        ("most_branches", most_branches, 1),
        ("points", points, 0),
    ):
        check_count(name, value, least)
    check_memory("points", points, BYTES_PER_VALUE, "Take fewer.")
    check_progress(progress)
    orbit = converged(orbit)
    behind = None
    with Reporter(progress, "diagram") as report:
        following = Following(parameter, steps, stop_when, report.say)
        options = following.options("branch 0, of the orbit")
        first = continue_orbit(orbit, parameter, bounds, inadmissible=True, **options)
        low, high = first.bounds
        tree = Tree((low, high), following)
        tree.grow(first, depth, most_branches)
        if points and not tree.interrupted:
            report.say(f"following a motion through {points} values, up and down")
            try:
                behind = _swept(first, orbit, np.linspace(low, high, points))
            except KeyboardInterrupt:
                tree.interrupted = True
    return Diagram(
        parameter,
        (low, high),
        tuple(tree.branches),
        tuple(tree.reached),
        tuple(tree.untried),
        behind,
        tree.interrupted,
    )


def _swept(branch: Branch, orbit: Orbit, values: Floats) -> xr.Dataset:
    """Section points x1, ..., v1, ..., phase at the stop where the orbits of a branch begin."""
    from vibroimpact.sweeps.analyses.diagram import bifurcation_sweep

    first = branch.family.signature.impacts[0]
    found = bifurcation_sweep(
        branch.family.system, over={branch.parameter: values}, start=orbit.state,
        at=AtPhase() if first.contact == PHASE else AtStop(first.name, first.contact),
        points=SWEPT_POINTS, periods=SWEPT_POINTS + 1,
        progress=False,
    )  # fmt: skip
    drawn = [str(name) for name, of in found.items() if "point" in of.dims]
    return found[drawn].drop_attrs(deep=False)


# ---- the tree ------------------------------------------------------------------------------------


class _Junction(NamedTuple):
    """Point at which branches meet."""

    parameter: float
    loop: Loop
    touching: bool


class _Options(TypedDict):
    steps: Steps | None
    stop_when: StopWhen | None
    progress: ProgressOption


class Following(NamedTuple):
    """Options for following branches, and the progress callback."""

    parameter: str
    steps: Steps | None
    stop_when: StopWhen | None
    report: Say

    def options(self, which: str) -> _Options:
        """Keywords for a branch, whose name is reported."""
        self.report(which)

        def progress(done: ProgressReport) -> None:
            self.report(f"{which}: {done.text}")

        return _Options(steps=self.steps, stop_when=self.stop_when, progress=progress)


class _Waiting(NamedTuple):
    """Point at which to switch; the least is tried first."""

    inadmissible: bool
    level: int
    branch: int
    number: int

    def point(self, branches: list[Branch]) -> BifurcationPoint:
        return branches[self.branch].special_points[self.number]


class Tree:
    """Branches found so far and the junctions between them."""

    def __init__(self, bounds: tuple[float, float], following: Following) -> None:
        self.bounds, self.following = bounds, following
        self.branches: list[Branch] = []
        self.reached: list[Reached] = []
        self.untried: list[tuple[int, str]] = []
        self.junctions: list[tuple[_Junction, Reached | None]] = []
        self.waiting: list[_Waiting] = []
        self.interrupted = False

    def grow(self, first: Branch, depth: int, most_branches: int) -> None:
        """Add a branch and switch at every waiting point, the least first."""
        self.interrupted = first.curve.interrupted
        self._add(first, 0)
        while self.waiting:
            here = heapq.heappop(self.waiting)
            point = here.point(self.branches)
            try:
                if self._known_junction(here.branch, point):
                    continue
                if self.interrupted or here.level >= depth or len(self.branches) >= most_branches:
                    self._leave(here.branch, point)
                elif found := self._switched(here.branch, point):
                    self._add(found, here.level + 1)
            except KeyboardInterrupt:
                self.interrupted = True
                self._leave(here.branch, point)

    def _add(self, branch: Branch, level: int) -> None:
        """Add a new branch, and its points to those that wait."""
        self.branches.append(branch)
        number = len(self.branches) - 1
        for index in self._points(number):
            admissible = branch.special_points[index].admissible
            heapq.heappush(self.waiting, _Waiting(not admissible, level, number, index))

    def _points(self, number: int) -> Iterator[int]:
        """Numbers of the points at which to switch: those next to admissible orbits."""
        branch = self.branches[number]
        for index, point in enumerate(branch.special_points):
            at = place_of(branch, point)[0]
            if point.record.begins and branch.admissible[max(at - 1, 0) : at + 2].any():
                yield index

    def _known_junction(self, number: int, point: BifurcationPoint) -> bool:
        """Whether a point is at a known junction (1); if so, its result is recorded."""
        here = _junction(point)
        mechanism = mechanism_of(point.orbit.system)
        span = self.bounds[1] - self.bounds[0]
        for known, result in self.junctions:
            near = abs(known.parameter - here.parameter) <= SAME_JUNCTION_OF_RANGE * span
            if not near or known.touching != here.touching:
                continue
            how = same_loop(known.loop, here.loop, mechanism, JUNCTION_OF_STATES)
            if not how:
                continue
            if result is not None:
                self.reached.append(_at_junction(number, point.label, result, how))
            return True
        return False

    def _leave(self, number: int, point: BifurcationPoint) -> None:
        self.untried.append((number, point.label))
        self.junctions.append((_junction(point), None))

    def _switched(self, number: int, point: BifurcationPoint) -> Branch | None:
        """Switch at a point; return the branch if it is new."""
        where = f"from {point.label} of branch {number} ({point.orbit.symbol})"
        left = f"{len(self.waiting)} more points to try"
        which = f"branch {len(self.branches)}, {where}, {left}"
        found = switch_branch(point, self.bounds, **self.following.options(which))
        if isinstance(found, NotFound):
            result = Reached(number, point.label, None, found.reason)
        else:
            self.interrupted = found.curve.interrupted
            result = self._placed(found, number, point.label)
        self.reached.append(result)
        self.junctions.append((_junction(point), result))
        return found if isinstance(found, Branch) and result.how == "new" else None

    def _placed(self, found: Branch, number: int, label: str) -> Reached:
        """Result for a branch that was found, by rule (2)."""
        for k, known in enumerate(self.branches):
            how = same_branch(found, known)
            if how:
                return Reached(number, label, k, _named(how))
        return Reached(number, label, len(self.branches), "new")


def _at_junction(number: int, label: str, first: Reached, how: str) -> Reached:
    """Result of a point at a junction at which another point was switched before."""
    if first.to is None:
        return Reached(number, label, None, first.how)
    back = first.to == number != first.branch
    return Reached(number, label, first.branch if back else first.to, _named(how))


def _named(how: str) -> str:
    return "known" if how == "same" else how


def _junction(point: BifurcationPoint) -> _Junction:
    loop = junction_of(point, JUNCTION_OF_STATES)
    return _Junction(point.parameter, loop, point.record.touch)
