"""Rules for what the paper says of strong resonance, by the true resonances in two parameters.

Witnesses: the strong resonances on the Neimark-Sacker curve of each set in the plane
(omega, half_clearance), with the coefficients of their normal forms, and the invariant circles
followed along the frequency with their normal multipliers.
"""

from __future__ import annotations

import math
from collections.abc import Mapping

from vibroimpact.branches.point import BifurcationPoint
from vibroimpact.normal_forms import CodimensionTwo
from vibroimpact_papers.impact_damper.evidence import Evidence
from vibroimpact_papers.impact_damper.resonances import Resonances, nearest_by_angle
from vibroimpact_papers.judged import Claim, RuleResult, listed, number, rule_result

NOT_COMPUTED = "curves in two parameters were not computed"
STRONG_HALF = {1: ("R1", "R2"), 2: ("R4",), 3: ("R3",), 4: ("R4",)}
# A strong resonance of the half map at which lambda = nu^2 has lambda^m = 1, by the least such m.
QUARTER = 4  # iterates of the half map until an orbit born at 1:4 repeats: two periods


def near_resonance(claim: Claim, evidence: Evidence) -> RuleResult:
    """Decide whether a set is near a strong resonance: whether its normal form warns of one."""
    found = evidence.resonances.get(claim.set)
    points = [m.point for m in evidence.circles if m.point.set == claim.set]
    if found is None or not points:
        return rule_result(None, "not computed", NOT_COMPUTED)
    kinds = STRONG_HALF[int(number(claim, "exponent"))]
    true = [p for p in found.strong if p.kind in kinds]
    warned = [p.name for p in points if p.form.warnings]
    angles = listed(f"ω = {p.omega:.6f}: ν at {math.degrees(p.form.angle):.2f}°" for p in points)
    return rule_result(
        bool(warned),
        f"{angles}; {_where(true, found)}",
        "continuation of the Neimark-Sacker curve in both parameters: a strong resonance is near "
        "if the normal form of a computed point warns of it; "
        f"{'it does at ' + listed(warned) if warned else 'none does'}",
        points=[dict(p.parameters) for p in true],
        angle_range=list(found.angles),
    )


def _where(true: list[BifurcationPoint], found: Resonances) -> str:
    low, high = found.angles
    if true:
        return "true point" + ("s" if len(true) > 1 else "") + " at (ω, δ) = " + listed(
            "({:.6f}, {:.6f})".format(*p.parameters.values()) for p in true
        )  # fmt: skip
    return f"no such point in the plane: ν stays within {low:.2f}° to {high:.2f}° on the curve"


def born_at_resonance(claim: Claim, evidence: Evidence) -> RuleResult:
    """Compare a motion that a strong resonance is said to give with what theory gives there."""
    forms = _quarter_points(evidence.resonances)
    if not forms:
        return rule_result(None, "not computed", NOT_COMPUTED)
    points = listed(
        f"{name} ({p.parameters['omega']:.6f}, {p.parameters['half_clearance']:.6f}): "
        f"|A| = {abs(form.scaled):.4f}, Re A = {form.scaled.real:.4f}"
        for name, p, form in forms
    )
    numbers = {"A": [[f.scaled.real, f.scaled.imag] for _, _, f in forms]}
    if claim.printed["type"] == "quasiperiodic":
        return rule_result(
            any(f.scaled.real < 0.0 and f.others_inside for _, _, f in forms),
            points,
            "normal form at every 1:4 of the half map: with Re A < 0 the circle attracts",
            **numbers,
        )
    periods = QUARTER // 2
    return rule_result(
        claim.printed["n"] == periods,
        f"period {periods}: {periods}-{periods}-{periods}; {points}",
        "λ⁴ = 1 is strong only at ν = ±i, where orbits of four half periods are born; 4-4-4 takes "
        "eight, so ν at 45° or 135°: 1:8 or 3:8, which are weak",
        **numbers,
    )


def _quarter_points(
    found: Mapping[str, Resonances],
) -> list[tuple[str, BifurcationPoint, CodimensionTwo]]:
    """Return every 1:4 of the half map with its set and its normal form."""
    quarter = ((name, p) for name, one in found.items() for p in one.strong if p.kind == "R4")
    every = ((name, p, p.normal_form) for name, p in quarter)
    return [(name, p, form) for name, p, form in every if isinstance(form, CodimensionTwo)]


def comparison(_: Claim, evidence: Evidence) -> RuleResult:
    """Say why sets of which none is resonant cannot be compared as resonant and not."""
    found = evidence.resonances
    if not found or not evidence.circles:
        return rule_result(None, "not computed", NOT_COMPUTED)
    near = {m.point.name: m.point.form.resonance.angle for m in evidence.circles
            if m.point.form.warnings}  # fmt: skip
    away = {
        m.point.name: nearest_by_angle(math.degrees(m.point.form.angle))[1]
        for m in evidence.circles
    }
    words = listed(f"{name}: {degrees:.2f}°" for name, degrees in away.items())
    return rule_result(
        None,
        f"ν from the nearest strong resonance: {words}",
        "no set is at a strong resonance, and near one are only "
        f"{listed(near)}, of the set that the paper calls nonresonant: its sets do not compare "
        "the cases",
        degrees=away,
    )


def torus_doubling(claim: Claim, evidence: Evidence) -> RuleResult:
    """Search the computed circles of a set for a doubling before they break."""
    family = evidence.families.get(claim.set)
    if family is None:
        return rule_result(None, "not computed", "circles were not followed")
    low, high = family.span
    doubled = [e for e in family.branch.special_points if e.kind == "PD"]
    leading = family.leading
    least = float(leading.min())
    below = listed(
        f"ω = {circle.system.omega:.10g}: {circle.status}"  # type: ignore[union-attr]
        for circle in family.at_panels.values()
        if not circle.converged and circle.system.omega < low  # type: ignore[union-attr]
    )
    return rule_result(
        bool(doubled),
        f"circles for ω in [{low:.6f}, {high:.6f}]: leading normal multiplier between {least:.4f} "
        f"and {float(leading.max()):.4f}, {len(doubled)} doublings. Below: {below}",
        "invariant circles as functions of their phase, with exact derivatives: a torus doubles "
        "where a normal multiplier passes −1",
        least_multiplier=least,
        least_angle=float(family.least_angles.min()),
        from_omega=low,
    )
