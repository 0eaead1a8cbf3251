"""What is too large for the memory that there is here is refused before it begins."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from support.systems import paper_damper

import vibroimpact as vi

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
