"""The rule by which each sort of claim is judged."""

from __future__ import annotations

from collections.abc import Callable, Mapping

from vibroimpact._core.errors import InvalidParameterError
from vibroimpact_papers.impact_damper import judge_circles as circles
from vibroimpact_papers.impact_damper import judge_motions as motions
from vibroimpact_papers.impact_damper import judge_numbers as rules
from vibroimpact_papers.impact_damper import judge_resonances as resonances
from vibroimpact_papers.impact_damper.evidence import Evidence
from vibroimpact_papers.judged import Claim, Judgement, RuleResult

Rule = Callable[[Claim, Evidence], RuleResult]


def _trend(claim: Claim, evidence: Evidence) -> RuleResult:
    """Judge a trend; without panels, by the comparison along omega."""
    rule = motions.trend if claim.panels else motions.instability
    return rule(claim, evidence)


RULES: Mapping[str, Rule] = {
    "orbit_count": rules.orbit_count,
    "flight_time": rules.flight_time,
    "existence": rules.existence,
    "neimark_sacker_omega": rules.neimark_sacker_omega,
    "crossing_direction": rules.crossing_direction,
    "crossing_count": rules.crossing_count,
    "multipliers": rules.multipliers,
    "modulus": rules.modulus,
    "inside": rules.inside,
    "resonance": rules.resonance,
    "near_resonance": resonances.near_resonance,
    "at_resonance": resonances.born_at_resonance,
    "comparison": resonances.comparison,
    "torus_doubling": resonances.torus_doubling,
    "multiplier_point": rules.multiplier_point,
    "multiplier_character": rules.multiplier_character,
    "stability_interval": rules.stability_interval,
    "invariant_circle": circles.invariant_circle,
    "first_coefficient": circles.first_coefficient,
    "stability_by_sign": circles.stability_by_sign,
    "angle_term": circles.angle_term,
    "transversality": circles.transversality,
    "centre_manifold": circles.centre_manifold,
    "attractor_type": motions.attractor_type,
    "no_attractor": motions.no_attractor,
    "trend": _trend,
    "impacts": motions.impacts,
    "route": motions.route,
}


def judge(evidence: Evidence) -> tuple[Judgement, ...]:
    """Judge every claim of the evidence by the rule of its kind.

    Raises
    ------
    InvalidParameterError
        A claim of a kind that has no rule.
    """
    return tuple(Judgement(claim, _rule(claim)(claim, evidence)) for claim in evidence.claims)


def _rule(claim: Claim) -> Rule:
    if claim.kind not in RULES:
        raise InvalidParameterError(
            f"claims.toml, {claim.id}: kind = {claim.kind!r}: must be one of {', '.join(RULES)}."
        )
    return RULES[claim.kind]
