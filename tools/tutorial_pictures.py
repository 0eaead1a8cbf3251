"""Run docs/tutorial.md: its pictures go to docs/pictures, what it prints goes below each block.

The blocks of the tutorial are marked `py` and run in order, in one namespace; the `text` block that
follows one holds what it prints.
"""

from __future__ import annotations

import contextlib
import io
import re
from pathlib import Path
from typing import NamedTuple

import matplotlib.pyplot as plt

DOCS = Path(__file__).parents[1] / "docs"
TUTORIAL = DOCS / "tutorial.md"
BLOCK = re.compile(r"^```py\n(.*?)^```\n(?:\n```text\n(.*?)^```\n)?", re.MULTILINE | re.DOTALL)


class Block(NamedTuple):
    """Code, and what the document says that it prints."""

    code: str
    printed: str


def blocks(text: str) -> list[Block]:
    """The blocks of a tutorial in order."""
    return [Block(code, printed or "") for code, printed in BLOCK.findall(text)]


def run(text: str, folder: Path) -> list[str]:
    """Run all blocks in a folder; what each prints."""
    namespace: dict[str, object] = {}
    plt.switch_backend("Agg")
    with contextlib.chdir(folder):
        return [_printed(block.code, namespace) for block in blocks(text)]


def _printed(code: str, namespace: dict[str, object]) -> str:
    said = io.StringIO()
    with contextlib.redirect_stdout(said):
        exec(compile(code, TUTORIAL.name, "exec"), namespace)  # noqa: S102 - our own text
    plt.close("all")
    return said.getvalue()


def refreshed(text: str, printed: list[str]) -> str:
    """The tutorial with what its blocks printed."""
    said = iter(printed)

    def block(found: re.Match[str]) -> str:
        output = next(said)
        return f"```py\n{found[1]}```\n" + (f"\n```text\n{output}```\n" if output else "")

    return BLOCK.sub(block, text)


def main() -> None:
    """Make the pictures and refresh the text."""
    text = TUTORIAL.read_text(encoding="utf-8")
    TUTORIAL.write_text(refreshed(text, run(text, DOCS / "pictures")), encoding="utf-8")


if __name__ == "__main__":
    main()
