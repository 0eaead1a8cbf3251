"""The command design: its files, words and report are those of the library."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
import xarray as xr
from support.commands import assert_nothing_written, said

import vibroimpact as vi
from vibroimpact.cli import main as cli
from vibroimpact.design import optimise

from .test_response_command import FRAME, PHYSICAL, Page

pytestmark = pytest.mark.usefixtures("no_windows", "own_folder")

JUDGED: dict[str, Any] = {"points": 3, "starts": 1, "settle_periods": 20.0, "periods": 5.0}
ARGV = [
    "design", "--config", "frame.toml", "--bounds", "half_clearance=0.005:0.02",
    "--band", "omega=7:9", "--unit", "Hz", "--budget", "32", "--refine", "0",
    *(word for name, value in JUDGED.items() for word in (f"--{name.replace('_', '-')}", str(value))),
]  # fmt: skip


@pytest.fixture(scope="module")
def best() -> vi.Design:
    frame = vi.ImpactDamper.from_physical(**PHYSICAL)
    return vi.optimise(
        frame, {"half_clearance": (0.005, 0.02)},
        vi.Objective("omega", (7.0, 9.0), unit="Hz", **JUDGED), budget=32, refine=0, progress=False,
    )  # fmt: skip


@pytest.fixture
def _few(monkeypatch: pytest.MonkeyPatch) -> None:
    """A report of few values."""
    for name, value in {"REPORT_VALUES": 3, "REPORT_STARTS": 1, "REPORT_BRANCHES": 0}.items():
        monkeypatch.setattr(optimise, name, value)


@pytest.mark.usefixtures("_few")
@pytest.mark.slow
def test_design_prints_and_writes_the_best_machine_of_the_library(
    best: vi.Design, capsys: pytest.CaptureFixture[str]
) -> None:
    Path("frame.toml").write_text(FRAME)
    text = said([*ARGV, "--out", "d.nc", "--out", "d.html"], capsys)
    assert repr(best) in text
    low, high, _ = best.robust()["half_clearance"]
    assert f"within 1 dB from {1e3 * low:.6g} to {1e3 * high:.6g} mm" in text
    with xr.open_dataset("d.nc", engine="h5netcdf") as found:
        assert float(found.best_value) == best.value
    page = Page(Path("d.html").read_text(encoding="utf-8"))
    assert not page.open
    assert f"Best of {best.machines} machines: half clearance" in page.words
    assert f"{best.reduction_db:.3g} dB better than with all stops open" in page.words
    assert any(row[0] == "half clearance" and len(row) == 5 for row in page.rows)
    assert "vibroimpact design --config frame.toml" in page.words


SCALED = ["design", "impact-damper/A", "--bounds", "half_clearance=1:20", *ARGV[5:]]


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (["--bounds", "half_clearnce=1:2"], "half_clearnce"),
        (["--band", "zeta=0:1"], "give --band"),
        (["--measure", "x9"], "of coordinates 1 to 2"),
        (["--bounds", "restitution=0.5:1.5"], "restitution"),
    ],
)
def test_what_cannot_be_designed_is_refused_in_one_sentence(
    change: list[str], message: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert_nothing_written([*SCALED, *change, "--out", "d.html"], cli.MISUSE, message, capsys)
