"""The look along the wide grid, and what is said of one of its intervals.

The programs draw the same systems in every build, which have equal bits (test_engine.py).
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import pytest
from support.builds import output

if TYPE_CHECKING:
    from pathlib import Path

pytestmark = pytest.mark.slow


def test_a_look_along_the_wide_grid_says_nothing_wrong(tmp_path: Path) -> None:
    output(tmp_path, "look_test", "clang")


@pytest.mark.parametrize("build", ["clang", "gcc, avx2"])
def test_flights_that_return_soon_have_the_same_bits_in_lanes_and_alone(
    tmp_path: Path, build: str
) -> None:
    output(tmp_path, "return_test", build)


def test_what_is_said_of_an_interval_holds_for_all_curves_that_may_be_there(
    tmp_path: Path,
) -> None:
    output(tmp_path, "meet_test", "clang")
