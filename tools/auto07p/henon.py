"""Curves of folds, period doublings and Neimark-Sacker points of the generalised Henon map.

AUTO follows the fixed point in alpha, finds the three bifurcations, and follows each in (alpha, beta) by its own
extended systems (``ISW`` = 2). It needs the derivatives of henon.f90: with differences (``JAC`` = 0) the first
steps do not converge.
"""

from __future__ import annotations

from typing import Any

CONSTANTS: dict[str, Any] = {
    "NDIM": 2, "IPS": -1, "JAC": 1, "ISP": 2, "ILP": 1, "IRS": 0, "NTST": 10, "NCOL": 4, "IAD": 0,
    "ITNW": 9, "NWTN": 3, "ITMX": 20, "DSMIN": 1e-7, "IADS": 1, "EPSL": 1e-10, "EPSU": 1e-10,
    "EPSS": 1e-9, "MXBF": 0, "NPR": 0, "IID": 2, "parnames": {1: "alpha", 2: "beta", 3: "R"},
    "PAR": {}, "UZR": {}, "STOP": [], "RL0": -1e9, "RL1": 1e9, "NBC": 0, "NINT": 0, "A0": -1e9, "A1": 1e9,
}  # fmt: skip
ALPHAS = [-3.0, -2.0, -0.8, -0.4, 0.3, 0.6, 1.0, 1.5, 2.0, 3.0]
BOX = {"alpha": [-4.0, 5.0], "beta": [-0.9, 2.5]}
KINDS = {"SN": ("LP1", -0.01), "PD": ("PD1", 0.01), "NS": ("TR1", -0.01)}


def value(solution: Any, name: str) -> float:
    """Number of a parameter, or of a coordinate, which AUTO gives as an array."""
    found = solution[name]
    return float(found[0] if getattr(found, "shape", ()) else found)


def henon_lines(auto: Any) -> list[str]:
    """Tables of the three curves: recorded and strongly resonant points (alpha, beta, x)."""
    out: list[str] = []
    for kind, (label, step) in KINDS.items():
        branch = auto.run(
            e="henon", ICP=["alpha"], ISW=1, DS=step, DSMAX=0.02, NMX=2000, UZSTOP=BOX, **CONSTANTS
        )
        rows: dict[tuple[float, float], tuple[str, list[float]]] = {}
        for direction in (0.01, -0.01):
            curve = auto.run(
                branch(label), ICP=["alpha", "beta"], ISW=2, DS=direction, DSMAX=0.05, NMX=400,
                UZSTOP=BOX, **{**CONSTANTS, "ILP": 0, "UZR": {"alpha": ALPHAS}},
            )  # fmt: skip
            for point in curve():
                row = [value(point, name) for name in ("alpha", "beta", "U(1)")]
                if point["TY"] in ("UZ", "R1", "R2", "R3", "R4"):
                    rows.setdefault((round(row[0], 6), round(row[1], 6)), (point["TY"], row))
        out += ["", "[[henon]]", f'kind = "{kind}"', 'columns = ["type", "alpha", "beta", "x"]']
        out.append("points = [")
        for kind_of_point, row in sorted(rows.values(), key=lambda one: one[1]):
            out.append(f'  ["{kind_of_point}", ' + ", ".join(f"{x:.12g}" for x in row) + "],")
        out.append("]")
    return out
