"""Labels of special points along a curve: their kind and their number."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable
from typing import Protocol, TypeVar

from vibroimpact._core.checks import check_choice, shown
from vibroimpact._core.errors import InvalidParameterError


class Labelled(Protocol):
    """Anything that has a label."""

    @property
    def label(self) -> str:
        """Kind and number."""


Point = TypeVar("Point", bound=Labelled)


def numbered(kinds: Iterable[str], between: str = "") -> list[str]:
    """Each kind with its number among its like, in order: NS1, PD1, NS2."""
    counts: Counter[str] = Counter()
    labels = []
    for kind in kinds:
        counts[kind] += 1
        labels.append(f"{kind}{between}{counts[kind]}")
    return labels


def labelled(points: Iterable[Point], label: str) -> Point:
    """The point with a label; another label is refused."""
    by_label = {point.label: point for point in points}
    if not by_label:
        raise InvalidParameterError(
            f"label = {shown(label)}: there is no special point here. Look in a wider range of the parameter."
        )
    check_choice("label", label, by_label)
    return by_label[label]


def counted(kinds: Iterable[str], nothing: str = "no special point") -> str:
    """Text of the number of each kind: "1 BP, 2 NS"."""
    return ", ".join(f"{n} {kind}" for kind, n in Counter(kinds).items()) or nothing
