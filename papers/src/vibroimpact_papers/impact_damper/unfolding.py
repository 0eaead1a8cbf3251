"""The neighbourhood of a strong resonance: portraits predicted and simulated, sector by sector.

Method      theory: the flow of unfolding_flows.py by Runge-Kutta steps; simulation: iterates of the
            half map H on the centre manifold, as unfolding_motions.py reads them, of 1:4, 1:3 and
            1:2 every so-many-th, a multiple of the order. At 1:1 fixed points exist on one side of
            a fold of half_clearance only; on the other the parameters are those reflected there
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np
import xarray as xr

from vibroimpact._core.types import Complexes, Floats
from vibroimpact.bifurcations.curve import BifurcationCurve
from vibroimpact.bifurcations.switch_curve import switch_curve
from vibroimpact.branches.point import BifurcationPoint
from vibroimpact.continuation import Steps
from vibroimpact.normal_forms import CodimensionTwo
from vibroimpact.orbits.find import find_orbit
from vibroimpact.orbits.orbit import Orbit
from vibroimpact.orbits.symmetric_damper import on_circle, symmetric_orbits
from vibroimpact.simulation.simulate import simulate
from vibroimpact_papers.impact_damper import ParameterSet
from vibroimpact_papers.impact_damper.datasets import attributes
from vibroimpact_papers.impact_damper.plan import Plan, damper_of
from vibroimpact_papers.impact_damper.resonances import AXES, orbit_at
from vibroimpact_papers.impact_damper.symmetric_bifurcations import half_map_jacobian, nus_of
from vibroimpact_papers.impact_damper.unfolding_flows import (
    SHARES,
    DoubleFlow,
    Flow,
    OneFlow,
    Place,
    TwoFlow,
    flow_at,
    logarithms,
    solutions,
    solved,
)
from vibroimpact_papers.impact_damper.unfolding_motions import HalfMap, OnManifold, iterated

REACH = 1.6  # half-width of the window of both parameters, in those of the sectors
STEP = 1e-6  # relative, of differences in the parameters
RADII = (0.12, 0.75, 1.6)  # of starts, in units of the flow
FOLDS = Steps(first=0.3, largest=4.0, tolerance=1e-3, points=200)  # for a picture
BEYOND_WINDOW = 4.0  # fold curves are followed so many windows far
PARTS = 500  # points of a trajectory
ACROSS = (0.97, 1.03)  # slopes m2 / m1 of lines on both sides of the curve of the doubled orbit
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
    periodic: Complexes = field(repr=False)


@dataclass(frozen=True, eq=False)
class Unfolded:
    """A resonance with its sectors, and curves of other orbits that begin there.

    ``born`` has parameters at 1:4, where they are folds of period four, and mu at 1:2, where it is
    the Neimark-Sacker curve of the doubled orbit.
    """

    set: str
    point: BifurcationPoint
    flow: Flow
    sectors: tuple[Sector, ...]
    born: tuple[Floats, ...] = field(repr=False)


def unfolded(chosen: ParameterSet, point: BifurcationPoint) -> Unfolded:
    """Return the portraits around a point. Cost: some seconds."""
    form = point.normal_form
    assert isinstance(form, CodimensionTwo)
    flow = flow_at(form)
    start = [point.parameters[name] for name in AXES]
    made = tuple(_sector(chosen, start, flow, place) for place in flow.places())
    born: tuple[Floats, ...] = ()
    if form.kind == "R4" and form.switchable:
        w, h = (BEYOND_WINDOW * half for half in reach(start, made))
        bounds = (start[0] - w, start[0] + w), (start[1] - h, start[1] + h)
        switched = switch_curve(point, bounds, steps=FOLDS, progress=False)
        if isinstance(switched, tuple):
            born = tuple(c.values for c in switched if isinstance(c, BifurcationCurve))
    if isinstance(flow, TwoFlow):
        born = (torus_of_doubled(chosen, start, flow),)
    return Unfolded(chosen.name, point, flow, made, born)


def stride(flow: Flow) -> int:
    """Return the half periods between points of a trajectory."""
    return flow.order * max(1, round(flow.duration / PARTS / flow.order))


def reach(at: Sequence[float], made: Sequence[Sector]) -> tuple[float, float]:
    """Return the half-widths of the window around a point."""
    away = np.abs(np.array([[s.omega, s.half_clearance] for s in made]) - at).max(axis=0)
    return REACH * float(away[0]), REACH * float(away[1])


# --- parameters -----------------------------------------------------------------------------------


def parameters_at(
    chosen: ParameterSet, flow: Flow, start: Sequence[float], mu: complex
) -> tuple[float, float]:
    """Return omega and half_clearance at which the flow has mu, by Newton's method."""
    at = np.array(start)
    found = solved(lambda a: mu_at(chosen, flow, *a), mu, at, STEP * at, 1e-13 * at)
    return float(found[0]), float(found[1])


def mu_at(chosen: ParameterSet, flow: Flow, omega: float, clearance: float) -> complex:
    """Return mu of the flow, reflected where there is no orbit."""
    mu = flow.mu_of(nus_of(orbit_of(chosen, flow, omega, clearance)))
    exists = not isinstance(flow, OneFlow) or clearance <= fold_at(chosen, omega)[0]
    return mu if exists else complex(-mu.real, mu.imag)


def orbit_of(chosen: ParameterSet, flow: Flow, omega: float, clearance: float) -> Orbit:
    """Return the orbit whose multipliers give mu: at 1:1 that which is no saddle, reflected."""
    if not isinstance(flow, OneFlow):
        return orbit_at(chosen, omega, clearance)
    fold = fold_at(chosen, omega)[0]
    damper = replace(damper_of(chosen, omega), half_clearance=fold - abs(fold - clearance))

    def saddle(orbit: Orbit) -> float:
        first, second = logarithms(nus_of(orbit), flow.root, 2)
        return -float((first * second).real)

    return min(symmetric_orbits(damper), key=saddle)


def fold_at(chosen: ParameterSet, omega: float) -> tuple[float, HalfMap]:
    """Return the largest half_clearance with symmetric orbits, and H at the orbit there."""
    damper = damper_of(chosen, omega)
    w, alpha, beta, _ = on_circle(damper)
    phase, fold = math.pi / 2.0 - math.atan2(beta, alpha), math.hypot(alpha, beta)
    x1, _, v1, v2 = (float(u) for u in w @ [math.sin(phase), math.cos(phase)])
    damper = replace(damper, half_clearance=fold)
    state = damper.on_stop("A", x1=x1, v1=v1, v2=v2, phase=phase % (2.0 * math.pi))
    return fold, HalfMap.at(damper, state, half_map_jacobian(damper, state)[0])


def half_map(chosen: ParameterSet, flow: Flow, omega: float, clearance: float) -> HalfMap:
    """Return H around the point z = 0 of the flow.

    At 1:1 this is the middle of both fixed points, whose states at the impact are on a circle
    around zero: the phase is that of the fold, the rest in proportion to half_clearance.
    """
    if not isinstance(flow, OneFlow):
        damper = replace(damper_of(chosen, omega), half_clearance=clearance)
        state = orbit_at(chosen, omega, clearance).state
        return HalfMap.at(damper, state, half_map_jacobian(damper, state)[0])
    fold, there = fold_at(chosen, omega)
    share = clearance / fold
    damper = replace(there.damper, half_clearance=clearance)
    return replace(there, damper=damper, middle=there.middle * [share, share, share, 1.0])


def torus_of_doubled(chosen: ParameterSet, start: Sequence[float], flow: TwoFlow) -> Floats:
    """Return (m1, m2) where a pair of multipliers of the doubled orbits has modulus one.

    In the full map these are 1-1-1 orbits without symmetry, found by Newton's method on the damper;
    the place on a line across the curve by secants.
    """
    far = (2.0 * flow.size * complex(1.0, slope) for slope in ACROSS)
    low, high = (np.array(parameters_at(chosen, flow, start, mu)) for mu in far)
    found = [0j]
    for share in SHARES:
        origin, across = start + share * (low - start), share * (high - low)
        k = [0.0, 1.0]
        growth = [doubled_growth(chosen, flow, *(origin + x * across)) for x in k]
        for _ in range(2):  # growth is nearly linear
            k.append(k[-1] - growth[-1] * (k[-1] - k[-2]) / (growth[-1] - growth[-2]))
            growth.append(doubled_growth(chosen, flow, *(origin + k[-1] * across)))
        found.append(mu_at(chosen, flow, *(origin + k[-1] * across)))
    return np.column_stack([np.real(found), np.imag(found)])


def doubled_growth(chosen: ParameterSet, flow: TwoFlow, omega: float, clearance: float) -> float:
    """Return the logarithm of the product of both multipliers near 1 of a doubled orbit."""
    half = half_map(chosen, flow, omega, clearance)
    z = flow.periodic(mu_at(chosen, flow, omega, clearance))[0]
    guess = simulate(half.damper, half.state(z.real * flow.amplitude * flow.form.q0), impacts=4)
    orbit = find_orbit(half.damper, guess, stops="AB", cycles=1, symmetric=False)
    return float(logarithms(orbit.multipliers, 1.0 + 0j, 2).sum().real)


# --- portraits ------------------------------------------------------------------------------------


def _sector(
    chosen: ParameterSet, start: Sequence[float], flow: Flow, place: Place
) -> Sector:  # fmt: skip
    words, mu = place
    omega, clearance = parameters_at(chosen, flow, start, mu)
    half = half_map(chosen, flow, omega, clearance)
    q, limit = flow.order, BEYOND * flow.unit
    count = q * flow.starts
    turn = np.exp(1j * (2.0 * math.pi / count) * np.arange(count))
    starts = np.concatenate([r * flow.unit * turn for r in RADII])
    every = stride(flow)
    predicted = solutions(flow, mu, starts, every / flow.iterates, PARTS, limit)
    part = np.concatenate([r * flow.unit * turn[: flow.starts] for r in RADII])
    if isinstance(flow, DoubleFlow):
        near = OnManifold.of(flow, half)
        runs = [near.followed(z, every, PARTS, limit) for z in map(complex, part)]
    else:
        runs = [iterated(flow.form, half, z, every, PARTS, limit) for z in map(complex, part)]
    # The half map commutes with no turn by the root; the q points of an orbit are shown by turning it.
    turned = np.array(flow.root) ** np.arange(q)[:, None, None]
    simulated = np.reshape(runs, (len(RADII), 1, flow.starts, PARTS)) * turned
    simulated = simulated.reshape(predicted.shape)
    return Sector(words, mu, omega, clearance, predicted, simulated, flow.periodic(mu))


# --- data -----------------------------------------------------------------------------------------


def unfolding_data(one: Unfolded, number: int, chosen: ParameterSet, plan: Plan) -> xr.Dataset:
    """Return the portraits, and the curves in the window around the point.

    At 1:4 and 1:3 the curves are in the plane of the parameters, at 1:2 and 1:1 in that of (m1, m2).
    """
    flow, lines = one.flow, one.flow.lines()
    at = np.array([one.point.parameters[name] for name in AXES])
    scaled = getattr(flow.form, "scaled", None)
    kept = (
        {"scaled_real": scaled.real, "scaled_imag": scaled.imag}
        if isinstance(scaled, complex)
        else {}
    )
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
            "periodic_real": (("sector", "point"), _periodic(one, "real")),
            "periodic_imag": (("sector", "point"), _periodic(one, "imag")),
            "torus": (("on_torus", "parameter"),
                      _joined([_line(chosen, one, mus) for mus in flow.torus()])),
            "born": (("on_born", "parameter"), _joined(one.born)),
            "lines": (("on_line", "parameter"),
                      _joined([_line(chosen, one, line.mus) for line in lines])),
        },
        coords={"parameter": list(AXES)},
        attrs=attributes(f"unfolding-{one.set}-{number}", chosen, plan)
        | {"point_omega": float(at[0]), "point_half_clearance": float(at[1]),
           "resonance": f"1:{flow.order}", "unit": flow.unit, "size_of_mu": flow.size,
           "line_words": [line.words for line in lines]}
        | kept,
    )  # fmt: skip


def _line(chosen: ParameterSet, one: Unfolded, mus: Complexes) -> Floats:
    """Return the parameters at values of mu, from the point on, or (m1, m2)."""
    if isinstance(one.flow, DoubleFlow):
        return np.column_stack([np.append(0.0, mus.real), np.append(0.0, mus.imag)])
    rows = [tuple(one.point.parameters[name] for name in AXES)]
    for mu in mus:
        rows.append(parameters_at(chosen, one.flow, rows[-1], complex(mu)))
    return np.array(rows)


def _joined(parts: Sequence[Floats]) -> Floats:
    """Join curves with a gap between them."""
    gap = np.full((1, 2), np.nan)
    return np.concatenate([rows for part in parts for rows in (part, gap)] or [gap])


def _stacked(parts: Sequence[Floats]) -> Floats:
    return np.array(parts, dtype=np.float32).astype(np.float64)


def _periodic(one: Unfolded, part: str) -> Floats:
    """Return the periodic points of every sector, at most eight."""
    found = np.full((len(one.sectors), 8), np.nan)
    for row, sector in zip(found, one.sectors, strict=True):
        row[: len(sector.periodic)] = getattr(sector.periodic, part)
    return found
