"""What the commands on ensembles share: axes, starts, the options of a sweep."""

from __future__ import annotations

import argparse
import re
from dataclasses import fields
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from vibroimpact.commands import common
from vibroimpact.damper import ImpactDamper
from vibroimpact.ensembles.motions import flags
from vibroimpact.ensembles.starts import RandomStarts
from vibroimpact.ensembles.store import store_path
from vibroimpact.ensembles.sweep import sweep
from vibroimpact.errors import InvalidParameterError
from vibroimpact.files import Case
from vibroimpact.state import STATE, State

WINDOW = ("settle", "periods", "most_impacts")
HOW = ("backend", "workers", "tile")
GRID = "NAME=LOW:HIGH:COUNT"
RANGE = "NAME=LOW:HIGH"
MIDDLE = State((0.0, 0.0), (0.0, 1.0))  # of a damper: free of its stops at any clearance
STATED = (*STATE, "on_stop", "orbit")
DAMPER = tuple(f.name for f in fields(ImpactDamper))


# ---- options -------------------------------------------------------------------------------------


def add_members(parser: argparse.ArgumentParser, over: str, observe: str) -> None:
    """Add the options that say which members: the system, one start or many, grid, observers."""
    common.add_system(parser)
    add_start(parser)
    _add_random(parser)
    add_over(parser, over)
    parser.add_argument("--observe", default="", metavar="A,B,...", help=observe)


def add_over(parser: argparse.ArgumentParser, text: str) -> None:
    """Add the option for the axes of the grid."""
    parser.add_argument(
        "--over", action="append", required=True, metavar=GRID,
        help=f"{text}; may be repeated. NAME=A,B,C gives the values one by one",
    )  # fmt: skip


def add_start(parser: argparse.ArgumentParser) -> None:
    """Add the options that say where to start."""
    common.add_start(parser, "both masses of a damper in the middle, the free one with velocity 1")


def _add_random(parser: argparse.ArgumentParser) -> None:
    """Add the options for random starts."""
    group = parser.add_argument_group(
        "random starts", "Many starts instead of one; the state above gives what does not vary."
    )
    group.add_argument("--starts", type=int, metavar="COUNT", help="how many")
    group.add_argument("--seed", type=int, default=0, help="of the random numbers (default: 0)")
    group.add_argument(
        "--vary", action="append", default=[], metavar=RANGE,
        help="a coordinate, x1, x2, ..., v1, v2, ..., phase, and its range; may be repeated",
    )  # fmt: skip


def add_window(parser: argparse.ArgumentParser, *, store: bool = True) -> None:
    """Add the options of a sweep: how long, where to, by whom."""
    common.add_arguments_of(parser, sweep, WINDOW)
    common.add_arguments_of(parser, sweep, (*HOW, "store") if store else HOW)
    common.add_out(parser)


# ---- what was asked for --------------------------------------------------------------------------


def options_of(arguments: argparse.Namespace) -> dict[str, Any]:
    """The options of a sweep that were given."""
    names = [name for name in (*WINDOW, *HOW, "store", "follow") if hasattr(arguments, name)]
    return common.given(arguments, names)


def observed(arguments: argparse.Namespace) -> list[str]:
    """The names of observers."""
    return [name for name in arguments.observe.split(",") if name]


def over_of(arguments: argparse.Namespace) -> dict[str, NDArray[np.float64]]:
    """The axes of the grid."""
    axes = [_axis(text) for text in arguments.over]
    twice = {name for name, _ in axes if [other for other, _ in axes].count(name) > 1}
    if twice:
        raise InvalidParameterError(f"over = {min(twice)}: is there twice. Give each name once.")
    return dict(axes)


def case_of(arguments: argparse.Namespace, over: dict[str, NDArray[np.float64]]) -> Case:
    """The system; a parameter of a damper that only the grid fixes is in the middle of its axis."""
    if not arguments.config:
        for name in set(over) & set(DAMPER):
            if getattr(arguments, name) is None:
                setattr(arguments, name, float((over[name].min() + over[name].max()) / 2.0))
    return common.case_of(arguments)


def base_of(arguments: argparse.Namespace, case: Case) -> State:
    """The state that was asked for."""
    if common.given(arguments, STATED) or case.start or not isinstance(case.system, ImpactDamper):
        return common.start_of(arguments, case)
    return MIDDLE if arguments.perturb is None else MIDDLE.perturbed(arguments.perturb)


def start_of(arguments: argparse.Namespace, case: Case) -> State | RandomStarts:
    """One start or many."""
    base = base_of(arguments, case)
    if arguments.starts is None:
        if arguments.vary:
            raise InvalidParameterError(f"vary = {arguments.vary[0]}: needs --starts COUNT.")
        return base
    ranges = {}
    for text in arguments.vary:
        name, low, high = _parts(text, "vary", RANGE, 2)
        ranges[name] = low, high
    return RandomStarts(arguments.starts, arguments.seed, ranges, base)


def _axis(text: str) -> tuple[str, NDArray[np.float64]]:
    name, _, values = text.partition("=")
    if "," in values:
        return name, np.array(_numbers(values.split(","), text, "over", GRID))
    name, low, high, count = _parts(text, "over", GRID, 3)
    if count != int(count) or count < 1:
        raise InvalidParameterError(f"over = {text}: COUNT must be a whole number >= 1.")
    return name, np.linspace(low, high, int(count))


def _parts(text: str, option: str, form: str, count: int) -> Any:
    """A name and so many numbers."""
    name, _, values = text.partition("=")
    parts = values.split(":")
    if not name or len(parts) != count:
        raise InvalidParameterError(f"{option} = {text}: must be {form}.")
    return name, *_numbers(parts, text, option, form)


def _numbers(parts: list[str], text: str, option: str, form: str) -> list[float]:
    try:
        return [float(part) for part in parts]
    except ValueError:
        raise InvalidParameterError(f"{option} = {text}: must be {form}.") from None


# ---- what was found ------------------------------------------------------------------------------


def summary(case: Case, over: dict[str, NDArray[np.float64]], members: xr.Dataset) -> list[str]:
    """Lines that say what moves, what was varied, and how the members ended."""
    return [_system(case, over), _shape(members, over), _ends(members)]


def kept(store: str | None) -> str:
    """A line that names the store."""
    return f"\nkept in {store_path(store)}" if store else ""


def _ends(members: xr.Dataset) -> str:
    """A line that counts how the members ended."""
    words = flags(members["end"])
    values, counts = np.unique(members["end"].values, return_counts=True)
    total = int(counts.sum())
    listed = ", ".join(
        f"{count} {words[int(v)].lower().replace('_', ' ')}"
        for v, count in zip(values, counts, strict=True)
    )
    return f"{total} members: {listed}"


def _system(case: Case, over: dict[str, NDArray[np.float64]]) -> str:
    """A line that says what moves; of a damper with the range of each parameter in the grid."""
    text = str(case.system)
    for name in set(over) & set(DAMPER) if isinstance(case.system, ImpactDamper) else ():
        ends = f"{name} from {over[name][0]:g} to {over[name][-1]:g}"
        text = re.sub(rf"\b{name}=[^,)]+", ends, text)
    return text


def _shape(members: xr.Dataset, over: dict[str, NDArray[np.float64]]) -> str:
    """A line that says what was varied."""
    parts = [f"{name} {axis[0]:g} to {axis[-1]:g} ({len(axis)})" for name, axis in over.items()]
    starts = members.sizes.get("start")
    return ", ".join(parts + ([f"{starts} starts"] if starts else []))
