"""Flight between events, exact to rounding at any time, against 50-digit references."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from support import UNIT
from support.flow import flown
from support.kernel import fly
from support.systems import damper_witness, oscillator, paper_damper, random_mechanism
from witness import damper as reference
from witness.precision import exact

import vibroimpact as vi
from vibroimpact.compile import hybrid
from vibroimpact.compile.hybrid import compile_mechanism

TIMES = [1e-9, 0.013, 0.7, 12.3, 1e4]
NEAR_ONE = [1.0 - 1e-14, 1.0, 1.0 + 1e-14, 1.0 - 2.0**-53, 1.0 + 2.0**-52]
ZETAS = [0.0, 1e-9, 0.045, 0.9, *NEAR_ONE, 1.5, 40.0]
LINE = vi.Harmonic(1.3, (1.0,), (0.4,))
STATE = vi.State((0.7,), (-0.4,), 0.6)


def tolerance(m: vi.Mechanism, sizes: list[float], t: float) -> float:
    """Rounding of a flight, relative to rate t radians of motion of these sizes.

    Every rate is compiled with a few roundings, so a phase of rate t radians is wrong by a few
    units in the last place: (64 + 8 rate t) unit roundoffs of the largest size on the way.
    """
    return UNIT * (64.0 + 8.0 * compile_mechanism(m).rate * t) * max(sizes)


def largest_errors(m: vi.Mechanism, state: vi.State, t: float) -> tuple[float, float]:
    """Error of (x, v / rate) after t, and its tolerance."""
    rate = compile_mechanism(m).rate
    x, v = fly(m, state, t)
    x_true, v_true = flown(m, state, t)
    errors = [abs(exact(a) - b) for a, b in zip(x[0], x_true, strict=True)]
    errors += [abs(exact(a) - b) / rate for a, b in zip(v[0], v_true, strict=True)]
    middle = [fly(m, state, t * k / 16.0) for k in range(17)]
    sizes = [float(np.max(np.abs(x)) + np.max(np.abs(v)) / rate) for x, v in middle]
    forced = sum(float(np.abs([*f.sine, *f.cosine]).max()) / rate**2 for f in m.forces)
    return float(max(errors)), tolerance(m, [*sizes, forced], t)


@pytest.mark.parametrize("zeta", ZETAS)
@pytest.mark.parametrize("t", TIMES)
def test_damped_oscillator_flies_to_rounding(zeta: float, t: float) -> None:
    m = oscillator(stiffness=0.25, damping=zeta, forces=(LINE,), constant_force=0.3)
    error, allowed = largest_errors(m, STATE, t)
    assert error <= allowed


FREE_MASS = oscillator(stiffness=0.0, damping=0.0, forces=(LINE,), constant_force=-0.3)
DRAGGED_MASS = oscillator(stiffness=0.0, damping=0.2, forces=(LINE,), constant_force=-0.3)
NEARLY_FREE = oscillator(stiffness=1e-12, damping=1e-9, forces=(LINE,), constant_force=-0.3)
THREE_LINES = oscillator(
    stiffness=0.81, damping=0.01,
    forces=(LINE, vi.Harmonic(0.31, (0.2,)), vi.Harmonic(2.7, (0.0,), (3.0,))),
)  # fmt: skip


@pytest.mark.parametrize("m", [FREE_MASS, DRAGGED_MASS, NEARLY_FREE, THREE_LINES])
@pytest.mark.parametrize("t", TIMES)
def test_free_masses_and_several_lines_fly_to_rounding(m: vi.Mechanism, t: float) -> None:
    error, allowed = largest_errors(m, STATE, t)
    assert error <= allowed


@pytest.mark.parametrize("t", [0.013, 0.7, 12.3, 300.0, 1e4])
@pytest.mark.parametrize(("n", "rank"), [(2, 1), (3, 3), (4, 2)])
@pytest.mark.parametrize("dense", [False, True])
@pytest.mark.one_in(3)
def test_non_proportional_damping_flies_to_rounding(
    n: int, rank: int, t: float, dense: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """In blocks, and by the full matrix."""
    if dense:
        monkeypatch.setattr(hybrid, "decoupled", lambda *_: None)
    monkeypatch.setattr(hybrid, "_compiled", hybrid._compiled.__wrapped__)
    monkeypatch.setattr(hybrid, "_hybrid", hybrid._hybrid.__wrapped__)
    rng = np.random.default_rng(100 * n + rank)
    m = random_mechanism(rng, n, stiff_rank=rank)
    assert compile_mechanism(m).dense == dense
    state = vi.State(tuple(rng.normal(size=n) * 1e-3), tuple(rng.normal(size=n)), 0.6)
    error, allowed = largest_errors(m, state, t)
    assert error <= allowed * n  # each stored product sums n pairs of terms


@pytest.mark.parametrize("zeta", [0.0, 0.045, 1.0, 1.0 + 1e-14])
def test_dense_output_of_a_run_is_exact_between_impacts(zeta: float) -> None:
    d = paper_damper("A", 1.2, zeta=zeta)
    run = vi.simulate(d, vi.State((0.2, 0.1), (0.0, 1.0), 0.3), impacts=12)
    w = damper_witness(d)
    for i in range(len(run) - 1):
        z = reference.state(
            run.position[i, 0], run.velocity_after[i, 0],
            run.position[i, 1], run.velocity_after[i, 1], phase=run.phase[i],
        )  # fmt: skip
        t = run.time[i] + 0.37 * (run.time[i + 1] - run.time[i])
        true = reference.flight(w, z, exact(t) - exact(run.time[i]))
        x, v = run.at(t)
        # the record rounds state, phase (below 8) and time (below 64): some 8 to 32 units
        scale = 1.0 + float(np.max(np.abs(run.position[i])) + np.max(np.abs(run.velocity_after[i])))
        got = np.array([*x, *v])
        error = max(
            abs(exact(a) - b)
            for a, b in zip(got, (true.x1, true.x2, true.v1, true.v2), strict=True)
        )
        assert error <= 64.0 * UNIT * scale * 4.0


def test_dense_output_at_an_event_is_the_state_after_it() -> None:
    run = vi.simulate(paper_damper("A", 1.2), vi.State((0.2, 0.1), (0.0, 1.0)), impacts=20)
    x, v = run.at(run.time)
    late = np.spacing(run.time)[:, None]  # a recorded time is its double, the motion goes on
    fastest = 1.0 + np.abs(run.velocity_after).max() + np.abs(run.position).max()
    assert np.all(np.abs(x - run.position) <= (late + 4.0 * UNIT) * fastest)
    assert np.all(np.abs(v - run.velocity_after) <= (late + 4.0 * UNIT) * fastest)


def test_dense_output_has_the_shape_of_the_times() -> None:
    run = vi.simulate(paper_damper("A", 1.2), vi.State((0.2, 0.1), (0.0, 1.0)), impacts=20)
    x, v = run.at(np.full((2, 3), 1.0))
    assert x.shape == v.shape == (2, 3, 2)
    assert run.at(1.0)[0].shape == (2,)


def test_dense_output_refuses_times_outside_the_run() -> None:
    run = vi.simulate(paper_damper("A", 1.2), vi.State((0.2, 0.1), (0.0, 1.0)), impacts=20)
    with pytest.raises(vi.InvalidParameterError, match="must be finite"):
        run.at(np.nan)
    for t in (-1e-300, run.time[-1] * (1.0 + 1e-14)):
        with pytest.raises(vi.InvalidParameterError, match="span of the run"):
            run.at(t)


@given(
    zeta=st.sampled_from([0.0, 0.1, 1.0, 3.0]),
    s=st.floats(0.0, 50.0),
    t=st.floats(0.0, 50.0),
)
def test_flights_add_up(zeta: float, s: float, t: float) -> None:
    m = oscillator(stiffness=1.0, damping=2.0 * zeta, forces=(LINE,))
    x, v = (a[0] for a in fly(m, STATE, s))
    whole = fly(m, STATE, s + t)
    parts = fly(m, vi.State(tuple(x), tuple(v), STATE.phase + LINE.omega * s), t)
    rate = compile_mechanism(m).rate
    error: Any = np.abs(np.hstack(whole) - np.hstack(parts)).max()
    # both flights, and the phase given to the second, are exact to `tolerance`
    assert error <= 3.0 * rate * tolerance(m, [4.0], s + t)
