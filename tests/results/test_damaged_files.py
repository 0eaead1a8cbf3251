"""A file that is not what was written is refused, and one that was made to do harm does none."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable, Iterator
from io import BytesIO
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest
import xarray as xr

import vibroimpact as vi
from vibroimpact.results.files import SEAL, TEXT, dataset_of, netcdf_in, result_of

OSCILLATOR = vi.ImpactOscillator(omega=0.8, zeta=0.05, restitution=0.7, clearance=0.5, force=1.0)


@pytest.fixture(scope="module")
def run() -> vi.Run:
    return vi.simulate(OSCILLATOR, vi.State((0.0,), (0.0,)), impacts=20)


@pytest.fixture(scope="module")
def content(run: vi.Run, tmp_path_factory: pytest.TempPathFactory) -> bytes:
    path = tmp_path_factory.mktemp("run") / "run.nc"
    vi.save(run, path)
    return path.read_bytes()


def sealed(netcdf: bytes) -> bytes:
    """A file with the digest of its content, as anybody can make one."""
    return netcdf + SEAL + hashlib.sha256(netcdf).hexdigest().encode()


# ---- damage ----------------------------------------------------------------------------------------


def changed_bytes(content: bytes, count: int) -> Iterator[bytes]:
    """Contents in each of which a random byte is another."""
    draws = np.random.default_rng(count)
    for at, change in zip(
        draws.integers(len(content), size=count), draws.integers(1, 256, size=count), strict=True
    ):
        yield content[:at] + bytes([content[at] ^ change]) + content[at + 1 :]


def test_a_changed_byte_anywhere_is_refused(content: bytes, tmp_path: Path) -> None:
    path = tmp_path / "run.nc"
    for other in changed_bytes(content, 200):
        path.write_bytes(other)
        with pytest.raises(vi.InvalidParameterError, match=r"is damaged, or was|no netCDF file"):
            vi.load(path)


@pytest.mark.slow
def test_many_changed_bytes_are_refused(content: bytes) -> None:
    for other in changed_bytes(content, 10_000):
        with pytest.raises(vi.InvalidParameterError):
            netcdf_in("path = run.nc", other, damaged=False)


def test_a_file_cut_anywhere_is_refused(content: bytes, tmp_path: Path) -> None:
    path = tmp_path / "run.nc"
    for length in range(0, len(content), 997):
        path.write_bytes(content[:length])
        with pytest.raises(vi.InvalidParameterError, match=r"is damaged, or was|no netCDF file"):
            vi.load(path)


def test_a_file_that_another_program_changed_is_read_on_request(
    run: vi.Run, content: bytes, tmp_path: Path
) -> None:
    path = tmp_path / "run.nc"
    path.write_bytes(content)
    with h5py.File(path, "a") as file:
        file.attrs["remark"] = "mine"
    with pytest.raises(vi.InvalidParameterError, match=r"load\(path, damaged=True\) reads"):
        vi.load(path)
    np.testing.assert_array_equal(vi.load(path, damaged=True).time, run.time)


def test_programs_that_read_netcdf_do_not_notice_the_digest(
    run: vi.Run, content: bytes, tmp_path: Path
) -> None:
    (tmp_path / "run.nc").write_bytes(content)
    with xr.open_dataset(tmp_path / "run.nc", engine="h5netcdf") as data:
        np.testing.assert_array_equal(data["time"], run.time)


# ---- files that are made to do harm ----------------------------------------------------------------


def changed(content: bytes, change: Callable[[h5py.File], object]) -> bytes:
    """A file of which the HDF5 is changed, with the right digest."""
    whole = BytesIO(content[: -len(SEAL) - 64])
    with h5py.File(whole, "a") as file:
        change(file)
    return sealed(whole.getvalue())


HARM: dict[str, tuple[Callable[[h5py.File], object], str]] = {
    "a scale": (lambda f: f["time"].attrs.update({"scale_factor": 2.0, "add_offset": 1.0}), ""),
    "a calendar": (lambda f: f["time"].attrs.update({"units": "days since 1900-01-01"}), ""),
    "a link": (lambda f: f.update({"linked": h5py.ExternalLink("other.nc", "/time")}), "is a link"),
    "a group": (lambda f: f.create_group("more"), "is no array"),
    "another file": (
        lambda f: f.create_dataset("raw", (4,), "u1", external=[("/etc/passwd", 0, 4)]), "in another file",
    ),
    "a virtual array": (
        lambda f: f.create_virtual_dataset("seen", h5py.VirtualLayout((4,), "u1")), "in another file",
    ),
    "a packed array": (
        lambda f: f.create_dataset("zeros", data=np.zeros(10**6), compression="gzip"), "packed",
    ),
    "a huge array": (
        lambda f: f.create_dataset("huge", (10**12,), "f8", chunks=(10**4,)), "larger than the file",
    ),
}  # fmt: skip


@pytest.mark.parametrize(("change", "said"), HARM.values(), ids=HARM)
def test_what_hdf5_can_do_beside_arrays_is_refused_or_without_effect(
    change: Callable[[h5py.File], object], said: str, run: vi.Run, content: bytes, tmp_path: Path
) -> None:
    path = tmp_path / "run.nc"
    path.write_bytes(changed(content, change))
    if said:
        with pytest.raises(vi.InvalidParameterError, match=f"cannot be read .*{said}"):
            vi.load(path)
    else:
        np.testing.assert_array_equal(vi.load(path).time, run.time)


def _objects(change: Callable[[Any], Any]) -> Callable[[str], str]:
    """A change of the objects of a text."""

    def changing(text: str) -> str:
        tree = json.loads(text)
        change(tree["objects"])
        return json.dumps(tree)

    return changing


def _everywhere(old: str, new: str) -> Callable[[str], str]:
    return lambda text: text.replace(old, new)


def _argument(name: str, value: Any) -> Callable[[str], str]:
    """The run with another argument."""
    return _objects(lambda objects: objects[0]["arguments"].update({name: value}))


TEXTS: dict[str, Callable[[str], str]] = {
    "depth": lambda _: "[" * 100_000,
    "digits": lambda _: '{"objects": [], "root": ' + "1" * 5_000 + "}",
    "no text": lambda _: "\x00",
    "a circle": _argument("system", {"object": 0}),
    "another package": _everywhere("vibroimpact.machines.impact_oscillator:ImpactOscillator", "os:system"),
    "a room that writes": _everywhere(
        "vibroimpact.machines.impact_oscillator:ImpactOscillator", "vibroimpact.cli.main:main"
    ),
    "no array": _argument("time", 1.0),
    "another type": _argument("time", {"words": ["a"], "dtype": "<U1", "shape": [1]}),
    "other lengths": _argument("time", {"array": "float64", "at": 0, "shape": [3], "writeable": False}),
    "more than there is": _argument(
        "time", {"array": "float64", "at": 0, "shape": [10**9], "writeable": False}
    ),
    "large words": _argument("time", {"words": ["a"], "dtype": "<U1000000000", "shape": [1]}),
    "no status": _everywhere('"name": "', '"name": "UN'),
    "an unknown argument": _argument("command", "rm"),
}  # fmt: skip


@pytest.mark.parametrize("change", TEXTS.values(), ids=TEXTS)
def test_objects_that_no_result_has_are_refused(change: Callable[[str], str], run: vi.Run) -> None:
    data = dataset_of(run)
    text = change(data[TEXT].values.tobytes().decode()).encode()
    made = data.drop_vars(TEXT).assign({TEXT: ("other", np.frombuffer(text, dtype=np.uint8))})
    with pytest.raises(vi.InvalidParameterError, match="data: "):
        result_of(made)


# ---- datasets of sweeps ------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def swept() -> xr.Dataset:
    return vi.plane(
        OSCILLATOR, over={"omega": [0.8, 0.9], "force": [1.0, 1.1]}, start=vi.State((0.0,), (0.0,)),
        observe=["lyapunov", "speeds"], settle_periods=3, periods=5, progress=False,
    )  # fmt: skip


def _first(name: str, value: float) -> Callable[[xr.Dataset], xr.Dataset]:
    """A dataset in which the first number of a variable is another."""

    def changing(data: xr.Dataset) -> xr.Dataset:
        values = data[name].values.copy()
        values.flat[0] = value
        return data.assign({name: (data[name].dims, values, data[name].attrs)})

    return changing


MEMBERS: dict[str, tuple[Callable[[xr.Dataset], xr.Dataset], str]] = {
    "a reason": (_first("end", 77), "end holds a code that means nothing"),
    "a motion": (_first("motion", -99), "motion holds a code that means nothing"),
    "a count": (_first("n", -3), "n holds what no sweep returns: .* from 0 to"),
    "a speed": (_first("speed_mean", -1.0), "speed_mean holds what no sweep returns"),
    "an exponent": (_first("lyapunov", np.inf), "lyapunov holds what no sweep returns"),
    "a type": (lambda data: data.assign(n=data.n.astype(float)), "n holds what .* of type int16"),
    "periods": (lambda data: data.assign_attrs(periods=-1.0), "periods = -1.0: must be > 0"),
    "an observer": (
        lambda data: data.assign_attrs(observe=data.attrs["observe"].replace("speeds", "sp")), "are damaged",
    ),
    "a machine": (lambda data: data.assign_attrs(mechanism="{}"), "system: is described otherwise"),
}  # fmt: skip


@pytest.mark.parametrize(("change", "said"), MEMBERS.values(), ids=MEMBERS)
def test_numbers_that_no_sweep_returns_are_refused(
    change: Callable[[xr.Dataset], xr.Dataset], said: str, swept: xr.Dataset, tmp_path: Path
) -> None:
    vi.save(change(swept), tmp_path / "plane.nc")
    with pytest.raises(vi.InvalidParameterError, match=said):
        vi.load(tmp_path / "plane.nc")
    vi.load(tmp_path / "plane.nc", damaged=True)


@pytest.mark.parametrize(
    "change",
    [
        _first("lyapunov", -np.inf), _first("speed_mean", np.nan),
        lambda data: data.isel(omega=0), lambda data: data[["n", "end"]],
        lambda data: data.assign(n=("own", [-1.5], {"long_name": "mine"})),
    ],
    ids=["forgotten", "none", "a row", "two variables", "an own variable"],
)  # fmt: skip
def test_what_a_sweep_or_its_user_may_have_made_is_read(
    change: Callable[[xr.Dataset], xr.Dataset], swept: xr.Dataset, tmp_path: Path
) -> None:
    vi.save(change(swept), tmp_path / "plane.nc")
    xr.testing.assert_equal(vi.load(tmp_path / "plane.nc"), change(swept))
