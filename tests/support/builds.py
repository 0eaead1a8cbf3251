"""Programs of ``tests/cpp``: built by every compiler, for every instruction set, and run."""

from __future__ import annotations

import os
import platform
import re
import shutil
import subprocess
import sys
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import pytest

from vibroimpact import _cpu

ROOT = Path(__file__).resolve().parents[2]
INCLUDE = ROOT / "include"
FOLDERS = [f"-I{INCLUDE}", f"-I{ROOT / 'src/bindings'}"]
FLAGS = ["-std=c++20", "-ffp-contract=off", "-fno-math-errno", "-Wno-psabi", *FOLDERS]
ZIG = (sys.executable, "-m", "ziglang", "c++")
X86 = platform.machine() in {"x86_64", "AMD64"}
ARM = platform.machine() in {"aarch64", "arm64"}


def flags_of(target: str) -> tuple[str, ...]:
    """Flags of an instruction set, as any GCC builds the package with them."""
    text = (ROOT / "CMakeLists.txt").read_text()
    found = re.findall(rf"^(?:set\(|  list\(APPEND )flags_{target} (-.*)\)$", text, re.M)
    assert len(found) > 1
    return tuple(" ".join(found).split())


@dataclass(frozen=True)
class Build:
    """A compiler with its flags, and what is needed to compile with it and to run the program."""

    command: tuple[str, ...]
    target: str = "baseline"  # instruction set of the package that it stands for
    on_arm: bool = True
    emulator: tuple[str, ...] = ()

    def require(self) -> None:
        """Skip the test where this build cannot be made."""
        if not (X86 or self.on_arm):
            pytest.skip(f"{self.target}: not for a {platform.machine()}")
        if not shutil.which(self.command[0]):
            pytest.skip(f"{self.command[0]} is not installed")

    def runner(self) -> list[str]:
        """What stands before the program on the command line; skip where nothing runs it."""
        if self.emulator and not ARM:
            found = next(filter(None, map(shutil.which, self.emulator)), None)
            if not found:
                pytest.skip(f"compiled; {self.emulator[0]} is not installed to run it")
            return [found]
        if X86 and self.target not in _cpu.supported():
            pytest.skip(f"compiled; this processor has no {self.target}")
        return []


BUILDS = {
    # on x86-64 without fma: done by sums without error; of engine_test jets and counts
    "gcc": Build(("g++", "-O1", "-DJETS_AND_COUNTS")),
    "gcc, avx2": Build(("g++", "-O1", *flags_of("avx2")), "avx2", on_arm=False),
    "gcc, avx512": Build(("g++", "-O1", *flags_of("avx512")), "avx512", on_arm=False),
    "gcc, neon": Build(
        ("aarch64-linux-gnu-g++", "-O1", "-static"),
        emulator=("qemu-aarch64", "qemu-aarch64-static"),
    ),
    "clang": Build((*ZIG, "-O2")),
}

QUICKLY = {  # more to compile than to run
    ("engine_test", "gcc"): ["-O0"],
    ("engine_test", "gcc, avx2"): ["-O0"],
}


@cache
def headers_of_gcc() -> list[str]:
    """Flags by which clang takes the C++ library of g++: zig compiles its own first, for a minute."""
    asked = ["g++", "-E", "-x", "c++", "-v", os.devnull]
    said = subprocess.run(asked, check=True, capture_output=True, text=True).stderr
    folders = said.partition("#include <...>")[2].partition("End of search list")[0].split()
    return ["-nostdinc++", *(f"-I{folder}" for folder in folders if "c++" in folder)]


def compile_program(command: list[str], source: Path, out: Path) -> None:
    """Compile and link a program; what clang has compiled is linked by g++."""
    if command[: len(ZIG)] != [*ZIG]:
        subprocess.run([*command, str(source), "-o", str(out)], check=True)
        return
    code = out.with_suffix(".o")
    subprocess.run([*command, *headers_of_gcc(), "-c", str(source), "-o", str(code)], check=True)
    subprocess.run(["g++", str(code), "-o", str(out)], check=True)


@cache
def program(folder: Path, name: str, build: str) -> Path:
    """A program of ``tests/cpp``; the test is skipped where its compiler is missing."""
    BUILDS[build].require()
    out = folder / f"{name}-{build}".replace(", ", "-")
    source = ROOT / "tests" / "cpp" / f"{name}.cpp"
    command = [*BUILDS[build].command, *FLAGS, *QUICKLY.get((name, build), ())]
    compile_program(command, source, out)
    return out


def output(folder: Path, name: str, build: str, *arguments: str, given: str = "") -> str:
    """What a program says; the test is skipped where it is built but cannot run."""
    built = program(folder, name, build)
    done = subprocess.run(
        [*BUILDS[build].runner(), str(built), *arguments],
        input=given,
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout.strip()
