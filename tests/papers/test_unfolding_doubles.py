"""Portraits around the resonances 1:2 and 1:1 of set C: prediction against simulation."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from scipy.integrate import quad, solve_ivp
from scipy.optimize import minimize_scalar
from support.bifurcations import double_of_set_c
from vibroimpact_papers.impact_damper import figures, parameter_sets, unfolding
from vibroimpact_papers.impact_damper.plan import Plan
from vibroimpact_papers.impact_damper.story_resonances import _around
from vibroimpact_papers.impact_damper.unfolding import RADII, Sector, Unfolded, unfolded
from vibroimpact_papers.impact_damper.unfolding_flows import (
    FIGURE_EIGHT,
    FOLD_OF_CIRCLES,
    HOMOCLINIC,
    DoubleFlow,
    OneFlow,
    TwoFlow,
    flow_at,
)
from vibroimpact_papers.impact_damper.unfolding_motions import STRIDE, OnManifold

import vibroimpact as vi
from vibroimpact.continuation import Steps

SET = parameter_sets()["C"]
SMALL = 0.0025  # size of flows that are compared with their first order: sqrt(SMALL) = 0.05


@cache
def around(label: str) -> Unfolded:
    return unfolded(SET, double_of_set_c(label))


def start_of(label: str) -> list[float]:
    return list(double_of_set_c(label).parameters.values())


def both(s: Sector) -> tuple[np.ndarray, np.ndarray]:
    """Predicted and simulated trajectories by radius of the start, shape (3, starts, points)."""
    shape = (len(RADII), -1, s.predicted.shape[1])
    return s.predicted.reshape(shape), s.simulated.reshape(shape)


def late(rows: np.ndarray) -> np.ndarray:
    """The last quarter, in which motions go around several times."""
    return rows[..., 3 * rows.shape[-1] // 4 :]


def nearest(rows: np.ndarray, points: np.ndarray) -> np.ndarray:
    return np.abs(rows[..., None] - points).min(axis=-1)


# ---- flows -----------------------------------------------------------------------------------


def unscaled(flow: DoubleFlow, w: float, rate: float) -> np.ndarray:
    """w0 at times 0, 1, 2 (iterates) on the flow at mu = 0, by SciPy."""
    z = complex(w, rate * flow.iterates) / flow.amplitude

    def field(_t: float, u: np.ndarray) -> list[float]:
        moved = flow.rate(0j, np.array([complex(*u)]))[0]
        return [moved.real, moved.imag]

    times = np.arange(3) / flow.iterates
    at = solve_ivp(field, (0.0, times[-1]), [z.real, z.imag], t_eval=times, rtol=1e-13, atol=1e-18)
    return np.asarray(at.y[0] * flow.amplitude)


@pytest.mark.slow
def test_time_one_map_of_the_flow_next_to_1_2_has_the_terms_of_the_normal_form() -> None:
    form = replace(double_of_set_c("R2_1").normal_form, numbers={"c": -0.7, "d": 5.0})
    left = []
    for s in (0.02, 0.01):  # w1 of order s^2: terms c w0^3 and d w0^2 w1 of orders 3 and 4
        w = unscaled(TwoFlow(form), s, 1.3 * s**2)
        before, after = -np.diff(w)  # w1 and -w1 of the next iterate of -H
        left.append(after - (before - form.c * w[0] ** 3 - form.d * w[0] ** 2 * before))
    assert left[0] / left[1] == pytest.approx(32.0, rel=0.1)  # order 5 is left


@pytest.mark.slow
def test_time_one_map_of_the_flow_next_to_1_1_has_the_terms_of_the_normal_form() -> None:
    form = replace(double_of_set_c("R1_1").normal_form, numbers={"a": 0.3, "b": 1.7})
    left = []
    for s in (0.001, 0.00025):  # w1 of order s^(3/2): terms a w0^2 and b w0 w1 of orders 2 and 5/2
        w = unscaled(OneFlow(form), s, 0.6 * s**1.5)
        before, after = np.diff(w)
        left.append(after - (before + form.a * w[0] ** 2 + form.b * w[0] * before))
    assert left[0] / left[1] == pytest.approx(64.0, rel=0.1)  # order 3 is left


def stopped(flow: DoubleFlow, mu: complex, start: complex, forward: bool = True) -> float:
    """x at which x' is zero next, on the flow from a start, by SciPy."""

    def field(_t: float, u: np.ndarray) -> list[float]:
        moved = flow.rate(mu, np.array([complex(*u)]))[0]
        return [moved.real, moved.imag]

    def still(_t: float, u: np.ndarray) -> float:
        return float(u[1])

    still.terminal = True  # type: ignore[attr-defined]
    end = 100.0 if forward else -100.0
    found = solve_ivp(field, (0.0, end), [start.real, start.imag], events=still,
                      rtol=1e-10, atol=1e-12)  # fmt: skip
    return float(found.y[0, -1])


def gap(flow: DoubleFlow, mu: complex, saddle: float, towards: float) -> float:
    """Distance on the axis x' = 0 of the unstable manifold of the saddle from its stable one."""
    h, axis = 1e-6, np.array([saddle, saddle]) + 0j
    by_x, by_v = (flow.rate(mu, axis + step)[0].imag / h for step in (h, 1j * h))
    slopes = np.roots([1.0, -by_v, -by_x])  # x'' = by_x x + by_v x' next to the saddle
    small = 1e-4 * towards
    out, back = (complex(saddle + small, small * float(s)) for s in (slopes.max(), slopes.min()))
    return stopped(flow, mu, out) - stopped(flow, mu, back, forward=False)


@pytest.mark.parametrize(
    ("label", "line", "saddle", "towards"),
    [("R2_1", FIGURE_EIGHT, 0.0, 1.0), ("R1_1", HOMOCLINIC, 1.0, -1.0)],
    ids=["figure eight", "homoclinic orbit"],
)
def test_manifolds_of_the_saddle_meet_on_the_predicted_line(
    label: str, line: float, saddle: float, towards: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    flow = flow_at(double_of_set_c(label).normal_form)
    monkeypatch.setattr(type(flow), "size", SMALL)
    m1, m2 = (SMALL, SMALL) if isinstance(flow, TwoFlow) else (-SMALL, math.sqrt(SMALL))
    below, above = (
        gap(flow, complex(m1, share * line * m2), saddle, towards) for share in (0.99, 1.01)
    )
    zero = 0.99 + 0.02 * below / (below - above)
    assert zero == pytest.approx(1.0, abs=0.004)  # the next term is of order sqrt(size)^2


def ratio(x: float) -> float:
    """m2 / m1 of (6) at which, to first order, a circle passes the axis at x > sqrt(2)."""

    # Along x'^2 = x^2 - x^4/2 - e the mean of (m2 - m1 x^2) x'^2 is zero.
    def speed(u: float) -> float:
        return math.sqrt(max(0.0, (x**2 - u**2) * ((u**2 + x**2) / 2.0 - 1.0)))

    def mean(power: int) -> float:  # u = x sin(a): smooth at the end
        return quad(lambda a: (x * math.sin(a)) ** power * speed(x * math.sin(a)) * math.cos(a),
                    0.0, math.pi / 2.0, limit=200)[0]  # fmt: skip

    return mean(2) / mean(0)


def test_two_circles_around_all_meet_on_the_predicted_line() -> None:
    # Melnikov's integral, by SciPy
    found = minimize_scalar(ratio, bounds=(1.43, 1.8), method="bounded", options={"xatol": 1e-4})
    assert found.fun == pytest.approx(FOLD_OF_CIRCLES, abs=5e-4)
    assert ratio(math.sqrt(2.0) + 1e-9) == pytest.approx(FIGURE_EIGHT, abs=1e-4)


@pytest.mark.parametrize(
    ("label", "change", "match"),
    [("R2_1", {"c": 0.1}, "must be negative"), ("R1_1", {"a": -0.1}, "must agree in sign")],
    ids=["R2", "R1"],
)
def test_coefficients_of_other_signs_are_refused(
    label: str, change: dict[str, float], match: str
) -> None:
    form = double_of_set_c(label).normal_form
    with pytest.raises(vi.InvalidParameterError, match=match):
        flow_at(replace(form, numbers={**form.numbers, **change}))


# ---- parameters ------------------------------------------------------------------------------


@pytest.mark.parametrize("label", ["R2_1", "R1_1"])
@pytest.mark.slow
def test_parameters_of_a_sector_give_m1_and_m2(label: str) -> None:
    one = around(label)
    for s in one.sectors:
        mu = unfolding.mu_at(SET, one.flow, s.omega, s.half_clearance)
        assert mu == pytest.approx(s.mu, rel=1e-6)


def test_no_symmetric_orbit_exists_on_the_far_side_of_the_fold_at_1_1() -> None:
    for s in around("R1_1").sectors:
        damper = replace(unfolding.damper_of(SET, s.omega), half_clearance=s.half_clearance)
        assert len(vi.symmetric_orbits(damper)) == (0 if s.mu.real > 0.0 else 2)


def test_curve_of_the_doubled_orbit_begins_along_its_predicted_line() -> None:
    curve = around("R2_1").born[0]
    slopes = curve[1:, 1] / curve[1:, 0]
    np.testing.assert_allclose(slopes, 1.0, atol=1e-3)
    assert abs(slopes[3] - 1.0) < 0.7 * abs(slopes[7] - 1.0)  # half as far: tangent


@pytest.mark.slow
@pytest.mark.parametrize("half_widths", [(3e-4, 0.05), (0.1, 1.0)])
def test_the_switch_at_1_2_finds_that_curve_whatever_the_bounds(
    half_widths: tuple[float, float],
) -> None:
    """|c / D| is 1e-3: e1 is 1e-6 of it where the truncation holds."""
    point = double_of_set_c("R2_1")
    at = np.array(list(point.parameters.values()))
    bounds = tuple((x - h, x + h) for x, h in zip(at, half_widths, strict=True))
    (curve,) = vi.switch_curve(point, bounds, steps=Steps(first=0.1, largest=1.0, points=6))
    assert curve.kind == "NS"
    flow = flow_at(point.normal_form)
    near = np.array([unfolding.mu_at(SET, flow, *values) for values in curve.values])
    near = near[near.real < 20.0]
    assert len(near) > 2
    # the curve of the normal form is a line, from which the true one parts in proportion to mu
    assert np.all(np.abs(near.imag / near.real - 1.0) < 2e-4 + 1e-3 * near.real)


def test_symmetric_orbits_are_read_as_the_fixed_points_the_better_the_nearer(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    off = []
    for size in (0.0025, 0.000625):
        monkeypatch.setattr(OneFlow, "size", size)
        flow = flow_at(double_of_set_c("R1_1").normal_form)
        mu = flow.places()[2].mu
        half = unfolding.half_map(
            SET, flow, *unfolding.parameters_at(SET, flow, start_of("R1_1"), mu)
        )
        reader = OnManifold.of(flow, half).reader / flow.amplitude
        for orbit, z in zip(vi.symmetric_orbits(half.damper), (1.0, -1.0), strict=True):
            at = orbit.state
            x = np.array([at.position[0], *at.velocity, at.phase]) - half.middle
            off.append(abs(reader @ x - z))
    assert max(off) < 0.05
    assert off[2] == pytest.approx(off[0] / 2.0, rel=0.2)  # of order sqrt(size)


# ---- portraits at 1:2 ------------------------------------------------------------------------


def two(number: int) -> tuple[Sector, tuple[np.ndarray, np.ndarray]]:
    s = around("R2_1").sectors[number - 1]
    return s, both(s)


def test_next_to_1_2_every_motion_shrinks_where_the_symmetric_orbit_is_stable() -> None:
    _, rows = two(1)
    for row in rows:
        assert np.abs(row[..., -1]).max() < 0.02


def test_next_to_1_2_motions_settle_on_a_circle_of_the_predicted_size() -> None:
    _, rows = two(2)
    widths = [np.abs(late(row).real).max(axis=-1) for row in rows]
    for width in widths:
        np.testing.assert_allclose(width[1:], np.median(width[1:]), rtol=0.05)
    np.testing.assert_allclose(widths[1], widths[0], rtol=0.03)


def test_before_the_doubled_orbit_is_stable_one_circle_around_all_attracts() -> None:
    s, rows = two(3)
    for row in rows:
        inner = nearest(row[1, [0, 2]], s.periodic)  # on the axis, next to the doubled points
        assert (inner[:, 200:250].max(axis=-1) > 1.5 * inner[:, :50].max(axis=-1)).all()
        assert np.abs(late(row[[0, 2]]).real).max(axis=-1).min() > 1.7


def test_inside_small_circles_motions_tend_to_the_doubled_orbit_and_outside_to_a_large_one() -> (
    None
):
    s, rows = two(4)
    for row in rows:
        inner = nearest(row[1, [0, 2]], s.periodic)
        assert (inner[:, -50:].max(axis=-1) < 0.7 * inner[:, :50].max(axis=-1)).all()
        assert np.abs(late(row[0]).real).max(axis=-1).min() > 1.5


def test_below_the_figure_eight_one_large_circle_repels_and_one_attracts() -> None:
    s, rows = two(5)
    for row in rows:
        sides = late(row).real
        assert (np.abs(sides[:2, [0, 2]]).min(axis=-1) > 0.3).all()  # round one doubled point
        assert (np.abs(np.sign(sides[2]).mean(axis=-1)) < 0.7).all()  # round both
    doubled = nearest(rows[1][0], s.periodic)
    assert (doubled[:, -50:].max(axis=-1) < doubled[:, 100:150].max(axis=-1)).all()


def test_beyond_the_fold_of_circles_every_motion_tends_to_the_doubled_orbit() -> None:
    s, rows = two(6)
    for row in rows:
        assert nearest(row[..., -1], s.periodic).max() < 0.03


def test_error_of_motions_next_to_1_2_falls_with_size(monkeypatch: pytest.MonkeyPatch) -> None:
    missed = []
    for size in (0.3, 0.075):  # w0 is halved
        monkeypatch.setattr(TwoFlow, "size", size)
        monkeypatch.setattr(TwoFlow, "starts", 1)
        monkeypatch.setattr(TwoFlow, "duration", property(lambda flow: 4.0 * flow.iterates))
        flow = flow_at(double_of_set_c("R2_1").normal_form)
        s = unfolding._sector(SET, start_of("R2_1"), flow, flow.places()[2])
        missed.append(np.abs(s.simulated - s.predicted).max())
    assert missed[0] < 0.05
    assert missed[1] < 0.4 * missed[0]


# ---- portraits at 1:1 ------------------------------------------------------------------------


def one(number: int) -> tuple[Sector, tuple[np.ndarray, np.ndarray]]:
    s = around("R1_1").sectors[number - 1]
    return s, both(s)


def test_without_fixed_points_every_motion_leaves() -> None:
    _, rows = one(1)
    for row in rows:
        assert np.isnan(row[..., -1]).all()


def test_beside_the_unstable_focus_motions_grow_until_they_leave() -> None:
    s, rows = one(2)
    for row in rows:
        inner = nearest(row[1, 2], s.periodic[:1])  # from x = -0.75
        assert inner[40:80].max() > 1.1 * inner[:40].max()
        assert np.isnan(np.delete(row.reshape(12, -1), 6, axis=0)[:, -1]).all()


def test_the_circle_that_repels_divides_what_is_attracted_from_what_leaves() -> None:
    s, (predicted, simulated) = one(3)
    for row in (predicted, simulated):
        inner = nearest(row[1, 2], s.periodic[:1])
        assert inner[-50:].max() < 0.5 * inner[:50].max()
        assert np.isnan(row[1, 0, -1])  # next to the saddle
        assert np.isnan(row[1, 1, -1])
    np.testing.assert_array_equal(np.isnan(predicted[..., -1]), np.isnan(simulated[..., -1]))


def test_beyond_the_homoclinic_orbit_the_focus_attracts_motions_from_next_to_the_saddle() -> None:
    s, (predicted, simulated) = one(4)
    for row in (predicted, simulated):
        ends = nearest(row[..., -1], s.periodic[:1])
        assert (ends[:2] < 0.05).all()
    np.testing.assert_array_equal(np.isnan(predicted[..., -1]), np.isnan(simulated[..., -1]))


@pytest.mark.slow
def test_a_motion_held_on_the_manifold_obeys_the_half_map_to_less_than_a_thousandth(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    flow = flow_at(double_of_set_c("R1_1").normal_form)
    changes = []
    changed: Callable[..., np.ndarray] = OnManifold._changed

    def noted(self: OnManifold, x: np.ndarray, first: int, far: float) -> np.ndarray:
        assert self.outer > 1.6
        y = changed(self, x, first, far)
        if first > STRIDE:  # not the start
            changes.append(np.abs(y - x).max() / (2.0 * flow.amplitude))
        return y

    monkeypatch.setattr(OnManifold, "_changed", noted)
    for place in flow.places()[1:3]:
        unfolding._sector(SET, start_of("R1_1"), flow, place)
    assert len(changes) > 300
    assert max(changes) < 1e-3  # in motions that leave
    assert np.median(changes) < 1e-5


# ---- report ----------------------------------------------------------------------------------


@pytest.mark.parametrize(("label", "sectors"), [("R2_1", 6), ("R1_1", 4)])
def test_figure_and_caption_show_every_sector(label: str, sectors: int) -> None:
    found = around(label)
    figure = figures.redraw(unfolding.unfolding_data(found, 5, SET, Plan()))
    assert len(figure.axes) == 1 + 2 * sectors
    labels = [line.get_label() for line in figure.axes[0].lines]
    assert {line.words for line in found.flow.lines()} <= set(labels)
    for i in range(1, sectors + 1):
        assert f"({i})" in _around(found)
