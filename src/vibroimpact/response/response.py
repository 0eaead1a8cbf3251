"""Frequency response: every steady motion over a band, with one measure of it.

Method      Motions are simulated up, down and from many starts (answers.py). The motion without
            impacts is known in closed form up to where it grazes (linear.py). Branches of orbits
            begin at orbits on which simulated motions settle, those first that most of them are on,
            and at the graze; from each, others are switched to at special points, as in
            :func:`~vibroimpact.branch_diagram`. A simulated periodic motion that no curve explains is
            the next start, until all are explained or there are enough branches. Along curves the
            measure and its derivative are exact (curves.py).
Fails       attractors with small basins, and branches of unstable orbits that no switching reaches,
            are missed; motions for which no orbit was found remain as simulated answers
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field, replace
from functools import cached_property
from os import PathLike
from typing import Any

import numpy as np

from vibroimpact import _kernel
from vibroimpact._core.checks import (
    check_count,
    check_flag,
    check_memory,
    is_function,
    names_arguments,
    nonnegative,
    positive,
    real,
    refusal,
)
from vibroimpact._core.errors import InvalidParameterError
from vibroimpact._core.lazy import xr
from vibroimpact._core.progress import ProgressOption, Reporter, interruptible
from vibroimpact._core.quantities import with_unit
from vibroimpact._core.types import Flags, Floats
from vibroimpact.branches.diagram import STOP_WHEN, Following, Tree
from vibroimpact.branches.kinds import GR, ZERO
from vibroimpact.branches.same_orbit import loop_of, orbits_at, same_loop
from vibroimpact.continuation import Steps
from vibroimpact.continuation.walk import check_steps
from vibroimpact.machines.units import units_of
from vibroimpact.measures.linear import FREE_MODE, free_motion
from vibroimpact.measures.measure import Measure, measure_of
from vibroimpact.model.parameters import with_parameter
from vibroimpact.model.state import State
from vibroimpact.model.stop import Stop
from vibroimpact.model.system import System, mechanism_of
from vibroimpact.orbits.find import SAME_ORBIT_RELATIVE, Guess, find_orbit
from vibroimpact.orbits.orbit import Orbit
from vibroimpact.orbits.stability import Stability
from vibroimpact.response.answers import (
    SAMPLED_MACHINES,
    Answer,
    Shown,
    Simulation,
    explained,
    random_starts,
    rest_of,
)
from vibroimpact.response.band import Band, Unit, band_of
from vibroimpact.response.curves import (
    ResponseCurve,
    curve_of_branch,
    curve_without_impacts,
    existing,
    likeness,
)
from vibroimpact.results.result import Result, meanings, plotting, sized
from vibroimpact.sweeps.starts import GridStarts, ListedStarts, RandomStarts

STEPS = Steps(first=0.05, largest=2.0, points=600)
MOST_NAMED_MOTIONS = 8  # a list names so many motions at most
END_KIND = -1  # no stretch begins at the last point of a curve, which has this kind
SAME_TOUCH_OF_BAND = 1e-6  # touches that are so near, relative to the band, are at one value
BYTES_PER_VALUE = 2**12  # of every value the band has some members, with their motions
TRIED_MOTIONS = 3  # an orbit is looked for from so many simulated motions of a kind


@dataclass(frozen=True, eq=False)
class Response(Result):
    """Steady motions of a machine over a band, measured.

    Attributes
    ----------
    system
        The machine.
    band
        :class:`Band`: parameter, range, unit of the user.
    measure
        The measure of every motion.
    curves
        :class:`ResponseCurve`, the motion without impacts first, if it exists.
    values
        Values of the parameter that were simulated, shape (k,).
    answers
        At each of them the motions that were simulated, equal ones once, most frequent first.
    notes
        Sentences: what was not found or not followed.
    interrupted
        Whether ``KeyboardInterrupt`` ended the search for branches; the rest is kept.
    """

    system: System
    band: Band
    measure: Measure
    curves: tuple[ResponseCurve, ...] = field(repr=False)
    values: Floats = field(metadata=sized("value"), repr=False)
    answers: tuple[tuple[Answer, ...], ...] = field(metadata=sized("value"), repr=False)
    simulation: Simulation = field(repr=False)
    notes: tuple[str, ...] = ()
    interrupted: bool = False

    @property
    def parameter(self) -> str:
        """Name of the parameter."""
        return self.band.parameter

    @property
    def size(self) -> float:
        """Largest value that occurs, in modulus."""
        found = [abs(a.value) for many in self.answers for a in many]
        return max((x for x in found if math.isfinite(x)), default=0.0) or 1.0

    @cached_property
    def unexplained(self) -> tuple[Answer, ...]:
        """Simulated answers that are on no curve: tori, chaos, orbits that were not found."""
        return tuple(
            answer
            for many in self.answers
            for answer in many
            if not any(curve.holds(answer, self.size) for curve in self.curves)
        )

    @property
    def worst(self) -> Answer:
        """The largest value over the band among motions on which the machine settles, as of :meth:`largest`."""
        return self.largest()

    def largest(self, *, neutral: bool = False) -> Answer:
        """Return the largest value over the band.

        On branches it is located by the exact derivative, at a maximum, at an end of the band or at
        the bifurcation where the orbit stops being stable; of other motions it is that of the
        values simulated.

        Parameters
        ----------
        neutral
            Whether neutral motions count that attract no starts: a free mass stands anywhere between its stops until
            it is pushed. They count in any case where most motions that were simulated have no impacts, and where there
            is nothing else.

        Raises
        ------
        InvalidParameterError
            There is no motion on which the machine settles.
        """
        check_flag("neutral", neutral)
        found = self._largest(neutral=neutral) or self._largest(neutral=True)
        if found is None:
            raise InvalidParameterError(
                "response: holds no stable motion at all. Raise starts, or settle_periods."
            )
        return self._shown(self._complete(found))

    def _largest(self, *, neutral: bool) -> Answer | None:

        def reached(value: float) -> bool:
            return neutral or bool(self._silent[np.argmin(np.abs(self.values - value))])

        found = [best for curve in self.curves if (best := curve.largest(reached)) is not None]
        found += [
            answer
            for answer in self.unexplained
            if math.isfinite(answer.value) and (answer.attracting or reached(answer.parameter))
        ]
        return max(found, key=lambda answer: answer.value, default=None)

    @cached_property
    def _silent(self) -> Flags:
        """Whether most motions that were simulated at a value have no impacts, shape (k,)."""
        counts = [
            (sum(a.members for a in many if a.silent), sum(a.members for a in many))
            for many in self.answers
        ]
        return np.array([2 * silent > every for silent, every in counts])

    def at(self, value: float) -> list[Answer]:
        """Return every steady motion at one value of the parameter, largest first.

        Parameters
        ----------
        value
            Within the band, in its unit.

        Returns
        -------
        list of Answer
            Orbits of the curves, of any stability, measured exactly; and motions that are
            simulated there, now, from the same starts, where no stable orbit is their equal.

        Raises
        ------
        InvalidParameterError
            A value outside the band.
        """
        own = positive("value", value) if self.band.unit else real("value", value)
        own /= self.band.factor
        low, high = self.band.low, self.band.high
        slack = 1e-12 * (high - low)
        if not low - slack <= own <= high + slack:
            ends = f"[{low * self.band.factor:.6g}, {high * self.band.factor:.6g}]"
            raise refusal("value", value, f"in the band, {ends} {self.band.unit}".rstrip())
        own = min(max(own, low), high)
        found = [self._complete(answer) for curve in self.curves for answer in curve.at(own)]
        for answer in self.simulation.answers(np.array([own]))[0]:
            equal = [k for k, known in enumerate(found) if _same(known, answer, self.size)]
            if equal:
                found[equal[0]] = explained(answer, found[equal[0]])
            else:
                found.append(answer)
        return sorted(map(self._shown, found), key=lambda answer: -answer.value)

    @cached_property
    def shown(self) -> Shown:
        """Units in which answers are printed."""
        units = units_of(self.system)
        across = self.band.unit or units.unit(units.quantity_of(self.parameter))
        return Shown(units.unit(self.measure.dimension), across, self.band.factor)

    def _shown(self, answer: Answer) -> Answer:
        return replace(answer, shown=self.shown)

    def _complete(self, answer: Answer) -> Answer:
        """An answer with the rms and peak of its orbit, where a row is measured."""
        others = self.simulation.measures[1:]
        if answer.orbit is None or not others:
            return answer
        rms, peak = (measure.of_orbit(answer.orbit) for measure in others)
        return replace(answer, rms=rms, peak=peak)

    def to_dataset(self) -> xr.Dataset:
        """Convert to a dataset: points of all curves, and simulated answers.

        Returns
        -------
        Dataset
            Along ``point``: curve (its number), parameter, value, derivative, stability (of the stretch that
            begins there); along ``answer``: parameter, value, motion, stability, members, on_curve, and of a
            row its rms and peak. Attributes ``units`` where they are SI.
        """
        units = units_of(self.system)
        across = units.quantity_of(self.parameter)

        def attrs(text: str, of: str) -> dict[str, str]:
            return {"long_name": text} | ({"quantity": of} if of else {}) | units.attrs(of)

        name = self.parameter
        curves = self.curves
        kinds = [np.append(curve.stability, END_KIND) for curve in curves]
        answers = [answer for many in self.answers for answer in many]
        off = {id(answer) for answer in self.unexplained}
        measures = self.simulation.measures  # the others are those of its row
        names = ("value", "rms", "peak")[: len(measures)]
        known = meanings(Stability)
        measured = {
            kind: attrs(one.label, one.dimension) for kind, one in zip(names, measures, strict=True)
        }

        over = [units.unit(one) for one in (self.measure.dimension, across)]
        slope = {"units": f"{over[0] or 1}/({over[1]})"} if over[1] else {}

        def joined(parts: list[Floats]) -> Floats:
            return np.concatenate(parts) if parts else np.empty(0)

        return xr.Dataset(
            {
                "curve": ("point", np.repeat(np.arange(len(curves)), [len(c.value) for c in curves])),
                f"{name}_of_point": (
                    "point", joined([c.parameter for c in curves]), attrs(name, across),
                ),
                "value_of_point": ("point", joined([c.value for c in curves]), measured["value"]),
                "derivative": (
                    "point", joined([c.derivative for c in curves]),
                    {"long_name": f"derivative of {self.measure.label} by {name}"} | slope,
                ),
                "stability_of_point": (
                    "point", np.concatenate(kinds).astype(np.int8) if kinds else np.empty(0, np.int8),
                    {
                        "long_name": "stability on the stretch to the next point",
                        "flag_values": np.append(END_KIND, known["flag_values"]),
                        "flag_meanings": f"end_of_curve {known['flag_meanings']}",
                    },
                ),
                "symbol": ("branch", np.array([c.symbol for c in curves], dtype=object)),
                f"{name}_of_answer": (
                    "answer", np.array([a.parameter for a in answers]), attrs(name, across),
                ),
                **{
                    f"{kind}_of_answer": (
                        "answer", np.array([getattr(a, kind) for a in answers]), words,
                    )
                    for kind, words in measured.items()
                },
                "motion": ("answer", np.array([a.motion for a in answers], dtype=object)),
                "stability_of_answer": (
                    "answer", np.array([a.stability for a in answers], dtype=np.int8), known,
                ),
                "members": ("answer", np.array([a.members for a in answers], dtype=np.int32)),
                "on_curve": ("answer", np.array([id(a) not in off for a in answers], dtype=bool)),
            },
            attrs={
                "system": repr(self.system),
                "parameter": name,
                "band": [self.band.low, self.band.high],
                "measure": self.measure.label,
                "settle_periods": self.simulation.settle_periods,
                "periods": self.simulation.periods,
                "version": _kernel.version(),
            },
        )  # fmt: skip

    def report(
        self, path: str | PathLike[str], *, title: str = "", compare: tuple[str, ...] = (),
        decibel: bool = False,
    ) -> None:  # fmt: skip
        """Write a report for readers who do not know the field: one HTML page.

        It has the machine as a table and a drawing, the figure, the worst motion and that of the
        machine with all stops open in plain words, the kinds of motion that occur, and what the
        statement rests on. Nothing is loaded from elsewhere, so that the file can be sent.

        Parameters
        ----------
        path
            Name of the file, which ends in .html; an earlier one is replaced.
        title
            Heading; by default the measure and the machine.
        compare, decibel
            As for :meth:`plot`; the linear machines are compared in words, too.

        Raises
        ------
        InvalidParameterError
            Another suffix, no such folder; no stable motion was found; a linear machine that does
            not exist, as for :meth:`plot`.
        """
        plotting("report").write_report(self, path, title=title, compare=compare, decibel=decibel)

    def __repr__(self) -> str:
        unit, across = self.shown[1:]
        low, high = (end * across for end in (self.band.low, self.band.high))
        what = f"{self.measure.label} over {self.parameter}"
        lines = [f"Response: {what} {with_unit(low, high, unit=unit)}"]
        lines += [f"  {k}: {_line(curve, across)}" for k, curve in enumerate(self.curves)]
        others = sorted({answer.motion for answer in self.unexplained}, key=_order)
        if others:
            lines.append(f"  simulated, on no branch: {_listed(others)}")
        lines.append(
            f"  worst: {self.worst!r}"
            if self._largest(neutral=True)
            else "  no stable motion was found"
        )
        lines += [f"  {note}" for note in self.notes]
        return "\n".join(lines)


def _order(motion: str) -> tuple[list[int], str]:
    """Motions without a symbol first, then short symbols."""
    return [int(number) for number in re.findall(r"\d+", motion)], motion


def _listed(motions: list[str]) -> str:
    """A few motions by name, and how many more."""
    more = len(motions) - MOST_NAMED_MOTIONS
    return ", ".join(motions[:MOST_NAMED_MOTIONS]) + (f" and {more} more" if more > 0 else "")


def _line(curve: ResponseCurve, across: float) -> str:
    kind = "without impacts" if curve.branch is None else curve.symbol
    low, high = (float(end) * across for end in (curve.parameter.min(), curve.parameter.max()))
    labels = " ".join(point.label for point in curve.special_points) or "no special point"
    return f"{kind}, {low:.6g} to {high:.6g}; {labels}"


def _same(known: Answer, simulated: Answer, size: float) -> bool:
    """Whether a simulated answer is a stable or a neutral orbit."""
    near = likeness(simulated.motion, known.motion) * size
    return known.stability <= Stability.NEUTRAL and abs(known.value - simulated.value) < near


@names_arguments()
@interruptible
def frequency_response(
    system: System,
    parameter: str,
    bounds: tuple[float, float],
    *,
    measure: Measure | str = "x1",
    unit: Unit = "",
    points: int = 200,
    starts: int | RandomStarts | GridStarts | ListedStarts = 16,
    start: State | None = None,
    seed: int = 0,
    settle_periods: float = 250,
    periods: float = 50,
    most_branches: int = 8,
    depth: int = 1,
    steps: Steps | None = None,
    inadmissible: bool = False,
    workers: int | None = None,
    so_far: Callable[[Response], object] | None = None,
    progress: ProgressOption = True,
) -> Response:
    """Compute how a machine answers over a band: every steady motion, with one measure of it.

    Parameters
    ----------
    system
        A forced machine: a :class:`~vibroimpact.Mechanism`, a :class:`~vibroimpact.Family`, or
        anything with a ``mechanism``.
    parameter
        Name of the parameter, usually the forcing frequency, ``"omega"``. Any other real parameter is
        allowed too: the response is then that over this parameter.
    bounds
        (low, high) of it.
    measure
        A measure or its name, such as "x1" (amplitude), "rms v1", "transmissibility x1", "power":
        see :func:`~vibroimpact.measure_of`.
    unit
        "Hz" if the band is in hertz and the parameter is the forcing frequency in radians per second;
        by default the band is in the unit of the parameter.
    points
        Values of the parameter that are simulated, evenly spaced, >= 2.
    starts
        Random starts at each of them, >= 0; or starts of :func:`~vibroimpact.sweep`.
    start
        Start of the motion that is followed up and down; by default the machine's free start.
    seed
        Seed of the random starts.
    settle_periods, periods
        Forcing periods before, and while, motions are observed.
    most_branches
        Largest number of branches that are followed, >= 0; with 0 there is simulation, and the motion
        without impacts, only.
    depth
        Switches from the branch of a simulated orbit to others, as for
        :func:`~vibroimpact.branch_diagram`.
    steps
        As for :func:`~vibroimpact.continue_orbit`; by default longer ones.
    inadmissible
        By default curves are of what exists: the motion without impacts up to where it grazes, and branches as in
        :func:`~vibroimpact.continue_orbit`. True adds motions that cross a stop.
    workers
        Threads of the simulation; by default one per core.
    so_far
        A function that is given the response as it is then: when motions are simulated, with the motion without
        impacts, and after every branch; each has one curve more. So a picture is there long before the last branch.
    progress
        True shows it on standard error after 2 s; a function gets a :class:`~vibroimpact.ProgressReport` after
        every panel of points of a branch, and before the sweep.

    Returns
    -------
    Response
        Ctrl-C while branches are followed keeps what is there.

    Raises
    ------
    InvalidParameterError
        No such parameter, a band that is reversed or that the system refuses, an unknown measure, a
        system without forcing.

    Notes
    -----
    Cost, for the impact damper on two cores: a second for 200 values, 16 starts and 300 periods, which ``so_far`` is
    given first; half a second to two seconds a branch.

    Examples
    --------
    >>> import vibroimpact as vi
    >>> damper = vi.ImpactDamper(mass_ratio=0.1, omega_n=0.5, zeta=0.045, restitution=0.8,
    ...                          half_clearance=5.0, omega=1.2)
    >>> response = vi.frequency_response(damper, "omega", (1.1, 1.2), points=5, starts=2,
    ...                                  progress=False)
    >>> [answer.motion for answer in response.at(1.15) if answer.stable]
    ['1-1-1']
    """
    chosen = band_of(system, parameter, bounds, unit)
    first = with_parameter(system, parameter, chosen.low)
    if not mechanism_of(first).forces:
        raise InvalidParameterError(
            f"system: has no forcing, so there is no response over {parameter}. Add forces."
        )
    measured = measure_of(first, measure)
    for name, value, least in (
        ("points", points, 2),
        ("most_branches", most_branches, 0),
        ("depth", depth, 0),
    ):
        check_count(name, value, least)
    check_memory("points", points, BYTES_PER_VALUE, "Take fewer.")
    nonnegative("settle_periods", settle_periods)
    positive("periods", periods)
    check_steps(steps, progress)
    check_flag("inadmissible", inadmissible)
    if so_far is not None and not is_function(so_far):
        raise refusal("so_far", so_far, "a function of a Response, or None")
    simulation = Simulation(
        first, parameter, measured, start if start is not None else rest_of(first),
        _starts(starts, seed, first, chosen, start), float(settle_periods), float(periods),
        {} if workers is None else {"workers": workers},
    )  # fmt: skip
    values = chosen.values(points)

    def found() -> Response:
        return Response(
            first, chosen, measured, tuple(search.curves), values, tuple(map(tuple, answers)), simulation,
            tuple(search.notes), search.interrupted,
        )  # fmt: skip

    with Reporter(progress, "frequency response") as report:
        report.say(f"simulating {points} values of {parameter}")
        answers = simulation.answers(values)
        following = Following(parameter, steps or STEPS, STOP_WHEN, inadmissible, report.say)
        search = _Search(simulation, chosen, following, most_branches, depth)
        if so_far is not None:
            search.tell = lambda: so_far(found())
        try:
            search.without_impacts(values)
            search.tell()
            search.branches(answers)
        except KeyboardInterrupt:
            search.interrupted = True
    return found()


def _starts(
    starts: Any, seed: int, system: System, band: Band, start: State | None
) -> RandomStarts | GridStarts | ListedStarts | None:
    """Starts beside the one that is followed."""
    if isinstance(starts, RandomStarts | GridStarts | ListedStarts):
        return starts
    check_count("starts", starts, 0)
    if not starts:
        return None
    base = start if start is not None else rest_of(system)
    sampled = [
        with_parameter(system, band.parameter, v) for v in band.values(SAMPLED_MACHINES).tolist()
    ]
    return random_starts(system, sampled, starts, seed, base)


class _Search:
    """Curves found so far."""

    def __init__(
        self,
        simulation: Simulation,
        band: Band,
        following: Following,
        most_branches: int,
        depth: int,
    ) -> None:
        self.simulation, self.band, self.following = simulation, band, following
        self.most_branches, self.depth = most_branches, depth
        self.tree = Tree((band.low, band.high), following)
        self.curves: list[ResponseCurve] = []
        self.notes: list[str] = []
        self.interrupted = False
        self.tell: Callable[[], object] = lambda: None  # is called after every new curve
        self.measured = 0  # so many of the branches
        self.tree.added = self._measure
        self.failed: dict[str, int] = {}
        self.rubs = any(e.slipping for e in mechanism_of(simulation.system).elements)

    @property
    def bounds(self) -> tuple[float, float]:
        """The band in the unit of the parameter."""
        return self.band.low, self.band.high

    def without_impacts(self, values: Floats) -> None:
        """The curve of the motion without impacts."""
        s = self.simulation
        curve = curve_without_impacts(s.system, s.parameter, values, s.measure)
        if isinstance(curve, str):
            self.notes.append(f"no motion without impacts: {curve}")
            return
        self.curves += [curve] if self.following.inadmissible else existing(curve)
        if not self.curves:
            self.notes.append("no motion without impacts: it would cross a stop all over the band")

    def branches(self, answers: list[list[Answer]]) -> None:
        """Branches from simulated orbits, then from the graze of the motion without impacts."""
        size = max(
            (abs(a.value) for many in answers for a in many if math.isfinite(a.value)), default=1.0
        )
        while len(self.tree.branches) < self.most_branches and not self.interrupted:
            seed = self._next(answers, size or 1.0)
            if seed is None:
                break
            self._follow(seed)
        for orbit in self._grazing():
            if len(self.tree.branches) < self.most_branches and not self.interrupted:
                self._follow(orbit)
        left = {a.motion for many in answers for a in many if self._open(a, size or 1.0)}
        if left and not self.interrupted:
            self.notes.append(f"not followed: {_listed(sorted(left, key=_order))}")

    def _open(self, answer: Answer, size: float) -> bool:
        """Whether a simulated motion may be an orbit, of impacts or friction, on no curve."""
        rubs = answer.motion == "no impacts" and self.rubs
        return (answer.periodic or rubs) and not any(c.holds(answer, size) for c in self.curves)

    def _next(self, answers: list[list[Answer]], size: float) -> Orbit | None:
        """An orbit of the kind of motion with most members that is on no curve yet."""
        kinds: dict[str, list[Answer]] = {}
        for answer in (a for many in answers for a in many if self._open(a, size)):
            if self.failed.get(answer.motion, 0) < TRIED_MOTIONS:
                kinds.setdefault(answer.motion, []).append(answer)
        for kind in sorted(kinds, key=lambda k: -sum(a.members for a in kinds[k])):
            here = kinds[kind]
            while self.failed.get(kind, 0) < TRIED_MOTIONS:
                share = (0.5, 0.25, 0.75)[self.failed.get(kind, 0)]
                seed = self._orbit(here[int(share * (len(here) - 1))])
                if seed is not None:
                    return seed
                self.failed[kind] = self.failed.get(kind, 0) + 1
        return None

    def _orbit(self, answer: Answer) -> Orbit | None:
        """The orbit on which a simulated motion settled, if it is new."""
        system = with_parameter(self.simulation.system, self.simulation.parameter, answer.parameter)
        assert answer.state is not None
        try:
            orbit = find_orbit(system, answer.state)
        except InvalidParameterError as error:
            self.notes.append(f"{answer.motion}: {error}")
            self.failed[answer.motion] = TRIED_MOTIONS
            return None
        return (
            orbit
            if orbit.converged and orbit.admissible and not self._known(orbit, answer)
            else None
        )

    def _known(self, orbit: Orbit, answer: Answer) -> bool:
        loop, m = loop_of(orbit), orbit.mechanism
        count = len(orbit.signature.impacts)
        return any(
            same_loop(loop, loop_of(other), m, SAME_ORBIT_RELATIVE)
            for branch in self.tree.branches
            if len(branch.family.signature.impacts) == count
            for other in orbits_at(branch, answer.parameter)
        )

    def _follow(self, orbit: Orbit) -> None:
        """Follow the branch of an orbit, and those reached from it."""
        number = len(self.tree.branches)
        which = f"branch {number}, {orbit.symbol}"
        try:
            branch = self.following.branch(orbit, self.bounds, which)
        except InvalidParameterError as error:
            self.notes.append(f"{orbit.symbol} was not followed: {error}")
            self.failed[orbit.symbol] = TRIED_MOTIONS
            return
        self.tree.grow(branch, self.depth, self.most_branches)
        self.interrupted = self.interrupted or self.tree.interrupted
        self._measure()  # what an interruption has left
        self.failed[orbit.symbol] = self.failed.get(orbit.symbol, 0) + 1

    def _measure(self) -> None:
        """Measure the branches that are new."""
        for branch in self.tree.branches[self.measured :]:
            self.following.report(f"measuring {branch.symbol}, {len(branch)} points")
            curve = curve_of_branch(branch, self.simulation.measure)
            self.measured += 1
            if not self._is_without_impacts(curve):
                self.curves.append(curve)
                self.tell()

    @property
    def _silent(self) -> list[ResponseCurve]:
        """Curves of motions without impacts in closed form."""
        return [curve for curve in self.curves if curve.branch is None]

    def _is_without_impacts(self, curve: ResponseCurve) -> bool:
        """Whether a branch is that of the motions in closed form: its orbits have no events where no element acts."""
        if curve.branch is None:
            return False
        family, middle = curve.branch.family, float(curve.parameter[len(curve.parameter) // 2])
        if not family.signature.eventless or family.codes != (FREE_MODE,):
            return False
        return any(len(known.stretches(middle)) for known in self._silent)

    def _grazing(self) -> Iterator[Orbit]:
        """Orbits that begin where the motion without impacts touches a rigid stop."""
        touches = [point.parameter for curve in self._silent for point in curve.special_points]
        yield from (orbit for value in touches if (orbit := self._touching(value)) is not None)

    def _touching(self, value: float) -> Orbit | None:
        """The orbit with an impact of no speed at a graze, where it is isolated and new."""
        near = SAME_TOUCH_OF_BAND * (self.band.high - self.band.low)
        if any(
            point.record in (ZERO, GR) and abs(point.parameter - value) <= near
            for curve in self.curves
            if curve.branch is not None
            for point in curve.special_points
        ):
            return None
        system = with_parameter(self.simulation.system, self.simulation.parameter, value)
        m, motion = mechanism_of(system), free_motion(system)
        if isinstance(motion, str) or m.switching:
            return None
        nearest = min(motion.reaches, key=lambda reach: reach.gap)
        flights = motion.flights()
        time = flights.signal(lambda code: flights.rows.gap(code, nearest.stop.contact)).place(
            largest=nearest.stop.side > 0
        )
        state = flights.state_at(time)
        guess = Guess(state[None], np.array([motion.period]))
        impacts = [Stop(*nearest.stop)]
        try:
            orbit = find_orbit(system, guess, stops=impacts, cycles=motion.cycles)
        except InvalidParameterError:
            return None
        return orbit if orbit.converged else None
