"""Statements of publications, judged: printed, computed, agrees or differs or cannot be decided, and why."""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from enum import Enum
from pathlib import Path

import numpy as np

from vibroimpact._core.errors import InvalidParameterError
from vibroimpact.plotting.page import Badge

Printed = float | int | str | bool | list[float] | list[str]
"""A printed value."""


class Word(Enum):
    """The three verdicts; the value is shown to the reader, the sign repeats it without colour."""

    AGREES = "agrees"
    DIFFERS = "differs"
    UNDECIDED = "cannot be decided"

    @property
    def badge(self) -> Badge:
        """The verdict on a page, with a sign that is seen in black and white."""
        sign = {"agrees": "\u2713", "differs": "\u2717", "cannot be decided": "?"}[self.value]
        return Badge(f"{sign} {self.value}", self.name.lower())


@dataclass(frozen=True, slots=True, kw_only=True)
class Claim:
    """One statement of a publication; `printed` holds its numbers and types, by name.

    Attributes
    ----------
    id
        Name of the statement, unique in its publication.
    section
        Where it stands: a section, "abstract", "Fig. 3".
    quote
        Its words, at most 15.
    printed
        Its numbers and types.
    notes
        How it is read.
    set, kind, panels, omega, start, contradicts
        Of the founding paper: parameter set, sort, panels, frequency, start, other statements that it denies.
    """

    id: str
    section: str
    quote: str
    printed: Mapping[str, Printed]
    notes: str = field(default="", repr=False)
    set: str = ""
    kind: str = ""
    panels: tuple[str, ...] = ()
    omega: float | None = None
    start: str = ""
    contradicts: tuple[str, ...] = ()


@dataclass(frozen=True)
class RuleResult:
    """Result of a rule: verdict, computed value in words, and the deciding witness."""

    word: Word
    computed: str
    witness: str
    numbers: dict[str, object] = field(default_factory=dict)


def rule_result(holds: bool | None, computed: str, witness: str, **numbers: object) -> RuleResult:
    """Return the result of a rule; None means that it cannot be decided."""
    word = {True: Word.AGREES, False: Word.DIFFERS, None: Word.UNDECIDED}[holds]
    return RuleResult(word, computed, witness, numbers)


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


def score(judgements: tuple[Judgement, ...]) -> dict[Word, int]:
    """Count the verdicts."""
    return {word: sum(j.verdict is word for j in judgements) for word in Word}


@dataclass(frozen=True)
class Summary:
    """Written files, and the number of verdicts of each sort."""

    out: Path
    judgements: tuple[Judgement, ...]

    @property
    def score(self) -> Mapping[Word, int]:
        """Return the number of verdicts of each sort."""
        return score(self.judgements)


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


def _word(value: object) -> str:
    if isinstance(value, list):
        return " \u2192 ".join(map(_word, value)) if value and isinstance(value[0], str) else (
            ", ".join(map(_word, value))
        )  # fmt: skip
    if isinstance(value, bool):
        return "yes" if value else "no"
    return str(value).replace("_", " ")


def number(claim: Claim, key: str) -> float:
    """Read a printed number."""
    value = claim.printed[key]
    if isinstance(value, bool) or not isinstance(value, (int, float)):
        raise InvalidParameterError(f"claim {claim.id}: {key} = {value!r}: must be a number.")
    return float(value)


def numbers(claim: Claim, key: str) -> list[float]:
    """Read a printed list of numbers."""
    value = claim.printed[key]
    if not isinstance(value, list):
        raise InvalidParameterError(f"claim {claim.id}: {key} = {value!r}: must be a list.")
    return [float(entry) for entry in value]


def half_unit(decimals: float) -> float:
    """Return half a unit of the last printed digit."""
    return float(0.5 * 10.0**-decimals)


def listed(items: Iterable[str], nothing: str = "none") -> str:
    """Join items, or say that there are none."""
    return "; ".join(items) or nothing
