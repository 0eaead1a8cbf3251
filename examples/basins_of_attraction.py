"""Basins of attraction: three attractors of one machine, set B of the paper at omega = 0.945.

A symmetric orbit, and two orbits of period eight that are mirror images of each other. The state
that stands for an attractor is handed on: here to find_orbit, which gives its multipliers.
"""

from __future__ import annotations

import argparse

import numpy as np

import vibroimpact as vi
from vibroimpact.plotting import plot_basins, save

DAMPER = vi.ImpactDamper(
    mass_ratio=0.04, omega_n=0.6, zeta=0.025, restitution=0.7, half_clearance=8.0, omega=0.945
)
START = vi.State((0.0, 0.0), (0.0, 1.0))  # of the free mass; place and velocity of the other vary
POINTS = 120


def main(out: str | None = None) -> None:
    """Find the attractors, their shares and their multipliers, and draw the basins."""
    axis = np.linspace(-6.0, 6.0, POINTS)
    basins = vi.basins(DAMPER, over={"x1": axis, "v1": axis}, start=START)
    columns = (basins[key].values for key in ("name", "kind", "share"))
    for name, kind, share in zip(*columns, strict=True):
        print(f"{name}, {kind}: {100.0 * share:.2f}% of the starts")
        if kind == "periodic":
            orbit = vi.find_orbit(DAMPER, vi.attractor_state(basins, name))
            print(f"  largest multiplier {np.abs(orbit.multipliers).max():.6f}")
    ax = plot_basins(basins)
    if out:
        save(ax, out)
    else:
        print("no picture is written: give --out FILE")


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--out", metavar="FILE", help="where to write the picture (SVG, PNG, PDF)")
    main(parser.parse_args().out)
