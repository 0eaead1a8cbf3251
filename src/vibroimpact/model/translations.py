"""Translations: displacements of a machine that its equations of motion do not notice.

Method      the columns d with K d = 0, row . d = 0 for every stop, and position . d = 0 for every
            normal load                                                                      (1)
            each has the entry 1 at its own coordinate, its reference, and 0 at those of the others;
            positions less the drift are  x - sum over d of x_reference d                    (2)
Accuracy    that of (1) is 2^-40 of the largest entries, with coordinates in units that make the
            diagonal of K one
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from vibroimpact._core.types import Floats
from vibroimpact.model.mechanism import Mechanism, as_array

RANK_RELATIVE = 2.0**-40


@dataclass(frozen=True)
class Translations:
    """Displacements that change nothing, and a coordinate by which each is measured."""

    # shape (n, k); k = 0 for most machines: a spring or a stop to the ground holds each body
    directions: Floats = field(repr=False)
    references: tuple[int, ...]  # coordinates x_reference of (2), k of them

    def removed(self, position: Floats) -> Floats:
        """Positions less the drift (2), relative to the reference bodies; shape (..., n)."""
        if not self.references:
            return position
        return position - position[..., list(self.references)] @ self.directions.T

    def relative(self, states: Floats) -> Floats:
        """States (x, v, ...) in rows with positions less the drift: equal at one place of a motion that drifts."""
        if not self.references:
            return states
        n = len(self.directions)
        return np.hstack([self.removed(states[:, :n]), states[:, n:]])


def translations_of(m: Mechanism) -> Translations:
    """Translations of a mechanism (1): none where every body is held or meets a stop."""
    stiffness = as_array(m.stiffness)
    units = 1.0 / _roots_of_stiffness(stiffness)
    rows = [row * units for row in _rows(m)]
    seen = [*(stiffness * np.outer(units, units)), *(row / np.abs(row).max() for row in rows)]
    _, values, across = np.linalg.svd(np.array(seen))
    scaled = _measured(across[int((values > RANK_RELATIVE).sum()) :].T)
    lengths = units[list(scaled.references)]
    return Translations(scaled.directions * units[:, None] / lengths, scaled.references)


def _roots_of_stiffness(stiffness: Floats) -> Floats:
    """Square roots of the stiffness at each coordinate; 1 where there is none.

    In their inverses as units no entry of K is large or small by a choice of the user's units.
    """
    own = np.abs(np.diag(stiffness))
    largest = np.maximum(np.abs(stiffness).max(axis=0), np.abs(stiffness).max(axis=1))
    size = np.where(own > 0.0, own, largest)
    return np.sqrt(np.where(size > 0.0, size, 1.0))


def _rows(m: Mechanism) -> list[Floats]:
    """Rows of stops and of normal loads, through which positions act."""
    return [np.array(row) for e in m.elements for row in e.positions]


def _measured(basis: Floats) -> Translations:
    """Return the space in a basis with unit entries at references: the last coordinates that can be."""
    columns = basis.copy()
    references: list[int] = []
    for i in reversed(range(len(basis))):
        k = len(references)
        free = columns[i, k:]
        if not free.size or np.abs(free).max() <= RANK_RELATIVE:
            continue
        best = k + int(np.abs(free).argmax())
        columns[:, [k, best]] = columns[:, [best, k]]
        columns[:, k] /= columns[i, k]
        for other in range(columns.shape[1]):
            if other != k:
                columns[:, other] -= columns[i, other] * columns[:, k]
        references.append(i)
    columns[np.abs(columns) <= RANK_RELATIVE] = 0.0
    return Translations(columns, tuple(references))
