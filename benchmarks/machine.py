"""What the numbers were measured on, in general terms."""

from __future__ import annotations

import os
import platform
import shlex
import subprocess
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from benchmarks.peers.compiled import TUNED, compiler


def processor() -> str:
    """Return the processor's model name where the system tells it."""
    info = Path("/proc/cpuinfo")
    lines = info.read_text().splitlines() if info.exists() else []
    names = [line.split(":", 1)[1].strip() for line in lines if line.startswith("model name")]
    return names[0] if names else platform.processor() or platform.machine()


def compiler_version() -> str:
    """Return the first line of the compiler's version text."""
    command = [*shlex.split(compiler()), "--version"]
    text = subprocess.run(command, capture_output=True, text=True, check=True).stdout
    return text.splitlines()[0]


def describe() -> dict[str, str]:
    """Return processor, compiler, flags and Python version."""
    return {
        "processor": processor(),
        "compiler": compiler_version(),
        "flags": " ".join(TUNED),
        "python": platform.python_version(),
    }


def show() -> dict[str, str]:
    """Print processor, compiler, flags and Python version, and return them."""
    about = describe()
    print("\n".join(f"{key}: {value}" for key, value in about.items()))
    return about


@contextmanager
def one_core() -> Iterator[None]:
    """Keep this process, its threads and the programs it starts on one core, where that is known.

    Just-in-time compilers that spread work over threads are held to one core like the others.
    """
    if not hasattr(os, "sched_setaffinity"):
        yield
        return
    allowed = os.sched_getaffinity(0)
    os.sched_setaffinity(0, {max(allowed)})
    try:
        yield
    finally:
        os.sched_setaffinity(0, allowed)
