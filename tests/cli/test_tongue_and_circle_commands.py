"""The commands tongue, switch and circle: what they say and write is the library's."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray as xr
from support.bifurcations import torus_of_set_a
from support.commands import WALL, assert_nothing_written, opened, said
from support.systems import paper_damper

import vibroimpact as vi
from vibroimpact.cli import main as cli

pytestmark = pytest.mark.usefixtures("no_windows", "own_folder")

SET_A = paper_damper("A", 1.0)
START = vi.State((0.0, 0.0), (0.0, 1.0))
TIP = ((0.81, 0.83), (7.7, 7.8))  # a small part of the tongue 2/9
NEAR_TIP = ["--bounds", "omega=0.81:0.83", "--bounds", "half_clearance=7.7:7.8"]
AT_R4 = ["--bounds", "omega=0.95:1.0", "--bounds", "half_clearance=5.7:6.2"]


@pytest.fixture(scope="module")
def curve() -> vi.BifurcationCurve:
    return torus_of_set_a()


@pytest.fixture(scope="module")
def saved(curve: vi.BifurcationCurve, tmp_path_factory: pytest.TempPathFactory) -> str:
    path = tmp_path_factory.mktemp("curve") / "curve.nc"
    vi.save(curve, path)
    return str(path)


def followed(name: str, monkeypatch: pytest.MonkeyPatch) -> list[tuple[Any, Any, Any]]:
    """Point, ranges and result of each call by which a command follows curves, while it runs."""
    calls = []
    of_library = getattr(vi, name.rpartition(".")[2])

    def noted(point: Any, bounds: Any, **rest: Any) -> Any:
        calls.append((point, bounds, of_library(point, bounds, **rest)))
        return calls[-1][2]

    monkeypatch.setattr(f"vibroimpact.cli.{name}", noted)
    return calls


def assert_same_point(here: vi.BifurcationPoint, there: vi.BifurcationPoint) -> None:
    """Of the file and of the library, from which the same curves begin: test_curve_store.py."""
    assert repr(here) == repr(there)
    for name in ("z", "tangent"):
        np.testing.assert_array_equal(getattr(here, name), getattr(there, name))


# ---- tongue and switch ---------------------------------------------------------------------------


@pytest.mark.slow
def test_tongue_writes_and_says_both_sides_of_the_library(
    curve: vi.BifurcationCurve,
    saved: str,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    argv = ["tongue", saved, "--at", "2/9_1", *NEAR_TIP]
    calls = followed("tongue.tongue", monkeypatch)
    out = said([*argv, "--out", "side.nc", "--out", "tongue.svg"], capsys)
    ((point, bounds, expected),) = calls
    assert_same_point(point, curve["2/9_1"])
    assert bounds == TIP
    assert isinstance(expected, vi.Tongue)
    for i, side in enumerate(expected.sides, 1):
        assert repr(side) in out
        np.testing.assert_array_equal(vi.load(f"side-{i}.nc").values, side.values)
    widths = re.findall(r"width in omega at half_clearance = (\S+): (\S+)", out)
    assert len(widths) == 4
    for at, width in widths:
        assert float(width) == pytest.approx(expected.width(float(at)), rel=1e-3)
    assert out.endswith("wrote side-1.nc, side-2.nc, tongue.svg\n")
    assert sorted(p.name for p in Path().iterdir()) == ["side-1.nc", "side-2.nc", "tongue.svg"]


@pytest.mark.slow
def test_switch_writes_and_says_the_curves_that_begin_at_a_resonance(
    curve: vi.BifurcationCurve,
    saved: str,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    argv = ["switch", saved, "--at", "R4_1", *AT_R4, "--out", "born.nc", "--out", "born.png"]
    calls = followed("switch.switch_curve", monkeypatch)
    out = said(argv, capsys)
    ((point, bounds, expected),) = calls
    assert_same_point(point, curve["R4_1"])
    assert bounds == ((0.95, 1.0), (5.7, 6.2))
    assert not isinstance(expected, vi.NotFound)
    for i, born in enumerate(expected, 1):
        assert repr(born) in out
        np.testing.assert_array_equal(vi.load(f"born-{i}.nc").values, born.values)
    assert Path("born.png").stat().st_size > 1000


@pytest.mark.slow
def test_switch_follows_the_touch_at_which_a_fold_ends(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    system = vi.ImpactOscillator(zeta=0.1, omega=1.95, restitution=0.7, clearance=0.3)
    orbit = vi.find_orbit(system, vi.State((0.0,), (0.0,)))
    fold = vi.continue_orbit(orbit, "clearance", (0.3, 0.4))["SN1"]
    bounds = ((1.94, 2.02), (0.325, 0.37))
    curve = vi.continue_bifurcation(fold, ("omega", "clearance"), bounds)
    vi.save(curve, "fold.nc")
    calls = followed("switch.switch_curve", monkeypatch)
    out = said(["switch", "fold.nc", "--at", "ZERO_1", "--out", "born.nc"], capsys)
    ((point, _, expected),) = calls
    assert_same_point(point, curve["ZERO_1"])
    assert point.normal_form.meaning == curve["ZERO_1"].normal_form.meaning
    assert [born.kind for born in expected] == ["ZERO", "PD"]
    assert expected[1]["ZERO_1"].normal_form.meaning in out
    for i, born in enumerate(expected, 1):
        assert repr(born) in out
        np.testing.assert_array_equal(vi.load(f"born-{i}.nc").values, born.values)


def test_where_nothing_begins_switch_fails_with_the_reason_of_the_library(
    curve: vi.BifurcationCurve, saved: str, capsys: pytest.CaptureFixture[str]
) -> None:
    refusal = vi.switch_curve(curve["R4_2"])
    assert isinstance(refusal, vi.NotFound)
    argv = ["switch", saved, "--at", "R4_2", "--out", "born.nc"]
    assert_nothing_written(argv, cli.FAILED, refusal.reason, capsys)


@pytest.mark.parametrize(
    ("argv", "message"),
    [
        (["tongue", "none.nc", "--at", "2/9_1"], "none.nc: cannot be read"),
        (["tongue", "CURVE", "--at", "1/5_1"], "at = '1/5_1': must be one of"),
        (["tongue", "CURVE", "--at", "R4_1"], "tongues begin at weak resonances"),
        (
            ["tongue", "CURVE", "--at", "2/9_1", "--bounds", "zeta=0:1"],
            "bounds = 'zeta': must be one",
        ),
        (["tongue", "CURVE", "--at", "2/9_1", "--bounds", "omega=0.9:1.0"], "must hold"),
        (["tongue", "CURVE", "--at", "2/9_1", "--behind", "no.nc"], "no.nc: cannot be read"),
        (["tongue", "CURVE", "--at", "2/9_1", "--out", "t.txt"], "must end in"),
        (["switch", "CURVE", "--at", "CP_1"], "at = 'CP_1': must be one of"),
    ],
)
def test_misuse_is_refused_with_what_is_allowed(
    argv: list[str], message: str, saved: str, capsys: pytest.CaptureFixture[str]
) -> None:
    argv = [saved if word == "CURVE" else word for word in argv]
    assert_nothing_written(argv, cli.MISUSE, message, capsys)


# ---- circle --------------------------------------------------------------------------------------


CIRCLE = ["circle", "impact-damper/A", "--omega", "1.0"]


def test_circle_writes_and_says_the_circle_of_the_library(
    capsys: pytest.CaptureFixture[str],
) -> None:
    out = said([*CIRCLE, "--out", "c.nc", "--out", "c.svg"], capsys)
    expected = vi.find_circle(SET_A, START)
    assert repr(expected) in out
    assert f"{expected.full_rotation_number:.12g} turns per full map" in out
    assert "normal directions: positive, negative, negative" in out
    assert f"roughness {expected.roughness:.6g}, least angle {expected.least_angle:.6g}" in out
    assert f"passes through {expected.state()}" in out
    xr.testing.assert_identical(opened("c.nc"), expected.to_dataset())
    assert Path("c.svg").read_text(encoding="utf-8").startswith("<?xml")


@pytest.mark.slow
def test_along_follows_the_circle(capsys: pytest.CaptureFixture[str]) -> None:
    argv = [*CIRCLE, "--bounds", "omega=0.998:1.02", "--out", "f.nc", "--out", "f.png"]
    assert cli.main(argv) == cli.DONE
    captured = capsys.readouterr()
    expected = vi.continue_circle(vi.find_circle(SET_A, START), "omega", (0.998, 1.02))
    assert repr(expected) in captured.out
    assert "shrinks to a periodic orbit (Neimark-Sacker): omega = 1.00787" in captured.out
    np.testing.assert_array_equal(opened("f.nc").rotation_numbers, expected.rotation_numbers)
    assert Path("f.png").stat().st_size > 1000


def test_the_full_map_turns_twice_as_fast(capsys: pytest.CaptureFixture[str]) -> None:
    out = said([*CIRCLE, "--full-map"], capsys)
    full = vi.find_circle(SET_A, START, symmetric=False)
    assert repr(full) in out
    assert "turns per full map" not in out


@pytest.mark.slow
def test_a_circle_of_a_machine_in_metres_is_followed_in_si_units(
    capsys: pytest.CaptureFixture[str],
) -> None:
    physical = {"M1": 10.0, "M2": 1.0, "K": 4.0e4, "C": 56.92, "F0": 60.0, "D": 0.0075}
    rate = np.sqrt(physical["K"] / physical["M1"])
    rows = [f"{name} = {value}" for name, value in physical.items()]
    text = "\n".join(["[physical]", *rows, f"Omega = {1.8 * rate}", "restitution = 0.8"])
    Path("damper.toml").write_text(text)
    ends = [f"{part * rate}" for part in (1.795, 1.805)]
    out = said(
        ["circle", "--config", "damper.toml", "--bounds", f"omega={ends[0]}:{ends[1]}"], capsys
    )
    assert f"the end of its range: {float(ends[0]):.6f}" in out


def test_motion_that_is_not_on_a_circle_is_a_failure_with_the_reason(
    capsys: pytest.CaptureFixture[str],
) -> None:
    argv = ["circle", "impact-damper/A", "--omega", "1.2", "--out", "c.nc"]
    assert cli.main(argv) == cli.FAILED
    assert "the motion is periodic after 1 iterates" in capsys.readouterr().err
    Path("wall.toml").write_text(WALL)
    assert cli.main(["circle", "--config", "wall.toml"]) == cli.FAILED
    assert "no circle was found from State(position=(0.0,)" in capsys.readouterr().err
    assert sorted(p.name for p in Path().iterdir()) == ["wall.toml"]


def test_an_interrupted_family_leaves_no_file(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def interrupted(*_: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr("vibroimpact._core.progress.Display.note", interrupted)
    argv = [*CIRCLE, "--bounds", "omega=0.99:1.02", "--out", "f.nc", "--out", "f.svg"]
    assert_nothing_written(argv, cli.INTERRUPTED, "interrupted; nothing was written", capsys)


@pytest.mark.parametrize(
    ("argv", "message"),
    [
        ([*CIRCLE, "--bounds", "omega=low:high"], "must be NAME=LOW:HIGH"),
        ([*CIRCLE, "--bounds", "omega=1.1:1.2"], "must hold omega = 1"),
        ([*CIRCLE, "--bounds", "speed=0:1"], "'speed'"),
        ([*CIRCLE, "--bounds", "omega=0.9:1.1", "--x", "x2"], "not with --bounds"),
        ([*CIRCLE, "--x", "x9", "--out", "c.png"], "x = 'x9': must be one of x1, x2, v1, v2"),
        ([*CIRCLE, "--points", "9"], "points = 9: must be"),
        ([*CIRCLE, "--tolerance", "0"], "tolerance = 0.0: must be > 0"),
        (["circle", "impact-damper/A"], "--omega: missing"),
    ],
)
def test_misuse_of_circle_is_refused_with_what_is_allowed(
    argv: list[str], message: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert_nothing_written(argv, cli.MISUSE, message, capsys)
