"""A publication whose statements are judged one by one, and the report on it.

A publication is one file of this folder. It holds a :class:`Publication`, and one function for each statement: the
rule that computes what the statement says and compares. Printed numbers stand in the decorator, as printed; what
decides, the witness, shares no code with the library: a closed form, bisection, an integration by SciPy.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import matplotlib as mpl
from matplotlib.axes import Axes

from vibroimpact import _kernel
from vibroimpact._core.progress import Display
from vibroimpact.plotting import style
from vibroimpact.plotting.page import Cell, Items, Page, Picture, Score, Section, Table, Text
from vibroimpact.plotting.style import content_of_picture
from vibroimpact_papers.folder import whole_folder
from vibroimpact_papers.judged import (
    Claim,
    Judgement,
    Printed,
    RuleResult,
    Summary,
    plain,
    score,
    to_json,
)

Rule = Callable[[Claim], RuleResult]
Draw = Callable[[], Axes]


@dataclass(frozen=True, slots=True)
class Statement:
    """A claim and its rule; a slow one takes more than a second."""

    claim: Claim
    rule: Rule
    slow: bool

    def judged(self) -> Judgement:
        """The claim with its verdict."""
        return Judgement(self.claim, self.rule(self.claim))


@dataclass(frozen=True, slots=True)
class Drawn:
    """A picture of the report: its name, and what stands below it."""

    name: str
    title: str
    caption: str
    draw: Draw


@dataclass(frozen=True)
class Publication:
    """A publication, its statements and the pictures of its report.

    Attributes
    ----------
    name
        Name on the command line.
    title
        What it is about, in a few words.
    reference
        Authors, title, journal, volume, year, pages, as far as they are known.
    seen
        What of it could be read.
    machine
        The machine of the catalogue, with what was chosen where the publication's numbers are not to be had.
    missing
        What is not to be had.
    """

    name: str
    title: str
    reference: str
    seen: str
    machine: str
    missing: Sequence[str] = ()
    statements: list[Statement] = field(default_factory=list)
    pictures: list[Drawn] = field(default_factory=list)

    def statement(
        self, section: str, quote: str, *, notes: str = "", slow: bool = False, **printed: Printed
    ) -> Callable[[Rule], Rule]:
        """Register a rule: where the statement stands, its words, its numbers by name."""

        def registered(rule: Rule) -> Rule:
            name = rule.__name__.replace("_", "-")
            claim = Claim(id=name, section=section, quote=quote, printed=printed, notes=notes)
            self.statements.append(Statement(claim, rule, slow))
            return rule

        return registered

    def picture(self, title: str, caption: str) -> Callable[[Draw], Draw]:
        """Register a function that draws a picture of the report."""

        def registered(draw: Draw) -> Draw:
            name = draw.__name__.replace("_", "-")
            self.pictures.append(Drawn(name, title, caption, draw))
            return draw

        return registered

    def reproduce(self, out: Path, *, progress: Display | None = None) -> Summary:
        """Judge every statement and write the report.

        Parameters
        ----------
        out
            Folder for the report: absent, empty, or an earlier report, which is replaced whole at the end. Its
            parent must exist.
        progress
            Progress display; on standard error if not given.

        Returns
        -------
        Summary
            The verdicts. On disk: ``report.html``, ``report.md``, ``verdicts.json``, ``figures/``.

        Raises
        ------
        InvalidParameterError
            ``out`` holds foreign files or cannot be written.
        """
        progress = progress or Display(2)
        try:
            with whole_folder(Path(out)) as work:
                rules = progress.track(self.name, self.statements, len(self.statements))
                judgements = tuple(one.judged() for one in rules)
                drawn = progress.track("figures", self.pictures, len(self.pictures))
                svg = {one.name: _written(one, work / "figures") for one in drawn}
                (work / "verdicts.json").write_text(self._json(judgements), encoding="utf-8")
                (work / "report.md").write_text(self._markdown(judgements), encoding="utf-8")
                page = self._page(judgements, svg).__html__()
                (work / "report.html").write_text(page, encoding="utf-8")
            return Summary(Path(out), judgements)
        finally:
            progress.close()

    def _json(self, judgements: tuple[Judgement, ...]) -> str:
        return to_json(
            judgements,
            package={"vibroimpact": _kernel.version()},
            publication={"name": self.name, "reference": self.reference, "seen": self.seen},
            missing=list(self.missing),
        )

    def _page(self, judgements: tuple[Judgement, ...], svg: Mapping[str, bytes]) -> Page:
        head = ("where", "printed", "computed", "verdict", "witness")
        rows: list[list[Cell]] = [
            [j.claim.section, _printed(j), j.result.computed, j.verdict.badge, j.result.witness]
            for j in judgements
        ]
        sections = [Section("Statements and verdicts", [Table(head, rows, stacked=True)])]
        if self.pictures:
            shown = [
                Picture(svg[one.name], one.caption, one.caption, one.title) for one in self.pictures
            ]
            sections.append(Section("Pictures", shown))
        if self.missing:
            sections.append(Section("Not to be had", [Items(self.missing)]))
        opening = [
            Text([self.reference, *self._about()]),
            Score({word.badge: count for word, count in score(judgements).items()}),
        ]
        foot = f"Written by vibroimpact {_kernel.version()}. Pictures in figures/, verdicts as text in verdicts.json."
        return Page(self.title, opening, sections, foot)

    def _about(self) -> Iterator[str]:
        """How it was judged."""
        yield f"Seen: {self.seen}"
        yield f"Machine: {self.machine}"
        yield (
            "A printed number agrees if it is right within half a unit of its last digit. Every verdict has a "
            "witness that shares no code with the library; nothing was fitted to the publication."
        )

    def _markdown(self, judgements: tuple[Judgement, ...]) -> str:
        lines = [f"# {self.title}", "", self.reference, ""]
        for paragraph in self._about():
            lines += [paragraph, ""]
        lines += ["| where | printed | computed | verdict | witness |", "|---|---|---|---|---|"]
        lines += [
            _row(j.claim.section, _printed(j), j.result.computed, j.verdict.value, j.result.witness)
            for j in judgements
        ]
        for one in self.pictures:
            lines += [
                "",
                f"![{one.caption}](figures/{one.name}.svg)",
                "",
                f"*{one.title}.* {one.caption}",
            ]
        if self.missing:
            lines += ["", "Not to be had:", "", *(f"- {one}" for one in self.missing)]
        return "\n".join(lines) + "\n"


def _row(*cells: str) -> str:
    return "| " + " | ".join(cell.replace("|", r"\|") for cell in cells) + " |"


def _printed(j: Judgement) -> str:
    """The words, the numbers, and how they are read."""
    numbers = (
        json.dumps(plain(dict(j.claim.printed)), ensure_ascii=False).strip("{}").replace('"', "")
    )
    parts = [f"\u201c{j.claim.quote}\u201d", numbers, j.claim.notes]
    return ". ".join(part for part in parts if part)


def _written(one: Drawn, folder: Path) -> bytes:
    """Draw a picture into SVG and PNG files; the SVG is returned."""
    folder.mkdir(exist_ok=True)
    with mpl.rc_context(style.RC):
        ax = one.draw()
        contents = {suffix: content_of_picture(ax, suffix) for suffix in (".svg", ".png")}
        import matplotlib.pyplot as plt

        plt.close(ax.get_figure(root=True))
    for suffix, content in contents.items():
        (folder / f"{one.name}{suffix}").write_bytes(content)
    return contents[".svg"]
