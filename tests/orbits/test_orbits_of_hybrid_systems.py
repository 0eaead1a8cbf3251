"""Orbits, branches, curves and sweeps of hybrid systems, against closed forms."""

from __future__ import annotations

import math

import numpy as np
import pytest

import vibroimpact as vi
from vibroimpact.orbits.maps import full_map

EPS = np.finfo(float).eps


def buck(
    supply: float = 3.0, load: float = 1.0, peak: float = 1.0, period: float = 1.0
) -> vi.HybridSystem:
    """A buck converter in continuous conduction whose switch opens at a peak current and closes at a clock.

    States: the current through an inductance of 1, and the clock. With m1 = supply - load and m2 = load, the
    current of one clock to the next is i -> peak - m2 (period - (peak - i) / m1), of slope -m2 / m1.
    """
    still = [[0.0, 0.0], [0.0, 0.0]]
    tick = [0.0, -1.0]
    return vi.HybridSystem(
        modes={
            "on": vi.LinearMode(still, [supply - load, 1.0 / period]),
            "off": vi.LinearMode(still, [-load, 1.0 / period]),
        },
        guards={"peak": vi.LinearGuard([1.0, 0.0], peak), "clock": vi.LinearGuard([0.0, 1.0], 1.0)},
        transitions=(
            vi.Transition("on", "peak", "rising", "off"),
            vi.Transition("off", "clock", "rising", "on", shift=tick),
            vi.Transition("on", "clock", "rising", "on", shift=tick),
        ),
    )


def wheel(slope: float = 0.08, spoke: float = math.pi / 8) -> vi.HybridSystem:
    """A rimless wheel with theta'' = theta; the next spoke strikes at theta = slope + spoke.

    There theta falls by 2 spoke, and the speed by cos 2 spoke [mcgeer1990].
    """
    fall = [[1.0, 0.0], [0.0, np.cos(2.0 * spoke)]]
    return vi.HybridSystem(
        modes={"stance": vi.LinearMode([[0.0, 1.0], [1.0, 0.0]])},
        guards={"heel": vi.LinearGuard([1.0, 0.0], slope + spoke)},
        transitions=(
            vi.Transition(
                "stance", "heel", "rising", "stance", matrix=fall, shift=[-2.0 * spoke, 0.0]
            ),
        ),
    )


CONVERTER, WHEEL = vi.Family(buck), vi.Family(wheel)
START = vi.State((0.5, 0.0), (0.0, 0.0))


@pytest.fixture(scope="module")
def orbit() -> vi.Orbit:
    return vi.find_orbit(CONVERTER, vi.simulate(CONVERTER, START, t_max=60.0))


@pytest.fixture(scope="module")
def branch(orbit: vi.Orbit) -> vi.Branch:
    return vi.continue_orbit(orbit, "load", (0.5, 1.9), inadmissible=True)


def test_a_run_of_a_hybrid_system_is_that_of_simulate_hybrid() -> None:
    given = vi.simulate_hybrid(CONVERTER.build(), "on", START.position, t_max=20.3)
    run = vi.simulate(CONVERTER, START, t_max=20.3)
    # errors of earlier times halve at every clock
    np.testing.assert_allclose(run.time, given.time, rtol=8 * EPS)
    np.testing.assert_allclose(run.position, given.after, atol=16 * EPS * 3.0)
    names = [*CONVERTER.build().modes]
    assert [names[k] for k in run.states[:-1, 0]] == [*given.modes[1:-1]]


def test_the_multiplier_of_a_converter_is_minus_the_ratio_of_its_slopes(orbit: vi.Orbit) -> None:
    assert orbit.converged
    assert abs(orbit.period - 1.0) <= 4 * EPS
    np.testing.assert_allclose(orbit.multipliers, [-0.5], rtol=8 * EPS)
    valley = 1.0 / (1.0 + 2.0)  # with duty d: 2 d = (1 - d), i falls from 1 by 1 - d = 2 / 3
    np.testing.assert_allclose(orbit.states[:, 0].min(), valley, rtol=8 * EPS)
    np.testing.assert_allclose(np.linalg.eigvals(full_map(orbit).jacobian()), [-0.5], rtol=8 * EPS)


def test_a_converter_doubles_its_period_at_half_the_supply(branch: vi.Branch) -> None:
    (point,) = branch.special_points
    assert point.label == "PD1"
    assert abs(point.parameters["load"] - 1.5) <= 1e-12
    refusal = point.normal_form  # the map is linear: no term decides
    assert refusal.status.name == "DEGENERATE"


def test_the_curve_of_period_doublings_of_a_converter_is_a_line(branch: vi.Branch) -> None:
    bounds = ((0.5, 3.0), (2.0, 5.0))
    curve = vi.continue_bifurcation(branch.special_points[0], ("load", "supply"), bounds)
    assert np.abs(curve.values[:, 0] - curve.values[:, 1] / 2.0).max() <= 1e-12
    assert np.ptp(curve.values[:, 1]) >= 3.0 - 1e-12


def map_of_converter(current: float, load: float) -> tuple[float, float]:
    """Current from one clock to the next, and the slope of this map."""
    up = 3.0 - load
    if current + up < 1.0:
        return current + up, 1.0
    return 1.0 - load * (1.0 - (1.0 - current) / up), -load / up


def test_the_exponent_of_a_chaotic_converter_is_that_of_its_map() -> None:
    current, logs = 0.5, list[float]()
    for _ in range(20_000):
        current, slope = map_of_converter(current, 1.8)
        logs.append(math.log(abs(slope)))
    found = vi.lyapunov_exponent(CONVERTER.replace(load=1.8), START, impacts=20_000)
    blocks = np.array(logs).reshape(50, -1).mean(axis=1)
    assert abs(found.value - np.mean(logs)) <= 4.0 * (found.error + blocks.std() / math.sqrt(50.0))


def test_a_sweep_of_a_converter_has_the_exponents_of_its_slopes() -> None:
    loads = np.array([0.5, 0.9, 1.3])
    found = vi.sweep(
        CONVERTER, over={"load": loads}, start=START, observe="lyapunov", settle_periods=100,
        periods=60, progress=False,
    )  # fmt: skip
    np.testing.assert_allclose(found.lyapunov, np.log(loads / (3.0 - loads)), atol=0.05)


def test_a_section_at_changes_has_the_peak_of_a_converter() -> None:
    found = vi.section(CONVERTER, START, at=vi.AtChange(0, vi.ModeSwitchState.MODE_1), points=30)
    np.testing.assert_allclose(found.x1, 1.0, rtol=4 * EPS)


def test_a_rimless_wheel_walks_at_the_speed_of_its_closed_form() -> None:
    """With c = cos 2 spoke, w^2 becomes c^2 (w^2 + 4 slope spoke) from impact to impact."""
    run = vi.simulate(WHEEL, vi.State((0.08 - math.pi / 8, 0.8), (0.0, 0.0)), t_max=60.0)
    steps = run.position[:, 1] ** 2
    lost = math.cos(math.pi / 4) ** 2
    np.testing.assert_allclose(steps[1:-1], lost * (steps[:-2] + 0.32 * math.pi / 8), rtol=64 * EPS)
    orbit = vi.find_orbit(WHEEL, run)
    speed = math.sqrt(lost * 0.32 * math.pi / 8 / (1.0 - lost))
    np.testing.assert_allclose(orbit.states[0, :2], [0.08 - math.pi / 8, speed], rtol=16 * EPS)
    # the section is all of space, as the state is reset: a multiplier zero along the flow
    np.testing.assert_allclose(orbit.multipliers, [lost, 0.0], atol=64 * EPS)


@pytest.mark.slow
def test_a_rimless_wheel_slows_down_where_its_speed_brings_it_upright_only() -> None:
    """w = a, where a = spoke - slope, at slope = spoke (3 - 2 sqrt 2) for spoke = pi / 8: an infinite period T.

    theta + theta' grows by exp(T) from w - a to b + sqrt(b^2 + w^2 - a^2), where b = slope + spoke. A flight multiplies
    rounding by exp(T), which is an error of w and of the slope beside that of a node, 1e-13; both change T by exp(T).
    Panels of the branch are as long as elsewhere while EPS exp(2 T) is below 1e-8, the tolerance of their expansions.
    """
    run = vi.simulate(WHEEL, vi.State((0.08 - math.pi / 8, 0.8), (0.0, 0.0)), t_max=60.0)
    branch = vi.continue_orbit(vi.find_orbit(WHEEL, run), "slope", (0.01, 0.1))
    spoke, last = math.pi / 8, math.pi / 8 * (3.0 - 2.0 * math.sqrt(2.0))
    slowest = int(np.argmin(branch.values))
    assert branch.values[slowest] > last
    assert branch.orbit(slowest).period >= 0.5 * math.log(1e-8 / EPS)
    for k in (slowest, *range(0, len(branch.values), 40)):
        slope = float(branch.values[k])
        w, a, b = math.sqrt(4.0 * slope * spoke), spoke - slope, slope + spoke
        period = math.log((b + math.sqrt(b * b + w * w - a * a)) / (w - a))
        grown = math.exp(period)
        assert abs(branch.orbit(k).period - period) <= (1e-13 + EPS * grown) * grown
    assert "did not converge" not in repr(branch)  # as rounding is no failure of Newton's iteration


@pytest.mark.parametrize(
    ("path", "value"),
    [("guards.peak.level", 1.0), ("modes.off.constant[0]", -1.0), ("transitions[1].shift[1]", -1.0)],
)  # fmt: skip
def test_numbers_of_a_hybrid_system_are_parameters_by_path(
    path: str, value: float, orbit: vi.Orbit
) -> None:
    system = buck()
    own = vi.find_orbit(system, orbit)
    assert own.converged
    moved = vi.continue_orbit(own, path, (value - 0.1, value + 0.1))
    assert np.ptp(moved.values) >= 0.2 - 1e-9
    other = system.replace({path: value + 0.05})
    assert own.multipliers == pytest.approx([-0.5])
    expected = -0.95 / 2.0 if path.startswith("modes") else -0.5  # it falls by 0.95 then
    np.testing.assert_allclose(vi.find_orbit(other, own).multipliers, [expected], rtol=1e-12)


def test_a_hybrid_system_begins_in_its_first_mode_and_is_kept_in_a_text() -> None:
    system = buck().beginning_in("off")
    assert vi.simulate(system, START, t_max=0.5).states[0, 0] == vi.ModeSwitchState.MODE_0
    assert vi.simulate(system, START, t_max=0.5).position[-1, 0] == pytest.approx(0.0)
    again = vi.find_orbit(system.mechanism, vi.simulate(system, START, t_max=60.0))
    np.testing.assert_allclose(again.multipliers, [-0.5], rtol=8 * EPS)


def test_a_system_beyond_seven_modes_is_refused_but_for_simulate_hybrid() -> None:
    modes = {f"m{k}": vi.LinearMode([[-1.0]]) for k in range(8)}
    system = vi.HybridSystem(modes=modes, guards={"level": vi.LinearGuard([1.0], 0.5)})
    assert vi.simulate_hybrid(system, "m7", [1.0], t_max=1.0).modes[0] == "m7"
    with pytest.raises(vi.InvalidParameterError, match=r"at most 7 modes .* simulate_hybrid"):
        vi.simulate(system, vi.State((1.0,), (0.0,)), t_max=1.0)
