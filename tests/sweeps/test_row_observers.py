"""Observers of rows on (x, v, a), of harmonics, dashpots and single parts: closed forms, quadrature, records."""

from __future__ import annotations

import itertools
import math
from typing import Any

import numpy as np
import pytest
from support import UNIT
from support.members import Case, cases, impacts_in_window, run
from support.systems import paper_damper

import vibroimpact as vi
from vibroimpact.simulation.simulate import Status
from vibroimpact.sweeps.execution.batch import batch_of
from vibroimpact.sweeps.observers import Extremes, Harmonic, Rms

CASES = cases()
NODES, WEIGHTS = np.polynomial.legendre.leggauss(20)


def elements() -> vi.Mechanism:
    """Two masses with a rigid stop, a soft stop and friction."""
    return vi.Mechanism(
        mass=[[1.0, 0.2], [0.2, 0.7]], damping=[[0.1, -0.03], [-0.03, 0.05]], stiffness=[[1.0, -0.2], [-0.2, 0.6]],
        forces=(vi.Harmonic(1.3, (0.6, -0.4), (0.1, 0.2)),), constant_force=(-0.1, 0.2),
        elements=(
            vi.RigidStop((1.0, 0.0), lower=-0.1, restitution=0.6),
            vi.SoftStop((1.0, -1.0), -0.5, 0.4, stiffness=(20.0, 35.0), damping=(0.8, 0.0)),
            vi.Friction((0.0, 1.0), 0.2, 0.3, belt_speed=0.1),
        ),
    )  # fmt: skip


MOTIONS = {
    "damper": CASES["chaotic"],
    "chain": CASES["two contacts"],
    "coupled": CASES["coupled"],
    "dense": CASES["dense"],
    "elements": Case(elements(), vi.State((0.0, 0.0), (1.0, -0.5), 0.4), 3.0, 30.0),
}


def quadrature(case: Case, row: tuple[float, ...]) -> tuple[np.ndarray, ...]:
    """Times of Gauss's nodes between the events of a motion, weights, and row . (x, v, a) there.

    Accelerations are those of the equations of motion.
    """
    m, record = case.mechanism, case.record()
    inside = record.time[(record.time > case.settle) & (record.time < case.settle + case.observe)]
    cuts = np.unique([case.settle, *inside, case.settle + case.observe])
    edges = np.concatenate([
        np.linspace(a, b, 1 + int(b - a), endpoint=False) for a, b in itertools.pairwise(cuts)
    ])  # fmt: skip
    half = np.diff(edges, append=cuts[-1])[:, None] / 2.0
    t = (edges[:, None] + half * (1.0 + NODES)).ravel()
    x, v = record.at(t)
    force = np.array(m.constant_force) - v @ np.array(m.damping).T - x @ np.array(m.stiffness).T
    first = case.state.phase / m.forces[0].omega
    for line in m.forces:
        theta = line.omega * (first + t)
        force += np.outer(np.sin(theta), line.sine) + np.outer(np.cos(theta), line.cosine)
    if any(e.row for e in m.elements):
        rows = np.array([e.row for e in m.elements])
        force += record.forces(t) @ rows
    a = np.linalg.solve(np.array(m.mass), force.T).T
    return t, (half * WEIGHTS).ravel(), np.hstack([x, v, a])[:, : len(row)] @ np.array(row)


@pytest.mark.parametrize("name", MOTIONS)
def test_means_and_harmonics_of_rows_are_those_of_quadrature_by_the_equations_of_motion(
    name: str,
) -> None:
    case, n = MOTIONS[name], MOTIONS[name].mechanism.degrees
    last = (0.0,) * (n - 1)
    rows = {
        "v": (0.0,) * n + (1.0, *last), "a": (0.0,) * 2 * n + (*last, 1.0),
        "mixed": (0.3, *last, *last, -0.5, 0.2, *last),
    }  # fmt: skip
    harmonics = [0.5, 1.0, 7.3]
    observe = [Rms(row=row, label=label) for label, row in rows.items()]
    observe += [Extremes(row=row, label=label) for label, row in rows.items()]
    observe += [
        Harmonic(row=row, label=f"{label}{i}", harmonic=k)
        for label, row in rows.items() for i, k in enumerate(harmonics)
    ]  # fmt: skip
    found = case.member(*observe)
    for label, row in rows.items():
        t, weights, u = quadrature(case, row)
        # motions after hundreds of impacts, of which states are read back with their rounding
        near = 1e-9 * np.abs(u).max()
        assert found[f"{label}_mean"] == pytest.approx(weights @ u / case.observe, abs=near)
        assert found[f"{label}_rms"] == pytest.approx(
            math.sqrt(weights @ u**2 / case.observe), abs=near
        )
        for i, k in enumerate(harmonics):
            whole = abs(weights @ (u * np.exp(-1j * k * case.mechanism.omega * t)))
            assert found[f"{label}{i}_harmonic"] == pytest.approx(
                2.0 * whole / case.observe, abs=near
            ), (label, k)
        # nodes next to an end of flight miss up to u' times their distance
        span = u.max() - u.min()
        assert u.max() - near <= found[f"{label}_largest"] <= u.max() + 0.05 * span
        assert u.min() - 0.05 * span <= found[f"{label}_smallest"] <= u.min() + near


@pytest.mark.parametrize("k", [1.0, 3.0, 40.0, 1024.0])
def test_harmonics_of_an_elastic_ball_are_those_of_a_parabola_and_a_sawtooth(k: float) -> None:
    """Beside it a mass is forced at the frequency of the bounces: fractions of 1/k^2 and 1/k are left."""
    v0, g = 1.5, 2.0
    omega = math.pi * g / v0  # of bounces of 2 v0 / g
    m = vi.Mechanism(
        mass=np.eye(2), damping=np.zeros((2, 2)), stiffness=np.diag([0.0, 1.0]), constant_force=(-g, 0.0),
        forces=(vi.Harmonic(omega, (0.0, 0.01)),),
        elements=(vi.RigidStop((1.0, 0.0), lower=0.0, restitution=1.0),),
    )  # fmt: skip
    bounce = 2.0 * v0 / g
    case = Case(m, vi.State((0.0, 0.0), (v0, 0.0)), 3.0 * bounce, 20.0 * bounce)
    found = case.member(
        Harmonic(row=(1.0, 0.0), label="x", harmonic=k), Harmonic(row=(0.0, 0.0, 1.0, 0.0), label="v", harmonic=k),
        Harmonic(row=(0.0,) * 4 + (1.0, 0.0), label="a", harmonic=k),
        Extremes(row=(0.0, 0.0, 1.0, 0.0), label="v"),
        Rms(row=(0.0, 0.0, 1.0, 0.0), label="v"), Extremes(row=(0.0,) * 4 + (1.0, 0.0), label="a"),
    )  # fmt: skip
    # some hundred roundings of values up to v0, and of times up to 50 turned by k omega
    near = (200.0 + 50.0 * k * omega) * UNIT * v0
    assert found["v_harmonic"] == pytest.approx(2.0 * v0 / (math.pi * k), abs=near)
    assert found["x_harmonic"] == pytest.approx(2.0 * v0 / (math.pi * k) / (k * omega), abs=near)
    assert found["a_harmonic"] == pytest.approx(0.0, abs=near * g)
    assert (found["v_smallest"], found["v_largest"]) == pytest.approx((-v0, v0), rel=200.0 * UNIT)
    assert found["v_rms"] == pytest.approx(v0 / math.sqrt(3.0), rel=200.0 * UNIT)
    assert (found["a_smallest"], found["a_largest"]) == (-g, -g)


def test_a_linear_motion_has_the_amplitudes_of_its_impedance() -> None:
    w, z = 1.2, 0.05
    m = vi.Mechanism(
        mass=[[2.0]], damping=[[4.0 * z]], stiffness=[[2.0]], forces=(vi.Harmonic(w, (0.3,)),),
        elements=(vi.RigidStop((1.0,), upper=50.0),),
    )  # fmt: skip
    size = abs(0.3 / (2.0 - 2.0 * w * w + 4.0j * z * w))
    period = 2.0 * math.pi / w
    found = Case(m, vi.State((0.0,), (0.0,)), 150.0 * period, 4.0 * period).member(
        *(Extremes(row=(0.0,) * k + (1.0,), label="xva"[k]) for k in range(3)),
        *(Harmonic(row=(0.0,) * k + (1.0,), label="xva"[k]) for k in range(3)), "dashpots",
    )  # fmt: skip
    for k, name in enumerate("xva"):
        expected = pytest.approx(size * w**k, rel=1e-10)  # exp(-z 150 period) is left of the start
        assert (found[f"{name}_largest"] - found[f"{name}_smallest"]) / 2.0 == expected
        assert found[f"{name}_harmonic"] == expected
    assert found["power_of_dashpots"] == pytest.approx(2.0 * z * (w * size) ** 2, rel=1e-10)


@pytest.mark.parametrize("name", MOTIONS)
def test_dashpots_take_the_mean_of_v_c_v(name: str) -> None:
    case, n = MOTIONS[name], MOTIONS[name].mechanism.degrees
    speeds = []
    for row in np.eye(n):
        _, weights, v = quadrature(case, (0.0,) * n + tuple(row))
        speeds.append(v)
    taken = np.einsum("it,ij,jt,t->", speeds, np.array(case.mechanism.damping), speeds, weights)
    assert case.member("dashpots")["power_of_dashpots"] == pytest.approx(
        taken / case.observe, rel=1e-9
    )


def test_damping_that_varies_over_a_sweep_is_that_of_each_member() -> None:
    damper = paper_damper("A", 1.2)
    zetas = [0.02, 0.05, 0.3]
    found = vi.sweep(damper, over={"zeta": zetas}, start=damper.free_start(), settle_periods=3, periods=7,
                     observe="dashpots", progress=False)  # fmt: skip
    for zeta, power in zip(zetas, found.power_of_dashpots.values, strict=True):
        period = damper.period
        alone = Case(paper_damper("A", 1.2, zeta=zeta), damper.free_start(), 3 * period, 7 * period)
        assert alone.member("dashpots")["power_of_dashpots"] == pytest.approx(power, rel=1e-12)


@pytest.mark.parametrize("name", ["chain", "elements"])
def test_each_part_loses_and_gives_what_its_impacts_do(name: str) -> None:
    case = MOTIONS[name]
    m, record = case.mechanism, case.record()
    found = case.member("power", "impulse")
    lost, largest = np.zeros(len(m.elements)), np.zeros(len(m.elements))
    struck = impacts_in_window(case, record, Status.IMPACT)
    mass = np.array(m.mass)
    for k in np.flatnonzero(struck):
        before, after = record.velocity_before[k], record.velocity_after[k]
        part, row = record.contact[k], np.array(m.elements[record.contact[k]].row)
        lost[part] += before @ mass @ before / 2.0 - after @ mass @ after / 2.0
        given = mass @ (after - before)
        largest[part] = max(largest[part], abs(given @ row) / (row @ row))
    assert np.count_nonzero(largest) >= 1
    np.testing.assert_allclose(found["power_of_part"] * case.observe, lost, rtol=1e-9, atol=1e-12)
    np.testing.assert_allclose(found["impulse_largest"], largest, rtol=1e-9)
    assert found["power_of_part"].sum() == pytest.approx(found["power"], rel=16.0 * UNIT)


def test_members_in_lanes_have_the_bits_of_each_alone() -> None:
    """Modal lanes and lanes of modes, in packs of many members and with one at a time."""
    rows: list[Any] = [
        "dashpots", Extremes(row=(0.0,) * 5 + (1.0,), label="a"), Rms(row=(0.0, 0.0, 1.0, 0.0), label="v"),
        Harmonic(row=(0.5, 0.0, 0.0, 1.0), label="w", harmonic=2.5), "power", "impulse",
    ]  # fmt: skip
    for case in (MOTIONS["damper"], MOTIONS["elements"]):
        rng = np.random.default_rng(3)
        starts = [
            vi.State((0.0, 0.0), tuple(v), p) for *v, p in rng.uniform(-1.0, 1.0, (21, 3)).tolist()
        ]
        batch = batch_of(case.system, {})
        together = run(batch, starts, case.settle, 20.0, rows)
        for i, start in enumerate(starts[:5]):
            alone = run(batch, [start], case.settle, 20.0, rows)
            for name, values in alone.items():
                np.testing.assert_array_equal(values[0], together[name][i], err_msg=name)
