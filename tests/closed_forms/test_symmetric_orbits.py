"""Closed-form symmetric orbits against 50-digit references, their conditions and identities."""

from __future__ import annotations

import dataclasses
import math
import tomllib
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import vibroimpact as vi
from vibroimpact._core.chebyshev import pieces, real_zeros, real_zeros_of
from vibroimpact.closed_forms import symmetric_orbits as orbits
from vibroimpact.machines.published import parameter_sets

REFERENCE = Path(__file__).parents[1] / "reference"
ORBITS = tomllib.loads((REFERENCE / "orbits.toml").read_text())["orbit"]
TABLE = tomllib.loads((REFERENCE / "bifurcations.toml").read_text())
POINTS = TABLE["bifurcation"]
RANGES = {name: tuple(map(float, entry["omega"])) for name, entry in TABLE["ranges"].items()}


def damper_of(name: str, omega: float) -> vi.ImpactDamper:
    """A parameter set of the paper at one frequency."""
    return parameter_sets()[name].damper(omega)


def sorted_multipliers(values: Any) -> np.ndarray:
    """By modulus, then imaginary part: an order both sides share."""
    z = np.asarray(values, dtype=complex)
    return z[np.lexsort((z.imag.round(9), np.abs(z).round(9)))]


@pytest.mark.parametrize("entry", ORBITS, ids=lambda e: f"{e['set']}-{e['omega']}-{e['sign']:+d}")
def test_orbit_and_multipliers_equal_the_50_digit_reference(entry: dict[str, Any]) -> None:
    found = [
        o for o in vi.symmetric_orbits(damper_of(entry["set"], float(entry["omega"])))
        if o.sign == entry["sign"]
    ]  # fmt: skip
    assert bool(found) == entry["exists"]
    if not found:
        return
    (orbit,) = found
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
def test_every_condition_of_equation_11_holds_to_rounding(name: str) -> None:
    low, high = RANGES[name]
    count = 0
    for omega in np.linspace(low, high, 60):
        for orbit in vi.symmetric_orbits(damper_of(name, omega)):
            count += 1
            # the smallest x2 is 1/500 of its terms: 32 ulp of these are 2e-12 of it
            assert max(orbit.residuals.values()) < 2e-12, orbit.residuals
            assert (
                orbit.determinant_error < 1e-9
            )  # det of entries up to 1e3: ulp times their square
    assert count > 60


def test_residuals_notice_a_wrong_state() -> None:
    orbit = vi.symmetric_orbits(damper_of("A", 1.2))[0]
    compiled = orbits.on_circle(orbit.damper)[3]
    wrong = orbits._residuals(orbit.damper, compiled, orbit.state.perturbed(1e-9))
    assert max(wrong.values()) > 1e-11


parameters = st.fixed_dictionaries({
    "mass_ratio": st.floats(0.01, 3.0),
    "omega_n": st.floats(0.0, 2.0),
    "zeta": st.floats(0.01, 1.5),
    "restitution": st.floats(0.05, 1.0),
    "half_clearance": st.floats(0.05, 10.0),
    "omega": st.floats(0.2, 3.0),
})  # fmt: skip


@settings(max_examples=150, deadline=None)
@given(parameters)
def test_product_of_multipliers_is_the_determinant_identity(p: dict[str, float]) -> None:
    damper = vi.ImpactDamper(**p)
    for orbit in vi.symmetric_orbits(damper):
        size = float(np.abs(orbit.half_jacobian).max())
        if size > 1e4 or orbit.impact_speed == 0.0:
            continue  # next to a grazing impact the matrix itself loses the digits
        exact = damper.restitution**2 * math.exp(
            -2 * math.pi * damper.zeta * damper.omega_n / damper.omega
        )
        assert abs(np.prod(orbit.half_multipliers) - exact) < 1e-13 * max(size, 1.0) ** 3


@settings(max_examples=100, deadline=None)
@given(parameters)
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


@pytest.mark.parametrize("point", POINTS, ids=lambda p: f"{p['set']}-{p['kind']}-{p['omega'][:7]}")
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


def branch_of(name: str) -> tuple[vi.Bifurcation, ...]:
    """Bifurcations of one set over the reference range, computed once."""
    if name not in _BRANCHES:
        _BRANCHES[name] = vi.symmetric_bifurcations(damper_of(name, 1.0), RANGES[name])
    return _BRANCHES[name]


_BRANCHES: dict[str, tuple[vi.Bifurcation, ...]] = {}


@pytest.mark.parametrize("name", RANGES)
def test_no_bifurcation_is_invented(name: str) -> None:
    assert len(branch_of(name)) == TABLE["ranges"][name]["count"]


def test_two_bifurcations_that_meet_are_found_as_two_or_none_never_one() -> None:
    # symmetry breaking of C, sign -1: two near omega = 0.508 at delta = 6, none at delta = 5
    base = damper_of("C", 1.0)

    def pair(delta: float) -> list[float]:
        damper = dataclasses.replace(base, half_clearance=delta)
        found = vi.symmetric_bifurcations(damper, (0.504, 0.512))
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


def test_zeros_of_many_series_are_the_planted_ones_whatever_the_rounding_above_their_degree():
    rng = np.random.default_rng(5)
    planted = [np.sort(rng.uniform(-0.99, 0.99, degree)) for degree in (0, 1, 2, 5, 1, 8)]
    series = np.zeros((25, len(planted)))
    for column, zeros in zip(series.T, planted, strict=True):
        column[: len(zeros) + 1] = np.polynomial.chebyshev.chebfromroots(zeros)
        column += 1e-17 * rng.normal(size=25) * np.abs(column).max()
    numbers, found = real_zeros_of(series)
    for k, zeros in enumerate(planted):
        # rounding of the values over the smallest slope between eight zeros, some 1e-5
        np.testing.assert_allclose(np.sort(found[numbers == k]), zeros, atol=1e-10)


@pytest.mark.parametrize("order", [1, 2, 7, 24])
@pytest.mark.parametrize("sign", [-1.0, 1.0])
def test_a_series_that_touches_zero_at_an_end_keeps_its_zeros(order: int, sign: float) -> None:
    """T_k + sign is zero at an end of the interval; with a bit less of the sign, next to it."""
    for first in (sign, sign * (1.0 - 1e-9), sign * (1.0 + 1e-13)):
        series = np.zeros(25)
        series[0], series[order] = first, 1.0
        angles = np.arccos(np.clip(-first, -1.0, 1.0)) + 2.0 * np.pi * np.arange(order + 1)
        planted = np.cos(np.concatenate([angles, 2.0 * np.pi * (order + 1) - angles]) / order)
        found = real_zeros(series)
        # a double zero has half of the digits
        assert max(np.abs(found - x).min() for x in planted) < 1e-4
    series[0] = 1.2 * sign
    assert not real_zeros(series).size


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
        through = vi.section_jacobian(orbit.damper, orbit.state)
        # two saltations of condition below 1e2
        np.testing.assert_allclose(through, orbit.jacobian, atol=1e-11 * abs(through).max())


@pytest.mark.parametrize(
    ("mu", "omega_n", "zeta", "restitution", "delta", "omega", "reason"),
    [
        (0.388, 1.008, 0.006, 0.646, 9.717, 0.9993, "after the impact at A the masses approach"),
        (0.751, 0.886, 0.0636, 0.934, 0.217, 1.05, "contact at A after t = 1.8"),
        (0.111, 1.048, 0.257, 0.603, 0.0871, 0.794, "contact at B after t = 0.33"),
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


@pytest.mark.parametrize("omega", [(1.2, 1.0), (0.0, 1.0), (-1.0, 1.0), (1.0, math.nan)])
def test_an_impossible_range_is_refused(omega: tuple[float, float]) -> None:
    with pytest.raises(vi.InvalidParameterError, match="omega"):
        vi.symmetric_bifurcations(damper_of("A", 1.0), omega)
