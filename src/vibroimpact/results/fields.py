"""What the fields of objects may hold: read from their declaration, and compared with what a file gives.

Method      a field is declared once, where its class is: by the words of ``_core/types.py``, many of which name a range
            (``Count``, ``Positive``, ``Rising``), and by the dims of ``along``, ``rows``, ``sized``. Here each word has
            its meaning, and a declaration becomes a check                                                     (1)
            plain ``float``, ``Floats`` and ``Complexes`` are finite; those of ``Any...`` may be NaN or infinite (2)
            arrays with one dim have one length, in an object and in those that are merged into its dataset     (3)
Fails       InvalidParameterError that names class and field; a name that is no class, such as a protocol, admits all
"""

from __future__ import annotations

import ast
import functools
import inspect
import re
import sys
from collections import Counter
from collections.abc import Callable, Hashable, Iterable, Iterator, Mapping
from dataclasses import dataclass, fields, is_dataclass, replace
from typing import Any, Literal, cast, get_args, get_origin

import numpy as np

from vibroimpact._core.checks import shown
from vibroimpact._core.errors import InvalidParameterError
from vibroimpact.results.result import ATTRS, DIMS, MERGED, ROWS, SIZES

ADVICE = "Give what vibroimpact.save wrote."
FULL_TURN = 2.0 * np.pi

Check = Callable[[Any], str]
"""What is wrong with a value, to be put behind the name of its field; empty if nothing is."""


def _all(_: Any) -> bool:
    return True


@dataclass(frozen=True)
class Word:
    """Meaning of a word of a declaration."""

    held: str | tuple[type, ...]  # kinds of numbers of an array, or types of one value
    allowed: str  # what it must be, in words
    right: Callable[[Any], Any] = _all  # of one value, or of all numbers of an array at once

    def __call__(self, value: Any) -> str:
        """What is wrong with a value."""
        if isinstance(self.held, str):
            return self._of_array(value)
        if not isinstance(value, self.held) or (isinstance(value, bool) and bool not in self.held):
            return f" = {shown(value)}: must be {self.allowed}"
        return "" if self.right(value) else f" = {shown(value)}: must be {self.allowed}"

    def _of_array(self, value: Any) -> str:
        kind = getattr(getattr(value, "dtype", None), "kind", " ")
        if kind not in self.held:
            return f" = {shown(value)}: must be an array of {self.allowed}"
        right = np.broadcast_to(self.right(value), value.shape)
        if right.all():
            return ""
        place = np.argwhere(~right)[0]
        return f"{place.tolist()} = {value[tuple(place)]}: must be {self.allowed}"


def _rising(values: Any) -> Any:
    return np.isfinite(values) & (np.diff(values, prepend=values[:1]) >= 0.0)


SYMBOL = re.compile(
    r"((\d+-)?(\d+|inf)-(\d+|inf)(,(\d+|inf)-(\d+|inf))*( \(contact \d+(, \d+)*\))?)?"
)


def _above_0_together(values: Any) -> Any:
    return np.isfinite(values) & (np.sum(values) > 0.0)


def _are_bounds(pair: tuple[Any, ...]) -> bool:
    right = len(pair) == 2 and not any(map(WORDS["float"], pair))
    return right and bool(pair[0] < pair[1])


def _are_any_bounds(pairs: tuple[Any, ...]) -> bool:
    two = len(pairs) == 2 and all(isinstance(one, tuple) for one in pairs)
    return all(map(_are_bounds, pairs)) if two else _are_bounds(pairs)


REAL, WHOLE = (int, float), (int,)
WORDS: dict[str, Word] = {  # (1), (2)
    "str": Word((str,), "a text"),
    "bool": Word((bool,), "True or False"),
    "int": Word(WHOLE, "a whole number"),
    "Sign": Word(WHOLE, "-1, 0 or 1", lambda x: abs(x) <= 1),
    "Symbol": Word((str,), "a symbol n-p-q, or empty", SYMBOL.fullmatch),
    "Count": Word(WHOLE, "a whole number >= 0", lambda x: x >= 0),
    "float": Word(REAL, "a finite number", np.isfinite),
    "Index": Word(WHOLE, "a whole number >= -1", lambda x: x >= -1),
    "Share": Word(REAL, "a number from 0 to 1", lambda x: 0.0 <= x <= 1.0),
    "Bounds": Word((tuple,), "(low, high), two finite numbers with low < high", _are_bounds),
    "OneOrTwoBounds": Word((tuple,), "(low, high), or two such pairs", _are_any_bounds),
    "Positive": Word(REAL, "a finite number > 0", lambda x: np.isfinite(x) and x > 0.0),
    "Amount": Word(REAL, "a finite number >= 0", lambda x: np.isfinite(x) and x >= 0.0),
    "AnyAmount": Word(REAL, "a number >= 0, or NaN", lambda x: not x < 0.0),
    "AnyFloat": Word(REAL, "a number"),
    "complex": Word((int, float, complex), "a finite number", np.isfinite),
    "Floats": Word("f", "finite numbers", np.isfinite),
    "Amounts": Word("f", "finite numbers >= 0", lambda x: np.isfinite(x) & (x >= 0.0)),
    "Angles": Word("f", "numbers from 0 to 2 pi", lambda x: (x >= 0.0) & (x <= FULL_TURN)),
    "Rising": Word("f", "finite numbers that never fall", _rising),
    "Durations": Word("f", "finite numbers with a sum > 0", _above_0_together),
    "AnyAmounts": Word("f", "numbers >= 0, or NaN", lambda x: ~(x < 0.0)),
    "AnyFloats": Word("f", "numbers"),
    "Complexes": Word("c", "finite numbers", np.isfinite),
    "AnyComplexes": Word("c", "complex numbers"),
    "Flags": Word("b", "truth values"),
    "Integers": Word("iu", "whole numbers"),
    "Codes": Word("iu", "whole numbers"),
    "Counts": Word("iu", "whole numbers >= 0", lambda x: x >= 0),
    "Indices": Word("iu", "whole numbers >= -1", lambda x: x >= -1),
    "Sides": Word("iu", "-1, 0 or 1", lambda x: np.abs(x) <= 1),
}


def check_fields(made: Any, arguments: Mapping[str, Any], *, ranges: bool = True) -> None:
    """Refuse an object with a field that its class does not admit; without ``ranges`` by types and lengths only.

    ``arguments`` are those by which it was made; those that are no fields are checked, too.

    Raises
    ------
    InvalidParameterError
        The message names class, field and value.
    """
    kind: type = type(made)
    for name, check in _checks_of(cast(Hashable, kind), ranges).items():
        is_field = name in _declared(kind)
        if (is_field or name in arguments) and (
            wrong := check(getattr(made, name, None) if is_field else arguments[name])
        ):
            raise InvalidParameterError(f"data: {kind.__name__}.{name}{wrong}. {ADVICE}")
    _check_lengths(made)


def _check_lengths(made: Any) -> None:
    """Refuse arrays that have other lengths along a dim than those before (3); records have those of their owner."""
    lengths: dict[str, tuple[int, str]] = {}
    records = [
        (f"{name}: ", one)
        for name, said in _metadata(type(made)).items()
        for one in (getattr(made, name) if ROWS in said else ())
    ]
    for head, owner in (("", made), *records):
        for name, dim, length in _sizes(owner):
            known, first = lengths.get(dim, (length, name))
            if known != length:
                raise InvalidParameterError(
                    f"data: {type(made).__name__}.{head}{name} has length {length} along {dim}, {first} has {known}. "
                    f"{ADVICE}"
                )
            if owner is made:
                lengths[dim] = known, first


def _sizes(made: Any) -> Iterator[tuple[str, str, int]]:
    """Name of a field, a dim of it, and its length (3)."""
    for name, said in _metadata(type(made)).items():
        value = getattr(made, name)
        if value is None:
            continue
        if dims := said.get(DIMS) or said.get(SIZES):
            for part in value.values() if isinstance(value, Mapping) else [value]:
                shape = part.shape if isinstance(part, np.ndarray) else (len(part),)
                if len(shape) != len(dims):
                    raise InvalidParameterError(
                        f"data: {type(made).__name__}.{name} has shape {shape}: must have {len(dims)} dims. "
                        f"{ADVICE}"
                    )
                yield from ((name, *_length(dim, n)) for dim, n in zip(dims, shape, strict=True))
        elif ROWS in said and value:
            yield name, said[ROWS][0], len(value)
        elif MERGED in said and is_dataclass(value):
            yield from ((f"{name}.{one}", dim, n) for one, dim, n in _sizes(value))


def _length(dim: str, length: int) -> tuple[str, int]:
    """A dim and its length, of "point-1" one more than there are between the points."""
    name, _, less = dim.partition("-")
    return name, length + int(less or 0)


def _metadata(kind: Any) -> dict[str, Any]:
    """Metadata of the fields of a class; a NamedTuple has those of ``dims_of``, where it has any."""
    if is_dataclass(kind):
        return {one.name: one.metadata for one in fields(kind)}
    of_entries = getattr(kind, "dims_of", dict)
    return {name: {SIZES: dims} for name, dims in of_entries().items()}


def _declared(kind: Any) -> dict[str, Any]:
    """Types of the fields of a class, by its annotations and those of its bases."""
    found: dict[str, Any] = {}
    for base in reversed(kind.__mro__):
        found |= vars(base).get("__annotations__", {})
    texts = {name: getattr(said, "__forward_arg__", said) for name, said in found.items()}
    return {
        n: text for n, text in texts.items() if isinstance(text, str) and "ClassVar" not in text
    }


@functools.cache
def _checks_of(kind: Any, ranges: bool) -> dict[str, Check]:
    """Checks of the fields of a class by their names."""
    words = WORDS if ranges else {name: replace(word, right=_all) for name, word in WORDS.items()}
    space = {**vars(sys.modules[kind.__module__]), **words}
    made_by = inspect.unwrap(kind.__init__)
    taken = made_by.__annotations__ if inspect.isfunction(made_by) else {}
    declared = {n: text for n, text in taken.items() if isinstance(text, str)} | _declared(kind)
    found = {
        name: _check_of(ast.parse(text, mode="eval").body, space)
        for name, text in declared.items()
        if name != "return"
    }
    for name, said in _metadata(kind).items():
        if "flag_values" in (about := said.get(ATTRS, {})):
            among = functools.partial(_among_codes, about["flag_values"])
            found[name] = _both(found[name], among)
    return {name: check for name, check in found.items() if check is not _anything}


def _anything(_: Any) -> str:
    return ""


def _both(first: Check, second: Check) -> Check:
    return lambda value: first(value) or second(value)


def _among_codes(codes: Any, value: Any) -> str:
    if value is None:
        return ""
    known = np.isin(value, codes)
    return "" if known.all() else f" = {value[~known][0]}: must be one of {codes.tolist()}"


# ---- from a declaration to a check (1) -----------------------------------------------------------------


def _check_of(said: ast.expr, space: Mapping[str, Any]) -> Check:
    """Check of a type as it is written."""
    if isinstance(said, ast.Constant):
        if isinstance(said.value, str):
            return _check_of(ast.parse(said.value, mode="eval").body, space)
        return _is_none
    if isinstance(said, ast.BinOp):
        both = [_check_of(part, space) for part in (said.left, said.right)]
        return functools.partial(_one_of, both)
    if isinstance(said, ast.Subscript):
        inner = said.slice.elts if isinstance(said.slice, ast.Tuple) else [said.slice]
        name = ast.unparse(said.value)
        if name == "Literal":
            return functools.partial(_among, tuple(ast.literal_eval(one) for one in inner))
        return _check_inside(
            name, [_check_of(one, space) for one in inner], [ast.unparse(one) for one in inner]
        )
    if isinstance(said, ast.Name):
        return _check_of_object(space.get(said.id), space)
    if isinstance(said, ast.Attribute) and isinstance(said.value, ast.Name):
        return _check_of_object(getattr(space.get(said.value.id), said.attr, None), space)
    return _anything


def _check_inside(name: str, inner: list[Check], words: list[str]) -> Check:
    """Check of what holds others."""
    if name == "tuple" and words[-1] == "...":
        return functools.partial(_each, tuple, inner[0])
    if name == "tuple":
        return functools.partial(_in_order, inner)
    if name == "list":
        return functools.partial(_each, list, inner[0])
    if name in ("dict", "Mapping", "Counter"):
        return functools.partial(_by_name, inner[0], inner[1] if len(inner) > 1 else WORDS["int"])
    if name == "NDArray":
        return WORDS[KINDS[words[0]]] if words[0] in KINDS else _is_array
    return _anything


KINDS = {
    "np.complex128": "Complexes",
    "np.bool_": "Flags",
    "np.intp": "Integers",
    "np.float64": "Floats",
}


def _check_of_object(found: Any, space: Mapping[str, Any]) -> Check:
    """Check of a word, of a class, or of another name of a type."""
    if isinstance(found, Word):
        return found
    if found is not Any and isinstance(found, type) and get_origin(found) is None:
        protocol = getattr(found, "_is_protocol", False)
        return _anything if protocol or found is object else functools.partial(_is_a, found)
    if get_origin(found) is Literal:
        return functools.partial(_among, get_args(found))
    if get_origin(found) is tuple:
        return _check_of(ast.parse(str(found), mode="eval").body, space)
    return _anything


def _is_none(value: Any) -> str:
    return "" if value is None else f" = {shown(value)}: must be None"


def _is_array(value: Any) -> str:
    return "" if isinstance(value, np.ndarray) else f" = {shown(value)}: must be an array"


def _is_a(kind: type, value: Any) -> str:
    right = isinstance(value, kind) or getattr(value, "is_missing", False)
    return "" if right else f" = {shown(value)}: must be {kind.__name__}"


def _among(words: tuple[Any, ...], value: Any) -> str:
    right = any(value is one or (type(value) is type(one) and value == one) for one in words)
    return "" if right else f" = {shown(value)}: must be one of {', '.join(map(str, words))}"


def _one_of(checks: list[Check], value: Any) -> str:
    """Right if one of the checks finds it right; else what the first says that is not of None."""
    said = [check(value) for check in checks]
    if not all(said):
        return ""
    return next(
        (text for text, check in zip(said, checks, strict=True) if check is not _is_none), said[0]
    )


def _each(kind: type, check: Check, value: Any) -> str:
    if not isinstance(value, kind):
        return f" = {shown(value)}: must be a {kind.__name__}"
    several = cast(Iterable[Any], value)
    return next((f"[{k}]{wrong}" for k, one in enumerate(several) if (wrong := check(one))), "")


def _in_order(checks: list[Check], value: Any) -> str:
    if not isinstance(value, tuple) or len(value) != len(checks):
        return f" = {shown(value)}: must be {len(checks)} values"
    both = enumerate(zip(checks, value, strict=True))
    return next((f"[{k}]{wrong}" for k, (check, one) in both if (wrong := check(one))), "")


def _by_name(of_name: Check, check: Check, value: Any) -> str:
    if not isinstance(value, Mapping | Counter):
        return f" = {shown(value)}: must be a dictionary"
    for name, one in value.items():
        if wrong := of_name(name):
            return f", a name{wrong}"
        if wrong := check(one):
            return f"[{name!r}]{wrong}"
    return ""
