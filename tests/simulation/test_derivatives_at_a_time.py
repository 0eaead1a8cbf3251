"""The derivative of a motion at a given time is that of its differences, whatever happened before."""

from __future__ import annotations

import numpy as np
import pytest

import vibroimpact as vi

H = 1e-6
RIGID = vi.RigidStop((1.0,), upper=0.3, restitution=0.7)
SOFT = vi.SoftStop((1.0,), upper=0.3, stiffness=9.0, damping=0.5)
MACHINES = {
    "rigid": (RIGID,),
    "soft": (SOFT,),
    "friction": (vi.Friction((1.0,), kinetic=0.2, static=0.3),),
    "moving": (vi.RigidStop((1.0,), upper=0.3, motion=(vi.Harmonic(1.3, (0.1,)),)),),
    "mixed": (RIGID, vi.SoftStop((1.0,), lower=-0.2, stiffness=4.0), vi.Friction((1.0,), 0.05)),
}


def machine(what: str) -> vi.Mechanism:
    return vi.Mechanism(
        mass=[[1.0]], damping=[[0.1]], stiffness=[[1.0]], elements=MACHINES[what],
        forces=(vi.Harmonic(1.3, (0.5,)),),
    )  # fmt: skip


@pytest.mark.parametrize("what", MACHINES)
@pytest.mark.parametrize("time", [2.0, 6.0, 11.0])
def test_the_derivative_at_a_time_is_that_of_the_state_at_this_time(what: str, time: float) -> None:
    m, start = machine(what), np.array([0.1, 0.2, 0.3])

    def after(x: np.ndarray) -> np.ndarray:
        last = vi.simulate(m, vi.State((x[0],), (x[1],), x[2]), t_max=time).last
        return np.array([*last.position, *last.velocity, last.phase])

    assert len(vi.simulate(m, vi.State((0.1,), (0.2,), 0.3), t_max=time)) > 1  # events, then t_max
    got = vi.map_derivative(m, vi.State((0.1,), (0.2,), 0.3), t_max=time, impacts=1000)
    columns = [(after(start + e) - after(start - e)) / (2.0 * H) for e in H * np.eye(3)]
    assert got.end is vi.RunEnd.HORIZON
    np.testing.assert_allclose(got.matrix, np.array(columns).T, atol=1e-7)
    assert not got.duration.any()


def test_after_so_many_impacts_the_time_moves_instead() -> None:
    m, start = machine("rigid"), vi.State((0.1,), (0.2,), 0.3)
    got = vi.map_derivative(m, start, impacts=2)
    times = [vi.simulate(m, vi.State((0.1 + d,), (0.2,), 0.3), impacts=2).time[-1] for d in (H, -H)]
    np.testing.assert_allclose(got.duration[0], (times[0] - times[1]) / (2.0 * H), rtol=1e-6)
    # on the stop the place does not move, to the rounding of what is added
    np.testing.assert_allclose(got.matrix[0], 0.0, atol=1e-13)
