"""A spring that switches: the mesh of two spur gears, in which two pairs of teeth press by turns with one.

x'' + 0.1 x' + k(t) x = 0.3 for the transmission error x, k = 1.6 for 2 radians of every period of the mesh and 0.8 for
the rest. It responds as a linear machine does, but for a band of frequencies in which the mesh itself drives it:
parametric resonance, between two period doublings. Where it begins is followed over the depth of the step.
"""

from __future__ import annotations

import argparse
import math

import numpy as np

import vibroimpact as vi
from vibroimpact.plotting import save, style


def mesh(omega: float = 0.9, two_pairs: float = 1.6, one_pair: float = 0.8) -> vi.Mechanism:
    """Transmission error of the gears; springs act along the line of action, here x itself."""
    teeth = vi.PhaseSwitch(omega, (0.0, 2.0), row=(1.0,), stiffness=(two_pairs, one_pair))
    return vi.Mechanism(
        mass=[[1.0]], damping=[[0.1]], stiffness=[[0.0]], constant_force=(0.3,), elements=(teeth,),
    )  # fmt: skip


def trace(omega: float, two_pairs: float = 1.6, one_pair: float = 0.8) -> float:
    """Trace of the closed form of a period, a product of two damped rotations."""
    whole = np.eye(2)
    for k, phases in ((two_pairs, 2.0), (one_pair, 2.0 * math.pi - 2.0)):
        w, t = math.sqrt(k - 0.05**2), phases / omega
        c, s = math.cos(w * t), math.sin(w * t)
        whole = np.array([[c + 0.05 / w * s, s / w], [-k / w * s, c - 0.05 / w * s]]) @ whole
    return float(np.trace(whole)) * math.exp(-0.05 * 2.0 * math.pi / omega)


def main(out: str | None = None) -> None:
    """Follow the orbit over the frequency, and its doubling over the stiffness of one pair of teeth."""
    gears = vi.Family(mesh)
    orbit = vi.find_orbit(gears, vi.simulate(gears, vi.State((0.0,), (0.0,)), t_max=300.0))
    print(f"trace {orbit.multipliers.sum().real:.12f}, closed form {trace(0.9):.12f}")
    branch = vi.continue_orbit(orbit, "omega", (0.88, 2.4), inadmissible=True)
    for point in branch.special_points:
        left = 1.0 + trace(point.parameter) + math.exp(-0.1 * 2.0 * math.pi / point.parameter)
        print(f"{point.label} at omega = {point.parameter:.9f}, its closed form {abs(left):.0e}")
    curve = vi.continue_bifurcation(branch["PD1"], ("omega", "one_pair"), ((1.4, 2.6), (0.6, 1.6)))
    with style.drawing(None) as ax:
        ax.plot(*curve.values.T, color=style.BLUE)
        ax.plot([p.parameter for p in branch.special_points], [0.8, 0.8], "o", color=style.GREY)
        ax.set(xlabel=r"mesh frequency $\omega$", ylabel="stiffness of one pair of teeth")
    if out:
        save(ax, out)
    else:
        print("no picture is written: give --out FILE")


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--out", metavar="FILE", help="where to write the picture (SVG, PNG, PDF)")
    main(parser.parse_args().out)
