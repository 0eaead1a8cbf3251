"""Derivatives of the maps of an orbit: 50-digit references and identities, no tuned numbers."""

from __future__ import annotations

import itertools
import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from scipy.linalg import expm
from support.periodic import (
    chain,
    guess_of_entry,
    impacts_of,
    largest,
    mechanism_of_entry,
    numbers,
    orbits_of_chains,
    table,
)
from support.systems import paper_damper

import vibroimpact as vi
from vibroimpact.compile.prescribed import COASTING_STOP, compile_prescribed
from vibroimpact.orbits.maps import SegmentMap, solved_map
from vibroimpact.orbits.multipliers import section_basis
from vibroimpact.orbits.orbit import Orbit

EPS = np.finfo(float).eps
DERIVATIVES = table("derivatives.toml")
PERIODIC = table("periodic.toml")
# (v1, x1, v2, theta) of the references as entries of (x1, v1, v2, theta)
PLACE = [1, 0, 2, 3]
FIELDS = ("omega", "half_clearance", "mass_ratio", "restitution", "zeta", "omega_n", "force")


def orbit_of(entry: dict[str, Any]) -> Orbit:
    """The symmetric orbit of the damper that a reference is about."""
    damper = paper_damper(entry["set"], float(entry["omega"]))
    return vi.find_orbit(damper, vi.symmetric_orbits(damper)[(1, -1).index(entry["sign"])])


def map_of(orbit: Orbit, name: str, parameter: str = "") -> SegmentMap:
    """The half or the full map."""
    return vi.half_map(orbit, parameter) if name == "half" else vi.full_map(orbit, parameter)


def basis(d: int) -> list[np.ndarray]:
    """Unit vectors of the coordinates and, last, of the parameter."""
    return list(np.eye(d + 1))


def allowed(*tensors: Any) -> float:
    """Rounding of a derivative: of itself, and of the point that it is taken at.

    The point is known to some hundred roundings of its size (below 20), so that the derivative one
    order higher enters with 1e3 EPS; the flight and Newton's steps for the event time lose as much
    again.
    """
    return 2e4 * EPS * sum(largest(np.array(t)) for t in tensors)


def compare(got: Any, wanted: Any, tolerance: float) -> None:
    """Both in the coordinates of the references."""
    np.testing.assert_allclose(np.array(got)[..., PLACE], wanted, rtol=0.0, atol=tolerance)


def identity(entry: dict[str, Any]) -> str:
    return f"{entry['set']}-{entry['omega']}-{entry['map']}"


# ---- 50 digits -----------------------------------------------------------------------------------


@pytest.mark.parametrize("entry", DERIVATIVES["damper"], ids=identity)
def test_all_forms_equal_the_50_digit_reference(entry: dict[str, Any]) -> None:
    forms, e = map_of(orbit_of(entry), entry["map"]), [np.eye(4)[i] for i in PLACE]
    first, second, third = (np.array(numbers(entry[k])) for k in ("first", "second", "third"))
    compare([forms.derivative(u) for u in e], first, allowed(first, second))
    pairs = itertools.combinations_with_replacement(e, 2)
    compare([forms.derivative(*u) for u in pairs], second, allowed(second, third))
    triples = itertools.combinations_with_replacement(e, 3)
    # the fourth derivative is not known; each order grows by no more than the last did
    grown = third * max(1.0, largest(third) / largest(second))
    compare([forms.derivative(*u) for u in triples], third, allowed(third, grown))


@pytest.mark.parametrize("entry", DERIVATIVES["damper"], ids=identity)
def test_derivatives_by_every_parameter_equal_the_50_digit_reference(entry: dict[str, Any]) -> None:
    orbit = orbit_of(entry)
    for name in FIELDS:
        forms = map_of(orbit, entry["map"], name)
        wanted = np.array(numbers(entry[f"by_{name}"]))
        compare(forms.derivative(basis(4)[-1]), wanted, allowed(wanted, numbers(entry["second"])))


@pytest.mark.parametrize(
    "entry", [e for e in DERIVATIVES["damper"] if "by_omega_omega" in e], ids=identity
)
def test_mixed_derivatives_by_omega_equal_the_50_digit_reference(entry: dict[str, Any]) -> None:
    forms = map_of(orbit_of(entry), entry["map"], "omega")
    *e, p = basis(4)
    e = [e[i] for i in PLACE]
    by = {k: np.array(numbers(entry[f"by_omega_{k}"])) for k in ("first", "second", "omega")}
    tolerance = allowed(by["first"], by["second"], entry_size(entry))
    compare([forms.derivative(u, p) for u in e], by["first"], tolerance)
    pairs = itertools.combinations_with_replacement(e, 2)
    compare(
        [forms.derivative(*u, p) for u in pairs], by["second"], 10.0 * tolerance
    )  # by one order more than is tabulated
    compare(forms.derivative(p, p), by["omega"], tolerance + allowed(by["omega"]))


def entry_size(entry: dict[str, Any]) -> Any:
    """The largest derivatives of a reference."""
    return numbers(entry["third"])


def whole_space_map(entry: dict[str, Any], parameter: str = "") -> SegmentMap:
    """A flight and an impact as a map of (x, v, theta), places off the stop included."""
    compiled = compile_prescribed(mechanism_of_entry(entry), parameter)
    point, image = (np.array(numbers(entry[k])) for k in ("point", "image"))
    size = compiled.size
    duration = (image[-1] - point[-1]) / compiled.omega
    (stop,) = impacts_of(entry["gap"])
    return SegmentMap(
        compiled, point[None, :], np.array([duration]), tuple(compiled.stop_numbers([stop])),
        (COASTING_STOP, 0), tuple(range(size)), tuple(range(size)), np.ones(size), np.zeros(4),
    )  # fmt: skip


@pytest.mark.parametrize("entry", DERIVATIVES["flight"], ids=lambda e: e["name"])
def test_forms_at_critical_damping_equal_frequencies_and_free_masses(entry: dict[str, Any]) -> None:
    forms = whole_space_map(entry)
    e = list(np.eye(forms.dimension))
    for order, name in enumerate(("first", "second", "third"), 1):
        if name not in entry:  # the larger systems are tabulated to second order
            continue
        wanted = np.array(numbers(entry[name]))
        got = [forms.derivative(*u) for u in itertools.combinations_with_replacement(e, order)]
        np.testing.assert_allclose(got, wanted, rtol=0.0, atol=allowed(wanted) + 1e2 * EPS)


@pytest.mark.parametrize("entry", DERIVATIVES["flight"], ids=lambda e: e["name"])
def test_parameter_derivatives_at_critical_damping_equal_frequencies_and_free_masses(
    entry: dict[str, Any],
) -> None:
    for by in entry["by"]:
        matrix, i, j = by["entry"]
        forms = whole_space_map(entry, f"{matrix}[{i}][{j}]")
        *e, p = basis(forms.dimension)
        value, first = (np.array(numbers(by[k])) for k in ("value", "first"))
        np.testing.assert_allclose(forms.derivative(p), value, rtol=0.0, atol=allowed(value, first))
        got = [forms.derivative(u, p) for u in e]
        np.testing.assert_allclose(got, first, rtol=0.0, atol=allowed(value, first))


# ---- identities ----------------------------------------------------------------------------------


def composed(outer: Any, inner: Any, *u: np.ndarray) -> np.ndarray:
    """(T48): the forms of outer o inner; directions may carry the parameter's part last."""
    d = inner.dimension

    def through(w: np.ndarray) -> np.ndarray:
        return np.append(inner.derivative(w), w[d:])

    if len(u) == 1:
        return np.asarray(outer.derivative(through(u[0])))
    if len(u) == 2:
        inside = outer.derivative(inner.derivative(*u))
        return np.asarray(outer.derivative(*map(through, u)) + inside)
    total = outer.derivative(*map(through, u)) + outer.derivative(inner.derivative(*u))
    for k in range(3):
        rest = [u[i] for i in range(3) if i != k]
        total = total + outer.derivative(through(u[k]), inner.derivative(*rest))
    return np.asarray(total)


class Composition:
    """outer o inner as forms."""

    def __init__(self, outer: Any, inner: Any) -> None:
        self.outer, self.inner, self.dimension = outer, inner, inner.dimension

    def derivative(self, *u: np.ndarray) -> np.ndarray:
        return composed(self.outer, self.inner, *u)


def directions(d: int, count: int, seed: int = 0) -> list[np.ndarray]:
    """Random directions with the parameter's part."""
    return list(np.random.default_rng(seed).normal(size=(count, d + 1)))


@pytest.mark.parametrize("order", [1, 2, 3])
@pytest.mark.parametrize(("name", "omega"), [("A", 0.93), ("A", 1.2), ("B", 0.95), ("C", 0.448)])
def test_the_full_map_is_the_half_map_twice(name: str, omega: float, order: int) -> None:
    damper = paper_damper(name, omega)
    for closed in vi.symmetric_orbits(damper):
        orbit = vi.find_orbit(damper, closed)
        half, full = vi.half_map(orbit, "omega"), vi.full_map(orbit, "omega")
        u = directions(4, order)
        twice = composed(half, half, *u)
        # products of the factors' entries, each with the rounding of its own
        scale = largest(half.jacobian()) ** (order + 1) * max(1.0, largest(twice))
        np.testing.assert_allclose(full.derivative(*u), twice, rtol=0.0, atol=2e4 * EPS * scale)


@pytest.mark.parametrize("order", [1, 2, 3])
@pytest.mark.parametrize("entry", PERIODIC["orbit"], ids=lambda e: e["name"])
def test_the_full_map_is_the_impact_maps_one_after_another(
    entry: dict[str, Any], order: int
) -> None:
    orbit = vi.find_orbit(
        mechanism_of_entry(entry), guess_of_entry(entry), stops=impacts_of(entry["signature"]),
        cycles=entry["cycles"],
    )  # fmt: skip
    for parameter in ("omega", "stiffness[0][0]", "elements[0].restitution"):
        whole = vi.full_map(orbit, parameter)
        chained: Any = vi.impact_map(orbit, 0, parameter)
        for k in range(1, len(orbit.signature.impacts)):
            chained = Composition(vi.impact_map(orbit, k, parameter), chained)
        u = directions(whole.dimension, order)
        wanted = chained.derivative(*u)
        # one rounding of each factor is magnified by the others: 1e6 roundings
        np.testing.assert_allclose(
            whole.derivative(*u), wanted, rtol=0.0, atol=1e6 * EPS * max(1.0, largest(wanted))
        )


def test_forms_are_symmetric() -> None:
    for orbit in orbits_of_chains():
        forms = vi.full_map(orbit, "omega")
        for order in (2, 3):
            u = directions(forms.dimension, order)
            values = np.array([forms.derivative(*p) for p in itertools.permutations(u)])
            apart = np.ptp(values, axis=0)
            assert largest(apart) <= 1e3 * EPS * max(1.0, largest(values))


def test_forms_are_linear_in_every_direction() -> None:
    forms = vi.half_map(orbit_of(DERIVATIVES["damper"][0]), "omega")
    u, v, w, more = directions(4, 4)
    left = forms.derivative(2.0 * u - 3.0 * more, v, w)
    right = 2.0 * forms.derivative(u, v, w) - 3.0 * forms.derivative(more, v, w)
    np.testing.assert_allclose(left, right, rtol=0.0, atol=1e3 * EPS * largest(right))


def test_a_flight_without_an_event_has_no_second_and_third_derivative() -> None:
    """Over one period of the force it is affine in (x, v); with an impact it is not."""
    compiled = compile_prescribed(chain(3, 0))
    state = np.array([[0.1, -0.2, 0.05, 0.3, 0.1, -0.4, 0.7]])
    period, kept = 2.0 * math.pi / compiled.omega, tuple(range(6))
    coasting = SegmentMap(
        compiled, state, np.array([period]), (COASTING_STOP,), (COASTING_STOP, 0), kept, kept, np.ones(6),
        np.array([period, 0.0, 0.0, 0.0]),
    )  # fmt: skip
    u, v, w = (d[:6] for d in directions(6, 3))
    assert not np.any(coasting.derivative(u, v))
    assert not np.any(coasting.derivative(u, v, w))
    orbit = vi.find_orbit(chain(1, 0), vi.State((0.0,), (0.0,)))
    impacting = vi.full_map(orbit)
    assert np.any(impacting.derivative(np.ones(2), np.ones(2)))


def test_the_flight_without_an_event_is_the_matrix_exponential() -> None:
    m = chain(2, 0)
    compiled = compile_prescribed(m)
    period, kept = 2.0 * math.pi / compiled.omega, tuple(range(4))
    coasting = SegmentMap(
        compiled, np.zeros((1, 5)), np.array([period]), (COASTING_STOP,), (COASTING_STOP, 0), kept, kept,
        np.ones(4), np.array([period, 0.0, 0.0, 0.0]),
    )  # fmt: skip
    inverse = np.linalg.inv(np.array(m.mass))
    field = np.block([
        [np.zeros((2, 2)), np.eye(2)],
        [-inverse @ np.array(m.stiffness), -inverse @ np.array(m.damping)],
    ])  # fmt: skip
    # both scale and square some five times, which loses as many bits, in numbers of order ten
    np.testing.assert_allclose(coasting.jacobian(), expm(field * period), rtol=0.0, atol=1e3 * EPS)


def test_the_jacobian_is_that_of_the_engine() -> None:
    """First-order jets through the event search, in modal coordinates: other code altogether."""
    compared = 0
    for orbit in [*orbits_of_chains(), orbit_of(DERIVATIVES["damper"][2])]:
        if not orbit.admissible:
            continue
        compared += 1
        compiled, first = orbit.problem.compiled(0.0), orbit.signature.first
        slopes = compiled.slopes(first, orbit.states[0])
        solved = compiled.solved_coordinate(first)
        tangents, kept = section_basis(slopes[: orbit.problem.size], solved)
        engine = vi.map_derivative(
            orbit.system, orbit.state, impacts=len(orbit.signature.impacts), directions=tangents
        )
        mine = vi.full_map(orbit).jacobian()
        np.testing.assert_allclose(
            engine.matrix[kept], mine, rtol=0.0, atol=1e5 * EPS * max(1.0, largest(mine))
        )
    assert compared >= 5


def test_all_sections_have_the_same_multipliers() -> None:
    for orbit in orbits_of_chains():
        wanted = np.poly(orbit.multipliers)
        tolerance = 1e5 * EPS * max(1.0, largest(wanted))
        maps = [
            vi.full_map(orbit),
            vi.stroboscopic_map(orbit, 0.3),
            vi.stroboscopic_map(orbit, 0.9),
        ]
        for forms in maps:
            values = np.linalg.eigvals(forms.jacobian())
            np.testing.assert_allclose(np.poly(values), wanted, rtol=0.0, atol=tolerance)


@pytest.mark.parametrize("name", ["A", "B", "C"])
def test_the_half_multipliers_are_those_of_the_half_map(name: str) -> None:
    damper = paper_damper(name, {"A": 1.2, "B": 0.95, "C": 0.448}[name])
    orbit = vi.find_orbit(damper, vi.symmetric_orbits(damper)[0])
    values = np.linalg.eigvals(solved_map(orbit).jacobian())
    assert orbit.half_multipliers is not None
    np.testing.assert_allclose(np.poly(values), np.poly(orbit.half_multipliers), atol=1e-11)


def test_the_orbit_moves_with_the_parameter_as_the_derivative_says() -> None:
    """dz/dp = (I - DP)^-1 F_p: against orbits found on both sides, error of order h^2."""
    damper = paper_damper("A", 1.2)
    orbit = vi.find_orbit(damper, vi.symmetric_orbits(damper)[0])
    for name in FIELDS:
        forms = vi.half_map(orbit, name)
        step = np.linalg.solve(np.eye(4) - forms.jacobian(), forms.derivative(basis(4)[-1]))
        errors = []
        for h in (1e-3, 5e-4):
            ends = [vi.find_orbit(changed(damper, name, s * h), orbit).states[0] for s in (1, -1)]
            difference = ((ends[0] - ends[1]) / (2.0 * h))[[0, 2, 3, 4]]
            errors.append(largest(difference - step))
        ratio = errors[0] / max(errors[1], 1e-300)
        # a quarter at half the step, unless both are rounding (the map may be linear in p)
        assert 3.5 < ratio < 4.5 or errors[0] < 1e-9, (name, errors)


@pytest.mark.parametrize("name", ["omega", "half_clearance", "zeta"])
def test_the_stroboscopic_state_moves_as_the_derivative_says(name: str) -> None:
    """The same at a fixed phase inside a flight, with omega changing the period too."""
    damper = paper_damper("A", 1.2)
    orbit = vi.find_orbit(damper, vi.symmetric_orbits(damper)[0])
    forms = vi.stroboscopic_map(orbit, 0.5, name)
    step = np.linalg.solve(np.eye(4) - forms.jacobian(), forms.derivative(basis(4)[-1]))
    phase = orbit.states[0, -1] + 0.5 * damper.omega * orbit.durations[0]

    def state(amount: float) -> np.ndarray:
        there = changed(damper, name, amount)
        near = vi.find_orbit(there, orbit)
        after = (phase - near.states[0, -1]) / there.omega
        return np.concatenate(vi.simulate(there, near.state, impacts=1).at(after))

    errors = [largest((state(h) - state(-h)) / (2.0 * h) - step) for h in (1e-3, 5e-4)]
    assert 3.5 < errors[0] / errors[1] < 4.5, errors


def changed(damper: vi.ImpactDamper, name: str, amount: float) -> vi.ImpactDamper:
    """The damper with one parameter moved."""
    return replace(damper, **{name: getattr(damper, name) + amount})


# ---- misuse --------------------------------------------------------------------------------------


def test_directions_of_wrong_number_or_shape_are_refused() -> None:
    forms = vi.full_map(orbit_of(DERIVATIVES["damper"][2]))
    u = np.ones(4)
    with pytest.raises(vi.InvalidParameterError, match="need 1 to 3"):
        forms.derivative(u, u, u, u)
    with pytest.raises(vi.InvalidParameterError, match="need 1 to 3"):
        forms.derivative()
    with pytest.raises(vi.InvalidParameterError, match="shape"):
        forms.derivative(np.ones(3))
    with pytest.raises(vi.InvalidParameterError, match="no parameter"):
        forms.derivative(np.ones(5))


def test_maps_are_refused_where_they_do_not_exist() -> None:
    orbit = vi.find_orbit(chain(1, 0), vi.State((0.0,), (0.0,)))
    with pytest.raises(vi.InvalidParameterError, match="symmetric"):
        vi.half_map(orbit)
    with pytest.raises(vi.InvalidParameterError, match="after"):
        vi.stroboscopic_map(orbit, 1.0)
    with pytest.raises(vi.InvalidParameterError, match="parameter"):
        vi.full_map(orbit, "no_such_thing")
