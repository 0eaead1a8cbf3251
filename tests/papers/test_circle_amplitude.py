"""Circles at the five Neimark-Sacker points: as large, as fast and where the normal form says."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from support.circles import NAMES, SUBCRITICAL, five_points
from vibroimpact_papers.impact_damper import circles
from vibroimpact_papers.impact_damper.circles import Measured, measure, observed_order, z_of
from vibroimpact_papers.impact_damper.plan import Plan

EVERY = pytest.mark.parametrize("name", NAMES)
ATTRACTING = [name for name in NAMES if name != SUBCRITICAL]

# At the largest distance the radius is a tenth of the one at which the normal form fails, and a
# correction of relative order r^2 changes the constant of an error by 20 per cent at most: at 1/8
# and 1/16 of it by 2.5 and 1.3, an order by 0.02. A wrong order is off by 0.5 or 1.
SLOPE = 0.05


@cache
def measured(name: str) -> Measured:
    return measure(five_points()[name], Plan())


@pytest.mark.slow
def test_the_five_points_are_those_of_the_paper() -> None:
    assert tuple(five_points()) == NAMES


@EVERY
@pytest.mark.slow
def test_every_start_ends_on_a_circle(name: str) -> None:
    assert {c.status for c in measured(name).circles} == {circles.ALTERNATE}


@EVERY
def test_error_of_the_radius_falls_in_proportion_to_the_distance(name: str) -> None:
    found = measured(name)
    assert found.order == pytest.approx(1.0, abs=SLOPE), found.errors
    # near 1:4 the constant is 600 and the distances are small in proportion: 6 per cent at most
    assert found.errors[0] < 0.06
    assert found.errors[-1] < 0.06 / 12.0


@EVERY
def test_error_of_the_turn_falls_with_the_square_of_the_distance(name: str) -> None:
    found = measured(name)
    form = found.point.form
    errors = [c.turn - form.turn(c.dp) for c in found.main]
    order = observed_order([c.dp for c in found.main], errors)
    # what is left of the start after 7 T moves |z| by exp(-7) of its error, and the turn with it
    assert order == pytest.approx(2.0, abs=SLOPE), errors


@EVERY
@pytest.mark.parametrize("coordinate", [0, 1])
def test_half_width_is_predicted(name: str, coordinate: int) -> None:
    found = measured(name)
    form = found.point.form
    errors = [c.half_width[coordinate] / form.amplitude(c.dp)[coordinate] - 1 for c in found.main]
    # a width has a correction of its own, of up to a third at the largest distance
    assert observed_order([c.dp for c in found.main], errors) == pytest.approx(
        1.0, abs=3 * SLOPE
    ), errors


@EVERY
def test_circle_lies_on_the_centre_manifold_to_second_order(name: str) -> None:
    # of the largest of four components, whose constants change like those of the widths
    assert measured(name).off_order == pytest.approx(1.5, abs=3 * SLOPE)


@EVERY
def test_turn_departs_from_the_multiplier_with_the_square_of_the_radius(name: str) -> None:
    found = measured(name)
    assert found.turn_order == pytest.approx(2.0, abs=2 * SLOPE)


@pytest.mark.parametrize("name", ATTRACTING)
def test_attracting_circle_is_reached_from_the_fixed_point_too(name: str) -> None:
    found = measured(name)
    assert found.point.form.attracting
    for a, b, error in zip(found.main, found.independent, found.errors, strict=True):
        # exp(-7) of the error of the start on the prediction is left
        assert abs(a.radius / b.radius - 1.0) < 2.0 * np.exp(-7.0) * error + 1e-8


@EVERY
def test_no_circle_attracts_on_the_other_side(name: str) -> None:
    found = measured(name)
    assert (found.other_side < 1.0) == found.point.form.supercritical
    assert np.isnan(found.point.form.radius(-found.main[0].dp))


def test_one_point_is_subcritical() -> None:
    repelling = [name for name in NAMES if not five_points()[name].form.supercritical]
    assert repelling == [SUBCRITICAL]


@pytest.mark.parametrize("k", [0, 2])
def test_repelling_circle_parts_what_falls_from_what_grows(k: int) -> None:
    found = measured(SUBCRITICAL)
    circle = found.main[k]
    share = circle.radius / found.point.form.radius(circle.dp)
    # |z| on the circle is not constant: 8 per cent is more than it varies
    assert circles.leaves(found.point, circle.dp, 0.92 * share)[0] == -1
    assert circles.leaves(found.point, circle.dp, 1.08 * share)[0] == 1


@EVERY
def test_wrong_coefficient_is_seen(name: str) -> None:
    found = measured(name)
    form = found.point.form
    wrong = replace(found, point=replace(found.point, form=replace(form, d=1.1 * form.d)))
    assert wrong.order < 0.5
    assert wrong.errors[-1] == pytest.approx(1.1**0.5 - 1.0, abs=0.006)  # instead of 0


def test_wrong_growth_is_seen() -> None:
    found = measured("A 1.0079")
    form = found.point.form
    assert form.unfolding is not None
    faster = replace(
        form.unfolding, multiplier_slope=form.unfolding.multiplier_slope + 0.1 * form.multiplier
    )
    wrong = replace(found, point=replace(found.point, form=replace(form, unfolding=faster)))
    assert wrong.order < 0.5


@EVERY
def test_z_of_inverts_the_centre_manifold(name: str) -> None:
    form = five_points()[name].form
    dp = circles.offsets(form, 1)[0]
    z = form.radius(dp) * np.exp(2j * np.pi * np.arange(16) / 16)
    back = z_of(form, form.on_manifold(z, dp), dp)
    # rounding of x, of order 1 in the sum, seen through p
    assert np.max(np.abs(back - z)) < 20 * 2.0**-52 * float(np.linalg.norm(form.p))


def test_circle_that_is_not_there_is_reported() -> None:
    point = five_points()[SUBCRITICAL]
    far = replace(point, form=replace(point.form, d=100.0 * point.form.d))
    circle = circles.bisected(far, -1e-4, Plan())
    assert circle.status == circles.NO_BRACKET
    assert np.isnan(circle.radius)


def test_motion_that_does_not_alternate_is_reported() -> None:
    from vibroimpact import State
    from vibroimpact.simulation.simulator import Simulator

    point = five_points()["A 1.0079"]
    motion = Simulator(point.bifurcation.damper, State((0.0, 0.0), (0.0, 0.1)))
    motion.settle(3)
    assert circles.iterates(point, motion, 40)[1] == circles.LOST


def test_distances_start_where_the_radius_is_a_tenth_of_the_resonant_one() -> None:
    form = five_points()["A 0.9318"].form
    distances = circles.offsets(form, 3)
    assert form.radius(distances[0]) == pytest.approx(0.1 * form.resonant_radius, rel=1e-12)
    assert distances[1] / distances[0] == 0.5
    assert form.warnings  # next to 1:4
    assert abs(distances[0]) < 1e-4
