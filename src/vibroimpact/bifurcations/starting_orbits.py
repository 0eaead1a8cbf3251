"""Orbits near a point of codimension two from which the curves start that begin there.

Method      at a distance s that is measured by the multipliers (R4, R3) or by the size of the orbit in units of its
            unknowns, whatever the units of the parameters:
            R4             the fold next to the orbits of period four of the normal form for |log(nu / i)| = s, inside
                           the half-lines of their folds                                                     (1)
            R3             the saddle of period three next to that of the normal form for log(nu / nu_0) = +-i s:
                           mu zeta = -b conj(nu) conj(zeta)^2                                                (2)
            R2, LPPD,      the doubled orbit of amplitude s along the eigenvector v of -1 where it has SN or NS:
            PDNS, GPD      Newton's method for F = 0, the condition G = 0 and <v, z - z_0> = s, from s v at the
                           parameters of the point, which differ by O(s^2)                                   (3)
                           It is regular but for factors s: the doubling itself determines one parameter, the
                           condition the other one
            GR, ZERO       on PD: as (3) for the touch of the turn that comes nearer, from s v moved along PD so that
                           its gap vanishes to first order                                                   (4)
            The unknowns of (2), (3) and (4) are corrected at a constant distance from the point.
Assumes     what the normal form assumes
Accuracy    solutions to SETTLED_OF_DISTANCE of the distance
Fails       gives nothing, or ``LinAlgError``
Reference   Kuznetsov, Elements of Applied Bifurcation Theory, sections 9.3, 9.5 and 9.6
"""

from __future__ import annotations

import cmath
import math
from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from vibroimpact._core.types import Complexes, Floats
from vibroimpact.bifurcations.augmented import Augmented, Both, is_inside
from vibroimpact.bifurcations.conditions import Condition, CriticalMultiplier
from vibroimpact.bifurcations.equations import Solution
from vibroimpact.bifurcations.grazing_contact import opening, touch_condition, touching
from vibroimpact.bifurcations.of_orbits import OrbitPlane
from vibroimpact.bifurcations.tests_along import nothing, on_multipliers
from vibroimpact.bifurcations.unfold import Centre, centre
from vibroimpact.branches.kinds import NS, ONE, SN
from vibroimpact.branches.point import BifurcationPoint
from vibroimpact.continuation.newton import equilibrated
from vibroimpact.normal_forms.kind import PointKind
from vibroimpact.normal_forms.strong_resonance import CUBE_ROOT, fold_directions, period_four

# This is the share of the angle between a half-line of folds and the middle of its sector.
INSIDE_OF_ANGLE = 0.1
NEWTON_ITERATIONS = 12  # Newton's method takes so many iterations at most
SETTLED_OF_DISTANCE = 1e-4  # its last step is so small, relative to the distance


class Born(NamedTuple):
    """Start of a curve that begins at a point: an orbit near it, for a touch with its condition."""

    solution: Solution
    condition: Condition | None = None


def solution_at(point: BifurcationPoint) -> Solution:
    """The orbit at a point of codimension two."""
    z, _, a = point.problem.parts(point.z, point.parameter)
    return Solution(point.problem.equations, z, a)


def run_through(origin: Solution, z: Floats) -> Floats:
    """Unknowns of the orbit at a point run through as often as those of an orbit of a multiple period."""
    times = len(z) // len(origin.z)
    return origin.equations.unrolled(origin.z, np.zeros((times, len(origin.z))))


def folds_of_four(
    point: BifurcationPoint, which: int, bounds: Both, distance: float
) -> Iterator[Born]:
    """Folds (1) on one of the two half-lines."""
    form = point.normal_form
    manifold, edges = centre(*solution_at(point), 1j), fold_directions(form)
    turn = cmath.phase(edges[1 - which] / edges[which])
    mu = distance * edges[which] * cmath.exp(1j * INSIDE_OF_ANGLE * turn / 2.0)
    da = manifold.offset(mu)
    if not is_inside(manifold.at(da), bounds):
        return
    for zeta in period_four(form, mu)[::4]:
        points = np.asarray(zeta * 1j ** np.arange(4), dtype=np.complex128)
        yield from _corrected_from(manifold, points, da, SN)


def saddles_of_three(
    point: BifurcationPoint, _which: int, bounds: Both, distance: float
) -> Iterator[Born]:
    """Saddles (2) of period three next to the tangent of the curve of NS, on both sides."""
    form = point.normal_form
    manifold = centre(*solution_at(point), CUBE_ROOT)
    for mu in (1j * distance, -1j * distance):
        da = manifold.offset(mu)
        if not is_inside(manifold.at(da), bounds):
            continue
        push = -form.b / manifold.nu / mu  # zeta = push conj(zeta)^2
        zeta = cmath.rect(1.0 / abs(push), cmath.phase(push) / 3.0)
        points = np.asarray(zeta * manifold.nu ** np.arange(3), dtype=np.complex128)
        yield from _corrected_from(manifold, points, da, NS)


def _corrected_from(
    manifold: Centre, points: Complexes, da: Floats, kind: PointKind
) -> Iterator[Born]:
    """The bifurcation next to an orbit of the normal form, at constant distance."""
    origin = Solution(manifold.equations, manifold.z, manifold.a)
    equations = manifold.equations.repeated(len(points))
    start = manifold.equations.unrolled(manifold.z, manifold.moved(points, da))
    near = Solution(equations, start, manifold.at(da))
    yield from _corrected(origin, near, on_multipliers(kind, equations)[0])


def doubled_orbit(
    point: BifurcationPoint, which: int, _bounds: Both, amplitude: float
) -> Iterator[Born]:
    """The doubled orbit (3)."""
    kind = ONE[point.normal_form.switchable[which].kind]
    origin = solution_at(point)
    start = _doubled(origin, amplitude)
    yield from _corrected(origin, start, on_multipliers(kind, start.equations)[0])


def doubled_touch(point: BifurcationPoint, amplitude: float) -> Iterator[Born]:
    """The doubled orbit (4) that touches in its first turn, and not in the second one."""
    here, origin = touching(point), solution_at(point)
    d = len(here.z)
    row = opening(here.plane, here.z, here.a, here.kind, here.nearest, here.segment)
    of_flips = np.concatenate([here.tangent[:d], here.tangent[-2:]])
    opened = float(row[:d] @ _eigenvector(origin))
    signed = -math.copysign(amplitude, opened)
    start = _doubled(origin, signed, -signed * opened / float(row @ of_flips) * of_flips)
    assert isinstance(start.equations, OrbitPlane)
    touch = touch_condition(start.equations, here.kind, here.nearest, here.segment)
    for born in _corrected(origin, start, touch):
        yield Born(born.solution, touch)


def _eigenvector(origin: Solution) -> Floats:
    """Eigenvector of -1, of size one."""
    equations, z, a = origin
    v = CriticalMultiplier(equations, -1.0).start(z, a)
    unit: Floats = v / np.abs(v).max() * equations.sizes
    return unit


def _doubled(origin: Solution, amplitude: float, along: Floats | None = None) -> Solution:
    """The doubled orbit of an amplitude to first order, where unknowns and parameters are moved along PD."""
    equations, z, a = origin
    moved = np.zeros(len(z) + 2) if along is None else along
    changes = np.outer([amplitude, -amplitude], _eigenvector(origin)) + moved[:-2]
    there = a[0] + float(moved[-2]), a[1] + float(moved[-1])
    return Solution(equations.repeated(2), equations.unrolled(z, changes), there)


def _corrected(origin: Solution, start: Solution, condition: Condition) -> Iterator[Born]:
    """The solution that satisfies a condition at a constant distance, if Newton's method finds it."""
    equations, z, a = start
    problem = Augmented(equations, condition, nothing, ((0.0, 1.0), (0.0, 1.0)))
    at = np.append(problem.packed(z, condition.start(z, a), a), a[1])
    d, sizes = len(z), problem.scale()
    away = (z - run_through(origin, z)) / sizes[:d]
    row = np.append(away, np.zeros(len(at) - d))
    for _ in range(NEWTON_ITERATIONS):
        by = np.column_stack(problem.jacobian(at[:-1], float(at[-1])))
        if not np.all(np.isfinite(by)):
            return
        rows, lengths = equilibrated(by * sizes)
        missing = -problem.residual(at[:-1], float(at[-1])) / lengths
        step = np.linalg.solve(np.vstack([rows, row]), np.append(missing, 0.0))
        at = at + step * sizes
        if np.abs(step[:d]).max() <= SETTLED_OF_DISTANCE * np.abs(away).max():
            z, _, a = problem.parts(at[:-1], float(at[-1]))
            yield Born(Solution(equations, z, a))
            return
