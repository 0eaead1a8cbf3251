"""Runs that move: bodies are where the run is, stops where they are met, and files hold every frame."""

from __future__ import annotations

import base64
import gzip
import io
import json
import shutil
from pathlib import Path

import matplotlib as mpl
import numpy as np
import pytest
from PIL import Image

import vibroimpact as vi
from vibroimpact.cli import main as cli
from vibroimpact.cli import simulate
from vibroimpact.explorer import page
from vibroimpact.plotting.animation import Lanes, content_of_animation

DAMPER = vi.ImpactDamper(**vi.ImpactDamper.example)
RUN = vi.simulate(DAMPER, DAMPER.free_start(), impacts=12)


def lanes_at(run: vi.Run, t: float) -> Lanes:
    """Lanes of a run, drawn at this time."""
    ax = mpl.figure.Figure().add_subplot()
    lanes = Lanes(ax, run, np.array([t]), run.at(np.array([t]))[0])
    lanes.show(0, 1e-6)
    return lanes


def test_at_an_impact_the_body_touches_the_stop_that_it_meets() -> None:
    for k in np.flatnonzero(RUN.impacts)[:8]:
        lanes = lanes_at(RUN, float(RUN.time[k]))
        free = lanes.bodies[1]
        edges = {1: free.get_x() + free.get_width(), -1: free.get_x()}
        for (_, _, side, _), line, flash in zip(
            lanes.stops, lanes.lines, lanes.flashes, strict=True
        ):
            gap = abs(line.get_xdata()[0] - edges[side])
            met = RUN.side[k] == side
            assert bool(gap < 1e-9) == met
            assert (len(flash.get_xdata()) == 1) == met


def test_a_ball_meets_its_table_where_the_table_is() -> None:
    ball = vi.machines.BouncingBall()
    run = vi.simulate(ball, ball.free_start(), impacts=4)
    k = int(np.flatnonzero(run.impacts)[1])
    lanes = lanes_at(run, float(run.time[k]))
    assert abs(lanes.lines[0].get_xdata()[0] - lanes.bodies[0].get_x()) < 1e-9


def test_a_gif_has_every_frame() -> None:
    moving = RUN.animate(1.0, 8.0, seconds=0.4, frames_per_second=10)
    with Image.open(io.BytesIO(content_of_animation(moving, ".gif"))) as image:
        assert image.n_frames == 4
        assert image.info["duration"] == 100


def test_the_command_writes_an_animation(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(simulate, "FRAMES_PER_SECOND", 1)
    path = tmp_path / "run.gif"
    words = ["simulate", "impact-damper/2a", "--impacts", "5", "--out", str(path)]
    assert cli.main(words) == 0
    with Image.open(path) as image:
        assert image.n_frames == 6


def test_the_page_of_a_run_has_its_machine_and_start(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    words = [
        "simulate",
        "bouncing-ball",
        "--restitution",
        "0.5",
        "--position",
        "2",
        "--velocity",
        "0",
    ]
    path = tmp_path / "run.html"
    monkeypatch.setattr(page, "PAGE", tmp_path / "page.html")
    assert cli.main([*words, "--out", str(path)]) == cli.FAILED
    assert "make explorer" in capsys.readouterr().err
    page.PAGE.write_text(page.PLACE)
    assert cli.main([*words, "--out", str(path)]) == 0
    packed = path.read_text().partition('id="machines">')[2].partition("<")[0]
    (machine,) = json.loads(gzip.decompress(base64.b64decode(packed)))["machines"].values()
    assert machine["start"] == {"x": [2.0], "v": [0.0], "phase": 0.0}
    assert {one["name"]: one["value"] for one in machine["parameters"]}["restitution"] == 0.5


def test_windows_and_lengths_that_cannot_be_are_refused(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    for options in (
        {"t0": -1.0},
        {"t1": 1e9},
        {"seconds": 0.0},
        {"frames_per_second": 0},
        {"seconds": 1e4},
    ):
        with pytest.raises(vi.InvalidParameterError):
            RUN.animate(**options)  # type: ignore[arg-type]
    monkeypatch.setattr(shutil, "which", lambda _: None)
    moving = RUN.animate(seconds=0.2, frames_per_second=10)
    assert content_of_animation(moving, ".gif").startswith(b"GIF")
    with pytest.raises(vi.InvalidParameterError, match="ffmpeg"):
        content_of_animation(moving, ".mp4")
