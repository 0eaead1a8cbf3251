"""Section 4 of the paper at the Neimark-Sacker points: the coefficient f1, right and as printed.

Method      half map H, basis-free formula: d, and with it the predicted circle
            (vibroimpact.normal_forms.neimark_sacker)
            half map H and full map P, method of the paper, corrected: f1 = -Re(d) of H, -2 Re(d) of P
            (vibroimpact.normal_forms.centre_manifold)
            full map P, as printed. With k1 = 2 q, z = <p, X> and a real basis k3, k4 of the other
            invariant subspace, w its coordinates,
                g20 = <p, B(q, q)>,  g11 = <p, B(q, conj q)>,  g02 = <p, B(conj q, conj q)>,
                G21 = <p, C(q, q, conj q)>,  G10 = <p, B(q, kj)>,  G01 = <p, B(conj q, kj)>,
                H11 = w(B(q, conj q)),  H02 = w(B(conj q, conj q))                          (1)
            The printed (39) has conj(lambda) to the first power; the printed sign in (A7) turns
                G01 into G01 - i (Im G01 - Im G10)                                          (2)
            and the printed sign in (A10) H02 into conj(H02).                               (3)
            The third derivatives printed in (A6), (A7) are over two variables, which has no
            meaning; second ones are taken.
            With the phase of k1, an eigenvector still, q and p turn by c = exp(i phase):
                g20, g11, g02, G21, G10, G01, H11, H02 by c, conj c, conj c^3, 1, 1, conj c^2,
                1, conj c^2                                                                 (4)
            f1 must not depend on it. With (2) and (3) it does: its range is given.
Assumes     as for the normal form (critical.py of vibroimpact.normal_forms)
Accuracy    rounding times the condition of the eigenbasis
Fails       never at the points of the paper's sets; a refused normal form raises AssertionError
Reference   the founding paper, section 4 and appendix; the same misprints on maps made by hand:
            normal_form_residuals.py
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from vibroimpact._core.types import Complexes, Floats
from vibroimpact.normal_forms import CentreManifold, Multilinear, NeimarkSacker, normal_form
from vibroimpact.normal_forms.centre_manifold import centre_manifold
from vibroimpact.normal_forms.forms import jacobian
from vibroimpact.orbits.maps import SegmentMap, full_map, half_map
from vibroimpact_papers.impact_damper.symmetric_bifurcations import Bifurcation

PHASES = 72  # of k1, at which f1 as printed is evaluated: every five degrees


@dataclass(frozen=True)
class Appendix:
    """The coefficients (1) at a point, from which (39) and the appendix make f1.

    Attributes
    ----------
    multiplier
        lambda_0, |lambda_0| = 1.
    g20, g11, g02, G21
        Coefficients of the planar map.
    G10, G01, H11, H02
        Coefficients of the coupling to the other coordinates, shape (dimension - 2,).
    block
        B of (A8), shape (dimension - 2, dimension - 2).
    """

    multiplier: complex
    g20: complex
    g11: complex
    g02: complex
    G21: complex
    G10: Complexes
    G01: Complexes
    H11: Floats
    H02: Complexes
    block: Floats

    def turned(self, phase: float) -> Appendix:
        """Return the coefficients for k1 turned by a phase in radians (4)."""
        c = complex(np.exp(1j * phase))
        bar = c.conjugate()
        return replace(
            self, g20=c * self.g20, g11=bar * self.g11, g02=bar**3 * self.g02,
            G01=bar**2 * self.G01, H02=bar**2 * self.H02,
        )  # fmt: skip

    def with_printed_signs(self) -> Appendix:
        """Return the coefficients by (A7) and (A10) with their printed signs."""
        G01 = self.G01 - 1j * (self.G01.imag - self.G10.imag)  # (2)
        return replace(self, G01=G01, H02=self.H02.conj())  # (3)

    def f1(self, *, power: int) -> float:
        """Return f1 by (39), conj(lambda_0) in its first term to a power: printed 1, right 2."""
        lam, bar, identity = self.multiplier, self.multiplier.conjugate(), np.eye(len(self.block))
        w11 = np.linalg.solve(identity - self.block, self.H11)  # (A8)
        w20 = np.linalg.solve(bar**2 * identity - self.block, self.H02).conj()
        g21 = self.G21 + complex(2.0 * self.G10 @ w11 + self.G01 @ w20)  # (A4)
        first = (1.0 - 2.0 * lam) * bar**power / (2.0 * (1.0 - lam)) * self.g20 * self.g11
        squares = abs(self.g11) ** 2 / 2.0 + abs(self.g02) ** 2 / 4.0
        return first.real + squares - (bar * g21).real / 2.0  # (39)

    def printed_range(self) -> tuple[float, float]:
        """Return the least and the largest f1 with every printed sign and power, over k1."""
        phases = 2.0 * np.pi * np.arange(PHASES) / PHASES
        values = [self.turned(float(t)).with_printed_signs().f1(power=1) for t in phases]
        return min(values), max(values)


@dataclass(frozen=True)
class CriticalPoint:
    """A Neimark-Sacker point of the paper's branch with its normal form.

    Attributes
    ----------
    set
        Name of the parameter set.
    bifurcation
        The point, found without a normal form.
    form
        Normal form of the half map, by the basis-free formula.
    f1
        (39), corrected, of the half map.
    f1_full
        The same of the full map, which is the paper's.
    f1_printed
        (39) as printed of the full map, with the appendix corrected.
    f1_all_printed
        Least and largest f1 of the full map with the appendix as printed too, over phases of k1.
    """

    set: str
    bifurcation: Bifurcation
    form: NeimarkSacker = field(repr=False)
    f1: float
    f1_full: float
    f1_printed: float
    f1_all_printed: tuple[float, float]

    @property
    def omega(self) -> float:
        """Critical frequency."""
        return self.bifurcation.omega

    @property
    def name(self) -> str:
        """Set and frequency, as in A 1.0079."""
        return f"{self.set} {self.omega:.4f}"

    @property
    def state(self) -> Floats:
        """The critical orbit just after its impact at stop A: (x1, v1, v2, theta)."""
        at = self.bifurcation.orbit.state
        return np.array([at.position[0], *at.velocity, at.phase])


def critical_points(name: str, bifurcations: Sequence[Bifurcation]) -> list[CriticalPoint]:
    """Return the normal form at each Neimark-Sacker point of a set that motions pass."""
    chosen = (b for b in bifurcations if b.kind == "NS" and b.admissible)
    return [critical_point(name, b) for b in chosen]


def critical_point(name: str, bifurcation: Bifurcation) -> CriticalPoint:
    """Return the normal form at one Neimark-Sacker point. Cost: some 0.1 s."""
    orbit = bifurcation.orbit
    half, full = half_map(orbit, "omega"), full_map(orbit)
    form = normal_form("NS", half)
    assert isinstance(form, NeimarkSacker), form
    printed = appendix(full)
    return CriticalPoint(
        set=name,
        bifurcation=bifurcation,
        form=form,
        f1=_f1(half),
        f1_full=_f1(full),
        f1_printed=printed.f1(power=1),
        f1_all_printed=printed.printed_range(),
    )


def appendix(forms: SegmentMap) -> Appendix:
    """Return the coefficients (1) of a map at a Neimark-Sacker point."""
    form, paper = normal_form("NS", forms, unfolded=False), centre_manifold(forms)
    assert isinstance(form, NeimarkSacker), form
    assert isinstance(paper, CentreManifold), paper.reason
    at, q, bar, H = Multilinear(forms), form.q, form.q.conj(), paper.H
    inverse = np.linalg.inv(H)

    def along(vector: Complexes) -> complex:
        return complex(np.vdot(form.p, vector))

    others = H.T[2:]
    return Appendix(
        multiplier=form.multiplier,
        g20=along(at(q, q)),
        g11=along(at(q, bar)),
        g02=along(at(bar, bar)),
        G21=along(at(q, q, bar)),
        G10=np.array([along(at(q, k)) for k in others]),
        G01=np.array([along(at(bar, k)) for k in others]),
        H11=np.asarray((inverse[2:] @ at(q, bar)).real, np.float64),
        H02=np.asarray(inverse[2:] @ at(bar, bar), np.complex128),
        block=np.asarray((inverse @ jacobian(forms) @ H)[2:, 2:], np.float64),
    )


def _f1(forms: SegmentMap) -> float:
    """Return f1 by the paper's method."""
    paper = centre_manifold(forms)
    assert isinstance(paper, CentreManifold), paper.reason
    return paper.f1
