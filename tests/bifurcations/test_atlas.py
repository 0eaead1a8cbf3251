"""Atlas of curves of bifurcations, against the curves and points that are known."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest
from support.bifurcations import COARSE

import vibroimpact as vi

PLANE = ("omega", "half_clearance")
DAMPER = vi.ImpactDamper(
    mass_ratio=0.1, omega_n=0.5, zeta=0.045, restitution=0.8, half_clearance=5.5, omega=0.98
)


@cache
def atlas() -> vi.Atlas:
    """A small part of the plane, around both resonances 1:4."""
    orbit = vi.symmetric_orbits(DAMPER)[0]
    return vi.bifurcation_atlas(
        orbit, PLANE, ((0.9, 1.05), (5.0, 6.3)), most_curves=4, steps=COARSE
    )


@pytest.mark.slow
def test_every_curve_is_followed_once_though_two_branches_meet_it() -> None:
    # the torus curve is cut twice by each of both branches, and leaves the part of the plane between
    torus = [curve for curve in atlas().curves if curve.kind == "NS" and len(curve.special_points)]
    at = [
        tuple(np.round(list(point.parameters.values()), 9))
        for curve in torus
        for point in curve.special_points
        if point.kind == "R4" and curve.orbit(0).symbol == "1-1-1"
    ]
    assert len(at) == len(set(at)) == 2


@pytest.mark.slow
def test_folds_of_period_four_are_in_the_atlas_and_their_points_shared() -> None:
    folds = [c for c in atlas().curves if c.kind == "SN"]
    assert {curve.orbit(0).symbol for curve in folds} == {"2-2-2"}
    for shared in atlas().points:
        at = tuple(shared[0][1].parameters.values())
        for number, point in shared:
            assert atlas().curves[number][point.label] is point
            assert tuple(point.parameters.values()) == pytest.approx(at, abs=1e-6)


@pytest.mark.slow
def test_a_search_that_stops_at_its_greatest_number_says_so() -> None:
    orbit = vi.symmetric_orbits(DAMPER)[0]
    part = vi.bifurcation_atlas(orbit, PLANE, ((0.9, 1.05), (5.0, 6.3)), most_curves=1)
    assert len(part) == 1
    assert not part.complete
    assert "not complete" in repr(part)


@pytest.mark.slow
def test_an_interrupted_search_keeps_its_curves() -> None:
    def stop(report: vi.ProgressReport) -> None:
        if report.stage == "atlas" and report.done:
            raise KeyboardInterrupt

    orbit = vi.symmetric_orbits(DAMPER)[0]
    part = vi.bifurcation_atlas(orbit, PLANE, ((0.9, 1.05), (5.0, 6.3)), depth=0, progress=stop)
    assert len(part) == 1
    assert not part.complete


def test_the_dataset_has_every_point_of_every_curve() -> None:
    data = atlas().to_dataset()
    assert data.sizes["point"] == sum(len(curve) for curve in atlas().curves)
    assert data.sizes["curves"] == len(atlas())
    last = atlas().curves[-1]
    np.testing.assert_array_equal(data.omega.values[-len(last) :], last.values[:, 0])


def test_bad_input_is_refused() -> None:
    orbit = vi.symmetric_orbits(DAMPER)[0]
    with pytest.raises(vi.InvalidParameterError, match="depth"):
        vi.bifurcation_atlas(orbit, PLANE, ((0.9, 1.05), (5.0, 6.3)), depth=-1)
    with pytest.raises(vi.InvalidParameterError, match="twice the same"):
        vi.bifurcation_atlas(orbit, ("omega", "omega"), ((0.9, 1.05), (5.0, 6.3)))
