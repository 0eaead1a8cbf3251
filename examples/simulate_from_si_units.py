"""A damper in kilograms and metres: simulate it in SI units."""

from __future__ import annotations

import argparse
import math

import vibroimpact as vi
from vibroimpact.plotting import plot_history, save

M1, M2 = 10.0, 0.8  # kg: main mass, free mass
K, C = 4.0e4, 40.0  # N/m, N s/m
F0, OMEGA = 60.0, 2.0 * math.pi * 10.5  # N, rad/s: near the resonance at 10.07 Hz
D = 6.0e-3  # m: whole play


def main(out: str | None = None) -> None:
    """Compare the largest swing of the main mass with and without the free mass."""
    damper = vi.ImpactDamper.from_physical(
        M1=M1, M2=M2, K=K, C=C, F0=F0, Omega=OMEGA, D=D, restitution=0.6
    )
    print(damper)
    run = vi.simulate(damper, vi.State((0.0, 0.0), (0.0, 0.0)), impacts=4000)
    steady = run.time > run.time[-1] / 2.0
    swing = abs(run.position[steady, 0]).max()
    speed = abs(run.velocity_before[steady, 1] - run.velocity_before[steady, 0]).max()
    alone = F0 / math.hypot(K - M1 * OMEGA**2, C * OMEGA)
    print(f"largest place of the main mass at an impact: {1e3 * swing:.3f} mm")
    print(f"amplitude without the free mass:             {1e3 * alone:.3f} mm")
    print(f"fastest impact: {speed:.3f} m/s")
    end = run.time[-1]
    ax = plot_history(run, end - 5.0 * damper.period, end)
    if out:
        save(ax, out)
    else:
        print("no picture is written: give --out FILE")


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--out", metavar="FILE", help="where to write the picture (SVG, PNG, PDF)")
    main(parser.parse_args().out)
