"""The notebooks of examples/: their cells, run one after the other in this process, and what each shows.

python tools/notebooks.py examples/student_breaks_a_torus.ipynb    # run it, say how long each cell takes
"""

from __future__ import annotations

import ast
import base64
import contextlib
import io
import json
import sys
import time
from collections.abc import Iterator
from html import escape
from pathlib import Path
from typing import Any, NamedTuple

from matplotlib.axes import Axes

from vibroimpact.plotting.report import picture_of


class Cell(NamedTuple):
    """A cell: Markdown or code, and the HTML that running it shows."""

    is_code: bool
    source: str
    shown: str = ""


def cells(path: Path) -> list[Cell]:
    """Cells of a notebook."""
    whole = json.loads(path.read_text(encoding="utf-8"))
    return [Cell(one["cell_type"] == "code", "".join(one["source"])) for one in whole["cells"]]


def run(path: Path) -> Iterator[Cell]:
    """Run the code of a notebook from top to bottom, and give each cell when it is done."""
    namespace: dict[str, Any] = {}
    for cell in cells(path):
        yield cell._replace(shown=_run(cell.source, path.name, namespace)) if cell.is_code else cell


def _run(source: str, name: str, namespace: dict[str, Any]) -> str:
    """Run a cell as Jupyter does: what is printed, then the value of its last line."""
    tree, last = ast.parse(source), None
    if isinstance(tree.body[-1], ast.Expr):
        last = ast.Expression(tree.body.pop().value)  # type: ignore[attr-defined]
    printed = io.StringIO()
    with contextlib.redirect_stdout(printed):
        exec(compile(tree, name, "exec"), namespace)  # noqa: S102 - our own text
        value = eval(compile(last, name, "eval"), namespace) if last else None  # noqa: S307
    text = printed.getvalue()
    return (f"<pre>{escape(text)}</pre>" if text else "") + ("" if value is None else shown(value))


def shown(value: Any) -> str:
    """What a notebook shows of a value, as HTML."""
    if isinstance(value, Axes):
        content = base64.b64encode(picture_of(value, ".png")).decode("ascii")
        return f'<img alt="picture" src="data:image/png;base64,{content}">'
    if hasattr(value, "_repr_html_"):
        return str(value._repr_html_())
    return f"<pre>{escape(repr(value))}</pre>"


def main(paths: list[str]) -> None:
    """Run notebooks, and write what they show beside them."""
    for path in map(Path, paths):
        parts, begin = [], time.process_time()
        for cell in run(path):
            first = cell.source.partition("\n")[0]
            print(f"{time.process_time() - begin:6.2f} s  {first}", flush=True)
            parts.append(cell.shown or f"<pre>{escape(cell.source)}</pre>")
        if "--out" in sys.argv:
            path.with_suffix(".html").write_text("\n<hr>\n".join(parts), encoding="utf-8")


if __name__ == "__main__":
    main([one for one in sys.argv[1:] if not one.startswith("--")])
