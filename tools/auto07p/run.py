"""Continue impacting orbits with AUTO-07p and write tests/reference/auto.toml (see README.md)."""

from __future__ import annotations

import json
import math
import os
import shutil
import sys
import tempfile
from pathlib import Path
from typing import Any, NamedTuple

from curves import continue_curve, curve_lines
from henon import henon_lines

HERE = Path(__file__).resolve().parent
TARGET = HERE.parent.parent / "tests" / "reference" / "auto.toml"
AUTO = os.environ.setdefault("AUTO_DIR", "/usr/lib/auto-07p")
VERSION = "0.9.2"

NAMES = {1: "k", 2: "c", 3: "A", 4: "w", 5: "d", 6: "e", 7: "T1", 8: "T2",
         9: "V1", 10: "V2", 12: "phase1", 13: "phase2"}  # fmt: skip
NUMBERS = {name: number for number, name in NAMES.items()}
MEASURED = ("T1", "T2", "V1", "V2", "phase1", "phase2")
SYSTEMS: dict[str, dict[str, float]] = {
    "coco": {"k": 1.0, "c": 0.1, "A": 1.0, "w": 1.0, "d": 1.0, "e": 0.8},
    "budd_dux": {"k": 1.0, "c": 0.0, "A": 1.0, "w": 2.8, "d": 0.0, "e": 0.8},
}
STARTS = {  # impact speed and phase of an orbit of one impact per period
    "coco": (1.69573293759488, 0.0759521649383124),
    "budd_dux": (0.336177269975670, 3.059376757945427),
}
RECORD: dict[str, list[float]] = {  # values of the free parameter at which to record
    "w": [0.8, 0.85, 0.9, 0.95, 1.05, 1.1, 1.2, 1.3, 1.4, 1.45, 1.5, 1.55, 1.6, 1.65, 1.7],
    "A": [0.11, 0.12, 0.15, 0.2, 0.25, 0.3, 0.35, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9],
    "d": [-1.6, -1.2, -0.8, -0.4, -0.2, -0.1, -0.05, -0.02, 0.02, 0.04, 0.06, 0.08],
}


class Curve(NamedTuple):
    """A curve of bifurcations, and the orbit near it from which it is reached."""

    name: str
    branch: str
    value: float  # of the branch's parameter at the orbit
    passage: int  # past that value along the branch
    flights: int
    kind: str
    free: tuple[str, str]


CURVES = (
    Curve("coco_folds", "coco_up", 1.7, 1, 1, "SN", ("e", "w")),
    Curve("budd_dux_folds", "budd_dux", -1.6, 1, 1, "SN", ("w", "d")),
    Curve("budd_dux_doublings", "budd_dux", -0.05, 0, 1, "PD", ("w", "d")),
    Curve("budd_dux_doubled_folds", "budd_dux_doubled", 0.08, 1, 2, "SN", ("w", "d")),
    Curve("budd_dux_doubled_doublings_1", "budd_dux_doubled", -0.02, 0, 2, "PD", ("w", "d")),
    Curve("budd_dux_doubled_doublings_2", "budd_dux_doubled", 0.06, 0, 2, "PD", ("w", "d")),
)
ALONG = {  # values of the first parameter at which to record a curve
    "e": [0.5, 0.55, 0.6, 0.65, 0.7, 0.75, 0.85, 0.9, 0.92, 0.95],
    "w": [2.2, 2.3, 2.4, 2.5, 2.6, 2.7, 2.75, 2.85, 2.9, 3.0, 3.05, 3.1, 3.2, 3.3, 3.4, 3.5],
}
STEPS = 4000  # of Runge and Kutta's method over the first flight, which AUTO then corrects
ROWS = 200  # of them written
LOCATED = 1e-6  # AUTO meets a value asked for less exactly than the tolerances below
CONSTANTS: dict[str, Any] = {
    "e": "impact", "NDIM": 6, "IPS": 4, "NBC": 8, "NINT": 0, "IRS": 0, "IPLT": 0, "JAC": 0,
    "NTST": 60, "NCOL": 7, "IAD": 3, "ILP": 1, "ISW": 1, "MXBF": 0, "NPR": 0, "IID": 2,
    "NMX": 400, "ITMX": 20, "ITNW": 9, "NWTN": 3, "A0": -1e9, "A1": 1e9,
    "EPSL": 1e-10, "EPSU": 1e-10, "EPSS": 1e-8, "DSMIN": 1e-8, "DSMAX": 0.05, "IADS": 1,
}  # fmt: skip
NEAR_SINGULAR = {"EPSL": 1e-8, "EPSU": 1e-8, "EPSS": 1e-5}  # beside a branch point, where finer
# tolerances let Newton's method slip onto the other branch


def write_start(p: dict[str, float], speed: float, phase: float, file: Path) -> float:
    """Write the flight, twice in a row, in the columns of AUTO; give its time."""
    T, x, v = 2 * math.pi / p["w"], p["d"], -p["e"] * speed
    h, rows = T / STEPS, []

    def force(x: float, v: float, t: float) -> float:
        return p["A"] * math.cos(phase + p["w"] * t) - p["c"] * v - p["k"] * x

    for i in range(STEPS + 1):
        t = i * h
        if i % (STEPS // ROWS) == 0:
            theta = phase + p["w"] * t
            rows.append([i / STEPS, x, v, theta, x, v, theta + 2 * math.pi])
        a1 = force(x, v, t)
        v2 = v + h / 2 * a1
        a2 = force(x + h / 2 * v, v2, t + h / 2)
        v3 = v + h / 2 * a2
        a3 = force(x + h / 2 * v2, v3, t + h / 2)
        v4 = v + h * a3
        a4 = force(x + h * v3, v4, t + h)
        x, v = x + h / 6 * (v + 2 * v2 + 2 * v3 + v4), v + h / 6 * (a1 + 2 * a2 + 2 * a3 + a4)
    file.write_text("\n".join(" ".join(f"{a:.16e}" for a in row) for row in rows) + "\n")
    return T


def continue_from(auto: Any, system: str, free: str, low: float, high: float, **more: Any) -> Any:
    """Follow a branch in one parameter from the start of a system until a speed is zero."""
    p = SYSTEMS[system]
    T = write_start(p, *STARTS[system], Path(f"{system}.dat"))
    values = {NUMBERS[k]: v for k, v in p.items()} | {7: T, 8: T}
    return auto.run(
        dat=system, PAR=values, ICP=[NUMBERS[free], *(NUMBERS[n] for n in MEASURED)],
        RL0=low, RL1=high, UZR={NUMBERS[free]: RECORD[free], -9: 0.0, -10: 0.0}, parnames=NAMES,
        **{**CONSTANTS, "ISP": 0, **more},
    )  # fmt: skip


def branch_lines(name: str, system: str, free: str, branch: Any) -> list[str]:
    """The labelled points of a branch: AUTO's type, the parameter, times, speeds, phases."""
    out = ["", "[[branch]]", f'name = "{name}"', f'free = "{free}"']
    out += [f"{k} = {v}" for k, v in SYSTEMS[system].items() if k != free]
    columns = ("type", free, *MEASURED)
    out += [f"columns = {json.dumps(columns)}", "points = ["]
    for solution in branch():
        numbers = [float(solution[key]) for key in columns[1:]]
        out.append(f"  {json.dumps([solution['TY'], *numbers])},")
    return [*out, "]"]


def tables(auto: Any) -> list[str]:
    """Every branch and every curve."""
    plain = (
        ("coco_up", "coco", "w", 0.5, 3.0, {"DS": 0.01}),
        ("coco_down", "coco", "w", 0.79, 3.0, {"DS": -0.01}),
        ("coco_amplitude", "coco", "A", 0.05, 1.5, {"DS": -0.01}),
        ("budd_dux", "budd_dux", "d", -2.0, 2.0, {"DS": -0.01}),
    )
    found: dict[str, tuple[str, str, Any]] = {}
    for name, system, free, low, high, more in plain:
        found[name] = system, free, continue_from(auto, system, free, low, high, **more)
    until = continue_from(
        auto, "budd_dux", "d", -2.0, 2.0, DS=-0.01, ISP=2, STOP=["BP1"], **NEAR_SINGULAR
    )
    found["budd_dux_doubling"] = "budd_dux", "d", until
    exact = {key: CONSTANTS[key] for key in NEAR_SINGULAR}
    doubled = auto.run(until("BP1"), ISW=-1, ISP=0, DS=0.01, STOP=[], **exact)
    found["budd_dux_doubled"] = "budd_dux", "d", doubled
    out: list[str] = []
    for name, (system, free, branch) in found.items():
        out += branch_lines(name, system, free, branch)
    for curve in CURVES:
        out += lines_along(auto, curve, *found[curve.branch])
    return out


def lines_along(auto: Any, curve: Curve, system: str, free: str, branch: Any) -> list[str]:
    """A curve of bifurcations, from an orbit on a branch."""
    there = [s for s in branch() if abs(float(s[free]) - curve.value) < LOCATED][curve.passage]
    at = {name: float(there[name]) for name in MEASURED}
    p = {**SYSTEMS[system], free: float(there[free])}
    points = continue_curve(
        auto, CONSTANTS, p, at, curve.flights, curve.kind, curve.free, ALONG[curve.free[0]]
    )
    return curve_lines(curve.name, p, curve.flights, curve.kind, curve.free, points)


def main() -> None:
    """Run AUTO in a folder of its own and write the table."""
    sys.path.insert(0, f"{AUTO}/python")
    import auto  # type: ignore[import-not-found]

    header = [
        f"# Generated by tools/auto07p/run.py with AUTO-07p {VERSION}; do not edit.",
        "# x'' + c x' + k x = A cos(theta), theta' = w, wall x <= d, v+ = -e v-: two flights of",
        "# times T1, T2 over two forcing periods, impact speeds V1, V2 and phases at their ends,",
        "# not reduced. type: LP fold, BP branch point (here a period doubling), UZ a value asked",
        "# for or, where V1 or V2 is zero, the end of the branch, EP an end. AUTO does not look",
        "# whether a flight crosses the wall. name: coco_* and budd_dux have equal flights;",
        "# budd_dux_doubling ends at their branch point, located only to EPSS_at_branch_point for",
        "# the sake of the switch; budd_dux_doubled starts there.",
        "# curve: folds (SN) and period doublings (PD) of orbits with so many flights over as many",
        "# periods, in two parameters; the variations of the orbit are unknowns, too (curves.f90).",
        "# Recorded at values of the first parameter, and where V1 or V2 is zero, the end.",
        "# henon: curves of the map (x, y) -> (y, alpha - beta x - y^2 + R x y), R = 1/2, with the",
        "# strong resonances that AUTO finds on them (henon.py).",
        "", f'version = "{VERSION}"',
        *(f"{key} = {CONSTANTS[key]}" for key in ("NTST", "NCOL", "EPSL", "EPSU", "EPSS")),
        f"EPSS_at_branch_point = {NEAR_SINGULAR['EPSS']}",
    ]  # fmt: skip
    with tempfile.TemporaryDirectory() as folder:
        os.chdir(folder)
        for equations in HERE.glob("*.f90"):
            shutil.copy(equations, folder)
        lines = header + tables(auto) + henon_lines(auto)
        os.chdir(HERE)
    TARGET.write_text("\n".join(lines) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
