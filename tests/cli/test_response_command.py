"""The command response: its files, words and report are those of the library."""

from __future__ import annotations

import base64
import math
import re
import shlex
import xml.etree.ElementTree as ET
from collections.abc import Iterator
from dataclasses import replace
from functools import wraps
from html.parser import HTMLParser
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray as xr
from support.commands import WALL, assert_nothing_written, said

import vibroimpact as vi
from vibroimpact.cli import main as cli
from vibroimpact.cli import response as command
from vibroimpact.response import compare

pytestmark = pytest.mark.usefixtures("no_windows", "own_folder")

HERTZ, ZETA, MASS, F0 = 8.0, 0.02, 120.0, 400.0
OMEGA = 2.0 * math.pi * HERTZ
PHYSICAL = {
    "M1": MASS, "M2": 6.0, "K": MASS * OMEGA**2, "C": 2.0 * ZETA * MASS * OMEGA, "F0": F0,
    "Omega": OMEGA, "D": 0.02, "restitution": 0.6,
}  # fmt: skip
FRAME = "[physical]\n" + "\n".join(f"{name} = {value!r}" for name, value in PHYSICAL.items())
CHEAP = {"points": 4, "starts": 1, "settle_periods": 40.0, "periods": 10.0, "most_branches": 0}
WORDS = [
    word for name, value in CHEAP.items() for word in (f"--{name.replace('_', '-')}", str(value))
]
TITLE = 'Frame <b> & "slot"'
ARGV = [
    "response", "--config", "frame.toml", "--band", "omega=7:9", "--unit", "Hz", "--measure", "x1",
    "--compare", "linear", "--title", TITLE, *WORDS,
]  # fmt: skip
OUT = ["--out", "r.nc", "--out", "r.svg", "--out", "r.html"]


class Page(HTMLParser):
    """Elements of a page: open ones, attributes, rows of tables, text."""

    VOID = ("meta", "img")

    def __init__(self, text: str) -> None:
        super().__init__()
        self.open: list[str] = []
        self.attributes: list[tuple[str, str, str]] = []
        self.rows: list[list[str]] = []
        self.words = ""
        self.feed(text)
        self.close()

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.attributes += [(tag, name, value or "") for name, value in attrs]
        if tag not in self.VOID:
            self.open.append(tag)
        if tag == "tr":
            self.rows.append([])
        if tag in ("td", "th"):
            self.rows[-1].append("")

    def handle_endtag(self, tag: str) -> None:
        assert self.open.pop() == tag

    def handle_data(self, data: str) -> None:
        self.words += data
        if {"td", "th"} & {*self.open}:
            self.rows[-1][-1] += data


def returns(response: vi.Response, monkeypatch: pytest.MonkeyPatch) -> None:
    """Let the command have this response from the library."""

    @wraps(vi.frequency_response)
    def given(*_: Any, **__: Any) -> vi.Response:
        return response

    monkeypatch.setattr(command, "frequency_response", given)


@pytest.fixture(scope="module", autouse=True)
def _coarse_lines() -> Iterator[None]:
    """Draw linear machines with few points; their largest values are located all the same."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(compare, "COMPARED_POINTS", 30)
        yield


@pytest.fixture(scope="module")
def response() -> vi.Response:
    frame = vi.ImpactDamper.from_physical(**PHYSICAL)
    asked: dict[str, Any] = {"unit": "Hz", "progress": False, **CHEAP}
    return vi.frequency_response(frame, "omega", (7.0, 9.0), **asked)


@pytest.fixture(scope="module")
def written(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, str]:
    """Folder with the files of one run, and what it printed."""
    folder = tmp_path_factory.mktemp("response")
    (folder / "frame.toml").write_text(FRAME)
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(folder)
        lines: list[str] = []
        patch.setattr("sys.stdout.write", lines.append)
        assert cli.main([*ARGV, *OUT]) == cli.DONE
    return folder, "".join(lines)


@pytest.fixture(scope="module")
def page(written: tuple[Path, str]) -> Page:
    return Page((written[0] / "r.html").read_text(encoding="utf-8"))


# ---- the output is the library's -----------------------------------------------------------------


@pytest.mark.slow
def test_a_file_in_si_units_gives_the_data_of_the_machine_made_from_these(
    written: tuple[Path, str], response: vi.Response
) -> None:
    folder, out = written
    xr.testing.assert_identical(vi.load(folder / "r.nc").to_dataset(), response.to_dataset())
    assert repr(response) in out
    assert out.endswith("wrote r.nc, r.svg, r.html\n")
    assert sorted(path.name for path in folder.iterdir()) == [
        "frame.toml", "r.html", "r.nc", "r.svg",
    ]  # fmt: skip


def test_the_worst_motion_and_that_without_the_damper_are_said_in_words(
    written: tuple[Path, str], page: Page, response: vi.Response
) -> None:
    worst = response.worst
    resonance = HERTZ * math.sqrt(1.0 - 2.0 * ZETA**2)
    peak = F0 / PHYSICAL["K"] / (2.0 * ZETA * math.sqrt(1.0 - ZETA**2))
    reduction = 20.0 * math.log10(peak / worst.value)
    for words in (
        f"amplitude of x1, the mass of 120 kg, between 7 Hz and 9 Hz is {1e3 * worst.value:.4g} mm, at "
        f"{worst.parameter_shown:.4g} Hz.",
        f"Without the damper it would be {1e3 * peak:.4g} mm, at {resonance:.4g} Hz.",
        f"a reduction of {reduction:.3g} dB.",
    ):
        assert words in written[1]
        assert words in page.words


def test_the_report_lists_the_machine_in_si_units(page: Page) -> None:
    values = {row[0]: row[2] for row in page.rows if len(row) == 3}
    for part, value in {
        "mass of x1": "120 kg", "mass of x2, free between stops": "6 kg",
        "spring of x1 to the ground": f"{PHYSICAL['K'] / 1e3:.4g} kN/m",
        "dashpot of x1 to the ground": f"{PHYSICAL['C']:.4g} N s/m",
        "natural frequency": f"{OMEGA:.4g} rad/s (8 Hz)", "coefficient of restitution": "0.6",
        "half clearance": "10 mm", "forcing frequency": "varied from 7 Hz to 9 Hz",
        "force amplitude": "400 N",
    }.items():  # fmt: skip
        assert values[part] == value


def test_the_report_lists_the_answers_of_the_library(page: Page, response: vi.Response) -> None:
    begin = next(k for k, row in enumerate(page.rows) if row[:1] == ["forcing frequency"] and
                 "reached by" in row)  # fmt: skip
    listed = [(row[0], row[1]) for row in page.rows[begin + 1 :]]
    expected = [
        (f"{answer.parameter_shown:.4g} Hz", f"{1e3 * answer.value:.4g} mm")
        for frequency in np.linspace(7.0, 9.0, 5).tolist()
        for answer in response.at(frequency)
        if answer.stable
    ]
    assert listed == expected
    without = {row[0]: row[-1] for row in page.rows[begin + 1 :]}
    for frequency, text in without.items():
        r = float(frequency.removesuffix(" Hz")) / HERTZ
        exact = F0 / PHYSICAL["K"] / math.hypot(1.0 - r * r, 2.0 * ZETA * r)
        assert float(text.removesuffix(" mm")) == pytest.approx(1e3 * exact, rel=1e-3)


def test_the_report_does_not_count_a_ball_that_stands_in_its_gap(
    page: Page, response: vi.Response
) -> None:
    neutral = [a for a in response.at(9.0) if a.motion == "1-0-0"]
    assert [a.stability.words for a in neutral] == ["neutral"]
    assert max(map(len, response.answers)) == 1
    assert "Only one steady motion was found at each value" in page.words
    assert not any(row[0] == "has no impacts" for row in page.rows)


def test_the_report_states_the_command_as_it_was_typed(page: Page) -> None:
    assert shlex.join(["vibroimpact", *ARGV, *OUT]) in page.words
    assert f"vibroimpact {vi.__version__}" in page.words


# ---- the page ------------------------------------------------------------------------------------


def test_the_report_is_one_well_formed_file_that_loads_nothing(
    written: tuple[Path, str], page: Page
) -> None:
    text = (written[0] / "r.html").read_text(encoding="utf-8")
    assert page.open == []
    assert not re.search(r"https?:|<script|<link|@import|url\(", text)
    sources = [value for _, name, value in page.attributes if name in ("src", "href")]
    assert len(sources) == 2
    for source in sources:
        media, _, data = source.partition(",")
        assert media == "data:image/svg+xml;base64"
        svg = ET.fromstring(base64.b64decode(data))  # noqa: S314 - our own text
        assert svg.tag.endswith("svg")
    assert all(value for tag, name, value in page.attributes if (tag, name) == ("img", "alt"))


def test_the_report_escapes_what_the_user_wrote(written: tuple[Path, str], page: Page) -> None:
    text = (written[0] / "r.html").read_text(encoding="utf-8")
    assert "<b>" not in text
    assert text.count("<title>Frame &lt;b&gt; &amp; &#34;slot&#34;</title>") == 1
    assert TITLE in page.words


@pytest.mark.slow
def test_a_response_writes_the_same_report_without_a_command(
    response: vi.Response, page: Page
) -> None:
    response.report("own.html", title=TITLE, compare=("linear",))
    own = Page(Path("own.html").read_text(encoding="utf-8"))
    assert own.rows == page.rows
    assert "vibroimpact response" not in own.words
    with pytest.raises(vi.InvalidParameterError, match=r"path = own.txt: must end in .html"):
        response.report("own.txt")


# ---- what goes wrong -----------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("argv", "message"),
    [
        (["impact-damper/A", "--band", "omega=1.2:1.1"], "omega=1.2:1.1: must be NAME=LOW:HIGH"),
        (["impact-damper/A", "--band", "omega=0:1"], "bounds: omega = 0.0: must be > 0"),
        (["impact-damper/A", "--band", "omega=1:2", "--band", "zeta=0:1"], "give --band"),
        (["impact-damper/A", "--band", "gap=1:2"], "band = 'gap': must be one of mass_ratio"),
        (["impact-damper/A", "--band", "omega=1:2", "--measure", "x9"], "row = 'x9': must be"),
        (["impact-damper/A", "--band", "omega=1:2", "--unit", "rpm"], "unit = 'rpm': must be one"),
        (["impact-damper/A", "--band", "omega=1:2", "--out", "r.txt"], "must end in .nc"),
        (["impact-oscillator", "--band", "omega=1:2", "--compare", "tuned", "--zeta", "0.1",
          "--restitution", "0.6", "--clearance", "0.2"], "compare = 'tuned': needs one mass"),
        (["impact-damper/A", "--omega", "1", "--band", "zeta=0.1:0.2", "--unit", "Hz"],
         "zeta is not the forcing frequency"),
    ],
)  # fmt: skip
def test_misuse_is_one_sentence_and_leaves_nothing(
    argv: list[str], message: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert_nothing_written(["response", *argv], cli.MISUSE, message, capsys)


def test_other_commands_write_no_report(capsys: pytest.CaptureFixture[str]) -> None:
    argv = ["orbit", "impact-damper/A", "--omega", "1.2", "--out", "r.html"]
    assert_nothing_written(
        argv, cli.MISUSE, "out = r.html: must end in .nc, .csv, .xlsx, .svg", capsys
    )


@pytest.mark.parametrize(
    ("changes", "status", "message"),
    [
        ({"interrupted": True}, cli.INTERRUPTED, "interrupted; nothing was written."),
        ({"curves": (), "answers": ((),)}, cli.FAILED, "holds no stable motion at all"),
    ],
)
def test_what_is_not_whole_is_not_written(
    changes: dict[str, Any], status: int, message: str, response: vi.Response,
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str],
) -> None:  # fmt: skip
    returns(replace(response, **changes), monkeypatch)
    argv = ["response", "impact-damper/A", "--band", "omega=1:2", *OUT]
    assert_nothing_written(argv, status, message, capsys)


def test_an_interruption_leaves_the_picture_of_what_was_found_and_says_so(
    response: vi.Response, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    @wraps(vi.frequency_response)
    def given(*_: Any, so_far: Any = None, **__: Any) -> vi.Response:
        if so_far is not None:
            so_far(response)
        return replace(response, interrupted=True)

    monkeypatch.setattr(command, "frequency_response", given)
    argv = ["response", "impact-damper/A", "--band", "omega=1:2", "--out", "r.nc", "--out", "r.svg"]
    assert cli.main(argv) == cli.INTERRUPTED
    message = "interrupted; r.svg: what was found until then. No other file was written."
    assert message in capsys.readouterr().err
    assert [path.name for path in Path().iterdir()] == ["r.svg"]


def test_an_error_in_the_report_leaves_no_other_file(
    response: vi.Response, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def failing(*_: Any, **__: Any) -> str:
        raise vi.VibroImpactError("the page fails")

    returns(response, monkeypatch)
    monkeypatch.setattr("vibroimpact.plotting.report.report_of", failing)
    argv = ["response", "impact-damper/A", "--band", "omega=1:2", *OUT]
    assert_nothing_written(argv, cli.FAILED, "the page fails", capsys)


def test_a_mechanism_from_a_file_starts_at_rest_or_where_the_file_says(
    capsys: pytest.CaptureFixture[str],
) -> None:
    Path("wall.toml").write_text(WALL.partition("[start]")[0])
    argv = ["response", "--config", "wall.toml", "--band", "omega=0.7:0.9", *WORDS]
    out = said([*argv, "--measure", "power", "--out", "w.html"], capsys)
    assert "dissipated power" in out
    assert "Without" not in out  # what takes no power says nothing about stops
    rows = {row[0]: row[-1] for row in Page(Path("w.html").read_text(encoding="utf-8")).rows}
    assert rows["rigid stop 0"] == "x1 ≤ 0.5; restitution 0.7"
    assert rows["force amplitude on x1"] == "1"
    Path("wall.toml").write_text(WALL.replace("position = [0.0]", "position = [-0.3]"))
    said(argv, capsys)
