"""The command curve: what it says and writes is the library's."""

from __future__ import annotations

import io
import sys
from contextlib import redirect_stdout
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pytest
from support.commands import assert_nothing_written, said

import vibroimpact as vi
from vibroimpact.cli import main as cli
from vibroimpact.normal_forms import CodimensionTwo

pytestmark = pytest.mark.usefixtures("no_windows", "own_folder")

CASE = "impact-damper/A"
SET_A = vi.ImpactDamper(
    mass_ratio=0.1, omega_n=0.5, zeta=0.045, restitution=0.8, half_clearance=5.0, omega=0.95
)
BRANCH = ["curve", CASE, "--branch", "omega=0.9:1.0", "--at", "NS1"]
NEAR = ["--bounds", "omega=0.9:0.95", "--bounds", "half_clearance=4.8:5.5"]


@pytest.fixture(scope="module")
def expected() -> vi.BifurcationCurve:
    branch = vi.continue_orbit(vi.symmetric_orbits(SET_A)[0], "omega", (0.9, 1.0))
    return vi.continue_bifurcation(
        branch["NS1"], ("omega", "half_clearance"), ((0.9, 0.95), (4.8, 5.5))
    )


class Told(NamedTuple):
    """What the command says of that curve, and writes."""

    out: str
    curve: Path
    picture: Path


@pytest.fixture(scope="module")
def told(tmp_path_factory: pytest.TempPathFactory) -> Told:
    curve, picture = (tmp_path_factory.mktemp("curve") / name for name in ("c.nc", "c.svg"))
    with redirect_stdout(io.StringIO()) as out:
        files = ["--out", str(curve), "--out", str(picture)]
        assert cli.main([*BRANCH, *NEAR, *files]) == cli.DONE
    return Told(out.getvalue(), curve, picture)


@pytest.mark.slow
def test_curve_writes_and_says_the_curve_of_the_library(
    expected: vi.BifurcationCurve, told: Told
) -> None:
    assert repr(expected) in told.out
    assert told.out.endswith(f"wrote {told.curve}, {told.picture}\n")
    np.testing.assert_array_equal(vi.load(told.curve).curve.z, expected.curve.z)
    assert told.picture.read_text(encoding="utf-8").startswith("<?xml")


def test_coefficients_are_printed_with_what_is_born(
    expected: vi.BifurcationCurve, told: Told
) -> None:
    form = expected["R4_1"].normal_form
    assert isinstance(form, CodimensionTwo)
    assert f"R4_1: c = {form.c.real:.12g}{form.c.imag:+.12g}j, d = " in told.out
    assert f"scaled = {form.scaled.real:.12g}{form.scaled.imag:+.12g}j" in told.out
    assert form.meaning in told.out


@pytest.mark.slow
def test_given_once_over_is_the_second_parameter(capsys: pytest.CaptureFixture[str]) -> None:
    out = said([*BRANCH, "--bounds", "half_clearance=4.9:5.1", "--out", "c.nc"], capsys)
    assert "Curve of NS points" in out
    loaded = vi.load("c.nc")
    assert loaded.names == ("omega", "half_clearance")
    assert loaded.bounds == ((0.9, 1.0), (4.9, 5.1))


@pytest.mark.slow
def test_then_follows_another_curve_through_a_point_of_the_last_one(
    capsys: pytest.CaptureFixture[str],
) -> None:
    argv = ["curve", CASE, "--half-clearance", "1.6", "--branch", "omega=0.9:1.1"]
    argv += ["--switch", "BP1", "--at", "PD1", "--then", "R2_1=NS"]
    argv += ["--bounds", "omega=0.94:1.0", "--bounds", "half_clearance=1.5:1.61"]
    out = said([*argv, "--out", "c.nc", "--out", "c.png"], capsys)
    assert out.index("Curve of PD points") < out.index("Curve of NS points")
    assert vi.load("c.nc").kind == "NS"
    assert vi.load("c.nc").neutral.any()


@pytest.mark.slow
def test_a_plane_that_was_written_lies_behind(
    expected: vi.BifurcationCurve, capsys: pytest.CaptureFixture[str]
) -> None:
    grid = ["--over", "omega=0.9:0.95:4", "--over", "half_clearance=4.8:5.5:3"]
    said(["plane", CASE, *grid, "--settle-periods", "5", "--periods", "5", "--out", "p.nc"], capsys)
    out = said([*BRANCH, *NEAR, "--behind", "p.nc", "--out", "c.png"], capsys)
    assert repr(expected) in out
    assert Path("c.png").stat().st_size > 1000


def test_a_store_behind_needs_zarr_and_says_so(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setitem(sys.modules, "zarr", None)
    argv = [*BRANCH, *NEAR, "--behind", "p.zarr", "--out", "c.png"]  # whether it is there or not
    assert_nothing_written(argv, cli.FAILED, "behind: needs Zarr, which is not", capsys)


def test_an_interrupted_curve_leaves_no_file(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def interrupted(*_: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr("vibroimpact._core.progress.Display.note", interrupted)
    argv = [*BRANCH, *NEAR, "--out", "c.nc"]
    assert_nothing_written(argv, cli.INTERRUPTED, "interrupted; nothing was written", capsys)


@pytest.mark.parametrize(
    ("argv", "message"),
    [
        ([*BRANCH, "--bounds", "omega=0.9:1.0"], "give --bounds NAME=LOW:HIGH twice"),
        ([*BRANCH, "--bounds", "half_clearance=4:6:20"], "must be NAME=LOW:HIGH"),
        ([*BRANCH, "--bounds", "clearance=4:6"], "'clearance'"),
        ([*BRANCH, "--bounds", "half_clearance=6:7"], "must hold half_clearance = 5"),
        ([*BRANCH[:-1], "NS7", *NEAR], "label = 'NS7': must be one of NS1"),
        ([*BRANCH, *NEAR, "--then", "R4_9=NS"], "then = 'R4_9': must be one of R4_1"),
        ([*BRANCH, *NEAR, "--then", "R4_1"], "must be POINT=KIND"),
        ([*BRANCH, *NEAR, "--behind", "none.nc"], "behind = none.nc: cannot be read"),
        ([*BRANCH, *NEAR, "--out", "c.txt"], "must end in"),
    ],
)
def test_misuse_is_refused_with_what_is_allowed(
    argv: list[str], message: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert_nothing_written(argv, cli.MISUSE, message, capsys)


def test_a_plane_of_other_parameters_is_refused(capsys: pytest.CaptureFixture[str]) -> None:
    grid = ["--over", "half_clearance=4.8:5.5:2", "--over", "omega=0.9:0.95:2"]
    said(["plane", CASE, *grid, "--settle-periods", "5", "--periods", "5", "--out", "p.nc"], capsys)
    assert cli.main([*BRANCH, *NEAR, "--behind", "p.nc"]) == cli.MISUSE
    assert "need a plane of omega and half_clearance, in this order" in capsys.readouterr().err
