"""Energy sinks in a chain whose sectors move alike: least amplitude, clearance, frequency of the backbone."""

from __future__ import annotations

import math
from functools import cache

import numpy as np
from matplotlib import pyplot as plt
from matplotlib.axes import Axes
from scipy.optimize import brentq, minimize_scalar

import vibroimpact as vi
from vibroimpact.plotting import style
from vibroimpact_papers.judged import Claim, RuleResult, rule_result
from vibroimpact_papers.publication import Publication

PAPER = Publication(
    name="energy-sink",
    title="Vibro-impact energy sinks, all sectors alike",
    reference=(
        "T. Weidemann, L. A. Bergman, A. F. Vakakis, M. Krack, Energy transfer and localization in a forced cyclic "
        "chain of oscillators with vibro-impact nonlinear energy sinks, Nonlinear Dynamics (2025), "
        "doi 10.1007/s11071-025-10928-4."
    ),
    seen="the formulas and the parameters in the program that the authors publish with the paper, in our words.",
    machine=(
        "ImpactDamper driven alike in all sectors: main mass 1 - eps, ball eps, damping ratio D = 0.001, "
        "restitution 0.8, "
        "as in its figures; eps = 0.02 there. Its formulas are for a light ball: they are judged as the limit eps -> 0."
    ),
    missing=("text and figures",),
)
RESTITUTION, DAMPING = 0.8, 1e-3
LIGHT = 2e-3  # the limit of the least amplitude is extrapolated from this mass and its half
LIGHTER = (1e-3, 5e-4)  # the errors of the backbone at these masses are of second order in them


def rho(restitution: float = RESTITUTION) -> float:
    """Rho = (2 / pi)(1 - e) / (1 + e)."""
    return 2.0 / math.pi * (1.0 - restitution) / (1.0 + restitution)


def printed(xi: float, eps: float) -> tuple[float, float]:
    """Frequency and clearance of the backbone at the amplitude xi of clearances, as in the program.

    The clearance is in units of the amplitude at the linear resonance, 1 / (2 D).
    """
    r = rho()
    theta = (1.0 + math.sqrt((1.0 + r * r) * xi * xi - r * r)) / (1.0 + r * r)
    lag = math.acos((theta - 1.0) / xi)
    w = math.sqrt(xi / ((1.0 - eps) * xi + 8.0 * eps * theta * math.cos(lag) / math.pi**2))
    dynamic = complex(-(1.0 - eps) * w * w + 1.0, 2.0 * DAMPING * w) * xi
    kick = 8.0 * eps * theta * w * w / math.pi**2 * complex(math.cos(lag), -math.sin(lag))
    return w, 2.0 * DAMPING / abs(dynamic - kick)


def damper(eps: float, omega: float, clearance: float) -> vi.ImpactDamper:
    """The main mass 1 - eps on a spring of stiffness 1, with a ball of mass eps."""
    main = 1.0 - eps
    omega_n = 1.0 / math.sqrt(main)
    return vi.ImpactDamper(
        mass_ratio=eps / main, omega_n=omega_n, zeta=DAMPING / math.sqrt(main), omega=omega,
        restitution=RESTITUTION, half_clearance=clearance, force=1.0 / main,
    )  # fmt: skip


def amplitudes(machine: vi.ImpactDamper) -> list[float]:
    """First harmonics of x1 of the symmetric orbits, one impact at each stop in a period, smaller first."""
    measure = vi.measure_of(machine, "harmonic 1 x1")
    return sorted(measure.of_orbit(one) for one in vi.symmetric_orbits(machine))


@cache
def least(eps: float) -> float:
    """Least amplitude, in half clearances, of exact symmetric orbits at the natural frequency 1.

    Over the clearance the smaller orbit's amplitude passes a minimum in units of the clearance.
    """
    omega = 1.0 / math.sqrt(1.0 - eps)
    near = 0.5 / (DAMPING + 4.0 * eps / (math.pi**2 * rho())) / rho()

    def height(b: float) -> float:
        found = amplitudes(damper(eps, omega, b))
        return found[0] / b if found else 1.0  # beyond the fold: as much as a clearance

    bounds, to = (0.9 * near, 1.3 * near), {"xatol": 1e-7 * near}
    return float(minimize_scalar(height, bounds=bounds, method="bounded", options=to).fun)


def limit(of_light: float, of_half: float) -> float:
    """Richardson's extrapolation to a ball without mass."""
    return 2.0 * of_half - of_light


@PAPER.statement(
    "backbone", "xi = rho / sqrt(1 + rho^2)", notes="The least amplitude, in clearances; e = 0.8."
)
def least_amplitude(_: Claim) -> RuleResult:
    """The fold of the symmetric orbits of a light ball."""
    exact = rho() / math.hypot(1.0, rho())
    wall = impact_pair_threshold()
    found = limit(least(LIGHT), least(LIGHT / 2.0))
    return rule_result(
        abs(found - exact) < 1e-3 * exact and abs(wall - exact) < 1e-9,
        f"{found:.6f} in the limit of a light ball; {least(0.02):.6f} for the mass 0.02 of its figures",
        f"ball between walls that move as given, in closed form: {wall:.9f}; printed {exact:.9f}",
        least=found,
    )


def impact_pair_threshold() -> float:
    """Witness: least amplitude of walls at -+1 + A sin t that keep a ball bouncing twice a period, by SciPy.

    The ball crosses in half a period with the speed (2 + 2 A sin t) / pi, and leaves the wall with
    (1 + e) A cos t + e times that.
    """

    def needed(phase: float) -> float:
        def miss(a: float) -> float:
            speed = 2.0 * (1.0 + a * math.sin(phase)) / math.pi
            return (1.0 + RESTITUTION) * a * math.cos(phase) - (1.0 - RESTITUTION) * speed

        return float(brentq(miss, 0.0, 10.0))

    found = minimize_scalar(needed, bounds=(-0.5, 0.5), method="bounded", options={"xatol": 1e-12})
    return float(found.fun)


@PAPER.statement(
    "backbone",
    "varpi = sqrt(xi / ((1 - epsa) xi + 8 epsa theta cos(Delta) / pi^2))",
    notes="With its clearance; amplitudes xi = 0.2, 0.5, 1 of clearances.",
)
def the_backbone(_: Claim) -> RuleResult:
    """Amplitudes of the exact orbits at the printed frequencies and clearances."""
    off, own = [], []
    for xi in (0.2, 0.5, 1.0):
        off.append([abs(on_backbone(xi, eps) / xi - 1.0) for eps in LIGHTER])
        own.append(on_backbone(xi, 0.02) / xi)
    balance = max(power_lost(xi) for xi in (0.2, 0.5, 1.0))
    return rule_result(
        all(half < 1e-3 and half < light / 3.0 for light, half in off) and balance < 1e-9,
        f"exact orbits have these amplitudes within {max(x for x, _ in off):.1e} for a ball of mass {LIGHTER[0]:g}, "
        f"{max(x for _, x in off):.1e} for half of it; for the mass 0.02 they are "
        f"{', '.join('none' if math.isnan(x) else f'{x:.3f}' for x in own)} of them",
        f"power lost at two impacts in a period = power of the force of the ball, within {balance:.0e}",
    )


def on_backbone(xi: float, eps: float) -> float:
    """Amplitude, in clearances, of the larger orbit at the printed frequency and clearance; NaN if there is none."""
    omega, clearance = printed(xi, eps)
    clearance /= 2.0 * DAMPING
    found = amplitudes(damper(eps, omega, clearance))
    return found[-1] / clearance if found else math.nan


def power_lost(xi: float) -> float:
    """Witness: energy of two impacts of a ball against the work of its triangle on walls that move as xi sin t."""
    r = rho()
    theta = (1.0 + math.sqrt((1.0 + r * r) * xi * xi - r * r)) / (1.0 + r * r)
    sine = r * theta / xi  # of the lag, from the imaginary part of the printed phase
    rate = 2.0 * theta / math.pi  # speed of the ball between walls of distance 2 theta
    wall = xi * sine  # speed of the wall at the impact
    lost = (1.0 - RESTITUTION**2) * (
        rate + wall
    ) ** 2  # two impacts: (1 - e^2)(relative speed)^2 / 2 each
    work = 4.0 * rate * wall  # momentum 2 rate at each of two impacts, at the speed of the wall
    return abs(lost / work - 1.0)


@PAPER.picture(
    "The backbone",
    "Clearance, in amplitudes of the linear resonance, over amplitude in clearances: as printed (line), and "
    "exact orbits "
    "of a ball of 2 % of the mass, as in its figures (dots; those away from the line are the other orbit).",
)
def backbone() -> Axes:
    """Printed clearances, and those of exact orbits."""
    _, ax = plt.subplots(figsize=(5.2, 3.6), layout="constrained")
    for xi in np.geomspace(0.08, 3.0, 40):
        omega, clearance = printed(float(xi), 0.02)
        found = amplitudes(damper(0.02, omega, clearance / (2.0 * DAMPING)))
        ax.plot(
            [a * 2.0 * DAMPING / clearance for a in found],
            [clearance] * len(found),
            ".",
            color=style.ORANGE,
        )
    fine = np.geomspace(0.0706, 3.0, 400)
    ax.plot(fine, [printed(float(x), 0.02)[1] for x in fine], color=style.BLUE)
    ax.set(
        xlabel=r"amplitude $\xi$, in clearances",
        ylabel="clearance, in resonance amplitudes",
        xlim=(0.0, 3.0),
    )
    return ax
