"""What the commands on ensembles share: options, the work, the report on it."""

from __future__ import annotations

import argparse
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr
from matplotlib.axes import Axes

from vibroimpact._core.errors import InvalidParameterError
from vibroimpact._core.types import Floats
from vibroimpact.cli import common
from vibroimpact.cli.members import GRID, RANGE
from vibroimpact.cli.output import rehearse_picture, write
from vibroimpact.machines.machine import Machine, parameters_of
from vibroimpact.machines.toml_file import Case
from vibroimpact.model.state import State
from vibroimpact.plotting import plot_along, plot_plane
from vibroimpact.sweeps.analyses.motion_codes import flags
from vibroimpact.sweeps.execution.store import store_path
from vibroimpact.sweeps.observers.table import OBSERVERS
from vibroimpact.sweeps.starts import Start
from vibroimpact.sweeps.sweep import sweep

WINDOW = ("settle_periods", "periods", "most_impacts")
HOW = ("store", "backend", "workers", "client", "tile")
TEXTS = {
    "settle_periods": "How long a run goes on before it is observed, in forcing periods; in units of time "
    "for a system without forcing.",
    "periods": "How long it is observed then, in the same units.",
    "follow": "NAME of one parameter: members start where they ended at the value before, upwards; "
    "downwards with --follow=-NAME.",
    "store": "A folder to keep results in, in Zarr's format (needs the extra store). If it is "
    "there, the command goes on where it ended.",
    "client": "For --backend dask: the address of a scheduler, such as tcp://node:8786. By default "
    "a cluster of this process alone.",
    "at": f"{common.PLACE}; {common.PHASE}.",
    "tolerance": "Periodic orbits nearer than this, in units of the largest position and velocity, "
    "are one; in (0, 1).",
}


# ---- options -------------------------------------------------------------------------------------


def add_members(
    parser: argparse.ArgumentParser, over: str, observe: str, *, grid: bool = True
) -> None:
    """Add the options that say which members: the system, one start or many, grid, observers."""
    common.add_system(parser)
    add_start(parser)
    _add_random(parser)
    if grid:
        _add_grid(parser)
    add_over(parser, over)
    parser.add_argument(
        "--observe", default="", metavar="A,B,...",
        help=f"{observe}: {', '.join(OBSERVERS)}; options as in section:points=50:stop=B or "
        "rms:row=1/-1:label=gap",
    )  # fmt: skip


def add_over(parser: argparse.ArgumentParser, text: str) -> None:
    """Add the option for the axes of the grid."""
    parser.add_argument(
        "--over", action="append", required=True, metavar=GRID,
        help=f"{text}; may be repeated. NAME=A,B,C gives the values one by one",
    )  # fmt: skip


def add_start(parser: argparse.ArgumentParser) -> None:
    """Add the options that say where to start."""
    common.add_start(parser, at_orbit=False)


def _add_random(parser: argparse.ArgumentParser) -> None:
    """Add the options for random starts."""
    group = parser.add_argument_group(
        "random starts",
        "Many starts instead of one; the state above gives what does not vary. Coordinates are x1, "
        "x2, ..., v1, v2, ..., phase.",
    )
    group.add_argument("--starts", type=int, metavar="COUNT", help="how many")
    group.add_argument("--seed", type=int, help="of the random numbers (default: 0)")
    group.add_argument(
        "--vary", action="append", default=[], metavar=RANGE,
        help="a coordinate and its range; may be repeated",
    )  # fmt: skip
    parser.set_defaults(grid=[])


def _add_grid(parser: argparse.ArgumentParser) -> None:
    """Add the option for a grid of starts."""
    parser.add_argument(
        "--grid", action="append", metavar=GRID,
        help="a grid of starts instead: a coordinate and its values; may be repeated",
    )  # fmt: skip


def add_window(parser: argparse.ArgumentParser) -> None:
    """Add the options of a sweep: how long, where to, by whom."""
    common.add_arguments_of(parser, sweep, (*WINDOW, *HOW), **TEXTS)
    common.add_out(parser)


# ---- the request ---------------------------------------------------------------------------------


def options_of(arguments: argparse.Namespace) -> dict[str, Any]:
    """The options of a sweep that were given."""
    names = [name for name in (*WINDOW, *HOW, "follow") if hasattr(arguments, name)]
    return common.given(arguments, names)


# ---- the work ------------------------------------------------------------------------------------


def computed(
    arguments: argparse.Namespace, targets: list[Path], over: dict[str, Floats], start: Start,
    compute: Callable[..., xr.Dataset], draw: Callable[[xr.Dataset], Axes],
) -> xr.Dataset:  # fmt: skip
    """Rehearse the picture, compute, and write."""
    _rehearse(targets, over, start, compute, draw)
    found = compute(over=over, start=start, **options_of(arguments))
    write(targets, data=found, picture=lambda: draw(found))
    return found


def _rehearse(
    targets: list[Path], over: dict[str, Floats], start: Start,
    compute: Callable[..., xr.Dataset], draw: Callable[[xr.Dataset], Axes],
) -> None:  # fmt: skip
    """Draw a few short members: what is wrong with a picture is said before hours are spent."""
    few = {name: axis[:2] for name, axis in over.items()}
    rehearse_picture(
        targets,
        lambda: draw(
            compute(over=few, start=_few(start), settle_periods=0, periods=1, progress=False)
        ),
    )


def picture_over(arguments: argparse.Namespace) -> Callable[..., Axes]:
    """What draws a number of each member over one parameter, or over two."""
    if len(arguments.over) > 2:
        raise InvalidParameterError(
            f"over = {', '.join(text.partition('=')[0] for text in arguments.over)}: a picture has "
            "one or two parameters. Of more, keep the numbers: --out FILE.nc."
        )
    return plot_plane if len(arguments.over) == 2 else plot_along


def _few(start: Start) -> Start:
    return start if isinstance(start, State) else start.block((slice(2),) * len(start.dims))


# ---- what was found ------------------------------------------------------------------------------


def report(
    arguments: argparse.Namespace, targets: list[Path], case: Case, over: dict[str, Floats],
    found: xr.Dataset, *more: str,
) -> str:  # fmt: skip
    """What moves, what was varied, how the members ended, more lines, and what was kept where."""
    store = [f"kept in {store_path(arguments.store)}"] if arguments.store else []
    lines = [system_over(case, over), _shape(found, over), _ends(found), *more, *store]
    return "\n".join(lines) + common.listed(targets)


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


def system_over(case: Case, over: dict[str, Floats]) -> str:
    """A line that says what moves; of a machine with the range of each parameter in the grid."""
    text = str(case.system)
    named = parameters_of(type(case.system)) if isinstance(case.system, Machine) else ()
    for name in set(over) & set(named):
        ends = f"{name} from {over[name][0]:g} to {over[name][-1]:g}"
        text = re.sub(rf"\b{name}=[^,)]+", ends, text)
    return text


def _shape(members: xr.Dataset, over: dict[str, Floats]) -> str:
    """A line that says what was varied."""
    grid = [name for name in members["end"].dims if name not in (*over, "start", "direction")]
    axes = over | {str(name): members[name].values for name in grid}
    parts = [f"{name} {axis[0]:g} to {axis[-1]:g} ({len(axis)})" for name, axis in axes.items()]
    starts = members.sizes.get("start")
    return ", ".join(parts + ([f"{starts} starts"] if starts else []))
