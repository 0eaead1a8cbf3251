"""Units of length, time and mass do not matter to what is found with runs: sections, orbits, branches, sweeps."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable
from functools import cache
from typing import Any, NamedTuple

import numpy as np
import pytest
from support.random_machines import scaled

import vibroimpact as vi

START = vi.State((0.1,), (0.3,), 0.1)
PARTS: dict[str, tuple[object, ...]] = {
    "rigid": (vi.RigidStop((1.0,), upper=0.5, restitution=0.7),),
    "soft": (vi.SoftStop((1.0,), upper=0.5, stiffness=20.0, damping=0.2),),
    "friction": (
        vi.SoftStop((1.0,), upper=0.5, stiffness=20.0, damping=0.2),
        vi.Friction((1.0,), 0.1),
    ),
}
UNITS = [(2.0**-20, 1.0, 1.0), (1.0, 2.0**-10, 1.0), (1.0, 1.0, 2.0**-7), (2.0**9, 2.0**5, 2.0**21)]


class Pair(NamedTuple):
    """A machine and a start as they are, and in other units."""

    here: tuple[vi.Mechanism, vi.State]
    there: tuple[vi.Mechanism, vi.State]
    units: tuple[float, float, float]

    def unit(self, length: int = 0, time: int = 0, mass: int = 0) -> float:
        """Unit of a quantity of this dimension."""
        return math.prod(u**d for u, d in zip(self.units, (length, time, mass), strict=True))

    def both(self, found: Callable[[vi.Mechanism, vi.State, float], Any]) -> tuple[Any, Any]:
        """What is found for both; the last argument is the unit of time."""
        return found(*self.here, 1.0), found(*self.there, self.units[1])

    def same(self, one: Any, other: Any, length: int = 0, time: int = 0, mass: int = 0) -> None:
        """Check that numbers of such a dimension have the same bits."""
        np.testing.assert_array_equal(np.array(one) * self.unit(length, time, mass), other)


def pair_of(kind: str, units: tuple[float, float, float]) -> Pair:
    if kind == "damper":
        damper = vi.ImpactDamper(mass_ratio=0.1, omega_n=0.5, zeta=0.045, restitution=0.8,
                                 half_clearance=5.0, omega=1.0)  # fmt: skip
        m, start = damper.mechanism, vi.symmetric_orbits(damper)[0].state
    else:
        m, start = vi.Mechanism(
            mass=[[1.0]], damping=[[0.1]], stiffness=[[1.0]], forces=(vi.Harmonic(0.8, (1.0,)),),
            elements=PARTS[kind],
        ), START  # fmt: skip
    return Pair((m, start), (scaled(m, *units), scaled(start, *units)), units)


# All units at once: powers that cancel in one number would not cancel in all.
IN_ALL_UNITS = pytest.mark.parametrize("units", UNITS[3:], ids=str)


@pytest.fixture(params=itertools.product(PARTS, UNITS), ids=str)
def pair(request: pytest.FixtureRequest) -> Pair:
    return pair_of(*request.param)


def test_sections_have_the_same_bits_in_units_of_powers_of_two(pair: Pair) -> None:
    one, other = pair.both(lambda m, s, _: vi.section(m, s, points=50, settle_events=100))
    pair.same(one.time, other.time, time=1)
    pair.same(one.position, other.position, length=1)
    pair.same(one.velocity, other.velocity, length=1, time=-1)


def test_orbits_and_multipliers_have_the_same_bits_in_units_of_powers_of_two(pair: Pair) -> None:
    one, other = pair.both(lambda m, s, _: vi.find_orbit(m, s))
    pair.same(one.period, other.period, time=1)
    pair.same(one.multipliers, other.multipliers)
    pair.same(one.state.position, other.state.position, length=1)
    pair.same(one.state.velocity, other.state.velocity, length=1, time=-1)


Dimension = tuple[int, int, int]  # of length, time, mass
FREQUENCY, LENGTH, PURE, FORCE = (0, -1, 0), (1, 0, 0), (0, 0, 0), (1, -2, 1)
BRANCHES: dict[
    str, tuple[str, str, Dimension, tuple[float, float]]
] = {  # machine, parameter, its dimension, range
    "frequency, rigid": ("rigid", "omega", FREQUENCY, (0.7, 0.84)),
    "clearance, rigid": ("rigid", "elements[0].upper", LENGTH, (0.48, 0.63)),
    "restitution, rigid": ("rigid", "elements[0].restitution", PURE, (0.65, 0.75)),
    "amplitude, rigid": ("rigid", "forces[0].sine[0]", FORCE, (0.8, 1.03)),
    "frequency, damper": ("damper", "omega", FREQUENCY, (0.9, 1.0)),
    "restitution, damper": ("damper", "elements[0].restitution", PURE, (0.77, 0.82)),
    "frequency, soft": ("soft", "omega", FREQUENCY, (0.7, 0.84)),
    "clearance, soft": ("soft", "elements[0].upper", LENGTH, (0.45, 0.55)),
    "frequency, friction": ("friction", "omega", FREQUENCY, (0.78, 0.82)),
    "clearance, friction": ("friction", "elements[0].upper", LENGTH, (0.47, 0.7)),
}


def same_but_for_a_power_of_two(one: np.ndarray, other: np.ndarray) -> bool:
    """Whether numbers are the same in units that differ by one: a test function has the unit of its guard."""
    (m, e), (n, f) = np.frexp(one), np.frexp(other)
    shifts = (f - e)[(m != 0.0) & np.isfinite(m)]
    return np.array_equal(m, n, equal_nan=True) and (not shifts.size or np.ptp(shifts) == 0)


def same_curves(one: Any, other: Any) -> None:
    pair_of_curves = one.curve, other.curve
    for name in ("arclength", "residual"):
        np.testing.assert_array_equal(*(getattr(curve, name) for curve in pair_of_curves))
    for name, f in one.curve.tests.items():
        assert same_but_for_a_power_of_two(f, other.curve.tests[name]), name
    np.testing.assert_array_equal(one.multipliers, other.multipliers)


@cache
def branches_of(
    kind: str, parameter: str, dimension: Dimension, bounds: tuple[float, float],
    units: tuple[float, float, float],
) -> tuple[Pair, vi.Branch, vi.Branch]:  # fmt: skip
    """A branch of a machine, in both units; curves begin at points of the same ones."""
    pair = pair_of(kind, units)
    orbits = pair.both(lambda m, s, _: vi.find_orbit(m, s))
    ends = (1.0, pair.unit(*dimension))
    one, other = (
        vi.continue_orbit(orbit, parameter, tuple(end * unit for end in bounds), inadmissible=True)
        for orbit, unit in zip(orbits, ends, strict=True)
    )
    return pair, one, other


@IN_ALL_UNITS
@pytest.mark.parametrize("case", BRANCHES)
@pytest.mark.slow
def test_branches_have_the_same_bits_in_units_of_powers_of_two(
    case: str, units: tuple[float, float, float]
) -> None:
    kind, parameter, dimension, bounds = BRANCHES[case]
    pair, one, other = branches_of(kind, parameter, dimension, bounds, units)
    same_curves(one, other)
    pair.same(one.values, other.values, *dimension)
    pair.same(one.impact_speed, other.impact_speed, length=1, time=-1)
    for name in ("stable", "admissible"):
        pair.same(getattr(one, name), getattr(other, name))
    for p, q in zip(one.special_points, other.special_points, strict=True):
        assert p.label == q.label
        pair.same((p.parameter, p.error), (q.parameter, q.error), *dimension)
        pair.same(p.orbit.multipliers, q.orbit.multipliers)
    reasons = ([str(end.reason) for end in branch.curve.ends] for branch in (one, other))
    assert next(reasons) == next(reasons)


CURVES: dict[str, tuple[str, tuple[float, float], str, str, Dimension, tuple[float, float]]] = {
    # machine, range of its branch, point, second parameter, its dimension and range
    "SN": ("rigid", (0.7, 0.84), "SN1", "elements[0].upper", LENGTH, (0.3, 0.7)),
    "PD": ("rigid", (0.7, 0.84), "PD1", "forces[0].sine[0]", FORCE, (0.8, 1.2)),
    "ZERO": ("rigid", (0.7, 0.84), "ZERO1", "elements[0].upper", LENGTH, (0.3, 0.7)),
    "NS": ("damper", (0.9, 1.0), "NS1", "elements[0].restitution", PURE, (0.7, 0.9)),
    "GR": ("soft", (0.7, 0.84), "GR1", "damping[0][0]", (0, -1, 1), (0.05, 0.2)),
}


@pytest.mark.slow
@IN_ALL_UNITS
@pytest.mark.parametrize("case", CURVES)
def test_curves_of_bifurcations_have_the_same_bits_in_units_of_powers_of_two(
    case: str, units: tuple[float, float, float]
) -> None:
    kind, omegas, label, second, dimension, bounds = CURVES[case]
    pair, *branches = branches_of(kind, "omega", FREQUENCY, omegas, units)

    def curve(branch: vi.Branch, frequency: float, unit: float) -> Any:
        point = branch[label]
        if point.orbit.rateless:  # the touch of a soft stop: of the orbits that do not reach it
            switched = vi.switch_branch(point)
            assert isinstance(switched, vi.Branch)
            point = next(p for p in switched.special_points if p.kind == "GR")
        (low, high), (least, most) = omegas, bounds
        plane = (low * frequency, high * frequency), (least * unit, most * unit)
        return vi.continue_bifurcation(point, ("omega", second), plane, steps=vi.Steps(points=25))

    one, other = map(curve, branches, (1.0, pair.unit(*FREQUENCY)), (1.0, pair.unit(*dimension)))
    same_curves(one, other)
    pair.same(one.values[:, 0], other.values[:, 0], *FREQUENCY)
    pair.same(one.values[:, 1], other.values[:, 1], *dimension)
    assert [p.label for p in one.special_points] == [p.label for p in other.special_points]


@pytest.mark.slow
@IN_ALL_UNITS
@pytest.mark.parametrize("kind", ["rigid", "soft"])
def test_responses_have_the_same_bits_in_units_of_powers_of_two(
    kind: str, units: tuple[float, float, float]
) -> None:
    pair = pair_of(kind, units)
    one, other = pair.both(
        lambda m, s, time: vi.frequency_response(
            m, "omega", (0.78 / time, 0.81 / time), points=3, starts=2, start=s, settle_periods=100,
            periods=20, progress=False,
        )
    )  # fmt: skip
    assert len(one.curves) == len(other.curves) > 0
    for a, b in zip(one.curves, other.curves, strict=True):
        pair.same(a.parameter, b.parameter, *FREQUENCY)
        pair.same(a.value, b.value, length=1)
        pair.same(a.derivative, b.derivative, length=1, time=1)
        assert [p.label for p in a.special_points] == [p.label for p in b.special_points]
    for many, there in zip(one.answers, other.answers, strict=True):
        assert [(a.motion, a.members) for a in many] == [(a.motion, a.members) for a in there]
        pair.same([a.value for a in many], [a.value for a in there], length=1)
    pair.same(one.worst.value, other.worst.value, length=1)


@pytest.mark.one_in(3)
def test_sweeps_in_lanes_have_the_same_bits_in_units_of_powers_of_two(pair: Pair) -> None:
    one, other = pair.both(
        lambda m, s, unit: vi.sweep(
            m, over={"omega": np.linspace(0.5, 1.2, 20) / unit}, start=s, settle_periods=30, periods=20,
            observe=["impacts", "final", "extremes"], progress=False,
        )
    )  # fmt: skip
    for name, length, time in (
        ("impacts_a", 0, 0), ("final_position", 1, 0), ("final_velocity", 1, -1),
        ("final_phase", 0, 0), ("x_largest", 1, 0),
    ):  # fmt: skip
        pair.same(one[name], other[name], length, time)


@pytest.mark.parametrize("unit", [1.0, 1e-3, 1e-6, 1e-9, 1e-12])
@pytest.mark.parametrize("beside", ["friction", "soft stop", "nothing"])
def test_a_ball_beside_an_element_comes_to_rest_on_the_floor_in_any_unit_of_length(
    beside: str, unit: float
) -> None:
    elements = {
        "friction": (vi.Friction((1.0,), 0.1 * unit),), "nothing": (),
        "soft stop": (vi.SoftStop((1.0,), upper=5.0 * unit, stiffness=10.0),),
    }[beside]  # fmt: skip
    m = vi.Mechanism(
        mass=[[1.0]], damping=[[0.02]], stiffness=[[0.5]],
        elements=(vi.RigidStop((1.0,), lower=0.0, restitution=0.6), *elements),
        constant_force=(-unit,),
        forces=(vi.Harmonic(1.3, (0.2 * unit,)),),
    )  # fmt: skip
    run = vi.simulate(m, vi.State((unit,), (0.0,)), t_max=100.0)
    assert abs(run.position[-1, 0]) <= 16 * 2.0**-53 * unit
