"""The part of the report on section 4: normal forms, and circles predicted and simulated."""

from __future__ import annotations

import math

from vibroimpact.plotting.page import Block, Cell, Table, Text
from vibroimpact_papers.impact_damper.circles import Circle, Measured
from vibroimpact_papers.impact_damper.findings import Findings, Pictures
from vibroimpact_papers.impact_damper.judge_circles import circle_here


def circle_blocks(found: Findings, pictures: Pictures) -> list[Block]:
    """Return the section of the report."""
    return [
        Text(
            (
                "Where a pair of multipliers leaves the unit circle, the normal form of section 4 "
                "says what is born: a circle that attracts or repels, on which side of the "
                "critical frequency, how large, and how fast the states turn on it. Its "
                "coefficients were computed from exact derivatives, by two routes that share "
                "only those and the eigenvectors: without a basis on the half map, and by the "
                "paper's own route, with its appendix corrected, on the half and the full map.",
                "The prediction is the first term of a series in the distance from the critical "
                "frequency. So the error of the predicted radius must fall in proportion to the "
                "distance, and it does. A circle that attracts is reached from two starts. The one "
                "that repels lies between what falls to the fixed point and what grows, and was "
                "found by bisection.",
            )
        ),
        *pictures.figure(
            "circles", "Circles predicted and simulated",
            "One row for each Neimark-Sacker point. Left: half-width of the circle in the place "
            "and the velocity of the main mass; lines are predicted, marks simulated. Middle: by "
            "what share the predicted radius is wrong. Right: the circles themselves, lines "
            "predicted, dots simulated.",
            "Size of the circles over the distance from the critical frequency, its error, and "
            "the circles in the section",
        ),
        _forms(found.circles),
        _as_printed(found.circles),
        _sizes(found.circles),
        _warnings(found.circles),
    ]  # fmt: skip


def point_record(m: Measured) -> dict[str, object]:
    """Return one critical point as plain data."""
    point, form = m.point, m.point.form
    return {
        "set": point.set,
        "omega": point.omega,
        "nu": [form.multiplier.real, form.multiplier.imag],
        "d": [form.d.real, form.d.imag],
        "supercritical": form.supercritical,
        "attracting": form.attracting,
        "side": form.side,
        "twist": form.twist,
        "growth": form.kappa.real,
        "resonance": f"{form.resonance.p}/{form.resonance.q}",
        "resonance_distance_degrees": abs(math.degrees(form.resonance.angle)),
        "warnings": list(form.warnings),
        "f1_half_map": point.f1,
        "f1_full_map": point.f1_full,
        "f1_full_map_printed_39": point.f1_printed,
        "f1_full_map_all_printed": list(point.f1_all_printed),
        "order_of_radius": m.order,
        "lemma_1": circle_here(m).value,
        "circles": [_circle_record(m, c) for c in m.circles],
    }


def _circle_record(m: Measured, c: Circle) -> dict[str, object]:
    form = m.point.form
    return {
        "start": c.start,
        "omega_minus_critical": c.dp,
        "status": c.status,
        "radius": c.radius,
        "predicted_radius": form.radius(c.dp),
        "turn": c.turn,
        "predicted_turn": form.turn(c.dp),
        "half_width_x1_v1": c.half_width[:2],
        "predicted_half_width_x1_v1": form.amplitude(c.dp)[:2],
        "impacts_waited": c.impacts,
    }


def _forms(circles: tuple[Measured, ...]) -> Table:
    head = ("set, ω_c", "angle of ν, resonance, away", "d", "circle", "twist", "f₁ half map",
            "f₁ full map", "lemma 1 here")  # fmt: skip
    rows: list[list[Cell]] = []
    for m in circles:
        p, form = m.point, m.point.form
        near = form.resonance
        born = "supercritical, attracting" if form.supercritical else "subcritical, repelling"
        side = "above" if form.side > 0 else "below"
        away = abs(math.degrees(near.angle))
        rows.append([
            f"{p.set} {p.omega:.9f}",
            f"{math.degrees(form.angle):.4f}°, {near.p}/{near.q}, {away:.3f}°",
            f"{form.d.real:.8g} {form.d.imag:+.8g}i", f"{born}, {side} ω_c", f"{form.twist:.5f}",
            f"{p.f1:.9g}", f"{p.f1_full:.9g}", circle_here(m).badge,
        ])  # fmt: skip
    caption = (
        "Normal form z → ν z (1 + d |z|²) of the half map, eigenvector of length one. f₁ is minus "
        "the real part of d on the half map and twice that on the full map."
    )
    return Table(head, rows, caption=caption, stacked=True)


def _as_printed(circles: tuple[Measured, ...]) -> Table:
    rows: list[list[Cell]] = []
    for m in circles:
        p, (low, high) = m.point, m.point.f1_all_printed
        rows.append([
            p.name, f"{p.f1_full:.6g}", f"{p.f1_printed:.6g}", f"{low:.4g} to {high:.4g}",
            "right" if (p.f1_printed > 0) == (p.f1_full > 0) else "wrong",
        ])  # fmt: skip
    head = ("set, ω_c", "f₁ full map", "with (39) as printed", "(39) and appendix as printed",
            "sign as printed")  # fmt: skip
    caption = (
        "What the printed formulas give for the full map, the paper's. With the signs of (A7) and "
        "(A10) as printed, f₁ depends on the phase of the eigenvector, which is free: its range "
        "is shown. The third derivatives in (A6) and (A7) are over two variables and cannot be "
        "evaluated; second ones were taken."
    )
    return Table(head, rows, caption=caption, stacked=True)


def _sizes(circles: tuple[Measured, ...]) -> Table:
    head = (
        *("set, ω_c", "ω − ω_c", "start", "radius of z, predicted", "simulated", "error"),
        *("half-width x₁", "simulated", "half-width v₁", "simulated", "turn", "simulated"),
    )
    rows = [_size_row(m, c) for m in circles for c in m.circles]
    caption = "Predicted and simulated circles. Turn: degrees per half period."
    return Table(head, rows, caption=caption)


def _size_row(m: Measured, c: Circle) -> list[Cell]:
    form = m.point.form
    predicted, width = form.radius(c.dp), form.amplitude(c.dp)
    if not math.isfinite(c.radius):
        return [m.point.name, f"{c.dp:+.3e}", c.start, f"{predicted:.6f}", c.status, *[""] * 7]
    return [
        m.point.name, f"{c.dp:+.3e}", c.start, f"{predicted:.6f}", f"{c.radius:.6f}",
        f"{abs(c.radius / predicted - 1.0):.1e}",
        f"{width[0]:.5f}", f"{c.half_width[0]:.5f}", f"{width[1]:.5f}", f"{c.half_width[1]:.5f}",
        f"{math.degrees(form.turn(c.dp)):.5f}", f"{math.degrees(c.turn):.5f}",
    ]  # fmt: skip


def _warnings(circles: tuple[Measured, ...]) -> Text:
    """Return warnings of strong resonances, and the choice of the distances."""
    warned = [
        f"Set {m.point.set}, ω_c = {m.point.omega:.6f}: {sentence} The circles above stay within "
        f"{abs(m.main[0].dp):.1e} of ω_c."
        for m in circles
        for sentence in m.point.form.warnings
    ]
    rule = (
        "At each point the largest distance is that at which the predicted radius is a tenth of "
        "the one where a term that the normal form removes is as large as z; then it is halved "
        "repeatedly."
    )
    return Text((rule, *warned))
