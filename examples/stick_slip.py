"""A block on a belt that sticks and slips: a motion that nothing forces, and its section.

    x'' + x = f,   |f| <= static while it sticks,   f = kinetic while it slips back

The belt drags the block until its spring pulls with the static level, at x = static; then it swings
back about x = kinetic, and is caught at x = 2 kinetic - static. Under a slow belt the motion is a
saw-tooth with the period 2 (static - kinetic) / speed.
"""

from __future__ import annotations

import argparse
import math

import numpy as np

import vibroimpact as vi
from vibroimpact.plotting import plot_history, save

KINETIC, STATIC = 0.1, 0.2
REST = vi.State((0.0,), (0.0,))


def block(speed: float) -> vi.Mechanism:
    """Return a block on a belt of this speed."""
    friction = vi.Friction((1.0,), KINETIC, STATIC, belt_speed=speed)
    return vi.Mechanism(mass=[[1.0]], damping=[[0.0]], stiffness=[[1.0]], elements=(friction,))


def main(out: str | None = None) -> None:
    """Compare section and period with their closed forms, for belts that become slower."""
    drop = STATIC - KINETIC
    for speed in (0.05, 0.01, 0.001):
        leaves = vi.section(
            block(speed), REST, at=vi.AtChange(takes="backward"), points=3, settle_events=2
        )
        sticks = vi.section(
            block(speed), REST, at=vi.AtChange(takes="stick"), points=3, settle_events=2
        )
        period = np.diff(leaves.time)[-1]
        closed = 2.0 * drop / speed + 2.0 * (math.pi - math.atan2(drop, speed))
        print(
            f"speed {speed:5}: leaves at x = {leaves.x1[-1]:.9f}, is caught at "
            f"{sticks.x1[-1] + 0.0:.9f}; period {period:.9f}, closed form {closed:.9f}, "
            f"saw-tooth {2.0 * drop / speed:.1f}"
        )
    found = vi.classify(block(0.05), REST, settle_events=20, points=64)
    print(f"attractor: {found.label}, {found.shape.period} changes of state in a cycle")
    if out:
        save(plot_history(vi.simulate(block(0.05), REST, t_max=40.0)), out)
    else:
        print("no picture is written: give --out FILE")


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--out", metavar="FILE", help="where to write the picture (SVG, PNG, PDF)")
    main(parser.parse_args().out)
