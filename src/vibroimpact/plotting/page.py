"""One self-contained HTML page: paragraphs, lists, tables, figures, sections.

A block is a record of what it shows; ``page.html`` beside this file writes it, by the macro with the
name of its class, and escapes all text. Pictures are embedded, and nothing is loaded from anywhere.
"""

from __future__ import annotations

import base64
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from html import escape
from types import ModuleType
from typing import cast


class Block:
    """A part of a page. Templates insert what ``__html__`` returns as it is."""

    __slots__ = ()

    def __html__(self) -> str:
        """The part as HTML."""
        return str(getattr(_macros(), type(self).__name__.lower())(self))


Cell = str | Block


@dataclass(frozen=True, slots=True)
class Symbol(Block):
    r"""A mathematical symbol in a cell, as figures write it: \omega_n."""

    text: str

    def __html__(self) -> str:
        named = re.sub(r"\\([A-Za-z]+)", r"&\1;", escape(self.text))
        lowered = re.sub(r"_\{?(\w+)\}?", r"<sub>\1</sub>", named)
        return f"<i>{lowered}</i>" if lowered else ""


@dataclass(frozen=True, slots=True)
class Badge(Block):
    """A verdict: text with a sign, in the colour of ``kind``: agrees, differs, undecided."""

    text: str
    kind: str


@dataclass(frozen=True, slots=True)
class Score(Block):
    """The number of verdicts of each sort."""

    counts: Mapping[Badge, int]


@dataclass(frozen=True, slots=True)
class Text(Block):
    """Paragraphs; a brief stands out from the others."""

    paragraphs: Sequence[str]
    brief: bool = False


@dataclass(frozen=True, slots=True)
class Items(Block):
    """A list of sentences."""

    sentences: Sequence[str]


@dataclass(frozen=True, slots=True)
class Code(Block):
    """Text as it is typed."""

    text: str


@dataclass(frozen=True, slots=True)
class Table(Block):
    """A table under a caption, which scrolls sideways where it is too wide.

    With ``stacked``, every row becomes a card on a narrow screen.
    """

    head: Sequence[str]
    rows: Sequence[Sequence[Cell]]
    caption: str = ""
    stacked: bool = False


@dataclass(frozen=True, slots=True)
class Picture(Block):
    """An SVG picture with its caption, and a text for readers who cannot see it."""

    svg: bytes
    caption: str
    alternative: str
    title: str = ""
    key: str = ""
    narrow: bool = False

    @property
    def source(self) -> str:
        """The picture as an address that holds it."""
        return f"data:image/svg+xml;base64,{base64.b64encode(self.svg).decode('ascii')}"


@dataclass(frozen=True, slots=True)
class Section(Block):
    """Blocks under a heading; ``key`` is the name by which links find it."""

    title: str
    blocks: Sequence[Block]
    key: str = ""


@dataclass(frozen=True, slots=True)
class Page(Block):
    """A whole page: title, opening, sections, a line at its foot.

    With ``contents``, sections are numbered and listed after the opening; each has a ``key`` then.
    """

    title: str
    opening: Sequence[Block]
    sections: Sequence[Section]
    footer: str
    contents: bool = False


@cache
def _macros() -> ModuleType:
    from jinja2 import Environment, PackageLoader, StrictUndefined  # once a page is written

    environment = Environment(
        loader=PackageLoader("vibroimpact", "plotting"),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    return cast(ModuleType, environment.get_template("page.html").module)
