"""Files: systems from TOML, results to netCDF and pictures, each written whole or not at all."""

from __future__ import annotations

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

from vibroimpact.damper import ImpactDamper
from vibroimpact.errors import InvalidParameterError
from vibroimpact.mechanism import Contact, Harmonic, Mechanism
from vibroimpact.plotting import save
from vibroimpact.state import State

DATA = (".nc",)
PICTURES = (".svg", ".png", ".pdf")


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
    system = _built(path, name, _SYSTEMS[name], tables[name])
    start = tables.get("start")
    return Case(system, None if start is None else _built(path, "start", State, start))


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


def _mechanism(
    *, forces: list[dict[str, Any]] | None = None, contacts: list[dict[str, Any]], **rest: Any
) -> Mechanism:
    pairs = [
        pair | ({"restitution": tuple(r)} if isinstance(r := pair.get("restitution"), list) else {})
        for pair in contacts
    ]
    return Mechanism(
        forces=tuple(Harmonic(**line) for line in forces or ()),
        contacts=tuple(Contact(**pair) for pair in pairs),
        **rest,
    )


_SYSTEMS: Mapping[str, Callable[..., Any]] = {
    "damper": ImpactDamper,
    "physical": ImpactDamper.from_physical,
    "mechanism": _mechanism,
}


def _built(path: Any, name: str, make: Callable[..., Any], table: Any) -> Any:
    """Call ``make`` with the entries of a table; a wrong name is the file's mistake, not a bug."""
    try:
        return make(**table)
    except TypeError as error:
        reason = str(error).partition("() ")[2] or error
        raise InvalidParameterError(
            f"config = {path}: [{name}] {reason}. The names are those of the reference."
        ) from error


# ---- writing -------------------------------------------------------------------------------------


def check_target(path: Path, suffixes: tuple[str, ...]) -> None:
    """Refuse a file that could not be written, before anything is computed for it.

    Parameters
    ----------
    path
        The file to be written; an earlier one of that name will be replaced.
    suffixes
        What the suffix may be.

    Raises
    ------
    InvalidParameterError
        Another suffix, a folder of that name, a folder around it that is missing or unwritable.
    """
    if path.suffix.lower() not in suffixes:
        raise InvalidParameterError(
            f"out = {path}: must end in {', '.join(suffixes)}. The suffix decides the format."
        )
    if path.is_dir():
        raise InvalidParameterError(f"out = {path}: is a folder. Name a file.")
    if not path.parent.is_dir():
        raise InvalidParameterError(
            f"out = {path}: {path.parent} must be a folder. Make it first, or name another."
        )
    if not os.access(path.parent, os.W_OK | os.X_OK):
        raise _unwritable(path, "no permission")


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
        raise _unwritable(path, error.strerror or str(error)) from error
    finally:
        temporary.unlink(missing_ok=True)


def _unwritable(path: Path, reason: str) -> InvalidParameterError:
    return InvalidParameterError(
        f"out = {path}: cannot be written ({reason}). Name a file in a folder that you may write."
    )
