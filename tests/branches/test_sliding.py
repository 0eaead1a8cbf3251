"""Sliding bifurcations by their names: places by own shooting, sequences on both sides, powers by own flows.

x'' + DAMPING x' + x = cos(omega t) + f on a belt of speed v: f = LEVEL while x' < v ("b"), -LEVEL while x' > v ("f"),
and while it sticks ("s") what holds it.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import cache
from typing import NamedTuple

import numpy as np
import pytest
from scipy.linalg import expm
from scipy.optimize import brentq, fsolve

import vibroimpact as vi
from vibroimpact.branches.kinds import ONE

DAMPING, LEVEL = 0.1, 0.5
SPEED = "elements[0].belt_speed"
GENERATOR = np.array([[0.0, 1.0], [-1.0, -DAMPING]])


def on_belt(omega: float, speed: float) -> vi.Mechanism:
    """The machine."""
    return vi.Mechanism(
        mass=[[1.0]], damping=[[DAMPING]], stiffness=[[1.0]],
        forces=(vi.Harmonic(omega, (0.0,), (1.0,)),),
        elements=(vi.Friction((1.0,), LEVEL, belt_speed=speed),),
    )  # fmt: skip


# ---- own motions ---------------------------------------------------------------------------------


class Own(NamedTuple):
    """Closed forms of this machine."""

    omega: float
    v: float

    def slipping(self, t0: float, state: np.ndarray, t: float, force: float) -> np.ndarray:
        """(x, x') at t of a slip with a friction force, from a state at t0."""
        response = 1.0 / complex(1.0 - self.omega**2, DAMPING * self.omega)

        def forced(at: float) -> np.ndarray:
            x = response * np.exp(1j * self.omega * at)
            return np.array([x.real + force, (1j * self.omega * x).real])

        moved: np.ndarray = forced(t) + expm(GENERATOR * (t - t0)) @ (state - forced(t0))
        return moved

    def holding(self, t: float, x: float) -> float:
        """Friction force that holds it on the belt at x."""
        return DAMPING * self.v + x - math.cos(self.omega * t)


class Case(NamedTuple):
    """Place of a bifurcation: a machine on one side, a range, the sequences without and with the piece."""

    omega: float
    start: float
    bounds: tuple[float, float]
    without: str
    piece: str


CASES = {
    "CS": Case(0.7, 0.299, (0.2985, 0.3005), "bf", "bfs"),
    "GS": Case(0.4, 0.477, (0.475, 0.478), "b", "bs"),
    "SS": Case(0.7, 1.131, (1.129, 1.132), "bs", "bfs"),
    "AS": Case(0.4, 0.2335, (0.2333, 0.2345), "bs", "bsbs"),
}
each = pytest.mark.parametrize("kind", CASES)


@cache
def followed(kind: str) -> vi.Branch:
    case = CASES[kind]
    orbit = vi.find_orbit(on_belt(case.omega, case.start), vi.State((0.5,), (0.0,)))
    return vi.continue_orbit(orbit, SPEED, case.bounds, steps=vi.Steps(first=0.5, largest=1.0))


def sequence(branch: vi.Branch) -> str:
    """States of the friction around the orbits of a branch, the first one least."""
    names = "".join("fbs"[flight.mode] for flight in branch.family.signature.flights)
    return min(names[i:] + names[:i] for i in range(len(names)))


@each
@pytest.mark.one_in(2)
def test_each_is_named_from_both_sides_and_the_sequence_changes_as_it_says(kind: str) -> None:
    branch, case = followed(kind), CASES[kind]
    (other,) = branch.others
    assert {sequence(branch), sequence(other)} == {case.without, case.piece}
    here, there = branch[f"{kind}1"], other[f"{kind}1"]
    assert here.record == there.record == ONE[kind]
    assert abs(here.parameter - there.parameter) < 1e-11
    assert here.record.name in repr(here)
    assert f"changes by the power {ONE[kind].power} of" in here.normal_form.reason
    assert all(b.admissible.all() for b in (branch, other))
    below, above = sorted((branch, other), key=lambda b: b.values.mean())
    assert below.values.max() < here.parameter < above.values.min()


def shot(kind: str, omega: float, near: vi.Orbit, v: float) -> float:
    """Belt speed of the bifurcation, from own equations of the orbit without the piece."""
    period = 2.0 * math.pi / omega
    if kind == "GS":  # the response to the force reaches the belt
        return omega / math.hypot(1.0 - omega**2, DAMPING * omega)
    states, durations = near.states, near.durations
    first = int(np.argmin([flight.mode != 1 for flight in near.signature.flights]))  # "b" begins
    t0, x0 = states[first, -1] / omega, states[first, 0]

    def crossing(u: np.ndarray) -> list[float]:
        at, x, slip, speed = u
        own = Own(omega, speed)
        half = own.slipping(at, np.array([x, speed]), at + slip, LEVEL)
        end = own.slipping(at + slip, half, at + period, -LEVEL)
        return [half[1] - speed, end[0] - x, end[1] - speed, own.holding(at, x) - LEVEL]

    def sticking(u: np.ndarray) -> list[float]:  # from the start of the slip, over it and the stick
        at, x, slip, speed = u[:4]
        own = Own(omega, speed)
        end = own.slipping(at, np.array([x, speed]), at + slip, LEVEL)
        left = period - slip
        found = [end[1] - speed, end[0] + speed * left - x, own.holding(at, x) - LEVEL]
        if kind == "SS":
            return [*found, own.holding(at + slip, end[0]) + LEVEL]
        touch = u[4]
        x_there = end[0] + speed * (touch - at - slip)
        level = own.holding(touch, x_there) - LEVEL
        return [*found, level, speed + omega * math.sin(omega * touch)]

    guess = [t0, x0, durations[first], v]
    if kind == "AS":
        nearest = min(near.gaps.values())
        guess.append(t0 + durations[first] + nearest.time)
    solved = fsolve(crossing if kind == "CS" else sticking, guess, xtol=1e-14, full_output=True)
    assert max(abs(solved[1]["fvec"])) < 1e-12
    return float(solved[0][3])


@each
@pytest.mark.one_in(2)
def test_each_is_where_own_equations_of_the_orbit_have_it(kind: str) -> None:
    branch, case = followed(kind), CASES[kind]
    side = next(b for b in (branch, *branch.others) if sequence(b) == case.without)
    point = side[f"{kind}1"]
    assert abs(point.parameter - shot(kind, case.omega, point.orbit, point.parameter)) < 1e-11


# ---- powers --------------------------------------------------------------------------------------

OWN = Own(1.0, 0.3)  # omega, belt speed
AFTER = 0.5  # time after which motions are compared


def border(t: float, beyond: float) -> float:
    """Position on the belt at which s, the acceleration of a slip forwards, is ``beyond`` at t."""
    return math.cos(OWN.omega * t) - DAMPING * OWN.v - LEVEL - beyond


def acceleration(t: float, x: float) -> float:
    """The acceleration s at a place on the belt."""
    return math.cos(OWN.omega * t) - DAMPING * OWN.v - x - LEVEL


def slid(t0: float, state: np.ndarray, t: float) -> np.ndarray:
    return OWN.slipping(t0, state, t, -LEVEL)


def leaves(t0: float, x0: float, low: float, high: float) -> float:
    """Time at which s of what sticks from x0 at t0 rises to zero."""
    return float(brentq(lambda t: acceleration(t, x0 + OWN.v * (t - t0)), low, high, xtol=1e-15))


def returns(t0: float, x0: float, low: float, high: float) -> float:
    """Time at which what slips forwards from x0 at t0 comes back to the belt."""
    start = np.array([x0, OWN.v])
    return float(brentq(lambda t: slid(t0, start, t)[1] - OWN.v, low, high, xtol=1e-15))


def crossing(d: float) -> float:
    t0 = -1.2
    start = np.array([border(t0, -d), OWN.v])
    t1 = leaves(t0, start[0], t0, t0 + AFTER)
    true = slid(t1, np.array([start[0] + OWN.v * (t1 - t0), OWN.v]), t0 + AFTER)
    return float(np.abs(true - slid(t0, start, t0 + AFTER)).max())


def switching(d: float) -> float:
    t0 = 1.2
    x0 = border(t0, d)
    t1 = returns(t0, x0, t0 + 0.5 * d, t0 + 10.0 * d)
    return abs(slid(t0, np.array([x0, OWN.v]), t1)[0] - x0 - OWN.v * (t1 - t0))


def grazing(d: float) -> float:
    t0 = -1.2
    least = np.array([border(t0, 0.0), OWN.v - d])
    start = slid(t0, least, t0 - AFTER)
    t1 = brentq(lambda t: slid(t0, least, t)[1] - OWN.v, t0 - AFTER, t0, xtol=1e-15)
    x1 = slid(t0, least, t1)[0]
    t2 = leaves(t1, x1, t1, t0 + AFTER)
    true = slid(t2, np.array([x1 + OWN.v * (t2 - t1), OWN.v]), t0 + AFTER)
    return float(np.abs(true - slid(t0 - AFTER, start, t0 + AFTER)).max())


def adding(d: float) -> float:
    top = -math.asin(OWN.v)  # where s of what sticks is largest
    t0 = top - AFTER
    x0 = border(top, d) - OWN.v * AFTER
    t1 = leaves(t0, x0, t0, top)
    x1, late = x0 + OWN.v * (t1 - t0), top - t1
    t2 = returns(t1, x1, t1 + late, t1 + 6.0 * late)
    return abs(slid(t1, np.array([x1, OWN.v]), t2)[0] - x0 - OWN.v * (t2 - t0))


CHANGES: dict[str, tuple[Callable[[float], float], float]] = {
    "CS": (crossing, 1e-3), "GS": (grazing, 1e-3), "SS": (switching, 1e-2), "AS": (adding, 1e-4),
}  # fmt: skip


@each
def test_the_map_changes_by_the_power_of_the_distance_that_the_kind_has(kind: str) -> None:
    """The next term is smaller by the distance, or its root: 1e-2 at most."""
    change, d = CHANGES[kind]
    slope = math.log(change(d) / change(d / 2.0)) / math.log(2.0)
    assert abs(slope - ONE[kind].power) < 0.05


# ---- two parameters ------------------------------------------------------------------------------


@each
@pytest.mark.slow
def test_each_is_followed_in_two_parameters_along_own_equations(kind: str) -> None:
    case, branch = CASES[kind], followed(kind)
    side = next(b for b in (branch, *branch.others) if sequence(b) == case.without)
    planes = (case.bounds, (case.omega - 0.005, case.omega + 0.005))
    curve = vi.continue_bifurcation(side[f"{kind}1"], (SPEED, "omega"), planes)
    assert curve.kind == kind
    assert not curve.special_points
    for k in (0, -1):
        v, omega = curve.values[k]
        assert abs(omega - case.omega) > 1e-5
        assert abs(v - shot(kind, omega, curve.orbit(k), v)) < 1e-10


def test_a_curve_begins_at_the_orbits_without_the_piece() -> None:
    branch = followed("SS")
    side = next(b for b in (branch, *branch.others) if sequence(b) == "bfs")
    with pytest.raises(vi.InvalidParameterError, match="a flight of the orbit vanishes there"):
        vi.continue_bifurcation(side["SS1"], (SPEED, "omega"), ((1.0, 1.2), (0.6, 0.8)))
