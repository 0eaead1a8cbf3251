"""Branches of impacting orbits against closed forms, 50-digit references and AUTO-07p."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np
import pytest
from support.periodic import guess_of_entry, impacts_of, mechanism_of_entry, numbers, table
from support.systems import paper_damper

import vibroimpact as vi
from vibroimpact.branches.continue_orbit import STEPS
from vibroimpact.branches.same_orbit import loop_of, same_loop
from vibroimpact.compile.prescribed import Linearised, Prescribed, compile_prescribed
from vibroimpact.continuation import Stopped
from vibroimpact.model.parameters import with_parameter
from vibroimpact.orbits.find import repeated, unfolded
from vibroimpact.orbits.problem import OrbitProblem, Signature

PERIODIC, AUTO, BIFURCATIONS = map(table, ("periodic.toml", "auto.toml", "bifurcations.toml"))
PATHS = {
    "omega": "omega",
    "amplitude": "forces[0].cosine[0]",
    "wall": "elements[0].upper",
    "w": "omega",
    "A": "forces[0].cosine[0]",
    "d": "elements[0].upper",
}
KINDS = {"V": "ZERO"}
# Points are located to rounding of their test function; references are exact to 25 digits.
LOCATED = 1e-10


def orbit_of(case: dict[str, Any], system: vi.Mechanism) -> vi.Orbit:
    """Newton from the orbit of a reference."""
    impacts = impacts_of(case["signature"])
    return vi.find_orbit(system, guess_of_entry(case), stops=impacts, cycles=case["cycles"])


def start_near(case: dict[str, Any], system: vi.Mechanism, push: float) -> vi.Orbit:
    """Newton from a tabulated special point, of which the state after the last impact is known.

    At a fold Newton's matrix is singular: the guess is pushed along its null vector.
    """
    impacts = impacts_of(case["signature"])
    state, durations = np.array([*numbers(case["last"]), float(case["phase"])]), case["times"]
    compiled, states = compile_prescribed(mechanism_of_entry(case)), []
    for duration, impact in zip(numbers(durations), impacts, strict=True):
        states.append(state)
        state = compiled.linearise([state], [duration], [impact]).after[0]
    first = (impacts[-1], *impacts[:-1])
    problem = OrbitProblem(mechanism_of_entry(case), Signature(first, case["cycles"]), "")
    z = problem.packed(np.array(states), np.array(numbers(durations)))
    z = z + push * np.linalg.svd(problem.jacobian(z, 0.0)[0])[2][-1]
    return vi.find_orbit(system, vi.Guess(*problem.unpacked(z)), stops=first, cycles=case["cycles"])


@pytest.mark.slow
@pytest.mark.parametrize(
    "case", PERIODIC["special"], ids=lambda c: f"{c['name']}-{c['kind']}-{c['free']}"
)
def test_special_points_are_found_where_50_digit_arithmetic_puts_them(case: dict[str, Any]) -> None:
    path, value = PATHS[case["free"]], float(case["value"])
    exact, width = mechanism_of_entry(case), 0.0
    # at a fold only one side has orbits, and they may end soon
    offsets = (side * share * abs(value) for share in (1e-3, 1e-4, 1e-5) for side in (1.0, -1.0))
    for offset in offsets:
        push = math.sqrt(abs(offset)) if case["kind"] == "SN" else 0.0
        start = start_near(case, with_parameter(exact, path, value + offset), push)
        width = 3.0 * offset
        if start.converged:
            break
    branch = vi.continue_orbit(start, path, (value - abs(width), value + abs(width)))
    wanted = KINDS.get(case["kind"], case["kind"])
    found = [p for p in branch.special_points if p.kind == wanted]
    assert found, branch
    assert min(abs(p.parameter - value) for p in found) < LOCATED * max(1.0, abs(value))


@pytest.mark.parametrize(
    "point",
    BIFURCATIONS["bifurcation"],
    ids=lambda b: f"{b['set']}-{b['kind']}-{float(b['omega']):.4f}",
)
@pytest.mark.slow
def test_the_bifurcations_of_the_closed_form_are_found_by_continuation(
    point: dict[str, Any],
) -> None:
    omega, width = float(point["omega"]), 5e-3
    starts = [
        orbit
        for near in (omega + 0.4 * width, omega - 0.4 * width)
        for sign, orbit in zip(
            (1, -1), vi.symmetric_orbits(paper_damper(point["set"], near)), strict=False
        )
        if sign == int(point["sign"]) or point["kind"] == "SN"
    ]
    branch = vi.continue_orbit(starts[0], "omega", (omega - width, omega + width))
    assert not branch.curve.unresolved
    near = [p.parameter for p in branch.special_points if p.kind == point["kind"]]
    assert min((abs(x - omega) for x in near), default=1.0) < LOCATED, branch


def auto_points(branch: dict[str, Any]) -> Iterator[dict[str, Any]]:
    for point in (dict(zip(branch["columns"], row, strict=True)) for row in branch["points"]):
        if point["V1"] > 1e-3 and point["V2"] > 1e-3:
            yield point


@pytest.mark.parametrize("branch", AUTO["branch"], ids=lambda b: b["name"])
def test_orbits_found_here_lie_on_the_branches_of_auto(branch: dict[str, Any]) -> None:
    free = branch["free"]
    for point in auto_points(branch):
        p = {key: point.get(key, branch.get(key)) for key in "kcAdew"}
        system = vi.Mechanism(
            mass=[[1.0]],
            damping=[[p["c"]]],
            stiffness=[[p["k"]]],
            forces=(vi.Harmonic(p["w"], (0.0,), (p["A"],)),),
            elements=(vi.RigidStop((1.0,), upper=p["d"], restitution=p["e"]),),
        )
        # impact 1 ends flight 1: the state after it has speed -e V1 and phase phase1
        states = np.array(
            [
                [p["d"], -p["e"] * point["V1"], point["phase1"]],
                [p["d"], -p["e"] * point["V2"], point["phase2"]],
            ]
        )
        guess = vi.Guess(states, np.array([point["T2"], point["T1"]]))
        orbit = vi.find_orbit(system, guess, stops="AA", cycles=2)
        if point["type"] in ("LP", "BP"):
            continue  # singular there: the points themselves are compared above
        assert orbit.converged, (free, point)
        speeds = -orbit.states[:, 1] / p["e"]
        # AUTO's own tolerance is 1e-10 in the norm of the whole solution
        np.testing.assert_allclose(speeds, [point["V1"], point["V2"]], rtol=2e-7)
        np.testing.assert_allclose(orbit.states[:, 2], states[:, 2], atol=2e-7)


@cache
def symmetric() -> vi.Branch:
    damper = paper_damper("A", 0.75)
    return vi.continue_orbit(vi.symmetric_orbits(damper)[0], "omega", (0.7, 0.8))


@cache
def asymmetric() -> vi.Branch:
    """One of the two mirror images that are born at the branch point."""
    other = vi.switch_branch(symmetric()["BP1"], (0.6, 0.8))
    assert isinstance(other, vi.Branch)
    return other


@cache
def grown() -> vi.Branch:
    """With one impact more, from where the asymmetric orbit grazes."""
    other = vi.switch_branch(asymmetric()["GR1"], (0.6, 0.7))
    assert isinstance(other, vi.Branch)
    return other


@pytest.mark.slow
def test_symmetry_breaking_leads_to_two_mirror_images() -> None:
    # the branch holds one of them, from where it is born
    other, middle = asymmetric(), asymmetric()["BP1"].parameter
    assert Stopped.REPEATED in {end.reason for end in other.curve.ends}
    assert other.values.max() == middle
    first = other.orbit(next(i for i in range(len(other)) if 0.69 < other.values[i] < 0.7))
    (mirror,) = vi.symmetries(first.system)
    image = vi.Guess(mirror.image(first.states, math.pi), first.durations)
    second = vi.find_orbit(first.system, image, stops="BA", cycles=1)
    for orbit in (first, second):
        assert orbit.stable
        assert not orbit.symmetric
    loops = loop_of(first), loop_of(second)
    assert same_loop(*loops, first.mechanism, 1e-9) == "mirror image"


@pytest.mark.slow
@pytest.mark.parametrize("first", [0.005, 0.01, 0.02, 0.04])
@pytest.mark.parametrize("low", [0.6, 0.65])
def test_panels_do_not_shrink_towards_a_birth(low: float, first: float) -> None:
    # dp/ds vanishes there, and is solved for with a matrix that becomes singular: more and more of
    # it is rounding, which no shorter panel resolves
    steps = replace(STEPS, first=first)
    born = vi.switch_branch(symmetric()["BP1"], (low, 0.8), steps=steps)
    assert isinstance(born, vi.Branch)
    curve = born.curve
    ends = [curve.arclength[curve.panel == k][-1] for k in range(curve.panel.max() + 1)]
    assert np.diff(ends).min() > 0.1 * first
    assert curve.rejected <= 3
    assert not curve.unresolved


@pytest.mark.slow
def test_period_doubling_leads_to_orbits_of_twice_the_period() -> None:
    doubled = vi.switch_branch(asymmetric()["PD1"], (0.66, 0.67))
    assert asymmetric()["PD1"].bounds == asymmetric().bounds == (0.6, 0.8)  # the default
    assert isinstance(doubled, vi.Branch)
    last = doubled.orbit(int(np.argmin(doubled.values)))
    assert last.symbol == "2-2-2"
    assert np.ptp(last.durations[::2]) > 1e-3  # not the simple orbit twice
    assert last.determinant_error < 1e-10


@pytest.mark.slow
def test_at_grazing_an_orbit_with_one_impact_more_begins_at_speed_zero() -> None:
    # (T45): one multiplier grows like 1 / speed, so that their product tends to a limit; at half
    # the speed it differs from it by half as much
    assert grown().symbol in ("1-1-2", "1-2-1")
    speeds, largest = grown().impact_speed, np.abs(grown().multipliers).max(axis=1)
    assert speeds[0] < 1e-9
    small = (speeds > 1e-6) & (speeds < 0.05)
    assert small.sum() >= 3
    products = (speeds * largest)[small]
    assert np.abs(products / products[0] - 1.0).max() < 20.0 * speeds[small].max()


def test_the_touching_orbit_dips_by_the_square_of_the_impact_speed() -> None:
    # square-root law: without the impact the gap would reach -v^2 / (2 a), a its acceleration
    orbit, touch = asymmetric()["GR1"].orbit, asymmetric()["GR1"].nearest
    assert touch is not None
    compiled, start = orbit.problem.compiled(orbit.parameter_value), orbit.states[touch.segment]
    errors = []
    for back in (0.02, 0.01):  # time before the touch at which the same flight is stopped
        times = touch.time + back * np.array([-1.0, 0.0, 1.0])
        x = np.array([compiled.after(start, t) for t in times])
        u, rate = x[:, 1] - x[:, 0], x[:, 3] - x[:, 2]
        acceleration = abs(rate[2] - rate[0]) / (2.0 * back)
        errors.append(abs(2.0 * acceleration * abs(u[1] - u[0]) / rate[0] ** 2 - 1.0))
    assert errors[0] < 0.05
    assert errors[1] < 0.7 * errors[0]


@pytest.mark.slow
def test_a_vanishing_impact_leads_back_to_the_orbit_without_it() -> None:
    touch = asymmetric()["GR1"].parameter
    start = next(i for i in range(len(grown())) if abs(grown().values[i] - touch) > 5e-4)
    bounds = (touch - 2e-3, touch + 2e-3)
    again = vi.continue_orbit(grown().orbit(start), "omega", bounds)
    zeros = [p for p in again.special_points if p.kind == "ZERO"]
    near = min(zeros, key=lambda p: abs(p.parameter - touch))
    assert abs(near.parameter - touch) < 1e-9
    back = vi.switch_branch(near, bounds)
    assert isinstance(back, vi.Branch)
    assert back.symbol == "1-1-1"


def plastic(preload: float, swing: float) -> vi.Mechanism:
    """A mass before a plastic stop at 1/2 + swing cos t."""
    return vi.Mechanism(
        mass=[[1.0]],
        damping=[[0.1]],
        stiffness=[[1.0]],
        forces=(vi.Harmonic(1.0, (0.0,), (1.0,)),),
        elements=(
            vi.RigidStop(
                (1.0,), upper=0.5, restitution=0.0, motion=(vi.Harmonic(1.0, (0.0,), (swing,)),)
            ),
        ),
        constant_force=[preload],
    )


@pytest.mark.slow
@pytest.mark.parametrize("swing", [0.0, 0.1])
def test_onset_of_sticking_is_where_a_plastic_impact_no_longer_opens(swing: float) -> None:
    # after it the mass has the place and speed of the stop: it opens if
    # cos(theta) + preload - 0.1 x' - x - (stop)'' < 0, and the onset is where this vanishes along the branch
    system = vi.Family(plastic, preload=0.0, swing=swing)
    guess = next(
        orbit
        for phase in np.linspace(0.0, 6.0, 25)
        if (
            orbit := vi.find_orbit(
                system,
                vi.Guess(
                    np.array([[0.5 + swing * math.cos(phase), -swing * math.sin(phase), phase]]),
                    np.array([2.0 * math.pi]),
                ),
                stops="A",
                cycles=1,
            )
        ).converged
    )
    branch = vi.continue_orbit(guess, "preload", (-2.0, 2.0))
    points = [p for p in branch.special_points if p.kind in ("CS", "SS")]
    assert points
    for point in points:
        theta = point.orbit.states[0, 2]
        left = math.cos(theta) + point.parameter - 0.5 + 0.1 * swing * math.sin(theta)
        assert abs(left) < 1e-9


def test_what_cannot_be_continued_is_refused_with_what_is_allowed() -> None:
    orbit = vi.symmetric_orbits(paper_damper("A", 1.2))[0]
    with pytest.raises(vi.InvalidParameterError, match="must be one of mass_ratio"):
        vi.continue_orbit(orbit, "frequency", (0.9, 1.2))
    with pytest.raises(vi.InvalidParameterError, match="need low < high"):
        vi.continue_orbit(orbit, "omega", (1.2, 0.9))
    with pytest.raises(vi.InvalidParameterError, match="must hold omega = 1"):
        vi.continue_orbit(orbit, "omega", (5.0, 6.0))
    branch = vi.continue_orbit(orbit, "omega", (1.2, 1.21))
    with pytest.raises(vi.InvalidParameterError, match="there is no special point here"):
        branch["PD7"]


def test_where_no_branch_begins_a_sentence_says_so() -> None:
    damper = paper_damper("A", 1.02)
    branch = vi.continue_orbit(vi.symmetric_orbits(damper)[0], "omega", (1.0, 1.05))
    answer = vi.switch_branch(branch["NS1"], (1.0, 1.05))
    assert isinstance(answer, vi.NotFound)
    assert "no other branch" in answer.reason


def test_evaluations_of_a_point_do_not_grow_with_the_impacts_of_its_orbit(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    counted = [0]
    linearise = Prescribed.linearise

    def counting(self: Prescribed, *segments: Any) -> Linearised:
        counted[0] += 1
        return linearise(self, *segments)

    monkeypatch.setattr(Prescribed, "linearise", counting)
    damper = paper_damper("A", omega=1.1)
    once = vi.find_orbit(damper, vi.symmetric_orbits(damper)[0], symmetric=False)
    per_point = []
    for times in (1, 6):
        orbit = vi.find_orbit(
            damper, repeated(unfolded(once), once.signature.cycles, times),
            stops=once.signature.impacts * times, cycles=once.signature.cycles * times,
        )  # fmt: skip
        counted[0] = 0
        steps = vi.Steps(first=0.005, largest=0.02, points=24)
        branch = vi.continue_orbit(orbit, "omega", (1.0, 1.2), steps=steps, both=False)
        per_point.append(counted[0] / len(branch))
    # the guess of a point, the point where that is not right to rounding; refused panels, special points
    assert max(per_point) <= 2.5


def test_the_equations_hold_at_every_point_however_coarse_the_steps() -> None:
    steps = vi.Steps(first=0.3, largest=4.0, tolerance=1e-3)
    (start, _) = vi.symmetric_orbits(paper_damper("A", 0.95))
    branch = vi.continue_orbit(start, "omega", (0.6, 1.2), inadmissible=True, steps=steps)
    assert len(branch) > 20
    assert all(branch.orbit(k).converged for k in range(len(branch)))


def test_a_branch_keeps_no_evaluation_of_its_points() -> None:
    """Each has a compiled machine, with the exponentials of its flights."""
    damper = paper_damper("A", omega=1.1)
    steps = vi.Steps(points=12)
    branch = vi.continue_orbit(
        vi.symmetric_orbits(damper)[0], "omega", (1.0, 1.2), steps=steps, both=False
    )
    own = [x for x in vars(branch.family).values() if isinstance(x, dict) and x]
    assert not [x for kept in own for x in kept.values() if isinstance(x, Prescribed | Linearised)]
