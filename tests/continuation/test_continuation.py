"""Curves of solutions whose points and ends are known in closed form."""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np
import pytest
from support.curves import LOCATED, Given, circle, line, located, nothing

from vibroimpact._core.errors import InvalidParameterError
from vibroimpact.continuation import Steps, Stopped, continue_curve

# --- the curve itself -----------------------------------------------------------------------


def test_circle_closes_on_its_start_with_both_folds_at_one():
    curve = continue_curve(circle(), np.array([1.0]), 0.0, (-2.0, 2.0))
    assert curve.ends[1].reason is Stopped.CLOSED
    assert np.array_equal(curve.z[-1], curve.z[0])
    assert curve.parameter[-1] == curve.parameter[0] == 0.0
    # The arclength is an integral of an expansion that holds to 1e-8 on each panel.
    assert curve.arclength[-1] == pytest.approx(2.0 * math.pi, abs=1e-8)
    assert [(point.test, point.crossing) for point in curve.special] == [("SN", -1), ("SN", 1)]
    assert located(curve, "SN") == pytest.approx([1.0, -1.0], abs=LOCATED)
    assert np.abs([point.z[0] for point in curve.special]).max() < LOCATED


def test_points_lie_on_the_curve_and_tangents_along_it():
    curve = continue_curve(circle(), np.array([1.0]), 0.0, (-2.0, 2.0))
    x, p = curve.z[:, 0], curve.parameter
    # Newton's tolerance 1e-11 on unknowns of size one; |F| is twice the distance.
    assert np.abs(x * x + p * p - 1.0).max() < 1e-10
    assert np.abs(curve.tangent - np.column_stack([-p, x])).max() < 1e-9
    assert curve.residual.max() < 1e-10
    assert np.all(np.diff(curve.arclength) > 0.0)


def test_closed_curve_started_on_its_fold_lists_each_fold_once():
    curve = continue_curve(circle(), np.array([1e-9]), 1.0, (-2.0, 2.0))
    assert curve.ends[1].reason is Stopped.CLOSED
    assert sorted(located(curve, "SN")) == pytest.approx([-1.0, 1.0], abs=LOCATED)


def test_cubic_has_its_two_folds_and_hits_both_ends_exactly():
    low, high = -1.0 / 3.0 - 1.0, 1.1
    cubic = Given(lambda z, p: p - z[0] ** 3 + z[0], lambda z, _p: (1.0 - 3.0 * z[0] ** 2, 1.0))
    curve = continue_curve(cubic, np.array([0.0]), 0.0, (low, high))
    fold = 2.0 / (3.0 * math.sqrt(3.0))
    assert located(curve, "SN") == pytest.approx([-fold, fold], abs=LOCATED)
    assert {curve.parameter[0], curve.parameter[-1]} == {low, high}
    assert all(end.reason is Stopped.RANGE for end in curve.ends)
    assert curve.parameter[curve.start] == 0.0
    assert curve.arclength[curve.start] == 0.0


def test_quintic_has_its_four_folds():
    # p = T_5(z): folds at the extrema cos(k pi / 5), where p = -+1.
    quintic = Given(
        lambda z, p: 16.0 * z[0] ** 5 - 20.0 * z[0] ** 3 + 5.0 * z[0] - p,
        lambda z, _p: (80.0 * z[0] ** 4 - 60.0 * z[0] ** 2 + 5.0, -1.0),
    )
    curve = continue_curve(quintic, np.array([0.0]), 0.0, (-3.0, 3.0))
    assert located(curve, "SN") == pytest.approx([1.0, -1.0, 1.0, -1.0], abs=LOCATED)
    x = [float(point.z[0]) for point in curve.special]
    assert sorted(x) == pytest.approx(
        sorted(math.cos(k * math.pi / 5) for k in range(1, 5)), abs=1e-10
    )


@pytest.mark.parametrize("gap", [1e-2, 1e-5, 1e-8])
def test_a_fold_that_bulges_out_of_the_range_between_two_points_ends_the_curve(gap):
    asked: list[float] = []

    def equations(z, p):
        asked.append(p)
        return z[0] ** 2 + p * p - 1.0

    problem = Given(equations, lambda z, p: (2.0 * z[0], 2.0 * p))
    high = 1.0 - gap
    curve = continue_curve(problem, np.array([1.0]), 0.0, (-0.5, high))
    assert {curve.parameter[0], curve.parameter[-1]} == {-0.5, high}
    assert not curve.special
    assert curve.z.min() > 0.0  # it has not come down the other side
    assert -0.5 <= min(asked) <= max(asked) <= high


def test_ends_of_any_range_are_hit_to_the_last_bit():
    rng = np.random.default_rng(4)
    for size, low, high in rng.uniform([0.1, -2.0, 0.1], [9.0, -0.1, 2.0], (20, 3)):
        curve = continue_curve(line(nothing, (1.0, size)), np.array([0.0]), 0.0, (low, high))
        assert (curve.parameter[0], curve.parameter[-1]) == (low, high)


def test_the_tangent_turns_less_than_allowed_within_a_panel():
    curve = continue_curve(circle(), np.array([1.0]), 0.0, (-2.0, 2.0), steps=Steps(turn=0.1))
    firsts = np.flatnonzero(np.diff(curve.panel, prepend=-1))
    assert np.diff(curve.arclength[firsts]).max() <= 0.1 * (1.0 + 1e-9)  # the circle's radius is 1


def test_one_direction_only_is_followed_on_request():
    curve = continue_curve(line(nothing), np.array([0.0]), 0.0, (-1.0, 1.0), both=False)
    assert curve.start == 0
    assert curve.parameter[-1] == 1.0
    assert curve.ends[0].reason is Stopped.NOT_FOLLOWED


def test_a_start_on_the_bound_is_followed_inwards():
    curve = continue_curve(line(nothing), np.array([1.0]), 1.0, (-1.0, 1.0))
    assert curve.parameter[0] == -1.0
    assert curve.parameter[-1] == 1.0
    assert curve.start == len(curve) - 1


def test_a_guess_is_corrected_at_its_own_parameter():
    curve = continue_curve(circle(), np.array([0.9]), 0.3, (-2.0, 2.0))
    assert curve.parameter[curve.start] == 0.3
    assert curve.z[curve.start, 0] == pytest.approx(math.sqrt(1.0 - 0.09), abs=1e-10)


# --- images ---------------------------------------------------------------------------------


class Mirrored(Given):
    """A problem that z -> -z maps to itself."""

    def images(self, z, _p, along, _near):
        return [(z, along), (-z, -along)]


def test_a_curve_that_comes_to_the_image_of_its_start_is_closed():
    # z on the unit circle, p = cos 2 phi: half of it holds every z up to its sign
    problem = Mirrored(
        lambda z, p: [z[0] ** 2 + z[1] ** 2 - 1.0, p - z[0] ** 2 + z[1] ** 2],
        lambda z, _p: ([2.0 * z, [-2.0 * z[0], 2.0 * z[1]]], [0.0, 1.0]),
        (1.0, 1.0, 1.0),
    )
    start = np.array([math.cos(1.0), math.sin(1.0)])
    curve = continue_curve(problem, start, math.cos(2.0), (-2.0, 2.0))
    assert curve.ends[1].reason is Stopped.CLOSED
    assert curve.z[-1] == pytest.approx(-start, abs=1e-6)
    assert sorted(located(curve, "SN")) == pytest.approx([-1.0, 1.0], abs=LOCATED)


def test_a_curve_ends_at_the_branch_point_beyond_which_its_images_come():
    problem = Mirrored(lambda z, p: p * z[0] - z[0] ** 3, lambda z, p: (p - 3.0 * z[0] ** 2, z[0]))
    arm = continue_curve(problem, np.array([0.5]), 0.25, (-1.0, 1.0))
    assert {end.reason for end in arm.ends} == {Stopped.RANGE, Stopped.REPEATED}
    assert arm.z.min() > -1e-9
    assert located(arm, "BP") == pytest.approx([0.0], abs=1e-10)
    # on the line z = 0, which every point's image is, nothing ends
    line_ = continue_curve(problem, np.array([0.0]), -0.5, (-1.0, 1.0))
    assert {line_.parameter[0], line_.parameter[-1]} == {-1.0, 1.0}


def test_two_directions_that_meet_are_joined():
    steps = Steps(points=100)
    curve = continue_curve(circle(), np.array([1.0]), 0.0, (-2.0, 2.0), steps=steps)
    assert [end.reason for end in curve.ends] == [Stopped.CLOSED, Stopped.CLOSED]
    assert curve.arclength[-1] - curve.arclength[0] == pytest.approx(2.0 * math.pi, abs=1e-8)
    assert curve.z[0] == pytest.approx(curve.z[-1], abs=1e-6)
    assert sorted(located(curve, "SN")) == pytest.approx([-1.0, 1.0], abs=LOCATED)


# --- ends -----------------------------------------------------------------------------------


def test_a_terminal_event_ends_the_curve_at_its_zero():
    def tests(_z, p):
        return {"GR": 0.4 - p, "other": p - 0.6, "before": p - 0.2}

    curve = continue_curve(line(tests), np.array([0.0]), 0.0, (-1.0, 1.0), terminal={"GR"})
    assert curve.ends[1].reason is Stopped.EVENT
    assert curve.ends[1].detail == "GR"
    assert curve.parameter[-1] == pytest.approx(0.4, abs=LOCATED)
    assert [point.test for point in curve.special] == ["before", "GR"]
    assert curve.parameter[0] == -1.0


def test_a_curve_may_start_on_its_terminal_event():
    def tests(_z, p):
        return {"GR": p - 0.4}

    curve = continue_curve(line(tests), np.array([0.4]), 0.4, (-1.0, 1.0), terminal=["GR"])
    assert {curve.parameter[0], curve.parameter[-1]} == {-1.0, 1.0}
    assert located(curve, "GR") == pytest.approx([0.4], abs=LOCATED)


@pytest.mark.parametrize("wall", ["residual", "jacobian"])
def test_a_wall_where_the_problem_is_nan_keeps_what_came_before(wall):
    bad = {"residual": lambda p: math.nan if p > 0.7 else 0.0, "jacobian": lambda _p: 0.0}[wall]
    slope = {"residual": 1.0, "jacobian": math.nan}[wall]
    problem = Given(
        lambda z, p: z[0] - p + bad(p), lambda _z, p: (1.0 if p <= 0.7 else slope, -1.0)
    )
    curve = continue_curve(problem, np.array([0.0]), 0.0, (-1.0, 1.0))
    assert curve.ends[1].reason is Stopped.STEP
    assert "not finite" in str(curve.ends[1])
    # A panel is shortened to a half at most once more than to the least step, 1e-6.
    assert 0.7 - 2e-6 < curve.parameter[-1] <= 0.7
    assert curve.parameter[0] == -1.0
    assert np.all(np.isfinite(curve.z))


def test_a_kink_of_the_curve_itself_is_a_status():
    problem = Given(
        lambda z, p: z[0] - abs(p - 0.3), lambda _z, p: (1.0, -math.copysign(1.0, p - 0.3))
    )
    curve = continue_curve(problem, np.array([0.3]), 0.0, (-1.0, 1.0))
    assert curve.ends[1].reason is Stopped.STEP
    assert 0.29 < curve.parameter[-1] <= 0.3 + 1e-6
    assert curve.parameter[0] == -1.0


def test_the_number_of_points_is_bounded():
    curve = continue_curve(
        circle(), np.array([1.0]), 0.0, (-2.0, 2.0), steps=Steps(points=30), both=False
    )
    assert curve.ends[1].reason is Stopped.POINTS
    assert 30 <= len(curve) - 1 < 60


def test_an_interruption_keeps_what_was_computed():
    def tests(_z, p):
        if p > 0.5:
            raise KeyboardInterrupt
        return {"f": p - 0.2}

    curve = continue_curve(line(tests), np.array([0.0]), 0.0, (-1.0, 1.0))
    assert curve.ends[1].reason is Stopped.INTERRUPTED
    assert curve.ends[0].reason is Stopped.NOT_FOLLOWED
    assert located(curve, "f") == pytest.approx([0.2], abs=LOCATED)


@pytest.mark.parametrize("seed", range(8))
def test_panels_do_not_shrink_where_only_rounding_moves_the_parameter(seed):
    """Along a curve at one p dp/ds is noise at every node, at some of which it comes out the same once more."""
    mix = np.random.default_rng(seed).normal(size=(4, 4))

    def equations(z, p):
        plain = [
            z[0] ** 2 + z[1] ** 2 - 1.0,
            z[1] * z[2] - 0.3 * z[0],
            p - 0.3,
            z[3] - math.exp(z[0]) * p,
        ]
        return mix @ plain

    def derivatives(z, p):
        e = math.exp(z[0])
        rows = [[2.0 * z[0], 2.0 * z[1], 0.0, 0.0, 0.0], [-0.3, z[2], z[1], 0.0, 0.0],
                [0.0, 0.0, 0.0, 0.0, 1.0], [-e * p, 0.0, 0.0, 1.0, -e]]  # fmt: skip
        mixed = mix @ rows
        return mixed[:, :-1], mixed[:, -1]

    start = np.array(
        [math.cos(0.8), math.sin(0.8), 0.3 / math.tan(0.8), 0.3 * math.exp(math.cos(0.8))]
    )
    curve = continue_curve(
        Given(equations, derivatives, (1.0,) * 5), start, 0.3, (0.0, 1.0),
        tangent=np.array([-1.0, 1.0, -1.0, -1.0, 0.0]), steps=Steps(points=60),
    )  # fmt: skip
    assert not curve.unresolved
    assert np.ptp(curve.arclength) > 1.0


def test_progress_is_told_after_every_panel():
    told: list[tuple[int, float]] = []
    curve = continue_curve(
        line(nothing),
        np.array([0.0]),
        0.0,
        (-1.0, 1.0),
        both=False,
        progress=lambda points, p: told.append((points, p)),
    )
    assert len(told) == curve.panel[-1] + 1
    assert told[-1] == (len(curve) - 1, 1.0)
    assert all(a < b for a, b in pairwise(told))


def test_panels_are_numbered_along_the_curve_and_tests_given_at_every_point():
    curve = continue_curve(
        circle(lambda _z, p: {"f": p * p - 0.3}), np.array([1.0]), 0.0, (-0.9, 0.9)
    )
    assert curve.panel[0] == 0
    assert set(np.diff(curve.panel)) == {0, 1}
    assert curve.tests["f"] == pytest.approx(curve.parameter**2 - 0.3, abs=1e-12)
    assert curve.tests["SN"] == pytest.approx(curve.tangent[:, 1], abs=1e-12)
    assert np.all(curve.tests["BP"] > 0.0) or np.all(curve.tests["BP"] < 0.0)
    # -+ sqrt 0.3 are crossed downwards and upwards along the arclength, which follows p here.
    assert [point.crossing for point in curve.special] == [-1, 1]


# --- misuse ---------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"bounds": (1.0, -1.0)}, "low < high"),
        ({"bounds": (0.5, 1.0)}, "within bounds"),
        ({"bounds": (-math.inf, 1.0)}, "finite"),
        ({"z": np.zeros(2)}, "shape"),
        ({"z": np.array([math.nan])}, "not finite"),
        ({"terminal": ["GR"]}, "terminal"),
        ({"tangent": np.zeros(2)}, "tangent"),
        ({"tangent": np.ones(3)}, "tangent"),
    ],
)
def test_misuse_is_refused_with_the_value_and_what_is_allowed(change, message):
    given = {"z": np.array([1.0]), "p": 0.0, "bounds": (-2.0, 2.0)} | change
    with pytest.raises(InvalidParameterError, match=message):
        continue_curve(circle(), **given)


def test_names_and_sizes_of_a_problem_are_checked():
    with pytest.raises(InvalidParameterError, match="built in"):
        continue_curve(line(lambda _z, _p: {"SN": 1.0}), np.zeros(1), 0.0, (-1.0, 1.0))
    with pytest.raises(InvalidParameterError, match="size"):
        continue_curve(line(nothing, (1.0, 0.0)), np.zeros(1), 0.0, (-1.0, 1.0))
    with pytest.raises(InvalidParameterError, match="Newton"):
        continue_curve(circle(), np.array([1.0]), 1.5, (-2.0, 2.0))


def test_printing_says_what_was_found_and_why_it_ended():
    text = repr(continue_curve(circle(), np.array([1.0]), 0.0, (-2.0, 2.0)))
    assert "2 SN" in text
    assert "returned to its start" in text
