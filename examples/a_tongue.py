"""A tongue of locked motion: from its tip, a weak resonance 2/9, between two curves of folds.

Between the sides there are orbits that close after nine half periods. Near the tip one of them is stable, and
motions that start near it lock to it; beyond the resonances R1 on the sides both are unstable. The region is filled
down to where a side turns back.
"""

from __future__ import annotations

import argparse

import vibroimpact as vi
from vibroimpact.continuation import Steps
from vibroimpact.plotting import plot_curves, save

DAMPER = vi.ImpactDamper(
    mass_ratio=0.1, omega_n=0.5, zeta=0.045, restitution=0.8, half_clearance=7.0, omega=0.85
)
NAMES = ("omega", "half_clearance")
BOUNDS = ((0.75, 0.9), (6.0, 8.0))
POINTS = 600  # of every side, in each direction


def main(out: str | None = None) -> None:
    """Follow the Neimark-Sacker curve and both sides of the tongue, print its widths, draw it."""
    branch = vi.continue_orbit(vi.symmetric_orbits(DAMPER)[0], "omega", (0.8, 0.9))
    curve = vi.continue_bifurcation(branch["NS1"], NAMES, BOUNDS)
    steps = Steps(first=0.02, largest=0.5, tolerance=1e-6, points=POINTS)
    tongue = vi.tongue(curve["2/9_1"], steps=steps)
    print(tongue)
    if isinstance(tongue, vi.NoTongue):
        return
    for clearance in (7.7, 7.5, 7.0, 6.5):
        print(f"half clearance {clearance}: {tongue.width(clearance):.6f} wide in omega")
    ax = tongue.plot(ax=plot_curves([curve], bounds=BOUNDS))
    if out:
        save(ax, out)
    else:
        print("no picture is written: give --out FILE")


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--out", metavar="FILE", help="where to write the picture (SVG, PNG, PDF)")
    main(parser.parse_args().out)
