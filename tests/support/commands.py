"""Commands under test: what they print, and a mechanism as a file for --config."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import xarray as xr

import vibroimpact as vi
from vibroimpact.cli import main as cli

if TYPE_CHECKING:
    import pytest

WALL = """
[mechanism]
mass = [[1.0]]
damping = [[0.1]]
stiffness = [[1.0]]

[[mechanism.forces]]
omega = 0.8
sine = [1.0]

[[mechanism.elements]]
kind = "rigid_stop"
row = [1.0]
upper = 0.5
restitution = 0.7

[start]
position = [0.0]
velocity = [0.0]
"""


def said(argv: list[str], capsys: pytest.CaptureFixture[str]) -> str:
    """What a command prints that ends well."""
    assert cli.main(argv) == cli.DONE
    return capsys.readouterr().out


def opened(path: str) -> xr.Dataset:
    """The data of a file."""
    found = vi.load(path)
    return found.to_dataset() if isinstance(found, vi.Result) else found


def assert_nothing_written(
    argv: list[str], status: int, message: str, capsys: pytest.CaptureFixture[str]
) -> None:
    """A command ends with this status and message, and its empty folder stays empty."""
    assert cli.main(argv) == status
    assert message in capsys.readouterr().err
    assert not list(Path().iterdir())
