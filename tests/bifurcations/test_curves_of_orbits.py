"""Curves of bifurcations of periodic orbits, against closed forms at 50 digits and scaling laws."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from support.bifurcations import oscillator_branch, torus_of_set_a
from witness.bifurcations import breaking_test, fold_test, torus_test
from witness.damper import PAPER_SETS, Damper
from witness.precision import Real, exact, mp
from witness.symmetric import characteristic, half_jacobian, orbit

import vibroimpact as vi

PLANE = ("omega", "half_clearance")
DAMPER = vi.ImpactDamper(
    mass_ratio=0.1, omega_n=0.5, zeta=0.045, restitution=0.8, half_clearance=5.0, omega=0.95
)


@cache
def branch() -> vi.Branch:
    return vi.continue_orbit(vi.symmetric_orbits(DAMPER)[0], "omega", (0.6, 1.3))


def at(omega: Real, clearance: Real) -> Damper:
    """The witness at a point of the plane; doubles are taken bit by bit."""
    return replace(
        Damper(**PAPER_SETS["A"], omega=omega), omega=exact(omega), half_clearance=exact(clearance)
    )


def sign_of(found: vi.BifurcationCurve, k: int) -> int:
    """Which of the two closed-form orbits the point belongs to."""
    omega, clearance = found.values[k]
    return min(
        (s for s in (1, -1) if orbit(at(omega, clearance), s)),
        key=lambda s: abs(orbit(at(omega, clearance), s).state.v1 - found.orbit(k).states[0, 2]),
    )


@pytest.mark.slow
@pytest.mark.parametrize(
    ("label", "test"), [("NS1", torus_test), ("BP1", breaking_test)], ids=["NS", "BP"]
)
def test_every_point_of_a_curve_solves_the_scalar_equation_at_fifty_digits(
    label: str, test: Callable[[Damper, int], Real]
) -> None:
    found = (
        torus_of_set_a()
        if label == "NS1"
        else vi.continue_bifurcation(branch()[label], PLANE, ((0.5, 1.2), (2.0, 12.0)))
    )
    for k in range(0, len(found), len(found) // 5):
        omega, clearance = found.values[k]
        sign = sign_of(found, k)
        exact_omega = mp.findroot(
            lambda w, c=clearance, s=sign: test(at(w, c), s), exact(omega), tol=1e-40
        )
        assert float(exact_omega) == pytest.approx(omega, abs=1e-11)


@pytest.mark.slow
def test_folds_of_the_symmetric_orbit_lie_where_the_discriminant_vanishes() -> None:
    low = replace_omega(0.55, 20.0)
    branch_of_folds = vi.continue_orbit(vi.symmetric_orbits(low)[0], "omega", (0.54, 1.3))
    fold = next(p for p in branch_of_folds.special_points if p.kind == "SN")
    found = vi.continue_bifurcation(fold, PLANE, ((0.3, 1.3), (2.0, 20.0)))
    assert len(found) > 20
    for k in range(0, len(found), len(found) // 5):
        omega, clearance = found.values[k]
        exact_omega = mp.findroot(
            lambda w, c=clearance: fold_test(at(w, c), 1), exact(omega), tol=1e-40
        )
        assert float(exact_omega) == pytest.approx(omega, abs=1e-11)


def replace_omega(omega: float, clearance: float) -> vi.ImpactDamper:
    return replace(DAMPER, omega=omega, half_clearance=clearance)


@pytest.mark.parametrize("label", ["R4_1", "R4_2"])
def test_strong_resonances_of_the_damper_are_those_at_fifty_digits(label: str) -> None:
    point = torus_of_set_a()[label]
    k = int(
        np.argmin(np.abs(torus_of_set_a().values - list(point.parameters.values())).sum(axis=1))
    )
    sign = sign_of(torus_of_set_a(), k)

    def remainder(omega: Real, clearance: Real) -> tuple[Real, Real]:
        """The characteristic polynomial of H modulo nu^2 + 1."""
        c4, c3, c2, c1, c0 = characteristic(half_jacobian(orbit(at(omega, clearance), sign)))
        return c4 - c2 + c0, c1 - c3

    start = tuple(exact(value) for value in point.parameters.values())
    omega, clearance = mp.findroot(remainder, start, tol=1e-60)
    assert float(omega) == pytest.approx(point.parameters["omega"], abs=1e-9)
    assert float(clearance) == pytest.approx(point.parameters["half_clearance"], abs=1e-9)
    assert point.resonance == (1, 4)


def test_the_angle_of_a_weak_resonance_is_its_fraction() -> None:
    points = [p for p in torus_of_set_a().special_points if p.kind == "WEAK"]
    assert points
    for point in points:
        p, q = point.resonance or (0, 1)
        angles = np.abs(np.angle(point.multipliers)) / (2.0 * np.pi)
        assert np.abs(angles - p / q).min() < 1e-10
        assert np.abs(np.abs(point.multipliers) - 1.0).min() < 1e-10


@pytest.mark.slow
@pytest.mark.parametrize(
    ("label", "omega"), [("PD1", 2.3), ("ZERO1", 2.0), ("SN1", 2.0), ("GR1", 2.0)]
)
def test_curves_in_clearance_and_force_are_rays_for_motions_scale(label: str, omega: float) -> None:
    # x -> s x, clearance -> s clearance, force -> s force maps motions to motions
    point = oscillator_branch(omega)[label]
    found = vi.continue_bifurcation(point, ("force", "clearance"), ((0.4, 3.0), (0.1, 1.2)))
    ratio = point.parameter
    assert np.ptp(found.values[:, 0]) > 1.5
    np.testing.assert_allclose(found.values[:, 1] / found.values[:, 0], ratio, rtol=1e-9)
    assert not found.special_points


@pytest.mark.slow
def test_a_level_of_a_speed_is_a_ray_too() -> None:
    along = oscillator_branch(2.0)
    start = along.orbit(int(np.argmin(np.abs(along.values - 0.3))))
    oscillator = start.system
    speed = float(start.states[0, 1])
    force = float(getattr(oscillator, "force"))  # noqa: B009

    found = vi.continue_level(
        start,
        lambda states, _durations, parameters: states[0, 1] / parameters["force"],
        ("force", "clearance"),
        ((0.4, 3.0), (-1.0, 1.0)),
        value=speed / force,
    )
    values = np.array([found.orbit(k).states[0, 1] for k in range(len(found))])
    np.testing.assert_allclose(values / found.values[:, 0], speed / force, rtol=1e-12)
    assert np.ptp(found.values[:, 1] / found.values[:, 0]) < 1e-12


def test_a_curve_ends_on_the_bounds_of_both_parameters() -> None:
    found = torus_of_set_a()
    low, high = found.bounds[0]
    assert found.values[:, 0].min() >= low - 1e-12
    assert found.values[:, 0].max() <= high + 1e-12
    for end, values in zip(found.ends, (found.values[0], found.values[-1]), strict=True):
        assert end.reason.name == "RANGE"
        column = PLANE.index(end.detail)
        assert min(abs(values[column] - b) for b in found.bounds[column]) < 1e-9


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ((("omega", "omega"), ((0.7, 1.2), (0.7, 1.2))), "twice the same"),
        ((("omega", "colour"), ((0.7, 1.2), (2.0, 12.0))), "colour"),
        ((("omega",), ((0.7, 1.2), (2.0, 12.0))), "two parameters"),
        ((PLANE, ((1.0, 1.2), (2.0, 12.0))), "must hold omega"),
        ((PLANE, ((0.7, 1.2), (6.0, 12.0))), "must hold half_clearance"),
        ((PLANE, (0.7, 1.2)), "bounds"),
    ],
)
def test_bad_input_is_refused_by_name(arguments: tuple[object, object], message: str) -> None:
    with pytest.raises(vi.InvalidParameterError, match=message):
        vi.continue_bifurcation(branch()["NS1"], *arguments)  # type: ignore[arg-type]


def test_a_point_that_is_not_on_a_curve_is_refused() -> None:
    with pytest.raises(vi.InvalidParameterError, match="special point"):
        vi.continue_bifurcation(branch().orbit(0), PLANE, ((0.7, 1.2), (2.0, 12.0)))  # type: ignore[arg-type]


def test_an_interrupted_curve_keeps_its_part() -> None:
    def stop(report: vi.ProgressReport) -> None:
        if report.done > 20:
            raise KeyboardInterrupt

    found = vi.continue_bifurcation(
        branch()["NS1"], PLANE, ((0.7, 1.2), (2.0, 12.0)), progress=stop
    )
    assert len(found) > 20
    assert "INTERRUPTED" in {end.reason.name for end in found.ends}


def test_a_curve_of_orbits_that_rest_all_the_time_is_that_of_the_machine_without_what_rests() -> (
    None
):
    """A third mass rests on a stop; its spring to the first mass is then one to the ground."""
    m, k = replace(DAMPER, omega=1.02).mechanism, 0.002
    one = m.stiffness[0][0]
    held = vi.Mechanism(
        mass=np.diag([m.mass[0][0], m.mass[1][1], 0.05]),
        damping=np.diag([m.damping[0][0], 0.0, 0.01]),
        stiffness=[[one + k, 0.0, -k], [0.0, 0.0, 0.0], [-k, 0.0, k + 0.01]],
        constant_force=(0.0, 0.0, -0.2),
        forces=(vi.Harmonic(m.omega, (*m.forces[0].sine, 0.0), (*m.forces[0].cosine, 0.0)),),
        elements=(
            replace(m.rigid_stops[0], row=(-1.0, 1.0, 0.0)),
            vi.RigidStop((0.0, 0.0, 1.0), lower=0.0, restitution=0.3),
        ),
    )
    plane = ("omega", "elements[0].upper")
    orbit = vi.find_orbit(held, vi.State((0.0, 0.0, 0.0), (0.0, 1.0, 0.0)))
    point = vi.continue_orbit(orbit, "omega", (1.0, 1.025))["NS1"]
    curve = vi.continue_bifurcation(
        point, plane, ((1.0, 1.02), (4.95, 5.05)), steps=vi.Steps(first=1.0, largest=1.0, points=3)
    )
    assert len(curve) > 2
    for k_th in (0, -1):
        values = dict(zip(plane, curve.values[k_th].tolist(), strict=True))
        rest = m.replace(stiffness=[[one + k, 0.0], [0.0, 0.0]]).replace(values)
        known = curve.orbit(k_th)
        guess = vi.Guess(known.states[:, [0, 1, 3, 4, 6]], known.durations)
        alone = vi.find_orbit(rest, guess, stops=known.signature.impacts, cycles=1)
        # Points of a curve are solved to 1e-9 of the unknowns.
        assert np.abs(np.abs(alone.multipliers[:2]) - 1.0).max() < 1e-7
        np.testing.assert_allclose(alone.multipliers, known.multipliers[:4], atol=1e-9)
