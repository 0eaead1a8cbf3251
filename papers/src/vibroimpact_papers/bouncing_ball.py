"""A ball on a vibrating table, as a textbook tells it: rest, chatter, period doubling, bounds."""

from __future__ import annotations

import math
from functools import cache
from itertools import pairwise

import numpy as np
from matplotlib.axes import Axes
from scipy.optimize import brentq

import vibroimpact as vi
from vibroimpact.plotting.bifurcation_diagram import plot_bifurcation_diagram
from vibroimpact_papers.judged import Claim, RuleResult, rule_result
from vibroimpact_papers.publication import Publication

PAPER = Publication(
    name="bouncing-ball",
    title="A ball on a vibrating table",
    reference=(
        "N. B. Tufillaro, T. Abbott, J. Reilly, An Experimental Approach to Nonlinear Dynamics and Chaos (1992), "
        "chapter 1, Bouncing ball."
    ),
    seen="the text of the sections on the model and its motions; their formulas are pictures and were not read.",
    machine=(
        "BouncingBall, exact: the flight ends where the table is. Γ = a ω² / g; \u03b1, the restitution, is "
        "0.5 where nothing else is said, which is our choice."
    ),
    missing=(
        "the values of Table 1.1",
        "formulas: bounds, phases and times below are derived again",
    ),
)
ALPHA = 0.5
NEAR_ONE = 1e-6  # relative distances of Γ from 1 at which the ball is looked at
ROUNDING = 1e-9


def ball(gamma: float, alpha: float = ALPHA) -> vi.machines.BouncingBall:
    """A ball with g = ω = 1."""
    return vi.machines.BouncingBall(amplitude=gamma, restitution=alpha)


def bounce(gamma: float, alpha: float, phase: float, speed: float) -> tuple[float, float]:
    """Witness: phase and speed after the next impact, by bisection on the height above the table.

    A grid of 4000 points finds the interval.
    """

    def gap(t: float) -> float:
        return gamma * math.sin(phase) + speed * t - t * t / 2.0 - gamma * math.sin(phase + t)

    t = np.linspace(1e-7, 2.0 * (abs(speed) + 2.0 * gamma) + 4.0, 4000)
    below = np.flatnonzero(np.array([gap(x) for x in t]) < 0.0)
    end = brentq(gap, t[below[0] - 1], t[below[0]], xtol=1e-13)
    table = gamma * math.cos(phase + end)
    return phase + end, (1.0 + alpha) * table - alpha * (speed - end)


def periodic_start(gamma: float, faster: float = 0.0) -> vi.State:
    """Impact of the motion with one bounce in a turn, in closed form, or a little faster."""
    phase = math.acos(math.pi / gamma * (1.0 - ALPHA) / (1.0 + ALPHA))
    return vi.State((gamma * math.sin(phase),), (math.pi + faster,), phase)


@cache
def settled() -> vi.Orbit:
    """The orbit at 1.3 to which a ball settles that starts nearby."""
    system = ball(1.3)
    run = vi.simulate(system, periodic_start(1.3, faster=0.1), impacts=300)
    return vi.find_orbit(system, run)


@cache
def doublings() -> tuple[float, ...]:
    """Γ at the first three period doublings, by continuation."""
    branch = vi.continue_orbit(settled(), "amplitude", (1.3, 1.6))
    found = []
    for width in (0.2, 0.04, 0.0):
        at = branch["PD1"].parameter
        found.append(at)
        if width:
            switched = vi.switch_branch(branch["PD1"], (at - width / 8.0, at + width))
            assert isinstance(switched, vi.Branch), switched
            branch = switched
    return tuple(found)


@PAPER.statement("Equilibrium solutions", "the ball will come to a halt in a finite time")
def a_halt_in_a_finite_time(_: Claim) -> RuleResult:
    """A table that stands still: the sum of the flights is a geometric series."""
    table = vi.RigidStop((1.0,), 0.0, restitution=ALPHA)
    still = vi.Mechanism(
        mass=[[1.0]], damping=[[0.0]], stiffness=[[0.0]], constant_force=(-1.0,), elements=(table,)
    )
    run = vi.simulate(still, vi.State((0.0,), (1.0,)), t_max=10.0, impacts=1000)
    halt = float(run.time[run.status == vi.Status.STICK][0])
    series = 2.0 / (1.0 - ALPHA)
    return rule_result(
        abs(halt - series) < ROUNDING,
        f"at rest from t = {halt:.12g} on, thrown up with speed 1",
        f"geometric series of the flights, 2 / (1 \u2212 \u03b1) = {series:g}",
        halt=halt,
    )


@PAPER.statement(
    "Sticking solutions", "until the table\u2019s maximum acceleration is greater than"
)
def stuck_until_the_table_falls_faster(_: Claim) -> RuleResult:
    """Rest on the table at Γ just below and just above 1, and the phase of release."""
    found = {}
    for gamma in (1.0 - NEAR_ONE, 1.0 + NEAR_ONE, 1.5):
        run = vi.simulate(ball(gamma), vi.State((0.0,), (gamma,)), t_max=7.0, impacts=10_000)
        found[gamma] = run.time[run.status == vi.Status.RELEASE]
    below, above, later = found.values()
    phase = math.asin(1.0 / 1.5)
    return rule_result(
        len(below) == 0 and len(above) > 0 and abs(later[0] - phase) < ROUNDING,
        f"leaves the table at Γ = 1 + {NEAR_ONE:g}, not at 1 \u2212 {NEAR_ONE:g}; at Γ = 1.5 at the phase "
        f"{later[0]:.9f}",
        f"the table\u2019s acceleration is \u2212g where sin θ = 1/Γ: {phase:.9f}",
        release=later[0],
    )


@PAPER.statement(
    "Sticking solutions", "maximum acceleration is much greater than g, the ball can become stuck",
    notes="Here Γ = 8 and \u03b1 = 0.1.",
)  # fmt: skip
def stuck_at_large_acceleration(_: Claim) -> RuleResult:
    """A ball of small restitution chatters to rest; the witness bounces it until the flights vanish."""
    gamma, alpha = 8.0, 0.1
    system = ball(gamma, alpha)
    run = vi.simulate(system, system.free_start(), t_max=200.0, impacts=10_000)
    stuck = run.time[run.status == vi.Status.STICK]
    if not len(stuck):
        return rule_result(False, "never at rest in 200 radians", "simulation")
    leaves = run.time[run.status == vi.Status.RELEASE][0]
    after = np.flatnonzero(run.time > leaves)[0]
    phase, speed, total = math.asin(1.0 / gamma), gamma * math.cos(math.asin(1.0 / gamma)), 0.0
    start = phase
    for _i in range(200):
        last = phase
        phase, speed = bounce(gamma, alpha, phase, speed)
        if phase - last < 1e-6:
            break
    total = phase - start
    again = run.time[run.status == vi.Status.STICK]
    again = again[again > leaves]
    computed = float(again[0] - leaves) if len(again) else math.nan
    return rule_result(
        len(again) > 0 and abs(computed - total) < 1e-5,
        f"at rest again {computed:.6f} radians after it has left the table (event {after})",
        f"bounces by bisection until a flight is shorter than 1e-6: {total:.6f}",
        flight=computed,
    )


@PAPER.statement(
    "Sticking solutions", "it will exactly repeat this pattern of getting stuck, and then released"
)
def the_pattern_repeats(_: Claim) -> RuleResult:
    """Phases of all releases and of all rests after the first."""
    system = ball(8.0, 0.1)
    run = vi.simulate(system, system.free_start(), t_max=400.0, impacts=100_000)
    turn = 2.0 * math.pi
    spread = []
    for status in (vi.Status.STICK, vi.Status.RELEASE):
        phases = run.time[run.status == status][1:]
        spread.append(float(np.abs(np.exp(1j * (phases - phases[0])) - 1.0).max()))
    return rule_result(
        max(spread) < 1e-8,
        f"phases of all rests and releases in {400.0 / turn:.0f} turns agree within {max(spread):.0e}",
        "the place from which it is released, sin θ = 1/Γ, does not know the past",
        spread=max(spread),
    )


@PAPER.statement(
    "Period one orbits", "a periodic orbit with a period exactly equal to that of the table",
    notes="Here Γ = 1.3.",
)  # fmt: skip
def period_one(_: Claim) -> RuleResult:
    """The motion to which a run settles, against the closed form."""
    orbit = settled()
    cosine = math.pi / 1.3 * (1.0 - ALPHA) / (1.0 + ALPHA)
    phase = float(orbit.states[0, -1])
    return rule_result(
        orbit.symbol == "1-0-1"
        and orbit.stable
        and abs(orbit.period - 2.0 * math.pi) < ROUNDING
        and abs(math.cos(phase) - cosine) < ROUNDING,
        f"{orbit.symbol}, stable, period {orbit.period:.12f}, impact where cos θ = {math.cos(phase):.9f}",
        f"2π, and cos θ = (π/Γ)(1 \u2212 \u03b1)/(1 + \u03b1) = {cosine:.9f}",
        period=orbit.period,
    )


@PAPER.statement(
    "Period one orbits",
    "the period one orbit bifurcates (literally, splits in two) to the period two",
)
def period_two(_: Claim) -> RuleResult:
    """Multipliers at the period doubling in closed form, and the motion of a ball beyond it."""
    exact = math.hypot(
        math.pi * (1.0 - ALPHA) / (1.0 + ALPHA),
        2.0 * (1.0 + ALPHA**2) / (1.0 + ALPHA) ** 2,
    )
    at, beyond = ball(exact), ball(exact + 0.05)
    orbit = vi.find_orbit(at, periodic_start(exact), stops="B", cycles=1)
    critical = float(min(orbit.multipliers.real))
    run = vi.simulate(beyond, periodic_start(exact + 0.05, faster=0.1), impacts=500)
    settled = vi.find_orbit(beyond, run)
    return rule_result(
        abs(critical + 1.0) < 1e-7 and settled.symbol == "2-0-2" and settled.stable,
        f"at Γ = {exact:.12f} a multiplier is {critical:.9f}; 0.05 beyond, balls settle on {settled.symbol}",
        "the trace of the exact map is \u22121 \u2212 \u03b1\u2074 there, which gives this Γ in closed form",
        gamma=exact,
    )


@PAPER.statement("Period one orbits", "and then a period eight orbit, and so on", slow=True)
def a_cascade(_: Claim) -> RuleResult:
    """Periods between the doublings, counted by the witness."""
    at = doublings()
    periods = []
    for gamma in ((a + b) / 2.0 for a, b in pairwise(at)):
        start = periodic_start(gamma, faster=0.01)
        speeds = [start.velocity[0]]
        phase = start.phase
        for _i in range(300):
            phase, speed = bounce(gamma, ALPHA, phase, speeds[-1])
            speeds.append(speed)
        same = np.abs(np.array(speeds[-17:-1]) - speeds[-1]) < 1e-6
        periods.append(int(np.argmax(same[::-1])) + 1)
    ratio = (at[1] - at[0]) / (at[2] - at[1])
    return rule_result(
        periods == [2, 4] and ratio > 1.0,
        f"doublings at Γ = {', '.join(f'{x:.6f}' for x in at)}: ranges shrink by {ratio:.2f}",
        f"bounces by bisection between them have the periods {periods[0]} and {periods[1]}",
        doublings=at,
    )


@PAPER.statement(
    "Trapping region",
    "all orbits of the dissipative bouncing ball system will eventually enter the region",
)
def a_trapping_region(_: Claim) -> RuleResult:
    """Speeds after impacts of a ball thrown high, at Γ = 3."""
    gamma = 3.0
    bound = (1.0 + 3.0 * ALPHA) / (1.0 - ALPHA) * gamma
    run = vi.simulate(ball(gamma), vi.State((1e4,), (0.0,)), impacts=3000)
    speed = run.velocity_after[run.impacts, 0]
    inside = (speed <= bound) & (speed >= -gamma)
    enters = int(np.argmax(inside))
    return rule_result(
        bool(inside[enters:].all()),
        f"thrown from 10⁴, inside from impact {enters} on; the largest speed after it is {speed[enters:].max():.3f}",
        f"mean speed of the ball in a flight = that of the table, so \u2212Aω ≤ v ≤ Aω(1 + 3\u03b1)/(1 \u2212 "
        f"\u03b1) = {bound:g}",
        enters=enters,
    )


@PAPER.statement(
    "Trapping region",
    "possible for the ball to reach infinite heights and velocities when no energy is lost",
)
def no_bound_without_loss(_: Claim) -> RuleResult:
    """An elastic ball that gains 2 Γ at every impact, on the table\u2019s steepest phase."""
    gamma = math.pi / 2.0  # a flight is longer by 2 (2 gamma) = 2 pi each time
    run = vi.simulate(ball(gamma, 1.0), vi.State((0.0,), (math.pi,), 0.0), impacts=20)
    expected = math.pi + 2.0 * gamma * np.arange(1, 21)
    error = float(np.abs(run.velocity_after[:, 0] - expected).max())
    return rule_result(
        error < 1e-6,
        f"\u03b1 = 1, Γ = π/2: the speed grows by π at each of 20 impacts, to {run.velocity_after[-1, 0]:.6f}",
        f"closed form v = π + k π, largest difference {error:.0e}",
        error=error,
    )


@PAPER.picture(
    "Period doubling",
    "Speed after the impacts over Γ, followed upwards from the motion of period one: "
    "period two, four, and chaos.",
)
def cascade() -> Axes:
    """The diagram of the ball."""
    data = vi.bifurcation_sweep(
        ball(1.3),
        over={"amplitude": np.linspace(1.25, 1.75, 400)},
        start=periodic_start(1.25),
        way="up",
        at=vi.AtStop("B"),
        progress=False,
    )
    return plot_bifurcation_diagram(data)
