"""Maps given by formulas: fixed points, multilinear forms, and curves of fixed points.

Method      the function is evaluated on jets x + u e1 + v e2 + w e3, e_i^2 = 0: the coefficient of
            e1 e2 e3 is D^3 F [u, v, w], that of e1 e2 D^2 F [u, v], that of e1 D F [u]      (1)
            fixed points by Newton's method:  (A - I) dx = -(F(x) - x)                       (2)
Assumes     the function is three times differentiable at the point
Accuracy    rounding of the function's own operations. (2) stops after a step with
            |dx| <= 2^-26 (s + |x|), s the sizes of the coordinates: the error then is of the order
            of its square
Fails       a status with a sentence: not converged, singular (a fold is near), left the domain
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from enum import StrEnum
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from vibroimpact import _kernel
from vibroimpact._core.checks import check_choice, check_count, numbers, real, refusal, vector
from vibroimpact._core.errors import InvalidParameterError
from vibroimpact._core.types import AnyAmount, AnyComplexes, AnyFloats, Count, Floats
from vibroimpact.normal_forms.codimension_one import NS, PD
from vibroimpact.normal_forms.forms import checked

Function = Callable[[Any, Any], Sequence[Any]]
"""function(x, p): x is an array of floats or of jets, shape (d,), p a float or a jet, or a tuple of them."""

Values = float | Sequence[float]
"""Value of the parameter, or values of all parameters where there are several."""

MOST_COUNT = 10**6
"""Largest number of dimensions and iterates."""

MOST_NEWTON_STEPS = 50
"""Newton steps (2): from a start in its basin it takes six or so."""

LAST_STEP_RELATIVE = 2.0**-26
"""Relative size of the last step: its square is rounding."""

DERIVATIVE_AT = {1: 1, 2: 3, 3: 7}
"""Order of a derivative to its place among the eight coefficients of a jet (1)."""


class FixedPointStatus(StrEnum):
    """Status of Newton's method."""

    CONVERGED = "converged"
    NOT_CONVERGED = "not converged"
    SINGULAR = "singular"
    LEFT_DOMAIN = "left the domain"


@dataclass(frozen=True, eq=False)
class FixedPoint:
    """Fixed point of a map, or the last iterate of a search without convergence.

    Attributes
    ----------
    status, reason
        :class:`FixedPointStatus`, and a sentence; empty where converged.
    x
        The point, or the last iterate of Newton's method, shape (d,).
    p
        The parameter, or a tuple of all of them.
    residual
        max |F(x) - x|.
    steps
        Newton steps taken.
    multipliers
        Eigenvalues of A = DF(x), largest modulus first, shape (d,); nan where not converged.
    """

    status: FixedPointStatus
    reason: str
    x: AnyFloats
    p: Values
    residual: AnyAmount
    steps: Count
    multipliers: AnyComplexes

    @property
    def converged(self) -> bool:
        """Whether the search converged to a fixed point."""
        return self.status is FixedPointStatus.CONVERGED

    @property
    def stable(self) -> bool:
        """Whether every multiplier lies inside the unit circle."""
        return self.converged and bool(np.all(np.abs(self.multipliers) < 1.0))


@dataclass(frozen=True, eq=False)
class MapForms:
    """Multilinear forms of an explicit map at a point; see :class:`vibroimpact.normal_forms.Forms`.

    Attributes
    ----------
    map
        The map.
    x, p
        The point, shape (d,), and the parameter.
    """

    map: ExplicitMap
    x: Floats
    p: Values

    @property
    def dimension(self) -> int:
        """Number of coordinates."""
        return self.map.dimension

    def derivative(self, *directions: Floats) -> Floats:
        """Return D^k F [u_1, ..., u_k], k = 1, 2, 3, shape (d,). Cost: one evaluation on jets."""
        return self.map.derivative(self.x, self.p, *directions)


@dataclass(frozen=True)
class ExplicitMap:
    """A map x -> F(x, p) given by a formula, or an iterate of it.

    A curve of its fixed points can be continued: the map is a problem F(x, p) - x = 0.

    Parameters
    ----------
    function
        function(x, p) returns the d coordinates of the image, as a sequence. It must use ordinary
        arithmetic, powers with constant exponents, and np.sin, np.cos, np.exp, np.log, np.sqrt
        (not those of ``math``): it is called with arrays of floats and with arrays of jets.
    dimension
        d, >= 1.
    iterate
        The map is the iterate-th iterate of the function, >= 1.
    sizes
        Typical size of each coordinate and, last, of each of the k parameters, all > 0, shape
        (d + k,); default 1.
    parameters
        Names of the k parameters. With one, p is a number; with several, p is a tuple in this
        order, for ``function`` and everywhere else.

    Raises
    ------
    InvalidParameterError
        A bad dimension, iterate or size; and, when the map is evaluated, a function that does not
        return d real numbers or cannot be evaluated on jets.

    Examples
    --------
    >>> import vibroimpact.normal_forms as nf
    >>> logistic = nf.ExplicitMap(lambda x, p: [p * x[0] * (1.0 - x[0])], dimension=1)
    >>> point = logistic.fixed_point([0.6], 3.0)
    >>> point.x, point.multipliers
    (array([0.66666667]), array([-1.+0.j]))
    >>> round(nf.normal_form("PD", logistic.forms(point.x, point.p)).c, 12)
    9.0
    """

    function: Function
    dimension: Count
    iterate: Count = 1
    sizes: tuple[float, ...] = field(default=())
    parameters: tuple[str, ...] = ("p",)

    def __post_init__(self) -> None:
        for name in ("dimension", "iterate"):
            check_count(name, getattr(self, name), 1, MOST_COUNT)
        if not callable(self.function):
            raise refusal("function", self.function, "a function of x and p")
        names = self.parameters
        if not names or len(set(names)) < len(names):
            raise refusal("parameters", names, "a tuple of different names")
        count = self.dimension + len(names)
        sizes = vector("sizes", self.sizes) or (1.0,) * count
        object.__setattr__(self, "sizes", vector("sizes", sizes, count))
        if min(self.sizes) <= 0.0:
            raise InvalidParameterError(f"sizes = {self.sizes}: every size must be > 0.")

    def __call__(self, x: ArrayLike, p: Values) -> Floats:
        """Return the image of x, shape (d,)."""
        image, values = self._place(x, p)
        given = self._given(values)
        for _ in range(self.iterate):
            image = np.array([_number(y) for y in self._image(image, given)])
        return image

    def derivative(self, x: ArrayLike, p: Values, *directions: Floats) -> Floats:
        """Return D^k F [u_1, ..., u_k] at (x, p), k = 1, 2, 3, shape (d,).

        Each direction is real, of shape (d,), or longer by one entry per parameter.
        """
        us = checked(directions, self.dimension, len(self.parameters))
        image = self._jets(np.append(*self._place(x, p)), us)
        place = DERIVATIVE_AT[len(us)]
        return np.array([jet.coefficients[place] for jet in image])

    def linearised(self, x: ArrayLike, p: Values) -> tuple[Floats, Floats]:
        """Return (A, F_p): derivatives by x, shape (d, d), and by p, shape (d,) or (d, k).

        Cost: one evaluation on jets for every three columns.
        """
        at = np.append(*self._place(x, p))
        units = np.eye(len(at))
        columns: list[list[float]] = []
        for first in range(0, len(at), 3):
            us = list(units[first : first + 3])
            image = self._jets(at, us)
            columns += [[jet.coefficients[1 << k] for jet in image] for k in range(len(us))]
        whole = np.array(columns).T
        by_p = whole[:, self.dimension :]
        return whole[:, : self.dimension], by_p[:, 0] if len(self.parameters) == 1 else by_p

    def forms(self, x: ArrayLike, p: Values) -> MapForms:
        """Return the multilinear forms of the map at a point."""
        x, values = self._place(x, p)
        return MapForms(self, x, self._given(values.tolist()))

    def along(self, parameter: str, **fixed: float) -> ExplicitMap:
        """Return the map along one parameter, the others having fixed values.

        Raises
        ------
        InvalidParameterError
            A name that is not a parameter, or one without a value.
        """
        check_choice("parameter", parameter, self.parameters)
        wanted = [name for name in self.parameters if name != parameter]
        if sorted(fixed) != sorted(wanted):
            raise InvalidParameterError(
                f"fixed = {sorted(fixed)}: along {parameter} give the values of {sorted(wanted)}."
            )
        values = {name: real(name, value) for name, value in fixed.items()}

        def function(x: Any, p: Any) -> Sequence[Any]:
            return self.function(
                x, tuple(p if name == parameter else values[name] for name in self.parameters)
            )

        at = self.dimension + self.parameters.index(parameter)
        sizes = (*self.sizes[: self.dimension], self.sizes[at])
        return ExplicitMap(function, self.dimension, self.iterate, sizes, (parameter,))

    def fixed_point(self, guess: ArrayLike, p: Values) -> FixedPoint:
        """Find a fixed point of the map (of its iterate) by Newton's method (2).

        Parameters
        ----------
        guess
            Start, shape (d,).
        p
            The parameter, or all of them.

        Returns
        -------
        FixedPoint
            With its ``status``.
        """
        x = np.array(vector("guess", guess, self.dimension))
        p = self._given(self._values(p).tolist())
        steps, converged = 0, False
        while not converged and steps < MOST_NEWTON_STEPS:
            A, b = self.linearised(x, p)[0] - np.eye(self.dimension), self.residual(x, p)
            if not (np.all(np.isfinite(A)) and np.all(np.isfinite(b))):
                return self._failed(FixedPointStatus.LEFT_DOMAIN, x, p, steps)
            try:
                step = np.linalg.solve(A, -b)
            except np.linalg.LinAlgError:
                return self._failed(FixedPointStatus.SINGULAR, x, p, steps)
            x, steps = x + step, steps + 1
            converged = bool(
                np.all(
                    np.abs(step)
                    <= LAST_STEP_RELATIVE * (self.scale()[: self.dimension] + np.abs(x))
                )
            )
        if not converged:
            return self._failed(FixedPointStatus.NOT_CONVERGED, x, p, steps)
        return self.point(x, p, steps)

    def point(self, x: ArrayLike, p: Values, iterates: int = 0) -> FixedPoint:
        """Return the fixed point at x, which is taken as it is given."""
        x, values = self._place(x, p)
        given = self._given(values.tolist())
        nus = np.linalg.eigvals(self.linearised(x, given)[0]).astype(np.complex128)
        nus = nus[np.argsort(-np.abs(nus), kind="stable")]
        residual = float(np.max(np.abs(self.residual(x, given))))
        return FixedPoint(FixedPointStatus.CONVERGED, "", x, given, residual, iterates, nus)

    def residual(self, z: Floats, p: Values) -> Floats:
        """F(z, p) - z, shape (d,)."""
        return self(z, p) - z

    def jacobian(self, z: Floats, p: Values) -> tuple[Floats, Floats]:
        """Derivatives of the residual by z, shape (d, d), and by p, shape (d,) or (d, k)."""
        A, F_p = self.linearised(z, p)
        return A - np.eye(self.dimension), F_p

    def scale(self) -> Floats:
        """Size of each coordinate and, last, of the parameters, shape (d + k,)."""
        return np.array(self.sizes)

    def watch(self, z: Floats, p: Floats) -> Mapping[str, Floats]:
        """Test functions along a curve of fixed points in rows, shape (k, d), by the name of the point they vanish at.

        ``p``, shape (k,), are the values of the parameter at these points.
        PD: det(A + I). NS (d >= 2): the product of 1 - nu_i nu_j over all pairs i < j, which also
        vanishes at a neutral saddle, a real pair nu, 1 / nu.
        """
        rows, values = numbers("z", z), vector("p", p)
        if rows.shape != (len(values), self.dimension):
            raise refusal(
                "z", z, f"of shape ({len(values)}, {self.dimension}), a row for each value of p"
            )
        A = np.array([self.linearised(*at)[0] for at in zip(rows, values, strict=True)])
        tests: dict[str, Floats] = {PD.label: np.linalg.det(A + np.eye(self.dimension))}
        if self.dimension > 1:
            nus = np.linalg.eigvals(A)
            i, j = np.triu_indices(self.dimension, 1)
            tests[NS.label] = np.prod(1.0 - nus[:, i] * nus[:, j], axis=1).real
        return tests

    def _failed(self, status: FixedPointStatus, x: Floats, p: Values, steps: int) -> FixedPoint:
        residual = float(np.max(np.abs(self.residual(x, p))))
        why = {
            FixedPointStatus.NOT_CONVERGED: f"not converged in {steps} Newton steps",
            FixedPointStatus.SINGULAR: f"A - I is singular after {steps} Newton steps",
            FixedPointStatus.LEFT_DOMAIN: f"the map is not finite after {steps} Newton steps",
        }[status]
        reason = f"{why}, at x = {x.tolist()}, residual {residual:.3g}; try a nearer guess."
        unknown = np.full(self.dimension, np.nan, dtype=np.complex128)
        return FixedPoint(status, reason, x, p, residual, steps, unknown)

    def _place(self, x: ArrayLike, p: Values) -> tuple[Floats, Floats]:
        """A point and parameters as arrays; a point that a Newton step led to may be infinite."""
        if not (isinstance(x, np.ndarray) and x.dtype == float and x.shape == (self.dimension,)):
            x = np.array(vector("x", x, self.dimension))
        return x, self._values(p)

    def _values(self, p: Values) -> Floats:
        """All parameters, shape (k,)."""
        if len(self.parameters) == 1:
            return np.array([real("p", p)])
        return np.array(vector("p", p, len(self.parameters)))

    def _given(self, values: Sequence[Any] | Floats) -> Any:
        """Parameters as the function takes them: one value, or a tuple of several."""
        return values[0] if len(self.parameters) == 1 else tuple(values)

    def _jets(self, at: Floats, directions: Sequence[Floats]) -> list[_kernel.Jet]:
        """The image of the jets at + u e1 + v e2 + w e3; ``at`` ends with the parameter."""
        seeds = np.zeros((len(at), 8))
        for k, u in enumerate(directions):
            seeds[:, 1 << k] = u
        jets = [
            _kernel.Jet.of(value, s) for value, s in zip(at.tolist(), seeds.tolist(), strict=True)
        ]
        image, p = _objects(jets[: self.dimension]), self._given(jets[self.dimension :])
        for _ in range(self.iterate):
            image = _objects([_jet(y) for y in self._image(image, p)])
        return list(image)

    def _image(self, x: NDArray[Any], p: Any) -> list[Any]:
        """Values of the function, checked for their number."""
        try:
            with np.errstate(all="ignore"):
                image = list(self.function(x, p))
        except (TypeError, AttributeError) as error:
            raise InvalidParameterError(
                f"function failed on {type(x[0]).__name__} coordinates ({error}): it must return a "
                "sequence and use arithmetic and np.sin, np.cos, np.exp, np.log, np.sqrt only, not "
                "those of math."
            ) from error
        if len(image) != self.dimension:
            raise InvalidParameterError(
                f"function returned {len(image)} numbers; expected dimension = {self.dimension}."
            )
        return image


def _objects(jets: Sequence[Any]) -> NDArray[Any]:
    """Array of jets, as functions with matrix products need it."""
    array = np.empty(len(jets), dtype=object)
    array[:] = jets
    return array


def _number(y: Any) -> float:
    """One coordinate of an image on floats."""
    try:
        return float(y)
    except (TypeError, ValueError):
        raise InvalidParameterError(
            f"function returned {y!r} as a coordinate: must be a real number."
        ) from None


def _jet(y: Any) -> _kernel.Jet:
    """One coordinate of an image on jets; a constant stays constant."""
    return y if isinstance(y, _kernel.Jet) else _kernel.Jet(_number(y))
