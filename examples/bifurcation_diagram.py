"""A bifurcation diagram by brute force: set B followed up, then down, so that hysteresis is seen.

Where orange and blue part, two attractors coexist, and the past of the machine decides.
"""

from __future__ import annotations

import argparse

import numpy as np

import vibroimpact as vi
from vibroimpact.plotting import plot_bifurcation_diagram, save

DAMPER = vi.ImpactDamper(
    mass_ratio=0.04, omega_n=0.6, zeta=0.025, restitution=0.7, half_clearance=8.0, omega=0.93
)
START = vi.State((0.0, 0.0), (0.0, 1.0))  # both masses in the middle, the free one moving
VALUES = 300
SETTLE = 1500  # forcing periods at each frequency


def main(out: str | None = None) -> None:
    """Follow, say where the two ways part, and draw the section."""
    diagram = vi.bifurcation_sweep(
        DAMPER, over={"omega": np.linspace(0.935, 0.965, VALUES)}, start=START, way="both",
        settle_periods=SETTLE, periods=60, observe="symbol",
    )  # fmt: skip
    up, down = (diagram.sel(direction=way) for way in ("up", "down"))
    apart = diagram.omega.values[(up.n != down.n).values]
    print(f"{2 * VALUES} motions of {SETTLE + 60} forcing periods")
    if apart.size:
        print(f"different symbols up and down between {apart.min():.5f} and {apart.max():.5f}")
    ax = plot_bifurcation_diagram(diagram, variable="x1")
    if out:
        save(ax, out)
    else:
        print("no picture is written: give --out FILE")


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--out", metavar="FILE", help="where to write the picture (SVG, PNG, PDF)")
    main(parser.parse_args().out)
