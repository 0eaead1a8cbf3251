"""Members of an ensemble: each runs as if it were alone."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from support.families import CHAIN, PAIR, swinging
from support.systems import paper_damper

import vibroimpact as vi
from vibroimpact import _kernel
from vibroimpact.compile import hybrid
from vibroimpact.compile.modes import Mode, closed_from_code
from vibroimpact.compile.tables import Stacks, kernel_arguments
from vibroimpact.model.parameters import with_parameters
from vibroimpact.model.system import System
from vibroimpact.sweeps.execution.batch import Members, batch_of, run_members
from vibroimpact.sweeps.member_status import MemberStatus
from vibroimpact.sweeps.observers import Final, Impacts, Shares
from vibroimpact.sweeps.observers.observer import Observer

Values = dict[str, np.ndarray]
DAMPER = paper_damper("A", 1.1)

SEEN: tuple[Observer, ...] = (Final(), Impacts(), Shares())


def members_of(
    system: list[int], position: list[float], velocity: list[float], length: float
) -> Members:
    """One member for each of these systems, from the same state."""
    count = len(system)
    return Members(
        np.array(system, dtype=np.int32), np.tile(position, (count, 1)),
        np.tile(velocity, (count, 1)), np.linspace(0.0, 1.0, count), np.zeros(count),
        np.full(count, length), 500,
    )  # fmt: skip


def alone_in_its_batch(system: System, values: Values, members: Members, row: int) -> Any:
    """A member run with no other."""
    k = members.system[row]
    only = members.of(np.array([row]), np.array([0]))
    return run_members(batch_of(system, {n: x[k : k + 1] for n, x in values.items()}), only, SEEN)


def check_members(system: System, values: Values, members: Members) -> dict[str, np.ndarray]:
    """Every member of a batch against the same member alone."""
    out = run_members(batch_of(system, values), members, SEEN)
    for row in range(len(members.system)):
        for name, one in alone_in_its_batch(system, values, members, row).items():
            assert one.tobytes() == out[name][row : row + 1].tobytes(), (name, row)
    return out


def test_members_of_systems_with_several_structures_run_as_alone() -> None:
    values = {"c": np.array([0.0, 0.1, 0.2, 0.3]), "m": np.array([1.0, 1.0, 2.0, 3.0])}
    members = members_of([3, 0, 2, 1, 0, 3], [0.0, 0.1], [0.3, 1.0], 60.0)
    out = check_members(PAIR, values, members)
    assert np.all(out["end"] == MemberStatus.OK)
    for row, k in enumerate(members.system):
        one = with_parameters(PAIR, {name: float(x[k]) for name, x in values.items()})
        start = vi.State((0.0, 0.1), (0.3, 1.0), float(members.phase[row]))
        run = vi.simulate(one, start, t_max=60.0)
        assert run.position[-1].tobytes() == out["final_position"][row].tobytes()


def held(k: float, c: float, pull: float) -> vi.Mechanism:
    """An impact damper whose mass moves freely, or is held by a spring, braked, or pulled."""
    return vi.Mechanism(
        mass=[[1.0, 0.0], [0.0, 0.5]],
        damping=[[0.1, 0.0], [0.0, c]],
        stiffness=[[1.0, 0.0], [0.0, k]],
        forces=(vi.Harmonic(0.9, (1.0, 0.0)),),
        constant_force=(0.0, pull),
        elements=(vi.RigidStop((1.0, -1.0), lower=-2.0, upper=2.0, restitution=0.7),),
    )


def test_a_free_mass_runs_as_alone_beside_one_that_is_held() -> None:
    """What lanes leave out for bodies that move straight on is left out for all of them or none."""
    values = {
        "k": np.array([0.0, 0.0, 0.0, 0.1, 0.0, 0.3]),
        "c": np.array([0.0, 0.0, 0.1, 0.0, 0.0, 0.0]),
        "pull": np.array([0.0, 0.05, 0.0, 0.0, 0.0, 0.05]),
    }
    members = members_of([0, 4, 1, 0, 2, 3, 5, 0, 4, 3] * 4, [0.1, 0.0], [0.3, -0.4], 300.0)
    out = check_members(vi.Family(held, k=0.0, c=0.0, pull=0.0), values, members)
    assert np.all(out["end"] == MemberStatus.OK)


def test_a_narrow_clearance_runs_as_alone_beside_a_wide_one() -> None:
    """Rounds look ahead at times one step apart in the first, one and a half in the other."""
    members = members_of(list(range(8)) * 5, [0.1, 0.0], [0.3, -0.4], 300.0)
    values = {"half_clearance": np.array([1.0, 5.0, 1.5, 9.0, 2.0, 0.7, 1.0, 6.0])}
    out = check_members(paper_damper("A", 1.0), values, members)
    assert np.all(out["end"] == MemberStatus.OK)


CHATTERING = paper_damper("C", 0.42, restitution=0.3), {"omega": np.linspace(0.42, 0.43, 12)}


def test_modes_of_closed_contacts_are_those_of_the_system_of_each_member() -> None:
    """More systems than lanes, all of which come to rest on the stops."""
    members = members_of(list(range(12)), [0.0, 0.0], [0.0, 1.0], 500.0)
    out = check_members(*CHATTERING, members)
    assert np.all(out["share_at_rest"] > 0.0)


def test_a_mode_that_is_refused_leaves_the_batch_as_it_was(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    compiled = Stacks.kernel

    def refused_once(stacks: Stacks) -> _kernel.Batch:
        free, *closed = stacks.modes
        kernel = compiled(replace(stacks, modes=[free]))
        closed = [kernel_arguments(mode) for mode in closed]
        with pytest.raises(ValueError, match="offset has 3 numbers; expected 2"):
            kernel.add_mode(**closed[0] | {"offset": np.zeros(3)})
        with pytest.raises(ValueError, match="offset: varied outside its numbers"):
            kernel.add_mode(**closed[0] | {"varied": {"offset": {2: 0}}})
        with pytest.raises(ValueError, match="varied: there is no array 'shifts' here"):
            kernel.add_mode(**closed[0] | {"varied": {"shifts": {0: 0}}})
        for mode in closed:
            kernel.add_mode(**mode)
        return kernel

    members = members_of([0, 5, 11], [0.0, 0.0], [0.0, 1.0], 500.0)
    expected = run_members(batch_of(*CHATTERING), members, SEEN)
    monkeypatch.setattr(Stacks, "kernel", refused_once)
    found = run_members(batch_of(*CHATTERING), members, SEEN)
    for name, one in expected.items():
        assert one.tobytes() == found[name].tobytes(), name


def test_no_members_are_no_results() -> None:
    none = members_of([], [0.0, 0.1], [0.3, 1.0], 60.0)
    out = run_members(batch_of(PAIR, {"c": [0.0, 0.2], "m": [1.0, 2.0]}), none, SEEN)
    assert out["end"].shape == (0,)
    assert out["final_position"].shape == (0, 2)


def falling(g: float, r: float) -> vi.Mechanism:
    """Three balls of different masses, joined by weak springs, above one floor."""
    return vi.Mechanism(
        mass=[[1.0, 0.0, 0.0], [0.0, 2.0, 0.0], [0.0, 0.0, 3.0]],
        damping=[[0.0] * 3] * 3,
        stiffness=[[0.1, -0.1, 0.0], [-0.1, 0.2, -0.1], [0.0, -0.1, 0.1]],
        forces=(vi.Harmonic(1.0, (0.2 * g, 0.0, 0.0)),),
        constant_force=(-g, -2.0 * g, -3.0 * g),
        elements=tuple(
            vi.RigidStop(tuple(float(i == j) for j in range(3)), 0.0, restitution=r)
            for i in range(3)
        ),
    )


def test_members_that_want_more_modes_are_finished() -> None:
    """Three balls come to rest one after the other: seven closed sets, none compiled at first."""
    system = vi.Family(falling, g=1.0, r=0.5)
    values = {"g": np.array([1.0, 2.0, 3.0]), "r": np.array([0.5, 0.2, 0.0])}
    members = members_of([2, 0, 1, 2], [0.1, 1.0, 3.0], [0.0, 0.0, 0.0], 40.0)
    out = check_members(system, values, members)
    assert np.all(out["end"] == MemberStatus.OK)
    assert np.all(np.abs(out["final_position"]) < 1e-12)


def test_a_mode_that_one_system_lacks_is_no_matter_for_the_others() -> None:
    """The first and third stop hold a corner, or (slope 0) the same coordinate twice."""

    def cornered(slope: float) -> vi.Mechanism:
        rows, stops = ((1.0, 0.0), (0.0, 1.0), (1.0, slope)), (0.0, -1e3, 0.0)
        return vi.Mechanism(
            mass=[[1.0, 0.0], [0.0, 1.0]], damping=[[0.0] * 2] * 2, stiffness=[[0.0] * 2] * 2,
            constant_force=(-1.0, -0.5),
            elements=tuple(
                vi.RigidStop(row, stop, restitution=0.0)
                for row, stop in zip(rows, stops, strict=True)
            ),
        )  # fmt: skip

    values = {"slope": np.array([1.0, 0.0, 0.5])}
    members = members_of([0, 1, 2, 1], [1.0, 0.5], [0.0, 0.0], 20.0)
    out = check_members(vi.Family(cornered, slope=1.0), values, members)
    assert np.all(out["end"] == MemberStatus.OK)


def test_a_member_whose_mode_cannot_be_compiled_ends_as_missing(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    mode = hybrid.Hybrid.mode

    def refusing(self: hybrid.Hybrid, code: int) -> Mode:
        if len(closed_from_code(code, 2)) == 2 and self.mechanism.constant_force[0] > -1.5:
            raise vi.InvalidParameterError("contacts: not determined.")
        return mode(self, code)

    monkeypatch.setattr(hybrid.Hybrid, "mode", refusing)
    members = members_of([0, 0, 1, 0], [0.1, 1.0, 3.0], [0.0, 0.0, 0.0], 40.0)
    out = check_members(vi.Family(falling, g=1.0, r=0.5), {"g": np.array([1.0, 2.0])}, members)
    missing = out["end"] == MemberStatus.MISSING
    assert missing.tolist() == [True, True, False, True]
    assert np.all(out["time"][missing] < 40.0)
    assert out["end"][2] == MemberStatus.OK


def test_members_of_systems_at_resonance_run_as_others_do() -> None:
    values = {"omega": np.array([0.7, 0.5, 1.1]), "zeta": np.array([0.0, 0.0, 0.1])}
    members = members_of([1, 0, 2, 1], [0.0, 0.0], [0.0, 0.0], 20.0)
    out = check_members(DAMPER, values, members)
    assert out["end"].tolist() == [MemberStatus.OK] * 4


def test_arrays_of_several_lengths_and_mixed_mechanisms_are_refused() -> None:
    with pytest.raises(vi.InvalidParameterError, match=r"zeta has shape \(3,\); expected \(S,\)"):
        batch_of(DAMPER, {"omega": [1.0, 1.1], "zeta": [0.1, 0.2, 0.3]})
    with pytest.raises(vi.InvalidParameterError, match="omega has shape"):
        batch_of(DAMPER, {"omega": []})

    def growing(n: float) -> vi.Mechanism:
        return CHAIN if n > 2.5 else swinging(n, 1.0, 0.0)

    with pytest.raises(vi.InvalidParameterError, match="different numbers of coordinates"):
        batch_of(vi.Family(growing, n=2.0), {"n": [2.0, 3.0]})
