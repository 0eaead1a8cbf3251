"""Stops that do not rebound: what one coordinate is after an impact is rounding, but for its phase.

The state just after the impact is (stop, 0, phase): phases and stops alone say what the motion is.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

import vibroimpact as vi

OFF: dict[str, Any] = {"progress": False}
UNIT = 1e-6  # of the phase: two returns to one state; contracting motions have settled to rounding


def plastic(seed: int, *, at_zero: bool) -> vi.Mechanism:
    """A forced mass on a spring in a slot; one of its ends is 0, or rounding next to it."""
    rng = np.random.default_rng(seed)
    low, high = sorted(rng.uniform(-1.0, 1.0, 2))
    if at_zero:
        low, high = -1.0 - abs(low), float(rng.choice([0.0, 1e-17, -1e-12]))
    return vi.Mechanism(
        mass=[[1.0]], damping=[[rng.uniform(0.02, 0.3)]], stiffness=[[rng.uniform(0.3, 4.0)]],
        forces=(vi.Harmonic(rng.uniform(0.4, 4.0), (rng.uniform(1.5, 8.0),)),),
        elements=(vi.RigidStop((1.0,), low, high, 0.0),),
    )  # fmt: skip


def witness(system: vi.Mechanism, start: vi.State) -> str:
    """n-p-q from the phases of a record and its stops; empty if it is longer than 20 impacts."""
    run = vi.simulate(system, start, impacts=1200)
    hits = run.impacts
    time, stop = run.time[hits][-100:], run.side[hits][-100:]
    phase = np.exp(1j * system.omega * time)
    for period in range(1, 21):
        back = np.abs(phase[period:] - phase[:-period]) < UNIT
        if back.all() and (stop[period:] == stop[:-period]).all():
            n = round((time[-1] - time[-1 - period]) * system.omega / (2.0 * math.pi))
            a = int((stop[-period:] == 1).sum())
            return f"{n}-{a}-{period - a}"
    return ""


@pytest.mark.parametrize("at_zero", [False, True])
def test_motions_between_plastic_stops_have_the_period_of_their_phases(*, at_zero: bool) -> None:
    compared = 0
    for seed in range(12):
        system = plastic(seed, at_zero=at_zero)
        contact = system.rigid_stops[0]
        start = vi.State((0.5 * (contact.lower + contact.upper),), (0.1,), 0.3)
        wanted = witness(system, start)
        if not wanted or wanted.split("-")[1] == "0":  # nothing on the section at stop A
            continue
        compared += 1
        assert vi.classify(system, start).symbol == wanted
        over = {"v1": np.linspace(-1.0, 1.0, 4), "phase": np.linspace(0.0, 6.0, 4)}
        found = vi.basins(system, over=over, start=start, **OFF)
        symbols = zip(*(found[name].values.ravel() for name in "npq"), strict=True)
        words = {f"{n}-{p}-{q}" for n, p, q in symbols} - {"0-0-0"}
        assert wanted in words
        names = [name for name in found.name.values if name != "without impacts"]
        assert {name.rsplit(" ", 1)[0] for name in names} == words
        assert len(names) == len(words)
    assert compared >= 8


def test_a_mass_that_lands_softly_on_both_stops_once_a_period_is_1_1_1() -> None:
    """After its impacts the velocity is some 1e-16, and "5-5-5" was read from it."""
    system = vi.Mechanism(
        mass=[[1.0]], damping=[[0.1]], stiffness=[[3.0]], forces=(vi.Harmonic(1.6, (1.5,)),),
        elements=(vi.RigidStop((1.0,), -0.7, 0.5, 0.0),),
    )  # fmt: skip
    start = vi.State((0.0,), (0.1,), 0.3)
    assert vi.classify(system, start).label == "1-1-1 periodic, not symmetric"
    starts = vi.RandomStarts(40, 3, {"v1": (-1.0, 1.0), "phase": (0.0, 6.2)}, start)
    slots = vi.Family(
        lambda upper: vi.Mechanism(
            mass=system.mass, damping=system.damping, stiffness=system.stiffness,
            forces=system.forces, elements=(vi.RigidStop((1.0,), -0.7, upper, 0.0),),
        ),
        upper=0.5,
    )  # fmt: skip
    counted = vi.multistability(slots, over={"upper": [0.4, 0.5]}, start=starts, **OFF)
    assert counted.attractors.values.tolist() == [1, 1]


def test_a_symmetric_slot_has_a_symmetric_plastic_motion() -> None:
    system = vi.Mechanism(
        mass=[[1.0]], damping=[[0.1]], stiffness=[[3.0]], forces=(vi.Harmonic(1.6, (1.5,)),),
        elements=(vi.RigidStop((1.0,), -0.5, 0.5, 0.0),),
    )  # fmt: skip
    found = vi.classify(system, vi.State((0.0,), (0.1,), 0.3))
    assert found.name == "1-1-1 periodic"
    assert found.symmetric
