"""The search for periodic orbits: what it lists is right, without repetition, and repeatable."""

from __future__ import annotations

import math
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from support.periodic import chain, largest
from support.systems import oscillator, paper_damper

import vibroimpact as vi
from vibroimpact.cli import main as cli
from vibroimpact.model.stop import Stop
from vibroimpact.model.translations import Translations
from vibroimpact.orbits.find import SAME_ORBIT_RELATIVE, primitive, unfolded
from vibroimpact.orbits.mirror_images import image_of
from vibroimpact.orbits.near_returns import KnownLoops, beginnings
from vibroimpact.orbits.orbit import Orbit
from vibroimpact.orbits.problem import Signature
from vibroimpact.orbits.search import find_orbits
from vibroimpact.orbits.search_result import GuessEnd, MotionEnd, OrbitSearch
from vibroimpact.orbits.starts import starts_of

CASE = ["impact-damper/B", "--omega", "0.9454"]
SMALL = {"most_cycles": 2, "most_impacts": 3, "starts": 12}


@cache
def found() -> OrbitSearch:
    """A damper with coexisting orbits of several kinds."""
    return find_orbits(paper_damper("B", 0.9454), **SMALL)


def same(a: Orbit, b: Orbit, within: float) -> bool:
    """Whether two orbits are one, up to where they begin: by brute force."""
    m = len(a.signature.impacts)
    if (len(b.signature.impacts), b.signature.cycles) != (m, a.signature.cycles):
        return False
    here, there = unfolded(a).states, unfolded(b).states
    for k in range(m):
        turned = np.roll(there, -k, axis=0)
        order = b.signature.impacts[k:] + b.signature.impacts[:k]
        wrap = np.angle(np.exp(1j * (here[:, -1] - turned[:, -1])))
        apart = max(largest(here[:, :-1] - turned[:, :-1]) / largest(here[:, :-1]), largest(wrap))
        if order == a.signature.impacts and apart <= within:
            return True
    return False


# ---- what is listed ------------------------------------------------------------------------------


def test_orbits_are_listed_once_within_the_bounds_and_primitive() -> None:
    orbits = found().orbits
    assert len(orbits) >= 5
    for k, orbit in enumerate(orbits):
        assert orbit.converged
        assert orbit.signature.cycles <= SMALL["most_cycles"]
        assert len(orbit.signature.impacts) <= SMALL["most_impacts"]
        assert not any(same(orbit, other, 1e-5) for other in orbits[:k])
        again = primitive(orbit)
        assert again.symbol == orbit.symbol
        assert again.symmetric == orbit.symmetric


def test_stable_unstable_and_inadmissible_orbits_are_all_found_and_marked() -> None:
    orbits = found().orbits
    assert {o.stable for o in orbits} == {True, False}
    assert {o.symmetric for o in orbits} == {True, False}
    for orbit in orbits:
        assert orbit.stable == (orbit.admissible and largest(orbit.multipliers) < 1.0)
        assert bool(orbit.inadmissible_reason) != orbit.admissible


def test_both_closed_form_orbits_are_in_the_list() -> None:
    damper = paper_damper("B", 0.9454)
    for closed in vi.symmetric_orbits(damper):
        wanted = vi.find_orbit(damper, closed)
        assert any(same(wanted, orbit, SAME_ORBIT_RELATIVE) for orbit in found().orbits)


def test_every_orbit_of_a_symmetric_system_has_its_mirror_image() -> None:
    search = found()
    (mirror,) = vi.symmetries(search.orbits[0].system)
    for orbit, of in zip(search.orbits, search.mirror_of, strict=True):
        image = image_of(orbit, mirror)
        matches = [k for k, other in enumerate(search.orbits) if same(image, other, 1e-5)]
        assert len(matches) == 1
        assert (search.orbits[matches[0]] is orbit) == orbit.symmetric
        if of is not None:
            assert matches == [of]
            assert search.mirror_of[of] is None
    assert any(of is not None for of in search.mirror_of)


def test_orbits_come_by_cycles_impacts_and_symbol() -> None:
    rank = [(o.signature.cycles, len(o.signature.impacts), o.symbol) for o in found().orbits]
    assert rank == sorted(rank)


def test_the_attractors_of_a_sweep_are_in_the_list() -> None:
    """The brute-force answer: what motions settle on, if it is within the bounds."""
    damper = paper_damper("A", 0.9)
    search = find_orbits(damper, most_cycles=2, most_impacts=4, starts=8)
    attractor = vi.classify(damper, vi.State((0.0, 0.0), (0.0, 1.0)))
    assert str(attractor.type) in {o.symbol for o in search.orbits if o.stable}


@pytest.mark.parametrize("walls", [0.0, 0.3])
def test_a_one_sided_wall_at_or_off_the_rest_position_is_searched(walls: float) -> None:
    """D: x'' + x = cos(3.7 t), restitution 0.8, has the stable orbit of two periods, V = 0.6657."""
    force = vi.Harmonic(3.7, (0.0,), (1.0,))
    system = oscillator(stiffness=1.0, damping=0.0, forces=(force,), lower=-math.inf, upper=walls,
                        restitution=0.8)  # fmt: skip
    search = find_orbits(system, most_cycles=2, most_impacts=2, starts=10)
    stable = [o for o in search.orbits if o.stable]
    assert any(o.symbol == "2-1-0" for o in stable)
    if walls == 0.0:
        (orbit,) = (o for o in stable if o.symbol == "2-1-0")
        assert orbit.least_impact_speed == pytest.approx(0.665693352839985, rel=1e-12)


def test_a_system_without_forcing_is_searched() -> None:
    system = oscillator(stiffness=1.0, damping=-0.1, lower=-math.inf, upper=1.0, restitution=0.5)
    search = find_orbits(system, starts=4)
    assert [o.symbol for o in search.orbits] == ["1-0"]
    assert search.to_dataset().sizes["multiplier"] == 1


def test_a_symmetric_signature_with_unequal_halves_is_solved_as_it_is() -> None:
    """Beyond the symmetry breaking of set A there are both: the symmetric and the asymmetric."""
    search = find_orbits(paper_damper("A", 0.705), most_cycles=1, most_impacts=2, starts=12)
    kinds = [(o.symmetric, o.stable) for o in search.orbits if o.admissible]
    assert (True, False) in kinds
    assert kinds.count((False, True)) == 2  # an orbit and its mirror image


# ---- how the search went -------------------------------------------------------------------------


@pytest.mark.slow
def test_the_same_seed_gives_the_same_list_and_fewer_starts_a_part_of_it() -> None:
    once, again = found(), find_orbits(paper_damper("B", 0.9454), **SMALL)
    xr.testing.assert_identical(once.to_dataset(), again.to_dataset())
    part = find_orbits(paper_damper("B", 0.9454), **{**SMALL, "starts": 4})
    for orbit in part.orbits:
        assert any(same(orbit, other, SAME_ORBIT_RELATIVE) for other in once.orbits)
    other_seed = find_orbits(paper_damper("B", 0.9454), **{**SMALL, "starts": 4}, seed=1)
    assert other_seed.guesses != part.guesses


def test_every_motion_and_every_guess_is_counted() -> None:
    search = found()
    assert sum(search.motions.values()) == search.starts == SMALL["starts"]
    images = sum(of is not None for of in search.mirror_of)
    new = search.guesses[GuessEnd.NEW] + search.guesses[GuessEnd.INADMISSIBLE]
    assert new + images == len(search)
    assert search.repeated > 0
    text = repr(search)
    assert len(text.splitlines()) <= 10
    assert f"{len(search)} orbits" in text
    assert "12 motions (seed 0)" in text


def test_motions_that_stop_impacting_are_said_to() -> None:
    weak = vi.Harmonic(1.0, (0.05,))
    far = oscillator(stiffness=1.0, damping=0.5, forces=(weak,), lower=-math.inf, upper=1.0,
                     restitution=0.5)  # fmt: skip
    silent = find_orbits(far, starts=5)
    assert silent.motions[MotionEnd.SILENT] == 5
    assert [orbit.symbol for orbit in silent.orbits] == ["1-0-0"]  # the linear response
    assert len(find_orbits(replace(far, forces=()), starts=2)) == 0


def test_progress_is_shown_and_ctrl_c_is_not_swallowed() -> None:
    told: list[str] = []
    find_orbits(paper_damper("A", 1.2), most_cycles=1, most_impacts=2, starts=2,
                progress=lambda report: told.append(str(report)))  # fmt: skip
    assert told == [f"searching from random starts: {n} of 2 motions" for n in (1, 2)]

    def interrupt(_: vi.ProgressReport) -> None:
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        find_orbits(paper_damper("A", 1.2), starts=2, progress=interrupt)


@pytest.mark.parametrize(
    ("name", "value"),
    [("most_cycles", 0), ("most_impacts", 0), ("starts", 0), ("seed", -1), ("most_cycles", 1.5)],
)
def test_counts_out_of_range_are_refused(name: str, value: float) -> None:
    with pytest.raises(vi.InvalidParameterError, match=f"{name} = {value}"):
        find_orbits(paper_damper("A", 1.2), **{name: value})  # type: ignore[arg-type]


# ---- its parts -----------------------------------------------------------------------------------


def test_random_starts_lie_on_their_stop_behind_none_and_leave_it() -> None:
    for system in (paper_damper("A", 1.2).mechanism, chain(5, 0), chain(4, 1)):
        starts, rng = starts_of(system), np.random.default_rng(3)
        stops = set()
        for number in range(200):
            face = starts.faces[number % len(starts.faces)]
            state = starts.draw(rng, number)
            x, v = np.array(state.position), np.array(state.velocity)
            stops.add(face.impact)
            assert face.row @ x == pytest.approx(face.limit, abs=1e-12 * max(1.0, largest(x)))
            assert face.impact[1] * (face.row @ v) <= 1e-12 * largest(v)
            for c in system.rigid_stops:
                assert c.lower - 1e-12 * largest(x) <= x @ c.row <= c.upper + 1e-12 * largest(x)
        both = {(i, s) for i, c in enumerate(system.rigid_stops) for s in (1, -1)
                if math.isfinite(c.upper if s > 0 else c.lower)}  # fmt: skip
        assert stops == both


def test_a_stop_behind_another_is_never_started_from() -> None:
    near, hidden = vi.RigidStop((1.0,), upper=0.5), vi.RigidStop((1.0,), upper=0.7)
    system = vi.Mechanism(mass=[[1.0]], damping=[[0.1]], stiffness=[[1.0]],
                          forces=(vi.Harmonic(1.0, (1.0,)),), elements=(near, hidden))  # fmt: skip
    assert [face.impact for face in starts_of(system).faces] == [(0, 1)]


def test_loops_are_one_wherever_they_begin_and_phases_wrap() -> None:
    a, b = Stop(0, 1), Stop(0, -1)
    states = np.array([[1.0, 0.2, 0.001], [2.0, 0.3, 2.0], [3.0, 0.4, 4.0]])
    known = KnownLoops(np.array([10.0, 10.0]), Translations(np.zeros((1, 0)), ()))
    known.add(Signature((a, a, b), 1), states)
    turned = np.roll(states, 1, axis=0) + np.array([0.0, 0.0, 2.0 * math.pi - 0.002])
    assert known.has(Signature((b, a, a), 1), turned, 1e-3)
    assert not known.has(Signature((b, a, a), 1), turned, 1e-4)
    assert not known.has(Signature((a, b, a), 1), turned, 1e-3)
    assert not known.has(Signature((b, a, a), 2), turned, 1e-3)
    assert beginnings((a, b, a, b)) == (0, 2)
    assert beginnings((b, a, a)) == (1,)


# ---- the dataset and the command -----------------------------------------------------------------


def test_the_dataset_holds_every_orbit() -> None:
    search, data = found(), found().to_dataset()
    ends = np.cumsum(data.row_size.values)
    for k, orbit in enumerate(search.orbits):
        rows = slice(ends[k] - data.row_size.values[k], ends[k])
        guess = unfolded(orbit)
        np.testing.assert_array_equal(data.position[rows], guess.states[:, :2])
        np.testing.assert_array_equal(data.phase[rows], guess.states[:, -1])
        np.testing.assert_array_equal(data.duration[rows], guess.durations)
        stops = list(zip(data.contact.values[rows], data.side.values[rows], strict=True))
        assert stops == list(orbit.signature.impacts)
        values = data.multipliers_real[k] + 1j * data.multipliers_imaginary[k]
        np.testing.assert_array_equal(values, orbit.multipliers)


@pytest.mark.usefixtures("own_folder")
@pytest.mark.slow
def test_the_command_lists_and_writes_what_the_library_finds(
    capsys: pytest.CaptureFixture[str],
) -> None:
    counts = [word for name, n in SMALL.items() for word in (f"--{name.replace('_', '-')}", str(n))]
    assert cli.main(["orbits", *CASE, *counts, "--out", "o.nc"]) == 0
    shown = capsys.readouterr().out
    assert found().table() in shown
    assert repr(found()) in shown
    assert len(found().table().splitlines()) == len(found()) + 1
    with xr.open_dataset("o.nc", engine="h5netcdf") as data:
        assert list(data.symbol.values) == [o.symbol for o in found().orbits]
        np.testing.assert_array_equal(data.position, found().to_dataset().position)


@pytest.mark.usefixtures("own_folder")
def test_the_command_searches_a_mechanism_from_a_file(capsys: pytest.CaptureFixture[str]) -> None:
    Path("m.toml").write_text(
        "[mechanism]\nmass = [[1.0]]\ndamping = [[0.1]]\nstiffness = [[1.0]]\n"
        "[[mechanism.forces]]\nomega = 1.0\nsine = [1.0]\n"
        '[[mechanism.elements]]\nkind = "rigid_stop"\nrow = [1.0]\nupper = 1.0\nrestitution = 0.8\n'
    )
    assert cli.main(["orbits", "--config", "m.toml", "--most-cycles", "1", "--starts", "3"]) == 0
    assert "1-1-0" in capsys.readouterr().out


@pytest.mark.usefixtures("own_folder")
def test_the_command_fails_in_words(capsys: pytest.CaptureFixture[str]) -> None:
    far = ["--half-clearance", "1e4", "--restitution", "0.1", "--starts", "2"]
    assert cli.main(["orbits", *CASE, *far, "--out", "o.nc"]) == cli.FAILED
    assert "no periodic orbit was found" in capsys.readouterr().err
    assert not Path("o.nc").exists()
    assert cli.main(["orbits", *CASE, "--starts", "0"]) == cli.MISUSE
    assert "starts = 0" in capsys.readouterr().err
    assert cli.main(["orbits", *CASE, "--out", "o.svg"]) == cli.MISUSE
    assert ".nc" in capsys.readouterr().err
