"""Resonant grazing of a forced oscillator: where folds and period doublings meet the grazing curve."""

from __future__ import annotations

import math
from functools import cache
from typing import Any

import numpy as np
from matplotlib import pyplot as plt
from matplotlib.axes import Axes

import vibroimpact as vi
from vibroimpact.plotting import style
from vibroimpact_papers.judged import Claim, RuleResult, rule_result
from vibroimpact_papers.publication import Publication
from vibroimpact_papers.witness import OnceAPeriod, once_a_period

PAPER = Publication(
    name="resonant-grazing",
    title="Resonant grazing of an impact oscillator",
    reference=(
        "D. J. W. Simpson, I. Ghosh, Resonant grazing bifurcations revisited, arXiv 2602.22797 (2026)."
    ),
    seen="the abstract.",
    machine=(
        "ImpactOscillator, one stop: x'' + 2 zeta x' + x = cos(omega t), x <= g, restitution R; zeta = 0.1 and "
        "R = 0.7 are ours."
    ),
    missing=(
        "the parameters of its figures",
        "its formulas of the coefficients: they are derived again",
    ),
)
ZETA, R = 0.1, 0.7
OMEGA_D = math.sqrt(1.0 - ZETA**2)
BOUNDS = ((1.9, 2.08), (0.28, 0.4))


def oscillator(omega: float, clearance: float) -> vi.ImpactOscillator:
    """The oscillator of the abstract."""
    return vi.ImpactOscillator(zeta=ZETA, omega=omega, restitution=R, clearance=clearance)


def closed(omega: Any) -> OnceAPeriod:
    """Witness: closed forms of motions with one impact in a period."""
    return once_a_period(omega, ZETA, R)


def bends() -> tuple[float, float]:
    """Witness: second-order coefficients of fold and flip against grazing at 2 w, by expansion of the closed forms."""
    at, t = 2.0 * OMEGA_D, math.pi / OMEGA_D
    rate = -2.0 * math.pi / at**2  # dT / d omega
    decay = math.exp(-ZETA * t)
    slope = -(1.0 + R) * decay * rate / (1.0 + decay) ** 2  # of a
    b = 1.0 - (1.0 + R) * decay / (1.0 + decay)
    kappa = -(at**2) * (1.0 + R) * decay * rate / (1.0 + R * decay) ** 2  # slope of kappa
    size = float(closed(at).amplitude)
    return size * (slope * at / b) ** 2 / 2.0, -size * (slope * kappa + (b * kappa / at) ** 2 / 2.0)


@cache
def folds() -> vi.BifurcationCurve:
    """Folds of the motions with one impact in a period, over frequency and clearance."""
    orbit = vi.find_orbit(oscillator(1.95, 0.3), vi.State((0.0,), (0.0,)))
    branch = vi.continue_orbit(orbit, "clearance", (0.3, 0.45))
    steps = vi.Steps(first=0.2, points=100)
    curve = vi.continue_bifurcation(branch["SN1"], ("omega", "clearance"), BOUNDS, steps=steps)
    assert isinstance(curve, vi.BifurcationCurve), curve
    return curve


@cache
def born() -> dict[str, vi.BifurcationCurve]:
    """Curves that begin where the fold meets the grazing curve, by kind."""
    found = vi.switch_curve(folds()["ZERO_1"], steps=vi.Steps(first=0.2, points=40))
    assert isinstance(found, tuple), found
    return {curve.kind: curve for curve in found if isinstance(curve, vi.BifurcationCurve)}


@PAPER.statement(
    "abstract",
    "the forcing frequency is a certain rational multiple of the damped natural frequency",
    slow=True,
)
def a_rational_multiple(_: Claim) -> RuleResult:
    """Frequency at which the fold meets the grazing curve."""
    at = folds()["ZERO_1"].parameters
    ratio = at["omega"] / OMEGA_D
    return rule_result(
        abs(ratio - 2.0) < 1e-8,
        f"codimension two at ω = {at['omega']:.9f} = {ratio:.9f} ω_d, g = {at['clearance']:.9f}",
        f"closed form: a = 0 at ω_d T = π, ω = 2 ω_d, g = {float(closed(2.0 * OMEGA_D).amplitude):.9f}",
        ratio=ratio,
    )


@PAPER.statement("abstract", "curves of saddle-node and period-doubling bifurcations", slow=True)
def curves_emanate(_: Claim) -> RuleResult:
    """Curves that begin at the point, against closed forms of both."""
    curves = {"SN": folds(), **born()}
    off = {}
    for kind, name in (("SN", "fold"), ("PD", "flip")):
        omega, g = curves[kind].values.T
        off[kind] = float(np.abs(getattr(closed(omega), name) - g).max())
    return rule_result(
        max(off.values()) < 1e-8,
        f"found: {', '.join(sorted(curves))} (ZERO is the grazing curve)",
        f"closed forms of SN and PD at all points: largest differences {off['SN']:.0e} and {off['PD']:.0e}",
        **{f"off_{kind}": value for kind, value in off.items()},
    )


@PAPER.statement(
    "abstract",
    "these curves are quadratically tangent to the curve of grazing bifurcations",
    slow=True,
)
def quadratically_tangent(_: Claim) -> RuleResult:
    """Order and coefficient of the contact of the fold."""
    form = folds()["ZERO_1"].normal_form
    exact = bends()[0]
    return rule_result(
        form.order == 2 and abs(form.coefficient / exact + 1.0) < 1e-6,
        f"order {form.order}, SN: g = g_graz + {-form.coefficient:.9f} (ω \u2212 2ω_d)²",
        f"expansion of the closed form: {exact:.9f}",
        coefficient=-form.coefficient,
    )


@PAPER.statement("abstract", "derive explicit formulas for their quadratic coefficients", slow=True)
def the_other_coefficient(_: Claim) -> RuleResult:
    """Order and coefficient of the contact of the period doubling."""
    form = born()["PD"]["ZERO_1"].normal_form
    exact = bends()[1]
    return rule_result(
        form.order == 2 and abs(form.coefficient / exact + 1.0) < 1e-6,
        f"order {form.order}, PD: {-form.coefficient:.9f}",
        f"expansion of the closed form: {exact:.9f}",
        coefficient=-form.coefficient,
    )


@PAPER.statement("abstract", "reveal an absence of chaos shortly past the grazing bifurcation")
def no_chaos_near_resonance(_: Claim) -> RuleResult:
    """Attractors a thousandth past grazing, at resonance and away from it; the witness has own impacts."""
    found = {}
    for omega in (2.0 * OMEGA_D, 2.15 * OMEGA_D):
        clearance = 0.999 * float(closed(omega).amplitude)
        attractor = vi.classify(oscillator(omega, clearance), vi.State((0.0,), (0.0,)))
        found[omega] = (attractor.label, repeats(omega, clearance))
    (at, own), (away, other) = found.values()
    return rule_result(
        "1-1-0" in at and own == 1 and "chaotic" in away and other > 50,
        f"at ω = 2 ω_d: {at}; at 2.15 ω_d: {away}",
        f"states once in a period by bisection: {own} different ones at 2 ω_d, {other} at 2.15 ω_d",
    )


def repeats(omega: float, clearance: float) -> int:
    """Witness: different states once in a period, of 60 after 400; exact flights, impacts by bisection."""
    w = OMEGA_D
    z = 1.0 / complex(1.0 - omega**2, 2.0 * ZETA * omega)
    turn = 2.0 * math.pi / omega
    grid = np.linspace(0.0, 1.0, 801)

    def forced(t: Any) -> tuple[Any, Any]:
        e = z * np.exp(1j * omega * t)
        return e.real, (1j * omega * e).real

    def at(t: Any, begin: float, p: float, q: float) -> tuple[Any, Any]:
        s = t - begin
        decay, c, n = np.exp(-ZETA * s), np.cos(w * s), np.sin(w * s)
        x, v = forced(t)
        free = decay * (p * c + q * n)
        return x + free, v + decay * w * (q * c - p * n) - ZETA * free

    def coefficients(t: float, x: float, v: float) -> tuple[float, float]:
        y, u = forced(t)
        return x - y, (v - u + ZETA * (x - y)) / w

    begin, (p, q) = 0.0, coefficients(0.0, 0.0, 0.0)
    kept = []
    for k in range(460):
        end = (k + 1) * turn
        start = begin if begin > k * turn else k * turn
        while True:
            t = start + (end - start) * grid
            over = np.flatnonzero(at(t, begin, p, q)[0][1:] > clearance)
            if not len(over):
                break
            low, high = t[over[0]], t[over[0] + 1]
            for _ in range(60):
                middle = (low + high) / 2.0
                if at(middle, begin, p, q)[0] > clearance:
                    high = middle
                else:
                    low = middle
            v = float(at(low, begin, p, q)[1])
            start = begin = float(low)
            p, q = coefficients(begin, clearance, -R * v)
            start += 1e-6
        if k >= 400:
            kept.append(float(at(end, begin, p, q)[0]))
    return len(np.unique(np.round(kept, 5)))


@PAPER.picture(
    "The plane of frequency and clearance",
    "Folds (blue) and period doublings (red) of motions with one impact in a period, minus the clearance of "
    "grazing: both "
    "touch it, quadratically, at twice the damped natural frequency. Dots: the library; lines: closed forms.",
)
def plane() -> Axes:
    """Both curves against grazing."""
    _, ax = plt.subplots(figsize=(5.4, 3.6), layout="constrained")
    omegas = np.linspace(1.92, 2.06, 200)
    for kind, name, colour in (("SN", "fold", style.BLUE), ("PD", "flip", style.VERMILION)):
        curve = folds() if kind == "SN" else born()["PD"]
        away = getattr(closed(omegas), name) - closed(omegas).amplitude
        ax.plot(omegas, away, color=colour, linewidth=1.0, label=kind)
        omega, g = curve.values.T
        ax.plot(omega, g - closed(omega).amplitude, ".", color=colour, markersize=4)
    ax.axhline(0.0, color="black", linewidth=0.8)
    ax.axvline(2.0 * OMEGA_D, color="black", linewidth=0.6, linestyle=":")
    ax.set(
        xlabel=r"frequency $\omega$", ylabel="clearance, minus that of grazing", xlim=(1.92, 2.06)
    )
    ax.set_ylim(-0.004, 0.004)
    ax.legend()
    return ax
