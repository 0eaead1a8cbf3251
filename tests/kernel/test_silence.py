"""Flights without an event: up to t_max, in few steps, and called silent only where that is proved."""

from __future__ import annotations

import math

import numpy as np
import pytest

import vibroimpact as vi
from vibroimpact.simulation.simulate import RunEnd
from vibroimpact.sweeps.member_status import MemberStatus

UNIT = 2.0**-53
GRAVITY = 9.8
FALL = math.sqrt(2.0 / GRAVITY)  # from 1 to 0
SPEED = math.sqrt(2.0 * GRAVITY)  # there
QUIETLY = (RunEnd.SILENT, RunEnd.QUIET)
FAST = [1e4, 1e6, 1e8, 1e10, 1e12]  # rates, of a mode that decays at once
# A flight takes some 200 applications of propagators at most, each 4 ulp of amplitudes of 1 and speeds of 4, which
# are what an error of the place is divided by.
PER_FLIGHT = 200 * 4 * UNIT


def ball_on_spring(stiffness: float) -> vi.Mechanism:
    """A ball of mass 1 above a soft stop at 0."""
    return vi.Mechanism(
        mass=[[1.0]], damping=[[0.0]], stiffness=[[0.0]], constant_force=(-GRAVITY,),
        elements=(vi.SoftStop((1.0,), lower=0.0, stiffness=stiffness),),
    )  # fmt: skip


def beside_a_dashpot(
    rate: float, stiffness: float = 0.0, force: float = 0.0, **parts: object
) -> vi.Mechanism:
    """Mass 1 of coordinate 0 beside another mass, which is joined to the ground by a dashpot only."""
    return vi.Mechanism(
        mass=[[1.0, 0.0], [0.0, 1.0]], damping=[[0.0, 0.0], [0.0, rate]],
        stiffness=[[stiffness, 0.0], [0.0, 0.0]], constant_force=(force, 0.0), **parts,
    )  # fmt: skip


def period_on_spring(stiffness: float) -> float:
    """From contact to contact: x'' = -g - k x below 0 from -SPEED, then a flight."""
    w = math.sqrt(stiffness)
    return 2.0 / w * (math.pi - math.atan(w * SPEED / GRAVITY)) + 2.0 * SPEED / GRAVITY


# ---- with t_max ----------------------------------------------------------------------------------


@pytest.mark.parametrize("stiffness", [1e8, 1e10, 1e12, 1e14])
def test_a_ball_on_a_stiff_soft_stop_bounces_up_to_t_max(stiffness: float) -> None:
    run = vi.simulate(ball_on_spring(stiffness), vi.State((1.0,), (0.0,)), t_max=10.0)
    period = period_on_spring(stiffness)
    met = FALL + period * np.arange(1 + (10.0 - FALL) // period)
    assert run.end is RunEnd.HORIZON
    assert run.time[-1] == 10.0
    assert run.impacts.sum() == len(met)
    assert run.time[run.impacts] == pytest.approx(met, abs=2 * len(met) * PER_FLIGHT)


@pytest.mark.parametrize("rate", FAST)
def test_a_mode_that_has_died_out_sets_no_step_of_a_ball_on_a_rigid_stop(rate: float) -> None:
    contact = vi.RigidStop((1.0, 0.0), lower=0.0, restitution=0.6)
    m = beside_a_dashpot(rate, force=-GRAVITY, elements=(contact,))
    run = vi.simulate(m, vi.State((1.0, 0.0), (0.0, 1.0)), t_max=10.0)
    hit = FALL + 2.0 * FALL * np.cumsum([0.0, *(0.6**k for k in range(1, 20))])
    assert run.end is RunEnd.HORIZON
    assert run.time[run.impacts][:20] == pytest.approx(hit, abs=20 * PER_FLIGHT)
    assert run.status[-2] == vi.Status.STICK  # chatter is over after 4 falls
    assert run.position[-1] == pytest.approx([0.0, 1.0 / rate], abs=4 * UNIT)


@pytest.mark.parametrize("rate", FAST)
def test_a_mode_that_has_died_out_sets_no_step_of_a_ball_on_a_soft_stop(rate: float) -> None:
    stop = vi.SoftStop((1.0, 0.0), lower=0.0, stiffness=100.0)
    m = beside_a_dashpot(rate, force=-GRAVITY, elements=(stop,))
    run = vi.simulate(m, vi.State((1.0, 0.0), (0.0, 1.0)), t_max=10.0)
    met = FALL + period_on_spring(100.0) * np.arange(8)
    assert run.end is RunEnd.HORIZON
    assert run.time[run.impacts] == pytest.approx(met, abs=2 * 8 * PER_FLIGHT)


@pytest.mark.parametrize("rate", FAST)
def test_a_mode_that_has_died_out_costs_a_slow_oscillator_no_digits(rate: float) -> None:
    contact = vi.RigidStop((1.0, 0.0), lower=-0.5, restitution=1.0)
    m = beside_a_dashpot(rate, stiffness=1.0, elements=(contact,))
    run = vi.simulate(m, vi.State((1.0, 0.0), (0.0, 1.0)), t_max=40.0)
    third = 2.0 * math.pi / 3.0  # cos t = -1/2; an elastic stop turns the motion back
    hit = third * np.arange(1, 40 / third, 2)
    assert run.end is RunEnd.HORIZON
    assert run.time[run.impacts] == pytest.approx(hit, abs=len(hit) * PER_FLIGHT)
    assert run.at(39.0)[0][0] == pytest.approx(
        math.cos(abs((39.0 + third) % (2 * third) - third)), abs=1e-12
    )


def test_t_max_is_reached_where_nothing_can_happen() -> None:
    free = vi.Mechanism(
        mass=[[1.0]], damping=[[0.0]], stiffness=[[0.0]],
        elements=(vi.RigidStop((1.0,), lower=-1.0, upper=1.0),),
    )  # fmt: skip
    slow = vi.simulate(free, vi.State((0.0,), (1e-15,)), t_max=1e7)
    assert slow.end is RunEnd.HORIZON
    assert slow.position[-1, 0] == pytest.approx(1e-8, rel=1e-15)
    for force in ({"constant_force": (0.999999,)}, {"forces": (vi.Harmonic(1.0, (0.999999,)),)}):
        held = vi.Mechanism(
            mass=[[1.0]], damping=[[0.0]], stiffness=[[0.0]],
            elements=(vi.Friction((1.0,), 1.0),), **force,
        )  # fmt: skip
        for t_max in (1e5, 1e7, 1e12):
            run = vi.simulate(held, vi.State((0.0,), (0.0,)), t_max=t_max)
            assert run.end is RunEnd.HORIZON
            assert run.time[-1] == t_max
            assert run.position[-1, 0] == 0.0
    load = vi.Harmonic(1.0, (1.0 + 1e-9,))
    moves = vi.Mechanism(
        mass=[[1.0]], damping=[[0.0]], stiffness=[[0.0]], forces=(load,),
        elements=(vi.Friction((1.0,), 1.0),),
    )  # fmt: skip
    assert (
        len(vi.simulate(moves, vi.State((0.0,), (0.0,)), t_max=10.0)) > 1
    )  # it slips at its peaks


@pytest.mark.parametrize("power", [-15, -3, 20])
def test_another_unit_of_time_changes_no_event_of_a_long_quiet_run(power: int) -> None:
    def run_in(unit: float) -> vi.Run:
        m = vi.Mechanism(
            mass=[[1.0, 0.0], [0.0, 1.0]], damping=[[0.0, 0.0], [0.0, 1e6 / unit]],
            stiffness=[[0.0, 0.0], [0.0, 0.0]], constant_force=(-GRAVITY / unit**2, 0.0),
            elements=(vi.SoftStop((1.0, 0.0), lower=0.0, stiffness=1e6 / unit**2),),
        )  # fmt: skip
        return vi.simulate(m, vi.State((1.0, 0.0), (0.0, 1.0 / unit)), t_max=10.0 * unit)

    one, other = run_in(1.0), run_in(2.0**power)
    assert one.end is other.end is RunEnd.HORIZON
    assert np.array_equal(one.status, other.status)
    assert np.array_equal(one.time * 2.0**power, other.time)
    assert np.array_equal(one.position, other.position)


def random_machine(rng: np.random.Generator) -> tuple[vi.Mechanism, vi.State]:
    """Up to three masses between stops of each kind, with rates over many decades."""
    n = int(rng.integers(1, 4))

    def semidefinite(decades: float) -> list[list[float]]:
        factor = rng.normal(size=(n, n)) * 10.0 ** rng.uniform(-decades, decades, n)
        return (factor.T @ factor * (rng.random() < 0.7)).tolist()

    def row() -> tuple[float, ...]:
        return tuple(np.eye(n)[rng.integers(n)] - np.eye(n)[rng.integers(n)] * (rng.random() < 0.3))

    elements: list[object] = []
    for _ in range(int(rng.integers(0, 3))):
        at = row()
        if not any(at):
            continue
        if rng.random() < 0.5:
            low = -float(rng.exponential())
            stiffness = 10.0 ** rng.uniform(-2, 12)
            damping = float(rng.random() < 0.5) * math.sqrt(stiffness) * rng.random()
            elements.append(
                vi.SoftStop(at, lower=low, upper=-low, stiffness=stiffness, damping=damping)
            )
        else:
            elements.append(vi.Friction(at, 10.0 ** rng.uniform(-3, 1)))
    forces = (vi.Harmonic(10.0 ** rng.uniform(-2, 1), tuple(rng.normal(size=n))),)
    m = vi.Mechanism(
        mass=np.diag(10.0 ** rng.uniform(-2, 2, n)).tolist(),
        damping=semidefinite(3.0), stiffness=semidefinite(2.0),
        constant_force=tuple(rng.normal(size=n) * (rng.random() < 0.5)),
        forces=forces if rng.random() < 0.7 else (),
        elements=(*(vi.RigidStop(tuple(np.eye(n)[i]), lower=-2.0, upper=2.0, restitution=rng.random())
                    for i in range(n) if not i or rng.random() < 0.7), *elements),
    )  # fmt: skip
    return m, vi.State(tuple(0.5 * rng.normal(size=n).clip(-3, 3)), tuple(rng.normal(size=n)))


@pytest.mark.parametrize("seed", range(60))
@pytest.mark.one_in(3)
def test_no_run_with_t_max_ends_without_a_reason(seed: int) -> None:
    m, state = random_machine(np.random.default_rng(seed))
    run = vi.simulate(m, state, t_max=30.0, impacts=300)
    assert run.end not in QUIETLY
    if run.end is RunEnd.HORIZON:
        assert run.time[-1] == pytest.approx(30.0, rel=4 * UNIT)
    elif run.end is RunEnd.IMPACTS:
        assert run.impacts.sum() == 300
    else:  # the last event says why
        assert run.end in (
            RunEnd.STEPS,
            RunEnd.DIVERGED,
            RunEnd.UNDECIDED,
            RunEnd.EVENTS,
            RunEnd.STALLED,
        )


# ---- without t_max -------------------------------------------------------------------------------


@pytest.mark.parametrize("seed", range(24))
def test_a_run_is_silent_where_the_forced_motion_stays_within_the_clearance(seed: int) -> None:
    rng = np.random.default_rng(seed)
    k, c, w = 10.0 ** rng.uniform(-1, 1, 3)
    offset, side = 0.3 * rng.normal(), float(rng.choice([-1.0, 1.0]))
    response = 1.0 / complex(k - w * w, c * w)  # x = offset / k + Im(response exp(i w t))
    start = vi.State((offset / k + response.imag,), (w * response.real,))
    for part in (vi.RigidStop, vi.SoftStop):
        for beyond in (1.001, 0.999):
            limit = offset / k + side * abs(response) * beyond
            bounds = {"upper" if side > 0 else "lower": limit}
            stop: dict[str, object] = (
                {"elements": (vi.RigidStop((1.0,), restitution=0.5, **bounds),)}
                if part is vi.RigidStop
                else {"elements": (vi.SoftStop((1.0,), stiffness=30.0, damping=0.2, **bounds),)}
            )
            m = vi.Mechanism(
                mass=[[1.0]], damping=[[c]], stiffness=[[k]], constant_force=(offset,),
                forces=(vi.Harmonic(w, (1.0,)),), **stop,
            )  # fmt: skip
            run = vi.simulate(m, start, impacts=1)
            assert run.end is (RunEnd.SILENT if beyond > 1.0 else RunEnd.IMPACTS), (part, beyond)


def test_what_moves_away_from_all_stops_or_rests_is_silent() -> None:
    away = vi.Mechanism(
        mass=[[1.0]], damping=[[0.0]], stiffness=[[0.0]],
        elements=(vi.RigidStop((1.0,), lower=0.0, restitution=0.5),),
    )  # fmt: skip
    assert vi.simulate(away, vi.State((1.0,), (2.0,))).end is RunEnd.SILENT
    bounced = vi.simulate(away, vi.State((1.0,), (-2.0,)))
    assert bounced.impacts.sum() == 1
    assert bounced.end is RunEnd.SILENT
    held = vi.Mechanism(
        mass=[[1.0]], damping=[[0.1]], stiffness=[[2.0]], forces=(vi.Harmonic(0.7, (0.3,)),),
        elements=(vi.Friction((1.0,), 1.0),),
    )  # fmt: skip
    assert vi.simulate(held, vi.State((0.2,), (0.0,))).end is RunEnd.SILENT


def test_silence_that_is_not_proved_is_quiet() -> None:
    # Of two undamped lines the amplitudes add up to more than the clearance, which is never reached:
    # sin t + sin(3 t) / 2 < 1.1
    forces = (vi.Harmonic(1.0, (-0.5,)), vi.Harmonic(3.0, (-8.5 * 0.5,)))
    m = vi.Mechanism(
        mass=[[1.0]], damping=[[0.0]], stiffness=[[0.5]], forces=forces,
        elements=(vi.RigidStop((1.0,), lower=-1.4, upper=1.4),),
    )  # fmt: skip
    forced = vi.State((0.0,), (1.0 + 1.5,))
    run = vi.simulate(m, forced)
    assert run.end is RunEnd.QUIET
    assert "proved" in run.end.sentence
    assert vi.simulate(m, forced, t_max=1e5).end is RunEnd.HORIZON


def test_a_slow_ball_is_followed_to_a_soft_stop_without_t_max() -> None:
    run = vi.simulate(ball_on_spring(1e14), vi.State((1.0,), (0.0,)), impacts=11)
    assert run.end is RunEnd.IMPACTS
    assert run.time[-1] == pytest.approx(
        FALL + 10 * period_on_spring(1e14), abs=2 * 11 * PER_FLIGHT
    )


@pytest.mark.parametrize("kind", ["soft", "rigid", "held"])
def test_members_of_sweeps_end_where_runs_do(kind: str) -> None:
    parts: dict[str, dict[str, object]] = {
        "soft": {"elements": (vi.SoftStop((1.0, 0.0), lower=0.0, stiffness=1e4),)},
        "rigid": {"elements": (vi.RigidStop((1.0, 0.0), lower=0.0, restitution=0.9),)},
        "held": {"elements": (vi.Friction((1.0, 0.0), 10.0),)},
    }
    m = beside_a_dashpot(1e9, force=-GRAVITY, **parts[kind])
    starts = vi.ListedStarts([[1.0, 0.0], [0.5, 0.0], [0.3, 0.1]], [[0.0, 1.0]] * 3)
    found = vi.sweep(m, over={}, start=starts, observe="final", settle_periods=0.0, periods=10.0,
                     progress=False)  # fmt: skip
    for k in range(3):
        state = vi.State(tuple(starts.position[k]), tuple(starts.velocity[k]))
        run = vi.simulate(m, state, t_max=10.0)
        assert run.end is RunEnd.HORIZON
        assert found["end"][k] == MemberStatus.OK
        assert np.array_equal(found["final_position"][k], run.position[-1])
        assert np.array_equal(found["final_velocity"][k], run.velocity_after[-1])
