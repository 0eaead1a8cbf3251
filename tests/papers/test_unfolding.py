"""Portraits around the resonances 1:4 of sets A and C and 1:3 of C: prediction against simulation."""

from __future__ import annotations

import cmath
import math
from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from support.bifurcations import torus_of_set_a, torus_of_set_c
from vibroimpact_papers.impact_damper import figures, parameter_sets, unfolding
from vibroimpact_papers.impact_damper.plan import Plan
from vibroimpact_papers.impact_damper.unfolding import Sector, Unfolded, unfolded
from vibroimpact_papers.impact_damper.unfolding_flows import (
    CUBE_ROOT,
    STABLE_BETWEEN,
    FourFlow,
    ThreeFlow,
    solutions,
)

import vibroimpact as vi
from vibroimpact.normal_forms import fold_directions

SET = parameter_sets()["A"]


def resonance(omega: float) -> vi.BifurcationPoint:
    points = [p for p in torus_of_set_a().special_points if p.kind == "R4"]
    return min(points, key=lambda p: abs(p.parameters["omega"] - omega))


@cache
def around(omega: float) -> Unfolded:
    return unfolded(SET, resonance(omega))


def last(rows: np.ndarray) -> np.ndarray:
    return np.abs(rows[:, -1])


def sector(one: Unfolded, number: int) -> Sector:
    return one.sectors[number - 1]


@pytest.mark.slow
def test_parameters_of_a_sector_give_its_multiplier() -> None:
    one = around(0.978)
    for s in one.sectors:
        mu = unfolding.mu_at(SET, one.flow, s.omega, s.half_clearance)
        assert mu == pytest.approx(s.mu, abs=1e-11)


def test_where_the_fixed_point_is_stable_every_motion_shrinks_to_it() -> None:
    s = sector(around(0.978), 1)
    assert s.mu.real < 0.0
    assert last(s.predicted).max() < 0.01
    assert last(s.simulated).max() < 0.01


def test_outside_the_folds_motions_settle_on_a_circle_of_the_predicted_size() -> None:
    for number in (2, 4):
        s = sector(around(0.978), number)
        assert not len(s.periodic)
        for rows in (s.predicted, s.simulated):
            assert last(rows).min() > 0.1
        sizes = [np.median(last(rows)) for rows in (s.predicted, s.simulated)]
        assert sizes[1] == pytest.approx(sizes[0], rel=0.1)


def test_between_the_folds_motions_settle_on_the_larger_orbit_of_period_four() -> None:
    s = sector(around(0.978), 3)
    node = s.periodic[-4:]  # the smaller orbit is the saddle
    for rows, error in ((s.predicted, 1e-3), (s.simulated, 0.1)):
        away = np.abs(rows[:, -1][:, None] - node).min(axis=1)
        assert away.max() < error * abs(node[0])


def test_error_of_the_predicted_orbit_falls_with_its_size(monkeypatch: pytest.MonkeyPatch) -> None:
    point = resonance(0.978)
    errors = []
    for size in (0.002, 0.0005):  # |z| is halved
        monkeypatch.setattr(FourFlow, "size", size)
        flow = FourFlow(point.normal_form)
        s = unfolding._sector(SET, list(point.parameters.values()), flow, flow.places()[2])
        errors.append(np.median(last(s.simulated)) / abs(s.periodic[-1]) - 1.0)
    assert abs(errors[1]) < 0.6 * abs(errors[0])


def test_below_modulus_one_motions_leave_in_the_middle_and_end_on_a_distant_2_2_2() -> None:
    one = around(0.928)
    assert not one.born
    s = sector(one, 3)
    assert np.isnan(s.predicted[:, -1]).all()  # the first terms send them away
    ends = last(s.simulated)
    assert np.nanmin(ends) > 3.0 * abs(s.periodic[0])


def test_computed_folds_begin_along_the_predicted_half_lines() -> None:
    one = around(0.978)
    assert len(one.born) == 2
    taken = set()
    for fold in one.born:
        mus = np.array([unfolding.mu_at(SET, one.flow, *v) for v in fold])
        near = mus[np.argsort(np.abs(mus))[:5]]
        turns = [abs(cmath.phase(near[0] / d)) for d in fold_directions(one.flow.form)]
        taken.add(int(np.argmin(turns)))
        assert min(turns) < math.radians(3.0)
    assert taken == {0, 1}


@pytest.mark.slow
def test_figure_shows_the_trajectories_of_its_file() -> None:
    data = unfolding.unfolding_data(around(0.928), 2, SET, Plan())
    figure = figures.redraw(data)
    assert len(figure.axes) == 1 + 2 * len(around(0.928).sectors)
    drawn = sum(np.isfinite(line.get_xdata()).sum() for line in figure.axes[1].lines[:3])
    assert drawn == np.isfinite(data["predicted_real"].values[0]).sum()


# ---- set C -----------------------------------------------------------------------------------


@cache
def around_in_c(label: str) -> Unfolded:
    return unfolded(parameter_sets()["C"], torus_of_set_c()[label])


def three_flow(cubic: complex) -> ThreeFlow:
    """A flow with b = 1 and a given coefficient c'."""
    form = around_in_c("R3_1").flow.form
    return ThreeFlow(replace(form, numbers={"b": 1.0 + 0j, "c": CUBE_ROOT * (cubic + 1.0)}))


@pytest.mark.slow
def test_every_sector_between_neimark_sacker_and_fold_lines_has_a_portrait() -> None:
    # set C: one fold line lies on the stable side
    words = [s.words for s in around_in_c("R4_1").sectors]
    assert words == [
        "fixed point stable",
        "unstable, outside the folds",
        "unstable, between the folds",
        STABLE_BETWEEN,
    ]
    for s in around_in_c("R4_1").sectors:
        stable, between = s.mu.real < 0.0, "between" in s.words
        assert len(s.periodic) == (8 if between else 0)
        assert stable == ("unstable" not in s.words)


def test_two_motions_attract_between_the_folds_where_the_fixed_point_is_stable() -> None:
    s = sector(around_in_c("R4_1"), 4)
    node = abs(s.periodic[-1])
    for rows, error in ((s.predicted, 0.02), (s.simulated, 0.1)):
        ends, starts = last(rows), np.abs(rows[:, 0])
        inner = starts < 0.2 * starts.max()
        assert (ends[inner] < starts[inner]).all()
        assert np.abs(ends / node - 1.0).min() < error


@pytest.mark.parametrize(
    ("number", "stays"), [(1, True), (2, True), (3, False), (4, True)], ids=lambda v: str(v)
)
def test_next_to_a_resonance_1_3_motions_stay_where_theory_says(number: int, stays: bool) -> None:
    s = sector(around_in_c("R3_1"), number)
    saddle = abs(s.periodic[0])
    for rows in (s.predicted, s.simulated):
        ends = last(rows)[np.abs(rows[:, 0]) < 0.5 * saddle]
        assert len(ends) == 12
        if stays:
            assert ends.max() < saddle
        else:
            assert np.isnan(ends).all()


@pytest.mark.slow
def test_the_damper_moves_less_at_the_predicted_saddle_the_nearer_the_resonance(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    chosen, point = parameter_sets()["C"], torus_of_set_c()["R3_1"]
    moved = []
    for size in (0.03, 0.0075):  # |z| is quartered
        monkeypatch.setattr(ThreeFlow, "size", size)
        flow = ThreeFlow(point.normal_form)
        errors = []
        for place in flow.places():
            z = flow.periodic(place.mu)
            np.testing.assert_allclose(np.abs(flow.rate(place.mu, z)), 0.0, atol=1e-12)
            start = list(point.parameters.values())
            at = unfolding.parameters_at(chosen, flow, start, place.mu)
            half = unfolding.half_map(chosen, flow, *at)
            rows = unfolding.iterated(flow.form, half, complex(z[0]), 3, 2, math.inf)
            errors.append(abs(rows[1] - rows[0]) / abs(place.mu * z[0]))
        moved.append(max(errors))
    # relative to the terms that cancel, what is left is of order |mu|
    assert moved[0] < 1.5
    assert moved[1] < 0.4 * moved[0]


def test_time_one_map_of_the_flow_has_the_terms_of_the_normal_form_up_to_third_order() -> None:
    flow = around_in_c("R3_1").flow
    errors = []
    for size in (0.02, 0.01):
        z = size * np.exp(2j * np.pi * np.arange(12) / 12.0 + 0.1j)
        after = solutions(flow, 0j, z, 1.0, 2, math.inf)[:, 1]
        back = CUBE_ROOT.conjugate()
        wanted = z + back * (flow.form.b * z.conj() ** 2 + flow.form.c * z * np.abs(z) ** 2)
        errors.append(np.abs(after - wanted).max())
    assert errors[0] / errors[1] == pytest.approx(16.0, rel=0.1)  # fourth order is left


@pytest.mark.parametrize("imaginary", [0.04, -0.04])
@pytest.mark.slow
def test_a_circle_next_to_1_3_ends_where_mean_divergence_vanishes(imaginary: float) -> None:
    flow = three_flow(-1.0 + 0.3j)
    end = flow.end_of_circle(imaginary)
    assert end.real == pytest.approx(0.5 * imaginary**2)  # -Re c' / 2 in units of |b|
    kept = []
    for share in (0.8, 1.25):  # the next terms are of relative order |mu|
        mu = complex(share * end.real, imaginary)
        z = np.array([0.2 * abs(mu)], dtype=np.complex128)
        step, times = 2.0, 12.0 / mu.real
        rows = solutions(flow, mu, z, step, round(times / step), 3.0 * abs(mu))
        kept.append(bool(np.isfinite(rows[0, -1])))
    assert kept == [True, False]


@pytest.mark.slow
def test_figure_around_a_resonance_1_3_shows_the_end_of_the_circle() -> None:
    data = unfolding.unfolding_data(around_in_c("R3_1"), 4, parameter_sets()["C"], Plan())
    figure = figures.redraw(data)
    labels = [line.get_label() for line in figure.axes[0].lines]
    assert {"Neimark-Sacker", "end of the circle, predicted", "1:3"} <= set(labels)
    assert len(figure.axes) == 9
