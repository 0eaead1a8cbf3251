"""Pareto front of two objectives: machines of which none is better in both.

Method      Differential evolution for several objectives [robic2005]: each generation mixes machines of
            a population at random; of old and new ones together those survive that fewest
            dominate, front after front [deb2002], and within the last front those whose neighbours
            are farthest. All machines that were tried are kept; those on the front of all are judged
            once more with ``refine`` times as many members, from other starts, and what is dominated then
            is dropped: the front has these values, not those for which its machines were chosen.
Accuracy    no machine of the front is dominated by another that was tried; better ones may exist
Reference   [robic2005], [deb2002]
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from vibroimpact._core.checks import (
    LARGEST_SEED,
    check_count,
    check_index,
    check_progress,
    refusal,
)
from vibroimpact._core.errors import InvalidParameterError
from vibroimpact._core.lazy import xr
from vibroimpact._core.progress import ProgressOption, Reporter, interruptible
from vibroimpact._core.types import Count, Flags, Floats
from vibroimpact.design.objective import Judge, Objective, judge_of
from vibroimpact.design.optimise import label_of, sobol
from vibroimpact.design.search import (
    Constraint,
    Variables,
    constraints_of,
    nowhere,
    variables_of,
    violations_of,
)
from vibroimpact.machines.units import units_of
from vibroimpact.model.parameters import with_parameters
from vibroimpact.model.system import System
from vibroimpact.results.result import Result, sized

GENERATION_MACHINES = 32  # a generation has so many machines
DIFFERENCE_WEIGHT = 0.5  # differential evolution adds this part of a difference of two machines
CROSSOVER_PROBABILITY = 0.7  # with this probability a parameter is taken from the mutated machine


@dataclass(frozen=True, eq=False)
class ParetoFront(Result):
    """Machines of which none is better in both objectives, sorted by the first.

    Attributes
    ----------
    names, table
        Names and values, shape (k, d), of the parameters that vary.
    values
        Both objectives, shape (k, 2).
    machines
        Number of machines that were tried.
    interrupted
        Whether ``KeyboardInterrupt`` ended the search; the front until then is kept.
    """

    system: System
    names: tuple[str, ...] = field(metadata=sized("parameter"))
    table: Floats = field(metadata=sized("machine", "parameter"), repr=False)
    values: Floats = field(metadata=sized("machine", "objective"), repr=False)
    machines: Count
    interrupted: bool
    judges: tuple[Judge, ...] = field(repr=False)

    def __len__(self) -> int:
        return len(self.table)

    def machine(self, index: int) -> System:
        """The machine of a number on the front."""
        check_index("index", index, len(self))
        row = self.table[index].tolist()
        return with_parameters(self.system, dict(zip(self.names, row, strict=True)))

    @property
    def labels(self) -> tuple[str, ...]:
        """Texts of the objectives."""
        return tuple(map(label_of, self.judges))

    def to_dataset(self) -> xr.Dataset:
        """Convert to a dataset along ``machine``: parameters, first, second."""
        units = units_of(self.system)
        columns = {
            name: (units.quantity_of(name), self.table[:, i]) for i, name in enumerate(self.names)
        }
        words = dict(zip(("first", "second"), self.labels, strict=True))
        for i, name in enumerate(words):
            columns[name] = self.judges[i].measure.dimension, self.values[:, i]
        return xr.Dataset(
            {
                name: (
                    "machine", values,
                    {"long_name": words.get(name, name)} | units.attrs(of),
                )
                for name, (of, values) in columns.items()
            }
        )  # fmt: skip


@interruptible
def pareto_front(
    system: System,
    bounds: Mapping[str, tuple[float, float]],
    objectives: Sequence[Objective],
    *,
    constraints: Constraint | Sequence[Constraint] = (),
    seed: int = 0,
    budget: int = 1000,
    refine: int = 2,
    workers: int | None = None,
    progress: ProgressOption = True,
) -> ParetoFront:
    """Find machines that are a best compromise of two objectives.

    Parameters
    ----------
    system, bounds, constraints, seed, workers
        As for :func:`~vibroimpact.optimise`.
    objectives
        Two, each an :class:`~vibroimpact.Objective`. Where they differ in
        the measure only, both come from the same simulations.
    budget
        Machines that are tried, at most, >= 64.
    refine
        Machines on the front are judged again with so many times as many members, from other starts; >= 1.
    progress
        True shows it on standard error after 2 s; a function gets a :class:`~vibroimpact.ProgressReport` after
        every generation.

    Returns
    -------
    ParetoFront
        Ctrl-C keeps the front so far.

    Raises
    ------
    InvalidParameterError
        As :func:`~vibroimpact.optimise`.

    Examples
    --------
    >>> import vibroimpact as vi
    >>> damper = vi.ImpactDamper(mass_ratio=0.1, omega_n=1.0, zeta=0.02, restitution=0.6,
    ...                          half_clearance=10.0, omega=1.0)
    >>> both = [vi.Objective("omega", (0.9, 1.1), what, points=5, starts=2, settle_periods=50)
    ...         for what in ("x1", "impact speed")]
    >>> front = vi.pareto_front(damper, {"half_clearance": (2.0, 30.0)}, both, budget=64,
    ...                         progress=False)
    >>> bool((front.values[1:, 1] < front.values[:-1, 1]).all())
    True
    """
    variables = variables_of(system, bounds)
    judges = _judges(system, objectives, variables.names, workers)
    check_count("seed", seed, 0, LARGEST_SEED)
    check_count("budget", budget, 2 * GENERATION_MACHINES)
    check_count("refine", refine, 1)
    for judge in judges:
        judge.check_finer(refine)
    check_progress(progress)
    search = _Compromises(judges, variables, constraints_of(constraints))
    interrupted = False
    with Reporter(progress, "pareto front") as report:
        try:
            search.evolve(
                seed, budget, lambda n: report.say(f"{n} of {budget} machines", n, budget)
            )
            search.judge_again(refine)
        except KeyboardInterrupt:
            if not len(search.table):
                raise
            interrupted = True
    table, worth = search.front()
    own = worth * np.array([judge.objective.sign for judge in judges])
    return ParetoFront(
        system, variables.names, table, own, search.tried, interrupted, search.judges
    )


def _judges(
    system: System, objectives: Any, names: tuple[str, ...], workers: int | None
) -> tuple[Judge, ...]:
    if not isinstance(objectives, Sequence) or len(objectives) != 2:
        raise refusal("objectives", objectives, "two objectives")
    return tuple(judge_of(system, one, names, workers) for one in objectives)


class _Compromises:
    """Machines tried for two objectives."""

    def __init__(
        self, judges: tuple[Judge, ...], variables: Variables, constraints: tuple[Constraint, ...]
    ) -> None:
        self.judges, self.variables, self.constraints = judges, variables, constraints
        self.table, self.worth = np.empty((0, len(variables.names))), np.empty((0, len(judges)))
        self.tried = 0

    def evolve(self, seed: int, budget: int, report: Callable[[int], None]) -> None:
        """Differential evolution."""
        rng = np.random.default_rng(seed)
        low, high = self.variables.low, self.variables.high
        table = sobol(low, high, GENERATION_MACHINES, seed)
        worth = self._try(table)
        report(self.tried)
        if not np.isfinite(worth).any():
            self._refuse()
        while self.tried + GENERATION_MACHINES <= budget:
            a, b, c = table[
                np.argsort(rng.random((GENERATION_MACHINES, GENERATION_MACHINES)), axis=1)[:, :3]
            ].swapaxes(0, 1)
            mutant = a + DIFFERENCE_WEIGHT * (b - c)
            mutant = np.where(
                (mutant < low) | (mutant > high), rng.uniform(low, high, a.shape), mutant
            )
            crossed = rng.random(a.shape) < CROSSOVER_PROBABILITY
            crossed[
                np.arange(GENERATION_MACHINES), rng.integers(len(low), size=GENERATION_MACHINES)
            ] = True
            trial = np.where(crossed, mutant, table)
            both = np.vstack([table, trial]), np.vstack([worth, self._try(trial)])
            kept = _survivors(both[1])
            table, worth = both[0][kept], both[1][kept]
            report(self.tried)

    def judge_again(self, times: int) -> None:
        """Judge those on the front with more members, and forget the rest."""
        coarse, (table, _) = self.judges, self.front()
        self.judges = tuple(judge.finer(times, seed=judge.objective.seed + 1) for judge in coarse)
        try:
            worth = self._judged(table)
        except KeyboardInterrupt:
            self.judges = coarse
            raise
        self.table, self.worth = table, worth

    def front(self) -> tuple[Floats, Floats]:
        """Machines that no other one dominates, by the first objective; equal ones once."""
        valued = np.flatnonzero(np.isfinite(self.worth).all(axis=1))
        worth = self.worth[valued]
        rows = valued[~_dominated(worth)]
        _, once = np.unique(self.worth[rows], axis=0, return_index=True)
        rows = rows[once]
        return self.table[rows], self.worth[rows]

    def _try(self, table: Floats) -> Floats:
        """Evaluate both objectives of new machines, infinite for those not allowed; all are kept."""
        names = self.variables.names
        allowed = [
            not any(violations_of(self.constraints, dict(zip(names, row, strict=True))))
            for row in table.tolist()
        ]
        worth = np.full((len(table), len(self.judges)), math.inf)
        if any(allowed):
            worth[allowed] = self._judged(table[allowed])
        self.table, self.worth = np.vstack([self.table, table]), np.vstack([self.worth, worth])
        self.tried += len(table)
        return worth

    def _judged(self, table: Floats) -> Floats:
        """Values of both objectives in the sense that less is better, infinite without one."""
        signs = np.array([judge.objective.sign for judge in self.judges])
        worth = Judge.values_of(self.judges, table).T * signs
        return np.where(np.isfinite(worth).all(axis=1, keepdims=True), worth, math.inf)

    def _refuse(self) -> None:
        names = self.variables.names
        machines = [dict(zip(names, row, strict=True)) for row in self.table.tolist()]
        if all(any(violations_of(self.constraints, one)) for one in machines):
            raise InvalidParameterError(nowhere(self.constraints, machines))
        raise InvalidParameterError(
            f"objectives: none of {len(machines)} machines has both; their motions do not reach the "
            "end of the window."
        )


def _dominated(worth: Floats) -> Flags:
    """Whether another row is at least as good in all objectives and better in one."""
    one, other = worth[:, None], worth[None]
    better = np.all(other <= one, axis=2) & np.any(other < one, axis=2)
    return np.asarray(np.any(better, axis=1))


def _survivors(worth: Floats) -> Any:
    """Rows that survive: front after front, the least crowded of the last one."""
    left, kept = np.arange(len(worth)), list[int]()
    while True:
        front = left[~_dominated(worth[left])]
        if len(kept) + len(front) >= GENERATION_MACHINES:
            order = np.argsort(-_crowding(worth[front]), kind="stable")
            return np.array([*kept, *front[order[: GENERATION_MACHINES - len(kept)]]])
        kept += front.tolist()
        left = np.setdiff1d(left, front)


def _crowding(worth: Floats) -> Floats:
    """Distance of the neighbours of each row on a front, infinite at its ends."""
    total = np.zeros(len(worth))
    for column in worth.T:
        order = np.argsort(column, kind="stable")
        values = np.nan_to_num(column[order], posinf=1e300)
        apart = np.full(len(column), math.inf)
        apart[1:-1] = (values[2:] - values[:-2]) / ((values[-1] - values[0]) or 1.0)
        total[order] += apart
    return total
