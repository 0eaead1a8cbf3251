"""Build one self-contained HTML page from sections, figures and tables.

Blocks are plain data; :meth:`Page.html` turns them into text. Pictures are embedded as data, the
style sheet is inlined, nothing is loaded from anywhere.
"""

from __future__ import annotations

import base64
from collections.abc import Sequence
from dataclasses import dataclass
from enum import Enum
from html import escape
from importlib.resources import files
from pathlib import Path

MEDIA = {".svg": "image/svg+xml", ".png": "image/png"}
INITIAL = "width=device-width, initial-scale=1"


class Word(Enum):
    """The three verdicts; the value is shown to the reader, the sign repeats it without colour."""

    AGREES = "agrees"
    DIFFERS = "differs"
    UNDECIDED = "cannot be decided"

    @property
    def sign(self) -> str:
        """Mark that can be distinguished in black and white."""
        return {"agrees": "\u2713", "differs": "\u2717", "cannot be decided": "?"}[self.value]


@dataclass(frozen=True, slots=True)
class Text:
    """Paragraphs of plain text, one per entry."""

    paragraphs: tuple[str, ...]

    def html(self) -> str:
        """Return the paragraphs."""
        return "".join(f"<p>{escape(p)}</p>\n" for p in self.paragraphs)


@dataclass(frozen=True, slots=True)
class Verdict:
    """A verdict as a table cell."""

    word: Word

    def html(self) -> str:
        """Return the badge: colour, sign and word."""
        name = self.word.name.lower()
        return f'<span class="verdict {name}">{self.word.sign} {self.word.value}</span>'


Cell = str | Verdict


@dataclass(frozen=True, slots=True)
class Table:
    """Table; with ``stacked``, every row becomes a card on a narrow screen."""

    head: tuple[str, ...]
    rows: Sequence[Sequence[Cell]]
    caption: str = ""
    stacked: bool = False

    def html(self) -> str:
        """Return the table in a box that scrolls sideways."""
        head = "".join(f'<th scope="col">{escape(name)}</th>' for name in self.head)
        body = "\n".join(self._row(row) for row in self.rows)
        caption = f"<caption>{escape(self.caption)}</caption>" if self.caption else ""
        kind = ' class="stacked"' if self.stacked else ""
        return (
            f'<div class="wide" tabindex="0"><table{kind}>{caption}<thead><tr>{head}</tr></thead>\n'
            f"<tbody>\n{body}\n</tbody></table></div>\n"
        )

    def _row(self, row: Sequence[Cell]) -> str:
        cells = (
            f'<td data-label="{escape(name)}"><span>{_cell(cell)}</span></td>'
            for name, cell in zip(self.head, row, strict=True)
        )
        return f"<tr>{''.join(cells)}</tr>"


@dataclass(frozen=True, slots=True)
class Figure:
    """An embedded picture with its caption and a text for readers who cannot see it."""

    path: Path
    title: str
    caption: str
    alternative: str
    narrow: bool = False

    def html(self) -> str:
        """Return the figure with the picture inlined as data."""
        narrow = ' class="narrow"' if self.narrow else ""
        data = base64.b64encode(self.path.read_bytes()).decode("ascii")
        return (
            f'<figure id="{escape(self.path.stem)}"{narrow}>'
            f'<img alt="{escape(self.alternative)}" '
            f'src="data:{MEDIA[self.path.suffix]};base64,{data}">'
            f"<figcaption><b>{escape(self.title)}.</b> {escape(self.caption)}</figcaption>"
            "</figure>\n"
        )


Block = Text | Table | Figure


@dataclass(frozen=True, slots=True)
class Section:
    """A numbered section of the page."""

    key: str
    title: str
    blocks: Sequence[Block]

    def html(self, number: int) -> str:
        """Return the section under its heading."""
        inner = "".join(block.html() for block in self.blocks)
        return (
            f'<section id="{escape(self.key)}"><h2>{number}. {escape(self.title)}</h2>\n'
            f"{inner}</section>\n"
        )


@dataclass(frozen=True, slots=True)
class Page:
    """A page: title, opening paragraphs, a score, sections, and a footer."""

    title: str
    opening: Text
    score: dict[Word, int]
    sections: Sequence[Section]
    footer: str

    def html(self) -> str:
        """Return the whole page."""
        style = files(__package__).joinpath("style.css").read_text(encoding="utf-8")
        contents = "".join(
            f'<li><a href="#{escape(s.key)}">{escape(s.title)}</a></li>' for s in self.sections
        )
        body = "".join(s.html(i) for i, s in enumerate(self.sections, 1))
        return (
            '<!doctype html>\n<html lang="en"><head><meta charset="utf-8">\n'
            f'<meta name="viewport" content="{INITIAL}">\n'
            f"<title>{escape(self.title)}</title>\n<style>\n{style}</style></head>\n<body><main>\n"
            f"<header><h1>{escape(self.title)}</h1>\n{self.opening.html()}{self._score()}</header>\n"
            f'<nav aria-label="Contents"><h2>Contents</h2><ol>{contents}</ol></nav>\n{body}'
            f"<footer><p>{escape(self.footer)}</p></footer>\n</main></body></html>\n"
        )

    def _score(self) -> str:
        items = (
            f'<li class="{word.name.lower()}"><b>{count}</b> {word.sign} {word.value}</li>'
            for word, count in self.score.items()
        )
        return f'<ul class="score">{"".join(items)}</ul>\n'


def _cell(cell: Cell) -> str:
    return cell.html() if isinstance(cell, Verdict) else escape(cell)
