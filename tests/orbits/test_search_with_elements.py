"""Lists of orbits of machines with elements: closed forms, classified motions, other descriptions."""

from __future__ import annotations

import math
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray as xr
from numpy.typing import NDArray
from scipy.linalg import expm

import vibroimpact as vi
from vibroimpact.cli import main as cli
from vibroimpact.model.stop import Stop
from vibroimpact.model.translations import Translations
from vibroimpact.orbits.near_returns import KnownLoops
from vibroimpact.orbits.problem import Flight, Signature
from vibroimpact.orbits.search_result import GuessEnd, MotionEnd, OrbitSearch
from vibroimpact.orbits.starts_between import starts_between

Array = NDArray[np.float64]
REST = vi.State((0.0,), (0.0,))
NO_DRIFT = Translations(np.zeros((1, 0)), ())


def one(
    *elements: Any, omega: float, force: float = 1.0, damping: float = 0.1, stiffness: float = 1.0
) -> vi.Mechanism:
    return vi.Mechanism(
        mass=[[1.0]], damping=[[damping]], stiffness=[[stiffness]], elements=elements,
        forces=(vi.Harmonic(omega, (force,)),),
    )  # fmt: skip


def between_soft_stops(omega: float) -> vi.Mechanism:
    stop = vi.SoftStop((1.0,), lower=-0.5, upper=0.5, stiffness=20.0)
    return one(stop, omega=omega)


@cache
def coexisting() -> OrbitSearch:
    return vi.find_orbits(between_soft_stops(0.6), most_cycles=1, starts=6)


@cache
def paired() -> OrbitSearch:
    return vi.find_orbits(between_soft_stops(0.5), most_cycles=1, starts=3)


def stable(search: OrbitSearch) -> list[vi.Orbit]:
    return [orbit for orbit in search.orbits if orbit.stable]


def by_differences(orbit: vi.Orbit) -> Array:
    """Multipliers by central differences of the simulation over a period, from within a flight."""
    m, h = orbit.mechanism, 2.0**-20
    half = orbit.durations[0] / 2.0
    run = vi.simulate(m, orbit.state, t_max=half)
    start = np.concatenate(run.at(half))
    phase = orbit.state.phase + m.omega * half

    def after(z: Array) -> Array:
        run = vi.simulate(m, vi.State(tuple(z[:1]), tuple(z[1:]), phase), t_max=orbit.period)
        return np.concatenate(run.at(orbit.period))

    np.testing.assert_allclose(after(start), start, rtol=0.0, atol=1e-12)
    sides = [after(start + h * e) - after(start - h * e) for e in np.eye(2)]
    return np.linalg.eigvals(np.column_stack(sides) / (2.0 * h))


# ---- what is listed ------------------------------------------------------------------------------


@pytest.mark.slow
def test_coexisting_attractors_of_soft_stops_are_those_that_classified_motions_settle_on() -> None:
    rng = np.random.default_rng(1)
    starts = [
        vi.State((rng.uniform(-1.0, 1.0),), (rng.uniform(-2.0, 2.0),), rng.uniform(0.0, 6.0))
        for _ in range(8)
    ]
    attractors = [vi.classify(between_soft_stops(0.6), start) for start in starts]
    found = {orbit.symbol: orbit for orbit in stable(coexisting())}
    assert {*found} == {a.symbol for a in attractors} == {"1-1-1", "1-2-2"}
    for attractor in attractors:
        np.testing.assert_allclose(
            np.poly(found[str(attractor.symbol)].multipliers), np.poly(attractor.multipliers),
            rtol=0.0, atol=1e-7,
        )  # fmt: skip


def test_an_unstable_orbit_between_them_has_the_multipliers_of_differences() -> None:
    (orbit,) = (o for o in coexisting().orbits if o.admissible and not o.stable)
    np.testing.assert_allclose(
        np.poly(orbit.multipliers), np.poly(by_differences(orbit)), rtol=0.0, atol=1e-6
    )
    assert abs(orbit.multipliers[0]) > 1.0


def test_a_pair_of_orbits_between_equal_soft_stops_is_listed_with_the_image_marked() -> None:
    search, m = paired(), between_soft_stops(0.5)
    (k,) = (
        k for k, of in enumerate(search.mirror_of) if of is not None and search.orbits[k].stable
    )
    image, orbit = search.orbits[k], search.orbits[search.mirror_of[k] or 0]
    assert search.orbits.index(orbit) == search.mirror_of[k]
    s = orbit.state
    start = vi.State((-s.position[0],), (-s.velocity[0],), s.phase + math.pi)
    run = vi.simulate(m, start, t_max=1.01 * orbit.period)
    passed = np.column_stack([run.position, run.velocity_after])  # the events of its period
    for state in image.states:
        assert np.abs(passed - state[:2]).max(axis=1).min() < 1e-9
    assert np.abs(np.sort(orbit.states[:, 1]) - np.sort(image.states[:, 1])).max() > 1e-3


def test_every_listed_orbit_is_listed_once() -> None:
    """Also wherever it begins, and whichever forcing cycle."""
    for search in (coexisting(), paired()):
        for k, orbit in enumerate(search.orbits):
            for other in search.orbits[:k]:
                for turn in range(len(orbit.durations)):
                    alike = orbit.signature.rolled(turn) == other.signature
                    states = np.roll(orbit.states, -turn, axis=0)
                    assert not alike or np.abs((states - other.states)[:, :-1]).max() > 1e-5


def test_a_search_that_moves_with_its_stop_finds_the_orbits_of_the_stop_at_rest() -> None:
    """x = u + a sin(omega t) below a stop at 1/4 + a sin(omega t): u meets one that stands still."""
    a, w, c, k, f = 0.25, 2.6, 0.1, 1.0, 1.0
    moving = vi.RigidStop((1.0,), upper=0.25, restitution=0.75, motion=vi.Harmonic(w, (a,)))
    own = vi.Mechanism(
        mass=[[1.0]], damping=[[c]], stiffness=[[k]],
        elements=(vi.RigidStop((1.0,), upper=0.25, restitution=0.75),),
        forces=(vi.Harmonic(w, (f + a * (w**2 - k),), (-c * a * w,)),),
    )  # fmt: skip
    here = vi.find_orbits(one(moving, omega=w, damping=c, force=f), most_impacts=2, starts=8)
    there = vi.find_orbits(own, most_impacts=2, starts=8)
    wanted, got = (
        sorted((o.symbol, -abs(o.multipliers[0]), -o.least_impact_speed)
               for o in search.orbits if o.admissible)
        for search in (there, here)
    )  # fmt: skip
    assert len(got) == 3
    assert [symbol for symbol, *_ in got] == [symbol for symbol, *_ in wanted]
    np.testing.assert_allclose([x[1:] for x in got], [x[1:] for x in wanted], rtol=1e-9)


def test_both_orbits_of_a_ball_on_an_oscillating_table_have_their_closed_forms() -> None:
    """One bounce a cycle at the phases +-phi, with multipliers of the map of (time, velocity)."""
    g, a, r = 1.0, 1.1, 0.5
    table = vi.RigidStop((1.0,), lower=0.0, restitution=r, motion=vi.Harmonic(1.0, (a,)))
    m = vi.Mechanism(mass=[[1.0]], damping=[[0.0]], stiffness=[[0.0]], elements=(table,),
                     constant_force=(-g,))  # fmt: skip
    search = vi.find_orbits(m, most_cycles=1, most_impacts=1, starts=40)
    phi, period, up = math.acos(math.pi * g * (1.0 - r) / (1.0 + r) / a), 2.0 * math.pi, math.pi * g
    bouncing = [orbit for orbit in search.orbits if orbit.symbol == "1-0-1"]
    assert len(bouncing) == 2
    for orbit in bouncing:
        phase = phi if orbit.stable else 2.0 * math.pi - phi
        wanted = [a * math.sin(phase), up, phase]
        np.testing.assert_allclose(orbit.states, [wanted], rtol=1e-12)
        q, push = a * math.cos(phase) + up, -(1.0 + r) * a * math.sin(phase)
        jacobian = [
            [1.0, period / q],
            [push, -r * (1.0 - g * period / q) + push * period / q],
        ]
        np.testing.assert_allclose(
            np.poly(orbit.multipliers), np.poly(np.array(jacobian)), rtol=0.0, atol=1e-11
        )
    assert {orbit.stable for orbit in bouncing} == {True, False}


def test_the_steady_motion_under_dry_friction_is_found_without_a_stop() -> None:
    """Den Hartog's amplitude of x'' + x + f sign(x') = cos(omega t), 1931."""
    omega, f = 0.6, 0.3
    m = one(vi.Friction((1.0,), f), omega=omega, damping=0.0)
    search = vi.find_orbits(m, most_cycles=1, starts=3)
    (orbit,) = (o for o in search.orbits if o.admissible)
    v, u = 1.0 / (1.0 - omega**2), math.tan(math.pi / (2.0 * omega)) / omega
    assert abs(abs(orbit.states[0, 0]) - math.sqrt(v**2 - (f * u) ** 2)) < 1e-13
    assert orbit.stable
    assert search.motions[MotionEnd.CHANGING] == 3
    assert "1-0-0  -" in search.table()  # no impacts


def test_stick_slip_on_a_belt_is_found_without_forcing() -> None:
    """The spring overcomes the static level at the speed of the belt."""
    c, static, speed = 0.02, 0.2, 0.05
    m = vi.Mechanism(mass=[[1.0]], damping=[[c]], stiffness=[[1.0]],
                     elements=(vi.Friction((1.0,), 0.1, static, belt_speed=speed),))  # fmt: skip
    search = vi.find_orbits(m, most_impacts=2, starts=1)
    (orbit,) = search.orbits
    assert abs(orbit.states[:, 0].max() - (static - c * speed)) < 1e-15
    assert orbit.multipliers.tolist() == [0.0]
    assert search.to_dataset().sizes["multiplier"] == 1


def test_the_orbit_of_a_kicked_oscillator_is_the_fixed_point_of_its_exponential() -> None:
    mass, c, k, p, omega = 2.0, 0.1, 1.0, 0.4, 2.0
    kicks = vi.PhaseSwitch(omega, (0.5,), ((0.0,),), impulses=((p,),))
    m = vi.Mechanism(mass=[[mass]], damping=[[c]], stiffness=[[k]], elements=(kicks,))
    (orbit,) = vi.find_orbits(m, most_cycles=1, starts=2).orbits
    free = expm(np.array([[0.0, 1.0], [-k / mass, -c / mass]]) * 2.0 * math.pi / omega)
    after = orbit.states[np.isclose(orbit.states[:, 2] % (2.0 * math.pi), 0.5)]
    wanted = np.linalg.solve(np.eye(2) - free, [0.0, p / mass])
    np.testing.assert_allclose(after[:, :2], [wanted], rtol=0.0, atol=1e-13)


# ---- what is counted -----------------------------------------------------------------------------


def test_motions_that_find_orbit_refuses_are_counted_with_its_sentence() -> None:
    """Two equal masses, joined by a dashpot, meet their stops at one instant."""
    stops = tuple(vi.RigidStop(row, upper=0.25, restitution=0.5) for row in np.eye(2).tolist())
    m = vi.Mechanism(
        mass=np.eye(2).tolist(), damping=[[0.25, -0.125], [-0.125, 0.25]],
        stiffness=np.eye(2).tolist(), elements=stops, forces=(vi.Harmonic(0.75, (1.0, 1.0)),),
    )  # fmt: skip
    search = vi.find_orbits(m, starts=2)
    (why,) = (reason for reason in search.unresolved if "one instant" in reason)
    assert search.unresolved[why] >= 1
    assert f"{search.unresolved[why]} ended on none of them: {why}" in repr(search)


def test_one_orbit_of_a_family_in_which_friction_sticks_all_the_time_is_listed() -> None:
    stop = vi.SoftStop((0.0, 1.0), upper=0.25, stiffness=8.0)
    m = vi.Mechanism(
        mass=np.eye(2).tolist(), damping=(0.125 * np.eye(2)).tolist(),
        stiffness=np.eye(2).tolist(), elements=(vi.Friction((1.0, 0.0), 9.0), stop),
        forces=(vi.Harmonic(0.75, (0.0, 1.0)),),
    )  # fmt: skip
    search = vi.find_orbits(m, most_cycles=1, most_impacts=2, starts=3)
    assert not search.unresolved
    (orbit,) = (o for o in search.orbits if o.attracting)
    assert orbit.family_dimension == 1


def test_motions_that_settle_beyond_the_bounds_are_counted() -> None:
    search = vi.find_orbits(between_soft_stops(0.6), most_cycles=1, most_impacts=1, starts=2)
    beyond = "it settled on an orbit of more than 1 cycles or 1 impacts"
    assert search.unresolved == {beyond: 2}
    assert coexisting().unresolved == {}


def test_every_motion_and_every_guess_is_counted() -> None:
    search = paired()
    assert sum(search.motions.values()) == search.starts == 3
    images = sum(of is not None for of in search.mirror_of)
    new = search.guesses[GuessEnd.NEW] + search.guesses[GuessEnd.INADMISSIBLE]
    assert new + images == len(search)


def test_loops_with_equal_impacts_and_other_flights_are_two() -> None:
    """Until they begin at another event; the flights turn with the impacts."""
    a, b, states = Flight(0, 1), Flight(5, 0), np.array([[1.0, 0.2, 0.1], [2.0, 0.3, 2.0]])
    known, impacts = KnownLoops(np.array([10.0, 10.0]), NO_DRIFT), (Stop(0, 1), Stop(0, 1))
    known.add(Signature(impacts, 1, False, (a, b)), states)
    assert known.has(Signature(impacts, 1, False, (b, a)), states[::-1], 1e-9)
    assert not known.has(Signature(impacts, 1, False, (b, a)), states, 1e-9)
    assert not known.has(Signature(impacts, 1, False, (a, a)), states, 1.0)


@pytest.mark.slow
def test_random_starts_lie_between_stops_that_move() -> None:
    wall = vi.Harmonic(1.0, (0.25,), (0.25,))
    moving = vi.RigidStop((1.0,), upper=0.5, motion=wall)
    m = one(moving, vi.RigidStop((1.0,), lower=-0.5), omega=2.0)
    starts, rng = starts_between(m), np.random.default_rng(2)
    places = []
    for number in range(200):
        state = starts.draw(rng, number)
        t = state.phase / m.omega
        places.append(state.position[0])
        assert -0.5 <= state.position[0] <= 0.5 + 0.25 * (math.sin(t) + math.cos(t))
        vi.simulate(m, state, impacts=1, t_max=0.1)  # refuses a start behind a stop
    assert np.ptp(places) > 0.9


def test_the_length_of_random_starts_has_the_unit_of_a_belts_displacement() -> None:
    """The belt is the largest length; not its speed, which is larger in a short unit of time."""
    for time in (1.0, 2.0**-20):
        m = vi.Mechanism(
            mass=[[1.0]], damping=[[0.1 / time]], stiffness=[[1.0 / time**2]],
            elements=(vi.Friction((1.0,), 0.5 / time**2, motion=vi.Harmonic(0.5 / time, (8.0,))),),
        )  # fmt: skip
        assert starts_between(m).length == 8.0


def test_stops_that_leave_no_place_are_refused() -> None:
    squeezing = (
        vi.RigidStop((1.0,), upper=0.5, motion=vi.Harmonic(1.0, (0.0,), (-2.0,))),
        vi.RigidStop((1.0,), lower=-0.5),
    )
    with pytest.raises(vi.InvalidParameterError, match="no place between the stops"):
        vi.find_orbits(one(*squeezing, omega=1.0), starts=1)


# ---- the dataset and the command -----------------------------------------------------------------


def test_the_dataset_holds_the_flights_with_which_every_orbit_is_solved_again() -> None:
    search, data = coexisting(), coexisting().to_dataset()
    ends = np.cumsum(data.row_size.values)
    for k, orbit in enumerate(search.orbits):
        rows = slice(ends[k] - data.row_size.values[k], ends[k])
        columns = [data[name].values[rows] for name in ("contact", "side", "mode", "watch")]
        contact, side, mode, watch = (column.tolist() for column in columns)
        again = Signature(
            tuple(zip(contact, side, strict=True)),  # type: ignore[arg-type]
            int(data.cycles[k]), False, tuple(zip(mode, watch, strict=True)),  # type: ignore[arg-type]
        )  # fmt: skip
        assert again == orbit.signature
        assert orbit.symbol.count("-") == 2
        assert sum(data.struck.values[rows]) == sum(map(int, orbit.symbol.split("-")[1:]))


@pytest.mark.usefixtures("own_folder")
def test_the_command_lists_and_writes_orbits_of_a_machine_with_elements(
    capsys: pytest.CaptureFixture[str],
) -> None:
    Path("m.toml").write_text(
        "[mechanism]\nmass = [[1.0]]\ndamping = [[0.1]]\nstiffness = [[1.0]]\n"
        "[[mechanism.forces]]\nomega = 0.6\nsine = [1.0]\n"
        '[[mechanism.elements]]\nkind = "soft_stop"\nrow = [1.0]\nlower = -0.5\nupper = 0.5\n'
        "stiffness = 20.0\n"
    )
    counts = ["--most-cycles", "1", "--starts", "2", "--out", "o.nc"]
    assert cli.main(["orbits", "--config", "m.toml", *counts]) == 0
    search = vi.find_orbits(between_soft_stops(0.6), most_cycles=1, starts=2)
    assert search.table() in capsys.readouterr().out
    with xr.open_dataset("o.nc", engine="h5netcdf") as data:
        assert [*data.symbol.values] == [orbit.symbol for orbit in search.orbits]
