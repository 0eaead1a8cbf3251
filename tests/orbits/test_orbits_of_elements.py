"""Periodic orbits of machines with elements: closed forms, 50 digits, limits, the simulation."""

from __future__ import annotations

import math
from collections.abc import Iterator
from functools import cache
from typing import Any

import numpy as np
import pytest
from mpmath import mp, mpf
from numpy.typing import NDArray
from scipy.linalg import expm
from support.event_reference import Reference
from support.exact_chain import DIGITS, Flight, flights, follow, start_of

import vibroimpact as vi
from vibroimpact.model.parameters import parameter_value, with_parameter
from vibroimpact.orbits.closing_segment import ClosingLoop, closing_loop
from vibroimpact.orbits.find import solve
from vibroimpact.orbits.problem import Signature

EPS = 2.0**-52
REST = vi.State((0.0,), (0.0,))
Array = NDArray[np.float64]


@pytest.fixture(autouse=True)
def fifty_digits() -> Iterator[None]:
    with mp.workdps(DIGITS + 15):
        yield


def one(*elements: Any, omega: float = 0.75, force: float = 0.75, damping: float = 0.125,
        stiffness: float = 1.0, **more: Any) -> vi.Mechanism:  # fmt: skip
    return vi.Mechanism(
        mass=[[1.0]], damping=[[damping]], stiffness=[[stiffness]], elements=elements,
        forces=(vi.Harmonic(omega, (force,)),), **more,
    )  # fmt: skip


# numbers of few binary digits: the reference at 50 digits holds them exactly
STOP, WAVE = vi.SoftStop, vi.Harmonic(0.75, (0.125,))
MACHINES = {
    "soft, by gap": one(STOP((1.0,), upper=0.5, stiffness=8.0, damping=0.5, law="linear")),
    "soft, by force": one(STOP((1.0,), upper=0.5, stiffness=8.0, damping=2.0)),
    "soft on both sides": one(
        STOP((1.0,), lower=-0.5, upper=0.25, stiffness=(4.0, 8.0), damping=(2.0, 0.5))),
    "soft, limited": one(STOP((1.0,), upper=0.5, stiffness=8.0, damping=2.0, law="limited")),
    "limited on both sides": one(
        STOP((1.0,), lower=-0.5, upper=0.25, stiffness=(4.0, 8.0), damping=(2.0, 0.5),
        law="limited")),
    "preloaded": one(STOP((1.0,), upper=-0.25, stiffness=3.0, damping=1.0)),
    "soft, moving": one(STOP((1.0,), upper=0.5, stiffness=8.0, damping=1.0, motion=WAVE)),
    "friction": one(vi.Friction((1.0,), kinetic=0.75), force=1.0),
    "friction that reverses": one(vi.Friction((1.0,), kinetic=0.125)),
    "friction on a belt": one(
        vi.Friction((1.0,), kinetic=0.25, static=0.5, belt_speed=0.25), force=0.25),
    "rigid, moving": one(vi.RigidStop((1.0,), upper=0.5, restitution=0.75, motion=WAVE)),
    "rigid and friction": one(
        vi.RigidStop((1.0,), upper=0.5, restitution=0.75), vi.Friction((1.0,), kinetic=0.125)),
    "soft and friction": one(
        STOP((1.0,), upper=0.25, stiffness=8.0, damping=2.0), vi.Friction((1.0,), kinetic=0.25,
        static=0.375), force=1.0),
}  # fmt: skip
PARAMETERS = {
    "soft, by gap": ("elements[0].upper", "elements[0].stiffness", "elements[0].damping"),
    "soft, by force": ("elements[0].upper", "elements[0].damping", "forces[0].sine[0]"),
    "soft on both sides": ("elements[0].lower", "elements[0].stiffness[0]"),
    "soft, limited": ("elements[0].upper", "elements[0].stiffness", "elements[0].damping"),
    "limited on both sides": ("elements[0].lower", "elements[0].damping[1]"),
    "preloaded": ("elements[0].upper",),
    "soft, moving": ("elements[0].motion[0].sine[0]",),
    "friction": ("elements[0].kinetic",),
    "friction that reverses": ("elements[0].kinetic",),
    "friction on a belt": ("elements[0].belt_speed", "elements[0].static"),
    "rigid, moving": ("elements[0].motion[0].sine[0]", "elements[0].restitution"),
    "rigid and friction": ("elements[1].kinetic", "elements[0].upper"),
    "soft and friction": ("elements[1].kinetic", "elements[0].stiffness"),
}
TO_THIRD_ORDER = ("soft, by gap", "soft, by force", "friction", "rigid, moving")


@pytest.fixture(scope="module", params=MACHINES)
def found(request: pytest.FixtureRequest) -> tuple[str, vi.Orbit]:
    orbit = vi.find_orbit(MACHINES[request.param], REST)
    assert orbit.stable, orbit
    return request.param, orbit


def chain_of(orbit: vi.Orbit) -> list[Flight]:
    """Flights of one period, from the simulation: the guards as the reference writes them."""
    run = vi.simulate(orbit.system, orbit.state, t_max=1.25 * orbit.period)
    return flights(run, Reference(orbit.mechanism, orbit.state))[: len(orbit.durations)]


def chain_at(m: vi.Mechanism, orbit: vi.Orbit, chain: list[Flight]) -> list[Flight]:
    """The same guards of a machine with another number."""
    before, after = (Reference(x, orbit.state) for x in (orbit.mechanism, m))
    out = []
    for flight in chain:
        rows = [margin.row for margin in before.mode(flight.states)[1]]
        at = next(i for i, row in enumerate(rows) if np.array_equal(row, flight.row))
        out.append(flight._replace(row=after.mode(flight.states)[1][at].row))
    return out


class Return:
    """The return map to the section of the first event at 50 digits, of x or v and the phase."""

    def __init__(self, orbit: vi.Orbit, parameter: str) -> None:
        self.orbit, self.parameter = orbit, parameter
        self.chain = chain_of(orbit)
        compiled = orbit.problem.compiled(0.0)
        self.first = orbit.signature.first
        self.left_out = compiled.solved_coordinate(self.first)
        self.kept = [i for i in range(3) if i != self.left_out]

    def __call__(self, xi: list[mpf], p: float) -> list[mpf]:
        m = with_parameter(self.orbit.mechanism, self.parameter, p)
        assert isinstance(m, vi.Mechanism)
        chain = chain_at(m, self.orbit, self.chain)
        reference = Reference(m, self.orbit.state)
        zeta = [mpf(0)] * 3
        for i, x in zip(self.kept, xi, strict=True):
            zeta[i] = x
        # the section: the guard of the last flight is zero, linear in x and v
        row = chain[-1].row
        z = start_of(reference, replace_state(zeta))
        rest = mp.fsum(mpf(float(r)) * y for r, y in zip(row, z, strict=True))
        zeta[self.left_out] = -rest / mpf(float(row[self.left_out]))
        times, end = follow(reference, start_of(reference, replace_state(zeta)), chain)
        theta = zeta[2] + mpf(m.omega) * times[-1] - 2 * mp.pi * self.orbit.signature.cycles
        return [[*end[:2], theta][i] for i in self.kept]


def replace_state(zeta: list[mpf]) -> Any:
    class Exact:
        position, velocity, phase = (zeta[0],), (zeta[1],), zeta[2]

    return Exact


def difference(f: Return, xi: list[mpf], p: float, along: list[tuple[Any, int]]) -> list[mpf]:
    """Mixed central difference; directions are numbers of coordinates, 2 for the parameter."""
    if not along:
        return f(xi, p)
    (step, i), *rest = along
    sides = []
    for sign in (1, -1):
        there = [x + sign * step * (j == i) for j, x in enumerate(xi)]
        sides.append(difference(f, there, p + float(sign * step) * (i == 2), rest))
    return [(a - b) / (2 * step) for a, b in zip(*sides, strict=True)]


def test_the_orbit_returns_to_itself_at_fifty_digits(found: tuple[str, vi.Orbit]) -> None:
    _, orbit = found
    start = orbit.state
    reference = Reference(orbit.mechanism, start)
    times, end = follow(reference, start_of(reference, start), chain_of(orbit))
    there = start_of(reference, start)
    # a stable orbit forgets the rounding of its start, which Newton's method leaves at 1e-14 or so
    assert abs(float(times[-1]) - orbit.period) < 1e-12 * orbit.period
    assert max(abs(float(a - b)) for a, b in zip(end, there, strict=True)) < 1e-12


@pytest.mark.slow
def test_derivatives_of_the_return_map_are_those_at_fifty_digits(
    found: tuple[str, vi.Orbit],
) -> None:
    """By coordinates and parameters. A step of h leaves h^2: 2^-40 of the parameter."""
    what, orbit = found
    for number, parameter in enumerate(PARAMETERS[what]):
        f = Return(orbit, parameter)
        p = parameter_value(orbit.mechanism, parameter)
        state = [*orbit.state.position, *orbit.state.velocity, orbit.state.phase]
        xi = [mpf(state[i]) for i in f.kept]
        forms = vi.full_map(orbit, parameter)
        fine, coarse = mpf(10) ** -12, mpf(2) ** -20
        orders = ((2,), (1, 2), (0, 1, 2)) if what in TO_THIRD_ORDER else ((2,), (0, 2))
        for directions in orders[: 1 if number else None]:
            along = [(coarse if i == 2 else fine, i) for i in directions]
            wanted = [float(x) for x in difference(f, xi, p, along)]
            got = forms.derivative(*(np.eye(3)[i] for i in directions))
            size = 1e-9 * max(1.0, float(np.abs(wanted).max()))
            np.testing.assert_allclose(got, wanted, rtol=0.0, atol=size, err_msg=parameter)


def test_multipliers_are_those_of_the_saltation_matrices(found: tuple[str, vi.Orbit]) -> None:
    """Of a period from within a flight."""
    _, orbit = found
    m, k = orbit.mechanism, int(np.argmax(orbit.durations))
    compiled, mode = orbit.problem.compiled(0.0), orbit.problem.modes[k]
    if compiled.modes[mode].forgotten:  # a start at speed zero, to rounding, is a decision
        slips = np.array(orbit.problem.modes) != mode
        k = int(np.argmax(orbit.durations * slips))
        mode = orbit.problem.modes[k]
    x, v, theta = compiled.after(orbit.states[k], orbit.durations[k] / 2.0, mode)
    got = vi.map_derivative(m, vi.State((x,), (v,), theta), t_max=orbit.period, impacts=1000)
    mu = np.linalg.eigvals(got.matrix[:2, :2])
    np.testing.assert_allclose(np.poly(orbit.multipliers), np.poly(mu), rtol=0.0, atol=1e-11)
    assert orbit.zero_multipliers == sum(abs(mu) < 1e-11)
    assert orbit.determinant_error < 1e-12


def test_the_free_period_of_a_bilinear_oscillator_is_half_of_each() -> None:
    k2 = 8.0
    m = vi.Mechanism(mass=[[1.0]], damping=[[0.0]], stiffness=[[1.0]],
                     elements=(STOP((1.0,), upper=0.0, stiffness=k2),))  # fmt: skip
    orbit = vi.find_orbit(m, vi.State((0.0,), (1.0,)))
    assert orbit.symbol == "1-0"
    assert abs(orbit.period - math.pi * (1.0 + 1.0 / math.sqrt(1.0 + k2))) < 16 * EPS
    assert orbit.family_dimension == 1
    assert orbit.admissible


def test_a_stiff_stop_tends_to_the_rigid_one() -> None:
    """With 1 / sqrt(k), the time of contact: a fourth of k doubles the distance."""
    zeta = 0.125
    loss = math.exp(-math.pi * zeta / math.sqrt(1.0 - zeta**2))
    rigid = vi.find_orbit(one(vi.RigidStop((1.0,), upper=0.5, restitution=loss)), REST)
    off, apart = [], []
    for k in (2.0**20, 2.0**22, 2.0**24):
        stop = STOP((1.0,), upper=0.5, stiffness=k, damping=2.0 * zeta * math.sqrt(k), law="linear")
        soft = vi.find_orbit(one(stop), vi.simulate(one(stop), rigid.state, impacts=6))
        assert soft.symbol == rigid.symbol
        # the state after an impact is the one at which the spring lets go
        off.append(abs(soft.states[1, 1] - rigid.states[0, 1]))
        apart.append(float(np.abs(np.poly(soft.multipliers) - np.poly(rigid.multipliers)).max()))
    for distances in (off, apart):
        ratios = np.divide(distances[:-1], distances[1:])
        np.testing.assert_allclose(ratios, 2.0, rtol=0.02)


def den_hartog(omega: float, friction: float) -> float:
    """Amplitude of x'' + x + f sign(x') = cos(omega t + phi) that does not stop (1931)."""
    v = 1.0 / (1.0 - omega**2)
    u = math.tan(math.pi / (2.0 * omega)) / omega
    return math.sqrt(v**2 - (friction * u) ** 2)


@pytest.mark.parametrize(("omega", "friction"), [(0.6, 0.3), (0.8, 0.2), (1.4, 0.25)])
def test_den_hartogs_amplitude_of_the_friction_oscillator(omega: float, friction: float) -> None:
    m = one(vi.Friction((1.0,), friction), omega=omega, force=1.0, damping=0.0)
    orbit = vi.find_orbit(m, REST)
    assert orbit.stable
    assert orbit.symbol == "1-0-0"  # no stop is met
    assert abs(abs(orbit.states[0, 0]) - den_hartog(omega, friction)) < 1e-13


def test_a_block_on_a_belt_leaves_it_where_the_spring_overcomes_the_static_level() -> None:
    """And forgets where it came from: its only multiplier is zero."""
    c, static, speed = 0.02, 0.2, 0.05
    m = vi.Mechanism(mass=[[1.0]], damping=[[c]], stiffness=[[1.0]],
                     elements=(vi.Friction((1.0,), 0.1, static, belt_speed=speed),))  # fmt: skip
    orbit = vi.find_orbit(m, REST)
    leaves = orbit.states[:, 0].max()
    assert abs(leaves - (static - c * speed)) < 4 * EPS
    assert orbit.multipliers.tolist() == [0.0]
    assert orbit.zero_multipliers == 1
    assert orbit.stable


def test_a_ball_on_a_table_has_its_closed_form() -> None:
    g, a, r = 1.0, 1.1, 0.5
    table = vi.RigidStop((1.0,), lower=0.0, restitution=r, motion=vi.Harmonic(1.0, (a,)))
    m = vi.Mechanism(mass=[[1.0]], damping=[[0.0]], stiffness=[[0.0]], elements=(table,),
                     constant_force=(-g,))  # fmt: skip
    orbit = vi.find_orbit(m, vi.State((a * math.sin(0.3),), (2.0 + a * math.cos(0.3),), phase=0.3))
    phase = math.acos(math.pi * g * (1.0 - r) / (1.0 + r) / a)
    np.testing.assert_allclose(
        orbit.states, [[a * math.sin(phase), math.pi * g, phase]], rtol=1e-13
    )


def test_backlash_has_the_orbit_and_multipliers_of_the_classified_motion() -> None:
    m = vi.Mechanism(
        mass=np.diag([1.0, 2.0]).tolist(), damping=np.diag([0.05, 0.05]).tolist(),
        stiffness=np.diag([0.2, 0.0]).tolist(), constant_force=(0.05, -0.05),
        elements=(STOP((1.0, -1.0), -0.1, 0.1, stiffness=50.0, damping=0.5),),
        forces=(vi.Harmonic(1.5, (0.4, 0.0)),),
    )  # fmt: skip
    start = vi.State((0.0, 0.0), (0.0, 0.0))
    orbit, attractor = vi.find_orbit(m, start), vi.classify(m, start)
    assert orbit.symbol == attractor.symbol == "1-2-1"
    np.testing.assert_allclose(
        np.poly(orbit.multipliers), np.poly(attractor.multipliers), rtol=0.0, atol=1e-8
    )


def test_an_orbit_beyond_the_limits_of_its_states_is_not_admissible() -> None:
    """Friction that should stick: the same reversals at a level above the onset of sticking."""
    m = one(vi.Friction((1.0,), 0.3), omega=0.6, force=1.0, damping=0.0)
    orbit = vi.find_orbit(m, REST)
    rubbing = with_parameter(m, "elements[0].kinetic", 0.7)
    beyond = vi.find_orbit(rubbing, orbit)
    assert beyond.converged
    assert "element 0" in beyond.inadmissible_reason
    assert vi.find_orbit(rubbing, REST).zero_multipliers == 1  # the motion itself sticks


def test_an_orbit_that_reverses_where_static_friction_holds_is_not_admissible() -> None:
    """It solves the equations without the state that sticks; the simulation sticks there."""
    load = vi.NormalLoad(0.5, (0.3,), (), vi.Harmonic(0.75, (0.4,)))
    m = one(vi.Friction((1.0,), 0.5, 0.6, load=load), force=0.75)
    impacts, states = ((0, 1), (0, -1), (0, -1)), [
        [-1.43723832, 1.07012958, 6.1102534], [1.53914899, 0.0, 8.02147952],
        [-0.470362363, -1.28611502, 10.5382298],
    ]  # fmt: skip
    signature = Signature(impacts, 1, False, ((0, 0), (1, 1), (3, 0)))  # type: ignore[arg-type]
    guess = vi.Guess(np.array(states), np.array([2.54830149, 3.35566698, 2.47361194]))
    orbit = solve(m, signature, guess)
    assert orbit.converged
    assert np.all(np.abs(orbit.multipliers) < 1.0)
    assert "friction 0 would stick at the end of flight 0" in orbit.inadmissible_reason
    assert not orbit.stable
    before = vi.State((-1.43723832,), (1.07012958,), 6.1102534)
    run = vi.simulate(m, before, t_max=2.6)
    assert vi.FrictionState.STICK in run.states[:, 0]
    settled = vi.find_orbit(m, REST)
    assert settled.admissible
    assert settled.zero_multipliers == 1


def test_impacts_that_stop_leave_the_orbit_of_the_changes_after_them() -> None:
    """A far soft stop is met at first only; then the orbit is the one without it."""
    stop, f = STOP((1.0,), upper=3.0, stiffness=8.0), vi.Friction((1.0,), 0.3)
    run = vi.simulate(one(f, stop, omega=0.6, force=1.0), vi.State((2.0,), (5.0,)), t_max=400.0)
    assert run.impacts.any()
    orbit = vi.find_orbit(run.system, run)
    alone = vi.find_orbit(one(f, omega=0.6, force=1.0), REST)
    assert orbit.symbol == alone.symbol == "1-0-0"
    np.testing.assert_allclose(np.sort(orbit.states[:, 0]), np.sort(alone.states[:, 0]), rtol=1e-12)


@cache
def beside_a_stop(element: Any, push: float) -> tuple[vi.Orbit, vi.Orbit]:
    """Orbits of a mass that an element holds, coupled to one that meets a soft stop, and of the latter alone."""
    stop = STOP((0.0, 1.0), upper=0.25, stiffness=8.0)
    m = vi.Mechanism(
        mass=[[1.0, 0.2], [0.2, 1.0]], damping=[[0.125, -0.05], [-0.05, 0.125]],
        stiffness=[[1.0, -0.3], [-0.3, 1.0]], elements=(element, stop), constant_force=(push, 0.0),
        forces=(vi.Harmonic(0.75, (0.0, 1.0)),),
    )  # fmt: skip
    alone = vi.Mechanism(
        mass=[[1.0]], damping=[[0.125]], stiffness=[[1.0]], forces=(vi.Harmonic(0.75, (1.0,)),),
        elements=(STOP((1.0,), upper=0.25, stiffness=8.0),),
    )  # fmt: skip
    return vi.find_orbit(m, vi.State((0.0, 0.0), (0.0, 0.0))), vi.find_orbit(alone, REST)


@pytest.mark.parametrize(
    ("element", "push", "structural"),
    [
        (vi.Friction((1.0, 0.0), 9.0), 0.0, [1.0, 0.0]),
        (vi.RigidStop((1.0, 0.0), lower=0.0, restitution=0.0), -9.0, [0.0, 0.0]),
    ],
)
def test_what_is_held_all_the_time_adds_its_structural_multipliers_to_those_of_the_rest(
    element: Any, push: float, structural: list[float]
) -> None:
    """Friction: 1 of its place, 0 of its speed; a stop that is rested on: both 0."""
    orbit, alone = beside_a_stop(element, push)
    assert orbit.admissible
    assert alone.stable
    assert orbit.attracting
    assert orbit.family_dimension == structural.count(1.0)
    wanted = np.poly([*alone.multipliers, *structural])
    np.testing.assert_allclose(np.poly(orbit.multipliers), wanted, rtol=0.0, atol=1e-11)
    jacobian = vi.full_map(orbit).jacobian()  # of the others alone
    np.testing.assert_allclose(np.poly(jacobian), np.poly(alone.multipliers), rtol=0.0, atol=1e-11)
    np.testing.assert_allclose(
        np.sort(orbit.states[:, 1]), np.sort(alone.states[:, 0]), rtol=0.0, atol=1e-12
    )


def test_a_branch_of_a_mass_that_rests_all_the_time_is_that_of_the_others() -> None:
    orbit, alone = beside_a_stop(vi.RigidStop((1.0, 0.0), lower=0.0, restitution=0.0), -9.0)
    branch = vi.continue_orbit(orbit, "forces[0].omega", (0.749, 0.752))
    last = vi.find_orbit(with_parameter(alone.system, "forces[0].omega", branch.values[-1]), alone)
    wanted = np.poly([*last.multipliers, 0.0, 0.0])
    np.testing.assert_allclose(np.poly(branch.multipliers[-1]), wanted, rtol=0.0, atol=1e-10)


def test_a_floor_that_moves_carries_what_rests_on_it_until_its_force_vanishes() -> None:
    """x = a sin t; the force of the floor is 1 + x'' = 1 - a sin t, at least 1 - a."""

    def carried(a: float) -> vi.Orbit:
        moved = vi.Harmonic(1.0, (a,))
        floor = vi.RigidStop((1.0,), lower=0.0, restitution=0.3, motion=moved)
        m = vi.Mechanism(mass=[[1.0]], damping=[[0.0]], stiffness=[[0.0]], elements=(floor,),
                         constant_force=(-1.0,))  # fmt: skip
        return vi.find_orbit(m, vi.State((0.3,), (0.0,)))

    orbit = carried(0.2)
    assert orbit.signature.eventless
    phase = orbit.state.phase
    wanted = 0.2 * math.sin(phase), 0.2 * math.cos(phase)
    np.testing.assert_allclose(orbit.states[0, :2], wanted, rtol=0.0, atol=1e-14)
    assert orbit.multipliers.tolist() == [0.0, 0.0]
    assert orbit.stable
    assert orbit.clearance_to_grazing == pytest.approx(0.8, abs=1e-12)
    with pytest.raises(vi.InvalidParameterError, match="no single coordinate that stands still"):
        vi.full_map(orbit)
    parameter = "elements[0].motion[0].sine[0]"
    branch = vi.continue_orbit(carried(0.95), parameter, (0.94, 1.01), inadmissible=True)
    (lifts,) = branch.special_points
    assert lifts.parameter == pytest.approx(1.0, abs=1e-12)


def random_machine(rng: np.random.Generator) -> vi.Mechanism:
    """One to three masses in a chain, with one to three elements on or between them."""
    n = int(rng.integers(1, 4))
    stiffness = np.diag(rng.uniform(0.5, 3.0, n))
    for i, k in enumerate(rng.uniform(0.2, 2.0, n - 1)):
        stiffness[i : i + 2, i : i + 2] += k * np.array([[1.0, -1.0], [-1.0, 1.0]])
    elements: list[Any] = []
    for kind in rng.integers(3, size=rng.integers(1, 4)):
        row = np.eye(n)[rng.integers(n)]
        upper, share = rng.uniform(0.1, 0.6), rng.uniform(0.02, 0.2)
        elements += [[
            STOP(tuple(row), upper=upper, stiffness=100.0 * share, damping=share),
            vi.Friction(tuple(row), share, belt_speed=0.1 * rng.integers(2)),
            vi.RigidStop(tuple(row), upper=upper, restitution=4.0 * share + 0.1),
        ][kind]]  # fmt: skip
    force = vi.Harmonic(rng.uniform(0.5, 2.0), tuple(rng.uniform(0.3, 1.0, n)))
    return vi.Mechanism(
        mass=np.diag(rng.uniform(0.5, 2.0, n)).tolist(), damping=(0.08 * stiffness).tolist(),
        stiffness=stiffness.tolist(), elements=tuple(elements), forces=(force,),
    )  # fmt: skip


@pytest.mark.slow
def test_orbits_of_random_machines_are_motions_of_the_simulation() -> None:
    """From which they are found, and which follows them for a period; volumes shrink as they say."""
    rng, followed = np.random.default_rng(20), 0
    for _ in range(16):
        m = random_machine(rng)
        orbit = vi.find_orbit(m, vi.State((0.0,) * m.degrees, (0.0,) * m.degrees))
        if not orbit.stable:
            continue
        followed += 1
        run = vi.simulate(m, orbit.state, t_max=orbit.period)
        end = np.concatenate(run.at(min(orbit.period, float(run.time[-1]))))[: m.degrees]
        np.testing.assert_allclose(end, orbit.state.position, rtol=0.0, atol=1e-12)
        assert orbit.determinant_error < 1e-10
    assert followed >= 12


def test_a_rotor_in_a_stop_that_loses_energy_has_no_orbit_without_forcing() -> None:
    """The skew part of its damping matrix does no work."""
    rotor = vi.Mechanism(
        mass=np.eye(2).tolist(), damping=[[0.1, 0.6], [-0.6, 0.1]], stiffness=np.eye(2).tolist(),
        elements=(vi.RigidStop((1.0, 0.0), upper=0.4, restitution=0.8),),
    )  # fmt: skip
    orbit = vi.find_orbit(rotor, vi.State((0.0, 0.5), (1.0, 0.0)))
    assert "every impact loses energy" in orbit.status


def test_a_kicked_oscillator_has_the_fixed_point_of_its_exponential() -> None:
    """Between kicks it is free: z = E z + (0, p / m) after each, E = exp(A T)."""
    m, c, k, p, omega = 2.0, 0.1, 1.0, 0.4, 2.0
    kicks = vi.PhaseSwitch(
        omega, (0.5, 2.0, 4.0), ((0.0,),) * 3, impulses=((p,), (0.0,), (0.0,))
    )  # fmt: skip
    kicked = vi.Mechanism(mass=[[m]], damping=[[c]], stiffness=[[k]], elements=(kicks,))
    orbit = vi.find_orbit(kicked, REST)
    free = expm(np.array([[0.0, 1.0], [-k / m, -c / m]]) * 2.0 * math.pi / omega)
    wanted = np.linalg.solve(np.eye(2) - free, [0.0, p / m])
    after = orbit.states[np.isclose(orbit.states[:, 2] % (2.0 * math.pi), 0.5)]
    np.testing.assert_allclose(after[:, :2], [wanted], rtol=0.0, atol=1e-14)
    np.testing.assert_allclose(np.poly(orbit.multipliers), np.poly(free), rtol=0.0, atol=1e-13)
    forms = vi.full_map(orbit, "elements[0].impulses[0][0]")
    by_kick = np.linalg.solve(np.eye(2) - forms.jacobian(), forms.derivative(np.eye(3)[2]))
    np.testing.assert_allclose(by_kick, orbit.states[0, :2] / p, rtol=0.0, atol=1e-13)  # linear


@pytest.mark.parametrize("omega", [0.9, 1.7])
def test_two_free_bodies_that_do_not_advance_have_an_orbit_at_every_place(omega: float) -> None:
    """Rounding of 1e-12 is no drift, though the events of a period are all at one place."""
    pair = np.array([[1.0, -1.0], [-1.0, 1.0]])
    m = vi.Mechanism(
        mass=np.diag([1.0, 2.0]), damping=0.1 * pair, stiffness=pair,
        elements=(vi.RigidStop((1.0, -1.0), upper=0.3, restitution=0.6),),
        forces=(vi.Harmonic(omega, (0.7, -0.7)),),
    )  # fmt: skip
    orbit = vi.find_orbit(m, vi.State((0.1, 0.0), (0.0, 0.0)))
    assert orbit.converged
    assert orbit.family_dimension == 1


@pytest.mark.parametrize("start", [0.0, 0.01])
def test_a_body_that_friction_holds_while_its_force_switches_stays_where_it_is(
    start: float,
) -> None:
    """At x = 0 nothing moves at all; warnings are errors, so that no size of 0 divides."""
    switch = vi.PhaseSwitch(omega=1.0, phases=(0.0, 2.0), forces=((0.1,), (-0.1,)))
    held = vi.Mechanism(
        mass=[[1.0]], damping=[[0.1]], stiffness=[[1.0]],
        elements=(vi.Friction((1.0,), 1.0), switch),
    )  # fmt: skip
    orbit = vi.find_orbit(held, vi.State((start,), (0.0,)))
    assert orbit.admissible
    assert orbit.family_dimension == 1
    assert np.unique(orbit.states[:, :2], axis=0).tolist() == [[start, 0.0]]


@pytest.mark.parametrize("length", [2.0**-40, 1.0, 2.0**40])
@pytest.mark.parametrize("time", [2.0**-30, 1.0, 2.0**20])
def test_the_closing_loop_of_a_motion_is_the_same_in_all_units(length: float, time: float) -> None:
    """Sizes of lengths and of speeds are not compared: x is L x, v is L/T v, omega is omega/T."""

    def loop_in(length: float, time: float) -> ClosingLoop:
        m = vi.Mechanism(
            mass=[[1.0]], damping=[[0.1 / time]], stiffness=[[1.0 / time**2]],
            elements=(vi.RigidStop((1.0,), upper=0.5 * length, restitution=0.5),),
            forces=(vi.Harmonic(1.3 / time, (length / time**2,)),),
        )  # fmt: skip
        found = closing_loop(vi.simulate(m, REST, t_max=300.0 * time), None, None)
        assert not isinstance(found, str)
        return found

    loop, first = loop_in(length, time), loop_in(1.0, 1.0)
    assert (loop.impacts, loop.cycles, loop.settled) == (first.impacts, first.cycles, first.settled)
    # of settled motions, which agree to rounding times their impacts
    np.testing.assert_allclose(loop.states[:, 0] / length, first.states[:, 0], rtol=1e-12)
    np.testing.assert_allclose(loop.durations / time, first.durations, rtol=1e-12)
