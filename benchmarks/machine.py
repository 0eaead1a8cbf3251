"""What the numbers were measured on, in general terms."""

from __future__ import annotations

import platform
import shlex
import subprocess
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
