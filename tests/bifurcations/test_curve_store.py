"""A stored curve of bifurcations is the curve: the same numbers, and it can be gone on from."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from support.bifurcations import PLANE, oscillator_branch, torus_of_set_a
from support.files import assert_full_disk_leaves_the_old_file
from support.systems import paper_damper

import vibroimpact as vi
from vibroimpact.bifurcations.store import curve_from_dataset, dataset_of

DAMPER = paper_damper("A", 0.95)


@pytest.fixture(scope="module")
def torus() -> vi.BifurcationCurve:
    return torus_of_set_a()


@pytest.fixture(scope="module")
def stored(
    torus: vi.BifurcationCurve, tmp_path_factory: pytest.TempPathFactory
) -> vi.BifurcationCurve:
    path = tmp_path_factory.mktemp("curves") / "torus.nc"
    vi.save_curve(torus, path)
    return vi.load_curve(path)


def assert_equal(here: vi.BifurcationCurve, there: vi.BifurcationCurve) -> None:
    """Every number of two curves is the same."""
    assert repr(here) == repr(there)
    assert (here.kind, here.names, here.bounds) == (there.kind, there.names, there.bounds)
    for name in ("values", "multipliers", "admissible", "neutral", "angle"):
        np.testing.assert_array_equal(getattr(here, name), getattr(there, name))
        assert getattr(here, name).dtype == getattr(there, name).dtype
    for name in ("parameter", "z", "tangent", "arclength", "residual", "steps", "panel"):
        np.testing.assert_array_equal(getattr(here.curve, name), getattr(there.curve, name))
    assert list(here.curve.tests) == list(there.curve.tests)
    for name, values in there.curve.tests.items():
        np.testing.assert_array_equal(here.curve.tests[name], values)
    assert here.ends == there.ends
    assert here.curve.unresolved == there.curve.unresolved
    assert (here.curve.start, here.curve.rejected) == (there.curve.start, there.curve.rejected)
    assert [(p.name, p.parameter, p.error) for p in here.curve.special] == [
        (p.name, p.parameter, p.error) for p in there.curve.special
    ]
    np.testing.assert_array_equal(here.problem.scale(), there.problem.scale())
    assert repr(here.problem.equations.system) == repr(there.problem.equations.system)  # type: ignore[attr-defined]
    for at, one in zip(here.special_points, there.special_points, strict=True):
        assert repr(at) == repr(one)
        assert at.parameters == one.parameters
        assert (at.error, at.arclength, at.resonance) == (one.error, one.arclength, one.resonance)
        assert at.nearest == one.nearest
        for name in ("multipliers", "z", "tangent"):
            np.testing.assert_array_equal(getattr(at, name), getattr(one, name))
        np.testing.assert_array_equal(at.orbit.states, one.orbit.states)


def test_every_number_comes_back_to_the_last_bit(
    torus: vi.BifurcationCurve, stored: vi.BifurcationCurve
) -> None:
    assert {"R4_1", "R4_2"} <= {point.label for point in torus.special_points}
    assert_equal(stored, torus)


def test_special_points_come_back_with_their_coefficients(
    torus: vi.BifurcationCurve, stored: vi.BifurcationCurve
) -> None:
    assert repr(stored["R4_2"].normal_form) == repr(torus["R4_2"].normal_form)


def test_curves_followed_from_a_loaded_point_are_those_from_the_original(
    torus: vi.BifurcationCurve, stored: vi.BifurcationCurve
) -> None:
    bounds = ((0.92, 0.94), (4.9, 5.2))
    there = vi.continue_bifurcation(torus["R4_2"], PLANE, bounds)
    here = vi.continue_bifurcation(stored["R4_2"], PLANE, bounds)
    assert_equal(here, there)
    state, other = stored.orbit(10), torus.orbit(10)
    np.testing.assert_array_equal(state.states, other.states)
    assert state.residual == other.residual


@pytest.mark.slow
@pytest.mark.parametrize(
    ("label", "omega"), [("PD1", 2.3), ("ZERO1", 2.0), ("SN1", 2.0), ("GR1", 2.0)]
)
def test_curves_of_every_kind_come_back(label: str, omega: float, tmp_path: Path) -> None:
    point = oscillator_branch(omega)[label]
    bounds = ((0.8, 1.2), (0.0, 1.2))
    found = vi.continue_bifurcation(point, ("force", "clearance"), bounds)
    vi.save_curve(found, tmp_path / "curve.nc")
    loaded = vi.load_curve(tmp_path / "curve.nc")
    assert_equal(loaded, found)
    Z, p = found.curve.z[3], float(found.values[3, 1])
    np.testing.assert_array_equal(loaded.problem.residual(Z, p), found.problem.residual(Z, p))


def test_a_level_comes_back_without_its_function_and_says_so(tmp_path: Path) -> None:
    start = vi.symmetric_orbits(DAMPER)[0]
    found = vi.continue_level(
        start,
        lambda states, _durations, _parameters: states[0, 2] - states[0, 3],
        PLANE,
        ((0.94, 0.96), (4.9, 5.1)),
    )
    vi.save_curve(found, tmp_path / "level.nc")
    loaded = vi.load_curve(tmp_path / "level.nc")
    assert_equal(loaded, found)
    with pytest.raises(vi.InvalidParameterError, match="does not hold the function of a level"):
        loaded.problem.residual(loaded.curve.z[0], float(loaded.values[0, 1]))


def test_a_curve_of_a_family_is_loaded_with_the_system_that_was_stored(tmp_path: Path) -> None:
    def oscillator(k: float, wall: float) -> vi.Mechanism:
        return vi.Mechanism(
            mass=((1.0,),), damping=((0.1,),), stiffness=((k,),),
            forces=(vi.Harmonic(0.8, (1.0,)),),
            elements=(vi.RigidStop((1.0,), upper=wall, restitution=0.7),),
        )  # fmt: skip

    start = vi.find_orbit(vi.Family(oscillator, k=1.0, wall=0.5), vi.State((0.0,), (0.0,)))
    assert start.converged
    found = vi.continue_level(
        start, lambda states, _d, _p: states[0, 1], ("k", "wall"), ((0.95, 1.05), (0.45, 0.55))
    )
    path = tmp_path / "family.nc"
    vi.save_curve(found, path)
    with pytest.raises(vi.InvalidParameterError, match=r"holds a curve of Family\(oscillator"):
        vi.load_curve(path)
    loaded = vi.load_curve(path, vi.Family(oscillator, k=3.0, wall=0.7))
    np.testing.assert_array_equal(loaded.orbit(0).states, found.orbit(0).states)


def meeting(omega: float, k: float) -> vi.Mechanism:
    """Two masses; two contacts whose impacts can come to coincide."""
    return vi.Mechanism(
        mass=[[1.0, 0.0], [0.0, 0.5]],
        damping=[[0.1, -0.03], [-0.03, 0.05]],
        stiffness=[[1.0 + k, -k], [-k, k]],
        forces=(vi.Harmonic(omega, (1.0, 0.0)),),
        elements=(
            vi.RigidStop((1.0, 0.0), upper=0.5, restitution=0.7),
            vi.RigidStop((-1.0, 1.0), lower=-0.4, upper=0.4, restitution=0.6),
        ),
    )


@pytest.mark.slow
def test_a_curve_of_two_impacts_at_once_comes_back(tmp_path: Path) -> None:
    system = vi.Family(meeting, omega=1.3, k=1.0)
    orbits = vi.find_orbits(system, cycles=1, impacts=3, starts=10).orbits
    start = next(orbit for orbit in orbits if orbit.symbol == "1-1-0,1-1")
    point = vi.continue_orbit(start, "omega", (1.19, 1.31))["SIM1"]
    bounds, few = ((1.19, 1.31), (0.99, 1.01)), vi.Steps(points=8)
    found = vi.continue_bifurcation(point, ("omega", "k"), bounds, steps=few)
    assert len(found) > 10
    flights = [found.orbit(i).durations[point.segment] for i in range(len(found))]
    assert np.abs(flights).max() < 1e-12
    vi.save_curve(found, tmp_path / "meeting.nc")
    loaded = vi.load_curve(tmp_path / "meeting.nc", system)
    assert_equal(loaded, found)
    Z, p = found.curve.z[3], float(found.values[3, 1])
    np.testing.assert_array_equal(loaded.problem.residual(Z, p), found.problem.residual(Z, p))


def test_a_curve_of_a_map_has_a_dataset_and_is_not_saved(tmp_path: Path) -> None:
    henon = vi.ExplicitMap(
        lambda x, p: [x[1], p[0] - p[1] * x[0] - x[1] ** 2 + 0.5 * x[0] * x[1]],
        dimension=2,
        parameters=("a", "b"),
    )
    start = vi.MapPoint("NS", henon, (2 / 3, 2 / 3), (16 / 9, 4 / 3))  # R3
    found = vi.continue_bifurcation(start, ("a", "b"), ((1.0, 2.5), (1.0, 1.5)))
    data = found.to_dataset()
    np.testing.assert_array_equal(data["value"].sel(parameter="a"), found.values[:, 0])
    assert list(data["special_label"].values) == [p.label for p in found.special_points]
    with pytest.raises(vi.InvalidParameterError, match="its map is a function"):
        vi.save_curve(found, tmp_path / "map.nc")
    assert not list(tmp_path.iterdir())
    with pytest.raises(vi.InvalidParameterError, match="fixed points of a map"):
        curve_from_dataset(data)


def test_errors_name_what_is_wrong(torus: vi.BifurcationCurve, tmp_path: Path) -> None:
    with pytest.raises(vi.InvalidParameterError, match=r"must end in \.nc"):
        vi.save_curve(torus, tmp_path / "curve.txt")
    with pytest.raises(vi.InvalidParameterError, match=r"missing\.nc: cannot be read"):
        vi.load_curve(tmp_path / "missing.nc")
    branch = vi.continue_orbit(vi.symmetric_orbits(DAMPER)[0], "omega", (0.94, 0.96))
    vi.save_branch(branch, tmp_path / "branch.nc")
    with pytest.raises(vi.InvalidParameterError, match="'vibroimpact branch 1' must be"):
        vi.load_curve(tmp_path / "branch.nc")
    with pytest.raises(vi.InvalidParameterError, match="as continue_bifurcation gives"):
        vi.save_curve(branch, tmp_path / "curve.nc")  # type: ignore[arg-type]
    for lost in ("tangent", "special_z", "size"):
        with pytest.raises(vi.InvalidParameterError, match=f"{lost}.* missing"):
            curve_from_dataset(dataset_of(torus).drop_vars(lost))
    damaged = dataset_of(torus)
    damaged.attrs["kind"] = "XX"
    with pytest.raises(vi.InvalidParameterError, match="is damaged"):
        curve_from_dataset(damaged)


def test_a_failure_while_writing_leaves_the_old_file(
    torus: vi.BifurcationCurve, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    assert_full_disk_leaves_the_old_file(
        lambda path: vi.save_curve(torus, path), tmp_path / "curve.nc", monkeypatch
    )
