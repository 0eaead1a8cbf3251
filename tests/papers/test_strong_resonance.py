"""True strong resonances of the paper's sets, against scalar equations of the closed form."""

from __future__ import annotations

import math
from dataclasses import replace
from functools import cache
from types import MappingProxyType

import numpy as np
import pytest
from vibroimpact_papers.impact_damper import claims, figures, parameter_sets
from vibroimpact_papers.impact_damper.evidence import Evidence
from vibroimpact_papers.impact_damper.judge_resonances import (
    born_at_resonance,
    comparison,
    near_resonance,
    torus_doubling,
)
from vibroimpact_papers.impact_damper.plan import Plan, damper_of
from vibroimpact_papers.impact_damper.resonances import (
    Resonances,
    distances,
    orbit_at,
    resonance_data,
    resonances_of,
    tongues_from,
)
from vibroimpact_papers.impact_damper.symmetric_bifurcations import nus_of, symmetric_bifurcations
from vibroimpact_papers.judged import Word

import vibroimpact as vi
from vibroimpact.results.files import result_of

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


@pytest.mark.slow
def test_at_both_resonances_of_set_a_the_closed_form_has_multipliers_i() -> None:
    assert [p.kind for p in of_a().strong] == ["R4", "R4"]
    assert [of_a().named("R4", omega) for omega in (0.928, 0.978)] == [*of_a().strong]
    for p in of_a().strong:
        nu = nus_of(orbit_at(SETS["A"], *p.parameters.values()))
        assert np.abs(nu - 1j).min() < 1e-9
        assert np.abs(nu**2 + 1.0).min() < 1e-9  # the full map has -1: no root of order four


@pytest.mark.slow
def test_set_a_which_the_paper_calls_nonresonant_is_nearest_to_a_strong_resonance() -> None:
    span = (0.92, 1.02)
    points = symmetric_bifurcations(damper_of(SETS["A"], span[1]), span)
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


# ---- tongues ---------------------------------------------------------------------------------


@cache
def of_b() -> Resonances:
    plan = Plan(
        strong=MappingProxyType({"B": (0.93, 1.03)}), strong_points=(60, 12), plane_settle=400.0,
        tongues=MappingProxyType({"B": ((1, 5), (3, 7))}),
    )  # fmt: skip
    return resonances_of(SETS["B"], plan)


@pytest.mark.slow
def test_the_tongue_1_5_of_set_b_has_two_tips_and_orbits_5_5_5_between_its_sides() -> None:
    found = of_b()
    (one,) = found.tongues  # 3/7 does not occur
    assert one.resonance == (1, 5)
    weak = [p for c in found.torus for p in c.special_points if p.resonance == (1, 5)]
    assert len(weak) == 2
    assert [p.label for p in weak if p is not one.tip] == [p.label for p in found.other_tips(one)]
    for side in one.sides:
        assert side.orbit(len(side) // 2).symbol == "5-5-5"
    between = found.between_sides(one)
    motion = found.plane["motion"]
    share = between.count("5-5-5") / len(between)
    assert share > 10.0 * _count(found, "5-5-5") / motion.size > 0.0


def _count(found: Resonances, name: str) -> int:
    motion = found.plane["motion"]
    codes = dict(
        zip(motion.attrs["flag_meanings"].split(), motion.attrs["flag_values"], strict=True)
    )
    return int((motion.values == codes[name]).sum())


@pytest.mark.slow
def test_the_figure_shows_the_tongues_of_its_files() -> None:
    found = of_b()
    data = resonance_data(found, SETS["B"], Plan(), claims())
    sides = [part for part in data if "tongue" in part.attrs]
    assert [part.attrs["tongue"] for part in sides] == ["1/5_1", "1/5_1"]
    curves = [result_of(p) for p in data[1:] if "tongue" not in p.attrs]
    for one, again in zip(found.tongues, tongues_from(curves, sides), strict=True):
        assert again.tip.parameters == one.tip.parameters
        for a, b in zip(one.sides, again.sides, strict=True):
            np.testing.assert_array_equal(a.values, b.values)
    ax = figures.redraw(data).axes[0]
    hatched = [patch for patch in ax.patches if patch.get_hatch()]
    assert len(hatched) == len(found.tongues)
