"""From one parameter to two: a Neimark-Sacker curve with its resonances 1:4, over the motions around it.

Inside the curve the 1-1-1 orbit is unstable. Motions of four half periods, 2-2-2, begin at the resonances.
"""

from __future__ import annotations

import argparse

import numpy as np

import vibroimpact as vi
from vibroimpact.plotting import plot_curves, plot_plane, save

DAMPER = vi.ImpactDamper(
    mass_ratio=0.1, omega_n=0.5, zeta=0.045, restitution=0.8, half_clearance=5.0, omega=0.95
)
START = vi.State((0.0, 0.0), (0.0, 1.0))  # both masses in the middle, the free one moving
ACROSS, UP = 200, 140
OMEGA, CLEARANCE = (0.75, 1.1), (3.0, 10.0)


def main(out: str | None = None) -> None:
    """Follow the curve, print its resonances and what happens there, draw it over a plane."""
    branch = vi.continue_orbit(vi.symmetric_orbits(DAMPER)[0], "omega", (0.9, 1.0))
    curve = vi.continue_bifurcation(branch["NS1"], ("omega", "half_clearance"), (OMEGA, CLEARANCE))
    print(curve)
    for point in curve.special_points:
        if point.kind == "R4":
            form = point.normal_form
            print(f"{point.label}: |A| = {abs(form.scaled):.6f}; {form.meaning}")
    over = {"omega": np.linspace(*OMEGA, ACROSS), "half_clearance": np.linspace(*CLEARANCE, UP)}
    plane = vi.plane(DAMPER, over=over, start=START, settle=500)
    ax = plot_curves([curve], ax=plot_plane(plane, most=4))
    if out:
        save(ax, out)
    else:
        print("no picture is written: give --out FILE")


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--out", metavar="FILE", help="where to write the picture (SVG, PNG, PDF)")
    main(parser.parse_args().out)
