"""Maps whose normal form is known, behind changes of coordinates; random polynomial maps."""

from __future__ import annotations

import cmath
import math
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

import vibroimpact.normal_forms as nf

TRACES = {"R1": 2.0, "R2": -2.0, "R3": -1.0, "R4": 0.0}

ROUNDING = 1e-13
"""A hundred operations on numbers of the order of one, behind gaps above 0.1."""

CHANGED = 1e-10
"""Behind a change of coordinates: products of its cubic polynomials with factors up to 2."""


class Change:
    """A change of coordinates y = T sheared(M x) + p s, exactly invertible and of any degree.

    Sheared: coordinate i is moved by a cubic polynomial of the coordinates after it, and then by
    one of those before it.
    """

    def __init__(self, n: int, seed: int = 0) -> None:
        rng = np.random.default_rng(seed)
        self.n = n
        self.T = np.linalg.qr(rng.normal(size=(n, n)))[0] @ np.diag(rng.uniform(0.5, 2.0, n))
        self.M = np.linalg.qr(rng.normal(size=(n, n)))[0]
        self.linear = self.T @ self.M
        self.shift = rng.uniform(-1.0, 1.0, n)
        self.second = rng.uniform(-0.5, 0.5, (n, n, n))
        self.third = rng.uniform(-0.5, 0.5, (n, n))

    def real_length(self, at: int) -> float:
        """Length of what is the unit vector of coordinate ``at`` in the normal form."""
        return float(np.linalg.norm(self.linear[:, at]))

    def complex_length(self, at: int) -> float:
        """The same of z = x_at + i x_(at + 1), where z = 1 is 2 Re(q size)."""
        return float(np.linalg.norm(self.linear[:, at : at + 2] @ [1.0, -1j])) / 2.0

    def _moved(self, x: Any, i: int, others: range) -> Any:
        quadratic = sum(self.second[i, j, k] * x[j] * x[k] for j in others for k in others)
        return quadratic + sum(self.third[i, j] * x[j] ** 3 for j in others)

    def seen(self, x: Any, p: Any) -> Any:
        """y of x."""
        x = list(self.M @ np.array(list(x)))
        for i in range(self.n):
            x[i] = x[i] + self._moved(x, i, range(i + 1, self.n))
        for i in reversed(range(self.n)):
            x[i] = x[i] + self._moved(x, i, range(i))
        return self.T @ np.array(x) + self.shift * p

    def hidden(self, y: Any, p: Any) -> Any:
        """x of y."""
        x = list(np.linalg.inv(self.T) @ (y - self.shift * p))
        for i in range(self.n):
            x[i] = x[i] - self._moved(x, i, range(i))
        for i in reversed(range(self.n)):
            x[i] = x[i] - self._moved(x, i, range(i + 1, self.n))
        return self.M.T @ np.array(x)

    def map(self, function: Any) -> nf.ExplicitMap:
        """The map x -> function(x, p) in the coordinates y."""
        return nf.ExplicitMap(
            lambda y, p: self.seen(function(self.hidden(y, p), p), p), dimension=self.n
        )


@dataclass(frozen=True)
class Planted:
    """z' = nu z (1 + kappa p + d |z|^2), w' = B w, behind a change of coordinates."""

    dimension: int
    nu: complex = cmath.exp(2.2j)
    kappa: complex = 0.7 - 0.3j
    d: complex = -0.8 + 0.5j
    seed: int = 0

    @cached_property
    def change(self) -> Change:
        return Change(self.dimension, self.seed)

    @cached_property
    def rest(self) -> np.ndarray:
        m = self.dimension - 2
        return 0.6 * np.random.default_rng(self.seed).uniform(-1.0, 1.0, (m, m)) / max(m, 1)

    def normal(self, x: Any, p: Any) -> Any:
        """The normal form, in real coordinates z = x1 + i x2."""
        size = x[0] ** 2 + x[1] ** 2
        factors = [
            self.nu.real + (self.nu * self.kappa).real * p + (self.nu * self.d).real * size,
            self.nu.imag + (self.nu * self.kappa).imag * p + (self.nu * self.d).imag * size,
        ]
        return [
            factors[0] * x[0] - factors[1] * x[1],
            factors[0] * x[1] + factors[1] * x[0],
            *(self.rest @ x[2:]),
        ]

    @property
    def map(self) -> nf.ExplicitMap:
        return self.change.map(self.normal)

    def forms(self) -> nf.MapForms:
        return self.map.forms(np.zeros(self.dimension), 0.0)


@dataclass(frozen=True)
class Tensors:
    """A random polynomial map with a pair exp(+-i angle), the rest inside the unit circle."""

    A: np.ndarray
    B: np.ndarray
    C: np.ndarray

    @property
    def dimension(self) -> int:
        return len(self.A)

    def derivative(self, *directions: np.ndarray) -> np.ndarray:
        image = (self.A, self.B, self.C)[len(directions) - 1]
        for u in directions:
            image = image @ u
        return image


def random_map(n: int, seed: int, angle: float = 1.9) -> Tensors:
    rng = np.random.default_rng(seed)
    core = np.zeros((n, n))
    core[:2, :2] = [[math.cos(angle), -math.sin(angle)], [math.sin(angle), math.cos(angle)]]
    core[2:, 2:] = np.triu(rng.uniform(-0.7, 0.7, (n - 2, n - 2)))
    T = rng.normal(size=(n, n)) + 2.0 * np.eye(n)
    B, C = rng.uniform(-1, 1, (n, n, n)), rng.uniform(-1, 1, (n, n, n, n))
    B = (B + B.transpose(0, 2, 1)) / 2.0
    C = sum(
        C.transpose(0, *(1 + np.array(order)))
        for order in [(0, 1, 2), (0, 2, 1), (1, 0, 2), (1, 2, 0), (2, 0, 1), (2, 1, 0)]
    )
    return Tensors(T @ core @ np.linalg.inv(T), B, C / 6.0)


def found(kind: str, forms: Any, **keywords: Any) -> Any:
    form = nf.normal_form(kind, forms, **keywords)
    assert not isinstance(form, nf.Refusal), form.reason
    return form


def point_of(kind: str, form: Any) -> Any:
    """The normal form of a point of codimension two, complete and not refused."""
    assert not isinstance(form, nf.Refusal), form.reason
    assert isinstance(form, nf.CodimensionTwo)
    assert form.kind == kind
    assert bool(form.switchable) != bool(form.why_not)
    assert "  " not in form.meaning
    return form


def henon(R: float, trace: float) -> tuple[Any, float, float]:
    """Generalised Henon map at its resonance, as a function of the displacement; alpha, beta.

    (x, y) -> (y, alpha - beta x - y^2 + R x y) has at x = y the trace (R - 2) x and the determinant
    beta - R x, which is 1.
    """
    x = trace / (R - 2.0)
    beta = 1.0 + R * x
    alpha = x + beta * x + (1.0 - R) * x**2

    def function(u: Any, _: Any) -> list[Any]:
        at = u[0] + x, u[1] + x
        return [u[1], alpha - beta * at[0] - at[1] ** 2 + R * at[0] * at[1] - x]

    return function, alpha, beta


def forms_at(kind: str, R: float) -> nf.MapForms:
    """The generalised Henon map at its resonance R1 to R4."""
    function, _, _ = henon(R, TRACES[kind])
    return nf.ExplicitMap(function, dimension=2).forms([0.0, 0.0], 0.0)


def times(w: complex, re: Any, im: Any) -> Any:
    """Real and imaginary part of w (re + i im)."""
    return np.array([w.real * re - w.imag * im, w.real * im + w.imag * re])


def driving(kind: str, R: float, change: Change | None = None) -> nf.MapForms:
    """The same map behind a change of coordinates; in dimension 4 it drives two stable ones."""
    plane, change = henon(R, TRACES[kind])[0], change or Change(4)

    def function(x: Any, p: Any) -> Any:
        driven = []
        if change.n == 4:
            driven.append(0.4 * x[2] + 0.3 * x[0] * x[1] + 0.2 * x[2] * x[0] - 0.1 * x[1] ** 3)
            driven.append(0.5 * x[0] ** 2 - 0.3 * x[3] + 0.2 * x[2] * x[3])
        return np.array([*plane(x[:2], p), *driven])

    return change.map(function).forms(np.zeros(change.n), 0.0)
