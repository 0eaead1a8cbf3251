"""Chatter and sticking in set C: infinitely many impacts, rest on the stop, release."""

from __future__ import annotations

import argparse

import vibroimpact as vi
from vibroimpact.plotting import plot_history, save

DAMPER = vi.ImpactDamper(
    mass_ratio=0.05092, omega_n=1.0, zeta=0.015, restitution=0.7, half_clearance=6.0, omega=0.4205
)
START = DAMPER.on_stop("A", x1=2.25, v1=0.0, v2=-0.34375, phase=4.375)


def main(out: str | None = None) -> None:
    """List the events of the first flight times and draw them."""
    run = vi.simulate(DAMPER, START, impacts=60, t_max=10.0)
    print(run)
    for time, status in zip(run.time, run.status, strict=True):
        if status != vi.Status.IMPACT:
            print(f"t = {time:.6f}: {vi.Status(status).name.lower()}")
    ax = plot_history(run)
    if out:
        save(ax, out)
    else:
        print("no picture is written: give --out FILE")


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--out", metavar="FILE", help="where to write the picture (SVG, PNG, PDF)")
    main(parser.parse_args().out)
