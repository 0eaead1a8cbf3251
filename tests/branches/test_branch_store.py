"""A stored branch is the branch: the same numbers, and it can be gone on from."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from support.files import assert_full_disk_leaves_the_old_file

import vibroimpact as vi
from vibroimpact.branches.store import branch_from, dataset_of, load_branch, save_branch
from vibroimpact.machines.json_text import system_of, text_of

SET_A = vi.ImpactDamper(
    mass_ratio=0.1, omega_n=0.5, zeta=0.045, restitution=0.8, half_clearance=5.0, omega=0.75
)
RANGE = (0.6, 0.8)
OSCILLATOR = vi.Mechanism(
    mass=((1.0,),),
    damping=((0.1,),),
    stiffness=((1.0,),),
    forces=(vi.Harmonic(0.8, (1.0,)),),
    elements=(vi.RigidStop((1.0,), upper=0.5, restitution=0.7),),
)


def oscillator(k: float, wall: float) -> vi.Mechanism:
    return vi.Mechanism(
        mass=((1.0,),), damping=((0.1,),), stiffness=((k,),),
        forces=(vi.Harmonic(0.8, (1.0,)),),
        elements=(vi.RigidStop((1.0,), upper=wall, restitution=0.7),),
    )  # fmt: skip


def settled(system: vi.Mechanism | vi.Family) -> vi.Orbit:
    orbit = vi.find_orbit(system, vi.State((0.0,), (0.0,)))
    assert orbit.converged
    return orbit


@pytest.fixture(scope="module")
def broken() -> vi.Branch:
    """With grazing, period doubling and the branch point at which it is born."""
    branch = vi.continue_orbit(vi.symmetric_orbits(SET_A)[0], "omega", RANGE)
    found = vi.switch_branch(branch["BP1"], RANGE)
    assert isinstance(found, vi.Branch)
    return found


@pytest.fixture(scope="module")
def stored(broken: vi.Branch, tmp_path_factory: pytest.TempPathFactory) -> vi.Branch:
    path = tmp_path_factory.mktemp("branches") / "broken.nc"
    save_branch(broken, path)
    return load_branch(path)


def test_every_number_comes_back_to_the_last_bit(broken: vi.Branch, stored: vi.Branch) -> None:
    assert repr(stored) == repr(broken)
    for name in ("values", "multipliers", "admissible", "stable", "clearance", "impact_speed"):
        np.testing.assert_array_equal(getattr(stored, name), getattr(broken, name))
        assert getattr(stored, name).dtype == getattr(broken, name).dtype
    for name in ("z", "tangent", "arclength", "residual", "steps", "panel"):
        np.testing.assert_array_equal(getattr(stored.curve, name), getattr(broken.curve, name))
    assert list(stored.curve.tests) == list(broken.curve.tests)
    for name, values in broken.curve.tests.items():
        np.testing.assert_array_equal(stored.curve.tests[name], values)
    assert stored.curve.ends == broken.curve.ends
    assert stored.curve.start == broken.curve.start
    assert stored.curve.unresolved == broken.curve.unresolved
    np.testing.assert_array_equal(stored.family.scale(), broken.family.scale())
    assert stored.family.system == SET_A or repr(stored.family.system) == repr(broken.family.system)


def test_zeros_of_the_test_functions_come_back(broken: vi.Branch, stored: vi.Branch) -> None:
    assert len(stored.curve.special) == len(broken.curve.special) > 0
    for here, there in zip(stored.curve.special, broken.curve.special, strict=True):
        assert (here.name, here.parameter, here.arclength, here.error, here.crossing) == (
            there.name, there.parameter, there.arclength, there.error, there.crossing,
        )  # fmt: skip
        np.testing.assert_array_equal(here.z, there.z)
        np.testing.assert_array_equal(here.tangent, there.tangent)


def test_special_points_come_back_with_their_normal_forms(
    broken: vi.Branch, stored: vi.Branch
) -> None:
    assert {point.kind for point in broken.special_points} == {"GR", "PD", "BP"}
    for here, there in zip(stored.special_points, broken.special_points, strict=True):
        assert repr(here) == repr(there)
        assert here.parameter == there.parameter
        assert here.error == there.error
        assert (here.crossing, here.segment) == (there.crossing, there.segment)
        assert here.nearest == there.nearest
        np.testing.assert_array_equal(here.orbit.states, there.orbit.states)
        np.testing.assert_array_equal(here.tangent, there.tangent)
    assert repr(stored["PD1"].normal_form) == repr(broken["PD1"].normal_form)


def test_a_loaded_branch_is_gone_on_from_with_the_same_numbers(
    broken: vi.Branch, stored: vi.Branch
) -> None:
    far = int(np.argmin(broken.values))
    here, there = stored.orbit(far), broken.orbit(far)
    np.testing.assert_array_equal(here.states, there.states)
    assert here.residual == there.residual
    assert here.converged
    bounds = (0.59, 0.62)
    on, expected = (vi.continue_orbit(orbit, "omega", bounds) for orbit in (here, there))
    np.testing.assert_array_equal(on.curve.z, expected.curve.z)


def test_a_loaded_special_point_is_switched_at_with_the_same_numbers(
    broken: vi.Branch, stored: vi.Branch
) -> None:
    bounds = (0.66, 0.67)
    here, there = (vi.switch_branch(b["PD1"], bounds) for b in (stored, broken))
    assert isinstance(here, vi.Branch)
    assert isinstance(there, vi.Branch)
    np.testing.assert_array_equal(here.curve.z, there.curve.z)


def test_the_file_tells_a_stranger_what_it_holds(broken: vi.Branch) -> None:
    data = dataset_of(broken)
    assert data.attrs["parameter"] == "omega"
    assert data.attrs["system"] == repr(broken.family.system)
    assert data.attrs["version"] == vi.__version__
    assert data.attrs["symbol"] == "1-1-1"
    assert (data.attrs["low"], data.attrs["high"]) == broken.bounds == RANGE
    assert list(data.special_label.values) == [p.label for p in broken.special_points]
    assert "RANGE" in data.attrs["ends"]
    assert dict(data.sizes)["point"] == len(broken)


def test_a_branch_without_special_points_is_stored(tmp_path: Path) -> None:
    branch = vi.continue_orbit(vi.symmetric_orbits(SET_A)[0], "omega", (0.74, 0.76))
    assert not branch.special_points
    save_branch(branch, tmp_path / "plain.nc")
    assert repr(load_branch(tmp_path / "plain.nc")) == repr(branch)


@pytest.mark.parametrize("parameter", ["omega", "elements[0].restitution"])
def test_a_branch_of_a_mechanism_is_stored_with_its_numbers(tmp_path: Path, parameter: str) -> None:
    value = 0.8 if parameter == "omega" else 0.7
    orbit = settled(OSCILLATOR)
    branch = vi.continue_orbit(orbit, parameter, (value - 0.02, value + 0.02))
    save_branch(branch, tmp_path / "mechanism.nc")
    loaded = load_branch(tmp_path / "mechanism.nc")
    assert repr(loaded.family.system) == repr(OSCILLATOR)
    np.testing.assert_array_equal(loaded.orbit(0).multipliers, branch.orbit(0).multipliers)


def test_systems_survive_as_text() -> None:
    scaled = vi.ImpactDamper.from_physical(
        M1=10.0, M2=0.8, K=4.0e4, C=40.0, F0=60.0, Omega=66.0, D=6.0e-3, restitution=0.6
    )
    back = system_of(text_of(scaled))
    assert back == scaled
    assert isinstance(back, vi.ImpactDamper)
    assert back.scales == scaled.scales
    two = vi.Mechanism(
        mass=((1.0, 0.1), (0.1, 1.0 / 3.0)), damping=((0.1, 0.0), (0.0, 0.2)),
        stiffness=((2.0, -1.0), (-1.0, 1.0)), constant_force=(0.0, -0.1),
        forces=(vi.Harmonic(1.0, (1.0, 0.0), (0.0, 0.5)), vi.Harmonic(2.0, (0.0, 0.1))),
        elements=(vi.RigidStop((1.0, 0.0), lower=-math.pi, restitution=(0.5, 0.25)),),
    )  # fmt: skip
    assert repr(system_of(text_of(two))) == repr(two)
    assert "Infinity" not in text_of(two)


def test_a_family_is_loaded_with_the_system_that_was_stored(tmp_path: Path) -> None:
    family = vi.Family(oscillator, k=1.0, wall=0.5)
    branch = vi.continue_orbit(settled(family), "k", (0.98, 1.02))
    path = tmp_path / "family.nc"
    save_branch(branch, path)
    with pytest.raises(vi.InvalidParameterError, match=r"Family\(oscillator, k=1.0, wall=0.5\)"):
        load_branch(path)
    elsewhere = vi.Family(oscillator, k=3.0, wall=0.5)  # its own value of k is of no consequence
    loaded = load_branch(path, elsewhere)
    np.testing.assert_array_equal(loaded.orbit(0).states, branch.orbit(0).states)
    with pytest.raises(vi.InvalidParameterError, match=r"wall=0.6.*Give that one"):
        load_branch(path, vi.Family(oscillator, k=1.0, wall=0.6))


def test_another_system_than_the_stored_one_is_refused(broken: vi.Branch) -> None:
    with pytest.raises(vi.InvalidParameterError, match=r"restitution=0\.5"):
        branch_from(
            dataset_of(broken),
            vi.ImpactDamper(
                mass_ratio=0.1, omega_n=0.5, zeta=0.045, restitution=0.5, half_clearance=5.0,
                omega=0.75,
            ),
        )  # fmt: skip


def test_errors_name_what_is_wrong(broken: vi.Branch, tmp_path: Path) -> None:
    with pytest.raises(vi.InvalidParameterError, match=r"must end in \.nc"):
        save_branch(broken, tmp_path / "branch.txt")
    with pytest.raises(vi.InvalidParameterError, match="must be a folder"):
        save_branch(broken, tmp_path / "nowhere" / "branch.nc")
    with pytest.raises(vi.InvalidParameterError, match=r"missing\.nc: cannot be read"):
        load_branch(tmp_path / "missing.nc")
    (tmp_path / "text.nc").write_text("no netCDF", encoding="utf-8")
    with pytest.raises(vi.InvalidParameterError, match=r"text\.nc: cannot be read"):
        load_branch(tmp_path / "text.nc")
    with pytest.raises(vi.InvalidParameterError, match="format None must be"):
        branch_from(xr.Dataset())
    for lost in ("tangent", "special_z"):
        with pytest.raises(vi.InvalidParameterError, match=f"{lost}.* missing"):
            branch_from(dataset_of(broken).drop_vars(lost))


def test_a_failure_while_writing_leaves_the_old_file(
    broken: vi.Branch, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    assert_full_disk_leaves_the_old_file(
        lambda path: save_branch(broken, path), tmp_path / "branch.nc", monkeypatch
    )
