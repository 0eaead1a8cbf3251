"""A mass that meets a soft stop: the impact oscillator with a spring of 29 times its own behind a gap.

    x'' + c x' + x = a w^2 sin(w t) + f,   f = -(29 (x - gap) + c2 x') where that presses

The strip below the motion shows when the stop is pressed, and when the mass is within it but free:
the stop lets go where its force would pull. The energy that the stop takes is the area of its
hysteresis loop.
"""

from __future__ import annotations

import argparse
import math

import numpy as np

import vibroimpact as vi
from vibroimpact.plotting import plot_history, save

GAP, OMEGA, A = 0.6, 0.75, 0.9
STOP = vi.SoftStop((1.0,), upper=GAP, stiffness=29.0, damping=3.0)
OSCILLATOR = vi.Mechanism(
    mass=[[1.0]], damping=[[0.02]], stiffness=[[1.0]],
    forces=(vi.Harmonic(OMEGA, sine=(A * OMEGA**2,)),), elements=(STOP,),
)  # fmt: skip
PERIOD = 2.0 * math.pi / OMEGA


def main(out: str | None = None) -> None:
    """Let the motion settle, and compare the energies of a period."""
    run = vi.simulate(OSCILLATOR, vi.State((0.0,), (0.0,)), t_max=60.0 * PERIOD)
    last = run.time[run.time > 59.0 * PERIOD]  # events, before and after which the force differs
    even = np.linspace(59.0 * PERIOD, 60.0 * PERIOD, 100_001)
    t = np.unique(np.concatenate([even, last, np.nextafter(last, 0.0)]))
    velocity, force = run.at(t)[1][:, 0], run.forces(t)[:, 0]
    pushed = A * OMEGA**2 * np.sin(OMEGA * t)
    given, lost, taken = (
        np.trapezoid(power, t)
        for power in (pushed * velocity, 0.02 * velocity**2, -force * velocity)
    )
    print(f"energy of a period: {given:.6f} in, {lost:.6f} in the dashpot, {taken:.6f} in the stop")
    states = run.states[-len(last) :, 0]
    print("states:", ", ".join(vi.SoftStopState(s).name for s in dict.fromkeys(states)))
    if out:
        save(plot_history(run, 56.0 * PERIOD, 60.0 * PERIOD), out)
    else:
        print("no picture is written: give --out FILE")


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--out", metavar="FILE", help="where to write the picture (SVG, PNG, PDF)")
    main(parser.parse_args().out)
