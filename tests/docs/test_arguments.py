"""Public functions take the arguments of the dictionary, with the defaults that it states."""

from __future__ import annotations

import enum
import inspect
import re
from collections.abc import Callable, Iterator
from functools import cache
from pathlib import Path
from typing import Any

import pytest

import vibroimpact as vi
from vibroimpact import plotting

DICTIONARY = Path(__file__).parents[2] / "docs" / "dictionary.md"
# They hand on what another function takes: a picture, the sweep that is repeated; names of numbers, fields of a
# machine.
OPEN = {
    "Result.plot",
    "plot_invariant_circle",
    "plot_section",
    "rerun_sweep",
    "Family",
    "Machine.from_physical",
    "Described.replace",
    "ExplicitMap.along",
}


def defaults_in(cell: str) -> dict[str, str]:
    """Defaults by the function that has them, from "`4`; `100` in `find_orbits`"; "" is all others."""
    found: dict[str, str] = {}
    for part in filter(None, cell.split("; ")):
        value, _, owners = part.partition(" in ")
        for owner in re.findall(r"`([^`]+)`", owners) or [""]:
            found[owner] = value.strip("`")
    return found


def table() -> dict[str, dict[str, str]]:
    """Arguments of the dictionary with their defaults."""
    section = DICTIONARY.read_text(encoding="utf-8").partition("\n## Arguments\n")[2]
    rows = re.findall(r"^\| (`.*?`) \| .* \| .*\| (.*)\|$", section.partition("\n## ")[0], re.M)
    return {
        name: defaults_in(cell.strip())
        for names, cell in rows
        for name in re.findall(r"`(\w+)`", names)
    }


def public() -> Iterator[tuple[str, Callable[..., Any]]]:
    """Public functions, classes that are made by hand, and public methods."""
    rooms = [("", vi), ("", plotting), ("observe.", vi.observe)]
    for owner, one in (
        (room + name, getattr(of, name)) for room, of in rooms for name in of.__all__
    ):
        if not inspect.isclass(one):
            yield owner, one
        elif not issubclass(one, Exception | enum.Enum):
            if "\nParameters\n" in (inspect.getdoc(one) or ""):
                yield owner, one
            for kind in one.__mro__:
                if kind.__module__.startswith("vibroimpact"):
                    for name, method in vars(kind).items():
                        plain = getattr(method, "__func__", method)
                        if inspect.isfunction(plain) and not name.startswith("_"):
                            yield f"{kind.__name__}.{name}", plain


@cache
def parameters() -> list[tuple[str, inspect.Parameter]]:
    """Parameters with the functions that have them."""
    return [
        (owner, parameter)
        for owner, one in public()
        for parameter in inspect.signature(one).parameters.values()
        if parameter.name not in ("self", "cls") and not parameter.name.startswith("_")
    ]


def departures(owner: str, one: inspect.Parameter, known: dict[str, dict[str, str]]) -> str:
    """How a parameter departs from the dictionary; nothing if it does not."""
    if one.kind in (one.VAR_POSITIONAL, one.VAR_KEYWORD):
        return "" if one.kind is one.VAR_POSITIONAL or owner in OPEN else "takes any keyword"
    if one.name not in known:
        return "is not in the dictionary"
    wanted = known[one.name].get(owner, known[one.name].get(""))
    have = None if one.default is one.empty else repr(one.default)
    return "" if have in (None, wanted) else f"is {have} by default, not {wanted}"


def test_no_public_signature_departs_from_the_dictionary() -> None:
    known = table()
    found = [
        f"{owner}({one.name}) {why}"
        for owner, one in parameters()
        if (why := departures(owner, one, known))
    ]
    assert not found, "\n".join(found)


def test_the_dictionary_lists_no_argument_and_no_default_that_is_not_there() -> None:
    have = {(owner, one.name) for owner, one in parameters()}
    names = {name for _, name in have}
    for name, defaults in table().items():
        assert name in names, name
        assert {(owner, name) for owner in defaults if owner} <= have, name


def test_system_comes_first_wherever_it_must_be_given() -> None:
    for owner, one in public():
        if inspect.isfunction(one) and "." not in owner:
            required = [
                p.name for p in inspect.signature(one).parameters.values() if p.default is p.empty
            ]
            assert "system" not in required[1:], owner


@pytest.mark.parametrize(
    ("name", "default", "message"),
    [
        ("settled", 250, "is not in the dictionary"),
        ("settle_periods", 400, "is 400 by default, not 250"),
        ("settle_periods", 250, ""),
        ("starts", 100, ""),  # of find_orbits
    ],
)
def test_a_departure_is_told(name: str, default: int, message: str) -> None:
    one = inspect.Parameter(name, inspect.Parameter.KEYWORD_ONLY, default=default)
    assert departures("find_orbits", one, table()) == message
