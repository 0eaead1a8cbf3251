"""Rayleigh's damping: vibration modes whatever contacts are closed."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.linalg import eigh
from support.systems import heavy

import vibroimpact as vi
from vibroimpact.compile import hybrid
from vibroimpact.compile.hybrid import Hybrid, compile_mechanism
from vibroimpact.compile.rayleigh import proportion
from vibroimpact.compile.reduction import Closed, reduce
from vibroimpact.compile.vibrations import rayleigh_modes
from vibroimpact.model.stop import Stop


def damped(seed: int, of_mass: float, of_stiffness: float) -> vi.Mechanism:
    """Full matrices of four coordinates, stiffnesses a thousand times the masses."""
    half, spring = np.random.default_rng(seed).normal(size=(2, 4, 4))
    mass = half @ half.T + 0.5 * np.eye(4)
    stiffness = 1e3 * (spring @ spring.T)
    return vi.Mechanism(
        mass=mass.tolist(), stiffness=stiffness.tolist(),
        damping=(of_mass * mass + of_stiffness * stiffness).tolist(),
        elements=tuple(vi.RigidStop(tuple(row), 0.0, np.inf) for row in np.eye(4)[:3]),
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


def chain(springs: list[float]) -> np.ndarray:
    """Stiffness of masses between springs, both ends held."""
    k = np.array(springs)
    return np.diag(k[:-1] + k[1:]) - np.diag(k[1:-1], 1) - np.diag(k[1:-1], -1)


SPREAD = {
    "a heavy mass": (np.diag([3000.0, 1.0, 1.0]), np.diag([3000.0, 2.0, 3.0]), (0.0, 0.1)),
    "nearly equal": (np.eye(3), 1000.0 * np.diag([1.0, 1.001, 1.002]), (0.0, 0.1)),
    "stiff springs": (np.eye(6), chain([1e6, 1e6, 3e5, 1.0, 2.0, 1.5, 1.0]), (0.1, 0.1)),
    "tiny": (1e-165 * np.eye(3), 1e-165 * chain([1.0, 2.0, 3.0, 1.0]), (0.0, 0.2)),
    "equal by a thousandth": (
        np.eye(4),
        100.0 * np.diag([1.0, 1.0007, 1.0002, 0.9991]),
        (0.0, 0.1),
    ),
    "an entry that nearly cancels": (
        np.eye(4),
        chain([3.0, 50.0, 800.0, 7.0, 1.0]),
        (-5.3 * (1.0 + 1e-13), 0.1),
    ),
    "parts that cancel": (np.eye(3), chain([2.0, 1.0, 3.0, 1.0]), (-0.4, 0.2)),
}


@pytest.mark.parametrize("name", SPREAD)
def test_entries_of_any_sizes_are_in_proportion(name: str) -> None:
    mass, stiffness, (a, b) = SPREAD[name]
    m = vi.Mechanism(
        mass=mass.tolist(), stiffness=stiffness.tolist(),
        damping=(a * mass + b * stiffness).tolist(),
        elements=tuple(vi.RigidStop(tuple(row), 0.0, np.inf) for row in np.eye(len(mass))[:3]),
    )  # fmt: skip
    assert proportion(m) == pytest.approx((a, b), rel=1e-9)


def test_dashpots_where_nothing_else_is_are_in_no_proportion() -> None:
    m = damped(0, 0.0, 0.0)
    crossed = np.zeros((4, 4))
    crossed[0, 1] = crossed[1, 0] = 0.1
    diagonal = [np.diag(np.diag(a)).tolist() for a in (m.mass, m.stiffness)]
    other = vi.Mechanism(
        mass=diagonal[0], damping=crossed.tolist(), stiffness=diagonal[1], elements=m.rigid_stops
    )
    assert proportion(other) is None


@pytest.mark.parametrize("closed", [(), (Stop(0, -1),), (Stop(1, -1), Stop(2, -1))])
def test_damping_of_modes_is_that_of_the_reduced_matrices(closed: Closed) -> None:
    """c = c_v / m_v of each vibration mode, by a library."""
    m = damped(3, 0.3, 2e-4)
    reduced = reduce(m, closed)
    assert reduced is not None
    found = rayleigh_modes(reduced, proportion(m))
    k, vectors = eigh(reduced.stiffness, reduced.mass)
    c = np.diag(vectors.T @ np.array(reduced.damping) @ vectors)
    assert sorted(found.k) == pytest.approx(k, rel=1e-9, abs=1e-9)
    assert sorted(found.c) == pytest.approx(sorted(c), rel=1e-10)


@pytest.mark.parametrize("entry", [(0, 0), (1, 2), (3, 3)])
def test_an_entry_of_another_kind_is_no_proportion(entry: tuple[int, int]) -> None:
    m = damped(1, 0.3, 2e-4)
    dashpots = np.array(m.damping)
    dashpots[entry] = dashpots[entry[::-1]] = dashpots[entry] * (1.0 + 1e-11)
    other = vi.Mechanism(
        mass=m.mass, damping=dashpots.tolist(), stiffness=m.stiffness, elements=m.rigid_stops
    )
    assert proportion(other) is None
    assert Hybrid(other).mixed
    assert not Hybrid(m).mixed


@pytest.mark.parametrize("matrix", ["mass", "stiffness"])
def test_stiffness_in_proportion_to_the_mass_or_none_is_damped_alike(matrix: str) -> None:
    m = damped(2, 0.0, 0.0)
    stiffness = 2.0 * np.array(m.mass) if matrix == "mass" else np.zeros((4, 4))
    alike = vi.Mechanism(
        mass=m.mass, damping=(0.2 * np.array(m.mass)).tolist(), stiffness=stiffness.tolist(),
        elements=m.rigid_stops,
    )  # fmt: skip
    assert proportion(alike) == pytest.approx((0.2, 0.0), rel=1e-15)


def test_a_mode_without_stiffness_keeps_its_speed_where_stiffness_damps() -> None:
    """c = 0 exactly, so that the block only drifts."""
    spring = np.array([[1.0, -1.0, 0.0], [-1.0, 2.0, -1.0], [0.0, -1.0, 1.0]])
    free = vi.Mechanism(
        mass=np.eye(3).tolist(), damping=(0.1 * spring).tolist(), stiffness=spring.tolist(),
        elements=tuple(vi.RigidStop(tuple(row), -9.0, 9.0) for row in np.eye(3)),
    )  # fmt: skip
    flow = compile_mechanism(free).free.flow
    assert [(k, c) for k, c in zip(flow["k"], flow["c"], strict=True) if k == 0.0] == [(0.0, 0.0)]


MANY = [seed for seed in range(60, 90) if len(heavy(seed)[0].rigid_stops) > 2]


@pytest.mark.parametrize("seed", MANY)
def test_motions_are_those_of_the_full_matrix(seed: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """Bouncing, at rest and after. Chatter may be summed an impact earlier in one of them."""
    mechanism, state = heavy(seed)
    monkeypatch.setattr(hybrid, "_compiled", hybrid._compiled.__wrapped__)
    monkeypatch.setattr(hybrid, "_hybrid", hybrid._hybrid.__wrapped__)
    assert not compile_mechanism(mechanism).dense
    run = vi.simulate(mechanism, state, impacts=30)
    monkeypatch.setattr(hybrid, "proportion", lambda _: None)
    monkeypatch.setattr(hybrid, "MOST_CONTACTS_ALL_BLOCKS", 0)
    assert compile_mechanism(mechanism).dense
    full = vi.simulate(mechanism, state, impacts=30)
    times = np.linspace(0.0, min(run.time[-1], full.time[-1]), 1000)[:-1]
    assert run.at(times)[0] == pytest.approx(full.at(times)[0], abs=1e-9)
