"""A sweep in a Zarr store: bigger than memory, written tile by tile, resumed after any end.

Method      chunks are tiles, so that no chunk is written twice. Of a tile, all variables are
            written and forced to the disc, then ``end``; its chunk is there or not, because Zarr
            renames chunks into place: a tile is done if and only if its chunk of ``end`` is there
            and not empty                                                                       (1)
            the store itself is made under another name, complete with the specification, and renamed (2)
            chunks have checksums. Tiles that do not agree with theirs are computed again; a store that is
            not laid out as its specification says is refused                                       (3)
Assumes     a local or shared file system on which a rename within a folder is atomic
Fails       StoreError where nothing can be written (disc full, no permission); what is there stays
Reference   Zarr format 3
"""

from __future__ import annotations

import hashlib
import json
import os
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np

from vibroimpact._core.checks import shortened
from vibroimpact._core.errors import (
    BackendUnavailableError,
    InvalidParameterError,
    StoreError,
    warn,
)
from vibroimpact._core.files import draft_folder, only_writer
from vibroimpact._core.lazy import xr
from vibroimpact._core.texts import json_of
from vibroimpact._core.types import Arrays
from vibroimpact.sweeps.execution.tiles import Tile, tiles_of
from vibroimpact.sweeps.schema import END, Schema
from vibroimpact.sweeps.specification import SPECIFICATION_ATTRIBUTE, SweepSpec

MOST_SHOWN_DIFFERENCES = 6  # a message lists so many differences between two specifications at most
DIGEST = "digest"  # attribute of a store: that of all its other attributes
PARTIAL = "*.partial"  # what Zarr calls a chunk that is not written to its end


class Store:
    """A store that is open for writing; one process at a time.

    Parameters
    ----------
    path
        A folder that :func:`opened` has made or checked.
    """

    def __init__(self, path: Path, schema: Schema) -> None:
        self.path, self.schema = path, schema
        with _readable(path):
            self.group = _zarr().open_group(path, mode="r+")
            self.arrays = {name: self.group[name] for name in schema.variables}
            _check_layout(self.group, schema)

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

    def drop_damaged(self) -> None:
        """Take tiles that cannot be read as they were written for not done (3)."""
        missing = {tile.chunk for tile in self.missing}
        for tile in tiles_of(tuple(self.schema.grid.values()), self.tile):
            if tile.chunk in missing:
                continue
            try:
                for name, array in self.arrays.items():
                    if not self.schema.variables[name].admits(array[tile.place]):
                        raise ValueError(f"{name} holds what no sweep returns")
            except Exception as error:
                reason = shortened(f"{type(error).__name__}: {error}")
                warn(
                    f"store = {str(self.path)!r}: a tile is damaged ({reason}) and is computed again."
                )
                self._chunk(END, tile).unlink()

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
        return read_store("store", self.path)[list(self.schema.variables)]

    def _chunk(self, name: str, tile: Tile) -> Path:
        """The file of a tile's chunk."""
        array = self.arrays[name]
        own = (0,) * (array.ndim - len(tile.chunk))
        key: str = array.metadata.encode_chunk_key((*tile.chunk, *own))
        return self.path / name / key


def read_store(name: str, path: Path) -> xr.Dataset:
    """Dataset of a store, whose numbers are read when they are wanted, as they are stored.

    Raises
    ------
    InvalidParameterError
        No store; the message begins with ``name``.
    BackendUnavailableError
        Zarr is not installed.
    """
    try:
        _check_attributes(dict(_zarr(name).open_group(path, mode="r").attrs))
        whole: xr.Dataset = xr.open_zarr(
            path, consolidated=False, mask_and_scale=False, decode_times=False
        )
    except BackendUnavailableError:
        raise
    except Exception as error:
        reason = shortened(f"{type(error).__name__}: {error}")
        raise InvalidParameterError(f"{name} = {path}: cannot be read ({reason}).") from error
    del whole.attrs[DIGEST]
    return whole


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
    with only_writer("store", path):
        for partial in path.rglob(PARTIAL):
            partial.unlink(missing_ok=True)  # of a process that was killed
        store = Store(path, schema)
        if strict and store.tile != tile:
            raise InvalidParameterError(
                f"tile: store = {str(path)!r} has tiles of {store.tile}, not {tile}. "
                "Leave tile out; it does not change the results."
            )
        store.drop_damaged()
        yield store


# ---- making (2) ----------------------------------------------------------------------------------


def _make(path: Path, schema: Schema, tile: tuple[int, ...]) -> None:
    """Write the store without results under another name, and rename it."""
    if not path.parent.is_dir():
        raise InvalidParameterError(
            f"store = {str(path)!r}: {str(path.parent)!r} must be a folder. Make it first."
        )
    try:
        with draft_folder(path) as draft:
            _fill(draft, schema, tile)
            draft.rename(path)
    except OSError as error:
        raise StoreError(
            f"store = {str(path)!r}: cannot be made ({error.strerror or error}). "
            "Name one in a folder that you may write, with room."
        ) from error


def _fill(draft: Path, schema: Schema, tile: tuple[int, ...]) -> None:
    others = [name for name, (dims, _, _) in schema.coords.items() if dims != (name,)]
    known = {"coordinates": " ".join(others)} if others else {}  # CF conventions
    attrs = _plain(schema.attrs) | known
    group = _zarr().create_group(draft, zarr_format=3, attributes=attrs | {DIGEST: _digest(attrs)})
    for name, (dims, values, attrs) in schema.coords.items():
        group.create_array(
            name, data=values, dimension_names=dims, attributes=_plain(attrs), compressors=_checksummed()
        )  # fmt: skip
    for name, variable in schema.variables.items():
        group.create_array(
            name,
            shape=schema.shape(name),
            chunks=(*tile, *variable.shape),
            dtype=variable.dtype,
            fill_value=variable.fill,
            dimension_names=schema.dims(name),
            attributes=_plain(variable.attrs),
            compressors=_checksummed(),
        )


def _digest(attrs: Mapping[str, Any]) -> str:
    """Digest of the attributes of a store, of which the specification is one (3)."""
    rest = {name: value for name, value in attrs.items() if name != DIGEST}
    return hashlib.sha256(json.dumps(rest, sort_keys=True).encode()).hexdigest()


def _check_attributes(attrs: Mapping[str, Any]) -> None:
    if attrs.get(DIGEST) != _digest(attrs):
        raise ValueError("its attributes are not those that were written")


def _checksummed() -> Any:
    """Compression of chunks, with which a damage is noticed when they are read (3)."""
    from zarr.codecs import ZstdCodec

    return ZstdCodec(level=0, checksum=True)


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
    with _readable(path):
        group = _zarr().open_group(path, mode="r")
        _check_attributes(dict(group.attrs))
        text = group.attrs[SPECIFICATION_ATTRIBUTE]
        names = json_of("specification", text)["axes"]
        return SweepSpec(text, tuple((name, tuple(group[name][:].tolist())) for name in names))


@contextmanager
def _readable(path: Path) -> Iterator[None]:
    """Refuse what Zarr cannot read, and what is missing in it."""
    try:
        yield
    except InvalidParameterError:
        raise
    except Exception as error:
        reason = shortened(f"{type(error).__name__}: {error}")
        raise InvalidParameterError(
            f"store = {str(path)!r}: is there, but is no store of a sweep, or is damaged ({reason}). Name another."
        ) from error


def _check_layout(group: Any, schema: Schema) -> None:
    """Refuse arrays that are not as :func:`_fill` makes them (3)."""
    for name, (dims, values, attrs) in schema.coords.items():
        if not _is_as(group[name], dims, values.dtype, values.shape, attrs) or not np.array_equal(
            group[name][...], values
        ):
            raise ValueError(f"{name} is another")
    for name, variable in schema.variables.items():
        found = group[name]
        fill = np.asarray(variable.fill, dtype=variable.dtype)
        if (
            not _is_as(found, schema.dims(name), variable.dtype, schema.shape(name), variable.attrs)
            or found.chunks[: len(schema.grid)] != group[END].chunks
            or np.asarray(found.fill_value, dtype=variable.dtype).tobytes() != fill.tobytes()
        ):
            raise ValueError(f"{name} is another")


def _is_as(array: Any, dims: Any, dtype: Any, shape: Any, attrs: dict[str, Any]) -> bool:
    """Whether an array has these dims, type, shape, attributes."""
    kept = json.loads(json.dumps(_plain(attrs)))
    return (
        tuple(array.metadata.dimension_names or ()) == tuple(dims)
        and array.dtype == np.dtype(dtype)
        and array.shape == tuple(shape)
        and dict(array.attrs) == kept
    )


def _zarr(name: str = "store") -> Any:
    try:
        import zarr
    except ImportError:
        raise BackendUnavailableError(
            f"{name}: needs Zarr, which is not installed. Run: pip install 'vibroimpact[store]'."
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
