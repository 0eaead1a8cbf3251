"""A computation written down while it runs, so that it can be repeated where there is no Python.

Method      The compile step computes with numbers of any kind (scalars.py). Here each is a column (columns.py)
            of one entry whose array, :class:`Written`, appends to a :class:`Recording` what is done with it.
            Repeated with other inputs the operations give the bits that Python would give. A branch of the
            code is a condition of the recording: where one does not hold, the code would have gone
            another way, and another recording is needed.
Assumes     numbers are finite, so that 0 x is a zero; such terms of sums are left out
Accuracy    + - * / and sqrt are rounded once wherever they are computed. Sines, cosines, exponentials,
            logarithms and powers are those of the place where they are repeated: a last digit may differ
            Blocks of damped systems (src/decouple) are one operation, of which numbers are taken.
Fails       code that reads numbers out of a column, other than by the functions of scalars.py
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any

import numpy as np

from vibroimpact import _kernel
from vibroimpact._core.columns import COSINE, EXP, LOG, POWER, SINE, Column
from vibroimpact._core.types import Floats

# Operations with the numbers of their operands, in the order of their numbers; web/kernel/page.cpp repeats them.
OPERANDS = {
    "add": 2, "subtract": 2, "multiply": 2, "divide": 2, "negative": 1, "absolute": 1, "sqrt": 1,
    "less": 2, "less_equal": 2, "greater": 2, "greater_equal": 2, "equal": 2, "not_equal": 2,
    "isfinite": 1, "isinf": 1, "where": 3, "copysign": 2, "mantissa": 1, "exponent": 1, "floor": 1, "ldexp": 2,
    "sin": 1, "cos": 1, "exp": 1, "log": 1, "power": 2, "decouple": 3, "taken": 3,
}  # fmt: skip
OPERATIONS = tuple(OPERANDS)
DECOUPLED = ("k", "c", "positions", "velocities", "back")  # in the order of their numbers
NUMBER = {name: i for i, name in enumerate(OPERATIONS)}
NAMED = {SINE: "sin", COSINE: "cos", EXP: "exp", LOG: "log", POWER: "power"}


class Recording:
    """Operations on inputs, in order: each has a number, a name, and operands, numbers of entries.

    Entries are the inputs, then constants and results as they are first needed. ``_kernel.Recording`` does the
    same for branches, which repeat it in Python (compile/along.py); this one is for a page, which has no Python.
    """

    def __init__(self, inputs: int) -> None:
        self.inputs = inputs
        self.constants = dict[int, float]()  # by entry
        # by entry: number of the operation, operands; of `taken` the place of a number follows
        self.operations = dict[int, tuple[int, ...]]()
        self.conditions = dict[int, bool]()  # truth that an entry must have
        self._count = inputs
        self._known = dict[tuple[Any, ...], int]()

    def input(self, i: int, value: float) -> Column:
        """The input of this number, as a number to compute with."""
        return Column(Written.of(self, i, value))

    def constant(self, x: float) -> int:
        """Entry of a number that is no input."""
        key = ("constant", float(x).hex())
        if key not in self._known:
            self._known[key] = self._next()
            self.constants[self._known[key]] = float(x)
        return self._known[key]

    def entry(self, x: Any) -> int:
        """Entry of an operand."""
        return x.entry if isinstance(x, Written) else self.constant(float(np.asarray(x).item()))

    def put(self, name: str, *operands: int) -> int:
        """Entry of a result; one that is known already is not computed again."""
        short = self._shorter(name, operands)
        if short is not None:
            return short
        key = (name, *operands)
        if key not in self._known:
            at = self._known[key] = self._next()
            self.operations[at] = (NUMBER[name], *operands)
        return self._known[key]

    def operands(self, entry: int) -> tuple[int, ...]:
        """Entries on which a result depends directly."""
        name, *all_of_them = self.operations[entry]
        return tuple(all_of_them[:1] if name == NUMBER["taken"] else all_of_them)

    def require(self, entry: int, truth: bool) -> None:
        """Write down that the code took this branch."""
        if entry not in self.constants:
            self.conditions[entry] = truth

    def _next(self) -> int:
        self._count += 1
        return self._count - 1

    # ---- what need not be written ------------------------------------------------------------

    def _shorter(self, name: str, operands: tuple[int, ...]) -> int | None:
        """Entry that has the same bits already, for finite numbers."""
        if name == "add" or name == "multiply":
            needless = self._adds_nothing if name == "add" else self._is_one
            for one, other in (operands, operands[::-1]):
                if needless(one, other):
                    return one
        elif name == "divide" and self._is_one(*operands):
            return operands[0]
        elif name == "subtract":
            one, other = operands
            certain = self._is_zero(other) and not self._may_be_negative_zero(one)
            if certain or self._is(other, 0.0, 1.0):
                return one
        return None

    def _is_one(self, _: int, other: int) -> bool:
        return self.constants.get(other) == 1.0

    def _adds_nothing(self, one: int, other: int) -> bool:
        certain = self._is_zero(other) and not self._may_be_negative_zero(one)
        return certain or self._is(other, 0.0, -1.0)

    def _is(self, entry: int, value: float, sign: float) -> bool:
        x = self.constants.get(entry)
        return x == value and float(np.copysign(1.0, x)) == sign

    def _is_zero(self, entry: int) -> bool:
        """Whether an entry is a zero of either sign, whatever the inputs are."""
        if entry in self.constants:
            return self.constants[entry] == 0.0
        name, *operands = self.operations.get(entry, (-1,))
        if name in (NUMBER["multiply"], NUMBER["negative"], NUMBER["absolute"]):
            return any(map(self._is_zero, operands))
        return name == NUMBER["divide"] and self._is_zero(operands[0])

    def _may_be_negative_zero(self, entry: int) -> bool:
        if entry in self.constants:
            return self._is(entry, 0.0, -1.0)
        name, *operands = self.operations.get(entry, (-1,))
        if name == NUMBER["add"]:
            return all(map(self._may_be_negative_zero, operands))
        return name not in (NUMBER["absolute"],)

    # ---- what is kept ------------------------------------------------------------------------

    def needed(self, outputs: Iterable[int]) -> list[int]:
        """Entries of operations on which these and the conditions depend, in order."""
        found, pending = set[int](), [*outputs, *self.conditions]
        while pending:
            one = pending.pop()
            if one in self.operations and one not in found:
                found.add(one)
                pending += self.operands(one)
        return sorted(found)


class Written(np.ndarray):
    """An array of one number that writes down what is done with it."""

    recording: Recording
    entry: int

    @classmethod
    def of(cls, recording: Recording, entry: int, value: Any) -> Written:
        """Make the value of an entry."""
        out = np.array([value]).view(cls)
        out.recording, out.entry = recording, entry
        return out

    def plain(self) -> np.ndarray:
        """The value without what is written."""
        return self.view(np.ndarray)

    def __array_ufunc__(self, ufunc: np.ufunc, method: str, *inputs: Any, **options: Any) -> Any:
        if method != "__call__" or options:
            return NotImplemented
        values = [x.plain() if isinstance(x, Written) else x for x in inputs]
        result, r = ufunc(*values), self.recording
        at = [r.entry(x) for x in inputs]
        if ufunc is np.frexp:
            names = ("mantissa", "exponent")
            return tuple(
                Written.of(r, r.put(name, *at), part[0])
                for name, part in zip(names, result, strict=True)
            )
        name = NAMED.get(ufunc, ufunc.__name__)
        if name not in NUMBER:
            return NotImplemented
        number = float(result[0]) if ufunc in NAMED else result[0]
        return Written.of(r, r.put(name, *at), number)

    def __array_function__(
        self, function: Callable[..., Any], types: Any, args: Iterable[Any], kwargs: Any
    ) -> Any:
        if function is np.where:
            r = self.recording
            truth, x, y = args
            if not isinstance(truth, Written):
                return x if np.asarray(truth).item() else y
            chosen = r.put("where", *(r.entry(a) for a in (truth, x, y)))
            picked = np.where(*(a.plain() if isinstance(a, Written) else a for a in args))
            return Written.of(r, chosen, picked[0])
        if function is np.ravel:  # numeric_value(): a unit of the machine, which moves no digit
            return self.plain().ravel()
        raise TypeError(f"{function.__name__} cannot be written down")

    def decoupled(self, arrays: Sequence[Any], _: tuple[int, ...], n: int) -> dict[str, Any]:
        """Blocks of a system of unit masses (compile/decoupling.py): arrays of one system, of written numbers."""
        r = self.recording
        halves = np.array([float(np.asarray(x).item()) for x in arrays]).reshape(2, 1, n, n)
        found = _kernel.decouple(halves[0], halves[1])
        at = r.put("decouple", *(r.entry(x) for x in arrays))
        out: dict[str, Any] = {"found": Written.of(r, at, found["found"][0])}
        place = 0
        for name in DECOUPLED:
            flat = np.empty(found[name].size, dtype=object)
            for i, x in enumerate(found[name].ravel().tolist()):
                flat[i] = Written.of(r, r.put("taken", at, place + i), x)
            out[name] = flat.reshape(found[name].shape)
            place += flat.size
        return out

    def reshape(self, *_: Any, **__: Any) -> Any:
        """Return the number itself: there is one system."""
        return self

    def all(self, *_: Any, **__: Any) -> Any:
        """Whether it is true; the answer becomes a condition."""
        truth = bool(self.plain()[0])
        self.recording.require(self.entry, truth)
        return truth

    def any(self, *_: Any, **__: Any) -> Any:
        """Whether it is true: the same of one number."""
        return self.all()

    def astype(self, *_: Any, **__: Any) -> Any:
        """Return the number itself: results are floats already."""
        return self


def repeated(inputs: Sequence[float], recording: Mapping[str, Any]) -> list[float] | None:
    """Entries of a recording (page_data.py) for other inputs; None where a condition does not hold.

    The page does this in WebAssembly. Here it says which recordings serve for which parameters.
    """
    e, tables = [*inputs, *recording["constants"]], dict[int, float]()
    with np.errstate(all="ignore"):
        for number, a, b, c in recording["code"]:
            name = OPERATIONS[number]
            if name == "decouple":
                found = _decoupled([e[i] for i in recording["lists"][b:]], a)
                e.append(float(found["found"][0]))
                numbers = np.concatenate([found[one].ravel() for one in DECOUPLED])
                tables |= {c + i: x for i, x in enumerate(numbers.tolist())}
            elif name == "taken":
                e.append(tables[b])
            else:
                e.append(float(DOES[name](*(np.float64(e[i]) for i in (a, b, c)))))
    held = all((e[at] != 0.0) == bool(truth) for at, truth in recording["conditions"])
    return e if held else None


def _decoupled(numbers: Sequence[float], n: int) -> dict[str, Floats]:
    halves = np.array(numbers[: 2 * n * n]).reshape(2, 1, n, n)
    return _kernel.decouple(halves[0], halves[1])


def _power(x: float, y: float) -> float:
    return x * x if y == 2.0 else float(np.exp(y * np.log(x)))


DOES: dict[str, Callable[[Any, Any, Any], Any]] = {
    "where": lambda x, y, z: y if x else z,
    "mantissa": lambda x, _, __: np.frexp(x)[0],
    "exponent": lambda x, _, __: np.frexp(x)[1],
    "ldexp": lambda x, y, _: np.ldexp(x, int(y)),
    "power": lambda x, y, _: _power(x, y),
    **{
        name: (lambda f: lambda x, _, __: f(x))(getattr(np, name))
        for name in ("negative", "absolute", "sqrt", "isfinite", "isinf", "floor", "sin", "cos", "exp", "log")
    },
    **{
        name: (lambda f: lambda x, y, _: f(x, y))(getattr(np, name))
        for name in (
            "add", "subtract", "multiply", "divide", "less", "less_equal", "greater", "greater_equal",
            "equal", "not_equal", "copysign",
        )
    },
}  # fmt: skip
