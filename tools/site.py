"""Build the documentation site: assemble its pages, then run Sphinx on them.

    python tools/site.py            # into site/, examples and machines run and drawn: some three minutes
    python tools/site.py --quick    # examples with the small pictures of docs/pictures, machines drawn at rest

The pages of docs/ are Markdown that can be read without the site. Here they are copied beside the front page and the
tables of contents of docs/site/, with what only a site has:

- links that leave docs/ go to the page of the site that shows the same file;
- "[nordmark2009]" becomes a citation, "(T12)" outside of an equation a link to it;
- "<!-- explorer: LINK -->" becomes the explorer at this state, where `make explorer` has built it;
- an example is a page with its picture, its text and its program;
- a public name is a page with its docstring, listed where docs/reference.md lists it.

Warnings of Sphinx (a link to nowhere, a picture that is not there, a docstring that cannot be read) are errors.
"""

from __future__ import annotations

import argparse
import ast
import html
import os
import re
import shutil
import subprocess
import sys
from collections.abc import Callable, Iterable, Iterator, Sequence
from importlib.resources import files
from importlib.util import find_spec
from operator import attrgetter
from pathlib import Path
from typing import Any, NamedTuple
from urllib.parse import parse_qsl

import matplotlib.pyplot as plt
from notebooks import cells

import vibroimpact as vi
from vibroimpact import plotting
from vibroimpact._core.docstrings import head_of
from vibroimpact._core.errors import VibroImpactError
from vibroimpact.explorer.link import read_link
from vibroimpact.explorer.page import PAGE, page_with
from vibroimpact.explorer.page_data import catalogue, machine_data
from vibroimpact.machines.machine import example_of
from vibroimpact.machines.registry import MACHINES, machine_of
from vibroimpact.plotting import plot_mechanism, save
from vibroimpact.plotting.gallery import commands_of, equations_of, plot_known_for

ROOT = Path(__file__).resolve().parents[1]
DOCS = ROOT / "docs"
PAGES = ROOT / "build" / "site"  # the assembled pages
EXAMPLES = ROOT / "examples"
LONGEST = 120.0  # seconds of an example
FIRST = "impact-damper"  # of the explorer

# Documents that are pages of the site, by the name of the page; the contents of index.md are in docs/site/.
DOCUMENTS = {file.stem: file for file in DOCS.glob("*.md") if file.name != "index.md"} | {
    "contributing": ROOT / "CONTRIBUTING.md",
    "changelog": ROOT / "CHANGELOG.md",
    "security": ROOT / "SECURITY.md",
    "benchmarks": ROOT / "benchmarks" / "README.md",
}
PAGE_OF = {file: f"{name}.md" for name, file in DOCUMENTS.items()} | {
    ROOT / "README.md": "index.md",
    DOCS / "index.md": "index.md",
    DOCS / "references.bib": "bibliography.md",
}
# A font for equations, with the package that ships it under the Open Font License.
MATHEMATICS = files("ziamath") / "fonts" / "STIXTwoMath-Regular.ttf"
LINK = re.compile(r"\[((?:[^\[\]]|\[[^\[\]]*\])*)\]\(([^)#\s:]+)(#[^)\s]*)?\)")
EQUATION = re.compile(r"(?<![\[\w`$])\((T\d+[a-z]?)\)(?!\])")
KEYS = re.findall(r"^@\w+\{(\w+),", (DOCS / "references.bib").read_text("utf-8"), re.MULTILINE)
CITED = re.compile(rf"\[({'|'.join(KEYS)})\](?!\()")
EQUATIONS = set(re.findall(r"\\tag\{(\w+)\}", (DOCS / "theory.md").read_text("utf-8")))
# A script that is no module, which a page from a folder could not load.
SHOW = """for (const one of document.querySelectorAll("div.explorer"))
  mount(one, new URL(one.dataset.page, location.href), { height: "46rem" });
"""
EXPLORER = re.compile(r"^<!-- explorer: (\S+) -->$", re.MULTILINE)
FENCED = re.compile(r"(^```.*?^```)", re.MULTILINE | re.DOTALL)
CODE = re.compile(r"(^```.*?^```|`[^`\n]+`|\$\$.*?\$\$|\$[^$\n]+\$)", re.MULTILINE | re.DOTALL)


class Example(NamedTuple):
    """An example: its name, what docs/index.md says of it, and its docstring."""

    name: str
    phrase: str
    text: str

    @property
    def title(self) -> str:
        """The name as words."""
        return self.name.replace("_", " ").capitalize().replace(" si ", " SI ")


class Card(NamedTuple):
    """A card of a gallery: the page it leads to, and what it shows."""

    page: str
    title: str
    picture: str
    phrase: str


def main() -> int:
    """Assemble the pages and build the site."""
    parser = argparse.ArgumentParser(description="Build the documentation site.")
    parser.add_argument("--out", type=Path, default=ROOT / "site", help="folder of the site")
    parser.add_argument("--quick", action="store_true", help="run no example and no machine")
    arguments = parser.parse_args()
    assemble(PAGES, quick=arguments.quick)
    command = [sys.executable, "-m", "sphinx", "-W", "--keep-going", "-q", "-b", "html"]
    return subprocess.run([*command, PAGES, arguments.out], check=False).returncode


def assemble(folder: Path, *, quick: bool) -> None:
    """Write every page of the site, as Sphinx reads it."""
    shutil.rmtree(folder, ignore_errors=True)
    shutil.copytree(DOCS / "site", folder, ignore=shutil.ignore_patterns("__pycache__", "site.css"))
    (folder / "_static").mkdir()
    shutil.copy(DOCS / "site" / "site.css", folder / "_static")
    shutil.copy(MATHEMATICS, folder / "_static")
    shutil.copytree(DOCS / "pictures", folder / "pictures")
    shutil.copy(DOCS / "references.bib", folder)
    for name, source in DOCUMENTS.items():
        write(folder / f"{name}.md", page(source))
    front = folder / "index.md"
    write(front, with_explorers(front.read_text(encoding="utf-8")).rstrip())
    write_explorer(folder, quick=quick)
    write_examples(folder, quick=quick)
    write_machines(folder, quick=quick)
    write_reference(folder)


# ---- pages of Markdown -------------------------------------------------------------------------


def page(source: Path) -> str:
    """The text of a document, as a page of the site."""
    text = with_explorers(source.read_text(encoding="utf-8"))
    text = outside(FENCED, text, lambda part: LINK.sub(lambda match: link(source, match), part))
    text = outside(CODE, text, lambda part: CITED.sub(r"{cite:p}`\1`", part))
    return outside(
        CODE, text, lambda part: EQUATION.sub(lambda match: equation(source, match), part)
    )


def equation(source: Path, match: re.Match[str]) -> str:
    """A link to an equation of theory.md."""
    if match[1] not in EQUATIONS:
        raise SystemExit(f"{source.relative_to(ROOT)}: theory.md has no equation ({match[1]})")
    return f'<a class="eqref" href="theory.html#eq-{match[1]}">({match[1]})</a>'


def outside(what: re.Pattern[str], text: str, change: Callable[[str], str]) -> str:
    """A text with a change made outside of what a pattern with one group matches."""
    parts = what.split(text)
    parts[::2] = map(change, parts[::2])
    return "".join(parts)


def link(source: Path, match: re.Match[str]) -> str:
    """A link of a document as the site has it; a file that is no page keeps its name alone."""
    words, target, place = match[1], match[2], match[3] or ""
    file = (source.parent / target).resolve()
    if file in PAGE_OF:
        return f"[{words}]({PAGE_OF[file]}{place})"
    if file.parent == EXAMPLES:
        return f"[{words}](examples/{file.stem}.md)"  # a program, or a notebook
    if file.is_relative_to(DOCS):  # a picture
        return f"[{words}]({file.relative_to(DOCS).as_posix()})"
    name = file.relative_to(ROOT).as_posix()
    return f"{words} (`{name}`)" if name not in words else words


# ---- the explorer ------------------------------------------------------------------------------


def with_explorers(text: str) -> str:
    """The text of a document in which links to the explorer are frames that show it."""
    return EXPLORER.sub(frame if PAGE.exists() else "", text)


def frame(match: re.Match[str]) -> str:
    """The explorer at the state of a link, which has to be one that it knows."""
    link = "&".join(word for word in match[1].split("&") if not word.startswith("show="))
    machine = dict(parse_qsl(link, strict_parsing=True)).get("machine", "")
    if machine not in MACHINES:
        raise SystemExit(f"The explorer has no such machine: {match[1]}")
    example = example_of(machine_of(machine))
    try:
        read_link(link, example, example.free_start())
    except VibroImpactError as error:
        raise SystemExit(f"The explorer does not take {match[1]}: {error}") from None
    address = html.escape(f"_static/explorer.html#{match[1]}")
    whole = html.escape(f"_static/explorer.html#{link}")
    return (
        f'<div class="explorer" data-page="{address}"></div>\n'
        f'<p class="explorer"><a href="{whole}">The same machine and start, with every panel</a></p>'
    )


def write_explorer(folder: Path, *, quick: bool) -> None:
    """What shows the explorer, and its page: with all machines, with the damper alone where it is to be quick."""
    embed = (
        PAGE.with_name("embed.js")
        .read_text(encoding="utf-8")
        .replace("export function", "function")
    )
    (folder / "_static" / "explorer.js").write_text(f"{{\n{embed}{SHOW}}}\n", encoding="utf-8")
    if not PAGE.exists():
        return
    machines = {name: one for name, one in catalogue().items() if name == FIRST or not quick}
    data = {name: machine_data(one) for name, one in machines.items()}
    (folder / "_static" / "explorer.html").write_text(page_with(data, FIRST), encoding="utf-8")


# ---- examples ----------------------------------------------------------------------------------


def examples() -> Iterator[Example]:
    """The examples in the order of docs/index.md."""
    listed = r"\]\(\.\./examples/(\w+)\.py\)<br>(.*) \|"
    for name, phrase in re.findall(listed, (DOCS / "index.md").read_text(encoding="utf-8")):
        tree = ast.parse((EXAMPLES / f"{name}.py").read_text(encoding="utf-8"))
        yield Example(name, phrase, ast.get_docstring(tree) or "")


def write_examples(folder: Path, *, quick: bool) -> None:
    """A page for each example, and the gallery."""
    into = folder / "examples"
    into.mkdir()
    found = list(examples())
    for example in found:
        shutil.copy(EXAMPLES / f"{example.name}.py", into)
        picture = f"../pictures/example_{example.name}.png" if quick else drawn(example.name, into)
        write(
            into / f"{example.name}.md",
            f"# {example.title}",
            example.text,
            f"![{example.phrase}]({picture})",
            f"```{{literalinclude}} {example.name}.py\n:language: python\n```",
            f"{{download}}`{example.name}.py <{example.name}.py>`",
        )
    for notebook in sorted(EXAMPLES.glob("*.ipynb")):
        shutil.copy(notebook, into)
        write(into / f"{notebook.stem}.md", *notebook_page(notebook))
    write_gallery(
        into,
        "# Examples",
        "Complete programs of 20 to 60 lines: `python examples/NAME.py --out FILE` writes the picture.",
        [Card(e.name, e.title, f"../pictures/example_{e.name}.png", e.phrase) for e in found],
    )


def notebook_page(notebook: Path) -> Iterator[str]:
    """Paragraphs of the page of a notebook: its text and its code, as it is kept."""
    yield "---\norphan: true\n---"  # docs/notebooks.md leads to it
    for cell in cells(notebook):
        yield f"```python\n{cell.source}\n```" if cell.is_code else cell.source
    yield f"{{download}}`{notebook.name} <{notebook.name}>`"


def write_gallery(into: Path, title: str, text: str, cards: Sequence[Card]) -> None:
    """A page of cards, each of which leads to a page beside it."""
    shown = (
        f":::{{grid-item-card}} {card.title}\n:img-top: {card.picture}\n"
        f":link: {card.page}\n:link-type: doc\n\n{card.phrase}\n:::\n"
        for card in cards
    )
    grid = "::::{grid} 1 2 3 3\n:gutter: 3\n\n" + "\n".join(shown) + "::::"
    write(into / "index.md", title, text, grid, contents(card.page for card in cards))


def write(file: Path, *parts: str) -> None:
    """Write a page of these paragraphs."""
    file.write_text("\n\n".join(parts) + "\n", encoding="utf-8")


def contents(pages: Iterable[str], options: str = ":hidden:") -> str:
    """A table of contents of these pages."""
    return f"```{{toctree}}\n{options}\n\n" + "\n".join(pages) + "\n```"


def drawn(name: str, into: Path) -> str:
    """Run an example; the name of the picture that it writes."""
    picture = into / f"{name}.png"
    command = [sys.executable, EXAMPLES / f"{name}.py", "--out", picture]
    environment = os.environ | {"MPLBACKEND": "Agg"}
    subprocess.run(command, check=True, capture_output=True, timeout=LONGEST, env=environment)
    return picture.name


# ---- machines ----------------------------------------------------------------------------------


def write_machines(folder: Path, *, quick: bool) -> None:
    """A page for each machine of the catalogue, and their gallery."""
    into = folder / "catalogue"
    into.mkdir()
    for name in MACHINES:
        machine = machine_of(name)
        known = machine.known_for
        # some have a page in the reference, which is the one to be listed
        listed = "   :no-index:\n" * (machine.__name__ in vi.__all__)
        drawing = plot_mechanism(example_of(machine))
        save(drawing, into / f"{name}.svg")
        save(drawing if quick else plot_known_for(machine), into / f"{name}-known-for.png")
        plt.close("all")
        write(
            into / f"{name}.md",
            f"# {name}",
            f"{head_of(machine)}.",
            f"![Drawing of {name}, not to scale]({name}.svg)",
            f"```text\n{equations_of(machine)}\n```",
            f"![{known.caption}]({name}-known-for.png)",
            f"*{known.caption}*",
            f"Source: {machine.source}",
            f"```sh\n{commands_of(machine)}\n```",
            f"```{{eval-rst}}\n.. autoclass:: vibroimpact.machines.{machine.__name__}\n{listed}```",
        )
    write_gallery(
        into,
        "# Gallery of machines",
        "Each with its defaults, and what it is known for. {doc}`../machines` says how they are named.",
        [Card(n, n, f"{n}-known-for.png", head_of(machine_of(n))) for n in MACHINES],
    )


# ---- reference ---------------------------------------------------------------------------------


def groups(text: str) -> dict[str, list[str]]:
    """Public names by the headings of docs/reference.md under which its lists have them."""
    found: dict[str, list[str]] = {}
    for part in re.split(r"^## ", text, flags=re.MULTILINE)[1:]:
        title, _, body = part.partition("\n")
        found[title] = re.findall(r"^- `([\w.]+)`", body, re.MULTILINE)
    return found


def write_reference(folder: Path) -> None:
    """A page for each public name, under the page of its room."""
    text = (DOCS / "reference.md").read_text(encoding="utf-8")
    into = folder / "reference"
    into.mkdir()
    rooms = []
    for title, names in groups(text).items():
        module = plotting if title == "Pictures" else vi
        rows = [name_page(into, module.__name__, name, attrgetter(name)(module)) for name in names]
        room = re.sub(r"\W+", "-", title.lower())
        rooms.append(f"reference/{room}")
        write(
            into / f"{room}.md",
            f"# {title}",
            "\n".join(f"- {{doc}}`{name} <{page}>`: {head}" for name, page, head in rows),
            contents(f"{name} <{page}>" for name, page, _ in rows),
        )
    head = text.partition("\n## ")[0]
    write(folder / "reference.md", head, contents(rooms, ":maxdepth: 2"))


def name_page(into: Path, module: str, name: str, thing: Any) -> tuple[str, str, str]:
    """Write the page of a name; its name, the name of the page, and the first line of its docstring."""
    kind = "autoclass" if isinstance(thing, type) else "autofunction"
    options = "   :members:\n   :inherited-members: Exception, tuple, int, str\n" * (
        kind == "autoclass"
    )
    inner, _, last = name.rpartition(".")
    place = f"{module}.{inner}" if inner else module  # of "measures.Peak": the room
    if find_spec(place) is None:
        place = thing.__module__
    page = f"{module}.{name}"
    write(
        into / f"{page}.rst",
        f"{name}\n{'=' * len(name)}",
        f".. currentmodule:: {place}",
        f".. {kind}:: {last}\n{options}",
    )
    head = (thing.__doc__ or "").strip().partition("\n")[0]
    return name, page, re.sub(r":\w+:`~?([^`]*)`", r"`\1`", head.replace("``", "`"))


if __name__ == "__main__":
    sys.exit(main())
