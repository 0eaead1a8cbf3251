"""Symmetries of machines: found, true of motions, and orbits that are solved by half under them."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import vibroimpact as vi

HIT = vi.State((0.0, 0.0), (0.5, -0.5))


def around(centre: float, omega: float = 0.8) -> vi.Mechanism:
    """A mass between stops on both sides of a centre, to which a constant force holds it."""
    stiffness = 1.0
    return vi.Mechanism(
        mass=[[1.0]], damping=[[0.1]], stiffness=[[stiffness]], constant_force=(stiffness * centre,),
        forces=(vi.Harmonic(omega, (1.0,)),),
        elements=(vi.RigidStop((1.0,), centre - 0.5, centre + 0.5, restitution=0.7),),
    )  # fmt: skip


def pair(coupling: float, omega: float = 0.9) -> vi.Mechanism:
    """Two equal masses with the same force, one with a stop above, one with a stop below."""
    k = 1.0 + coupling
    return vi.Mechanism(
        mass=np.eye(2), damping=0.2 * np.eye(2), stiffness=[[k, -coupling], [-coupling, k]],
        forces=(vi.Harmonic(omega, (1.0, 1.0)),),
        elements=(
            vi.RigidStop((1.0, 0.0), upper=0.5, restitution=0.7),
            vi.RigidStop((0.0, 1.0), lower=-0.5, restitution=0.7),
        ),
    )  # fmt: skip


def ring(rigid: bool) -> vi.Mechanism:
    """Three equal masses in a ring, forced one after the other, each before a stop that moves with its force."""
    third = 2.0 * math.pi / 3.0
    sine, cosine = ([f(third * i) for i in range(3)] for f in (math.cos, math.sin))
    rows = [tuple(float(i == j) for j in range(3)) for i in range(3)]

    def stop(i: int) -> vi.RigidStop | vi.SoftStop:
        motion = vi.Harmonic(0.9, (0.1 * sine[i],), (0.1 * cosine[i],))
        if rigid:
            return vi.RigidStop(rows[i], upper=0.3, restitution=0.7, motion=motion)
        return vi.SoftStop(rows[i], upper=0.3, stiffness=9.0, damping=0.3, motion=motion)

    return vi.Mechanism(
        mass=np.eye(3), damping=0.1 * np.eye(3), stiffness=2.5 * np.eye(3) - 0.5,
        forces=(vi.Harmonic(0.9, tuple(sine), tuple(cosine)),), elements=tuple(map(stop, range(3))),
    )  # fmt: skip


def rubbing() -> vi.Mechanism:
    """A mass with friction on a belt, another one on a belt that runs the other way."""
    return vi.Mechanism(
        mass=np.eye(2), damping=0.1 * np.eye(2), stiffness=[[2.0, -1.0], [-1.0, 2.0]],
        forces=(vi.Harmonic(0.7, (0.8, 0.8)),),
        elements=(
            vi.Friction((1.0, 0.0), 0.2, belt_speed=0.3), vi.Friction((0.0, 1.0), 0.2, belt_speed=-0.3),
        ),
    )  # fmt: skip


def before_swinging_stops(*motions: tuple[float, ...]) -> vi.Mechanism:
    """Two equal masses with the same force, each before a stop that moves by a sum of lines of one frequency."""
    stops = (
        vi.RigidStop(
            row, upper=0.3, restitution=0.7, motion=tuple(vi.Harmonic(0.9, (a,)) for a in sines)
        )
        for row, sines in zip(((1.0, 0.0), (0.0, 1.0)), motions, strict=True)
    )
    return replace(pair(0.5), elements=tuple(stops))


MACHINES = {
    "another centre": (around(0.25), ["(x1) -> (-x1 + 0.5), 1 pi later"]),
    "exchange": (pair(0.5), ["(x1, x2) -> (-x2, -x1), 1 pi later"]),
    "ring of rigid stops": (
        ring(rigid=True),
        [
            "(x1, x2, x3) -> (x2, x3, x1), 0.666666667 pi later",
            "(x1, x2, x3) -> (x3, x1, x2), 1.33333333 pi later",
        ],
    ),
    "ring of soft stops": (ring(rigid=False), None),
    "belts": (rubbing(), ["(x1, x2) -> (-x2, -x1), 1 pi later"]),
    "motions with one sum": (
        before_swinging_stops((0.0625, 0.125), (0.1875,)),
        ["(x1, x2) -> (x2, x1)"],
    ),
    "motions with one line alike": (before_swinging_stops((0.05, 0.2), (0.1, 0.2)), []),
    "no pair": (replace(pair(0.5), damping=np.diag([0.2, 0.3])), []),
}


@pytest.mark.parametrize("name", MACHINES)
def test_images_of_motions_under_the_symmetries_that_are_found_are_motions(name: str) -> None:
    m, wanted = MACHINES[name]
    found = vi.symmetries(m)
    if wanted is not None:
        assert [str(symmetry) for symmetry in found] == wanted
    n = m.degrees
    start = vi.State((0.1, -0.2, 0.15)[:n], (0.7, 0.4, -0.5)[:n], 0.2)
    run = vi.simulate(m, start, t_max=30.0)
    for symmetry in found:
        (row,) = symmetry.image(np.array([[*start.position, *start.velocity, 0.2]]), symmetry.turn)
        image = vi.simulate(m, vi.State(tuple(row[:n]), tuple(row[n:-1]), row[-1]), t_max=30.0)
        assert len(run) > 5
        np.testing.assert_allclose(image.time, run.time, atol=1e-9)
        there = np.column_stack([run.position, run.velocity_after, np.zeros(len(run))])
        np.testing.assert_allclose(
            np.column_stack([image.position, image.velocity_after]),
            symmetry.image(there, 0.0)[:, :-1],
            atol=1e-8,
        )


def test_an_orbit_between_stops_about_another_centre_is_that_about_zero_displaced() -> None:
    start = vi.State((0.0,), (0.5,))
    zero = vi.find_orbit(around(0.0), start)
    moved = vi.find_orbit(around(2.0), vi.State((2.0,), (0.5,)))
    assert zero.symmetric
    assert moved.symmetric
    np.testing.assert_allclose(moved.states, zero.states + np.array([2.0, 0.0, 0.0]), atol=1e-12)
    np.testing.assert_allclose(moved.half_multipliers, zero.half_multipliers, atol=1e-11)
    branches = [
        vi.continue_orbit(orbit, "omega", (0.78, 0.82), steps=vi.Steps(first=0.5, largest=1.0))
        for orbit in (zero, moved)
    ]
    one, other = ([(p.label, p.parameter) for p in b.special_points] for b in branches)
    assert [label for label, _ in one] == [label for label, _ in other]
    np.testing.assert_allclose([p for _, p in one], [p for _, p in other], atol=1e-10)
    with pytest.raises(vi.InvalidParameterError, match="breaks the symmetry"):
        vi.continue_orbit(moved, "elements[0].upper", (2.4, 2.6))


def by_parts(values: np.ndarray) -> np.ndarray:
    """Complex numbers by their real parts, but for rounding, and then by their imaginary parts."""
    return values[np.lexsort((values.imag, values.real.round(9)))]


def test_an_orbit_of_two_equal_masses_is_solved_by_half() -> None:
    """Its half multipliers squared are those of the whole, and of one mass alone where nothing couples them."""
    for coupling in (0.0, 0.5):
        m = pair(coupling)
        half = vi.find_orbit(m, HIT)
        whole = vi.find_orbit(m, HIT, symmetric=False)
        assert half.symmetric
        assert len(half.durations) * 2 == len(whole.durations)
        assert half.signature.exchange == (-2, -1)
        np.testing.assert_allclose(
            by_parts(half.multipliers), by_parts(whole.multipliers), atol=1e-9
        )
        assert vi.find_orbit(m, whole, symmetric=vi.symmetries(m)[0]).symmetric
    alone = vi.Mechanism(
        mass=[[1.0]], damping=[[0.2]], stiffness=[[1.0]], forces=(vi.Harmonic(0.9, (1.0,)),),
        elements=(vi.RigidStop((1.0,), upper=0.5, restitution=0.7),),
    )  # fmt: skip
    one = vi.find_orbit(alone, vi.State((0.0,), (0.5,)))
    both = vi.find_orbit(pair(0.0), HIT)
    wanted = np.sqrt(one.multipliers.astype(complex))
    assert np.allclose(
        sorted(np.abs(both.half_multipliers)), sorted(np.abs([*wanted, *-wanted])), atol=1e-9
    )
    first = both.half_multipliers[:, None] - np.array([*wanted, *-wanted])[None]
    assert np.abs(first).min(axis=1).max() < 1e-9


def test_maps_and_files_of_orbits_by_half_know_the_symmetry(tmp_path: Path) -> None:
    orbit = vi.find_orbit(pair(0.5), HIT)
    solved, whole = vi.half_map(orbit), vi.full_map(orbit)
    values = np.linalg.eigvals(solved.jacobian()) ** 2
    np.testing.assert_allclose(np.poly(values), np.poly(whole.jacobian()), atol=1e-9)
    branch = vi.continue_orbit(orbit, "omega", (0.88, 0.91), steps=vi.Steps(first=0.5, largest=1.0))
    assert branch.orbit(-1).symmetric
    assert branch.admissible.all()
    vi.save(branch, tmp_path / "branch.nc")
    again = vi.load(tmp_path / "branch.nc")
    assert again.family.signature == branch.family.signature
    np.testing.assert_array_equal(again.orbit(-1).multipliers, branch.orbit(-1).multipliers)


def test_what_is_no_symmetry_of_the_sequence_is_refused() -> None:
    other = vi.symmetries(pair(0.5))[0]
    with pytest.raises(vi.InvalidParameterError, match="not symmetric"):
        vi.find_orbit(
            around(2.0), vi.find_orbit(around(2.0), vi.State((2.0,), (0.5,))), symmetric=other
        )


def test_a_half_orbit_at_stops_that_move_has_the_multipliers_of_their_own_coordinates() -> None:
    """Half of the cycles later the stop moves the other way, and so does the section."""
    machine = vi.ImpactDamper(
        mass_ratio=0.04, omega_n=0.6, zeta=0.025, restitution=0.7, half_clearance=9.8, omega=0.995
    )
    damper, guess = machine.mechanism, vi.symmetric_orbits(machine)[0]
    stop, line, added = damper.rigid_stops[0], damper.forces[0], 0.04 * damper.omega**2
    moving = damper.replace(elements=(replace(stop, motion=vi.Harmonic(0.995, (0.04,), (0.1,))),))
    force = vi.Harmonic(0.995, (line.sine[0], 0.04 * added), (line.cosine[0], 0.1 * added))
    found = [vi.find_orbit(m, guess) for m in (moving, damper.replace(forces=(force,)))]
    assert all(orbit.symmetric for orbit in found)
    # characteristic polynomials: the two of a pair may come in either order
    one, other = (np.poly(orbit.half_multipliers) for orbit in found)
    np.testing.assert_allclose(one, other, rtol=1e-9)
    np.testing.assert_allclose(one, np.poly(vi.half_map(found[0]).jacobian()), rtol=1e-9)
