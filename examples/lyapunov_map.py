"""A map of the largest Lyapunov exponent of a mass that hits a wall, over frequency and gap.

Blue: disturbances die out. White: they neither grow nor die. Red: chaos. Any mechanism can be
swept, by the path of its parameters.
"""

from __future__ import annotations

import argparse

import numpy as np

import vibroimpact as vi
from vibroimpact.plotting import plot_plane, save

WALL = vi.Mechanism(
    mass=[[1.0]], damping=[[0.1]], stiffness=[[1.0]],
    forces=(vi.Harmonic(2.5, (1.0,)),),
    elements=(vi.RigidStop((1.0,), upper=0.0, restitution=0.8),),
)  # fmt: skip
START = vi.State((-1.0,), (0.0,))
ACROSS, UP = 200, 140


def main(out: str | None = None) -> None:
    """Compute the map, count the chaotic machines, and draw it."""
    over = {
        "omega": np.linspace(1.6, 4.4, ACROSS),
        "elements[0].upper": np.linspace(-0.4, 0.4, UP),
    }
    found = vi.plane(
        WALL, over=over, start=START, observe="lyapunov", settle_periods=150, periods=80
    )
    chaotic = float((found["lyapunov"] > 0.02).mean())
    print(f"{100.0 * chaotic:.1f}% of {ACROSS * UP} machines have an exponent above 0.02")
    ax = plot_plane(found, variable="lyapunov")
    ax.set_ylabel("place of the wall $b$")
    if out:
        save(ax, out)
    else:
        print("no picture is written: give --out FILE")


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--out", metavar="FILE", help="where to write the picture (SVG, PNG, PDF)")
    main(parser.parse_args().out)
