"""Every machine of the catalogue against a number that this library has not made.

A witness returns pairs (found, expected). Rigid stops: periodic motions with one impact in closed form
(support/one_impact.py), whose matrices are written here from the equations at the head of the machine's file.
The motion that starts there must repeat. Soft stops and friction: free periods, distances, sets, phases.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from typing import Any, cast

import numpy as np
import pytest
from numpy.typing import ArrayLike
from scipy.linalg import expm
from support.one_impact import Closing, one_impact

import vibroimpact as vi
from vibroimpact import machines
from vibroimpact.machines.machine import Machine
from vibroimpact.machines.registry import MACHINES

Pairs = Iterator[tuple[ArrayLike, ArrayLike]]
TURN = 2.0 * math.pi
ROUNDING = 1e-9  # of expm and a solve, grown by a few flights
WITNESSES: dict[str, Callable[[], Pairs]] = {}


def witness(name: str) -> Callable[[Callable[[], Pairs]], Callable[[], Pairs]]:
    """Register the witness of a machine."""

    def registered(pairs: Callable[[], Pairs]) -> Callable[[], Pairs]:
        WITNESSES[name] = pairs
        return pairs

    return registered


@pytest.mark.parametrize("name", MACHINES)
def test_a_machine_moves_as_its_witness_says(name: str) -> None:
    pairs = list(WITNESSES[name]())
    assert pairs
    for found, expected in pairs:
        size = max(1e-3, float(np.abs(expected).max()))
        np.testing.assert_allclose(found, expected, rtol=0.0, atol=ROUNDING * size)


def repeats(machine: Machine, motions: list[Closing], impacts: int = 1) -> Pairs:
    """States after the impact that closes each motion that the machine can make."""
    assert motions
    done = 0
    for one in motions:
        start = vi.State(tuple(one.position), tuple(one.velocity), one.phase)
        run = vi.simulate(machine, start, impacts=impacts)
        if abs(run.time[-1] - one.time) > 1e-3 * one.time:
            continue  # it meets a stop on its way
        done += 1
        yield run.time[-1], one.time
        yield run.position[-1], one.sign * one.position
        yield run.velocity_after[-1], one.sign * one.velocity
    assert done


def after(machine: Machine, start: vi.State, time: float) -> tuple[Any, Any]:
    """Position and velocity after a time."""
    run = vi.simulate(machine, start, t_max=time, impacts=1000)
    return np.array(run.last.position), np.array(run.last.velocity)


def phasor(mass: Any, damping: Any, stiffness: Any, force: Any, omega: float) -> Any:
    """Amplitudes X of the forced motion Im(X exp(i theta)) of a linear system under Im(F exp(i theta))."""
    M, C, K = (np.atleast_2d(np.array(a)) for a in (mass, damping, stiffness))
    F = np.atleast_1d(np.array(force, dtype=complex))
    return np.linalg.solve(K - omega**2 * M + 1j * omega * C, F)


def forced(machine: Machine, mass: Any, damping: Any, stiffness: Any, force: Any) -> Pairs:
    """The forced motion of a machine that meets nothing, a radian later."""
    w = cast(Any, machine).omega
    X = phasor(mass, damping, stiffness, force, w)
    start = vi.State(tuple(X.imag), tuple((1j * w * X).imag))
    later = X * np.exp(1j)
    x, v = after(machine, start, 1.0 / w)
    yield [x, v], [later.imag, (1j * w * later).imag]


# ---- rigid stops ---------------------------------------------------------------------------------


@witness("impact-damper")
def _() -> Pairs:
    m = machines.ImpactDamper(
        mass_ratio=0.2, omega_n=0.5, zeta=0.1, restitution=0.6, half_clearance=1.0, omega=0.8
    )
    mass, c, k = np.diag([1.0, 0.2]), np.diag([0.1, 0.0]), np.diag([0.25, 0.0])
    motions = one_impact(mass, c, k, 0.8, (-1, 1), 1.0, 0.6, sine=(1, 0), periods=0.5)
    return repeats(m, motions)


@witness("impact-oscillator")
def _() -> Pairs:
    m = machines.ImpactOscillator(zeta=0.05, omega=2.6, restitution=0.7, clearance=0.1)
    return repeats(m, one_impact(1, 0.1, 1, 2.6, (1,), 0.1, 0.7, cosine=(1,)))


@witness("vibration-hammer")
def _() -> Pairs:
    m = machines.VibrationHammer(damping=0.3, ram_damping=0.2, omega=1.3, clearance=0.2)
    c, k = [[0.5, -0.2], [-0.2, 0.2]], [[1.5, -0.5], [-0.5, 0.5]]
    motions = one_impact(np.diag([1, 0.5]), c, k, 1.3, (-1, 1), 0.2, 0.6, sine=(1, 0))
    return repeats(m, motions)


@witness("gear-rattle")
def _() -> Pairs:
    m = machines.GearRattle(mass=2.0, drag=0.6, speed=8.0, eccentricity=0.1, half_clearance=2.0)
    e, w = 0.1, 6.0
    motions = one_impact(
        2.0, 0.6, 0.0, w, (1,), 2.0, 0.9,
        constant=(0.6 * 8.0,), sine=(-0.6 * e * w,), cosine=(-2.0 * e * w * w,), periods=1.0,
    )  # fmt: skip
    return repeats(m, motions)


@witness("shaker")
def _() -> Pairs:
    m = machines.Shaker(gravity=2.0, restitution=0.3, omega=2.0, damping=0.4)
    motions = one_impact(
        np.diag([1, 0.2]), np.diag([0.4, 0]), np.diag([1, 0]), 2.0, (1, -1), 0.0, 0.3,
        constant=(0.0, -0.2 * 2.0), sine=(4.0, 0.0),
    )  # fmt: skip
    return repeats(m, motions)


@witness("wheelset")
def _() -> Pairs:
    """At the critical speed (3) of its file the wheelset hunts without growth or decay."""
    w0, a, r, slope = 1.7, 0.75, 0.5, 0.05
    speed = w0 * math.sqrt(r * a / slope)
    m = machines.Wheelset(
        mass=2.0, yaw_mass=2.0, stiffness=2.0 * w0**2, yaw_stiffness=2.0 * w0**2, creep=30.0,
        half_gauge=a, radius=r, conicity=slope, speed=speed, half_clearance=1.0,
    )  # fmt: skip
    y, yaw = 0.5, -0.5 * w0 / speed * a  # y' = V psi: lateral displacement is rolling
    x, v = after(m, vi.State((y, 0.0), (0.0, yaw * w0)), TURN / w0)
    yield [x, v], [(y, 0.0), (0.0, yaw * w0)]
    x, v = after(m, vi.State((y, 0.0), (0.0, yaw * w0)), TURN / w0 / 4.0)
    yield [x, v], [(0.0, yaw), (-y * w0, 0.0)]
    m = machines.Wheelset(half_clearance=0.4, restitution=0.3, speed=2.0, creep=1.5)
    run = vi.simulate(m, vi.State((0.0, 0.1), (1.0, 0.0)), impacts=1)
    C, K = 1.5 * np.eye(2), np.array([[1.0, -3.0], [3.0, 1.0]])
    A = np.block([[np.zeros((2, 2)), np.eye(2)], [-K, -C]])
    y, u, vy, vu = expm(A * run.time[-1]) @ (0.0, 0.1, 1.0, 0.0)
    yield [0.4, *run.position[-1]], [y, 0.4, u]
    yield run.velocity_after[-1], [-0.3 * vy, vu]


@witness("bouncing-ball")
def _() -> Pairs:
    g, a, w, R = 1.5, 0.8, 1.9, 0.4
    m = machines.BouncingBall(gravity=g, amplitude=a, omega=w, restitution=R)
    speed = math.pi * g / w
    phase = math.acos(speed / (a * w) * (1.0 - R) / (1.0 + R))
    run = vi.simulate(m, vi.State((a * math.sin(phase),), (speed,), phase), impacts=1)
    yield run.time[-1], TURN / w
    yield run.velocity_after[-1], [speed]
    yield from repeats(
        m, one_impact(1, 0, 0, w, (-1,), 0.0, R, constant=(-g,), motion=(-a, 0.0), periods=1.0)
    )


@witness("fermi-ulam")
def _() -> Pairs:
    m = machines.FermiUlam(length=2.0, amplitude=0.3, omega=1.4)
    speed = (2.0 + 0.3) * 1.4 / (3.0 * math.pi)
    run = vi.simulate(m, vi.State((2.3,), (-speed,), math.pi / 2.0), impacts=2)
    yield run.time, np.array([0.5, 1.0]) * 3.0 * TURN / 1.4
    yield run.velocity_after[:, 0], [speed, -speed]


@witness("energy-sink")
def _() -> Pairs:
    m = machines.EnergySink(mass=2.0, mass_ratio=0.1, amplitude=0.1, half_clearance=0.3, omega=0.8)
    mass, push = np.diag([2.0, 0.2]), 0.1 * 0.8**2
    motions = one_impact(
        mass, np.diag([0.02, 0]), np.diag([1, 0]), 0.8, (-1, 1), 0.3, 0.6,
        sine=(2.0 * push, 0.2 * push), periods=0.5,
    )  # fmt: skip
    return repeats(m, motions)


@witness("ball-harvester")
def _() -> Pairs:
    m = machines.BallHarvester(mass=0.1, half_length=2.0, gravity=3.0, incline=0.4, omega=5.0)
    motions = one_impact(
        0.1, 0, 0, 5.0, (-1,), 2.0, 0.5,
        constant=(-0.1 * 3.0 * math.sin(0.4),), cosine=(0.1 * 0.1 * 25.0,),
    )  # fmt: skip
    yield from repeats(m, motions)
    level = machines.BallHarvester(incline=0.0)
    yield from repeats(level, one_impact(1, 0, 0, 3.0, (1,), 0.3, 0.5, cosine=(0.9,), periods=0.5))


@witness("electromagnetic-harvester")
def _() -> Pairs:
    m = machines.ElectromagneticHarvester(omega=1.2, amplitude=0.3, clearance=0.7)
    motions = one_impact(
        np.diag([1, 0.2]), [[0.02, 0.2], [-0.2, 1.0]], np.diag([1, 0]), 1.2, (1, 0), 0.7, 0.7,
        sine=(0.3 * 1.44, 0.0), periods=0.5,
    )  # fmt: skip
    return repeats(m, motions)


@witness("pounding")
def _() -> Pairs:
    m = machines.PoundingStructures(mass2=0.5, omega=2.0, clearance=0.05, amplitude=0.2)
    motions = one_impact(
        np.diag([1, 0.5]), np.diag([0.1, 0.1]), np.diag([1, 3]), 2.0, (1, -1), 0.05, 0.65,
        sine=(0.2 * 4.0, 0.5 * 0.2 * 4.0),
    )  # fmt: skip
    return repeats(m, motions)


@witness("impact-pair")
def _() -> Pairs:
    m = machines.ImpactPair(half_clearance=0.7, amplitude=0.9, omega=1.3, restitution=0.5)
    motions = one_impact(1, 0, 0, 1.3, (1,), 0.7, 0.5, motion=(0.9, 0.0), periods=0.5)
    yield from repeats(m, motions)
    for one in motions:  # (2) of its file
        wall = 0.9 * 1.3 * math.cos(one.phase)
        coming = (wall - one.velocity[0]) / 0.5  # relative speed before the impact
        yield coming * 0.5 - wall, -one.velocity[0]
        yield -one.velocity[0] * math.pi / 2.6, 0.7 + 0.9 * math.sin(one.phase)


@witness("dual-component")
def _() -> Pairs:
    m = machines.DualComponent(lag=0.7, omega=1.4, damping1=0.3, damping2=0.4)
    motions = one_impact(
        np.diag([1, 2]), np.diag([0.3, 0.4]), np.diag([1, 4]), 1.4, (1, -1), 0.2, 0.7,
        sine=(1.0, 0.5 * math.cos(0.7)), cosine=(0.0, 0.5 * math.sin(0.7)),
    )  # fmt: skip
    return repeats(m, motions)


@witness("cam-follower")
def _() -> Pairs:
    """The follower leaves the cam where the contact force vanishes, and bounces once a turn."""
    m = machines.CamFollower(mass=0.5, stiffness=2.0, preload=3.0, amplitude=0.6, omega=4.0)
    start = vi.State((0.0,), (0.6 * 4.0,))  # on the cam, with its speed
    run = vi.simulate(m, start, t_max=1.5, impacts=100)
    lift_off = math.asin(3.0 / ((0.5 * 16.0 - 2.0) * 0.6))
    yield run.time[run.status == vi.Status.RELEASE][0], lift_off / 4.0
    slow = machines.CamFollower(mass=0.5, stiffness=2.0, preload=3.0, amplitude=0.6, omega=3.74)
    run = vi.simulate(slow, vi.State((0.0,), (0.6 * 3.74,)), t_max=4.0, impacts=100)
    yield run.impacts.sum(), 0  # below sqrt((2 + 3 / 0.6) / 0.5) = 3.7417 it follows
    fast = machines.CamFollower(mass=0.5, stiffness=2.0, preload=3.0, amplitude=0.6, omega=6.0)
    motions = one_impact(0.5, 0, 2, 6.0, (-1,), 0.0, 0.3, constant=(-3.0,), motion=(-0.6, 0.0))
    yield from repeats(fast, motions)


@witness("multi-unit-damper")
def _() -> Pairs:
    """Units in step are the impact damper with their whole mass."""
    m = machines.MultiUnitDamper(
        mass_ratio=0.2, stiffness=0.25, damping=0.1, half_clearance=1.0, force=1.0, omega=0.8
    )
    mass, c, k = np.diag([1.0, 0.2]), np.diag([0.1, 0.0]), np.diag([0.25, 0.0])
    for one in one_impact(mass, c, k, 0.8, (-1, 1), 1.0, 0.6, sine=(1, 0), periods=0.5):
        (x1, x2), (v1, v2) = one.position, one.velocity
        alike = Closing(
            np.array([x1] + 3 * [x2]), np.array([v1] + 3 * [v2]), one.phase, one.time, -1
        )
        yield from repeats(m, [alike])


# ---- soft stops ----------------------------------------------------------------------------------


@witness("gear-backlash")
def _() -> Pairs:
    """Free play and two half swings on the mesh: 4 b / v + 2 pi sqrt(m / k)."""
    m = machines.GearBacklash(
        mass=3.0, mesh_stiffness=20.0, half_clearance=0.4, damping=0.0, load=0.0, force=0.0
    )
    x, v = after(m, vi.State((0.1,), (1.5,)), 4.0 * 0.4 / 1.5 + TURN * math.sqrt(3.0 / 20.0))
    yield [x, v], [[0.1], [1.5]]
    yield from forced(machines.GearBacklash(load=0.0, half_clearance=99.0), 1.0, 0.1, 0.0, 0.2j)
    m = machines.GearBacklash(mesh_damping=0.3, force=0.0)
    yield vi.simulate(m, vi.State((1.5,), (0.4,)), t_max=1.0).forces(0.0), [-0.5 - 0.3 * 0.4]
    still = m.free_start()
    yield after(m, still, 3.0)[0], [1.1]  # the mean load on the mesh: 1 + 0.1 / 1


@witness("bilinear-oscillator")
def _() -> Pairs:
    m = machines.BilinearOscillator(
        mass=2.0, stiffness=3.0, second_stiffness=7.0, damping=0.0, force=0.0
    )
    period = math.pi * (math.sqrt(2.0 / 3.0) + math.sqrt(2.0 / 10.0))
    for size in (0.1, 4.0):  # whatever its size
        x, v = after(m, vi.State((-size,), (0.0,)), period)
        yield [x, v], [[-size], [0.0]]
    yield from forced(machines.BilinearOscillator(gap=99.0), 1.0, 0.1, 1.0, 1j)
    m = machines.BilinearOscillator(gap=0.3)
    yield vi.simulate(m, vi.State((0.5,), (0.0,)), t_max=1.0).forces(0.0), [-8.0 * 0.2]


@witness("soft-impact-oscillator")
def _() -> Pairs:
    """The free period from two arcs, and grazing where the linear response reaches the gap."""
    gap, A, k = 0.5, 0.8, 29.0
    free = machines.SoftImpactOscillator(zeta=0.0, gap=gap, amplitude=0.0)
    stiff, middle = math.sqrt(1.0 + k), k * gap / (1.0 + k)
    speed = math.sqrt(A * A - gap * gap)
    arc = TURN - 2.0 * math.acos(gap / A) + 2.0 / stiff * math.atan2(speed / stiff, gap - middle)
    x, v = after(free, vi.State((-A,), (0.0,)), arc)
    yield [x, v], [[-A], [0.0]]
    X = phasor([[1.0]], [[0.02]], [[1.0]], [0.7 * 0.64], 0.8)[0]
    for gap, touches in ((1.000001 * abs(X), 0), (0.999999 * abs(X), 1)):
        m = machines.SoftImpactOscillator(gap=gap)
        start = vi.State((X.imag,), ((1j * 0.8 * X).imag,))
        run = vi.simulate(m, start, t_max=TURN / 0.8, impacts=100)
        yield np.sum(run.status == vi.Status.ENGAGE), touches
    m = machines.SoftImpactOscillator(stop_zeta=0.2, omega_n=3.0, mass=2.0)
    pressed = vi.simulate(m, vi.State((1.36,), (0.5,)), t_max=0.1)
    yield pressed.forces(0.0), [-29.0 * 18.0 * 0.1 - 2.0 * 0.2 * 6.0 * 0.5]


@witness("piezo-harvester")
def _() -> Pairs:
    """Motion and voltage are the linear ones where the stop is out of reach, and touch it where they say."""
    w, drive = 1.1, 0.1 * 1.1**2
    X = phasor(np.diag([1, 1]), [[0.02, 0.2], [-0.2, 1.0]], np.diag([1, 0]), [drive, 0.0], w)
    start = vi.State(tuple(X.imag), tuple((1j * w * X).imag))
    for gap, touches in ((1.000001 * abs(X[0]), 0), (0.999999 * abs(X[0]), 1)):
        m = machines.PiezoHarvester(gap=gap)
        run = vi.simulate(m, start, t_max=TURN / w, impacts=100)
        yield np.sum(run.status == vi.Status.ENGAGE), touches
    m = machines.PiezoHarvester(gap=9.0, resistance=2.0)
    C = [[0.02, 0.2], [-0.2, 0.5]]
    yield from forced(m, np.eye(2), C, np.diag([1, 0]), [drive, 0.0])
    m = machines.PiezoHarvester(gap=0.2)
    pressed = vi.simulate(m, vi.State((0.3, 0.0), (0.5, 0.0)), t_max=1.0)
    yield pressed.forces(0.0), [-4.0 * 0.1 - 0.05 * 0.5]


# ---- friction ------------------------------------------------------------------------------------


@witness("friction-oscillator")
def _() -> Pairs:
    """Den Hartog's amplitude without stops."""
    F, f, k, mass, w = 1.3, 0.4, 2.0, 1.5, 0.9
    m = machines.FrictionOscillator(mass=mass, stiffness=k, friction=f, force=F, omega=w)
    beta = w / math.sqrt(k / mass)
    V = 1.0 / (1.0 - beta**2)
    U = math.sin(math.pi / beta) / (beta * (1.0 + math.cos(math.pi / beta)))
    run = vi.simulate(m, vi.State((2.0,), (0.0,)), t_max=150 * TURN / w, impacts=10)
    turns = np.abs(run.position[(run.time > 140 * TURN / w), 0])[:-1]
    yield turns, np.full(len(turns), F / k * math.sqrt(V**2 - (f / F) ** 2 * U**2))


@witness("dry-impact-oscillator")
def _() -> Pairs:
    """Speed of the impact and the next turning point, by the work of friction."""
    mass, k, f, s, R, A = 2.0, 3.0, 0.2, 0.4, 0.7, 1.5
    m = machines.DryImpactOscillator(
        mass=mass, stiffness=k, friction=f, clearance=s, restitution=R, force=0.0
    )
    run = vi.simulate(m, vi.State((-A,), (0.0,)), t_max=4.0, impacts=10)
    speed = math.sqrt((k * (A * A - s * s) - 2.0 * f * (A + s)) / mass)
    first = int(np.flatnonzero(run.impacts)[0])
    yield run.velocity_after[first], [-R * speed]
    energy = k * s * s / 2.0 + mass * (R * speed) ** 2 / 2.0 - f * s
    yield from forced(
        machines.DryImpactOscillator(friction=0.0, damping=0.2, clearance=99.0), 1.0, 0.2, 1.0, 1j
    )
    yield run.position[first + 1], [-(math.sqrt(f * f + 2.0 * k * energy) - f) / k]


def stick_slip_period(k: float, w: float, jump: float, speed: float) -> float:
    """(2) of block_on_belt.py."""
    return 2.0 * jump / (k * speed) + 2.0 / w * (math.pi - math.atan(jump * w / (k * speed)))


@witness("block-on-belt")
def _() -> Pairs:
    m = machines.BlockOnBelt(mass=2.0, stiffness=3.0, kinetic=0.3, static=0.5, speed=0.1)
    yield from caught(m, 60.0, stick_slip_period(3.0, math.sqrt(1.5), 0.2, 0.1))


@witness("drill-string")
def _() -> Pairs:
    m = machines.DrillString(inertia=2.0, stiffness=3.0, kinetic=0.3, static=0.5, rate=0.1)
    yield from caught(m, 60.0, stick_slip_period(3.0, math.sqrt(1.5), 0.2, 0.1))


def caught(machine: Machine, time: float, period: float) -> Pairs:
    """Times between instants at which friction begins to stick."""
    run = vi.simulate(machine, machine.free_start(), t_max=time)
    between = np.diff(run.time[run.states[:, 0] == vi.FrictionState.STICK][1:-1])
    yield between, np.full(len(between), period)


@witness("capsule")
def _() -> Pairs:
    """Both masses slide to a stop by the distance v^2 (m + M) / (2 friction); the plate holds half a swing."""
    v, f = 1.2, 0.8
    m = machines.VibroImpactCapsule(
        inner_mass=1.0, capsule_mass=3.0, stiffness=2.0, gap=5.0, friction=f, force=0.0
    )
    slows = f / 4.0
    run = vi.simulate(m, vi.State((slows / 2.0, 0.0), (v, v)), t_max=2.0 * v / slows)
    at = int(np.flatnonzero(run.states[:, 1] == vi.FrictionState.STICK)[0])
    yield run.time[at], v / slows
    yield run.position[at, 1], v * v / (2.0 * slows)
    held = machines.VibroImpactCapsule(
        inner_mass=1.5, stiffness=0.0, damping=0.0, gap=0.1, friction=99.0, force=0.0
    )
    run = vi.simulate(held, vi.State((0.0, 0.0), (1.0, 0.0)), t_max=5.0)
    yield run.time[:2], np.array([0.1, 0.1 + math.pi * math.sqrt(1.5 / 15.0)])
    free = machines.VibroImpactCapsule(gap=99.0, friction=0.0, reaction=0.4)
    c, k = 0.1 * np.array([[1, -1], [-1, 1]]), np.array([[1, -1], [-1, 1]])
    yield from forced(free, np.diag([1, 4]), c, k, [0.8j, -0.32j])


@witness("mole")
def _() -> Pairs:
    """The set of a blow: (m v^2 / 2 - resistance^2 / (2 k)) / resistance."""
    m = machines.Mole(
        mass=2.0, stiffness=50.0, damping=0.0, resistance=3.0, static_force=0.0, force=0.0
    )
    x, _ = after(m, vi.State((0.0, 0.0), (1.5, 0.0)), 3.0)
    yield x[1], (2.0 * 1.5**2 / 2.0 - 9.0 / 100.0) / 3.0
    m, t = machines.Mole(mass=2.0, gap=0.3, omega=0.7), 1.2
    x, _ = after(m, vi.State((-5.0, 0.0), (0.0, 0.0)), t)
    yield x[0], -5.0 + 0.05 * t * t / 2.0 + 0.15 / 0.49 * (1.0 - math.cos(0.7 * t))
    pressed = vi.simulate(m, vi.State((0.4, 0.0), (0.5, 0.0)), t_max=0.1)
    yield pressed.forces(0.0)[:1], [-0.1 - 0.02 * 0.5]


@witness("rammer")
def _() -> Pairs:
    """The set of a blow from a height, (3) of its file."""
    mass, k, f, g, h = 2.0, 60.0, 30.0, 9.0, 0.5
    m = machines.Rammer(
        mass=mass,
        damping=0.0,
        soil_stiffness=k,
        soil_damping=0.0,
        resistance=f,
        gravity=g,
        force=0.0,
    )
    down = math.sqrt(2.0 * h / g)
    x, _ = after(m, vi.State((-h, 0.0), (0.0, 0.0)), down + 1.0)
    yield x[1], (mass * g * (h + f / k) - f * f / k / 2.0) / (f - mass * g)
    m, t, w = machines.Rammer(mass=2.0, damping=0.0, omega=0.7), 1.2, 0.7
    x, _ = after(m, vi.State((-5.0, 0.0), (0.0, 0.0)), t)
    yield x[0], -5.0 + 0.2 * t * t / 2.0 + 0.3 / w * (t - math.sin(w * t) / w)
    pressed = vi.simulate(m, vi.State((0.01, 0.0), (0.2, 0.0)), t_max=0.01)
    yield pressed.forces(0.0)[:1], [-40.0 * 0.01 - 0.4 * 0.2]


# ---- published -----------------------------------------------------------------------------------


@pytest.mark.parametrize("gap", [0.0, 0.1])
def test_the_mole_repeats_in_two_periods_as_published(gap: float) -> None:
    """Pavlovskaia and Wiercigroch, Chaos, Solitons and Fractals (2003), Fig. 3, a motion of period two.

    a = 0.3, b = 0.1, damping ratio 0.01, omega = 0.1. The gap is not to be had, and does not matter.
    """
    m = machines.Mole(force=0.3, static_force=0.1, damping=0.02, omega=0.1, gap=gap)
    run = vi.simulate(m, m.free_start(), t_max=100 * TURN / 0.1, impacts=10_000)
    x, _ = run.at(np.arange(90, 100) * TURN / 0.1)
    bounded = x[:, 0] - x[:, 1]
    np.testing.assert_allclose(bounded[2:], bounded[:-2], rtol=1e-8)
    assert (np.abs(np.diff(bounded)) > 1.0).all()
    assert (np.diff(x[:, 1]) > 0.0).all()  # and advances
