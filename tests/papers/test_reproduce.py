"""A reduced run of the main job: what is written, what is drawn, what an interruption leaves."""

from __future__ import annotations

import json
import math
import os
import re
import signal
import subprocess
import sys
from dataclasses import replace
from pathlib import Path
from types import MappingProxyType
from typing import NamedTuple

import matplotlib.pyplot as plt
import numpy as np
import pytest
from vibroimpact_papers.impact_damper import (
    TITLE,
    Panel,
    claims,
    figures,
    measures,
    panels,
    parameter_sets,
    planes,
    transient,
)
from vibroimpact_papers.impact_damper import reproduce as job
from vibroimpact_papers.impact_damper.plan import Plan, Sweep

import vibroimpact as vi
from vibroimpact._core.progress import Display

pytestmark = pytest.mark.slow

SMALL = Plan(
    sweeps=MappingProxyType(
        {
            "A": Sweep(0.92, 1.2, 0.04),
            "B": Sweep(0.93, 1.02, 0.01),
            "C": Sweep(0.415, 0.448, 0.003),
        }
    ),
    sweep_settle=200,
    sweep_points=30,
    panel_settle=1000,
    panel_max_settle=1000,
    panel_points=300,
    path_points=21,
    circle_offsets=2,
    circle_settle=2.0,
    circle_points=500,
    plane_points=(12, 9),
    plane_settle=60.0,
    plane_periods=20.0,
    strong=MappingProxyType({"A": (0.9, 0.99)}),
    strong_points=(12, 9),
    unfolded=(("A", "R4", 0.928),),
    spectrum_points=3,
    spectrum_impacts=1024,
    basin_points=10,
    basin_settle=1000.0,
    figures=("3", "5"),
)


ROOT = Path(__file__).parents[2]
POINTS = 5  # Neimark-Sacker points of the branch, each with a verdict on the lemma of section 4


def quiet() -> Display:
    return Display(job.STAGES, quiet=True)


@pytest.fixture(scope="module")
def out(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("reproduce") / "out"
    job.reproduce(folder, plan=SMALL, progress=quiet())
    return folder


def test_report_names_its_paper_as_the_references_do(out: Path) -> None:
    entry = (ROOT / "docs" / "references.bib").read_text(encoding="utf-8")
    title = re.search(r"@misc\{paper,\s*title = \{([^}]*)\}", entry)
    assert title is not None
    assert title[1] == TITLE
    for page in (out / "report.html", ROOT / "docs" / "overview.md"):
        assert TITLE in re.sub(r"\s+", " ", page.read_text(encoding="utf-8"))


def test_starts_that_have_not_settled_are_those_whose_sections_do_not_repeat() -> None:
    """Each start alone, by its section in the window."""
    small = replace(SMALL, transient_starts=(3, 2), transient_periods=(300, 1500))
    chosen = parameter_sets()["B"]
    found = transient.survivors(chosen, 0.94, small)
    half = planes.HALF_WIDTH * chosen.parameters.half_clearance
    for periods, left in zip(small.transient_periods, found.left, strict=True):
        settled = 0
        for x1 in np.linspace(-half, half, 3):
            for v1 in (-half, half):
                start = vi.State((x1, 0.0), (v1, 1.0))
                points = vi.section(
                    chosen.damper(0.94), start, at=vi.AtPhase(), points=20, settle_events=periods
                ).position
                again = np.abs(points[1:] - points[0]).max(axis=1) / np.abs(points).max()
                settled += bool(again[:10].min() < 1e-5)
        assert left == 6 - settled
    assert found.starts == 6
    assert found.impacts[0] == pytest.approx(600, rel=0.1)  # two in a period


def test_a_number_that_halves_falls_by_e_in_more_impacts() -> None:
    halved = transient.Survivors(8, (0, 1000), (8, 4))
    assert halved.fold == pytest.approx(1000 / np.log(2.0))
    assert transient.Survivors(8, (0, 1000), (8, 8)).fold == np.inf
    assert math.isnan(transient.Survivors(8, (0, 1000), (8, 0)).fold)


def test_everything_is_written(out: Path) -> None:
    drawn = {path.stem for path in (out / "figures").iterdir()}
    assert {"mechanism", "history", "portrait", "figure-3", "figure-5"} <= drawn
    assert {"multipliers-A", "diagram-A", "diagram-B", "diagram-C", "circles"} <= drawn
    assert {"plane-A", "plane-B", "plane-C", "strong-A", "unfolding-A-1", "spectra"} <= drawn
    for name in drawn:
        assert (out / "figures" / f"{name}.svg").stat().st_size > 0
        assert (out / "figures" / f"{name}.png").stat().st_size > 0


def test_exponents_along_a_route_add_up_to_the_contraction(out: Path) -> None:
    data = figures.open_data(out / "data" / "spectra-A.nc")
    p = parameter_sets()["A"].parameters
    per_period = 4.0 * math.log(p.restitution)  # two impacts, each by R^2
    expected = data["omega"] / (2.0 * math.pi) * per_period - 2.0 * p.zeta * p.omega_n
    assert np.allclose(data["exponent"].sum("order"), expected, atol=2e-4)


def test_every_claim_has_one_verdict(out: Path) -> None:
    rows = json.loads((out / "verdicts.json").read_text(encoding="utf-8"))["verdicts"]
    assert [row["id"] for row in rows] == [claim.id for claim in claims()]
    assert {row["verdict"] for row in rows} <= {"agrees", "differs", "cannot be decided"}
    assert all(row["witness"] for row in rows)


def test_section_4_is_recorded_at_every_point(out: Path) -> None:
    rows = json.loads((out / "verdicts.json").read_text(encoding="utf-8"))["section_4"]
    assert [row["set"] for row in rows] == ["A", "A", "B", "B", "C"]
    assert [row["supercritical"] for row in rows] == [True, True, False, True, True]
    assert len(list((out / "data").glob("circles-*.nc"))) == POINTS


def test_misprints_are_listed_with_residuals(out: Path) -> None:
    rows = json.loads((out / "verdicts.json").read_text(encoding="utf-8"))["misprints"]
    assert len(rows) > 10
    assert all(float(row["residual_printed"]) > float(row["residual_corrected"]) for row in rows)


def test_report_is_one_file_that_loads_nothing(out: Path) -> None:
    html = (out / "report.html").read_text(encoding="utf-8")
    links = re.findall(r'(?:src|href)="([^"]{0,40})', html)
    assert all(link.startswith(("#", "data:")) for link in links)
    assert html.count('class="badge ') == len(claims()) + POINTS
    for path in (out / "figures").glob("*.svg"):
        assert f'id="{path.stem}"' in html


def test_files_say_how_they_were_made(out: Path) -> None:
    for path in (out / "data").glob("*.nc"):
        attrs = figures.open_data(path).attrs
        for key in ("mass_ratio", "restitution", "version", "start_down", "sweep_settle_impacts"):
            assert key in attrs, (path.name, key)
        assert " at 0x" not in str(attrs)  # of an object in memory: another one in every run


def test_panel_figure_shows_the_points_of_its_file(out: Path) -> None:
    data = figures.open_data(out / "data" / "figure-5.nc")
    figure = figures.redraw(data)
    for ax, name in zip(figure.axes, dict.fromkeys(data["panel"].values), strict=True):
        rows = figures.rows_of(data, name)
        assert len(ax.lines) == len(rows)
        for line, row in zip(ax.lines, rows, strict=True):
            assert np.array_equal(line.get_xdata(), row["x1"])
            assert np.array_equal(line.get_ydata(), row["v1"])
    plt.close(figure)


def test_multiplier_figure_shows_the_squares(out: Path) -> None:
    parts = tuple(figures.open_data(out / "data" / f"multipliers-{s}.nc") for s in "BC")
    figure = figures.redraw(parts)
    for k, data in enumerate(parts):
        nu = (data["nu_real"] + 1j * data["nu_imag"]).sel(sign=1).values.ravel()
        for power in (1, 2):
            dots = figure.axes[2 * k + power - 1].collections[0].get_offsets()
            expected = np.column_stack([(nu**power).real, (nu**power).imag])
            assert np.array_equal(np.asarray(dots), expected)
    plt.close(figure)


def test_run_of_a_file_is_repeated_bit_for_bit(out: Path) -> None:
    for name in ("history", "portrait"):
        data = figures.open_data(out / "data" / f"{name}.nc")
        run = figures.run_from(data)
        assert np.array_equal(run.time, data["time"])
        assert np.array_equal(run.velocity_after, data["velocity_after"])


def test_two_runs_give_equal_bits(out: Path) -> None:
    alone = replace(SMALL, figures=("5",), strong=MappingProxyType({}))
    with job.processes(quiet()) as workers:
        found = job.compute(alone, workers)
    data = figures.open_data(out / "data" / "figure-5.nc")
    points = np.concatenate([f.points for r in found.panels.values() for f in r.found])
    assert np.array_equal(points[:, 0], data["x1"].values)
    assert np.array_equal(points[:, 1], data["v1"].values)


@pytest.mark.parametrize("stage", ["compute", "_residuals", "_write_figures"])
def test_interruption_leaves_nothing(
    stage: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def interrupt(*_: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr(job, "judge", lambda _: ())
    monkeypatch.setattr(job, "evidence_of", lambda *_: None)
    monkeypatch.setattr(job, "compute", lambda *_: None)
    monkeypatch.setattr(job, "_residuals", tuple)
    monkeypatch.setattr(job, "_write_figures", lambda *_: {})
    monkeypatch.setattr(job, stage, interrupt)
    with pytest.raises(KeyboardInterrupt):
        job.reproduce(tmp_path / "out", plan=SMALL, progress=quiet())
    assert not list(tmp_path.iterdir())


@pytest.mark.skipif(os.name != "posix", reason="sends SIGINT")
def test_interrupt_of_the_command_leaves_nothing(tmp_path: Path) -> None:
    command = [sys.executable, "-m", "vibroimpact", "reproduce", "impact-damper"]
    with subprocess.Popen(
        [*command, "--out", str(tmp_path / "out")],
        stderr=subprocess.PIPE,
        text=True,
        preexec_fn=lambda: signal.signal(
            signal.SIGINT, signal.SIG_DFL
        ),  # background jobs ignore it
    ) as process:
        assert process.stderr is not None
        for line in process.stderr:
            if "following" in line:
                break
        assert list(tmp_path.iterdir())
        process.send_signal(signal.SIGINT)
        assert "interrupted" in process.stderr.read()
    assert process.returncode == 130
    assert not list(tmp_path.iterdir())


def test_rings_of_a_plane_are_the_frequencies_of_the_paper(out: Path) -> None:
    data = figures.open_data(out / "data" / "plane-B.nc")
    figure = figures.redraw(data)
    (rings,) = figure.axes[0].get_lines()
    assert sorted(rings.get_xdata()) == sorted(p.omega for p in panels() if p.name[0] == "4")
    assert set(rings.get_ydata()) == {8.0}
    assert dict(data.motion.sizes) == {"omega": 12, "half_clearance": 9}
    plt.close(figure)


def test_basins_are_drawn_where_the_panels_found_that_attractors_coexist() -> None:
    class Result(NamedTuple):
        panel: Panel
        distinct: tuple[int, ...]

        @property
        def omega(self) -> float:
            return float(self.panel.omega)  # type: ignore[arg-type]

    counts = {"4c": 2, "4e": 3, "4i": 1, "2l": 2}
    results = {p.name: Result(p, (0,) * counts[p.name]) for p in panels() if p.name in counts}
    chosen = planes.multistable_panel(results)  # type: ignore[arg-type]
    assert chosen is not None
    assert chosen.panel.name == "4e"
    data = planes.basin_data(parameter_sets()["B"], SMALL, chosen.omega)
    assert sorted(data.name.values) == ["1-1-1 a", "8-8-8 a", "8-8-8 b"]
    figure = figures.redraw(data)
    assert len(figure.axes[0].get_lines()) == 3
    plt.close(figure)


def test_grid_holds_the_panels_and_the_ends() -> None:
    grid = Sweep(0.9, 1.0, 0.05).grid((0.93, 2.0))
    assert grid.tolist() == [0.9, 0.93, 0.95, 1.0]


def circle(count: int, wave: float = 0.0) -> np.ndarray:
    turn = 2.0 * np.pi * np.sqrt(2.0) * np.arange(count)
    return np.column_stack([np.cos(turn), np.sin(turn) + wave * np.cos(7.0 * turn)])


def test_smooth_circles_need_fewer_harmonics() -> None:
    rotation = float(np.sqrt(2.0) % 1.0)
    assert measures.harmonics(circle(2000), rotation) == 1.0
    assert measures.harmonics(circle(2000, 0.1), rotation) == 7.0


def test_same_cloud_tells_a_circle_from_a_larger_one() -> None:
    assert measures.same_cloud(circle(1000), circle(700))
    assert not measures.same_cloud(circle(1000), 1.2 * circle(1000))


def test_width_of_a_ring() -> None:
    ring = circle(20_000) * np.linspace(0.8, 1.0, 20_000)[:, None]
    assert measures.width(ring) == pytest.approx(0.2 / np.hypot(2.0, 2.0), rel=0.02)
