"""The mechanism of a system: built once for one that cannot change, each time for one that can."""

from __future__ import annotations

import gc
from dataclasses import dataclass

import vibroimpact as vi
from vibroimpact.model import system

START = vi.State((0.0,), (1.0,))
built: list[float] = []


def wall(upper: float) -> vi.Mechanism:
    built.append(upper)
    return vi.Mechanism(
        mass=[[1.0]], damping=[[0.0]], stiffness=[[0.0]],
        elements=(vi.RigidStop((1.0,), -1.0, upper, 0.9),),
    )  # fmt: skip


@dataclass(frozen=True)
class Frozen:
    upper: float = 1.0

    @property
    def mechanism(self) -> vi.Mechanism:
        return wall(self.upper)


@dataclass
class Changing:
    upper: float = 1.0

    @property
    def mechanism(self) -> vi.Mechanism:
        return wall(self.upper)


def first_impact(one: object) -> float:
    return float(vi.simulate(one, START, impacts=1).time[0])


def test_the_mechanism_of_a_frozen_system_is_built_once() -> None:
    one, other = Frozen(), Frozen(2.0)
    built.clear()
    assert [first_impact(x) for x in (one, one, other, one)] == [1.0, 1.0, 2.0, 1.0]
    assert built == [1.0, 2.0]


def test_a_system_that_changes_is_built_again() -> None:
    one = Changing()
    before, one.upper = first_impact(one), 3.0
    assert (before, first_impact(one)) == (1.0, 3.0)


def test_what_was_built_is_forgotten_with_its_system() -> None:
    gc.collect()
    count = len(system._BUILT)
    one = vi.Family(wall, upper=1.5)
    assert first_impact(one) == 1.5
    assert len(system._BUILT) == count + 1
    del one
    gc.collect()
    assert len(system._BUILT) == count


def test_the_damper_of_the_paper_is_remembered() -> None:
    damper = vi.ImpactDamper(
        mass_ratio=0.1, omega_n=0.5, zeta=0.045, restitution=0.8, half_clearance=5.0, omega=1.2
    )
    assert system.mechanism_of(damper) is system.mechanism_of(damper)
