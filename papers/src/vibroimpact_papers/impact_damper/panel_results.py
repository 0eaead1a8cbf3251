"""Sections of Figs. 2, 4 and 5: attractors followed along omega, and from the fixed point."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np

from vibroimpact._core.types import Floats
from vibroimpact.attractors.classify import Attractor, classify
from vibroimpact.model.state import State
from vibroimpact.orbits.orbit import Orbit
from vibroimpact.simulation.sections import Section, section
from vibroimpact_papers.impact_damper import Panel, ParameterSet
from vibroimpact_papers.impact_damper.measures import same_cloud
from vibroimpact_papers.impact_damper.plan import BRANCH, Plan, Sweep, damper_of
from vibroimpact_papers.impact_damper.symmetric_bifurcations import orbits_by_sign

CLOSED = 1 / 500  # of the length of a curve: a wider gap between its points is visible
MORE_POINTS = 64_000  # are then drawn


class Step(NamedTuple):
    """Section at one frequency, and the last state, where the next frequency starts."""

    section: Section
    last: State


@dataclass(frozen=True)
class Followed:
    """The attractor of one set followed along omega, both ways; steps in increasing omega."""

    set: str
    omega: Floats
    start: State
    down: tuple[Step, ...]
    up: tuple[Step, ...]

    def states(self, panel: Panel) -> dict[str, State]:
        """Return the states that both ways reached at the frequency of a panel."""
        index = int(np.flatnonzero(self.omega == panel.omega)[0])
        return {"down": self.down[index].last, "up": self.up[index].last}


@dataclass(frozen=True)
class LabelledAttractor:
    """An attractor at one panel, from one start; ``points`` are (x1, x1'+), shape (n, 2)."""

    start: str
    attractor: Attractor
    points: Floats = field(repr=False)


@dataclass(frozen=True)
class PanelResult:
    """Attractors at one panel from every start."""

    panel: Panel
    found: tuple[LabelledAttractor, ...]

    @property
    def omega(self) -> float:
        """Return the frequency of the panel."""
        assert isinstance(self.panel.omega, float)
        return self.panel.omega

    @cached_property
    def distinct(self) -> tuple[tuple[LabelledAttractor, ...], ...]:
        """Return groups of starts that lead to the same attractor."""
        groups: list[list[LabelledAttractor]] = []
        for one in self.found:
            same = next((g for g in groups if _same(g[0], one)), None)
            if same is None:
                groups.append([one])
            else:
                same.append(one)
        return tuple(tuple(group) for group in groups)


def branch_orbit(chosen: ParameterSet, omega: float) -> Orbit | None:
    """Return the orbit of the paper's branch, if it exists and is a motion of the damper."""
    orbit = orbits_by_sign(damper_of(chosen, omega)).get(BRANCH)
    return orbit if orbit and orbit.admissible else None


def follow_both_ways(chosen: ParameterSet, plan: Plan, omegas: tuple[float, ...]) -> Followed:
    """Follow the attractor of a set down from the perturbed fixed point, and back up."""
    sweep: Sweep = plan.sweeps[chosen.name]
    grid = sweep.grid(omegas)
    orbit = branch_orbit(chosen, float(grid[-1]))
    assert orbit is not None, "a sweep starts where the symmetric orbit is a motion"
    start = orbit.state.perturbed(plan.perturbation)
    down = _followed(chosen, plan, grid[::-1], start)
    up = _followed(chosen, plan, grid, down[-1].last)
    return Followed(chosen.name, grid, start, tuple(down[::-1]), tuple(up))


def _followed(chosen: ParameterSet, plan: Plan, omegas: Floats, state: State) -> list[Step]:
    steps: list[Step] = []
    for omega in omegas.tolist():
        found = section(
            damper_of(chosen, omega),
            state,
            points=plan.sweep_points,
            settle_events=plan.sweep_settle,
        )
        state = found.last if len(found) else state
        steps.append(Step(found, state))
    return steps


def panel_result(
    chosen: ParameterSet, panel: Panel, reached: Mapping[str, State], plan: Plan
) -> PanelResult:
    """Classify the attractor of every start at the frequency of a panel: the states reached, and the fixed point."""
    assert isinstance(panel.omega, float)
    starts = dict(reached)
    orbit = branch_orbit(chosen, panel.omega)
    if orbit is not None:
        starts["fixed point"] = orbit.state.perturbed(plan.perturbation)
    damper = damper_of(chosen, panel.omega)
    settings: dict[str, Any] = plan.classification
    found = []
    for name, state in starts.items():
        attractor = classify(damper, state, **settings)
        found.append(LabelledAttractor(name, attractor, _points(attractor)))
    return PanelResult(panel, tuple(found))


def _points(attractor: Attractor) -> Floats:
    """Return the points of the last window, or the last period of a periodic orbit."""
    found, curve = attractor.section, attractor.shape.curve
    if curve is not None and curve.widest_gap > CLOSED * curve.length:
        found = section(found.system, found.last, points=MORE_POINTS, settle_events=0)
    points = np.column_stack([found.x1, found.v1])
    return points[-attractor.shape.period :] if attractor.shape.period else points


def _same(a: LabelledAttractor, b: LabelledAttractor) -> bool:
    def sort(found: LabelledAttractor) -> tuple[object, ...]:
        one = found.attractor
        turns = one.shape.curve.turns if one.shape.curve else 0
        return one.kind, one.type, one.shape.pieces, turns

    if sort(a) != sort(b) or not (len(a.points) and len(b.points)):
        return False
    return same_cloud(a.points, b.points)


def labels(groups: Sequence[Sequence[LabelledAttractor]]) -> list[str]:
    """Return the name of each group and its starts."""
    return [f"{g[0].attractor.label} ({', '.join(f.start for f in g)})" for g in groups]
