"""Sliding modes of hybrid systems: Filippov's combination, against closed forms and other machines."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import vibroimpact as vi
from vibroimpact.plotting import plot_hybrid_run

STILL = np.zeros((2, 2))


def pair(
    below: vi.LinearMode, above: vi.LinearMode, row: list[float], **more: object
) -> vi.HybridSystem:
    """Two modes, one on either side of row . y = level."""
    level = float(more.pop("level", 0.0))  # type: ignore[arg-type]
    return vi.HybridSystem(
        modes={"below": below, "above": above},
        guards={"g": vi.LinearGuard(row, level)},
        transitions=(
            vi.Transition("below", "g", "rising", "above"),
            vi.Transition("above", "g", "falling", "below"),
        ),
        **more,  # type: ignore[arg-type]
    )


def relays() -> vi.HybridSystem:
    """x' = -+2, y' = 1.5 or -3 by the sign of x - y."""
    return pair(vi.LinearMode(STILL, [2.0, -3.0]), vi.LinearMode(STILL, [-2.0, 1.5]), [1.0, -1.0])


@pytest.mark.parametrize(
    ("mode", "start"), [("above", [1.0, 0.0]), ("below", [1.0, 0.0]), ("below", [0.0, 1.0])]
)
def test_two_relays_slide_on_each_other_at_the_speed_of_the_convex_combination(
    mode: str, start: list[float]
) -> None:
    """a = 5 / (5 + 3.5): both go at 2 - 4 a = -3 + 4.5 a = -6/17. A start on the wrong side crosses at once."""
    run = vi.simulate_hybrid(relays(), mode, start, t_max=4.0)
    assert run.modes[-1] == "below|above"
    met = 1.0 / 3.5 if start[0] > 0 else 0.2
    np.testing.assert_allclose(run.time[-2], met, rtol=4 * 2.0**-53)
    there = run.after[-2]
    t = np.array([1.0, 2.5, 4.0])
    expected = there[0] - 6.0 / 17.0 * (t - met)
    np.testing.assert_allclose(
        run.at(t), np.stack([expected, expected], axis=1), rtol=0, atol=2e-15
    )


def test_a_surface_that_is_crossed_is_no_sliding() -> None:
    """x' = 1 below, 2 above: crossed once, and back never."""
    system = pair(vi.LinearMode([[0.0]], [1.0]), vi.LinearMode([[0.0]], [2.0]), [1.0])
    run = vi.simulate_hybrid(system, "below", [-1.0], t_max=3.0)
    assert run.modes == ("below", "above", "above")
    np.testing.assert_allclose(run.after[-1], 4.0, rtol=4 * 2.0**-53)


MATRIX = np.array([[-1.0, 1.0, 0.0], [-2.0, 0.5, 1.0], [-1.0, 0.0, -0.3]])
PUSH, ROW = np.array([1.6, -1.8, 2.0]), np.array([1.0, 0.5, 0.8])


def test_a_relay_feedback_slides_by_the_equivalent_control_of_filippov() -> None:
    """Equivalent control u of c . (A y + b u + w) = 0, |u| <= 1, integrated by scipy from event to event."""
    system = pair(
        vi.LinearMode(MATRIX, PUSH, [[0.0, 0.0], [0.6, 0.0], [0.0, 0.3]]),
        vi.LinearMode(MATRIX, -PUSH, [[0.0, 0.0], [0.6, 0.0], [0.0, 0.3]]),
        ROW.tolist(), omegas=(1.3,),
    )  # fmt: skip
    run = vi.simulate_hybrid(system, "above", [1.5, 0.3, -0.4], t_max=30.0)
    assert {"below|above", "below", "above"} <= set(run.modes)

    def free(t: float, y: np.ndarray) -> np.ndarray:
        return MATRIX @ y + np.array([0.0, 0.6 * math.sin(1.3 * t), 0.3 * math.cos(1.3 * t)])

    def control(t: float, y: np.ndarray) -> float:
        return float(-(ROW @ free(t, y)) / (ROW @ PUSH))

    def below(_t: float, _y: np.ndarray) -> float:
        return 1.0

    def above(_t: float, _y: np.ndarray) -> float:
        return -1.0

    signs = {"below": below, "above": above, "below|above": control}
    times, at = [0.0, *run.time], run.start
    for k, mode in enumerate(run.modes[:-1]):
        law = signs[mode]
        part = solve_ivp(
            lambda t, y, law=law: free(t, y) + PUSH * law(t, y), times[k : k + 2], at, rtol=1e-12, atol=1e-13,
            method="DOP853",
        )  # fmt: skip
        at = part.y[:, -1]
        np.testing.assert_allclose(run.before[k], at, rtol=0, atol=1e-9)
        if k + 1 < len(run) and mode == "below|above":  # left where the control is at its limit
            assert math.isclose(abs(control(times[k + 1], run.before[k])), 1.0, rel_tol=1e-9)
        if mode == "below|above":
            inside = np.linspace(times[k], times[k + 1], 9)
            assert (
                max(abs(control(float(t), y)) for t, y in zip(inside, run.at(inside), strict=True))
                <= 1.0 + 1e-9
            )
            np.testing.assert_allclose(run.at(inside) @ ROW, 0.0, atol=64 * 2.0**-53)


@pytest.mark.parametrize("level", [1.0, 0.3])
def test_dry_friction_as_a_hybrid_system_is_the_machine_with_friction(level: float) -> None:
    omega, force, c = 0.7, 1.3, 0.1
    slip = [[0.0, 1.0], [-1.0, -c]]
    waves = [[0.0, 0.0], [force, 0.0]]
    system = pair(
        vi.LinearMode(slip, [0.0, level], waves), vi.LinearMode(slip, [0.0, -level], waves), [0.0, 1.0],
        omegas=(omega,),
    )  # fmt: skip
    run = vi.simulate_hybrid(system, "above", [0.0, 1.0], t_max=200.0)
    machine = vi.Mechanism(
        mass=[[1.0]], stiffness=[[1.0]], damping=[[c]], forces=(vi.Harmonic(omega, (force,)),),
        elements=(vi.Friction((1.0,), level),),
    )  # fmt: skip
    other = vi.simulate(
        machine, vi.State(position=(0.0,), velocity=(1.0,), phase=0.0), t_max=200.0, impacts=10_000
    )
    assert "below|above" in run.modes[:-1]
    changes = other.time[other.status == vi.Status.CHANGE]
    np.testing.assert_allclose(run.time[:-1], changes, rtol=0, atol=200.0 * 64 * 2.0**-53)


def test_a_combination_that_is_not_linear_is_said_with_its_share() -> None:
    """u' = 2 + y_2 below, -2 above; met at t = 0.5 with y_2 = 1.5 (1 - e^-0.5): a = u'_A / (u'_A + 2)."""
    system = pair(
        vi.LinearMode([[0.0, 1.0], [0.0, 0.0]], [2.0, -3.0]), vi.LinearMode([[0.0, 0.0], [0.0, -1.0]], [-2.0, 1.5]),
        [1.0, 0.0],
    )  # fmt: skip
    run = vi.simulate_hybrid(system, "above", [1.0, 0.0], t_max=3.0)
    assert run.end == vi.RunEnd.SLIDING
    share = (2.0 + 1.5 * (1.0 - math.exp(-0.5))) / (4.0 + 1.5 * (1.0 - math.exp(-0.5)))
    for word in ("'g'", "'below'", "'above'", f"{share:.6g}", f"{1 - share:.6g}"):
        assert word in run.reason
    np.testing.assert_allclose(run.time, [0.5], rtol=4 * 2.0**-53)


def test_sliding_on_two_guards_at_once_is_said_with_their_names() -> None:
    names = [a + b for a in "pn" for b in "pn"]
    fields = {n: [-1.0 if n[0] == "p" else 1.0, -2.0 if n[1] == "p" else 1.0] for n in names}
    flip = {"p": "n", "n": "p"}
    ways = {"p": "falling", "n": "rising"}
    system = vi.HybridSystem(
        modes={n: vi.LinearMode(STILL, f) for n, f in fields.items()},
        guards={"x": vi.LinearGuard([1.0, 0.0]), "y": vi.LinearGuard([0.0, 1.0])},
        transitions=tuple(
            t
            for n in names
            for t in (
                vi.Transition(n, "x", ways[n[0]], flip[n[0]] + n[1]),  # type: ignore[arg-type]
                vi.Transition(n, "y", ways[n[1]], n[0] + flip[n[1]]),  # type: ignore[arg-type]
            )
        ),
    )
    run = vi.simulate_hybrid(system, "pp", [0.5, 2.0], t_max=3.0)
    assert run.modes[1] == "np|pp"
    assert run.end == vi.RunEnd.STALLED
    assert "'x', 'y'" in run.reason
    assert "several at once" in run.reason


def test_a_guard_that_one_of_the_two_modes_does_not_know_ends_the_run() -> None:
    given = relays()
    system = vi.HybridSystem(
        modes=given.modes,
        guards={**given.guards, "low": vi.LinearGuard([1.0, 0.0], -1.0)},
        transitions=(*given.transitions, vi.Transition("above", "low", "falling", "below")),
    )
    run = vi.simulate_hybrid(system, "above", [1.0, 0.0], t_max=9.0)
    assert run.end == vi.RunEnd.SLIDING
    assert "'below' goes on, 'above' goes to 'below'" in run.reason
    np.testing.assert_allclose(run.before[-1], -1.0, rtol=8 * 2.0**-53)


def test_a_count_of_events_counts_what_a_user_sees() -> None:
    system = pair(
        vi.LinearMode([[0.0]], [3.0], [[1.0, 0.0]]),
        vi.LinearMode([[0.0]], [-0.5], [[1.0, 0.0]]),
        [1.0],
        omegas=(1.0,),
    )
    whole = vi.simulate_hybrid(system, "below", [-1.0], events=40)
    assert len(whole) == 40
    for events in (1, 2, 3, 7):
        run = vi.simulate_hybrid(system, "below", [-1.0], events=events)
        assert (run.end, run.modes) == (vi.RunEnd.EVENTS, whole.modes[: events + 1])
        np.testing.assert_array_equal(run.time, whole.time[:events])
    assert all(a != b for a, b in zip(whole.modes, whole.modes[1:], strict=False))


def test_a_drawing_shades_the_mode_that_slides() -> None:
    ax = plot_hybrid_run(vi.simulate_hybrid(relays(), "above", [1.0, 0.0], t_max=4.0))
    assert "below|above" in ax.get_legend_handles_labels()[1]
