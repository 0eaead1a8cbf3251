"""Hybrid systems as data in other units: powers of two give the same bits, others the same to rounding."""

from __future__ import annotations

from collections import Counter

import numpy as np
import pytest

import vibroimpact as vi

Start = tuple[vi.HybridSystem, str, np.ndarray, float, float]  # with the phase and t_max


def random_system(seed: int) -> Start:
    """Modes with full, sparse or no matrices, pushes, waves, guards on lines and sums, resets and relays."""
    rng = np.random.default_rng(seed)
    n, lines = int(rng.integers(1, 5)), int(rng.integers(0, 3))
    size, rate = 2.0 ** rng.uniform(-6, 6, n), 2.0 ** rng.uniform(-8, 8)
    names = "abc"[: int(rng.integers(2, 4))]
    relay = rng.random() < 0.5  # modes that differ by what pushes them alone: they may slide
    shared = rng.normal(size=(n, n)) - 1.5 * np.eye(n), rng.normal(size=(n, 2 * lines))

    def mode() -> vi.LinearMode:
        b, waves = shared
        if not relay:
            b = rng.normal(size=(n, n)) * (rng.random((n, n)) < rng.choice([0.0, 0.4, 1.0]))
            b = float(rng.choice([1.0, 1.0, 1e3])) * b - 0.5 * np.eye(n) * rng.integers(0, 2)
            waves = rng.normal(size=(n, 2 * lines)) * (rng.random((n, 2 * lines)) < 0.5)
        push = 2.0 * rng.normal(size=n) * (rng.random(n) < 0.7)
        return vi.LinearMode(
            b * size[:, None] / size * rate, push * size * rate, waves * size[:, None] * rate
        )

    def guard(k: int) -> vi.LinearGuard:
        row = rng.normal(size=n) if k else np.eye(n)[int(rng.integers(n))]
        waves = rng.normal(size=2 * lines) * (rng.random() < 0.3)
        return vi.LinearGuard(row / size, float(rng.normal() * (k or rng.integers(0, 2))), waves)

    modes = {name: mode() for name in names}
    guards = {f"g{k}": guard(k) for k in range(2)}
    transitions = [
        vi.Transition("a", "g0", "rising", "b"),
        vi.Transition("b", "g0", "falling", "a"),
    ]
    for name in names:
        if (name, "g0") not in {(t.mode, t.guard) for t in transitions}:
            transitions.append(vi.Transition(name, "g0", "falling", "a"))
        matrix = shift = None
        if rng.random() < 0.5:
            matrix = 0.7 * np.diag(rng.normal(size=n))
            shift = size * rng.normal(size=n) * rng.integers(0, 2)
        to = str(rng.choice(list(names)))
        transitions.append(
            vi.Transition(name, "g1", str(rng.choice(["rising", "falling"])), to, matrix, shift)
        )  # type: ignore[arg-type]
    omegas = tuple((rate * rng.uniform(0.1, 3.0, lines)).tolist())
    system = vi.HybridSystem(modes, guards, tuple(transitions), omegas)
    start = size * rng.normal(size=n) * (rng.random(n) < 0.8)
    return system, "a", start, float(rng.uniform(0.0, 6.0)), 10.0 / rate


def in_units(of: Start, states: np.ndarray, time: float) -> Start:
    """The same in units so many times smaller."""
    system, mode, start, phase, t_max = of
    modes = {
        k: vi.LinearMode(
            m.matrix * states[:, None] / states / time, m.constant * states / time,
            m.waves * states[:, None] / time,
        )
        for k, m in system.modes.items()
    }  # fmt: skip
    guards = {k: vi.LinearGuard(g.row / states, g.level, g.waves) for k, g in system.guards.items()}
    transitions = tuple(
        vi.Transition(
            t.mode,
            t.guard,
            t.direction,
            t.to,
            t.matrix * states[:, None] / states,
            t.shift * states,
        )
        for t in system.transitions
    )
    omegas = tuple(w / time for w in system.omegas)
    return (
        vi.HybridSystem(modes, guards, transitions, omegas),
        mode,
        start * states,
        phase,
        t_max * time,
    )


def simulated(of: Start, events: int = 60) -> vi.HybridRun:
    system, mode, start, phase, t_max = of
    return vi.simulate_hybrid(system, mode, start, phase=phase, t_max=t_max, events=events)


@pytest.mark.parametrize("seeds", [range(60), pytest.param(range(60, 400), marks=pytest.mark.slow)])
def test_powers_of_two_as_units_change_no_bit_no_status_and_no_event(seeds: range) -> None:
    ends = Counter[str]()
    slid = 0
    for seed in seeds:
        of = random_system(seed)
        rng = np.random.default_rng(10_000 + seed)
        n = len(of[2])
        states = 2.0 ** rng.integers(-40, 41, n).astype(float)
        time = 2.0 ** float(rng.integers(-40, 41))
        run, other = simulated(of), simulated(in_units(of, states, time))
        assert (other.modes, other.guard, other.end) == (run.modes, run.guard, run.end), seed
        np.testing.assert_array_equal(other.status, run.status)
        np.testing.assert_array_equal(other.time / time, run.time)
        np.testing.assert_array_equal(other.before / states, run.before)
        np.testing.assert_array_equal(other.after / states, run.after)
        t = np.linspace(0.0, float(run.time[-1]), 7)
        np.testing.assert_array_equal(other.at(t * time) / states, run.at(t))
        ends[run.end.name] += 1
        slid += any("|" in name for name in run.modes[:-1])
    assert slid >= len(seeds) // 60
    assert ends["HORIZON"] + ends["EVENTS"] >= len(seeds) // 2, ends


@pytest.mark.parametrize("seeds", [range(40), pytest.param(range(40, 200), marks=pytest.mark.slow)])
def test_micrometres_and_years_give_the_same_motion_to_rounding(seeds: range) -> None:
    """Where 2^-44 of the start moves times by less than 1e-10: then 2^-50 by units moves them by less than 1e-11."""
    compared = 0
    for seed in seeds:
        of = random_system(seed)
        states = 10.0 ** np.random.default_rng(seed).integers(-9, 10, len(of[2])).astype(float)
        run, other = simulated(of, 12), simulated(in_units(of, states, 3.2e7), 12)
        near = simulated((*of[:2], of[2] * (1.0 + 2.0**-44), *of[3:]), 12)
        if run.end == vi.RunEnd.DIVERGED or near.modes != run.modes:
            continue
        last = float(run.time[-1])
        if np.abs(near.time - run.time).max() > 1e-10 * last:
            continue
        assert other.modes == run.modes, seed
        np.testing.assert_array_equal(other.status, run.status)
        moves = (
            run.status != vi.Status.GRAZING
        )  # a rest on a guard is said whenever the search is resumed
        np.testing.assert_allclose(
            other.time[moves] / 3.2e7, run.time[moves], rtol=1e-11, atol=1e-11 * last
        )
        compared += 1
    assert compared >= len(seeds) // 2


@pytest.mark.parametrize("stiffness", [2e6, 1e10, 1e14])
def test_a_mode_that_is_never_entered_does_not_set_the_step_of_a_fall(stiffness: float) -> None:
    """Closed forms: the fall, then half a period of the undamped spring about -g / k, at rate sqrt(k)."""
    g = 9.8e-3
    system = vi.HybridSystem(
        modes={
            "air": vi.LinearMode([[0.0, 1.0], [0.0, 0.0]], [0.0, -g]),
            "stop": vi.LinearMode([[0.0, 1.0], [-stiffness, 0.0]], [0.0, -g]),
        },
        guards={"floor": vi.LinearGuard([1.0, 0.0])},
        transitions=(
            vi.Transition("air", "floor", "falling", "stop"),
            vi.Transition("stop", "floor", "rising", "air"),
        ),
    )
    never = vi.simulate_hybrid(system, "air", [1.0, 0.0], t_max=14.0)
    assert (never.end, len(never)) == (vi.RunEnd.HORIZON, 1)
    run = vi.simulate_hybrid(system, "air", [1.0, 0.0], t_max=100.0)
    fall, speed, root = np.sqrt(2.0 / g), np.sqrt(2.0 * g), np.sqrt(stiffness)
    pressed = (np.pi + 2.0 * np.arctan(g / root / speed)) / root
    np.testing.assert_allclose(run.time[0], fall, rtol=8 * 2.0**-53)
    np.testing.assert_allclose(np.diff(run.time)[:3], [pressed, 2.0 * fall, pressed], rtol=1e-7)
    np.testing.assert_allclose(
        run.time[1:4], fall + np.cumsum([pressed, 2.0 * fall, pressed]), rtol=2e-13
    )


@pytest.mark.parametrize("t_max", [6.0, np.inf])
@pytest.mark.parametrize("omega", [1e-5, 1e-8, 1e-12, 1e-20, 1e-100])
def test_a_force_as_slow_as_one_likes_leaves_a_fall_as_it_is(omega: float, t_max: float) -> None:
    """The force omega t adds omega t^3 / 6 < 0.016 omega to the height: times change by less than omega / 50."""
    system = vi.HybridSystem(
        modes={
            "air": vi.LinearMode([[0.0, 1.0], [0.0, 0.0]], [0.0, -9.8], [[0.0, 0.0], [1.0, 0.0]])
        },
        guards={"floor": vi.LinearGuard([1.0, 0.0])},
        transitions=(vi.Transition("air", "floor", "falling", "air", [[1.0, 0.0], [0.0, -0.9]]),),
        omegas=(omega,),
    )
    run = vi.simulate_hybrid(system, "air", [1.0, 0.0], t_max=t_max, events=11)
    first = np.sqrt(2.0 / 9.8)
    expected = first * (1.0 + 2.0 * np.cumsum(np.r_[0.0, 0.9 ** np.arange(1.0, 11.0)]))
    np.testing.assert_allclose(run.time[0], first, rtol=4 * 2.0**-53, atol=omega / 50.0)
    np.testing.assert_allclose(run.time, expected, rtol=64 * 2.0**-53, atol=10.0 * omega)


def test_a_mode_too_fast_for_the_one_at_the_start_is_refused_by_name() -> None:
    system = vi.HybridSystem(
        modes={"slow": vi.LinearMode([[-1.0]], [1.0]), "fast": vi.LinearMode([[-1e14]])},
        guards={"g": vi.LinearGuard([1.0], 0.5)},
        transitions=(vi.Transition("slow", "g", "rising", "fast"),),
    )
    with pytest.raises(
        vi.InvalidParameterError, match=r"mode 'fast' has the rate .* that of the mode"
    ):
        vi.simulate_hybrid(system, "slow", [0.0], t_max=5.0)
