"""Circles of the paper's sections as computed curves, and the motions that lock them."""

from __future__ import annotations

from functools import cache
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from vibroimpact_papers.impact_damper import claims, figures, panels, parameter_sets
from vibroimpact_papers.impact_damper.evidence import Evidence
from vibroimpact_papers.impact_damper.families import (
    Family,
    circle_fold,
    family_data,
    family_of,
    locked_at,
)
from vibroimpact_papers.impact_damper.judge_resonances import torus_doubling
from vibroimpact_papers.impact_damper.plan import Plan, damper_of
from vibroimpact_papers.judged import Word

import vibroimpact as vi

SETS = parameter_sets()
SMALL = Plan(family_points=2, family_nodes=101)


@cache
def results() -> dict[str, Any]:
    panel = next(p for p in panels() if p.name == "5a")
    assert isinstance(panel.omega, float)
    start = vi.State((0.0, 0.0), (0.0, 1.0))
    cloud = vi.section(damper_of(SETS["C"], panel.omega), start, settle_events=8000, points=200)
    points = np.column_stack([cloud.x1, cloud.v1])
    return {"5a": SimpleNamespace(panel=panel, omega=panel.omega,
                                  found=[SimpleNamespace(points=points)])}  # fmt: skip


@cache
def of_c() -> Family:
    found = family_of(SETS["C"], results(), SMALL)
    assert found is not None
    return found


def test_the_circle_of_figure_5a_has_its_rotation_number_and_lies_on_the_simulated_points() -> None:
    circle = of_c().at_panels["5a"]
    assert circle.rotation_number == pytest.approx(0.287925934321, abs=1e-10)
    data = family_data(of_c(), SETS["C"], results(), SMALL)
    curve, cloud = data["circle"].values[0], data["simulated"].values[0]
    away = np.linalg.norm(cloud[:, None] - curve[None], axis=2).min(axis=1)
    step = np.linalg.norm(np.diff(curve, axis=0), axis=1).max()
    assert away.max() < step


def test_no_torus_doubles_where_the_leading_multiplier_is_positive() -> None:
    assert of_c().leading.min() > 0.0
    route = next(c for c in claims() if c.id == "s6-route")
    found = torus_doubling(route, Evidence(SETS, claims(), {}, {}, families={"C": of_c()}))
    assert found.word is Word.DIFFERS


def test_set_a_is_locked_to_a_quarter_and_set_b_to_three_sixteenths() -> None:
    assert locked_at(SETS["A"], 0.9817) == (1, 4)  # four half periods: 2-2-2
    assert locked_at(SETS["B"], 0.9454) == (3, 16)  # sixteen: 8-8-8
    assert locked_at(SETS["A"], 1.00734) is None


def test_figure_of_a_family_shows_the_numbers_of_its_file() -> None:
    data = family_data(of_c(), SETS["C"], results(), SMALL)
    figure = figures.redraw(data)
    assert len(figure.axes) == 3
    assert np.array_equal(figure.axes[1].lines[0].get_ydata(), data["rotation"].values)


@pytest.mark.slow
def test_circles_born_next_to_a_strong_resonance_of_set_a_end_in_a_fold() -> None:
    fold = circle_fold(SETS["A"], 0.9318453770651753, +1)
    assert fold is not None
    assert fold.parameter == pytest.approx(0.932061757, abs=2e-9)
    assert abs(fold.orbit.normal_multipliers[0] - 1.0) < 1e-4
