"""Verdicts on the claims: printed, computed, agrees or differs or cannot be decided, and why."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np

from vibroimpact._core.errors import InvalidParameterError
from vibroimpact_papers.impact_damper import Claim
from vibroimpact_papers.impact_damper import judge_circles as circles
from vibroimpact_papers.impact_damper import judge_motions as motions
from vibroimpact_papers.impact_damper import judge_numbers as rules
from vibroimpact_papers.impact_damper import judge_resonances as resonances
from vibroimpact_papers.impact_damper.judged import Evidence, RuleResult, Word

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


@dataclass(frozen=True, slots=True)
class Judgement:
    """A claim with its verdict."""

    claim: Claim
    result: RuleResult

    @property
    def verdict(self) -> Word:
        """Return the verdict."""
        return self.result.word

    @property
    def printed(self) -> str:
        """Return what is printed, in short."""
        return in_words(self.claim)

    def record(self) -> dict[str, object]:
        """Return the judgement as plain data."""
        claim = self.claim
        return {
            "id": claim.id,
            "section": claim.section,
            "set": claim.set,
            "kind": claim.kind,
            "panels": list(claim.panels),
            "omega": claim.omega,
            "quote": claim.quote,
            "printed": dict(claim.printed),
            "computed": self.result.computed,
            "numbers": plain(self.result.numbers),
            "verdict": self.verdict.value,
            "witness": self.result.witness,
            "contradicts": list(claim.contradicts),
        }


def judge(evidence: Evidence) -> tuple[Judgement, ...]:
    """Judge every claim of the evidence by the rule of its kind.

    Raises
    ------
    InvalidParameterError
        A claim of a kind that has no rule.
    """
    return tuple(Judgement(claim, _rule(claim)(claim, evidence)) for claim in evidence.claims)


def score(judgements: tuple[Judgement, ...]) -> dict[Word, int]:
    """Count the verdicts."""
    return {word: sum(j.verdict is word for j in judgements) for word in Word}


def in_words(claim: Claim) -> str:
    """Return the printed numbers and types of a claim in a short line."""
    printed = dict(claim.printed)
    if claim.kind == "multipliers":
        first, second = (int(d) for d in printed["decimals"])  # type: ignore[union-attr]
        return f"{printed['real']:.{first}f} \u00b1 {printed['imaginary']:.{second}f}i"
    if "type" in printed:
        return _type_in_words(printed)
    if claim.kind == "resonance" and "power_is_one" in printed:
        orders = printed.get("exponents") or [printed["exponent"]]
        relation = "=" if printed["power_is_one"] else "≠"
        return f"λᵐ {relation} 1, m = {', '.join(f'{m:g}' for m in orders)}"  # type: ignore[union-attr]
    shown = {k: v for k, v in printed.items() if k != "decimals"}
    return ", ".join(f"{_key(k)} {_word(v)}" for k, v in shown.items())


def _key(name: str) -> str:
    return name.replace("omega", "ω").replace("_", " ")


def _type_in_words(printed: Mapping[str, object]) -> str:
    """Return a type with its symbol n-p-q and number of curves."""
    words = str(printed["type"]).replace("_", " ")
    if {"n", "p", "q"} <= set(printed):
        words += " {n}-{p}-{q}".format(**printed)
    if "minimum_n" in printed:
        words += f", n \u2265 {printed['minimum_n']}"
    if "curves" in printed:
        words += f", {printed['curves']} closed curve{'s' if printed['curves'] != 1 else ''}"
    return words


def to_json(judgements: tuple[Judgement, ...], **more: object) -> str:
    """Return the whole set of verdicts as text."""
    content = {
        **more,
        "count": {word.value: n for word, n in score(judgements).items()},
        "verdicts": [j.record() for j in judgements],
    }
    return json.dumps(plain(content), indent=1, ensure_ascii=False, allow_nan=False) + "\n"


def plain(value: object) -> object:
    """Return plain numbers, strings, lists and dicts; non-finite numbers become strings."""
    if isinstance(value, Mapping):
        return {str(k): plain(v) for k, v in value.items()}
    if isinstance(value, (list, tuple, np.ndarray)):
        return [plain(v) for v in value]
    if isinstance(value, np.generic):
        return plain(value.item())
    if isinstance(value, float) and not np.isfinite(value):
        return str(value)
    return value


def _rule(claim: Claim) -> Rule:
    if claim.kind not in RULES:
        raise InvalidParameterError(
            f"claims.toml, {claim.id}: kind = {claim.kind!r}: must be one of {', '.join(RULES)}."
        )
    return RULES[claim.kind]


def _word(value: object) -> str:
    if isinstance(value, list):
        return " \u2192 ".join(map(_word, value)) if value and isinstance(value[0], str) else (
            ", ".join(map(_word, value))
        )  # fmt: skip
    if isinstance(value, bool):
        return "yes" if value else "no"
    return str(value).replace("_", " ")
