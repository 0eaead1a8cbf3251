"""Every class of results has a picture, a dataset and a table, and comes back from a file with the same bits."""

from __future__ import annotations

import copy
import importlib
import inspect
import math
import pickle
import pkgutil
import re
from collections.abc import Callable, Mapping
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
    assert lines[0].split(",")[0].strip('"') == table.columns[0]
    assert len(lines) >= len(table) + 1


NUMBERS = re.compile(
    r"z|tangent|arclength|residual|zero_.*|multipliers_.*|special_(arclength|error|parameter)|progress|per_impact|"
    r"growth|impacts|determinant_error"
)  # without a unit: multipliers, growths, and what continuation has of its own


def in_si(curve: vi.BifurcationCurve) -> vi.BifurcationCurve:
    """The curve of a machine in SI units with the same numbers."""
    found = copy.deepcopy(curve)
    plane = found.problem.equations
    object.__setattr__(plane, "system", replace(plane.system, si=True))
    return found


@pytest.mark.parametrize(
    "name",
    ["Attractor", "BifurcationCurve", "Branch", "FreeDecay", "LyapunovEstimate", "LyapunovSpectrum", "Orbit",
     "OrbitSearch", "RecordResponse", "Run", "Section", "SineSweep", "Tongue"],
)  # fmt: skip
def test_every_number_of_a_machine_in_si_has_its_unit(
    name: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Each variable, or each of its entries: but for those that are plain numbers, codes and words."""
    for system in ("SET_A", "OSCILLATOR"):
        monkeypatch.setitem(globals(), system, replace(globals()[system], si=True))
    if name == "Branch":
        found = vi.continue_orbit(vi.symmetric_orbits(SET_A)[0], "omega", (0.94, 0.96), steps=FEW)
    elif name == "Orbit":
        found = vi.symmetric_orbits(SET_A)[0]
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
