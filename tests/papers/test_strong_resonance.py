"""True strong resonances of the paper's sets, against scalar equations of the closed form."""

from __future__ import annotations

import math
from dataclasses import replace
from functools import cache
from types import MappingProxyType

import numpy as np
import pytest
from vibroimpact_papers.impact_damper import claims, parameter_sets
from vibroimpact_papers.impact_damper.judge_resonances import (
    born_at_resonance,
    comparison,
    near_resonance,
    torus_doubling,
)
from vibroimpact_papers.impact_damper.judged import Evidence
from vibroimpact_papers.impact_damper.plan import Plan, damper_of
from vibroimpact_papers.impact_damper.resonances import (
    Resonances,
    distances,
    orbit_at,
    resonances_of,
)
from vibroimpact_papers.report import Word

import vibroimpact as vi

SETS = parameter_sets()
SMALL = Plan(strong=MappingProxyType({"A": (0.91, 1.05)}), strong_points=(4, 4), plane_settle=20.0)


@cache
def of_a() -> Resonances:
    return resonances_of(SETS["A"], SMALL)


def claim(name: str, **printed: object) -> object:
    found = next(c for c in claims() if c.id == name)
    return replace(found, printed=MappingProxyType({**found.printed, **printed}))


def evidence(found: Resonances | None) -> Evidence:
    return Evidence(SETS, claims(), {}, {}, resonances={found.set: found} if found else {})


def test_at_both_resonances_of_set_a_the_closed_form_has_multipliers_i() -> None:
    assert [p.kind for p in of_a().strong] == ["R4", "R4"]
    assert [of_a().named("R4", omega) for omega in (0.928, 0.978)] == [*of_a().strong]
    for p in of_a().strong:
        nu = orbit_at(SETS["A"], *p.parameters.values()).half_multipliers
        assert np.abs(nu - 1j).min() < 1e-9
        assert np.abs(nu**2 + 1.0).min() < 1e-9  # the full map has -1: no root of order four


def test_set_a_which_the_paper_calls_nonresonant_is_nearest_to_a_strong_resonance() -> None:
    span = (0.92, 1.02)
    points = vi.symmetric_bifurcations(damper_of(SETS["A"], span[1]), span)
    rows = distances(of_a(), SETS["A"], claims(), points)
    assert [d.what for d in rows] == ["printed", "computed", "computed"]
    lower = rows[1]
    assert lower.nearest is not None
    assert lower.in_omega == pytest.approx(-0.004091774, abs=1e-8)
    assert lower.in_clearance == pytest.approx(0.071506970, abs=1e-8)
    assert lower.by_angle[0] == "R4"
    assert lower.by_angle[1] == pytest.approx(0.334782, abs=1e-6)
    assert lower.relative == min(d.relative for d in rows)


def test_folds_of_period_four_are_born_at_one_resonance_of_set_a_and_not_at_the_other() -> None:
    moduli = {round(p.parameters["omega"], 6): abs(p.normal_form.scaled) for p in of_a().strong}
    assert moduli[0.978148] == pytest.approx(1.966387, abs=1e-6)
    assert moduli[0.927754] == pytest.approx(0.238523, abs=1e-6)


def test_period_four_of_a_strong_resonance_is_2_2_2_in_theory_and_in_the_plane() -> None:
    four = born_at_resonance(claim("s6-periodic"), evidence(of_a()))  # type: ignore[arg-type]
    two = born_at_resonance(claim("s6-periodic", n=2), evidence(of_a()))  # type: ignore[arg-type]
    assert (four.word, two.word) == (Word.DIFFERS, Word.AGREES)
    damper = replace(damper_of(SETS["A"], 0.95), half_clearance=5.2)  # between both resonances
    found = vi.classify(damper, vi.State((0.0, 0.0), (0.0, 1.0)))
    assert str(found.type) == "2-2-2"


def test_circles_attract_at_the_resonances() -> None:
    found = born_at_resonance(claim("s6-quasiperiodic"), evidence(of_a()))  # type: ignore[arg-type]
    assert found.word is Word.AGREES


@pytest.mark.parametrize(
    ("rule", "name"),
    [
        (near_resonance, "b-strong-case"),
        (born_at_resonance, "s6-periodic"),
        (comparison, "s6-more-complicated"),
        (torus_doubling, "s6-route"),
    ],
)
def test_without_curves_nothing_is_decided(rule: object, name: str) -> None:
    assert rule(claim(name), evidence(None)).word is Word.UNDECIDED  # type: ignore[operator]


def test_angle_of_a_pair_is_that_of_the_closed_form() -> None:
    low, high = of_a().angles
    assert low < 90.0 < high
    assert math.isfinite(low + high)
