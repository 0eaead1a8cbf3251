"""Results in files: netCDF that comes back to the last bit, CSV for tables.

A file holds what ``to_dataset`` gives, for any program that reads netCDF, and beside it in ``stored_...`` what is
needed to make the same result again (tree.py). Files are opened and closed here and nowhere else.
"""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np

from vibroimpact._core.checks import check_target, path_of, refusal
from vibroimpact._core.errors import InvalidParameterError
from vibroimpact._core.files import replacing
from vibroimpact._core.lazy import xr
from vibroimpact.results.result import Result, dataframe_of
from vibroimpact.results.tree import Tree, object_of, tree_of

NETCDF, CSV = ".nc", ".csv"
SUFFIXES = (NETCDF, CSV)
FORMAT = "vibroimpact result 1"
STORED = "stored_"  # begins names of variables that are not for reading
TEXT = STORED + "text"
SEEN_AS = {"complex128": np.float64, "bool": np.int8}  # types that netCDF has not, as their bytes
ADVICE = "Give what vibroimpact.save wrote."


def save(result: Any, path: str | os.PathLike[str]) -> None:
    """Write a result to a file, whole or not at all.

    Parameters
    ----------
    result
        Any result: a run, section, orbit, branch, curve, circle, response, design, ..., a special point of one, or
        the dataset of a sweep.
    path
        A name that ends in .nc, for :func:`load`, or in .csv, for the table of ``to_dataframe``; an earlier file of
        that name is replaced.

    Raises
    ------
    InvalidParameterError
        An object that is no result, another suffix, no such folder, no permission.
    """
    target = path_of("path", path)
    check_target(target, SUFFIXES, "path")
    with replacing(target) as temporary:
        write(result, temporary)


def load(path: str | os.PathLike[str], system: Any = None) -> Any:
    """Read a result that :func:`save` wrote to a .nc file.

    Parameters
    ----------
    path
        The file.
    system
        Needed where the system is code, as a :class:`~vibroimpact.Family`, an
        :class:`~vibroimpact.normal_forms.ExplicitMap` or a class of your own, which a file cannot hold. The same
        function or class must be given; all numbers are those of the file.

    Returns
    -------
    The result, with the same numbers to the last bit: what can be computed from it, or followed from it, is the same.
    Functions in it other than the system's, such as constraints of a design, are missing and refuse to be called.

    Raises
    ------
    InvalidParameterError
        No such file, no result in it or one of another format; no system where one is needed, or another one.
    """
    return result_of(read(path), system)


def dataset_of(result: Any) -> xr.Dataset:
    """Dataset of a result with all that :func:`result_of` needs."""
    if isinstance(result, xr.Dataset):
        return result.assign_attrs(format=FORMAT)
    named = result.to_dataset() if isinstance(result, Result) else xr.Dataset()
    known = {str(name): variable.values for name, variable in named.variables.items()}
    tree = tree_of(result, known)
    if not tree.text:
        raise refusal("result", result, "a result, as a function of vibroimpact gives")
    stored = {STORED + kind: _seen(pool, kind) for kind, pool in tree.pools.items()}
    stored[TEXT] = np.frombuffer(tree.text.encode(), dtype=np.uint8)
    parts = {name: (f"{name}_place", array) for name, array in stored.items()}
    return named.assign(parts).assign_attrs(format=FORMAT)


def _seen(pool: Any, kind: str) -> Any:
    return pool.view(SEEN_AS[kind]) if kind in SEEN_AS else pool


def result_of(data: xr.Dataset, system: Any = None) -> Any:
    """Result of a dataset that :func:`dataset_of` made."""
    given = data.attrs.get("format")
    if given != FORMAT:
        raise InvalidParameterError(f"data: format {given!r} must be {FORMAT!r}. {ADVICE}")
    if TEXT not in data:
        found = data.copy()
        del found.attrs["format"]
        return found
    with _damage():
        pools = {
            name.removeprefix(STORED): _whole(variable.values, name.removeprefix(STORED))
            for name, variable in ((str(n), v) for n, v in data.data_vars.items())
            if name.startswith(STORED) and name != TEXT
        }
        named = {str(name): variable.values for name, variable in data.variables.items()}
        return object_of(Tree(data[TEXT].values.tobytes().decode(), pools), named, system)


def _whole(pool: Any, kind: str) -> Any:
    return pool.view(kind) if kind in SEEN_AS else pool


@contextmanager
def _damage() -> Iterator[None]:
    """Say what is missing or damaged in data that are read inside."""
    try:
        yield
    except InvalidParameterError:
        raise
    except KeyError as error:
        raise InvalidParameterError(f"data: {error.args[0]} is missing. {ADVICE}") from error
    except (ValueError, TypeError, IndexError, AttributeError, ImportError) as error:
        raise InvalidParameterError(f"data: is damaged ({error}). {ADVICE}") from error


# ---- the files ---------------------------------------------------------------------------------------


def write(result: Any, path: Path) -> None:
    """Write a result to a file of one of the suffixes."""
    if path.suffix.lower() == NETCDF:
        dataset_of(result).to_netcdf(path, engine="h5netcdf")
    else:
        table = result.to_dataframe() if isinstance(result, Result) else dataframe_of(result)
        table.to_csv(path, index=False)


def read(path: str | os.PathLike[str]) -> xr.Dataset:
    """Read a netCDF file."""
    target = path_of("path", path)
    try:
        with xr.open_dataset(target, engine="h5netcdf", decode_times=False) as opened:
            return opened.load()
    except (OSError, ValueError) as error:
        raise InvalidParameterError(
            f"path = {target}: cannot be read ({error}). {ADVICE}"
        ) from error
