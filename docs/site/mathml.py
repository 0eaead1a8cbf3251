r"""Equations as MathML: rendered when the site is built, so that a page needs no script and no network.

``\tag{T4}`` becomes a number beside the equation, with the anchor ``eq-T4``; without a tag there is no number.
"""

from __future__ import annotations

import re
from html import escape
from typing import TYPE_CHECKING, Any

from docutils import nodes
from math_core import LatexError, LatexToMathML
from sphinx.errors import ExtensionError

if TYPE_CHECKING:
    from sphinx.application import Sphinx

TAG = re.compile(r"\\tag\{([^}]*)\}")
PLAIN = re.compile(r"\x1b\[[0-9;]*m")


def mathml(latex: str, *, block: bool) -> str:
    """MathML Core of an equation; one that is no LaTeX ends the build with what is wrong in it."""
    try:
        return LatexToMathML().convert_with_local_state(
            latex.replace("\n", " "), displaystyle=block
        )
    except LatexError as error:
        raise ExtensionError(f"{latex}\n{PLAIN.sub('', str(error))}") from None


def visit_inline(self: Any, node: nodes.math) -> None:
    """An equation in a line of text."""
    self.body.append(mathml(node.astext(), block=False))
    raise nodes.SkipNode


def visit_block(self: Any, node: nodes.math_block) -> None:
    """An equation of its own, with its number."""
    text = node.astext()
    tag = TAG.search(text)
    equation = mathml(TAG.sub("", text), block=True)
    name = escape(tag[1]) if tag else ""
    number = f'<a class="eqno" href="#eq-{name}">({name})</a>' if tag else ""
    place = f' id="eq-{name}"' if tag else ""
    self.body.append(f'<div class="equation"{place}>{equation}{number}</div>\n')
    raise nodes.SkipNode


def setup(app: Sphinx) -> dict[str, bool]:
    """Register the renderer."""
    app.add_html_math_renderer("mathml", (visit_inline, None), (visit_block, None))
    return {"parallel_read_safe": True, "parallel_write_safe": True}
