"""What no simulation may break: energy, symmetry, scaling, time shift, determinant, derivatives."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from support import UNIT
from support.kernel import growth, tangents
from support.systems import damper_witness, paper_damper, random_mechanism
from witness import damper as reference
from witness.precision import exact, mp

import vibroimpact as vi

OMEGAS = st.sampled_from([("A", 1.2), ("A", 0.9817), ("B", 0.937), ("C", 0.4172), ("C", 0.3)])
PUSHES = st.floats(0.05, 2.0).map(lambda x: float(np.round(x, 6)))
PULLS = PUSHES.map(lambda x: -x)  # x2 must move against x1, or the motion may never impact


def arrays(run: vi.Run) -> dict[str, Any]:
    """Everything recorded."""
    names = ["time", "status", "side", "position", "velocity_before", "velocity_after",
             "phase", "rate_before", "rate_after"]  # fmt: skip
    return {name: getattr(run, name) for name in names}


def assert_same_bits(run: vi.Run, other: vi.Run, scales: dict[str, float]) -> None:
    """Two runs are equal bit by bit, the second times these powers of two."""
    for name, mine in arrays(run).items():
        np.testing.assert_array_equal(mine, arrays(other)[name] * scales.get(name, 1), name)


@given(case=OMEGAS, v1=PUSHES, v2=PULLS, power=st.integers(-8, 8))
def test_scaling_of_time_by_powers_of_two_changes_no_bit(
    case: tuple[str, float], v1: float, v2: float, power: int
) -> None:
    """(omega_n, omega, delta, t) -> (s omega_n, s omega, delta / s^2, t / s), x -> x / s^2."""
    d, s = paper_damper(*case), 2.0**power
    scaled = replace(
        d, omega_n=s * d.omega_n, omega=s * d.omega, half_clearance=d.half_clearance / s**2
    )
    run = vi.simulate(d, vi.State((0.5, 0.25), (v1, v2), 0.4), impacts=60)
    start = vi.State((0.5 / s**2, 0.25 / s**2), (v1 / s, v2 / s), 0.4)
    other = vi.simulate(scaled, start, impacts=60)
    speeds = dict.fromkeys(("velocity_before", "velocity_after", "rate_before", "rate_after"), s)
    assert_same_bits(run, other, {"time": s, "position": s**2, **speeds})


@given(case=OMEGAS, v1=PUSHES, v2=PULLS, power=st.integers(-20, 20))
def test_scaling_of_force_by_powers_of_two_changes_no_bit(
    case: tuple[str, float], v1: float, v2: float, power: int
) -> None:
    """Only half_clearance / force matters."""
    d, s = paper_damper(*case), 2.0**power
    scaled = replace(d, force=s * d.force, half_clearance=s * d.half_clearance)
    run = vi.simulate(d, vi.State((0.5, 0.25), (v1, v2), 0.4), impacts=60)
    start = vi.State((0.5 * s, 0.25 * s), (v1 * s, v2 * s), 0.4)
    other = vi.simulate(scaled, start, impacts=60)
    names = ("position", "velocity_before", "velocity_after", "rate_before", "rate_after")
    assert_same_bits(run, other, dict.fromkeys(names, 1 / s))


@given(scale=st.floats(0.3, 3.0), v2=PULLS)
def test_scaling_by_any_number_holds_to_rounding(scale: float, v2: float) -> None:
    d = paper_damper("A", 1.2)
    scaled = replace(
        d, omega_n=scale * d.omega_n, omega=scale * d.omega,
        half_clearance=d.half_clearance / scale**2,
    )  # fmt: skip
    start = vi.State((0.5, 0.25), (0.1, v2), 0.4)
    run = vi.simulate(d, start, impacts=8)
    other = vi.simulate(
        scaled,
        vi.State((0.5 / scale**2, 0.25 / scale**2), (0.1 / scale, v2 / scale), 0.4),
        impacts=8,
    )
    size = 1.0 + float(np.abs(run.position).max() + np.abs(run.velocity_before).max())
    # the parameters were rounded: some u of the size at every impact, grown since
    allowed = 64.0 * UNIT * size * growth(d, start, range(1, 9))
    assert np.abs(other.time * scale - run.time).max() <= allowed
    assert np.abs(other.position * scale**2 - run.position).max() <= allowed


@given(case=OMEGAS, v1=PUSHES, v2=PULLS)
def test_the_mirror_image_of_a_motion_has_the_same_bits(
    case: tuple[str, float], v1: float, v2: float
) -> None:
    """(x, v, F) -> (-x, -v, -F) exchanges the stops."""
    m = paper_damper(*case).mechanism
    force = m.forces[0]
    mirrored = replace(m, forces=(vi.Harmonic(force.omega, tuple(-f for f in force.sine)),))
    run = vi.simulate(m, vi.State((0.5, 0.25), (v1, v2), 0.4), impacts=80)
    image = vi.simulate(mirrored, vi.State((-0.5, -0.25), (-v1, -v2), 0.4), impacts=80)
    np.testing.assert_array_equal(run.time, image.time)
    np.testing.assert_array_equal(run.status, image.status)
    np.testing.assert_array_equal(run.side, -image.side)
    np.testing.assert_array_equal(run.position, -image.position)
    np.testing.assert_array_equal(run.velocity_after, -image.velocity_after)


@given(case=OMEGAS, v1=PUSHES, v2=PULLS)
def test_turning_a_contact_row_exchanges_its_stops(
    case: tuple[str, float], v1: float, v2: float
) -> None:
    m = paper_damper(*case).mechanism
    c = m.rigid_stops[0]
    turned = replace(
        m, elements=(vi.RigidStop(tuple(-x for x in c.row), -c.upper, -c.lower, c.restitutions),)
    )
    start = vi.State((0.5, 0.25), (v1, v2), 0.4)
    run, other = vi.simulate(m, start, impacts=80), vi.simulate(turned, start, impacts=80)
    np.testing.assert_array_equal(run.time, other.time)
    np.testing.assert_array_equal(run.side, -other.side)
    np.testing.assert_array_equal(run.position, other.position)


@given(case=OMEGAS, v1=PUSHES, v2=PULLS, share=st.floats(0.05, 0.95))
def test_a_start_later_on_the_same_motion_meets_the_same_impacts(
    case: tuple[str, float], v1: float, v2: float, share: float
) -> None:
    d = paper_damper(*case)
    start = vi.State((0.5, 0.25), (v1, v2), 0.4)
    run = vi.simulate(d, start, impacts=4)
    t = share * float(run.time[0])
    x, v = run.at(t)
    later = vi.State(tuple(x), tuple(v), start.phase + d.omega * t)
    other = vi.simulate(d, later, impacts=4)
    size = 10.0 + float(np.abs(run.position).max() + np.abs(run.velocity_before).max()) + t
    gain = growth(d, start, range(1, 5)) * growth(d, later, range(1, 5))
    np.testing.assert_array_equal(run.status, other.status)
    # the later start is rounded, and so is its phase
    assert np.abs(other.time + t - run.time).max() <= 64.0 * UNIT * size * gain


@given(phase=st.floats(0.0, 6.28), turns=st.integers(-3, 3))
def test_whole_turns_of_phase_change_nothing_but_rounding(phase: float, turns: int) -> None:
    d = paper_damper("A", 1.2)
    start = vi.State((0.5, 0.25), (0.3, -0.2), phase)
    run = vi.simulate(d, start, impacts=5)
    other = vi.simulate(d, replace(start, phase=phase + turns * 2.0 * math.pi), impacts=5)
    size = 10.0 + float(np.abs(run.position).max() + np.abs(run.velocity_before).max())
    allowed = 64.0 * UNIT * size * growth(d, start, range(1, 6))  # 2 pi and the sum are rounded
    assert np.abs(other.time - run.time).max() <= allowed
    assert np.all((other.phase >= 0.0) & (other.phase < 2.0 * math.pi))


@given(seed=st.integers(0, 100_000), n=st.integers(1, 5), contacts=st.integers(1, 3))
@pytest.mark.slow
def test_unforced_energy_never_grows(seed: int, n: int, contacts: int) -> None:
    rng = np.random.default_rng(seed)
    m = random_mechanism(rng, n, contacts=min(n, contacts), lines=0,
                         stiff_rank=int(rng.integers(0, n + 1)))  # fmt: skip
    start = vi.State((0.0,) * n, tuple(rng.normal(size=n)))
    run = vi.simulate(m, start, impacts=60, t_max=100.0)
    mass, stiffness = np.array(m.mass), np.array(m.stiffness)

    def energy(x: Any, v: Any) -> Any:
        quadratic = np.einsum("...i,ij,...j", v, mass, v) + np.einsum(
            "...i,ij,...j", x, stiffness, x
        )
        return 0.5 * quadratic

    along = energy(*run.at(np.linspace(0.0, run.time[-1], 400)))
    # forms of condition below 1e3, flights of a hundred units: 1e3 x 100 u at most per sample
    assert np.all(np.diff(along) <= 1e5 * UNIT * along[0])
    before = energy(run.position, run.velocity_before)
    after = energy(run.position, run.velocity_after)
    assert np.all(after - before <= 1e3 * UNIT * along[0])


def section_basis(m: vi.Mechanism, contact: int) -> tuple[Any, Any]:
    """A direction across the contact's stop on which u grows by one, and a basis along it."""
    n = m.degrees
    row = np.array(m.rigid_stops[contact].row)
    across = np.zeros(2 * n + len(m.forces))
    across[:n] = row / (row @ row)
    along = np.linalg.svd(row[None, :])[2][1:]
    basis = np.eye(across.size)[:, n:]
    inside = np.zeros((across.size, n - 1))
    inside[:n] = along.T
    return across, np.hstack([inside, basis])


def section_map(m: vi.Mechanism, start: vi.State, ends: tuple[int, int], impacts: int) -> Any:
    """Volume gained in section coordinates over some impacts, and the condition of the map."""
    (near, seeds), (far, _) = (section_basis(m, contact) for contact in ends)
    columns, _ = tangents(m, start, seeds, impacts)
    frames = [np.column_stack(pair) for pair in ((near, seeds), (far, columns))]
    volumes = [abs(np.linalg.det(frame)) for frame in frames]
    return volumes[1] / volumes[0], float(np.linalg.cond(frames[1]))


def exact_volume(m: vi.Mechanism, run: vi.Run, leaving: float) -> float:
    """What the determinant identity says of a run that leaves its first stop at this rate.

    In (x, v, theta) the flow has the divergence -tr(M^-1 C). With sigma the volume of a section
    {g = 0}, vol = dg ^ sigma, the flux g' sigma is carried along: a flight from g0'+ to g1'-
    multiplies sigma by g0'+ / |g1'-| exp(-T tr(M^-1 C)); the impact multiplies it by |det J| = R
    and gives g1'+ = R |g1'-|. Along a sequence of impacts the rates cancel but for the ends:

        sigma_N / sigma_0 = (g0'+ / gN'+) prod R_i^2 exp(-T tr(M^-1 C))
    """
    restitutions = [
        m.rigid_stops[c].restitutions[1 if s > 0 else 0]
        for c, s in zip(run.contact, run.side, strict=True)
    ]
    trace = np.trace(np.linalg.solve(np.array(m.mass), np.array(m.damping)))
    damped = math.exp(-float(run.time[-1]) * trace)
    return float(np.prod(np.square(restitutions)) * damped * leaving / run.rate_after[-1])


def determinant_error(m: vi.Mechanism, start: vi.State, impacts: int) -> float | None:
    """Relative error of the identity in units of u, per condition of the map and of its factors.

    d log det = tr(D^-1 dD): rounding of each factor D, and of the product, counts cond(D) times,
    and that of a rate w in |g''| eps_g / w^2, which is taken in units of the greatest speed.
    """
    first = vi.simulate(m, start, impacts=1)
    begin = first.last
    run = vi.simulate(m, begin, impacts=impacts)
    if any(np.any(r.status != vi.Status.IMPACT) for r in (first, run)):
        return None
    contacts = [int(c) for c in (*first.contact, *run.contact)]
    states = [begin] + [
        vi.State(tuple(x), tuple(v), float(p))
        for x, v, p in zip(run.position, run.velocity_after, run.phase, strict=True)
    ]
    side = float(first.side[0])
    leaving = -side * float(np.dot(m.rigid_stops[contacts[0]].row, begin.velocity))
    volume, condition = section_map(m, begin, (contacts[0], contacts[-1]), impacts)
    condition += sum(
        section_map(m, states[i], (contacts[i], contacts[i + 1]), 1)[1] for i in range(impacts)
    )
    fastest = 1.0 + np.abs(run.velocity_before).max() + np.abs(run.position).max()
    rates = np.array([leaving, *run.rate_after])
    condition += float(np.sum((fastest / rates) ** 2))
    if condition > ILL:
        return None
    return abs(volume / exact_volume(m, run, leaving) - 1.0) / (UNIT * condition)


# A factor is good to a few times the eps of a flight of some steps, 2^-53 times 16 and more.
DETERMINANT = 32.0
ILL = 1e9  # maps that lose more than nine digits prove little


@pytest.mark.parametrize("n", [1, 2, 3, 4, 5, 6])
@pytest.mark.one_in(3)
def test_determinant_identity_on_random_systems(n: int) -> None:
    """One to six degrees of freedom, free masses, several contacts, random impact sequences."""
    checked = 0
    for seed in range(30):
        rng = np.random.default_rng(1000 * n + seed)
        m = random_mechanism(rng, n, contacts=int(rng.integers(1, 4)), lines=1,
                             stiff_rank=int(rng.integers(0, n + 1)))  # fmt: skip
        start = vi.State((0.0,) * n, tuple(rng.normal(size=n)), rng.uniform(0.0, 6.28))
        error = determinant_error(m, start, int(rng.integers(1, 7)))
        if error is None:
            continue
        assert error <= DETERMINANT, (n, seed)
        checked += 1
    assert checked >= 20


@pytest.mark.parametrize(("name", "omega"), [("A", 1.2), ("B", 0.937), ("C", 0.4172)])
def test_determinant_identity_on_the_damper(name: str, omega: float) -> None:
    d = paper_damper(name, omega)
    for impacts in (1, 2, 3):
        error = determinant_error(d.mechanism, vi.State((0.3, 0.1), (0.2, 0.7)), impacts)
        assert error is not None
        assert error <= DETERMINANT


def section_state(d: vi.ImpactDamper, q: Any) -> reference.State:
    """From (v1+, x1, v2+, theta) on stop A."""
    v1, x1, v2, theta = q
    return reference.state(x1, v1, x1 + exact(d.half_clearance), v2, phase=theta)


def reference_jacobian(d: vi.ImpactDamper, q: list[float], impacts: int, step: str) -> Any:
    """Central differences at 50 digits of (x1, x2, v1, v2, time) after some impacts."""
    w, h = damper_witness(d), mp.mpf(step)
    columns = []
    for i in range(4):
        ends = []
        for sign in (1, -1):
            moved = [exact(x) + (sign * h if i == j else 0) for j, x in enumerate(q)]
            e = reference.simulate(w, section_state(d, moved), impacts, from_stop="A")[-1]
            ends.append([e.after.x1, e.after.x2, e.after.v1, e.after.v2, e.time])
        columns.append([(a - b) / (2 * h) for a, b in zip(*ends, strict=True)])
    return np.array([[float(x) for x in column] for column in columns]).T


# columns of d(x1, x2, v1, v2, theta) for the section coordinates
SECTION_SEEDS = np.array([[0, 1, 0, 0], [0, 1, 0, 0], [1, 0, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1.0]])


@pytest.mark.parametrize("impacts", [1, 2, 5, 12])
@pytest.mark.parametrize(("name", "omega"), [("A", 1.2), ("B", 0.937), ("C", 0.4172)])
@pytest.mark.one_in(3)
def test_jacobian_agrees_with_high_precision_differences(
    name: str, omega: float, impacts: int
) -> None:
    d = paper_damper(name, omega)
    q = [0.3, 0.4, -1.3, 1.1]
    start = d.on_stop("A", v1=q[0], x1=q[1], v2=q[2], phase=q[3])
    columns, durations = tangents(d, start, SECTION_SEEDS, impacts)
    true = reference_jacobian(d, q, impacts, "1e-18")  # its error is of the order 1e-36
    size = np.abs(true).max()
    # relative to the growth: a hundred u at each impact, grown by what remains
    allowed = 100.0 * UNIT * impacts * max(1.0, size) * growth(d, start, range(1, impacts + 1))
    assert np.abs(columns[:4] - true[:4]).max() <= allowed
    assert np.abs(durations - true[4]).max() <= allowed
    assert np.abs(columns[4] - d.omega * true[4] - np.array([0, 0, 0, 1])).max() <= allowed


def after_release(d: vi.ImpactDamper, q: list[Any]) -> list[Any]:
    """(x1, x2, v1, v2, time) at the impact that follows the first release."""
    events = reference.simulate(damper_witness(d), section_state(d, q), 400, from_stop="A", t_max=8)
    released = next(k for k, e in enumerate(events) if e.kind == "release")
    e = events[released + 1]
    return [e.after.x1, e.after.x2, e.after.v1, e.after.v2, e.time]


def test_jacobian_through_chatter_and_release_agrees_with_differences() -> None:
    """Set C at omega = 0.4205: impacts, chatter, sticking, release, and a flight to stop B."""
    d = paper_damper("C", 0.4205)
    q = [0.75, 1.75, 0.6875, 2.6875]
    start = d.on_stop("A", v1=q[0], x1=q[1], v2=q[2], phase=q[3])
    run = vi.simulate(d, start, impacts=100)
    end = int(np.flatnonzero(run.status == vi.Status.CHATTER)[0])
    assert run.status[end + 3] == vi.Status.IMPACT
    columns, durations = tangents(d, start, SECTION_SEEDS, end + 2)  # the sum counts as one
    direction, h = [0.5, -0.25, 0.75, 1.0], mp.mpf("1e-9")  # any generic direction
    ends = [
        after_release(d, [exact(x) + s * h * y for x, y in zip(q, direction, strict=True)])
        for s in (1, -1)
    ]
    true = np.array([float((a - b) / (2 * h)) for a, b in zip(*ends, strict=True)])
    got = np.append(columns[:4] @ direction, durations @ direction)
    # the sum leaves out terms of order v^2 <= u, whose derivative is of order sqrt(u)
    allowed = 10.0 * math.sqrt(UNIT) * np.abs(true).max()
    assert np.abs(got - true).max() <= allowed
    singular = np.linalg.svd(np.vstack([columns[:4], durations]), compute_uv=False)
    assert singular[-1] <= allowed  # chatter forgets one direction


def test_jacobian_predicts_the_measured_contraction() -> None:
    """Near a stable orbit a deviation shrinks as the powers of DP say, to second order."""
    d = paper_damper("A", 1.2)
    settled = vi.simulate(d, vi.State((0.3, 0.1), (0.2, 0.7)), impacts=4001)
    last = np.flatnonzero(settled.side == 1)[-1]
    (x1, _), (v1, v2) = settled.position[last], settled.velocity_after[last]
    q = np.array([v1, x1, v2, settled.phase[last]])

    def on_stop(q: Any) -> vi.State:
        return d.on_stop("A", v1=q[0], x1=q[1], v2=q[2], phase=q[3])

    def section(run: vi.Run, k: int) -> Any:
        i = 2 * k - 1
        return np.array([run.velocity_after[i, 0], run.position[i, 0], run.velocity_after[i, 1],
                         run.phase[i]])  # fmt: skip

    columns, _ = tangents(d, on_stop(q), SECTION_SEEDS, 2)
    jacobian = columns[[2, 0, 3, 4]]
    push = 1e-6 * np.array([0.3, -0.5, 0.7, 0.2])
    plain = vi.simulate(d, on_stop(q), impacts=60)
    pushed = vi.simulate(d, on_stop(q + push), impacts=60)
    assert np.abs(np.linalg.eigvals(jacobian)).max() < 1.0
    expected = push
    for k in range(1, 31):
        expected = jacobian @ expected
        measured = section(pushed, k) - section(plain, k)
        # second derivatives of the map are of order ten; 1e-12 x 10, and rounding over 1e-6
        assert np.abs(measured - expected).max() <= 1e-10
    assert np.abs(expected).max() < 0.2 * np.abs(push).max()
