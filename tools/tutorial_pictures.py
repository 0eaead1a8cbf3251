"""Run the tutorials: their pictures go to docs/pictures, what they print goes below each block.

The blocks of a tutorial are marked `py` and run in order, in one namespace; the `text` block that
follows one holds what it prints.

    python tools/tutorial_pictures.py             # both
    python tools/tutorial_pictures.py describe-your-machine
"""

from __future__ import annotations

import contextlib
import io
import re
import shutil
import sys
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import NamedTuple

import matplotlib.pyplot as plt

DOCS = Path(__file__).parents[1] / "docs"
TUTORIALS = {
    "tutorial": "tutorial_",
    "normal-forms": "normal_",
    "two-parameters": "two_",
    "missing-elements": "missing_",
    "describe-your-machine": "machine_",
    "own-machine": "own_",
    "design": "design_",
    "transients": "transients_",
}  # names of pictures begin
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
        exec(compile(code, "tutorial", "exec"), namespace)  # noqa: S102 - our own text
    plt.close("all")
    return said.getvalue()


def refreshed(text: str, printed: list[str]) -> str:
    """The tutorial with what its blocks printed."""
    said = iter(printed)

    def block(found: re.Match[str]) -> str:
        output = next(said)
        return f"```py\n{found[1]}```\n" + (f"\n```text\n{output}```\n" if output else "")

    return BLOCK.sub(block, text)


def pictures_in(folder: Path) -> list[Path]:
    """The pictures among the files that the blocks wrote."""
    return [path for path in folder.iterdir() if path.suffix in (".svg", ".png")]


def document(name: str) -> Path:
    """The file of a tutorial."""
    return DOCS / f"{name}.md"


def main(names: list[str]) -> None:
    """Make the pictures of some tutorials, or of all, and refresh their texts."""
    for name in names or [*TUTORIALS]:
        text = document(name).read_text(encoding="utf-8")
        with TemporaryDirectory() as folder:
            new = refreshed(text, run(text, Path(folder)))
            for picture in pictures_in(Path(folder)):
                shutil.copy(picture, DOCS / "pictures")
        document(name).write_text(new, encoding="utf-8")


if __name__ == "__main__":
    main(sys.argv[1:])
