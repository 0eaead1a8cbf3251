"""Motions without impacts: flights and rest, named alike wherever attractors are named."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import vibroimpact as vi

ORIGIN = vi.State((0.0,), (0.0,))
OFF: dict[str, Any] = {"progress": False}


def oscillator(
    damping: float, omega: float, *, upper: float, stiffness: float = 1.0, restitution: float = 0.8
) -> vi.Mechanism:
    """A mass on a spring with one stop, under cos(omega t)."""
    return vi.Mechanism(
        mass=[[1.0]], damping=[[damping]], stiffness=[[stiffness]],
        forces=(vi.Harmonic(omega, (1.0,)),),
        elements=(vi.RigidStop((1.0,), upper=upper, restitution=restitution),),
    )  # fmt: skip


def names_of_starts(found: Any) -> list[str]:
    names = found.name.values
    return [names[label] if label >= 0 else "" for label in found.attractor.values.ravel()]


@pytest.mark.parametrize("seed", range(6))
def test_basins_hold_the_starts_that_classify_says_are_without_impacts(seed: int) -> None:
    """More starts fly for ever than ever go on: the stop is above the steady response."""
    rng = np.random.default_rng(seed)
    damping, omega = rng.uniform(0.1, 0.3), rng.uniform(1.3, 2.5)
    steady = 1.0 / abs(complex(1.0 - omega**2, damping * omega))
    system = oscillator(damping, omega, upper=steady * rng.uniform(1.5, 3.0))
    x, v = np.linspace(-2.0, 2.0, 28), np.linspace(-2.0, 2.0, 25)
    found = vi.basins(system, over={"x1": x, "v1": v}, start=ORIGIN, **OFF)
    names = names_of_starts(found)
    assert names.count("without impacts") > 64
    startable = found.attractor.values.ravel() != -8
    beyond = np.repeat(x > system.rigid_stops[0].upper, len(v))
    np.testing.assert_array_equal(startable, ~beyond)
    counts = [names.count(name) for name in found.name.values]
    assert found.share.values == pytest.approx(np.array(counts) / startable.sum(), rel=1e-15)
    assert found.share.values.sum() == pytest.approx(1.0)
    for i in rng.permutation(np.flatnonzero(startable))[:12]:
        start = vi.State((x[i // len(v)],), (v[i % len(v)],))
        settled = vi.classify(system, start)
        assert (settled.symbol or settled.name) in names[i]
    at = vi.attractor_state(found, "without impacts")
    assert vi.simulate(system, at, t_max=50.0).impacts.sum() == 0


def test_members_that_only_fly_are_one_attractor_each_way_of_counting() -> None:
    """1600 starts of the oscillator that the stop hardly touches."""
    system = oscillator(0.04, 1.7, upper=1.26)
    axis = np.linspace(-2.0, 2.0, 40)
    found = vi.basins(system, over={"x1": axis, "v1": axis}, start=ORIGIN, **OFF)
    assert found.name.values.tolist() == ["without impacts", "1-1-0 a"]
    starts = vi.GridStarts({"x1": axis, "v1": axis}, ORIGIN)
    stops = vi.Family(lambda upper: oscillator(0.04, 1.7, upper=upper), upper=1.26)
    counted = vi.multistability(
        stops, over={"upper": [1.26]}, start=starts, settle_periods=1000, **OFF
    )
    assert counted.attractors.values.tolist() == [2]


def test_a_damper_at_rest_between_far_stops_is_an_attractor_of_all_starts() -> None:
    """One name for a mass that drifts or stands anywhere: none of them is told from another."""
    damper = vi.ImpactDamper(
        mass_ratio=0.1, omega_n=0.5, zeta=0.045, restitution=0.8, half_clearance=50.0, omega=1.2
    )
    over = {"x1": np.linspace(-1.0, 1.0, 9), "x2": np.linspace(-9.0, 9.0, 9)}
    start = vi.State((0.0, 0.0), (0.0, 0.0))
    found = vi.basins(damper, over=over, start=start, **OFF)
    assert found.name.values.tolist() == ["without impacts"]
    assert found.share.values.tolist() == [1.0]


def test_no_start_at_all_can_start_behind_a_stop() -> None:
    system = oscillator(0.04, 1.7, upper=1.0)
    axis = np.array([1.5, 2.0])
    found = vi.basins(system, over={"x1": axis, "v1": axis}, start=ORIGIN, **OFF)
    assert found.sizes["label"] == 0
    assert found.attractor.attrs["flag_meanings"] == "initial_penetration"


@pytest.mark.parametrize("floor", [0.0, 0.3, -2.0])
@pytest.mark.parametrize("shaken", [False, True])
def test_rest_on_a_stop_has_one_name(floor: float, *, shaken: bool) -> None:
    def ball(floor: float) -> vi.Mechanism:
        return vi.Mechanism(
            mass=[[1.0]], damping=[[0.1]], stiffness=[[0.0]], constant_force=(-1.0,),
            forces=(vi.Harmonic(2.0, (0.3,)),) if shaken else (),
            elements=(vi.RigidStop((1.0,), lower=floor, restitution=0.8),),
        )  # fmt: skip

    start = vi.State((floor + 1.0,), (0.0,))
    found = vi.classify(ball(floor), start, at=vi.AtStop("B"))
    assert found.label == found.name == "at rest on stop B"
    assert found.kind == "without impacts"
    over = {"x1": floor + np.array([0.5, 1.0]), "v1": [0.0, 1.0]}
    assert vi.basins(
        ball(floor), at=vi.AtStop("B"), over=over, start=start, **OFF
    ).name.values.tolist() == ["at rest on stop B"]


def test_rests_on_different_stops_are_counted_apart() -> None:
    """A mass that is pushed apart from the middle rests on either side of its slot."""

    def slot(half: float) -> vi.Mechanism:
        return vi.Mechanism(
            mass=[[1.0]], damping=[[0.3]], stiffness=[[-1.0]],
            elements=(vi.RigidStop((1.0,), -half, half, 0.5),),
        )  # fmt: skip

    over = {"x1": [-0.2, -0.1, 0.1, 0.2], "v1": [-0.05, 0.05]}
    found = vi.basins(slot(0.5), over=over, start=ORIGIN, **OFF)
    assert sorted(found.name.values) == ["at rest on stop A", "at rest on stop B"]
    counted = vi.multistability(
        vi.Family(slot, half=0.5), over={"half": [0.4, 0.5]}, start=vi.GridStarts(over, ORIGIN),
        **OFF,
    )  # fmt: skip
    assert counted.attractors.values.tolist() == [2, 2]
    for x, name in ((0.2, "at rest on stop A"), (-0.2, "at rest on stop B")):
        assert vi.classify(slot(0.5), vi.State((x,), (0.0,))).label == name


def test_a_motion_that_leaves_the_stop_of_the_section_alone_names_it() -> None:
    slot = vi.Mechanism(
        mass=[[1.0]], damping=[[0.1]], stiffness=[[1.0]], constant_force=(-1.5,),
        forces=(vi.Harmonic(1.3, (2.0,)),), elements=(vi.RigidStop((1.0,), -1.0, 50.0, 0.7),),
    )  # fmt: skip
    found = vi.classify(slot, ORIGIN)
    assert found.kind == "undecided"
    assert found.reason.startswith("0 of ")
    assert found.reason.endswith("at stop A of contact 0: take another stop or contact.")
    assert vi.classify(slot, ORIGIN, at=vi.AtStop("B")).kind == "periodic"
