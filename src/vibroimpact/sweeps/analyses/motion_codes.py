"""Codes of the motions of members: one category for each.

n-p-q           periodic, codes 0, 1, 2, ... from the most frequent to the rarest symbol; with a
                pair p-q for every contact that impacts; without forcing there is no n: p-q
chaotic         by the exponent: the tangent grows by more e-folds in the window than along any
                smooth curve (point_sets.py)
not periodic    within the tolerance and the window of the symbol: a closed curve, weak chaos, or
                still settling; without the exponent any chaos
no impacts      none while observed: flights, or rest on a stop
(a status)      the end of its window was not reached; the words are those of ``end``
not computed    in a store: the tile is missing
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from vibroimpact._core.lazy import xr
from vibroimpact._core.types import Integers
from vibroimpact.attractors.orbit_type import symbol_word
from vibroimpact.model.stop import Stop, StopName
from vibroimpact.results.result import words_of_codes
from vibroimpact.simulation.lyapunov import LEAST_GROWTH
from vibroimpact.sweeps.member_status import NOT_COMPUTED

NOT_PERIODIC, CHAOTIC, NO_IMPACTS = -1, -2, -3
BELOW = -3  # statuses have the codes below: BELOW - end
ABSENT = -99
WORDS = {
    NOT_PERIODIC: "not periodic",
    NO_IMPACTS: "no impacts",
    CHAOTIC: "chaotic",
    ABSENT: "not computed",
}
LARGEST = 2**62  # largest number that encodes a symbol
FULL = 0  # value of ``end`` where the whole window was observed


class Category(NamedTuple):
    """Category of motions: its code, its words, and its number of members."""

    code: int
    words: str
    members: int


def motions(members: xr.Dataset) -> xr.DataArray:
    """Code the motion of every member.

    Parameters
    ----------
    members
        A sweep with ``end``, ``n``, ``p``, ``q`` of the symbol, the impacts, and the largest
        Lyapunov exponent if chaos is to be distinguished.

    Returns
    -------
    DataArray
        Integer codes with the dims of ``end``; ``flag_values`` and ``flag_meanings`` hold their
        meanings (CF conventions: words joined by underscores, separated by blanks).
    """
    end = members["end"].values.astype(np.int64)
    of_each = symbols_of(members)
    periodic = np.asarray(of_each[..., 1:].any(axis=-1))
    symbols, place, counts = _different(np.where(periodic[..., None], of_each, 0))
    order = np.argsort(-counts, kind="stable")
    rank = np.empty_like(order)
    rank[order] = np.arange(len(order))
    codes = np.where(periodic, rank[place].reshape(end.shape), NOT_PERIODIC)
    codes = np.where(~periodic & _grows(members), CHAOTIC, codes)
    codes = np.where(~periodic & _silent(members), NO_IMPACTS, codes)
    codes = np.where(end == FULL, codes, BELOW - end)
    codes = np.where(end == NOT_COMPUTED, ABSENT, codes)
    words = {i: symbol(symbols[k]) for i, k in enumerate(order)} | WORDS
    words |= {
        BELOW - end: text for end, text in words_of_codes(members["end"]).items() if end > FULL
    }
    present = [int(code) for code in np.unique(codes)]
    return xr.DataArray(
        codes.astype(np.int32),
        dims=members["end"].dims,
        attrs={
            "flag_values": np.array(present, dtype=np.int32),
            "flag_meanings": " ".join(words[code].replace(" ", "_") for code in present),
        },
    )


def categories(codes: xr.DataArray) -> list[Category]:
    """Categories that occur: symbols first, from the most frequent to the rarest."""
    words = words_of_codes(codes)
    values, counts = np.unique(codes.values, return_counts=True)
    found = [
        Category(int(v), words[int(v)].replace("_", " "), int(c))
        for v, c in zip(values, counts, strict=True)
    ]
    return sorted(found, key=lambda one: (one.code < 0, abs(one.code)))


def symbols_of(members: xr.Dataset) -> Integers:
    """Symbols of the members, with the dims of ``end`` and one more: n, all p, all q."""
    dims = members["end"].dims
    arrays = [members[name].transpose(*dims, ...).values for name in ("n", "p", "q")]
    columns = [array.reshape(*array.shape[: len(dims)], -1) for array in arrays]
    return np.concatenate(columns, axis=-1, dtype=np.int64)


def column_of(contact: int, stop: StopName, width: int) -> int:
    """Column of the impacts at a stop, in symbols of so many numbers."""
    return 1 + contact + (Stop.at(stop).digit - 1) * (width // 2)


def symbol(numbers: Integers) -> str:
    """Symbol n-p-q of one member (orbit_type.py); without forcing there is no n."""
    n, *counts = numbers.tolist()
    return symbol_word(n, np.reshape(counts, (2, -1)).T.tolist())


def _different(symbols: Integers) -> tuple[Integers, Integers, Integers]:
    """Different symbols in order, zeros last; index of each member's symbol; their counts."""
    rows = symbols.reshape(-1, symbols.shape[-1])
    packed = np.zeros(len(rows), dtype=np.int64)  # a number per symbol sorts faster than a row
    for column in rows.T:
        size = int(column.max(initial=0)) + 1
        if (int(packed.max(initial=0)) + 1) * size > LARGEST:
            packed = np.unique(packed, return_inverse=True)[1]
        packed = packed * size + column
    _, first, place, counts = np.unique(
        packed, return_index=True, return_inverse=True, return_counts=True
    )
    found = rows[first]
    return found, place, np.where(found.any(axis=1), counts, 0)  # those not periodic come last


def _grows(members: xr.Dataset) -> NDArray[np.bool_]:
    """Mask of members whose tangent vector grows faster than in any regular motion."""
    if "lyapunov" not in members:
        return np.zeros(members["end"].shape, dtype=bool)
    settle_periods, periods = (float(members.attrs[name]) for name in ("settle_periods", "periods"))
    window = members["time"].values * (periods / (settle_periods + periods))
    return np.asarray(members["lyapunov"].values * window > LEAST_GROWTH)


def _silent(members: xr.Dataset) -> NDArray[np.bool_]:
    """Mask of members without an observed impact."""
    return np.asarray(members["impacts_a"].values + members["impacts_b"].values == 0.0)
