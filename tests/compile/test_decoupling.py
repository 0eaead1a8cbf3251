"""Damping of any kind in second-order blocks (src/decouple, decoupling.py)."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import mpmath
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import root
from support.systems import heavy, random_mechanism, random_symmetric

import vibroimpact as vi
from vibroimpact import _kernel
from vibroimpact.compile import hybrid
from vibroimpact.compile.hybrid import Hybrid, compile_mechanism

UNIT = 2.0**-53
Arrays = dict[str, Any]


def decoupled(stiffness: Any, damping: Any) -> Arrays:
    """The blocks of one system of unit masses."""
    found = _kernel.decouple(np.array([stiffness], float), np.array([damping], float))
    return {name: x[0] for name, x in found.items()}


def matrices(blocks: Arrays) -> tuple[Any, Any, Any]:
    """(x, x') by (q, q') of every block, its inverse, and the flow of the blocks."""
    n = len(blocks["k"])
    states, flow = np.zeros((2 * n, 2 * n)), np.zeros((2 * n, 2 * n))
    for j, (k, c) in enumerate(zip(blocks["k"], blocks["c"], strict=True)):
        at, also = blocks["positions"][:, j], blocks["velocities"][:, j]
        states[:, 2 * j] = np.concatenate([at, -k * also])
        states[:, 2 * j + 1] = np.concatenate([also, at - c * also])
        flow[2 * j : 2 * j + 2, 2 * j : 2 * j + 2] = [[0.0, 1.0], [-k, -c]]
    return states, blocks["back"], flow


def companion(stiffness: Any, damping: Any) -> Any:
    n = len(stiffness)
    return np.block([[np.zeros((n, n)), np.eye(n)], [-np.array(stiffness), -np.array(damping)]])


def check_blocks(stiffness: Any, damping: Any) -> None:
    """T T^-1 = 1 and T F T^-1 = B, within what rounding of so many products can leave."""
    blocks = decoupled(stiffness, damping)
    assert blocks["found"] == 1.0
    states, back, flow = matrices(blocks)
    n = len(states)
    terms = np.abs(states) @ np.abs(back)
    assert np.all(np.abs(states @ back - np.eye(n)) <= 64 * n * UNIT * np.max(terms))
    terms = np.abs(states) @ np.abs(flow) @ np.abs(back)
    error = np.abs(states @ flow @ back - companion(stiffness, damping))
    assert np.max(error) <= 64 * n * UNIT * np.max(terms)


def random_pair(seed: int) -> tuple[Any, Any]:
    """Stiffness and damping of two to eight unit masses; damping light to heavy, of any rank."""
    rng = np.random.default_rng(seed)
    n = int(rng.integers(2, 9))
    rank = int(rng.integers(1, n + 1))
    return random_symmetric(rng, n, n), 10 ** rng.uniform(-2, 1.5) * random_symmetric(rng, n, rank)


@pytest.mark.parametrize("seed", range(40))
def test_blocks_are_the_equation_of_motion(seed: int) -> None:
    check_blocks(*random_pair(seed))


@pytest.mark.parametrize("seed", range(10))
def test_every_eigenvalue_is_one_of_a_block(seed: int) -> None:
    """Each to rounding of the matrix, by 50 digits; k and c give its equation."""
    stiffness, damping = random_pair(seed)
    blocks = decoupled(stiffness, damping)
    with mpmath.workdps(50):
        exact = mpmath.eig(mpmath.matrix(companion(stiffness, damping)), left=False, right=False)
        left = [mpmath.mpc(x) for x in exact]
        for k, c in zip(blocks["k"].tolist(), blocks["c"].tolist(), strict=True):
            root = mpmath.sqrt(mpmath.mpf(c) ** 2 / 4 - mpmath.mpf(k))
            for x in (-mpmath.mpf(c) / 2 + root, -mpmath.mpf(c) / 2 - root):
                nearest = min(left, key=lambda y, x=x: abs(x - y))
                size = max(abs(y) for y in exact)
                assert abs(nearest - x) <= 1e-12 * size
                left.remove(nearest)
        assert not left


def critical(seed: int) -> list[tuple[Any, Any]]:
    """Systems on either side of where two eigenvalues meet on the real line."""
    rng = np.random.default_rng(seed)
    n = int(rng.integers(2, 5))
    stiffness, damping = random_symmetric(rng, n, n), random_symmetric(rng, n, n)

    def real(factor: float) -> int:
        return int(np.sum(np.linalg.eigvals(companion(stiffness, factor * damping)).imag == 0.0))

    light, strong = 0.01, 30.0
    if real(light) == real(strong):
        return []
    for _ in range(60):
        middle = (light + strong) / 2
        if real(middle) == real(light):
            light = middle
        else:
            strong = middle
    factors = (light, strong, light * (1.0 - 1e-10), strong * (1.0 + 1e-10), strong * (1.0 + 1e-6))
    return [(stiffness, factor * damping) for factor in factors]


@pytest.mark.parametrize("seed", range(20))
def test_critical_damping_of_a_pair_costs_no_digits(seed: int) -> None:
    """Where each eigenvalue alone keeps half of them."""
    for stiffness, damping in critical(seed):
        check_blocks(stiffness, damping)


@pytest.mark.parametrize("apart", [0.0, 1e-14, 1e-10, 1e-6])
def test_equal_pairs_of_parts_that_do_not_touch_are_blocks(apart: float) -> None:
    """Two equal structures, or nearly, in coordinates that mix them."""
    rng = np.random.default_rng(7)
    turn = np.linalg.qr(rng.normal(size=(4, 4)))[0]
    stiffness = np.kron(np.eye(2), [[2.0, -1.0], [-1.0, 1.5]])
    stiffness[2, 2] += apart
    damping = np.kron(np.eye(2), [[0.1, 0.02], [0.02, 0.3]])
    check_blocks(turn.T @ stiffness @ turn, turn.T @ damping @ turn)


def test_real_eigenvalues_that_meet_are_paired_whatever_is_around_them() -> None:
    """Signs + - + - from above, the middle ones about to become conjugate."""

    def system(strength: float) -> tuple[Any, Any]:
        stiffness = np.array([[2.0, 0.05], [0.05, 2.0 * strength**2]])
        return stiffness, np.diag([3.0, 3.0 * strength])

    def real(strength: float) -> int:
        return int(np.sum(np.linalg.eigvals(companion(*system(strength))).imag == 0.0))

    conjugate, apart = 2.0, 2.3
    assert (real(conjugate), real(apart)) == (2, 4)
    for _ in range(50):
        middle = (conjugate + apart) / 2
        if real(middle) == 2:
            conjugate = middle
        else:
            apart = middle
    for strength in (conjugate, apart, apart + 1e-9, apart + 1e-6, apart + 1e-3, 2.3):
        check_blocks(*system(strength))


@pytest.mark.parametrize("rates", [1e2, 1e4, 1e6, 1e7])
def test_a_soft_part_beside_a_stiff_one_keeps_its_digits(rates: float) -> None:
    """To those of the numbers given, by 60 digits."""
    stiffness = np.diag([rates**2, 1.0])
    damping = np.array([[0.4, -0.1], [-0.1, 0.05]])
    found = decoupled(stiffness, damping)
    with mpmath.workdps(60):
        values = mpmath.eig(mpmath.matrix(companion(stiffness, damping)), left=False, right=False)
        slow = min(values, key=abs)
        k, c = float(abs(slow) ** 2), float(-2 * slow.real)
    j = np.argmin(found["k"])
    assert found["k"][j] == pytest.approx(k, rel=1e-14)
    assert found["c"][j] == pytest.approx(c, rel=1e-13)


def test_a_soft_spring_beside_a_stiff_one_is_one() -> None:
    """In vibration modes, too: what is lost in rounding is told by the terms of each entry."""
    m = vi.Mechanism(
        mass=[[1.0, 0.0], [0.0, 1.0]], stiffness=[[1e15, 0.0], [0.0, 1.0]],
        damping=[[0.1, 0.0], [0.0, 0.2]], elements=(vi.RigidStop((-1.0, 1.0), upper=0.5),),
    )  # fmt: skip
    assert sorted(Hybrid(m).free.flow["k"]) == [1.0, 1e15]  # type: ignore[call-overload]


@pytest.mark.parametrize("seed", range(30))
def test_two_equal_structures_that_hit_each_other_are_blocks(seed: int) -> None:
    one = random_pair(seed)
    stiffness, damping = (np.kron(np.eye(2), a[:2, :2]).tolist() for a in one)
    row = (1.0, 0.0, -1.0, 0.0)
    m = vi.Mechanism(
        mass=np.eye(4).tolist(), stiffness=stiffness, damping=damping,
        elements=(vi.RigidStop(row, upper=0.1),),
    )  # fmt: skip
    assert not Hybrid(m).dense


def test_pairs_that_meet_with_one_shape_have_no_blocks() -> None:
    """Two oscillators tuned apart, and dashpots that make their conjugate pairs one."""
    stiffness = np.diag([0.95, 1.05])

    def damping(strengths: Any) -> Any:
        both, difference = strengths
        return both * np.ones((2, 2)) + np.diag([difference, -difference])

    def gap(strengths: Any) -> list[float]:
        """Square of the difference of the eigenvalues in the upper half plane."""
        values = np.linalg.eigvals(companion(stiffness, damping(strengths)))
        first, second = values[values.imag > 0.0]
        square = (first - second) ** 2
        return [square.real, square.imag]

    meeting = root(gap, [0.05, 0.0], tol=1e-14).x
    assert np.hypot(*gap(meeting)) < 1e-12
    assert decoupled(stiffness, damping(meeting))["found"] == 0.0
    check_blocks(stiffness, damping(meeting + 1e-2))


@pytest.mark.parametrize("what", ["stiffness", "damping"])
def test_systems_that_grow_have_no_blocks(what: str) -> None:
    stiffness, damping = random_pair(3)
    down = {"stiffness": stiffness, "damping": damping}
    down[what] = down[what] - 5.0 * np.eye(len(stiffness))
    assert decoupled(**down)["found"] == 0.0


@pytest.mark.parametrize("unit", [1e-9, 3.7e-4, 1e7])
def test_the_unit_of_time_does_not_matter(unit: float) -> None:
    stiffness, damping = random_pair(6)
    check_blocks(stiffness * unit**2, damping * unit)


@settings(max_examples=200, deadline=None)
@given(
    st.integers(2, 4),
    st.lists(st.sampled_from([-1.0, 0.0, 0.5, 1.0, 2.0]), min_size=20, max_size=20),
)
def test_systems_of_few_numbers_are_blocks_or_said_to_have_none(
    n: int, numbers: list[float]
) -> None:
    """Equal, zero and simple entries: repeated eigenvalues, free masses, parts that stand alone."""
    half = np.reshape(numbers[: n * n], (n, n)) if n * n <= 20 else np.eye(n)
    stiffness = half @ half.T
    rows = np.reshape((numbers * 2)[: n * 2], (n, 2))
    damping = rows @ rows.T
    if decoupled(stiffness, damping)["found"]:
        check_blocks(stiffness, damping)


def full_matrix(monkeypatch: pytest.MonkeyPatch) -> None:
    """Follow what is simulated next in physical coordinates."""
    monkeypatch.setattr(hybrid, "decoupled", lambda *_: None)


def motion(seed: int) -> tuple[vi.Mechanism, vi.State]:
    """Two to five masses, one to three contacts, up to two lines, perhaps a constant force."""
    rng = np.random.default_rng(seed)
    n, contacts, lines = (int(rng.integers(low, high)) for low, high in ((2, 6), (1, 4), (0, 3)))
    m = random_mechanism(rng, n, contacts=contacts, lines=lines)
    damping = np.array(m.damping) * rng.choice([0.2, 1.0, 30.0])
    push = tuple(rng.normal(size=n) * 0.1 * rng.integers(0, 2))
    start = vi.State(
        tuple(rng.normal(size=n) * 1e-3), tuple(rng.normal(size=n)), 0.6 if lines else 0.0
    )
    return replace(m, damping=damping.tolist(), constant_force=push), start


@pytest.mark.parametrize("seed", range(24))
def test_motions_are_those_of_the_full_matrix(seed: int, monkeypatch: pytest.MonkeyPatch) -> None:
    mechanism, state = motion(seed)
    monkeypatch.setattr(hybrid, "_compiled", hybrid._compiled.__wrapped__)
    monkeypatch.setattr(hybrid, "_hybrid", hybrid._hybrid.__wrapped__)
    compiled = Hybrid(mechanism)
    assert compiled.mixed
    assert not compiled.dense
    run = vi.simulate(mechanism, state, impacts=12)
    full_matrix(monkeypatch)
    assert compile_mechanism(mechanism).dense
    full = vi.simulate(mechanism, state, impacts=12)
    assert np.array_equal(run.status, full.status)
    assert run.time == pytest.approx(full.time, abs=1e-9)
    times = np.linspace(0.0, run.time[-1], 500)[:-1]
    assert run.at(times)[0] == pytest.approx(full.at(times)[0], abs=1e-8)
    for name in ("position", "velocity_before", "velocity_after"):
        assert getattr(run, name) == pytest.approx(getattr(full, name), abs=1e-8)


MANY = [seed for seed in range(60, 90) if len(heavy(seed)[0].rigid_stops) > 2]


@pytest.mark.parametrize("seed", MANY)
def test_rest_on_several_stops_is_that_of_the_full_matrix(
    seed: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Bouncing, at rest and after. Chatter may be summed an impact earlier in one of them."""
    mechanism, state = heavy(seed, "general")
    monkeypatch.setattr(hybrid, "_compiled", hybrid._compiled.__wrapped__)
    monkeypatch.setattr(hybrid, "_hybrid", hybrid._hybrid.__wrapped__)
    assert Hybrid(mechanism).mixed
    run = vi.simulate(mechanism, state, impacts=30)
    full_matrix(monkeypatch)
    full = vi.simulate(mechanism, state, impacts=30)
    times = np.linspace(0.0, min(run.time[-1], full.time[-1]), 1000)[:-1]
    assert run.at(times)[0] == pytest.approx(full.at(times)[0], abs=1e-9)


def dragged(force: float, **changes: Any) -> vi.Mechanism:
    """A mass on a spring, and one that a dashpot to the ground and one between them drag."""
    return vi.Mechanism(
        mass=[[1.0, 0.0], [0.0, 0.5]], stiffness=[[2.0, 0.0], [0.0, 0.0]],
        damping=[[0.3, -0.2], [-0.2, 0.3]], constant_force=(0.0, force),
        elements=(vi.RigidStop((-1.0, 1.0), -1.0, 1.0, 0.8),),
    ) if not changes else replace(dragged(force), **changes)  # fmt: skip


def test_a_dragged_free_mass_is_a_block_unless_a_constant_force_drives_it() -> None:
    """It then has no place of rest: the full matrix follows it."""
    assert Hybrid(dragged(0.0)).mixed
    assert 0.0 in Hybrid(dragged(0.0)).free.flow["k"]  # type: ignore[operator]
    assert Hybrid(dragged(0.1)).dense


@pytest.mark.parametrize("force", [-1e-9, -1e-7, 1e-3])
def test_a_force_on_loose_masses_is_seen_whatever_stop_they_are_on(force: float) -> None:
    """Near or far; only closed contacts couple the masses that no spring holds."""
    m = vi.Mechanism(
        mass=np.diag([1.0, 2.0, 1.0, 1.0]).tolist(),
        stiffness=np.diag([0.0, 0.0, 1e9, 1.3e9]).tolist(),
        damping=np.diag([100.0, 300.0, 50.0, 70.0]).tolist(),
        constant_force=(force, force, 0.0, 0.0),
        elements=(
            vi.RigidStop((1.0, -1.0, 1.0, 0.0), -1e-6, 1.0, 0.5),
            vi.RigidStop((0.0, 0.0, 1.0, -1.0), -1e-6, 1.0, 0.5),
            vi.RigidStop((0.0, 0.0, 0.0, 1.0), -1e-6, 1.0, 0.5),
        ),
    )
    assert Hybrid(m).dense
    assert not Hybrid(replace(m, constant_force=(0.0,) * 4)).dense


def test_forcing_at_an_undamped_mode_is_left_to_the_full_matrix() -> None:
    """A third mass swings undamped beside the others, at the frequency of the force."""
    two = dragged(0.0)

    def beside(omega: float) -> vi.Mechanism:
        def with_third(a: Any, entry: float) -> Any:
            return np.block([[np.array(a), np.zeros((2, 1))], [np.zeros((1, 2)), entry]]).tolist()

        return vi.Mechanism(
            mass=with_third(two.mass, 1.0), stiffness=with_third(two.stiffness, 4.0),
            damping=with_third(two.damping, 0.0), forces=(vi.Harmonic(omega, (0.0, 0.0, 1.0)),),
            elements=(vi.RigidStop((-1.0, 1.0, 0.0), -1.0, 1.0, 0.8),),
        )  # fmt: skip

    assert Hybrid(beside(1.7)).mixed
    assert Hybrid(beside(2.0)).dense


def test_more_contacts_than_can_be_looked_at_first_are_left_to_the_full_matrix() -> None:
    rng = np.random.default_rng(1)
    assert Hybrid(random_mechanism(rng, 5, contacts=hybrid.MOST_CONTACTS_ALL_BLOCKS)).mixed
    assert Hybrid(random_mechanism(rng, 5, contacts=hybrid.MOST_CONTACTS_ALL_BLOCKS + 1)).dense
