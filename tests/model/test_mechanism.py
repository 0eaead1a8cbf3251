"""Mechanisms with several contacts, and what is refused."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from support import UNIT
from support.systems import oscillator, paper_damper, random_mechanism

import vibroimpact as vi
from vibroimpact.compile.hybrid import compile_mechanism


def twin_dampers(first: float = 0.7, second: float = 0.7) -> vi.Mechanism:
    """One main mass with two equal free masses, each in its own slot."""
    return vi.Mechanism(
        mass=np.diag([1.0, 0.05, 0.05]),
        damping=np.diag([0.06, 0.0, 0.0]),
        stiffness=np.diag([1.0, 0.0, 0.0]),
        forces=(vi.Harmonic(0.9, (1.0, 0.0, 0.0)),),
        elements=(
            vi.RigidStop((-1.0, 1.0, 0.0), -5.0, 5.0, first),
            vi.RigidStop((-1.0, 0.0, 1.0), -5.0, 5.0, second),
        ),
    )


def falling(*restitutions: float, masses: tuple[float, ...] = ()) -> vi.Mechanism:
    """Independent balls above one floor, g = 1."""
    n = len(restitutions)
    mass = np.diag(masses or (1.0,) * n)
    return vi.Mechanism(
        mass=mass,
        damping=np.zeros((n, n)),
        stiffness=np.zeros((n, n)),
        constant_force=tuple(-np.diag(mass)),
        elements=tuple(
            vi.RigidStop(tuple(np.eye(n)[i]), lower=0.0, restitution=r)
            for i, r in enumerate(restitutions)
        ),
    )


def row_of_balls(n: int, restitution: float) -> vi.Mechanism:
    """Equal balls on a line; contact i keeps ball i + 1 to the right of ball i."""
    rows = [tuple(float((j == i + 1) - (j == i)) for j in range(n)) for i in range(n - 1)]
    return vi.Mechanism(
        mass=np.eye(n), damping=np.zeros((n, n)), stiffness=np.zeros((n, n)),
        elements=tuple(vi.RigidStop(row, lower=0.0, restitution=restitution) for row in rows),
    )  # fmt: skip


def test_lists_of_contacts_and_forces_make_the_same_mechanism_as_tuples() -> None:
    m = twin_dampers()
    listed = replace(m, elements=list(m.elements), forces=list(m.forces))
    assert listed == m
    start = vi.State((0.0, 0.0, 0.0), (0.0, 1.0, -2.0))
    runs = (vi.simulate(system, start, impacts=5) for system in (listed, m))
    one, other = (run.time.tolist() for run in runs)
    assert one == other


def events(run: vi.Run, contact: int, status: vi.Status) -> Any:
    """Times of the events of one kind at one contact."""
    return run.time[(run.contact == contact) & (run.status == status)]


@pytest.mark.parametrize(("first", "second"), [(0.7, 0.7), (0.9, 0.2), (1.0, 0.0)])
def test_twin_dampers_that_arrive_together_obey_moreaus_law(first: float, second: float) -> None:
    """Both active: each gap rate is reversed with its own restitution, momentum is kept."""
    run = vi.simulate(
        twin_dampers(first, second), vi.State((0.0, 0.0, 0.0), (0.0, 1.0, 1.0)), impacts=1
    )
    assert run.status[0] == vi.Status.SIMULTANEOUS
    before, after = run.velocity_before[0], run.velocity_after[0]
    for i, r in ((1, first), (2, second)):
        assert abs((after[i] - after[0]) + r * (before[i] - before[0])) <= 32.0 * UNIT * 2.0
    momentum = np.array([1.0, 0.05, 0.05]) @ (after - before)
    assert abs(momentum) <= 32.0 * UNIT * 2.0


def test_equal_twins_stay_together() -> None:
    run = vi.simulate(twin_dampers(), vi.State((0.0, 0.0, 0.0), (0.0, 1.0, 1.0)), impacts=60)
    assert np.all(run.status == vi.Status.SIMULTANEOUS)
    # their difference is a free mass bounced sixty times: eps_g of each flight at most, added up
    assert np.abs(run.position[:, 1] - run.position[:, 2]).max() <= 60 * 64.0 * UNIT * 10.0


def test_contacts_that_share_no_body_do_not_see_each_other() -> None:
    both = vi.simulate(falling(0.5, 0.25), vi.State((1.0, 1.0), (0.0, 0.0)), impacts=1)
    assert both.status[0] == vi.Status.SIMULTANEOUS
    fall = math.sqrt(2.0)
    np.testing.assert_allclose(both.velocity_after[0], [0.5 * fall, 0.25 * fall], rtol=16.0 * UNIT)


def test_newtons_cradle_shares_the_push_as_moreaus_law_does() -> None:
    """A ball strikes two that touch: A p = (1 + R) gamma gives p = (4/3, 2/3), R = 1."""
    m = row_of_balls(3, 1.0)
    run = vi.simulate(m, vi.State((-1.0, 0.0, 0.0), (1.0, 0.0, 0.0)), impacts=1, t_max=5.0)
    (hit,) = np.flatnonzero(run.impacts)  # the two that touch, without force, graze until then
    assert abs(run.time[hit] - 1.0) <= 4.0 * UNIT
    np.testing.assert_allclose(run.velocity_after[hit], [-1 / 3, 2 / 3, 2 / 3], atol=16.0 * UNIT)


def test_a_row_of_elastic_balls_hands_velocity_on_where_gaps_are_open() -> None:
    m = row_of_balls(4, 1.0)
    run = vi.simulate(m, vi.State((0.0, 1.0, 2.0, 3.0), (1.0, 0.0, 0.0, 0.0)), impacts=3)
    np.testing.assert_array_equal(run.contact, [0, 1, 2])
    np.testing.assert_allclose(run.time, [1.0, 2.0, 3.0], rtol=16.0 * UNIT)
    np.testing.assert_allclose(run.velocity_after[-1], [0.0, 0.0, 0.0, 1.0], atol=32.0 * UNIT)


@pytest.mark.parametrize("restitutions", [(0.5, 0.6), (0.2, 0.8), (0.5, 0.6, 0.7, 0.1)])
def test_every_ball_comes_to_rest_in_its_own_time(restitutions: tuple[float, ...]) -> None:
    """h = 1/2, g = 1: the falls take (1 + e) / (1 - e), whatever the other balls do."""
    n = len(restitutions)
    m = falling(*restitutions)
    run = vi.simulate(m, vi.State((0.5,) * n, (0.0,) * n), impacts=2000, t_max=30.0)
    for i, e in enumerate(restitutions):
        (rest,) = events(run, i, vi.Status.STICK)
        # a hundred flights or so, each a few roundings
        assert abs(rest - (1.0 + e) / (1.0 - e)) <= 400.0 * UNIT * rest
    assert run.end is vi.RunEnd.HORIZON
    x, v = run.at(np.linspace(rest, 30.0, 7)) if restitutions[-1] == max(restitutions) else (0, 0)
    assert np.all(np.abs(x) <= 1e-15)
    assert np.all(v == 0.0)


@pytest.mark.parametrize("preloads", [(0.2, 0.7), (0.7, 0.2), (0.1, 0.4, 0.9)])
def test_closed_contacts_are_released_one_by_one(preloads: tuple[float, ...]) -> None:
    """Masses pressed by p_i and lifted by sin(t) leave at asin(p_i)."""
    n = len(preloads)
    m = vi.Mechanism(
        mass=np.eye(n), damping=np.zeros((n, n)), stiffness=np.zeros((n, n)),
        forces=(vi.Harmonic(1.0, (1.0,) * n),), constant_force=tuple(-p for p in preloads),
        elements=tuple(vi.RigidStop(tuple(np.eye(n)[i]), lower=0.0, restitution=0.5)
                       for i in range(n)),
    )  # fmt: skip
    run = vi.simulate(m, vi.State((0.0,) * n, (0.0,) * n), impacts=1)
    for i, p in enumerate(preloads):
        released = events(run, i, vi.Status.RELEASE)[0]
        assert abs(released - math.asin(p)) <= 1024.0 * UNIT / math.sqrt(1.0 - p * p)


def resting_neighbour() -> vi.Mechanism:
    """A ball that rests on a sprung table, on which another one bounces."""
    return vi.Mechanism(
        mass=np.diag([3.0, 0.5, 0.2]),
        damping=np.diag([0.3, 0.0, 0.0]),
        stiffness=np.diag([40.0, 0.0, 0.0]),
        constant_force=(-3.0, -5.0, -0.2),
        elements=(
            vi.RigidStop((-1.0, 1.0, 0.0), lower=0.0, restitution=0.1),
            vi.RigidStop((-1.0, 0.0, 1.0), lower=0.0, restitution=0.9),
        ),
    )


def test_an_impact_beside_a_held_contact_leaves_it_closed_where_it_is_pressed() -> None:
    m = resting_neighbour()
    run = vi.simulate(m, vi.State((-0.2, -0.2, 0.3), (0.0, 0.0, 0.0)), impacts=30, t_max=20.0)
    stuck = events(run, 0, vi.Status.STICK)
    assert len(stuck)
    assert len(events(run, 1, vi.Status.SIMULTANEOUS)) > 3  # it moves the ball at rest, too
    assert_dense_output_joins_the_events(run)


def assert_dense_output_joins_the_events(run: vi.Run) -> None:
    """Just before each event the dense output arrives where the event was recorded."""
    before = np.nextafter(run.time, 0.0)
    later = np.flatnonzero(np.diff(np.concatenate([[0.0], run.time])) > 1e-6)
    x, v = run.at(before[later])
    chatter = run.status[later] == vi.Status.CHATTER  # the sum replaces many impacts
    size = 1.0 + float(np.abs(run.position).max() + np.abs(run.velocity_before).max())
    # two ways to the same state: the march and one long flight, a few hundred u apart
    allowed = 1e4 * UNIT * size * max(1.0, compile_mechanism(run.system).rate)
    error = np.abs(x - run.position[later]).max(axis=1)
    speed_error = np.abs(v - run.velocity_before[later]).max(axis=1)
    assert np.all(error[~chatter] <= allowed)
    assert np.all(speed_error[~chatter] <= allowed * max(1.0, compile_mechanism(run.system).rate))


@given(seed=st.integers(0, 10_000), n=st.integers(1, 4), lines=st.integers(0, 1))
def test_dense_output_is_continuous_through_every_kind_of_event(
    seed: int, n: int, lines: int
) -> None:
    rng = np.random.default_rng(seed)
    m = random_mechanism(rng, n, contacts=int(rng.integers(1, n + 1)), lines=lines)
    start = vi.State((0.0,) * n, tuple(rng.normal(size=n)))
    run = vi.simulate(m, start, impacts=60, t_max=60.0)
    assert run.end in (vi.RunEnd.IMPACTS, vi.RunEnd.HORIZON)
    assert_dense_output_joins_the_events(run)


@given(seed=st.integers(0, 10_000), n=st.integers(1, 4))
def test_no_contact_is_ever_behind_its_stop(seed: int, n: int) -> None:
    rng = np.random.default_rng(seed)
    m = random_mechanism(rng, n, contacts=int(rng.integers(1, n + 1)))
    run = vi.simulate(m, vi.State((0.0,) * n, tuple(rng.normal(size=n))), impacts=40, t_max=60.0)
    x, _ = run.at(np.linspace(0.0, run.time[-1], 2000))
    size = 1.0 + float(np.abs(run.position).max() + np.abs(run.velocity_before).max())
    for c in m.rigid_stops:
        u = x @ np.array(c.row)
        # eps_g, and the flight that sums a chatter dips by v^2 / a <= u of the size
        assert np.all(u <= c.upper + 1e4 * UNIT * size)
        assert np.all(u >= c.lower - 1e4 * UNIT * size)


def test_two_stops_at_one_place_act_as_one() -> None:
    """Dependent contacts: their impulses are not determined, the motion is."""
    m = vi.Mechanism(
        mass=[[1.0]], damping=[[0.0]], stiffness=[[0.0]], constant_force=(-1.0,),
        elements=(vi.RigidStop((1.0,), lower=0.0, restitution=0.5),
                  vi.RigidStop((2.0,), lower=0.0, restitution=0.5)),
    )  # fmt: skip
    run = vi.simulate(m, vi.State((0.5,), (0.0,)), impacts=5)
    assert np.all(run.status == vi.Status.SIMULTANEOUS)
    np.testing.assert_allclose(run.time, 3.0 - 4.0 * 0.5 ** np.arange(1, 6), rtol=32.0 * UNIT)
    still = vi.simulate(m, vi.State((0.0,), (0.0,)), impacts=5, t_max=10.0)
    assert np.all(still.at(np.linspace(0.0, 10.0, 9))[0] == 0.0)


GOOD: dict[str, Any] = {
    "mass": [[1.0, 0.0], [0.0, 0.1]],
    "damping": np.zeros((2, 2)),
    "stiffness": np.eye(2),
    "elements": (vi.RigidStop((-1.0, 1.0), -5.0, 5.0, 0.8),),
}
BAD_MECHANISMS = [
    ({"mass": [[1.0, 0.0], [0.0, -0.1]]}, "mass: must be positive definite"),
    ({"mass": [[1.0, 0.0], [0.0, 0.0]]}, "massless"),
    (
        {"mass": [[1.0, 0.5], [0.0, 1.0]]},
        r"mass: must be symmetric; mass\[0\]\[1\] = 0.5, mass\[1\]\[0\] = 0.0",
    ),
    (
        {"mass": [[1.0, math.nan], [math.nan, 1.0]]},
        r"mass\[0, 1\] = nan: every entry must be finite",
    ),
    ({"mass": [1.0, 2.0]}, r"mass has shape \(2,\)"),
    ({"mass": "heavy"}, "mass = .*: must be a square matrix"),
    ({"mass": np.eye(21)}, "must be 1 to 20"),
    ({"damping": np.eye(3)}, r"damping has shape \(3, 3\); expected \(2, 2\)"),
    (
        {"stiffness": np.full((2, 2), math.inf)},
        r"stiffness\[0, 0\] = inf: every entry must be finite",
    ),
    ({"elements": ()}, "elements: 0 are given; must be 1 to 16"),
    ({"elements": ("A",)}, r"elements\[0\] = .*: must be a RigidStop or SoftStop"),
    (
        {"elements": vi.RigidStop((1.0,), upper=1.0)},
        "elements = .*: must be RigidStop or .* in a tuple",
    ),
    ({"forces": vi.Harmonic(1.0, (1.0,))}, "forces = .*: must be 0 to 12 of Harmonic"),
    ({"elements": (vi.RigidStop((1.0,), 0.0, 1.0),)}, r"row has shape \(1,\); expected \(2,\)"),
    ({"forces": (vi.Harmonic(1.0, (1.0,)),)}, r"sine has shape \(1,\); expected \(2,\)"),
    ({"constant_force": (1.0,)}, r"constant_force has shape \(1,\); expected \(2,\)"),
    ({"constant_force": (math.nan, 0.0)}, "constant_force.* every entry must be finite"),
]


@pytest.mark.parametrize(("change", "message"), BAD_MECHANISMS)
def test_bad_mechanisms_are_refused_by_name(change: dict[str, Any], message: str) -> None:
    with pytest.raises(vi.InvalidParameterError, match=message):
        vi.Mechanism(**{**GOOD, **change})


BAD_CONTACTS = [
    ({"row": (0.0, 0.0), "lower": 0.0}, "a rigid stop must involve a coordinate"),
    ({"row": (math.nan,), "lower": 0.0}, "row.* every entry must be finite"),
    ({"row": (1.0,)}, "one finite"),
    ({"row": (1.0,), "lower": 1.0, "upper": 1.0}, "need lower < upper"),
    ({"row": (1.0,), "lower": 2.0, "upper": 1.0}, "need lower < upper"),
    ({"row": (1.0,), "lower": math.nan}, "lower = nan: must be a finite number"),
    ({"row": (1.0,), "lower": math.inf}, "need lower < upper"),
    ({"row": (1.0,), "lower": 0.0, "restitution": 1.3}, r"restitution = 1.3: must be in \[0, 1\]"),
    ({"row": (1.0,), "lower": 0.0, "restitution": -0.1}, "restitution = -0.1: must be in"),
    ({"row": (1.0,), "lower": 0.0, "restitution": math.nan}, "restitution = nan"),
    ({"row": (1.0,), "lower": 0.0, "restitution": (0.5, 0.5, 0.5)}, "one number, or"),
]


@pytest.mark.parametrize(("given_values", "message"), BAD_CONTACTS)
def test_bad_contacts_are_refused_by_name(given_values: dict[str, Any], message: str) -> None:
    with pytest.raises(vi.InvalidParameterError, match=message):
        vi.RigidStop(**given_values)


@pytest.mark.parametrize("omega", [0.0, -1.0, math.nan, math.inf, "fast", None])
def test_bad_frequencies_are_refused_by_name(omega: Any) -> None:
    with pytest.raises(vi.InvalidParameterError, match="omega = "):
        vi.Harmonic(omega, (1.0,))


def test_bad_amplitudes_are_refused_by_name() -> None:
    with pytest.raises(vi.InvalidParameterError, match="sine"):
        vi.Harmonic(1.0, (math.inf,))
    with pytest.raises(vi.InvalidParameterError, match=r"cosine has shape \(2,\); expected \(1,\)"):
        vi.Harmonic(1.0, (1.0,), (1.0, 2.0))


BAD_STATES = [
    (((math.nan, 0.0), (0.0, 0.0)), "position.* every entry must be finite"),
    (((0.0, 0.0), (0.0, math.inf)), "velocity.* every entry must be finite"),
    (((0.0, 0.0), (0.0,)), r"position = .*, velocity = .*: must be as long as each other"),
    (((0.0, 0.0), (0.0, 0.0), math.nan), "phase = nan"),
    ((("left", 0.0), (0.0, 0.0)), "position .* must be numbers"),
]


@pytest.mark.parametrize(("values", "message"), BAD_STATES)
def test_bad_states_are_refused_by_name(values: Any, message: str) -> None:
    with pytest.raises(vi.InvalidParameterError, match=message):
        vi.State(*values)


@pytest.mark.parametrize("behind", [1e-12, 0.1, 1e6])
@pytest.mark.parametrize(("sign", "name"), [(1.0, "upper"), (-1.0, "lower")])
def test_a_start_behind_a_stop_is_refused_with_the_distance(
    behind: float, sign: float, name: str
) -> None:
    d = paper_damper("A", 1.2)
    state = vi.State((0.0, sign * (5.0 + behind)), (0.0, 0.0))
    with pytest.raises(vi.InvalidParameterError, match=f"behind the {name} stop .* must be >= 0"):
        vi.simulate(d, state)


BAD_RUNS: list[tuple[dict[str, Any], str]] = [
    ({"impacts": 0}, "impacts = 0: must be an integer >= 1"),
    ({"impacts": -3}, "impacts = -3"),
    ({"impacts": 2.5}, "impacts = 2.5"),
    ({"impacts": True}, "impacts = True"),
    ({"t_max": 0.0}, "t_max = 0.0: must be > 0"),
    ({"t_max": -1.0}, "t_max = -1.0"),
    ({"t_max": math.nan}, "t_max = nan"),
]


@pytest.mark.parametrize(("limits", "message"), BAD_RUNS)
def test_bad_lengths_of_runs_are_refused_by_name(limits: dict[str, Any], message: str) -> None:
    with pytest.raises(vi.InvalidParameterError, match=message):
        vi.simulate(paper_damper("A", 1.2), vi.State((0.0, 0.0), (0.0, 1.0)), **limits)


def test_what_is_no_system_or_state_is_refused() -> None:
    state = vi.State((0.0, 0.0), (0.0, 1.0))
    with pytest.raises(
        vi.InvalidParameterError, match="must be a Mechanism or HybridSystem, or have one"
    ):
        vi.simulate("damper", state)  # type: ignore[arg-type]
    with pytest.raises(vi.InvalidParameterError, match="must be a State"):
        vi.simulate(paper_damper("A", 1.2), (0.0, 1.0))  # type: ignore[arg-type]
    with pytest.raises(
        vi.InvalidParameterError, match=r"position has shape \(1,\); expected \(2,\)"
    ):
        vi.simulate(paper_damper("A", 1.2), vi.State((0.0,), (1.0,)))


@pytest.mark.parametrize("detuning", [0.0, 1e-15, 1e-9, 1e-3])
def test_undamped_forcing_at_resonance_is_simulated(detuning: float) -> None:
    d = paper_damper("A", 0.5 * (1.0 + detuning), zeta=0.0)
    run = vi.simulate(d, vi.State((0.0, 0.0), (0.0, 1.0)), impacts=5)
    assert run.end is vi.RunEnd.IMPACTS


def test_one_coordinate_may_have_more_stops_than_freedom() -> None:
    m = vi.Mechanism(
        mass=[[1.0]], damping=[[0.1]], stiffness=[[1.0]],
        elements=tuple(vi.RigidStop((1.0 + i,), -1.0, 1.0, 0.5) for i in range(3)),
    )  # fmt: skip
    run = vi.simulate(m, vi.State((0.0,), (2.0,)), impacts=4, t_max=20.0)
    assert set(run.contact[run.status == vi.Status.IMPACT]) == {2}  # the narrowest one


def test_bodies_far_from_their_stops_are_silent() -> None:
    m = oscillator(stiffness=1.0, damping=0.1, forces=(vi.Harmonic(1.3, (1.0,)),))
    assert vi.simulate(m, vi.State((0.0,), (0.0,)), impacts=1).end is vi.RunEnd.SILENT


# ---- a moving base -------------------------------------------------------------------------------


SHAKEN = vi.Harmonic(1.7, (0.3,), (0.1,))


def test_a_machine_on_a_moving_base_moves_as_one_whose_supports_all_move() -> None:
    """Spring, dashpot, stop and friction to the ground, each moved by itself in other coordinates."""
    m, c, k, w = 1.3, 0.2, 2.0, SHAKEN.omega
    a, b = SHAKEN.sine[0], SHAKEN.cosine[0]
    still = vi.Mechanism(
        mass=[[m]], damping=[[c]], stiffness=[[k]], forces=(vi.Harmonic(1.7, (0.2,)),),
        elements=(vi.RigidStop((1.0,), upper=0.4, restitution=0.7), vi.Friction((1.0,), 0.1)),
    )  # fmt: skip
    ground = vi.Mechanism(
        mass=[[m]], damping=[[c]], stiffness=[[k]],
        forces=(vi.Harmonic(w, (0.2 + k * a - c * w * b,), (k * b + c * w * a,)),),
        elements=(
            vi.RigidStop((1.0,), upper=0.4, restitution=0.7, motion=SHAKEN),
            vi.Friction((1.0,), 0.1, motion=SHAKEN),
        ),
    )  # fmt: skip
    on_base = vi.simulate(still.on_moving_base(SHAKEN), vi.State((0.1,), (0.2,)), t_max=20.0)
    on_ground = vi.simulate(ground, vi.State((0.1 + b,), (0.2 + w * a,)), t_max=20.0)
    assert on_base.status.tolist() == on_ground.status.tolist()
    assert {vi.Status.IMPACT, vi.Status.CHANGE} < {*on_base.status.tolist()}
    # rounding of some 1e-15 grows from event to event
    np.testing.assert_allclose(on_base.time, on_ground.time, rtol=0.0, atol=1e-11)


def test_what_the_base_does_not_carry_feels_no_force() -> None:
    m = row_of_balls(3, 0.5).on_moving_base(SHAKEN, direction=(1.0, 0.5, 0.0))
    square = SHAKEN.omega**2
    assert m.forces == (
        vi.Harmonic(1.7, tuple(square * 0.3 * x for x in (1.0, 0.5, 0.0)),
                    tuple(square * 0.1 * x for x in (1.0, 0.5, 0.0))),
    )  # fmt: skip


def test_forces_of_one_frequency_are_one_line_on_a_moving_base() -> None:
    own = twin_dampers()
    shaken = own.on_moving_base((vi.Harmonic(0.9, (0.1,)), SHAKEN))
    assert [line.omega for line in shaken.forces] == [0.9, 1.7]
    np.testing.assert_allclose(shaken.forces[0].sine, [1.0 + 0.081, 0.081 * 0.05, 0.081 * 0.05])


@pytest.mark.parametrize(
    ("given", "said"),
    [
        ({"motion": vi.Harmonic(1.0, (1.0, 2.0))}, "motion: has 2 amplitudes"),
        ({"motion": 0.3}, "motion = 0.3.*a Harmonic"),
        ({"motion": SHAKEN, "direction": (1.0,)}, "direction has shape"),
    ],
)
def test_a_mistake_in_the_motion_of_a_base_is_named(given: dict[str, Any], said: str) -> None:
    with pytest.raises(vi.InvalidParameterError, match=said):
        twin_dampers().on_moving_base(**given)


# ---- matrices that are singular to rounding ------------------------------------------------------


def sprung(masses: Any, *rows: tuple[float, ...], elements: Any = (), **more: Any) -> vi.Mechanism:
    """Masses on equal springs per mass, and one with a constant force on each, on plastic stops at 0."""
    mass = np.array(masses) if np.ndim(masses) == 2 else np.diag(masses)
    own = np.diag(np.diag(mass))
    return vi.Mechanism(
        mass=mass, damping=0.0 * mass, stiffness=own, constant_force=tuple(-np.diag(mass)),
        elements=(*(vi.RigidStop(row, lower=0.0, restitution=0.0) for row in rows), *elements), **more,
    )  # fmt: skip


@given(lost=st.floats(12.5, 17.0), units=st.lists(st.floats(-140.0, 140.0), min_size=3, max_size=3))
def test_a_mass_matrix_without_inertia_of_a_coordinate_is_refused_in_all_units(
    lost: float, units: list[float]
) -> None:
    """Coordinates 0 and 2 are tied to 10^-lost; 2^-40 = 10^-12.04 of an entry is the least that counts."""
    beside = 1.0 - 10.0**-lost
    tied = np.array([[1.0, 0.3, beside], [0.3, 1.0, 0.3 * beside], [beside, 0.3 * beside, 1.0]])
    scale = 10.0 ** np.array(units)
    with pytest.raises(
        vi.InvalidParameterError,
        match=r"mass: is singular .*condition number (\d\.\de\+\d\d|inf).* coordinate 2",
    ):
        sprung(scale[:, None] * tied * scale, (1.0, 0.0, 0.0))


@given(st.lists(st.floats(-300.0, 300.0), min_size=1, max_size=4))
def test_masses_of_any_sizes_are_no_singular_matrix(exponents: list[float]) -> None:
    row = (1.0,) + (0.0,) * (len(exponents) - 1)
    sprung(10.0 ** np.array(exponents), row)


@pytest.mark.parametrize("elements", [(), (vi.Friction((1.0, 0.0), 1e-30),)])
def test_contacts_that_coincide_for_the_masses_are_refused_by_name(elements: Any) -> None:
    """x1 +- x2 with masses 1 and 1e-25: their impulses are told apart by one part in 10^25."""
    tied = sprung((1.0, 1e-25), (1.0, 1.0), (1.0, -1.0), elements=elements)
    with pytest.raises(vi.InvalidParameterError, match=r"mobility of .*contacts.*condition number"):
        vi.simulate(tied, vi.State((1.0, 0.0), (0.0, 0.0)), impacts=5, t_max=9.0)


def test_the_order_of_heavy_and_light_masses_does_not_matter() -> None:
    """On x1 + x2 + x3 >= 0 with one of 10^25: a light one passes momentum to the other light one only."""
    at_rest = vi.State((1.0, 1.0, 1.0), (0.0, 0.0, 0.0))
    times = [
        vi.simulate(sprung(np.roll((1e25, 1.0, 1.0), k), (1.0, 1.0, 1.0)), at_rest, t_max=3.0).time
        for k in range(3)
    ]  # fmt: skip
    np.testing.assert_allclose(times[0][0], math.pi / 3.0, rtol=1e-14)  # 3 (2 cos t - 1) = 0
    np.testing.assert_allclose(times[1], times[0], rtol=1e-12)
    np.testing.assert_allclose(times[2], times[0], rtol=1e-12)
