"""What each member of an ensemble does, as one category.

n-p-q           periodic, codes 0, 1, 2, ... from the most frequent to the rarest symbol
chaotic         the exponent says so: the tangent grows by more e-folds in the window than along any
                smooth curve (iterates.py)
not periodic    within the tolerance and the window of the symbol: a closed curve, weak chaos, or
                still settling; without the exponent any chaos
no impacts      none while observed: flights, or rest on a stop
(an outcome)    the end of its window was not reached; the words are those of ``end``
not computed    of a store: the tile is not there yet
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from vibroimpact.ensembles.outcome import NOT_COMPUTED
from vibroimpact.iterates import LEAST_GROWTH

Integers = NDArray[np.int64]

NOT_PERIODIC, CHAOTIC, NO_IMPACTS = -1, -2, -3
BELOW = -3  # outcomes have the codes below: BELOW - end
ABSENT = -99
WORDS = {
    NOT_PERIODIC: "not periodic",
    NO_IMPACTS: "no impacts",
    CHAOTIC: "chaotic",
    ABSENT: "not computed",
}
FULL = 0  # value of ``end`` where the whole window was observed


class Category(NamedTuple):
    """A motion that occurs: its code, its words, and how many members move so."""

    code: int
    words: str
    members: int


def motions(members: xr.Dataset) -> xr.DataArray:
    """Code the motion of every member.

    Parameters
    ----------
    members
        A sweep with ``end``, ``n``, ``p``, ``q`` of the symbol, the impacts, and the largest
        Lyapunov exponent if chaos is to be told from the rest.

    Returns
    -------
    DataArray
        Integer codes with the dims of ``end``; ``flag_values`` and ``flag_meanings`` say what they
        mean (CF conventions: words joined by underscores, separated by blanks).
    """
    n, p, q, end = (np.asarray(members[k].values, dtype=np.int64) for k in ("n", "p", "q", "end"))
    symbols, place, counts = _symbols(n, p, q)
    order = np.argsort(-counts, kind="stable")
    rank = np.empty_like(order)
    rank[order] = np.arange(len(order))
    codes = np.where(p + q > 0, rank[place].reshape(n.shape), NOT_PERIODIC)
    codes = np.where((p + q == 0) & _grows(members), CHAOTIC, codes)
    codes = np.where((p + q == 0) & _silent(members), NO_IMPACTS, codes)
    codes = np.where(end == FULL, codes, BELOW - end)
    codes = np.where(end == NOT_COMPUTED, ABSENT, codes)
    words = {i: symbol(*symbols[k].tolist()) for i, k in enumerate(order)} | WORDS
    words |= {BELOW - end: said for end, said in flags(members["end"]).items() if end > FULL}
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
    """The motions that occur: symbols first, from the most frequent to the rarest."""
    words = flags(codes)
    values, counts = np.unique(codes.values, return_counts=True)
    found = [
        Category(int(v), words[int(v)].replace("_", " "), int(c))
        for v, c in zip(values, counts, strict=True)
    ]
    return sorted(found, key=lambda one: (one.code < 0, abs(one.code)))


def flags(codes: xr.DataArray) -> dict[int, str]:
    """The meaning of each value of a coded variable, from its attributes."""
    values = np.atleast_1d(codes.attrs["flag_values"])
    return {int(v): w for v, w in zip(values, codes.attrs["flag_meanings"].split(), strict=True)}


def symbol(n: int, p: int, q: int) -> str:
    """n-p-q; without forcing there is no n."""
    return f"{n or '?'}-{p}-{q}"


def _symbols(n: Integers, p: Integers, q: Integers) -> tuple[Integers, Integers, Integers]:
    """The different n-p-q of periodic members, the one of each member, and how many have it."""
    rows = [np.where(p + q > 0, part, 0).ravel() for part in (n, p, q)]
    sizes = [int(row.max(initial=0)) + 1 for row in rows]
    packed = np.ravel_multi_index(rows, sizes)  # one number per symbol sorts faster than three
    codes, place, counts = np.unique(packed, return_inverse=True, return_counts=True)
    symbols = np.column_stack(np.unravel_index(codes, sizes))
    counts = np.where(symbols[:, 1:].any(axis=1), counts, 0)  # those not periodic come last
    return symbols, place, counts


def _grows(members: xr.Dataset) -> NDArray[np.bool_]:
    """Where a tangent vector grows as it only does in chaos."""
    if "lyapunov" not in members:
        return np.zeros(members["end"].shape, dtype=bool)
    settle, periods = (float(members.attrs[name]) for name in ("settle", "periods"))
    window = members["time"].values * (periods / (settle + periods))
    return np.asarray(members["lyapunov"].values * window > LEAST_GROWTH)


def _silent(members: xr.Dataset) -> NDArray[np.bool_]:
    """Where no impact was observed."""
    return np.asarray(members["impacts_a"].values + members["impacts_b"].values == 0.0)
