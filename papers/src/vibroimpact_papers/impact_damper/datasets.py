"""Data of every figure, as xarray datasets with their origin in the attributes.

Points of sections are kept in contiguous ragged form: `row_size` is the number of points of each
panel and start, in order.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict
from fractions import Fraction

import numpy as np
import xarray as xr

from vibroimpact import _kernel
from vibroimpact.orbits.symmetric_damper import symmetric_orbits
from vibroimpact.simulation.simulate import Run
from vibroimpact_papers.impact_damper import ParameterSet
from vibroimpact_papers.impact_damper.circles import Measured
from vibroimpact_papers.impact_damper.panel_results import Followed, PanelResult
from vibroimpact_papers.impact_damper.plan import Plan, damper_of
from vibroimpact_papers.impact_damper.symmetric_bifurcations import (
    RESONANCE_ORDER,
    Bifurcation,
    nus_of,
)

SECTION = ("x1", "v1", "v2", "theta")  # coordinates of the half map
CIRCLE_POINTS = 600  # of a simulated circle kept for a picture

Attributes = dict[str, str | int | float]


def attributes(figure: str, chosen: ParameterSet, plan: Plan) -> Attributes:
    """Return the attributes of every file."""
    return {
        "figure": figure,
        "set": chosen.name,
        **asdict(chosen.parameters),
        "force": 1.0,
        **plan.attributes(),
        "random_numbers": "none",
        "package": "vibroimpact",
        "version": _kernel.version(),
    }


def panel_data(
    figure: str, chosen: ParameterSet, plan: Plan, results: Sequence[PanelResult]
) -> xr.Dataset:
    """Return the section points of every panel of a figure, from every start."""
    found = [f for result in results for f in result.found]
    group = [next(i for i, g in enumerate(r.distinct) if f in g) for r in results for f in r.found]
    points = np.concatenate([f.points for f in found])
    exponents = [f.attractor.exponent for f in found]
    rotation = [r.value if (r := f.attractor.rotation) else np.nan for f in found]
    names = [r.panel.name for r in results for _ in r.found]
    omegas = [r.omega for r in results for _ in r.found]
    return xr.Dataset(
        {
            "x1": ("point", points[:, 0]),
            "v1": ("point", points[:, 1]),
            "row_size": ("row", [len(f.points) for f in found]),
            "panel": ("row", names),
            "omega": ("row", omegas),
            "start": ("row", [f.start for f in found]),
            "attractor": ("row", group),
            "name": ("row", [f.attractor.name for f in found]),
            "label": ("row", [f.attractor.label for f in found]),
            "transient_impacts": ("row", [f.attractor.transient for f in found]),
            "exponent": ("row", [e.value for e in exponents]),
            "exponent_error": ("row", [e.error for e in exponents]),
            "rotation": ("row", rotation),
        },
        attrs=attributes(figure, chosen, plan),
    )


def diagram_data(chosen: ParameterSet, plan: Plan, followed: Followed) -> xr.Dataset:
    """Return the sections along omega in both directions; short sections end in NaN."""
    ways = {"down": followed.down, "up": followed.up}
    shape = (len(ways), len(followed.omega), plan.sweep_points)
    x1, v1 = np.full(shape, np.nan), np.full(shape, np.nan)
    for i, steps in enumerate(ways.values()):
        for j, step in enumerate(steps):
            count = len(step.section)
            x1[i, j, :count], v1[i, j, :count] = step.section.x1, step.section.v1
    dims = ("direction", "omega", "point")
    return xr.Dataset(
        {"x1": (dims, x1), "v1": (dims, v1)},
        coords={"direction": list(ways), "omega": followed.omega},
        attrs=attributes(f"diagram-{chosen.name}", chosen, plan) | {"start": repr(followed.start)},
    )


def multiplier_data(chosen: ParameterSet, plan: Plan) -> xr.Dataset:
    """Return the half multipliers nu of both signs along omega; lambda = nu^2."""
    low, high = _path_range(chosen, plan)
    omega = np.linspace(low, high, plan.path_points)
    nu = np.full((2, omega.size, 4), np.nan, dtype=complex)
    admissible = np.zeros((2, omega.size), dtype=np.int8)
    for j, w in enumerate(omega):
        for i, orbit in enumerate(symmetric_orbits(damper_of(chosen, float(w)))):
            nu[i, j], admissible[i, j] = nus_of(orbit), orbit.admissible
    dims = ("sign", "omega", "multiplier")
    return xr.Dataset(
        {
            "nu_real": (dims, nu.real),
            "nu_imag": (dims, nu.imag),
            "admissible": (dims[:2], admissible),
        },
        coords={"sign": [1, -1], "omega": omega},
        attrs=attributes(f"multipliers-{chosen.name}", chosen, plan),
    )


def _path_range(chosen: ParameterSet, plan: Plan) -> tuple[float, float]:
    """Return the range of Fig. 3; for a set without such a panel that of the sweep."""
    if "3" in chosen.figures:
        return chosen.omega_range
    return plan.sweeps[chosen.name].low, plan.sweeps[chosen.name].high


def bifurcation_data(chosen: ParameterSet, plan: Plan, points: Sequence[Bifurcation]) -> xr.Dataset:
    """Return every bifurcation of the symmetric orbits of a set."""

    def near(b: Bifurcation) -> tuple[int, int, float]:
        return nearest_resonance(b.angle)

    row = "row"
    return xr.Dataset(
        {
            "kind": (row, [b.kind for b in points]),
            "omega": (row, [b.omega for b in points]),
            "sign": (row, [b.sign for b in points]),
            "nu_real": (row, [b.half_multiplier.real for b in points]),
            "nu_imag": (row, [b.half_multiplier.imag for b in points]),
            "angle_nu_degrees": (row, [b.half_angle for b in points]),
            "angle_lambda_degrees": (row, [b.angle for b in points]),
            "resonance": (row, ["{}/{}".format(*b.resonance) for b in points]),
            "resonance_distance_degrees": (row, [b.resonance_distance for b in points]),
            "resonance_of_lambda": (row, ["{}/{}".format(*near(b)[:2]) for b in points]),
            "resonance_of_lambda_distance_degrees": (row, [near(b)[2] for b in points]),
            "crossing": (row, [b.crossing for b in points]),
            "admissible": (row, np.array([b.admissible for b in points], dtype=np.int8)),
            "inadmissible_reason": (row, [b.orbit.inadmissible_reason for b in points]),
        },
        attrs=attributes("none", chosen, plan),
    )


def circle_data(chosen: ParameterSet, plan: Plan, measured: Measured) -> xr.Dataset:
    """Return the predicted and the simulated circles next to one Neimark-Sacker point.

    Points are states just after the impact at stop A minus the critical one, of the first start.
    """
    point, form = measured.point, measured.point.form
    dp = np.array([c.dp for c in measured.main])
    starts = list(dict.fromkeys(c.start for c in measured.circles))
    shape = (len(starts), len(dp))
    radius, turn, impacts = (np.full(shape, np.nan) for _ in range(3))
    width = np.full((*shape, len(SECTION)), np.nan)
    for c in measured.circles:
        at = starts.index(c.start), int(np.flatnonzero(dp == c.dp)[0])
        radius[at], turn[at], width[at], impacts[at] = c.radius, c.turn, c.half_width, c.impacts
    by_start, by_point = ("start", "offset"), ("offset", "point", "coordinate")
    kept = min(CIRCLE_POINTS, *(len(c.points) for c in measured.main))
    return xr.Dataset(
        {
            "omega": ("offset", point.omega + dp),
            "predicted_radius": ("offset", [form.radius(d) for d in dp]),
            "predicted_turn": ("offset", [form.turn(d) for d in dp]),
            "predicted_half_width": (("offset", "coordinate"), [form.amplitude(d) for d in dp]),
            "predicted_points": (
                ("offset", "phase_of_z", "coordinate"), [form.circle(d) for d in dp],
            ),
            "radius": (by_start, radius),
            "turn": (by_start, turn),
            "half_width": ((*by_start, "coordinate"), width),
            "impacts_waited": (by_start, impacts),
            "off_manifold": ("offset", [c.off for c in measured.main]),
            "points": (by_point, [c.points[:kept] for c in measured.main]),
        },
        coords={"offset": dp, "start": starts, "coordinate": list(SECTION)},
        attrs=attributes(f"circles-{point.name.replace(' ', '-')}", chosen, plan)
        | _form_attributes(measured),
    )  # fmt: skip


def _form_attributes(measured: Measured) -> Attributes:
    """Return the numbers of the normal form."""
    point, form = measured.point, measured.point.form
    return {
        "omega_critical": point.omega,
        "nu_real": form.multiplier.real,
        "nu_imag": form.multiplier.imag,
        "d_real": form.d.real,
        "d_imag": form.d.imag,
        "growth": form.kappa.real,
        "turning": form.kappa.imag,
        "twist": form.twist,
        "side": form.side,
        "attracting": int(form.attracting),
        "f1_half_map": point.f1,
        "f1_full_map": point.f1_full,
        "f1_full_map_printed": point.f1_printed,
        "order_of_radius": measured.order,
        "warnings": " ".join(form.warnings) or "none",
    }


def nearest_resonance(degrees: float) -> tuple[int, int, float]:
    """Return (p, q, distance in degrees) of the root of one nearest to an angle, q <= 12."""
    turn = abs(degrees) / 360.0
    nearest = Fraction(turn).limit_denominator(RESONANCE_ORDER)
    return nearest.numerator, nearest.denominator, 360.0 * abs(turn - float(nearest))


def run_data(figure: str, chosen: ParameterSet, plan: Plan, run: Run, impacts: int) -> xr.Dataset:
    """Return the record of a run, with its start as numbers so that it can be repeated."""
    data = run.to_dataset()
    start = {
        "start_position": list(run.start.position),
        "start_velocity": list(run.start.velocity),
        "start_phase": run.start.phase,
    }
    data.attrs |= attributes(figure, chosen, plan)
    data.attrs |= start | {"omega": run.system.omega, "impacts": impacts}  # type: ignore[union-attr]
    return data
