"""The birth of a torus: set A of the paper below its Neimark-Sacker point near omega = 1.0079.

The symmetric orbit, a point of the section, loses its stability; a closed curve is born and grows.
"""

from __future__ import annotations

import argparse

import vibroimpact as vi
from vibroimpact.plotting import plot_section, save, style

OMEGAS = {0.998: style.ORANGE, 1.004: style.GREEN, 1.007: style.BLUE, 1.0083: style.BLACK}


def main(out: str | None = None) -> None:
    """Draw the section at each omega into one picture."""
    ax = None
    for omega, color in OMEGAS.items():
        damper = vi.ImpactDamper(
            mass_ratio=0.1, omega_n=0.5, zeta=0.045, restitution=0.8, half_clearance=5.0,
            omega=omega,
        )  # fmt: skip
        orbit = vi.symmetric_orbits(damper)[0]
        section = vi.section(damper, orbit.state.perturbed(0.01), settle_events=40_000)
        ax = plot_section(section, ax=ax, color=color, label=rf"$\omega={omega}$")
        print(f"omega = {omega}: {orbit.stability.words} orbit, {section}")
    assert ax is not None
    if out:
        save(ax, out)
    else:
        print("no picture is written: give --out FILE")


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--out", metavar="FILE", help="where to write the picture (SVG, PNG, PDF)")
    main(parser.parse_args().out)
