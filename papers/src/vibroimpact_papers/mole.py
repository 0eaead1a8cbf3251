"""An impact oscillator with a drift: bounded motion, progress, and how one follows from the other."""

from __future__ import annotations

import math
from functools import cache
from typing import Any, NamedTuple

import numpy as np
from matplotlib import pyplot as plt
from matplotlib.axes import Axes
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

import vibroimpact as vi
from vibroimpact.plotting import style
from vibroimpact_papers.judged import Claim, RuleResult, rule_result
from vibroimpact_papers.publication import Publication

PAPER = Publication(
    name="mole",
    title="An impact oscillator with a drift",
    reference=(
        "E. Pavlovskaia, M. Wiercigroch, Analytical drift reconstruction for visco-elastic impact oscillators "
        "operating in periodic and chaotic regimes, Chaos, Solitons and Fractals (2003), "
        "doi 10.1016/S0960-0779(03)00128-0."
    ),
    seen="the abstract and the captions of the first figures.",
    machine=(
        "Mole with a = 0.3, b = 0.1, xi = 0.01, omega = 0.1, as in Fig. 3. The gap is not to be had; 0.02 is "
        "ours, and no "
        "statement depends on it."
    ),
    missing=("the gap", "Table 1 and Fig. 4: progress", "parameters of coexisting attractors"),
)
FORCE, STATIC, XI, OMEGA, GAP = 0.3, 0.1, 0.01, 0.1, 0.02
TURN = 2.0 * math.pi / OMEGA
SETTLED = 90  # periods


def mole() -> vi.machines.Mole:
    """The mole of Fig. 3."""
    return vi.machines.Mole(
        force=FORCE, static_force=STATIC, damping=2.0 * XI, omega=OMEGA, gap=GAP
    )


@cache
def run() -> vi.Run:
    """A hundred periods from rest."""
    system = mole()
    return vi.simulate(system, system.free_start(), t_max=100 * TURN, impacts=10_000)


def bounded(t: NDArray[np.floating[Any]]) -> NDArray[np.float64]:
    """P = x - v at some times."""
    x, _ = run().at(t)
    return x[:, 0] - x[:, 1]


class Witness(NamedTuple):
    """Bounded place and progress after each period, shape (periods, 2), and the phases that were passed."""

    places: NDArray[np.float64]
    phases: frozenset[str]


@cache
def witness(periods: int = 20) -> Witness:
    """Motion of the same start by SciPy, phase by phase, in the equations of the machine's file.

    Free: x'' = b + a cos. Contact: x'' = b + a cos - p, p = (x - v - gap) + 2 xi x', v' = 0. Progress: p = 1, and
    x' - v' = (1 - (x - v - gap)) / (2 xi), so that v' = x' - that. Which follows is asked at the end of steps that end
    at events.
    """
    c = 2.0 * XI
    y, t, phase = np.array([0.0, 0.0, 0.0]), 0.0, "free"
    passed = {phase}
    kept: list[tuple[float, float]] = []

    def drive(t: float) -> float:
        return STATIC + FORCE * math.cos(OMEGA * t)

    def pull(y: NDArray[np.float64]) -> float:
        return float(y[0] - y[2] - GAP + c * y[1])

    def rates(t: float, y: NDArray[np.float64]) -> list[float]:
        if phase == "free":
            return [y[1], drive(t), 0.0]
        if phase == "contact":
            return [y[1], drive(t) - pull(y), 0.0]
        return [y[1], drive(t) - 1.0, y[1] - (1.0 - (y[0] - y[2] - GAP)) / c]

    def meets(_t: float, y: NDArray[np.float64]) -> float:
        return float(y[0] - y[2] - GAP)

    def lets_go(_t: float, y: NDArray[np.float64]) -> float:
        return pull(y)

    def yields(_t: float, y: NDArray[np.float64]) -> float:
        return pull(y) - 1.0

    def rests(_t: float, y: NDArray[np.float64]) -> float:
        return float(y[1] - (1.0 - (y[0] - y[2] - GAP)) / c)

    ways = {  # of each phase: its events, the sign of the crossing, and what follows
        "free": [(meets, 1.0, "contact")],
        "contact": [(lets_go, -1.0, "free"), (yields, 1.0, "progress")],
        "progress": [(rests, -1.0, "contact")],
    }
    for events in ways.values():
        for event, way, _next in events:
            event.terminal, event.direction = True, way  # type: ignore[attr-defined]
    while len(kept) < periods:
        end = (len(kept) + 1) * TURN
        found = solve_ivp(
            rates, (t, end), y, events=[one[0] for one in ways[phase]], rtol=1e-10, atol=1e-12,
            method="Radau" if phase == "progress" else "DOP853",
        )  # fmt: skip
        t, y = float(found.t[-1]), found.y[:, -1]
        if found.status == 0:
            kept.append((y[0] - y[2], y[2]))
            continue
        which = next(k for k, times in enumerate(found.t_events) if len(times))
        phase = ways[phase][which][2]
        passed.add(phase)
    return Witness(np.array(kept), frozenset(passed))


@PAPER.statement(
    "Fig. 3", "Phase plane of a period two motion constructed for", a=0.3, b=0.1, xi=0.01, omega=0.1
)
def period_two(_: Claim) -> RuleResult:
    """Places once in a period, and those of the witness from the same start."""
    p = bounded(np.arange(SETTLED, 100) * TURN)
    repeats = float(np.abs(p[2:] - p[:-2]).max())
    apart = float(np.abs(np.diff(p)).min())
    early = bounded(np.arange(1, 21) * TURN)
    off = float(np.abs(early - witness().places[:, 0]).max())
    return rule_result(
        repeats < 1e-7 and apart > 0.1 and off < 1e-5,
        f"repeats after two periods within {repeats:.0e}; after one it is {apart:.3f} away",
        f"SciPy, phase by phase, over 20 periods: largest difference {off:.0e}",
        apart=apart,
    )


@PAPER.statement(
    "Fig. 3", "No contact phase; contact without progression phase; contact with progression phase"
)
def three_phases(_: Claim) -> RuleResult:
    """States in the last ten periods."""
    late = run().time > SETTLED * TURN
    upper, rest = int(vi.SoftStopState.UPPER), int(vi.FrictionState.STICK)
    phases = {
        "no contact"
        if soft != upper
        else "contact, at rest"
        if slide == rest
        else "contact, progress"
        for soft, slide in run().states[late]
    }
    own = witness().phases
    return rule_result(
        len(phases) == len(own) == 3,
        f"{len(phases)} phases: {'; '.join(sorted(phases))}",
        f"SciPy, by its own events: {', '.join(sorted(own))}",
    )


@PAPER.statement("abstract", "the drift does not influence the dynamics of the bounded system")
def drift_does_not_matter(_: Claim) -> RuleResult:
    """Two runs, one begun 1000 further on."""
    system, t = mole(), np.arange(1, 41) * TURN
    far = vi.simulate(
        system, vi.State((1000.0, 1000.0), (0.0, 0.0)), t_max=40 * TURN, impacts=10_000
    )
    x, _v = far.at(t)
    off = float(np.abs(x[:, 0] - x[:, 1] - bounded(t)).max())
    return rule_result(
        off < 1e-8,
        f"begun 1000 further on, x \u2212 v is the same within {off:.0e} over 40 periods",
        "only x \u2212 v and velocities are in (1) to (3) of the machine\u2019s file",
        off=off,
    )


@PAPER.statement(
    "abstract", "can be reconstructed once the bounded oscillatory motion is determined"
)
def progress_from_the_bounded_motion(_: Claim) -> RuleResult:
    """Progress of two periods from p alone: while the slider yields the mass moves under b + a cos - 1."""
    begin = 18 * TURN
    events = run().time
    sliding = (run().states[:, 1] == vi.FrictionState.FORWARD) & (run().states[:, 0] > 0)
    total = 0.0
    for k in np.flatnonzero(
        sliding[:-1] & (events[:-1] >= begin) & (events[:-1] < begin + 2.0 * TURN)
    ):
        t0, t1 = float(events[k]), float(events[k + 1])
        t = t1 - t0
        # before it the slider rests, so that the mass has the speed of p
        h = 1e-5
        ahead = bounded(np.array([t0 - 2.0 * h, t0 - h, t0]))
        speed = float((3.0 * ahead[2] - 4.0 * ahead[1] + ahead[0]) / (2.0 * h))
        s0, c0, c1 = math.sin(OMEGA * t0), math.cos(OMEGA * t0), math.cos(OMEGA * t1)
        moved = speed * t + (STATIC - 1.0) * t * t / 2.0
        moved += FORCE / OMEGA * ((c0 - c1) / OMEGA - s0 * t)
        p = bounded(np.array([t0, t1]))
        total += moved - float(p[1] - p[0])
    x, _v = run().at(np.array([begin, begin + 2.0 * TURN]))
    progress = float(x[1, 1] - x[0, 1])
    late = witness().places[:, 1]
    other = float(late[-1] - late[-3])
    return rule_result(
        abs(total / progress - 1.0) < 1e-5 and abs(other / progress - 1.0) < 1e-5,
        f"progress in two periods {progress:.6f}; from x \u2212 v alone {total:.6f}",
        f"SciPy, phase by phase: {other:.6f}",
        progress=progress,
    )


@PAPER.statement(
    "abstract", "Evolutions of co-existing periodic and strange attractors were studied"
)
def coexisting_attractors(_: Claim) -> RuleResult:
    """No parameters are to be had."""
    return rule_result(
        None, "not computed", "the parameters at which they coexist are not in what could be read"
    )


@PAPER.picture(
    "Bounded motion and progress",
    "Two blows in two periods of the settled motion of Fig. 3: place of the mass relative to the slider (blue), and "
    "progress of the slider (orange).",
)
def blows() -> Axes:
    """Four periods."""
    _, ax = plt.subplots(figsize=(5.6, 3.4), layout="constrained")
    t = SETTLED * TURN + np.linspace(0.0, 4.0 * TURN, 4000)
    x, _v = run().at(t)
    ax.plot(t / TURN - SETTLED, x[:, 0] - x[:, 1], color=style.BLUE, label="$x - v$")
    ax.plot(t / TURN - SETTLED, x[:, 1] - x[0, 1], color=style.ORANGE, label="progress $v$")
    ax.axhline(GAP, color="black", linewidth=0.6, linestyle=":")
    ax.set(xlabel="periods", ylabel="place")
    ax.legend()
    return ax
