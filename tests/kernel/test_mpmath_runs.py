"""Two hundred impacts of the paper's three sets against the 50-digit reference."""

from __future__ import annotations

import numpy as np
import pytest
from support import UNIT
from support.kernel import growth
from support.replay import flights
from support.systems import damper_witness, paper_damper
from witness import damper as reference
from witness import symmetric
from witness.precision import exact

import vibroimpact as vi

IMPACTS = 200
# omegas at which the symmetric orbit is stable, and others of the paper's figures
STABLE = [("A", 1.2), ("A", 1.02), ("B", 1.1), ("B", 1.05), ("C", 0.435), ("C", 0.45)]
OTHERS = [("A", 1.0011368), ("A", 0.9817), ("A", 0.970453), ("B", 0.945), ("B", 0.937),
          ("C", 0.41731), ("C", 0.41719)]  # fmt: skip


def near_symmetric_orbit(d: vi.ImpactDamper, push: float) -> vi.State:
    """On stop A, on the stable symmetric orbit but for a push of the main mass."""
    orbits = [symmetric.orbit(damper_witness(d), sign) for sign in (1, -1)]
    stable = [
        o for o in orbits
        if o and not symmetric.inadmissible(o) and abs(symmetric.half_multipliers(o)[0]) < 1
    ]  # fmt: skip
    z = stable[0].state
    return d.on_stop("A", x1=float(z.x1), v1=float(z.v1) + push, v2=float(z.v2),
                     phase=float(z.phase))  # fmt: skip


@pytest.mark.slow
@pytest.mark.parametrize("push", [1e-3, 0.0])  # 0: flights repeat from the fourth on
@pytest.mark.parametrize(("name", "omega"), STABLE)
def test_stable_motion_follows_the_reference_for_200_impacts(
    name: str, omega: float, push: float
) -> None:
    d = paper_damper(name, omega)
    state = near_symmetric_orbit(d, push)
    run = vi.simulate(d, state, impacts=IMPACTS)
    z = reference.state(state.position[0], state.velocity[0], state.position[1],
                        state.velocity[1], phase=state.phase)  # fmt: skip
    events = reference.simulate(damper_witness(d), z, IMPACTS, from_stop="A")
    assert [e.kind for e in events] == ["impact"] * IMPACTS
    assert [e.stop for e in events] == ["?AB"[i] for i in run.side]
    # an error made at any impact grows at most so much and then dies out; of the order of
    # 64 u of the size of the motion is made at each
    size = float(np.abs(run.position).max() + np.abs(run.velocity_before).max())
    allowed = 64.0 * UNIT * size * 10.0 * growth(d, state, (1, 2, 5, 10, 20, 50))
    assert allowed < 1e-9
    for i, e in enumerate(events):
        true = (e.before.x1, e.before.x2, e.before.v1, e.before.v2)
        got = (*run.position[i], *run.velocity_before[i])
        assert max(abs(exact(a) - b) for a, b in zip(got, true, strict=True)) <= allowed
        assert abs(exact(run.time[i]) - e.time) <= allowed + np.spacing(run.time[i])
        turn = abs(exact(run.phase[i]) - e.after.phase)
        assert min(turn, abs(turn - 2 * reference.mp.pi)) <= allowed * max(1.0, d.omega)


@pytest.mark.slow
@pytest.mark.parametrize(("name", "omega"), STABLE + OTHERS)
def test_every_flight_of_200_impacts_matches_the_reference(name: str, omega: float) -> None:
    d = paper_damper(name, omega)
    run = vi.simulate(d, vi.State((0.3, 0.1), (0.2, 0.7), 0.4), impacts=IMPACTS)
    checked = 0
    for flight in flights(run):
        flight.check()
        checked += 1
    assert checked >= 0.9 * IMPACTS  # the rest are flights from or to chatter and rest


def test_time_does_not_drift_over_a_million_impacts() -> None:
    """On a periodic orbit the clock and the phase of the force must stay together."""
    d = paper_damper("A", 1.2)
    run = vi.simulate(d, near_symmetric_orbit(d, 1e-3), impacts=1_000_000)
    turns = (exact(run.time[-1]) * exact(d.omega) + exact(run.start.phase)) / (2 * reference.mp.pi)
    apart = abs((turns - exact(run.phase[-1]) / (2 * reference.mp.pi) + 0.5) % 1 - 0.5)
    # the phasor is turned once an impact, each time by an angle good to a few roundings, which
    # add up like a random walk at best and linearly at worst
    assert apart * 2 * reference.mp.pi <= 8.0 * UNIT * 1_000_000
