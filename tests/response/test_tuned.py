"""Tuned mass dampers against Den Hartog's and Asami's closed forms, and a machine of two masses."""

from __future__ import annotations

import math

import numpy as np
import pytest

import vibroimpact as vi
from vibroimpact.measures.linear import FreeMotion


@pytest.mark.parametrize("mu", [0.02, 0.05, 0.25])
def test_the_numerical_optimum_of_an_undamped_machine_is_the_exact_one(mu: float) -> None:
    """[nishihara2002], without the approximation of fixed points."""
    root = math.sqrt(4.0 + 3.0 * mu)
    square = 2.0 * (16.0 + 23.0 * mu + 9.0 * mu**2 + 2.0 * (2.0 + mu) * root)
    ratio = 2.0 / (1.0 + mu) * math.sqrt(square / (3.0 * (64.0 + 80.0 * mu + 27.0 * mu**2)))
    own = 0.25 * math.sqrt((8.0 + 9.0 * mu - 4.0 * root) / (1.0 + mu))
    tuned = vi.tuned_damper(mu)
    assert tuned.frequency_ratio == pytest.approx(ratio, rel=1e-4)  # two maxima level off only
    assert tuned.damping_ratio == pytest.approx(own, rel=1e-3)
    exact = vi.TunedDamper(mu, ratio, own)
    assert tuned.peak == pytest.approx(exact.peak, rel=1e-7)


def test_den_hartogs_optimum_passes_the_fixed_points_at_their_height() -> None:
    mu = 0.05
    tuned = vi.tuned_damper(mu, optimum="den hartog")
    assert tuned.frequency_ratio == pytest.approx(1.0 / (1.0 + mu))
    to_machine = tuned.damping_ratio * tuned.frequency_ratio  # his c / c_c
    assert to_machine**2 == pytest.approx(3.0 * mu / (8.0 * (1.0 + mu) ** 3))
    square = np.array([1.0, -1.0]) * math.sqrt(mu / (2.0 + mu)) + 1.0
    fixed = np.sqrt(square / (1.0 + mu))
    assert tuned.amplification(fixed) == pytest.approx([math.sqrt(1.0 + 2.0 / mu)] * 2)


def test_with_a_damped_machine_no_neighbour_of_the_optimum_is_better() -> None:
    tuned = vi.tuned_damper(0.05, 0.02)
    for nu, own in ((1e-3, 0.0), (-1e-3, 0.0), (0.0, 1e-2), (0.0, -1e-2)):
        near = vi.TunedDamper(
            0.05, tuned.frequency_ratio * (1.0 + nu), tuned.damping_ratio * (1.0 + own), 0.02
        )
        assert near.peak > tuned.peak
    assert tuned.peak < vi.tuned_damper(0.05, 0.02, optimum="den hartog").peak


def test_the_closed_form_is_the_motion_of_a_machine_of_two_masses() -> None:
    tuned, g, z = vi.TunedDamper(0.1, 0.93, 0.2, 0.03), 1.1, 0.03
    k, c = 0.1 * 0.93**2, 2.0 * 0.2 * 0.93 * 0.1
    machine = vi.Mechanism(
        mass=[[1.0, 0.0], [0.0, 0.1]], damping=[[2.0 * z + c, -c], [-c, c]],
        stiffness=[[1.0 + k, -k], [-k, k]], forces=(vi.Harmonic(g, (1.0, 0.0)),),
        elements=(vi.RigidStop((-1.0, 1.0), upper=100.0),),
    )  # fmt: skip
    amplitude = vi.measure_of(machine, "x1").of_orbit(FreeMotion(machine, np.zeros(2)))
    assert tuned.amplification(g) == pytest.approx(amplitude, rel=1e-12)
    place, height = tuned.peak_at
    grid = np.linspace(0.5, 1.5, 20_001)
    assert height == pytest.approx(tuned.amplification(grid).max(), rel=1e-6)
    assert tuned.amplification(place) == height
