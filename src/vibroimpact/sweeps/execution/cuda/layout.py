"""Arrays, options and tables of a batch in the form of include/vibroimpact/ensemble/arrays.hpp."""

from __future__ import annotations

import re
from functools import cache
from typing import Any, NamedTuple

import numpy as np

from vibroimpact._core.types import Floats
from vibroimpact.sweeps.execution.cuda.program import Kernels, include_folder

# In the order of observer_bit (observe/observers.hpp).
SEEN = (
    "section", "symbol", "impacts", "speeds", "power", "settling", "extremes", "averages", "shares",
    "rotation", "stroboscopic",
)  # fmt: skip

_FIELD = re.compile(r"^    (?:const )?([a-z ]+)(\*?) (\w+);", re.MULTILINE)
_KINDS = {"long long": np.int64, "double": np.float64}


@cache
def batch_arrays() -> np.dtype[np.void]:
    """The struct of that name: fields of eight bytes, addresses as unsigned integers."""
    text = (include_folder() / "vibroimpact" / "ensemble" / "arrays.hpp").read_text()
    return np.dtype(
        [(name, np.uint64 if star else _KINDS[kind]) for kind, star, name in _FIELD.findall(text)]
    )


class Sizes(NamedTuple):
    """Coordinates, contacts and forcing lines of every system; 1 where its flow is mixed."""

    degrees: int
    contacts: int
    lines: int
    mixed: int

    @property
    def dimension(self) -> int:
        """Of a compiled state."""
        return 2 * (self.degrees + self.lines)


class Asked(NamedTuple):
    """What observers want of the kernels, and how their results look.

    Attributes
    ----------
    kernels
        Which kernels serve.
    options
        Fields of the struct.
    rows
        Watched rows on the coordinates by observer, shape (rows, n).
    widths
        Numbers per member of every table.
    """

    kernels: Kernels
    options: dict[str, int | float]
    rows: dict[str, Floats]
    widths: dict[str, int]


def asked_of(spec: dict[str, Any], sizes: Sizes) -> Asked:
    """What ``kernel_observers`` of observers.py wrote, for kernels."""
    wanted = sum(1 << bit for bit, name in enumerate(SEEN) if name in spec)
    rows = {name: _rows(spec.get(name, []), sizes.degrees) for name in ("extremes", "averages")}
    widths = _widths(spec, sizes, rows)
    exponents = widths.get("spectrum", widths.get("lyapunov", 0))
    tangents = sizes.dimension - 1 if "spectrum" in spec else exponents
    shape = sizes.dimension, sizes.lines, sizes.contacts, sizes.mixed
    kernels = Kernels(*shape, tangents, wanted)
    options = _options(spec) | {
        "wanted": wanted,
        "exponents": exponents,
        **{f"{name}_count": len(one) for name, one in rows.items()},
    }
    return Asked(kernels, options, rows, widths)


def _options(spec: dict[str, Any]) -> dict[str, int | float]:
    section = {"contact": 0, "side": 1, "last": 0, "stride": 1} | spec.get("section", {})
    symbol, settling = ({"tolerance": 0.0, "returns": 1} | spec.get(name, {})
                        for name in ("symbol", "settling"))  # fmt: skip
    rotation = {"contact": 0, "side": 1, "stride": 1, "tolerance": 0.0} | spec.get("rotation", {})
    strobe = {"last": 0, "phase": 0.0} | spec.get("stroboscopic", {})
    return {
        "strobe_last": strobe["last"],
        "strobe_at": strobe["phase"],
        "contact": section["contact"],
        "stop": section["side"],
        "last": section["last"],
        "stride": section["stride"],
        "symbol_tolerance": symbol["tolerance"],
        "symbol_returns": symbol["returns"],
        "settling_tolerance": settling["tolerance"],
        "settling_returns": settling["returns"],
        "longest": settling.get("longest", 0),
        "rotation_contact": rotation["contact"],
        "rotation_stop": rotation["side"],
        "rotation_stride": rotation["stride"],
        "rotation_tolerance": rotation["tolerance"],
    }


def _rows(given: list[list[float]], degrees: int) -> Floats:
    """Watched rows; an empty one stands for a row for every coordinate."""
    parts = [np.array([row]) if row else np.eye(degrees) for row in given]
    return np.concatenate([np.empty((0, degrees)), *parts])


def _widths(spec: dict[str, Any], sizes: Sizes, rows: dict[str, Floats]) -> dict[str, int]:
    """By name of a table that is wanted."""
    n, points, strobes = (
        sizes.degrees,
        *(spec.get(name, {}).get("last", 0) for name in ("section", "stroboscopic")),
    )
    tables = {
        "section": {"section_position": points * n, "section_velocity": points * n,
                    "section_phase": points, "section_time": points},
        "stroboscopic": {"strobe_position": strobes * n, "strobe_velocity": strobes * n,
                         "strobe_phase": strobes, "strobe_time": strobes},
        "symbol": {"symbol": 1 + 2 * sizes.contacts},
        "impacts": {"impacts": 2},
        "speeds": {"speeds": 4},
        "power": {"power": 1},
        "settling": {"settling": 1},
        "extremes": {"extremes": 2 * len(rows["extremes"])},
        "averages": {"averages": 2 * len(rows["averages"])},
        "shares": {"shares": 1, "counts": 2},
        "rotation": {"rotation": 2},
        "lyapunov": {"lyapunov": 1},
        "spectrum": {"spectrum": 2 * n + sizes.lines - 1},
        "final": {"final_position": n, "final_velocity": n, "final_phase": 1},
    }  # fmt: skip
    widths = {"time": 1}
    for name, table in tables.items():
        if name in spec:
            widths |= table
    return widths
