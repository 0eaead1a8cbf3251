"""Hybrid systems as data: a relay, a ball, a converter, each with another derivation of its times."""

from __future__ import annotations

import itertools
import math

import numpy as np
import pytest
from scipy.linalg import expm
from scipy.optimize import brentq

import vibroimpact as vi
from vibroimpact.compile.sliding import GivenSystem
from vibroimpact.compile.units import units_of

ULPS = 64 * 2.0**-53


def relay(levels: tuple[float, float] = (1.0, 2.0)) -> vi.HybridSystem:
    low, high = levels
    return vi.HybridSystem(
        modes={"on": vi.LinearMode([[-1.0]], [3.0]), "off": vi.LinearMode([[-1.0]])},
        guards={"upper": vi.LinearGuard([1.0], high), "lower": vi.LinearGuard([1.0], low)},
        transitions=(
            vi.Transition("on", "upper", "rising", "off"),
            vi.Transition("off", "lower", "falling", "on"),
        ),
    )


def test_a_relay_switches_at_the_times_of_its_closed_form() -> None:
    run = vi.simulate_hybrid(relay((1.0, 2.5)), "on", [1.0], events=20)
    rise, fall = math.log(2.0 / 0.5), math.log(2.5 / 1.0)
    np.testing.assert_allclose(np.diff(run.time)[::2], fall, rtol=ULPS)
    np.testing.assert_allclose(np.diff(run.time)[1::2], rise, rtol=ULPS)
    assert run.modes[:3] == ("on", "off", "on")
    assert set(run.guard[::2]) == {"upper"}


def test_a_guard_beyond_its_level_at_the_start_is_crossed_at_once() -> None:
    run = vi.simulate_hybrid(relay(), "on", [2.7], t_max=0.1)
    assert run.time[0] == 0.0
    assert run.modes[1] == "off"
    np.testing.assert_allclose(run.at(0.1), 2.7 * math.exp(-0.1), rtol=ULPS)


@pytest.mark.parametrize("names", ["gh", "hg"])
@pytest.mark.parametrize("start", [0.0, 1.5])
def test_of_two_guards_reached_at_one_instant_the_one_given_first_decides(
    names: str, start: float
) -> None:
    first = {
        "g": vi.Transition("a", "g", "rising", "b"),
        "h": vi.Transition("a", "h", "rising", "c"),
    }
    system = vi.HybridSystem(
        modes={name: vi.LinearMode([[0.0]], [1.0]) for name in "abc"},
        guards={"g": vi.LinearGuard([1.0], 1.0), "h": vi.LinearGuard([2.0], 2.0)},
        transitions=tuple(first[name] for name in names),
    )
    run = vi.simulate_hybrid(system, "a", [start], t_max=2.0)
    assert run.modes[1] == {"g": "b", "h": "c"}[names[0]]


@pytest.mark.parametrize("names", ["gh", "hg"])
@pytest.mark.parametrize("rate", [0.9, 2.3, 13.0])
@pytest.mark.parametrize("faster", [1.0, 16.0])
@pytest.mark.one_in(5)
def test_of_guards_due_on_either_side_of_the_end_of_a_step_the_one_given_first_decides(
    names: str, rate: float, faster: float
) -> None:
    # x' = 1 beside a swing that sets the step: x reaches its level within some ulp of the end of a step,
    # and 3 x three times the level, rounded otherwise. The unit of time is that of the mode of the start.
    first = {
        "g": vi.Transition("a", "g", "rising", "b"),
        "h": vi.Transition("a", "h", "rising", "c"),
    }

    def swing(rate: float) -> vi.LinearMode:
        return vi.LinearMode(
            [[0.0, 0.0, 0.0], [0.0, 0.0, rate], [0.0, -rate, 0.0]], [1.0, 0.0, 0.0]
        )

    def system(begin: float, ulps: int) -> vi.HybridSystem:
        return vi.HybridSystem(
            modes=dict.fromkeys("abc", swing(rate)) | {"start": swing(faster * rate)},
            guards={
                "begin": vi.LinearGuard([1.0, 0.0, 0.0], begin),
                "g": vi.LinearGuard([1.0, 0.0, 0.0], 1.0),
                "h": vi.LinearGuard([3.0, 0.0, 0.0], 3.0 * (1.0 + ulps * 2.0**-52)),
            },
            transitions=(
                vi.Transition("start", "begin", "rising", "a"),
                *(first[name] for name in names),
            ),
        )

    after = set()
    for ulps, steps in itertools.product((-2, -1, 0, 1, 2), (1, 3, 8)):
        one = system(0.5, ulps)
        units = units_of(one, "start", np.array([0.0, 0.1, 0.0]), 50.0)
        end = steps * GivenSystem(one, units).steps[0] * units.time
        for shift in range(-4, 5):
            begin = 1.0 - end + shift * 2.0**-53
            start = [begin - 1e-3, 0.1, 0.0]
            run = vi.simulate_hybrid(system(begin, ulps), "start", start, t_max=50.0)
            after.add(run.modes[2])
    assert after == {first[names[0]].to}


def test_rest_on_a_guard_is_no_chain_of_touches() -> None:
    # x' = 0.1 - x stays on its level beside a swing that comes so near to another guard that every
    # step is examined, more than 4096 of them
    turning = vi.LinearMode([[-1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, -1.0, 0.0]], [0.1, 0.0, 0.0])
    system = vi.HybridSystem(
        modes={"a": turning, "b": turning},
        guards={"g": vi.LinearGuard([1.0, 0.0, 0.0], 0.1),
                "h": vi.LinearGuard([0.0, 1.0, 0.0], 1.0 + 1e-6)},
        transitions=(vi.Transition("a", "g", "rising", "b"), vi.Transition("a", "h", "rising", "b")),
    )  # fmt: skip
    run = vi.simulate_hybrid(system, "a", [0.1, 1.0, 0.0], t_max=1e4)
    assert list(run.status) == [vi.Status.HORIZON]
    assert run.time[-1] == 1e4
    np.testing.assert_allclose(run.at(1e4)[0], 0.1, rtol=ULPS)


def test_a_transition_that_would_never_happen_is_refused() -> None:
    twice = vi.Transition("a", "g", "rising", "a"), vi.Transition("a", "g", "rising", "b")
    with pytest.raises(
        vi.InvalidParameterError, match=r"transitions\[1\]: mode 'a'.*'g' is rising"
    ):
        vi.HybridSystem(
            modes={name: vi.LinearMode([[0.0]], [1.0]) for name in "ab"},
            guards={"g": vi.LinearGuard([1.0], 1.0)}, transitions=twice,
        )  # fmt: skip


def test_a_motion_that_only_touches_a_level_stays_in_its_mode() -> None:
    turning = vi.LinearMode([[0.0, 1.0], [-1.0, 0.0]])
    system = vi.HybridSystem(
        modes={"a": turning, "b": turning},
        guards={"top": vi.LinearGuard([1.0, 0.0], 1.0)},
        transitions=(vi.Transition("a", "top", "rising", "b"),),
    )
    run = vi.simulate_hybrid(system, "a", [0.0, 1.0], t_max=7.0)
    assert set(run.modes) == {"a"}
    assert run.status[0] == vi.Status.GRAZING
    higher = vi.simulate_hybrid(system, "a", [0.0, 1.0 + 1e-12], t_max=7.0)
    assert "b" in higher.modes


def test_a_ball_with_restitution_as_a_reset_lands_after_a_geometric_series() -> None:
    ball = vi.HybridSystem(
        modes={"air": vi.LinearMode([[0.0, 1.0], [0.0, 0.0]], [0.0, -1.0])},
        guards={"floor": vi.LinearGuard([1.0, 0.0])},
        transitions=(
            vi.Transition("air", "floor", "falling", "air", [[1.0, 0.0], [0.0, -0.5]]),
        ),
    )  # fmt: skip
    run = vi.simulate_hybrid(ball, "air", [0.5, 0.0], events=30)
    np.testing.assert_allclose(run.time, 3.0 - 2.0 ** (1.0 - np.arange(30.0)), rtol=ULPS)


V, L, C, R, PERIOD, DUTY = 10.0, 1.0, 20.0, 3.0, 4.0, 0.3


def converter() -> vi.HybridSystem:
    """A buck converter with a diode, switched by a clock: state (current, voltage)."""
    charging = np.array([[0.0, -1.0 / L], [1.0 / C, -1.0 / (R * C)]])
    idle = np.array([[0.0, 0.0], [0.0, -1.0 / (R * C)]])
    begin, end = 0.0, 2.0 * math.pi * DUTY
    sines = [np.array([math.cos(p), -math.sin(p)]) for p in (begin, end)]  # sin(theta - p)
    zero = [0.0, 0.0]
    return vi.HybridSystem(
        modes={
            "on": vi.LinearMode(charging, [V / L, 0.0]),
            "diode": vi.LinearMode(charging),
            "idle": vi.LinearMode(idle),
        },
        guards={
            "begin": vi.LinearGuard(zero, 0.0, sines[0]),
            "end": vi.LinearGuard(zero, 0.0, sines[1]),
            "empty": vi.LinearGuard([1.0, 0.0]),
        },
        transitions=(
            vi.Transition("on", "end", "rising", "diode"),
            vi.Transition("diode", "empty", "falling", "idle", [[0.0, 0.0], [0.0, 1.0]]),
            vi.Transition("idle", "begin", "rising", "on"),
        ),
        omegas=(2.0 * math.pi / PERIOD,),
    )


def flown(matrix: np.ndarray, constant: np.ndarray, y: np.ndarray, t: float) -> np.ndarray:
    whole = np.zeros((3, 3))
    whole[:2, :2], whole[:2, 2] = matrix, constant
    return (expm(whole * t) @ [*y, 1.0])[:2]


def test_a_converter_in_discontinuous_conduction_has_the_orbit_of_matrix_exponentials() -> None:
    system = converter()
    on, diode, idle = (system.modes[name] for name in ("on", "diode", "idle"))

    def period(voltage: float) -> tuple[float, float]:
        """Voltage after a period, and when the current ends."""
        y = flown(on.matrix, on.constant, np.array([0.0, voltage]), DUTY * PERIOD)
        rest = (1.0 - DUTY) * PERIOD
        empty = brentq(lambda t: flown(diode.matrix, diode.constant, y, t)[0], 1e-3, rest)
        y = flown(diode.matrix, diode.constant, y, empty)
        return float(flown(idle.matrix, idle.constant, y, rest - empty)[1]), empty

    voltage = brentq(lambda v: period(v)[0] - v, 3.2, 7.0, xtol=1e-14)
    assert 0.5 < DUTY + period(voltage)[1] / PERIOD < 1.0  # the guard "begin" is below its level
    start = [0.0, voltage]
    run = vi.simulate_hybrid(system, "on", start, phase=1e-300, t_max=40.0 * PERIOD)
    assert run.modes[:4] == ("on", "diode", "idle", "on")
    np.testing.assert_allclose(run.after[2::3, 1], voltage, rtol=1e-12)
    lengths = run.time[1::3] - run.time[:-1:3]
    np.testing.assert_allclose(lengths, period(voltage)[1], rtol=1e-11)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"modes": {}}, "modes = .*one LinearMode"),
        ({"modes": {"on": vi.LinearMode([[1.0, 2.0]])}}, "matrix has shape"),
        ({"transitions": (vi.Transition("on", "top", "rising", "off"),)}, "guard = 'top'"),
        ({"transitions": (vi.Transition("on", "upper", "up", "off"),)}, "direction = 'up'"),
        ({"guards": {"upper": vi.LinearGuard([1.0, 2.0])}}, r"guards\['upper'\].row"),
        ({"omegas": (0.0,)}, "omegas = 0.0: must be > 0"),
    ],
)
def test_what_does_not_fit_is_named(change: dict, message: str) -> None:  # type: ignore[type-arg]
    given = relay()
    parts = {"modes": given.modes, "guards": given.guards, "transitions": given.transitions}
    with pytest.raises(vi.InvalidParameterError, match=message):
        vi.HybridSystem(**(parts | change))
