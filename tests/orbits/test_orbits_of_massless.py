"""Periodic orbits of machines with massless coordinates: SciPy, exponentials, limits, closed forms."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.integrate import solve_ivp
from scipy.linalg import expm
from support.massless import DASH, LEVEL, OWN, RIGID, SOFT, SPRING, C, K, jenkins, maxwell

import vibroimpact as vi
from vibroimpact.orbits.find import rotated

Array = NDArray[np.float64]
REST = vi.State((0.0, 0.0), (0.0, 0.0))
HARVESTER = {"m": 0.01, "c": 0.1, "k": 40.0, "coil": 4.0, "R": 20.0, "a": 0.3, "omega": 70.0}


def harvester(inductance: float, stop: Any, unit: float = 1.0) -> vi.Mechanism:
    """A magnet between stops and a coil: L i' + R i = coil x', force -coil i; i in a unit."""
    h = HARVESTER
    return vi.Mechanism(
        mass=[[h["m"], 0.0], [0.0, 0.0]],
        damping=[[h["c"], 0.0], [-h["coil"] / unit, inductance]],
        stiffness=[[h["k"], h["coil"] * unit], [0.0, h["R"]]],
        elements=(stop,), forces=(vi.Harmonic(h["omega"], (h["a"], 0.0)),),
    )  # fmt: skip


MAGNET = vi.SoftStop((1.0, 0.0), lower=-1e-3, upper=1e-3, stiffness=2000.0, damping=0.1)
MACHINES = {
    "Maxwell, soft": maxwell(SOFT), "Maxwell, rigid": maxwell(RIGID),
    "harvester": harvester(1.0, MAGNET),
    "Jenkins, soft": jenkins(vi.SoftStop((1.0, 0.0), upper=0.6, stiffness=7.0)),
    "Jenkins, rigid": jenkins(vi.RigidStop((1.0, 0.0), upper=0.6, restitution=0.7)),
}  # fmt: skip


@pytest.fixture(scope="module", params=MACHINES)
def found(request: pytest.FixtureRequest) -> vi.Orbit:
    orbit = vi.find_orbit(MACHINES[request.param], REST)
    assert orbit.stable, orbit
    return orbit


# ---- the simulation and SciPy ---------------------------------------------------------------------


def middle_of_sticking_or_longest(orbit: vi.Orbit) -> tuple[Array, list[int]]:
    """State within a flight in which every coordinate is free, and its entries that are states."""
    compiled, modes = orbit.problem.compiled(0.0), orbit.problem.modes
    free = np.array([not compiled.modes[mode].forgotten for mode in modes])
    k = int(np.argmax(orbit.durations * free))
    state = compiled.after(orbit.states[k], orbit.durations[k] / 2.0, modes[k])
    return state, [i for i in orbit.problem.kept if i < 2 * orbit.mechanism.degrees]


def test_multipliers_are_those_of_differences_of_the_simulation(found: vi.Orbit) -> None:
    """Over a period from within a flight, in x, v and z: the velocity of z is no state."""
    start, states = middle_of_sticking_or_longest(found)
    assert states == [0, 1, 2]
    sizes = np.abs(found.states).max(axis=0)

    def end(zeta: Array) -> Array:
        there = vi.State(tuple(zeta[:2]), tuple(zeta[2:4]), zeta[4])
        run = vi.simulate(found.system, there, t_max=found.period, impacts=1000)
        return np.array([*run.last.position, *run.last.velocity])[states]

    np.testing.assert_allclose(end(start), start[states], rtol=0.0, atol=1e-11)
    steps = 1e-5 * sizes[states]
    matrix = np.column_stack([
        (end(start + h * np.eye(5)[i]) - end(start - h * np.eye(5)[i])) / (2.0 * h)
        for i, h in zip(states, steps, strict=True)
    ])  # fmt: skip
    assert len(found.multipliers) == 3
    np.testing.assert_allclose(np.poly(found.multipliers), np.poly(matrix), rtol=0.0, atol=2e-8)
    assert found.zero_multipliers == ("Friction" in repr(found.mechanism.switching))


def test_velocities_of_massless_coordinates_are_those_of_the_simulation(found: vi.Orbit) -> None:
    run = vi.simulate(found.system, found.state, t_max=0.25 * found.durations[0])
    np.testing.assert_allclose(
        found.states[0, 3], run.at(0.0)[1][1], rtol=0.0, atol=1e-11 * np.abs(found.states).max()
    )


def test_volumes_shrink_as_the_flights_and_impacts_say() -> None:
    """The trace of the flow is that of x, v and z: -(C + dashpot) / m + ... of each flight."""
    orbit = vi.find_orbit(maxwell(RIGID), REST)
    # v' = .. - C v - own z,  z' = v - own z / dash: trace -C - own / dash
    shrinks = math.exp(-(C + OWN / DASH) * orbit.period) * 0.7**2
    np.testing.assert_allclose(np.prod(orbit.multipliers), shrinks, rtol=1e-11)
    assert orbit.determinant_error < 1e-11


def test_scipy_returns_to_the_start_of_a_maxwell_oscillator_in_a_soft_stop() -> None:
    stop = vi.SoftStop((1.0, 0.0), upper=0.4, stiffness=20.0)
    m = maxwell(stop)
    orbit = vi.find_orbit(m, REST)
    (x, z), v, theta = orbit.state.position, orbit.state.velocity[0], orbit.state.phase

    def rate(t: float, y: Array) -> list[float]:
        x, v, z = y
        force = 0.5 * math.sin(1.3 * t + theta) - 20.0 * max(x - 0.4, 0.0)
        return [v, force - K * x - C * v - OWN * z, v - OWN * z / DASH]

    s = solve_ivp(rate, (0.0, orbit.period), [x, v, z], rtol=1e-12, atol=1e-14, method="DOP853")
    np.testing.assert_allclose(s.y[:, -1], [x, v, z], rtol=0.0, atol=1e-9)


# ---- derivatives ---------------------------------------------------------------------------------


class Leg(NamedTuple):
    pressed: bool
    slips: int
    guard: str  # gap, force, speed: that ends it


class Chain:
    """Flights and impacts of an orbit as exponentials, from their own equations in (x, v, z, s, c, 1)."""

    def __init__(self, orbit: vi.Orbit, numbers: dict[str, float], *, rigid: bool) -> None:
        self.numbers, self.rigid, self.orbit = numbers, rigid, orbit
        run = vi.simulate(orbit.system, orbit.state, t_max=orbit.period * 0.999999, impacts=1000)
        ends = np.cumsum(orbit.durations)
        place, speed = run.at(ends - orbit.durations / 2.0)
        self.legs = [
            self._leg(x[0] > numbers["upper"], v[1], state)
            for x, v, state in zip(place, speed, np.roll(orbit.states, -1, axis=0), strict=True)
        ]

    def _leg(self, beyond: bool, w: float, end: Array) -> Leg:
        n, slips = self.numbers, int(np.sign(w)) if "level" in self.numbers else 0
        slips *= abs(w) > 1e-9
        margins = {"gap": abs(end[0] - n["upper"])}
        if "level" in n:
            margins["speed" if slips else "force"] = abs(
                end[2] if slips else abs(n["spring"] * (end[0] - end[1])) - n["level"]
            )
        return Leg(beyond and not self.rigid, slips, min(margins, key=margins.__getitem__))

    def field(self, leg: Leg, n: dict[str, float]) -> Array:
        a = np.zeros((6, 6))
        a[0, 1], a[3, 4], a[4, 3] = 1.0, n["omega"], -n["omega"]
        a[1] = [-n["k"], -n["c"], 0.0, n["a"], 0.0, 0.0]
        if leg.pressed:
            a[1] -= [n["stiffness"], n["damping"], 0.0, 0.0, 0.0, -n["stiffness"] * n["upper"]]
        if "level" in n:
            a[1] -= [n["spring"], 0.0, -n["spring"], 0.0, 0.0, 0.0]
            a[2, 1] = float(leg.slips != 0)
        else:
            a[1, 2] -= n["own"]
            a[2, 1:3] = 1.0, -n["own"] / n["dash"]
        return a

    def guard(self, leg: Leg, n: dict[str, float], sign: float) -> Array:
        if leg.guard == "gap":
            return np.array([1.0, 0.0, 0.0, 0.0, 0.0, -n["upper"]])
        if leg.guard == "speed":
            return np.array([0.0, 1.0, 0.0, 0.0, 0.0, 0.0])
        return np.array([n["spring"], 0.0, -n["spring"], 0.0, 0.0, -sign * n["level"]])

    def __call__(self, xi: Array, kept: list[int], left_out: int, **changed: float) -> Array:
        """The map in entries of (x, z, v, -, theta), the one left out from the first guard."""
        n, zeta = self.numbers | changed, np.zeros(5)
        zeta[kept] = xi
        signs = [float(np.sign(s[0] - s[1])) for s in np.roll(self.orbit.states, -1, axis=0)]
        first, at = self.guard(self.legs[-1], n, signs[-1]), {0: 0, 1: 2, 2: 1}[left_out]
        y = np.array([zeta[0], zeta[2], zeta[1], math.sin(zeta[4]), math.cos(zeta[4]), 1.0])
        y[at] -= first @ y / first[at]
        theta = zeta[4]
        for leg, sign, guess in zip(self.legs, signs, self.orbit.durations, strict=True):
            a, row = self.field(leg, n), self.guard(leg, n, sign)
            t = float(guess)
            for _ in range(5):
                there = expm(a * t) @ y
                t -= float(row @ there / (row @ a @ there))
            y, theta = expm(a * t) @ y, theta + n["omega"] * t
            if self.rigid and leg.guard == "gap":
                y[1] *= -n["restitution"]
        theta -= 2.0 * math.pi * self.orbit.signature.cycles
        return np.array([y[0], y[2], y[1], 0.0, theta])[kept]


def derivative(f: Callable[[float], Array], h: float) -> Array:
    """Central difference with an error of h^4."""
    return np.asarray((8.0 * (f(h) - f(-h)) - (f(2.0 * h) - f(-2.0 * h))) / (12.0 * h))


BASE = {"k": K, "c": C, "own": OWN, "dash": DASH, "omega": 1.3, "a": 0.5, "upper": 0.4}
SLIDER = {"k": 0.3, "c": C, "spring": SPRING, "level": LEVEL, "omega": 1.1, "a": 0.9, "upper": 0.6}
DERIVED = {
    "Maxwell, soft": (BASE | {"stiffness": 20.0, "damping": 0.3}, {
        "stiffness[1][1]": "own", "elements[0].damping": "damping", "omega": "omega"}),
    "Maxwell, rigid": (BASE | {"restitution": 0.7}, {
        "stiffness[1][1]": "own", "elements[0].restitution": "restitution"}),
    "Jenkins, soft": (SLIDER | {"stiffness": 7.0, "damping": 0.0}, {
        "elements[1].kinetic": "level", "elements[0].upper": "upper", "forces[0].sine[0]": "a"}),
    "Jenkins, rigid": (SLIDER | {"restitution": 0.7}, {"elements[1].kinetic": "level"}),
}  # fmt: skip


@pytest.mark.parametrize("what", DERIVED)
def test_derivatives_of_the_return_map_are_those_of_exponentials(what: str) -> None:
    """First ones by state and parameter, second ones along both; by differences of order h^4."""
    numbers, parameters = DERIVED[what]
    orbit = vi.find_orbit(MACHINES[what], REST)
    free = [not orbit.problem.compiled(0.0).modes[mode].forgotten for mode in orbit.problem.modes]
    at_stop = [event.contact == 0 for event in orbit.signature.impacts]
    orbit = rotated(orbit, next(k for k in range(len(free)) if free[k] and at_stop[k]))  # z is free
    chain = Chain(orbit, numbers, rigid="rigid" in what)
    for parameter, own in parameters.items():
        forms = vi.full_map(orbit, parameter)
        kept = list(forms.kept_in)
        left_out = next(i for i in (0, 1, 2) if i not in kept)
        xi, p = orbit.states[0][kept], numbers[own]
        np.testing.assert_allclose(chain(xi, kept, left_out), xi, rtol=0.0, atol=1e-12)

        def moved(u: Array, s: float) -> Array:
            return chain(xi + s * u[:3], kept, left_out, **{own: p + s * u[3]})  # noqa: B023

        for u in np.eye(4):
            wanted = derivative(lambda s, u=u: moved(u, s), 1e-3)
            size = 1.0 + float(np.abs(wanted).max())
            np.testing.assert_allclose(forms.derivative(u), wanted, rtol=0.0, atol=2e-9 * size)
        u, w = np.array([0.3, -0.2, 0.4, 0.1]), np.array([0.1, 0.3, -0.2, 0.2])
        second = [
            (moved(u + w, h) - moved(u - w, h) + moved(-u - w, h) - moved(w - u, h)) / (4.0 * h * h)
            for h in (4e-3, 8e-3)
        ]
        wanted = (4.0 * second[0] - second[1]) / 3.0
        size = 1.0 + float(np.abs(wanted).max())
        np.testing.assert_allclose(forms.derivative(u, w), wanted, rtol=0.0, atol=1e-6 * size)


@pytest.mark.parametrize("parameter", ["mass[1][1]", "damping[1][1]", "elements[0].damping"])
def test_a_parameter_that_would_give_a_slider_a_mass_or_a_dashpot_is_refused(
    parameter: str,
) -> None:
    stop = vi.SoftStop((1.0, -1.0), upper=0.02, stiffness=3.0)
    orbit = vi.find_orbit(jenkins(stop), REST)
    with pytest.raises(vi.InvalidParameterError, match="changes the order of its equation"):
        vi.full_map(orbit, parameter)


# ---- limits --------------------------------------------------------------------------------------


def char(orbit: vi.Orbit) -> Array:
    """Coefficients of the characteristic polynomial of the multipliers."""
    return np.asarray(np.poly(orbit.multipliers).real)


@pytest.mark.parametrize("stop", [SOFT, RIGID], ids=["soft", "rigid"])
def test_a_massless_coordinate_is_the_limit_of_a_small_mass(stop: Any) -> None:
    """Of first order: a tenth of the mass, a tenth of the distance; its own multiplier vanishes."""
    limit, off = vi.find_orbit(maxwell(stop), REST), []
    for mass in (4e-3, 4e-4, 4e-5):
        orbit = vi.find_orbit(maxwell(stop, light=mass), limit)
        assert orbit.stable
        states = [0, 1, 2, 4]
        place = np.abs(orbit.states[0, states] - limit.states[0, states]).max()
        assert abs(orbit.multipliers[-1]) < 1e-12
        off.append([place, np.abs(char(orbit)[:4] - char(limit)).max()])
    np.testing.assert_allclose(np.divide(off[:-1], off[1:]), 10.0, rtol=0.05)


def test_a_coil_without_inductance_is_a_dashpot() -> None:
    """L -> 0: i = coil x' / R, a force of coil^2 / R on the magnet; of first order in L."""
    h, off = HARVESTER, []
    stop = vi.SoftStop((1.0,), lower=-1e-3, upper=1e-3, stiffness=2000.0, damping=0.1)
    dashpot = vi.Mechanism(
        mass=[[h["m"]]], damping=[[h["c"] + h["coil"] ** 2 / h["R"]]], stiffness=[[h["k"]]],
        elements=(stop,), forces=(vi.Harmonic(h["omega"], (h["a"],)),),
    )  # fmt: skip
    limit = vi.find_orbit(dashpot, vi.State((0.0,), (0.0,)))
    orbit = vi.find_orbit(harvester(1e-2, MAGNET), REST)
    for inductance in (2e-4, 1e-4):
        orbit = vi.find_orbit(harvester(inductance, MAGNET), orbit)
        assert orbit.stable
        assert orbit.symbol == limit.symbol
        off.append(abs(orbit.states[0, 2] - limit.states[0, 1]) / abs(limit.states[0, 1]))
        np.testing.assert_allclose(
            orbit.multipliers[:2], limit.multipliers, rtol=0.0, atol=20.0 * inductance
        )
    assert abs(off[0] / off[1] - 2.0) < 0.05


def test_the_unit_of_a_current_does_not_matter() -> None:
    """Nanoamperes: the orbit has the same multipliers, states and verdicts."""
    plain, unit = vi.find_orbit(harvester(1.0, MAGNET), REST), 1e-9
    other = harvester(1.0, MAGNET, unit)
    fine = vi.find_orbit(
        other, replace(plain, system=other, states=plain.states / [1.0, unit, 1.0, 1.0, 1.0])
    )
    assert fine.stable
    np.testing.assert_allclose(fine.multipliers, plain.multipliers, rtol=1e-9)
    np.testing.assert_allclose(fine.states[:, 1] * unit, plain.states[:, 1], rtol=1e-9)


# ---- sliders in closed form ----------------------------------------------------------------------


def test_a_jenkins_element_that_is_driven_harmonically_has_masings_loop() -> None:
    """Spring k on the ground and friction L on a plate that moves by X sin(theta).

    The force k z follows the plate from L at its reversal down to -L, over 2 L / k, and stays
    there: slip begins at sin(theta) = 1 - 2 L / (k X), by symmetry half a turn later again.
    """
    k, level, size, omega = 3.0, 0.4, 0.5, 0.8
    plate = vi.Friction((0.0, 1.0), level, motion=vi.Harmonic(omega, (size,)))
    m = vi.Mechanism(
        mass=[[1.0, 0.0], [0.0, 0.0]], damping=[[0.2, 0.0], [0.0, 0.0]], stiffness=[[1.0, 0.0], [0.0, k]],
        elements=(vi.SoftStop((1.0, 0.0), upper=9.0, stiffness=1.0), plate),
    )  # fmt: skip
    orbit = vi.find_orbit(m, vi.State((0.0, 0.0), (0.0, 0.0)))
    slip = math.pi - math.asin(1.0 - 2.0 * level / (k * size))
    phases = [0.5 * math.pi, slip, 1.5 * math.pi, slip + math.pi]
    order = np.argsort(orbit.states[:, 4] % (2.0 * math.pi))
    theta = orbit.states[order, 4] % (2.0 * math.pi)
    np.testing.assert_allclose(theta, np.sort(np.mod(phases, 2.0 * math.pi)), atol=1e-13)
    z = {round(t, 9): x for t, x in zip(theta, orbit.states[order, 1], strict=True)}
    assert abs(z[round(phases[0], 9)] - level / k) < 1e-13
    assert abs(z[round(slip, 9)] + level / k) < 1e-13
    assert orbit.stable
    free = expm(np.array([[0.0, 1.0], [-1.0, -0.2]]) * 2.0 * math.pi / omega)
    np.testing.assert_allclose(np.poly(orbit.multipliers), [*np.poly(free), 0.0], atol=1e-13)
    assert orbit.zero_multipliers == 1


def test_a_slider_that_slips_all_the_time_follows_its_belt_at_its_level() -> None:
    k, level = 3.0, 0.4
    m = vi.Mechanism(
        mass=[[1.0, 0.0], [0.0, 0.0]], damping=[[0.2, 0.0], [0.0, 0.0]],
        stiffness=[[1.0 + k, -k], [-k, k]], forces=(vi.Harmonic(0.8, (1.0, 0.0)),),
        elements=(vi.SoftStop((1.0, 0.0), upper=0.5, stiffness=5.0), vi.Friction((0.0, 1.0), level, belt_speed=9.0)),
    )  # fmt: skip
    orbit = vi.find_orbit(m, REST)
    # the belt pulls with its level all the time: an oscillator under a constant force
    pulled = vi.Mechanism(
        mass=[[1.0]], damping=[[0.2]], stiffness=[[1.0]], forces=(vi.Harmonic(0.8, (1.0,)),),
        constant_force=(level,), elements=(vi.SoftStop((1.0,), upper=0.5, stiffness=5.0),),
    )  # fmt: skip
    other = vi.find_orbit(pulled, vi.State((0.0,), (0.0,)))
    assert orbit.symbol == other.symbol
    np.testing.assert_allclose(orbit.states[:, [0, 2]], other.states[:, :2], atol=1e-13)
    np.testing.assert_allclose(orbit.states[:, 1], orbit.states[:, 0] + level / k, atol=1e-13)
    np.testing.assert_allclose(orbit.multipliers, [*other.multipliers, 0.0], atol=1e-12)


def test_a_ram_that_drives_its_slider_on_advances_as_in_simulation() -> None:
    """By what the simulation advances in a period of the force."""
    ram = vi.Mechanism(
        mass=[[1.0, 0.0], [0.0, 0.0]], damping=[[0.2, 0.0], [0.0, 0.0]], stiffness=np.zeros((2, 2)).tolist(),
        elements=(vi.SoftStop((1.0, -1.0), upper=0.05, stiffness=40.0, damping=0.8), vi.Friction((0.0, 1.0), 0.6)),
        forces=(vi.Harmonic(1.0, (0.8, 0.0)),), constant_force=(0.1, 0.0),
    )  # fmt: skip
    orbit = vi.find_orbit(ram, REST)
    assert orbit.converged
    run = vi.simulate(ram, REST, t_max=410.0 * math.pi, impacts=5000)
    before, after = (run.at(turns * 2.0 * math.pi)[0][1] for turns in (200, 201))
    assert abs(orbit.progress[1] - (after - before)) < 1e-6


# ---- other outcomes ------------------------------------------------------------------------------


def test_an_orbit_between_rigid_stops_that_is_its_own_image_has_a_half_map() -> None:
    both = maxwell(vi.RigidStop((1.0, 0.0), lower=-0.3, upper=0.3, restitution=0.7), omega=1.1)
    half = vi.find_orbit(both, REST)
    assert half.symmetric
    assert half.stable
    whole = vi.find_orbit(both, half, symmetric=False)
    np.testing.assert_allclose(char(half), char(whole), rtol=0.0, atol=1e-12)
    matrix = vi.half_map(half).jacobian()
    np.testing.assert_allclose(
        np.poly(np.linalg.eigvals(matrix @ matrix)), char(half), rtol=0.0, atol=1e-12
    )


def test_a_stroboscopic_map_has_no_velocity_of_a_massless_coordinate() -> None:
    orbit = vi.find_orbit(maxwell(SOFT), REST)
    strobe = vi.stroboscopic_map(orbit)
    assert strobe.kept_in == (0, 1, 2)
    np.testing.assert_allclose(np.poly(strobe.jacobian()), char(orbit), rtol=0.0, atol=1e-12)


@pytest.mark.parametrize("kind", ["first-order state", "slider"])
def test_a_search_finds_the_stable_orbits_on_which_motions_settle(kind: str) -> None:
    parts: dict[str, tuple[vi.Element, ...]] = {
        "first-order state": (vi.RigidStop((1.0, 0.0), upper=0.5, restitution=0.7),),
        "slider": (
            vi.Friction((0.0, 1.0), 0.1), vi.SoftStop((1.0, 0.0), upper=0.5, stiffness=9.0),
        ),
    }  # fmt: skip
    dashpot = 0.5 if kind == "first-order state" else 0.0
    m = vi.Mechanism(
        mass=[[1.0, 0.0], [0.0, 0.0]], damping=[[0.05, 0.0], [0.0, dashpot]],
        stiffness=[[1.5, -0.5], [-0.5, 0.5]], elements=parts[kind],
        forces=(vi.Harmonic(1.1, (0.4, 0.0)),),
    )  # fmt: skip
    found = vi.find_orbits(m, most_cycles=2, starts=4)
    assert sum(found.motions.values()) == 4
    stable = [orbit for orbit in found.orbits if orbit.stable and orbit.admissible]
    settled = vi.simulate(m, vi.State((0.1, 0.1), (0.0, 0.0)), impacts=300)
    own = vi.find_orbit(m, settled)
    assert isinstance(own, vi.Orbit)
    (same,) = (o for o in stable if abs(o.period - own.period) < 1e-9)
    np.testing.assert_allclose(
        sorted(abs(same.multipliers)), sorted(abs(own.multipliers)), atol=1e-8
    )
