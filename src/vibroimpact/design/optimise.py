"""The best machine: parameters that make the worst, or the mean, of a measure least.

Method      Differential evolution, seeded, from a Sobol sequence of machines [storn1997]: SciPy's, each
            generation one population of lanes (objective.py). It finds machines that are good at
            the values of the band and from the starts that it saw; so the best ones, unlike each
            other, are judged again with ``refine`` times as many of both, and the best of these is
            improved: by linear programmes of exact gradients, where the worst motions are periodic
            (minimax.py), else by the simplex method of Nelder and Mead, SciPy's too.
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
import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np

from vibroimpact._core.checks import LARGEST_SEED, check_count, check_progress
from vibroimpact._core.errors import InvalidParameterError
from vibroimpact._core.lazy import xr
from vibroimpact._core.progress import ProgressOption, Reporter
from vibroimpact._core.types import Floats
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
from vibroimpact.results.result import Result

FEWEST_MACHINES = 16  # a generation has so many machines at least
MACHINES_PER_PARAMETER = 10  # a generation has about so many, rounded to a power of two
LAST_SHARE_OF_BUDGET = 0.05  # the last improvements may take this share of all machines
LAST_MACHINES_PER_PARAMETER = 25  # they may take so many in any case
LARGEST_LAST_SHARE_OF_BUDGET = 0.25  # they never take a larger share
MOST_FINALISTS = 32  # so many machines are judged again at most
FINALIST_DISTANCE_OF_BOUNDS = 0.02  # these lie so far apart, relative to the bounds
# Verification takes so many times as many values and starts, and another seed.
VERIFYING_REFINEMENT = 2
FIRST_SIMPLEX_OF_BOUNDS = 0.05  # the first simplex has this size, relative to the bounds
LAST_SIMPLEX_OF_BOUNDS = 1e-4  # the method ends at a simplex of this size, relative to the bounds
DIFFERENCE_OF_BOUNDS = 0.005  # central differences take this step, relative to the bounds
TOLERATED_DECIBELS = 1.0  # a machine in an Interval is worse than the best by so much at most
SCANNED_MACHINES = 8  # a scan takes so many to each side of the best machine
SCAN_BISECTIONS = 5  # the end of an Interval is bisected so many times after the scan
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
        Its objective.
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
    machines: int
    why_stopped: str
    interrupted: bool
    history: tuple[tuple[int, ...], tuple[float, ...]] = field(repr=False)
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

    @cached_property
    def verified(self) -> float:
        """The objective with twice as many values of the band and starts as the last judge.

        The starts are others, and values between those of the band are added. Somewhat worse than
        :attr:`value`, for which the machine was chosen.
        """
        seed = self.objective.seed + 1
        found = self.judge.finer(VERIFYING_REFINEMENT, seed=seed).values(self._row[None])
        return float(found[0])

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

        Each range is that around the optimum, by a scan to each bound and bisection, with some 40 machines per
        parameter: seconds, the first time.
        """
        return self._robust

    @cached_property
    def _robust(self) -> dict[str, Interval]:
        return robust_of(self.search, self._row, self.value)

    @property
    def _row(self) -> Floats:
        return np.array(list(self.parameters.values()))

    def to_dataset(self) -> xr.Dataset:
        """Convert to a dataset: every machine tried, and the best.

        Returns
        -------
        Dataset
            Along ``machine``: the parameters, value (NaN of machines that are not allowed, or have
            none); along ``parameter``: best, sensitivity, its error, and the robust range low, high;
            scalars reduction_db, machines.
        """
        names = list(self.parameters)
        table, worth = np.array(self.search.table), np.array(self.search.worth)
        valued = np.where(worth < UNVALUED_WORTH, self.objective.sign * worth, math.nan)
        robust, sensitivity = self.robust(), self.sensitivity
        across = {
            "best": list(self.parameters.values()),
            "sensitivity": [sensitivity[n].value for n in names],
            "sensitivity_error": [sensitivity[n].error for n in names],
            "robust_low": [robust[n].low for n in names],
            "robust_high": [robust[n].high for n in names],
        }
        tried = {n: ("machine", table[:, i], {"units": self.units[n]}) for i, n in enumerate(names)}
        return xr.Dataset(
            {
                **tried,
                "value": ("machine", valued, {"units": self.units[""], "long_name": self.label}),
                **{name: ("parameter", values) for name, values in across.items()},
                "best_value": self.value,
                "reduction_db": self.reduction_db,
            },
            coords={"parameter": np.array(names, dtype=object)},
            attrs={"objective": repr(self.objective), "why_stopped": self.why_stopped},
        )

    @property
    def label(self) -> str:
        """Text of the objective: "worst amplitude of x1 over omega"."""
        return label_of(self.judge)

    def __repr__(self) -> str:
        lines = [f"Design: {self.label} {self.value:.6g} {self.units['']}".rstrip()]
        if math.isfinite(self.reduction_db):
            lines[0] += f", {self.reduction_db:.2f} dB better than without impacts"
        lines += [
            f"  {name} = {value:.6g} {self.units[name]}".rstrip()
            for name, value in self.parameters.items()
        ]
        return "\n".join([*lines, f"  {self.machines} machines; {self.why_stopped}"])

    def __str__(self) -> str:
        seen = f"  {self.verified:.6g} {self.units['']}".rstrip()
        seen += " with twice as many values of the band and starts as the last judgement"
        kind = "exact derivatives" if self.sensitivity_exact else "derivatives by differences"
        lines = [repr(self), seen, f"  {kind} of the objective, and ranges:"]
        for name, slope in self.sensitivity.items():
            low, high, _ = self.robust()[name]
            ends = f"{low:.6g} to {high:.6g} {self.units[name]}".rstrip()
            lines.append(f"  {name}: derivative {slope.value:.4g}; within 1 dB from {ends}")
        return "\n".join(lines)


def label_of(judge: Judge) -> str:
    """Text of an objective: "worst amplitude of x1 over omega"."""
    return f"{judge.objective.kind} {judge.measure.label} over {judge.band.parameter}"


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
    store: str | os.PathLike[str] | None = None,
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
        starts, and the best is improved; 0 ends the search before.
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
        machine satisfies; a store of another search.
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
    check_progress(progress)
    judges = judge, judge.finer(max(refine, 1))
    search = Search(judges, variables, constraints_of(constraints), seed=seed)
    if store is not None:
        search.open(store)
    interrupted = False
    with Reporter(progress, "optimise") as report:
        search.report = lambda machines, best: report.say(
            f"{machines} of {budget} machines, best {best:.6g}", machines, budget
        )
        try:
            why = _evolve(search, seed, budget)
            if refine:
                why += _refined(search, budget)
        except KeyboardInterrupt:
            if not search.evaluated:
                raise KeyboardInterrupt("interrupted; no machine was judged yet.") from None
            interrupted, why = True, "interrupted; the best machine until then is kept"
    search.over()
    row = search.best
    return Design(
        judge.machine(row), search.parameters(row), search.best_value, len(search.worth), why,
        interrupted, search.history(), search.judge, search,
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
    search.level = 1
    search(finalists)
    wanted = max(
        LAST_SHARE_OF_BUDGET * budget, LAST_MACHINES_PER_PARAMETER * search.variables.low.size
    )
    left = round(min(wanted, LARGEST_LAST_SHARE_OF_BUDGET * budget))
    begun = f"; {len(finalists)} machines were judged again"
    if search.judge.objective.kind == "worst":
        steps, converged = descend(search, left)
        if steps:
            begun += f", {steps} steps by exact gradients"
        if converged:
            return f"{begun} converged"
        left -= steps
    return begun + _simplex(search, left)


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

    def good(parts: Floats) -> Any:
        """Whether machines at parts of the way to each end, shape (2 d, k), are good enough."""
        table = [
            _moved(row, i, float(row[i] + part * (end - row[i])))
            for (i, end), some in zip(ends, parts, strict=True)
            for part in some
        ]
        values = search.judge.values(np.array(table)).reshape(parts.shape)
        allowed = np.array([not any(search.violations(one)) for one in table])
        loss = np.array([-judge.decibels(v, best) for v in values.ravel()]).reshape(parts.shape)
        return (loss <= TOLERATED_DECIBELS) & allowed.reshape(parts.shape)

    scan = np.tile(np.arange(1, SCANNED_MACHINES + 1) / SCANNED_MACHINES, (len(ends), 1))
    kept = good(scan)
    whole = kept.all(axis=1)
    first = np.where(whole, SCANNED_MACHINES, np.argmin(kept, axis=1))
    inner, outer = (
        first / SCANNED_MACHINES,
        np.minimum(first + 1, SCANNED_MACHINES) / SCANNED_MACHINES,
    )
    for _ in range(SCAN_BISECTIONS):
        middle = (inner + outer) / 2.0
        fine = good(middle[:, None])[:, 0]
        inner, outer = np.where(fine, middle, inner), np.where(fine, outer, middle)
    reached = [
        float(row[i] + part * (end - row[i])) for (i, end), part in zip(ends, inner, strict=True)
    ]
    return {
        name: Interval(
            reached[2 * i], reached[2 * i + 1], (bool(whole[2 * i]), bool(whole[2 * i + 1]))
        )
        for i, name in enumerate(names)
    }


def _moved(row: Floats, i: int, value: float) -> Floats:
    """A machine with another value of one parameter."""
    moved = row.copy()
    moved[i] = value
    return moved
