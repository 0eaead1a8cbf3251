"""The commands sweep, diagram, plane and basins: what they say and write is the library's."""

from __future__ import annotations

import functools
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from support.commands import WALL, assert_nothing_written, opened, said

import vibroimpact as vi
from vibroimpact import plotting
from vibroimpact.cli import main as cli

pytestmark = pytest.mark.usefixtures("no_windows", "own_folder")

CASE = "impact-damper/A"
SET_A = vi.ImpactDamper(
    mass_ratio=0.1, omega_n=0.5, zeta=0.045, restitution=0.8, half_clearance=5.0, omega=1.2
)
MIDDLE = replace(SET_A, omega=(1.1 + 1.2) / 2.0).free_start()  # the default, at the middle of omega
OMEGA, CLEARANCE = "omega=1.1:1.2:3", "half_clearance=4,5"
OVER = {"omega": np.linspace(1.1, 1.2, 3), "half_clearance": np.array([4.0, 5.0])}
PLANE = ["plane", CASE, "--over", OMEGA, "--over", CLEARANCE]
RANDOM = ["sweep", CASE, "--over", OMEGA, "--starts"]
SHORT = ["--settle-periods", "60", "--periods", "20"]
WINDOW = {"settle_periods": 60.0, "periods": 20.0, "progress": False}


def test_the_system_is_said_with_the_ranges_of_the_grid(capsys: pytest.CaptureFixture[str]) -> None:
    argv = ["sweep", CASE, "--over", OMEGA, "--over", CLEARANCE, *SHORT]
    line = said(argv, capsys).split("\n")[0]
    assert "omega from 1.1 to 1.2" in line
    assert "half_clearance from 4 to 5" in line
    assert "omega_n=0.5" in line


def same(one: xr.Dataset, other: xr.Dataset) -> None:
    """Equal bits, dimensions and coordinates; attributes hold the system as text."""
    xr.testing.assert_equal(one, other)
    assert one.attrs["system"] == other.attrs["system"]


# ---- the output is the library's -----------------------------------------------------------------


def test_sweep_writes_the_sweep_of_the_library(capsys: pytest.CaptureFixture[str]) -> None:
    argv = ["sweep", CASE, "--over", OMEGA, "--over", CLEARANCE, "--observe", "symbol,speeds"]
    out = said([*argv, *SHORT, "--follow=-omega", "--out", "s.nc"], capsys)
    expected = vi.sweep(
        SET_A, over=OVER, start=MIDDLE, observe=["symbol", "speeds"], follow="-omega", **WINDOW
    )
    xr.testing.assert_equal(opened("s.nc"), expected)
    assert "omega 1.1 to 1.2 (3), half_clearance 4 to 5 (2)\n6 members: 6 ok" in out
    assert out.endswith("wrote s.nc\n")


def test_followed_downwards_is_taken_with_and_without_an_equals_sign(
    capsys: pytest.CaptureFixture[str],
) -> None:
    argv = ["sweep", CASE, "--over", OMEGA, *SHORT, "--observe", "final"]
    for name, words in (("a.nc", ["--follow", "-omega"]), ("b.nc", ["--follow=-omega"])):
        said([*argv, *words, "--out", name], capsys)
    xr.testing.assert_identical(opened("a.nc"), opened("b.nc"))
    assert opened("a.nc").attrs["follow"] == "-omega"
    assert cli.main([*argv, "--follow", "--out", "c.nc"]) == cli.MISUSE


def test_counts_over_one_parameter_are_drawn_along_it(capsys: pytest.CaptureFixture[str]) -> None:
    argv = ["plane", CASE, "--over", OMEGA, "--starts", "2", "--bounds", "x1=0:1", *SHORT]
    assert "wrote p.png" in said([*argv, "--out", "p.png"], capsys)


def test_random_starts_are_those_of_the_library(capsys: pytest.CaptureFixture[str]) -> None:
    argv = ["sweep", CASE, "--over", OMEGA, "--starts", "4", "--seed", "7", "--bounds", "x1=-1:2"]
    out = said([*argv, "--bounds", "v2=0:3", *SHORT, "--out", "s.nc"], capsys)
    starts = vi.RandomStarts(4, 7, {"x1": (-1.0, 2.0), "v2": (0.0, 3.0)}, MIDDLE)
    expected = vi.sweep(SET_A, over={"omega": OVER["omega"]}, start=starts, **WINDOW)
    xr.testing.assert_equal(opened("s.nc"), expected)
    assert "omega 1.1 to 1.2 (3), 4 starts" in out


def test_plane_writes_the_plane_of_the_library(capsys: pytest.CaptureFixture[str]) -> None:
    argv = ["plane", CASE, "--over", OMEGA, "--over", CLEARANCE, "--observe", "lyapunov", *SHORT]
    out = said([*argv, "--variable", "lyapunov", "--out", "p.nc", "--out", "p.png"], capsys)
    expected = vi.plane(SET_A, over=OVER, start=MIDDLE, observe="lyapunov", **WINDOW)
    xr.testing.assert_equal(opened("p.nc"), expected)
    assert opened("p.nc").motion.attrs["flag_meanings"] == expected.motion.attrs["flag_meanings"]
    words = expected.motion.attrs["flag_meanings"].split()
    assert all(word.replace("_", " ") in out for word in words)
    assert Path("p.png").stat().st_size > 1000


def test_plane_colours_the_symbols_that_are_named(capsys: pytest.CaptureFixture[str]) -> None:
    symbols = ["2-2-2", "1-1-1"]
    said([*PLANE, *SHORT, "--symbols", *symbols, "--out", "p.svg"], capsys)
    plane = vi.plane(SET_A, over=OVER, start=MIDDLE, **WINDOW)
    plotting.save(plotting.plot_plane(plane, symbols=symbols), "q.svg")
    assert Path("p.svg").read_bytes() == Path("q.svg").read_bytes()


def test_plane_observes_what_it_draws(capsys: pytest.CaptureFixture[str]) -> None:
    over = ["--over", "omega=1.0:1.005:2", "--over", "half_clearance=5,5.1"]
    said(["plane", CASE, *over, "--variable", "rotation", "--out", "p.nc"], capsys)
    said(["plane", CASE, *over, "--observe", "rotation", "--out", "q.nc"], capsys)
    found = opened("p.nc")
    xr.testing.assert_identical(found, opened("q.nc"))
    assert np.isfinite(found.rotation).all()


@pytest.mark.slow
def test_plane_counts_attractors_from_random_starts(capsys: pytest.CaptureFixture[str]) -> None:
    argv = ["plane", CASE, "--over", OMEGA, "--over", CLEARANCE, "--starts", "3", "--bounds"]
    out = said(
        [*argv, "v1=-1:1", "--settle-periods", "800", "--out", "p.nc", "--out", "p.svg"], capsys
    )
    starts = vi.RandomStarts(3, 0, {"v1": (-1.0, 1.0)}, MIDDLE)
    expected = vi.multistability(SET_A, over=OVER, start=starts, settle_periods=800, progress=False)
    xr.testing.assert_equal(opened("p.nc"), expected)
    assert "attractors met: 1 at 6 points" in out


def test_axes_of_a_sweep_may_be_coordinates_of_the_start(
    capsys: pytest.CaptureFixture[str],
) -> None:
    argv = ["sweep", CASE, "--over", "omega=1.1", "--over", "x1=-1:2:3", "--over", "v2=0,3"]
    out = said([*argv, *SHORT, "--out", "s.nc"], capsys)
    assert "omega 1.1, x1 -1 to 2 (3), v2 0 to 3 (2)\n6 members: 6 ok" in out
    starts = vi.GridStarts({"x1": [-1.0, 0.5, 2.0], "v2": [0.0, 3.0]}, MIDDLE)
    expected = vi.sweep(SET_A, over={"omega": [1.1]}, start=starts, **WINDOW)
    xr.testing.assert_equal(opened("s.nc"), expected)


def test_a_plane_of_a_parameter_and_a_coordinate_has_the_first_axis_as_its_abscissa(
    capsys: pytest.CaptureFixture[str],
) -> None:
    argv = ["plane", CASE, "--over", "v2=0,3", "--over", OMEGA, *SHORT, "--out", "p.nc"]
    said([*argv, "--out", "p.svg"], capsys)
    over = {"v2": [0.0, 3.0], "omega": OVER["omega"]}
    expected = vi.plane(SET_A, over=over, start=MIDDLE, **WINDOW)
    assert expected["motion"].dims == ("v2", "omega")
    xr.testing.assert_equal(opened("p.nc"), expected)


def test_a_plane_of_more_axes_counts_attractors_from_the_coordinates_among_them(
    capsys: pytest.CaptureFixture[str],
) -> None:
    argv = ["plane", CASE, "--over", OMEGA, "--over", "x1=0,1", "--over", "v2=0,3", *SHORT]
    said([*argv, "--out", "p.nc"], capsys)
    starts = vi.GridStarts({"x1": [0.0, 1.0], "v2": [0.0, 3.0]}, MIDDLE)
    expected = vi.multistability(SET_A, over={"omega": OVER["omega"]}, start=starts, **WINDOW)
    xr.testing.assert_equal(opened("p.nc"), expected)


def test_observers_take_the_options_of_the_library(capsys: pytest.CaptureFixture[str]) -> None:
    observe = "section:points=4:stop=B, section:label=upper, rms:row=-1/1:label=gap"
    observe += ", symbol:tolerance=1e-4"
    argv = ["sweep", CASE, "--over", OMEGA, "--observe", observe, *SHORT]
    said([*argv, "--out", "s.nc"], capsys)
    expected = vi.sweep(
        SET_A, over={"omega": OVER["omega"]}, start=MIDDLE, **WINDOW,
        observe=[
            vi.observe.Section(points=4, stop="B"), vi.observe.Section(label="upper"),
            vi.observe.Rms(row=(-1.0, 1.0), label="gap"), vi.observe.Symbol(tolerance=1e-4),
        ],
    )  # fmt: skip
    xr.testing.assert_equal(opened("s.nc"), expected)
    assert opened("s.nc").attrs["observe"] == expected.attrs["observe"]


def test_the_section_of_a_count_and_of_a_rotation_is_that_of_the_library(
    capsys: pytest.CaptureFixture[str],
) -> None:
    many = [*PLANE, *SHORT, "--starts", "2", "--bounds", "x1=-1:1", "--at", "B"]
    said([*many, "--out", "c.nc"], capsys)
    starts = vi.RandomStarts(2, 0, {"x1": (-1.0, 1.0)}, MIDDLE)
    counted = vi.multistability(SET_A, at=vi.AtStop("B"), over=OVER, start=starts, **WINDOW)
    xr.testing.assert_equal(opened("c.nc"), counted)
    turning = [*PLANE, *SHORT, "--observe", "rotation:stop=B", "--variable", "rotation"]
    said([*turning, "--out", "r.nc", "--out", "r.png"], capsys)
    observe = vi.observe.Rotation(stop="B")
    expected = vi.plane(SET_A, over=OVER, start=MIDDLE, observe=observe, **WINDOW)
    xr.testing.assert_equal(opened("r.nc"), expected)


@pytest.mark.parametrize(
    "argv",
    [
        ["basins", CASE, "--omega", "1.2", "--over", "x1=-2:2:2", "--over", "v1=0,1"],
        ["diagram", CASE, "--over", OMEGA, "--way", "up", "--points", "4"],
    ],
)
@pytest.mark.slow
def test_basins_and_diagrams_are_kept_in_a_store(
    argv: list[str], capsys: pytest.CaptureFixture[str]
) -> None:
    pytest.importorskip("zarr")
    kept = [*argv, *SHORT, "--store", "s.zarr"]
    said([*kept, "--out", "one.nc"], capsys)
    assert "kept in s.zarr" in said([*kept, "--out", "two.nc"], capsys)
    xr.testing.assert_identical(opened("one.nc"), opened("two.nc"))


def test_basins_are_those_of_the_library(capsys: pytest.CaptureFixture[str]) -> None:
    argv = ["basins", CASE, "--omega", "1.2", "--over", "x1=-2:2:4", "--over", "v1=-1:1:3"]
    out = said([*argv, "--out", "b.nc", "--out", "b.png"], capsys)
    over = {"x1": np.linspace(-2.0, 2.0, 4), "v1": np.linspace(-1.0, 1.0, 3)}
    expected = vi.basins(SET_A, over=over, start=SET_A.free_start(), progress=False)
    xr.testing.assert_equal(opened("b.nc"), expected)
    state = vi.attractor_state(expected, "1-1-1 a")
    assert f"1-1-1 a: periodic, 100% of the starts, for example {state}" in out
    assert vi.attractor_state(opened("b.nc"), "1-1-1 a") == state


def test_basins_say_how_many_starts_are_left(capsys: pytest.CaptureFixture[str]) -> None:
    three = ["basins", "impact-damper/B", "--omega", "0.945"]
    argv = [*three, "--over", "x1=-6:6:4", "--over", "v1=-6:6:3"]
    out = said([*argv, "--most-classified", "1"], capsys)
    assert "% of the starts. Raise --settle-periods, or --most-classified." in out
    out = said(argv, capsys)
    assert "not matched" not in out


@pytest.mark.parametrize("variable", ["v1", "phase", "lyapunov"])
def test_diagram_is_that_of_the_library(variable: str, capsys: pytest.CaptureFixture[str]) -> None:
    argv = ["diagram", CASE, "--over", OMEGA, "--way", "down", "--points", "4", *SHORT]
    argv += ["--observe", "lyapunov", "--variable", variable]
    said([*argv, "--out", "d.nc", "--out", "d.png"], capsys)
    expected = vi.bifurcation_sweep(
        SET_A, over={"omega": OVER["omega"]}, start=MIDDLE, way="down", points=4,
        observe="lyapunov", **WINDOW,
    )  # fmt: skip
    xr.testing.assert_equal(opened("d.nc"), expected)


def test_a_mechanism_is_swept_by_path_from_the_start_of_its_file(
    capsys: pytest.CaptureFixture[str],
) -> None:
    Path("wall.toml").write_text(WALL, encoding="utf-8")
    argv = ["sweep", "--config", "wall.toml", "--over", "elements[0].restitution=0.5:0.9:3"]
    out = said([*argv, *SHORT, "--variable", "n", "--out", "s.png", "--out", "s.nc"], capsys)
    assert "elements[0].restitution 0.5 to 0.9 (3)" in out
    assert opened("s.nc").n.dims == ("elements[0].restitution",)


def test_a_store_resumes_and_refuses_another_sweep(capsys: pytest.CaptureFixture[str]) -> None:
    pytest.importorskip("zarr")
    argv = ["sweep", CASE, "--over", OMEGA, *SHORT, "--store", "s.zarr"]
    assert "kept in s.zarr" in said(argv, capsys)
    assert said(argv, capsys)
    assert cli.main([*argv, "--settle-periods", "61"]) == cli.MISUSE
    assert "holds another sweep" in capsys.readouterr().err


@pytest.mark.parametrize("kind", ["sweep", "plane"])
def test_a_store_without_zarr_names_the_extra_before_anything_is_computed(
    kind: str, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setitem(sys.modules, "zarr", None)
    more = ["--over", "half_clearance=4:5:2"] if kind == "plane" else []
    assert cli.main([kind, CASE, "--over", OMEGA, *more, "--store", "s.zarr"]) == cli.FAILED
    message = capsys.readouterr().err
    assert "store: needs Zarr, which is not installed. Run: pip install" in message
    assert not Path("s.zarr").exists()


def test_an_interrupted_sweep_says_how_to_go_on(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    @functools.wraps(vi.sweep)
    def stopped(*_: object, **__: object) -> None:
        raise KeyboardInterrupt("interrupted; 3 of 9 tiles are kept.")

    monkeypatch.setattr("vibroimpact.cli.sweep.sweep", stopped)
    assert cli.main(["sweep", CASE, "--over", OMEGA]) == cli.INTERRUPTED
    assert "interrupted; 3 of 9 tiles are kept." in capsys.readouterr().err


def test_an_interruption_after_the_sweep_says_that_the_store_is_there(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def interrupted(*_: object, **__: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr("vibroimpact.cli.output.write", interrupted)
    argv = ["sweep", CASE, "--over", OMEGA, *SHORT, "--store", "s.zarr", "--out", "s.nc"]
    assert cli.main(argv) == cli.INTERRUPTED
    assert "interrupted; no file was written. s.zarr is kept" in capsys.readouterr().err


# ---- misuse --------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("argv", "message"),
    [
        (["sweep", CASE, "--over", OMEGA], "variable: missing. Take one of end"),
        (["sweep", CASE, "--over", OMEGA, "--variable", "power"], "'power': must be one of end"),
        (["sweep", *PLANE[1:], "--over", "zeta=0,0.1", "--variable", "n"], "one or two parameters"),
        ([*PLANE, "--over", "zeta=0,0.1", "--starts", "2", "--bounds", "x1=0:1"], "one or two para"),
        ([*PLANE[:4], "--starts", "2", "--bounds", "x1=0:1", "--most-motions", "3"], "most_motions: is for planes"),
        ([*PLANE, "--symbols", "1-1-1", "--variable", "period"], "are the colours of 'motion'"),
        (["sweep", *PLANE[1:], "--over", "x1=0,1", "--variable", "n"], "one or two parameters"),
        ([*PLANE, "--most-motions", "9"], "most_motions = 9: must be at most 7"),
        ([*PLANE, "--symbols", "1"], "symbols = ['1']: must be 1 to 7 different ones"),
        ([*PLANE, "--variable", "attractors"], "'attractors': must be one of"),
        ([*PLANE, "--starts", "2", "--bounds", "x1=0:1", "--variable", "n"], "must have two"),
        (["diagram", CASE, "--over", OMEGA, "--variable", "x9"], "'x9': must be one of"),
    ],
)  # fmt: skip
def test_a_mistake_about_the_picture_is_found_before_the_work(
    argv: list[str], message: str, capsys: pytest.CaptureFixture[str]
) -> None:
    endless = ["--settle-periods", "1e9", "--most-impacts", "1000000000"]
    assert cli.main([*argv, *endless, "--out", "p.png", "--out", "p.nc"]) == cli.MISUSE
    assert message in capsys.readouterr().err
    assert not list(Path().iterdir())


@pytest.mark.parametrize(
    ("argv", "message"),
    [
        (["sweep", CASE, "--over", "omega=1:2"], "omega=1:2: must be NAME=LOW:HIGH:COUNT"),
        (["sweep", CASE, "--over", "omega=a:2:3"], "must be NAME=LOW:HIGH:COUNT"),
        (["sweep", CASE, "--over", "omega=1:2:0"], "COUNT must be a whole number from 1"),
        (["sweep", CASE, "--over", OMEGA, "--over", OMEGA], "over = omega: is given twice"),
        (["sweep", CASE, "--over", OMEGA, "--observe", "sound"], "'sound': must be one of section"),
        (["sweep", CASE, "--over", OMEGA, "--bounds", "x1=0:1"], "Give --starts COUNT"),
        (["sweep", CASE, "--over", OMEGA, "--backend", "fpga"], "backend = 'fpga'"),
        (["sweep", CASE, "--over", "omega=1:2:inf"], "finite numbers"),
        (["sweep", CASE, "--over", "omega=1:2:1e18"], "from 1 to 10000000"),
        (["sweep", CASE, "--over", "omega=a"], "must be NAME=LOW:HIGH:COUNT or NAME=A,B"),
        (["sweep", CASE, "--over", OMEGA, "--seed", "3"], "Give --starts COUNT"),
        ([*RANDOM, "0", "--bounds", "x1=0:1"], "starts = 0: must be >= 1"),
        ([*RANDOM, "2"], "with --bounds NAME=LOW:HIGH"),
        ([*RANDOM, "2", "--bounds", "y=0:1"], "bounds = 'y': must be one of x1, x2, v1, v2, phase"),
        ([*RANDOM, "2", "--bounds", "x1=0:1:2"], "bounds = x1=0:1:2: must be NAME=LOW:HIGH"),
        ([*RANDOM, "2", "--bounds", "x1=0:1", "--bounds", "x1=0:2"], "bounds = x1: is given twice"),
        ([*RANDOM, "2", "--bounds", "v1=0:1", "--over", "x1=0:1:2"], "over = x1: a coordinate of the start varies one"),
        (["sweep", CASE, "--over", "x3=0:1:2", "--omega", "1"], "'x3': must be one of x1, x2, v1, v2, phase"),
        ([*RANDOM, "2", "--bounds", "x1=1:0"], "x1=1:0: must be NAME=LOW:HIGH with LOW < HIGH"),
        (["sweep", CASE, "--over", OMEGA, "--over", "x1=0,0"], "over = x1=0,0: must have each val"),
        (["sweep", CASE, "--over", OMEGA, "--observe", "section:stop=A:stop=B"], "stop is given"),
        (["sweep", CASE, "--over", OMEGA, "--client", "tcp://node:1"], "is for backend = 'dask'"),
        (["diagram", CASE, "--omega", "1", "--over", "x1=0,1"], "a diagram is along a parameter"),
        (["sweep", CASE, "--over", OMEGA, "--observe", "section:end=B"], "'end' must be one of p"),
        (["sweep", CASE, "--over", OMEGA, "--observe", "impacts:a=1"], "'a' must be left out"),
        (["sweep", CASE, "--over", OMEGA, "--observe", "section:points=x"], "a whole number"),
        ([*PLANE, "--at", "B"], "at: is for counting attractors"),
        ([*PLANE, "--starts", "2", "--bounds", "x1=0:1", "--observe", "power"], "must be left out"),
        (["sweep", CASE, "--over", "nothing=1:2:3", "--omega", "1"], "= 'nothing': must be one of m"),
        (["plane", CASE, "--over", "omga=1:2:3", "--over", "force=1:2:3"], "over = 'omga': must be"),
        (["plane", CASE, "--over", OMEGA], "give --over NAME=LOW:HIGH:COUNT twice"),
        (["diagram", CASE, "--over", OMEGA, "--over", "force=1:2:3"], "omega, force: give --over"),
        (["plane", CASE, "--over", OMEGA, "--over", "force=1:2:3", "--out", "p.txt"], "must end"),
        (["basins", CASE, "--omega", "1", "--over", "x1=0:1:3"], "over = x1: give --over NAME"),
        (["diagram", CASE, "--over", OMEGA, "--way", "left"], "way = 'left'"),
    ],
)  # fmt: skip
def test_misuse_is_refused_with_what_is_allowed(
    argv: list[str], message: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert_nothing_written(argv, cli.MISUSE, message, capsys)
