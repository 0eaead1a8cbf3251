"""The centre manifold in the unknowns of the equations, against that of the map and differences."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import vibroimpact as vi
from vibroimpact.bifurcations.unfold import Centre, centre

PLANE = ("omega", "half_clearance")


@pytest.fixture(scope="module")
def point() -> vi.BifurcationPoint:
    """A resonance 1/5 of the damper, whose half map has five impacts a turn."""
    damper = vi.ImpactDamper(
        mass_ratio=0.04, omega_n=0.6, zeta=0.025, restitution=0.7, half_clearance=9.8, omega=1.0
    )
    branch = vi.continue_orbit(vi.symmetric_orbits(damper)[0], "omega", (0.98, 1.02))
    return vi.continue_bifurcation(branch["NS1"], PLANE, ((0.98, 1.01), (9.5, 10.2)))["1/5_1"]


@pytest.fixture(scope="module")
def manifold(point: vi.BifurcationPoint) -> Centre:
    z, _, a = point.problem.parts(point.z, point.parameters["half_clearance"])
    return centre(point.problem.equations, z, a, complex(np.exp(2j * np.pi / 5)))


@pytest.mark.slow
def test_its_terms_are_those_of_the_map_on_the_section(
    point: vi.BifurcationPoint, manifold: Centre
) -> None:
    equations = point.problem.equations
    form = vi.normal_form("NS", equations.forms(manifold.z, manifold.a), unfolded=False)
    assert isinstance(form, vi.normal_forms.NeimarkSacker)
    for mine, theirs in ((manifold.v, form.q), (manifold.h20, form.h20), (manifold.h11, form.h11)):
        # rounding times the conditions of L(nu^2) and L(1), some hundreds
        np.testing.assert_allclose(equations.on_section(mine), theirs, rtol=0.0, atol=1e-12)


def test_the_multiplier_and_the_orbit_move_as_differences_say(
    point: vi.BifurcationPoint, manifold: Centre
) -> None:
    h = 1e-5  # second derivatives of size one to a hundred: errors of h^2 times these
    for k, name in enumerate(PLANE):
        nus, orbits = [], []
        for step in (h, -h):
            value = point.parameters[name] + step
            system = replace(point.orbit.system, **{name: value})
            guess = vi.Guess(point.orbit.states, point.orbit.durations)
            orbit = vi.find_orbit(
                system, guess, stops=point.orbit.signature.impacts, cycles=1, symmetric=True
            )
            nus.append(min(orbit.half_multipliers, key=lambda nu: abs(nu - manifold.nu)))
            orbits.append(orbit.problem.packed(orbit.states, orbit.durations))
        assert (nus[0] - nus[1]) / (2 * h) == pytest.approx(manifold.slopes[k], rel=1e-6)
        moved = (orbits[0] - orbits[1]) / (2 * h)
        np.testing.assert_allclose(manifold.drift[:, k], moved, rtol=1e-5, atol=1e-6)


def test_a_change_of_the_multiplier_gives_the_change_of_the_parameters(manifold: Centre) -> None:
    change = 1e-4 * (0.3 - 0.8j)
    da = manifold.offset(change)
    assert complex(manifold.slopes @ da) / manifold.nu == pytest.approx(change, rel=1e-12)
