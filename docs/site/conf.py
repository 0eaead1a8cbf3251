"""Settings of Sphinx for the site; tools/site.py assembles the pages and runs it."""

from __future__ import annotations

import re
import sys
from pathlib import Path
from typing import Any

import vibroimpact as vi

sys.path.insert(0, str(Path(__file__).parent))

project = "vibroimpact"
author = "the authors of vibroimpact"
version = release = vi.__version__
language = "en"

extensions = [
    "myst_parser",  # pages are Markdown, readable without the site
    "sphinx.ext.autodoc",
    "numpydoc",  # docstrings follow it
    "sphinx.ext.viewcode",
    "sphinx_design",  # cards of the front page
    "sphinx_copybutton",
    "sphinxcontrib.bibtex",
    "mathml",
]
myst_enable_extensions = ["colon_fence", "dollarmath", "amsmath"]
myst_dmath_double_inline = True
myst_heading_anchors = 4

autodoc_member_order = "bysource"
autodoc_typehints = "none"  # the docstrings say shapes, units and ranges
numpydoc_show_class_members = False
numpydoc_xref_param_type = False
bibtex_bibfiles = ["references.bib"]
bibtex_default_style = "unsrt"

html_theme = "pydata_sphinx_theme"
html_title = "vibroimpact"
html_static_path = ["_static"]
html_css_files = ["site.css"]
html_js_files = [("explorer.js", {"defer": "defer"})]
html_math_renderer = "mathml"
html_show_sourcelink = False
html_copy_source = False
html_theme_options = {
    "navbar_align": "left",
    "header_links_before_dropdown": 6,
    "navbar_end": ["theme-switcher"],
    "navbar_persistent": ["search-button"],
    "show_toc_level": 2,
    "footer_start": ["copyright"],
    "footer_end": [],
    "show_prev_next": True,
    "secondary_sidebar_items": ["page-toc"],
    "pygments_light_style": "a11y-high-contrast-light",
    "pygments_dark_style": "a11y-high-contrast-dark",
}
html_sidebars = {"index": []}
copyright = "the authors of vibroimpact, MIT licence"  # noqa: A001 - the name that Sphinx reads

LITERAL = re.compile(
    r"(``.*?``|:\w+:`[^`]*`|`[^`]*`|^\s*(?:>>>|\.\.\.) .*$)", re.MULTILINE | re.DOTALL
)


def plain(_app: Any, _what: str, _name: str, _thing: Any, _options: Any, lines: list[str]) -> None:
    """Docstrings are plain text: |x| is a modulus and c_ a name, no markup."""
    parts = LITERAL.split("\n".join(lines))
    parts[::2] = [re.sub(r"[|*]|(?<=\w)_(?!\w)", r"\\\g<0>", part) for part in parts[::2]]
    lines[:] = "".join(parts).split("\n")


def setup(app: Any) -> None:
    """Register what is done with docstrings, before numpydoc reads them."""
    app.connect("autodoc-process-docstring", plain, priority=100)
