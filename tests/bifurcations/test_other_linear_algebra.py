"""Curves and their points are the same with the linear algebra of other processors, which rounds otherwise.

OpenBLAS, which NumPy and SciPy bring with them, has kernels for many processors and chooses by OPENBLAS_CORETYPE; with
another library this compares a process with itself.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
from typing import Any

import pytest

pytestmark = pytest.mark.slow

SCRIPT = """
import json
from dataclasses import replace

import vibroimpact as vi

damper = vi.ImpactDamper(mass_ratio=0.1, omega_n=0.5, zeta=0.045, restitution=0.8, half_clearance=5.0, omega=1.2)
axes, bounds = ("omega", "half_clearance"), ((0.6, 1.4), (1.0, 10.0))
symmetric = vi.continue_orbit(vi.symmetric_orbits(damper)[0], "omega", (0.6, 1.2))
broken = vi.switch_branch(symmetric["BP1"], (0.6, 0.72))
torus = vi.continue_bifurcation(symmetric["NS1"], axes, bounds)
doubling = vi.continue_bifurcation(broken["PD1"], axes, bounds)
saddles = vi.continue_bifurcation(doubling["R2_1"], axes, bounds, kind="NS")
quintic = vi.ExplicitMap(  # all terms of its cubic coefficient vanish at GPD
    lambda x, p: [-(1.0 + p[0]) * x[0] + p[1] * x[0] ** 3 - x[0] ** 5], dimension=1, parameters=("a", "b"))
flips = vi.continue_bifurcation(
    vi.map_bifurcation("PD", quintic, (0.0,), (0.0, 0.37)), ("a", "b"), ((-0.5, 0.5), (-1.0, 1.0)))
born = vi.switch_curve(flips["GPD_1"])
slower = vi.symmetric_orbits(replace(damper, omega=0.75))[0]
diagram = vi.branch_diagram(slower, "omega", (0.6, 0.75), depth=2, points=40)
points = {
    f"{name} {p.label}": list(p.parameters.values())
    for name, found in vars().copy().items() if isinstance(found, vi.Branch | vi.BifurcationCurve)
    for p in found.special_points
}
print(json.dumps({"points": points, "born": [curve.kind for curve in born],
                  "diagram": [branch.symbol for branch in diagram.branches]}))
"""
OLD = {"OPENBLAS_CORETYPE": "Prescott"}  # every processor with 64 bits has its instructions


def found(**variables: str) -> dict[str, Any]:
    ended = subprocess.run(
        [sys.executable, "-c", SCRIPT], capture_output=True, text=True, check=False,
        env=os.environ | variables,
    )  # fmt: skip
    assert ended.returncode == 0, ended.stderr
    return dict(json.loads(ended.stdout))


def test_special_points_and_branches_are_the_same_on_other_processors() -> None:
    here, there = found(), found(**OLD)
    assert here["points"].keys() == there["points"].keys()
    assert len(here["points"]) > 12
    for name, at in here["points"].items():
        # double multipliers are known to half of the digits
        assert at == pytest.approx(there["points"][name], abs=1e-8), name
    assert (here["born"], here["diagram"]) == (there["born"], there["diagram"])
    assert here["born"] == ["SN"]
