"""What orbits and branches are asked with: refused in plain words, or taken as it is meant."""

from __future__ import annotations

import copy
import math
import pickle
from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np
import pytest
from support.systems import paper_damper

import vibroimpact as vi
from vibroimpact.continuation import Steps
from vibroimpact.model.parameters import expanded, with_parameter
from vibroimpact.orbits.find import unfolded
from vibroimpact.orbits.maps import full_map, stroboscopic_map

DAMPER = paper_damper("A", 1.2)
SETTLING = vi.State((0.0, 0.0), (0.0, 1.0))
REFUSED = vi.InvalidParameterError


def oscillator(**stop: Any) -> vi.Mechanism:
    """One mass on a spring, one forcing line, one contact."""
    return vi.Mechanism(
        mass=[[1.0]], damping=[[0.1]], stiffness=[[1.0]], forces=(vi.Harmonic(1.0, (2.0,)),),
        elements=(vi.RigidStop((1.0,), **({"restitution": 0.7} | stop)),),
    )  # fmt: skip


def walled(k: float, shift: float, lines: int) -> vi.Mechanism:
    """A family of module level, with a number that is no real parameter."""
    forces = tuple(vi.Harmonic(1.0 + i * (1.0 + shift), (2.0 / (1 + i),)) for i in range(lines))
    return replace(oscillator(upper=0.5), stiffness=[[k]], forces=forces)


@cache
def symmetric() -> vi.Orbit:
    """An orbit that was solved as its own mirror image."""
    return vi.find_orbit(DAMPER, SETTLING)


@cache
def bouncing() -> vi.Orbit:
    """An orbit at one wall under two commensurate forcing lines."""
    lines = (vi.Harmonic(1.0, (2.0,)), vi.Harmonic(3.0, (0.2,)))
    return vi.find_orbit(replace(oscillator(upper=0.5), forces=lines), vi.State((0.0,), (0.0,)))


def pickled(thing: Any) -> Any:
    """There and back."""
    return pickle.loads(pickle.dumps(thing))  # noqa: S301


def test_the_orbits_used_here_are_what_they_should_be() -> None:
    assert symmetric().converged
    assert symmetric().symmetric
    assert bouncing().converged


# ---- parameters that break what the equations assume ---------------------------------------------


@pytest.mark.parametrize(
    ("parameter", "bounds"),
    [
        ("constant_force[0]", (-0.1, 0.1)),
        ("elements[0].upper", (4.5, 5.5)),
        ("elements[0].restitution[0]", (0.7, 0.8)),
        ("elements[0].restitution[0]", (0.8, 1.5)),
    ],
)
def test_a_parameter_that_breaks_the_symmetry_is_refused_with_the_remedy(
    parameter: str, bounds: tuple[float, float]
) -> None:
    orbit = vi.find_orbit(DAMPER.mechanism, symmetric())
    assert orbit.symmetric
    with pytest.raises(REFUSED, match=r"breaks the symmetry.*symmetric=False"):
        vi.continue_orbit(orbit, parameter, bounds)


@pytest.mark.parametrize("parameter", ["forces[0].omega", "forces[1].omega"])
def test_a_parameter_that_changes_the_ratios_of_the_forcing_is_refused(parameter: str) -> None:
    value = {"forces[0].omega": 1.0, "forces[1].omega": 3.0}[parameter]
    with pytest.raises(REFUSED, match="changes the ratios"):
        vi.continue_orbit(bouncing(), parameter, (value, value + 0.5))
    with pytest.raises(REFUSED, match="changes the ratios"):
        full_map(bouncing(), parameter)


def test_omega_keeps_the_ratios_of_the_forcing() -> None:
    assert np.isfinite(full_map(bouncing(), "omega").derivative(np.array([0.0, 0.0, 1.0]))).all()
    branch = vi.continue_orbit(bouncing(), "omega", (0.99, 1.01), steps=Steps(points=24))
    assert len(branch) > 1


# ---- guesses from motions ------------------------------------------------------------------------


@pytest.mark.parametrize("count", [500, 501])
@pytest.mark.parametrize("impacts", [("A", "B"), ("B", "A")])
def test_a_run_gives_its_sequence_wherever_it_ends(count: int, impacts: tuple[str, ...]) -> None:
    run = vi.simulate(DAMPER, SETTLING, impacts=count)
    orbit = vi.find_orbit(DAMPER, run, stops=impacts)
    assert orbit.converged
    assert orbit.signature.impacts == tuple((0, 1 if side == "A" else -1) for side in impacts)


@pytest.mark.parametrize(
    ("omega", "half_clearance"),
    [(0.904026845637584, 6.979865771812081), (0.9483221476510068, 5.2885906040268456)],
)
def test_a_motion_that_has_settled_on_a_long_orbit_gives_that_orbit(
    omega: float, half_clearance: float
) -> None:
    """Tori locked at 70 and 146 impacts; shorter loops that nearly close are no orbits."""
    damper = paper_damper("A", omega, half_clearance=half_clearance)
    attractor = vi.classify(damper, SETTLING)
    assert attractor.type is not None
    assert sum(attractor.type[1:]) > 60
    orbit = vi.find_orbit(damper, attractor.section.last)
    assert orbit.converged
    assert orbit.symbol == attractor.symbol
    assert orbit.stable
    assert orbit.admissible


def test_the_state_of_an_orbit_leads_back_to_it() -> None:
    for impacts in (("A", "B"), ("B", "A")):
        start = vi.find_orbit(DAMPER, vi.simulate(DAMPER, SETTLING, impacts=500), stops=impacts)
        orbit = vi.find_orbit(DAMPER, start.state, stops=impacts)
        assert orbit.converged
        np.testing.assert_allclose(orbit.states, start.states, rtol=0.0, atol=1e-9)


def test_whole_turns_of_the_phase_do_not_matter() -> None:
    known = unfolded(symmetric())
    far = known.states.copy()
    far[:, -1] += 2.0 * math.pi * 1e6
    impacts = symmetric().signature.impacts
    orbit = vi.find_orbit(DAMPER, vi.Guess(far, known.durations), stops=impacts, cycles=1)
    assert orbit.converged
    # the phase of the guess has lost six digits; the orbit has them all
    np.testing.assert_allclose(orbit.states, known.states, rtol=0.0, atol=1e-11)


def test_a_motion_without_a_loop_is_an_orbit_with_a_status() -> None:
    """The wall is out of reach; only the lower stop exists; every property answers."""
    far = replace(oscillator(lower=-5.0), forces=(vi.Harmonic(2.0, (0.01,)),))
    orbit = vi.find_orbit(far, vi.State((0.0,), (0.0,)), stops="B")
    assert not orbit.converged
    assert not orbit.stable
    assert not orbit.admissible
    assert orbit.inadmissible_reason == orbit.status
    assert orbit.multipliers.shape == (2,)
    assert np.isnan(orbit.multipliers).all()
    assert orbit.symbol == "1-0-1"
    assert math.isnan(orbit.clearance_to_grazing)
    assert math.isnan(orbit.least_impact_speed)
    assert orbit.half_multipliers is None
    assert "no loop" in repr(orbit)


def test_what_is_not_found_closes_over_cycles_that_the_forcing_has() -> None:
    lines = (vi.Harmonic(2.0, (0.01,)), vi.Harmonic(3.0, (0.01,)))
    far = replace(oscillator(upper=5.0), forces=lines)
    orbit = vi.find_orbit(far, vi.State((0.0,), (0.0,)), stops="A")
    assert not orbit.converged
    assert orbit.signature.cycles == 2


def test_forces_without_a_common_period_are_refused() -> None:
    lines = (vi.Harmonic(2.0, (0.01,)), vi.Harmonic(2.0 * math.sqrt(2.0), (0.01,)))
    with pytest.raises(REFUSED, match="no common period"):
        vi.find_orbit(replace(oscillator(upper=5.0), forces=lines), vi.State((0.0,), (0.0,)))


def test_impacts_do_not_say_where_a_motion_rests() -> None:
    """A preload presses the mass to its stop; the force lifts it once per cycle."""
    pressed = replace(oscillator(upper=0.0, restitution=0.3), constant_force=(1.2,))
    run = vi.simulate(pressed, vi.State((-1.0,), (0.0,)), impacts=300)
    orbit = vi.find_orbit(pressed, run, stops=("A",))
    assert not orbit.converged
    assert "rests on a stop in every period" in orbit.status
    assert vi.find_orbit(pressed, run).converged


# ---- copies --------------------------------------------------------------------------------------


def test_orbits_compare_by_identity_and_can_be_hashed() -> None:
    orbit = symmetric()
    assert orbit == orbit
    assert orbit != vi.find_orbit(DAMPER, orbit)
    assert len({orbit, full_map(orbit)}) == 2


@pytest.mark.parametrize("copied", [pickled, copy.deepcopy])
def test_orbits_branches_and_maps_can_be_copied(copied: Any) -> None:
    orbit, around = symmetric(), full_map(symmetric(), "omega")
    values = orbit.multipliers  # fills what the orbit remembers
    np.testing.assert_array_equal(copied(orbit).multipliers, values)
    np.testing.assert_array_equal(copied(around).jacobian(), around.jacobian())
    branch = vi.continue_orbit(orbit, "omega", (1.19, 1.21))
    again = copied(branch)
    np.testing.assert_array_equal(again.multipliers, branch.multipliers)
    np.testing.assert_array_equal(again.orbit(0).multipliers, branch.orbit(0).multipliers)


def test_a_branch_with_a_normal_form_and_a_family_can_be_pickled() -> None:
    branch = vi.continue_orbit(vi.symmetric_orbits(paper_damper("A", 1.1))[0], "omega", (1.0, 1.15))
    point = branch["NS1"]
    form = repr(point.normal_form)
    assert repr(pickled(point).normal_form) == form
    family = vi.Family(walled, k=1.0, shift=0.0, lines=1)
    orbit = vi.find_orbit(family, vi.State((0.0,), (0.0,)))
    np.testing.assert_array_equal(pickled(orbit).multipliers, orbit.multipliers)


# ---- values out of range -------------------------------------------------------------------------


@pytest.mark.parametrize(
    "wrong",
    [
        {"first": 0}, {"first": -1.0}, {"least": 0.0}, {"tolerance": 0.0}, {"turn": math.nan},
        {"points": 0}, {"points": 10.0}, {"points": True}, {"largest": 1e-7},
    ],
)  # fmt: skip
def test_steps_that_lead_nowhere_are_refused_by_name(wrong: dict[str, Any]) -> None:
    with pytest.raises(REFUSED, match=next(iter(wrong))):
        Steps(**wrong)


NARROW = (1.2, 1.2 + 40 * math.ulp(1.2))


@pytest.mark.parametrize("bounds", [(1,), (None, 2), "ab", 3.0, (1.3, 1.1), (0, math.inf), NARROW])
def test_a_range_that_is_none_is_refused(bounds: Any) -> None:
    with pytest.raises(REFUSED, match="bounds"):
        vi.continue_orbit(symmetric(), "omega", bounds)


@pytest.mark.parametrize("bounds", [(1,), (None, 2), "ab"])
@pytest.mark.slow
def test_a_range_that_is_none_is_refused_on_another_branch_too(bounds: Any) -> None:
    branch = vi.continue_orbit(vi.symmetric_orbits(paper_damper("A", 1.1))[0], "omega", (1.0, 1.15))
    with pytest.raises(REFUSED, match="bounds"):
        vi.switch_branch(branch.special_points[0], bounds)


def test_starts_of_the_wrong_kind_are_refused() -> None:
    with pytest.raises(REFUSED, match=r"guess = 3\.0"):
        vi.find_orbit(DAMPER, 3.0)  # type: ignore[arg-type]
    with pytest.raises(REFUSED, match="converged orbit"):
        vi.continue_orbit(SETTLING, "omega", (1.0, 1.3))  # type: ignore[arg-type]
    with pytest.raises(REFUSED, match="special point"):
        vi.switch_branch("BP1", (1.0, 1.3))  # type: ignore[arg-type]


@pytest.mark.parametrize("impacts", [[3], [(0.5, 1)], [(0, 1, 1)], ["C"], [None]])
def test_impacts_that_are_no_stops_are_refused(impacts: list[Any]) -> None:
    with pytest.raises(REFUSED, match="two integers"):
        vi.find_orbit(DAMPER, symmetric(), stops=impacts)


def test_one_stop_alone_is_no_sequence() -> None:
    with pytest.raises(REFUSED, match="stops = 3: must be a sequence"):
        vi.find_orbit(DAMPER, symmetric(), stops=3)  # type: ignore[arg-type]


@pytest.mark.parametrize("cycles", [1.0, True, -1, "1"])
def test_cycles_are_an_integer(cycles: Any) -> None:
    with pytest.raises(REFUSED, match="cycles = "):
        vi.find_orbit(DAMPER, symmetric(), cycles=cycles)


@pytest.mark.parametrize("bad", [0.0, -1.0, math.nan, math.inf])
def test_times_and_states_of_a_guess_are_checked(bad: float) -> None:
    states, durations = unfolded(symmetric())
    wrong = durations.copy()
    wrong[0] = bad
    with pytest.raises(REFUSED, match="durations"):
        vi.find_orbit(DAMPER, vi.Guess(states, wrong), stops=["A", "B"])
    if not math.isfinite(bad):
        broken = states.copy()
        broken[0, 0] = bad
        with pytest.raises(REFUSED, match="states"):
            vi.find_orbit(DAMPER, vi.Guess(broken, durations), stops=["A", "B"])


@pytest.mark.parametrize("states", [[], 1.0, [[]]])
def test_states_of_a_guess_are_rows(states: Any) -> None:
    with pytest.raises(REFUSED, match=r"guess\.states has shape"):
        vi.find_orbit(DAMPER, vi.Guess(states, np.ones(1)), stops=["A"])


def test_a_family_names_a_keyword_that_its_function_does_not_take() -> None:
    with pytest.raises(REFUSED, match=r"walled.*'q'"):
        vi.Family(walled, k=1.0, shift=0.0, lines=1, q=2.0)
    with pytest.raises(REFUSED, match=r"walled.*'shift'"):
        vi.Family(walled, k=1.0, lines=1)


def test_a_number_that_counts_cannot_be_differentiated() -> None:
    family = vi.Family(walled, k=1, shift=0.0, lines=2)
    assert isinstance(expanded(family, "k"), vi.Mechanism)  # 1 is as good as 1.0
    with pytest.raises(REFUSED, match="cannot be differentiated"):
        expanded(family, "lines")
    with pytest.raises(REFUSED, match=r"one of k, shift\."):
        with_parameter(vi.Family(walled, k=1.0, shift=0.0, lines=True), "lines", 3)


# ---- what messages say ---------------------------------------------------------------------------


def test_two_restitutions_are_named_one_by_one() -> None:
    system = oscillator(upper=0.5, lower=-0.5, restitution=(0.6, 0.7))
    with pytest.raises(REFUSED, match=r"restitution\[0\] or elements\[0\]\.restitution\[1\]"):
        with_parameter(system, "elements[0].restitution", 0.5)
    assert isinstance(with_parameter(system, "elements[0].restitution[1]", 0.5), vi.Mechanism)


def test_a_system_without_forcing_is_not_told_to_take_omega() -> None:
    with pytest.raises(REFUSED, match=r"Take a path") as told:
        with_parameter(replace(oscillator(upper=0.5), forces=()), "omega", 1.0)
    assert "forces[0]" not in str(told.value)


def test_a_stroboscopic_map_asks_for_forcing() -> None:
    """An elastic mass between two walls goes on for ever: an orbit without forcing."""
    free = vi.Mechanism(
        mass=[[1.0]], damping=[[0.0]], stiffness=[[0.0]],
        elements=(vi.RigidStop((1.0,), -1.0, 1.0, 1.0),),
    )  # fmt: skip
    states = np.array([[1.0, -1.0, 0.0], [-1.0, 1.0, 0.0]])
    autonomous = vi.Orbit(
        free, symmetric().signature.__class__(((0, 1), (0, -1)), 0), states, np.full(2, 2.0), 0.0
    )
    with pytest.raises(REFUSED, match="no forcing"):
        stroboscopic_map(autonomous)
    with pytest.raises(REFUSED, match=r"after = 1\.5"):
        stroboscopic_map(symmetric(), 1.5)


def test_more_impacts_than_the_guess_has_are_counted_out() -> None:
    with pytest.raises(REFUSED, match="the sequence has 4 impacts and the guess 2"):
        vi.find_orbit(DAMPER, symmetric(), stops=["A", "A", "B", "B"])


def test_a_symbol_names_contacts_that_are_not_the_first() -> None:
    two = replace(
        oscillator(upper=0.5),
        elements=(vi.RigidStop((1.0,), lower=-50.0), oscillator(upper=0.5).elements[0]),
    )
    orbit = vi.find_orbit(two, vi.State((0.0,), (0.0,)))
    assert orbit.converged
    counts = f"{orbit.signature.cycles}-{len(orbit.signature.impacts)}-0"
    assert orbit.symbol == f"{counts} (contact 1)"
