"""Datasets of one format as netCDF files: written whole or not at all, and refused where they are another's."""

from __future__ import annotations

import os
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from vibroimpact._core.checks import check_kind, check_target, path_of
from vibroimpact._core.errors import InvalidParameterError
from vibroimpact._core.files import replacing

if TYPE_CHECKING:
    import xarray as xr

SUFFIXES = (".nc",)

Array = NDArray[Any]
Table = dict[str, tuple[Any, ...]]
Row = dict[str, Any]


class Format(NamedTuple):
    """Format of datasets, and who makes them.

    Attributes
    ----------
    name
        The attribute ``format`` of such a dataset.
    method, writer
        What converts a result to a dataset, and what writes it to a file.
    """

    name: str
    method: str
    writer: str

    @property
    def advice(self) -> str:
        """What to give."""
        return f"Give what {self.method} or {self.writer} wrote."

    @contextmanager
    def reading(self, data: object) -> Iterator[None]:
        """Refuse what is no dataset of this format; say what is missing or damaged in one that is read inside."""
        import xarray as xr

        check_kind("data", data, xr.Dataset, f"a Dataset, as {self.method} gives")
        assert isinstance(data, xr.Dataset)
        if data.attrs.get("format") != self.name:
            raise InvalidParameterError(
                f"data: format {data.attrs.get('format')!r} must be {self.name!r}. {self.advice}"
            )
        try:
            yield
        except InvalidParameterError:
            raise
        except KeyError as error:
            raise InvalidParameterError(
                f"data: {error.args[0]} is missing. {self.advice}"
            ) from error
        except (ValueError, TypeError, IndexError) as error:
            raise InvalidParameterError(f"data: is damaged ({error}). {self.advice}") from error

    def save(self, data: xr.Dataset, path: str | os.PathLike[str]) -> None:
        """Write a dataset to a file, whole or not at all."""
        target = path_of("path", path)
        check_target(target, SUFFIXES, "path")
        with replacing(target) as temporary:
            data.to_netcdf(temporary, engine="h5netcdf")

    def load(self, path: str | os.PathLike[str]) -> xr.Dataset:
        """Read a file."""
        import xarray as xr

        target = path_of("path", path)
        try:
            with xr.open_dataset(target, engine="h5netcdf") as opened:
                return opened.load()
        except (OSError, ValueError) as error:
            raise InvalidParameterError(
                f"path = {target}: cannot be read ({error}). Name a file that {self.writer} wrote."
            ) from error


# ---- columns of a table, whose names begin with that of their dim ---------------------------------


def words(items: Sequence[str]) -> Array:
    """Column of texts."""
    return np.array(items, dtype=object)


def reals(items: Sequence[float]) -> Array:
    """Column of floats."""
    return np.array(items, dtype=np.float64)


def whole(items: Sequence[int]) -> Array:
    """Column of integers."""
    return np.array(items, dtype=np.int32)


def vectors(items: Sequence[Array], width: int) -> Array:
    """Column of vectors, also of none."""
    return np.array(items, dtype=np.float64).reshape(len(items), width)


def rows_of_table(data: xr.Dataset, dim: str) -> list[Row]:
    """Rows of the table along a dim, with their entries by name."""
    head = dim + "_"
    columns = {str(k): v.values for k, v in data.data_vars.items() if str(k).startswith(head)}
    return [{k: v[i] for k, v in columns.items()} for i in range(data.sizes.get(dim, 0))]
