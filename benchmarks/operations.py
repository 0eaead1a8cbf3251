"""How many operations an impact costs: the scalar engine run on numbers that count.

The program is that of the tests (``tests/cpp/engine_test.cpp``, with the scalar of
``include/vibroimpact/numeric/counting.hpp``): additions, multiplications, divisions and square
roots, each as one. Lanes that are masked, steps repeated for another lane's sake, loads,
comparisons and selections are not in it: it is the work that the trajectories need, not what a
target spends.
"""

from __future__ import annotations

import subprocess
import sys
import tempfile
from pathlib import Path

from benchmarks.case import Floats, Parameters
from benchmarks.peers.compiled import HERE, build
from benchmarks.peers.library import damper_of, states_of
from benchmarks.peers.method import require

ROOT = HERE.parent
# Unoptimised: it compiles in a third of the time, and counts the same.
FLAGS = ("-std=c++20", "-O0", "-ffp-contract=off", "-Wno-psabi", f"-I{ROOT / 'include'}")


def per_impact(starts: Floats, parameters: Parameters, impacts: int) -> float:
    """Count operations per event over the first `impacts` events of every start."""
    sys.path.append(str(ROOT / "tests"))
    try:
        system_text = require("support.system_file", ".").system_text
    finally:
        sys.path.pop()
    program = build(ROOT / "tests" / "cpp" / "engine_test.cpp", FLAGS)
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "system.txt"
        file.write_text(system_text(damper_of(parameters), states_of(starts)))
        command = [str(program), str(file), "count", str(impacts)]
        done = subprocess.run(command, capture_output=True, text=True, check=True)
    return float(done.stdout)
