"""A run of the impact damper flight by flight: the reference starts where the kernel stood."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from witness import damper as reference
from witness.precision import exact

import vibroimpact as vi
from support import UNIT
from support.kernel import stated_eps
from support.systems import damper_witness
from vibroimpact.compile.hybrid import compile_mechanism

if TYPE_CHECKING:
    from collections.abc import Iterator


@dataclass(frozen=True)
class Flight:
    """One flight of a run beside the reference's, with the tolerances that rounding explains."""

    index: int  # of the event that ends it
    duration: Any
    side: int
    before: Any  # (x1, x2, v1, v2)
    contact: reference.Contact | None
    time_tolerance: float
    state_tolerance: float

    def check(self) -> None:
        """Assert that both end at the same stop, at the same time, in the same state."""
        assert self.contact is not None, self
        assert self.contact.stop == "?AB"[self.side], self
        assert abs(self.duration - self.contact.time) <= self.time_tolerance, self
        z = self.contact.before
        for mine, true in zip(self.before, (z.x1, z.x2, z.v1, z.v2), strict=True):
            assert abs(exact(mine) - true) <= self.state_tolerance, self


def flights(run: vi.Run) -> Iterator[Flight]:
    """Every flight from one impact to the next."""
    d = run.system
    assert isinstance(d, vi.ImpactDamper)
    w = damper_witness(d)
    step = compile_mechanism(d.mechanism).step
    for i in range(len(run) - 1):
        if run.status[i] != vi.Status.IMPACT or run.status[i + 1] != vi.Status.IMPACT:
            continue
        duration = exact(run.time[i + 1]) - exact(run.time[i])
        (x1, x2), (v1, v2) = run.position[i], run.velocity_after[i]
        z = reference.state(x1, v1, x2, v2, phase=run.phase[i])
        contact = reference.first_contact(
            w, z, t_max=2 * duration + 1, from_stop="?AB"[run.side[i]]
        )
        # what the march may add to the gap, and the rounding of the recorded start: x, v, phase
        eps = stated_eps(d, x1, v1, x2, v2, run.phase[i], float(duration) // step)
        amplitude = float(np.hypot(*map(float, w.apart.forced())))
        size = abs(x1) + abs(v1) / max(d.omega_n, 1.0 / (1.0 + float(duration)))
        size += abs(v2) * float(duration) + d.half_clearance + 7.0 * amplitude
        error = eps + 8.0 * UNIT * size
        late = 2.0 * error / abs(run.rate_before[i + 1]) + 4.0 * np.spacing(run.time[i + 1])
        fast = abs(v1) + abs(v2) + d.omega_n * size + d.force
        state_error = error * max(1.0, d.omega, d.omega_n) + late * fast
        before = (*run.position[i + 1], *run.velocity_before[i + 1])
        yield Flight(i + 1, duration, int(run.side[i + 1]), before, contact, late, state_error)
