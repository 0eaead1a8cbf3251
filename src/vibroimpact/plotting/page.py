"""One self-contained HTML page: paragraphs, lists, tables, figures, sections.

Pictures are embedded and nothing is loaded from anywhere. All text is escaped.
"""

from __future__ import annotations

import base64
import re
from collections.abc import Sequence
from dataclasses import dataclass
from html import escape
from typing import Protocol

STYLE = """
:root { --ink: #1c1f23; --soft: #5b636d; --line: #dfe3e8; --wash: #f3f6f9; --strong: #0b5394; }
* { box-sizing: border-box; }
body { margin: 0; background: #fff; color: var(--ink);
  font: 17px/1.55 system-ui, -apple-system, "Segoe UI", Roboto, "Helvetica Neue", Arial, sans-serif; }
main { max-width: 56rem; margin: 0 auto; padding: 2.5rem 1.25rem 3rem; }
h1 { font-size: 1.9rem; line-height: 1.2; margin: 0 0 1rem; }
h2 { font-size: 1.3rem; line-height: 1.3; margin: 2.5rem 0 .6rem; padding-top: .7rem;
  border-top: 1px solid var(--line); }
p, li { max-width: 46rem; }
p { margin: .6rem 0; }
.brief { background: var(--wash); border-left: 4px solid var(--strong); padding: .5rem 1.2rem; }
.brief p:first-child { font-size: 1.15rem; font-weight: 600; }
figure { margin: 1.25rem 0; }
figure img { display: block; width: 100%; height: auto; }
figure.narrow img { max-width: 30rem; }
figcaption, caption { color: var(--soft); font-size: .9rem; line-height: 1.45; }
figcaption { margin-top: .4rem; max-width: 46rem; }
.wide { overflow-x: auto; margin: 1rem 0; }
table { border-collapse: collapse; font-size: .92rem; line-height: 1.4;
  font-variant-numeric: tabular-nums; }
caption { text-align: left; padding-bottom: .4rem; }
th, td { text-align: left; vertical-align: top; padding: .35rem 1.2rem .35rem 0;
  border-bottom: 1px solid var(--line); }
th { border-bottom: 2px solid var(--ink); vertical-align: bottom; }
pre { background: var(--wash); padding: .8rem 1rem; white-space: pre-wrap;
  overflow-wrap: anywhere; font-size: .85rem; }
footer { margin-top: 2.5rem; border-top: 1px solid var(--line); color: var(--soft);
  font-size: .85rem; }
@media print {
  body { font-size: 11pt; }
  main { max-width: none; padding: 0; }
  h2, caption { break-after: avoid; }
  figure, tr, pre, .brief { break-inside: avoid; }
  .wide { overflow: visible; }
}
"""


class Block(Protocol):
    """A part of a page."""

    def html(self) -> str:
        """The part as HTML."""


@dataclass(frozen=True, slots=True)
class Symbol:
    r"""A mathematical symbol in a cell, as figures write it: \omega_n."""

    text: str

    def html(self) -> str:
        """The symbol in italics, with its subscript."""
        named = re.sub(r"\\([A-Za-z]+)", r"&\1;", escape(self.text))
        lowered = re.sub(r"_\{?(\w+)\}?", r"<sub>\1</sub>", named)
        return f"<i>{lowered}</i>" if lowered else ""


Cell = str | Symbol


@dataclass(frozen=True, slots=True)
class Text:
    """Paragraphs; a brief stands out from the others."""

    paragraphs: Sequence[str]
    brief: bool = False

    def html(self) -> str:
        """The paragraphs."""
        inner = "".join(f"<p>{escape(one)}</p>\n" for one in self.paragraphs)
        return f'<div class="brief">\n{inner}</div>\n' if self.brief else inner


@dataclass(frozen=True, slots=True)
class Items:
    """A list of sentences."""

    sentences: Sequence[str]

    def html(self) -> str:
        """The list."""
        inner = "".join(f"<li>{escape(one)}</li>\n" for one in self.sentences)
        return f"<ul>\n{inner}</ul>\n"


@dataclass(frozen=True, slots=True)
class Code:
    """Text as it is typed."""

    text: str

    def html(self) -> str:
        """The text with its spaces."""
        return f"<pre><code>{escape(self.text)}</code></pre>\n"


@dataclass(frozen=True, slots=True)
class Table:
    """A table under a caption; it scrolls sideways where it is too wide."""

    head: Sequence[str]
    rows: Sequence[Sequence[Cell]]
    caption: str = ""

    def html(self) -> str:
        """The table."""
        caption = f"<caption>{escape(self.caption)}</caption>" if self.caption else ""
        head = "".join(f'<th scope="col">{escape(name)}</th>' for name in self.head)
        body = "\n".join(
            f"<tr>{''.join(f'<td>{_cell(cell)}</td>' for cell in row)}</tr>" for row in self.rows
        )
        return (
            f'<div class="wide"><table>{caption}<thead><tr>{head}</tr></thead>\n'
            f"<tbody>\n{body}\n</tbody></table></div>\n"
        )


@dataclass(frozen=True, slots=True)
class Picture:
    """An SVG picture with its caption, and a text for readers who cannot see it."""

    svg: bytes
    caption: str
    alternative: str
    narrow: bool = False

    def html(self) -> str:
        """The figure with the picture inside."""
        data = base64.b64encode(self.svg).decode("ascii")
        narrow = ' class="narrow"' if self.narrow else ""
        return (
            f'<figure{narrow}><img alt="{escape(self.alternative)}" '
            f'src="data:image/svg+xml;base64,{data}">'
            f"<figcaption>{escape(self.caption)}</figcaption></figure>\n"
        )


@dataclass(frozen=True, slots=True)
class Section:
    """Blocks under a heading."""

    title: str
    blocks: Sequence[Block]

    def html(self) -> str:
        """The section."""
        inner = "".join(block.html() for block in self.blocks)
        return f"<section><h2>{escape(self.title)}</h2>\n{inner}</section>\n"


def page_of(title: str, parts: Sequence[Block], footer: str) -> str:
    """HTML of a page from its title, its parts and a line at its foot."""
    body = "".join(part.html() for part in parts)
    return (
        '<!DOCTYPE html>\n<html lang="en"><head><meta charset="utf-8">\n'
        '<meta name="viewport" content="width=device-width, initial-scale=1">\n'
        f"<title>{escape(title)}</title>\n<style>{STYLE}</style></head>\n<body><main>\n"
        f"<h1>{escape(title)}</h1>\n{body}<footer><p>{escape(footer)}</p></footer>\n"
        "</main></body></html>\n"
    )


def _cell(cell: Cell) -> str:
    return escape(cell) if isinstance(cell, str) else cell.html()
