"""Every example runs, prints what it says, and writes its picture only when asked."""

from __future__ import annotations

import importlib.util
import re
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pytest
from PIL import Image
from scipy.integrate import solve_ivp

import vibroimpact as vi

pytestmark = pytest.mark.usefixtures("no_windows")

ROOT = Path(__file__).parents[2]
EXAMPLES = sorted((ROOT / "examples").glob("*.py"))
# Ensembles are tested with fewer members: constants of the example. tools/gallery_pictures.py runs
# all examples at full size, for the pictures in docs/index.md.
SMALLER = {
    "basins_of_attraction": {"POINTS": 12},
    "big_sweep_that_resumes": {"ACROSS": 12, "UP": 6, "TILE": 24},
    "bifurcation_diagram": {"VALUES": 12, "SETTLE": 300},
    "lyapunov_map": {"ACROSS": 16, "UP": 10},
    "parameter_plane": {"ACROSS": 16, "UP": 10},
    "resonances_in_a_plane": {"ACROSS": 16, "UP": 10},
    "rotation_numbers": {"ACROSS": 20, "UP": 14},
    "size_a_damper": {"BUDGET": 32, "STARTS": 1, "REFINE": 1},
}


def module_of(path: Path) -> ModuleType:
    spec = importlib.util.spec_from_file_location(path.stem, path)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


GALLERY = module_of(ROOT / "tools" / "gallery_pictures.py")


def loaded(name: str) -> ModuleType:
    (path,) = (path for path in EXAMPLES if path.stem == name)
    module = module_of(path)
    for constant, value in SMALLER.get(name, {}).items():
        assert hasattr(module, constant)
        setattr(module, constant, value)
    return module


@pytest.mark.slow
@pytest.mark.parametrize("path", EXAMPLES, ids=lambda path: path.stem)
def test_the_example_writes_its_picture_where_asked(
    path: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    loaded(path.stem).main("picture.png")
    assert [made.name for made in tmp_path.iterdir()] == ["picture.png"]
    assert (tmp_path / "picture.png").read_bytes().startswith(b"\x89PNG")
    assert capsys.readouterr().out


def test_an_example_that_is_not_asked_writes_nothing_and_says_so(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    loaded("bouncing_ball").main()
    assert not list(tmp_path.iterdir())
    assert "no picture is written: give --out FILE" in capsys.readouterr().out
    assert [p.stem for p in EXAMPLES if "no picture is written" not in p.read_text("utf-8")] == []


@pytest.mark.parametrize("path", EXAMPLES, ids=lambda path: path.stem)
def test_examples_are_short(path: Path) -> None:
    assert 20 <= len(path.read_text(encoding="utf-8").splitlines()) <= 60


def test_the_ball_rests_when_the_closed_form_says(capsys: pytest.CaptureFixture[str]) -> None:
    loaded("bouncing_ball").main()
    computed, closed = (float(x) for x in re.findall(r"\d\.\d{15}", capsys.readouterr().out))
    assert computed == pytest.approx(closed, rel=1e-14)  # 57 impacts, rounding of each


def test_chatter_sticking_and_release_come_in_this_order(
    capsys: pytest.CaptureFixture[str],
) -> None:
    loaded("chatter_and_sticking").main()
    kinds = re.findall(r"t = \S+: (\w+)", capsys.readouterr().out)
    assert kinds[:3] == ["chatter", "stick", "release"]


def test_the_ball_meets_its_table_where_the_closed_form_says(
    capsys: pytest.CaptureFixture[str],
) -> None:
    loaded("moving_stop").main()
    computed, closed = (float(x) for x in re.findall(r"\d\.\d{12}", capsys.readouterr().out))
    assert computed == pytest.approx(closed, abs=1e-11)


def test_a_soft_stop_and_a_dashpot_take_the_energy_that_the_force_gives(
    capsys: pytest.CaptureFixture[str],
) -> None:
    loaded("soft_stop").main()
    said = capsys.readouterr().out
    given, lost, taken = (float(x) for x in re.findall(r"(\d\.\d{6})", said))
    assert given == pytest.approx(lost + taken, abs=2e-6)  # of six digits printed
    assert "states: UPPER, BEHIND_UPPER, OPEN" in said


def test_a_block_on_a_belt_keeps_the_period_of_its_closed_form(
    capsys: pytest.CaptureFixture[str],
) -> None:
    loaded("stick_slip").main()
    said = capsys.readouterr().out
    periods = re.findall(r"period (\S+), closed form (\S+), saw-tooth (\S+)", said)
    assert len(periods) == 3
    assert all(computed == closed for computed, closed, _ in periods)
    slowest, saw = float(periods[-1][0]), float(periods[-1][2])
    assert slowest == pytest.approx(saw, rel=0.02)
    assert said.count("leaves at x = 0.200000000, is caught at 0.000000000") == 3
    assert "attractor: 0-0 periodic, 2 changes" in said


def test_the_soil_takes_its_level_times_the_drift(capsys: pytest.CaptureFixture[str]) -> None:
    loaded("driven_pile").main()
    said = capsys.readouterr().out
    work, product = re.findall(r"period (\S+), level times drift (\S+)", said)[0]
    assert float(work) == pytest.approx(float(product), rel=1e-8)
    assert float(product) > 0.5
    assert "the same to 1e-9: True" in said


def test_a_force_in_pieces_moves_the_mass_as_an_integrator_does() -> None:
    """SciPy's, told of the same steps and impacts, over three periods from rest."""
    example = loaded("square_wave_force")
    runs = list(example.pieces(vi.State((0.0,), (0.0,)), 6))

    def gap(_: float, y: Any) -> Any:
        return 0.6 - y[0]

    gap.terminal, gap.direction = True, -1  # type: ignore[attr-defined]
    y, hits = np.zeros(2), 0
    for k, run in enumerate(runs):
        force, t = example.FORCE * (-1.0) ** k, 0.0
        while t < example.HALF:
            found = solve_ivp(
                lambda _, y, force=force: [y[1], force - 0.1 * y[1] - y[0]],
                (t, example.HALF), y, events=gap, rtol=1e-12, atol=1e-13,
            )  # fmt: skip
            t, y = found.t[-1], found.y[:, -1]
            if found.status == 1:
                y, hits = np.array([0.6, -0.7 * y[1]]), hits + 1
        assert [*run.last.position, *run.last.velocity] == pytest.approx(y, abs=1e-9)
    assert sum(int(run.impacts.sum()) for run in runs) == hits > 0


def test_an_interrupted_sweep_goes_on_where_it_was(capsys: pytest.CaptureFixture[str]) -> None:
    loaded("big_sweep_that_resumes").main()
    said = capsys.readouterr().out
    assert "first run: 48 of 72 members\nplane: interrupted; 2 of 3 tiles are in" in said
    assert "second run: 24 of 24 members\n" in said


def test_basins_name_their_three_attractors(capsys: pytest.CaptureFixture[str]) -> None:
    loaded("basins_of_attraction").main()
    names = re.findall(r"^(\S+ \w), periodic", capsys.readouterr().out, re.MULTILINE)
    assert sorted(names) == ["1-1-1 a", "8-8-8 a", "8-8-8 b"]


def test_locked_tori_turn_by_fractions_of_their_period(capsys: pytest.CaptureFixture[str]) -> None:
    loaded("rotation_numbers").main()
    said = capsys.readouterr().out
    assert int(re.findall(r"(\d+) of them are locked", said)[0]) > 0
    # A number that knows nothing of the period q is off by 1/(4 q) on average, 0.01 at q = 21 here.
    assert float(re.findall(r"fractions within (\S+)", said)[0]) < 1e-4


def test_the_gallery_shows_every_example_with_its_picture() -> None:
    text = (ROOT / "docs" / "index.md").read_text(encoding="utf-8")
    row = r"\]\(pictures/example_(\w+)\.png\)\]\(\.\./examples/\1\.py\) \| \[\1\.py\]"
    shown = re.findall(row, text)
    assert sorted(shown) == [path.stem for path in EXAMPLES]
    kept = sorted(GALLERY.PICTURES.glob("example_*"))
    assert kept == [GALLERY.picture_of(path.stem) for path in EXAMPLES]
    for picture in kept:
        assert picture.stat().st_size <= GALLERY.LARGEST
        with Image.open(picture) as image:
            assert image.width == GALLERY.WIDTH


def test_a_picture_of_the_gallery_is_scaled_down(tmp_path: Path) -> None:
    large, small = tmp_path / "large.png", tmp_path / "small.png"
    Image.new("RGB", (1600, 800), "#0072B2").save(large)
    GALLERY.scale(large, small)
    with Image.open(small) as image:
        assert image.size == (GALLERY.WIDTH, GALLERY.WIDTH // 2)
        assert image.convert("RGB").getpixel((0, 0)) == (0x00, 0x72, 0xB2)
