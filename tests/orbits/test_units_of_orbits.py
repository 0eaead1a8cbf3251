"""Units of length, time and mass do not matter to what is found with runs: sections, orbits, branches, sweeps."""

from __future__ import annotations

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
BOTH = pytest.mark.parametrize("units", UNITS), pytest.mark.parametrize("kind", PARTS)


def machine(kind: str) -> vi.Mechanism:
    return vi.Mechanism(
        mass=[[1.0]], damping=[[0.1]], stiffness=[[1.0]], forces=(vi.Harmonic(0.8, (1.0,)),),
        elements=PARTS[kind],
    )  # fmt: skip


def both(kind: str, units: tuple[float, float, float]) -> tuple[tuple[vi.Mechanism, vi.State], ...]:
    m, (length, time, mass) = machine(kind), units
    there = scaled(m, length, time, mass), scaled(START, length, time, mass)
    return (m, START), there


@BOTH[0]
@BOTH[1]
def test_sections_have_the_same_bits_in_units_of_powers_of_two(
    kind: str, units: tuple[float, float, float]
) -> None:
    one, other = (vi.impact_section(m, s, points=50, settle=100) for m, s in both(kind, units))
    assert np.array_equal(one.time * units[1], other.time)
    assert np.array_equal(one.x1 * units[0], other.x1)
    assert np.array_equal(one.v1 * (units[0] / units[1]), other.v1)


@BOTH[0]
@BOTH[1]
def test_orbits_and_multipliers_have_the_same_bits_in_units_of_powers_of_two(
    kind: str, units: tuple[float, float, float]
) -> None:
    length, time, _ = units
    one, other = (vi.find_orbit(m, s) for m, s in both(kind, units))
    assert one.period * time == other.period
    assert np.array_equal(one.multipliers, other.multipliers)
    assert np.array_equal(np.array(one.state.position) * length, other.state.position)
    assert np.array_equal(np.array(one.state.velocity) * (length / time), other.state.velocity)


FREQUENCY, LENGTH, PURE, FORCE = (0, -1, 0), (1, 0, 0), (0, 0, 0), (1, -2, 1)  # length, time, mass
BRANCHES = {  # machine, parameter, its dimension, range
    "frequency, rigid": ("rigid", "omega", FREQUENCY, (0.7, 0.84)),
    "clearance, rigid": ("rigid", "contacts[0].upper", LENGTH, (0.3, 0.7)),
    "restitution, rigid": ("rigid", "contacts[0].restitution", PURE, (0.5, 0.9)),
    "amplitude, rigid": ("rigid", "forces[0].sine[0]", FORCE, (0.8, 1.2)),
    "frequency, damper": ("damper", "omega", FREQUENCY, (0.9, 1.0)),
    "restitution, damper": ("damper", "contacts[0].restitution", PURE, (0.6, 0.9)),
    "frequency, soft": ("soft", "omega", FREQUENCY, (0.7, 0.84)),
    "clearance, soft": ("soft", "elements[0].upper", LENGTH, (0.3, 0.7)),
    "frequency, friction": ("friction", "omega", FREQUENCY, (0.7, 0.84)),
    "clearance, friction": ("friction", "elements[0].upper", LENGTH, (0.3, 0.7)),
}
ALONG = pytest.mark.parametrize("case", BRANCHES)


def unit_of(dimension: tuple[int, int, int], units: tuple[float, float, float]) -> float:
    return float(np.prod([u**d for u, d in zip(units, dimension, strict=True)]))


def orbits_of(kind: str, units: tuple[float, float, float]) -> list[vi.Orbit]:
    if kind != "damper":
        return [vi.find_orbit(m, s) for m, s in both(kind, units)]
    damper = vi.ImpactDamper(mass_ratio=0.1, omega_n=0.5, zeta=0.045, restitution=0.8,
                             half_clearance=5.0, omega=1.0)  # fmt: skip
    m, s = damper.mechanism, vi.symmetric_orbits(damper)[0].state
    return [vi.find_orbit(m, s), vi.find_orbit(scaled(m, *units), scaled(s, *units))]


def differ_by_one_power_of_two(one: np.ndarray, other: np.ndarray) -> bool:
    """Whether they are the same numbers in units of a power of two: a test function has that of its guard."""
    (m, e), (n, f) = np.frexp(one), np.frexp(other)
    shifts = (f - e)[(m != 0.0) & np.isfinite(m)]
    return (
        bool(np.array_equal(m, n, equal_nan=True) and np.ptp(shifts, axis=None) == 0)
        if shifts.size
        else True
    )


@BOTH[0]
@ALONG
def test_branches_have_the_same_bits_in_units_of_powers_of_two(
    case: str, units: tuple[float, float, float]
) -> None:
    kind, parameter, dimension, (low, high) = BRANCHES[case]
    unit = unit_of(dimension, units)
    one, other = orbits_of(kind, units)
    one, other = (
        vi.continue_orbit(orbit, parameter, (low * u, high * u))
        for orbit, u in ((one, 1.0), (other, unit))
    )
    assert np.array_equal(one.values * unit, other.values)
    assert np.array_equal(one.multipliers, other.multipliers, equal_nan=True)
    assert np.array_equal(one.stable, other.stable)
    assert np.array_equal(one.admissible, other.admissible)
    assert np.array_equal(one.impact_speed * (units[0] / units[1]), other.impact_speed)
    assert np.array_equal(one.curve.arclength, other.curve.arclength)
    assert np.array_equal(one.curve.residual, other.curve.residual)
    for name, f in one.curve.tests.items():
        assert differ_by_one_power_of_two(f, other.curve.tests[name]), name
    for p, q in zip(one.special_points, other.special_points, strict=True):
        assert (p.label, p.parameter * unit, p.error * unit) == (q.label, q.parameter, q.error)
        assert np.array_equal(p.orbit.multipliers, q.orbit.multipliers, equal_nan=True)
    assert [str(end.reason) for end in one.curve.ends] == [
        str(end.reason) for end in other.curve.ends
    ]


CURVES = {  # machine, parameter and range of its branch, point, second parameter, its dimension and range
    "SN": ("rigid", (0.7, 0.84), "SN1", "contacts[0].upper", LENGTH, (0.3, 0.7)),
    "PD": ("rigid", (0.7, 0.84), "PD1", "forces[0].sine[0]", FORCE, (0.8, 1.2)),
    "ZERO": ("rigid", (0.7, 0.84), "ZERO1", "contacts[0].upper", LENGTH, (0.3, 0.7)),
    "NS": ("damper", (0.9, 1.0), "NS1", "contacts[0].restitution", PURE, (0.7, 0.9)),
    "GR": ("soft", (0.7, 0.84), "GR1", "damping[0][0]", (0, -1, 1), (0.05, 0.2)),
}


@pytest.mark.slow
@BOTH[0]
@pytest.mark.parametrize("case", CURVES)
def test_curves_of_bifurcations_have_the_same_bits_in_units_of_powers_of_two(
    case: str, units: tuple[float, float, float]
) -> None:
    kind, (low, high), label, second, dimension, (least, most) = CURVES[case]
    found = []
    for orbit, (rate, unit) in zip(
        orbits_of(kind, units), ((1.0, 1.0), (1.0 / units[1], unit_of(dimension, units))), strict=True
    ):  # fmt: skip
        omegas, others = (low * rate, high * rate), (least * unit, most * unit)
        point = vi.continue_orbit(orbit, "omega", omegas)[label]
        if point.orbit.rateless:  # the touch of a soft stop: of the orbits that do not reach it
            switched = vi.switch_branch(point)
            assert isinstance(switched, vi.Branch)
            point = next(p for p in switched.special_points if p.kind == "GR")
        found.append(vi.continue_bifurcation(point, ("omega", second), (omegas, others)))
    one, other = found
    assert np.array_equal(one.values * (rate, unit), other.values)
    assert np.array_equal(one.multipliers, other.multipliers, equal_nan=True)
    for name, f in one.curve.tests.items():
        assert differ_by_one_power_of_two(f, other.curve.tests[name]), name
    assert [p.label for p in one.special_points] == [p.label for p in other.special_points]


@pytest.mark.slow
@BOTH[0]
@pytest.mark.parametrize("kind", ["rigid", "soft"])
def test_responses_have_the_same_bits_in_units_of_powers_of_two(
    kind: str, units: tuple[float, float, float]
) -> None:
    length, time, _ = units
    one, other = (
        vi.frequency_response(m, "omega", (0.7 / unit, 0.84 / unit), number=5, starts=2, start=s,
                              settle=100, periods=20, progress=False)
        for (m, s), unit in zip(both(kind, units), (1.0, time), strict=True)
    )  # fmt: skip
    assert len(one.curves) == len(other.curves) > 0
    for a, b in zip(one.curves, other.curves, strict=True):
        assert np.array_equal(a.parameter / time, b.parameter)
        assert np.array_equal(a.value * length, b.value)
        assert np.array_equal(a.derivative * (length * time), b.derivative, equal_nan=True)
        assert [mark.label for mark in a.marks] == [mark.label for mark in b.marks]
    for many, there in zip(one.answers, other.answers, strict=True):
        assert [(a.motion, a.members, a.value * length) for a in many] == [
            (a.motion, a.members, a.value) for a in there
        ]
    assert one.worst.value * length == other.worst.value


@BOTH[0]
@BOTH[1]
def test_sweeps_in_lanes_have_the_same_bits_in_units_of_powers_of_two(
    kind: str, units: tuple[float, float, float]
) -> None:
    length, time, _ = units
    omegas, found = np.linspace(0.5, 1.2, 20), []
    for (m, s), unit in zip(both(kind, units), (1.0, time), strict=True):
        over = {"omega": omegas / unit}
        found.append(vi.sweep(m, over=over, start=s, observe=["impacts", "final", "extremes"],
                              settle=30, periods=20, progress=False))  # fmt: skip
    one, other = found
    for name, unit in (
        ("impacts_a", 1.0), ("final_position", length), ("final_velocity", length / time),
        ("final_phase", 1.0), ("x_largest", length),
    ):  # fmt: skip
        assert np.array_equal(one[name].values * unit, other[name].values), name


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
        mass=[[1.0]], damping=[[0.02]], stiffness=[[0.5]], elements=elements,
        contacts=(vi.Contact((1.0,), lower=0.0, restitution=0.6),), constant_force=(-unit,),
        forces=(vi.Harmonic(1.3, (0.2 * unit,)),),
    )  # fmt: skip
    run = vi.simulate(m, vi.State((unit,), (0.0,)), t_max=100.0)
    assert abs(run.position[-1, 0]) <= 16 * 2.0**-53 * unit
