"""A result of a file is the result: it is gone on from with the same numbers, and what is wrong is said."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray as xr
from support.bifurcations import PLANE, oscillator_branch, torus_of_a_map, torus_of_set_a
from support.systems import paper_damper

import vibroimpact as vi
from vibroimpact._core.types import Complexes, Floats
from vibroimpact.results.files import FORMAT, TEXT, dataset_of, result_of
from vibroimpact.results.result import along, dataframe_of, rows

SET_A = paper_damper("A", 0.75)


def oscillator(k: float, wall: float) -> vi.Mechanism:
    return vi.Mechanism(
        mass=((1.0,),), damping=((0.1,),), stiffness=((k,),),
        forces=(vi.Harmonic(0.8, (1.0,)),),
        elements=(vi.RigidStop((1.0,), upper=wall, restitution=0.7),),
    )  # fmt: skip


@dataclass(frozen=True)
class Bench:
    """A class of the user's."""

    k: float
    wall: float

    @property
    def mechanism(self) -> vi.Mechanism:
        return oscillator(self.k, self.wall)


def again(result: Any, folder: Path, system: Any = None) -> Any:
    vi.save(result, folder / "result.nc")
    return vi.load(folder / "result.nc", system)


@pytest.fixture(scope="module")
def broken() -> vi.Branch:
    """With grazing, period doubling and the branch point at which it is born."""
    branch = vi.continue_orbit(vi.symmetric_orbits(SET_A)[0], "omega", (0.6, 0.8))
    found = vi.switch_branch(branch["BP1"], (0.6, 0.8))
    assert isinstance(found, vi.Branch)
    return found


@pytest.fixture(scope="module")
def stored(broken: vi.Branch, tmp_path_factory: pytest.TempPathFactory) -> vi.Branch:
    found = again(broken, tmp_path_factory.mktemp("branches"))
    assert isinstance(found, vi.Branch)
    return found


# ---- a result of a file is gone on from ------------------------------------------------------------


@pytest.mark.slow
def test_a_loaded_branch_is_gone_on_from_with_the_same_numbers(
    broken: vi.Branch, stored: vi.Branch
) -> None:
    far = int(np.argmin(broken.values))
    here, there = stored.orbit(far), broken.orbit(far)
    np.testing.assert_array_equal(here.states, there.states)
    on, expected = (vi.continue_orbit(orbit, "omega", (0.59, 0.62)) for orbit in (here, there))
    np.testing.assert_array_equal(on.curve.z, expected.curve.z)


@pytest.mark.slow
def test_a_loaded_special_point_is_switched_at_with_the_same_numbers(
    broken: vi.Branch, stored: vi.Branch
) -> None:
    assert repr(stored["PD1"].normal_form) == repr(broken["PD1"].normal_form)
    here, there = (vi.switch_branch(b["PD1"], (0.66, 0.67)) for b in (stored, broken))
    assert isinstance(here, vi.Branch)
    assert isinstance(there, vi.Branch)
    np.testing.assert_array_equal(here.curve.z, there.curve.z)


@pytest.mark.slow
def test_curves_followed_from_a_loaded_point_are_those_from_the_original(tmp_path: Path) -> None:
    torus = torus_of_set_a()
    loaded = again(torus, tmp_path)
    assert repr(loaded["R4_2"].normal_form) == repr(torus["R4_2"].normal_form)
    bounds = ((0.92, 0.94), (4.9, 5.2))
    here, there = (vi.continue_bifurcation(c["R4_2"], PLANE, bounds) for c in (loaded, torus))
    np.testing.assert_array_equal(here.curve.z, there.curve.z)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("label", "omega"), [("PD1", 2.3), ("ZERO1", 2.0), ("SN1", 2.0), ("GR1", 2.0)]
)
def test_curves_of_every_kind_keep_their_equations(
    label: str, omega: float, tmp_path: Path
) -> None:
    bounds = ((0.8, 1.2), (0.0, 1.2))
    point = oscillator_branch(omega)[label]
    assert_same_equations(vi.continue_bifurcation(point, ("force", "clearance"), bounds), tmp_path)


def assert_same_equations(found: vi.BifurcationCurve, folder: Path, system: Any = None) -> None:
    loaded = again(found, folder, system)
    assert repr(loaded) == repr(found)
    Z, p = found.curve.z[3], float(found.values[3, 1])
    for name in ("residual", "jacobian"):
        here, there = (getattr(curve.problem, name)(Z, p) for curve in (loaded, found))
        np.testing.assert_equal(here, there)
    # test functions have a positive factor that is chosen where they are first computed: zeros and signs are theirs
    here, there = (curve.problem.watch(Z[None], np.array([p])) for curve in (loaded, found))
    assert {name: np.sign(x).tolist() for name, x in here.items()} == {
        name: np.sign(x).tolist() for name, x in there.items()
    }


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
def test_a_curve_of_two_impacts_at_once_keeps_its_equations(tmp_path: Path) -> None:
    system = vi.Family(meeting, omega=1.3, k=1.0)
    orbits = vi.find_orbits(system, most_cycles=1, most_impacts=3, starts=10).orbits
    start = next(orbit for orbit in orbits if orbit.symbol == "1-1-0,1-1")
    point = vi.continue_orbit(start, "omega", (1.19, 1.31), inadmissible=True)["SIM1"]
    bounds, few = ((1.19, 1.31), (0.99, 1.01)), vi.Steps(points=8)
    found = vi.continue_bifurcation(point, ("omega", "k"), bounds, steps=few)
    flights = [found.orbit(i).durations[point.segment] for i in range(len(found))]
    assert np.abs(flights).max() < 1e-12
    assert_same_equations(found, tmp_path, system)


def test_points_and_normal_forms_are_saved_too(broken: vi.Branch, tmp_path: Path) -> None:
    point = broken["PD1"]
    assert repr(again(point, tmp_path).normal_form) == repr(point.normal_form)
    assert repr(again(point.normal_form, tmp_path)) == repr(point.normal_form)


# ---- code is given again ---------------------------------------------------------------------------


@pytest.mark.parametrize("system", [vi.Family(oscillator, k=1.0, wall=0.5), Bench(k=1.0, wall=0.5)])
@pytest.mark.slow
def test_code_is_that_of_the_given_system_and_numbers_are_those_of_the_file(
    system: Any, tmp_path: Path
) -> None:
    orbit = vi.find_orbit(system, vi.State((0.0,), (0.0,)))
    branch = vi.continue_orbit(orbit, "k", (0.98, 1.02))
    with pytest.raises(vi.InvalidParameterError, match="is code, which the file"):
        again(branch, tmp_path)
    same_code = type(system)(
        *([oscillator] if isinstance(system, vi.Family) else []), k=3.0, wall=2.0
    )
    loaded = vi.load(tmp_path / "result.nc", same_code)
    assert repr(loaded.family.system) == repr(system)
    np.testing.assert_array_equal(loaded.orbit(0).states, branch.orbit(0).states)


def test_other_code_than_the_stored_one_is_refused(tmp_path: Path) -> None:
    run = vi.simulate(vi.Family(oscillator, k=1.0, wall=0.5), vi.State((0.0,), (0.0,)), impacts=5)
    loaded = again(run, tmp_path)  # what needs no code does without it
    np.testing.assert_array_equal(loaded.at(1.0), run.at(1.0))
    with pytest.raises(
        vi.InvalidParameterError, match=r"holds a result of .*oscillator.* Give that"
    ):
        vi.load(tmp_path / "result.nc", vi.Family(meeting, omega=1.0, k=1.0))
    vi.save(vi.simulate(SET_A, vi.State((0.0, 0.0), (0.0, 1.0)), impacts=5), tmp_path / "own.nc")
    with pytest.raises(vi.InvalidParameterError, match="its own system with all numbers"):
        vi.load(tmp_path / "own.nc", SET_A)


@pytest.mark.slow
def test_a_curve_of_a_map_is_loaded_with_the_map(tmp_path: Path) -> None:
    torus = torus_of_a_map()
    henon = torus.problem.equations.map  # type: ignore[attr-defined]
    loaded = again(torus, tmp_path, henon)
    assert repr(loaded["R3_1"].normal_form) == repr(torus["R3_1"].normal_form)


@pytest.mark.slow
def test_a_level_comes_back_without_its_function_and_says_so(tmp_path: Path) -> None:
    found = vi.continue_level(
        vi.symmetric_orbits(paper_damper("A", 0.95))[0],
        lambda states, _durations, _parameters: states[0, 2] - states[0, 3],
        PLANE, ((0.94, 0.96), (4.9, 5.1)),
    )  # fmt: skip
    loaded = again(found, tmp_path)
    np.testing.assert_array_equal(loaded.orbit(2).states, found.orbit(2).states)
    with pytest.raises(
        vi.InvalidParameterError, match=r"lambda.* is code, which the file does not"
    ):
        loaded.problem.residual(loaded.curve.z[0], float(loaded.values[0, 1]))


# ---- the dataset and the table ---------------------------------------------------------------------


def test_the_file_tells_a_stranger_what_it_holds(broken: vi.Branch, tmp_path: Path) -> None:
    vi.save(broken, tmp_path / "branch.nc")
    with xr.open_dataset(tmp_path / "branch.nc", engine="h5netcdf") as data:
        assert data.attrs["format"] == FORMAT
        assert data.attrs["system"] == repr(broken.family.system)
        assert data.attrs["version"] == vi.__version__
        assert data.attrs["symbol"] == "1-1-1"
        assert list(data.special_label.values) == [p.label for p in broken.special_points]
        np.testing.assert_array_equal(data["values"], broken.values)
        multipliers = data["multipliers_real"] + 1j * data["multipliers_imaginary"]
        np.testing.assert_array_equal(multipliers, broken.multipliers)


@dataclass(frozen=True)
class Mark:
    label: str
    place: float | None
    inner: tuple[int, ...] = ()


@dataclass(frozen=True)
class Toy(vi.Result):
    """A result that says nothing but what its fields are."""

    name: str
    time: Floats = field(metadata=along("event", units="s"))
    place: Floats = field(metadata=along("event", "coordinate"))
    roots: Complexes = field(metadata=along("root"))
    marks: tuple[Mark, ...] = field(metadata=rows("mark"))


def test_a_result_is_converted_by_the_declaration_of_its_fields() -> None:
    marks = (Mark("a", 1.0), Mark("b", None))
    toy = Toy("toy", np.arange(3.0), np.arange(6.0).reshape(3, 2), np.array([1j]), marks)
    data = toy.to_dataset()
    assert data.attrs["name"] == "toy"
    assert data["time"].attrs == {"units": "s"}
    assert data["place"].dims == ("event", "coordinate")
    assert (float(data["roots_real"][0]), float(data["roots_imaginary"][0])) == (0.0, 1.0)
    assert list(data["mark_label"].values) == ["a", "b"]
    np.testing.assert_array_equal(data["mark_place"], [1.0, np.nan])
    assert "mark_inner" not in data
    table = toy.to_dataframe()
    assert [*table] == ["time", "place_0", "place_1"]
    np.testing.assert_array_equal(table["place_1"], toy.place[:, 1])


def test_numbers_of_a_table_are_written_to_the_last_bit(broken: vi.Branch, tmp_path: Path) -> None:
    vi.save(broken, tmp_path / "branch.csv")
    head, *lines = (tmp_path / "branch.csv").read_text(encoding="utf-8").splitlines()
    column = head.split(",").index("values")
    assert [float(line.split(",")[column]) for line in lines] == broken.values.tolist()


def test_a_sweep_comes_back_and_its_table_has_a_row_for_each_member(tmp_path: Path) -> None:
    over = {"omega": [1.1, 1.2], "zeta": [0.04, 0.05, 0.06]}
    start = vi.State((0.0, 0.0), (0.0, 1.0))
    found = vi.sweep(SET_A, over=over, start=start, settle_periods=5, periods=5, progress=False)
    xr.testing.assert_identical(again(found, tmp_path), found)
    one = found.isel(omega=0, zeta=0).assign_coords(direction="up")  # a word without a dim
    xr.testing.assert_identical(again(one, tmp_path), one)
    table = dataframe_of(found)
    assert len(table) == 6
    assert list(zip(table["omega"], table["zeta"], strict=True))[:2] == [(1.1, 0.04), (1.1, 0.05)]


# ---- what is wrong is said -------------------------------------------------------------------------


def test_errors_name_what_is_wrong(broken: vi.Branch, tmp_path: Path) -> None:
    with pytest.raises(vi.InvalidParameterError, match=r"must end in \.nc, \.csv"):
        vi.save(broken, tmp_path / "branch.txt")
    with pytest.raises(vi.InvalidParameterError, match="must be a folder"):
        vi.save(broken, tmp_path / "nowhere" / "branch.nc")
    with pytest.raises(vi.InvalidParameterError, match="must be a result"):
        vi.save({"a": 1}, tmp_path / "branch.nc")
    with pytest.raises(vi.InvalidParameterError, match=r"missing\.nc: cannot be read"):
        vi.load(tmp_path / "missing.nc")
    (tmp_path / "text.nc").write_text("no netCDF", encoding="utf-8")
    with pytest.raises(vi.InvalidParameterError, match=r"text\.nc: cannot be read"):
        vi.load(tmp_path / "text.nc")


def test_a_file_of_another_format_is_refused(broken: vi.Branch) -> None:
    with pytest.raises(vi.InvalidParameterError, match="format None must be"):
        result_of(xr.Dataset())
    older = dataset_of(broken).assign_attrs(format="vibroimpact result 0")
    with pytest.raises(vi.InvalidParameterError, match="'vibroimpact result 0' must be"):
        result_of(older)


def test_a_damaged_file_is_refused(broken: vi.Branch) -> None:
    data = dataset_of(broken)
    for lost in ("values", "stored_float64"):
        with pytest.raises(
            vi.InvalidParameterError, match=f"'{lost.removeprefix('stored_')}' is missing"
        ):
            result_of(data.drop_vars(lost))
    text = data[TEXT].values.tobytes()
    for old, new in (
        (b'"tuple"', b'"tulpe"'),
        (b"vibroimpact.branches", b"vibroimpact.branched"),
        (b"vibroimpact.", b"subprocess:."),
    ):
        wrong = np.frombuffer(text.replace(old, new), dtype=np.uint8)
        with pytest.raises(vi.InvalidParameterError, match="data: "):
            result_of(data.drop_vars(TEXT).assign({TEXT: ("other", wrong)}))


@pytest.mark.parametrize("suffix", [".nc", ".csv"])
def test_a_full_disk_is_an_error_that_names_it(
    suffix: str, broken: vi.Branch, tmp_path: Path
) -> None:
    path = tmp_path / f"full{suffix}"
    path.symlink_to("/dev/full")
    with pytest.raises(vi.InvalidParameterError, match=r"full.*No space left on device"):
        vi.save(broken, path)
