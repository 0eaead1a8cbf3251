"""The tutorials are what happens: their blocks print what they show and draw their pictures."""

from __future__ import annotations

import importlib.util
import re
from pathlib import Path
from types import ModuleType
from typing import NamedTuple

import pytest

pytestmark = pytest.mark.slow

ROOT = Path(__file__).parents[2]
NUMBER = re.compile(r"(?<![\w.])\d+\.\d*(?:e[+-]?\d+)?")


def loaded() -> ModuleType:
    path = ROOT / "tools" / "tutorial_pictures.py"
    spec = importlib.util.spec_from_file_location(path.stem, path)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


TOOL = loaded()
TEXTS = {name: TOOL.document(name).read_text(encoding="utf-8") for name in TOOL.TUTORIALS}
BLOCKS = {name: TOOL.blocks(text) for name, text in TEXTS.items()}
PLACES = [(name, index) for name, blocks in BLOCKS.items() for index in range(len(blocks))]


class Ran(NamedTuple):
    printed: list[str]
    pictures: set[str]


@pytest.fixture(scope="module")
def ran(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Ran]:
    found = {}
    for name, text in TEXTS.items():
        folder = tmp_path_factory.mktemp("tutorial")
        printed = TOOL.run(text, folder)
        pictures = {path.name for path in TOOL.pictures_in(folder) if path.stat().st_size}
        found[name] = Ran(printed, pictures)
    return found


def words(printed: str) -> str:
    """What is printed, with its signs, counts and spaces, and without decimal numbers."""
    return NUMBER.sub("#", printed)


def numbers(printed: str) -> list[str]:
    return NUMBER.findall(printed)


def resolution(number: str) -> float:
    """One unit of the last printed digit."""
    digits, _, exponent = number.partition("e")
    return float(10.0 ** (int(exponent or 0) - len(digits.partition(".")[2])))


@pytest.mark.parametrize(("name", "index"), PLACES)
def test_the_block_prints_what_stands_below_it(name: str, index: int, ran: dict[str, Ran]) -> None:
    shown, printed = BLOCKS[name][index].printed, ran[name].printed[index]
    assert words(printed) == words(shown)
    for a, b in zip(numbers(printed), numbers(shown), strict=True):
        assert abs(float(a) - float(b)) <= 1.01 * resolution(b), f"{a} is shown as {b}"


@pytest.mark.parametrize("name", TEXTS)
def test_the_pictures_shown_are_those_that_the_blocks_draw(name: str, ran: dict[str, Ran]) -> None:
    shown = re.findall(r"\]\(pictures/([^)]*)\)", TEXTS[name])
    assert set(shown) == ran[name].pictures
    kept = (TOOL.DOCS / "pictures").glob(f"{TOOL.TUTORIALS[name]}*")
    assert {p.name for p in kept} == ran[name].pictures


@pytest.mark.parametrize("name", TEXTS)
def test_every_number_in_the_text_is_one_that_a_block_uses_or_prints(name: str) -> None:
    prose = re.sub(r"^```.*?^```$", "", TEXTS[name], flags=re.MULTILINE | re.DOTALL)
    prose = re.sub(r"`[^`]*`", "", prose)  # code beside the text
    known = [float(x) for block in BLOCKS[name] for x in numbers(block.code + block.printed)]
    for number in re.findall(r"\d+\.\d+", prose):
        near = resolution(number) / 2.0 + 1e-12  # rounded to the digits that the text gives
        assert any(abs(x - float(number)) <= near for x in known), number


@pytest.mark.parametrize("name", TEXTS)
def test_blocks_are_short(name: str) -> None:
    assert max(len(block.code.splitlines()) for block in BLOCKS[name]) <= 15


def test_output_is_put_below_its_block() -> None:
    text = "```py\nprint(1)\n```\n\n```text\nold\n```\n\n```py\nx = 2\n```\n"
    again = "```py\nprint(1)\n```\n\n```text\nnew\n```\n\n```py\nx = 2\n```\n"
    assert TOOL.refreshed(text, ["new\n", ""]) == again
