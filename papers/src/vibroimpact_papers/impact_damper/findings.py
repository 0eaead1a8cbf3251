"""Everything that is computed before the report is written, and the pictures of it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

import xarray as xr

from vibroimpact.branches.point import BifurcationPoint
from vibroimpact.plotting.page import Block, Picture
from vibroimpact_papers.impact_damper import ParameterSet
from vibroimpact_papers.impact_damper.circles import Measured
from vibroimpact_papers.impact_damper.families import Family
from vibroimpact_papers.impact_damper.misprints import Misprint
from vibroimpact_papers.impact_damper.panel_results import Followed, PanelResult
from vibroimpact_papers.impact_damper.plan import Plan
from vibroimpact_papers.impact_damper.resonances import Distance, Resonances
from vibroimpact_papers.impact_damper.symmetric_bifurcations import Bifurcation
from vibroimpact_papers.impact_damper.transient import Survivors
from vibroimpact_papers.impact_damper.unfolding import Unfolded
from vibroimpact_papers.judged import plain


@dataclass(frozen=True)
class Findings:
    """Everything that is computed before anything is drawn."""

    plan: Plan
    sets: Mapping[str, ParameterSet]
    bifurcations: Mapping[str, tuple[Bifurcation, ...]]
    followed: Mapping[str, Followed]
    panels: Mapping[str, PanelResult]
    circles: tuple[Measured, ...]
    ensembles: Mapping[str, xr.Dataset]
    transient: Survivors | None
    resonances: Mapping[str, Resonances] = field(default_factory=dict)
    distances: Mapping[str, tuple[Distance, ...]] = field(default_factory=dict)
    families: Mapping[str, Family] = field(default_factory=dict)
    unfolded: tuple[Unfolded, ...] = ()
    spectra: tuple[xr.Dataset, ...] = ()
    circle_folds: Mapping[str, BifurcationPoint] = field(default_factory=dict)


@dataclass(frozen=True, slots=True)
class Residual:
    """A misprint with its residual as printed and as corrected."""

    misprint: Misprint
    printed: float
    corrected: float

    def record(self) -> dict[str, object]:
        """Return the row as plain data."""
        m = self.misprint
        return {
            "where": m.where,
            "printed": m.printed,
            "holds": m.corrected,
            "why": m.why,
            "case": m.case,
            "residual_printed": plain(self.printed),
            "residual_corrected": plain(self.corrected),
        }


@dataclass(frozen=True, slots=True)
class Pictures:
    """The folder of the pictures, and the data files of each."""

    folder: Path
    files: Mapping[str, tuple[str, ...]]

    def figure(
        self, name: str, title: str, caption: str, alternative: str, *, narrow: bool = False
    ) -> list[Block]:
        """Return the figure, or nothing if it was not drawn."""
        if name not in self.files:
            return []
        data = ", ".join(f"data/{file}" for file in self.files[name])
        svg = (self.folder / f"{name}.svg").read_bytes()
        return [Picture(svg, f"{caption} Data: {data}.", alternative, title, name, narrow)]
