"""A force that is not harmonic: an oscillator before a stop, driven by a square wave.

x'' + 0.1 x' + x = +-0.5, x <= 0.6, R = 0.7; the sign changes every 2 units of time. Between two
changes the force is constant: the motion is simulated in pieces, each from ``run.last`` on.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator

import matplotlib.pyplot as plt
import numpy as np

import vibroimpact as vi
from vibroimpact.plotting import save

HALF, FORCE, PERIODS, SHOWN = 2.0, 0.5, 100, 6


def pushed(force: float) -> vi.Mechanism:
    """The oscillator under a constant force."""
    return vi.Mechanism(
        mass=[[1.0]], damping=[[0.1]], stiffness=[[1.0]], constant_force=(force,),
        elements=(vi.RigidStop((1.0,), upper=0.6, restitution=0.7),),
    )  # fmt: skip


def pieces(state: vi.State, count: int) -> Iterator[vi.Run]:
    """The motion between one change of the force and the next."""
    signs = pushed(FORCE), pushed(-FORCE)
    for k in range(count):
        run = vi.simulate(signs[k % 2], state, t_max=HALF, impacts=10_000)
        state = run.last
        yield run


def main(out: str | None = None) -> None:
    """Let the motion settle; say what it repeats."""
    runs = list(pieces(vi.State((0.0,), (0.0,)), 2 * PERIODS))
    ends = np.array([[*run.last.position, *run.last.velocity] for run in runs[1::2]])
    print(f"impacts in the last period: {sum(int(run.impacts.sum()) for run in runs[-2:])}")
    print(f"change from one period to the next: {np.abs(ends[-1] - ends[-2]).max():.1e}")

    _, ax = plt.subplots(figsize=(5.4, 2.6), layout="constrained")
    for k, run in enumerate(runs[-2 * SHOWN :]):
        t = np.linspace(0.0, run.time[-1], 200)
        ax.plot(k * HALF + t, run.at(t)[0][:, 0], color=("#0072B2", "#D55E00")[k % 2])
    ax.axhline(0.6, color="#8C8C8C", linewidth=2.0)
    ax.set(xlabel="time", ylabel="$x$: force +0.5 blue, -0.5 red")
    if out:
        save(ax, out)
    else:
        print("no picture is written: give --out FILE")


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--out", metavar="FILE", help="where to write the picture (SVG, PNG, PDF)")
    main(parser.parse_args().out)
