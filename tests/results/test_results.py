"""Every class of results has a picture, a dataset and a table, and comes back from a file with the same bits."""

from __future__ import annotations

import copy
import importlib
import inspect
import json
import math
import pickle
import pkgutil
import re
import sys
from collections.abc import Callable, Iterator, Mapping
from dataclasses import replace
from enum import Enum
from functools import cache
from pathlib import Path
from typing import Any

import matplotlib.pyplot as plt
import numpy as np
import pytest
import xarray as xr
from support.bifurcations import oscillator_branch, torus_of_set_a
from support.systems import paper_damper

import vibroimpact as vi
from vibroimpact.results import fields
from vibroimpact.results.files import STORED, TEXT, dataset_of, result_of
from vibroimpact.results.tree import ROOMS

pytestmark = pytest.mark.usefixtures("no_windows")

SET_A = paper_damper("A", 0.95)
START = vi.State((0.0, 0.0), (0.0, 1.0))
FEW = vi.Steps(first=0.02, largest=0.5, points=12)
OSCILLATOR = vi.Mechanism(
    mass=((1.0,),), damping=((0.1,),), stiffness=((1.0,),),
    forces=(vi.Harmonic(0.8, (1.0,)),),
    elements=(vi.RigidStop((1.0,), upper=0.5, restitution=0.7), vi.Friction((1.0,), 0.05)),
)  # fmt: skip
RELAY = vi.HybridSystem(
    modes={"on": vi.LinearMode([[-1.0]], [3.0]), "off": vi.LinearMode([[-1.0]], [0.0])},
    guards={"top": vi.LinearGuard([1.0], 2.0), "low": vi.LinearGuard([1.0], 1.0)},
    transitions=(
        vi.Transition("on", "top", "rising", "off"), vi.Transition("off", "low", "falling", "on"),
    ),
)  # fmt: skip
RECORD = vi.ForceRecord(np.linspace(0.0, 10.0, 21), np.sin(np.linspace(0.0, 10.0, 21)))


def spinning(x: Any, p: Any) -> list[Any]:
    """A circle, and a direction beside it in which it doubles at p = 1."""
    grow = 1.2 - 0.2 * (x[0] ** 2 + x[1] ** 2)
    return [grow * (0.28 * x[0] - 0.96 * x[1]), grow * (0.96 * x[0] + 0.28 * x[1]),
            -p * x[2] + x[2] ** 3]  # fmt: skip


SPIN = vi.ExplicitMap(spinning, dimension=3)


@cache
def orbit() -> vi.Orbit:
    return vi.find_orbit(SET_A, vi.symmetric_orbits(SET_A)[0])


@cache
def circle() -> vi.Circle:
    return vi.find_circle(SPIN, (1.0, 0.0, 0.0), p=0.9, settle_iterates=500, points=500)


@cache
def objective() -> vi.Objective:
    return vi.Objective("omega", (0.9, 1.0), points=2, starts=1, settle_periods=20, periods=10)


def tongue() -> vi.Tongue:
    torus = torus_of_set_a()
    return vi.Tongue(torus["2/9_1"], (torus, torus), 0.1)


EXAMPLES: dict[str, Callable[[], Any]] = {
    "Atlas": lambda: vi.Atlas(
        ("omega", "half_clearance"), ((0.8, 1.05), (3.5, 8.0)), (torus_of_set_a(),), ("none",), True
    ),
    "Attractor": lambda: vi.classify(SET_A, START, points=64, settle_events=50),
    "BifurcationCurve": torus_of_set_a,
    "Branch": lambda: oscillator_branch(),
    "Circle": circle,
    "CircleBranch": lambda: vi.continue_circle(circle(), "p", (0.85, 1.05)),
    "Design": lambda: vi.optimise(
        SET_A, {"half_clearance": (4.0, 6.0)}, objective(), budget=32, progress=False
    ),
    "DesignMap": lambda: vi.design_map(
        SET_A, {"half_clearance": [4.0, 5.0], "zeta": [0.04, 0.05]}, objective(), progress=False
    ),
    "Diagram": lambda: vi.branch_diagram(orbit(), "omega", (0.94, 0.96), points=2, steps=FEW),
    "ForceRecord": lambda: RECORD,
    "FreeDecay": lambda: vi.free_decay(SET_A, {"v1": 1.0}),
    "HybridRun": lambda: vi.simulate_hybrid(RELAY, "on", [0.0], t_max=5.0),
    "LyapunovEstimate": lambda: vi.lyapunov_exponent(SET_A, START, impacts=1024, settle_impacts=1),
    "LyapunovSpectrum": lambda: vi.lyapunov_spectrum(SET_A, START, impacts=1024, settle_impacts=1),
    "Orbit": orbit,
    "OrbitSearch": lambda: vi.find_orbits(SET_A, most_cycles=1, most_impacts=2, starts=5),
    "ParetoFront": lambda: vi.pareto_front(
        SET_A, {"half_clearance": (4.0, 6.0)},
        (objective(), replace(objective(), kind="mean")),
        budget=64, progress=False,
    ),
    "RecordResponse": lambda: vi.simulate_record(SET_A, RECORD),
    "Response": lambda: vi.frequency_response(
        SET_A, "omega", (0.94, 0.96), points=3, starts=1, settle_periods=50, periods=20, steps=FEW,
    ),
    "ResponseSpectrum": lambda: vi.response_spectrum(RECORD, [1.0, 2.0, 3.0], clearance=0.2),
    "Run": lambda: vi.simulate(OSCILLATOR, vi.State((0.0,), (0.0,)), impacts=30),
    "Section": lambda: vi.section(SET_A, START, points=30),
    "SineSweep": lambda: vi.sine_sweep(SET_A, "omega", (0.9, 1.0), points=4, progress=False),
    "Tongue": tongue,
    "Touch": lambda: oscillator_branch()["GR2"].normal_form,
    "TunedDamper": lambda: vi.tuned_damper(0.05, optimum="den hartog"),
}  # fmt: skip
CODE = {"Circle": SPIN, "CircleBranch": SPIN}  # what a file cannot hold


@cache
def example(name: str) -> Any:
    return EXAMPLES[name]()


def classes_of_results() -> set[str]:
    """Names of all classes of results, as far as they are no base of others."""
    for module in pkgutil.walk_packages(vi.__path__, "vibroimpact."):
        if not module.name.endswith("__main__") and "._kernel" not in module.name:
            importlib.import_module(module.name)
    found, left = set(), [vi.Result]
    while left:
        kind = left.pop()
        left += kind.__subclasses__()
        if not kind.__subclasses__() and kind.__module__.startswith("vibroimpact."):
            found.add(kind.__name__)
    return found


def assert_same_bits(here: Any, there: Any, where: str = "") -> None:
    """Every number, word and array of two objects is the same, by a walk that knows nothing of the files."""
    here, there = (x.item() if isinstance(x, np.generic) else x for x in (here, there))
    assert type(here) is type(there), where
    if isinstance(here, np.ndarray):
        assert (here.dtype, here.shape) == (there.dtype, there.shape), where
        assert here.tobytes() == there.tobytes() or here.dtype == object, where
    elif isinstance(here, xr.Dataset):
        xr.testing.assert_identical(here, there)
    elif isinstance(here, float):
        assert math.isnan(here) == math.isnan(there), where
        assert math.isnan(here) or (
            here == there and math.copysign(1.0, here) == math.copysign(1.0, there)
        ), where
    elif isinstance(here, Mapping):
        assert list(here) == list(there), where
        for key in here:
            assert_same_bits(here[key], there[key], f"{where}[{key!r}]")
    elif isinstance(here, tuple | list):
        assert len(here) == len(there), where
        for k, (one, other) in enumerate(zip(here, there, strict=True)):
            assert_same_bits(one, other, f"{where}[{k}]")
    elif type(here).__module__.startswith("vibroimpact.") and not isinstance(here, Enum):
        for name in inspect.signature(type(here)).parameters:
            own = name if hasattr(here, name) else f"_{name}"
            one, other = getattr(here, own), getattr(there, own)
            assert_same_bits(one, other, f"{where}.{name}")
    else:
        assert here == there, where


def test_there_is_an_example_of_every_class_of_results() -> None:
    assert classes_of_results() == set(EXAMPLES)


@pytest.mark.parametrize("name", EXAMPLES)
@pytest.mark.slow
def test_a_result_comes_back_with_the_same_bits(name: str, tmp_path: Path) -> None:
    found = example(name)
    vi.save(found, tmp_path / "result.nc")
    loaded = vi.load(tmp_path / "result.nc", CODE.get(name))
    assert repr(loaded) == repr(found)
    assert_same_bits(loaded, found, name)
    xr.testing.assert_identical(loaded.to_dataset(), found.to_dataset())


@pytest.mark.parametrize("name", EXAMPLES)
def test_a_result_is_drawn(name: str) -> None:
    _, ax = plt.subplots()
    example(name).plot()
    if name != "RecordResponse":
        assert example(name).plot(ax=ax) is ax
    plt.close("all")


@pytest.mark.parametrize("name", EXAMPLES)
def test_a_result_is_a_table(name: str, tmp_path: Path) -> None:
    table = example(name).to_dataframe()
    assert len(table) >= 1
    vi.save(example(name), tmp_path / "table.csv")
    lines = (tmp_path / "table.csv").read_text(encoding="utf-8").splitlines()
    assert lines[0].split(",")[0].strip('"').partition(" [")[0] == table.columns[0]
    assert len(lines) >= len(table) + 1


NUMBERS = re.compile(
    r"z|tangent|arclength|residual|zero_.*|multipliers_.*|special_(arclength|error|parameter)|progress|per_impact|"
    r"growth|impacts|determinant_error|phi|normal_exponent"
)  # without a unit: multipliers, growths, and what continuation has of its own


def in_si(curve: vi.BifurcationCurve) -> vi.BifurcationCurve:
    """The curve of a machine in SI units with the same numbers."""
    found = copy.deepcopy(curve)
    plane = found.problem.equations
    object.__setattr__(plane, "system", replace(plane.system, si=True))
    return found


@pytest.mark.parametrize(
    "name",
    ["Attractor", "BifurcationCurve", "Branch", "Circle", "ForceRecord", "FreeDecay", "LyapunovEstimate",
     "LyapunovSpectrum", "Orbit", "OrbitSearch", "RecordResponse", "ResponseSpectrum", "Run", "Section", "SineSweep",
     "Tongue"],
)  # fmt: skip
def test_every_number_of_a_machine_in_si_has_its_unit(
    name: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Each variable, or each of its entries: but for those that are plain numbers, codes and words."""
    for system in ("SET_A", "OSCILLATOR", "RECORD"):
        monkeypatch.setitem(globals(), system, replace(globals()[system], si=True))
    if name == "Branch":
        found = vi.continue_orbit(vi.symmetric_orbits(SET_A)[0], "omega", (0.94, 0.96), steps=FEW)
    elif name == "Orbit":
        found = vi.symmetric_orbits(SET_A)[0]
    elif name == "Circle":
        found = vi.find_circle(SET_A, START)
    elif name in ("BifurcationCurve", "Tongue"):
        side = in_si(torus_of_set_a())
        found = side if name == "BifurcationCurve" else vi.Tongue(side["2/9_1"], (side, side), 0.1)
    else:
        found = EXAMPLES[name]()
    data = found.to_dataset()
    bare = [
        str(key) for key, variable in data.variables.items()
        if variable.dtype.kind == "f" and not {"units", "units_of_entries"} & set(variable.attrs)
    ]  # fmt: skip
    assert not [key for key in bare if not NUMBERS.fullmatch(key)]
    assert any("units" in variable.attrs for variable in data.variables.values())


# ---- copies ----------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", EXAMPLES)
def test_a_result_is_copied_and_sent_to_other_processes_with_the_same_bits(name: str) -> None:
    result = example(name)
    for other in (pickle.loads(pickle.dumps(result)), copy.deepcopy(result)):  # noqa: S301
        assert_same_bits(result, other)
        assert isinstance(result == other, bool)
    assert result == copy.copy(result) or type(result).__eq__ is object.__eq__
    assert len({result, result}) == 1


def public_classes() -> set[type]:
    rooms = (vi, vi.normal_forms, vi.continuation, vi.measures, vi.observers)
    found = (getattr(room, name) for room in rooms for name in dir(room))
    return {one for one in found if isinstance(one, type)}


def test_no_public_class_compares_arrays_or_hashes_dictionaries() -> None:
    for kind in public_classes():
        made_by_dataclass = getattr(vars(kind).get("__dataclass_params__"), "eq", False)
        if not made_by_dataclass and kind.__eq__ is not tuple.__eq__:
            continue
        for name, declared in vars(kind).get("__annotations__", {}).items():
            words = set(re.findall(r"\w+", str(declared)))
            arrays = {
                "Floats",
                "Complexes",
                "Codes",
                "Flags",
                "Integers",
                "NDArray",
                "Mapping",
                "dict",
            }
            assert "ClassVar" in words or not words & arrays, (kind, name)


# ---- what a field does not admit is refused ------------------------------------------------------------

Place = tuple[
    Any, Any, str, str
]  # where a value stands in the tree of a file: holder, key, class, field


def places(node: Any, kind: str, field: str) -> Iterator[Place]:
    """Values in the arguments of an object, of lists the first ones."""
    for key, value in node.items() if isinstance(node, dict) else enumerate(node[:2]):
        if isinstance(value, dict) and "object" in value:
            continue
        if isinstance(value, list) or (
            isinstance(value, dict) and not {"writeable", "enum"} & {*value}
        ):
            yield from places(value, kind, field)
        else:
            yield node, key, kind, field


def places_of(objects: list[Any]) -> list[Place]:
    """One value of every field of every class."""
    found: dict[tuple[str, str], Place] = {}
    for one in objects:
        for field in one.get("arguments", {}) if "class" in one else ():
            kind = one["class"].partition(":")[2]
            for place in places({"only": one["arguments"][field]}, kind, field):
                holder = one["arguments"] if "only" in place[0] else place[0]
                key = field if "only" in place[0] else place[1]
                found.setdefault((kind, field), (holder, key, kind, field))
    return [*found.values()]


def with_nan(data: xr.Dataset, old: dict[str, Any]) -> tuple[xr.Dataset, dict[str, Any]] | None:
    """A dataset with an array more, that is an old one with a NaN; None of an array of other numbers."""
    if "variable" in old:
        array = np.array(data[old["variable"]].values)
    else:
        size = math.prod(old["shape"])
        pool = data[STORED + old["array"]].values.view(old["array"])
        array = np.array(pool[old["at"] : old["at"] + size]).reshape(old["shape"])
    if array.dtype.kind not in "fc" or not array.size:
        return None
    array.flat[array.size // 2] = math.nan
    name, kind = STORED + array.dtype.name, array.dtype
    stored = data[name].values if name in data else np.empty(0)
    both = np.concatenate([stored.view(kind), array.ravel()])
    other = {name: (f"{name}_other", both.view(stored.dtype))}
    new = old | {"array": kind.name, "at": len(both) - array.size, "shape": array.shape}
    new.pop("variable", None)
    return data.drop_vars(name, errors="ignore").assign(other), new


def refusal_of(data: xr.Dataset, tree: Any, system: Any) -> str:
    """What is said of a dataset with another tree; empty if it is read."""
    text = np.frombuffer(json.dumps(tree).encode(), dtype=np.uint8)
    try:
        result_of(data.drop_vars(TEXT).assign({TEXT: ("other_text", text)}), system)
    except vi.InvalidParameterError as error:
        return str(error)
    return ""


def check_changes(name: str, every: int) -> None:
    """Numbers that are none, and NaN, in one of so many fields of a result."""
    whole = dataset_of(example(name))
    tree = json.loads(whole[TEXT].values.tobytes())
    for holder, key, kind, field in places_of(tree["objects"])[::every]:
        old, data = holder[key], whole
        holder[key] = 3.0 if isinstance(old, str) or old is None else "a text"
        said = refusal_of(data, tree, CODE.get(name))
        assert said or old is None, (name, kind, field, old)
        declared = declared_types(kind, field)
        if isinstance(old, float):
            holder[key] = math.nan
        elif isinstance(old, dict) and "writeable" in old and (more := with_nan(whole, old)):
            data, holder[key] = more
        else:
            holder[key] = old
            continue
        said = refusal_of(data, tree, CODE.get(name))
        assert said or "Any" in declared, (name, kind, field, declared)
        holder[key] = old


def declared_types(kind: str, field: str) -> str:
    """Type of a field as its class declares it."""
    found = next(
        one for module in list(sys.modules.values()) if "vibroimpact" in getattr(module, "__name__", "")
        for one in [getattr(module, kind, None)] if isinstance(one, type) and one.__module__ == module.__name__
    )  # fmt: skip
    types = fields._declared(found) | getattr(inspect.unwrap(found.__init__), "__annotations__", {})
    return str(types.get(field, "Any"))


@pytest.mark.parametrize("name", EXAMPLES)
def test_a_field_that_holds_another_type_or_nan_is_refused(name: str) -> None:
    check_changes(name, every=9)


@pytest.mark.slow
@pytest.mark.parametrize("name", EXAMPLES)
def test_every_field_that_holds_another_type_or_nan_is_refused(name: str) -> None:
    check_changes(name, every=1)


def changed(name: str, kind: str, field: str, change: Callable[[Any], Any]) -> str:
    """What is said of a file in which one field of the first object of a class is another."""
    whole = dataset_of(example(name))
    tree = json.loads(whole[TEXT].values.tobytes())
    one = next(one for one in tree["objects"] if one.get("class", "").endswith(f":{kind}"))
    one["arguments"][field] = change(one["arguments"][field])
    return refusal_of(whole, tree, CODE.get(name))


def array(at: int, *shape: int) -> Callable[[Any], Any]:
    """Another array of numbers of the file."""
    return lambda _: {"array": "float64", "at": at, "shape": shape, "writeable": False}


IMPOSSIBLE: dict[str, tuple[str, str, str, Callable[[Any], Any], str]] = {
    "a symbol": ("Attractor", "Attractor", "symbol", lambda _: "1-x-1", "Attractor.symbol = '1-x-1': must be a sy"),
    "a count": ("Attractor", "Attractor", "impacts", lambda _: -1, r"impacts = -1: must be a whole number >= 0"),
    "a half impact": ("Attractor", "Attractor", "impacts", lambda _: 1.5, r"impacts = 1.5: must be a whole number"),
    "a period": ("Attractor", "InvariantSet", "period", lambda _: -2, r"InvariantSet.period = -2: must be a whole"),
    "a word": ("Orbit", "Orbit", "status", lambda _: None, r"Orbit.status = None: must be a text"),
    "cycles": ("Orbit", "Signature", "cycles", lambda _: -1, r"Signature.cycles = -1|cycles"),
    "a reason": (
        "Run", "Run", "end", lambda _: {"enum": "vibroimpact.simulation.simulate:Status", "name": "IMPACT"},
        r"Run.end = .*: must be RunEnd",
    ),
    "a side": ("Orbit", "Stop", "side", lambda _: 2, r"Stop.side = 2: must be -1, 0 or 1"),
    "times that fall": (
        "Run", "Run", "time", lambda _: {"variable": "rate_after", "writeable": False},
        r"Run.time\[\d+\] = .*: must be finite numbers that never fall",
    ),
    "a phase": (
        "Run", "Run", "phase", lambda _: {"variable": "time", "writeable": False},
        r"Run.phase\[\d+\] = .*: must be numbers from 0 to 2 pi",
    ),
    "a length": (
        "Run", "Run", "_low", array(0, 2),
        r"Run._low has length 2 along event, time has",
    ),
    "dims": (
        "Run", "Run", "_low", array(0, 1, 2),
        r"Run._low has shape \(1, 2\): must have 1 dims",
    ),
    "bounds": ("Branch", "Branch", "bounds", lambda _: {"tuple": [2.0, 1.0]}, r"Branch.bounds = \(2.0, 1.0\): must be"),
    "a ratio": ("TunedDamper", "TunedDamper", "mass_ratio", lambda _: 0.0, r"mass_ratio = 0.0: must be > 0"),
    "a rotation": ("Circle", "Circle", "rotation_number", lambda _: 1.5, r"rotation_number = 1.5: must be a number"),
    "another object": ("Run", "Run", "start", lambda _: {"object": 0}, r"Run.start = .*: must be State|damaged"),
}  # fmt: skip


@pytest.mark.parametrize(
    ("name", "kind", "field", "change", "said"), IMPOSSIBLE.values(), ids=IMPOSSIBLE
)
def test_what_is_impossible_is_refused_by_its_name(
    name: str, kind: str, field: str, change: Callable[[Any], Any], said: str
) -> None:
    assert re.search(said, changed(name, kind, field, change))


def test_flight_times_that_are_negative_together_are_no_orbit() -> None:
    found = example("Orbit")
    backwards = replace(found, durations=-found.durations)
    with pytest.raises(
        vi.InvalidParameterError, match=r"durations\[0\] = -.*: must be .* a sum > 0"
    ):
        result_of(dataset_of(backwards))


def test_a_file_that_is_taken_as_it_is_may_hold_numbers_that_no_motion_has(tmp_path: Path) -> None:
    found = example("Orbit")
    vi.save(replace(found, durations=-found.durations), tmp_path / "orbit.nc")
    loaded = vi.load(tmp_path / "orbit.nc", damaged=True)
    np.testing.assert_array_equal(loaded.durations, -found.durations)


def test_no_class_of_files_has_the_name_of_a_word() -> None:
    rooms = tuple(f"{vi.__name__}.{room}." for room in ROOMS)
    for module in [one for one in sys.modules if f"{one}.".startswith(rooms)]:
        kinds = {
            name for name, one in vars(sys.modules[module]).items()
            if isinstance(one, type) and one.__name__ == name and one.__module__ != "builtins"
        }  # fmt: skip
        assert not kinds & {*fields.WORDS}, module
