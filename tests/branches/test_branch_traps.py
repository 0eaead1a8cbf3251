"""Systems that once gave wrong multipliers or special points along branches."""

from __future__ import annotations

import math
from typing import Any, cast

import numpy as np
import pytest
from numpy.typing import NDArray

import vibroimpact as vi
from vibroimpact.branches.beginning import single_tangent
from vibroimpact.continuation import Stopped


def one_mass(
    *, force: float = 2.0, omega: float = 1.0, restitution: float = 0.7, damping: float = 0.1,
    stiffness: float = 1.0, stops: tuple[vi.RigidStop, ...] = (), **stop: float,
) -> vi.Mechanism:  # fmt: skip
    contacts = stops or (vi.RigidStop((1.0,), restitution=restitution, **stop),)
    return vi.Mechanism(
        mass=[[1.0]],
        damping=[[damping]],
        stiffness=[[stiffness]],
        forces=(vi.Harmonic(omega, (force,)),),
        elements=contacts,
    )


def two_masses(row: float = 0.6, length: float = 1.0, time: float = 1.0) -> vi.Mechanism:
    """One machine in other units of length and time."""
    per_time, force = 1.0 / time, length / time**2
    return vi.Mechanism(
        mass=[[1.0, 0.1], [0.1, 0.7]],
        damping=[[0.08 * per_time, -0.03 * per_time], [-0.03 * per_time, 0.06 * per_time]],
        stiffness=[
            [2.0 * per_time**2, -0.7 * per_time**2],
            [-0.7 * per_time**2, 1.4 * per_time**2],
        ],
        forces=(vi.Harmonic(1.1 * per_time, (force, 0.4 * force)),),
        elements=(vi.RigidStop((row, -1.3), upper=0.3 * length, restitution=0.75),),
    )


def test_multipliers_follow_a_contact_whose_row_is_the_parameter() -> None:
    system = vi.Family(two_masses, row=0.6)
    orbit = vi.find_orbit(system, vi.State((0.0, 0.0), (0.0, 0.0)))
    branch = vi.continue_orbit(orbit, "row", (0.4, 0.8))
    for i in range(0, len(branch), 12):
        row = float(branch.values[i])
        alone = vi.find_orbit(vi.Family(two_masses, row=row), branch.orbit(i))
        np.testing.assert_allclose(branch.multipliers[i], alone.multipliers, rtol=1e-8)
        watched = branch.family.watch(branch.curve.z[i : i + 1], np.array([row]))
        nearest = float(np.abs(alone.multipliers + 1.0).min())
        # the flip function is the product of 1 + mu over all multipliers, up to its saturation
        assert (watched["flip"][0] == 0.0) == (nearest == 0.0)
    for point in branch.special_points:
        if point.kind == "PD":
            assert np.abs(point.multipliers + 1.0).min() < 1e-7
        if point.kind == "NS":
            assert np.abs(np.abs(point.multipliers) - 1.0).min() < 1e-7


@pytest.mark.slow
def test_a_plastic_orbit_is_one_orbit_and_can_be_followed() -> None:
    # its velocity after the impact is zero: the scale of velocities comes from length and time
    system = one_mass(omega=2.2, restitution=0.0, lower=-0.2)
    search = vi.find_orbits(system, most_cycles=3, most_impacts=3, starts=5)
    assert [orbit.symbol for orbit in search.orbits] == ["1-0-1"]
    branch = vi.continue_orbit(search.orbits[0], "forces[0].sine[0]", (0.5, 4.0), inadmissible=True)
    assert branch.values.max() == 4.0
    kinds = [point.kind for point in branch.special_points]
    assert {"SN", "PD"} <= set(kinds)


@pytest.mark.parametrize(("length", "time"), [(1e6, 1.0), (1e-6, 1.0), (1.0, 1e-6), (1e-9, 1e-9)])
def test_orbits_and_multipliers_do_not_depend_on_units(length: float, time: float) -> None:
    here, there = two_masses(), two_masses(length=length, time=time)
    start = vi.State((0.0, 0.0), (0.0, 0.0))
    first, second = vi.find_orbit(here, start), vi.find_orbit(there, start)
    assert first.converged
    assert second.converged
    assert first.symbol == second.symbol
    np.testing.assert_allclose(second.period / time, first.period, rtol=1e-12)
    np.testing.assert_allclose(
        np.sort(np.abs(second.multipliers)), np.sort(np.abs(first.multipliers)), rtol=1e-8
    )
    assert second.determinant_error < 1e-9


@pytest.mark.slow
def test_without_loss_no_torus_is_invented() -> None:
    # mu and 1 / mu: the product over pairs vanishes identically
    system = vi.Mechanism(
        mass=[[1.0]],
        damping=[[0.0]],
        stiffness=[[0.3]],
        forces=(vi.Harmonic(1.0, (0.5,), (0.2,)),),
        elements=(vi.RigidStop((1.0,), upper=1.0, restitution=1.0),),
    )
    orbit = vi.find_orbits(system, most_cycles=2, most_impacts=3, starts=10).orbits[0]
    branch = vi.continue_orbit(orbit, "stiffness[0][0]", (0.29, 0.31))
    assert [p for p in branch.special_points if p.kind == "NS"] == []
    assert {note.name for note in branch.curve.unresolved} == {"torus"}
    assert not branch.stable.any()


@pytest.mark.slow
def test_every_stop_that_is_grazed_is_reported() -> None:
    # x swings between the stops; both lower ones are touched, at different amplitudes
    stops = (
        vi.RigidStop((1.0,), upper=1.0, restitution=0.7),
        vi.RigidStop((1.0,), lower=-9.0),
        vi.RigidStop((2.0,), lower=-19.0),
    )
    system = one_mass(force=1.0, stops=stops)
    orbit = vi.find_orbit(system, vi.State((0.0,), (1.0,)))
    branch = vi.continue_orbit(orbit, "forces[0].sine[0]", (0.5, 12.0), inadmissible=True)
    touched = [(p.nearest.contact, p.nearest.side) for p in branch.special_points if p.nearest]
    assert touched == [(1, -1), (2, -1)]


def test_a_range_beyond_what_a_parameter_may_be_keeps_what_was_found() -> None:
    damper = vi.ImpactDamper(
        mass_ratio=0.1, omega_n=0.5, zeta=0.045, restitution=0.8, half_clearance=5.0, omega=1.2
    )
    branch = vi.continue_orbit(vi.symmetric_orbits(damper)[0], "restitution", (0.75, 1.2))
    assert branch.values.max() > 0.99
    assert "must be in [0, 1]" in str(branch.curve.ends)


@pytest.mark.slow
def test_the_error_of_a_birth_on_the_branch_that_is_born_holds() -> None:
    damper = vi.ImpactDamper(
        mass_ratio=0.1, omega_n=0.5, zeta=0.045, restitution=0.8, half_clearance=5.0, omega=0.72
    )
    parent = vi.continue_orbit(vi.symmetric_orbits(damper)[0], "omega", (0.7, 0.73))
    born = vi.switch_branch(parent["BP1"], (0.7, 0.73))
    assert isinstance(born, vi.Branch)
    off = abs(born["BP1"].parameter - parent["BP1"].parameter)
    assert off <= max(10.0 * born["BP1"].error, 4.0 * math.ulp(1.0))
    assert off < 1e-10


def meeting(omega: float, k2: float) -> vi.Mechanism:
    """Two masses; two contacts whose impacts can come to coincide."""
    return vi.Mechanism(
        mass=[[1.0, 0.0], [0.0, 0.5]],
        damping=[[0.1, -0.03], [-0.03, 0.05]],
        stiffness=[[1.0 + k2, -k2], [-k2, k2]],
        forces=(vi.Harmonic(omega, (1.0, 0.0)),),
        elements=(
            vi.RigidStop((1.0, 0.0), upper=0.5, restitution=0.7),
            vi.RigidStop((-1.0, 1.0), lower=-0.4, upper=0.4, restitution=0.6),
        ),
    )


@pytest.mark.slow
def test_where_two_impacts_coincide_the_branch_says_so_and_ends_soon() -> None:
    system = vi.Family(meeting, omega=1.3, k2=1.0)
    found = vi.find_orbits(system, most_cycles=1, most_impacts=3, starts=10).orbits
    one_of_each = {orbit.signature: orbit for orbit in found}
    triple = [orbit for orbit in one_of_each.values() if len(orbit.signature.impacts) == 3]
    assert len(triple) == 3
    for orbit in triple:
        apart = orbit.durations.min() > 1e-9  # else two coincide all along, at no point
        branch = vi.continue_orbit(orbit, "omega", (1.18, 1.38) if apart else (1.28, 1.32))
        points = [point for point in branch.special_points if point.kind == "SIM"]
        assert bool(points) == apart
        for point in points:
            assert abs(point.orbit.durations[point.segment]) < 1e-9
        backwards = [i for i in range(len(branch)) if branch.orbit(i).durations.min() < -1e-9]
        assert not branch.admissible[backwards].any()


@pytest.mark.slow
def test_a_doubled_branch_begun_beside_its_birth_meets_it() -> None:
    # Begun 0.02 from the birth with a first step of 0.02, whose end is a singular point.
    m = one_mass(force=1.0, omega=0.66, restitution=0.8, damping=0.04, upper=1.26)
    orbit = vi.find_orbit(m, vi.State((1.26,), (-1.5,)))
    branch = vi.continue_orbit(orbit, "omega", (0.55, 0.67), steps=vi.Steps(first=0.02, points=60))
    (doubling,) = (point for point in branch.special_points if point.kind == "PD")
    found = vi.switch_branch(doubling, steps=vi.Steps(first=0.02, largest=0.5, points=84))
    assert isinstance(found, vi.Branch)
    births = [p.parameter for p in found.special_points if p.kind == "BP"]
    assert births == pytest.approx([doubling.parameter], abs=1e-9)
    # Beyond it come the same orbits, begun two impacts later.
    assert Stopped.REPEATED in [end.reason for end in found.curve.ends]
    assert found.curve.rejected <= 6
    assert not found.curve.unresolved


def test_equations_that_nothing_changes_have_no_single_tangent() -> None:
    """As of a ball that rests anywhere in its slot: a row of zeros, which has no direction."""

    class Resting:
        def scale(self) -> NDArray[np.float64]:
            return np.ones(3)

        def jacobian(
            self, _z: object, _p: float
        ) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
            return np.array([[1.0, 2.0], [0.0, 0.0]]), np.array([0.5, 0.0])

    assert single_tangent(cast(Any, Resting()), np.zeros(2), 0.0) is None
