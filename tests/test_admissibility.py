"""Which orbits are motions of the machine, and how near to grazing: against simulation."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from support.periodic import coco, damper_orbits, largest, orbits_of_chains
from support.systems import paper_damper

import vibroimpact as vi
from vibroimpact.periodic.admissibility import least_gaps
from vibroimpact.periodic.find import unfolded
from vibroimpact.periodic.orbit import Orbit
from vibroimpact.periodic.prescribed import compile_prescribed


def repeats_in_simulation(orbit: Orbit) -> bool:
    """Whether the machine, started on an orbit, has its impacts at its times."""
    durations = unfolded(orbit).durations
    try:
        run = vi.simulate(
            orbit.system, orbit.state, impacts=len(durations), t_max=1.5 * orbit.period
        )
    except vi.InvalidParameterError:  # it starts behind another stop
        return False
    times = np.cumsum(durations)
    # a start wrong by 1e-13 is wrong by at most that times the largest multiplier at the end
    allowed = 1e-10 * max(1.0, largest(orbit.multipliers)) * orbit.period
    stops = [(int(c), 1 if s == 0 else -1) for c, s in zip(run.contact, run.stop, strict=True)]
    around = [*orbit.signature.impacts[1:], orbit.signature.impacts[0]]
    return (
        len(run) == len(times)
        and stops == around
        and bool(np.all(run.status == vi.Status.IMPACT))
        and bool(np.all(np.abs(run.time - times) <= allowed))
    )


def test_exactly_the_admissible_orbits_are_motions_of_the_machine() -> None:
    orbits = [*orbits_of_chains(), *damper_orbits()]
    verdicts = [orbit.admissible for orbit in orbits]
    assert verdicts.count(False) >= 10
    assert verdicts.count(True) >= 100
    assert [repeats_in_simulation(orbit) for orbit in orbits] == verdicts


def dense_gaps(orbit: Orbit) -> list[tuple[float, int, int, int, float]]:
    """(gap, contact, side, flight, time) at local minima of sampled gaps, by another flight.

    The machine without stops is simulated: modal coordinates instead of Taylor series.
    """
    m = orbit.mechanism
    far = tuple(replace(c, lower=-1e6, upper=1e6) for c in m.contacts)
    free, n, found = replace(m, contacts=far), m.degrees, []
    for k, (state, duration) in enumerate(zip(orbit.states, orbit.durations, strict=True)):
        start = vi.State(tuple(state[:n]), tuple(state[n : 2 * n]), float(state[-1]))
        run = vi.simulate(free, start, t_max=float(duration))
        times = np.linspace(0.0, float(run.time[-1]), 20_001)
        place = run.at(times)[0]
        for i, c in enumerate(m.contacts):
            for side, gap in ((1, c.upper - place @ c.row), (-1, place @ c.row - c.lower)):
                low = np.flatnonzero((gap[1:-1] < gap[:-2]) & (gap[1:-1] <= gap[2:])) + 1
                found += [(float(gap[j]), i, side, k, float(times[j])) for j in low if gap[j] < 1e5]
    return found


def test_the_clearance_is_that_of_a_dense_evaluation() -> None:
    orbits = [*orbits_of_chains(), *damper_orbits()]
    compared = 0
    for orbit in orbits:
        sampled = [g for g in dense_gaps(orbit) if 1e-3 < g[4] < orbit.durations[g[3]] - 1e-3]
        several = len(orbit.mechanism.contacts) > 1  # then gaps count at others' impacts too
        if not sampled or (several and min(sampled)[0] > orbit.clearance_to_grazing):
            continue
        gap, contact, side, flight, time = min(sampled)
        compared += 1
        # half a step from the minimum: (dt / 2)^2 u'' / 2, with u'' below 1e2 in all these
        dt = orbit.durations[flight] / 20_000
        assert orbit.clearance_to_grazing == pytest.approx(gap, abs=13.0 * dt**2 + 1e-10)
        assert orbit.nearest is not None
        assert orbit.nearest[1:4] == (contact, side, flight)
        assert orbit.nearest.time == pytest.approx(time, abs=2.0 * dt)
    assert compared >= 15


def test_an_inadmissible_orbit_names_the_gap_that_it_violates() -> None:
    damper = paper_damper("B", 0.6)
    early, behind = (vi.find_orbit(damper, closed) for closed in vi.symmetric_orbits(damper))
    gap = min(dense_gaps(early))[0]
    assert f"the gap at the upper stop of contact 0 is {gap:.5g}"[:-1] in early.inadmissible_reason
    assert "in flight 0" in early.inadmissible_reason
    assert "from behind" in behind.inadmissible_reason
    assert not early.stable
    assert early.inadmissible_reason in repr(early)


def test_a_gap_that_another_contact_leaves_open_or_crosses_is_seen_at_its_impact() -> None:
    """A second wall, beyond the first by little, is behind the mass at every impact."""
    one = coco()
    orbit = vi.find_orbit(one, vi.State((0.0,), (0.0,)))
    wall = one.contacts[0]
    for limit, admissible in ((1.5, True), (0.9, False)):
        both = replace(one, contacts=(wall, replace(wall, upper=limit)))
        again = vi.find_orbit(both, unfolded(orbit), impacts=["A"], cycles=1)
        assert again.admissible == admissible
        assert again.clearance_to_grazing == pytest.approx(limit - 1.0, abs=1e-12)


def test_a_contact_left_at_the_start_of_a_flight_may_be_crossed_before_its_end() -> None:
    """x2 = cos t / 2 - sin t leaves its stop at 1/2, and is behind it when x1 impacts at t = 4.5.

    On the way its gap has a maximum and no minimum.
    """
    m = vi.Mechanism(
        mass=np.eye(2), damping=np.zeros((2, 2)), stiffness=np.diag([0.0, 1.0]),
        contacts=(vi.Contact((1.0, 0.0), upper=1.0), vi.Contact((0.0, 1.0), upper=0.5)),
    )  # fmt: skip
    start = np.array([[1.0 - 4.5, 0.5, 1.0, -1.0, 0.0]])
    for begun, ends in (((1, 1), (0, 1)), ((1, 1), (1, 1))):
        found = least_gaps(compile_prescribed(m), start, np.array([4.5]), [ends], [begun])
        least = min(found.values())
        assert least is not None
        crossed = 0.5 - (0.5 * np.cos(4.5) - np.sin(4.5))
        if ends == (0, 1):
            assert least.gap == pytest.approx(crossed, abs=1e-13)
            assert least[1:] == (1, 1, 0, 4.5)
        else:  # its own impact: the gap there is the equation's business
            assert least.contact == 0
