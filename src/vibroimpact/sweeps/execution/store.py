"""A sweep in a Zarr store: bigger than memory, written tile by tile, resumed after any end.

Method      chunks are tiles, so that no chunk is written twice. Of a tile, all variables are
            written and forced to the disc, then ``end``; its chunk is there or not, because Zarr
            renames chunks into place: a tile is done if and only if its chunk of ``end`` is there
            and not empty                                                                       (1)
            the store itself is made under another name, complete with the specification, and renamed (2)
Assumes     a local or shared file system on which a rename within a folder is atomic
Fails       StoreError where nothing can be written (disc full, no permission); what is there stays
Reference   Zarr format 3
"""

from __future__ import annotations

import fcntl
import json
import os
import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np

from vibroimpact._core.checks import path_of, refusal
from vibroimpact._core.errors import BackendUnavailableError, InvalidParameterError, StoreError
from vibroimpact._core.lazy import xr
from vibroimpact._core.types import Arrays
from vibroimpact.sweeps.execution.tiles import Tile, tiles_of
from vibroimpact.sweeps.schema import END, Schema
from vibroimpact.sweeps.specification import SPECIFICATION_ATTRIBUTE, SweepSpec

MOST_SHOWN_DIFFERENCES = 6  # a message lists so many differences between two specifications at most
PARTIAL = "*.partial"  # what Zarr calls a chunk that is not written to its end


def store_path(store: str | os.PathLike[str]) -> Path:
    """The folder that a user names, ``~`` replaced."""
    path = path_of("store", store)
    try:
        return path.expanduser()
    except RuntimeError:
        raise refusal(
            "store", store, "the name of a folder", f"{path.parts[0]} is no user's home."
        ) from None


class Store:
    """A store that is open for writing; one process at a time.

    Parameters
    ----------
    path
        A folder that :func:`opened` has made or checked.
    """

    def __init__(self, path: Path, schema: Schema) -> None:
        self.path, self.schema = path, schema
        self.group = _zarr().open_group(path, mode="r+")
        for name in schema.variables:
            if name not in self.group:
                raise StoreError(f"store = {str(path)!r}: {name} is gone from it. Name another.")
        self.arrays = {name: self.group[name] for name in schema.variables}

    @property
    def tile(self) -> tuple[int, ...]:
        """Sizes of a tile."""
        sizes: tuple[int, ...] = self.arrays[END].chunks
        return sizes

    @property
    def missing(self) -> list[Tile]:
        """Tiles that are not done (1)."""
        tiles = tiles_of(tuple(self.schema.grid.values()), self.tile)
        return [tile for tile in tiles if not _filled(self._chunk(END, tile))]

    def write(self, tile: Tile, results: Arrays) -> None:
        """Write a tile (1)."""
        try:
            for name in sorted(self.arrays, key=lambda name: name == END):
                chunk = self._chunk(name, tile)
                self.arrays[name][tile.place] = results[name]
                _to_disc(chunk)
        except OSError as error:
            raise StoreError(
                f"store = {str(self.path)!r}: cannot be written ({error.strerror or error}). "
                "The tiles that are done are kept: make room, and the same call goes on."
            ) from error

    @property
    def kept(self) -> str:
        """Sentence that says what is there, and how to go on."""
        tiles = list(tiles_of(tuple(self.schema.grid.values()), self.tile))
        done = len(tiles) - len(self.missing)
        return (
            f"{done} of {len(tiles)} tiles are in {str(self.path)!r}: the same call goes on there."
        )

    def dataset(self) -> xr.Dataset:
        """The results, read when they are wanted."""
        whole: xr.Dataset = xr.open_zarr(self.path, consolidated=False)
        return whole[list(self.schema.variables)]

    def _chunk(self, name: str, tile: Tile) -> Path:
        """The file of a tile's chunk."""
        array = self.arrays[name]
        own = (0,) * (array.ndim - len(tile.chunk))
        key: str = array.metadata.encode_chunk_key((*tile.chunk, *own))
        return self.path / name / key


@contextmanager
def opened(
    path: Path, schema: Schema, specification: SweepSpec, tile: tuple[int, ...], *, strict: bool
) -> Iterator[Store]:
    """Make a store, or open one that holds the same specification.

    Parameters
    ----------
    path
        The folder; there is none yet, or it is a store of a sweep.
    schema, specification
        Of the sweep.
    tile
        Sizes of a tile of a new store.
    strict
        Refuse a store with other tiles.

    Raises
    ------
    InvalidParameterError
        Something else is there; another specification, or other tiles if ``strict``; another process
        is writing.
    StoreError
        The folder cannot be made.
    BackendUnavailableError
        Zarr is not installed.
    """
    _zarr()
    if not path.exists():
        _make(path, schema, tile)
    _check(path, specification)
    with _alone(path):
        for partial in path.rglob(PARTIAL):
            partial.unlink(missing_ok=True)  # of a process that was killed
        store = Store(path, schema)
        if strict and store.tile != tile:
            raise InvalidParameterError(
                f"tile: store = {str(path)!r} has tiles of {store.tile}, not {tile}. "
                "Leave tile out; it does not change the results."
            )
        yield store


# ---- making (2) ----------------------------------------------------------------------------------


def _make(path: Path, schema: Schema, tile: tuple[int, ...]) -> None:
    """Write the store without results under another name, and rename it."""
    if not path.parent.is_dir():
        raise InvalidParameterError(
            f"store = {str(path)!r}: {str(path.parent)!r} must be a folder. Make it first."
        )
    draft = path.with_name(f".{path.name}-{os.getpid()}")
    try:
        _fill(draft, schema, tile)
        draft.rename(path)
    except OSError as error:
        raise StoreError(
            f"store = {str(path)!r}: cannot be made ({error.strerror or error}). "
            "Name one in a folder that you may write, with room."
        ) from error
    finally:
        shutil.rmtree(draft, ignore_errors=True)


def _fill(draft: Path, schema: Schema, tile: tuple[int, ...]) -> None:
    others = [name for name, (dims, _, _) in schema.coords.items() if dims != (name,)]
    known = {"coordinates": " ".join(others)} if others else {}  # CF conventions
    group = _zarr().create_group(draft, zarr_format=3, attributes=_plain(schema.attrs) | known)
    for name, (dims, values, attrs) in schema.coords.items():
        group.create_array(name, data=values, dimension_names=dims, attributes=_plain(attrs))
    for name, variable in schema.variables.items():
        group.create_array(
            name,
            shape=schema.shape(name),
            chunks=(*tile, *variable.shape),
            dtype=variable.dtype,
            fill_value=variable.fill,
            dimension_names=schema.dims(name),
            attributes=_plain(variable.attrs),
        )


def _plain(attrs: dict[str, Any]) -> dict[str, Any]:
    """Attributes as JSON holds them."""
    return {k: x.tolist() if isinstance(x, np.ndarray) else x for k, x in attrs.items()}


# ---- opening -------------------------------------------------------------------------------------


def _check(path: Path, specification: SweepSpec) -> None:
    """Refuse what is no store of a sweep, and the store of another sweep."""
    stored = _specification_in(path)
    different = specification.differences(stored)
    if different:
        more = (
            f"; and {len(different) - MOST_SHOWN_DIFFERENCES} more"
            if len(different) > MOST_SHOWN_DIFFERENCES
            else ""
        )
        raise InvalidParameterError(
            f"store = {str(path)!r}: holds another sweep. Requested is "
            f"{'; '.join(different[:MOST_SHOWN_DIFFERENCES])}{more}. Name another store, or ask what it holds."
        )


def _specification_in(path: Path) -> SweepSpec:
    try:
        group = _zarr().open_group(path, mode="r")
        text = group.attrs[SPECIFICATION_ATTRIBUTE]
        names = json.loads(text)["axes"]
        return SweepSpec(text, tuple((name, tuple(group[name][:].tolist())) for name in names))
    except (OSError, KeyError, ValueError) as error:
        raise InvalidParameterError(
            f"store = {str(path)!r}: is there, but is no store of a sweep. Name another."
        ) from error


@contextmanager
def _alone(path: Path) -> Iterator[None]:
    """Hold the store's lock; it falls with the process, however that ends."""
    folder = os.open(path, os.O_RDONLY)
    try:
        try:
            fcntl.flock(folder, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            raise InvalidParameterError(
                f"store = {str(path)!r}: another process is writing to it. Wait for it, or end it."
            ) from None
        yield
    finally:
        os.close(folder)


def _zarr() -> Any:
    try:
        import zarr
    except ImportError:
        raise BackendUnavailableError(
            "store: needs Zarr, which is not installed. Run: pip install 'vibroimpact[store]'."
        ) from None
    return zarr


# ---- files ---------------------------------------------------------------------------------------


def _filled(chunk: Path) -> bool:
    """Whether a chunk is there; after a loss of power it may be there and empty."""
    try:
        return chunk.stat().st_size > 0
    except FileNotFoundError:
        return False


def _to_disc(chunk: Path) -> None:
    """Force a file and its name to the disc; Zarr makes none for a chunk of nothing but fill."""
    for place in (chunk, chunk.parent) if chunk.exists() else ():
        handle = os.open(place, os.O_RDONLY)
        try:
            os.fsync(handle)
        finally:
            os.close(handle)
