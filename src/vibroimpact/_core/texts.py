"""Texts of others: read within limits of size and depth, and shown without control characters."""

from __future__ import annotations

import json
import re
import tomllib
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from vibroimpact._core.checks import shortened
from vibroimpact._core.errors import InvalidParameterError
from vibroimpact._core.files import read_bytes

MOST_TOML_BYTES = 10**6
MOST_JSON_CHARACTERS = 10**7
DOTTED_KEY = re.compile(  # of so many parts that a parser would take minutes
    r"""(?:\.[ \t]*(?:"[^"\n]*"|'[^'\n]*'|[\w-]+)[ \t]*){64}"""
)


def read_text(name: str, path: Path, most: int, advice: str = "") -> str:
    """Text of a file of at most so many bytes; a mark of its byte order is left out.

    Raises
    ------
    InvalidParameterError
        A file that :func:`~vibroimpact._core.files.read_bytes` refuses, or that is no UTF-8 text.
    """
    content = read_bytes(name, path, most, advice)
    try:
        return content.decode("utf-8-sig")
    except UnicodeDecodeError:
        raise InvalidParameterError(
            f"{name} = {path}: cannot be read (it is not UTF-8 text).{advice and ' ' + advice}"
        ) from None


def read_toml(name: str, path: Path) -> dict[str, Any]:
    """Tables of a TOML file.

    Raises
    ------
    InvalidParameterError
        No such file, no TOML, more of it than a description of a machine can have.
    """
    text = read_text(name, path, MOST_TOML_BYTES, "Name a TOML file.")
    if DOTTED_KEY.search(text):
        raise InvalidParameterError(f"{name} = {path}: has a key of too many parts.")
    with _well_formed(f"{name} = {path}: is not valid TOML"):
        return tomllib.loads(text)


def json_of(name: str, text: Any) -> Any:
    """Value of a JSON text.

    Raises
    ------
    InvalidParameterError
        No text, no JSON, or more of it than the package writes.
    """
    if not isinstance(text, str) or len(text) > MOST_JSON_CHARACTERS:
        raise InvalidParameterError(f"{name}: is no text, or too long.")
    with _well_formed(f"{name}: is not valid JSON"):
        return json.loads(text)


@contextmanager
def _well_formed(what: str) -> Iterator[None]:
    """Say why a text cannot be parsed."""
    try:
        yield
    except RecursionError:
        raise InvalidParameterError(f"{what} (it is nested too deeply).") from None
    except ValueError as error:  # an integer of too many digits is one, too
        raise InvalidParameterError(
            f"{what} ({shortened(str(error))}). Correct that place."
        ) from error
