"""The founding paper: its claims as data, beside its parameter sets and panels.

`claims.toml` holds the printed values; this module only reads it. The sets and the panels are in
the library (:mod:`vibroimpact.machines.published`).
"""

from __future__ import annotations

import tomllib
from importlib.resources import files
from types import MappingProxyType
from typing import Any

from vibroimpact.machines.published import Panel, ParameterSet, panels, parameter_sets
from vibroimpact_papers.judged import Claim

__all__ = [
    "TITLE",
    "Panel",
    "ParameterSet",
    "claims",
    "panels",
    "parameter_sets",
]

TITLE = "Nonlinear dynamic characteristics of a vibro-impact system under harmonic excitation"
"""Title of the paper. The copy at hand names neither authors nor journal."""


def claims() -> tuple[Claim, ...]:
    """Return every claim of sections 3 to 6 and of captions 2 to 5 that has a number or a type."""
    text = files(__package__).joinpath("claims.toml").read_text(encoding="utf-8")
    return tuple(_claim(row) for row in tomllib.loads(text)["claims"])


def _claim(row: dict[str, Any]) -> Claim:
    row = dict(row)
    row["printed"] = MappingProxyType(row.get("printed", {}))
    for key in ("panels", "contradicts"):
        row[key] = tuple(row.get(key, ()))
    return Claim(**row)
