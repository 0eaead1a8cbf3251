"""Search for a design: parameters that vary, constraints, and every machine that was tried.

Method      Every machine that a search asks for is kept in the order of the questions, with its
            value. A search that is repeated with the same seed asks the same questions, and those
            that are in the record already are answered from it: so a search that was stopped goes
            on where it stopped, and ends as if it had not been, bit for bit.
"""

from __future__ import annotations

import itertools
import math
import os
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from vibroimpact._core.checks import ends_of, is_function, path_of, real, refusal
from vibroimpact._core.errors import InvalidParameterError
from vibroimpact._core.files import check_target, only_writer
from vibroimpact._core.lazy import xr
from vibroimpact._core.types import Count, Floats
from vibroimpact.design.objective import Judge
from vibroimpact.model.mechanism import Mechanism
from vibroimpact.model.parameters import parameter_value, with_parameters, with_values
from vibroimpact.model.system import System, mechanism_of
from vibroimpact.results.files import NETCDF, load, save
from vibroimpact.results.result import sized

Constraint = Callable[[dict[str, float]], float]

INFEASIBLE_WORTH = 1e100  # a machine that is not allowed is worse than any motion
UNVALUED_WORTH = 1e50  # a machine whose motion has no value is worse than any that has one


class Variables(NamedTuple):
    """Parameters that vary, and their bounds, shape (d,) each."""

    names: tuple[str, ...]
    low: Floats
    high: Floats

    @staticmethod
    def dims_of() -> dict[str, tuple[str, ...]]:
        """Dims of its entries."""
        return {"names": ("parameter",), "low": ("parameter",), "high": ("parameter",)}


def variables_of(system: System, bounds: Any) -> Variables:
    """Check what varies: parameters of the system, and bounds that it admits.

    Raises
    ------
    InvalidParameterError
        Nothing, an unknown parameter, bounds that are reversed or that the system refuses.
    """
    if not isinstance(bounds, Mapping) or not bounds:
        raise refusal("bounds", bounds, "a dictionary from names of parameters to (low, high)")
    ends = []
    for name, pair in bounds.items():
        parameter_value(system, name)
        ends.append(ends_of(f"bounds[{name!r}]", pair))
    for corner in itertools.product(*ends):
        values = dict(zip(bounds, corner, strict=True))
        try:
            mechanism_of(with_parameters(system, values))
        except InvalidParameterError as error:
            text = str(error)
            named = with_values(text, values) if isinstance(system, Mechanism) else text
            raise InvalidParameterError(f"bounds: {named}") from error
    low, high = np.array(ends).T
    return Variables(tuple(bounds), low, high)


@dataclass(eq=False)
class Search:
    """Machines tried so far, best first on request."""

    # what is judged: of the search, and with more and more members for the last machines
    judges: list[Judge]
    variables: Variables  # what varies
    constraints: tuple[Constraint, ...] = ()  # functions of the parameters that must be >= 0
    store: str | os.PathLike[str] | None = None  # file in which the record is kept, or None
    # called with (machines, best value) after every group of machines
    report: Callable[[int, float], object] | None = None
    seed: Count = 0  # of the search, which the store must share
    refine: Count = 0  # the same
    # every machine that was evaluated: its parameters, (k, d), its value in the sense that less is better, and the
    # number of its judge
    table: list[Floats] = field(metadata=sized("machine"), default_factory=list)
    worth: list[float] = field(metadata=sized("machine"), default_factory=list)
    levels: list[Count] = field(metadata=sized("machine"), default_factory=list)
    # how many machines had been evaluated after each group
    groups: list[Count] = field(default_factory=list)
    evaluated: Count = 0  # how many of them this search has come to; the others are of the store
    level: Count = 0  # number of the judge in use

    def __call__(self, table: Floats) -> Floats:
        """Worth of machines, shape (k, d) to (k,): less is better; those not allowed are worst."""
        known = self.table[self.evaluated : self.evaluated + len(table)]
        replayed = len(known) == len(table) and np.array_equal(known, table)
        if not replayed:
            self._drop_rest()
            worth = self._computed(np.asarray(table, dtype=float))
            self.table += list(np.array(table, dtype=float))
            self.worth += worth.tolist()
            self.levels += [self.level] * len(worth)
            self.groups.append(len(self.table))
        at, self.evaluated = self.evaluated, self.evaluated + len(table)
        if not replayed and self.store is not None:
            save(self._record(), self.store)
        if self.report is not None:
            self.report(self.evaluated, self.best_value)
        return np.array(self.worth[at : self.evaluated])

    def over(self) -> None:
        """End the search: what a store holds beyond it is dropped, and nothing is reported."""
        self._drop_rest()
        self.report = self.store = None
        self.level = self.levels[-1]
        del self.judges[self.level + 1 :]

    def sharpen(self, times: int, seed: int = 0) -> None:
        """Take a judge with ``times`` as many steps over the band and starts as the last one."""
        self.judges.append(self.judge.finer(times, seed=seed))
        self.level = len(self.judges) - 1

    def seen_before(self, row: Floats) -> float:
        """Objective of a machine by the judge before the one in use."""
        k = next(
            k for k, known in enumerate(self.table)
            if self.levels[k] == self.level - 1 and np.array_equal(known, row)
        )  # fmt: skip
        return self.judge.objective.sign * self.worth[k]

    @property
    def best_before(self) -> float:
        """Objective of the machine that was best by the judge before the one in use."""
        levels = np.array(self.levels[: self.evaluated])
        worth = np.array(self.worth[: self.evaluated])
        return self.judge.objective.sign * float(worth[levels == self.level - 1].min())

    def _drop_rest(self) -> None:
        """Drop the machines of the store that this search has not come to."""
        for column in (self.table, self.worth, self.levels):
            del column[self.evaluated :]
        self.groups = [k for k in self.groups if k <= self.evaluated]

    @property
    def judge(self) -> Judge:
        """The judge in use."""
        return self.judges[self.level]

    @property
    def seen(self) -> tuple[Floats, Floats]:
        """Machines of the finest judge so far, and their worth: shapes (k, d), (k,)."""
        count = self.evaluated
        rows = [k for k in range(count) if self.levels[k] == self.levels[count - 1]]
        table = np.reshape(self.table[:count], (count, len(self.variables.names)))
        return table[rows], np.array(self.worth[:count])[rows]

    @property
    def best(self) -> Floats:
        """Parameters of the best machine so far.

        Raises
        ------
        InvalidParameterError
            No machine was allowed; the message names the constraint.
        """
        table, worth = self.seen
        k = int(np.argmin(worth))
        if worth[k] >= INFEASIBLE_WORTH:
            raise InvalidParameterError(self._nowhere())
        if worth[k] >= UNVALUED_WORTH:
            raise InvalidParameterError(
                f"objective: none of {len(worth)} machines has a value: their motions do not reach "
                "the end of the window. Examine one of them with vi.sweep."
            )
        return np.asarray(table[k])

    @property
    def best_value(self) -> float:
        """Objective of the best machine so far; NaN without one."""
        least = self.seen[1].min(initial=math.inf)
        return self.judge.objective.sign * float(least) if least < UNVALUED_WORTH else math.nan

    def finalists(self, count: int, apart: float) -> Floats:
        """The best machines, no two of them closer than ``apart`` of the bounds in all parameters."""
        table, worth = self.seen
        width = self.variables.high - self.variables.low
        found: list[Floats] = []
        for k in np.argsort(worth, kind="stable"):
            far = [np.max(np.abs(table[k] - one) / width) > apart for one in found]
            if worth[k] < UNVALUED_WORTH and all(far):
                found.append(table[k])
            if len(found) == count:
                break
        return np.array(found)

    def history(self) -> tuple[tuple[int, ...], tuple[float, ...]]:
        """Machines evaluated, and the best objective by their judge, after each group of machines."""
        best: list[float] = []
        worth, levels = np.array(self.worth), np.array(self.levels)
        for count in self.groups:
            least = worth[:count][levels[:count] == levels[count - 1]].min()
            value = self.judge.objective.sign * float(least)
            best.append(value if least < UNVALUED_WORTH else math.nan)
        return tuple(self.groups), tuple(best)

    def parameters(self, row: Floats) -> dict[str, float]:
        """Values by name."""
        return dict(zip(self.variables.names, row.tolist(), strict=True))

    def violations(self, row: Floats) -> list[float]:
        """Amount by which each constraint is violated: 0 where it holds."""
        return violations_of(self.constraints, self.parameters(row))

    def _computed(self, table: Floats) -> Floats:
        wrong = np.array([math.fsum(self.violations(row)) for row in table])
        worth = INFEASIBLE_WORTH * (1.0 + wrong)
        allowed = np.flatnonzero(wrong == 0.0)
        if allowed.size:
            found = self.judge.objective.sign * self.judge.values(table[allowed])
            worth[allowed] = np.where(np.isfinite(found), found, UNVALUED_WORTH)
        return worth

    def _nowhere(self) -> str:
        return nowhere(self.constraints, [self.parameters(row) for row in self.table])

    # ---- the store ---------------------------------------------------------------------------

    @contextmanager
    def kept_in(self, store: str | os.PathLike[str] | None) -> Iterator[None]:
        """Keep the record in a file, if one is given, and take what an earlier search has left there."""
        if store is None:
            yield
            return
        self.store = path = path_of("store", store)
        check_target(path, (NETCDF,), "store")
        with only_writer("store", path):
            self._take_up(path)
            yield

    def _take_up(self, path: Path) -> None:
        """Take what an earlier search has left."""
        if not path.exists():
            return
        data = load(path)
        if getattr(data, "attrs", {}).get("specification") != self._specification():
            raise InvalidParameterError(
                f"store = {path}: holds another search. Name another file, or repeat that one."
            )
        try:
            table, worth, levels, groups = (
                data[name].values for name in ("table", "worth", "levels", "groups")
            )
            self._check_record(table, worth, levels, groups)
        except (KeyError, ValueError, TypeError) as error:
            raise InvalidParameterError(
                f"store = {path}: is damaged ({error}). Name another file."
            ) from error
        self.table = list(table)
        self.worth, self.levels, self.groups = worth.tolist(), levels.tolist(), groups.tolist()

    def _check_record(self, table: Any, worth: Any, levels: Any, groups: Any) -> None:
        """Refuse what no search has recorded."""
        low, high = self.variables.low, self.variables.high
        count = len(worth)
        for what, right in (
            (
                "machines",
                table.shape == (count, len(low)) and np.all((low <= table) & (table <= high)),
            ),
            ("worth", worth.shape == (count,) and np.isfinite(worth).all()),
            (
                "levels",
                levels.shape == (count,) and np.isin(np.diff(levels, prepend=0), (0, 1)).all(),
            ),
            ("groups", np.all(np.diff(groups, prepend=0) > 0) and groups[-1:].sum() <= count),
        ):
            if not right:
                raise ValueError(what)

    def _record(self) -> xr.Dataset:
        return xr.Dataset(
            {
                "table": (("machine", "parameter"), np.array(self.table)),
                "worth": ("machine", np.array(self.worth)),
                "levels": ("machine", np.array(self.levels)),
                "groups": ("group", np.array(self.groups)),
            },
            coords={"parameter": np.array(self.variables.names, dtype=object)},
            attrs={"specification": self._specification()},
        )

    def _specification(self) -> str:
        """Everything on which the answers depend, but for the bodies of constraints."""
        fixed = with_parameters(self.judges[0].system, self.parameters(self.variables.low))
        names = ", ".join(map(_name, self.constraints))
        bounds = [part.tolist() for part in self.variables[1:]]
        first = self.judges[0].objective
        return (
            f"{fixed!r}; {first!r}; {self.variables.names} {bounds}; [{names}]; {self.seed}, "
            f"{self.refine}"
        )


def constraints_of(constraints: Any) -> tuple[Constraint, ...]:
    """Check constraints: a function of the parameters, or several."""
    listed = [constraints] if callable(constraints) else constraints
    if not isinstance(listed, Sequence) or not all(map(is_function, listed)):
        raise refusal("constraints", constraints, "functions of a dictionary of the parameters")
    return tuple(listed)


def violations_of(constraints: Sequence[Constraint], parameters: dict[str, float]) -> list[float]:
    """Amount by which each constraint is violated: 0 where it holds."""
    return [max(0.0, -_value_of(one, parameters)) for one in constraints]


def _value_of(constraint: Constraint, parameters: dict[str, float]) -> float:
    """A user's function at one machine."""
    name = f"constraint {_name(constraint)}"
    try:
        value = constraint(dict(parameters))
    except (TypeError, ValueError, LookupError, AttributeError, ArithmeticError) as error:
        raise InvalidParameterError(
            f"{name}: failed ({type(error).__name__}: {error}). It takes a dictionary of the parameters that vary."
        ) from error
    return real(name, value, "a number")


def nowhere(constraints: Sequence[Constraint], machines: Sequence[dict[str, float]]) -> str:
    """Sentence: no machine is allowed, and which constraint fails most often."""
    broken = np.array([violations_of(constraints, one) for one in machines])
    name = _name(constraints[int(np.argmax((broken > 0.0).sum(axis=0)))])
    return (
        f"constraints: none of {len(machines)} machines within the bounds satisfies them; "
        f"{name} fails most often. Widen the bounds, or relax it."
    )


def _name(function: Constraint) -> str:
    """A function by name; a lambda by its number of line."""
    name = getattr(function, "__name__", repr(function))
    code = getattr(function, "__code__", None)
    return f"the one in line {code.co_firstlineno}" if name == "<lambda>" and code else name
