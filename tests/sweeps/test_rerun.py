"""A dataset of a sweep is repeated from what it says of itself, bit for bit."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray as xr
from support.systems import paper_damper

import vibroimpact as vi

DAMPER = paper_damper("A", 1.0)
START = vi.State((0.1, 0.0), (0.0, 1.0), 0.5)
SHORT = {"settle_periods": 21.5, "periods": 7, "most_impacts": 900, "progress": False}
GRID = {"omega": np.linspace(1.0, 1.2, 3), "half_clearance": [4.0, 9.0]}
LISTED = vi.ListedStarts([[0.0, 0.1], [0.2, 0.3]], [[0.0, 1.0], [1.0, 0.0]], [0.0, 0.1])
RANDOM = vi.RandomStarts(3, 7, {"x1": (-1.0, 1.0), "phase": (0.0, 6.0)}, START, skip=2)
WATCHED = [
    vi.observe.Section(points=3, stop="B", label="low"), "symbol", "final", "spectrum",
    vi.observe.Extremes(row=(-1.0, 1.0), label="gap"),
]  # fmt: skip


def chain(wall: float) -> vi.Mechanism:
    return vi.Mechanism(
        mass=[[1.0, 0.0], [0.0, 2.0]], damping=[[0.2, -0.1], [-0.1, 0.1]],
        stiffness=[[2.0, -1.0], [-1.0, 1.0]], forces=(vi.Harmonic(0.8, (1.0, 0.0)),),
        elements=(vi.RigidStop((1.0, 0.0), upper=wall, restitution=(0.7, 0.8)),
                  vi.RigidStop((-1.0, 1.0), lower=-1.0, restitution=0.6)),
    )  # fmt: skip


MADE: dict[str, Callable[[], xr.Dataset]] = {
    "a sweep": lambda: vi.sweep(DAMPER, over=GRID, start=START, observe=WATCHED, **SHORT),
    "followed": lambda: vi.sweep(DAMPER, over=GRID, start=START, follow="-omega", **SHORT),
    "random starts": lambda: vi.sweep(DAMPER, over=GRID, start=RANDOM, **SHORT),
    "listed starts": lambda: vi.sweep(DAMPER, over={}, start=LISTED, observe="final", **SHORT),
    "a mechanism": lambda: vi.sweep(
        chain(0.3), over={"elements[0].upper": [0.2, 0.3]}, start=LISTED, **SHORT
    ),
    "a plane": lambda: vi.plane(
        DAMPER, over=GRID, start=START, observe=["lyapunov", vi.observe.Symbol(tolerance=1e-4)],
        **SHORT,
    ),
    "a grid of starts": lambda: vi.sweep(
        DAMPER, over={"phase": [0.0, 1.0], "omega": [1.0, 1.1], "v2": [0.0, 1.0]}, start=START, **SHORT
    ),
    "a plane along a coordinate": lambda: vi.plane(
        DAMPER, over={"v2": [0.0, 1.0], "omega": [1.0, 1.1]}, start=START, **SHORT
    ),
    "a count from a grid": lambda: vi.multistability(
        DAMPER, over={"v2": [0.0, 1.0], "omega": [1.0, 1.1]}, start=START, **SHORT
    ),
    "basins": lambda: vi.basins(
        DAMPER, over={"v2": [0.0, 1.0], "phase": [0.0, 1.0]}, start=START, at=vi.AtStop("B"),
        same_within=1e-4, most_classified=5, **SHORT,
    ),
    "a count": lambda: vi.multistability(
        DAMPER, over=GRID, start=RANDOM, at=vi.AtStop("B"), same_within=1e-4, **SHORT
    ),
    "a diagram, both ways": lambda: vi.bifurcation_sweep(
        DAMPER, over={"omega": [1.0, 1.1]}, start=START, at=vi.AtStop("B"), points=4, observe="lyapunov",
        **SHORT,
    ),
    "a diagram down": lambda: vi.bifurcation_sweep(
        DAMPER, over={"zeta": [0.04, 0.05]}, start=START, way="down", **SHORT
    ),
    "a diagram at a phase": lambda: vi.bifurcation_sweep(
        DAMPER, over={"omega": [1.0, 1.1]}, start=START, observe="section", points=3,
        at=vi.AtPhase(0.5), **SHORT,
    ),
    "a diagram at the user's phase": lambda: vi.bifurcation_sweep(
        DAMPER, over={"omega": [1.0, 1.1]}, start=START, at=vi.AtPhase(0.5),
        observe=vi.observe.Stroboscopic(points=3, phase=1.5), **SHORT,
    ),
    "a diagram of random starts": lambda: vi.bifurcation_sweep(
        DAMPER, over={"omega": [1.0, 1.1]}, start=RANDOM, points=2, **SHORT
    ),
}  # fmt: skip


@pytest.mark.parametrize("make", MADE.values(), ids=MADE)
def test_what_was_made_is_made_again_from_itself(make: Callable[[], xr.Dataset]) -> None:
    found = make()
    xr.testing.assert_identical(vi.rerun_sweep(found, progress=False), found)


def test_a_file_is_enough(tmp_path: Path) -> None:
    found = MADE["basins"]()
    found.to_netcdf(tmp_path / "basins.nc", engine="h5netcdf")
    with xr.open_dataset(tmp_path / "basins.nc", engine="h5netcdf") as read:
        xr.testing.assert_identical(vi.rerun_sweep(read, progress=False), found)


def test_a_store_that_is_opened_gives_its_sweep(tmp_path: Path) -> None:
    pytest.importorskip("zarr")
    plane = vi.plane(DAMPER, over=GRID, start=START, store=tmp_path / "plane.zarr", **SHORT)
    sweep = vi.rerun_sweep(
        xr.open_zarr(tmp_path / "plane.zarr", consolidated=False), progress=False
    )
    assert sweep.attrs["made_by"] == "sweep"
    xr.testing.assert_equal(sweep, plane.load()[list(sweep)])
    xr.testing.assert_identical(vi.rerun_sweep(plane, progress=False), plane)


def test_what_is_given_is_asked_instead() -> None:
    found = MADE["a sweep"]()
    longer = vi.rerun_sweep(found, settle_periods=30, observe="final", progress=False)
    expected = vi.sweep(
        DAMPER, over=GRID, start=START, observe="final", **SHORT | {"settle_periods": 30}
    )
    xr.testing.assert_identical(longer, expected)


def test_a_section_of_a_diagram_is_asked_instead() -> None:
    diagram = MADE["a diagram, both ways"]()
    other = vi.rerun_sweep(diagram, points=7, at=vi.AtStop("A"), progress=False)
    expected = vi.bifurcation_sweep(
        DAMPER, over={"omega": [1.0, 1.1]}, start=START, at=vi.AtStop("A"), points=7, observe="lyapunov",
        **SHORT,
    )  # fmt: skip
    xr.testing.assert_identical(other, expected)
    strided = vi.bifurcation_sweep(
        DAMPER, over={"omega": [1.0]}, start=START, observe=vi.observe.Section(stride=2, points=3),
        **SHORT,
    )  # fmt: skip
    xr.testing.assert_identical(vi.rerun_sweep(strided, progress=False), strided)


@pytest.mark.parametrize(
    ("made", "part", "said"),
    [
        ("a sweep", {"omega": slice(1, 3)}, "2 of 3 values of omega"),
        ("a sweep", {"omega": 0}, "0 of 3 values of omega"),
        ("random starts", {"start": [0]}, "1 of 3 values of start"),
        ("listed starts", {"start": 1}, "0 of 2 values of start"),
        ("a diagram, both ways", {"direction": 0}, "0 of 2 values of direction"),
        ("basins", {"v2": [0]}, "1 of 2 values of v2"),
    ],
)
def test_a_part_is_not_repeated(made: str, part: Any, said: str) -> None:
    with pytest.raises(vi.InvalidParameterError, match=f"is a part of what was made, {said}"):
        vi.rerun_sweep(MADE[made]().isel(part))


def test_the_order_of_an_axis_is_kept() -> None:
    family = vi.Family(chain, wall=0.3)
    found = vi.sweep(family, over={"wall": [0.2, 0.3, 0.4]}, start=LISTED, **SHORT)
    turned = found.isel(wall=slice(None, None, -1))
    again = vi.rerun_sweep(turned, system=family, progress=False)
    xr.testing.assert_equal(again, turned)


def test_code_must_be_given_and_be_the_same() -> None:
    family = vi.Family(chain, wall=np.float64(0.3))
    assert repr(family) == "Family(chain, wall=0.3)"
    found = vi.sweep(family, over={"wall": [0.2, 0.3]}, start=LISTED, **SHORT)
    with pytest.raises(vi.InvalidParameterError, match=r"Family\(chain, wall=0.2\) is code"):
        vi.rerun_sweep(found)
    again = vi.rerun_sweep(found, system=vi.Family(chain, wall=0.9), progress=False)
    xr.testing.assert_identical(again, found)
    with pytest.raises(vi.InvalidParameterError, match=r"was Family\(chain, wall=0.2\)"):
        vi.rerun_sweep(found, system=vi.Family(lambda wall: chain(wall), wall=0.3))


def test_what_is_no_sweep_is_refused() -> None:
    with pytest.raises(vi.InvalidParameterError, match="was made by none of sweep, plane"):
        vi.rerun_sweep(xr.Dataset())
    diagram = vi.bifurcation_sweep(DAMPER, over={"omega": [1.0, 1.1]}, start=LISTED, **SHORT)
    with pytest.raises(vi.InvalidParameterError, match="does not hold its listed starts"):
        vi.rerun_sweep(diagram)
