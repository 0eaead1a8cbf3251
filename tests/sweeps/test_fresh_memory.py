"""What a sweep computes does not depend on what stood in its memory before."""

from __future__ import annotations

import hashlib
import os
import platform
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
FILLED = ROOT / "tests" / "cpp" / "nan_memory.c"
SCRIPT = "from tests.sweeps.test_fresh_memory import digest; print(digest())"


def digest() -> str:
    """Of all results of members in different modes, machine by machine."""
    from tests.sweeps.test_mode_lanes import MACHINES, swept

    bits = hashlib.sha256()
    for name in MACHINES:
        for values in swept(name).out.values():
            bits.update(values.tobytes())
    return bits.hexdigest()


@pytest.mark.skipif(
    platform.libc_ver()[0] != "glibc" or not shutil.which("gcc"), reason="needs gcc and glibc"
)
def test_memory_full_of_nan_changes_no_bit_of_machines_in_different_modes(tmp_path: Path) -> None:
    library = tmp_path / "nan_memory.so"
    subprocess.run(
        ["gcc", "-O1", "-shared", "-fPIC", "-fno-builtin", str(FILLED), "-o", str(library)],
        check=True,
    )
    environment = {**os.environ, "LD_PRELOAD": str(library)}
    done = subprocess.run(
        [sys.executable, "-c", SCRIPT], env=environment, cwd=ROOT, capture_output=True, text=True,
        check=True,
    )  # fmt: skip
    assert done.stdout.split() == [digest()]
