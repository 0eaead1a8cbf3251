"""Bifurcations of the symmetric 1-1-1 orbits, from the half map H only.

    fold               1 + r^2 - r^2 q^2 = 0: the two signs meet, nu = +1             (1)
    symmetry breaking  det(DH + I) = 0: nu = -1                                       (2)
    torus              det of the biproduct, prod over i < j of (nu_i nu_j - 1) = 0   (3)

A pair of real multipliers with product 1 (a neutral saddle) is a root of (3) too and is dropped.
A grid of omega brackets sign changes; around every local minimum of the modulus the grid is
refined, and the ends of the branch, the folds, are grid points.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import combinations
from typing import TYPE_CHECKING

from .precision import Real, exact, mp
from .symmetric import (
    characteristic,
    coefficients,
    half_jacobian,
    half_multipliers,
    inadmissible,
    orbit,
)

if TYPE_CHECKING:
    from collections.abc import Callable

    from .damper import Damper
    from .symmetric import Orbit

    Test = Callable[[Real], Real]  # of omega; None where there is no orbit

SIDE = "1e-6"  # how far from the point stability is looked at
REFINE = 20  # grid points added in an interval beside a local minimum of the modulus


@dataclass(frozen=True)
class Point:
    """A bifurcation of the branch of one sign (a fold belongs to both)."""

    kind: str  # SN, BP, NS
    omega: Real
    sign: int
    multipliers: list[Real]  # of H
    critical: Real  # the one on the unit circle, upper half plane
    inadmissible: str | None
    stable: str  # "below", "above", "neither", "both": where in omega the orbit is stable
    growth: Real  # d|nu|/d omega of the critical pair, a torus; None otherwise


def at_omega(damper: Damper, omega: Real) -> Damper:
    """The same damper at another forcing frequency."""
    return replace(damper, omega=exact(omega))


def fold_test(damper: Damper, _sign: int) -> Real:
    """(1)."""
    return coefficients(damper).discriminant


def breaking_test(damper: Damper, sign: int) -> Real | None:
    """(2)."""
    o = orbit(damper, sign)
    if o is None:
        return None
    return sum(c * (-1) ** k for k, c in enumerate(characteristic(half_jacobian(o))))


def torus_test(damper: Damper, sign: int) -> Real | None:
    """(3)."""
    o = orbit(damper, sign)
    if o is None:
        return None
    product = mp.mpc(1)
    for first, second in combinations(half_multipliers(o), 2):
        product *= first * second - 1
    return product.real


def bifurcations(damper: Damper, low: Real, high: Real, *, steps: int = 400) -> list[Point]:
    """All bifurcations of both signs for omega in a range."""
    low, high = exact(low), exact(high)
    grid = [low + (high - low) * i / steps for i in range(steps + 1)]
    folds = _roots(lambda w: fold_test(at_omega(damper, w), 1), grid)
    beside = mp.mpf(10) ** -12
    grid = sorted(grid + [w * (1 + e) for w in folds for e in (-beside, beside)])
    found = [("SN", 1, omega) for omega in folds]
    for kind, test in (("BP", breaking_test), ("NS", torus_test)):
        for sign in (1, -1):
            roots = _roots(lambda w: test(at_omega(damper, w), sign), grid)  # noqa: B023
            found += [(kind, sign, omega) for omega in roots]
    points = [_point(kind, at_omega(damper, omega), sign) for kind, sign, omega in found]
    return sorted((p for p in points if p), key=lambda p: p.omega)


def _roots(test: Test, grid: list[Real]) -> list[Real]:
    """Roots of a test function: sign changes on a grid, each polished to working precision."""
    with mp.workdps(30):
        grid = _refined(test, grid)
        values = [test(w) for w in grid]
    roots = []
    for i in range(len(grid) - 1):
        ends = values[i], values[i + 1]
        if None not in ends and ends[0] * ends[1] < 0:
            root = _polish(test, grid[i], grid[i + 1])
            if root is not None:
                roots.append(root)
    return roots


def _refined(test: Test, grid: list[Real]) -> list[Real]:
    """The grid with more points beside each local minimum of the modulus."""
    sizes = [mp.inf if v is None else abs(v) for v in map(test, grid)]
    extra = []
    for i in range(1, len(grid) - 1):
        if sizes[i] < mp.inf and sizes[i - 1] >= sizes[i] <= sizes[i + 1]:
            for low, high in ((grid[i - 1], grid[i]), (grid[i], grid[i + 1])):
                extra += [low + (high - low) * j / REFINE for j in range(1, REFINE)]
    return sorted(grid + extra)


def _polish(test: Test, low: Real, high: Real) -> Real | None:
    """The root in a bracket by false position (Illinois); None at a pole, where values grow."""
    f_low, f_high = test(low), test(high)
    if None in (f_low, f_high) or f_low * f_high > 0:
        return None  # at working precision the sign does not change
    before = max(abs(f_low), abs(f_high))
    while True:
        middle = high - f_high * (high - low) / (f_high - f_low)
        value = test(middle)
        near = min(abs(middle - low), abs(high - middle)) < mp.mpf(10) ** (8 - mp.dps)
        if near or value == 0:
            return middle if abs(value) < before * mp.mpf("1e-9") else None
        if value * f_high < 0:
            low, f_low = high, f_high
        else:
            f_low /= 2
        high, f_high = middle, value


def _point(kind: str, damper: Damper, sign: int) -> Point | None:
    nearby = orbit(damper, sign)
    if nearby is None and kind == "SN":  # rounding put the fold on the far side
        nearby = _beside_fold(damper, sign)
    if nearby is None:
        return None
    nu = half_multipliers(nearby)
    critical = min(nu, key=lambda v: abs(abs(v) - 1) + (v.imag < 0))
    if kind == "NS" and abs(critical.imag) < mp.mpf(10) ** -20:
        return None
    growth = _growth(damper, sign, critical) if kind == "NS" else None
    side = _stable_side(damper, sign)
    return Point(kind, damper.omega, sign, nu, critical, inadmissible(nearby), side, growth)


def _growth(damper: Damper, sign: int, critical: Real) -> Real:
    """d|nu|/d omega by a central difference; its error, of the order 1e-36, is below use."""
    sizes = []
    for shift in (mp.mpf(10) ** -18, -(mp.mpf(10) ** -18)):
        o = orbit(at_omega(damper, damper.omega + shift), sign)
        assert o is not None
        sizes.append(abs(min(half_multipliers(o), key=lambda v: abs(v - critical))))
    return (sizes[0] - sizes[1]) / (2 * mp.mpf(10) ** -18)


def _beside_fold(damper: Damper, sign: int) -> Orbit | None:
    shift = mp.mpf(10) ** (15 - mp.dps)
    sides = (orbit(at_omega(damper, damper.omega * (1 + e)), sign) for e in (shift, -shift))
    return next((o for o in sides if o is not None), None)


def _stable_side(damper: Damper, sign: int) -> str:
    stable = []
    for name, shift in (("below", -mp.mpf(SIDE)), ("above", mp.mpf(SIDE))):
        o = orbit(at_omega(damper, damper.omega + shift), sign)
        if o is not None and abs(half_multipliers(o)[0]) < 1:
            stable.append(name)
    return {0: "neither", 1: "".join(stable), 2: "both"}[len(stable)]
