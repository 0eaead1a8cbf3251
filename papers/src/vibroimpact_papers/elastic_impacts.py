"""The elastic impact oscillator: area, grazing, chaos, order, and growth without bound."""

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
from vibroimpact_papers.witness import next_impact, speeds_of_impacts

PAPER = Publication(
    name="elastic-impacts",
    title="The elastic impact oscillator",
    reference=(
        "H. Lamba, Chaotic, regular and unbounded behaviour in the elastic impact oscillator, arXiv chao-dyn/9310004 "
        "(1993)."
    ),
    seen="the abstract and the equation (1).",
    machine="ImpactOscillator: x'' + x = cos(omega t), x < sigma, restitution 1. omega and sigma are ours.",
    missing=("the parameters of its figures",),
)


def oscillator(omega: float, sigma: float) -> vi.ImpactOscillator:
    """The equation (1) with r = 1."""
    return vi.ImpactOscillator(zeta=0.0, omega=omega, restitution=1.0, clearance=sigma)


@cache
def orbit() -> vi.Orbit:
    """One impact in a period."""
    return vi.find_orbit(oscillator(2.8, 0.2), vi.State((0.2,), (-0.3,), 0.1), stops="A", cycles=1)


@PAPER.statement(
    "abstract", "A discontinuous area-preserving mapping", notes="Here omega = 2.8, sigma = 0.2."
)
def area_preserving(_: Claim) -> RuleResult:
    """Product of the multipliers, and the determinant of the witness in time and energy."""
    product = complex(np.prod(orbit().multipliers)).real
    t, v, h = 0.3, 0.9, 1e-6

    def energies(t: float, v: float) -> tuple[float, float]:
        time, speed = next_impact(t, math.sqrt(2.0 * v), 2.8, 0.2)
        return time, speed * speed / 2.0

    e = v * v / 2.0
    columns = [
        [
            (x - y) / (2.0 * h)
            for x, y in zip(energies(t + dt, e + de), energies(t - dt, e - de), strict=True)
        ]
        for dt, de in ((h, 0.0), (0.0, h))
    ]
    det = columns[0][0] * columns[1][1] - columns[0][1] * columns[1][0]
    return rule_result(
        abs(product - 1.0) < 1e-9 and abs(det - 1.0) < 1e-6,
        f"product of the multipliers of a periodic orbit: {product:.12f}",
        f"bisection: d(time, energy) at a point off it, by differences, has the determinant {det:.7f}",
        product=product,
    )


@PAPER.statement("abstract", "The discontinuity in the mapping is due to grazing")
def discontinuous_by_grazing(_: Claim) -> RuleResult:
    """Two starts beside each other, one of which just misses the stop."""
    omega, sigma = 2.8, 0.1
    system = oscillator(omega, sigma)

    def after(v: float) -> float:
        run = vi.simulate(system, vi.State((sigma,), (-v,), 0.0), impacts=1)
        return float(run.time[-1])

    speeds = np.linspace(0.05, 1.5, 400)
    times = np.array([after(v) for v in speeds])
    k = int(np.argmax(np.abs(np.diff(times))))
    low, high = speeds[k], speeds[k + 1]
    for _i in range(40):
        middle = (low + high) / 2.0
        if abs(after(middle) - times[k]) < abs(times[k + 1] - times[k]) / 2.0:
            low = middle
        else:
            high = middle
    jump = after(high) - after(low)
    early = low - 1e-6 if jump > 0.0 else high + 1e-6
    time, speed = next_impact(0.0, float(early), omega, sigma)
    return rule_result(
        abs(jump) > 0.1 and high - low < 1e-9 and abs(speed) < 0.02,
        f"between speeds {high - low:.0e} apart the time of the next impact jumps by {abs(jump):.4f}",
        f"bisection: 1e-6 beside it the earlier impact, at {time:.4f}, has the speed {speed:.4f}: it grazes",
        jump=jump,
    )


@PAPER.statement("title", "Chaotic, regular", notes="Here omega = 3.3, sigma = 0; two starts.")
def chaotic_and_regular(_: Claim) -> RuleResult:
    """Exponents of two motions, and how far two witnesses part that begin 1e-9 apart."""
    system = oscillator(3.3, 0.0)
    rates, apart = [], []
    for v in (0.1, 30.0):
        found = vi.lyapunov_exponent(system, vi.State((0.0,), (-v,), 0.0), impacts=200_000)
        rates.append((found.value, found.error))
        last = [
            speeds_of_impacts(3.3, 0.0, 1.0, 0.0, u, settle=59, kept=1)[0] for u in (v, v + 1e-9)
        ]
        apart.append(abs(last[0] - last[1]))
    chaotic, regular = rates
    return rule_result(
        chaotic[0] > 3.0 * chaotic[1] and abs(regular[0]) < 1e-2 and apart[0] > 1e3 * apart[1],
        f"exponent {chaotic[0]:.3f} ± {chaotic[1]:.3f} from v = 0.1, {regular[0]:.4f} ± {regular[1]:.4f} from v = 30",
        f"bisection: two motions 1e-9 apart are {apart[0]:.0e} apart after 60 impacts from v = 0.1, "
        f"{apart[1]:.0e} from 30",
    )


@PAPER.statement(
    "abstract", "the existence of invariant curves that bound the energy of the motion"
)
def energy_is_bounded(_: Claim) -> RuleResult:
    """Speeds of 20000 impacts that begin with 30 at omega = 2.8."""
    run = vi.simulate(oscillator(2.8, 0.0), vi.State((0.0,), (-30.0,), 0.0), impacts=20_000)
    speed = np.abs(run.velocity_after[:, 0])
    own = speeds_of_impacts(2.8, 0.0, 1.0, 0.0, 30.0, settle=0, kept=300)
    first = float(np.abs(speed[:300] - own).max())
    return rule_result(
        float(np.ptp(speed)) < 1.0 and first < 1e-6,
        f"speeds stay within {speed.min():.3f} and {speed.max():.3f} in 20000 impacts; no proof",
        f"bisection gives the first 300 speeds within {first:.0e}",
    )


@PAPER.statement(
    "title",
    "and unbounded behaviour",
    notes="Here omega = 2, sigma = 0: an impact in each period, in step.",
)
def unbounded(_: Claim) -> RuleResult:
    """Growth at resonance, in closed form while impacts stay in step."""
    run = vi.simulate(oscillator(2.0, 0.0), vi.State((0.0,), (-100.0,), math.pi / 2.0), impacts=400)
    speed = np.abs(run.velocity_after[:, 0])
    gain = float(np.diff(speed)[-100:].mean())
    phase = float(np.mod(2.0 * run.time[-1] + math.pi / 2.0, 2.0 * math.pi))
    # from one impact at the phase th to the next, half a free period later: v grows by 2 a omega sin th
    exact = 2.0 * 2.0 / 3.0 * math.sin(phase)
    return rule_result(
        gain > 0.1 and abs(gain / exact - 1.0) < 0.02,
        f"the speed grows from 100 to {speed[-1]:.1f} in 400 impacts, by {gain:.4f} each",
        f"closed form for a flight of exactly π at that phase: {exact:.4f}",
        gain=gain,
    )


@PAPER.picture(
    "Speeds and phases of impacts",
    "omega = 3.3, sigma = 0, 24 motions: a sea of chaos below, curves that bound it above.",
)
def sea() -> Axes:
    """Impacts of motions from several speeds."""
    _, ax = plt.subplots(figsize=(5.2, 4.0), layout="constrained")
    colours = (style.BLUE, style.ORANGE, style.GREEN, style.VERMILION, style.PURPLE, style.BLACK)
    for k, v in enumerate(np.linspace(0.05, 3.0, 24)):
        run = vi.simulate(oscillator(3.3, 0.0), vi.State((0.0,), (-float(v),), 0.0), impacts=700)
        phase = np.mod(3.3 * run.time, 2.0 * math.pi)
        ax.plot(phase, -run.velocity_after[:, 0], ".", markersize=1.0, color=colours[k % 6])
    ax.set(
        xlabel=r"phase $\omega t$ at the impact",
        ylabel="speed after it",
        xlim=(0, 2 * math.pi),
        ylim=(0, None),
    )
    return ax
