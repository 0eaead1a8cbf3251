"""Rayleigh's damping: vibration modes whatever contacts are closed."""

from __future__ import annotations

import numpy as np
import pytest
from test_resting import heavy

import vibroimpact as vi
from vibroimpact import hybrid
from vibroimpact.hybrid import compile_mechanism
from vibroimpact.rayleigh import proportion


def damped(seed: int, of_mass: float, of_stiffness: float) -> vi.Mechanism:
    """Full matrices of four coordinates, stiffnesses a thousand times the masses."""
    half, spring = np.random.default_rng(seed).normal(size=(2, 4, 4))
    mass = half @ half.T + 0.5 * np.eye(4)
    stiffness = 1e3 * (spring @ spring.T)
    return vi.Mechanism(
        mass=mass.tolist(), stiffness=stiffness.tolist(),
        damping=(of_mass * mass + of_stiffness * stiffness).tolist(),
        contacts=tuple(vi.Contact(tuple(row), 0.0, np.inf) for row in np.eye(4)[:3]),
    )  # fmt: skip


@pytest.mark.parametrize("parts", [(0.0, 0.0), (0.3, 0.0), (0.0, 2e-4), (0.3, 2e-4), (-0.1, 1e-3)])
@pytest.mark.parametrize("seed", range(5))
def test_the_proportion_of_rayleighs_damping_is_found(
    seed: int, parts: tuple[float, float]
) -> None:
    """Each entry of C is rounded three times."""
    m = damped(seed, *parts)
    found = proportion(m)
    assert found is not None
    error = abs(np.subtract(found, parts))
    assert np.all(error * [1.0, 1e3] <= 2e-14 * (abs(parts[0]) + 1e3 * abs(parts[1])))
    assert [p == 0.0 for p in found] == [p == 0.0 for p in parts]


@pytest.mark.parametrize("entry", [(0, 0), (1, 2), (3, 3)])
def test_an_entry_of_another_kind_is_no_proportion(entry: tuple[int, int]) -> None:
    m = damped(1, 0.3, 2e-4)
    dashpots = np.array(m.damping)
    dashpots[entry] = dashpots[entry[::-1]] = dashpots[entry] * (1.0 + 1e-11)
    other = vi.Mechanism(
        mass=m.mass, damping=dashpots.tolist(), stiffness=m.stiffness, contacts=m.contacts
    )
    assert proportion(other) is None
    assert compile_mechanism(other).dense
    assert not compile_mechanism(m).dense


@pytest.mark.parametrize("matrix", ["mass", "stiffness"])
def test_stiffness_in_proportion_to_the_mass_or_none_is_damped_alike(matrix: str) -> None:
    m = damped(2, 0.0, 0.0)
    stiffness = 2.0 * np.array(m.mass) if matrix == "mass" else np.zeros((4, 4))
    alike = vi.Mechanism(
        mass=m.mass, damping=(0.2 * np.array(m.mass)).tolist(), stiffness=stiffness.tolist(),
        contacts=m.contacts,
    )  # fmt: skip
    assert proportion(alike) == pytest.approx((0.2, 0.0), rel=1e-15)


def test_a_mode_without_stiffness_keeps_its_speed_where_stiffness_damps() -> None:
    """c = 0 exactly, so that the block only drifts."""
    spring = np.array([[1.0, -1.0, 0.0], [-1.0, 2.0, -1.0], [0.0, -1.0, 1.0]])
    free = vi.Mechanism(
        mass=np.eye(3).tolist(), damping=(0.1 * spring).tolist(), stiffness=spring.tolist(),
        contacts=tuple(vi.Contact(tuple(row), -9.0, 9.0) for row in np.eye(3)),
    )  # fmt: skip
    flow = compile_mechanism(free).free.flow
    assert [(k, c) for k, c in zip(flow["k"], flow["c"], strict=True) if k == 0.0] == [(0.0, 0.0)]


@pytest.mark.parametrize("seed", range(60, 80))
def test_motions_are_those_of_the_full_matrix(seed: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """Bouncing, at rest and after. Chatter may be summed an impact earlier in one of them."""
    mechanism, state = heavy(seed)
    monkeypatch.setattr(hybrid, "_compiled", hybrid._compiled.__wrapped__)
    run = vi.simulate(mechanism, state, impacts=30)
    monkeypatch.setattr(hybrid, "proportion", lambda _: None)
    full = vi.simulate(mechanism, state, impacts=30)
    assert compile_mechanism(mechanism).dense == (len(mechanism.contacts) > 2)
    times = np.linspace(0.0, min(run.time[-1], full.time[-1]), 1000)[:-1]
    assert run.at(times)[0] == pytest.approx(full.at(times)[0], abs=1e-9)
