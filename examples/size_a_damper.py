"""From data sheet to damper: the best ball for a frame of 120 kg between 6 and 10 Hz, in SI units."""

from __future__ import annotations

import argparse
import math
from dataclasses import replace

import matplotlib as mpl
from matplotlib.figure import Figure

import vibroimpact as vi
from vibroimpact.plotting import plot_design, plot_mechanism, save, style

M1, HERTZ, DAMPING = 120.0, 8.0, 0.02  # kg, Hz, of critical damping
FORCE, BAND = 400.0, (6.0, 10.0)  # N, Hz
BUDGET, STARTS, REFINE = 400, 2, 2  # machines to try, starts of each, and how much more at the end


def main(out: str | None = None) -> None:
    """Search mass, clearance and restitution; print and draw the damper and what it does."""
    w = 2.0 * math.pi * HERTZ
    frame = vi.ImpactDamper.from_physical(
        M1=M1, M2=6.0, K=M1 * w**2, C=2.0 * DAMPING * M1 * w, F0=FORCE, Omega=w, D=0.02,
        restitution=0.6,
    )  # fmt: skip
    vary = {"mass_ratio": (0.02, 0.15), "half_clearance": (2e-3, 50e-3), "restitution": (0.3, 0.9)}
    over = vi.Objective("omega", BAND, "x1", unit="Hz", starts=STARTS)
    best = vi.optimise(frame, vary, over, budget=BUDGET, refine=REFINE)
    print(best)
    for name, (low, high, _) in best.robust().items():
        print(f"{name}: {best.parameters[name]:.4g}; within 1 dB from {low:.4g} to {high:.4g}")
    with mpl.rc_context(style.RC):
        figure = Figure(figsize=(5.0, 5.0), layout="constrained")
        above, below = figure.subplots(2, height_ratios=(2, 3))
    plot_mechanism(replace(frame, **best.parameters), ax=above)
    plot_design(best, ax=below)
    if out:
        save(below, out)
    else:
        print("no picture is written: give --out FILE")


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--out", metavar="FILE", help="where to write the picture (SVG, PNG, PDF)")
    main(parser.parse_args().out)
