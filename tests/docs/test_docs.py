"""The documents say what the code does: their code runs, their links lead somewhere."""

from __future__ import annotations

import doctest
import importlib
import pkgutil
import re
import runpy
import shlex
import subprocess
import sys
from operator import attrgetter
from pathlib import Path

import pytest

import vibroimpact as vi
from vibroimpact import plotting
from vibroimpact.cli import main as cli
from vibroimpact.machines.registry import MACHINES

pytestmark = pytest.mark.usefixtures("no_windows", "own_folder")

ROOT = Path(__file__).parents[2]
README = ROOT / "README.md"
OVERVIEW = ROOT / "docs" / "overview.md"
DOCUMENTS = sorted([README, ROOT / "CONTRIBUTING.md", *(ROOT / "docs").glob("*.md")])
REFERENCE = (ROOT / "docs" / "reference.md").read_text(encoding="utf-8")
MODULES = sorted(
    module.name
    for module in pkgutil.walk_packages(vi.__path__, "vibroimpact.")
    if not module.name.startswith("vibroimpact._kernel_")  # _kernel loads one; two would clash
)

# Their examples follow curves or search: more than a second. test-all runs them.
DEAR = {
    f"vibroimpact.{name}"
    for name in (
        *("bifurcations.atlas", "bifurcations.continue_bifurcation", "branches.diagram"),
        *("design.maps", "design.optimise", "orbits.search", "response.response"),
    )
}


def blocks(path: Path, language: str) -> list[str]:
    text = path.read_text(encoding="utf-8")
    return re.findall(rf"^```{language}\n(.*?)^```", text, re.MULTILINE | re.DOTALL)


@pytest.mark.parametrize(
    "name",
    [pytest.param(name, marks=[pytest.mark.slow] * (name in DEAR), id=name) for name in MODULES],
)
def test_the_examples_in_the_docstrings_hold(name: str) -> None:
    outcome = doctest.testmod(importlib.import_module(name))
    assert outcome.failed == 0


def test_the_first_figure_of_the_readme_is_drawn_in_ten_lines(tmp_path: Path) -> None:
    first = blocks(README, "python")[0]
    assert len(first.splitlines()) <= 10
    exec(compile(first, "README.md", "exec"), {})  # noqa: S102 - our own text
    assert (tmp_path / "circle.svg").stat().st_size > 0


@pytest.mark.parametrize(
    "path",
    [pytest.param(path, marks=[pytest.mark.slow] * (path == OVERVIEW)) for path in DOCUMENTS],
    ids=lambda path: path.name,
)
def test_python_in_the_document_runs_from_top_to_bottom(path: Path) -> None:
    namespace: dict[str, object] = {}
    for block in blocks(path, "python"):
        exec(compile(block, path.name, "exec"), namespace)  # noqa: S102 - our own text


@pytest.mark.parametrize("path", DOCUMENTS, ids=lambda path: path.name)
def test_commands_in_the_document_are_understood(path: Path) -> None:
    for block in blocks(path, "sh"):
        for line in block.replace("\\\n", " ").splitlines():
            if line.startswith("vibroimpact ") and "--version" not in line:
                cli.parser().parse_args(shlex.split(line)[1:])


def headings(path: Path) -> set[str]:
    """Names by which links lead to the headings of a document."""
    titles = re.findall(r"^#+ (.*)$", path.read_text(encoding="utf-8"), re.MULTILINE)
    return {re.sub(r"[^\w -]", "", title.lower()).replace(" ", "-") for title in titles}


@pytest.mark.parametrize("path", DOCUMENTS, ids=lambda path: path.name)
def test_links_in_the_document_lead_to_files_and_headings(path: Path) -> None:
    text = path.read_text(encoding="utf-8")
    links = re.findall(
        r"\]\(([^)#\s]*)(?:#([^)\s]*))?\)|^\[\w+\]: ([^#\s]*)#(\S*)$", text, re.MULTILINE
    )
    for *inline, file, part in links:
        target, heading = (a or b for a, b in zip(inline, (file, part), strict=True))
        if "://" in target:
            continue
        place = path.parent / target if target else path
        assert place.exists(), f"{path.name} links to {target}"
        if heading and place.suffix == ".md":
            assert heading in headings(place), f"{path.name} links to {target}#{heading}"


FOLDERS = (
    ROOT,
    ROOT / "src",
    ROOT / "src" / "vibroimpact",
    ROOT / "include" / "vibroimpact",
    ROOT / "docs",
)
MAPS = (OVERVIEW, ROOT / "CONTRIBUTING.md", ROOT / "docs" / "architecture.md")
SUFFIXES = "py|pyi|hpp|cpp|toml|md|txt"
TOYS = ("dead_band", "pauses")  # files that a reader of CONTRIBUTING adds


@pytest.mark.parametrize("path", MAPS, ids=lambda path: path.name)
def test_files_that_the_map_of_the_code_names_are_there(path: Path) -> None:
    named = re.findall(rf"`([\w./-]+(?:/|\.(?:{SUFFIXES})))`", path.read_text(encoding="utf-8"))
    lost = [
        name
        for name in named
        if Path(name).stem not in TOYS
        and not any((folder / name).exists() for folder in FOLDERS)
        and ("/" in name or not any(folder.rglob(name) for folder in FOLDERS[1:4]))
    ]
    assert len(named) > 10
    assert not lost


def test_every_equation_has_a_number_of_its_own_and_every_number_an_equation() -> None:
    tags = re.findall(r"\\tag\{(T\d+)\}", (ROOT / "docs" / "theory.md").read_text(encoding="utf-8"))
    assert len(tags) > 50
    assert sorted(tags) == sorted({*tags})
    for folder in (ROOT / "docs", *FOLDERS[2:4]):
        for path in folder.rglob("*"):
            if path.suffix in {".md", ".py", ".hpp"}:
                cited = re.findall(r"\((T\d+)\)", path.read_text(encoding="utf-8"))
                assert {*cited} <= {*tags}, path.name


def test_files_that_the_architecture_names_define_what_it_says() -> None:
    text = (ROOT / "docs" / "architecture.md").read_text(encoding="utf-8")
    file = r"`([\w/.]+\.(?:py|hpp))`"
    pairs = re.findall(
        rf"`(\w+)` \({file}|\(`(\w+)`, {file}\)|^\| `(\w+)` \| {file} \|", text, re.MULTILINE
    )
    named = [[part for part in pair if part] for pair in pairs]
    assert len(named) > 50
    for name, place in named:
        folder = FOLDERS[3 if place.endswith(".hpp") else 2]
        defined = rf"\b(?:def|class|struct) {name}\b" + (
            rf"|\b{name}\(" if place.endswith(".hpp") else ""
        )
        assert re.search(defined, (folder / place).read_text(encoding="utf-8")), (
            f"{name} is not in {place}"
        )


def test_the_reference_lists_every_public_name_once_and_nothing_else() -> None:
    head, _, pictures = REFERENCE.partition("\n## Pictures\n")
    for part, module, inner in ((head, vi, {"measures", "stop"}), (pictures, plotting, set())):
        listed = re.findall(r"^- `([\w.]+)`", part, re.MULTILINE)
        assert len(listed) == len(set(listed))
        assert {name.partition(".")[0] for name in listed} == {*module.__all__} | inner
        for name in listed:
            assert attrgetter(name)(module) is not None


def test_every_command_and_option_is_described() -> None:
    text = (ROOT / "docs" / "cli.md").read_text(encoding="utf-8")
    for command in cli.COMMANDS:
        assert f"`{command}" in text


def test_the_page_of_machines_is_that_of_the_catalogue() -> None:
    tool = runpy.run_path(str(ROOT / "tools" / "machines_page.py"))
    assert (ROOT / "docs" / "machines.md").read_text("utf-8") == tool["page"]()
    assert {model.entry for model in tool["MODELS"]} - {""} <= MACHINES.keys()


def test_editors_see_every_observer_and_every_machine() -> None:
    tool = ROOT / "tools" / "name_stubs.py"
    done = subprocess.run([sys.executable, str(tool), "--check"], check=False)
    assert done.returncode == 0, "run: make stubs"


@pytest.mark.slow
def test_the_picture_of_the_architecture_is_that_of_the_imports() -> None:
    tool = ROOT / "tools" / "architecture_picture.py"
    done = subprocess.run([sys.executable, str(tool), "--check"], check=False)
    assert done.returncode == 0, "run: python tools/architecture_picture.py"
