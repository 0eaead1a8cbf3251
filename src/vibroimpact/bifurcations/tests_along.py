"""Test functions along a curve of bifurcations, whose zeros are points of codimension two.

Method      with L, E of equations.py, scaled, v the null vector of L(mu), W' the left one,
            SN   cusp   det [L(1), F_zz v v; v', 0]  ~  W' F_zz v v                              (1)
                 flip   det L(-1)        pair   tau of conditions.py: R1, and LPNS               (2)
            PD   fold   det L(1)         pair   tau: R2, and PDNS                                (3)
                 cubic  the coefficient c, times det L(1) and det [L(-1), E v; v', 0], which remove its poles
                        at fold-flip and R2 points                                               (4)
            NS   with kappa = (mu_1 + mu_2) / 2 of the critical pair, the cosine of the angle or, for a neutral
                 saddle, a number beyond 1:  kappa - cos(2 pi p / q) for all p / q               (5)
                 fold   det L(1)         flip   det L(-1), both also zero at R1 or R2            (6)
                 others product of 1 - mu_i mu_j over all other pairs                            (7)
                 cubic  the real part of d, undefined on neutral saddles                         (8)
            GR   fold   det L(1)         flip   det L(-1)         pair   tau                     (9)
            GR, ZERO of a rigid stop, with C, L of the touch, w the speeds after an impulse (normal_forms/touch.py):
                 push   C L w: an impact does not move the gap a turn later                     (10)
                 side   kappa of w, whose sign is the side on which the orbit with the impact begins, times
                        D / (1 + D^2)^(1/2), D = det(I - L), which takes its pole away          (11)
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from fractions import Fraction

import numpy as np

from vibroimpact._core.types import Floats
from vibroimpact.bifurcations.augmented import Tests
from vibroimpact.bifurcations.conditions import (
    OF_TESTS,
    ClosingRate,
    Condition,
    CriticalMultiplier,
    CriticalPair,
    Graze,
    Level,
    critical_pair,
)
from vibroimpact.bifurcations.equations import Equations, Pair
from vibroimpact.bifurcations.of_orbits import OrbitPlane
from vibroimpact.branches.family import EVENT
from vibroimpact.branches.touch import Place, touched_map
from vibroimpact.compile.prescribed import GAP_WATCH
from vibroimpact.normal_forms.codimension_one import NS, PD
from vibroimpact.normal_forms.codimension_two import TWO
from vibroimpact.normal_forms.critical import Refusal
from vibroimpact.normal_forms.flip_fold import Flip, flip
from vibroimpact.normal_forms.forms import InSizes
from vibroimpact.normal_forms.kind import PointKind
from vibroimpact.normal_forms.neimark_sacker import NeimarkSacker, neimark_sacker
from vibroimpact.normal_forms.resonance import HIGHEST_DENOMINATOR
from vibroimpact.orbits.admissibility import Nearest

CUSP, FLIP, FOLD, PAIR, CUBIC, OTHERS = "cusp", "flip", "fold", "pair", "cubic", "others"
PUSH, SIDE = "push", "side"


def _fractions() -> dict[str, float]:
    """Cosines of (5) by the name of the resonance; strong ones by their labels."""
    strong = {kind.label: Fraction(*kind.resonance) for kind in TWO.values() if kind.resonance}
    found = {label: round(_cosine(ratio), 15) for label, ratio in strong.items()}  # exact
    ratios = {
        Fraction(p, q) for q in range(5, HIGHEST_DENOMINATOR + 1) for p in range(1, (q + 1) // 2)
    }
    weak = sorted(ratio for ratio in ratios if ratio.denominator >= 5)
    return found | {f"{r.numerator}/{r.denominator}": _cosine(r) for r in weak}


def _cosine(turns: Fraction) -> float:
    return math.cos(2.0 * math.pi * turns)


RESONANCES = _fractions()
COSINE = min(
    RESONANCES, key=lambda name: abs(RESONANCES[name])
)  # of the angle: the function of 1:4


def nothing(_z: Floats, _w: Floats, _a: Pair) -> Mapping[str, float]:
    """Return no test functions, for curves of touches and levels."""
    return {}


def _forms(equations: Equations, z: Floats, a: Pair) -> InSizes:
    """Forms of the map in coordinates of size one."""
    sizes = equations.on_section(equations.sizes.astype(np.complex128)).real
    return InSizes(equations.forms(z, a), np.asarray(sizes, dtype=float))


class AtMultiplier:
    """Test functions of curves of SN, PD and BP."""

    def __init__(self, condition: CriticalMultiplier) -> None:
        self.condition, self.equations = condition, condition.equations
        self._pair = CriticalPair(condition.equations)

    def __call__(self, z: Floats, w: Floats, a: Pair) -> Mapping[str, float]:
        """Values of the test functions (1) to (4)."""
        tests = {PAIR: self._pair.tau(z, a)}
        if self.condition.multiplier == 1.0:
            tests[CUSP] = self._cusp(z, w, a)
            tests[FLIP] = self._determinant(z, a, -1.0)
        else:
            tests[FOLD] = fold = self._determinant(z, a, 1.0)
            tests[CUBIC] = self._cubic(z, w, a) * fold
        return tests

    def _determinant(self, z: Floats, a: Pair, multiplier: float) -> float:
        return float(np.linalg.det(self.condition.matrix(z, a, multiplier)))

    def _cusp(self, z: Floats, w: Floats, a: Pair) -> float:
        eq = self.equations
        v = w * eq.sizes
        return self._bordered(
            z, w, a, eq.second(z, a, v[None])[0, :, : len(v)] @ v / eq.rows
        )  # (1)

    def _bordered(self, z: Floats, w: Floats, a: Pair, column: Floats) -> float:
        matrix = self.condition.matrix(z, a, self.condition.multiplier)
        return float(np.linalg.det(np.block([[matrix, column[:, None]], [w, np.zeros(1)]])))

    def _cubic(self, z: Floats, w: Floats, a: Pair) -> float:
        eq = self.equations
        form = flip(PD, _forms(eq, z, a), parameter=False)
        found = form.critical if isinstance(form, Refusal) else form
        marked = eq.closing @ (w * eq.sizes) / eq.rows
        return found.c * self._bordered(z, w, a, marked) if isinstance(found, Flip) else math.nan


class AtPair:
    """Test functions of curves of NS."""

    def __init__(self, condition: CriticalPair) -> None:
        self.condition, self.equations = condition, condition.equations
        self._multiplier = CriticalMultiplier(condition.equations, 1.0)

    def __call__(self, z: Floats, _w: Floats, a: Pair) -> Mapping[str, float]:
        """Values of the test functions (5) to (8)."""
        mu = self.equations.multipliers(z, a)
        i, j = critical_pair(mu)
        kappa = float((mu[i] + mu[j]).real) / 2.0
        tests = {name: kappa - cosine for name, cosine in RESONANCES.items()}
        for name, multiplier in ((FOLD, 1.0), (FLIP, -1.0)):
            tests[name] = float(np.linalg.det(self._multiplier.matrix(z, a, multiplier)))
        if len(mu) > 2:
            tests[OTHERS] = self.condition.tau(z, a, (i, j))
        tests[CUBIC] = self._cubic(z, a) * (1.0 - kappa * kappa) if abs(kappa) < 1.0 else math.nan
        return tests

    def _cubic(self, z: Floats, a: Pair) -> float:
        form = neimark_sacker(NS, _forms(self.equations, z, a), parameter=False)
        found = form.critical if isinstance(form, Refusal) else form
        return found.d.real if isinstance(found, NeimarkSacker) else math.nan


class AtTouch:
    """Test functions of curves of touches of a stop: (9) to (11)."""

    def __init__(self, plane: OrbitPlane, condition: Graze | ClosingRate) -> None:
        self.plane, self.condition = plane, condition
        self._pair, self._multiplier = CriticalPair(plane), CriticalMultiplier(plane, 1.0)

    def __call__(self, z: Floats, w: Floats, a: Pair) -> Mapping[str, float]:
        """Values of the test functions; NaN where there is no orbit."""
        tests, place = {}, self._place(z, w)
        if isinstance(self.condition, Graze):
            tests = {PAIR: self._pair.tau(z, a)}
            for name, multiplier in ((FOLD, 1.0), (FLIP, -1.0)):
                tests[name] = float(np.linalg.det(self._multiplier.matrix(z, a, multiplier)))
        if place.end.watch != GAP_WATCH:
            return tests
        orbit = self.plane.solution(z, a)
        if not orbit.converged:
            return tests | dict.fromkeys((PUSH, SIDE), math.nan)
        at = touched_map(orbit, place, self.plane.names[0])
        sizes = self.plane.sizes[[self.plane.kept.index(i) for i in at.kept]]
        push, side = at.conditions(sizes)
        return tests | {PUSH: push, SIDE: side}

    def _place(self, z: Floats, w: Floats) -> Place:
        """Where the orbit touches."""
        if isinstance(self.condition, Graze):
            return self.condition.place(w)
        k = self.condition.segment
        return Place(k, float(self.plane.unpacked(z)[1][k]), self.plane.ends[k])


def on_multipliers(kind: PointKind, equations: Equations) -> tuple[Condition, Tests]:
    """Condition and test functions of a smooth kind of codimension one."""
    (critical,) = kind.critical
    if critical is None:
        pair = CriticalPair(equations)
        return pair, AtPair(pair)
    condition = CriticalMultiplier(equations, critical)
    return condition, AtMultiplier(condition)


def condition_of(
    kind: PointKind, plane: OrbitPlane, touch: Nearest | None, test: str
) -> tuple[Condition, Tests] | None:
    """Condition and test functions of a kind: of a touch with the stop, else of the test function that is zero."""
    if kind.critical:
        return on_multipliers(kind, plane)
    if kind.function:
        return Level(plane, kind.function, 0.0, f"{EVENT} {kind.label}"), nothing
    word, _, number = test.partition(" ")
    if word in OF_TESTS and number:
        condition: Condition = OF_TESTS[word](plane, int(number))
        if isinstance(condition, ClosingRate) and plane.mechanism.forces:
            return condition, AtTouch(plane, condition)
        return condition, nothing
    if not touch or kind.test:
        return None
    graze = Graze(plane, touch)
    return graze, AtTouch(plane, graze) if plane.mechanism.forces else nothing
