"""All Lyapunov exponents of single motions, against multipliers, determinants and closed forms."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

import vibroimpact as vi
from vibroimpact.machines.published import parameter_sets
from vibroimpact.simulation.lyapunov import errors_of, weighted_ratio
from vibroimpact.simulation.lyapunov_spectrum import _last_part
from vibroimpact.simulation.simulate import RunEnd

SETS = parameter_sets()
PLAIN = vi.State((0.0, 0.0), (0.0, 1.0))
CHAOS = SETS["C"].damper(0.418)
CHATTER = SETS["C"].damper(0.41719)


def mass(damping: float, *walls: vi.RigidStop, **more: object) -> vi.Mechanism:
    """A mass of one that no spring holds, between walls."""
    return vi.Mechanism(
        mass=[[1.0]], damping=[[damping]], stiffness=[[0.0]], elements=walls, **more
    )


def falling(restitution: float) -> vi.Mechanism:
    """A ball above a table that shakes harder than gravity holds it."""
    return mass(
        0.0, vi.RigidStop((1.0,), lower=0.0, restitution=restitution),
        forces=(vi.Harmonic(1.0, (2.0,)),), constant_force=(-1.0,),
    )  # fmt: skip


def stack() -> vi.Mechanism:
    """Two elastic masses one above the other in gravity: conservative and chaotic."""
    return vi.Mechanism(
        mass=[[1.0, 0.0], [0.0, 0.4]], damping=np.zeros((2, 2)), stiffness=np.zeros((2, 2)),
        constant_force=(-1.0, -0.4),
        elements=(vi.RigidStop((1.0, 0.0), lower=0.0), vi.RigidStop((-1.0, 1.0), lower=0.0)),
    )  # fmt: skip


STACKED = vi.State((1.0, 2.1), (0.0, 0.3))


# ---- periodic motion -----------------------------------------------------------------------------

TWO_CONTACTS = vi.Mechanism(
    mass=[[1.0, 0.0], [0.0, 0.5]], damping=[[0.2, -0.1], [-0.1, 0.1]],
    stiffness=[[2.0, -1.0], [-1.0, 1.0]], forces=(vi.Harmonic(1.1, (1.0, 0.0)),),
    elements=(
        vi.RigidStop((1.0, 0.0), upper=0.6, restitution=0.7),
        vi.RigidStop((-1.0, 1.0), lower=-0.9, restitution=(0.5, 1.0)),
    ),
)  # fmt: skip
PERIODIC = {
    "set A": (SETS["A"].damper(1.2), PLAIN),
    "set A, 2-2-2": (SETS["A"].damper(0.9817), PLAIN),
    "set B": (SETS["B"].damper(1.05), PLAIN),
    "one stop": (
        vi.ImpactOscillator(zeta=0.1, omega=2.0, restitution=0.6, clearance=0.0),
        vi.State((0.0,), (-0.1,)),
    ),
    "two contacts": (TWO_CONTACTS, vi.State((0.0, 0.0), (0.0, 0.0))),
}


@pytest.mark.parametrize("name", PERIODIC)
@pytest.mark.one_in(3)
def test_exponents_of_periodic_motion_are_those_of_its_multipliers(name: str) -> None:
    system, start = PERIODIC[name]
    found = vi.lyapunov_spectrum(system, start, impacts=8000, settle_impacts=4000)
    orbit = vi.find_orbit(system, vi.simulate(system, start, impacts=9000).last)
    assert orbit.stable
    wanted = np.log(np.sort(np.abs(orbit.multipliers))[::-1]) / orbit.period
    # smooth weights on 7500 impacts leave less than rounding of the rotation of a tangent
    np.testing.assert_allclose(found.values, wanted, rtol=0.0, atol=1e-10)
    assert np.all(np.abs(found.values - wanted) <= 3.0 * found.errors)
    assert found.negative.all()
    assert found.dimension == 0.0
    assert found.determinant_error < 1e-12


# ---- the sum -------------------------------------------------------------------------------------


def logarithm_of_volumes(run: vi.Run, first: int, last: int) -> float:
    """log R^2 of the impacts after one and up to another, less the trace over the time between."""
    m = run.system.mechanism if hasattr(run.system, "mechanism") else run.system
    trace = float(np.trace(np.linalg.solve(np.array(m.mass), np.array(m.damping))))
    losses = 0.0
    for k in range(first + 1, last + 1):
        lower, upper = m.rigid_stops[run.contact[k]].restitutions
        losses += 2.0 * math.log(upper if run.side[k] > 0 else lower)
    return losses - trace * float(run.time[last] - run.time[first])


def test_exponents_of_chaos_add_up_to_the_determinant() -> None:
    found = vi.lyapunov_spectrum(CHAOS, PLAIN, impacts=4000)
    assert found.positive[0]
    assert found.determinant_error < 1e-12
    assert found.flow == 0.0
    volumes = 2.0 * math.log(CHAOS.restitution) - 2.0 * CHAOS.zeta * CHAOS.omega_n * found.duration
    np.testing.assert_allclose(found.growth.sum(axis=1), volumes, rtol=0.0, atol=1e-10)
    # the contraction is a mean of these
    assert found.contraction == pytest.approx(weighted_ratio(volumes, found.duration), rel=1e-13)


def test_the_contraction_counts_every_impact_with_its_own_restitution() -> None:
    start = PERIODIC["two contacts"][1]
    found = vi.lyapunov_spectrum(TWO_CONTACTS, start, impacts=4000, settle_impacts=4000)
    run = vi.simulate(TWO_CONTACTS, start, impacts=9000)
    orbit = vi.find_orbit(TWO_CONTACTS, run.last)
    per_period = len(orbit.signature.impacts)
    volumes = logarithm_of_volumes(run, len(run) - 1 - per_period, len(run) - 1)
    assert found.contraction == pytest.approx(volumes / orbit.period, rel=1e-10)


@pytest.mark.slow
def test_long_flights_keep_the_sum() -> None:
    """The free mass crosses 4000 forced amplitudes; the main one forgets e^500 meanwhile."""
    damper = vi.ImpactDamper(
        mass_ratio=0.1, omega_n=1.0, zeta=0.3, restitution=0.9, half_clearance=2000.0, omega=1.0
    )
    start = vi.State((0.0, 0.0), (0.0, 2.0))
    found = vi.lyapunov_spectrum(damper, start, impacts=1024, settle_impacts=100)
    assert np.isfinite(found.values).all()
    assert found.duration.mean() * 2.0 * damper.zeta > 300.0
    assert found.determinant_error < 1e-12


# ---- circles and chaos ---------------------------------------------------------------------------


@pytest.mark.parametrize(("letter", "omega"), [("B", 0.975), ("B", 0.96), ("A", 1.0)])
def test_on_a_circle_one_exponent_is_zero_and_the_others_are_negative(
    letter: str, omega: float
) -> None:
    found = vi.lyapunov_spectrum(
        SETS[letter].damper(omega), PLAIN, impacts=8000, settle_impacts=8000
    )
    assert found.zero.tolist() == [True, False, False, False]
    assert found.negative.tolist() == [False, True, True, True]
    assert found.errors[0] < 1e-4
    assert found.dimension == 1.0
    assert "1 zero, 3 negative" in repr(found)


@pytest.mark.parametrize("damper", [CHAOS, CHATTER], ids=["chaos", "with chatter"])
def test_the_largest_exponent_of_chaos_is_that_of_lyapunov_exponent(
    damper: vi.ImpactDamper,
) -> None:
    found = vi.lyapunov_spectrum(damper, PLAIN, impacts=10_000)
    wanted = vi.lyapunov_exponent(damper, PLAIN, impacts=10_000)
    assert found.positive[0]
    assert wanted.is_positive
    assert abs(found.values[0] - wanted.value) <= 3.0 * math.hypot(found.errors[0], wanted.error)


@pytest.mark.slow
def test_errors_cover_the_scatter_of_many_chaotic_runs() -> None:
    """In units of its error a value scatters by one; of 32 values here by 0.7 to 1.3 at 99 %."""
    found = [
        vi.lyapunov_spectrum(CHAOS, vi.State((0.0, 0.0), (0.0, 1.0 + 0.013 * k)), impacts=2000)
        for k in range(16)
    ]
    values, errors = (np.array([getattr(x, name) for x in found]) for name in ("values", "errors"))
    scatter = values.std(axis=0, ddof=1) / np.sqrt((errors**2).mean(axis=0))
    assert np.all((scatter > 0.35) & (scatter < 1.6))


def test_errors_of_independent_growth_are_those_of_its_mean() -> None:
    rng = np.random.default_rng(5)
    growth, duration = rng.normal(size=(4096, 200)), np.ones(4096)
    errors = errors_of(growth, duration)
    # 1.16 by the weights, and by a sixth for the larger of two; 200 errors of 18 % each
    assert errors.mean() * math.sqrt(4096) == pytest.approx(1.16 * 1.17, rel=0.06)
    outside = np.abs(weighted_ratio(growth, duration)) > 3.0 * errors
    assert outside.mean() < 0.02


# ---- closed forms --------------------------------------------------------------------------------


@pytest.mark.parametrize(("gain", "restitution"), [(0.3, 0.6), (0.05, 0.9), (1.0, 0.3)])
def test_a_self_excited_mass_between_two_walls_has_the_exponent_of_its_gain(
    gain: float, restitution: float
) -> None:
    """x'' = c x' gains c L in speed between walls: v -> R (v + c L), with the period ln(1/R) / c.

    The multiplier is R per impact, and the exponent is ln R / period = -c.
    """
    walls = vi.RigidStop((1.0,), 0.0, 1.0, restitution)
    found = vi.lyapunov_spectrum(mass(-gain, walls), vi.State((0.5,), (1.0,)), impacts=1024)
    np.testing.assert_allclose(found.values, [-gain], rtol=1e-12)
    np.testing.assert_allclose(found.per_impact, [math.log(restitution)], rtol=1e-12)


def test_two_independent_masses_have_both_exponents_and_a_zero_for_their_phases() -> None:
    pair = vi.Mechanism(
        mass=[[1.0, 0.0], [0.0, 2.0]], damping=[[-0.3, 0.0], [0.0, -0.4]],
        stiffness=np.zeros((2, 2)),
        elements=(
            vi.RigidStop((1.0, 0.0), 0.0, 1.0, 0.6), vi.RigidStop((0.0, 1.0), 0.0, 1.5, 0.7),
        ),
    )  # fmt: skip
    found = vi.lyapunov_spectrum(pair, vi.State((0.5, 0.3), (1.0, 0.7)), impacts=4000)
    wanted = np.array([0.0, -0.2, -0.3])
    np.testing.assert_allclose(found.values, wanted, rtol=0.0, atol=1e-6)
    assert np.all(np.abs(found.values - wanted) <= 3.0 * found.errors)
    assert found.zero.tolist() == [True, False, False]
    assert found.dimension == 1.0


def test_a_free_mass_between_walls_loses_a_difference_of_speeds_at_the_rate_of_its_losses() -> None:
    """Speeds go as R^k, and so do differences of them and the velocity of the flow."""
    walls = vi.RigidStop((1.0,), 0.0, 1.0, (0.999, 0.998))
    found = vi.lyapunov_spectrum(
        mass(0.0, walls), vi.State((0.5,), (1.0,)), impacts=1024, settle_impacts=0
    )
    wanted = 0.5 * (math.log(0.999) + math.log(0.998))
    np.testing.assert_allclose(found.per_impact, [wanted], rtol=1e-4)  # alternate impacts
    assert found.flow == pytest.approx(found.values[0], rel=1e-12)
    assert found.contraction == pytest.approx(2.0 * found.values[0], rel=1e-3)
    assert found.determinant_error < 1e-12


def test_exponents_without_losses_come_in_pairs_around_the_zero_of_the_energy() -> None:
    found = vi.lyapunov_spectrum(stack(), STACKED, impacts=8000)
    assert found.positive.tolist() == [True, False, False]
    assert found.zero.tolist() == [False, True, False]
    assert found.contraction == 0.0
    # the sum differs from 0 by the growth of the flow between the ends only
    np.testing.assert_allclose(found.values + found.values[::-1], 0.0, atol=1e-3)
    assert abs(found.sum + found.flow) < 1e-12
    assert found.dimension == pytest.approx(3.0, abs=1e-3)


TWO_LINES = vi.Mechanism(
    mass=[[1.0]], damping=[[0.1]], stiffness=[[1.0]],
    forces=(vi.Harmonic(1.0, (2.0,)), vi.Harmonic(math.sqrt(2.0), (0.5,))),
    elements=(vi.RigidStop((1.0,), upper=0.3, restitution=0.8),),
)  # fmt: skip


@pytest.mark.parametrize(
    ("system", "start"),
    [(SETS["B"].damper(0.975), PLAIN), (TWO_LINES, vi.State((0.0,), (0.0,))), (stack(), STACKED)],
    ids=["circle", "two lines", "without forcing"],
)
def test_exponents_are_those_that_sweeps_observe(system: vi.Mechanism, start: vi.State) -> None:
    """The observer carries jets through the same flights, and knows no errors."""
    found = vi.lyapunov_spectrum(system, start, impacts=8000)
    unit = 2.0 * math.pi / system.omega if system.omega else 1.0
    swept = vi.sweep(
        system, over={}, start=vi.GridStarts({"phase": [start.phase]}, start), observe="spectrum",
        settle_periods=500, periods=math.ceil(2000 / unit), progress=False,
    )  # fmt: skip
    observed = np.sort(swept.spectrum.values.ravel())[::-1]
    assert observed.shape == found.values.shape
    # bounded factors at both ends of a time of 2000, and the errors of both in chaos
    np.testing.assert_array_less(abs(observed - found.values), 8.0 / 2000 + 6.0 * found.errors)


def test_two_lines_have_a_zero_for_the_phase_between_them() -> None:
    found = vi.lyapunov_spectrum(TWO_LINES, vi.State((0.0,), (0.0,)), impacts=2000)
    assert found.values.shape == (3,)
    assert (found.values[0], found.errors[0]) == (0.0, 0.0)
    assert found.zero.tolist() == [True, False, False]
    assert found.determinant_error < 1e-12
    largest = vi.lyapunov_exponent(TWO_LINES, vi.State((0.0,), (0.0,)), impacts=2000)
    assert abs(largest.value) <= 3.0 * largest.error


# ---- what is forgotten, and what ends ------------------------------------------------------------


def test_chatter_that_ends_in_rest_forgets_two_directions() -> None:
    found = vi.lyapunov_spectrum(CHATTER, PLAIN, impacts=4000)
    assert np.isneginf(found.values).tolist() == [False, False, True, True]
    assert found.sum == found.contraction == -math.inf
    assert found.determinant_error == 0.0
    assert "2 -inf" in found.statement


def test_what_sticking_leaves_has_the_multipliers_of_the_tangents_through_it() -> None:
    """Two of four multipliers of a period with chatter, rest and release are not zero."""
    damper = replace(SETS["C"].damper(0.6), restitution=0.3)
    run = vi.simulate(damper, PLAIN, impacts=6000)
    chatters = np.flatnonzero(run.status == vi.Status.CHATTER)
    first, last = chatters[-5] - 3, chatters[-3] - 3  # one period: it rests at both stops in turn
    start = vi.State(
        tuple(run.position[first]), tuple(run.velocity_after[first]), float(run.phase[first])
    )
    period = float(run.time[last] - run.time[first])
    assert period == pytest.approx(3 * damper.period, rel=1e-9)
    through = vi.map_derivative(damper, start, impacts=int(run.impacts[first + 1 : last + 1].sum()))
    sizes = np.sort(np.abs(np.linalg.eigvals(through.matrix)))[::-1]
    found = vi.lyapunov_spectrum(damper, PLAIN, impacts=8000, settle_impacts=4000)
    wanted = np.log(sizes[:2]) / period
    # 220 periods in the average: the weights leave e^-26 of growth by some e-folds
    np.testing.assert_allclose(found.values[:2], wanted, rtol=0.0, atol=1e-8)
    assert np.isneginf(found.values[2:]).all()


def test_a_direction_that_long_flights_nearly_lose_is_not_what_sticking_forgets() -> None:
    """Fast modes shrink by e^-40 between impacts; one rest takes exactly two directions more."""
    rng = np.random.default_rng(8)
    rng.integers(2, 4)
    fast, off = 10.0 ** rng.uniform(0.0, 2.0), rng.uniform(0.0, 0.3)
    damping = rng.uniform(0.1, 1.0) * math.sqrt(fast)
    half, omega = rng.uniform(2.0, 30.0), rng.uniform(0.7, 1.5)
    box = vi.Mechanism(
        mass=np.diag([1.0, 1.0, 0.1]), damping=np.diag([damping, damping, 0.0]),
        stiffness=[[fast + off, off, 0.0], [off, fast + off, 0.0], [0.0, 0.0, 0.0]],
        forces=(vi.Harmonic(omega, (5.0 * fast, 0.0, 0.0)),),
        elements=(vi.RigidStop((-1.0, 0.0, 1.0), -half, half, float(rng.uniform(0.5, 0.95))),),
    )  # fmt: skip
    start = vi.State((0.0, 0.0, 0.0), (0.0, 0.0, 2.0))
    run = vi.simulate(box, start, impacts=3000)
    assert (run.status[1200:] == vi.Status.CHATTER).any()
    found = vi.lyapunov_spectrum(box, start, impacts=1500)
    assert np.isneginf(found.values).tolist() == [False] * 4 + [True] * 2


def test_only_the_last_part_counts_where_the_motion_changes() -> None:
    rng = np.random.default_rng(3)
    growth = np.concatenate([0.3 + rng.normal(size=3000), np.full(3000, -0.1)])
    assert 2900 <= _last_part(growth, np.ones(6000)) <= 3100


@pytest.mark.slow
def test_chaos_that_ends_within_the_average_is_left_out() -> None:
    """How long it lasts depends on the last bits of a start: the first that fits is taken."""
    damper = vi.ImpactDamper(
        mass_ratio=0.074, omega_n=1.44, zeta=0.026, restitution=0.92, half_clearance=5.25,
        omega=0.705,
    )  # fmt: skip
    starts = (vi.State((0.0, 0.0), (0.0, 1.0 + 0.01 * k)) for k in range(40))
    start = next(start for start in starts if len(vi.lyapunov_exponent(damper, start).earlier) == 1)
    found = vi.lyapunov_spectrum(damper, start)
    orbit = vi.symmetric_orbits(damper)
    wanted = [np.log(np.abs(one.multipliers).max()) / damper.period for one in orbit if one.stable]
    assert 0.0 < found.discarded < 1.0
    assert "left out" in repr(found)
    assert min(abs(found.values[0] - x) / found.errors[0] for x in wanted) < 3.0
    assert found.negative.all()
    assert found.determinant_error < 1e-12


@pytest.mark.parametrize("restitution", [0.0, 0.5])
def test_a_ball_that_comes_to_rest_in_every_period_forgets_everything(restitution: float) -> None:
    found = vi.lyapunov_spectrum(falling(restitution), vi.State((1.0,), (0.0,)), impacts=1024)
    assert np.isneginf(found.values).all()
    assert found.run_end is RunEnd.OBSERVER
    assert found.dimension == 0.0


def test_motions_without_impacts_have_no_exponents_but_a_reason() -> None:
    silent = vi.lyapunov_spectrum(
        replace(CHAOS, half_clearance=1e4), vi.State((0.0, 0.0), (0.0, 0.0)), impacts=1024
    )
    assert np.isnan(silent.values).all()
    assert silent.values.shape == (4,)
    assert silent.run_end is RunEnd.SILENT
    assert silent.statement == RunEnd.SILENT.sentence
    assert math.isnan(silent.determinant_error)
    assert math.isnan(silent.dimension)


def test_a_contact_that_never_opens_is_named_as_the_reason() -> None:
    held = vi.Mechanism(
        mass=np.eye(2), damping=0.1 * np.eye(2), stiffness=np.eye(2),
        forces=(vi.Harmonic(1.0, (1.0, 0.1)),), constant_force=(0.0, 50.0),
        elements=(
            vi.RigidStop((1.0, 0.0), upper=0.2, restitution=0.8),
            vi.RigidStop((0.0, 1.0), upper=0.2, restitution=0.8),
        ),
    )  # fmt: skip
    found = vi.lyapunov_spectrum(held, vi.State((0.0, 0.0), (0.0, 0.0)), impacts=1024)
    assert np.isnan(found.values).all()
    assert "stays closed" in found.statement


def test_impacts_of_several_contacts_at_once_leave_the_sum_unknown() -> None:
    """Two equal oscillators strike at the same time whenever both are driven alike."""
    twins = vi.Mechanism(
        mass=np.eye(2), damping=0.1 * np.eye(2), stiffness=np.eye(2),
        forces=(vi.Harmonic(1.0, (1.0, 1.0)),),
        elements=tuple(vi.RigidStop(row, upper=0.2, restitution=0.8) for row in np.eye(2)),
    )  # fmt: skip
    found = vi.lyapunov_spectrum(twins, vi.State((0.0, 0.0), (0.0, 0.0)), impacts=1024)
    assert "all impacts are simultaneous" in found.statement


# ---- invariance, and misuse ----------------------------------------------------------------------


def test_exponents_scale_with_the_unit_of_time_and_with_no_other() -> None:
    """A unit of time half as long, of length four times as short (T3), s = 1/2."""
    damper = SETS["B"].damper(0.96)
    scaled = replace(
        damper, omega_n=damper.omega_n / 2.0, omega=damper.omega / 2.0,
        half_clearance=damper.half_clearance * 4.0,
    )  # fmt: skip
    found = vi.lyapunov_spectrum(damper, PLAIN, impacts=2000)
    other = vi.lyapunov_spectrum(scaled, vi.State((0.0, 0.0), (0.0, 2.0)), impacts=2000)
    # powers of two: the motion is the same but for rounding, which the circle does not amplify
    np.testing.assert_allclose(2.0 * other.values, found.values, rtol=1e-6, atol=1e-9)
    np.testing.assert_allclose(other.per_impact, found.per_impact, rtol=1e-6, atol=1e-9)
    assert 2.0 * other.contraction == pytest.approx(found.contraction, rel=1e-12)


def test_the_size_of_the_parts_that_are_recorded_does_not_matter(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    system, start = PERIODIC["set A"]
    found = vi.lyapunov_spectrum(system, start, impacts=2000, settle_impacts=2000)
    monkeypatch.setattr("vibroimpact.simulation.lyapunov_spectrum.CHUNK_EVENTS", 70)
    other = vi.lyapunov_spectrum(system, start, impacts=2000, settle_impacts=2000)
    assert other.duration.size == found.duration.size
    # the unit of velocity is taken from the first part, and turns the first frame
    np.testing.assert_allclose(other.values, found.values, rtol=0.0, atol=1e-6)
    assert other.contraction == pytest.approx(found.contraction, rel=1e-12)


@pytest.mark.parametrize("count", [1, 2, 3])
def test_the_first_exponents_alone_are_those_of_all(count: int) -> None:
    some = vi.lyapunov_spectrum(CHAOS, PLAIN, impacts=1024, exponents=count)
    every = vi.lyapunov_spectrum(CHAOS, PLAIN, impacts=1024)
    # rounding turns the frame, which forgets it
    np.testing.assert_allclose(some.values, every.values[:count], rtol=1e-9)
    assert math.isnan(some.determinant_error)
    assert "exactly" not in repr(some)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"impacts": 1000}, "impacts = 1000: must be an integer >= 1024"),
        ({"impacts": 2000.0}, "impacts = 2000.0: must be an integer"),
        ({"settle_impacts": -1}, "settle_impacts = -1: must be an integer >= 0"),
        ({"exponents": 0}, "exponents = 0: must be an integer >= 1"),
        ({"exponents": 5}, "exponents = 5: must be at most 4"),
        ({"exponents": "all"}, "exponents = 'all': must be an integer"),
    ],
)
def test_bad_counts_are_refused(options: dict[str, object], message: str) -> None:
    with pytest.raises(vi.InvalidParameterError, match=message):
        vi.lyapunov_spectrum(CHAOS, PLAIN, **options)


def test_bad_starts_and_systems_are_refused() -> None:
    with pytest.raises(vi.InvalidParameterError, match="behind the upper stop"):
        vi.lyapunov_spectrum(CHAOS, vi.State((0.0, 100.0), (0.0, 0.0)))
    with pytest.raises(vi.InvalidParameterError, match=r"position has shape \(1,\)"):
        vi.lyapunov_spectrum(CHAOS, vi.State((0.0,), (0.0,)))
    with pytest.raises(vi.InvalidParameterError, match="system"):
        vi.lyapunov_spectrum(3.0, PLAIN)


@pytest.mark.parametrize(
    ("length", "time"), [(1.0, 1.0), (1e-6, 1e-3), (2.0**20, 2.0**-10), (1e6, 1.0), (1.0, 1e5)]
)
def test_the_exponent_of_a_stable_orbit_is_that_of_its_multiplier_in_all_units(
    length: float, time: float
) -> None:
    """A soft oscillator with complex multipliers, whose modulus is exp(-damping period / 2), Liouville:

    the stop has the same damping rate as the mass beside it, in all.
    """
    m = vi.Mechanism(
        mass=[[1.0]], damping=[[0.1 / time]], stiffness=[[1.0 / time**2]],
        elements=(vi.SoftStop((1.0,), upper=0.5 * length, stiffness=29.0 / time**2),),
        forces=(vi.Harmonic(0.8 / time, (length / time**2,)),),
    )  # fmt: skip
    found = vi.lyapunov_exponent(m, vi.State((0.0,), (0.0,)))
    assert abs(found.value * time + 0.05) <= 3.0 * found.error * time
    # errors of plain means are 1 / 8000 periods of some e-folds, 2e-4 here and more
    assert found.error * time < 2e-5
