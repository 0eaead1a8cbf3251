"""Masses that are pressed against stops and rub on each other: against every combination of states."""

from __future__ import annotations

import itertools
from dataclasses import dataclass

import numpy as np
import pytest

import vibroimpact as vi
from vibroimpact._core.types import Floats

SMALL = 1e-12  # of forces of order one
SOON = 1e-3


@dataclass(frozen=True)
class Squeeze:
    """Masses at rest on stops, on the ground and on each other, under constant forces."""

    masses: Floats
    stops: list[Floats]  # rows, at their stops
    sides: list[int]
    joints: list[Floats]
    levels: Floats
    force: Floats

    def accelerations(self) -> list[Floats]:
        """Those of every combination of states that is consistent with its forces."""
        found = []
        for closed in itertools.product((False, True), repeat=len(self.stops)):
            for slips in itertools.product((0, 1, -1), repeat=len(self.joints)):
                a = self._acceleration(closed, slips)
                if a is not None:
                    found.append(a)
        return found

    def _acceleration(self, closed: tuple[bool, ...], slips: tuple[int, ...]) -> Floats | None:
        """Of one combination; None where its constraints repeat each other, or it cannot last."""
        held = [row for row, is_closed in zip(self.stops, closed, strict=True) if is_closed]
        held += [row for row, slip in zip(self.joints, slips, strict=True) if slip == 0]
        pull = self.force - sum(
            (s * f * row for s, f, row in zip(slips, self.levels, self.joints, strict=True)),
            np.zeros_like(self.force),
        )
        rows = np.array(held).reshape(len(held), len(self.force))
        mobility = rows / self.masses @ rows.T
        if np.linalg.matrix_rank(mobility, tol=1e-10) < len(held):
            return None
        forces = -np.linalg.solve(mobility, rows @ (pull / self.masses)) if held else np.zeros(0)
        a: Floats = (pull + rows.T @ forces) / self.masses
        of = iter(forces)
        for row, side, is_closed in zip(self.stops, self.sides, closed, strict=True):
            outside = side * next(of) if is_closed else side * (row @ a)
            if outside > SMALL:
                return None
        for row, level, slip in zip(self.joints, self.levels, slips, strict=True):
            outside = abs(next(of)) - level if slip == 0 else -slip * (row @ a)
            if outside > SMALL:
                return None
        return a

    def machine(self) -> vi.Mechanism:
        n = len(self.masses)
        stops = [
            vi.RigidStop(tuple(row), **{"upper" if side > 0 else "lower": 0.0}, restitution=0.5)
            for row, side in zip(self.stops, self.sides, strict=True)
        ]
        joints = [
            vi.Friction(tuple(r), float(f)) for r, f in zip(self.joints, self.levels, strict=True)
        ]
        return vi.Mechanism(
            mass=np.diag(self.masses), damping=np.zeros((n, n)), stiffness=np.zeros((n, n)),
            constant_force=tuple(self.force), elements=(*stops, *joints),
        )  # fmt: skip


def drawn(seed: int) -> Squeeze:
    """Up to three masses; stops and joints on each, and between each two."""
    rng = np.random.default_rng(seed)
    n = int(rng.integers(1, 4))
    masses, one = rng.uniform(0.5, 2.0, n), np.eye(n)
    rows = [*one, *(one[i] - one[j] for i, j in itertools.combinations(range(n), 2))]

    def some() -> list[Floats]:
        count = rng.integers(1, min(3, len(rows)) + 1)
        return [rows[k] for k in rng.permutation(len(rows))[:count]]

    stops = some()
    sides = [int(rng.choice([-1, 1])) for _ in stops]
    joints = some()
    return Squeeze(
        masses, stops, sides, joints, rng.uniform(0.1, 1.0, len(joints)), 1.5 * rng.normal(size=n)
    )


@pytest.mark.parametrize("first", range(0, 60, 20))
def test_squeezed_masses_move_as_the_only_consistent_combination_says(first: int) -> None:
    for seed in range(first, first + 20):
        check(seed)


@pytest.mark.parametrize("seed", [76, 709])
def test_a_contact_that_friction_has_held_is_decided_anew_when_that_slips(seed: int) -> None:
    check(seed)


def check(seed: int) -> None:
    """Accelerations are unique: they minimise a convex function of theirs [moreau1988]."""
    squeeze = drawn(seed)
    wanted, *others = squeeze.accelerations()
    for other in others:
        np.testing.assert_allclose(other, wanted, atol=1e-9)
    n = len(squeeze.masses)
    run = vi.simulate(squeeze.machine(), vi.State((0.0,) * n, (0.0,) * n), t_max=SOON)
    assert run.end is vi.RunEnd.HORIZON, seed
    np.testing.assert_allclose(
        np.array(run.last.velocity) / SOON, wanted, atol=1e-11, err_msg=str(seed)
    )
    np.testing.assert_allclose(run.last.position, wanted * SOON**2 / 2.0, atol=1e-16)
