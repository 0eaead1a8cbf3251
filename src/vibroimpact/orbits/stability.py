"""Stability of a periodic motion in four words, the one place where they are decided.

Method      By the moduli of its multipliers: stable where all are inside the unit circle, unstable where
            one is outside, neutral where one is on the circle and none outside: motions near it stay near
            but do not come back, or drift away. A family of orbits is neutral, a multiplier 1 for each of
            its dimensions: those of a mass that stands anywhere between its stops, or of a machine without
            loss. A motion that is none of the machine's, since a stop is crossed, is not admissible,
            whatever its multipliers are.
            A neutral family still attracts where all other multipliers are inside: starts near it settle
            on one or another of its members. Where more multipliers are on the circle than the
            family has dimensions, motions beside it drift: a free mass with any speed meets a stop.
Accuracy    multipliers are on the circle within NEUTRAL_DISTANCE; those of families, a multiple
            eigenvalue, within SPLIT_DISTANCE
"""

from __future__ import annotations

import numpy as np

from vibroimpact._core.codes import NamedCode
from vibroimpact._core.types import Complexes

# A multiplier that is so near to the unit circle is neither inside nor outside.
NEUTRAL_DISTANCE = 1e-9
SPLIT_DISTANCE = 1e-3  # rounding moves a multiplier 1 of multiplicity k by its k-th root


class Stability(NamedCode):
    """Stability of a motion, the better first."""

    STABLE = 0
    NEUTRAL = 1
    UNSTABLE = 2
    INADMISSIBLE = 3

    @property
    def words(self) -> str:
        """Its name in words."""
        return "not admissible" if self is Stability.INADMISSIBLE else self.name.lower()


def stability_of(multipliers: Complexes, family: int = 0, *, admissible: bool = True) -> Stability:
    """Stability by the multipliers of a motion, and the dimension of its family.

    Multipliers that are not known, NaN, are not inside.
    """
    if not admissible:
        return Stability.INADMISSIBLE
    slack = SPLIT_DISTANCE if family else NEUTRAL_DISTANCE
    sizes = np.abs(multipliers)
    if not np.all(sizes <= 1.0 + slack):
        return Stability.UNSTABLE
    inside = not family and bool(np.all(sizes < 1.0 - slack))
    return Stability.STABLE if inside else Stability.NEUTRAL


def attracts(multipliers: Complexes, family: int, stability: Stability) -> bool:
    """Whether a motion, or the family that it is one of, attracts starts of positive measure."""
    on_circle = int(np.sum(np.abs(multipliers) > 1.0 - SPLIT_DISTANCE))
    return stability is Stability.STABLE or (
        stability is Stability.NEUTRAL and 0 < on_circle == family
    )


def in_words(stability: Stability, family: int = 0) -> str:
    """Stability in words, with the dimension of the family of a neutral motion."""
    if stability is Stability.NEUTRAL and family:
        return f"neutral, one of a {family}-parameter family"
    return stability.words
