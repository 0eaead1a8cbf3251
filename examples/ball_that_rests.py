"""A ball on a shaken table that rests and is thrown up again: until when?

Force in units of its weight. With a plastic impact it rests until its flight takes the whole period, at sqrt(1 + pi^2).
"""

from __future__ import annotations

import argparse
import math

import vibroimpact as vi
from vibroimpact.plotting import save


def ball(push: float, restitution: float) -> vi.Mechanism:
    """The ball in the frame of the table: x'' = push sin t - 1."""
    return vi.Mechanism(
        mass=[[1.0]], damping=[[0.0]], stiffness=[[0.0]], constant_force=(-1.0,),
        forces=(vi.Harmonic(1.0, (push,)),),
        elements=(vi.RigidStop((1.0,), lower=0.0, restitution=restitution),),
    )  # fmt: skip


def main(out: str | None = None) -> None:
    """Follow the resting ball in the amplitude, and draw how long it flies and rests."""
    start = ball(3.0, 0.0)
    orbit = vi.find_orbit(start, vi.simulate(start, vi.State((0.0,), (0.0,)), impacts=100))
    branch = vi.continue_orbit(orbit, "forces[0].sine[0]", (2.9, 3.4))
    print(branch)
    print(
        f"rest ends at {branch['CS1'].parameter:.12f}, closed form {math.hypot(1.0, math.pi):.12f}"
    )
    bouncing = ball(1.3, 0.5)
    found = vi.find_orbit(bouncing, vi.simulate(bouncing, vi.State((0.0,), (0.0,)), impacts=200))
    print(
        f"with restitution 0.5 it chatters to rest: {found.symbol}, multipliers {found.multipliers}"
    )
    if out:
        save(found.plot(), out)
    else:
        print("no picture is written: give --out FILE")


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--out", metavar="FILE", help="where to write the picture (SVG, PNG, PDF)")
    main(parser.parse_args().out)
