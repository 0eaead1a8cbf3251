"""A mechanism of your own: two coupled masses, a wall for the first, a clearance between the two.

x1 <= 0.4              contact 0, R = 0.7
|x2 - x1| <= 0.6       contact 1, R = 0.5
"""

from __future__ import annotations

import argparse

import vibroimpact as vi
from vibroimpact.plotting import plot_history, save

MECHANISM = vi.Mechanism(
    mass=((1.0, 0.0), (0.0, 0.5)),
    damping=((0.06, -0.02), (-0.02, 0.02)),  # not proportional: that is no special case
    stiffness=((2.0, -1.0), (-1.0, 1.0)),
    forces=(vi.Harmonic(1.8, sine=(1.0, 0.0)),),
    elements=(
        vi.RigidStop((1.0, 0.0), upper=0.4, restitution=0.7),
        vi.RigidStop((-1.0, 1.0), lower=-0.6, upper=0.6, restitution=0.5),
    ),
)


def main(out: str | None = None) -> None:
    """Simulate from rest and count the impacts of each contact."""
    run = vi.simulate(MECHANISM, vi.State((0.0, 0.0), (0.0, 0.0)), impacts=2000)
    print(run)
    for contact in (0, 1):
        for side, stop in ((1, "A"), (-1, "B")):
            here = run.impacts & (run.contact == contact) & (run.side == side)
            print(f"contact {contact}, stop {stop}: {here.sum()} impacts")
    ax = plot_history(run, run.time[-1] - 40.0)
    if out:
        save(ax, out)
    else:
        print("no picture is written: give --out FILE")


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--out", metavar="FILE", help="where to write the picture (SVG, PNG, PDF)")
    main(parser.parse_args().out)
