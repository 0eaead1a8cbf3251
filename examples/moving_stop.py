"""A stop that moves harmonically: a ball on a table that shakes.

table: y = a sin(omega t);  ball: x'' = -g, x >= y, R = 0.5. In the frame of the table, u = x - y:

    u'' = -g + a omega^2 sin(omega t),   u >= 0

which is a mechanism with a stop that stands still.
"""

from __future__ import annotations

import argparse
import math

import matplotlib.pyplot as plt
import numpy as np

import vibroimpact as vi
from vibroimpact.plotting import save

G, A, OMEGA, R = 1.0, 1.1, 1.0, 0.5
START = 0.3  # phase of the table
TABLE = vi.Mechanism(
    mass=[[1.0]], damping=[[0.0]], stiffness=[[0.0]], constant_force=(-G,),
    forces=(vi.Harmonic(OMEGA, sine=(A * OMEGA**2,)),),
    elements=(vi.RigidStop((1.0,), lower=0.0, restitution=R),),
)  # fmt: skip


def main(out: str | None = None) -> None:
    """Let the ball settle to one bounce a period, and compare with the closed form."""
    run = vi.simulate(TABLE, vi.State((0.0,), (2.0,), phase=START), impacts=400)
    # One bounce a period: the ball comes and leaves with the speed pi g / omega; the law of impact
    # then gives the speed of the table, a omega cos(phase).
    closed = math.acos(math.pi * G * (1.0 - R) / (1.0 + R) / (A * OMEGA**2))
    print(f"phase of the impacts: {run.phase[-1]:.12f}, in closed form {closed:.12f}")

    end = float(run.time[-1])
    t = np.linspace(end - 6.0 * math.pi, end, 1000)
    table = A * np.sin(START + OMEGA * t)
    _, ax = plt.subplots(figsize=(5.4, 2.6), layout="constrained")
    ax.plot(t - t[0], run.at(t)[0][:, 0] + table, label="ball: u + y")
    ax.plot(t - t[0], table, label="table: y")
    ax.set(xlabel="time", ylabel="height")
    ax.legend()
    if out:
        save(ax, out)
    else:
        print("no picture is written: give --out FILE")


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--out", metavar="FILE", help="where to write the picture (SVG, PNG, PDF)")
    main(parser.parse_args().out)
