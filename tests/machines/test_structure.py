"""Structures against closed forms: chains, beams, matrices of finite elements."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.io import mmwrite
from scipy.linalg import eigh
from scipy.sparse import csr_matrix, save_npz

import vibroimpact as vi

pytestmark = pytest.mark.usefixtures("own_folder")
CANTILEVER = (1.8751040687119611, 4.694091132974175)  # cos x cosh x = -1


def finite_elements(count: int) -> tuple[Any, Any]:
    """A clamped beam, EI = rho A = length = 1, in cubic elements: (w, w') of each node but the first."""
    h = 1.0 / count
    k = np.array([[12, 6 * h, -12, 6 * h], [6 * h, 4 * h * h, -6 * h, 2 * h * h],
                  [-12, -6 * h, 12, -6 * h], [6 * h, 2 * h * h, -6 * h, 4 * h * h]]) / h**3  # fmt: skip
    m = np.array([[156, 22 * h, 54, -13 * h], [22 * h, 4 * h * h, 13 * h, -3 * h * h],
                  [54, 13 * h, 156, -22 * h], [-13 * h, -3 * h * h, -22 * h, 4 * h * h]]) * h / 420  # fmt: skip
    M, K = np.zeros((2, 2 * count + 2, 2 * count + 2))
    for i in range(count):
        at = slice(2 * i, 2 * i + 4)
        M[at, at] += m
        K[at, at] += k
    return M[2:, 2:], K[2:, 2:]


def frequencies(structure: vi.Structure) -> Any:
    return np.sqrt(eigh(np.array(structure.stiffness), np.array(structure.mass))[0])


def test_a_chain_of_equal_masses_has_the_frequencies_of_the_textbook() -> None:
    chain = vi.Structure.chain([2.0] * 5, [3.0] * 6)
    closed = 2.0 * math.sqrt(1.5) * np.sin(np.arange(1, 6) * math.pi / 12.0)
    np.testing.assert_allclose(frequencies(chain), closed, rtol=1e-13)


def test_a_chain_that_nothing_holds_has_a_rigid_motion_and_keeps_its_momentum() -> None:
    chain = vi.Structure.chain([1.0, 2.0, 3.0], [0.0, 1.0, 4.0], [0.0, 0.1, 0.2])
    for matrix in (chain.damping, chain.stiffness):
        np.testing.assert_allclose(np.array(matrix) @ np.ones(3), 0.0, atol=1e-15)
    stops = [vi.RigidStop(chain.row("x1-x2"), upper=0.1, restitution=0.5)]
    run = vi.simulate(
        chain.mechanism(stops), vi.State((0.0,) * 3, (1.0, 0.0, -0.5)), t_max=20.0, impacts=100
    )
    assert run.impacts.sum() > 1
    np.testing.assert_allclose(run.velocity_after @ (1.0, 2.0, 3.0), -0.5, atol=1e-13)


def test_a_row_between_two_places_is_their_difference() -> None:
    chain = vi.Structure.chain([1.0, 1.0, 1.0], [1.0, 1.0, 1.0])
    assert chain.row("x1", "x2") == chain.row("x1-x2") == (1.0, -1.0, 0.0)
    with pytest.raises(vi.InvalidParameterError, match="place = 'x9': must be one of x1, x2"):
        chain.row("x9")


def test_a_force_at_a_place_acts_by_the_shapes_there() -> None:
    shapes = {"tip": (2.0, -1.5), "middle": (0.7, 1.1)}
    beam = vi.Structure.of_modes([3.0, 18.0], shapes, zeta=(0.02, 0.03), masses=(1.5, 2.0))
    line = vi.Harmonic(2.0, (0.3,), (0.1,))
    machine = beam.mechanism(
        [vi.RigidStop(beam.row("tip"), upper=9.0)], forces={"middle": line, "tip": [line]},
        constant_force={"tip": 0.4},
    )  # fmt: skip
    both = np.array([2.7, -0.4])
    np.testing.assert_allclose(machine.forces[0].sine, 0.3 * both, rtol=1e-14)
    np.testing.assert_allclose(machine.forces[0].cosine, 0.1 * both, rtol=1e-14)
    np.testing.assert_allclose(machine.constant_force, (0.8, -0.6), rtol=1e-14)
    np.testing.assert_allclose(
        np.diag(beam.damping), (2 * 0.02 * 3 * 1.5, 2 * 0.03 * 18 * 2), rtol=1e-14
    )


def test_a_beam_of_finite_elements_has_the_frequencies_of_the_clamped_beam() -> None:
    """Frequencies of cubic elements are too high by (k h)^4 / 1440, here 2e-6; 15 modes add less."""
    beam = vi.Structure.of_matrices(*finite_elements(20), {"tip": 38}, modes=15)
    np.testing.assert_allclose(frequencies(beam)[:2], np.square(CANTILEVER), rtol=1e-5)


def test_a_reduction_is_exact_in_statics_and_approaches_the_frequencies_from_above() -> None:
    M, K = finite_elements(12)
    whole = np.sqrt(eigh(K, M)[0])
    places = {"tip": 22, "middle": 10}
    flexibility = np.linalg.inv(K)[np.ix_([22, 10], [22, 10])]
    former = np.full(3, np.inf)
    for modes in (1, 3, 6, 18):
        beam = vi.Structure.of_matrices(M, K, places, modes=modes)
        found = np.linalg.inv(np.array(beam.stiffness))[:2, :2]
        np.testing.assert_allclose(found, flexibility, rtol=1e-9)
        now = frequencies(beam)[:3]
        assert (now >= whole[:3] * (1.0 - 1e-9)).all()
        assert (now <= former * (1.0 + 1e-9)).all()
        former = now
    np.testing.assert_allclose(former, whole[:3], rtol=1e-6)


def test_a_damping_ratio_is_that_of_every_mode() -> None:
    beam = vi.Structure.of_matrices(*finite_elements(8), {"tip": 14}, modes=3, zeta=0.03)
    M, C, K = map(np.array, (beam.mass, beam.damping, beam.stiffness))
    n = len(M)
    A = np.block([[np.zeros((n, n)), np.eye(n)], [-np.linalg.solve(M, K), -np.linalg.solve(M, C)]])
    values = np.linalg.eigvals(A)
    np.testing.assert_allclose(-values.real / np.abs(values), 0.03, rtol=1e-7)


def test_matrices_come_from_files_dense_and_sparse() -> None:
    M, K = finite_elements(10)
    direct = vi.Structure.of_matrices(M, K, {"tip": 18}, modes=2)
    mmwrite("mass.mtx", csr_matrix(M))
    np.save("stiffness.npy", K)
    save_npz("sparse.npz", csr_matrix(K))
    places = {"tip": 18}
    for again in (
        vi.Structure.of_matrices(csr_matrix(M), csr_matrix(K), places, modes=2),
        vi.Structure.of_files("mass.mtx", Path("stiffness.npy"), places, modes=2),
        vi.Structure.of_files("mass.mtx", "sparse.npz", places, modes=2),
    ):
        np.testing.assert_allclose(again.stiffness, direct.stiffness, rtol=1e-7, atol=1e-7)
        np.testing.assert_allclose(again.mass, direct.mass, rtol=1e-7, atol=1e-9)
    with pytest.raises(
        vi.InvalidParameterError, match=r"mass = none\.mtx: must be a matrix in Matrix"
    ):
        vi.Structure.of_files("none.mtx", "stiffness.npy", places)
    with pytest.raises(
        vi.InvalidParameterError, match=r"mass = 'none\.txt': must be a file \.mtx, \.npy or \.npz"
    ):
        vi.Structure.of_files("none.txt", "stiffness.npy", places)


def test_a_beam_that_hits_a_stop_conserves_its_energy() -> None:
    beam = vi.Structure.of_matrices(*finite_elements(10), {"tip": 18}, modes=3)
    machine = beam.mechanism([vi.RigidStop(beam.row("tip"), upper=0.05)])
    run = vi.simulate(machine, vi.State((0.0,) * 4, (0.4, 0.0, 0.0, 0.0)), t_max=6.0, impacts=1000)
    assert run.impacts.sum() > 3
    x, v = run.position, run.velocity_after
    energy = np.einsum("ei,ij,ej->e", v, np.array(beam.mass), v)
    energy += np.einsum("ei,ij,ej->e", x, np.array(beam.stiffness), x)
    np.testing.assert_allclose(energy, energy[0], rtol=1e-11)


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: vi.Structure.chain([1.0, 1.0], [1.0]), "stiffnesses: 1 are given; must be 2 or 3"),
        (lambda: vi.Structure.chain([1.0], [1.0], [1.0, 2.0]), "dampings: 2 are given"),
        (lambda: vi.Structure.of_modes([-1.0], {}), "frequencies = -1.0: must be >= 0"),
        (lambda: vi.Structure.of_modes([1.0], {}, zeta=-0.1), r"zeta = -0.1: must be >= 0"),
        (lambda: vi.Structure.of_modes([1.0], {"tip": (1.0, 2.0)}), r"places\['tip'\] has shape"),
        (lambda: vi.Structure.of_matrices(np.eye(3), np.eye(2), {"tip": 0}), "expected"),
        (lambda: vi.Structure.of_matrices(np.eye(3), np.eye(3), {}), "places = {}: must be one"),
        (lambda: vi.Structure.of_matrices(np.eye(3), np.eye(3), {"tip": 3}), r"places\['tip'\] = 3"),
        (lambda: vi.Structure.of_matrices(np.eye(3), np.eye(3), {"tip": 0}, modes=3), "modes = 3"),
    ],
)  # fmt: skip
def test_a_structure_that_is_none_is_refused(call: Any, message: str) -> None:
    with pytest.raises(vi.InvalidParameterError, match=message):
        call()
