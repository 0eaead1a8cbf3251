"""The core's measured peak (``peak.cpp``), and the share of it that an algorithm reaches."""

from __future__ import annotations

import subprocess

from benchmarks.peers.compiled import HERE, build
from benchmarks.peers.method import UnavailableError

FLAGS = ("-std=c++20", "-O3", "-ffp-contract=off")
TARGETS = {"baseline": (), "AVX2": ("-mavx2",), "AVX-512": ("-mavx512f",)}


def measured() -> dict[str, float]:
    """Measure multiplications and additions in 10^9 per second, for each kind of vectors here.

    Returns
    -------
    dict
        By target, narrowest vectors first; without those that compiler or processor lack.
    """
    found = {}
    for target, flags in TARGETS.items():
        try:
            program = build(HERE / "peak.cpp", FLAGS + flags)
        except UnavailableError:  # another architecture: its compiler knows no such flag
            continue
        done = subprocess.run([program], capture_output=True, text=True, check=False)
        if done.returncode == 0:
            found[target] = float(done.stdout.split()[1])
    return found


def share(flops: float, nanoseconds: float, peak: float) -> float:
    """Return the share of a peak (10^9 per second) that so many operations in this time are."""
    return flops / nanoseconds / peak
