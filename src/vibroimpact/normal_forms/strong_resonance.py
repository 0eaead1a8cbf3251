"""Critical coefficients at the strong resonances 1:2 and 1:3 (codimension two).

Method      1:2, a double multiplier -1 with one eigenvector. With A q0 = -q0, A q1 = -q1 + q0,
            A^T p0 = -p0, A^T p1 = -p1 + p0, <p0, q1> = <p1, q0> = 1, <p1, q1> = <q0, q1> = 0:
                w0 -> -w0 + w1,   w1 -> -w1 + c w0^3 + d w0^2 w1 + ...,                      (1)
                h20 = (I - A)^-1 B(q0, q0),   h11 = (I - A)^-1 (B(q0, q1) + h20),
                c = <p0, g> / 6,  g = C(q0, q0, q0) + 3 B(q0, h20),
                d = <p0, C(q0, q0, q1) + 2 B(q0, h11) + B(q1, h20)> / 2 + <p1, g> / 2.       (2)
            1:3, nu = exp(2 pi i / 3), which conj(nu)^2 equals:
                z -> nu z + b conj(z)^2 + c z |z|^2 + ...,                                   (3)
                (conj(nu) I - A) h20 = B(q, q) - 2 conj(b) conj(q),  <conj p, h20> = 0,
                h11 = (I - A)^-1 B(q, conj q),   b = <p, B(conj q, conj q)> / 2,
                c = <p, C(q, q, conj q) + 2 B(q, h11) + B(conj q, h20)> / 2.                 (4)
Assumes     no other multiplier on the unit circle
Accuracy    1:2: the double multiplier is known to half of the digits at best, but q0 and p0 are
            singular vectors of A + I, accurate to rounding over the gap; 1:3: rounding times |p|
Fails       a Refusal where the multipliers are not those of the resonance
Reference   Kuznetsov, Elements of Applied Bifurcation Theory, sections 9.5 and 9.6; the scaled
            coefficients are those that MatContM prints
"""

from __future__ import annotations

import cmath
import math
from dataclasses import dataclass

import numpy as np

from vibroimpact._core.errors import InvalidParameterError
from vibroimpact._core.types import Complexes, Floats
from vibroimpact.normal_forms.critical import (
    ON_CIRCLE,
    Critical,
    Refusal,
    Status,
    critical_multiplier,
)
from vibroimpact.normal_forms.forms import Forms, Multilinear, jacobian

CUBE_ROOT = cmath.exp(2j * math.pi / 3.0)


@dataclass(frozen=True)
class OneToTwo:
    """Coefficients (2) of (1), for |q0| = 1.

    Attributes
    ----------
    c, d
        c < 0: saddles of period two, c > 0: neutral ones. -2 d - 6 c decides the stability of the
        circle around the fixed point.
    """

    c: float
    d: float

    kind = "R2"

    @property
    def scaled(self) -> tuple[float, float]:
        """Scaled coefficients (4 c, -2 d - 6 c)."""
        return 4.0 * self.c, -2.0 * self.d - 6.0 * self.c


@dataclass(frozen=True)
class OneToThree:
    """Coefficients (4) of (3), for |q| = 1, <p, q> = 1.

    Attributes
    ----------
    b, c
        b != 0: a saddle orbit of period three lies next to the fixed point.
    """

    b: complex
    c: complex

    kind = "R3"

    @property
    def scaled(self) -> complex:
        """Scaled coefficient (conj(nu) c / |b|^2 - 1) / 3; if negative, the circle attracts.

        Only its real part, the one that decides, is invariant under changes of coordinates: the
        imaginary part depends on the choice of h20 along conj(q), which conj(z)^2 leaves free.
        """
        return (CUBE_ROOT.conjugate() * self.c / abs(self.b) ** 2 - 1.0) / 3.0


def strong_resonance(kind: str, forms: Forms) -> OneToTwo | OneToThree | Refusal:
    """Compute the critical coefficients at a strong resonance.

    Parameters
    ----------
    kind
        "R2" or "R3".
    forms
        Forms of the map at its fixed point, at the critical parameters.

    Returns
    -------
    OneToTwo, OneToThree or Refusal
        A refusal where the multipliers are not those of the resonance.

    Raises
    ------
    InvalidParameterError
        Another kind.
    """
    if kind == "R2":
        return _one_to_two(forms)
    if kind == "R3":
        return _one_to_three(forms)
    raise InvalidParameterError(f'kind = {kind!r}: must be "R2" or "R3".')


def _one_to_two(forms: Forms) -> OneToTwo | Refusal:
    A, at = jacobian(forms), Multilinear(forms)
    values = np.linalg.eigvals(A).astype(np.complex128)
    near = np.abs(values + 1.0) <= math.sqrt(ON_CIRCLE)  # a double root splits by the square root
    if np.count_nonzero(near) != 2 or np.any(np.abs(np.abs(values[~near]) - 1.0) <= ON_CIRCLE):
        reason = "R2 needs exactly two multipliers -1 and no other on the unit circle."
        return Refusal("R2", Status.NOT_CRITICAL, reason, values)
    q0, q1, p0, p1 = _chains(A)
    identity = np.eye(len(A))
    h20 = np.linalg.solve(identity - A, at.real(q0, q0))
    h11 = np.linalg.solve(identity - A, at.real(q0, q1) + h20)
    cubic = at.real(q0, q0, q0) + 3.0 * at.real(q0, h20)
    mixed = at.real(q0, q0, q1) + 2.0 * at.real(q0, h11) + at.real(q1, h20)
    return OneToTwo(float(p0 @ cubic) / 6.0, float(p0 @ mixed + p1 @ cubic) / 2.0)  # (2)


def _chains(A: Floats) -> tuple[Floats, Floats, Floats, Floats]:
    """(q0, q1, p0, p1) of the double multiplier -1."""
    shifted = A + np.eye(len(A))
    left, sizes, right = np.linalg.svd(shifted)
    q0, p0 = right[-1], left[:, -1]
    inverse = (right[:-1].T / sizes[:-1]) @ left[:, :-1].T  # of A + I without its null vectors
    q1, p1 = inverse @ q0, inverse.T @ p0
    p0, p1 = p0 / (p0 @ q1), p1 / (p0 @ q1)
    return q0, q1, p0, p1 - (p1 @ q1) * p0


def _one_to_three(forms: Forms) -> OneToThree | Refusal:
    A, at = jacobian(forms), Multilinear(forms)
    critical = critical_multiplier("R3", A, None)
    if isinstance(critical, Refusal):
        return critical
    if abs(critical.multiplier - CUBE_ROOT) > ON_CIRCLE:
        reason = f"R3 needs nu = exp(2 pi i / 3); the nearest is {critical.multiplier:.9g}."
        return Refusal("R3", Status.NOT_CRITICAL, reason, critical.multipliers)
    q, bar = critical.q, critical.q.conj()
    b = critical.project(at(bar, bar)) / 2.0
    h11 = np.linalg.solve(np.eye(len(A)) - A, at(q, bar))
    cubic = at(q, q, bar) + 2.0 * at(q, h11) + at(bar, _resonant_h20(A, critical, at(q, q)))
    return OneToThree(b, critical.project(cubic) / 2.0)  # (4)


def _resonant_h20(A: Floats, critical: Critical, right: Complexes) -> Complexes:
    """The solution of (4), from the system bordered by the null vectors conj(q) and conj(p)."""
    shifted = CUBE_ROOT.conjugate() * np.eye(len(A)) - A
    column, row = critical.q.conj()[:, None], critical.p[None, :]
    bordered = np.block([[shifted, column], [row, np.zeros((1, 1))]])
    return np.asarray(np.linalg.solve(bordered, np.append(right, 0.0))[:-1], np.complex128)
