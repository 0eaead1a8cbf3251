"""Den Hartog's oscillator with dry friction: motions with and without stops."""

from __future__ import annotations

import math
from functools import cache

import numpy as np
from matplotlib import pyplot as plt
from matplotlib.axes import Axes
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

import vibroimpact as vi
from vibroimpact.plotting import style
from vibroimpact_papers.judged import Claim, RuleResult, rule_result
from vibroimpact_papers.publication import Publication

PAPER = Publication(
    name="dry-friction",
    title="Forced vibration with dry friction",
    reference=(
        "J. P. Den Hartog, Forced vibrations with combined viscous and Coulomb damping, Philosophical Magazine, "
        "series 7, vol. 9, no. 59, supplement (May 1930) 801."
    ),
    seen="the first page: the equation, its conditions of periodicity, and what the paper claims.",
    machine=(
        "FrictionOscillator without dashpot, m = k = 1, force P cos(omega t) with P = 1. The ratios F/P and omega are "
        "ours."
    ),
    missing=("his amplitudes and the limit of his solution: figures were not seen",),
)
OMEGA = 0.6


def oscillator(friction: float, omega: float = OMEGA) -> vi.machines.FrictionOscillator:
    """The oscillator under a force of amplitude 1."""
    return vi.machines.FrictionOscillator(friction=friction, omega=omega)


def steady(friction: float, omega: float = OMEGA) -> vi.Run:
    """Four periods after 200 of transient."""
    system = oscillator(friction, omega)
    turn = 2.0 * math.pi / omega
    settled = vi.simulate(system, system.free_start(), t_max=200.0 * turn, impacts=10**5).last
    return vi.simulate(system, settled, t_max=4.0 * turn, impacts=10**5)


def amplitude(friction: float, omega: float) -> float:
    """Witness: amplitude without stops, from the half period in closed form.

    Over half a period x'' + x - F = P cos(omega t + phi) from x(0) = X, x'(0) = 0 to x = -X, x' = 0.
    """
    v = 1.0 / (1.0 - omega**2)
    u = math.sin(math.pi / omega) / (omega * (1.0 + math.cos(math.pi / omega)))
    return math.sqrt(v * v - (friction * u) ** 2)


@cache
def limit(omega: float) -> float:
    """Witness: F/P at which the motion first stops in its passage, by the closed form of the half period.

    x - F = (X - F - v cos phi) cos t + (omega v sin phi) sin t + v cos(omega t + phi) slides to -X
    while x' < 0 all the way.
    """
    v, t = 1.0 / (1.0 - omega**2), np.linspace(0.0, math.pi / omega, 4001)[1:-1]

    def fastest(friction: float) -> float:
        x = amplitude(friction, omega)
        u = math.sin(math.pi / omega) / (omega * (1.0 + math.cos(math.pi / omega)))
        cosine, sine = x / v, -friction * u / v
        place, speed = x - friction - v * cosine, omega * v * sine
        rate = (
            -place * np.sin(t)
            + speed * np.cos(t)
            - v * omega * (np.sin(omega * t) * cosine + np.cos(omega * t) * sine)
        )
        return float(rate.max())

    return float(brentq(fastest, 1e-3, 0.99 * min(1.0, abs(v / (amplitude_u(omega) or 1.0)))))


def amplitude_u(omega: float) -> float:
    """U of the closed form."""
    return math.sin(math.pi / omega) / (omega * (1.0 + math.cos(math.pi / omega)))


def stops(run: vi.Run) -> int:
    """Intervals in which the mass stands still."""
    return int((run.states[:, 0] == vi.FrictionState.STICK).sum())


@PAPER.statement(
    "I", "the ensuing motion will be continuous", notes="For small friction; here F/P = 0.2."
)
def continuous_for_small_friction(_: Claim) -> RuleResult:
    """No stop in four periods, and the amplitude of the closed form."""
    run = steady(0.2)
    x, _v = run.at(np.linspace(0.0, 8.0 * math.pi / OMEGA, 8001))
    height, exact = float(np.abs(x).max()), amplitude(0.2, OMEGA)
    return rule_result(
        stops(run) == 0 and abs(height - exact) < 1e-5,
        f"no stop in four periods, amplitude {height:.6f}",
        f"half period in closed form: {exact:.6f}",
        amplitude=height,
    )


@PAPER.statement(
    "I", "may consist of regions of motion and regions of standstill",
    notes="For large friction; here F/P = 0.8.",
)  # fmt: skip
def stops_for_large_friction(_: Claim) -> RuleResult:
    """Stops in four periods; SciPy integrates the sliding between two of them."""
    friction = 0.8
    run = steady(friction)
    stuck = np.flatnonzero(run.states[:, 0] == vi.FrictionState.STICK)
    free = [
        k for k in range(stuck[0] + 1, len(run.time)) if run.states[k, 0] != vi.FrictionState.STICK
    ]
    begin = free[0]
    theta = OMEGA * float(run.time[begin]) + run.start.phase
    side = 1.0 if run.states[begin, 0] == vi.FrictionState.FORWARD else -1.0

    def rate(t: float, y: list[float]) -> list[float]:
        return [y[1], math.cos(theta + OMEGA * t) - y[0] - side * friction]

    def halts(t: float, y: list[float]) -> float:
        return float(y[1]) if t > 1e-3 else side

    halts.terminal = True  # type: ignore[attr-defined]
    found = solve_ivp(
        rate,
        (0.0, 10.0),
        [float(run.position[begin, 0]), 0.0],
        events=halts,
        rtol=1e-11,
        atol=1e-12,
    )
    computed = float(run.time[begin + 1] - run.time[begin])
    exact = float(found.t_events[0][0])
    return rule_result(
        abs(computed - exact) < 1e-6,
        f"{stops(run)} stops in four periods; slides {computed:.7f} between two of them",
        f"SciPy\u2019s solve_ivp slides {exact:.7f}",
        slides=computed,
    )


@PAPER.statement(
    "II",
    "t = 0, x = x0, x' = 0; t = π/ω, x = \u2212x0",
    notes="The conditions of periodicity; F/P = 0.2.",
)
def the_second_half_mirrors_the_first(_: Claim) -> RuleResult:
    """The settled motion half a period later."""
    run = steady(0.2)
    t = np.linspace(0.0, 2.0 * math.pi / OMEGA, 101)
    x, v = run.at(t)
    y, u = run.at(t + math.pi / OMEGA)
    off = max(float(np.abs(x + y).max()), float(np.abs(v + u).max()))
    return rule_result(
        off < 1e-9,
        f"x(t + π/ω) = \u2212x(t) within {off:.0e}",
        "the equation is odd under x \u2192 \u2212x, t \u2192 t + π/ω",
        off=off,
    )


@PAPER.statement("I", "a steady periodic non-harmonic motion will be set up", notes="F/P = 0.2.")
def periodic_and_not_harmonic(_: Claim) -> RuleResult:
    """Period, and the share of the third harmonic."""
    turn = 2.0 * math.pi / OMEGA
    run = steady(0.2)
    t = np.arange(2048) * turn / 2048
    x, _v = run.at(t)
    later, _v = run.at(t + turn)
    lines = np.abs(np.fft.rfft(x[:, 0])) / 1024.0
    # witness: friction is a square wave of height F, -4F/(3 pi) of its third line, on a spring-mass at 3 omega
    third = 4.0 * 0.2 / (3.0 * math.pi) / abs(1.0 - 9.0 * OMEGA**2)
    off = float(np.abs(later - x).max())
    return rule_result(
        off < 1e-9 and abs(lines[3] - third) < 1e-5,
        f"repeats itself within {off:.0e}; third harmonic {lines[3]:.6f}, first {lines[1]:.6f}",
        f"friction is a square wave: its third line moves the mass by {third:.6f}",
        third=float(lines[3]),
    )


@PAPER.statement(
    "I", "valid for such values of the friction and the frequency as are ordinarily met"
)
def ordinarily_met(_: Claim) -> RuleResult:
    """Where the motion first stops; what is ordinary is not said."""
    found, exact = [], []
    for omega in (0.6, 0.8):
        edge = limit(omega)
        found.append((stops(steady(edge - 1e-3, omega)), stops(steady(edge + 1e-3, omega))))
        exact.append(edge)
    text = ", ".join(f"F/P = {e:.4f} at ω = {w}" for e, w in zip(exact, (0.6, 0.8), strict=True))
    agreed = all(below == 0 and above > 0 for below, above in found)
    return rule_result(
        None,
        f"without stops up to {text}" + ("" if agreed else ", which simulation does not confirm"),
        "the closed form of the half period, where its speed first vanishes; no number is printed for "
        "\u201cordinarily\u201d",
        limit=exact,
    )


@PAPER.picture(
    "Amplitudes",
    "Amplitude over frequency for F/P = 0, 0.2, 0.4, 0.6, 0.8: simulated (dots; hollow where the mass stops on "
    "its way) "
    "and in closed form without stops (lines).",
)
def amplitudes() -> Axes:
    """His figure, simulated."""
    _, ax = plt.subplots(figsize=(5.6, 3.8), layout="constrained")
    omegas = np.concatenate([np.linspace(0.3, 0.94, 17), np.linspace(1.08, 1.9, 14)])
    colours = (style.BLACK, style.BLUE, style.GREEN, style.ORANGE, style.VERMILION)
    for friction, colour in zip((0.0, 0.2, 0.4, 0.6, 0.8), colours, strict=True):
        fine = np.linspace(0.3, 1.9, 800)
        line = [
            amplitude(friction, w)
            if 1.0 / (1.0 - w * w) ** 2 > (friction * amplitude_u(w)) ** 2
            else math.nan
            for w in fine
        ]
        ax.plot(fine, line, color=colour, linewidth=0.8, label=f"F/P = {friction:g}")
        if not friction:
            continue
        for omega in omegas:
            run = steady(friction, float(omega))
            x, _v = run.at(np.linspace(0.0, 8.0 * math.pi / omega, 1201))
            face = "white" if stops(run) else colour
            ax.plot(omega, np.abs(x).max(), "o", color=colour, markerfacecolor=face, markersize=3.5)
    ax.set(xlabel=r"frequency $\omega$", ylabel="amplitude", ylim=(0.0, 4.0), xlim=(0.3, 1.9))
    ax.legend(fontsize=8)
    return ax
