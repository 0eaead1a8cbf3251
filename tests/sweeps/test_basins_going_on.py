"""Basins of members that take their time: each is labelled by where it leads in the end."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
import xarray as xr
from support.systems import paper_damper

import vibroimpact as vi
from vibroimpact.model.system import System

SET_B = paper_damper("B", 0.945)
START = vi.State((0.0, 0.0), (0.0, 1.0))
REST = vi.State((0.0,), (0.0,))
AXIS = np.linspace(-6.0, 6.0, 8)


def named(found: xr.Dataset) -> list[str]:
    """The name of the attractor of every start."""
    names = dict(enumerate(found.name.values.tolist()))
    return [names.get(int(label), "none") for label in found.attractor.values.ravel()]


def basins(system: System, over: Any, start: vi.State, **options: Any) -> xr.Dataset:
    return vi.basins(system, over=over, start=start, progress=False, **options)


@pytest.mark.parametrize(("omega", "settle"), [(1.145, 250), (1.12, 20)])
def test_chaos_with_a_long_flight_is_not_without_impacts(omega: float, settle: float) -> None:
    """classify meets a flight of ten thousand periods from some of these starts."""
    system, over = replace(SET_B, omega=omega), {"x1": AXIS, "v1": AXIS}
    found = basins(system, over, START, settle_periods=settle)
    truth = vi.sweep(system, over={}, start=vi.GridStarts(over, START), observe="lyapunov",
                     settle_periods=3000, periods=3000, progress=False).lyapunov.values.ravel()  # fmt: skip
    assert found.name.values.tolist() == ["chaotic a", "1-1-1 a"]
    chaotic = np.array(named(found)) == "chaotic a"
    assert np.all(truth[chaotic] > 0.02)
    assert np.all(truth[~chaotic] < 0.0)


def double_well(damping: float) -> vi.Mechanism:
    """A mass that is pushed to the stops of its slot and comes to rest on one of them."""
    return vi.Mechanism(
        mass=[[1.0]], damping=[[damping]], stiffness=[[-1.0]],
        elements=(vi.RigidStop((1.0,), -0.5, 0.5, 0.9),),
    )  # fmt: skip


@pytest.mark.parametrize("stop", ["A", "B"])
def test_members_that_come_to_rest_later_rest_on_their_stop(stop: str) -> None:
    over = {"x1": np.linspace(-0.45, 0.45, 6), "v1": np.linspace(-3.0, 3.0, 6)}
    soon, late = (
        basins(double_well(0.02), over, REST, at=vi.AtStop(stop), settle_periods=settle)
        for settle in (20, 250)
    )
    assert named(soon) == named(late)
    assert set(named(soon)) == {"at rest on stop A", "at rest on stop B"}


def test_a_motion_that_dies_away_is_without_impacts_at_once() -> None:
    dying = vi.Mechanism(
        mass=[[1.0]], damping=[[0.01]], stiffness=[[1.0]],
        elements=(vi.RigidStop((1.0,), -0.5, 0.5, 0.9),),
    )  # fmt: skip
    over = {"x1": np.linspace(-0.45, 0.45, 6), "v1": np.linspace(-3.0, 3.0, 6)}
    assert set(named(basins(dying, over, REST, settle_periods=0))) == {"without impacts"}


def test_members_that_never_meet_the_section_settle_all_the_same() -> None:
    light = vi.Mechanism(
        mass=[[1.0]], damping=[[0.002]], stiffness=[[1.0]], forces=(vi.Harmonic(2.2, (1.0,)),),
        elements=(vi.RigidStop((1.0,), -50.0, 0.05, 0.99),),
    )  # fmt: skip
    over = {"x1": np.linspace(-1.0, 0.04, 4), "v1": np.linspace(-1.0, 1.0, 4)}
    for stop in ("A", "B"):
        assert set(named(basins(light, over, REST, at=vi.AtStop(stop)))) == {"1-1-0 a"}


@pytest.mark.parametrize("settle", [0, 20, 251])
def test_members_go_on_at_the_phase_of_every_forcing_line(settle: float) -> None:
    """The second line has 3/2 of the frequency: a period of the first is none of the second."""
    lines = vi.Harmonic(3.2, (1.0,)), vi.Harmonic(4.8, (0.05,))
    two = vi.Mechanism(
        mass=[[1.0]], damping=[[0.05]], stiffness=[[1.0]], forces=lines,
        elements=(vi.RigidStop((1.0,), upper=0.2, restitution=0.8),),
    )  # fmt: skip
    over = {"x1": np.linspace(-2.0, 0.15, 5), "v1": np.linspace(-2.0, 2.0, 5)}
    found = basins(two, over, REST, settle_periods=settle)
    assert sorted(found.name.values) == ["2-1-0 a", "2-1-0 b"]
    truth = vi.sweep(two, over={}, start=vi.GridStarts(over, REST), observe="final", settle_periods=3950,
                     progress=False).final_position.values.ravel()  # fmt: skip
    labels = found.attractor.values.ravel()
    assert np.ptp(truth) > 0.1
    assert all(np.ptp(truth[labels == label]) < 1e-3 for label in (0, 1))


def test_a_section_of_the_transient_alone_takes_seconds_not_minutes() -> None:
    """The second mass strikes its stop at first only; what settles is the first one."""
    weak = vi.Mechanism(
        mass=[[1.0, 0.0], [0.0, 1.0]], damping=[[0.05, 0.0], [0.0, 0.02]],
        stiffness=[[1.0, -0.02], [-0.02, 1.5]], forces=(vi.Harmonic(0.8, (1.0, 0.0)),),
        elements=(vi.RigidStop((1.0, 0.0), upper=0.5, restitution=0.7),
                  vi.RigidStop((0.0, 1.0), upper=0.4, restitution=0.8)),
    )  # fmt: skip
    start = vi.State((0.0, 0.0), (0.0, 0.0))
    found = basins(
        weak, {"x1": [0.0, 0.1], "v2": [1.0, 2.0]}, start, at=vi.AtStop(contact=1), settle_periods=0
    )
    assert set(named(found)) == {"1-2-0 a"}


@pytest.mark.parametrize("settle", [60.3, 800.3])
def test_members_end_at_one_phase_whether_they_went_on_or_not(settle: float) -> None:
    """At one phase of the forcing the 1-1-1 orbit is a point, to the tolerance of the matching."""
    over = {"x1": AXIS, "v1": AXIS}
    found = basins(SET_B, over, START, settle_periods=settle)
    here = np.array(named(found)).reshape(found.attractor.shape) == "1-1-1 a"
    window = vi.sweep(SET_B, over={}, start=vi.GridStarts(over, START), observe="final",
                      settle_periods=settle, progress=False)  # fmt: skip
    stayed = (found.final_position == window.final_position).all("coordinate").values[here]
    assert stayed.any() == (settle > 500.0)
    assert not stayed.all()
    ends = found.final_position.values[here], found.final_velocity.values[here]
    assert max(np.ptp(one, axis=0).max() for one in ends) < 0.05
    assert np.ptp(found.final_phase.values[here]) < 1e-9


def test_what_flies_for_a_window_in_chaos_is_not_without_impacts() -> None:
    """Long transients at omega 1.08: some members are in flight whenever one looks."""
    axis = np.linspace(-6.0, 6.0, 24)
    found = basins(replace(SET_B, omega=1.08), {"x1": axis, "v1": axis}, START)
    assert found.name.values.tolist() == ["1-1-1 a"]
    assert float(found.share[0]) > 0.99


@pytest.mark.parametrize("settle", [0, 250, 4000])
def test_a_torus_whose_points_come_in_runs_is_one(settle: float) -> None:
    """Its rotation number is next to 395/967: 4000 points leave three quarters of it out."""
    over = {"x1": AXIS, "v1": AXIS}
    found = basins(replace(SET_B, omega=1.0), over, START, settle_periods=settle)
    assert found.name.values.tolist() == ["quasiperiodic a"]
    assert float(found.share[0]) == 1.0


@pytest.mark.slow
def test_every_name_has_its_starts() -> None:
    for omega, settle in ((1.075, 20), (1.085, 250)):
        system, over = replace(SET_B, omega=omega), {"x1": AXIS, "v1": AXIS}
        found = basins(system, over, START, settle_periods=settle)
        assert (found.share > 0.0).all()
        assert len(set(found.name.values)) == len(found.name)
        assert found.share.sum() + (found.attractor.values < 0).mean() == pytest.approx(1.0)
