"""A full disk, as files of results meet it."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest
import xarray as xr

import vibroimpact as vi


def assert_full_disk_leaves_the_old_file(
    save: Callable[[Path], None], path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Saving to a path in an empty folder fails, and leaves there what was there, alone."""
    path.write_bytes(b"old")

    def full(*_: object, **__: object) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(xr.Dataset, "to_netcdf", full)
    with pytest.raises(vi.InvalidParameterError, match="No space left"):
        save(path)
    assert [*path.parent.iterdir()] == [path]
    assert path.read_bytes() == b"old"
