"""Results in files: netCDF that comes back to the last bit, CSV and XLSX for tables.

A file holds what ``to_dataset`` gives, for any program that reads netCDF, and beside it in ``stored_...`` what is
needed to make the same result again (tree.py). It ends with the digest of all bytes before, which programs that read
netCDF do not look at. Files are made and read here and nowhere else.

Method      the digest is compared before anything of a file is interpreted                                    (1)
            of what HDF5 offers, only plain arrays are taken that are in the file at full length, so that reading takes
            no more memory than the file has bytes, and reads no other file                                    (2)
            numbers are taken as they are stored: no scales, offsets, fill values, calendars                   (3)
"""

from __future__ import annotations

import hashlib
import os
from collections.abc import Iterator
from contextlib import contextmanager
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np

from vibroimpact._core.checks import (
    check_flag,
    memory_here,
    path_of,
    refusal,
    shortened,
    shown,
)
from vibroimpact._core.errors import InvalidParameterError
from vibroimpact._core.files import check_target, read_bytes, write_files
from vibroimpact._core.lazy import xr
from vibroimpact.results.fields import ADVICE
from vibroimpact.results.result import CSV, Result, check_dataset, csv_of, dataframe_of, titled
from vibroimpact.results.spreadsheet import xlsx_of
from vibroimpact.results.tree import Tree, object_of, tree_of

NETCDF = ".nc"
XLSX = ".xlsx"
SUFFIXES = (NETCDF, CSV, XLSX)
PICTURES = (".svg", ".png", ".pdf")  # suffixes of files that plotting writes
PAGES = (".html",)
ANIMATIONS = (".gif", ".mp4")
FORMAT = "vibroimpact result 1"
STORED = "stored_"  # begins names of variables that are not for reading
TEXT = STORED + "text"
SEEN_AS = {"complex128": np.float64, "bool": np.int8}  # types that netCDF has not, as their bytes
MAGIC = b"\x89HDF\r\n\x1a\n"  # HDF5 files begin with it
NO_VARIABLE = b"This is a netCDF dimension but not a netCDF variable"
SEAL = b"\nvibroimpact sha256 "  # at the end of a file, before the digest of all before
DIGEST_CHARACTERS = 64
# words of an array are read so many at a time, until they are more than the file holds
MOST_WORDS_AT_ONCE = 64
DAMAGED = "Take a whole copy. vibroimpact.load(path, damaged=True) reads what is left; numbers may be wrong."


def save(result: Any, path: str | os.PathLike[str]) -> None:
    """Write a result to a file, whole or not at all.

    Parameters
    ----------
    result
        Any result: a run, section, orbit, branch, curve, circle, response, design, ..., a special point of one, or
        the dataset of a sweep.
    path
        A name that ends in .nc, for :func:`load`, or in .csv or .xlsx, for the table of ``to_dataframe``; an earlier
        file of that name is replaced.

    Raises
    ------
    InvalidParameterError
        An object that is no result, another suffix, no such folder, no permission.
    """
    target = path_of("path", path)
    check_target(target, SUFFIXES, "path")
    write_files({target: content_of(result, target.suffix)})


def load(path: str | os.PathLike[str], system: Any = None, *, damaged: bool = False) -> Any:
    """Read a result that :func:`save` wrote to a .nc file.

    Parameters
    ----------
    path
        The file.
    system
        Needed where the system is code, as a :class:`~vibroimpact.Family`, an
        :class:`~vibroimpact.normal_forms.ExplicitMap` or a class of your own, which a file cannot hold. The same
        function or class must be given; all numbers are those of the file.
    damaged
        Read a file, too, that is not as it was written, by a damage or by another program, or that holds numbers
        which its fields do not admit. They may be wrong, and HDF5 may fail on it in any way. Only for a file that you
        cannot get again, from somebody you trust.

    Returns
    -------
    The result, with the same numbers to the last bit: what can be computed from it, or followed from it, is the same.
    Functions in it other than the system's, such as constraints of a design, are missing and refuse to be called.

    Raises
    ------
    InvalidParameterError
        No such file, no result in it or one of another format; a file that is not as it was written, or with numbers
        that no result holds; no system where one is needed, or another one.
    """
    check_flag("damaged", damaged)
    return read("path", path_of("path", path), system, damaged=damaged)


def read(name: str, path: Path, system: Any = None, *, damaged: bool = False) -> Any:
    """Read a result as :func:`load` does; errors begin with ``name``."""
    where = f"{name} = {path}"
    content = read_bytes(name, path, memory_here(), ADVICE)
    data = _dataset_in(where, netcdf_in(where, content, damaged=damaged))
    return result_of(data, system, damaged=damaged)


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


def result_of(data: xr.Dataset, system: Any = None, *, damaged: bool = False) -> Any:
    """Result of a dataset that :func:`dataset_of` made; a damaged one may hold numbers that its fields do not admit."""
    given = data.attrs.get("format")
    if given != FORMAT:
        raise InvalidParameterError(f"data: format {given!r} must be {FORMAT!r}. {ADVICE}")
    if TEXT not in data:
        found = data.copy()
        del found.attrs["format"]
        if not damaged:
            check_dataset(found)
        return found
    with _damage():
        pools = {
            name.removeprefix(STORED): _whole(variable.values, name.removeprefix(STORED))
            for name, variable in ((str(n), v) for n, v in data.data_vars.items())
            if name.startswith(STORED) and name != TEXT
        }
        named = {str(name): variable.values for name, variable in data.variables.items()}
        tree = Tree(data[TEXT].values.tobytes().decode(), pools)
        return object_of(tree, named, system, ranges=not damaged)


def _whole(pool: Any, kind: str) -> Any:
    if pool.dtype.name != np.dtype(SEEN_AS.get(kind, kind)).name or pool.ndim != 1:
        raise ValueError(f"{STORED}{kind} are {pool.dtype}")
    return pool.view(kind) if kind in SEEN_AS else pool


@contextmanager
def _damage() -> Iterator[None]:
    """Say what is missing or damaged in data that are read inside."""
    try:
        yield
    except InvalidParameterError:
        raise
    except KeyError as error:
        raise InvalidParameterError(f"data: {shown(error.args[0])} is missing. {ADVICE}") from error
    except Exception as error:
        raise InvalidParameterError(f"data: is damaged ({_short(error)}). {ADVICE}") from error


def _short(error: Exception) -> str:
    """An error of another library in a line."""
    return shortened(f"{type(error).__name__}: {error}")


# ---- the files ---------------------------------------------------------------------------------------


def content_of(result: Any, suffix: str) -> bytes:
    """Content of a file of one of the suffixes."""
    if suffix.lower() == NETCDF:
        data = dataset_of(result).drop_encoding()
        plain = {name: {"_FillValue": None} for name in data.variables}  # (3)
        content: bytes = bytes(data.to_netcdf(engine="h5netcdf", encoding=plain))
        return content + SEAL + hashlib.sha256(content).hexdigest().encode()
    table = titled(result.to_dataframe() if isinstance(result, Result) else dataframe_of(result))
    return xlsx_of(table) if suffix.lower() == XLSX else csv_of(table)


def netcdf_in(where: str, content: bytes, *, damaged: bool) -> bytes:
    """The netCDF of a file, if it is what was written (1)."""
    end = len(content) - len(SEAL) - DIGEST_CHARACTERS
    netcdf, seal = content[: max(end, 0)], content[max(end, 0) :]
    if seal == SEAL + hashlib.sha256(netcdf).hexdigest().encode():
        return netcdf
    if damaged:
        return netcdf if seal.startswith(SEAL) else content
    if not content.startswith(MAGIC):
        raise InvalidParameterError(f"{where}: cannot be read (no netCDF file). {ADVICE}")
    what = (
        "its digest is not that of its content" if seal.startswith(SEAL) else "its end is missing"
    )
    raise InvalidParameterError(
        f"{where}: is damaged, or was changed by another program ({what}). {DAMAGED}"
    )


def _dataset_in(where: str, netcdf: bytes) -> xr.Dataset:
    """Dataset of a netCDF file, with the numbers that are stored (3)."""
    import h5py

    plain: dict[str, Any] = {
        "mask_and_scale": False,
        "decode_times": False,
        "concat_characters": False,
    }
    try:
        with h5py.File(BytesIO(netcdf), "r") as file:
            for name in file:
                _check_plain(file, name, len(netcdf))
        with xr.open_dataset(BytesIO(netcdf), engine="h5netcdf", **plain) as opened:
            return opened.load()
    except Exception as error:
        raise InvalidParameterError(
            f"{where}: cannot be read ({_short(error)}). {ADVICE}"
        ) from error


def _check_plain(file: Any, name: str, size: int) -> None:
    """Refuse what is no plain array that is in the file at full length (2)."""
    import h5py

    if not isinstance(file.get(name, getlink=True), h5py.HardLink):
        raise ValueError(f"{shown(name)} is a link")
    one = file[name]
    if not isinstance(one, h5py.Dataset):
        raise ValueError(f"{shown(name)} is no array")
    made = one.id.get_create_plist()
    if made.get_nfilters() or made.get_external_count() or one.is_virtual:
        raise ValueError(f"{shown(name)} is packed, or in another file")
    if bytes(one.attrs.get("NAME", b"")).startswith(NO_VARIABLE):
        return  # a dim, of which only the length is read
    if one.nbytes > size:
        raise ValueError(f"{shown(name)} is larger than the file")
    if h5py.check_string_dtype(one.dtype):
        held = 0 if one.shape else len(one[()])
        for at in range(0, one.shape[0] if one.shape else 0, MOST_WORDS_AT_ONCE):
            held += sum(map(len, one[at : at + MOST_WORDS_AT_ONCE].ravel()))
            if held > size:
                raise ValueError(f"the words of {shown(name)} are longer than the file")
