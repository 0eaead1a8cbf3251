"""Files: systems from TOML, results to netCDF and pictures, each written whole or not at all."""

from __future__ import annotations

import inspect
import os
import tomllib
from collections.abc import Callable, Iterator, Mapping
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import matplotlib.pyplot as plt
import xarray as xr
from matplotlib.axes import Axes

from vibroimpact.checks import unknown_keyword, unwritable
from vibroimpact.damper import ImpactDamper
from vibroimpact.errors import InvalidParameterError
from vibroimpact.mechanism import Contact, Harmonic, Mechanism
from vibroimpact.plotting import save
from vibroimpact.plotting.style import PICTURES
from vibroimpact.state import State

DATA = (".nc",)


@dataclass(frozen=True, slots=True)
class Case:
    """A system and, where the file gives one, a start."""

    system: ImpactDamper | Mechanism
    start: State | None = None


# ---- reading -------------------------------------------------------------------------------------


def read_case(path: str | os.PathLike[str]) -> Case:
    """Read a system, and perhaps a start, from a TOML file.

    Parameters
    ----------
    path
        The file. One table gives the system: ``[damper]`` (the parameters of
        :class:`~vibroimpact.ImpactDamper`), ``[physical]`` (those of ``from_physical``) or
        ``[mechanism]`` (those of :class:`~vibroimpact.Mechanism`, with ``[[mechanism.forces]]``
        and ``[[mechanism.contacts]]``). A table ``[start]`` (those of
        :class:`~vibroimpact.State`) is optional.

    Raises
    ------
    InvalidParameterError
        No such file, no TOML, an unknown or missing table or name, a value out of range.
    """
    tables = _read_toml(Path(path))
    systems = sorted(set(tables) & set(_SYSTEMS))
    unknown = sorted(set(tables) - set(_SYSTEMS) - {"start"})
    if len(systems) != 1 or unknown:
        raise InvalidParameterError(
            f"config = {path}: holds {', '.join(tables) or 'nothing'}; must hold one of "
            f"{', '.join(f'[{name}]' for name in _SYSTEMS)}, and [start] if wanted."
        )
    name = systems[0]
    system = _built(path, f"[{name}]", _SYSTEMS[name], _parts(path, name, tables[name]))
    start = tables.get("start")
    return Case(system, None if start is None else _built(path, "[start]", State, start))


def _read_toml(path: Path) -> dict[str, Any]:
    try:
        return tomllib.loads(path.read_text(encoding="utf-8"))
    except (OSError, UnicodeDecodeError) as error:
        reason = error.strerror if isinstance(error, OSError) else "it is no UTF-8 text"
        raise InvalidParameterError(
            f"config = {path}: cannot be read ({reason}). Name a TOML file."
        ) from error
    except tomllib.TOMLDecodeError as error:
        raise InvalidParameterError(
            f"config = {path}: is no TOML ({error}). Correct that place."
        ) from error


_SYSTEMS: Mapping[str, Callable[..., Any]] = {
    "damper": ImpactDamper,
    "physical": ImpactDamper.from_physical,
    "mechanism": Mechanism,
}
_PARTS: Mapping[str, Callable[..., Any]] = {"forces": Harmonic, "contacts": Contact}


def _parts(path: Any, name: str, table: Any) -> Any:
    """A table of a mechanism with its forces and contacts built, any other as it is."""
    if name != "mechanism" or not isinstance(table, dict):
        return table
    return table | {key: _several(path, key, table[key]) for key in _PARTS if key in table}


def _several(path: Any, key: str, items: Any) -> list[Any]:
    label = f"[[mechanism.{key}]]"
    if not isinstance(items, list):
        raise InvalidParameterError(f"config = {path}: {key} must be tables {label}.")
    numbered = [f"{label} {i + 1}" for i in range(len(items))] if len(items) > 1 else [label]
    return [
        _built(path, where, _PARTS[key], item) for where, item in zip(numbered, items, strict=False)
    ]


def _built(path: Any, where: str, make: Callable[..., Any], table: Any) -> Any:
    """Call ``make`` with the entries of a table; what is wrong is said with file and table."""
    if not isinstance(table, dict):
        raise InvalidParameterError(
            f"config = {path}: {where} must be a table of names and values."
        )
    names = inspect.signature(make).parameters
    missing = [n for n, p in names.items() if p.default is p.empty and n not in table]
    try:
        for name in table:
            if name not in names and not isinstance(make, type):  # classes say more themselves
                raise unknown_keyword(where, name, [*names])
        if missing and not table.keys() - names:
            raise InvalidParameterError(f"{', '.join(missing)}: missing.")
        return make(**table)
    except InvalidParameterError as error:
        raise InvalidParameterError(f"config = {path}: {where}: {error}") from error


# ---- writing -------------------------------------------------------------------------------------


def write(
    paths: list[Path], *, data: Callable[[], xr.Dataset], picture: Callable[[], Axes]
) -> None:
    """Write files by their suffixes: all of them, or none.

    Parameters
    ----------
    paths
        Files that :func:`check_target` has passed.
    data, picture
        Make what is written to netCDF and to pictures; called only where a file wants it.
    """
    with ExitStack() as stack:
        for path in paths:
            temporary = stack.enter_context(replacing(path))
            if path.suffix.lower() in DATA:
                data().to_netcdf(temporary, engine="h5netcdf")
            else:
                with _drawn(picture) as ax:
                    save(ax, temporary)


def rehearse_picture(paths: list[Path], picture: Callable[[], Axes]) -> None:
    """Make a picture if a file wants one, and drop it: an error comes before the long work."""
    if any(path.suffix.lower() in PICTURES for path in paths):
        with _drawn(picture):
            pass


@contextmanager
def _drawn(picture: Callable[[], Axes]) -> Iterator[Axes]:
    plt.switch_backend("agg")  # a file needs no window and no display
    ax = picture()
    try:
        yield ax
    finally:
        plt.close(ax.get_figure(root=True))


@contextmanager
def replacing(path: Path) -> Iterator[Path]:
    """Yield a name in the same folder; what is written there becomes ``path`` at the end.

    After an error or an interruption ``path`` is as it was and the other name is gone.
    """
    temporary = path.with_name(f".{path.stem}-{os.getpid()}{path.suffix}")
    try:
        yield temporary
        temporary.replace(path)
    except OSError as error:
        raise unwritable("out", path, error.strerror or str(error)) from error
    finally:
        temporary.unlink(missing_ok=True)
