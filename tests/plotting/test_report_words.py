"""Words of a report: numbers with prefixes, motions, machines as tables, linear machines beside."""

from __future__ import annotations

import math
from types import SimpleNamespace
from typing import Any, cast

import pytest

import vibroimpact as vi
from vibroimpact.plotting.machine_table import Varied, machine_table
from vibroimpact.plotting.page import Symbol
from vibroimpact.plotting.report import comparison_sentence
from vibroimpact.plotting.words import kind_of, motion_in_words, number
from vibroimpact.response.compare import comparison, decibels, is_comparable, worst_of_comparison

CHEAP: dict[str, Any] = {
    "points": 2, "starts": 0, "settle_periods": 1, "periods": 1, "most_branches": 0, "progress": False,
}  # fmt: skip


@pytest.mark.parametrize(
    ("value", "unit", "text"),
    [
        (0.0257039, "m", "25.7 mm"), (303190.6, "N/m", "303.2 kN/m"), (6.0, "kg", "6 kg"),
        (12346.0, "kg", "12350 kg"), (50.2655, "rad/s", "50.27 rad/s"), (0.0, "m", "0 m"),
        (0.123456, "", "0.1235"), (math.inf, "m", "unbounded"), (math.nan, "", "not known"),
    ],
)  # fmt: skip
def test_numbers_have_four_digits_and_the_prefix_of_their_size(
    value: float, unit: str, text: str
) -> None:
    assert number(value, unit) == text


@pytest.mark.parametrize(
    ("motion", "kind", "words"),
    [
        ("1-1-1", "one", "repeats every forcing period, with 1 impact at each stop"),
        ("1-2-0", "one", "repeats every forcing period, with 2 impacts at stop A"),
        ("3-0-2", "several", "repeats every 3 forcing periods, with 2 impacts at stop B"),
        ("2-1-2", "several",
         "repeats every 2 forcing periods, with 1 impact at stop A and 2 impacts at stop B"),
        ("1-1-1,0-2", "one", "repeats every forcing period, with 4 impacts at all stops together"),
        ("1-2-1 (contact 1)", "one",
         "repeats every forcing period, with 2 impacts at stop A and 1 impact at stop B"),
        ("11-0-1", "several", "repeats every 11 forcing periods, with 1 impact at stop B"),
        ("1-0-0", "no impacts", "has no impacts"),
        ("chaotic", "chaotic", "is irregular (chaotic) and never repeats"),
    ],
)  # fmt: skip
def test_motions_are_told_by_their_symbols(motion: str, kind: str, words: str) -> None:
    assert (kind_of(motion), motion_in_words(motion)) == (kind, words)


def test_symbols_of_figures_become_letters_with_subscripts() -> None:
    assert Symbol(r"\omega_n").__html__() == "<i>&omega;<sub>n</sub></i>"
    assert Symbol("x_{12}").__html__() == "<i>x<sub>12</sub></i>"


def test_the_table_of_several_balls_has_every_spring_and_stop() -> None:
    machine = vi.Mechanism(
        mass=[[1.0, 0.1, 0.0], [0.1, 2.0, 0.0], [0.0, 0.0, 0.5]],
        damping=[[0.3, 0.0, 0.0], [0.0, 0.0, 0.0], [0.0, 0.0, 0.0]],
        stiffness=[[5.0, -2.0, 0.0], [-2.0, 2.0, 0.0], [0.0, 0.0, 0.0]],
        forces=(vi.Harmonic(1.5, (3.0, 0.0, 0.0), (4.0, 0.0, 0.0)),),
        elements=(
            vi.RigidStop((-1.0, 0.0, 1.0), -0.2, 0.3, (0.5, 0.7)),
            vi.Friction((0.0, 1.0, 0.0), kinetic=0.25),
        ),
    )
    rows = {row[0]: row[2] for row in machine_table(machine, [Varied("omega", "varied")]).rows}
    assert {name: value for name, value in rows.items() if name != "friction 1"} == {
        "mass of x1": "1", "mass shared by x1 and x2": "0.1", "mass of x2": "2",
        "mass of x3, free between stops": "0.5", "spring of x1 to the ground": "3",
        "spring between x1 and x2": "2", "dashpot of x1 to the ground": "0.3",
        "forcing frequency": "varied", "force amplitude on x1": "5",
        "rigid stop 0": "-0.2 ≤ x3 - x1 ≤ 0.3; restitution 0.5 below, 0.7 above",
    }  # fmt: skip
    assert "kinetic=0.25" in cast(str, rows["friction 1"])


def oscillator(zeta: float) -> vi.ImpactOscillator:
    return vi.ImpactOscillator(zeta=zeta, omega=1.0, restitution=0.7, clearance=0.2)


def test_the_largest_value_without_stops_is_that_of_the_closed_form() -> None:
    response = vi.frequency_response(oscillator(0.05), "omega", (0.8, 1.3), **CHEAP)
    place, value = worst_of_comparison(response, "linear")
    assert value == pytest.approx(1.0 / (0.1 * math.sqrt(1.0 - 0.0025)), rel=1e-11)
    assert place == pytest.approx(math.sqrt(1.0 - 0.005), rel=1e-6)
    assert value >= comparison(response, "linear")[1].max()


def test_a_resonance_without_damping_is_unbounded_and_said_to_be() -> None:
    response = vi.frequency_response(oscillator(0.0), "omega", (0.8, 1.3), **CHEAP)
    place, value = worst_of_comparison(response, "linear")
    assert (round(place, 5), value) == (1.0, math.inf)
    assert comparison_sentence(response, "linear") == (
        "Without stops it would grow without bound at 1."
    )


def test_a_value_that_does_not_vary_has_no_place() -> None:
    response = vi.frequency_response(oscillator(0.05), "clearance", (0.1, 0.2), **CHEAP)
    place, value = worst_of_comparison(response, "linear")
    assert math.isnan(place)
    assert value == pytest.approx(10.0, rel=1e-12)
    assert "it would be 10, over the whole band." in comparison_sentence(response, "linear")


def test_free_masses_are_not_compared_with_themselves_at_rest() -> None:
    damper = vi.ImpactDamper(
        mass_ratio=0.1, omega_n=1.0, zeta=0.05, restitution=0.6, half_clearance=5.0, omega=1.0
    )
    found = {
        measure: is_comparable(cast(Any, SimpleNamespace(
            measure=vi.measure_of(damper, measure), system=damper
        )))
        for measure in ("x1", "rms v1", "x2", "x2 - x1", "power", "impact speed")
    }  # fmt: skip
    assert [name for name, yes in found.items() if yes] == ["x1", "rms v1"]


def test_decibels_are_20_lg_and_10_lg_of_powers() -> None:
    assert decibels(10.0, "length") == pytest.approx(20.0)
    assert decibels(10.0, "power") == pytest.approx(10.0)
