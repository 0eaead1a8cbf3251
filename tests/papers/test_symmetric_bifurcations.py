"""Bifurcations of the symmetric orbits in closed form against 50-digit references."""

from __future__ import annotations

import dataclasses
import math
import tomllib
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from support.systems import DAMPER_PARAMETERS
from support.systems import paper_damper as damper_of
from vibroimpact_papers.impact_damper.symmetric_bifurcations import (
    Bifurcation,
    half_map_jacobian,
    pieces,
    symmetric_bifurcations,
)

import vibroimpact as vi
from vibroimpact._core.chebyshev import real_zeros

REFERENCE = Path(__file__).parents[1] / "reference"
TABLE = tomllib.loads((REFERENCE / "bifurcations.toml").read_text())
POINTS = TABLE["bifurcation"]
RANGES = {name: tuple(map(float, entry["omega"])) for name, entry in TABLE["ranges"].items()}
# (v1, x1, v2, theta) of (x1, x2, v1, v2, theta), and the reverse on a stop, where x2 - x1 is fixed
SECTION = [2, 0, 3, 4]
ON_STOP = np.array(
    [[0, 1, 0, 0], [0, 1, 0, 0], [1, 0, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]], dtype=float
)


@pytest.mark.parametrize("point", POINTS, ids=lambda p: f"{p['set']}-{p['kind']}-{p['omega'][:7]}")
@pytest.mark.one_in(4)
def test_each_bifurcation_is_found_to_1e_12(point: dict[str, Any]) -> None:
    found = branch_of(point["set"])
    near = min(found, key=lambda b: abs(b.omega - float(point["omega"])))
    assert near.kind == point["kind"]
    assert abs(near.omega - float(point["omega"])) < 1e-12
    assert near.admissible == point["admissible"]
    if point["kind"] == "NS":
        assert near.sign == point["sign"]
        nu = complex(*map(float, point["nu"]))
        assert abs(near.half_multiplier - nu) < 1e-9  # |nu| = 1 pins omega; its angle moves slowly
        assert near.half_angle == pytest.approx(float(point["angle"]), abs=1e-7)
        assert near.crossing == ("leaves" if point["stable"] == "below" else "enters")


def branch_of(name: str) -> tuple[Bifurcation, ...]:
    """Bifurcations of one set over the reference range, computed once."""
    if name not in _BRANCHES:
        _BRANCHES[name] = symmetric_bifurcations(damper_of(name, 1.0), RANGES[name])
    return _BRANCHES[name]


_BRANCHES: dict[str, tuple[Bifurcation, ...]] = {}


@pytest.mark.parametrize("name", RANGES)
def test_no_bifurcation_is_invented(name: str) -> None:
    assert len(branch_of(name)) == TABLE["ranges"][name]["count"]


@pytest.mark.slow
def test_two_bifurcations_that_meet_are_found_as_two_or_none_never_one() -> None:
    # symmetry breaking of C, sign -1: two near omega = 0.508 at delta = 6, none at delta = 5
    base = damper_of("C", 1.0)

    def pair(delta: float) -> list[float]:
        damper = dataclasses.replace(base, half_clearance=delta)
        found = symmetric_bifurcations(damper, (0.504, 0.512))
        return [b.omega for b in found if b.kind == "BP" and b.sign == -1]

    none, two, closest = 5.0, 6.0, 1.0
    for _ in range(14):
        middle = (none + two) / 2
        omegas = pair(middle)
        assert len(omegas) in (0, 2)
        if omegas:
            two, closest = middle, omegas[1] - omegas[0]
        else:
            none = middle
    assert closest < 1e-4  # a hundredth of the range: far closer than the samples


def test_a_chebyshev_piece_separates_close_zeros() -> None:
    at, gap = 0.3123, 1e-4

    def product(x: float) -> np.ndarray:
        return np.array([(x - at) * (x - at - gap) * (2.0 + np.sin(x))])

    ((_, _, coefficients),) = list(pieces(product, -1.0, 1.0))
    # a zero moves by rounding over the slope: 1e-15 / 1e-4
    np.testing.assert_allclose(real_zeros(coefficients[:, 0]), [at, at + gap], atol=1e-10)


def test_orbits_meet_at_the_fold() -> None:
    fold = next(b for b in branch_of("B") if b.kind == "SN")
    inside = damper_of("B", fold.omega * (1.0 - 1e-10))
    plus, minus = vi.symmetric_orbits(inside)
    # distance of the two signs falls like the square root of the distance to the fold
    assert abs(plus.state.phase - minus.state.phase) < 1e-3
    assert vi.symmetric_orbits(damper_of("B", fold.omega * (1.0 + 1e-10))) == ()


def test_jets_through_the_engine_give_the_closed_form_jacobian() -> None:
    for name, omega in (("A", 1.2), ("B", 1.1), ("C", 0.45)):
        orbit = vi.symmetric_orbits(damper_of(name, omega))[0]
        through = vi.map_derivative(orbit.system, orbit.state, impacts=2, directions=ON_STOP)
        half, _ = half_map_jacobian(orbit.system, orbit.state)
        # two saltations of condition below 1e2
        size = np.abs(half).max() ** 2
        np.testing.assert_allclose(through.matrix[SECTION], half @ half, atol=1e-11 * size)


@settings(max_examples=150, deadline=None)
@given(DAMPER_PARAMETERS)
@pytest.mark.slow
def test_the_determinant_of_the_half_map_is_the_identity(p: dict[str, float]) -> None:
    damper = vi.ImpactDamper(**p)
    for orbit in vi.symmetric_orbits(damper):
        jacobian, speed = half_map_jacobian(damper, orbit.state)
        size = float(np.abs(jacobian).max())
        if size > 1e4 or speed == 0.0:
            continue  # next to a grazing impact the matrix itself loses the digits
        exact = damper.restitution**2 * math.exp(
            -2 * math.pi * damper.zeta * damper.omega_n / damper.omega
        )
        assert abs(np.linalg.det(jacobian) - exact) < 1e-13 * max(size, 1.0) ** 3


@pytest.mark.parametrize("omega", [(1.2, 1.0), (0.0, 1.0), (-1.0, 1.0), (1.0, math.nan)])
def test_an_impossible_range_is_refused(omega: tuple[float, float]) -> None:
    with pytest.raises(vi.InvalidParameterError, match="omega"):
        symmetric_bifurcations(damper_of("A", 1.0), omega)
