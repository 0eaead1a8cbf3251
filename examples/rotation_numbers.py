"""Rotation numbers over a plane: how fast the tori of set B turn, and where they lock.

A torus turns about the orbit that it was born from, by its rotation number at every impact on one
stop. Where the motion locks, it repeats after q of them and turns by a fraction p/q: the dots.
Grey: the orbit itself, which does not turn, and chaos, which turns at no steady rate.
"""

from __future__ import annotations

import argparse
from collections import Counter
from fractions import Fraction

import numpy as np

import vibroimpact as vi
from vibroimpact.plotting import plot_plane, save

DAMPER = vi.ImpactDamper(
    mass_ratio=0.04, omega_n=0.6, zeta=0.025, restitution=0.7, half_clearance=8.0, omega=0.95
)
START = vi.State((0.0, 0.0), (0.0, 1.0))  # both masses in the middle, the free one moving
ACROSS, UP = 200, 140


def main(out: str | None = None) -> None:
    """Compute the plane, count the fractions, and draw it with the locked machines."""
    over = {
        "omega": np.linspace(0.9, 1.07, ACROSS),
        "half_clearance": np.linspace(5.5, 13.0, UP),
    }
    plane = vi.plane(
        DAMPER, over=over, start=START, observe="rotation", settle_periods=1000, periods=400
    )
    turning = plane["rotation_error"].values < 1e-3
    i, j = np.nonzero(turning & (plane["period"].values > 1))
    print(f"{turning.sum()} of {ACROSS * UP} machines turn, {len(i)} of them are locked")
    rho, impacts = plane["rotation"].values[i, j], plane["p"].values[i, j]  # p: at stop A
    turns = np.round(rho * impacts).astype(int)
    print(f"locked rotation numbers are fractions within {np.abs(rho - turns / impacts).max():.0e}")
    found = Counter(map(Fraction, turns.tolist(), impacts.tolist()))
    for fraction, machines in found.most_common(4):
        print(f"  {fraction}: {machines} machines")
    ax = plot_plane(plane, variable="rotation")
    ax.plot(over["omega"][i], over["half_clearance"][j], "k.", markersize=1.2)
    if out:
        save(ax, out)
    else:
        print("no picture is written: give --out FILE")


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--out", metavar="FILE", help="where to write the picture (SVG, PNG, PDF)")
    main(parser.parse_args().out)
