"""The program ``tests/cpp/batch_program.cpp`` in place of the kernel's batches of one impact damper."""

from __future__ import annotations

import os
import subprocess
from typing import Any

import numpy as np

STOPS = {"A": 1.0, "B": -1.0}
EACH = [1.0, 0.0], [0.0, 1.0]  # rows of each coordinate


def said(*arguments: str, given: str = "") -> list[list[str]]:
    """The words that the program prints, line by line."""
    done = subprocess.run(
        [os.environ["BATCH_PROGRAM"], *arguments],
        input=given, capture_output=True, text=True, check=True,
    )  # fmt: skip
    return [line.split() for line in done.stdout.splitlines()]


def observers() -> dict[str, tuple[dict[str, tuple[Any, ...]], tuple[str, ...]]]:
    """The table of observers, as ``_kernel.observers`` returns it."""
    options: dict[str, dict[str, tuple[Any, ...]]] = {}
    tables: dict[str, tuple[str, ...]] = {}
    for what, name, *more in said("table"):
        if what == "observer":
            options[name], tables[name] = {}, ()
        elif what == "option":
            option, kind, *limits = more
            if kind == "of_rows":
                options[name][option] = (kind, *map(float.fromhex, limits))
                continue
            used = {"count": 2, "rows": 1}.get(kind, 0)
            options[name][option] = (kind, *map(int, limits[:used]))
        else:
            tables[name] += (more[0],)
    return {name: (options[name], tables[name]) for name in options}


class Batch:
    """``_kernel.Batch`` of one system."""

    def __init__(self, *, columns: Any, varied: Any, **system: Any) -> None:  # noqa: ARG002
        assert not varied
        assert not system.pop("piecewise")
        assert not system.pop("elements")
        assert (system["dense"], system["mixed"], system["degrees"]) == (False, False, 2)
        self.arrays: dict[str, list[Any]] = {}
        self._add(system)

    def add_mode(
        self, *, flow: dict[str, Any], code: int, varied: Any, piecewise: Any, **mode: Any
    ) -> None:
        assert not varied
        assert not piecewise
        self._add({**mode, **flow, "codes": [code]})

    def run(self, *, observers: dict[str, dict[str, Any]], **members: Any) -> dict[str, Any]:
        """Results by name, as ``_kernel.Batch.run`` returns them."""
        words = [f"{name} {_numbers(np.concatenate(x))}" for name, x in self.arrays.items()]
        words += [f"{name} {_numbers(x)}" for name, x in members.items()]
        for name, options in observers.items():
            words += [f"{name} 0"]
            words += [f"{name}.{option} {_option(x)}" for option, x in _spread(options).items()]
        count, found = len(members["settle"]), dict[str, Any]()
        for name, _, *numbers in said(given="\n".join(words)):
            found[name] = np.array([float.fromhex(x) for x in numbers])
        return {name: x.reshape(count, -1) for name, x in found.items()} | {
            "end": found["end"].astype(np.int8), "time": found["time"],
        }  # fmt: skip

    def _add(self, arrays: dict[str, Any]) -> None:
        for name, values in arrays.items():
            self.arrays.setdefault(name, []).append(np.ravel(values))


def _spread(options: dict[str, Any]) -> dict[str, Any]:
    """Options with a row of (x, v, a) for each coordinate in place of none, and numbers that go with it."""
    if "rows" not in options:
        return options
    each = [[row] if row else EACH for row in options["rows"]]
    rows = [[*row, *[0.0] * (6 - len(row))] for some in each for row in some]
    return {
        name: rows if name == "rows" else np.repeat(x, [len(some) for some in each])
        for name, x in options.items()
    }


def _option(value: Any) -> str:
    return _numbers(STOPS[value] if isinstance(value, str) else value)


def _numbers(values: Any) -> str:
    flat = np.ravel(np.asarray(values, dtype=float))
    return " ".join([str(flat.size), *(float(x).hex() for x in flat)])
