"""Random machines with elements against step-by-step integration (support/event_reference.py)."""

from __future__ import annotations

import numpy as np
import pytest
from support.event_reference import Reference
from support.random_elements import KINDS, machine, start

import vibroimpact as vi

EVENTS, SPAN, MACHINES = 12, 20.0, 10
NAMES = {
    "impact": vi.Status.IMPACT, "stick": vi.Status.STICK, "release": vi.Status.RELEASE,
    "engage": vi.Status.ENGAGE, "change": vi.Status.CHANGE,
}  # fmt: skip
NO_EVENT = (vi.Status.GRAZING, vi.Status.HORIZON)


def disagreement(m: vi.Mechanism, state: vi.State) -> tuple[str, int, float]:
    """What is different, if anything; events compared; the largest difference in its bound."""
    run = vi.simulate(m, state, impacts=400, t_max=SPAN)
    fine, coarse = (Reference(m, state).events(EVENTS, SPAN, rtol) for rtol in (1e-13, 1e-11))
    ours = [i for i in range(len(run)) if run.status[i] not in NO_EVENT]
    worst, allowed = 0.0, 1e-10  # local errors of 1e-13 of coordinates below 5, in some 200 steps
    for j, (e, c) in enumerate(zip(fine, coarse, strict=False)):
        if c[1:3] != e[1:3]:
            return "", j, worst  # too sensitive for the coarse one
        # what tolerances a hundred times as large change: more than they are wrong by themselves
        allowed = max(allowed, abs(c.time - e.time), float(np.abs(c.z - e.z).max()))
        if j >= len(ours):
            return f"event {j} of {e.what} {e.number} at {e.time} is missing; {run.end.name}", j, 0
        i = ours[j]
        got = f"{vi.Status(run.status[i]).name} {run.contact[i]} at {run.time[i]}"
        kind = vi.Status.CHANGE if run.status[i] == vi.Status.NON_UNIQUE else run.status[i]
        if (kind, run.contact[i]) != (NAMES[e.what], e.number):
            return f"event {j}: {e.what} {e.number} at {e.time}, not {got}", j, 0.0
        after = np.concatenate([run.position[i], run.velocity_after[i]])
        apart = max(abs(run.time[i] - e.time), float(np.abs(after - e.z[: len(after)]).max()))
        worst = max(worst, apart / allowed)
        if apart > allowed:
            return f"event {j}: {got} is {apart:.1e} from {e.time}, > {allowed:.1e}", j, worst
    if len(fine) < EVENTS and len(ours) > len(fine):
        i = ours[len(fine)]
        if run.time[i] < SPAN and abs(run.rate_before[i]) > 0.01:
            return f"{vi.Status(run.status[i]).name} at {run.time[i]} is too much", len(fine), 0.0
    return "", len(fine), worst


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.slow
def test_events_of_random_machines_are_those_of_integration(kind: str) -> None:
    compared = 0
    for seed in range(MACHINES):
        rng = np.random.default_rng(seed)
        m = machine(rng, KINDS[kind])
        what, events, _ = disagreement(m, start(rng, m))
        assert not what, f"seed {seed}: {what}"
        compared += events
    assert compared > 2 * MACHINES
