"""States that lie behind stops are put on them."""

from __future__ import annotations

import numpy as np
import pytest

import vibroimpact as vi
from vibroimpact.simulation.simulate import before_stops


def corner(ceiling: float) -> vi.Mechanism:
    """x <= 1 and y <= x, and y >= -ceiling."""
    return vi.Mechanism(
        mass=np.eye(2), damping=np.zeros((2, 2)), stiffness=np.eye(2), forces=(vi.Harmonic(1.0, (1.0, 0.0)),),
        elements=(
            vi.RigidStop((1.0, 0.0), upper=1.0, restitution=0.5),
            vi.RigidStop((-1.0, 1.0), upper=0.0, restitution=0.5),
            vi.RigidStop((0.0, 1.0), lower=-ceiling, restitution=0.5),
        ),
    )  # fmt: skip


@pytest.mark.parametrize(
    ("position", "nearest"),
    [
        ((0.5, 0.0), (0.5, 0.0)),  # before all
        ((1.2, 0.3), (1.0, 0.3)),  # behind the first
        ((0.2, 0.6), (0.4, 0.4)),  # behind the second
        ((0.9, 1.5), (1.0, 1.0)),  # the way out of the second leads behind the first
    ],
)
def test_a_state_goes_to_the_nearest_place_before_the_stops(
    position: tuple[float, float], nearest: tuple[float, float]
) -> None:
    start = before_stops(corner(2.0), vi.State(position, (0.1, -0.2), 0.3))
    np.testing.assert_allclose(start.position, nearest, rtol=0.0, atol=4e-16)
    assert (start.velocity, start.phase) == ((0.1, -0.2), 0.3)
    vi.simulate(corner(2.0), start, impacts=1)  # takes it


def test_where_stops_leave_no_place_the_state_is_refused() -> None:
    none = corner(-1.5)  # y >= 1.5, y <= x <= 1
    with pytest.raises(vi.InvalidParameterError, match="behind the"):
        vi.simulate(none, before_stops(none, vi.State((0.5, 0.0), (0.0, 0.0))), impacts=1)
