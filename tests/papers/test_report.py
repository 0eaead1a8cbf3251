"""The page builder, the output folder and the progress display."""

from __future__ import annotations

import io
import os
import re
from typing import TYPE_CHECKING

import pytest
from vibroimpact_papers.folder import whole_folder
from vibroimpact_papers.judged import Word

from vibroimpact import InvalidParameterError
from vibroimpact._core.progress import Display
from vibroimpact.plotting.page import Page, Picture, Score, Section, Table, Text

if TYPE_CHECKING:
    from pathlib import Path


class Terminal(io.StringIO):
    def isatty(self) -> bool:
        return True


def sample_page() -> str:
    table = Table(("claim", "verdict"), [["a < b & c", Word.DIFFERS.badge]], stacked=True)
    svg = b"<svg xmlns='http://www.w3.org/2000/svg'/>"
    picture = Picture(svg, "A caption.", 'what "it" shows', "A title", "one")
    section = Section("First", [Text(("One.", "Two.")), table, picture], "first")
    opening = [Text(("Opening.",)), Score({Word.AGREES.badge: 3})]
    return Page("Title", opening, [section], "Foot.", contents=True).__html__()


def test_page_loads_nothing_from_outside() -> None:
    html = sample_page()
    links = re.findall(r'(?:src|href)="([^"]*)"', html)
    assert links
    assert all(link.startswith(("#", "data:")) for link in links)
    assert "url(" not in html
    assert "@import" not in html


def test_text_is_escaped() -> None:
    html = sample_page()
    assert "a &lt; b &amp; c" in html
    assert 'alt="what &#34;it&#34; shows"' in html


def test_every_contents_entry_leads_to_a_section() -> None:
    html = sample_page()
    targets = re.findall(r'href="#([^"]*)"', html)
    assert targets == ["first"]
    assert all(f'id="{target}"' in html for target in targets)


def test_verdicts_are_words_and_signs_not_only_colours() -> None:
    shown = {word.badge.__html__() for word in Word}
    assert len(shown) == len(Word)
    assert all(word.value in word.badge.__html__() for word in Word)
    assert len({word.badge.text[0] for word in Word}) == len(Word)


def test_folder_appears_whole(tmp_path: Path) -> None:
    out = tmp_path / "out"
    with whole_folder(out) as work:
        (work / "a").write_text("1")
        assert not out.exists()
    assert (out / "a").read_text() == "1"
    assert list(tmp_path.iterdir()) == [out]


@pytest.mark.parametrize("error", [KeyboardInterrupt, OSError, ValueError])
def test_interruption_leaves_what_was_there(tmp_path: Path, error: type[BaseException]) -> None:
    out = tmp_path / "out"
    with whole_folder(out) as work:
        (work / "a").write_text("old")

    def interrupted() -> None:
        with whole_folder(out) as work:
            (work / "a").write_text("new")
            raise error

    with pytest.raises(error):
        interrupted()
    assert (out / "a").read_text() == "old"
    assert list(tmp_path.iterdir()) == [out]


def test_own_folder_is_replaced_whole(tmp_path: Path) -> None:
    out = tmp_path / "out"
    for name in ("first", "second"):
        with whole_folder(out) as work:
            (work / name).write_text("")
    assert not (out / "first").exists()
    assert (out / "second").exists()


def test_foreign_folder_is_refused_and_kept(tmp_path: Path) -> None:
    (tmp_path / "notes.txt").write_text("mine")
    with pytest.raises(InvalidParameterError, match="foreign files"), whole_folder(tmp_path):
        pass
    assert [path.name for path in tmp_path.iterdir()] == ["notes.txt"]


def test_file_in_place_of_the_folder_is_refused(tmp_path: Path) -> None:
    out = tmp_path / "out"
    out.write_text("mine")
    with pytest.raises(InvalidParameterError, match="not a folder"), whole_folder(out):
        pass
    assert out.read_text() == "mine"


def test_missing_parent_is_refused(tmp_path: Path) -> None:
    out = tmp_path / "no" / "out"
    with pytest.raises(InvalidParameterError, match="cannot be written"), whole_folder(out):
        pass
    assert not list(tmp_path.iterdir())


@pytest.mark.skipif(
    not hasattr(os, "geteuid") or os.geteuid() == 0, reason="root may write anywhere"
)
def test_unwritable_parent_is_refused(tmp_path: Path) -> None:
    tmp_path.chmod(0o500)
    try:
        with (
            pytest.raises(InvalidParameterError, match="cannot be written"),
            whole_folder(tmp_path / "out"),
        ):
            pass
    finally:
        tmp_path.chmod(0o700)


def test_progress_prints_one_line_per_stage_without_a_terminal() -> None:
    stream = io.StringIO()
    progress = Display(2, stream)
    progress.stage("one")
    assert list(progress.track("two", [1, 2, 3], 3)) == [1, 2, 3]
    progress.close()
    assert stream.getvalue() == "[1/2] one\n[2/2] two\n"


def test_progress_shows_a_bar_and_the_time_left_on_a_terminal() -> None:
    stream = Terminal()
    progress = Display(1, stream)
    list(progress.track("work", range(2), 2))
    progress.close()
    assert "s left" in stream.getvalue()
    assert "\n" not in stream.getvalue()


def test_quiet_progress_writes_nothing() -> None:
    stream = Terminal()
    progress = Display(1, stream, quiet=True)
    list(progress.track("work", range(2), 2))
    assert stream.getvalue() == ""
