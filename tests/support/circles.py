"""The five Neimark-Sacker points of the paper's branch, with the 50-digit reference of each."""

from __future__ import annotations

import tomllib
from functools import cache
from pathlib import Path
from typing import Any

from vibroimpact_papers.impact_damper.normal_forms import CriticalPoint, critical_points
from vibroimpact_papers.impact_damper.symmetric_bifurcations import symmetric_bifurcations

from vibroimpact.machines.published import parameter_sets

REFERENCE = Path(__file__).parents[1] / "reference" / "normal_forms.toml"
SPAN = {"A": (0.92, 1.02), "B": (0.94, 1.03), "C": (0.42, 0.44)}
NAMES = ("A 0.9318", "A 1.0079", "B 0.9517", "B 1.0170", "C 0.4289")
SUBCRITICAL = "B 0.9517"


@cache
def five_points() -> dict[str, CriticalPoint]:
    """The points by name, in the order of NAMES."""
    found = [
        point
        for name, chosen in parameter_sets().items()
        for point in critical_points(
            name, symmetric_bifurcations(chosen.damper(SPAN[name][1]), SPAN[name])
        )
    ]
    return {point.name: point for point in found}


@cache
def references() -> dict[str, dict[str, Any]]:
    """Tables [[torus]] of the reference file, by the name of the point."""
    rows = tomllib.loads(REFERENCE.read_text(encoding="utf-8"))["torus"]
    return {f"{row['set']} {float(row['omega']):.4f}": row for row in rows}
