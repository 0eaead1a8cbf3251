"""Evidence of verdicts, shared by the rules for numbers and for motions."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import lru_cache

from vibroimpact.machines.impact_damper import ImpactDamper
from vibroimpact.orbits.orbit import Orbit
from vibroimpact_papers.impact_damper import ParameterSet
from vibroimpact_papers.impact_damper.circles import Measured
from vibroimpact_papers.impact_damper.families import Family
from vibroimpact_papers.impact_damper.panel_results import PanelResult
from vibroimpact_papers.impact_damper.plan import BRANCH, damper_of
from vibroimpact_papers.impact_damper.resonances import Resonances
from vibroimpact_papers.impact_damper.symmetric_bifurcations import Bifurcation, orbits_by_sign
from vibroimpact_papers.judged import Claim


@lru_cache(maxsize=4096)
def all_orbits(damper: ImpactDamper) -> dict[int, Orbit]:
    """Return the symmetric orbits of a damper by sign; several claims use the same ones."""
    return orbits_by_sign(damper)


@dataclass(frozen=True)
class Evidence:
    """Evidence for the verdicts.

    Attributes
    ----------
    sets
        Parameters of each set.
    claims
        All claims: some are judged together with another of the same set.
    bifurcations
        Bifurcations of the symmetric orbits of each set, in the range of the paper and of the sweep.
    panels
        Results at each panel, by name; panels that were not computed are missing.
    circles
        The normal form and the simulated circles at each Neimark-Sacker point.
    resonances
        Curves of bifurcations in two parameters with their strong resonances, of each set.
    families
        Invariant circles followed along the frequency, of each set.
    """

    sets: Mapping[str, ParameterSet]
    claims: tuple[Claim, ...]
    bifurcations: Mapping[str, tuple[Bifurcation, ...]]
    panels: Mapping[str, PanelResult]
    circles: tuple[Measured, ...] = ()
    resonances: Mapping[str, Resonances] = field(default_factory=dict)
    families: Mapping[str, Family] = field(default_factory=dict)

    def orbits(self, name: str, omega: float) -> dict[int, Orbit]:
        """Return the symmetric orbits of a set that are motions of the damper, by sign."""
        found = all_orbits(self.damper(name, omega))
        return {sign: orbit for sign, orbit in found.items() if orbit.admissible}

    def branch(self, name: str, omega: float) -> Orbit | None:
        """Return the orbit of the paper's branch."""
        return self.orbits(name, omega).get(BRANCH)

    def damper(self, name: str, omega: float) -> ImpactDamper:
        """Return the damper of a set."""
        return damper_of(self.sets[name], omega)

    def crossings(self, name: str) -> tuple[Bifurcation, ...]:
        """Return the Neimark-Sacker points of a set that motions of the damper pass."""
        return tuple(b for b in self.bifurcations[name] if b.kind == "NS" and b.admissible)
