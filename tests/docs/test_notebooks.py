"""The notebooks of examples/ run from top to bottom, and are kept without what they show."""

from __future__ import annotations

import json
import math
import re
import runpy
from pathlib import Path

import pytest

import vibroimpact as vi
from vibroimpact.explorer import page

ROOT = Path(__file__).parents[2]
TOOL = runpy.run_path(str(ROOT / "tools" / "notebooks.py"))
NOTEBOOKS = sorted((ROOT / "examples").glob("*.ipynb"))
TORUS = {  # set C of the paper
    "mass_ratio": 0.05092, "omega_n": 1.0, "zeta": 0.015, "restitution": 0.7, "half_clearance": 6.0,
}  # fmt: skip
pytestmark = pytest.mark.usefixtures("no_windows")


@pytest.fixture
def shown(
    request: pytest.FixtureRequest, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> list[str]:
    """What the code cells of a notebook show, in their order."""
    pytest.importorskip("anywidget", reason="anywidget is not installed")
    if not page.PAGE.exists():
        monkeypatch.setattr(page, "PAGE", tmp_path / "page.html")
        page.PAGE.write_text(page.PLACE)
    (path,) = (one for one in NOTEBOOKS if one.stem.startswith(request.param))
    return [cell.shown for cell in TOOL["run"](path) if cell.is_code]


@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.stem)
def test_a_notebook_holds_no_output_and_says_what_it_is(path: Path) -> None:
    whole = json.loads(path.read_text("utf-8"))
    assert whole["nbformat"] == 4
    assert "".join(whole["cells"][0]["source"]).startswith("# ")
    for cell in whole["cells"]:
        assert re.fullmatch(r"[\w-]{1,64}", cell["id"])
        if cell["cell_type"] == "code":
            assert cell["outputs"] == []
            assert cell["execution_count"] is None


def numbers(text: str) -> list[float]:
    return [float(x) for x in re.findall(r"-?\d+\.\d*(?:e[+-]?\d+)?|-?\d+e[+-]?\d+", text)]


@pytest.mark.slow
@pytest.mark.parametrize("shown", ["student"], indirect=True)
def test_the_torus_of_the_student_breaks(shown: list[str]) -> None:
    (text,) = (one for one in shown if "+-" in one and "<table" not in one)
    rows = [numbers(line) for line in text.splitlines() if ":" in line]
    exponents = {omega: (value, error) for omega, value, error in rows}
    orbit = vi.symmetric_orbits(vi.ImpactDamper(**TORUS, omega=0.435))[0]
    closed = math.log(max(abs(orbit.multipliers))) / orbit.period
    assert exponents[0.435][0] == pytest.approx(closed, abs=2e-5)  # three digits are printed
    assert all(abs(exponents[omega][0]) < 1e-4 for omega in (0.425, 0.421, 0.419))
    value, error = exponents[0.418]
    assert value > 4.0 * error > 0.0


@pytest.mark.slow
@pytest.mark.parametrize("shown", ["researcher"], indirect=True)
def test_the_point_of_the_researcher_is_where_the_closed_form_has_it(shown: list[str]) -> None:
    (text,) = (one for one in shown if one.startswith("<pre>array("))
    assert numbers(text)[:2] == pytest.approx([1.0, 1.0], abs=1e-8)
    assert shown[-1] == "<pre>True</pre>"


@pytest.mark.slow
@pytest.mark.parametrize("shown", ["engineer"], indirect=True)
def test_the_damper_of_the_engineer_is_better_than_none_and_robust(shown: list[str]) -> None:
    (text,) = (one for one in shown if "dB better" in one)
    assert float(re.findall(r"([\d.]+) dB better", text)[0]) > 3.0
    (ranges,) = (one for one in shown if ", from " in one)
    for best, low, high in re.findall(
        r": (\S+), from (\S+) to (\S+)", ranges.replace("</pre>", "")
    ):
        assert float(low) <= float(best) <= float(high)
    assert shown[-1] == "<pre>8.0</pre>"
