"""Rules for the claims of section 4: the normal form, and the circle that it predicts.

Witnesses: the basis-free formula of the half map, which shares no formula with the appendix, and
the circles that simulation finds at a geometric sequence of distances from each point. A prediction
to leading order must be wrong by a share that falls with the distance, by a power within `ORDER` of
the one that theory gives.
"""

from __future__ import annotations

import math

from vibroimpact_papers.impact_damper.circles import ALTERNATE, Measured
from vibroimpact_papers.impact_damper.evidence import Evidence
from vibroimpact_papers.judged import Claim, RuleResult, Word, listed, number, rule_result

ORDER = 0.25  # tolerance of a power: the next one is at least half a power away
RADIUS_ORDER, OFF_ORDER = 1.0, 1.5  # powers of the distance from the point
SAME_CIRCLE = 0.1  # of the error of the prediction: two starts lead to one circle
EXACT = 1e-3  # relative: a formula without printed digits holds if it holds within this


def invariant_circle(_: Claim, evidence: Evidence) -> RuleResult:
    """Search for the circle that the sign of f1 predicts, at every point."""
    words = {m.point.name: circle_here(m) for m in evidence.circles}
    return rule_result(
        _all(evidence, [word is Word.AGREES for word in words.values()]),
        listed((_found(m) for m in evidence.circles), "no point computed"),
        "simulation: circles of the predicted side and stability, whose radius differs from the "
        "prediction by a share that falls in proportion to the distance",
        points={name: word.value for name, word in words.items()},
        orders=[m.order for m in evidence.circles],
    )


def first_coefficient(claim: Claim, evidence: Evidence) -> RuleResult:
    """Compare f1 as printed with the coefficient that the circles confirm."""
    whole = claim.printed["formula"] == "appendix"
    pairs = [(m.point, _printed(m, whole)) for m in evidence.circles]
    return rule_result(
        _all(evidence, [max(abs(v / p.f1_full - 1.0) for v in values) <= EXACT
                        for p, values in pairs]),
        listed((f"{p.name}: f₁ {p.f1_full:.5g}, as printed {_interval(values)}"
                for p, values in pairs), "no point computed"),
        "-2 Re d of the half map, f₁ of the full map by the corrected formulas, and the simulated "
        "radius agree" + ("; over the phases of k₁ f₁ must not change" if whole else ""),
        f1=[p.f1_full for p, _ in pairs],
        printed=[list(values) for _, values in pairs],
    )  # fmt: skip


def stability_by_sign(_: Claim, evidence: Evidence) -> RuleResult:
    """Compare the sign of f1 as printed with simulation."""
    right = [(m.point.f1_printed > 0.0) == m.point.form.attracting for m in evidence.circles]
    return rule_result(
        _all(evidence, right),
        listed(
            (
                f"{m.point.name}: f₁ as printed {m.point.f1_printed:.3g}, the circle "
                f"{'attracts' if m.point.form.attracting else 'repels'}"
                for m in evidence.circles
            ),
            "no point computed",
        ),
        "simulation; with (39) corrected the sign is right at every point",
        right=right,
    )


def angle_term(claim: Claim, evidence: Evidence) -> RuleResult:
    """Measure the power of the radius with which the turn on the circle departs from theta."""
    powers = [m.turn_order for m in evidence.circles]
    return rule_result(
        _all(evidence, [abs(p - number(claim, "exponent")) <= ORDER for p in powers]),
        listed(
            (f"{m.point.name}: r^{p:.2f}" for m, p in zip(evidence.circles, powers, strict=True)),
            "no point computed",
        ),
        "turn per iterate of the simulated circles minus the angle of ν of the fixed point at the "
        "same ω, against the radius",
        powers=powers,
    )


def transversality(claim: Claim, evidence: Evidence) -> RuleResult:
    """Compare the sign of d|lambda| / d omega at every point."""
    slopes = [2.0 * m.point.form.kappa.real for m in evidence.circles]
    wanted = 1.0 if claim.printed["slope"] == "positive" else -1.0
    return rule_result(
        _all(evidence, [slope * wanted > 0.0 for slope in slopes]),
        listed(
            (f"{m.point.name}: {s:+.4g}" for m, s in zip(evidence.circles, slopes, strict=True)),
            "no point computed",
        ),
        "exact derivative along the branch; where it is negative the circle lies below the point, "
        "and v must be -ω",
        slopes=slopes,
    )


def centre_manifold(_: Claim, evidence: Evidence) -> RuleResult:
    """Measure the distance of the circles from the two-dimensional manifold."""
    powers = [m.off_order for m in evidence.circles]
    return rule_result(
        _all(evidence, [abs(p - OFF_ORDER) <= ORDER for p in powers]),
        listed(
            (
                f"{m.point.name}: at most {m.main[-1].off:.1e} off, falling as |ω − ω_c|^{p:.2f}"
                for m, p in zip(evidence.circles, powers, strict=True)
            ),
            "no point computed",
        ),
        "distance of simulated states from the manifold to second order, which must fall with the "
        "power 3/2",
        powers=powers,
    )


def circle_here(m: Measured) -> Word:
    """Judge the lemma at one point."""
    form = m.point.form
    if any(c.status != ALTERNATE for c in m.circles):
        return Word.UNDECIDED
    starts = zip(m.main, m.independent, m.errors, strict=False)  # none independent if it repels
    same = all(abs(a.radius / b.radius - 1.0) <= SAME_CIRCLE * error for a, b, error in starts)
    dies_out = m.other_side < 1.0
    right_size = abs(m.order - RADIUS_ORDER) <= ORDER
    holds = same and right_size and dies_out == form.supercritical == (m.point.f1 > 0.0)
    return Word.AGREES if holds else Word.DIFFERS


def _all(evidence: Evidence, holds: list[bool]) -> bool | None:
    unknown = any(c.status != ALTERNATE for m in evidence.circles for c in m.circles)
    return None if unknown or not holds else all(holds)


def _found(m: Measured) -> str:
    form, last = m.point.form, m.main[-1]
    what = "attracts" if form.attracting else "repels"
    side = "above" if form.side > 0 else "below"
    error = abs(last.radius / form.radius(last.dp) - 1.0)
    return (
        f"{m.point.name}: f₁ {m.point.f1_full:.4g}, circle {what} {side} ω_c; radius within "
        f"{error:.1e} at {abs(last.dp):.1e}, error falls as |ω − ω_c|^{m.order:.2f}"
    )


def _printed(m: Measured, whole: bool) -> tuple[float, ...]:
    return m.point.f1_all_printed if whole else (m.point.f1_printed,)


def _interval(values: tuple[float, ...]) -> str:
    return " to ".join(f"{v:.5g}" for v in values if math.isfinite(v))
