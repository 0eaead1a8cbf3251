"""Codes with names: integers in arrays and files, names in print."""

from __future__ import annotations

from enum import IntEnum


class NamedCode(IntEnum):
    """Integer that is printed by its name."""

    def __str__(self) -> str:
        return self.name
