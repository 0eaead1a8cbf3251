"""Whatever is given to a public function, it answers with a result or an error of the package."""

from __future__ import annotations

import contextlib
import inspect
import itertools
import math
import sys
import warnings
from collections.abc import Callable
from dataclasses import fields
from pathlib import Path
from typing import Any, cast

import matplotlib.pyplot as plt
import numpy as np
import pytest
import xarray as xr
from support.bifurcations import PLANE, torus_of_a_map
from support.massless import RIGID, maxwell
from support.pictures import assert_nothing_is_cut

import vibroimpact as vi
from vibroimpact import plotting
from vibroimpact._core import checks
from vibroimpact.cli.main import main
from vibroimpact.machines.toml_file import read_case
from vibroimpact.sweeps.observers.table import OBSERVERS

pytestmark = pytest.mark.usefixtures("no_windows")

DAMPER = {
    "mass_ratio": 0.1, "omega_n": 0.5, "zeta": 0.045, "restitution": 0.8, "half_clearance": 5.0,
    "omega": 1.2,
}  # fmt: skip
OSCILLATOR = {
    "zeta": 0.05, "omega": 1.2, "restitution": 0.8, "clearance": 1.0, "lower_clearance": 1.0,
}  # fmt: skip
SI = {"M1": 1.0, "M2": 0.1, "K": 1.0, "C": 0.1, "F0": 1.0, "Omega": 1.0, "D": 1.0,
      "restitution": 0.5}  # fmt: skip
WINDOW = {"settle_periods": 2, "periods": 2, "most_impacts": 1000, "progress": False}
RESULTS = {  # made by functions, not by hand
    "Atlas", "Attractor", "BifurcationCurve", "BifurcationPoint",
    "Branch", "Result", "Circle", "CircleBranch", "Diagram",
    "GrazingContact", "InvariantSet", "LyapunovEstimate", "LyapunovSpectrum", "MapDerivative",
    "NotFound", "Orbit", "OrbitSearch", "Symmetry", "ProgressReport", "Run", "Section",
    "Tongue",
    "Answer", "Energies", "FreeDecay", "Measure", "RecordResponse", "Response", "ResponseCurve",
    "ResponseSpectrum", "SineSweep", "TunedDamper", "Design", "DesignMap", "ParetoFront",
}  # fmt: skip
ENUMS_AND_ERRORS = {
    "BackendUnavailableError", "ClusterLostError", "InvalidParameterError", "Kind", "RunEnd",
    "Status", "StoreError", "VibroImpactError", "FrictionState", "PhaseSwitchState", "RigidStopState",
    "ModeSwitchState",
    "SoftStopState",
}  # fmt: skip
# What is done as asked, and would take days: 10^12 impacts or motions, none of them recorded.
LONG = {
    ("sine_sweep", "periods_per_step"), ("section", "settle_events"),
    ("lyapunov_exponent", "settle_impacts"), ("lyapunov_exponent", "impacts"),
    ("lyapunov_spectrum", "settle_impacts"), ("lyapunov_spectrum", "impacts"),
    ("find_orbits", "starts"), ("find_orbits", "most_impacts"),
    ("find_circle", "settle_iterates"), ("find_circle, formula", "settle_iterates"),
    ("Objective", "points"), ("optimise", "budget"),
    ("optimise", "refine"), ("pareto_front", "budget"), ("pareto_front", "refine"),
    ("frequency_response", "points"), ("frequency_response", "starts"),
    ("frequency_response", "settle_periods"), ("frequency_response", "periods"),
    ("map_derivative", "impacts"), ("ExplicitMap", "dimension"),
}  # fmt: skip

Call = tuple[Callable[..., Any], dict[str, Any]]


def a_function(*_: Any) -> float:
    return 1.0


def first_speed(states: Any, _durations: Any, _parameters: Any) -> Any:
    return states[0, 2]


RUBBING = vi.Friction((1.0,), 0.1)


def still(*elements: Any, **more: Any) -> vi.Mechanism:
    one: dict[str, Any] = {"mass": [[1.0]], "damping": [[0.0]], "stiffness": [[1.0]]}
    return vi.Mechanism(**(one | more), elements=elements)


def oscillator(k: float, A: float) -> vi.Mechanism:
    return vi.Mechanism(
        mass=[[1.0]], damping=[[0.1]], stiffness=[[k]], forces=(vi.Harmonic(1.0, (A,)),),
        elements=(vi.RigidStop((1.0,), upper=1.0, restitution=0.8),),
    )  # fmt: skip


def spinning(x: Any, p: Any) -> list[Any]:
    """A circle, and a direction beside it in which it doubles at p = 1."""
    grow = 1.2 - 0.2 * (x[0] ** 2 + x[1] ** 2)
    return [grow * (0.28 * x[0] - 0.96 * x[1]), grow * (0.96 * x[0] + 0.28 * x[1]),
            -p * x[2] + x[2] ** 3]  # fmt: skip


def circles() -> xr.Dataset:
    """Data of the shape that plots of circles take."""
    names, offsets = ["x1", "v1"], [1e-3, 2e-3]
    points = ("offset", "point", "coordinate"), np.ones((2, 4, 2))
    return xr.Dataset(
        {
            "predicted_half_width": (("offset", "coordinate"), np.ones((2, 2))),
            "half_width": (("start", "offset", "coordinate"), np.ones((1, 2, 2))),
            "predicted_radius": ("offset", np.ones(2)),
            "radius": (("start", "offset"), 1.1 * np.ones((1, 2))),
            "points": points,
            "predicted_points": (("offset", "phase_of_z", "coordinate"), points[1]),
        },
        coords={"offset": offsets, "coordinate": names, "start": ["first"]},
    )


def in_print(columns: int) -> None:
    with plotting.print_style(columns):
        pass


def _calls(folder: Path) -> tuple[dict[str, Call], dict[str, Any]]:
    """By name: what is called, with valid arguments; and objects of our own."""
    damper, state = vi.ImpactDamper(**DAMPER), vi.State((0.0, 0.0), (0.0, 1.0))
    contact, swing = vi.RigidStop((1.0,), upper=1.0), vi.Harmonic(1.0, (0.1,))
    run = vi.simulate(damper, state, impacts=20)
    chain = vi.Structure.chain([1.0, 1.0], [1.0, 1.0])
    for name in ("mass", "stiffness"):
        np.save(folder / f"{name}.npy", np.eye(4))
    relay = vi.HybridSystem(
        modes={"on": vi.LinearMode([[-1.0]], [3.0])}, guards={"top": vi.LinearGuard([1.0], 9.0)},
        transitions=(vi.Transition("on", "top", "rising", "on"),),
    )  # fmt: skip
    relayed = vi.simulate_hybrid(relay, "on", [0.0], t_max=3.0)
    rubbing = vi.simulate(still(RUBBING), vi.State((2.0,), (0.0,)), t_max=6.0)
    section = vi.section(damper, state, points=5, settle_events=5)
    closed = vi.symmetric_orbits(damper)[0]
    orbit = vi.find_orbit(damper, closed)
    whole = vi.find_orbit(damper, closed, symmetric=False)
    few = vi.Steps(first=0.02, largest=0.5, points=12)
    steps = vi.Steps(first=0.02, largest=0.5, points=200)
    branch = vi.continue_orbit(orbit, "omega", (1.0, 1.21), steps=steps)
    short = vi.continue_orbit(orbit, "omega", (1.19, 1.21), steps=few)
    diagram = vi.branch_diagram(orbit, "omega", (1.19, 1.21), points=2, steps=few)
    over, two = {"omega": [1.1, 1.2]}, {"omega": [1.1, 1.2], "zeta": [0.04, 0.05]}
    axes = {"x1": [-1.0, 1.0], "v2": [0.5, 1.0]}
    long = WINDOW | {"settle_periods": 100, "periods": 20}
    swept = vi.sweep(damper, over=over, start=state, observe=["symbol", "lyapunov"], **WINDOW)
    basins = vi.basins(damper, over=axes, start=state, **long)
    random = vi.RandomStarts(2, 1, {"v1": (-1.0, 1.0)}, state)
    forms = vi.ExplicitMap(lambda x, p: [p * x[0] * (1.0 - x[0])], dimension=1)
    P = vi.full_map(orbit, "omega")
    spin = vi.ExplicitMap(spinning, dimension=3)
    circle = vi.find_circle(spin, (1.0, 0.0, 0.0), p=0.9, settle_iterates=500, points=500)
    family = vi.continue_circle(circle, "p", (0.8, 1.1))
    file = folder / "branch.nc"
    vi.save(short, file)
    around = ((1.0, 1.21), (4.0, 6.0))
    curve = vi.continue_level(closed, first_speed, PLANE, around, steps=few, both=False)
    torus = torus_of_a_map()
    touched = vi.normal_forms.Touch(
        "GR", "p", 0.0, "a stop", vi.normal_forms.ContactLaw.RIGID, acceleration=0.5, opening=1.0,
        coordinates=("x1", "v1"), linear=np.array([[0.2, 1.0], [0.0, 0.0]]), jump=np.array([0.0, 1.0]),
        gap=np.array([1.0, 0.0]), rate=np.array([0.0, 1.0]), bend=np.zeros(2), jerk=0.0,
        cross=np.zeros((2, 2)), second=np.zeros(2),
    )  # fmt: skip
    locked = vi.Tongue(
        torus["2/9_1"], (torus, torus), 0.1
    )  # any two curves: their look is not tested here
    label = next((point.label for point in curve.special_points), "R4_1")
    henon = vi.ExplicitMap(
        lambda x, p: [x[1], p[0] - p[1] * x[0] - x[1] ** 2], dimension=2, parameters=("a", "b")
    )
    motion = {"system": damper, "start": state}
    where = {"at": vi.AtStop()}
    sweeping = {"system": damper, "start": state}

    def observed(observer: Any) -> Call:
        valid = {n: p.default for n, p in inspect.signature(observer).parameters.items()}
        return (
            lambda **given: vi.sweep(
                damper, over={"omega": [1.2]}, start=state, observe=[observer(**given)], **WINDOW
            ),
            valid,
        )

    calls: dict[str, Call] = {
        "ImpactDamper": (vi.ImpactDamper, DAMPER | {"force": 1.0, "mass": 1.0, "si": False}),
        "ImpactDamper.from_physical": (vi.ImpactDamper.from_physical, SI),
        "ImpactDamper.on_stop": (
            damper.on_stop, {"stop": "A", "x1": 0.0, "v1": 0.0, "v2": -1.0, "phase": 0.0},
        ),
        "ImpactOscillator": (
            vi.ImpactOscillator, OSCILLATOR | {"force": 1.0, "omega_n": 1.0, "mass": 1.0, "si": False},
        ),
        "ImpactOscillator.from_physical": (
            vi.ImpactOscillator.from_physical,
            {"M": 1.0, "K": 1.0, "C": 0.1, "F0": 1.0, "Omega": 1.0, "D": 1.0, "restitution": 0.5,
             "D_lower": 1.0},
        ),
        "ImpactOscillator.on_stop": (
            vi.ImpactOscillator(**OSCILLATOR).on_stop, {"stop": "B", "v1": 1.0, "phase": 0.0},
        ),
        "RigidStop": (
            vi.RigidStop,
            {"row": (1.0,), "lower": -1.0, "upper": 1.0, "restitution": (0.5, 0.5), "motion": (swing,)},
        ),
        "SoftStop": (
            vi.SoftStop,
            {"row": (1.0,), "lower": -1.0, "upper": 1.0, "stiffness": 9.0, "damping": (0.1, 0.2),
             "law": "limited", "motion": swing},
        ),
        "Friction": (
            vi.Friction,
            {"row": (1.0,), "kinetic": 0.1, "static": 0.2, "belt_speed": 1.0,
             "motion": swing, "load": vi.NormalLoad(1.0)},
        ),
        "NormalLoad": (
            vi.NormalLoad,
            {"constant": 1.0, "position": (1.0,), "velocity": (1.0,), "motion": swing},
        ),
        "PhaseSwitch": (
            vi.PhaseSwitch,
            {"omega": 1.0, "phases": (0.0, 1.0), "forces": ((1.0,), (0.0,)),
             "impulses": ((0.0,), (1.0,)), "row": (1.0,), "stiffness": (1.0, 2.0),
             "damping": (0.1, 0.2)},
        ),
        "HybridSystem": (
            vi.HybridSystem,
            {"modes": relay.modes, "guards": relay.guards, "transitions": relay.transitions,
             "omegas": (1.0,)},
        ),
        "LinearMode": (
            lambda **mode: vi.HybridSystem(modes={"a": vi.LinearMode(**mode)}, guards={}),
            {"matrix": [[1.0]], "constant": [1.0]},
        ),
        "LinearGuard": (
            lambda **guard: vi.HybridSystem(
                modes=relay.modes, guards={"top": vi.LinearGuard(**guard)}
            ),
            {"row": [1.0], "level": 1.0},
        ),
        "Transition": (
            lambda **one: vi.HybridSystem(
                modes=relay.modes, guards=relay.guards, transitions=(vi.Transition(**one),)
            ),
            {"mode": "on", "guard": "top", "direction": "rising", "to": "on", "matrix": [[1.0]],
             "shift": [1.0]},
        ),
        "simulate_hybrid": (
            vi.simulate_hybrid,
            {"system": relay, "mode": "on", "start": [1.0], "phase": 0.0, "events": 9,
             "t_max": 1.0},
        ),
        "HybridRun.at": (vi.simulate_hybrid(relay, "on", [1.0], t_max=1.0).at, {"t": 0.5}),
        "Harmonic": (vi.Harmonic, {"omega": 1.0, "sine": (1.0,), "cosine": (0.0,)}),
        "Mechanism": (
            vi.Mechanism,
            {
                "mass": [[1.0]], "damping": [[0.1]], "stiffness": [[1.0]],
                "forces": (vi.Harmonic(1.0, (1.0,)),), "constant_force": (0.0,),
                "elements": (contact, vi.Friction((1.0,), 0.1)),
            },
        ),
        "Structure": (
            vi.Structure,
            {"mass": [[1.0]], "damping": [[0.1]], "stiffness": [[1.0]], "places": {"x": (1.0,)}},
        ),
        "Structure.chain": (
            vi.Structure.chain,
            {"masses": [1.0, 1.0], "stiffnesses": [1.0, 1.0], "dampings": [0.1, 0.1]},
        ),
        "Structure.of_modes": (
            vi.Structure.of_modes,
            {"frequencies": [1.0], "shapes": {"x": (1.0,)}, "zeta": 0.01, "masses": [1.0]},
        ),
        "Structure.of_matrices": (
            vi.Structure.of_matrices,
            {"mass": np.eye(4), "stiffness": np.eye(4), "places": {"x": 0}, "modes": 2, "zeta": 0.01},
        ),
        "Structure.of_files": (
            vi.Structure.of_files,
            {"mass": folder / "mass.npy", "stiffness": folder / "stiffness.npy", "places": {"x": 0},
             "modes": 2, "zeta": 0.01},
        ),
        "Structure.row": (chain.row, {"place": "x1", "other": "x2"}),
        "Structure.mechanism": (
            chain.mechanism,
            {"elements": [vi.RigidStop((1.0, 0.0), upper=1.0)],
             "forces": {"x1": vi.Harmonic(1.0, (1.0,))}, "constant_force": {"x1": 0.1}},
        ),
        "State": (vi.State, {"position": (0.0,), "velocity": (0.0,), "phase": 0.0}),
        "State.perturbed": (state.perturbed, {"amount": 0.1}),
        "Steps": (
            vi.Steps,
            {"first": 0.1, "least": 1e-6, "largest": 1.0, "tolerance": 1e-8, "turn": 0.7,
             "points": 10},
        ),
        "Family": (
            lambda **given: vi.Family(**given).mechanism, {"build": oscillator, "k": 1.0, "A": 2.0},
        ),
        "ExplicitMap": (
            vi.ExplicitMap,
            {"function": lambda x, _: [x[0]], "dimension": 1, "iterate": 1, "sizes": (1.0, 1.0)},
        ),
        "ExplicitMap.__call__": (forms, {"x": [0.5], "p": 3.0}),
        "ExplicitMap.derivative": (
            lambda x, p, u: forms.derivative(x, p, u), {"x": [0.5], "p": 3.0, "u": [1.0]},
        ),
        "ExplicitMap.linearised": (forms.linearised, {"x": [0.5], "p": 3.0}),
        "ExplicitMap.forms": (forms.forms, {"x": [0.5], "p": 3.0}),
        "ExplicitMap.fixed_point": (forms.fixed_point, {"guess": [0.6], "p": 3.0}),
        "ExplicitMap.residual": (forms.residual, {"z": [0.5], "p": 3.0}),
        "ExplicitMap.jacobian": (forms.jacobian, {"z": [0.5], "p": 3.0}),
        "ExplicitMap.watch": (forms.watch, {"z": [[0.5]], "p": [3.0]}),
        "RandomStarts": (
            vi.RandomStarts,
            {"starts": 2, "seed": 1, "bounds": {"v1": (-1.0, 1.0)}, "base": state, "skip": 0},
        ),
        "RandomStarts, range": (
            lambda v1: vi.RandomStarts(2, 1, {"v1": v1}, state), {"v1": (-1.0, 1.0)},
        ),
        "GridStarts": (vi.GridStarts, {"over": {"x1": [0.0, 1.0]}, "base": state}),
        "GridStarts, axis": (lambda x1: vi.GridStarts({"x1": x1}, state), {"x1": [0.0, 1.0]}),
        "ListedStarts": (
            vi.ListedStarts,
            {"position": [[0.0, 0.0]], "velocity": [[0.0, 1.0]], "phase": [0.0]},
        ),
        "Explorer": (vi.Explorer, {"system": damper, "start": state, "height": 500}),
        "simulate": (vi.simulate, motion | {"impacts": 5, "t_max": 100.0}),
        "simulate, no end": (vi.simulate, motion | {"impacts": 5}),
        "Run.at": (run.at, {"t": 1.0}),
        "Run.forces": (run.forces, {"t": 1.0}),
        "section": (vi.section, motion | where | {"points": 3, "settle_events": 3}),
        "AtStop": (
            lambda **at: vi.section(damper, state, at=vi.AtStop(**at)), {"stop": "A", "contact": 0},
        ),
        "AtPhase": (lambda **at: vi.section(damper, state, at=vi.AtPhase(**at)), {"phase": 0.0}),
        "AtChange": (
            lambda **at: vi.section(damper, state, at=vi.AtChange(**at)),
            {"element": 0, "takes": "upper"},
        ),
        "Section.plot": (section.plot, {"ax": None}),
        "classify": (
            vi.classify,
            motion | where | {"settle_events": 10, "points": 64, "most_settle_events": 100},
        ),
        "classify_points": (
            vi.classify_points,
            {
                "points": np.zeros((64, 2)),
                "exponent": vi.lyapunov_exponent(damper, state, impacts=2000, settle_impacts=10),
            },
        ),
        "lyapunov_exponent": (vi.lyapunov_exponent, motion | {"impacts": 1024, "settle_impacts": 1}),
        "lyapunov_spectrum": (
            vi.lyapunov_spectrum, motion | {"impacts": 1024, "settle_impacts": 1, "exponents": 2}
        ),
        "map_derivative": (
            vi.map_derivative, motion | {"impacts": 1, "t_max": 100.0, "directions": np.eye(5)},
        ),
        "symmetric_orbits": (vi.symmetric_orbits, {"system": damper}),
        "symmetries": (vi.symmetries, {"system": damper}),
        "find_orbit": (
            vi.find_orbit,
            {"system": damper, "guess": closed, "stops": ("A", "B"), "cycles": 1,
             "symmetric": False},
        ),
        "Guess": (
            lambda states, durations: vi.find_orbit(
                damper, vi.Guess(states, durations), stops="AB", cycles=1, symmetric=False
            ),
            {"states": whole.states, "durations": whole.durations},
        ),
        "find_orbits": (
            vi.find_orbits,
            {"system": damper, "most_cycles": 1, "most_impacts": 2, "starts": 1, "seed": 0,
             "progress": False},
        ),
        "full_map": (vi.full_map, {"orbit": orbit, "parameter": "omega"}),
        "half_map": (vi.half_map, {"orbit": orbit, "parameter": "omega"}),
        "impact_map": (vi.impact_map, {"orbit": orbit, "impact": 0, "parameter": "omega"}),
        "stroboscopic_map": (
            vi.stroboscopic_map, {"orbit": orbit, "after": 0.5, "parameter": "omega"},
        ),
        "SegmentMap.derivative": (lambda u: P.derivative(u), {"u": [1.0, 0.0, 0.0, 0.0]}),
        "normal_form": (
            vi.normal_form,
            {"kind": "PD", "forms": forms.forms([2.0 / 3.0], 3.0), "unfolded": True},
        ),
        "Orbit.why_inadmissible": (orbit.why_inadmissible, {"slack": 0.0}),
        "continue_orbit": (
            vi.continue_orbit,
            {"orbit": closed, "parameter": "omega", "bounds": (1.19, 1.21), "steps": few,
             "both": False, "tangent": None, "progress": False},
        ),
        "find_circle": (
            vi.find_circle,
            {"system": damper, "start": state, "p": None, "stops": None, "cycles": None,
             "symmetric": None, "settle_iterates": 10, "points": 100, "tolerance": 1e-10, "most_nodes": 31},
        ),
        "find_circle, formula": (
            vi.find_circle,
            {"system": spin, "start": (1.0, 0.0, 0.0), "p": 0.9, "settle_iterates": 500, "points": 500},
        ),
        "CircleGuess": (
            lambda points, rotation_number: vi.find_circle(
                spin, vi.CircleGuess(points, rotation_number), p=0.9
            ),
            {"points": circle.points, "rotation_number": circle.rotation_number},
        ),
        "Circle.at": (circle.at, {"phi": 0.5}),
        "Circle.plot": (circle.plot, {"ax": None}),
        "continue_circle": (
            vi.continue_circle,
            {"circle": circle, "parameter": "p", "bounds": (0.85, 0.95), "both": True,
             "steps": vi.Steps(first=0.1, least=1e-2, largest=0.5, points=3, tolerance=1e-10),
             "most_nodes": 63, "progress": False},
        ),
        "CircleBranch.__getitem__": (family.__getitem__, {"label": "PD1"}),
        "CircleBranch.plot": (family.plot, {"ax": None}),
        "switch_circle": (
            vi.switch_circle,
            {"point": family["PD1"], "amplitude": 0.05, "tolerance": 1e-10, "most_nodes": 63},
        ),
        "switch_branch": (
            vi.switch_branch,
            {"point": branch["NS1"], "bounds": (1.0, 1.21), "steps": few, "progress": False},
        ),
        "branch_diagram": (
            vi.branch_diagram,
            {"orbit": closed, "parameter": "omega", "bounds": (1.19, 1.21), "depth": 0, "most_branches": 1,
             "points": 2, "steps": few, "progress": False},
        ),
        "Branch.orbit": (branch.orbit, {"index": 0}),
        "Branch.__getitem__": (branch.__getitem__, {"label": "NS1"}),
        "Branch.plot": (branch.plot, {"variable": "v1", "ax": None}),
        "Diagram.plot": (diagram.plot, {"variable": "v1", "ax": None, "marks": True}),
        "Diagram.origin": (diagram.origin, {"index": 0}),
        "continue_bifurcation": (
            vi.continue_bifurcation,
            {"point": branch["NS1"], "parameters": PLANE, "bounds": around, "kind": "",
             "steps": few, "both": False, "progress": False},
        ),
        "continue_level": (
            vi.continue_level,
            {"orbit": closed, "function": first_speed, "parameters": PLANE, "bounds": around,
             "value": None, "steps": few, "both": False, "progress": False},
        ),
        "switch_curve": (
            vi.switch_curve,
            {"point": torus["R1_1"], "bounds": None, "steps": few, "progress": False},
        ),
        "bifurcation_atlas": (
            vi.bifurcation_atlas,
            {"orbit": closed, "parameters": PLANE, "bounds": ((1.15, 1.21), (4.8, 5.2)),
             "touches": False, "depth": 0, "most_curves": 1, "steps": few, "progress": False},
        ),
        "tongue": (
            vi.tongue, {"point": torus["1/5_1"], "bounds": None, "steps": few, "progress": False},
        ),
        "Tongue.plot": (locked.plot, {"ax": None}),
        "map_bifurcation": (
            vi.map_bifurcation, {"kind": "NS", "mapping": henon, "x": (0.5, 0.5), "p": (1.25, 1.0)},
        ),
        "BifurcationCurve.orbit": (curve.orbit, {"index": 0}),
        "BifurcationCurve.__getitem__": (curve.__getitem__, {"label": label}),
        "BifurcationCurve.plot": (curve.plot, {"ax": None}),
        "save, a result": (vi.save, {"result": branch, "path": folder / "again.nc"}),
        "load": (vi.load, {"path": file, "system": None}),
        "load_machine": (vi.load_machine, {"path": file}),
        "Result.to_csv": (branch.to_csv, {"path": folder / "branch.csv"}),
        "load_start": (vi.load_start, {"path": file}),
        "sweep": (
            vi.sweep,
            sweeping | {"over": over, "observe": "symbol", "follow": None, "settle_periods": 2,
                        "periods": 2, "most_impacts": 100, "store": None, "backend": "threads",
                        "workers": 1, "client": None, "tile": None, "progress": False},
        ),
        "sweep, axis": (
            lambda omega: vi.sweep(damper, over={"omega": omega}, start=state, **WINDOW),
            {"omega": [1.1]},
        ),
        "rerun_sweep": (
            vi.rerun_sweep,
            {"found": swept, "system": None, "settle_periods": 2, "workers": 1, "progress": False},
        ),
        "plane": (vi.plane, sweeping | WINDOW | {"over": two, "observe": ()}),
        "multistability": (
            vi.multistability,
            sweeping | where | WINDOW | {"over": over, "start": random, "same_within": 1e-3},
        ),
        "basins": (
            vi.basins, sweeping | where | long | {"over": axes, "same_within": 1e-3, "most_classified": 64},
        ),
        "attractor_state": (
            vi.attractor_state, {"basins": basins, "name": str(basins["name"].values[0])},
        ),
        "bifurcation_sweep": (
            vi.bifurcation_sweep,
            sweeping | where | WINDOW | {"over": over, "way": "up", "points": 3, "observe": ()},
        ),
        "plot_along": (plotting.plot_along, {"along": swept, "variable": "lyapunov", "ax": None}),
        "plot_basins": (plotting.plot_basins, {"basins": basins, "ax": None, "marks": True}),
        "plot_bifurcation_diagram": (
            plotting.plot_bifurcation_diagram,
            {
                "diagram": vi.bifurcation_sweep(
                    damper, over=over, start=state, points=3, **WINDOW
                ),
                "variable": "v1", "ax": None,
            },
        ),
        "plot_branch_multipliers": (
            plotting.plot_branch_multipliers, {"branch": branch, "ax": None},
        ),
        "plot_branches": (
            plotting.plot_branches,
            {"branches": [branch], "variable": "v1", "ax": None, "marks": True, "stop": (0, 1),
             "mirror": False, "attractors": None},
        ),
        "plot_circle_error": (plotting.plot_circle_error, {"circles": circles(), "ax": None}),
        "plot_circle_half_width": (
            plotting.plot_circle_half_width, {"circles": circles(), "ax": None},
        ),
        "plot_circles": (plotting.plot_circles, {"circles": circles(), "ax": None}),
        "plot_curves": (
            plotting.plot_curves,
            {"curves": [curve], "ax": None, "marks": True, "bounds": around},
        ),
        "plot_exponents": (
            plotting.plot_exponents,
            {"exponents": vi.lyapunov_exponent(damper, state, impacts=1024, settle_impacts=1), "ax": None},
        ),
        "plot_orbit": (plotting.plot_orbit, {"orbit": orbit, "row": "x1", "ax": None}),
        "plot_orbits": (
            plotting.plot_orbits,
            {"search": vi.find_orbits(damper, most_cycles=1, most_impacts=2, starts=2), "x": "x1", "y": "v1",
             "ax": None},
        ),
        "plot_tuned_damper": (
            plotting.plot_tuned_damper, {"damper": vi.tuned_damper(0.05), "ax": None},
        ),
        "plot_forces": (
            plotting.plot_forces,
            {"run": rubbing, "t0": 0.0, "t1": 5.0, "elements": [0], "ax": None},
        ),
        "plot_hybrid_run": (plotting.plot_hybrid_run, {"run": relayed, "ax": None}),
        "plot_hysteresis": (
            plotting.plot_hysteresis,
            {"run": rubbing, "element": 0, "t0": 0.0, "t1": 5.0, "ax": None},
        ),
        "plot_history": (plotting.plot_history, {"run": run, "t0": 0.0, "t1": 5.0, "ax": None}),
        "plot_mechanism": (plotting.plot_mechanism, {"system": damper, "ax": None}),
        "plot_multipliers": (
            plotting.plot_multipliers, {"path": [closed], "omega": [1.2], "half": True, "ax": None},
        ),
        "plot_phase_portrait": (
            plotting.plot_phase_portrait,
            {"run": run, "t0": 0.0, "t1": 5.0, "row": (1.0,), "ax": None},
        ),
        "plot_plane": (
            plotting.plot_plane,
            {"plane": vi.plane(damper, over=two, start=state, **WINDOW), "variable": "motion",
             "ax": None, "most_motions": 7, "symbols": None},
        ),
        "plot_circle_branch": (
            plotting.plot_circle_branch, {"branch": family, "ax": None},
        ),
        "plot_invariant_circle": (
            plotting.plot_invariant_circle, {"circle": circle, "x": "x1", "y": "x2", "ax": None},
        ),
        "print_style": (in_print, {"columns": 1}),
        "plot_tongue": (plotting.plot_tongue, {"tongue": locked, "ax": None}),
        "plot_touch": (
            plotting.plot_touch,
            {"form": touched, "bounds": (-0.1, 0.01), "simulated": ([-0.1], [0.1]), "ax": None},
        ),
        "plot_section": (
            plotting.plot_section,
            {"section": section, "x": "x1", "y": "v1", "drift": False, "ax": None},
        ),
        "save": (
            plotting.save, {"ax": plotting.plot_mechanism(damper), "path": folder / "p.png"},
        ),
    }  # fmt: skip
    calls |= {
        f"observe.{kind.__name__}": observed(kind)
        for kind in OBSERVERS.values() if fields(cast(Any, kind))
    }  # fmt: skip
    calls |= (
        _response_calls(damper, folder)
        | _design_calls(damper, folder)
        | _transient_calls(damper, folder)
    )
    ours = {
        "a contact": contact,
        "a damper": damper,
        "a branch": branch,
        "a run": run,
        "a curve": curve,
    }
    return calls, ours


def _response_calls(damper: vi.ImpactDamper, folder: Path) -> dict[str, Call]:
    """The same of responses over a band, and of measures."""
    few: dict[str, Any] = {
        "points": 2,
        "starts": 1,
        "settle_periods": 2,
        "periods": 2,
        "most_branches": 0,
    }
    response = vi.frequency_response(damper, "omega", (1.1, 1.2), **few, progress=False)
    closed = vi.find_orbit(damper, vi.simulate(damper, damper.free_start(), impacts=900).last)
    amplitude = vi.measure_of(damper, "x1")
    measures = {
        "Amplitude": {"row": "x1", "order": 0}, "Peak": {"row": "x1", "order": 0},
        "Rms": {"row": "x1", "order": 0}, "Harmonic": {"row": "x1", "order": 0, "harmonic": 1},
        "Transmissibility": {"row": "x1", "order": 0, "base": None},
        "DissipatedPower": {"part": None}, "ContactForce": {"part": 0}, "Impulse": {"part": None},
        "ImpactSpeed": {"kind": "largest"},
    }  # fmt: skip
    return {
        "frequency_response": (
            vi.frequency_response,
            few | {"system": damper, "parameter": "omega", "bounds": (1.1, 1.2), "measure": "x1",
                   "unit": "", "start": None, "seed": 0, "depth": 0, "steps": None, "workers": 1,
                   "progress": False},
        ),
        "Response.at": (response.at, {"value": 1.15}),
        "Response.largest": (response.largest, {"neutral": False}),
        "Response.plot": (response.plot, {"decibel": False, "compare": (), "marks": True, "ax": None}),
        "Response.report": (response.report, {"path": folder / "report.html", "decibel": False}),
        "measure_of": (vi.measure_of, {"system": damper, "measure": "x1"}),
        **{f"measures.{name}": (getattr(vi.measures, name), v) for name, v in measures.items()},
        "Measure.of_orbit": (amplitude.of_orbit, {"orbit": closed}),
        "Measure.derivative": (amplitude.derivative, {"orbit": closed, "parameter": "omega"}),
        "Measure.along": (amplitude.along, {"orbit": closed, "parameter": "omega"}),
        "tuned_damper": (
            vi.tuned_damper, {"mass_ratio": 0.05, "zeta": 0.01, "optimum": "minimax"},
        ),
        "plot_response": (
            plotting.plot_response,
            {"response": response, "decibel": False, "compare": (), "marks": True, "ax": None},
        ),
    }  # fmt: skip


def _design_calls(damper: vi.ImpactDamper, folder: Path) -> dict[str, Call]:
    """The same of designs."""
    few: dict[str, Any] = {"points": 2, "starts": 1, "settle_periods": 2, "periods": 2}
    judged = {"parameter": "omega", "bounds": (1.1, 1.2), "measure": "x1", "seed": 0, "unit": "",
              "spread": None, "aim": "small", "kind": "worst"} | few  # fmt: skip
    both = (
        vi.Objective("omega", (1.1, 1.2), **few),
        vi.Objective("omega", (1.1, 1.2), **few, kind="mean"),
    )
    vary = {"half_clearance": (4.0, 6.0)}
    asked = {"system": damper, "bounds": vary, "constraints": (), "seed": 0, "budget": 64, "refine": 0,
             "workers": 1, "progress": False}  # fmt: skip
    over = {"half_clearance": [4.0, 5.0], "restitution": [0.5, 0.6]}
    best = vi.optimise(damper, vary, both[0], budget=32, refine=0, progress=False)
    drawn = vi.design_map(damper, over, both[0], progress=False)
    front = vi.pareto_front(damper, vary, both, budget=64, refine=1, progress=False)
    return {
        "Objective": (vi.Objective, judged),
        "optimise": (vi.optimise, asked | {"objective": both[0], "store": None}),
        "Design.plot": (best.plot, {"what": "response", "ax": None}),
        "Design.report": (best.report, {"path": folder / "design.html"}),
        "design_map": (
            vi.design_map,
            {"system": damper, "over": over, "objective": both[0], "workers": 1, "progress": False},
        ),
        "DesignMap.plot": (drawn.plot, {"ax": None}),
        "pareto_front": (vi.pareto_front, asked | {"objectives": both, "refine": 1}),
        "ParetoFront.machine": (front.machine, {"index": 0}),
        "ParetoFront.plot": (front.plot, {"ax": None}),
        "plot_design": (plotting.plot_design, {"design": best, "what": "response", "ax": None}),
        "plot_design_map": (plotting.plot_design_map, {"found": drawn, "ax": None}),
        "plot_pareto_front": (plotting.plot_pareto_front, {"front": front, "ax": None}),
    }  # fmt: skip


def _transient_calls(damper: vi.ImpactDamper, folder: Path) -> dict[str, Call]:
    """The same of free decay, sine sweeps and records."""
    record = vi.ForceRecord([0.0, 0.5, 1.0], [0.0, 1.0, 0.0])
    response = vi.simulate_record(damper, record)
    decay = vi.free_decay(damper, {"v1": 1.0}, t_max=50.0)
    spectrum = vi.response_spectrum(record, [1.0, 2.0])
    swept = vi.sine_sweep(damper, "omega", (1.1, 1.2), points=2, progress=False)
    path = folder / "record.csv"
    path.write_text("0,0\n1,2\n2,1\n", encoding="utf-8")
    drawn = {"row": "x1", "ax": None}
    return {
        "ForceRecord": (
            vi.ForceRecord, {"time": [0.0, 1.0], "values": [0.0, 1.0], "row": "x1", "kind": "force"},
        ),
        "ForceRecord.from_csv": (
            vi.ForceRecord.from_csv,
            {"path": path, "time": 0, "values": 1, "step": None, "factor": 1.0, "time_factor": 1.0,
             "row": None, "kind": "base"},
        ),
        "ForceRecord.at": (record.at, {"t": [0.5]}),
        "ForceRecord.scaled": (record.scaled, {"factor": 2.0}),
        "ForceRecord.pieces": (record.pieces, {"after": 2.0}),
        "ForceRecord.plot": (record.plot, {"ax": None}),
        "simulate_record": (
            vi.simulate_record,
            {"system": damper, "record": record, "start": None, "after": 1.0, "own_forces": False},
        ),
        "RecordResponse.at": (response.at, {"t": [0.5]}),
        "RecordResponse.row_at": (response.row_at, {"row": "x1", "t": [0.5]}),
        "RecordResponse.measure": (response.measure, {"measure": "peak x1"}),
        "RecordResponse.peak": (response.peak, {"row": "x1"}),
        "RecordResponse.peak_acceleration": (response.peak_acceleration, {"row": "a1"}),
        "RecordResponse.to_dataset": (response.to_dataset, {"t": [0.5]}),
        "RecordResponse.plot": (response.plot, drawn),
        "free_decay": (
            vi.free_decay,
            {"system": damper, "start": {"v1": 1.0}, "row": "x1", "remaining": 0.1, "rest": None,
             "t_max": 5.0},
        ),
        "free_decay, start": (
            lambda v1: vi.free_decay(damper, {"v1": v1}, t_max=5.0), {"v1": 1.0},
        ),
        "FreeDecay.to_dataset": (decay.to_dataset, {"points": 10}),
        "FreeDecay.plot": (decay.plot, {"ax": None}),
        "sine_sweep": (
            vi.sine_sweep,
            {"system": damper, "parameter": "omega", "bounds": (1.1, 1.2), "row": "x1", "unit": "",
             "points": 2, "rate": None, "spacing": "linear", "periods_per_step": 1, "way": "up",
             "start": None, "observe": "speeds", "progress": False},
        ),
        "sine_sweep, rate": (
            lambda rate: vi.sine_sweep(damper, "omega", (1.1, 1.2), rate=rate, progress=False),
            {"rate": 0.01},
        ),
        "SineSweep.quantity": (swept.quantity, {"name": "peak"}),
        "SineSweep.plot": (swept.plot, {"quantity": "peak", "ax": None}),
        "response_spectrum": (
            vi.response_spectrum,
            {"record": record, "over": [1.0, 2.0], "zeta": 0.05, "unit": "Hz",
             "clearance": 0.1, "lower_clearance": None, "restitution": 0.5, "progress": False},
        ),
        "ResponseSpectrum.plot": (spectrum.plot, {"quantity": "displacement", "ax": None}),
        "plot_free_decay": (plotting.plot_free_decay, {"decay": decay, "ax": None}),
        "plot_sine_sweep": (
            plotting.plot_sine_sweep, {"swept": swept, "quantity": "rms", "ax": None},
        ),
        "plot_record": (plotting.plot_record, {"record": record, "ax": None}),
        "plot_record_response": (
            plotting.plot_record_response, {"response": response} | drawn,
        ),
        "plot_response_spectrum": (
            plotting.plot_response_spectrum,
            {"spectrum": spectrum, "quantity": "impulse", "ax": None},
        ),
    }  # fmt: skip


NONSENSE = {
    "None": None, "a text": "text", "a list": [], "a dictionary": {}, "an object": object(),
    "-1": -1, "0": 0, "nan": math.nan, "inf": math.inf, "10^12": 10**12, "1e308": 1e308,
    "10^400": 10**400, "an array": np.array([1.0, 2.0]), "a function": a_function, "True": True,
    "a complex number": 2 + 1j, "a class": vi.ImpactDamper, "a list of None": [None],
    "a list of texts": ["a"], "a dataset": xr.Dataset(),
}  # fmt: skip
NAMES = [
    "ImpactDamper", "ImpactDamper.from_physical", "ImpactDamper.on_stop", "ImpactOscillator",
    "ImpactOscillator.from_physical", "ImpactOscillator.on_stop", "RigidStop",
    "SoftStop", "Friction", "NormalLoad", "PhaseSwitch", "HybridSystem", "LinearMode",
    "LinearGuard", "Transition", "simulate_hybrid", "HybridRun.at",
    "Harmonic", "Mechanism", "Structure", "Structure.chain", "Structure.of_modes",
    "Structure.of_matrices", "Structure.of_files",
    "Structure.row", "Structure.mechanism", "State", "State.perturbed", "Steps", "Family",
    "ExplicitMap", "ExplicitMap.__call__", "ExplicitMap.derivative", "ExplicitMap.linearised",
    "ExplicitMap.forms", "ExplicitMap.fixed_point", "ExplicitMap.residual", "ExplicitMap.jacobian",
    "ExplicitMap.watch", "RandomStarts", "RandomStarts, range", "GridStarts", "GridStarts, axis",
    "ListedStarts", "Explorer", "simulate", "simulate, no end", "Run.at", "Run.forces", "section",
    "AtStop", "AtPhase", "AtChange", "Section.plot", "classify", "classify_points", "lyapunov_exponent",
    "lyapunov_spectrum", "map_derivative",
    "symmetric_orbits", "symmetries", "find_orbit", "Guess", "find_orbits", "full_map",
    "half_map", "impact_map", "stroboscopic_map", "SegmentMap.derivative", "normal_form",
    "find_circle", "find_circle, formula", "CircleGuess", "Circle.at", "Circle.plot",
    "continue_circle", "CircleBranch.__getitem__", "CircleBranch.plot", "switch_circle",
    "plot_circle_branch", "plot_invariant_circle", "plot_exponents", "plot_orbit", "plot_orbits",
    "plot_tuned_damper", "Orbit.why_inadmissible", "continue_orbit",
    "switch_branch", "branch_diagram", "Branch.orbit", "continue_bifurcation", "continue_level",
    "switch_curve", "bifurcation_atlas", "tongue", "Tongue.plot", "map_bifurcation",
    "BifurcationCurve.orbit", "BifurcationCurve.__getitem__", "BifurcationCurve.plot",
    "save, a result", "load", "load_machine", "load_start", "Result.to_csv",
    "plot_curves", "Branch.__getitem__", "Branch.plot", "Diagram.plot",
    "Diagram.origin", "sweep", "sweep, axis", "rerun_sweep", "plane",
    "multistability", "basins", "attractor_state", "bifurcation_sweep", "plot_along",
    "plot_basins", "plot_bifurcation_diagram", "plot_branch_multipliers", "plot_branches",
    "plot_circle_error", "plot_circle_half_width", "plot_circles", "plot_forces", "plot_history",
    "plot_hybrid_run", "plot_hysteresis",
    "plot_mechanism", "plot_multipliers", "plot_phase_portrait", "plot_plane", "plot_section",
    "plot_tongue", "plot_touch", "save",
    *(f"observe.{kind.__name__}" for kind in OBSERVERS.values() if fields(cast(Any, kind))),
    "Objective", "optimise", "Design.plot", "Design.report", "design_map",
    "DesignMap.plot", "pareto_front", "ParetoFront.machine",
    "ParetoFront.plot", "plot_design", "plot_design_map", "plot_pareto_front",
    "frequency_response", "Response.at", "Response.largest", "Response.plot", "Response.report",
    "measure_of",
    "measures.Amplitude", "measures.Peak", "measures.Rms", "measures.Harmonic",
    "measures.Transmissibility", "measures.DissipatedPower", "measures.ContactForce",
    "measures.Impulse", "measures.ImpactSpeed", "Measure.of_orbit", "Measure.derivative",
    "Measure.along", "tuned_damper", "plot_response",
    "ForceRecord", "ForceRecord.from_csv", "ForceRecord.at", "ForceRecord.scaled",
    "ForceRecord.pieces", "ForceRecord.plot", "simulate_record", "RecordResponse.at",
    "RecordResponse.row_at", "RecordResponse.measure", "RecordResponse.peak",
    "RecordResponse.peak_acceleration", "RecordResponse.to_dataset", "RecordResponse.plot",
    "free_decay", "free_decay, start", "FreeDecay.to_dataset", "FreeDecay.plot", "sine_sweep",
    "sine_sweep, rate", "SineSweep.quantity", "SineSweep.plot", "response_spectrum",
    "ResponseSpectrum.plot", "print_style", "plot_free_decay", "plot_sine_sweep",
    "plot_record", "plot_record_response", "plot_response_spectrum",
]  # fmt: skip


@pytest.fixture(scope="module")
def table(tmp_path_factory: pytest.TempPathFactory) -> tuple[dict[str, Call], dict[str, Any]]:
    return _calls(tmp_path_factory.mktemp("misuse"))


@pytest.mark.slow
def test_every_name_has_its_call(table: tuple[dict[str, Call], dict[str, Any]]) -> None:
    assert sorted(NAMES) == sorted(table[0])


def test_every_public_name_is_called() -> None:
    called = {name.partition(".")[0].partition(",")[0] for name in NAMES}
    assert {*vi.__all__} - RESULTS - ENUMS_AND_ERRORS <= called
    assert {*plotting.__all__} <= called


@pytest.mark.slow
@pytest.mark.parametrize("name", NAMES)
def test_nonsense_is_answered_by_an_error_of_the_package(
    name: str, table: tuple[dict[str, Call], dict[str, Any]], tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:  # fmt: skip
    """Or by a result, where it is none: True is a flag, 10^12 a step of an axis."""
    monkeypatch.chdir(tmp_path)
    calls, ours = table
    call, valid = calls[name]
    bare = []
    for argument, (label, nonsense) in itertools.product(valid, (NONSENSE | ours).items()):
        if label == "10^12" and (name, argument) in LONG:
            continue
        try:
            with warnings.catch_warnings():
                warnings.simplefilter("ignore", UserWarning)  # of the cap on impacts
                call(**(valid | {argument: nonsense}))
        except vi.VibroImpactError as error:
            if "\n" in str(error) or len(str(error)) > 480:
                bare.append(f"{argument} = {label}: a message of {len(str(error))} characters")
        except Exception as error:
            bare.append(f"{argument} = {label}: {type(error).__name__}: {error}")
        plt.close("all")
    assert not bare, "\n".join(bare)


@pytest.mark.slow
@pytest.mark.parametrize("columns", [1, 2])
@pytest.mark.parametrize("name", [name for name in NAMES if name.startswith("plot_")])
def test_every_plot_fits_in_print(
    name: str, columns: int, table: tuple[dict[str, Call], dict[str, Any]]
) -> None:
    call, valid = table[0][name]
    with plotting.print_style(columns):
        assert_nothing_is_cut(call(**valid).get_figure(root=True))
    plt.close("all")


# ---- flags and names of files --------------------------------------------------------------------

SWEEPING = {  # they pass options on to a sweep
    "plane", "multistability", "basins", "bifurcation_sweep", "rerun_sweep",
}  # fmt: skip
NOT_GIVEN = RESULTS | ENUMS_AND_ERRORS  # classes that nobody calls
NO_FLAGS = {
    "an array": np.array([True, False]), "an array of one": np.array([True]),
    "an array without axes": np.array(True), "a series": xr.DataArray([1.0]).to_series(),
    "a text": "yes", "an empty text": "", "2": 2, "1": 1, "0.0": 0.0, "nan": math.nan,
    "a list": [True],
}  # fmt: skip
NO_PATHS: dict[str, Any] = {
    "a null byte": "name\0.nc", "a path with a null byte": Path("name\0.nc"),
    "half a pair": "\ud800.nc", "a long name": 300 * "x" + ".nc", "an empty text": "", "3": 3,
    "2.5": 2.5, "bytes": b"name.nc", "a list": ["name.nc"], "True": True, "nan": math.nan,
    "an array": np.array(["name.nc"]), "a loop of links": "loop.nc",
}  # fmt: skip


def parameters_with(words: tuple[str, ...]) -> set[tuple[str, str]]:
    """Public functions, classes, methods and plots, with their parameters of a type that holds a word."""
    callables = {
        name: getattr(module, name) for module in (vi, plotting) for name in module.__all__
    }
    classes = {name: one for name, one in callables.items() if inspect.isclass(one)}
    callables |= {
        f"{name}.{method}": one
        for name, kind in classes.items() if name not in ENUMS_AND_ERRORS
        for method, one in inspect.getmembers(kind, callable)
        if not method.startswith("_") and method in vars(kind)
    }  # fmt: skip
    return {
        (name, parameter.name)
        for name, one in callables.items() if name not in NOT_GIVEN
        for parameter in inspect.signature(one).parameters.values()
        if any(word in str(parameter.annotation).partition("Callable")[0] for word in words)
    }  # fmt: skip


FLAGS = parameters_with(("bool",)) | {(name, "progress") for name in SWEEPING}
FILES = parameters_with(("PathLike",)) | {(name, "store") for name in SWEEPING}


def refusals(call: Call, argument: str, values: dict[str, Any]) -> str:
    """What is wrong with the answers to invalid values, a line each."""
    function, valid = call
    wrong = []
    for label, value in values.items():
        try:
            with warnings.catch_warnings():
                warnings.simplefilter("ignore", UserWarning)
                function(**(valid | {argument: value}))
            wrong.append(f"{argument} = {label}: is taken")
        except vi.InvalidParameterError as error:
            if not str(error).startswith(f"{argument} = ") or "must be" not in str(error):
                wrong.append(f"{argument} = {label}: {error}")
        except Exception as error:
            wrong.append(f"{argument} = {label}: {type(error).__name__}: {error}")
        plt.close("all")
    return "\n".join(wrong)


@pytest.mark.slow
@pytest.mark.parametrize(("name", "argument"), sorted(FLAGS))
def test_a_flag_is_true_or_false_and_nothing_else(
    name: str, argument: str, table: tuple[dict[str, Call], dict[str, Any]]
) -> None:
    assert not refusals(table[0][name], argument, NO_FLAGS)


@pytest.mark.slow
@pytest.mark.parametrize(("name", "argument"), sorted(FILES))
def test_what_cannot_be_the_name_of_a_file_is_refused_with_the_value(
    name: str, argument: str, table: tuple[dict[str, Call], dict[str, Any]], tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:  # fmt: skip
    """Before anything is computed for it; nor is it a folder, or in a folder that is not there."""
    monkeypatch.chdir(tmp_path)
    Path("loop.nc").symlink_to("loop.nc")
    Path("folder.nc").mkdir()
    folders: dict[str, Any] = {
        "a folder": "folder.nc", "no folder": "nowhere/name.nc", "in a file": f"{__file__}/name.nc",
    }  # fmt: skip
    assert not refusals(table[0][name], argument, NO_PATHS)
    function, valid = table[0][name]
    for place in folders.values():
        with pytest.raises(vi.InvalidParameterError, match=f"{argument} = .*{place}"):
            function(**(valid | {argument: place}))


@pytest.mark.parametrize("value", [v for v in NO_PATHS.values() if isinstance(v, str)])
@pytest.mark.parametrize(
    "words",
    [
        ["simulate", "--config"], ["sweep", "impact-damper/A", "--over", "omega=1.1:1.2:2", "--store"],
        ["simulate", "impact-damper/A", "--omega", "1", "--out"], ["tongue", "--at", "R1_1"],
        ["curve", "impact-damper/A", "--branch", "omega=0.9:1.0", "--bounds", "zeta=0.04:0.05", "--at", "NS1",
         "--behind"],
        ["design", "impact-damper/A", "--bounds", "half_clearance=4:6", "--band", "omega=1.1:1.2", "--store"],
    ],
)  # fmt: skip
def test_the_command_line_refuses_what_cannot_be_the_name_of_a_file(
    words: list[str], value: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:  # fmt: skip
    monkeypatch.chdir(tmp_path)
    Path("loop.nc").symlink_to("loop.nc")
    assert main([*words, value]) == 2, words
    assert "Traceback" not in capsys.readouterr().err


# ---- keywords ------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: vi.RigidStop((1.0,), upper=1.0, friction=0.1), "RigidStop, .*row.* Friction\\(row"),
        (lambda: vi.RigidStop((1.0,), upper=1.0, stiffness=9.0), "is a SoftStop"),
        (lambda: vi.RigidStop((1.0,), upper=1.0, velocity=1.0), "has motion"),
        (lambda: vi.RigidStop((1.0,), upper=1.0, upper_motion=SWING), "upper_motion.*Give motion"),
        (lambda: vi.Mechanism(stiffness_=[[1.0]]), "takes mass, .* Did you mean stiffness"),
        (lambda: vi.ImpactDamper(omgea=1.0), "Did you mean omega"),
        (lambda: vi.LinearGuard(rows=[1.0]), "LinearGuard, which takes row, .* Did you mean row"),
        (lambda: vi.ImpactDamper(M1=1.0), "from_physical"),
        (lambda: vi.Harmonic(1.0, amplitude=1.0), "sine and cosine"),
        (lambda: vi.State((0.0,), (0.0,), theta=1.0), "State, which takes position"),
    ],
)  # fmt: skip
def test_an_unknown_keyword_is_answered_with_those_there_are(
    make: Callable[[], Any], message: str
) -> None:
    with pytest.raises(vi.InvalidParameterError, match=message) as caught:
        make()
    assert isinstance(caught.value, TypeError)  # as Python's own answer is


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: vi.RigidStop((1.0,), upper=a_function), "a_function: .* has motion"),
        (lambda: vi.Harmonic(1.0, a_function), "a_function: .* harmonic lines"),
    ],
)
def test_a_function_of_time_is_answered_with_what_is_possible(
    make: Callable[[], Any], message: str
) -> None:
    with pytest.raises(vi.InvalidParameterError, match=message):
        make()


# ---- what a message shows ------------------------------------------------------------------------


def test_a_message_shows_a_number_whole_and_a_long_value_shortened() -> None:
    assert checks.shown(1.25) == "1.25"
    assert checks.shown(np.float64(1.25)) == "1.25"
    assert checks.shown("text") == "'text'"
    assert checks.shown(np.zeros((400, 3))) == "array of shape (400, 3)"
    assert checks.shown(list(range(400))) == "[0, 1, 2, 3, 4, 5, ...]"
    assert checks.shown(xr.Dataset()).count("\n") == 0
    assert len(checks.shown(10**4000)) < 100


def test_too_many_contacts_are_counted_and_not_printed() -> None:
    many = tuple(vi.RigidStop((1.0,), upper=float(i + 1)) for i in range(17))
    with pytest.raises(vi.InvalidParameterError, match="elements: 17 are given; must be 1 to 16"):
        vi.Mechanism(mass=[[1.0]], damping=[[0.0]], stiffness=[[1.0]], elements=many)


UPPER: dict[str, Any] = {"row": (1.0,), "upper": 1.0}
SWING = vi.Harmonic(1.0, (0.1,))
PAIR = vi.Harmonic(1.0, (0.1, 0.2))


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: vi.SoftStop((1.0,), 0.5, 0.2), r"lower = 0\.5, upper = 0\.2: .* two one-sided"),
        (lambda: vi.RigidStop((1.0,), 0.5, 0.2), r"lower = 0\.5, upper = 0\.2: need lower < upper"),
        (lambda: vi.SoftStop((1.0,)), "need lower <= upper, one finite"),
        (lambda: vi.SoftStop(**UPPER, stiffness=(1, 2, 3)), r"\(1, 2, 3\): .*\(lower, upper\)"),
        (lambda: vi.SoftStop(**UPPER, stiffness=(0.0, 1.0)), r"stiffness = 0\.0: must be > 0"),
        (lambda: vi.SoftStop(**UPPER, stiffness=a_function), "a_function: .* sum of soft stops"),
        (lambda: vi.SoftStop((1.0,), upper=a_function), "a_function: .* has motion"),
        (lambda: vi.SoftStop(**UPPER, motion=PAIR), "motion: has 2 amplitudes.*sine=.a,"),
        (lambda: vi.SoftStop(**UPPER, motion=a_function), "a_function: .* Fourier series"),
        (
            lambda: vi.SoftStop(**UPPER, law="never"),
            "'never': must be one of linear, unilateral, limited",
        ),
        (lambda: vi.SoftStop(**UPPER, release="gap"), "release.*Give law: 'linear' pulls"),
        (lambda: vi.SoftStop(**UPPER, preload=1.0), "upper < 0"),
        (lambda: vi.Friction((1.0,), 0.2, 0.1), r"static = 0\.1: must be >= kinetic = 0\.2"),
        (
            lambda: vi.Friction((1.0 - 1.0, 0.0), 0.2),
            "between a coordinate and itself nothing acts",
        ),
        (lambda: vi.Friction((1.0,), a_function), "a_function: .* two levels are: kinetic, static"),
        (lambda: vi.Friction((1.0,), 0.1, belt_speed=a_function), "a_function: .* has motion"),
        (lambda: vi.Friction((1.0,), 0.1, belt_motion=SWING), "belt_motion.*displacement"),
        (lambda: vi.Friction((1.0,), 0.1, mu=0.3), "coefficient times normal load"),
        (
            lambda: still(*[RUBBING] * 9),
            "elements: 9 are given; .* at most 8 of them no .* are one",
        ),
        (lambda: still(RUBBING, vi.Friction((1.0, -1.0), 0.1)), r"elements\[1\]\.row has shape"),
        (lambda: still(a_function), r"elements\[0\] = .*a RigidStop or SoftStop or Friction"),
        (
            lambda: still(
                vi.SoftStop(**UPPER, motion=tuple(vi.Harmonic(1.0 + i, (0.1,)) for i in range(13)))
            ),
            "13 frequencies are given; must be at most 12, those of moving stops",
        ),
        (
            lambda: vi.full_map(
                vi.find_orbit(maxwell(RIGID), vi.State((0.0, 0.0), (0.0, 0.0))), "mass[1][1]"
            ),
            "would give coordinate 1 a mass.*Give it a small mass first",
        ),
        (
            lambda: vi.find_orbit(
                still(RUBBING), vi.Guess(np.ones((1, 3)), np.ones(1)), stops=[(0, 1)]
            ),
            "0 flights are given for 1 impacts.*Give a run, a state or an orbit",
        ),
        (
            lambda: vi.section(still(RUBBING), vi.State((1.0,), (0.0,)), at=vi.AtStop()),
            "is friction, which has no stop.*AtChange",
        ),
    ],
)
def test_a_mistake_in_an_element_is_answered_with_the_value_and_the_way_out(
    make: Callable[[], Any], message: str
) -> None:
    with pytest.raises(vi.InvalidParameterError, match=message) as caught:
        make()
    assert len(str(caught.value)) < 500  # values are shortened, sequences counted


# ---- lengths -------------------------------------------------------------------------------------


def test_a_run_that_memory_cannot_hold_is_refused_with_its_size() -> None:
    damper, state = vi.ImpactDamper(**DAMPER), vi.State((0.0, 0.0), (0.0, 1.0))
    with pytest.raises(vi.InvalidParameterError, match=r"impacts = 10+: needs .* GB.* t_max"):
        vi.simulate(damper, state, impacts=10**12)
    with pytest.raises(vi.InvalidParameterError, match=r"points = 10+: needs .* GB"):
        vi.section(damper, state, points=10**12)
    assert main(["simulate", "impact-damper/A", "--omega", "1", "--impacts", str(10**12)]) == 2


def test_any_number_of_impacts_may_be_asked_for_up_to_a_time() -> None:
    damper, state = vi.ImpactDamper(**DAMPER), vi.State((0.0, 0.0), (0.0, 1.0))
    run = vi.simulate(damper, state, impacts=10**12, t_max=100.0)
    few = vi.simulate(damper, state, t_max=100.0)
    assert run.end is vi.RunEnd.HORIZON
    np.testing.assert_array_equal(run.time, few.time)


# ---- files and the command line ------------------------------------------------------------------

MECHANISM = """[mechanism]
mass = [[1.0]]
damping = [[0.1]]
stiffness = [[1.0]]
[[mechanism.elements]]
kind = "rigid_stop"
row = [1.0]
upper = 1.0
"""


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (MECHANISM + "friction = 0.1\n", r"\[\[mechanism.elements\]\]: friction: .*Friction"),
        (MECHANISM + "upperr = 1.0\n", r"elements.*upperr.* row, lower, upper, .*mean upper"),
        (MECHANISM.replace("mass", "mas"), r"\[mechanism\]: mas: .* Did you mean mass"),
        (MECHANISM + "[[mechanism.forces]]\nsine = [1.0]\n", "mechanism.forces.*omega: missing"),
        (MECHANISM + "[start]\nposition = 0.0\nvelocity = [0.0]", r"\[start\]: position has shape"),
        ("[physical]\nm1 = 1.0\n", r"\[physical\]: m1: .*takes M1, M2, .*mean M1"),
        ("[physical]\nM1 = 1.0\n", r"\[physical\]: M2, K, C, F0, Omega, D, restitution: missing"),
        ("[physical]\n" + "".join(f"{k} = '{v}'\n" for k, v in SI.items()), "M1 = '1.0': must be"),
        ("damper = 3\n", r"\[damper\] must be a table"),
    ],
)  # fmt: skip
def test_a_mistake_in_a_file_is_named_with_its_table_and_the_names_there_are(
    text: str, message: str, tmp_path: Path
) -> None:
    file = tmp_path / "system.toml"
    file.write_text(text)
    with pytest.raises(vi.InvalidParameterError, match=message):
        read_case(file)


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["--bounds", "omgea=0.9:1.1"], "bounds = 'omgea': must be one of"),
        (["--bounds", "omega=1.5:0.5"], "must be NAME=LOW:HIGH with LOW < HIGH"),
        (
            ["--omega", "1.3", "--bounds", "omega=0.9:1.2"],
            "bounds = (0.9, 1.2): must hold omega = 1.3",
        ),
    ],
)
def test_the_command_branch_names_the_option_that_is_wrong(
    words: list[str], message: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["branch", "impact-damper/A", *words]) == 2
    assert message in capsys.readouterr().err


def test_a_damaged_file_of_a_branch_is_refused(
    table: tuple[dict[str, Call], dict[str, Any]],
) -> None:
    from vibroimpact.results.files import TEXT, dataset_of, result_of

    data = dataset_of(table[1]["a branch"])
    text = data[TEXT].values
    for cut in range(0, len(text), len(text) // 50):
        damaged = np.concatenate([text[:cut], text[cut + 1 :]])
        with contextlib.suppress(vi.InvalidParameterError):  # a digit less is another number
            result_of(data.drop_vars(TEXT).assign({TEXT: ("other", damaged)}))


# ---- interruptions -------------------------------------------------------------------------------


NOT_LONG = {  # end before anybody could press Ctrl-C
    "attractor_state", "classify_points", "full_map", "half_map", "impact_map", "load", "load_machine", "load_start",
    "map_bifurcation", "measure_of", "normal_form", "save", "stroboscopic_map", "symmetric_orbits", "symmetries",
    "tuned_damper",
}  # fmt: skip
LONG_FUNCTIONS = sorted(
    name for name in vi.__all__ if inspect.isfunction(getattr(vi, name)) and name not in NOT_LONG
)


def interrupted_at(line: int, call: Callable[[], Any]) -> Any:
    """What a call raises or returns that is interrupted at a line of the package; None if it ended before."""
    count = itertools.count()

    def inside(_frame: Any, event: str, _argument: Any) -> Any:
        if event == "line" and next(count) == line:
            sys.settrace(None)
            raise KeyboardInterrupt
        return inside

    def trace(frame: Any, _event: str, _argument: Any) -> Any:
        file, name = frame.f_code.co_filename, frame.f_code.co_name
        ours = "/vibroimpact/" in file and not file.endswith(("progress.py", "checks.py"))
        return inside if ours and name != "<module>" else None  # an import is left whole

    before = sys.gettrace()
    sys.settrace(trace)
    try:
        found = call()
    except KeyboardInterrupt as stop:
        return stop
    finally:
        sys.settrace(before)
    return found if next(count) > line else None


def says_that_it_was_interrupted(found: Any) -> bool:
    """Whether a result tells that it is a part."""
    if isinstance(found, tuple):
        return says_that_it_was_interrupted(found[-1])
    ends = getattr(found, "ends", ()) or getattr(getattr(found, "curve", None), "ends", ())
    return (
        getattr(found, "interrupted", False)
        or getattr(found, "complete", True) is False
        or any(end.reason.name == "INTERRUPTED" for end in ends)
    )


def check_interruption(
    name: str, call: Callable[..., Any], valid: dict[str, Any], line: int
) -> bool:
    """Whether there was one."""
    found = interrupted_at(line, lambda: call(**valid))
    if isinstance(found, KeyboardInterrupt):
        assert str(found).startswith(f"{name}: interrupted; "), (line, str(found))
        assert "the same call" in str(found).lower(), (line, str(found))
        assert "store" not in str(found) or {"store", "options"} & {
            *inspect.signature(call).parameters
        }
    elif found is not None:
        assert says_that_it_was_interrupted(found), (line, found)
    return found is not None


@pytest.mark.parametrize("name", LONG_FUNCTIONS)
def test_an_interruption_has_words_or_a_result_that_tells_of_it(
    name: str, table: tuple[dict[str, Call], dict[str, Any]]
) -> None:
    call, valid = table[0][name]
    assert check_interruption(name, call, valid, 0)
    for line in (30, 1000):
        check_interruption(name, call, valid, line)


@pytest.mark.slow
@pytest.mark.parametrize("name", LONG_FUNCTIONS)
def test_an_interruption_has_words_wherever_it_comes(
    name: str, table: tuple[dict[str, Call], dict[str, Any]]
) -> None:
    call, valid = table[0][name]
    line = 0
    while check_interruption(name, call, valid, line):
        line += 1 + line // 2  # every line at first, then ever fewer
