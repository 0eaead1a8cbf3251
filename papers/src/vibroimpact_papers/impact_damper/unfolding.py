"""The neighbourhood of a strong resonance 1:4: portraits predicted and simulated, sector by sector.

Equation    z' = mu z - i c z |z|^2 - i d conj(z)^3, per iterate of H, in a frame that turns by i  (1)
            mu = log(nu / i), nu the multiplier of the fixed point near i
Method      theory: (1) by Runge-Kutta steps; simulation: every fourth iterate of the half map H,
            started on the centre manifold and brought back to z by its second-order terms
Assumes     mu is small: (1) is the first term of a series
Reference   Kuznetsov, Elements of Applied Bifurcation Theory, section 9.5.4
"""

from __future__ import annotations

import cmath
import math
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
import xarray as xr

from vibroimpact._core.types import Complexes, Floats
from vibroimpact.bifurcations.curve import BifurcationCurve, CodimensionTwoPoint
from vibroimpact.bifurcations.switch_curve import switch_curve
from vibroimpact.closed_forms.symmetric_orbits import SymmetricOrbit
from vibroimpact.normal_forms.strong_resonance import OneToFour
from vibroimpact.simulation.simulator import Simulator
from vibroimpact_papers.impact_damper import ParameterSet
from vibroimpact_papers.impact_damper.datasets import attributes
from vibroimpact_papers.impact_damper.plan import Plan
from vibroimpact_papers.impact_damper.resonances import AXES, orbit_at

SIZE = 0.002  # |mu|
NEAR = 0.018  # relative half-width of the window of both parameters
STEP = 1e-6  # relative, of differences in the parameters
RADII = (0.12, 0.75, 1.6)  # of starts, in units of sqrt(|mu| / |c|)
ANGLES = 4  # of starts on each radius, within a quarter turn
TIMES = 6.0  # length of a trajectory in units of 1 / |mu|
PARTS = 500  # points of a trajectory
BEYOND = 3.0  # a trajectory ends where |z| exceeds so many units


@dataclass(frozen=True, eq=False)
class Sector:
    """One sector around the point: its parameters and trajectories, shape (starts, PARTS)."""

    words: str
    mu: complex
    omega: float
    half_clearance: float
    predicted: Complexes = field(repr=False)
    simulated: Complexes = field(repr=False)
    period_four: Complexes = field(repr=False)


@dataclass(frozen=True, eq=False)
class Unfolded:
    """A resonance 1:4 with its sectors and the fold curves that begin there."""

    set: str
    point: CodimensionTwoPoint
    form: OneToFour
    sectors: tuple[Sector, ...]
    folds: tuple[BifurcationCurve, ...] = field(repr=False)


def unfolded(chosen: ParameterSet, point: CodimensionTwoPoint) -> Unfolded:
    """Return the portraits around a point. Cost: some seconds."""
    form = point.normal_form
    assert isinstance(form, OneToFour)
    folds: tuple[BifurcationCurve, ...] = ()
    if form.folds_exist:
        at = [point.parameters[name] for name in AXES]
        (a, b), (c, d) = [(v * (1.0 - NEAR), v * (1.0 + NEAR)) for v in at]
        switched = switch_curve(point, ((a, b), (c, d)))
        folds = switched if isinstance(switched, tuple) else ()
    made = tuple(_sector(chosen, point, form, words, arg) for words, arg in sectors(form))
    return Unfolded(chosen.name, point, form, made, folds)


def sectors(form: OneToFour) -> list[tuple[str, float]]:
    """Return the sectors with the argument of mu in the middle of each, in radians."""
    if not form.folds_exist:
        return [
            ("fixed point stable", math.pi),
            ("unstable, near the curve", 0.47 * math.pi),
            ("unstable, far from it", 0.0),
            ("unstable, near the curve", -0.47 * math.pi),
        ]
    low, high = sorted(cmath.phase(d) for d in form.fold_directions)
    return [
        ("fixed point stable", math.pi),
        ("unstable, outside the folds", (high + math.pi / 2.0) / 2.0),
        ("unstable, between the folds", (low + high) / 2.0),
        ("unstable, outside the folds", (low - math.pi / 2.0) / 2.0),
    ]


def parameters_at(
    chosen: ParameterSet, point: CodimensionTwoPoint, mu: complex
) -> tuple[float, float]:
    """Return omega and half_clearance at which log(nu / i) is mu, by Newton's method."""
    a = np.array([point.parameters[name] for name in AXES])
    for _ in range(20):
        here = mu_at(chosen, *a)
        slopes = [(mu_at(chosen, *(a + step)) - here) / step.sum() for step in np.diag(STEP * a)]
        matrix = np.array([[s.real for s in slopes], [s.imag for s in slopes]])
        change = np.linalg.solve(matrix, [(mu - here).real, (mu - here).imag])
        a = a + change
        if np.all(np.abs(change) < 1e-13 * np.abs(a)):
            break
    return float(a[0]), float(a[1])


def mu_at(chosen: ParameterSet, omega: float, clearance: float) -> complex:
    """Return log(nu / i) of the multiplier next to i."""
    nus = orbit_at(chosen, omega, clearance).half_multipliers
    return cmath.log(complex(nus[np.argmin(np.abs(nus - 1j))]) / 1j)


def flow(form: OneToFour, mu: complex, z: Complexes, step: float, count: int) -> Complexes:
    """Return solutions of (1) at multiples of a step, shape (starts, count)."""

    def rate(w: Complexes) -> Complexes:
        turned: Complexes = mu * w - 1j * form.c * w * np.abs(w) ** 2 - 1j * form.d * w.conj() ** 3
        return turned

    inner = 4
    h = step / inner
    rows = [z]
    limit = BEYOND * math.sqrt(abs(mu) / abs(form.c))
    for _ in range(count - 1):
        w = rows[-1]
        for _ in range(inner):
            k1 = rate(w)
            k2 = rate(w + h / 2.0 * k1)
            k3 = rate(w + h / 2.0 * k2)
            k4 = rate(w + h * k3)
            w = w + h / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + k4)
        rows.append(np.where(np.abs(w) < limit, w, np.nan))
    return np.array(rows).T


def iterated(
    form: OneToFour, orbit: SymmetricOrbit, z: complex, every: int, count: int, limit: float
) -> Complexes:
    """Return z of every so-many-th iterate of the half map from a start on the centre manifold."""
    at = orbit.state
    middle = np.array([at.position[0], *at.velocity, at.phase])
    x1, v1, v2, phase = map(float, middle + form.points(np.array([z]))[0])
    start = orbit.damper.on_stop("A", x1=x1, v1=v1, v2=v2, phase=phase % (2.0 * math.pi))
    part = Simulator(orbit.damper, start).record(every * (count - 1))
    sign = np.where(part.side > 0, 1.0, -1.0)[:, None]
    turned = part.phase + np.where(part.side > 0, 0.0, math.pi)
    x = np.column_stack([part.position[:, :1] * sign, part.velocity * sign, turned]) - middle
    x[:, 3] = np.remainder(x[:, 3] + math.pi, 2.0 * math.pi) - math.pi
    found = np.full(count, np.nan + 0j)
    kept = x[every - 1 :: every]
    found[0], found[1 : 1 + len(kept)] = z, coordinate_of(form, kept)
    gone = np.flatnonzero(np.abs(found) > limit)
    if gone.size:
        found[gone[0] :] = np.nan
    return found


def coordinate_of(form: OneToFour, x: Floats) -> Complexes:
    """Return z of displacements from the fixed point."""
    linear: Complexes = x @ form.p.conj()
    z = linear
    for _ in range(4):
        bent = np.real(np.outer(z**2, form.h20)) + np.outer(np.abs(z) ** 2, form.h11)
        z = linear - bent @ form.p.conj()
    return z


def _sector(
    chosen: ParameterSet, point: CodimensionTwoPoint, form: OneToFour, words: str, argument: float
) -> Sector:
    mu = SIZE * cmath.exp(1j * argument)
    omega, clearance = parameters_at(chosen, point, mu)
    orbit = orbit_at(chosen, omega, clearance)
    unit = math.sqrt(abs(mu) / abs(form.c))
    turn = np.exp(1j * math.pi / 2.0 * np.arange(4 * ANGLES) / ANGLES)
    starts = np.concatenate([r * unit * turn for r in RADII])
    every = 4 * max(1, round(TIMES / abs(mu) / PARTS / 4.0))
    predicted = flow(form, mu, starts, float(every), PARTS)
    quarter = [r * unit * turn[:ANGLES] for r in RADII]
    runs = [iterated(form, orbit, complex(z), every, PARTS, BEYOND * unit)
            for z in np.concatenate(quarter)]  # fmt: skip
    # The half map commutes with no turn by i; the four points of an orbit are shown by turning it.
    simulated = np.array([run * 1j**k for run in runs for k in range(4)])
    return Sector(words, mu, omega, clearance, predicted, simulated, form.period_four(mu))


# --- data -----------------------------------------------------------------------------------------


def unfolding_data(one: Unfolded, number: int, chosen: ParameterSet, plan: Plan) -> xr.Dataset:
    """Return the portraits, and the curves in the window around the point."""
    at = np.array([one.point.parameters[name] for name in AXES])
    lines = [_line(chosen, one.point, d) for d in one.form.fold_directions]
    torus = [_line(chosen, one.point, 1j), _line(chosen, one.point, -1j)]  # mu imaginary: exact
    folds = [_within(c.values, at) for c in one.folds]
    z = ("sector", "start", "time")
    return xr.Dataset(
        {
            "words": ("sector", [s.words for s in one.sectors]),
            "mu_real": ("sector", [s.mu.real for s in one.sectors]),
            "mu_imag": ("sector", [s.mu.imag for s in one.sectors]),
            "sector_at": (("sector", "parameter"),
                          [[s.omega, s.half_clearance] for s in one.sectors]),
            "predicted_real": (z, _stacked([s.predicted.real for s in one.sectors])),
            "predicted_imag": (z, _stacked([s.predicted.imag for s in one.sectors])),
            "simulated_real": (z, _stacked([s.simulated.real for s in one.sectors])),
            "simulated_imag": (z, _stacked([s.simulated.imag for s in one.sectors])),
            "period_four_real": (("sector", "point"), _fours(one, "real")),
            "period_four_imag": (("sector", "point"), _fours(one, "imag")),
            "torus": (("on_torus", "parameter"), _joined(torus)),
            "folds": (("on_fold", "parameter"), _joined(folds)),
            "half_lines": (("on_line", "parameter"), _joined(lines)),
        },
        coords={"parameter": list(AXES)},
        attrs=attributes(f"unfolding-{one.set}-{number}", chosen, plan)
        | {"point_omega": float(at[0]), "point_half_clearance": float(at[1]),
           "A_real": one.form.scaled.real, "A_imag": one.form.scaled.imag,
           "unit": math.sqrt(SIZE / abs(one.form.c)), "size_of_mu": SIZE},
    )  # fmt: skip


def _line(chosen: ParameterSet, point: CodimensionTwoPoint, direction: complex) -> Floats:
    """Return the parameters on the half-line of a direction of mu."""
    sizes = 2.0 * SIZE * np.linspace(0.0, 1.0, 9)[1:]
    start = [point.parameters[name] for name in AXES]
    return np.array([start, *(parameters_at(chosen, point, s * direction) for s in sizes)])


def _within(values: Floats, at: Floats) -> Floats:
    """Return a curve with NaN where it is outside the window."""
    inside = np.all(np.abs(values / at - 1.0) < NEAR, axis=1)
    kept: Floats = np.where(inside[:, None], values, np.nan)
    return kept


def _joined(parts: Sequence[Floats]) -> Floats:
    """Join curves with a gap between them."""
    gap = np.full((1, 2), np.nan)
    return np.concatenate([rows for part in parts for rows in (part, gap)] or [gap])


def _stacked(parts: Sequence[Floats]) -> Floats:
    return np.array(parts, dtype=np.float32).astype(np.float64)


def _fours(one: Unfolded, part: str) -> Floats:
    """Return the points of period four of every sector, at most eight."""
    found = np.full((len(one.sectors), 8), np.nan)
    for row, sector in zip(found, one.sectors, strict=True):
        row[: len(sector.period_four)] = getattr(sector.period_four, part)
    return found
