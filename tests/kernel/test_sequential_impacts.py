"""Impacts of several contacts one after the other: against the law in rational numbers, and closed forms."""

from __future__ import annotations

import itertools
import math
from fractions import Fraction
from pathlib import Path

import numpy as np
import pytest

import vibroimpact as vi
from vibroimpact.machines.json_text import system_of, text_of
from vibroimpact.machines.toml_file import read_case
from vibroimpact.model.mechanism import ImpactLaw

ULPS = 64 * 2.0**-53
Order = list[tuple[int, int]]


def row_of(
    masses: list[float], restitution: float, order: Order | None = None, floor: bool = False,
    law: ImpactLaw = "sequential", stiffness: float = 0.0,
) -> vi.Mechanism:  # fmt: skip
    """Bodies in a row that touch at x = 0; contacts (left, right) in this order, the floor last."""
    n = len(masses)
    pairs = order or list(itertools.pairwise(range(n)))
    rows = [tuple(float(j == b) - float(j == a) for j in range(n)) for a, b in pairs]
    rows += [tuple(-float(j == n - 1) for j in range(n))] if floor else []
    return vi.Mechanism(
        mass=np.diag(masses), damping=np.zeros((n, n)), stiffness=stiffness * np.diag(masses),
        elements=tuple(vi.RigidStop(row, lower=0.0, restitution=restitution) for row in rows),
        impact_law=law,
    )  # fmt: skip


def struck(m: vi.Mechanism, speeds: list[float]) -> vi.Run:
    """The run up to the first event at which the first body arrives, at these speeds."""
    n = len(speeds)
    start = vi.State((-speeds[0], *[0.0] * (n - 1)), (speeds[0], *speeds[1:]))
    return vi.simulate(m, start, impacts=1, t_max=10.0)


def in_turn(masses: list[float], restitution: float, speeds: list[float], order: Order) -> list[Fraction]:  # fmt: skip
    """The law itself, without rounding."""
    m, v = [Fraction(x) for x in masses], [Fraction(x) for x in speeds]
    r = Fraction(restitution)
    for _ in range(10_000):
        approached = False
        for a, b in order:
            rate = v[b] - v[a]
            if rate < -Fraction(1, 10**15):
                approached = True
                p = -(1 + r) * rate * m[a] * m[b] / (m[a] + m[b])
                v[a], v[b] = v[a] - p / m[a], v[b] + p / m[b]
        if not approached:
            return v
    raise AssertionError


@pytest.mark.parametrize("n", [3, 5, 9])
def test_newtons_cradle_passes_its_momentum_to_the_last_ball(n: int) -> None:
    run = struck(row_of([1.0] * n, 1.0), [1.0] + [0.0] * (n - 1))
    assert run.status[-1] == vi.Status.SIMULTANEOUS
    np.testing.assert_allclose(run.velocity_after[-1], [0.0] * (n - 1) + [1.0], atol=ULPS)
    other = struck(row_of([1.0] * n, 1.0, law="moreau"), [1.0] + [0.0] * (n - 1))
    # all others as one body of mass n - 1
    wanted = [(2.0 - n) / n, *[2.0 / n] * (n - 1)]
    np.testing.assert_allclose(other.velocity_after[-1], wanted, atol=ULPS)
    assert (run.impact_law, other.impact_law) == ("sequential", "moreau")


def test_balls_of_a_cradle_that_come_together_leave_together() -> None:
    m = row_of([1.0] * 5, 1.0, stiffness=1.0)
    start = vi.State((0.0,) * 5, (1.0, 1.0, 0.0, 0.0, 0.0))
    run = vi.simulate(m, start, impacts=6, t_max=40.0)
    np.testing.assert_allclose(run.velocity_after[run.impacts][0], [0, 0, 0, 1, 1], atol=ULPS)
    # pendula: back after half a period, and from there in turn, for ever
    np.testing.assert_allclose(np.diff(run.time[run.impacts]), math.pi, rtol=1e2 * ULPS)
    energy = 0.5 * np.sum(run.position**2 + run.velocity_after**2, axis=1)
    np.testing.assert_allclose(energy, 1.0, rtol=1e2 * ULPS)


def test_of_a_ball_between_two_the_order_decides() -> None:
    """Both sides are struck at once: the contact that is first in the list strikes first."""
    found = []
    for order in ([(0, 1), (1, 2)], [(1, 2), (0, 1)]):
        m = row_of([1.0, 2.0, 1.0], 1.0, order)
        run = vi.simulate(m, vi.State((-1.0, 0.0, 1.0), (1.0, 0.0, -1.0)), impacts=1, t_max=5.0)
        wanted = in_turn([1.0, 2.0, 1.0], 1.0, [1.0, 0.0, -1.0], order)
        np.testing.assert_allclose(run.velocity_after[-1], [float(x) for x in wanted], atol=ULPS)
        found.append(run.velocity_after[-1])
    np.testing.assert_allclose(found[0], -found[1][::-1], atol=ULPS)  # mirror images
    assert abs(found[0][1]) > 0.1  # though the middle is struck alike from both sides


@pytest.mark.parametrize("seed", range(12))
def test_rows_of_balls_follow_the_law_in_rational_numbers(seed: int) -> None:
    rng = np.random.default_rng(seed)
    n = int(rng.integers(3, 7))
    masses = [float(x) for x in rng.uniform(0.2, 3.0, n)]
    restitution = float(rng.choice([0.8, 0.95, 1.0]))
    order = [list(itertools.pairwise(range(n)))[i] for i in rng.permutation(n - 1)]
    speeds = [1.0] + [0.0] * (n - 1)
    run = struck(row_of(masses, restitution, order), speeds)
    wanted = in_turn(masses, restitution, speeds, order)
    np.testing.assert_allclose(run.velocity_after[-1], [float(x) for x in wanted], atol=1e2 * ULPS)
    before, after = run.velocity_before[-1], run.velocity_after[-1]
    assert np.dot(masses, after) == pytest.approx(np.dot(masses, before), rel=1e2 * ULPS)
    assert np.dot(masses, after**2) <= np.dot(masses, before**2) * (1.0 + 1e2 * ULPS)


def test_a_row_of_inelastic_balls_hands_on_a_power_of_the_speed() -> None:
    n, r = 6, 0.9
    run = struck(row_of([1.0] * n, r), [1.0] + [0.0] * (n - 1))
    share = (1.0 + r) / 2.0  # nothing catches up with the last one
    np.testing.assert_allclose(run.velocity_after[-1][-1], share ** (n - 1), rtol=ULPS)


@pytest.mark.parametrize("ratio", [1.0, 20.0, 100.0])
def test_a_plastic_ball_between_another_and_the_floor_ends_at_rest(ratio: float) -> None:
    """Each round leaves ratio / (1 + ratio) of the speed: the sum of all rounds is rest."""
    m = row_of([ratio, 1.0], 0.0, floor=True)
    run = vi.simulate(m, vi.State((-1.0, 0.0), (1.0, 0.0)), impacts=1, t_max=5.0)
    assert run.status[-1] == vi.Status.SIMULTANEOUS
    np.testing.assert_allclose(run.velocity_after[-1], 0.0, atol=2.0 * ratio * ULPS)


def test_rounds_that_do_not_end_are_a_status() -> None:
    """A mass of a hundred million: a round takes 1e-8 of its speed."""
    m = row_of([1e8, 1.0], 0.0, floor=True)
    run = vi.simulate(m, vi.State((-1.0, 0.0), (1.0, 0.0)), impacts=10_000)
    assert run.end is vi.RunEnd.STALLED
    assert run.time[-1] == 1.0


def test_derivatives_pass_through_impacts_in_turn() -> None:
    """Speeds of the first body: the others touch all along, so that differences are of one law."""
    m = row_of([1.0, 0.7, 1.9, 0.4], 0.9, stiffness=1.3)

    def after(speed: float) -> np.ndarray:
        run = vi.simulate(m, vi.State((-0.5, 0.0, 0.0, 0.0), (speed, 0.0, 0.0, 0.0)), impacts=1)
        return np.concatenate([run.position[-1], run.velocity_after[-1]])

    found = vi.map_derivative(m, vi.State((-0.5, 0.0, 0.0, 0.0), (1.0, 0.0, 0.0, 0.0)))
    h = 1e-5
    difference = (after(1.0 + h) - after(1.0 - h)) / (2.0 * h)
    np.testing.assert_allclose(found.matrix[:, 4], difference, atol=1e-8)
    assert np.abs(difference[4:]).min() > 0.01


def test_a_sweep_has_the_bits_of_the_runs_and_names_the_law() -> None:
    m = row_of([1.0, 0.8, 1.2], 0.9, stiffness=1.0)
    start = vi.State((-0.5, 0.0, 0.0), (1.0, 0.0, 0.0))
    found = vi.sweep(m, over={"mass[0][0]": [1.0, 1.1]}, start=start, settle_periods=0, periods=20.0,
                     observe=["final", "power", "impulse"], progress=False)  # fmt: skip
    run = vi.simulate(m, start, t_max=20.0, impacts=100_000)
    assert (run.status == vi.Status.SIMULTANEOUS).any()
    assert run.last.velocity == tuple(found.final_velocity.values[0])
    assert found.attrs["impact_law"] == run.to_dataset().attrs["impact_law"] == "sequential"
    mass, k = np.diag([1.0, 0.8, 1.2]), np.diag([1.0, 0.8, 1.2])
    x, v = np.array(run.last.position), np.array(run.last.velocity)
    lost = (1.0 + 0.25) / 2.0 - (v @ mass @ v + x @ k @ x) / 2.0
    assert found.power.values[0] * 20.0 == pytest.approx(lost, rel=1e-12)


def test_files_keep_the_law(tmp_path: Path) -> None:
    m = row_of([1.0, 1.0], 1.0)
    assert system_of(text_of(m)) == m
    assert "impact_law" not in text_of(row_of([1.0, 1.0], 1.0, law="moreau"))
    assert hash(m) != hash(row_of([1.0, 1.0], 1.0, law="moreau"))
    path = tmp_path / "cradle.toml"
    path.write_text(
        "[mechanism]\nmass = [[1.0, 0.0], [0.0, 1.0]]\ndamping = [[0.0, 0.0], [0.0, 0.0]]\n"
        'stiffness = [[0.0, 0.0], [0.0, 0.0]]\nimpact_law = "sequential"\n'
        '[[mechanism.elements]]\nkind = "rigid_stop"\nrow = [-1.0, 1.0]\nlower = 0.0\n'
    )
    assert read_case(path).system == m
    with pytest.raises(vi.InvalidParameterError, match="impact_law = 'poisson': must be"):
        row_of([1.0, 1.0], 1.0, law="poisson")  # type: ignore[arg-type]
