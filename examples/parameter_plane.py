"""A plane of two parameters: which motion for which forcing frequency and clearance.

Every point is a machine of its own. Blue 1-1-1: one impact at each stop per period.
"""

from __future__ import annotations

import argparse

import numpy as np

import vibroimpact as vi
from vibroimpact.plotting import plot_plane, save

DAMPER = vi.ImpactDamper(
    mass_ratio=0.1, omega_n=0.5, zeta=0.045, restitution=0.8, half_clearance=5.0, omega=1.0
)
START = vi.State((0.0, 0.0), (0.0, 1.0))  # both masses in the middle, the free one moving
ACROSS, UP = 240, 160


def main(out: str | None = None) -> None:
    """Compute the plane, list the most frequent motions, and draw it."""
    over = {
        "omega": np.linspace(0.6, 1.4, ACROSS),
        "half_clearance": np.linspace(1.0, 10.0, UP),
    }
    plane = vi.plane(DAMPER, over=over, start=START, observe="lyapunov")
    motion = plane["motion"]
    words = dict(zip(motion.flag_values, motion.flag_meanings.split(), strict=True))
    codes, machines = np.unique(motion, return_counts=True)
    for i in np.argsort(-machines)[:6]:
        print(f"{words[codes[i]]}: {machines[i]} of {ACROSS * UP} machines")
    ax = plot_plane(plane)
    if out:
        save(ax, out)
    else:
        print("no picture is written: give --out FILE")


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--out", metavar="FILE", help="where to write the picture (SVG, PNG, PDF)")
    main(parser.parse_args().out)
