"""Closed-form symmetric orbits against 50-digit references, their conditions and identities."""

from __future__ import annotations

import math
import tomllib
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from support.systems import DAMPER_PARAMETERS

import vibroimpact as vi
from vibroimpact.machines.published import parameter_sets

REFERENCE = Path(__file__).parents[1] / "reference"
ORBITS = tomllib.loads((REFERENCE / "orbits.toml").read_text())["orbit"]
RANGES = {"A": (0.6, 1.4), "B": (0.6, 1.3), "C": (0.3, 1.0)}


def damper_of(name: str, omega: float) -> vi.ImpactDamper:
    """A parameter set of the paper at one frequency."""
    return parameter_sets()[name].damper(omega)


def sorted_multipliers(values: Any) -> np.ndarray:
    """By modulus, then imaginary part: an order both sides share."""
    z = np.asarray(values, dtype=complex)
    return z[np.lexsort((z.imag.round(9), np.abs(z).round(9)))]


@pytest.mark.parametrize("entry", ORBITS, ids=lambda e: f"{e['set']}-{e['omega']}-{e['sign']:+d}")
def test_orbit_and_multipliers_equal_the_50_digit_reference(entry: dict[str, Any]) -> None:
    found = vi.symmetric_orbits(damper_of(entry["set"], float(entry["omega"])))
    assert bool(found) == entry["exists"]
    if not found:
        return
    orbit = found[(1, -1).index(entry["sign"])]
    x1, v1, x2, v2, s, c = map(float, entry["state"])
    # a 4 x 4 solve of condition below 100: some hundred ulp of the largest coordinate
    exact = [x1, x2, v1, v2, s, c]
    here = [
        *orbit.state.position,
        *orbit.state.velocity,
        math.sin(orbit.state.phase),
        math.cos(orbit.state.phase),
    ]
    np.testing.assert_allclose(here, exact, rtol=0.0, atol=1e-13 * max(map(abs, exact)))
    nus = np.array(entry["nu_real"], float) + 1j * np.array(entry["nu_imag"], float)
    # simple eigenvalues of a matrix of norm up to 1e2
    np.testing.assert_allclose(
        sorted_multipliers(orbit.half_multipliers),
        sorted_multipliers(nus),
        rtol=0.0,
        atol=1e-11 * abs(nus).max(),
    )
    assert orbit.stable == entry["stable"]
    assert orbit.admissible == entry["admissible"]


@pytest.mark.parametrize("name", RANGES)
def test_the_equations_of_orbits_hold_to_rounding_at_the_closed_forms(name: str) -> None:
    low, high = RANGES[name]
    count = 0
    for omega in np.linspace(low, high, 60):
        for orbit in vi.symmetric_orbits(damper_of(name, omega)):
            count += 1
            assert orbit.residual < 1e-13  # a 4 x 4 solve of condition below 100
            assert orbit.determinant_error < 1e-9  # of entries up to 1e3: ulp times their square
    assert count > 60


@settings(max_examples=100, deadline=None)
@given(DAMPER_PARAMETERS)
def test_an_admissible_orbit_repeats_in_simulation(p: dict[str, float]) -> None:
    damper = vi.ImpactDamper(**p)
    for orbit in vi.symmetric_orbits(damper):
        growth = float(np.abs(orbit.multipliers).max())
        if not orbit.admissible or growth > 1e3:
            continue
        run = vi.simulate(damper, orbit.state, impacts=2)
        assert list(run.side) == [-1, 1]
        size = abs(np.array(orbit.state.position + orbit.state.velocity)).max()
        error = abs(run.position[-1] - orbit.state.position).max() / size
        assert error < 1e-11 * max(growth, 1.0)


@pytest.mark.parametrize(
    ("mu", "omega_n", "zeta", "restitution", "delta", "omega", "reason"),
    [
        (
            0.388,
            1.008,
            0.006,
            0.646,
            9.717,
            0.9993,
            "impact 0 reaches the lower stop of contact 0 from behind",
        ),
        (
            0.751,
            0.886,
            0.0636,
            0.934,
            0.217,
            1.05,
            "the gap at the upper stop of contact 0 is -0.0497757",
        ),
        (
            0.111,
            1.048,
            0.257,
            0.603,
            0.0871,
            0.794,
            "the gap at the upper stop of contact 0 is -0.477852",
        ),
    ],
)
def test_inadmissible_orbits_say_why(
    mu: float,
    omega_n: float,
    zeta: float,
    restitution: float,
    delta: float,
    omega: float,
    reason: str,
) -> None:
    damper = vi.ImpactDamper(
        mass_ratio=mu,
        omega_n=omega_n,
        zeta=zeta,
        restitution=restitution,
        half_clearance=delta,
        omega=omega,
    )
    orbit = vi.symmetric_orbits(damper)[0]
    assert not orbit.admissible
    assert not orbit.stable
    assert orbit.inadmissible_reason.startswith(reason)
