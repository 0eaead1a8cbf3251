"""A tongue of locked motion: from its tip, a weak resonance 1/5, between two curves of folds.

Between the sides motion locks to an orbit that closes after five half periods; outside it is not periodic.
"""

from __future__ import annotations

import argparse

import vibroimpact as vi
from vibroimpact.plotting import plot_curves, save

DAMPER = vi.ImpactDamper(
    mass_ratio=0.04, omega_n=0.6, zeta=0.025, restitution=0.7, half_clearance=9.5, omega=1.0
)
NAMES = ("omega", "half_clearance")
BOUNDS = ((0.96, 1.02), (7.6, 10.5))


def main(out: str | None = None) -> None:
    """Follow the Neimark-Sacker curve and both sides of the tongue, print its widths, draw it."""
    branch = vi.continue_orbit(vi.symmetric_orbits(DAMPER)[0], "omega", (0.98, 1.02))
    curve = vi.continue_bifurcation(branch["NS1"], NAMES, BOUNDS)
    tongue = vi.tongue(curve["1/5_1"])
    print(tongue)
    if isinstance(tongue, vi.NotFound):
        return
    for clearance in (9.8, 9.5, 9.0, 8.0):
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
