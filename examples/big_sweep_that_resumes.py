"""A sweep that is kept on disc, is interrupted, and goes on: nothing that was done is done twice.

Needs Zarr: pip install 'vibroimpact[store]'. Here the interruption is made on purpose, half way; a
power cut would lose no more. With --store FOLDER the results stay.
"""

from __future__ import annotations

import argparse
import tempfile
from collections.abc import Callable
from pathlib import Path

import numpy as np
import xarray as xr

import vibroimpact as vi
from vibroimpact.plotting import plot_plane, save

DAMPER = vi.ImpactDamper(
    mass_ratio=0.1, omega_n=0.5, zeta=0.045, restitution=0.8, half_clearance=5.0, omega=1.0
)
START = vi.State((0.0, 0.0), (0.0, 1.0))
ACROSS, UP, TILE = 160, 100, 1000  # machines; how many are computed and stored together


def swept(store: Path, progress: bool | Callable[[vi.ProgressReport], object]) -> xr.Dataset:
    """Ask the same question again: only what is missing is computed."""
    over = {"omega": np.linspace(0.7, 1.3, ACROSS), "restitution": np.linspace(0.5, 0.95, UP)}
    return vi.plane(DAMPER, over=over, start=START, store=store, tile=TILE, progress=progress)


def stop_half_way(report: vi.ProgressReport) -> None:
    """Play the user who presses Ctrl-C."""
    print(f"first run: {report.text}")
    if 2 * report.done >= (report.total or 0):
        raise KeyboardInterrupt


def main(out: str | None = None, store: str | None = None) -> None:
    """Begin, be interrupted, go on, and draw what is in the store."""
    with tempfile.TemporaryDirectory() as folder:
        place = Path(store or folder) / "plane.zarr"
        try:
            swept(place, stop_half_way)
        except KeyboardInterrupt as stopped:
            print(stopped)
        plane = swept(place, lambda done, total: print(f"second run: {done} of {total} left"))
        ax = plot_plane(plane.load())
        if out:
            save(ax, out)
        else:
            print("no picture is written: give --out FILE")


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--out", metavar="FILE", help="where to write the picture (SVG, PNG, PDF)")
    parser.add_argument("--store", metavar="FOLDER", help="keep the results there")
    main(**vars(parser.parse_args()))
