"""Objects as plain JSON and arrays, and back, exact to the last bit.

Method      An object is its class, by name, and the arguments of its class, which are among its attributes under
            the same names, perhaps with an underscore before. Each is written once and referred to by its number.
            Floats are written so that they come back, numbers of arrays of one type one after the other.
            Only classes and functions of ROOMS are found again, which neither read nor write files.
            Functions, and objects of classes, that are not the package's are code, which a file cannot hold: their
            names are kept, and the arguments of the class of a dataclass. Whoever reads gives the system again, and
            its function or its class is taken from there.
Fails       an object whose class was renamed since: InvalidParameterError
"""

from __future__ import annotations

import hashlib
import inspect
import json
from collections.abc import Mapping
from dataclasses import is_dataclass
from enum import Enum
from importlib import import_module
from types import FunctionType
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from vibroimpact._core.checks import shown
from vibroimpact._core.errors import InvalidParameterError
from vibroimpact._core.lazy import xr
from vibroimpact.results.fields import check_fields
from vibroimpact.results.result import check_dataset

PACKAGE = "vibroimpact"
ROOMS = (
    "attractors", "bifurcations", "branches", "compile", "continuation", "design", "machines", "measures", "model",
    "normal_forms", "orbits", "response", "simulation", "sweeps.starts", "tori", "transients",
)  # fmt: skip
Array = NDArray[Any]
Pools = dict[str, Array]  # numbers of all arrays, by the name of their type


class Tree(NamedTuple):
    """Objects as text and arrays."""

    text: str
    pools: Pools


def tree_of(result: Any, named: Mapping[str, Array]) -> Tree:
    """Write down an object with all that it holds; the text is empty for an object of another package.

    Arrays that are in ``named`` already are referred to by their names.
    """
    if _place(type(result)) is None:
        return Tree("", {})
    writer = _Writer(named)
    root = writer.written(result)
    text = json.dumps({"objects": writer.objects, "root": root})
    return Tree(text, {kind: np.concatenate(parts) for kind, parts in writer.pools.items()})


def object_of(
    tree: Tree, named: Mapping[str, Array], system: Any = None, *, ranges: bool = True
) -> Any:
    """Object of a tree; ``system`` is the one with the code that the tree lacks.

    Without ``ranges`` numbers are taken that a field does not admit.

    Raises
    ------
    InvalidParameterError
        Code in it and no system, or a system that has none of that name.
    """
    given = json.loads(tree.text)  # a depth that Python has not ends as RecursionError
    reader = _Reader(given["objects"], tree.pools, named, system, ranges=ranges)
    found = reader.read(given["root"])
    if system is not None and not reader.used:
        raise InvalidParameterError(
            f"system = {shown(system)}: the file holds its own system with all numbers. Leave it out."
        )
    return found


def _place(kind: Any) -> str | None:
    """Name by which a class or a function is found again; None for one that is not the package's."""
    module, name = getattr(kind, "__module__", None) or "", getattr(kind, "__qualname__", "<")
    if "<" in name or not f"{module}.".startswith(f"{PACKAGE}."):
        return None
    return f"{module}:{name}"


def _at(place: str) -> Any:
    """Class or function of a name that :func:`_place` gave; others are refused."""
    module, _, name = place.rpartition(":")
    ours = f"{module}.".startswith(tuple(f"{PACKAGE}.{room}." for room in ROOMS))
    found = getattr(import_module(module), name, None) if ours else None
    if _place(found) != place:
        raise InvalidParameterError(
            f"data: {shown(place)} is no class of this version of the package. Compute the result again."
        )
    return found


def _arguments(value: Any) -> dict[str, Any]:
    """Arguments by which an object is made."""
    found: dict[str, Any] = {}
    for name, one in inspect.signature(type(value)).parameters.items():
        part = getattr(value, name if hasattr(value, name) else f"_{name}")
        found |= dict(part) if one.kind is one.VAR_KEYWORD else {name: part}
    return found


def _bits(array: Array) -> tuple[Any, ...]:
    return array.dtype.str, array.shape, hashlib.sha256(array.tobytes()).digest()


def _is_dataset(value: Any) -> bool:
    return type(value).__module__.startswith("xarray.")


class _Writer:
    def __init__(self, named: Mapping[str, Array]) -> None:
        self._named: dict[Any, str] = {
            _bits(a): name for name, a in named.items() if a.dtype.kind in "fiu"
        }
        self.objects: list[Any] = []
        self.pools: dict[str, list[Array]] = {}
        self._sizes: dict[str, int] = {}
        self._known: dict[int, dict[str, Any]] = {}
        self._alive: list[Any] = []  # what ``_known`` counts on

    def written(self, value: Any) -> Any:
        """JSON of a value."""
        if isinstance(value, Enum):
            return {"enum": _place(type(value)), "name": value.name}
        if isinstance(value, np.generic):
            value = value.item()
        if value is None or isinstance(value, bool | int | float | str):
            return value
        if isinstance(value, complex):
            return {"complex": [value.real, value.imag]}
        if type(value) is list:
            return [self.written(part) for part in value]
        if type(value) is tuple:
            return {"tuple": [self.written(part) for part in value]}
        if isinstance(value, Mapping) and not _is_dataset(value):
            return {"dict": [[self.written(k), self.written(v)] for k, v in value.items()]}
        if id(value) not in self._known:
            self._alive.append(value)
            self._known[id(value)] = self._new(value)
        return self._known[id(value)]

    def _new(self, value: Any) -> dict[str, Any]:
        if isinstance(value, np.ndarray):
            return self._array(value)
        self.objects.append(None)
        number = len(self.objects) - 1
        self.objects[number] = self._object(value)
        return {"object": number}

    def _array(self, value: Array) -> dict[str, Any]:
        if value.dtype == object or value.dtype.kind == "U":
            words = [self.written(word) for word in value.ravel().tolist()]
            return {"words": words, "dtype": str(value.dtype), "shape": value.shape}
        if name := self._named.get(_bits(value)):
            return {"variable": name, "writeable": value.flags.writeable}
        kind, flat = value.dtype.name, np.ascontiguousarray(value).ravel()
        at = self._sizes.get(kind, 0)
        self.pools.setdefault(kind, []).append(flat)
        self._sizes[kind] = at + flat.size
        return {"array": kind, "at": at, "shape": value.shape, "writeable": value.flags.writeable}

    def _object(self, value: Any) -> dict[str, Any]:
        kind, place = type(value), _place(type(value))
        if _is_dataset(value):
            return {"dataset": self.written(value.to_dict(data="array"))}
        if isinstance(value, FunctionType) and (own := _place(value)):
            return {"function": own}
        if place is None and not is_dataclass(value):
            return {
                "code": getattr(value, "__qualname__", kind.__qualname__),
                "shown": shown(value),
            }
        parts = {name: self.written(part) for name, part in _arguments(value).items()}
        named = {"class": place} if place else {"code": kind.__qualname__, "shown": shown(value)}
        return named | {"arguments": parts}


class _Reader:
    def __init__(
        self,
        objects: list[Any],
        pools: Pools,
        named: Mapping[str, Array],
        system: Any,
        *,
        ranges: bool,
    ) -> None:
        self.objects, self.pools, self.named, self.system = objects, pools, named, system
        self.ranges = ranges
        self.used = False
        self._made: dict[int, Any] = {}
        self._arrays: dict[str, Array] = {}  # an array that two objects share is one again
        self._left = {kind: pool.size for kind, pool in pools.items()}

    def read(self, tree: Any) -> Any:
        """Value of its JSON."""
        if isinstance(tree, list):
            return [self.read(part) for part in tree]
        if not isinstance(tree, dict):
            return tree
        if "object" in tree:
            number = tree["object"]
            if number not in self._made:
                self._made[number] = self._object(self.objects[number])
            return self._made[number]
        if "writeable" in tree:
            return self._array(tree)
        if "words" in tree:
            words = [self.read(word) for word in tree["words"]]
            kind = np.dtype(tree["dtype"])
            if kind.kind != "O" and not (
                kind.kind == "U" and kind.itemsize <= 4 * max(map(len, words), default=1)
            ):
                raise TypeError(f"words are {kind}")
            return np.array(words, dtype=kind).reshape(tree["shape"])
        if "tuple" in tree:
            return tuple(self.read(part) for part in tree["tuple"])
        if "dict" in tree:
            return {self.read(k): self.read(v) for k, v in tree["dict"]}
        if "complex" in tree:
            return complex(*tree["complex"])
        return _at(tree["enum"])[tree["name"]]

    def _array(self, tree: dict[str, Any]) -> Array:
        key = json.dumps(tree)
        if key not in self._arrays:
            self._arrays[key] = self._new_array(tree)
        return self._arrays[key]

    def _new_array(self, tree: dict[str, Any]) -> Array:
        if "variable" in tree:
            array = np.array(self.named[tree["variable"]])
        else:
            kind, at = tree["array"], tree["at"]
            size = int(np.prod(tree["shape"], dtype=int))
            self._left[kind] -= size
            if at < 0 or self._left[kind] < 0:
                raise ValueError(f"arrays are more than the numbers {kind}")
            array = self.pools[kind][at : at + size].copy().reshape(tree["shape"])
        array.flags.writeable = tree["writeable"]
        return array

    def _object(self, tree: dict[str, Any]) -> Any:
        if "dataset" in tree:
            data = xr.Dataset.from_dict(self.read(tree["dataset"]))
            if self.ranges:
                check_dataset(data)
            return data
        if "function" in tree:
            return _at(tree["function"])
        if "code" in tree:
            return self._code(tree)
        kind = _at(tree["class"])
        if not isinstance(kind, type):
            raise TypeError(f"{kind} is no class")
        found = {name: self._argument(kind, name, part) for name, part in tree["arguments"].items()}
        made = kind(**found)
        check_fields(made, found, ranges=self.ranges)
        return made

    def _argument(self, kind: type, name: str, part: Any) -> Any:
        """An argument; a function of the user's is that of the given system."""
        stored = self.objects[part["object"]] if isinstance(part, dict) and "object" in part else {}
        if "code" in stored and type(self.system) is kind and "arguments" not in stored:
            return self._given(stored, getattr(self.system, name))
        return self.read(part)

    def _code(self, tree: dict[str, Any]) -> Any:
        if "arguments" not in tree:
            same = type(self.system).__qualname__ == tree["code"]
            return self._given(tree, self.system) if same else Missing(tree["code"], tree["shown"])
        if self.system is None:
            return Missing(tree["code"], tree["shown"])
        make = self._given(tree, type(self.system))
        return make(**{name: self.read(part) for name, part in tree["arguments"].items()})

    def _given(self, tree: dict[str, Any], given: Any) -> Any:
        self.used = True
        if getattr(given, "__qualname__", type(given).__qualname__) != tree["code"]:
            raise InvalidParameterError(
                f"system = {shown(self.system)}: the file holds a result of {tree['shown']}. Give that one."
            )
        return given


class Missing:
    """A function, or a system, that is code of the user's and was not given again."""

    is_missing = True

    def __init__(self, name: str, words: str) -> None:
        self.__name__ = self.__qualname__ = name
        self._words = words

    def __call__(self, *_: Any, **__: Any) -> Any:
        """Refuse to be called: the code is not there."""
        raise InvalidParameterError(
            f"{self._words} is code, which the file does not hold. Give the same system, vibroimpact.load(path, "
            "system), or compute the result again."
        )

    @property
    def mechanism(self) -> Any:
        """Refuse to give a mechanism: the code is not there."""
        return self()

    def __repr__(self) -> str:
        return self._words
