"""The symmetric 1-1-1 orbit of set A in closed form: its multipliers and where they cross."""

from __future__ import annotations

import argparse
from dataclasses import replace

import numpy as np

import vibroimpact as vi
from vibroimpact.plotting import plot_multipliers, save

DAMPER = vi.ImpactDamper(
    mass_ratio=0.1, omega_n=0.5, zeta=0.045, restitution=0.8, half_clearance=5.0, omega=1.2
)
RANGE = (0.85, 1.25)


def main(out: str | None = None) -> None:
    """Print the orbit and its bifurcations, draw the path of the half multipliers."""
    for orbit in vi.symmetric_orbits(DAMPER):
        print(orbit)
        print(f"  determinant identity holds to {orbit.determinant_error:.0e}")
    for point in vi.continue_orbit(vi.symmetric_orbits(DAMPER)[0], "omega", RANGE).special_points:
        print(point)
    path = [
        vi.symmetric_orbits(replace(DAMPER, omega=omega))[0] for omega in np.linspace(*RANGE, 401)
    ]
    ax = plot_multipliers(path)
    if out:
        save(ax, out)
    else:
        print("no picture is written: give --out FILE")


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--out", metavar="FILE", help="where to write the picture (SVG, PNG, PDF)")
    main(parser.parse_args().out)
