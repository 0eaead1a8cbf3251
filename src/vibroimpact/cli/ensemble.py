"""Common parts of the commands on ensembles: options, starts, observers, the work, the report on it."""

from __future__ import annotations

import argparse
import re
from collections.abc import Callable, Iterable
from dataclasses import fields, replace
from typing import TYPE_CHECKING, Any, cast

import numpy as np

from vibroimpact._core.checks import path_of
from vibroimpact._core.errors import InvalidParameterError
from vibroimpact._core.lazy import xr
from vibroimpact._core.quantities import with_unit
from vibroimpact._core.types import Floats
from vibroimpact.cli import common
from vibroimpact.cli.common import GRID, RANGE
from vibroimpact.cli.output import Done, rehearse_picture
from vibroimpact.machines.machine import Machine, parameters_of
from vibroimpact.machines.toml_file import Case
from vibroimpact.model.state import COORDINATE, State, names_of_state
from vibroimpact.results.result import words_of_codes
from vibroimpact.sweeps.observers.observer import Observer
from vibroimpact.sweeps.observers.selection import observer_of
from vibroimpact.sweeps.observers.table import OBSERVERS
from vibroimpact.sweeps.starts import RandomStarts, Start
from vibroimpact.sweeps.sweep import sweep

if TYPE_CHECKING:
    from matplotlib.axes import Axes

WINDOW = ("settle_periods", "periods", "most_impacts")
MOST_PRINTED_VALUES = 8  # of a single member variables with so many values are printed
HOW = ("store", "backend", "workers", "client", "tile")


# ---- options -------------------------------------------------------------------------------------


def add_members(parser: argparse.ArgumentParser, over: str, observe: str) -> None:
    """Add the options of the members: the system, one start or many, the grid, the observers."""
    common.add_start(parser, at_orbit=False)
    group = parser.add_argument_group(
        "random starts",
        "Many starts instead of one; the state above gives what does not vary. Coordinates are x1, "
        "x2, ..., v1, v2, ..., phase.",
    )
    group.add_argument("--starts", type=int, metavar="COUNT", help="how many")
    group.add_argument("--seed", type=int, help="of the random numbers (default: 0)")
    common.add_named(group, "--bounds", RANGE, "a coordinate and its bounds; may be repeated")
    add_over(parser, over)
    parser.add_argument(
        "--observe", default="", metavar="A,B,...",
        help=f"{observe}: {', '.join(OBSERVERS)}; options as in section:points=50:stop=B or "
        "rms:row=1/-1:label=gap",
    )  # fmt: skip


def add_over(parser: argparse.ArgumentParser, text: str) -> None:
    """Add the option for the axes of the grid."""
    text += "; may be repeated. NAME=A,B,C gives the values one by one"
    common.add_named(parser, "--over", GRID, text, required=True)


def add_window(parser: argparse.ArgumentParser) -> None:
    """Add the options of a sweep: its window, its store, its workers."""
    common.add_arguments_of(parser, sweep, (*WINDOW, *HOW))
    common.add_out(parser)


def options_of(arguments: argparse.Namespace) -> dict[str, Any]:
    """The options of a sweep that were given."""
    return common.given(arguments, (*WINDOW, *HOW, "follow"))


# ---- starts and observers ------------------------------------------------------------------------


def start_of(arguments: argparse.Namespace, case: Case) -> Start:
    """Start, or starts, of the members by the arguments."""
    base = common.start_of(arguments, case, parameters_over(arguments))
    random, bounds = common.given(arguments, ["starts", "seed"]), arguments.bounds
    known = names_of_state(len(base.position))
    if "starts" not in random:
        if random or bounds:
            raise InvalidParameterError("seed, bounds: are for random starts. Give --starts COUNT.")
        return base
    if arguments.starts < 1 or not bounds:
        raise InvalidParameterError(
            f"starts = {arguments.starts}: must be >= 1, with --bounds {RANGE}, a coordinate "
            "and its bounds."
        )
    common.check_names("bounds", bounds, known)
    return RandomStarts(arguments.starts, arguments.seed or 0, bounds, base)


def parameters_over(arguments: argparse.Namespace) -> dict[str, Floats]:
    """Axes of the grid that are parameters of the system; the others are coordinates of the start."""
    return {name: x for name, x in arguments.over.items() if not COORDINATE.fullmatch(name)}


def observed(arguments: argparse.Namespace) -> list[Observer]:
    """Observers with their options."""
    texts = [text.strip() for text in arguments.observe.split(",")]
    return [_observer(text) for text in texts if text]


def _observer(text: str) -> Observer:
    """Observer from NAME, or NAME:OPTION=VALUE:..."""
    name, *options = text.split(":")
    plain = cast(Any, observer_of(name))
    types = {f.name: str(f.type) for f in fields(plain)}
    given: dict[str, Any] = {}
    for option in options:
        key, _, value = option.partition("=")
        if key not in types:
            allowed = f"one of {', '.join(types)}" if types else "left out"
            raise InvalidParameterError(f"observe = {text}: {key!r} must be {allowed}.")
        if key in given:
            raise InvalidParameterError(f"observe = {text}: {key} is given twice.")
        try:
            given[key] = common.TYPES.get(types[key], str)(value)
        except ValueError:
            words = {"int": "a whole number", "float": "a number"}.get(types[key], "as 1/-1")
            raise InvalidParameterError(f"observe = {text}: {key} must be {words}.") from None
    return cast(Observer, replace(plain, **given))


# ---- the work ------------------------------------------------------------------------------------


def computed(
    arguments: argparse.Namespace, case: Case, start: Start, compute: Callable[..., xr.Dataset],
    draw: Callable[[xr.Dataset], Axes], more: Callable[[xr.Dataset], Iterable[str]] = lambda _: (),
) -> Done:  # fmt: skip
    """Rehearse the picture with a few short members, compute, and say how the members ended.

    What is wrong with a picture is said before hours are spent.
    """
    over: dict[str, Floats] = arguments.over
    few = {name: axis[:2] for name, axis in over.items()}
    one = start if isinstance(start, State) else start.block((slice(2),) * len(start.dims))
    short = {"settle_periods": 0, "periods": 1, "progress": False}
    rehearse_picture(arguments.out, lambda: draw(compute(over=few, start=one, **short)))
    found = compute(over=over, start=start, **options_of(arguments))
    return report(arguments, case, found, more(found), lambda: draw(found))


def picture_over(axes: common.Values) -> Callable[..., Axes]:
    """Function that draws a number of each member over one parameter, or over two."""
    from vibroimpact.plotting import plot_along, plot_plane

    if len(axes) > 2:
        raise InvalidParameterError(
            f"over = {', '.join(axes)}: a picture has one or two parameters. Of more, keep "
            "the numbers: --out FILE.nc."
        )
    return plot_plane if len(axes) == 2 else plot_along


# ---- what was found ------------------------------------------------------------------------------


def report(
    arguments: argparse.Namespace, case: Case, found: xr.Dataset, more: Iterable[str],
    picture: Callable[[], Axes],
) -> Done:  # fmt: skip
    """Report of what moves, what was varied, how the members ended, more lines, and what was kept where."""
    store = [f"kept in {path_of('store', arguments.store)}"] if arguments.store else []
    lines = [
        system_over(case, arguments.over),
        _shape(found, arguments.over),
        _ends(found),
        *_values(found),
    ]
    return Done([*lines, *more, *store], found, picture)


def _ends(members: xr.Dataset) -> str:
    """A line that counts how the members ended."""
    words = words_of_codes(members["end"])
    values, counts = np.unique(members["end"].values, return_counts=True)
    total = int(counts.sum())
    listed = ", ".join(
        f"{count} {words[int(v)].lower().replace('_', ' ')}"
        for v, count in zip(values, counts, strict=True)
    )
    return f"{total} member{'s' * (total > 1)}: {listed}"


def _values(members: xr.Dataset) -> list[str]:
    """Lines with what was observed of a single member; of several the numbers are in the files."""
    if members["end"].size != 1:
        return []
    shown = {str(name): v for name, v in members.data_vars.items() if name != "end"}
    return [
        f"{name} = {with_unit(*v.values.ravel().tolist(), unit=v.attrs.get('units', ''), separator=', ')}"
        for name, v in shown.items()
        if v.size <= MOST_PRINTED_VALUES and v.dtype.kind in "iuf"
    ]


def system_over(case: Case, over: common.Values) -> str:
    """A line that says what moves; of a machine with the range of each parameter in the grid."""
    text = str(case.system)
    named = parameters_of(type(case.system)) if isinstance(case.system, Machine) else ()
    for name in set(over) & set(named):
        low, high = over[name][0], over[name][-1]
        ends = (
            f"{name} from {low:g} to {high:g}" if len(over[name]) > 1 else f"{name}={float(low)!r}"
        )
        text = re.sub(rf"\b{name}=[^,)]+", ends, text)
    return text


def _shape(members: xr.Dataset, over: dict[str, Floats]) -> str:
    """A line that says what was varied."""
    grid = [name for name in members["end"].dims if name not in (*over, "start", "direction")]
    axes = over | {str(name): members[name].values for name in grid}

    def unit_of(name: str) -> str:
        return str(members[name].attrs.get("units", "")) if name in members.coords else ""

    parts = [
        f"{name} {with_unit(axis[0], axis[-1], unit=unit_of(name))} ({len(axis)})"
        if len(axis) > 1
        else f"{name} {with_unit(axis[0], unit=unit_of(name))}"
        for name, axis in axes.items()
    ]
    starts = members.sizes.get("start")
    return ", ".join(parts + ([f"{starts} starts"] if starts else []))
