"""Multilinear forms of a map at a point, and of compositions of maps.

Method      F(x0 + u) = F(x0) + A u + B(u, u) / 2 + C(u, u, u) / 6 + ...                     (1)
            a direction may carry the parameter's part last: u = (u_1, ..., u_d, u_p), so that
            one notation holds A_p q, B(q, x_p), F_p                                         (2)
            complex arguments  B(a + i b, v) = B(a, v) + i B(b, v), and so in every argument (3)
            composition G o F  D[u] = D2[u'], where u' = (D1[u], u_p),
                               D[u, v] = D2[u', v'] + D2[D1[u, v]],
                               D[u, v, w] = D2[u', v', w'] + D2[u', D1[v, w]] + D2[v', D1[u, w]]
                                            + D2[w', D1[u, v]] + D2[D1[u, v, w]]             (4)
Assumes     the forms are symmetric: (3) evaluates each real form once, whatever the order of its
            arguments
Accuracy    sums of a few products: rounding of the forms given
Fails       never; a direction of the wrong shape raises InvalidParameterError
Reference   (4) is Faa di Bruno's formula to order 3
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple, Protocol

import numpy as np
from numpy.typing import ArrayLike

from vibroimpact._core.checks import numbers, refusal
from vibroimpact._core.errors import InvalidParameterError
from vibroimpact._core.types import Complexes, Floats

HIGHEST_ORDER = 3


class Forms(Protocol):
    """Derivatives of a map at a point, in the map's own coordinates and in its parameter.

    Any object with these two members can be analysed: an orbit's return map, an explicit map, a
    composition of two.
    """

    @property
    def dimension(self) -> int:
        """Number d of coordinates of the map, >= 1."""
        ...

    def derivative(self, *directions: Floats) -> Floats:
        """Return D^k F [u_1, ..., u_k], k = 1, 2, 3.

        Parameters
        ----------
        *directions
            Real; each of shape (d,), or (d + 1,) with the parameter's part last.

        Returns
        -------
        ndarray
            Shape (d,).
        """
        ...


class Multilinear:
    """Forms with complex arguments (3); every real form is evaluated once and stored.

    Parameters
    ----------
    forms
        Real symmetric forms.

    Examples
    --------
    >>> import vibroimpact.normal_forms as nf
    >>> square = nf.ExplicitMap(lambda x, p: [x[0] ** 2 + p], dimension=1).forms([1.0], 0.0)
    >>> nf.Multilinear(square)([1j], [1 + 1j])
    array([-2.+2.j])
    """

    def __init__(self, forms: Forms) -> None:
        self._forms = forms
        self._known: dict[tuple[int, ...], Floats] = {}
        self._lines: dict[bytes, tuple[int, Floats]] = {}  # numbers of aligned directions
        self._split: dict[bytes, list[_Part]] = {}

    def __call__(self, *directions: ArrayLike) -> Complexes:
        """Return D^k F of one to three complex directions, each of shape (d,) or (d + 1,)."""
        total = np.zeros(self._forms.dimension, dtype=np.complex128)
        for parts in itertools.product(*map(self._parts, directions)):
            total += math.prod([part.unit for part in parts]) * self._real(parts)
        return total

    def real(self, *directions: ArrayLike) -> Floats:
        """Return D^k F of real directions, shape (d,)."""
        return np.asarray(self(*directions).real)

    def _real(self, parts: Sequence[_Part]) -> Floats:
        """Form of real directions, stored by their lines through 0."""
        key = tuple(sorted([part.line for part in parts]))
        if key not in self._known:
            aligned = {part.line: part.aligned for part in parts}
            self._known[key] = self._forms.derivative(*(aligned[line] for line in key))
        return self._known[key]

    def _parts(self, direction: ArrayLike) -> list[_Part]:
        """Real and imaginary part of a direction, those that are not zero."""
        u = np.asarray(direction, dtype=np.complex128)
        key = u.tobytes()
        if key not in self._split:
            self._split[key] = [
                part
                for unit, real in ((1.0, u.real), (1.0j, u.imag))
                if (part := self._part(unit, real))
            ]
        return self._split[key]

    def _part(self, unit: complex, real: Floats) -> _Part | None:
        leading = next(filter(None, real.tolist()), 0.0)
        if not leading:
            return None
        sign = 1.0 if leading > 0.0 else -1.0
        aligned = sign * real + 0.0
        line, aligned = self._lines.setdefault(aligned.tobytes(), (len(self._lines), aligned))
        return _Part(unit * sign, aligned, line)


class _Part(NamedTuple):
    """Real or imaginary part of a direction, on its line through 0."""

    unit: complex  # the part of the direction is this times what is aligned
    aligned: Floats  # its first entry that is not zero is positive
    line: int  # number of that


@dataclass(frozen=True)
class InSizes:
    """Forms of the same map in coordinates of size one, so that its normal form does not depend on units.

    Parameters
    ----------
    forms
        Forms of the map.
    sizes
        Unit of each coordinate, shape (d,).
    """

    forms: Forms
    sizes: Floats

    @property
    def dimension(self) -> int:
        """Number of coordinates."""
        return self.forms.dimension

    def derivative(self, *directions: Floats) -> Floats:
        """Return D^k of the map for directions without the parameter's part."""
        moved = self.forms.derivative(*(np.asarray(u) * self.sizes for u in directions))
        return np.asarray(moved / self.sizes)


def with_parameter(direction: ArrayLike, part: float) -> Floats:
    """Return a direction of shape (d + 1,) whose parameter's part is ``part``."""
    return np.append(np.asarray(direction, dtype=np.float64), part)


def jacobian(forms: Forms) -> Floats:
    """Return A = DF, shape (d, d). Cost: d first derivatives."""
    columns = [forms.derivative(unit) for unit in np.eye(forms.dimension)]
    return np.column_stack(columns)


def check_forms(given: Any) -> None:
    """Refuse what are not the forms of a map at a point; a map without its point is refused too."""
    ready = hasattr(given, "dimension") and callable(getattr(given, "derivative", None))
    if not ready or hasattr(given, "forms"):
        raise refusal(
            "forms", given, "the forms of a map, such as vi.full_map(orbit) or map.forms(x, p)"
        )


def checked(directions: tuple[Any, ...], dimension: int, parameters: int = 1) -> list[Floats]:
    """Return the directions with their parts of k parameters, shape (d + k,) each.

    Raises
    ------
    InvalidParameterError
        Fewer than one or more than three directions, or a shape other than (d,) or (d + k,).
    """
    if not 1 <= len(directions) <= HIGHEST_ORDER:
        raise InvalidParameterError(
            f"directions: {len(directions)} are given; give 1, 2 or 3, one per order."
        )
    whole = [u if isinstance(u, np.ndarray) else numbers("direction", u) for u in directions]
    for u in whole:
        if u.shape not in ((dimension,), (dimension + parameters,)):
            raise InvalidParameterError(
                f"direction has shape {u.shape}: must be ({dimension},), or "
                f"({dimension + parameters},) with the parameter's part last."
            )
    still = np.zeros(parameters)
    return [u if u.size > dimension else np.append(u, still) for u in whole]


@dataclass(frozen=True)
class Composition:
    """Forms of the map ``second`` after ``first``, by (4).

    Parameters
    ----------
    first, second
        Forms of two maps of the same dimension and in the same parameter; ``second`` at the image
        of the point of ``first``.

    Raises
    ------
    InvalidParameterError
        Maps of different dimensions.

    Notes
    -----
    Cost of a third derivative: 7 forms of ``first``, 5 of ``second``.

    Examples
    --------
    >>> import vibroimpact.normal_forms as nf
    >>> half = nf.ExplicitMap(lambda x, p: [p * x[0] ** 2], dimension=1)
    >>> full = nf.Composition(half.forms([1.0], 2.0), half.forms([2.0], 2.0))  # 8 x^4
    >>> full.derivative(np.ones(1), np.ones(1), np.ones(1))
    array([192.])
    """

    first: Forms
    second: Forms

    def __post_init__(self) -> None:
        if self.first.dimension != self.second.dimension:
            raise InvalidParameterError(
                f"first has dimension {self.first.dimension}, second {self.second.dimension}: "
                "must be equal. Compose maps of the same space."
            )

    @property
    def dimension(self) -> int:
        """Number of coordinates."""
        return self.first.dimension

    def derivative(self, *directions: Floats) -> Floats:
        """Return D^k of the composed map, k = 1, 2, 3; see :class:`Forms`."""
        us = checked(directions, self.dimension)
        outer = [with_parameter(self.first.derivative(u), u[-1]) for u in us]
        total = self.second.derivative(*outer)  # (4), first term
        if len(us) == 1:
            return total
        for k in range(len(us)) if len(us) == HIGHEST_ORDER else []:
            pair = self.first.derivative(*(u for j, u in enumerate(us) if j != k))
            total = total + self.second.derivative(outer[k], pair)
        return np.asarray(total + self.second.derivative(self.first.derivative(*us)))
