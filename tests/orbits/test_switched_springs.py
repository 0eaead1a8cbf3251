"""Springs and dashpots that change at phases: the Meissner equation, a mesh of gears, against closed forms."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import vibroimpact as vi

EPS = np.finfo(float).eps


def mesh(
    omega: float = 0.9,
    one: float = 1.6,
    two: float = 0.8,
    load: float = 0.3,
    zeta: float = 0.05,
    width: float = 2.0,
) -> vi.Mechanism:
    """Transmission error of a pair of gears: two pairs of teeth press for 2 radians (width) of the mesh, then one.

    x'' + 2 zeta x' + k(t) x = load, k = one for phases in [0, width), two in [width, 2 pi)
    """
    switch = vi.PhaseSwitch(omega, (0.0, width), row=(1.0,), stiffness=(one, two))
    return vi.Mechanism(
        mass=[[1.0]], damping=[[2.0 * zeta]], stiffness=[[0.0]], constant_force=(load,), elements=(switch,),
    )  # fmt: skip


def half(k: float, zeta: float, time: float) -> np.ndarray:
    """Propagator of x'' + 2 zeta x' + k x = 0 in closed form, k > zeta^2."""
    w = math.sqrt(k - zeta * zeta)
    c, s = math.cos(w * time), math.sin(w * time)
    rows = [[c + zeta / w * s, s / w], [-k / w * s, c - zeta / w * s]]
    return math.exp(-zeta * time) * np.array(rows)


def monodromy(omega: float, one: float, two: float, zeta: float) -> np.ndarray:
    """Of one period of the mesh."""
    rest = half(two, zeta, (2.0 * math.pi - 2.0) / omega)
    whole: np.ndarray = rest @ half(one, zeta, 2.0 / omega)
    return whole


MESH = vi.Family(mesh)
START = vi.State((0.0,), (0.0,))


@pytest.fixture(scope="module")
def orbit() -> vi.Orbit:
    return vi.find_orbit(MESH, vi.simulate(MESH, START, t_max=300.0))


@pytest.fixture(scope="module")
def branch(orbit: vi.Orbit) -> vi.Branch:
    return vi.continue_orbit(orbit, "omega", (0.88, 2.4), inadmissible=True)


def test_the_trace_of_the_meissner_equation_is_its_closed_form() -> None:
    """x'' + (1 +- 0.4) x = 0, the sign that of sin 2t: two half periods of pi / 2."""
    switch = vi.PhaseSwitch(2.0, (0.0, math.pi), row=(1.0,), stiffness=(1.4, 0.6))
    m = vi.Mechanism(mass=[[1.0]], damping=[[0.0]], stiffness=[[0.0]], elements=(switch,))
    ends = [
        vi.simulate(m, vi.State((x,), (v,)), t_max=math.pi).last for x, v in ((1.0, 0.0), (0.0, 1.0))
    ]  # fmt: skip
    a, b, t = math.sqrt(1.4), math.sqrt(0.6), math.pi / 2
    closed = 2.0 * math.cos(a * t) * math.cos(b * t) - (a / b + b / a) * math.sin(a * t) * math.sin(
        b * t
    )
    assert abs(ends[0].position[0] + ends[1].velocity[0] - closed) <= 32 * EPS
    assert abs(closed) > 2.0  # within a tongue of parametric resonance


def test_a_mesh_moves_as_an_integrator_says_that_is_told_of_its_steps() -> None:
    run = vi.simulate(MESH, START, t_max=3.0 * 2.0 * math.pi / 0.9)
    y, t = np.zeros(2), 0.0
    arcs = ((2.0, 1.6), (2.0 * math.pi, 0.8))
    for end, k in [((2.0 * math.pi * n + p) / 0.9, k) for n in range(3) for p, k in arcs]:
        found = solve_ivp(
            lambda _, y, k=k: [y[1], 0.3 - 0.1 * y[1] - k * y[0]], (t, end), y, rtol=1e-12, atol=1e-13
        )  # fmt: skip
        y, t = found.y[:, -1], end
    assert [run.last.position[0], run.last.velocity[0]] == pytest.approx(y, abs=1e-10)


def test_the_multipliers_of_a_mesh_are_those_of_its_propagators(orbit: vi.Orbit) -> None:
    closed = np.linalg.eigvals(monodromy(0.9, 1.6, 0.8, 0.05))
    np.testing.assert_allclose(
        np.sort_complex(orbit.multipliers), np.sort_complex(closed), atol=64 * EPS
    )


def test_a_mesh_is_unstable_between_two_period_doublings(branch: vi.Branch) -> None:
    """There 1 + trace + determinant is zero."""
    points = branch.special_points
    assert [point.label for point in points] == ["PD1", "PD2"]
    for point in points:
        a = monodromy(point.parameters["omega"], 1.6, 0.8, 0.05)
        assert abs(1.0 + np.trace(a) + np.linalg.det(a)) <= 1e-11


def test_a_curve_of_doublings_of_a_mesh_bounds_its_tongue(branch: vi.Branch) -> None:
    bounds = ((1.5, 2.5), (0.6, 1.0))
    curve = vi.continue_bifurcation(branch.special_points[0], ("omega", "two"), bounds)
    assert len(curve.values) > 10
    for omega, two in curve.values:
        a = monodromy(omega, 1.6, two, 0.05)
        assert abs(1.0 + np.trace(a) + np.linalg.det(a)) <= 1e-9


def test_steps_of_the_profile_are_parameters(orbit: vi.Orbit) -> None:
    """The multipliers at the end of a branch are those of the propagators there."""
    own = vi.find_orbit(mesh(), orbit)
    for path, end, step in (("elements[0].stiffness[1]", 0.9, 2.0), ("elements[0].phases[1]", 2.1, 2.1)):  # fmt: skip
        moved = vi.continue_orbit(own, path, (end - 0.15, end))
        two = end if "stiffness" in path else 0.8
        rest = half(two, 0.05, (2.0 * math.pi - step) / 0.9)
        closed = np.linalg.eigvals(rest @ half(1.6, 0.05, step / 0.9))
        last = moved.multipliers[np.argmax(moved.values)]
        assert moved.values.max() == pytest.approx(end, abs=1e-12)
        np.testing.assert_allclose(np.sort_complex(last), np.sort_complex(closed), atol=1e-11)


def test_a_sweep_of_a_mesh_has_the_exponents_of_its_propagators() -> None:
    """Where both multipliers are complex the exponent is -zeta; where they are real, another one."""
    found = vi.sweep(
        MESH.replace(zeta=0.12), over={"omega": np.array([0.8, 2.05])}, start=START, observe="lyapunov",
        progress=False, settle_periods=30, periods=100,
    )  # fmt: skip
    largest = np.abs(np.linalg.eigvals(monodromy(2.05, 1.6, 0.8, 0.12))).max()
    expected = [-0.12, math.log(largest) * 2.05 / (2.0 * math.pi)]
    assert expected[1] > -0.02
    np.testing.assert_allclose(found.lyapunov, expected, atol=1e-3)


def test_a_dashpot_that_switches_loses_what_it_takes() -> None:
    """x'' + c(t) x' = 0: the speed falls by exp(-c) over each arc of length 1."""
    switch = vi.PhaseSwitch(math.pi, (0.0, math.pi), row=(1.0,), damping=(0.5, 0.1))
    m = vi.Mechanism(mass=[[1.0]], damping=[[0.0]], stiffness=[[0.0]], elements=(switch,))
    run = vi.simulate(m, vi.State((0.0,), (1.0,)), t_max=4.0)
    assert run.last.velocity[0] == pytest.approx(math.exp(-1.2), rel=16 * EPS)
    np.testing.assert_allclose(run.forces(0.5)[0], -0.5 * math.exp(-0.25), rtol=16 * EPS)


def test_a_branch_ends_with_a_reason_where_an_arc_is_half_a_turn() -> None:
    """An arc longer than pi counts as two: beside this value the same motion has other arcs on either side."""
    family = vi.Family(mesh, width=math.pi)
    orbit = vi.find_orbit(family, vi.simulate(family, START, t_max=300.0))
    branch = vi.continue_orbit(orbit, "width", (1.9, 4.0))
    for end in branch.curve.ends:
        assert "elements[0]: no flight ends so in this machine" in end.detail
