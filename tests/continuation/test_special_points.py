"""Special points of curves: zeros of test functions, branch points, maps in closed form."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np
import pytest
from support.curves import LOCATED, Floats, Given, circle, line, located, nothing, pitchfork

from vibroimpact._core.errors import InvalidParameterError
from vibroimpact.continuation import Steps, continue_curve, switch

# --- special points -------------------------------------------------------------------------


@pytest.mark.parametrize("separation", [1e-3, 1e-5])
def test_two_zeros_a_small_part_of_a_step_apart_are_both_found(separation):
    first = 0.312345

    def tests(_z, p):
        # The pole at p = 0.2 i limits the panels: their expansions do not reach rounding.
        return {"pair": (p - first) * (p - second) / (0.04 + p * p)}

    second = first  # a double zero: where do the points lie?
    plain = continue_curve(line(tests), np.array([0.0]), 0.0, (-1.0, 1.0))
    at = int(np.searchsorted(plain.parameter, first))
    second = first + separation * float(plain.parameter[at] - plain.parameter[at - 1])
    curve = continue_curve(line(tests), np.array([0.0]), 0.0, (-1.0, 1.0))
    assert not np.any((curve.parameter > first) & (curve.parameter < second))
    # The slope at the zeros is about the separation of the pair: rounding of f is 1e-16.
    found = located(curve, "pair")
    assert found == pytest.approx([first, second], abs=1e-15 / (second - first) + 1e-15)
    assert [point.crossing for point in curve.special] == [-1, 1]


def test_a_double_zero_is_no_crossing():
    def tests(_z, p):
        return {
            "touch": (p - 0.312345) ** 2,
            "from below": -((p + 0.2) ** 2) * (1 + p * p),
        }

    curve = continue_curve(line(tests), np.array([0.0]), 0.0, (-1.0, 1.0))
    assert not curve.special
    assert not curve.unresolved


def test_rounding_makes_no_pair_of_a_double_zero():
    for at in np.random.default_rng(3).uniform(-1.0, 1.0, 20):

        def tests(_z, p, at=at):
            return {"touch": (p - at) ** 2 + 1e-16 * math.sin(1e15 * p)}

        assert not continue_curve(line(tests), np.array([0.0]), 0.0, (-1.0, 1.0)).special


def test_a_triple_zero_is_one_crossing():
    curve = continue_curve(
        line(lambda _z, p: {"triple": (p - 0.3) ** 3}), np.array([0.0]), 0.0, (-1.0, 1.0)
    )
    # A cube is below rounding 1e-16 within 5e-6 of its zero.
    assert located(curve, "triple") == pytest.approx([0.3], abs=1e-5)


def test_three_zeros_within_one_step_are_found_on_a_curved_branch():
    zeros = [0.5, 0.5001, 0.50012]

    def tests(z, p):
        return {"three": float(np.prod([p - at for at in zeros])) * math.exp(z[0])}

    curve = continue_curve(circle(tests), np.array([1.0]), 0.0, (-0.9, 0.9))
    assert located(curve, "three") == pytest.approx(zeros, abs=1e-8)


def test_zeros_of_many_functions_are_found_with_honest_errors():
    zeros = np.random.default_rng(1).uniform(-1.0, 1.0, 20)

    def tests(_z, p):
        return {f"{k}": math.sin(p - at) for k, at in enumerate(zeros)}

    curve = continue_curve(line(tests), np.array([0.0]), 0.0, (-1.0, 1.0))
    assert len(curve.special) == 20
    for point in curve.special:
        miss = abs(point.parameter - zeros[int(point.test)])
        assert miss <= point.error < LOCATED


@pytest.mark.parametrize("at", [-1.0, -0.25, 0.0, 1.0])
def test_a_zero_on_a_point_of_the_curve_is_found_once(at):
    curve = continue_curve(
        line(lambda _z, p: {"f": p - at}),
        np.array([0.0]),
        0.0,
        (-1.0, 1.0),
        steps=Steps(first=0.25),
    )
    assert located(curve, "f") == pytest.approx([at], abs=LOCATED)
    assert curve.special[0].crossing == 1


def test_a_zero_on_the_end_of_a_panel_is_found_once():
    def along(tests):
        return continue_curve(
            line(tests), np.array([0.0]), 0.0, (-1.0, 1.0), steps=Steps(first=0.3)
        )

    plain = along(nothing)
    change = np.flatnonzero(np.diff(plain.panel))
    hit = 0
    for at in map(float, plain.parameter[np.union1d(change, change + 1)]):
        curve = along(lambda _z, p, at=at: {"f": at - p})
        hit += int(np.any(curve.tests["f"] == 0.0))
        assert located(curve, "f") == pytest.approx([at], abs=LOCATED)
        assert curve.special[0].crossing == -1
    assert hit


def test_crossings_and_tangents_of_special_points_are_those_of_their_neighbours():
    problem = Given(
        lambda z, p: p - z[0] ** 3 + z[0],
        lambda z, _p: (1.0 - 3.0 * z[0] ** 2, 1.0),
        tests=lambda z, _p: {"up": z[0] - 0.9, "down": -0.9 - z[0]},
    )
    curve = continue_curve(problem, np.array([0.0]), 0.0, (-2.0, 2.0))
    assert len(curve.special) == 4
    for point in curve.special:
        after = int(np.searchsorted(curve.arclength, point.arclength))
        values = curve.tests[point.test][after - 1 : after + 1]
        assert np.sign(values).tolist() == [-point.crossing, point.crossing]
        between = curve.tangent[after - 1 : after + 1] @ point.tangent
        assert np.all(between > 0.9)


def test_a_test_function_that_is_zero_everywhere_is_reported():
    curve = continue_curve(line(lambda _z, _p: {"zero": 0.0}), np.array([0.0]), 0.0, (-1.0, 1.0))
    [note] = curve.unresolved
    assert (note.name, note.first, note.last) == ("zero", 0, len(curve) - 1)
    assert "zero everywhere" in note.reason
    assert not curve.special


def test_a_test_function_that_is_noise_is_reported_and_stops_nothing():
    noise = np.random.default_rng(5)
    curve = continue_curve(
        line(lambda _z, _p: {"noise": noise.normal()}), np.array([0.0]), 0.0, (-1.0, 1.0)
    )
    assert curve.parameter[-1] == 1.0
    assert {note.name for note in curve.unresolved} == {"noise"}


def test_a_test_function_that_is_not_finite_is_reported_where_it_is_not():
    def tests(_z, p):
        return {"half": p + 0.5 if p < 0.3 else math.nan}

    curve = continue_curve(line(tests), np.array([0.0]), 0.0, (-1.0, 1.0))
    assert located(curve, "half") == pytest.approx([-0.5], abs=LOCATED)
    [note] = curve.unresolved
    assert curve.parameter[note.first] <= 0.3 <= curve.parameter[note.last] == 1.0


def test_a_kink_is_reported_and_its_zero_found():
    def tests(_z, p):
        return {
            "kink": max(p - 0.1, 3.0 * (p - 0.1)),
            "jump": math.copysign(1.0, p - 0.4),
        }

    curve = continue_curve(line(tests), np.array([0.0]), 0.0, (-1.0, 1.0))
    assert located(curve, "kink") == pytest.approx([0.1], abs=LOCATED)
    assert not located(curve, "jump")
    assert {note.name for note in curve.unresolved} == {"kink", "jump"}
    for note in curve.unresolved:  # only about the kink and the jump
        ends = curve.parameter[[note.first, note.last]]
        assert 0.0 < ends[1] - ends[0] < 0.3
        assert ends[0] < {"kink": 0.1, "jump": 0.4}[note.name] < ends[1]


def test_after_a_kink_a_test_function_is_resolved_again():
    def tests(_z, p):
        return {"f": abs(p + 0.5) + 1.0 / (1.0 + 2500.0 * (p - 0.3) ** 2)}

    curve = continue_curve(line(tests), np.array([0.0]), -1.0, (-1.0, 1.0))
    assert curve.unresolved
    for note in curve.unresolved:
        assert np.abs(curve.parameter[[note.first, note.last]] + 0.5).max() < 0.3


def test_a_pole_is_no_zero():
    def tests(_z, p):
        return {"pole": 1.0 / (p - 0.123 + 1e-300)}

    curve = continue_curve(line(tests), np.array([0.0]), 0.0, (-1.0, 1.0))
    assert not curve.special
    assert {note.name for note in curve.unresolved} == {"pole"}
    assert curve.parameter[-1] == 1.0


@pytest.mark.parametrize("z_unit", [1e-6, 1.0, 1e6])
@pytest.mark.parametrize("p_unit", [1e-6, 1.0, 1e6])
@pytest.mark.parametrize("f_unit", [1e-9, 1e9])
@pytest.mark.one_in(3)
def test_found_points_do_not_depend_on_units(z_unit, p_unit, f_unit):
    def equations(z, p):
        x, q = z[0] / z_unit, p / p_unit
        return f_unit * (q - x**3 + x)

    def derivatives(z, _p):
        x = z[0] / z_unit
        return f_unit * (1.0 - 3.0 * x * x) / z_unit, f_unit / p_unit

    problem = Given(
        equations, derivatives, (z_unit, p_unit), lambda z, _p: {"f": z[0] / z_unit - 0.2}
    )
    curve = continue_curve(problem, np.zeros(1), 0.0, (-2.0 * p_unit, 2.0 * p_unit))
    fold = 2.0 / (3.0 * math.sqrt(3.0))
    assert np.array(located(curve, "SN")) / p_unit == pytest.approx([-fold, fold], abs=LOCATED)
    assert np.array(located(curve, "f")) / p_unit == pytest.approx([0.008 - 0.2], abs=LOCATED)
    assert {curve.parameter[0], curve.parameter[-1]} == {-2.0 * p_unit, 2.0 * p_unit}


# --- branch points --------------------------------------------------------------------------


def test_pitchfork_is_a_branch_point_from_both_of_its_branches():
    problem, bounds = pitchfork(), (-1.0, 1.0)
    straight = continue_curve(problem, np.array([0.0]), -1.0, bounds)
    assert [point.test for point in straight.special] == ["BP"]
    [point] = straight.special
    assert abs(point.parameter) < LOCATED
    start = switch(problem, point.z, point.parameter, point.tangent, bounds)
    assert start.found
    arm = continue_curve(problem, start.z, start.parameter, bounds, tangent=start.tangent)
    assert [point.test for point in arm.special] == ["BP"]  # where p turns back, but no fold
    assert sorted(arm.z[[0, -1], 0]) == pytest.approx([-1.0, 1.0], abs=1e-10)
    assert np.abs(arm.parameter - arm.z[:, 0] ** 2).max() < 1e-10
    [again] = arm.special
    back = switch(problem, again.z, again.parameter, again.tangent, bounds)
    assert back.found
    assert abs(back.z[0]) < 1e-10
    assert abs(back.parameter) > 1e-6


@pytest.mark.parametrize("slope", [1.0, -1.0, 0.1, 30.0])
def test_transcritical_branch_point_is_crossed_at_any_angle(slope):
    # z_0 (p - slope z_0) = 0, and a second unknown that follows the first.
    problem = Given(
        lambda z, p: [z[0] * (p - slope * z[0]), z[1] - z[0] - p],
        lambda z, p: ([[p - 2.0 * slope * z[0], 0.0], [-1.0, 1.0]], [z[0], -1.0]),
        (1.0, 1.0, 1.0),
    )
    bounds = (-1.0, 1.0)
    trivial = continue_curve(problem, np.array([0.0, -0.7]), -0.7, bounds)
    [point] = trivial.special
    assert (point.test, abs(point.parameter) < LOCATED) == ("BP", True)
    start = switch(problem, point.z, point.parameter, point.tangent, bounds)
    other = continue_curve(problem, start.z, start.parameter, bounds, tangent=start.tangent)
    assert np.abs(other.parameter - slope * other.z[:, 0]).max() < 1e-9
    assert {other.parameter[0], other.parameter[-1]} == set(bounds)
    assert located(other, "BP") == pytest.approx([0.0], abs=LOCATED)
    assert not located(other, "SN")


def test_two_branch_points_a_thousandth_of_a_step_apart_are_both_found():
    near = 1e-4

    def roots(p):
        return (p - 0.3) * (p - 0.3 - near)

    problem = Given(
        lambda z, p: roots(p) * z[0] + z[0] ** 3,
        lambda z, p: (roots(p) + 3.0 * z[0] ** 2, (2.0 * p - 0.6 - near) * z[0]),
    )
    curve = continue_curve(problem, np.array([0.0]), -1.0, (-1.0, 1.0))
    assert located(curve, "BP") == pytest.approx([0.3, 0.3 + near], abs=1e-11)


def test_branch_point_among_fifty_unknowns():
    d = 50
    rng = np.random.default_rng(2)
    mix = np.linalg.qr(rng.normal(size=(d, d)))[0]
    rates = np.linspace(0.5, 3.0, d)

    def split(z, p):
        y = mix.T @ z
        f = y * rates - np.sin(rates * p)
        by_y, by_p = np.diag(rates), -rates * np.cos(rates * p)
        f[0], by_p[0], by_y[0, 0] = p * y[0] - y[0] ** 3, y[0], p - 3.0 * y[0] ** 2
        return f, by_y @ mix.T, by_p

    problem = Given(
        lambda z, p: split(z, p)[0], lambda z, p: split(z, p)[1:], tuple(np.ones(d + 1))
    )
    y = np.sin(-rates * 0.8) / rates
    y[0] = 0.0
    curve = continue_curve(problem, mix @ y, -0.8, (-0.8, 1.0))
    assert [point.test for point in curve.special] == ["BP"]
    [point] = curve.special
    assert abs(point.parameter) < LOCATED
    start = switch(problem, point.z, point.parameter, point.tangent, (-0.8, 1.0))
    assert start.found
    assert abs(float(mix.T[0] @ start.z)) > 1e-6


def test_a_fold_is_no_branch_point_and_has_no_second_branch():
    problem = circle()
    curve = continue_curve(problem, np.array([1.0]), 0.0, (-2.0, 2.0))
    point = curve.special[0]
    start = switch(problem, point.z, point.parameter, point.tangent, (-2.0, 2.0))
    assert not start.found
    assert "no branch point" in start.status
    assert np.all(np.isnan(start.z))


def test_a_far_point_of_the_known_branch_is_not_taken_for_another_branch():
    # h g = 0 with g > 0 but at the origin: one branch h = 0, though J vanishes there. At z = e it
    # has a point at p = -sqrt(e), to which Newton's iteration goes from (e, 0).
    def h(z, p):
        return z - p * p - 3.0 * z * p

    def g(z, p):
        return z * z + 1e-4 * p * p

    problem = Given(
        lambda z, p: h(z[0], p) * g(z[0], p),
        lambda z, p: (
            (1.0 - 3.0 * p) * g(z[0], p) + 2.0 * z[0] * h(z[0], p),
            (-2.0 * p - 3.0 * z[0]) * g(z[0], p) + 2e-4 * p * h(z[0], p),
        ),
    )
    start = switch(problem, np.zeros(1), 0.0, np.array([0.0, 1.0]), (-1.0, 1.0))
    assert not start.found


def test_starting_at_a_branch_point_needs_a_tangent():
    with pytest.raises(InvalidParameterError, match="give the tangent"):
        continue_curve(pitchfork(), np.array([0.0]), 0.0, (-1.0, 1.0))


# --- maps with known bifurcations -----------------------------------------------------------


@dataclass
class Cycle:
    """n points of a planar map, each the image of the one before; tests PD and NS."""

    image: Callable[[Floats, float], Floats]
    by_x: Callable[[Floats, float], Floats]
    by_p: Callable[[Floats, float], Floats]
    n: int = 1

    def residual(self, z: Floats, p: float) -> Floats:
        x = z.reshape(self.n, 2)
        images = np.array([self.image(point, p) for point in x])
        return (images - np.roll(x, -1, axis=0)).ravel()

    def jacobian(self, z: Floats, p: float) -> tuple[Floats, Floats]:
        x = z.reshape(self.n, 2)
        whole = np.zeros((2 * self.n, 2 * self.n))
        for i, point in enumerate(x):
            j = (i + 1) % self.n
            whole[2 * i : 2 * i + 2, 2 * i : 2 * i + 2] += self.by_x(point, p)
            whole[2 * i : 2 * i + 2, 2 * j : 2 * j + 2] -= np.eye(2)
        return whole, np.concatenate([self.by_p(point, p) for point in x])

    def scale(self) -> Floats:
        return np.ones(2 * self.n + 1)

    def watch(self, z: Floats, p: Floats) -> Mapping[str, Floats]:
        m = np.array([self.round(*at) for at in zip(z, p.tolist(), strict=True)])
        return {"PD": np.linalg.det(m + np.eye(2)), "NS": np.linalg.det(m) - 1.0}

    def round(self, z: Floats, p: float) -> Floats:
        """Derivative of one turn."""
        m = np.eye(2)
        for point in z.reshape(self.n, 2):
            m = self.by_x(point, p) @ m
        return m


def predator(n: int) -> Cycle:
    """AUTO-07p's demonstration dd2 with p2 = 2, p3 = 1; on u2 = 0 the logistic map."""
    return Cycle(
        lambda u, p: np.array([p * u[0] * (1 - u[0]) - 2 * u[0] * u[1], 2 * u[0] * u[1]]),
        lambda u, p: np.array([[p - 2 * p * u[0] - 2 * u[1], -2 * u[0]], [2 * u[1], 2 * u[0]]]),
        lambda u, _p: np.array([u[0] * (1 - u[0]), 0.0]),
        n,
    )


def test_predator_prey_map_has_the_published_bifurcations():
    bounds = (0.5, 3.8)
    trivial = continue_curve(predator(1), np.zeros(2), 0.5, bounds)
    assert located(trivial, "BP") == pytest.approx([1.0], abs=LOCATED)
    [point] = trivial.named("BP")
    start = switch(predator(1), point.z, point.parameter, point.tangent, bounds)
    fixed = continue_curve(predator(1), start.z, start.parameter, bounds, tangent=start.tangent)
    assert sorted(located(fixed, "BP")) == pytest.approx([1.0, 2.0], abs=LOCATED)
    # Multipliers 2 - p and 2 - 2/p.
    assert sorted(located(fixed, "PD")) == pytest.approx([2.0 / 3.0, 3.0], abs=LOCATED)


def test_period_doublings_are_followed_by_switching_to_the_doubled_problem():
    # 3, 1 + sqrt 6 and the root of the degree 12 polynomial of the period-4 orbit, 3.5440903595...
    expected = [3.0, 1.0 + math.sqrt(6.0), 3.544090359551922853615]
    bounds = (2.5, 3.56)
    curve = continue_curve(predator(1), np.array([0.6, 0.0]), 2.5, bounds)
    for n, at in zip((2, 4, 8), expected, strict=True):
        found = [point for point in curve.named("PD") if abs(point.z[1]) < 1e-9]
        assert found[0].parameter == pytest.approx(at, abs=LOCATED)
        point = found[0]
        direction = np.append(np.tile(point.tangent[:-1], 2), point.tangent[-1])
        doubled = np.tile(point.z, 2)
        start = switch(predator(n), doubled, point.parameter, direction, bounds)
        assert start.found
        curve = continue_curve(predator(n), start.z, start.parameter, bounds, tangent=start.tangent)
        assert located(curve, "BP")[0] == pytest.approx(at, abs=1e-10)


def test_henon_map_has_its_closed_form_bifurcations():
    # x' = y, y' = a - b x - y^2 at a = 2: y^2 + (1 + b) y = 2.
    henon = Cycle(
        lambda u, b: np.array([u[1], 2.0 - b * u[0] - u[1] ** 2]),
        lambda u, b: np.array([[0.0, 1.0], [-b, -2.0 * u[1]]]),
        lambda u, _b: np.array([0.0, -u[0]]),
    )
    curve = continue_curve(henon, np.array([0.8, 0.8]), 0.5, (0.0, 2.0))
    assert located(curve, "PD") == pytest.approx([math.sqrt(8.0 / 3.0) - 1.0], abs=LOCATED)
    assert located(curve, "NS") == pytest.approx([1.0], abs=LOCATED)
    [flip], [torus] = curve.named("PD"), curve.named("NS")
    assert flip.z == pytest.approx(np.full(2, math.sqrt(2.0 / 3.0)), abs=1e-12)
    assert torus.z == pytest.approx(np.full(2, math.sqrt(3.0) - 1.0), abs=1e-12)
