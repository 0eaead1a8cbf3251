"""The vibro-impact capsule: which way it goes."""

from __future__ import annotations

import math
from functools import cache

import numpy as np
from matplotlib import pyplot as plt
from matplotlib.axes import Axes

import vibroimpact as vi
from vibroimpact.plotting import style
from vibroimpact_papers.judged import Claim, RuleResult, rule_result
from vibroimpact_papers.publication import Publication

PAPER = Publication(
    name="capsule",
    title="Which way a vibro-impact capsule goes",
    reference=(
        "Y. Liu, E. Pavlovskaia, D. Hendry, M. Wiercigroch, Vibro-impact responses of capsule system with "
        "various friction "
        "models, Int. J. Mech. Sci. (July 2013) 39-54."
    ),
    seen="the abstract.",
    machine=(
        "VibroImpactCapsule with Coulomb friction, one of its four laws. Parameters are ours: k = m = 1, c = "
        "0.1, plate 15, "
        "gap 0.02, F = 0.8, omega = 0.9, friction 0.5; the mass of the capsule varies."
    ),
    missing=(
        "its parameters and bifurcation diagrams",
        "its other laws of friction, but for viscous damping, are no elements",
    ),
)
OMEGA, FRICTION = 0.9, 0.5
TURN = 2.0 * math.pi / OMEGA
SETTLE, COUNT = 200, 60  # periods


def capsule(mass: float) -> vi.machines.VibroImpactCapsule:
    """A capsule of some mass."""
    return vi.machines.VibroImpactCapsule(capsule_mass=mass, omega=OMEGA, friction=FRICTION)


def progress(mass: float, start: vi.State | None = None) -> tuple[float, float]:
    """Mean progress in a period, and the largest change of x1 - x2 after the periods of the motion."""
    system = capsule(mass)
    run = vi.simulate(
        system, start or system.free_start(), t_max=(SETTLE + COUNT) * TURN, impacts=10**6
    )
    x, _ = run.at((SETTLE + np.arange(COUNT + 1)) * TURN)
    p = x[:, 0] - x[:, 1]
    repeats = min(float(np.abs(p[n:] - p[:-n]).max()) for n in (1, 2, 3, 4, 6))
    return float(x[-1, 1] - x[0, 1]) / COUNT, repeats


def stepped(mass: float, steps: int = 4000, settle: int = 40, count: int = 24) -> float:
    """Witness: mean progress in a period by small steps, velocities first, friction solved in each step.

    The error is of first order in the step.
    """
    h = TURN / steps
    x1 = x2 = v1 = v2 = 0.0
    begin = 0.0
    wave = [0.8 * math.cos(2.0 * math.pi * k / steps) for k in range(steps)]
    for period in range(settle + count):
        if period == settle:
            begin = x2
        for force in wave:
            u = x1 - x2
            inner = u + 0.1 * (v1 - v2) + (15.0 * (u - 0.02) if u > 0.02 else 0.0)
            v1 += h * (force - inner)
            free = v2 + h * (inner - force) / mass
            most = h * FRICTION / mass
            v2 = free - most if free > most else free + most if free < -most else 0.0
            x1 += h * v1
            x2 += h * v2
    return (x2 - begin) / count


@cache
def both_ways() -> dict[float, tuple[float, float]]:
    """Progress of a light and of a heavier capsule."""
    return {mass: progress(mass) for mass in (0.5, 2.0)}


@PAPER.statement(
    "abstract", "directional control of the system can be achieved either by varying its mass ratio"
)
def by_the_mass_ratio(_: Claim) -> RuleResult:
    """Signs of the progress of two capsules."""
    found = both_ways()
    own = {mass: stepped(mass, steps=1500) for mass in found}
    back, on = (value for value, _ in found.values())
    agree = all(value * own[mass] > 0.0 for mass, (value, _) in found.items())
    return rule_result(
        back < 0.0 < on and agree,
        ", ".join(
            f"M/m = {mass:g}: {value:+.4f} in a period" for mass, (value, _) in found.items()
        ),
        "small steps with implicit friction: "
        + ", ".join(f"{value:+.4f}" for value in own.values()),
        progress=[back, on],
    )


@PAPER.statement("abstract", "or by switching between co-existing attractors", slow=True)
def by_the_attractor(_: Claim) -> RuleResult:
    """Signs of the progress from many starts, of capsules of several masses."""
    rng = np.random.default_rng(7)
    for mass in (0.7, 0.8, 0.9, 0.6, 1.0):
        ways = {}
        for _i in range(12):
            x1, v1, v2 = rng.uniform(-2.0, 0.0), rng.uniform(-2.0, 2.0), rng.uniform(-1.0, 1.0)
            start = vi.State((float(x1), 0.0), (float(v1), float(v2)))
            value, repeats = progress(mass, start)
            if repeats < 1e-6:
                ways[math.copysign(1.0, value)] = value
        if len(ways) == 2:
            text = " and ".join(f"{value:+.4f}" for value in ways.values())
            return rule_result(
                True,
                f"M/m = {mass:g}: periodic motions that go {text} in a period",
                "both repeat themselves within 1e-6 for sixty periods",
            )
    return rule_result(
        None,
        "12 starts at each of five masses: no two periodic motions of different direction",
        "its parameters are not to be had, and a search proves no absence",
    )


@PAPER.picture(
    "Progress",
    "Mean progress in a period over the mass ratio, of the library (dots) and by small steps (crosses): a light "
    "capsule "
    "goes backwards.",
)
def over_the_mass() -> Axes:
    """Progress over the mass ratio."""
    _, ax = plt.subplots(figsize=(5.4, 3.4), layout="constrained")
    masses = np.geomspace(0.25, 8.0, 60)
    ax.plot(masses, [progress(float(m))[0] for m in masses], ".", color=style.BLUE)
    few = masses[::10]
    ax.plot(few, [stepped(float(m), steps=1500) for m in few], "x", color=style.VERMILION)
    ax.axhline(0.0, color="black", linewidth=0.6)
    ax.set(xscale="log", xlabel="mass ratio $M/m$", ylabel="progress in a period")
    return ax
