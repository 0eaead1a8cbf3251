"""Texts of numpydoc docstrings, for help and lists."""

from __future__ import annotations

import inspect


def head_of(thing: object) -> str:
    """First line of a docstring, without the full stop."""
    return (inspect.getdoc(thing) or "").partition("\n")[0].rstrip(".")


def descriptions(thing: object) -> dict[str, str]:
    """Texts of a section Parameters, by name."""
    section = (inspect.getdoc(thing) or "").partition("Parameters\n----------\n")[2]
    texts: dict[str, str] = {}
    names: list[str] = []
    for line in section.partition("\n\n")[0].splitlines():
        if line.startswith(" "):
            texts |= {name: f"{texts.get(name, '')} {line.strip()}".strip() for name in names}
        else:
            names = line.partition(" : ")[0].split(", ")
    return texts
