"""Translations: which displacements a machine does not notice."""

from __future__ import annotations

import numpy as np
import pytest

import vibroimpact as vi
from vibroimpact.model.translations import translations_of

PAIR = [[1.0, -1.0], [-1.0, 1.0]]


def machine(stiffness, *elements, **more):
    n = len(stiffness)
    return vi.Mechanism(
        mass=np.eye(n), damping=np.eye(n), stiffness=stiffness, elements=elements, **more
    )


def test_bodies_held_by_each_other_alone_move_as_one():
    capsule = machine(PAIR, vi.SoftStop((1.0, -1.0), upper=0.1), vi.Friction((0.0, 1.0), 0.3))
    found = translations_of(capsule)
    assert found.references == (1,)
    assert np.allclose(found.directions, [[1.0], [1.0]], rtol=0.0, atol=1e-15)
    moved = found.removed(np.array([[5.0, 3.0], [7.5, 5.5]]))
    assert np.allclose(moved, [[2.0, 0.0], [2.0, 0.0]], rtol=0.0, atol=1e-14)


def test_a_lever_moves_in_its_own_ratio():
    # K d = 0 for d = (2, 1): a spring that acts on x1 - 2 x2.
    row = np.array([1.0, -2.0])
    found = translations_of(machine(np.outer(row, row), vi.Friction((1.0, 0.0), 0.3)))
    assert np.allclose(found.directions, [[2.0], [1.0]], rtol=0.0, atol=1e-14)


def test_two_bodies_that_only_rub_move_by_themselves():
    found = translations_of(machine(np.zeros((2, 2)), vi.Friction((1.0, -1.0), 0.3)))
    assert np.array_equal(found.directions[list(found.references)], np.eye(2))


@pytest.mark.parametrize(
    "element",
    [
        vi.RigidStop((1.0, 0.0), upper=1.0),
        vi.SoftStop((0.0, 1.0), lower=-1.0),
        vi.Friction((1.0, 0.0), 0.1, load=vi.NormalLoad(1.0, position=(0.0, 0.2))),
    ],
    ids=["rigid stop", "soft stop", "normal load"],
)
def test_what_sees_the_ground_leaves_no_translation(element):
    assert translations_of(machine(PAIR, element)).references == ()


def test_a_spring_to_the_ground_leaves_none_and_changes_no_bit():
    held = translations_of(machine([[1.0, -1.0], [-1.0, 1.0 + 1e-6]], vi.Friction((1.0, 0.0), 0.1)))
    position = np.array([[0.1, 0.3]])
    assert held.references == ()
    assert held.removed(position) is position


@pytest.mark.parametrize("unit", [1.0, 1e-7, 1e7])
def test_springs_hold_a_coordinate_in_whatever_unit_it_is_counted(unit: float) -> None:
    """A torsion spring of 1e-13 beside a linear one of 1: both hold, whatever the units."""
    held = vi.Mechanism(
        mass=np.diag([1.0, unit**2]), damping=np.zeros((2, 2)), stiffness=np.diag([1.0, unit**2]),
        elements=(vi.RigidStop((1.0, 0.0), upper=0.4),),
    )  # fmt: skip
    assert translations_of(held).references == ()
    k = np.array([[1.0, -unit], [-unit, unit**2]])  # the second body counted in another unit
    loose = vi.Mechanism(
        mass=np.diag([1.0, unit**2]), damping=np.zeros((2, 2)), stiffness=k,
        elements=(vi.Friction((1.0, 0.0), 0.1),),
    )  # fmt: skip
    (direction,) = translations_of(loose).directions.T
    np.testing.assert_allclose(direction, [unit, 1.0], rtol=1e-12)
