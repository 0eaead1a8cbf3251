"""Portraits around the resonances 1:4 of set A: prediction against simulation."""

from __future__ import annotations

import cmath
import math
from functools import cache

import numpy as np
import pytest
from support.bifurcations import torus_of_set_a
from vibroimpact_papers.impact_damper import figures, parameter_sets, unfolding
from vibroimpact_papers.impact_damper.plan import Plan
from vibroimpact_papers.impact_damper.unfolding import Sector, Unfolded, unfolded

import vibroimpact as vi

SET = parameter_sets()["A"]


def resonance(omega: float) -> vi.CodimensionTwoPoint:
    points = [p for p in torus_of_set_a().special_points if p.kind == "R4"]
    return min(points, key=lambda p: abs(p.parameters["omega"] - omega))


@cache
def around(omega: float) -> Unfolded:
    return unfolded(SET, resonance(omega))


def last(rows: np.ndarray) -> np.ndarray:
    return np.abs(rows[:, -1])


def sector(one: Unfolded, number: int) -> Sector:
    return one.sectors[number - 1]


def test_parameters_of_a_sector_give_its_multiplier() -> None:
    for s in around(0.978).sectors:
        assert unfolding.mu_at(SET, s.omega, s.half_clearance) == pytest.approx(s.mu, abs=1e-11)


def test_where_the_fixed_point_is_stable_every_motion_shrinks_to_it() -> None:
    s = sector(around(0.978), 1)
    assert s.mu.real < 0.0
    assert last(s.predicted).max() < 0.01
    assert last(s.simulated).max() < 0.01


def test_outside_the_folds_motions_settle_on_a_circle_of_the_predicted_size() -> None:
    for number in (2, 4):
        s = sector(around(0.978), number)
        assert not len(s.period_four)
        for rows in (s.predicted, s.simulated):
            assert last(rows).min() > 0.1
        sizes = [np.median(last(rows)) for rows in (s.predicted, s.simulated)]
        assert sizes[1] == pytest.approx(sizes[0], rel=0.1)


def test_between_the_folds_motions_settle_on_the_larger_orbit_of_period_four() -> None:
    s = sector(around(0.978), 3)
    node = s.period_four[-4:]  # the smaller orbit is the saddle
    for rows, error in ((s.predicted, 1e-3), (s.simulated, 0.1)):
        away = np.abs(rows[:, -1][:, None] - node).min(axis=1)
        assert away.max() < error * abs(node[0])


def test_error_of_the_predicted_orbit_falls_with_its_size(monkeypatch: pytest.MonkeyPatch) -> None:
    point = resonance(0.978)
    errors = []
    for size in (0.002, 0.0005):  # |z| is halved
        monkeypatch.setattr(unfolding, "SIZE", size)
        form = point.normal_form
        words, argument = unfolding.sectors(form)[2]
        s = unfolding._sector(SET, point, form, words, argument)
        errors.append(np.median(last(s.simulated)) / abs(s.period_four[-1]) - 1.0)
    assert abs(errors[1]) < 0.6 * abs(errors[0])


def test_below_modulus_one_motions_leave_in_the_middle_and_end_on_a_distant_2_2_2() -> None:
    one = around(0.928)
    assert not one.folds
    s = sector(one, 3)
    assert np.isnan(s.predicted[:, -1]).all()  # the first terms send them away
    ends = last(s.simulated)
    assert np.nanmin(ends) > 3.0 * abs(s.period_four[0])


def test_computed_folds_begin_along_the_predicted_half_lines() -> None:
    one = around(0.978)
    assert len(one.folds) == 2
    taken = set()
    for fold in one.folds:
        mus = np.array([unfolding.mu_at(SET, *v) for v in fold.values])
        near = mus[np.argsort(np.abs(mus))[:5]]
        turns = [abs(cmath.phase(near[0] / d)) for d in one.form.fold_directions]
        taken.add(int(np.argmin(turns)))
        assert min(turns) < math.radians(3.0)
    assert taken == {0, 1}


def test_figure_shows_the_trajectories_of_its_file() -> None:
    data = unfolding.unfolding_data(around(0.928), 2, SET, Plan())
    figure = figures.redraw(data)
    assert len(figure.axes) == 1 + 2 * len(around(0.928).sectors)
    drawn = sum(np.isfinite(line.get_xdata()).sum() for line in figure.axes[1].lines[:3])
    assert drawn == np.isfinite(data["predicted_real"].values[0]).sum()
