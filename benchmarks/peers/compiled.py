"""A C++ program as a method: compiled once per session, fed and read through pipes.

The program's input and output are described in ``program.hpp``.
"""

from __future__ import annotations

import os
import shlex
import shutil
import subprocess
import tempfile
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import numpy as np

from benchmarks.case import Floats, Parameters
from benchmarks.peers.method import Result, UnavailableError

HERE = Path(__file__).resolve().parent.parent
TUNED = ("-std=c++20", "-O3", "-march=native", "-fno-math-errno")


def compiler() -> str:
    """Return the C++ compiler: ``$CXX``, or the first of c++, g++ and clang++ on the path."""
    named = os.environ.get("CXX")
    found = named or next(filter(None, map(shutil.which, ("c++", "g++", "clang++"))), None)
    if found is None:
        raise UnavailableError("no C++ compiler: set CXX or install one")
    return found


@cache
def _build_folder() -> tempfile.TemporaryDirectory[str]:
    return tempfile.TemporaryDirectory(prefix="vibroimpact-benchmarks-")


@cache
def build(source: Path, flags: tuple[str, ...]) -> Path:
    """Compile one source file and return the program."""
    if not source.exists():
        raise UnavailableError(f"{source.name} does not exist")
    program = Path(tempfile.mkdtemp(dir=_build_folder().name)) / source.stem
    command = [*shlex.split(compiler()), *flags, str(source), "-o", str(program)]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    if done.returncode != 0:
        raise UnavailableError(f"{shlex.join(command)} failed:\n{done.stderr}")
    return program


@dataclass(frozen=True, slots=True, kw_only=True)
class Compiled:
    """A method written as one C++ source file beside this package."""

    name: str
    source: str
    settings: str
    flags: tuple[str, ...] = TUNED
    max_starts: int | None = None
    tolerance: float = 1e-9

    def run(self, starts: Floats, parameters: Parameters, impacts: int) -> Result:
        """Simulate every start in one process; the program times itself."""
        program = build(HERE / self.source, self.flags)
        sizes = np.array([len(starts), impacts], dtype=float)
        task = np.concatenate([parameters.as_array(), sizes, np.ravel(starts)])
        done = subprocess.run([program], input=task.tobytes(), capture_output=True, check=True)
        answer = np.frombuffer(done.stdout)
        return Result(seconds=float(answer[0]), times=answer[1:].reshape(len(starts), impacts))


SAMPLED = Compiled(
    name="C++ closed form, libm, sampled",
    source="sampled_closed_form.cpp",
    settings="64 samples per forcing period, Newton with bisection to 1e-14",
)
CERTIFIED = Compiled(
    name="C++ closed form, libm, certified strides",
    source="certified_closed_form.cpp",
    settings="quadratic minorant with one bound on u'' per flight",
)
