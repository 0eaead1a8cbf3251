"""From one parameter to two: a Neimark-Sacker curve, its resonances 1:4, and the motions that lock there.

Inside the curve the 1-1-1 orbit is unstable. At one resonance orbits of four half periods, 2-2-2, are born in two
folds: between their curves simulated motions are 2-2-2.
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
ACROSS, UP = 180, 130
OMEGA, CLEARANCE = (0.88, 1.06), (3.6, 7.0)


def main(out: str | None = None) -> None:
    """Follow the curve, and the folds from its resonance; draw them over a plane of motions."""
    branch = vi.continue_orbit(vi.symmetric_orbits(DAMPER)[0], "omega", (0.9, 1.0))
    plane = (OMEGA, CLEARANCE)
    torus = vi.continue_bifurcation(branch["NS1"], ("omega", "half_clearance"), plane)
    print(torus)
    resonances = [point for point in torus.special_points if point.kind == "R4"]
    for point in resonances:
        form = point.normal_form
        print(f"{point.label}: |A| = {abs(form.scaled):.6f}; {form.meaning}")
    (strong,) = (point for point in resonances if point.normal_form.switchable)
    folds = vi.switch_curve(strong)
    if isinstance(folds, vi.NotFound):
        raise SystemExit(folds.reason)
    for fold in folds:
        print(fold)  # or, in the place of one that was not found, why
    folds = [fold for fold in folds if isinstance(fold, vi.BifurcationCurve)]
    over = {"omega": np.linspace(*OMEGA, ACROSS), "half_clearance": np.linspace(*CLEARANCE, UP)}
    motions = vi.plane(DAMPER, over=over, start=START, settle_periods=500)
    ax = plot_curves([torus, *folds], ax=plot_plane(motions, symbols=["1-1-1", "2-2-2", "4-4-4"]))
    if out:
        save(ax, out)
    else:
        print("no picture is written: give --out FILE")


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--out", metavar="FILE", help="where to write the picture (SVG, PNG, PDF)")
    main(parser.parse_args().out)
