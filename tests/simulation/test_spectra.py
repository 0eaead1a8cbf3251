"""All Lyapunov exponents of motions with long flights and fast modes."""

from __future__ import annotations

import math

import numpy as np
import pytest

import vibroimpact as vi


def spectrum(system: vi.Mechanism, start: vi.State, periods: float) -> tuple[np.ndarray, float]:
    """The exponents, and the impacts per unit of time of the same window."""
    starts = vi.GridStarts({"phase": [start.phase]}, start)
    found = vi.sweep(system, over={}, start=starts, observe=["spectrum", "lyapunov", "impacts"],
                     settle_periods=periods, periods=periods, progress=False)  # fmt: skip
    exponents = found.spectrum.values.ravel()
    assert exponents[0] == found.lyapunov.item()
    per_period = float(found.impacts_a.item() + found.impacts_b.item())
    return exponents, per_period * system.omega / (2.0 * math.pi)


def contraction(system: vi.Mechanism, rate: float) -> float:
    """Volumes shrink by exp(-trace(C / M) t) in flight and by R^2 in an impact."""
    flight = np.trace(np.linalg.solve(np.array(system.mass), np.array(system.damping)))
    (restitution, _) = system.rigid_stops[0].restitutions
    return -float(flight) + 2.0 * math.log(restitution) * rate


def test_long_flights_of_a_damper_leave_all_exponents_finite() -> None:
    """The free mass crosses 40 amplitudes of the main one, which forgets itself meanwhile."""
    damper = vi.ImpactDamper(
        mass_ratio=0.1, omega_n=1.0, zeta=0.3, restitution=0.9, half_clearance=20.0, omega=1.0
    ).mechanism
    found, rate = spectrum(damper, vi.State((0.0, 0.0), (0.0, 2.0)), 2000)
    assert np.isfinite(found).all()
    assert found.sum() == pytest.approx(-0.6268, abs=5e-4)
    assert found.sum() == pytest.approx(contraction(damper, rate), abs=2e-3)


def with_modes_that_fade(seed: int) -> tuple[vi.Mechanism, float]:
    """A free mass in a wide box on one or two others, with modes that fade at any rate; half of the box."""
    rng = np.random.default_rng(seed)
    n = int(rng.integers(2, 4))
    mass = np.diag([1.0] * (n - 1) + [0.1])
    fast = 10.0 ** rng.uniform(0.0, 2.0)
    stiffness = np.zeros((n, n))
    stiffness[: n - 1, : n - 1] = fast * np.eye(n - 1) + rng.uniform(0.0, 0.3) * np.ones(
        (n - 1, n - 1)
    )
    damping = np.zeros((n, n))
    damping[: n - 1, : n - 1] = rng.uniform(0.1, 1.0) * math.sqrt(fast) * np.eye(n - 1)
    row = (-1.0, *(0.0,) * (n - 2), 1.0)
    half, omega = rng.uniform(2.0, 30.0), rng.uniform(0.7, 1.5)
    force = (5.0 * fast, *(0.0,) * (n - 1))
    system = vi.Mechanism(
        mass=mass.tolist(), damping=damping.tolist(), stiffness=stiffness.tolist(),
        forces=(vi.Harmonic(omega, force),),
        elements=(vi.RigidStop(row, -half, half, float(rng.uniform(0.5, 0.95))),),
    )  # fmt: skip
    return system, half


PERIODS = 400  # discarded, and observed
RESTING = (8, 23, 27, 47)  # of fifty


@pytest.mark.parametrize(
    "seed", [*range(11), *(pytest.param(k, marks=pytest.mark.slow) for k in range(11, 50))]
)
def test_exponents_add_up_whatever_fades_between_impacts(seed: int) -> None:
    """Flights may leave a direction exp(-100) of itself; only rest on the stop takes any away.

    A body on its stop has neither a gap nor a rate that could differ: two directions of 2 n are forgotten.
    """
    system, half = with_modes_that_fade(seed)
    n = system.degrees
    start = vi.State((0.0,) * n, (0.0,) * (n - 1) + (2.0,))
    found, rate = spectrum(system, start, PERIODS)
    run = vi.simulate(system, start, impacts=10**6, t_max=PERIODS * 4.0 * math.pi / system.omega)
    carried = run.time >= run.time[-1] * (
        0.5 - 0.125
    )  # tangents begin a quarter of the window before
    rests = bool(np.any(run.status[carried] == vi.Status.STICK))
    assert rests == (seed in RESTING)
    assert np.isneginf(found).sum() == 2 * rests
    assert np.isfinite(found[: len(found) - 2 * rests]).all()
    if not rests:
        # at both ends a flight that is cut and the volume of the section enter
        ends = (30.0 + 2.0 * half) / (PERIODS * 2.0 * math.pi / system.omega)
        assert found.sum() == pytest.approx(contraction(system, rate), abs=ends)


@pytest.mark.parametrize("restitution", [0.05, 0.3, 0.6])
def test_a_start_that_one_flight_leaves_nothing_of_is_not_forgotten(restitution: float) -> None:
    """Once in a period of the force an oscillator impacts that fades by exp(-44) in between."""
    system = vi.Mechanism(
        mass=[[1.0]], damping=[[14.0]], stiffness=[[400.0]], forces=(vi.Harmonic(1.0, (400.0,)),),
        elements=(vi.RigidStop((1.0,), upper=0.9999, restitution=restitution),),
    )  # fmt: skip
    start = vi.State((0.0,), (0.0,))
    found, rate = spectrum(system, start, 200)
    assert rate == pytest.approx(system.omega / (2.0 * math.pi))
    ends = 1.0 / 200  # a complex pair turns by an angle between the first and the last impact
    assert found.sum() == pytest.approx(contraction(system, rate), abs=ends)
    over = {"elements[0].restitution[1]": np.linspace(restitution, 0.9, 20)}
    several = vi.sweep(system, over=over, start=start, observe=["lyapunov"], settle_periods=200, periods=200,
                       progress=False)  # fmt: skip
    assert several.lyapunov[0].item() == found[0]  # in lanes, beside others
    one = vi.lyapunov_exponent(system, start, impacts=1024)
    assert one.value == pytest.approx(found[0], abs=ends + 4.0 * one.error)
