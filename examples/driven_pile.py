"""A ram that drives a pile: the pile is a slider, which the soil holds up to a force.

    ram x1'' + c x1' = a sin t + p - f,   f = 40 (x1 - x2 - gap) + c2 (x1' - x2') where it presses

The slider x2 has no mass: it stays where it is until f reaches the level of the soil, and then gives
way. Nothing holds the machine in its place, so that its motion repeats but for the drift; the work
of the soil in a period is its level times the drift.
"""

from __future__ import annotations

import argparse
import math

import numpy as np

import vibroimpact as vi
from vibroimpact.plotting import plot_history, save

LEVEL, GAP, PUSH = 0.6, 0.05, 0.2
PILE = vi.Mechanism(
    mass=[[1.0, 0.0], [0.0, 0.0]], damping=[[0.2, 0.0], [0.0, 0.0]], stiffness=np.zeros((2, 2)),
    elements=(
        vi.SoftStop((1.0, -1.0), upper=GAP, stiffness=40.0, damping=0.8),
        vi.Friction((0.0, 1.0), LEVEL),
    ),
    forces=(vi.Harmonic(1.0, (0.8, 0.0)),), constant_force=(PUSH, 0.0),
)  # fmt: skip
START = vi.State((0.0, 0.0), (0.0, 0.0))
PERIOD = 2.0 * math.pi


def main(out: str | None = None) -> None:
    """Take the drift from a section, and compare the work of a period with it."""
    section = vi.section(PILE, START, at=vi.AtPhase(), points=10, settle_events=50)
    drift = np.diff(section.position[:, 1])[-1]
    places = section.relative[:, 0]
    print(f"the pile is driven by {drift:.9f} a period")
    same = np.ptp(places) < 1e-9
    print(f"the ram is {-places[-1]:.9f} behind it at phase 0, the same to 1e-9: {same}")
    seen = vi.sweep(
        PILE, over={"constant_force[0]": [PUSH]}, start=START, settle_periods=50, periods=50,
        observe="dissipation", progress=False,
    )  # fmt: skip
    work = PERIOD * float(seen.work_on_element[0, 1])
    print(f"work of the soil in a period {work:.9f}, level times drift {LEVEL * drift:.9f}")
    if out:
        save(plot_history(vi.simulate(PILE, START, t_max=5.0 * PERIOD)), out)
    else:
        print("no picture is written: give --out FILE")


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--out", metavar="FILE", help="where to write the picture (SVG, PNG, PDF)")
    main(parser.parse_args().out)
