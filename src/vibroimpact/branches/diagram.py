"""Branch diagrams: all branches that can be reached from an orbit, and the attractors behind.

Method      The branch of the orbit goes on, at every touch at which its orbits end to be motions, as that which
            begins there (going_on.py). From all of these, branches are switched (switch.py) once at
            every point of kind PD, BP, GR or ZERO next to which orbits are admissible, breadth
            first, but points whose own orbit is admissible before those next to admissible orbits on one side only:
              - points that are one junction (junctions.py) are switched at once;            (1)
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
    check_flag,
    check_index,
    check_memory,
    check_progress,
)
from vibroimpact._core.lazy import xr
from vibroimpact._core.progress import ProgressOption, ProgressReport, Reporter, interruptible
from vibroimpact._core.types import Bounds, Count, Floats
from vibroimpact.branches.beginning import begins_at
from vibroimpact.branches.branch import Branch, Reached, place_of
from vibroimpact.branches.continue_orbit import continue_orbit, following
from vibroimpact.branches.going_on import (
    Border,
    Follow,
    every_part,
    no_motions,
    parted,
    trimmed,
)
from vibroimpact.branches.junctions import KNOWN, NEW, Junctions, named
from vibroimpact.branches.point import BifurcationPoint, NotFound
from vibroimpact.branches.same_orbit import same_branch
from vibroimpact.branches.stop_rules import AT_ONCE, Inadmissible, Rule, StopWhen, listed
from vibroimpact.branches.stop_rules import inadmissible as inadmissible_rule
from vibroimpact.branches.switch import switch_branch
from vibroimpact.compile.prescribed import PHASE
from vibroimpact.continuation import Steps
from vibroimpact.orbits.find import converged
from vibroimpact.orbits.orbit import Orbit
from vibroimpact.results.result import Result, rows
from vibroimpact.simulation.places import AtPhase, AtStop

Say = Callable[[str], object]

SWEPT_POINTS = 60  # section points kept at every value of the sweep
BYTES_PER_VALUE = 2**14  # a value of the sweep has some hundred section points, up and down
STOP_WHEN = inadmissible_rule()


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
        Section points of the sweep, dims "direction", the parameter, "point"; None if not requested, and where the
        orbit begins with a change of state of an element that is no stop, of which sweeps take no points.
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
        return next((r for r in self.reached if r.to == index and r.how == NEW), None)

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
    inadmissible: bool = False,
    progress: ProgressOption = True,
) -> Diagram:
    """Follow all branches that can be reached from an orbit by switching at special points.

    Parameters
    ----------
    orbit, parameter, bounds, steps
        As for :func:`~vibroimpact.continue_orbit`.
    depth
        Largest number of switches from the orbit's branch to any other, >= 0. Where a branch goes on with another
        sequence it is the same one.
    most_branches
        Largest number of branches, >= 1.
    points
        Values of the parameter in the brute-force sweep, each way; 0 for no sweep. There is none either for an orbit
        that begins with a change of state of an element that is no stop.
    stop_when
        As for :func:`~vibroimpact.continue_orbit`, for every branch. By default ``vi.stop.inadmissible()``: with
        ``inadmissible`` parts far from admissible orbits are not followed, nor anything beyond them; ``None`` follows
        all to the end of the range.
    inadmissible
        By default branches follow what exists, as in :func:`~vibroimpact.continue_orbit`. True follows the orbits of
        each sequence, motions or not.
    progress
        True shows it on standard error after 2 s; a function gets a :class:`~vibroimpact.ProgressReport` after
        every panel of points, with the branch and its origin; at the start of a branch with the number of
        points left to try; and before the sweep.

    Returns
    -------
    Diagram
        Without branches from points that are not next to admissible orbits: the orbits that begin there are not
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
    check_flag("inadmissible", inadmissible)
    check_progress(progress)
    orbit = converged(orbit)
    behind = None
    with Reporter(progress, "diagram") as report:
        following = Following(
            parameter, steps, stop_when, inadmissible or not orbit.admissible, report.say
        )
        first = following.branch(orbit, bounds, "branch 0, of the orbit")
        low, high = first.bounds
        tree = Tree((low, high), following)
        tree.grow(first, depth, most_branches)
        place = _place_of(first)
        if points and place and not tree.interrupted:
            report.say(f"following a motion through {points} values, up and down")
            try:
                behind = _swept(first, orbit, place, np.linspace(low, high, points))
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


def _place_of(branch: Branch) -> AtStop | AtPhase | None:
    """Stop at which the orbits of a branch begin, or phase; None where an element that is no stop changes its state."""
    first = branch.family.signature.impacts[0]
    if first.contact == PHASE:
        return AtPhase()
    met = branch.family.mechanism.elements[first.contact].is_stop
    return AtStop(first.name, first.contact) if met else None


def _swept(branch: Branch, orbit: Orbit, place: AtStop | AtPhase, values: Floats) -> xr.Dataset:
    """Section points x1, ..., v1, ..., phase at the place where the orbits of a branch begin."""
    from vibroimpact.sweeps.analyses.diagram import bifurcation_sweep

    found = bifurcation_sweep(
        branch.family.system, over={branch.parameter: values}, start=orbit.state,
        at=place, points=SWEPT_POINTS, periods=SWEPT_POINTS + 1,
        progress=False,
    )  # fmt: skip
    drawn = [str(name) for name, of in found.items() if "point" in of.dims]
    return found[drawn].drop_attrs(deep=False)


# ---- the tree ------------------------------------------------------------------------------------


class Following(NamedTuple):
    """Options for following branches, and the progress callback."""

    parameter: str
    steps: Steps | None
    stop_when: StopWhen | None
    inadmissible: bool
    report: Say

    def branch(self, orbit: Orbit, bounds: tuple[float, float], which: str) -> Branch:
        """Branch of an orbit, up to where its orbits end to be motions if that is asked for."""
        return continue_orbit(orbit, self.parameter, bounds, **self._options(which))

    def switched(
        self, point: BifurcationPoint, bounds: tuple[float, float], which: str
    ) -> Branch | NotFound:
        """Branch that begins at a point, up to where its orbits end to be motions if that is asked for."""
        return switch_branch(point, bounds, **self._options(which))

    def follow(self, bounds: tuple[float, float], which: str) -> Follow:
        """Function that follows those with which a branch goes on."""

        def told(count: int, value: float) -> None:
            self.report(f"{which}: {count} points, {self.parameter} = {value:.6g}")

        return following(bounds, self.steps, self.stop_when, told, inadmissible=self.inadmissible)

    def _options(self, which: str) -> _Options:
        """Keywords for a branch of one sequence, whose name is reported."""
        self.report(which)

        def progress(done: ProgressReport) -> None:
            self.report(f"{which}: {done.text}")

        rules = listed(self.stop_when) + ([] if self.inadmissible else [AT_ONCE])
        return _Options(steps=self.steps, stop_when=rules, inadmissible=True, progress=progress)


class _Options(TypedDict):
    steps: Steps | None
    stop_when: list[Rule | Inadmissible]
    inadmissible: bool
    progress: ProgressOption


class _Waiting(NamedTuple):
    """Point at which to switch; the least is tried first."""

    inadmissible: bool
    level: int
    branch: int
    number: int

    def point(self, branches: list[Branch]) -> BifurcationPoint:
        return branches[self.branch].special_points[self.number]


class _Part(NamedTuple):
    """Branch, and its ends from which it goes on with others."""

    branch: Branch
    borders: list[Border]


class Tree:
    """Branches found so far and the junctions between them."""

    def __init__(self, bounds: tuple[float, float], following: Following) -> None:
        self.bounds, self.following = bounds, following
        self.branches: list[Branch] = []
        self.reached: list[Reached] = []
        self.untried: list[tuple[int, str]] = []
        self.junctions = Junctions(bounds)
        self.waiting: list[_Waiting] = []
        self.interrupted = False
        self.added: Callable[[], object] = lambda: None  # is called after every new branch

    def grow(self, first: Branch, depth: int, most_branches: int) -> None:
        """Add a branch and switch at every waiting point, the least first."""
        self.interrupted = first.curve.interrupted
        self._add(*self._part(first), None, 0, most_branches)
        while self.waiting:
            here = heapq.heappop(self.waiting)
            point = here.point(self.branches)
            try:
                if self._known_junction(here.branch, point):
                    continue
                if self.interrupted or here.level >= depth or len(self.branches) >= most_branches:
                    self._leave(here.branch, point)
                elif found := self._switched(here.branch, point):
                    self._add(*found, (here.branch, point), here.level + 1, most_branches)
            except KeyboardInterrupt:
                self.interrupted = True
                self._leave(here.branch, point)

    def _part(self, found: Branch) -> _Part:
        """What is kept of a branch, and its ends at which orbits end to be motions."""
        if self.following.inadmissible:
            return _Part(found, [])
        part, borders = trimmed(found)
        return _Part(part, borders)

    def _add(
        self,
        branch: Branch,
        borders: list[Border],
        origin: tuple[int, BifurcationPoint] | None,
        level: int,
        most: int,
    ) -> None:
        """Add a new branch, those with which it goes on, and their points to those that wait."""
        number, back = len(self.branches), list[str]()
        if origin:
            borders, back = parted(borders, origin[1])
            self.reached += [Reached(number, label, origin[0], KNOWN) for label in back]
        follow = self.following.follow(self.bounds, f"branch {number} goes on")
        parts, reached = every_part(
            branch, borders, follow, self.junctions, known=self.branches, most=most
        )
        self.branches += parts
        self.reached += reached
        self.added()
        self.interrupted = self.interrupted or self.branches[-1].curve.interrupted
        known = {(result.branch, result.label) for result in reached} | {
            (number, label) for label in back
        }
        for k in range(number, len(self.branches)):
            for index, point in self._points(k):
                if (k, point.label) not in known:
                    heapq.heappush(self.waiting, _Waiting(not point.admissible, level, k, index))

    def _points(self, number: int) -> Iterator[tuple[int, BifurcationPoint]]:
        """Points at which to switch: those next to admissible orbits."""
        branch = self.branches[number]
        for index, point in enumerate(branch.special_points):
            at = place_of(branch, point)[0]
            if begins_at(point) and branch.admissible[max(at - 1, 0) : at + 2].any():
                yield index, point

    def _known_junction(self, number: int, point: BifurcationPoint) -> bool:
        """Whether a point is at a known junction; if so, its result is recorded."""
        known = self.junctions.find(number, point)
        if known and known.result:
            self.reached.append(known.result)
        return known is not None

    def _leave(self, number: int, point: BifurcationPoint) -> None:
        self.untried.append((number, point.label))
        self.junctions.add(point, None)

    def _switched(self, number: int, point: BifurcationPoint) -> _Part | None:
        """Switch at a point; return what is kept of the branch if it is new."""
        where = f"from {point.label} of branch {number} ({point.orbit.symbol})"
        left = f"{len(self.waiting)} more points to try"
        which = f"branch {len(self.branches)}, {where}, {left}"
        found = self.following.switched(point, self.bounds, which)
        part: _Part | None = None
        if isinstance(found, NotFound):
            result = Reached(number, point.label, None, found.reason)
        else:
            part = self._part(found)
            self.interrupted = found.curve.interrupted
            exists = self.following.inadmissible or part.branch.admissible.any()
            result = (
                self._placed(part.branch, number, point.label)
                if exists
                else Reached(number, point.label, None, no_motions(found))
            )
        self.reached.append(result)
        self.junctions.add(point, result)
        return part if result.how == NEW else None

    def _placed(self, found: Branch, number: int, label: str) -> Reached:
        """Result for a branch that was found, by rule (2)."""
        for k, known in enumerate(self.branches):
            how = same_branch(found, known)
            if how:
                return Reached(number, label, k, named(how))
        return Reached(number, label, len(self.branches), NEW)
