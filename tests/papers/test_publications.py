"""Publications: every statement has the verdict that is known, and the report holds all of it."""

from __future__ import annotations

import json
import tomllib
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING

import pytest
from vibroimpact_papers.judged import Claim, Word
from vibroimpact_papers.publication import Publication

if TYPE_CHECKING:
    from collections.abc import Iterator

ROOT = Path(__file__).parents[2]
UNDECIDED = {
    ("capsule", "by-the-attractor"),
    ("dry-friction", "ordinarily-met"),
    ("mole", "coexisting-attractors"),
}  # no numbers are printed
LONGEST_QUOTE = 15  # words


def publications() -> Iterator[Publication]:
    """All but the founding paper, which has its own tests."""
    text = (ROOT / "papers" / "pyproject.toml").read_text(encoding="utf-8")
    points = tomllib.loads(text)["project"]["entry-points"]["vibroimpact.papers"]
    for name, place in points.items():
        module, _, attribute = place.partition(":")
        if attribute:
            found = getattr(import_module(module), attribute)
            assert isinstance(found, Publication)
            assert found.name == name
            yield found


PAPERS = {paper.name: paper for paper in publications()}
STATEMENTS = [
    pytest.param(
        paper, one, id=f"{paper.name}-{one.claim.id}", marks=[pytest.mark.slow] if one.slow else []
    )
    for paper in PAPERS.values()
    for one in paper.statements
]


@pytest.mark.parametrize(("paper", "statement"), STATEMENTS)
def test_a_statement_has_its_verdict(paper: Publication, statement) -> None:  # type: ignore[no-untyped-def]
    judged = statement.judged()
    known = Word.UNDECIDED if (paper.name, statement.claim.id) in UNDECIDED else Word.AGREES
    assert judged.verdict is known, judged.result.computed
    assert judged.result.computed
    assert judged.result.witness


def test_there_are_six_publications_and_more_and_most_statements_are_quick() -> None:
    assert len(PAPERS) >= 6
    slow = [one.slow for paper in PAPERS.values() for one in paper.statements]
    assert sum(slow) <= len(slow) / 5


@pytest.mark.parametrize("paper", PAPERS.values(), ids=PAPERS)
def test_a_publication_says_what_was_seen_and_what_is_missing(paper: Publication) -> None:
    assert paper.reference
    assert paper.seen
    assert paper.pictures
    names = [one.claim.id for one in paper.statements]
    assert len(set(names)) == len(names)
    assert all(len(one.claim.quote.split()) <= LONGEST_QUOTE for one in paper.statements)


def test_the_report_holds_statements_verdicts_and_pictures(tmp_path: Path) -> None:
    paper = PAPERS["dry-friction"]
    small = Publication(
        paper.name, paper.title, paper.reference, paper.seen, paper.machine, paper.missing,
        paper.statements[:2],
    )  # fmt: skip

    @small.picture("A picture", "A caption.")
    def a_picture():  # type: ignore[no-untyped-def]
        from vibroimpact.plotting import plot_mechanism

        return plot_mechanism(import_module("vibroimpact_papers.dry_friction").oscillator(0.2))

    out = tmp_path / "report"
    summary = small.reproduce(out)
    assert summary.score[Word.AGREES] == 2
    data = json.loads((out / "verdicts.json").read_text())
    assert [one["verdict"] for one in data["verdicts"]] == ["agrees", "agrees"]
    assert data["publication"]["seen"] == paper.seen
    markdown, html = ((out / name).read_text() for name in ("report.md", "report.html"))
    for one in small.statements:
        assert one.claim.quote in markdown
        assert one.claim.quote in html
    assert "figures/a-picture.svg" in markdown
    assert "A caption." in html
    assert {path.name for path in (out / "figures").iterdir()} == {"a-picture.svg", "a-picture.png"}


def test_a_wrong_number_is_said_to_differ() -> None:
    module = import_module("vibroimpact_papers.continuation_recipes")
    first = module.PAPER.statements[0]
    claim = Claim(id="x", section="", quote="", printed={"velocity": -1.37, "phase": 0.076})
    assert first.rule(first.claim).word is Word.AGREES
    assert first.rule(claim).word is Word.DIFFERS


def test_the_document_counts_statements_and_verdicts() -> None:
    text = (ROOT / "docs" / "reproduction.md").read_text(encoding="utf-8")
    for name, paper in PAPERS.items():
        row = next(line for line in text.splitlines() if line.startswith(f"| `{name}` |"))
        counts = [int(cell or 0) for cell in (cell.strip() for cell in row.split("|")[4:7])]
        open_ = sum(key[0] == name for key in UNDECIDED)
        assert counts == [len(paper.statements), len(paper.statements) - open_, open_]
