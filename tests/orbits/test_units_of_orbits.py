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


@BOTH[0]
@BOTH[1]
def test_branches_have_the_same_special_points_in_any_units(
    kind: str, units: tuple[float, float, float]
) -> None:
    (m, s), (there, start) = both(kind, units)
    omega = "omega"
    one = vi.continue_orbit(vi.find_orbit(m, s), omega, (0.7, 0.84))
    other = vi.continue_orbit(vi.find_orbit(there, start), omega, (0.7 / units[1], 0.84 / units[1]))
    points = [[(p.label, p.parameter) for p in b.special_points] for b in (one, other)]
    assert [label for label, _ in points[0]] == [label for label, _ in points[1]]
    np.testing.assert_allclose(
        [p for _, p in points[0]], [p * units[1] for _, p in points[1]], rtol=1e-9
    )


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
