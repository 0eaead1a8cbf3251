"""Basins and numbers of attractors of machines without stops, and of machines that advance."""

from __future__ import annotations

import json
from typing import Any

import numpy as np
import pytest
import xarray as xr

import vibroimpact as vi
from vibroimpact.attractors.matching import strobe_symbols

REST = vi.State((0.0,), (0.0,))
QUIET = {"settle_periods": 300, "periods": 50, "progress": False}


def belt(*forces):
    """A block on a belt: it slides steadily near x = kinetic, or it sticks and slips."""
    return vi.Mechanism(
        mass=[[1.0]], damping=[[0.02]], stiffness=[[1.0]], forces=forces,
        elements=(vi.Friction((1.0,), 0.1, 0.2, belt_speed=0.05),),
    )  # fmt: skip


FORCED = belt(vi.Harmonic(2.3, (0.01,)))


def test_basins_of_a_machine_of_friction_are_those_of_its_attractors_one_by_one():
    over = {"x1": [-0.1, 0.1], "v1": [0.0]}
    found = vi.basins(FORCED, over=over, start=REST, **QUIET)
    assert found["name"].values.tolist() == ["3-0-0 a", "1-0-0 a"]
    for i, x in enumerate(over["x1"]):
        for j, v in enumerate(over["v1"]):
            alone = vi.classify(FORCED, vi.State((x,), (v,)), settle_events=300, points=100)
            label = found["attractor"].transpose("x1", "v1").values[i, j]
            assert found["name"].values[label] == f"{alone.symbol} a"


def test_attractors_without_impacts_are_counted():
    starts = vi.ListedStarts([[0.0], [0.1], [0.3]], [[0.0], [0.0], [0.1]])
    found = vi.multistability(FORCED, over={"damping[0][0]": [0.02, 0.4]}, start=starts, **QUIET)
    assert found["attractors"].values.tolist() == [2, 1]


def test_a_diagram_of_a_machine_of_friction_has_the_points_of_its_section():
    found = vi.bifurcation_sweep(
        FORCED, over={"damping[0][0]": [0.02, 0.03]}, start=REST, points=6, way="up", **QUIET
    )
    assert json.loads(found.attrs["call"])["at"] == {"phase": 0.0}
    section = vi.section(FORCED, REST, at=vi.AtPhase(), points=6, settle_events=344)
    drawn = found["x1"].isel({"damping[0][0]": 0}).values.ravel()
    assert np.allclose(drawn, section.x1, rtol=0.0, atol=1e-12)


def test_motions_that_differ_by_a_displacement_alone_are_one_attractor():
    ram = vi.Mechanism(
        mass=[[1.0, 0.0], [0.0, 0.0]], damping=[[0.2, 0.0], [0.0, 0.0]], stiffness=np.zeros((2, 2)),
        elements=(
            vi.SoftStop((1.0, -1.0), upper=0.05, stiffness=40.0, damping=0.8),
            vi.Friction((0.0, 1.0), 0.6),
        ),
        forces=(vi.Harmonic(1.0, (0.8, 0.0)),), constant_force=(0.2, 0.0),
    )  # fmt: skip
    starts = vi.ListedStarts([[0.0, 0.0], [1e3, 1e3], [-0.5, 0.2]], np.zeros((3, 2)))
    found = vi.multistability(ram, over={"damping[0][0]": [0.2]}, start=starts, **QUIET)
    assert np.ptp(found["section_position"].values[..., -1, 0]) > 1.0
    assert found["attractors"].values.tolist() == [1]


def test_periods_of_points_are_the_least_that_repeat():
    cycle = np.array([[0.0, 1.0], [0.5, 0.0], [1.0, 0.0]])
    repeats = np.array(
        [np.tile(cycle, (4, 1)), np.ones((12, 2)), np.random.default_rng(1).random((12, 2))]
    )
    assert strobe_symbols(repeats).tolist() == [[3, 3], [1, 1], [0, 0]]
    assert strobe_symbols(np.full((1, 12, 2), np.nan)).tolist() == [[0, 0]]


def test_without_force_the_way_out_is_named():
    with pytest.raises(vi.VibroImpactError, match=r"with forcing.*vi\.classify"):
        vi.basins(belt(), over={"x1": [0.0, 0.1], "v1": [0.0, 0.1]}, start=REST)


def test_results_at_a_phase_are_done_again_from_themselves() -> None:
    belt = vi.Mechanism(
        mass=[[1.0]], damping=[[0.02]], stiffness=[[1.0]], forces=(vi.Harmonic(2.3, (0.01,)),),
        elements=(vi.Friction((1.0,), 0.1, 0.2, belt_speed=0.05),),
    )  # fmt: skip
    window: dict[str, Any] = {"settle_periods": 50, "periods": 50, "progress": False}
    basins = vi.basins(
        belt, over={"x1": [-0.1, 0.1], "v1": [0.0]}, start=vi.State((0.0,), (0.0,)), **window
    )
    counted = vi.multistability(
        belt, over={"damping[0][0]": [0.02]}, start=vi.ListedStarts([[0.0]], [[0.0]]), **window
    )
    for found in (basins, counted):
        xr.testing.assert_identical(vi.rerun_sweep(found, progress=False), found)
