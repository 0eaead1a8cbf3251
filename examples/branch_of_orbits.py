"""From one orbit to the branches around it: bifurcations, the branch that breaks the symmetry."""

from __future__ import annotations

import argparse

import vibroimpact as vi
from vibroimpact.plotting import plot_branches, save

DAMPER = vi.ImpactDamper(
    mass_ratio=0.1, omega_n=0.5, zeta=0.045, restitution=0.8, half_clearance=5.0, omega=0.75
)


def main(out: str | None = None) -> None:
    """Follow the symmetric orbit, go over to the orbits without symmetry, draw both."""
    orbit = vi.symmetric_orbits(DAMPER)[0]
    symmetric = vi.continue_orbit(orbit, "omega", (0.6, 1.0))
    print(symmetric)
    broken = vi.switch_branch(symmetric["BP1"], (0.6, 1.0))
    if isinstance(broken, vi.NotFound):
        raise SystemExit(broken.reason)
    print(broken)
    circle = symmetric["NS1"].normal_form
    print(circle)
    ax = plot_branches([symmetric, broken], variable="x1", stop=(0, 1), mirror=True)
    if out:
        save(ax, out)
    else:
        print("no picture is written: give --out FILE")


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--out", metavar="FILE", help="where to write the picture (SVG, PNG, PDF)")
    main(parser.parse_args().out)
