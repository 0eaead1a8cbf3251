"""Groups of tiles whose systems are compiled at one go."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
import xarray as xr
from hypothesis import given
from hypothesis import strategies as st
from support.families import PAIR, swinging
from support.systems import paper_damper

import vibroimpact as vi
from vibroimpact.compile import many_systems as compiling
from vibroimpact.compile.many_systems import compile_together
from vibroimpact.sweeps.execution import groups
from vibroimpact.sweeps.execution.groups import grouped
from vibroimpact.sweeps.execution.tiles import compiled_bytes, tiles_of
from vibroimpact.sweeps.sweep import plan_of

DAMPER = paper_damper("A", 1.2)
PLAIN = vi.State((0.0, 0.0), (0.0, 1.0))
OVER = {"omega": np.linspace(1.0, 1.2, 5), "half_clearance": np.linspace(2.0, 5.0, 4)}
MANY = vi.RandomStarts(6, 1, {"v2": (-1.0, 1.0)}, PLAIN)


def rooted(k: float) -> vi.Mechanism:
    """Beyond columns: each system is compiled alone."""
    return swinging(math.sqrt(k), 2.0, 0.4)


SWEEPS: dict[str, dict[str, Any]] = {
    "plane": {"system": DAMPER, "over": OVER, "start": PLAIN, "tile": 3},
    "followed": {"system": DAMPER, "over": OVER, "start": PLAIN, "tile": 5, "follow": "-omega"},
    "starts cut": {"system": DAMPER, "over": {"omega": [1.0, 1.1, 1.2]}, "start": MANY, "tile": 4},
    "one system": {"system": DAMPER, "over": {}, "start": MANY, "tile": 1},
    "branching apart": {"system": PAIR, "start": PLAIN, "tile": 2,
                        "over": {"c": [0.0, 0.1, 0.2], "d": [0.0, 0.1], "m": [1.0, 2.0]}},
    "resonance": {"system": paper_damper("A", 1.2, zeta=0.0), "start": PLAIN, "tile": 2,
                  "over": {"omega": [0.4, 0.5, 0.6], "omega_n": [0.5, 0.6]}},
    "beyond columns": {"system": vi.Family(rooted, k=1.0), "start": PLAIN, "tile": 2,
                       "over": {"k": [1.0, 1.5, 2.0, 2.5, 3.0]}},
}  # fmt: skip


def swept(name: str, **options: Any) -> xr.Dataset:
    usual = {"observe": ["final", "symbol"], "settle_periods": 10, "periods": 5, "progress": False}
    return vi.sweep(**(SWEEPS[name] | usual | options))


@pytest.fixture
def calls(monkeypatch: pytest.MonkeyPatch) -> Callable[[Any, str], list[Any]]:
    """Arguments that a function of a module is called with."""

    def counted(module: Any, name: str) -> list[Any]:
        seen, function = list[Any](), getattr(module, name)

        def noted(*given: Any) -> Any:
            seen.append(given)
            return function(*given)

        monkeypatch.setattr(module, name, noted)
        return seen

    return counted


@pytest.mark.parametrize("name", SWEEPS)
def test_groups_change_no_bit(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """All tiles in one group, each in its own, and all in one tile."""
    together = swept(name, workers=2)
    xr.testing.assert_identical(swept(name, tile=100), together)
    monkeypatch.setattr(groups, "GROUP_BYTES", 1)
    xr.testing.assert_identical(swept(name), together)


def test_a_group_is_compiled_once(calls: Callable[[Any, str], list[Any]]) -> None:
    """By whichever thread comes first; tiles that differ in their starts share systems."""
    compiled = calls(groups, "compile_together")
    swept("plane", workers=4)
    swept("starts cut")
    swept("one system")
    assert [len(next(iter(values.values()), [0])) for _, values, *_ in compiled] == [20, 3, 1]


def test_systems_beyond_columns_are_compiled_when_their_tile_wants_them(
    calls: Callable[[Any, str], list[Any]],
) -> None:
    """So threads do not wait for those of other tiles, and none is refused before its turn."""
    seen = calls(compiling, "_alone")
    values = {"k": np.array([1.0, 1.5, 2.0, -1.0])}
    found = compile_together(vi.Family(rooted, k=1.0), values)
    assert not seen
    parts = found.inside(slice(1, 3))
    assert [part.systems.tolist() for part, _ in parts] == [[1, 2]]
    assert [k for _, _, k, *_ in seen] == [1, 2]
    with pytest.raises(vi.InvalidParameterError, match=r"math domain.*System: k = -1\.0\."):
        found.inside(slice(3, 4))


@st.composite
def unfinished(draw: st.DrawFn) -> tuple[Any, list[Any], int]:
    """A plan, some of its tiles, and how many systems a group may have."""
    count = draw(st.integers(1, 4))
    over = {"omega": np.linspace(1.0, 1.2, draw(st.integers(1, 5))), "zeta": np.arange(count) / 9}
    plan = plan_of(DAMPER, over, MANY, "symbol", None, 1, 1, None)
    sizes = tuple(draw(st.integers(1, n)) for n in plan.shape)
    tiles = [tile for tile in tiles_of(plan.shape, sizes) if draw(st.booleans())]
    return plan, tiles, draw(st.integers(1, 10))


@given(unfinished())
def test_a_group_holds_tiles_in_their_order_within_its_bytes(given: Any) -> None:
    plan, tiles, most = given
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(groups, "GROUP_BYTES", most * compiled_bytes(DAMPER.mechanism))
        found = list(grouped(plan, tiles))
    assert [tile for tile, _ in found] == tiles
    for group in {id(group): group for _, group in found}.values():
        places = {tile.chunk[:2]: tile.place[:2] for tile, its in found if its is group}
        sizes = [math.prod(part.stop - part.start for part in place) for place in places.values()]
        assert sum(sizes) <= most or len(sizes) == 1
