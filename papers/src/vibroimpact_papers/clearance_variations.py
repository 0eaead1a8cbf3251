"""The impact oscillator over frequency and clearance: chaos, coexistence, chatter, grazing."""

from __future__ import annotations

import math
from functools import cache

import numpy as np
from matplotlib.axes import Axes

import vibroimpact as vi
from vibroimpact.plotting.bifurcation_diagram import plot_bifurcation_diagram
from vibroimpact_papers.judged import Claim, RuleResult, rule_result
from vibroimpact_papers.publication import Publication
from vibroimpact_papers.witness import next_impact, speeds_of_impacts

PAPER = Publication(
    name="clearance-variations",
    title="An impact oscillator over frequency and clearance",
    reference=(
        "C. Budd, F. Dux, A. Cliffe, The effect of frequency and clearance variations on "
        "single-degree-of-freedom impact "
        "oscillators, J. Sound Vib. 184 (1995) 475-502."
    ),
    seen="the abstract, and the program of one of the authors, which begins with omega = 2.8, sigma = 0, r = 0.8.",
    machine=(
        "ImpactOscillator: x'' + x = cos(omega t), x < sigma, restitution r = 0.8. Frequencies and clearances "
        "other than "
        "2.8 and 0 are ours."
    ),
    missing=("frequencies, clearances and figures of the paper",),
)
R = 0.8


def oscillator(omega: float, sigma: float) -> vi.ImpactOscillator:
    """The oscillator without dashpot."""
    return vi.ImpactOscillator(zeta=0.0, omega=omega, restitution=R, clearance=sigma)


def struck(sigma: float, speed: float, phase: float) -> vi.State:
    """A state just after an impact."""
    return vi.State((sigma,), (-speed,), phase)


def own_speeds(omega: float, sigma: float, start: vi.State, settle: int, kept: int) -> list[float]:
    """Witness: speeds before impacts, by bisection."""
    return speeds_of_impacts(omega, sigma, R, start.phase / omega, -start.velocity[0], settle, kept)


@PAPER.statement("abstract", "these include chaotic regimes", notes="Here omega = 2.8, sigma = 0.")
def chaotic_regimes(_: Claim) -> RuleResult:
    """The exponent, and the rate at which two witnesses part."""
    start = struck(0.0, 0.3, 0.4)
    found = vi.lyapunov_exponent(oscillator(2.8, 0.0), start, impacts=20_000)
    near = struck(0.0, 0.3 + 1e-10, 0.4)
    pair = [own_speeds(2.8, 0.0, one, 0, 40) for one in (start, near)]
    apart = np.abs(np.subtract(pair[0], pair[1]))
    return rule_result(
        found.is_positive and apart[-1] > 1e4 * apart[0],
        f"exponent {found.value:.4f} ± {found.error:.4f} per time",
        f"bisection: impact speeds that differ by {apart[0]:.0e} differ by {apart[-1]:.0e} 40 impacts later",
        exponent=found.value,
    )


@PAPER.statement(
    "abstract", "and multiply coexisting stable states", notes="Here omega = 5.5, sigma = 0."
)
def coexisting_states(_: Claim) -> RuleResult:
    """Two attractors of one machine, and the speeds of the witness from the same starts."""
    system, rng = oscillator(5.5, 0.0), np.random.default_rng(1)
    found: dict[str, vi.State] = {}
    for _i in range(14):
        start = struck(0.0, float(rng.uniform(0.02, 1.0)), float(rng.uniform(0.0, 6.28)))
        found.setdefault(vi.classify(system, start).label, start)
        if len(found) == 2:
            break
    counts = [
        len(np.unique(np.round(own_speeds(5.5, 0.0, start, 500, 48), 6)))
        for start in found.values()
    ]
    return rule_result(
        len(found) == 2 and len(set(counts)) == 2,
        "; ".join(found),
        f"bisection: {' and '.join(map(str, counts))} different impact speeds from the same starts",
    )


@PAPER.statement(
    "abstract",
    "chatter, when infinitely many impacts occur in a finite time",
    notes="Here omega = 2.5, sigma = -0.5.",
)
def chatter(_: Claim) -> RuleResult:
    """Rest after a slow impact, and the sum of the flights of the witness."""
    omega, sigma = 2.5, -0.5
    run = vi.simulate(oscillator(omega, sigma), struck(sigma, 0.02, 0.0), t_max=1.0, impacts=10_000)
    stuck = run.time[run.status == vi.Status.STICK]
    if not len(stuck):
        return rule_result(False, "no rest", "simulation")
    t, v = 0.0, 0.02
    for _i in range(60):
        later, before = next_impact(t, v, omega, sigma, least=1e-9 + v / 10.0)
        t, v = later, R * before
        if v < 1e-6:
            break
    # what is left: flights 2 v / a, each R of the last, at the acceleration a there
    t += 2.0 * v / (math.cos(omega * t) - sigma) / (1.0 - R)
    return rule_result(
        abs(float(stuck[0]) - t) < 1e-6,
        f"after an impact with speed 0.02 at rest at t = {stuck[0]:.9f}",
        f"bisection until a speed is below 1e-6, and a geometric series: {t:.9f}",
        rest=float(stuck[0]),
    )


@cache
def touching() -> tuple[float, vi.Orbit]:
    """Clearance at which the motion with one impact in three periods touches the stop, by bisection, and the motion."""
    system = oscillator(6.0, 0.0)
    orbit = vi.find_orbit(system, vi.simulate(system, struck(0.0, 0.5, 0.3), impacts=600))
    low, high = -0.0285, 0.0
    while high - low > 1e-10:
        middle = (low + high) / 2.0
        moved = vi.find_orbit(oscillator(6.0, middle), orbit)
        if moved.admissible:
            high, orbit = middle, moved
        else:
            low = middle
    return high, orbit


@PAPER.statement(
    "abstract", "a stable periodic orbit encounters a discontinuity and disappears catastrophically",
    notes="Here omega = 6, the motion with one impact in three periods.",
)  # fmt: skip
def grazing(_: Claim) -> RuleResult:
    """The motion on both sides of the clearance at which it touches the stop."""
    at, touch = touching()
    before = vi.find_orbit(oscillator(6.0, at + 1e-4), touch)
    beyond = oscillator(6.0, at - 1e-4)
    moved = vi.State((at - 1e-4,), before.state.velocity, before.state.phase)
    after = vi.classify(beyond, moved)
    speeds = [
        own_speeds(6.0, sigma, vi.State((sigma,), moved.velocity, moved.phase), 600, 60)
        for sigma in (at + 1e-4, at - 1e-4)
    ]
    near, far = (float(np.ptp(one)) for one in speeds)
    return rule_result(
        before.stable and before.admissible and after.symbol != before.symbol
        and near < 1e-6 and far > 0.01,
        f"touches at sigma = {at:.9f}; 1e-4 before it {before.symbol}, stable; 1e-4 beyond: {after.label}",
        f"bisection: impact speeds vary by {near:.0e} before it, by {far:.3f} beyond",
        sigma=at,
    )  # fmt: skip


@PAPER.picture(
    "Clearance",
    "Speed after the impacts over the clearance at omega = 2.8, followed up (orange) and down (blue).",
)
def over_clearance() -> Axes:
    """The diagram of the authors' program over the clearance."""
    data = vi.bifurcation_sweep(
        oscillator(2.8, -0.3),
        over={"clearance": np.linspace(-0.3, 0.4, 400)},
        start=struck(-0.3, 0.5, 0.3),
        progress=False,
    )
    return plot_bifurcation_diagram(data)
