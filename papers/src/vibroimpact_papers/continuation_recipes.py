"""The impact oscillator of a textbook on continuation: an orbit, its grazing point, the grazing curve."""

from __future__ import annotations

import cmath
import math
from functools import cache
from typing import Any

import numpy as np
from matplotlib import pyplot as plt
from matplotlib.axes import Axes
from scipy.optimize import fsolve

import vibroimpact as vi
from vibroimpact.plotting import style
from vibroimpact_papers.judged import Claim, RuleResult, half_unit, number, rule_result
from vibroimpact_papers.publication import Publication

PAPER = Publication(
    name="continuation-recipes",
    title="An impact oscillator in a textbook on continuation",
    reference="H. Dankowicz, F. Schilder, Recipes for Continuation (2013), Example 15.2 and Figs. 15.4 to 15.7.",
    seen="the captions and the programs that the authors publish with the book, which hold the numbers.",
    machine=(
        "ImpactOscillator with k = 1, c = 0.1, A = 1, ω = 1, a stop at d = 1 with restitution e = 0.8, as printed; "
        "the force is A cos θ."
    ),
    missing=("the tables that the program of the book prints",),
)
C, D, E = 0.1, 1.0, 0.8


def oscillator(amplitude: float, omega: float = 1.0) -> vi.ImpactOscillator:
    """The oscillator of Example 15.2."""
    return vi.ImpactOscillator(
        zeta=C / 2.0, omega=omega, restitution=E, clearance=D, force=amplitude
    )


def grazing_amplitude(omega: float) -> float:
    """Witness: force at which the motion without impacts reaches the stop."""
    return D * math.hypot(1.0 - omega**2, C * omega)


def rising(amplitude: float, omega: float) -> vi.State:
    """The motion without impacts where it passes 0 upwards, in closed form."""
    z = amplitude / complex(1.0 - omega**2, C * omega)
    return vi.State((0.0,), (omega * abs(z),), -cmath.phase(z) - math.pi / 2.0)


@cache
def impact_in_closed_form() -> tuple[float, float]:
    """Witness: velocity after the impact and its phase, once in a period of A = omega = 1.

    Between impacts x = sin(theta) / c + e^(-ct/2) (p cos wt + q sin wt). The place at both ends and the impact law
    leave phase and speed.
    """
    w, turn = math.sqrt(1.0 - C * C / 4.0), 2.0 * math.pi

    def residual(unknown: Any) -> list[float]:
        theta, after = unknown
        place, speed = math.sin(theta) / C, math.cos(theta) / C
        p = D - place
        q = (after - speed + C / 2.0 * p) / w
        decay, c, s = math.exp(-C / 2.0 * turn), math.cos(w * turn), math.sin(w * turn)
        x = decay * (p * c + q * s)
        v = decay * w * (q * c - p * s) - C / 2.0 * x
        return [x + place - D, E * (v + speed) + after]

    theta, after = fsolve(residual, (0.08, -1.36), xtol=1e-12)
    return float(after), float(theta)


@cache
def orbit() -> vi.Orbit:
    """One impact in a period, from the printed state."""
    return vi.find_orbit(oscillator(1.0), vi.State((1.0,), (-1.36,), 0.076), stops="A", cycles=1)


@cache
def branch() -> vi.Branch:
    """The orbits over the force."""
    found = vi.continue_orbit(orbit(), "force", (0.01, 1.0), inadmissible=True)
    assert isinstance(found, vi.Branch), found
    return found


@PAPER.statement(
    "Example 15.2", "Continuation of impacting trajectory", notes="The state after the impact.",
    velocity=-1.36, phase=0.076,
)  # fmt: skip
def the_impact(claim: Claim) -> RuleResult:
    """Velocity and phase after the impact."""
    velocity, phase = float(orbit().states[0, 1]), float(orbit().states[0, 2])
    exact = impact_in_closed_form()
    holds = (
        abs(velocity - number(claim, "velocity")) <= half_unit(2)
        and abs(phase - number(claim, "phase")) <= half_unit(3)
        and max(abs(velocity - exact[0]), abs(phase - exact[1])) < 1e-9
    )
    return rule_result(
        holds,
        f"velocity {velocity:.9f}, phase {phase:.9f}",
        f"closed form: {exact[0]:.9f}, {exact[1]:.9f}",
        velocity=velocity,
        phase=phase,
    )


@PAPER.statement(
    "Example 15.2", "Continuation of impacting trajectory", notes="The state at the phase \u2212π.",
    place=-0.98, velocity=-0.29,
)  # fmt: skip
def half_a_turn_later(claim: Claim) -> RuleResult:
    """The state at which the phase is reset."""
    first = orbit().state
    run = vi.simulate(oscillator(1.0), first, t_max=math.pi - float(orbit().states[0, 2]))
    x, v = run.last.position[0], run.last.velocity[0]
    # witness: the same closed form, evaluated at the phase pi
    after, theta = impact_in_closed_form()
    w, t = math.sqrt(1.0 - C * C / 4.0), math.pi - theta
    p = D - math.sin(theta) / C
    q = (after - math.cos(theta) / C + C / 2.0 * p) / w
    decay = math.exp(-C / 2.0 * t)
    y = decay * (p * math.cos(w * t) + q * math.sin(w * t))
    u = decay * w * (q * math.cos(w * t) - p * math.sin(w * t)) - C / 2.0 * y - 1.0 / C
    holds = (
        abs(x - number(claim, "place")) <= half_unit(2)
        and abs(v - number(claim, "velocity")) <= half_unit(2)
        and max(abs(x - y), abs(v - u)) < 1e-9
    )
    return rule_result(
        holds,
        f"x = {x:.9f}, x\u2032 = {v:.9f}",
        f"closed form: {y:.9f}, {u:.9f}",
        place=x,
        velocity=v,
    )


@PAPER.statement(
    "Example 15.2", "Continuation of impacting trajectory", notes="The times of the two segments.",
    before=3.2, after=3.1,
)  # fmt: skip
def the_two_segments(claim: Claim) -> RuleResult:
    """Times from the phase -pi to the impact, and from there to the phase pi."""
    phase = float(orbit().states[0, 2])
    times = math.pi + phase, math.pi - phase
    exact = impact_in_closed_form()[1]
    own = math.pi + exact, math.pi - exact
    holds = all(
        abs(time - number(claim, key)) <= half_unit(1) and abs(time - by_hand) < 1e-9
        for time, by_hand, key in zip(times, own, ("before", "after"), strict=True)
    )
    return rule_result(
        holds,
        f"{times[0]:.6f} and {times[1]:.6f}",
        f"π ± the phase of the impact in closed form: {own[0]:.6f}, {own[1]:.6f}",
    )


@PAPER.statement(
    "Fig. 15.5",
    "passes through a grazing point (b), after which nonphysical orbits result (c)",
    slow=True,
)
def through_grazing(_: Claim) -> RuleResult:
    """Where the speed of the impact vanishes, and whether the orbits beyond are motions."""
    at = branch()["ZERO1"].parameter
    exact = grazing_amplitude(1.0)
    sides: dict[bool, set[bool]] = {True: set(), False: set()}
    for k in range(0, len(branch().values), 3):
        one = branch().orbit(k)
        after = float(one.states[0, 1])
        if abs(after) > 1e-3:
            sides[after < 0.0].add(bool(one.admissible))
    return rule_result(
        abs(at - exact) < 1e-9 and sides == {True: {True}, False: {False}},
        f"speed zero at A = {at:.12f}; before it every orbit is a motion, beyond it none is",
        f"d |k \u2212 ω² + icω| = {exact:.12f}; beyond, the mass would leave the stop inwards with a speed of the "
        "wrong sign",
        amplitude=at,
    )


@PAPER.statement(
    "Fig. 15.6", "region of parameter values for which nonimpacting orbits exist (left-hand side)"
)
def the_grazing_curve(_: Claim) -> RuleResult:
    """Runs that begin on the motion without impacts, a thousandth to the left and to the right of the curve."""
    left: list[int] = []
    right: list[int] = []
    omegas = np.linspace(0.3, 1.5, 7)
    for omega in omegas:
        edge = grazing_amplitude(float(omega))
        for side, found in ((0.999, left), (1.001, right)):
            a, w = side * edge, float(omega)
            run = vi.simulate(oscillator(a, w), rising(a, w), t_max=4.0 * math.pi / w)
            found.append(int(run.impacts.sum()))
    return rule_result(
        max(left) == 0 and min(right) > 0,
        f"at {len(omegas)} frequencies from 0.3 to 1.5: impacts to the left {max(left)}, to the right at least "
        f"{min(right)}",
        "A = d |k \u2212 ω² + icω| of the linear motion",
    )


@PAPER.statement("Fig. 15.7", "All orbits have the same amplitude, but different periods")
def the_same_amplitude(_: Claim) -> RuleResult:
    """Largest places of grazing orbits in their simulation."""
    heights = []
    for omega in (0.5, 1.0, 1.4):
        a = grazing_amplitude(float(omega)) * (1.0 - 1e-12)
        turn = 2.0 * math.pi / omega
        run = vi.simulate(oscillator(a, omega), rising(a, omega), t_max=turn)
        x, _v = run.at(np.linspace(0.0, turn, 4001))
        heights.append(float(x[:, 0].max()))
    spread = max(heights) - min(heights)
    return rule_result(
        spread < 1e-5 and abs(heights[0] - D) < 1e-5,
        f"largest places at ω = 0.5, 1, 1.4: {', '.join(f'{h:.6f}' for h in heights)}",
        "a motion that touches the stop and does not cross it has the stop\u2019s place as its maximum",
    )


@PAPER.picture(
    "The grazing curve of Fig. 15.6",
    "Force and frequency at which the motion without impacts touches the stop: simulated machines with impacts "
    "(orange) "
    "and without (blue), and the closed form (line).",
)
def grazing_curve() -> Axes:
    """Machines on both sides of the curve."""
    _, ax = plt.subplots(figsize=(5.0, 3.6), layout="constrained")
    omegas = np.linspace(0.02, 1.5, 300)
    ax.plot([grazing_amplitude(float(w)) for w in omegas], omegas, color="black", linewidth=1.2)
    for omega in np.linspace(0.1, 1.45, 16):
        for a in np.linspace(0.03, 0.99, 20):
            w, force = float(omega), float(a)
            hits = vi.simulate(oscillator(force, w), rising(force, w), t_max=2.0 * math.pi / w)
            colour = style.ORANGE if hits.impacts.any() else style.BLUE
            ax.plot(a, omega, ".", color=colour, markersize=4)
    ax.set(xlabel="force amplitude $A$", ylabel=r"frequency $\omega$", xlim=(0, 1), ylim=(0, 1.5))
    return ax
