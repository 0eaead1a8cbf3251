"""Groups of massless coordinates that dashpots lead to nothing but sliders: SciPy, small masses, the equations."""

from __future__ import annotations

import itertools
import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from numpy.polynomial.legendre import leggauss
from scipy.integrate import solve_ivp
from support.massless import SOFT, jenkins, maxwell

import vibroimpact as vi
from vibroimpact.compile.prescribed import compile_prescribed

STUCK = vi.FrictionState.STICK
RAM, K, C, STOP, LEVEL, GAP = 1.0, 1.0, 0.2, 40.0, 1.0, 0.02


def mole(plate: float = 0.0, c: float = C) -> vi.Mechanism:
    """A ram above a plate that a spring and a dashpot join to a slider, the soil [pavlovskaia2001]."""
    return vi.Mechanism(
        mass=np.diag([RAM, plate, 0.0]), damping=[[0, 0, 0], [0, c, -c], [0, -c, c]],
        stiffness=[[0, 0, 0], [0, K, -K], [0, -K, K]], constant_force=(0.2, 0.0, 0.0),
        elements=(vi.SoftStop((1.0, -1.0, 0.0), upper=GAP, stiffness=STOP), slides(2, 3)),
        forces=(vi.Harmonic(1.0, (1.2, 0.0, 0.0)),),
    )  # fmt: skip


def slides(at: int, n: int, level: float = LEVEL, *, on_mass: bool = False) -> vi.Friction:
    """Friction on a coordinate, against the ground or coordinate 0."""
    return vi.Friction(
        tuple(-1.0 if on_mass and i == 0 else float(i == at) for i in range(n)), level
    )


def from_rest(m: vi.Mechanism, t_max: float) -> vi.Run:
    return vi.simulate(
        m, vi.State((0.0,) * m.degrees, (0.0,) * m.degrees), t_max=t_max, impacts=10_000
    )


def test_a_mole_with_a_plate_without_mass_is_that_of_scipy() -> None:
    """While it slips, the stop carries the level, so that the plate moves as the ram does."""
    run = from_rest(mole(), 30.0)

    def press(y: np.ndarray) -> float:
        return STOP * max(y[0] - y[2] - GAP, 0.0)

    def rate(t: float, y: np.ndarray, slips: bool) -> list[float]:
        _, v, z, s = y
        p = press(y)
        plate = v if slips else (p - K * (z - s)) / C
        soil = v + (K * (z - s) - LEVEL) / C if slips else 0.0
        return [v, 1.2 * math.sin(t) + 0.2 - p, plate, soil]

    def gap(_: float, y: np.ndarray, __: bool) -> float:
        return float(y[0] - y[2] - GAP)

    def limit(t: float, y: np.ndarray, slips: bool) -> float:
        return -rate(t, y, True)[3] if slips else press(y) - LEVEL

    gap.terminal = limit.terminal = limit.direction = 1  # type: ignore[attr-defined]
    t, y, slips, gap.direction, times = 0.0, np.zeros(4), False, 1, list[float]()  # type: ignore[attr-defined]
    while t < 30.0:
        s = solve_ivp(rate, (t, 30.0), y, args=(slips,), events=(gap, limit), rtol=1e-11,
                      atol=1e-12, method="DOP853")  # fmt: skip
        t, y = s.t[-1], s.y[:, -1]
        if s.t_events[0].size:
            gap.direction = -gap.direction  # type: ignore[attr-defined]
        slips ^= bool(s.t_events[1].size)
        times.append(t)
    assert run.end is vi.RunEnd.HORIZON
    assert len(times) > 10
    np.testing.assert_allclose(run.time, times, atol=1e-8)
    np.testing.assert_allclose(
        [*run.last.position, run.last.velocity[0]], y[[0, 2, 3, 1]], atol=1e-8
    )


@pytest.mark.parametrize(
    ("case", "power"), [("mole", 1.0), ("two sliders", 1.0), ("on a mass", 0.5)]
)
def test_a_net_without_mass_is_the_limit_of_small_masses(case: str, power: float) -> None:
    """A difference O(m); O(m^(1/2)), the amplitude, where a jump of speed leaves masses swinging on springs."""

    def machine(light: float) -> vi.Mechanism:
        if case == "mole":
            return mole(light)
        two = slides(1, 4, 0.1), slides(3, 4, 0.05)
        sliders = two if case == "two sliders" else (slides(1, 4, 0.2, on_mass=True),)
        return with_elements(chained(0.3, 0.5, light), *sliders)

    exact, *near = (from_rest(machine(light), 9.0) for light in (0.0, 1e-3, 1e-4))
    assert (exact.states[:, -1] != STUCK).any()
    off = [np.abs(np.subtract(run.last.position, exact.last.position)).max() for run in near]
    assert 0.0 < off[0] < 0.01
    assert off[1] < 1.25 * 0.1**power * off[0]


def chained(a: float, b: float, light: float = 0.0) -> vi.Mechanism:
    """A driven mass, and three coordinates in a row by dashpots a and b, each on a spring."""
    return vi.Mechanism(
        mass=np.diag([1.0, *[light] * 3]),
        damping=[[0.1, 0, 0, 0], [0, a, -a, 0], [0, -a, a + b, -b], [0, 0, -b, b]],
        stiffness=[[3.0, -1.0, 0, 0], [-1.0, 2.0, 0, 0], [0, 0, 1.0, 0], [0, 0, 0, 1.0]],
        elements=(slides(1, 4, 0.3),), forces=(vi.Harmonic(1.1, (1.0, 0.0, 0.0, 0.0)),),
    )  # fmt: skip


def with_elements(m: vi.Mechanism, *elements: Any) -> vi.Mechanism:
    return vi.Mechanism(mass=m.mass, damping=m.damping, stiffness=m.stiffness, elements=elements,
                        forces=m.forces)  # fmt: skip


def linked(matrix: np.ndarray, i: int, j: int | None, k: float) -> None:
    """Add a spring or dashpot between two coordinates, or to the ground."""
    row = np.zeros(len(matrix))
    row[i] = 1.0
    if j is not None:
        row[j] = -1.0
    matrix += k * np.outer(row, row)


def random_net(rng: np.random.Generator) -> dict[str, Any]:
    """One driven mass, two to four massless coordinates with dashpots at random, one or two sliders."""
    n = int(rng.integers(3, 6))
    damping, stiffness = np.zeros((2, n, n))
    linked(damping, 0, None, 0.1)
    linked(stiffness, 0, None, 1.0)
    for i in range(1, n):
        j = int(rng.integers(0 if rng.random() < 0.3 else 1, n))
        linked(damping, i, None if i == j else j, rng.uniform(0.2, 1.0))
        j = int(rng.integers(0, n))
        linked(stiffness, i, None if i == j else j, rng.uniform(0.5, 3.0))
    at = rng.permutation(np.arange(1, n))[: rng.integers(1, 3)]
    sliders = [slides(int(i), n, rng.uniform(0.1, 0.4), on_mass=rng.random() < 0.3) for i in at]
    row = np.eye(n)[0] - np.eye(n)[rng.integers(1, n)]
    stop = vi.SoftStop(tuple(row), upper=rng.uniform(0.0, 0.2), stiffness=rng.uniform(2.0, 20.0),
                       damping=float(rng.choice([0.0, 0.3])))  # fmt: skip
    force = vi.Harmonic(rng.uniform(0.7, 1.8), tuple(rng.normal() * np.eye(n)[0]))
    return {
        "mass": np.diag(np.eye(n)[0]), "damping": damping, "stiffness": stiffness, "forces": (force,),
        "elements": (stop, *sliders) if rng.random() < 0.5 else (*sliders,),
    }  # fmt: skip


@pytest.mark.slow
def test_every_net_is_refused_by_name_or_moves_by_its_equations() -> None:
    """Forces on massless coordinates balance at all times, and what friction takes is force times slip."""
    nodes, weights = leggauss(6)
    ended, refused = 0, list[str]()
    for seed in range(60):
        net = random_net(np.random.default_rng(seed))
        try:
            m = vi.Mechanism(**net)
        except vi.InvalidParameterError as error:
            refused.append(str(error))
            continue
        run = from_rest(m, 6.0)
        assert run.end is vi.RunEnd.HORIZON, seed
        ended += 1
        rows = np.array([e.row for e in m.switching])
        times = np.array([0.0, *run.time, 6.0])
        for a, b in itertools.pairwise(times):
            t = (a + b) / 2.0 + (b - a) / 2.0 * nodes
            x, v = run.at(t)
            forces = run.forces(t)
            load = np.outer(np.sin(m.omega * t), m.forces[0].sine)
            left = v @ net["damping"] + x @ net["stiffness"] - forces @ rows - load
            assert np.abs(left[:, 1:]).max() < 1e-11, seed
            for e, force in zip(m.switching, forces.T, strict=True):
                if isinstance(e, vi.Friction):
                    assert np.abs(force).max() <= e.kinetic + 1e-11, seed
                    assert (force * (v @ e.row)).max() < 1e-11, seed
            moved = (b - a) / 2.0 * weights @ v  # the speeds are those of the places
            steady = np.abs(run.at([b])[0] - run.at([a])[0] - moved).max() if b - a < 0.1 else 0.0
            assert steady < 1e-8, seed
    assert ended > 30
    assert refused
    assert all("is massless, and neither a dashpot nor friction" in text for text in refused)


@pytest.mark.parametrize("seed", range(4))
def test_rounding_of_dashpots_that_lead_nowhere_does_not_matter(seed: int) -> None:
    """The sums a + b on the diagonal are rounded, so that the damping is not singular exactly."""
    a, b = np.random.default_rng(seed).uniform(0.1, 1.0, 2)
    m, scale = chained(a, b), 2.0**-30 / 3.0
    plain = from_rest(with_elements(m, slides(1, 4, 0.3, on_mass=True)), 10.0)
    assert plain.end is vi.RunEnd.HORIZON
    assert not all(STUCK in states for states in plain.states.tolist())
    scaled = vi.Mechanism(  # forces in another unit
        mass=np.multiply(m.mass, scale), damping=np.multiply(m.damping, scale),
        stiffness=np.multiply(m.stiffness, scale), elements=(slides(1, 4, 0.3 * scale, on_mass=True),),
        forces=(vi.Harmonic(1.1, (scale, 0.0, 0.0, 0.0)),),
    )  # fmt: skip
    np.testing.assert_allclose(from_rest(scaled, 10.0).time, plain.time, rtol=1e-11)


def test_nets_whose_speeds_are_not_determined_are_refused_by_name() -> None:
    def machine(damping: Any, *elements: Any) -> vi.Mechanism:
        return vi.Mechanism(mass=np.diag([1.0, 0.0, 0.0]), damping=damping, stiffness=np.eye(3),
                            elements=elements)  # fmt: skip

    c = 1.0 / 3.0
    free = [[0.0, 0.0, 0.0], [0.0, c, -c], [0.0, -c, c]]
    with pytest.raises(vi.InvalidParameterError, match="coordinate 1 is massless, and neither"):
        machine(free, vi.SoftStop((1.0, 0.0, 0.0), upper=1.0))
    turning = [[0.0, 0.0, 0.5], [0.0, c, -c], [-0.5, -c, c]]
    with pytest.raises(
        vi.InvalidParameterError,
        match=r"no dashpot holds coordinates 1, 2 .* with coordinate 0.* give coordinate 2 a mass",
    ):
        machine(turning, slides(2, 3))
    machine(free, slides(2, 3))


def test_two_sliders_on_one_spring_alone_do_not_slip_together() -> None:
    """Nothing balances their levels then; a blow moves the first, and the second by the spring."""
    m = vi.Mechanism(
        mass=np.diag([1.0, 0.0, 0.0]), damping=np.zeros((3, 3)),
        stiffness=[[0, 0, 0], [0, 2.0, -2.0], [0, -2.0, 2.0]],
        elements=(vi.SoftStop((1.0, -1.0, 0.0), upper=0.0, stiffness=30.0), slides(1, 3, 0.2), slides(2, 3, 0.3)),
    )  # fmt: skip
    run = vi.simulate(m, vi.State((-0.1, 0.0, 0.0), (1.0, 0.0, 0.0)), t_max=4.0)
    assert run.end is vi.RunEnd.HORIZON
    _, soil, deep = run.last.position
    spring = 2.0 * (soil - deep)
    assert deep > 0.0
    np.testing.assert_allclose(spring, 0.2, rtol=1e-12)  # the first has slipped back to its level
    way = np.abs(np.diff([0.0, *run.position[:, 1], soil])).sum()
    taken = 0.2 * way + 0.3 * deep + spring**2 / 4.0
    v = run.last.velocity[0]
    np.testing.assert_allclose(taken + v * v / 2.0, 0.5, rtol=1e-12)


@pytest.mark.parametrize("parameter", ["damping[1][1]", "damping[0][2]"])
def test_a_dashpot_that_would_hold_a_group_has_no_derivative(parameter: str) -> None:
    with pytest.raises(vi.InvalidParameterError, match="would give coordinate 2 a dashpot"):
        compile_prescribed(mole(), parameter)


def test_a_parameter_that_keeps_a_group_without_hold_is_allowed() -> None:
    """It changes no order of an equation; one that does is refused."""
    compile_prescribed(vi.Family(lambda c: mole(c=c), c=C), "c")


def test_a_group_that_comes_to_rest_at_its_level_stays_there() -> None:
    """The stop opens while the group slips back: only the spring of the slider is left, and it is at the level."""
    damping, stiffness = np.zeros((2, 4, 4))
    for i, j, c in ((0, None, 0.1), (1, 3, 1.4409), (2, 3, 0.2109)):
        linked(damping, i, j, c)
    for i, j, k in ((0, None, 1.0), (1, 2, 2.5656), (1, 3, 2.361), (2, None, 1.785)):
        linked(stiffness, i, j, k)
    stop = vi.SoftStop((1.0, -1.0, 0.0, 0.0), upper=0.0921, stiffness=3.1503)
    m = vi.Mechanism(
        mass=np.diag([1.0, 0.0, 0.0, 0.0]), damping=damping, stiffness=stiffness,
        elements=(slides(2, 4, 0.392), stop), forces=(vi.Harmonic(1.2, (1.5, 0.0, 0.0, 0.0)),),
    )  # fmt: skip
    run = from_rest(m, 20.0)
    assert run.end is vi.RunEnd.HORIZON
    opened = next(i for i, states in enumerate(run.states[:, 1].tolist()) if i > 2 and not states)
    np.testing.assert_allclose(1.785 * run.position[opened, 2], 0.392, rtol=1e-12)
    assert run.velocity_before[opened, 2] < -0.1
    assert run.velocity_after[opened, 2] == 0.0


def in_unit(m: vi.Mechanism, at: int, unit: float) -> vi.Mechanism:
    """The machine with a coordinate counted in this unit."""
    s = np.diag([unit if i == at else 1.0 for i in range(m.degrees)])
    return vi.Mechanism(
        mass=m.mass, damping=s @ m.damping @ s, stiffness=s @ m.stiffness @ s, forces=m.forces,
        elements=tuple(replace(e, row=tuple(e.row @ s)) for e in m.switching), constant_force=m.constant_force,
    )  # fmt: skip


@pytest.mark.parametrize("unit", [1e-9, 1e-4, 1e4, 1e9])
@pytest.mark.parametrize(
    "machine", [maxwell(SOFT), jenkins(SOFT), mole()], ids=["maxwell", "jenkins", "mole"]
)
def test_a_massless_coordinate_may_be_counted_in_any_unit(
    machine: vi.Mechanism, unit: float
) -> None:
    """A current in nanoamperes takes no more steps than one in amperes."""
    plain, other = from_rest(machine, 20.0), from_rest(in_unit(machine, 1, unit), 20.0)
    assert plain.end is other.end is vi.RunEnd.HORIZON
    assert other.states.tolist() == plain.states.tolist()
    np.testing.assert_allclose(other.time, plain.time, rtol=1e-11)
    at = np.multiply(other.last.position, [unit if i == 1 else 1.0 for i in range(machine.degrees)])
    np.testing.assert_allclose(at, plain.last.position, rtol=1e-10)
