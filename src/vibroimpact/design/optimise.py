"""The best machine: parameters that make the worst, or the mean, of a measure least.

Method      Differential evolution, seeded, from a Sobol sequence of machines [storn1997]: SciPy's, each
            generation one population of lanes (objective.py). It finds machines that are good at
            the values of the band and from the starts that it saw; so the best ones, unlike each
            other, are judged again with ``refine`` times as many of both, and the best of these is
            improved: by linear programmes of exact gradients, where the worst motions are periodic
            (minimax.py), else by the simplex method of Nelder and Mead, SciPy's too.
            A search finds what its judge does not see. So the best of the last machines, unlike each
            other, are verified with twice as many values and starts, others than before, one after the
            other until none that is left was better in the search than the best verified one, which is
            the result. Where its verified value is worse by more than TOLERATED_EXCESS than the best
            that the search saw, the judge that verified takes over: the best machine is improved with
            it, and the best are verified with twice as many of both again. Such a round improves with a
            fourth of the machines of the one before, each of which costs four times as much, and verifies half
            as many; there are FURTHER_ROUNDS at most.
            Sensitivities of a worst value: where the worst motion is a stable periodic orbit,
            the exact derivative of its measure; the value of the band at which it is worst moves, too,
            but to first order the maximum does not feel that (envelope theorem). Else, and for
            means, central differences.
Assumes     the members of the objective show the motions that matter
Fails       steps of the objective have no derivative: the error of differences is then large
Reference   [storn1997]
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from os import PathLike
from typing import Any, Literal, NamedTuple

import numpy as np

from vibroimpact._core.checks import LARGEST_SEED, check_count, check_progress
from vibroimpact._core.errors import InvalidParameterError
from vibroimpact._core.lazy import xr
from vibroimpact._core.progress import ProgressOption, Reporter, interruptible
from vibroimpact._core.quantities import with_unit
from vibroimpact._core.types import AnyFloat, Count, Floats, Integers
from vibroimpact.design.minimax import descend, gradient, motion_of
from vibroimpact.design.objective import Judge, Member, Objective, judge_of
from vibroimpact.design.search import (
    UNVALUED_WORTH,
    Constraint,
    Search,
    constraints_of,
    variables_of,
)
from vibroimpact.machines.units import units_of
from vibroimpact.measures.motions import Motion
from vibroimpact.model.system import System
from vibroimpact.response.response import Response, frequency_response
from vibroimpact.results.result import Result, plotting

FEWEST_MACHINES = 16  # a generation has so many machines at least
MACHINES_PER_PARAMETER = 10  # a generation has about so many, rounded to a power of two
LAST_SHARE_OF_BUDGET = 0.05  # the last improvements may take this share of all machines
LAST_MACHINES_PER_PARAMETER = 25  # they may take so many in any case
LARGEST_LAST_SHARE_OF_BUDGET = 0.25  # they never take a larger share
MOST_FINALISTS = 32  # so many machines are judged again at most
FINALIST_DISTANCE_OF_BOUNDS = 0.02  # these lie so far apart, relative to the bounds
# Verification takes so many times as many values and starts, and another seed.
VERIFYING_REFINEMENT = 2
VERIFIED_MACHINES = 8  # so many of the last machines are verified
# a verified value may be worse by so much than the one before, relative to it
TOLERATED_EXCESS = 0.05
FURTHER_ROUNDS = 2  # the search goes on so often at most where it is worse by more
# a round has this share of the machines of the one before
ROUND_SHARE = 1 / VERIFYING_REFINEMENT**2
BOUND_OF_BOUNDS = 1e-3  # a parameter that is so near to a bound, relative to both, is at the bound
FIRST_SIMPLEX_OF_BOUNDS = 0.05  # the first simplex has this size, relative to the bounds
LAST_SIMPLEX_OF_BOUNDS = 1e-4  # the method ends at a simplex of this size, relative to the bounds
DIFFERENCE_OF_BOUNDS = 0.005  # central differences take this step, relative to the bounds
TOLERATED_DECIBELS = 1.0  # a machine in an Interval is worse than the best by so much at most
SCANNED_MACHINES = 8  # a scan takes so many to each side of the best machine at most
SCAN_BISECTIONS = 5  # the end of an Interval is bisected so many times after the scan
REPORT_VALUES = 60  # the response of the best machine in a report has so many values of the band
REPORT_STARTS = 6  # it has so many starts at each
REPORT_BRANCHES = 4  # it has so many branches at most
CONSTANT_RELATIVE_RANGE = 1e-9  # an objective that varies by less over all machines is constant


class Interval(NamedTuple):
    """Range of a parameter within which the objective is as good as the best to 1 dB."""

    # its ends
    low: float
    high: float
    # whether (low, high) are bounds of the parameter: the range might be wider
    to_bounds: tuple[bool, bool]


class Sensitivity(NamedTuple):
    """Derivative of the objective by a parameter."""

    value: float  # the derivative
    # whether it is that of a periodic orbit; else it is a central difference, next to a bound of a place two steps
    # inside, 1 % of the bounds
    exact: bool
    error: float  # difference from the result of twice the step; 0 where the derivative is exact


@dataclass(frozen=True, eq=False)
class Design(Result):
    """The best machine that was found.

    Attributes
    ----------
    system
        The machine.
    parameters
        Its parameters that were varied.
    value
        Its objective, verified: with twice as many values of the band and starts as it was chosen by, others
        than those.
    searched
        Its objective as the search saw it, by the judge before: somewhat better, since it was chosen for it.
    machines
        Number of machines that were tried.
    why_stopped
        A sentence.
    interrupted
        Whether ``KeyboardInterrupt`` ended the search; the best machine until then is kept.
    history
        Machines tried, and the best objective, after each generation.
    """

    system: System
    parameters: dict[str, float]
    value: float
    searched: float
    machines: Count
    why_stopped: str
    interrupted: bool
    history: tuple[tuple[Count, ...], tuple[AnyFloat, ...]] = field(repr=False)
    judge: Judge = field(repr=False)
    search: Search = field(repr=False)

    @property
    def objective(self) -> Objective:
        """The objective by which the machine was judged."""
        return self.judge.objective

    @cached_property
    def units(self) -> dict[str, str]:
        """Units in words, by name of a parameter, and "" for the objective."""
        units = units_of(self.system)
        found = {name: units.unit(units.quantity_of(name)) for name in self.parameters}
        return found | {"": units.unit(self.judge.measure.dimension)}

    @cached_property
    def reduction_db(self) -> float:
        """Decibels by which it is better than the machine as given with all its stops open.

        20 lg of the ratio, 10 lg for a power. A machine without stops is compared with the one that
        was given. NaN where that has no value, or a value of 0.
        """
        return self.judge.decibels(self.value, self.judge.without_impacts)

    @property
    def excess(self) -> float:
        """By how much :attr:`value` is worse than :attr:`searched`, relative to that; 0 where both vanish."""
        return excess_of(self.value, self.searched, self.objective)

    @cached_property
    def worst(self) -> Member:
        """The simulated motion that is worst: its measure, machine, and a state on it."""
        return self.judge.worst(self._row)

    @cached_property
    def worst_motion(self) -> Motion | None:
        """Periodic orbit, or motion without impacts, of the worst motion where that is stable; else None."""
        return motion_of(self.worst, self.judge)

    @cached_property
    def sensitivity(self) -> dict[str, Sensitivity]:
        """Derivatives of the objective by the parameters."""
        if self.objective.kind == "worst" and self.worst_motion is not None:
            motion = self.worst_motion
            slopes = gradient(self.worst, motion, self.judge).tolist()
            return {
                name: Sensitivity(slope, True, 0.0)
                for name, slope in zip(self.parameters, slopes, strict=True)
            }
        return _differences(self.search, self._row)

    @property
    def sensitivity_exact(self) -> bool:
        """Whether these are exact derivatives of a periodic motion."""
        return all(one.exact for one in self.sensitivity.values())

    def robust(self) -> dict[str, Interval]:
        """Compute ranges of each parameter, the others at their best, that cost less than 1 dB.

        Each range is that around the optimum, by a scan to each bound and bisection. The first time this takes some
        25 machines per parameter, each judged as the best one was verified: seconds, or minutes where that took
        further rounds.
        """
        return self._robust

    @cached_property
    def _robust(self) -> dict[str, Interval]:
        return robust_of(self.search, self._row, self.value)

    @property
    def _row(self) -> Floats:
        return np.array(list(self.parameters.values()))

    @property
    def at_bounds(self) -> dict[str, Literal["lower", "upper"]]:
        """Bound at which a parameter is, by name of those that are at one: beyond it there may be better machines."""
        names, low, high = self.search.variables
        near = BOUND_OF_BOUNDS * (high - low)
        below, above = self._row - low <= near, high - self._row <= near
        return {
            name: "lower" if lower else "upper"
            for name, lower, upper in zip(names, below, above, strict=True)
            if lower or upper
        }

    def to_dataset(self) -> xr.Dataset:
        """Convert to a dataset: every machine tried, what each judge saw of it, and the best.

        Returns
        -------
        Dataset
            Along ``machine``: the parameters. Along ``judge`` and ``machine``: value, NaN of machines that it
            did not judge, are not allowed, or have none. Along ``judge``: points and starts of the band, the
            last being that of the verified value. Along ``parameter``: best, bound ("lower", "upper" or ""),
            sensitivity, its error, and the robust range low, high; scalars best_value, searched_value,
            reduction_db.
        """
        names = list(self.parameters)
        tried, which = np.unique(np.array(self.search.table), axis=0, return_inverse=True)
        worth, levels = np.array(self.search.worth), np.array(self.search.levels)
        value = np.full((len(self.search.judges), len(tried)), math.nan)
        valued = worth < UNVALUED_WORTH
        value[levels[valued], which[valued]] = self.objective.sign * worth[valued]
        robust, sensitivity = self.robust(), self.sensitivity
        across = {
            "best": list(self.parameters.values()),
            "bound": np.array([self.at_bounds.get(n, "") for n in names], dtype=object),
            "sensitivity": [sensitivity[n].value for n in names],
            "sensitivity_error": [sensitivity[n].error for n in names],
            "robust_low": [robust[n].low for n in names],
            "robust_high": [robust[n].high for n in names],
        }
        seen = [judge.objective for judge in self.search.judges]
        entries = units_of(self.system).of_entries(names)
        slopes = ", ".join(f"{n} [{self.units[''] or 1}/({self.units[n] or 1})]" for n in names)
        by_entry = dict.fromkeys(("best", "robust_low", "robust_high"), entries)
        if entries:
            slope = {"units_of_entries": slopes}
            by_entry |= {"sensitivity": slope, "sensitivity_error": slope}
        attrs = {"long_name": self.label} | ({"units": self.units[""]} if self.units[""] else {})
        return xr.Dataset(
            {
                **{
                    n: ("machine", tried[:, i], {"units": self.units[n]} if self.units[n] else {})
                    for i, n in enumerate(names)
                },
                "value": (("judge", "machine"), value, attrs),
                "points": ("judge", [one.points for one in seen]),
                "starts": ("judge", [one.starts for one in seen]),
                **{
                    name: (
                        "parameter",
                        values,
                        by_entry.get(name, {}),
                    )
                    for name, values in across.items()
                },
                "best_value": ((), self.value, attrs),
                "searched_value": ((), self.searched, attrs),
                "reduction_db": ((), self.reduction_db, {"units": "dB"}),
            },
            coords={"parameter": np.array(names, dtype=object)},
            attrs={"objective": repr(self.objective), "why_stopped": self.why_stopped},
        )

    def report(
        self, path: str | PathLike[str], *, title: str = "", progress: ProgressOption = True
    ) -> None:
        """Write a report for readers who do not know the field: one HTML page.

        It has the machine, the parameters with what each may stray, the response before and after, every steady
        motion of the best machine over the band, and what the statement rests on.

        Parameters
        ----------
        path
            Name of the file, which ends in .html; an earlier one is replaced.
        title
            Heading; by default the machine.
        progress
            As for :func:`~vibroimpact.frequency_response`, which is computed for the best machine.

        Raises
        ------
        InvalidParameterError
            Another suffix, no such folder.
        """
        page = plotting("design_report")
        page.write_report(self, lambda: self.response(progress=progress), path, title=title)

    def response(self, *, progress: ProgressOption = True) -> Response:
        """Compute the frequency response of the best machine over the band of the objective, as a report shows it."""
        seen = self.search.judges[0].objective
        return frequency_response(
            self.system, seen.parameter, seen.bounds, measure=seen.measure, unit=seen.unit,
            seed=seen.seed, points=REPORT_VALUES, starts=REPORT_STARTS, most_branches=REPORT_BRANCHES,
            progress=progress,
        )  # fmt: skip

    @property
    def label(self) -> str:
        """Text of the objective: "worst amplitude of x1 over omega"."""
        return label_of(self.judge)

    def __repr__(self) -> str:
        unit, at = self.units[""], self.at_bounds
        lines = [f"Design: {self.label} {with_unit(self.value, unit=unit)}"]
        if math.isfinite(self.reduction_db):
            lines[0] += f", {self.reduction_db:.2f} dB better than without impacts"
        for name, value in self.parameters.items():
            line = f"  {name} = {with_unit(value, unit=self.units[name])}"
            lines.append(line + (f", its {at[name]} bound" if name in at else ""))
        searched = with_unit(self.searched, unit=unit)
        lines.append(f"  {searched} in the search, by half as many values of the band and starts")
        return "\n".join([*lines, f"  {self.machines} machines; {self.why_stopped}"])

    def __str__(self) -> str:
        kind = "exact derivatives" if self.sensitivity_exact else "derivatives by differences"
        lines = [repr(self), f"  {kind} of the objective, and ranges:"]
        for name, slope in self.sensitivity.items():
            low, high, _ = self.robust()[name]
            ends = with_unit(low, high, unit=self.units[name])
            lines.append(f"  {name}: derivative {slope.value:.4g}; within 1 dB from {ends}")
        return "\n".join(lines)


def excess_of(value: float, searched: float, objective: Objective) -> float:
    """By how much a value is worse than another, relative to that."""
    more = objective.sign * (value - searched)
    return more / abs(searched) if searched else math.copysign(math.inf, more) if more else 0.0


def label_of(judge: Judge) -> str:
    """Text of an objective: "worst amplitude of x1 over omega"."""
    return f"{judge.objective.kind} {judge.measure.label} over {judge.band.parameter}"


@interruptible
def optimise(
    system: System,
    bounds: Mapping[str, tuple[float, float]],
    objective: Objective,
    *,
    constraints: Constraint | Sequence[Constraint] = (),
    seed: int = 0,
    budget: int = 2000,
    refine: int = 4,
    workers: int | None = None,
    progress: ProgressOption = True,
    store: str | PathLike[str] | None = None,
) -> Design:
    """Find the parameters of a machine for which an objective is best.

    Parameters
    ----------
    system
        A forced machine: a :class:`~vibroimpact.Mechanism`, a :class:`~vibroimpact.Family`, or
        anything with a ``mechanism``. The parameters that do not vary are its own.
    bounds
        (low, high) by name of a parameter.
    objective
        An :class:`~vibroimpact.Objective`.
    constraints
        Functions of a dictionary of the varied parameters that must be >= 0:
        ``lambda p: 0.1 - p["mass_ratio"]``.
    seed
        Seed of the search; with that of the objective it determines the result to the last bit.
    budget
        Machines that the search tries, at most, >= 32; the last
        improvements try 25 per parameter more, or a twentieth of the budget, but at most a quarter of it.
    refine
        The best 32 machines are judged again with so many times as many values of the band, and of
        starts, and the best is improved; 0 ends the search before. The best of the last machines are
        verified in any case; where that shows that the search saw too little, it goes on with more values and
        starts, twice at most, unless ``refine`` is 0.
    workers
        Threads; by default one per core.
    progress
        True shows it on standard error after 2 s; a function gets a :class:`~vibroimpact.ProgressReport` after
        every generation. A ``KeyboardInterrupt`` that it raises ends the search as Ctrl-C does.
    store
        A file, ``.nc``, in which every machine that was tried is kept after each generation. The
        same call with that file goes on where an interrupted one stopped, and ends with the same
        result as one that was not interrupted.

    Returns
    -------
    Design
        Ctrl-C ends the search and keeps the best machine so far.

    Raises
    ------
    InvalidParameterError
        No such parameter; bounds that are reversed, or that the machine refuses; a band or a measure
        that it does not have; an objective that is the same for all machines; constraints that no
        machine satisfies; a store of another search, or one to which another process writes.
    KeyboardInterrupt
        Ctrl-C before the first machines are judged.

    Notes
    -----
    Cost: ``budget`` machines of the cost that :class:`~vibroimpact.Objective` states; for an impact
    damper with three parameters and the defaults about 25 s on two cores. Sensitivity and the
    robust range are computed when they are read, with 4 and some 40 machines per parameter.
    Bodies of constraints are not compared with those of a store, only their names.

    Examples
    --------
    >>> import vibroimpact as vi
    >>> damper = vi.ImpactDamper(mass_ratio=0.1, omega_n=1.0, zeta=0.02, restitution=0.6,
    ...                          half_clearance=10.0, omega=1.0)
    >>> best = vi.optimise(damper, {"half_clearance": (2.0, 30.0)},
    ...                    vi.Objective("omega", (0.9, 1.1), "x1", points=5, starts=2, settle_periods=50),
    ...                    budget=48, progress=False)
    >>> 5.0 < best.parameters["half_clearance"] < 20.0 and best.reduction_db > 3.0
    True
    """
    variables = variables_of(system, bounds)
    judge = judge_of(system, objective, variables.names, workers)
    for name, value, least in (("budget", budget, 2 * FEWEST_MACHINES), ("seed", seed, 0)):
        check_count(name, value, least)
    check_count("seed", seed, 0, LARGEST_SEED)
    check_count("refine", refine, 0)
    judge.check_finer(refine)
    check_progress(progress)
    search = Search([judge], variables, constraints_of(constraints), seed=seed, refine=refine)
    unit, interrupted = units_of(system).unit(judge.measure.dimension), False
    with search.kept_in(store), Reporter(progress, "optimise") as report:

        def told(machines: int, best: float) -> None:
            seen = search.judge.objective
            text = f"{machines} of {budget} machines, best {with_unit(best, unit=unit)}"
            if search.level:
                text = f"{machines} machines, best of the last {with_unit(best, unit=unit)}"
                text += f", by {seen.points} values of the band and {seen.starts} starts"
            report.say(text, machines, max(budget, machines))

        search.report = told
        try:
            why = _evolve(search, seed, budget)
            if refine:
                why += _refined(search, budget)
            why += _verified(search, budget, FURTHER_ROUNDS if refine else 0)
        except KeyboardInterrupt:
            if not search.evaluated:
                raise
            interrupted, why = True, "interrupted; the best machine until then is kept"
    search.over()
    if interrupted:
        _verify(search, 1)
    row = search.best
    return Design(
        judge.machine(row), search.parameters(row), search.best_value, search.seen_before(row),
        len(search.worth), why, interrupted, search.history(), search.judge, search,
    )  # fmt: skip


# ---- the two stages ------------------------------------------------------------------------------


def _evolve(search: Search, seed: int, budget: int) -> str:
    """Run differential evolution; return why it stopped."""
    from scipy.optimize import differential_evolution

    low, high = search.variables.low, search.variables.high
    count = 2 ** round(math.log2(max(FEWEST_MACHINES, MACHINES_PER_PARAMETER * len(low))))
    while 2 * count > budget:
        count //= 2

    def worth(columns: Floats) -> Floats:
        found = search(columns.T)
        if search.evaluated == count:
            _refuse_constant(search)
        return found

    try:
        found = differential_evolution(
            worth, list(zip(low, high, strict=True)), maxiter=budget // count - 1,
            init=sobol(low, high, count, seed), rng=np.random.default_rng(seed),
            vectorized=True, updating="deferred", polish=False, tol=1e-3, atol=0.0,
        )  # fmt: skip
    except RuntimeError as error:  # SciPy's, in place of the objective's own
        raise error.__cause__ or error from None
    if found.success:
        return f"all {count} machines of generation {found.nit} are equally good to 0.1 %"
    return f"the budget was spent after {found.nit} generations of {count} machines"


def sobol(low: Floats, high: Floats, count: int, seed: int) -> Floats:
    """First machines, spread evenly over the bounds: shape (count, d)."""
    from scipy.stats.qmc import Sobol

    drawn = Sobol(len(low), rng=np.random.default_rng(seed)).random(count)
    return np.asarray(low + (high - low) * drawn)


def _refuse_constant(search: Search) -> None:
    """Refuse an objective that does not depend on the parameters."""
    worth = np.array(search.worth)
    valued = worth[worth < UNVALUED_WORTH]
    if not valued.size:
        _ = search.best  # names what is wrong
    elif len(valued) > 1 and np.ptp(valued) <= CONSTANT_RELATIVE_RANGE * np.abs(valued).max():
        raise InvalidParameterError(
            f"objective: {label_of(search.judge)} is {search.best_value:.6g} for all {len(valued)} "
            f"machines of the first generation; it does not depend on "
            f"{', '.join(search.variables.names)}. Vary others, or measure something else."
        )


def _refined(search: Search, budget: int) -> str:
    """Judge the best machines more finely, and improve the best of them; return how it ended."""
    finalists = search.finalists(MOST_FINALISTS, FINALIST_DISTANCE_OF_BOUNDS)
    search.sharpen(search.refine)
    search(finalists)
    return f"; {len(finalists)} machines were judged again" + _improved(
        search, _last(search, budget)
    )


def _last(search: Search, budget: int) -> int:
    """How many machines the last improvements may take."""
    each = LAST_MACHINES_PER_PARAMETER * search.variables.low.size
    return round(
        min(max(LAST_SHARE_OF_BUDGET * budget, each), LARGEST_LAST_SHARE_OF_BUDGET * budget)
    )


def _improved(search: Search, left: int) -> str:
    """The best machine improved by the judge in use, with so many machines at most; how it ended."""
    begun = ""
    if search.judge.objective.kind == "worst":
        steps, converged = descend(search, left)
        if steps:
            begun = f", {steps} steps by exact gradients"
        if converged:
            return f"{begun} converged"
        left -= steps
    return begun + _simplex(search, left)


def _verify(search: Search, most: int) -> None:
    """Judge the best machines, no two alike, with more members and other starts, so many at most."""
    _ = search.best  # refuses a search without any
    finalists = search.finalists(most, FINALIST_DISTANCE_OF_BOUNDS)
    search.sharpen(VERIFYING_REFINEMENT, seed=search.judge.objective.seed + 1)
    sign, least = search.judge.objective.sign, math.inf
    for row in finalists:
        if least <= sign * search.seen_before(row):
            break
        least = min(least, float(search(row[None])[0]))


def _verified(search: Search, budget: int, rounds: int) -> str:
    """Verification, and further rounds where the search saw too little; how it ended."""
    objective, share, most, done = search.judge.objective, 1.0, VERIFIED_MACHINES, 0
    _verify(search, most)
    while (
        done < rounds
        and excess_of(search.best_value, search.best_before, objective) > TOLERATED_EXCESS
    ):
        share, most, done = share * ROUND_SHARE, most // 2, done + 1
        _improved(search, round(share * _last(search, budget)))
        _verify(search, most)
    text = f"; verified after {done} further round{'s' * (done > 1)}" if done else "; verified"
    excess = excess_of(search.best_value, search.seen_before(search.best), objective)
    if excess > TOLERATED_EXCESS:
        text += f", {excess:.0%} worse than in the search: raise points and starts of the objective"
    return text


def _simplex(search: Search, left: int) -> str:
    """Run the simplex method from the best machine; return how it ended."""
    from scipy.optimize import minimize

    low, high = search.variables.low, search.variables.high
    width = high - low
    begin = (search.best - low) / width
    corners = np.tile(begin, (len(low) + 1, 1))
    edge = FIRST_SIMPLEX_OF_BOUNDS
    for i in range(len(low)):
        corners[i + 1, i] += edge if begin[i] + edge <= 1.0 else -edge
    if left <= len(low) + 1:
        return ""
    found = minimize(
        lambda at: float(search((low + width * np.clip(at, 0.0, 1.0))[None])[0]), begin,
        method="Nelder-Mead", bounds=[(0.0, 1.0)] * len(low),
        options={"initial_simplex": corners, "maxfev": left, "xatol": LAST_SIMPLEX_OF_BOUNDS, "fatol": 0.0},
    )  # fmt: skip
    ended = "converged" if found.success else "was stopped"
    return f", the simplex method {ended} after {found.nfev} more"


# ---- about the best ------------------------------------------------------------------------------


def _differences(search: Search, row: Floats) -> dict[str, Sensitivity]:
    """Central differences, of two steps, within the bounds."""
    names, low, high = search.variables
    steps = DIFFERENCE_OF_BOUNDS * (high - low)
    inside = np.clip(row, low + 2.0 * steps, high - 2.0 * steps)
    table = np.array(
        [
            _moved(row, i, inside[i] + k * steps[i])
            for i in range(len(row))
            for k in (-2.0, -1.0, 1.0, 2.0)
        ]
    )
    values = search.judge.values(table).reshape(-1, 4)
    fine = (values[:, 2] - values[:, 1]) / (2.0 * steps)
    rough = (values[:, 3] - values[:, 0]) / (4.0 * steps)
    return {
        name: Sensitivity(float(fine[i]), False, float(abs(fine[i] - rough[i])))
        for i, name in enumerate(names)
    }


def robust_of(search: Search, row: Floats, best: float) -> dict[str, Interval]:
    """Range of each parameter around a machine that costs less than 1 dB."""
    names, low, high = search.variables
    judge, count = search.judge, len(row)
    ends = [(i, end) for i in range(count) for end in (float(low[i]), float(high[i]))]

    def good(some: Integers, parts: Floats) -> Any:
        """Whether machines at parts of the way to some of the ends are good enough."""
        places = ((ends[k], part) for k, part in zip(some, parts, strict=True))
        table = [_moved(row, i, float(row[i] + part * (end - row[i]))) for (i, end), part in places]
        values = search.judge.values(np.array(table))
        allowed = np.array([not any(search.violations(one)) for one in table])
        loss = np.array([-judge.decibels(value, best) for value in values])
        return (loss <= TOLERATED_DECIBELS) & allowed

    reached, going = np.zeros(len(ends)), np.arange(len(ends))
    rounds = SCANNED_MACHINES + SCAN_BISECTIONS
    with Reporter(True, "ranges") as reporter:
        for k in range(1, SCANNED_MACHINES + 1):
            reporter.say(f"{k} of at most {rounds} scans", k, rounds)
            going = going[good(going, np.full(len(going), k / SCANNED_MACHINES))]
            reached[going] = k / SCANNED_MACHINES
            if not going.size:
                break
        whole, step = reached == 1.0, 1.0 / SCANNED_MACHINES
        left = np.flatnonzero(~whole)
        for k in range(SCAN_BISECTIONS if left.size else 0):
            reporter.say(f"{SCANNED_MACHINES + k + 1} of at most {rounds} scans")
            step /= 2.0
            reached[left] += step * good(left, reached[left] + step)
    at = [
        float(row[i] + part * (end - row[i])) for (i, end), part in zip(ends, reached, strict=True)
    ]
    return {
        name: Interval(at[2 * i], at[2 * i + 1], (bool(whole[2 * i]), bool(whole[2 * i + 1])))
        for i, name in enumerate(names)
    }


def _moved(row: Floats, i: int, value: float) -> Floats:
    """A machine with another value of one parameter."""
    moved = row.copy()
    moved[i] = value
    return moved
