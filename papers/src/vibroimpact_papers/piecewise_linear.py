"""The piecewise linear oscillator and its impact limit: harmonic, subharmonic, chaotic motions."""

from __future__ import annotations

import math

import numpy as np
from matplotlib.axes import Axes
from scipy.integrate import solve_ivp

import vibroimpact as vi
from vibroimpact.plotting.bifurcation_diagram import plot_bifurcation_diagram
from vibroimpact_papers.judged import Claim, RuleResult, rule_result
from vibroimpact_papers.publication import Publication
from vibroimpact_papers.witness import next_impact, speeds_of_impacts

PAPER = Publication(
    name="piecewise-linear",
    title="A periodically forced piecewise linear oscillator",
    reference=(
        "S. W. Shaw, P. J. Holmes, A periodically forced piecewise linear oscillator, J. Sound Vib. 90 (1983) 129-155."
    ),
    seen="a summary by others, whose words are quoted here.",
    machine=(
        "BilinearOscillator, a second spring of stiffness 8 from x = 0 on, c = 0.1; and ImpactOscillator with the "
        "restitution 0.8 at x = 0, without dashpot. All numbers are ours."
    ),
    missing=("text, parameters and figures",),
)
R = 0.8


def bilinear(omega: float) -> vi.machines.BilinearOscillator:
    """The oscillator with two stiffnesses."""
    return vi.machines.BilinearOscillator(omega=omega)


def impacting(omega: float) -> vi.ImpactOscillator:
    """Its limit."""
    return vi.ImpactOscillator(zeta=0.0, omega=omega, restitution=R, clearance=0.0)


def settled(omega: float, turns: int) -> list[float]:
    """Witness: places once in a period after 100, by SciPy, whose steps end where the stiffness changes."""
    y, t, kept = np.zeros(2), 0.0, []
    period = 2.0 * math.pi / omega
    side = 1.0  # the force presses towards the second spring at first

    def rate(t: float, y: np.ndarray) -> list[float]:
        k = 9.0 if side > 0.0 else 1.0
        return [y[1], math.cos(omega * t) - 0.1 * y[1] - k * y[0]]

    def crosses(_t: float, y: np.ndarray) -> float:
        return float(y[0])

    crosses.terminal = True  # type: ignore[attr-defined]
    for n in range(1, 101 + turns):
        while t < n * period - 1e-12:
            crosses.direction = -side  # type: ignore[attr-defined]
            found = solve_ivp(rate, (t, n * period), y, events=crosses, rtol=1e-9, atol=1e-11)
            t, y = float(found.t[-1]), found.y[:, -1]
            if found.status == 1:
                side = -side
        if n > 100:
            kept.append(float(y[0]))
    return kept


@PAPER.statement(
    "summary",
    "the existence of harmonic, subharmonic",
    notes="Harmonic at 1.5, subharmonic at 3.",
    slow=True,
)
def harmonic_and_subharmonic(_: Claim) -> RuleResult:
    """Periods of two settled motions."""
    labels, counts = [], []
    for omega in (1.5, 3.0):
        system = bilinear(omega)
        labels.append(vi.classify(system, system.free_start()).label)
        counts.append(len(np.unique(np.round(settled(omega, 6), 4))))
    return rule_result(
        labels[0].startswith("1-") and labels[1].startswith("2-") and counts == [1, 2],
        f"\u03c9 = 1.5: {labels[0]}; \u03c9 = 3: {labels[1]}",
        f"SciPy\u2019s solve_ivp with events: {counts[0]} and {counts[1]} places once in a period",
    )


@PAPER.statement("summary", "the impact limit where one stiffness approaches infinity")
def the_impact_limit(_: Claim) -> RuleResult:
    """An oscillator that swings against a stiff spring, and one that impacts without loss."""
    off = []
    for k in (1e4, 1e6):
        soft = vi.machines.BilinearOscillator(second_stiffness=k, damping=0.0, force=0.0)
        run = vi.simulate(soft, vi.State((-1.0,), (0.0,)), t_max=20.0)
        x, _v = run.at(np.array([9.0, 20.0]))
        off.append(float(np.abs(x[:, 0] + np.abs(np.cos([9.0, 20.0]))).max()))
    return rule_result(
        off[1] < off[0] / 5.0 and off[1] < 0.03,
        f"distance from the motion with impacts without loss: {off[0]:.4f} at K = 10\u2074, {off[1]:.4f} at 10\u2076",
        "closed form of the limit: \u2212|cos t|; each half swing on the spring delays it by \u03c0/\u221aK",
    )


@PAPER.statement(
    "summary",
    "including single-impact and multiple-impact orbits",
    notes="Here \u03c9 = 2.5 and 2.7.",
)
def single_and_multiple_impacts(_: Claim) -> RuleResult:
    """Orbits of the limit before and after a period doubling."""
    symbols, counts = [], []
    for omega in (2.5, 2.7):
        run = vi.simulate(impacting(omega), vi.State((0.0,), (-0.4,), 0.2), impacts=1500)
        orbit = vi.find_orbit(impacting(omega), run)
        symbols.append(f"{orbit.symbol}{', stable' if orbit.stable else ''}")
        speeds = speeds_of_impacts(omega, 0.0, R, 0.2 / omega, 0.4, settle=276, kept=24)
        counts.append(len(np.unique(np.round(speeds, 5))))
    return rule_result(
        symbols == ["1-1-0, stable", "2-2-0, stable"] and counts == [1, 2],
        f"\u03c9 = 2.5: {symbols[0]}; \u03c9 = 2.7: {symbols[1]}",
        f"bisection: {counts[0]} and {counts[1]} impact speeds",
    )


@PAPER.statement(
    "summary", "the system can exhibit period-doubling bifurcations, leading to chaotic motions"
)
def period_doubling_to_chaos(_: Claim) -> RuleResult:
    """The period doubling of the orbit with one impact in a period, and an exponent beyond it."""
    low, high = 2.5, 2.7
    guess = vi.find_orbit(
        impacting(low), vi.simulate(impacting(low), vi.State((0.0,), (-0.4,), 0.2), impacts=1500)
    )
    while high - low > 1e-9:
        middle = (low + high) / 2.0
        orbit = vi.find_orbit(impacting(middle), guess)
        low, high = (middle, high) if orbit.stable else (low, middle)
    rate = vi.lyapunov_exponent(impacting(2.8), vi.State((0.0,), (-0.3,), 0.4), impacts=20_000)
    trace = trace_of_one_impact(low)
    return rule_result(
        abs(trace + 1.0 + R**2) < 1e-6 and rate.is_positive,
        f"period doubling at \u03c9 = {low:.9f}; at 2.8 the exponent is {rate.value:.4f} \u00b1 {rate.error:.4f}",
        f"trace of the witness map there, by differences: {trace:.8f}; \u22121 \u2212 R\u00b2 = {-1.0 - R**2:.8f}",
        omega=low,
    )


def trace_of_one_impact(omega: float) -> float:
    """Witness: trace of the map of time and speed at its fixed point, by Newton's method and differences."""

    def step(t: float, v: float) -> np.ndarray:
        time, before = next_impact(t, v, omega, 0.0)
        return np.array([time - 2.0 * math.pi / omega, R * before])

    z, h = np.array([0.2 / omega, 0.3]), 1e-6
    for _ in range(200):
        z = step(*z) if _ < 150 else z
    for _ in range(8):
        jacobian = np.array(
            [
                (step(*(z + d)) - step(*(z - d))) / (2.0 * h)
                for d in (np.array([h, 0.0]), np.array([0.0, h]))
            ]
        ).T
        z = z - np.linalg.solve(jacobian - np.eye(2), step(*z) - z)
    return float(np.trace(jacobian))


@PAPER.picture(
    "Between two springs",
    "Place once in a period of the force over the frequency: harmonic motions, and subharmonic ones of order two "
    "and three.",
)
def over_the_frequency() -> Axes:
    """The diagram of the bilinear oscillator."""
    system = bilinear(1.2)
    data = vi.bifurcation_sweep(
        system,
        over={"omega": np.linspace(1.2, 6.0, 300)},
        start=system.free_start(),
        way="up",
        at=vi.AtPhase(0.0),
        progress=False,
    )
    return plot_bifurcation_diagram(data, variable="x1")
