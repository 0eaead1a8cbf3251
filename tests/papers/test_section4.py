"""Section 4 of the paper: normal forms by two routes, as printed, and their place in the report."""

from __future__ import annotations

import json
import math
from dataclasses import replace
from functools import cache
from types import MappingProxyType
from typing import Any

import numpy as np
import pytest
from support.circles import NAMES, SPAN, SUBCRITICAL, five_points, references
from vibroimpact_papers.impact_damper import (
    claims,
    datasets,
    figures,
    normal_form_residuals,
    parameter_sets,
)
from vibroimpact_papers.impact_damper.circles import ALTERNATE, Measured, measure
from vibroimpact_papers.impact_damper.evidence import Evidence
from vibroimpact_papers.impact_damper.judge_circles import circle_here
from vibroimpact_papers.impact_damper.normal_forms import Appendix, appendix
from vibroimpact_papers.impact_damper.plan import Plan
from vibroimpact_papers.impact_damper.story_circles import point_record
from vibroimpact_papers.impact_damper.symmetric_bifurcations import symmetric_bifurcations
from vibroimpact_papers.impact_damper.verdicts import judge
from vibroimpact_papers.judged import Word, plain

from vibroimpact.orbits.maps import full_map, half_map
from vibroimpact.plotting import plot_circles

EVERY = pytest.mark.parametrize("name", NAMES)
FEW = Plan(circle_offsets=4, circle_settle=5.0, circle_points=1200)
# rounding 1e-16 times |p| and the divisors of d, together below 1e4, and the point's own 1e-12
COEFFICIENT = 1e-9
REORDERED = [1, 0, 2, 3]  # (v1, x1, v2, theta) of the reference to (x1, v1, v2, theta)


@cache
def circles() -> tuple[Measured, ...]:
    return tuple(measure(point, FEW) for point in five_points().values())


@cache
def evidence() -> Evidence:
    sets = parameter_sets()
    points = {n: symmetric_bifurcations(s.damper(SPAN[n][1]), SPAN[n]) for n, s in sets.items()}
    of_section = tuple(c for c in claims() if c.section == "4")
    return Evidence(sets, of_section, points, {}, circles())


def number(pair: list[str]) -> complex:
    return complex(float(pair[0]), float(pair[1]))


# Normal forms


@EVERY
def test_normal_form_is_that_of_the_reference(name: str) -> None:
    point, row = five_points()[name], references()[name]
    form = point.form
    assert abs(point.omega - float(row["omega"])) < 1e-12
    assert abs(form.multiplier - number(row["nu"])) < 1e-11
    assert abs(form.d / number(row["d"]) - 1.0) < COEFFICIENT
    assert form.twist == pytest.approx(float(row["ratio"]), rel=COEFFICIENT)
    assert form.kappa.real == pytest.approx(float(row["growth"]), rel=COEFFICIENT)
    assert form.kappa.imag == pytest.approx(float(row["turning"]), rel=COEFFICIENT)
    assert form.supercritical is row["supercritical"]
    squared = float(row["squared_radius"])
    assert form.side == math.copysign(1.0, squared)
    assert form.radius(1e-4 * form.side) ** 2 == pytest.approx(1e-4 * abs(squared), rel=COEFFICIENT)
    moduli = np.array([float(m) for m in row["q_moduli"]])[REORDERED]
    assert np.max(np.abs(np.abs(form.q) - moduli)) < COEFFICIENT


@EVERY
def test_both_routes_agree_on_the_half_map_and_on_the_full_map(name: str) -> None:
    point, row = five_points()[name], references()[name]
    assert point.f1 == pytest.approx(-point.form.d.real, rel=COEFFICIENT)
    assert point.f1_full == pytest.approx(-2.0 * point.form.d.real, rel=COEFFICIENT)
    assert point.f1_full == pytest.approx(-float(row["d_full"][0]), rel=COEFFICIENT)


# As printed


def appendix_of(name: str, *, half: bool = False) -> Appendix:
    orbit = five_points()[name].bifurcation.orbit
    return appendix(half_map(orbit) if half else full_map(orbit))


@EVERY
@pytest.mark.parametrize("half", [True, False])
def test_corrected_appendix_gives_f1_whatever_the_phase_of_k1(name: str, half: bool) -> None:
    point, given = five_points()[name], appendix_of(name, half=half)
    right = point.f1 if half else point.f1_full
    for phase in (0.0, 0.7, 2.5):
        f1 = given.turned(phase).f1(power=2)
        assert f1 == pytest.approx(right, rel=COEFFICIENT)


@EVERY
def test_printed_39_is_another_number_and_printed_signs_depend_on_the_phase(name: str) -> None:
    point = five_points()[name]
    assert abs(point.f1_printed / point.f1_full - 1.0) > 1.0
    low, high = point.f1_all_printed
    assert high - low > 0.1 * abs(high)
    turned = appendix_of(name).turned(1.0).f1(power=1)
    assert turned == pytest.approx(point.f1_printed, rel=COEFFICIENT)


def test_printed_39_calls_the_repelling_circle_attracting() -> None:
    wrong = [name for name in NAMES if (p := five_points()[name]).f1_printed * p.f1_full < 0.0]
    assert wrong == [SUBCRITICAL]


@pytest.mark.parametrize("power", [1, 2])
def test_misprint_list_and_section_4_evaluate_one_formula(power: int) -> None:
    """On a planar map with a planted coefficient, both leave the same residual."""
    p = normal_form_residuals.planted_map()
    lam, none = normal_form_residuals.ROTATION, np.empty(0)
    planar = Appendix(lam, 2 * p[2, 0], p[1, 1], 2 * p[0, 2], 2 * p[2, 1], none + 0j, none + 0j,
                      none, none + 0j, np.empty((0, 0)))  # fmt: skip
    planted = -(lam.conjugate() * normal_form_residuals.CUBIC).real
    residual = abs(planar.f1(power=power) - planted)
    assert residual == pytest.approx(normal_form_residuals.first_coefficient(power), abs=1e-14)


def test_misprint_list_and_section_4_have_the_same_printed_signs() -> None:
    """On coefficients planted in a quadratic map."""
    r = normal_form_residuals
    planted = replace(
        appendix_of("C 0.4289"),
        G10=np.array([r.G10]),
        G01=np.array([r.G01]),
        H02=np.array([r.H20.conjugate()]),
    )
    printed = planted.with_printed_signs()
    by_sign = r.g01(-1, third_derivatives=False)
    assert abs(printed.G01[0] - r.G01) == pytest.approx(by_sign, abs=1e-14)
    assert abs(printed.H02[0] - planted.H02[0]) == pytest.approx(r.h02(-1), abs=1e-14)


# Verdicts


def verdict(name: str, given: Evidence, **printed: object) -> Word:
    def edited(c: Any) -> Any:
        return replace(c, printed=MappingProxyType({**c.printed, **printed}))

    chosen = tuple(edited(c) for c in given.claims if c.id == name)
    return judge(replace(given, claims=chosen))[0].verdict


@pytest.mark.parametrize(
    ("name", "word"),
    [
        ("s4-transversality", Word.DIFFERS),
        ("s4-centre-manifold", Word.AGREES),
        ("s4-angle", Word.DIFFERS),
        ("s4-circle", Word.AGREES),
        ("s4-first-coefficient", Word.DIFFERS),
        ("s4-sign", Word.DIFFERS),
        ("s4-appendix", Word.DIFFERS),
    ],
)
def test_verdict_on_each_statement_of_section_4(name: str, word: Word) -> None:
    assert verdict(name, evidence()) is word


def test_every_statement_of_section_4_is_judged_at_every_point() -> None:
    for j in judge(evidence()):
        assert all(name in j.result.computed for name in NAMES), j.claim.id
        assert j.result.witness


def test_without_circles_nothing_is_decided() -> None:
    bare = replace(evidence(), circles=())
    assert {j.verdict for j in judge(bare)} == {Word.UNDECIDED}


def test_right_power_of_the_radius_agrees() -> None:
    assert verdict("s4-angle", evidence(), exponent=2) is Word.AGREES


def with_form(m: Measured, **change: Any) -> Measured:
    return replace(m, point=replace(m.point, form=replace(m.point.form, **change)))


def test_lemma_differs_where_the_coefficient_is_wrong_or_the_circle_is_on_the_other_side() -> None:
    m = circles()[1]
    assert circle_here(m) is Word.AGREES
    assert circle_here(with_form(m, d=1.1 * m.point.form.d)) is Word.DIFFERS
    assert circle_here(replace(m, other_side=2.0)) is Word.DIFFERS
    lost = replace(m, circles=(replace(m.circles[0], status="lost"), *m.circles[1:]))
    assert circle_here(lost) is Word.UNDECIDED


# Records, data, pictures


def test_record_of_each_point_is_plain_and_complete() -> None:
    for m in circles():
        row = json.loads(json.dumps(plain(point_record(m)), allow_nan=False))
        assert row["lemma_1"] == "agrees"
        assert {"set", "omega", "nu", "d", "supercritical", "side", "twist", "warnings"} <= set(row)
        assert {c["status"] for c in row["circles"]} == {ALTERNATE}
        assert len(row["circles"]) == 4 * (2 if m.point.form.attracting else 1)


def test_warning_stands_at_the_point_next_to_the_strong_resonance() -> None:
    warned = [m.point.name for m in circles() if m.point.form.warnings]
    assert warned == ["A 0.9318"]


def test_data_hold_what_was_predicted_and_what_was_measured() -> None:
    m = circles()[0]
    data = datasets.circle_data(parameter_sets()["A"], FEW, m)
    first = m.main[0]
    assert data["radius"].sel(start="prediction", offset=first.dp) == first.radius
    assert data["predicted_radius"].values[0] == m.point.form.radius(first.dp)
    assert np.array_equal(data["points"].values[0], first.points[: data.sizes["point"]])
    assert data.attrs["d_real"] == m.point.form.d.real
    assert "1:4" in data.attrs["warnings"]


def test_figure_shows_the_numbers_of_its_data() -> None:
    sets = parameter_sets()
    parts = tuple(datasets.circle_data(sets[m.point.set], FEW, m) for m in circles())
    figure = figures.redraw(parts)
    assert len(figure.axes) == 3 * len(parts)
    for data, ax in zip(parts, figure.axes[::3], strict=True):
        line, mark = ax.lines[0], ax.lines[1]
        assert np.array_equal(
            line.get_ydata(), data["predicted_half_width"].sel(coordinate="x1").values
        )
        assert np.array_equal(mark.get_ydata(), data["half_width"].sel(coordinate="x1").values[0])


def test_circles_are_drawn_closed() -> None:
    m = circles()[1]
    data = datasets.circle_data(parameter_sets()["A"], FEW, m)
    ax = plot_circles(data)
    x = np.asarray(ax.lines[1].get_xdata())
    assert x[0] == x[-1]
    assert len(x) == data.sizes["phase_of_z"] + 1
