"""Every claim gets one verdict, and verdicts follow the numbers."""

from __future__ import annotations

import json
from dataclasses import replace
from types import MappingProxyType, SimpleNamespace
from typing import TYPE_CHECKING, Any

import pytest
from vibroimpact_papers.impact_damper import claims, parameter_sets
from vibroimpact_papers.impact_damper.evidence import Evidence
from vibroimpact_papers.impact_damper.judge_motions import matches
from vibroimpact_papers.impact_damper.plan import damper_of
from vibroimpact_papers.impact_damper.symmetric_bifurcations import symmetric_bifurcations
from vibroimpact_papers.impact_damper.verdicts import RULES, judge
from vibroimpact_papers.judged import Claim, Word, to_json

from vibroimpact import InvalidParameterError
from vibroimpact.attractors.orbit_type import OrbitType
from vibroimpact.attractors.point_sets import Kind

if TYPE_CHECKING:
    from collections.abc import Callable

SPAN = {"A": (0.92, 1.02), "B": (0.94, 1.02), "C": (0.42, 0.44)}
Change = dict[str, Any]


def evidence(chosen: tuple[Claim, ...] | None = None, **change: float) -> Evidence:
    """Evidence without simulated panels, of sets with some parameters changed."""
    sets = {
        name: replace(s, parameters=replace(s.parameters, **change))
        for name, s in parameter_sets().items()
    }
    points = {
        name: symmetric_bifurcations(damper_of(s, SPAN[name][1]), SPAN[name])
        for name, s in sets.items()
    }
    return Evidence(sets, chosen or claims(), points, {})


@pytest.fixture(scope="module")
def paper() -> Evidence:
    return evidence()


def only(name: str, given: Evidence) -> Any:
    claim = next(c for c in given.claims if c.id == name)
    return judge(replace(given, claims=tuple(c for c in given.claims if c is claim)))[0]


def with_printed(name: str, given: Evidence, **change: object) -> Evidence:
    def edited(c: Claim) -> Claim:
        return replace(c, printed=MappingProxyType({**c.printed, **change})) if c.id == name else c

    return replace(given, claims=tuple(map(edited, given.claims)))  # type: ignore[arg-type]


def test_every_claim_has_exactly_one_verdict(paper: Evidence) -> None:
    judged = judge(paper)
    assert [j.claim.id for j in judged] == [c.id for c in claims()]
    assert len({j.claim.id for j in judged}) == len(judged)
    assert all(j.result.witness and j.result.computed for j in judged)


def test_every_kind_of_claim_has_a_rule() -> None:
    assert {c.kind for c in claims()} == set(RULES)


def test_unknown_kind_is_refused(paper: Evidence) -> None:
    strange = replace(claims()[0], kind="colour")
    with pytest.raises(InvalidParameterError, match="colour"):
        judge(replace(paper, claims=(strange,)))


def test_without_panels_types_cannot_be_decided(paper: Evidence) -> None:
    assert only("a-caption-2g", paper).verdict is Word.UNDECIDED


def test_printed_frequency_agrees_when_it_is_the_computed_one(paper: Evidence) -> None:
    assert only("a-critical-omega", paper).verdict is Word.DIFFERS
    true = round(paper.crossings("A")[-1].omega, 5)
    assert only(
        "a-critical-omega", with_printed("a-critical-omega", paper, omega=true)
    ).verdict is (Word.AGREES)


def test_one_unit_in_the_last_digit_differs(paper: Evidence) -> None:
    close = round(paper.crossings("A")[-1].omega, 5) + 1e-5
    changed = with_printed("a-critical-omega", paper, omega=close)
    assert only("a-critical-omega", changed).verdict is Word.DIFFERS


def test_printed_multipliers_agree_when_they_are_the_computed_ones(paper: Evidence) -> None:
    orbit = paper.branch("A", 0.99176)
    assert orbit is not None
    z = orbit.multipliers[0]
    right = with_printed(
        "a-lambda-12", paper, real=round(z.real, 7), imaginary=round(abs(z.imag), 7)
    )
    assert only("a-lambda-12", paper).verdict is Word.DIFFERS
    assert only("a-lambda-12", right).verdict is Word.AGREES


def test_witness_of_multipliers_is_the_determinant_identity(paper: Evidence) -> None:
    witness = next(j for j in judge(paper) if j.claim.id == "a-lambda-12").result.witness
    assert "0.3080" in witness
    assert "0.1698" in witness


@pytest.mark.slow
def test_restitution_moves_the_verdicts(paper: Evidence) -> None:
    changed = evidence(restitution=0.75)
    assert [b.omega for b in changed.crossings("A")] != [b.omega for b in paper.crossings("A")]
    before = {j.claim.id: j.verdict for j in judge(paper)}
    after = {j.claim.id: j.verdict for j in judge(changed)}
    assert before != after


@pytest.mark.parametrize(
    ("name", "change"),
    [
        ("s3-two-orbits", {"maximum": 3}),
        ("s3-equal-flights", {"ratio": 1.001}),
        ("a-one-crossing", {"count": 2}),
        ("b-direction", {"omega": "sideways"}),
        ("a-stable-interval", {"low": 1.0}),
        ("c-two-pairs", {"pairs": 1}),
        ("a-resonance-case", {"case": "strong"}),
    ],
)
def test_changed_claim_changes_the_verdict(paper: Evidence, name: str, change: Change) -> None:
    before = only(name, paper).verdict
    assert only(name, with_printed(name, paper, **change)).verdict is not before


def attractor(kind: Kind, numbers: tuple[int, int, int] | None, **shape: Any) -> Any:
    given = {"pieces": 1, "curve": None} | shape
    kinds = OrbitType(*numbers) if numbers else None
    return SimpleNamespace(kind=kind, type=kinds, shape=SimpleNamespace(**given))


ONE = attractor(Kind.PERIODIC, (1, 1, 1))
FOUR = attractor(Kind.PERIODIC, (4, 4, 4))
CIRCLE = attractor(Kind.QUASIPERIODIC, None, curve=SimpleNamespace(turns=1))
TWO_CIRCLES = attractor(Kind.QUASIPERIODIC, None, pieces=2, curve=SimpleNamespace(turns=1))
DOUBLE = attractor(Kind.QUASIPERIODIC, None, curve=SimpleNamespace(turns=2))
CHAOS = attractor(Kind.CHAOTIC, None)
ALL = (ONE, FOUR, CIRCLE, TWO_CIRCLES, DOUBLE, CHAOS)


@pytest.mark.parametrize(
    ("kind", "printed", "fits"),
    [
        ("fixed_point", {"n": 1, "p": 1, "q": 1}, (ONE,)),
        ("periodic", {"n": 4, "p": 4, "q": 4}, (FOUR,)),
        ("phase_locked", {}, (FOUR,)),
        ("quasiperiodic", {}, (CIRCLE, TWO_CIRCLES, DOUBLE)),
        ("quasiperiodic", {"curves": 1}, (CIRCLE, DOUBLE)),
        ("quasiperiodic", {"curves": 4}, ()),
        ("torus_doubled", {}, (TWO_CIRCLES, DOUBLE)),
        ("break_of_circle", {}, (FOUR, CHAOS)),
        ("chaotic", {}, (CHAOS,)),
    ],
)
def test_vocabulary_of_types(kind: str, printed: Change, fits: tuple[Any, ...]) -> None:
    test: Callable[[Any], bool] = lambda a: matches(kind, printed, a)  # noqa: E731
    assert [test(a) for a in ALL] == [a in fits for a in ALL]


def test_json_is_plain_and_complete(paper: Evidence) -> None:
    judged = judge(paper)
    content = json.loads(to_json(judged, plan={"step": float("nan")}))
    assert sum(content["count"].values()) == len(content["verdicts"]) == len(claims())
    assert {v["verdict"] for v in content["verdicts"]} <= {word.value for word in Word}
    assert content["plan"]["step"] == "nan"
