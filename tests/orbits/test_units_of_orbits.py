"""Units of length, time and mass do not matter to what is found with runs: sections, orbits, branches, sweeps."""

from __future__ import annotations

import itertools
from collections.abc import Callable
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
    length: float
    time: float

    def both(self, found: Callable[[vi.Mechanism, vi.State, float], Any]) -> tuple[Any, Any]:
        """What is found for both; the last argument is the unit of time."""
        return found(*self.here, 1.0), found(*self.there, self.time)

    def same(self, one: Any, other: Any, length: int = 0, time: int = 0) -> None:
        """Check that numbers of such a dimension have the same bits."""
        np.testing.assert_array_equal(np.array(one) * self.length**length * self.time**time, other)


@pytest.fixture(params=itertools.product(PARTS, UNITS), ids=str)
def pair(request: pytest.FixtureRequest) -> Pair:
    kind, units = request.param
    m = vi.Mechanism(
        mass=[[1.0]], damping=[[0.1]], stiffness=[[1.0]], forces=(vi.Harmonic(0.8, (1.0,)),),
        elements=PARTS[kind],
    )  # fmt: skip
    return Pair((m, START), (scaled(m, *units), scaled(START, *units)), *units[:2])


def test_sections_have_the_same_bits_in_units_of_powers_of_two(pair: Pair) -> None:
    one, other = pair.both(lambda m, s, _: vi.impact_section(m, s, points=50, settle=100))
    pair.same(one.time, other.time, time=1)
    pair.same(one.position, other.position, length=1)
    pair.same(one.velocity, other.velocity, length=1, time=-1)


def test_orbits_and_multipliers_have_the_same_bits_in_units_of_powers_of_two(pair: Pair) -> None:
    one, other = pair.both(lambda m, s, _: vi.find_orbit(m, s))
    pair.same(one.period, other.period, time=1)
    pair.same(one.multipliers, other.multipliers)
    pair.same(one.state.position, other.state.position, length=1)
    pair.same(one.state.velocity, other.state.velocity, length=1, time=-1)


def test_branches_have_the_same_special_points_in_any_units(pair: Pair) -> None:
    def special(m: vi.Mechanism, s: vi.State, unit: float) -> list[tuple[str, float]]:
        branch = vi.continue_orbit(vi.find_orbit(m, s), "omega", (0.7 / unit, 0.84 / unit))
        return [(p.label, p.parameter * unit) for p in branch.special_points]

    one, other = pair.both(special)
    assert [label for label, _ in one] == [label for label, _ in other]
    np.testing.assert_allclose([p for _, p in one], [p for _, p in other], rtol=1e-9)


def test_sweeps_in_lanes_have_the_same_bits_in_units_of_powers_of_two(pair: Pair) -> None:
    one, other = pair.both(
        lambda m, s, unit: vi.sweep(
            m, over={"omega": np.linspace(0.5, 1.2, 20) / unit}, start=s, settle=30, periods=20,
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
        mass=[[1.0]], damping=[[0.02]], stiffness=[[0.5]], elements=elements,
        contacts=(vi.Contact((1.0,), lower=0.0, restitution=0.6),), constant_force=(-unit,),
        forces=(vi.Harmonic(1.3, (0.2 * unit,)),),
    )  # fmt: skip
    run = vi.simulate(m, vi.State((unit,), (0.0,)), t_max=100.0)
    assert abs(run.position[-1, 0]) <= 16 * 2.0**-53 * unit
