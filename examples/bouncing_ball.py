"""A bouncing ball comes to rest after infinitely many impacts, at a time known in closed form.

Dropped from h with restitution e, it rests at sqrt(2 h / g) (1 + e) / (1 - e).
"""

from __future__ import annotations

import argparse
import math

import vibroimpact as vi
from vibroimpact.plotting import plot_history, save

HEIGHT, GRAVITY, RESTITUTION = 1.0, 9.8, 0.5

BALL = vi.Mechanism(
    mass=((1.0,),),
    damping=((0.0,),),
    stiffness=((0.0,),),
    constant_force=(-GRAVITY,),
    elements=(vi.RigidStop((1.0,), lower=0.0, restitution=RESTITUTION),),
)


def main(out: str | None = None) -> None:
    """Compare the end of the chatter with the closed form."""
    run = vi.simulate(BALL, vi.State((HEIGHT,), (0.0,)), t_max=2.0)
    rest = run.time[run.status == vi.Status.CHATTER][0]
    closed = math.sqrt(2.0 * HEIGHT / GRAVITY) * (1.0 + RESTITUTION) / (1.0 - RESTITUTION)
    print(f"at rest after t = {rest:.15f}")
    print(f"closed form       {closed:.15f}")
    ax = plot_history(run)
    if out:
        save(ax, out)
    else:
        print("no picture is written: give --out FILE")


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--out", metavar="FILE", help="where to write the picture (SVG, PNG, PDF)")
    main(parser.parse_args().out)
