"""Words that are tried and not known: the message names what is meant."""

from __future__ import annotations

import pytest

import vibroimpact as vi
from vibroimpact._core.words import OF_RESULTS, OF_THE_PACKAGE
from vibroimpact.machines.registry import case_named

OSCILLATOR = vi.ImpactOscillator(zeta=0.05, omega=1.2, restitution=0.8, clearance=1.0)
START = vi.State((0.0,), (0.5,))


@pytest.mark.parametrize(
    ("word", "name"),
    [
        ("bifurcation_diagram", "vi.bifurcation_sweep or vi.branch_diagram"),
        ("poincare", "vi.section or vi.impact_map"),
        ("lyapunov", "vi.lyapunov_exponent or vi.lyapunov_spectrum"),
        ("floquet", "multipliers"),
        ("find_orbti", "vi.find_orbit"),
        ("plot_branch", "vi.plotting.plot_branches"),
    ],
)
def test_a_word_of_the_field_leads_to_the_function(word: str, name: str) -> None:
    with pytest.raises(AttributeError, match=rf"no attribute '{word}'.*Did you mean .*{name}"):
        getattr(vi, word)


def test_every_word_of_the_table_leads_to_a_name_that_is_there() -> None:
    for word in OF_THE_PACKAGE:
        with pytest.raises(AttributeError, match="Did you mean"):
            getattr(vi, word)


@pytest.mark.parametrize(
    ("word", "name"), [("t", "time"), ("x", "position"), ("v", "velocity_before"), ("tim", "time")]
)
def test_an_attribute_of_a_run_is_suggested(word: str, name: str) -> None:
    run = vi.simulate(OSCILLATOR, START, impacts=3)
    with pytest.raises(AttributeError, match=rf"'{word}'. Did you mean .*{name}"):
        getattr(run, word)
    assert word in OF_RESULTS or hasattr(run, name)


def test_an_argument_is_suggested() -> None:
    with pytest.raises(TypeError, match=r"t_end: is no argument of simulate.*Did you mean t_max"):
        vi.simulate(OSCILLATOR, START, t_end=3.0)  # type: ignore[call-arg]
    with pytest.raises(TypeError, match="Did you mean omega"):
        vi.ImpactOscillator(frequency=1.0)  # type: ignore[call-arg]


def test_a_parameter_and_a_machine_are_suggested() -> None:
    orbit = vi.find_orbit(OSCILLATOR, START)
    with pytest.raises(vi.InvalidParameterError, match="Did you mean omega"):
        vi.continue_orbit(orbit, "omgea", (1.0, 1.3))
    with pytest.raises(vi.InvalidParameterError, match="Did you mean impact-damper"):
        case_named("impact-dampr")


def test_why_a_run_ended_is_printed_by_its_name() -> None:
    run = vi.simulate(OSCILLATOR, START, impacts=3)
    assert str(run.end) == f"{run.end}" == "IMPACTS"
    assert int(run.end) == 0


@pytest.mark.parametrize(
    ("room", "word", "name"),
    [("machines", "Shakr", "Shaker"), ("plotting", "plot_histroy", "plot_history"),
     ("measures", "Amplitudes", "Amplitude"), ("observe", "Extrema", "Extremes")],
)  # fmt: skip
def test_a_misspelt_name_of_a_room_is_answered_with_the_nearest(
    room: str, word: str, name: str
) -> None:
    with pytest.raises(AttributeError, match=rf"'{word}'. Did you mean {name}\?"):
        getattr(getattr(vi, room), word)


def test_a_family_of_a_mechanism_says_how_its_numbers_vary() -> None:
    ball = vi.machines.BouncingBall(gravity=1.0, amplitude=1.1, omega=1.0, restitution=0.5)
    with pytest.raises(vi.InvalidParameterError, match=r"is a mechanism.*replace\(\)"):
        vi.Family(ball.mechanism)  # type: ignore[arg-type]
