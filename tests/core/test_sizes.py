"""What is too large for the memory that there is here is refused before it begins."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from support.systems import paper_damper

import vibroimpact as vi
from vibroimpact._core.checks import memory_of_machine

HUGE = 10**12
DAMPER = paper_damper("A", 1.0)
FEW = vi.Objective("omega", (0.9, 1.0), points=2, starts=1, settle_periods=1, periods=1)
MILLION = np.linspace(1.0, 2.0, 10**6)

CALLS: dict[str, tuple[Callable[[], Any], str]] = {
    "response": (lambda: vi.frequency_response(DAMPER, "omega", (0.9, 1.0), points=HUGE), "points = "),
    "objective": (lambda: vi.Objective("omega", (0.9, 1.0), points=HUGE), "points = "),
    "refine": (
        lambda: vi.optimise(DAMPER, {"zeta": (0.01, 0.1)}, FEW, refine=HUGE, progress=False), "refine = ",
    ),
    "map": (
        lambda: vi.design_map(DAMPER, {"zeta": MILLION, "half_clearance": MILLION}, FEW, progress=False),
        "over = ",
    ),
}  # fmt: skip


@pytest.mark.parametrize(("call", "named"), CALLS.values(), ids=CALLS)
def test_a_count_that_no_memory_holds_is_refused_by_its_name(
    call: Callable[[], Any], named: str
) -> None:
    with pytest.raises(vi.InvalidParameterError, match=f"^{named}.*more than the memory here"):
        call()


def test_the_limit_of_a_shell_is_the_memory_here() -> None:
    program = (
        "import resource; from vibroimpact._core.checks import memory_here; "
        "resource.setrlimit(resource.RLIMIT_AS, (2**32, 2**32)); print(memory_here())"
    )
    ended = subprocess.run(
        [sys.executable, "-c", program], capture_output=True, text=True, check=True
    )
    assert 2**30 < int(ended.stdout) < 2**32


PHYSICAL = os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES")
V1, V2 = "sys/fs/cgroup/memory", "sys/fs/cgroup"
GROUPS: dict[str, tuple[str, dict[str, str], int]] = {  # what processes are in, files of limits, the least
    "of the second kind": ("0::/app.slice/job", {f"{V2}/app.slice/job/memory.max": "4096"}, 4096),
    "around its own": (
        "0::/app.slice/job", {f"{V2}/app.slice/job/memory.max": "max", f"{V2}/app.slice/memory.max": "8192"}, 8192,
    ),
    "the least of several": (
        "0::/a/b", {f"{V2}/a/b/memory.max": "8192", f"{V2}/a/memory.max": "4096"}, 4096,
    ),
    "of a container": ("0::/", {f"{V2}/memory.max": "4096"}, 4096),
    "of the first kind": (
        "5:cpu:/x\n4:memory:/jobs/7\n0::/", {f"{V1}/jobs/7/memory.limit_in_bytes": "4096"}, 4096,
    ),
    "of a container of the first kind, whose name is seen from outside": (
        "4:hugetlb,memory:/docker/abc", {f"{V1}/memory.limit_in_bytes": "4096"}, 4096,
    ),
    "of others": ("0::/mine", {f"{V2}/other/memory.max": "4096"}, PHYSICAL),
    "without a limit": ("4:memory:/", {f"{V1}/memory.limit_in_bytes": str(2**63 - 4096)}, PHYSICAL),
    "unreadable": ("no line of this kind", {}, PHYSICAL),
}  # fmt: skip


@pytest.mark.parametrize(("groups", "files", "least"), GROUPS.values(), ids=GROUPS)
def test_the_least_limit_of_control_groups_is_the_memory_here(
    groups: str, files: dict[str, str], least: int, tmp_path: Path
) -> None:
    for name, text in {"proc/self/cgroup": groups, **files}.items():
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).write_text(f"{text}\n")
    assert memory_of_machine(tmp_path) == least


def test_what_a_control_group_has_no_room_for_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("vibroimpact._core.checks.memory_of_machine", lambda: 10**6)
    start = vi.State((0.0, 0.0), (0.0, 1.0))
    refused = "more than the memory here"
    with pytest.raises(vi.InvalidParameterError, match=refused):
        vi.sweep(DAMPER, over={"omega": MILLION}, start=start, settle_periods=1, periods=1)
    with pytest.raises(vi.InvalidParameterError, match=refused):
        vi.frequency_response(DAMPER, "omega", (0.9, 1.0), points=10**6)
