"""Contact of a curve of bifurcations with the curve on which its orbits touch a stop.

Method      Flight times are unknowns, so that orbits with an impact of speed s >= 0 and their continuation s < 0, which
            is no motion, form a smooth surface F(z, a) = 0, as do orbits without the impact by their gap. Both curves
            are smooth on it and cross. What they do in the plane of a depends on F_z, the derivative of the projection:
            regular   they cross in the plane too                                                (1)
            singular  with null vectors F_z v = 0, W' F_z = 0 and W' F_a tau = 0 both have the direction tau. At
                      a = a* + tau t + e n, a curve z = z* + (q + x v) t has
                          n = n_SN(t) - (x - x_SN)^2 t^2 W' F_zz v v / (2 W' F_a e)              (2)
                      with x_SN that of the fold: they are tangent and part as t^2, the gap or the speed on the other
                      curve grows as t: as the square root of the distance from the touch.
            Admissible are the points of the curve on the side of t on which the gap or the speed is positive. Orbits
            lie on the side of n on which theirs is: in (1) on the same one for all t, in (2) it changes with t.  (3)
            The orbits with one impact more or fewer are those of branches/switch.py; their F_z is regular unless they
            are critical too. Of a single impact they are the forced motion y without impacts: with H the flight over
            its period T and M its mirror image, (H_y - M) dy + H_a da + H_t dT = 0. H is the flight with the impact at
            its end, from which the impulse is taken: dH = dA + (1 + R) M^-1 r (r M^-1 r)^-1 d(rate).  (4)
            With one degree of freedom one closing rate s makes all multipliers infinite or zero; where its factor
            vanishes det L(mu) does so at every mu: SN and PD both meet the touch there.          (5)
Assumes     nothing of this is degenerate: two curves have single tangents, and the coefficients are not zero
Accuracy    that of the point; derivatives are exact
Fails       ``Refusal`` with a sentence
Reference   theory.md, "Two parameters"; di Bernardo, Budd, Champneys, Kowalczyk, Piecewise-smooth Dynamical Systems
            (2008), chapters 6 and 7; Foale, Phil. Trans. R. Soc. A 347 (1994) 353
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np

from vibroimpact._core.types import AnyComplexes, AnyFloat, Complexes, Count, Floats
from vibroimpact.bifurcations.augmented import Augmented
from vibroimpact.bifurcations.conditions import (
    ClosingRate,
    Condition,
    CriticalMultiplier,
    Graze,
    critical_pair,
)
from vibroimpact.bifurcations.equations import Pair
from vibroimpact.bifurcations.of_orbits import OrbitPlane
from vibroimpact.bifurcations.tests_along import nothing, on_multipliers
from vibroimpact.branches.beginning import single_tangent, with_touch, without_impact
from vibroimpact.branches.kinds import GR, ONE, PD, SN, ZERO
from vibroimpact.branches.point import BifurcationPoint
from vibroimpact.branches.verify import CRITICAL_DISTANCE as AT_CRITICAL
from vibroimpact.continuation.newton import equilibrated
from vibroimpact.model.mechanism import accelerations
from vibroimpact.normal_forms.critical import Refusal, Status
from vibroimpact.normal_forms.kind import PointKind
from vibroimpact.normal_forms.special_points import NewCurve
from vibroimpact.orbits.admissibility import Nearest
from vibroimpact.orbits.newton import scale_of
from vibroimpact.orbits.orbit import Orbit
from vibroimpact.orbits.problem import OrbitProblem

# This is the least singular value over the largest, equilibrated: points are known to 1e-10.
SINGULAR_RELATIVE = 1e-6
# A curve along which one parameter changes by less, relative to both and in the ranges, is parallel
# to an axis.
PARALLEL_TO_AXIS = 1e-9
# It steps so far, in ranges of the parameters, from a point where multipliers are not determined.
STEP_OF_RANGES = 1e-3


@dataclass(frozen=True, eq=False)
class GrazingContact:
    """Contact of a curve of bifurcations with the curve on which its orbit touches a stop.

    Attributes
    ----------
    kind
        Label of the touch: a flight touches a stop, or an impact has become a touch.
    curve_kind
        Kind of the curve of bifurcations.
    along, across
        The parameter p along which both curves are compared, and the other one, q.
    at
        Value of p at the point.
    order
        1 where the curves cross, 2 where they are tangent.
    coefficient
        q on the curve of the touch minus q on the curve of bifurcations at the same p is, to leading order,
        ``coefficient * (p - at) ** order``.
    admissible_side
        +1 where the curve of bifurcations consists of motions for p > at, -1 for p < at; the other half is no motion.
    own_sides
        For p < at and for p > at: the side of the curve of the touch, +1 for larger q, on which the orbits of the curve
        are motions.
    other_sides
        Those sides for the orbits with one impact more (GR) or fewer (ZERO); 0 where they are not decided.
    impacts
        Number of impacts of both.
    switchable
        The curves that :func:`~vibroimpact.switch_curve` follows.
    why_not
        Why the orbits with one impact more or fewer have no curve of this kind there; empty where they have.
    multipliers
        Of the orbit: one is infinite at ZERO, and all are NaN where the closing rate leaves them undetermined.

    Notes
    -----
    Motions are meant as far as this touch decides: other stops are not looked at.
    """

    kind: str
    curve_kind: str
    along: str
    across: str
    at: float
    order: Count
    coefficient: AnyFloat
    admissible_side: int
    own_sides: tuple[int, int] = field(repr=False)
    other_sides: tuple[int, int] = field(repr=False)
    impacts: tuple[int, int] = field(repr=False)
    switchable: tuple[NewCurve, ...] = field(repr=False)
    why_not: str = field(repr=False)
    multipliers: AnyComplexes = field(repr=False)

    @property
    def numbers(self) -> dict[str, Any]:
        """Quantities that say how the curves meet, by name."""
        names = ("curve_kind", "along", "across", "at", "order", "coefficient", "admissible_side")
        return {name: getattr(self, name) for name in names}

    @property
    def meaning(self) -> str:
        """Sentences: how the curves meet, and which orbits are on which side."""
        how = "is tangent to" if self.order == 2 else "crosses"
        half = "above" if self.admissible_side > 0 else "below"
        touch = "the impact is a touch" if self.kind == ZERO.label else "a stop is touched"
        first = (
            f"the curve of {self.curve_kind} {how} the curve of {self.kind}, on which {touch}, and consists "
            f"of motions for {self.along} {half} {self.at:.6g}"
        )
        own, other = self.impacts
        sides = [
            f"for {self.along} {word} {self.at:.6g} {self._sides(k)}"
            for k, word in enumerate(("below", "above"))
        ]
        return f"{first}; orbits with {own} and with {other} impacts: {', '.join(sides)}"

    def _sides(self, k: int) -> str:
        """The two kinds of orbits next to the curve of the touch."""
        words = {1: f"larger {self.across}", -1: f"smaller {self.across}"}
        own, other = self.own_sides[k], self.other_sides[k]
        if not own or not other:
            known = f"the former at {words[own]}" if own else "not decided"
            return f"{known}, the latter not decided" if own else known
        if own == other:
            return f"both at {words[own]}, where they meet in a non-smooth fold"
        return f"the former at {words[own]}, the latter on the other side: one becomes the other"


class _At(NamedTuple):
    """Orbits with one signature next to the touch: how far they are from it is ``row . (dz, da)``."""

    plane: OrbitPlane
    z: Floats
    a: Pair
    row: Floats  # (d + 2,) of the gap or of the closing speed


class Touching(NamedTuple):
    """The orbit at a special point of a curve."""

    kind: PointKind
    curve: PointKind
    orbit: Orbit
    plane: OrbitPlane
    z: Floats
    a: Pair
    tangent: Floats  # of the curve, as its problem has it
    widths: tuple[float, float]
    nearest: Nearest | None
    segment: int


def touching(point: BifurcationPoint) -> Touching:
    """Quantities from which the contact of the two curves at a touch is computed."""
    plane, curve = point.problem.equations, point.curve
    assert isinstance(plane, OrbitPlane)
    assert curve is not None
    z, _, a = point.problem.parts(point.z, point.parameter)
    (low, high), (second_low, second_high) = point.bounds
    return Touching(
        point.record, curve, point.orbit, plane, z, a, point.tangent,
        (high - low, second_high - second_low), point.nearest, point.segment,
    )  # fmt: skip


def touch_condition(
    plane: OrbitPlane, kind: PointKind, nearest: Nearest | None, segment: int
) -> Condition:
    """Condition of the curve of a touch."""
    if kind == GR:
        assert nearest is not None
        return Graze(plane, nearest)
    return ClosingRate(plane, segment)


def grazing_contact(_kind: PointKind, at: BifurcationPoint) -> GrazingContact | Refusal:
    """Compute how the curve of a special point at a touch meets the curve of the touch."""
    return _contact(touching(at))


def critical_contact(kind: PointKind, at: BifurcationPoint) -> GrazingContact | Refusal:
    """Compute how the curve of a touch meets that of the multipliers that are critical at a point of it."""
    point = touching(at)
    crossed, touched = ONE[kind.label], point.curve
    condition, _ = on_multipliers(crossed, point.plane)
    rates = _rates(point.plane, condition, point.z, point.a)
    point = point._replace(kind=touched, curve=crossed)
    if rates is None:
        mu = point.plane.multipliers(point.z, point.a)
        return _refused(point, f"the curve of {crossed.label} has no single tangent there", mu)
    return _contact(point._replace(tangent=rates))


def _contact(point: Touching) -> GrazingContact | Refusal:
    plane, z, a = point.plane, point.z, point.a
    mu = plane.multipliers(z, a)
    if plane.signature.flights:
        return _refused(
            point, "the contact of curves at a touch is known for rigid stops alone", mu
        )
    touch = touch_condition(plane, point.kind, point.nearest, point.segment)
    of_touch = _rates(plane, touch, z, a)
    own = np.concatenate([point.tangent[: len(z)], point.tangent[-2:]])
    if of_touch is None:
        return _refused(point, "the curve of the touch has no single tangent there", mu)
    common = np.minimum(
        *(np.abs(r[-2:] / np.linalg.norm(r[-2:] / point.widths)) for r in (own, of_touch))
    )
    along = int(np.argmax(common / point.widths))
    if not common[along] / point.widths[along] > PARALLEL_TO_AXIS:
        return _refused(point, "each curve is parallel to an axis; combine the parameters", mu)
    own, of_touch = own / own[len(z) + along], of_touch / of_touch[len(z) + along]
    here = _At(plane, z, a, opening(plane, z, a, point.kind, point.nearest, point.segment))
    meeting = _crossing if _is_regular(plane, z, a) else _tangency
    found = meeting(here, own, of_touch, along)
    if isinstance(found, str):
        return _refused(point, found, mu)
    order, coefficient, own_sides = found
    other = neighbour(point)
    sides, count, why, more = _beyond(point, other, along)
    names = plane.names
    return GrazingContact(
        kind=point.kind.label, curve_kind=point.curve.label, along=names[along], across=names[1 - along],
        at=a[along], order=order, coefficient=coefficient, admissible_side=_sign(float(here.row @ own)),
        own_sides=own_sides, other_sides=sides, impacts=(len(point.orbit.signature.impacts), count),
        switchable=(NewCurve(point.kind.label, 1), *_same_orbits(point), *more), why_not=why, multipliers=mu,
    )  # fmt: skip


def _refused(point: Touching, why: str, mu: Complexes) -> Refusal:
    label = point.kind.label
    return Refusal(label, Status.DEGENERATE, f"{label}: {why}", mu)


def _sign(x: float) -> int:
    return int(np.sign(x)) if math.isfinite(x) else 0


def _rates(plane: OrbitPlane, condition: Condition, z: Floats, a: Pair) -> Floats | None:
    """Changes of z and a along the curve of a condition; None where it has no single tangent."""
    problem = Augmented(plane, condition, nothing, ((0.0, 1.0), (0.0, 1.0)))
    condition.value(z, w := condition.start(z, a), a)
    tangent = single_tangent(problem, problem.packed(z, w, a), a[1])
    return None if tangent is None else np.concatenate([tangent[: len(z)], tangent[-2:]])


def opening(
    plane: OrbitPlane, z: Floats, a: Pair, kind: PointKind, nearest: Nearest | None, segment: int
) -> Floats:
    """Derivatives of the gap at a touch, or of the speed of an impact."""
    if kind == ZERO:
        return plane.impacts[segment].side * ClosingRate(plane, segment).gradient(z, a)
    assert nearest is not None
    graze = Graze(plane, nearest)
    parts = graze.derivatives(z, graze.start(z, a), a)
    return -nearest.side * np.concatenate([parts.by_z[0], parts.by_a[0]])


def _least(plane: OrbitPlane, z: Floats, a: Pair, multiplier: float) -> float:
    """Least singular value of L(multiplier), relative to the largest."""
    matrix = CriticalMultiplier(plane, multiplier).matrix(z, a, multiplier)
    if not np.all(np.isfinite(matrix)):
        return math.nan
    values = np.linalg.svd(equilibrated(matrix)[0], compute_uv=False)
    return float(values[-1] / values[0])


def _is_regular(plane: OrbitPlane, z: Floats, a: Pair) -> bool:
    """Whether F_z is regular."""
    return not _least(plane, z, a, 1.0) <= SINGULAR_RELATIVE


def beside(point: Touching, condition: Condition) -> tuple[Floats, Pair]:
    """Guess of a solution on a curve through the point, a small step from it, where the orbits are motions.

    At the point itself the multipliers are not all determined (5).
    """
    z, a = point.z, point.a
    rates = _rates(point.plane, condition, z, a)
    if rates is None:
        return z, a
    row = opening(point.plane, z, a, point.kind, point.nearest, point.segment)
    rates = (
        rates
        * (STEP_OF_RANGES / float(np.max(np.abs(rates[-2:]) / point.widths)))
        * _sign(float(row @ rates))
    )
    return z + rates[: len(z)], (a[0] + float(rates[-2]), a[1] + float(rates[-1]))


# ---- (1), (2), (3) -------------------------------------------------------------------------------

Meeting = tuple[int, float, tuple[int, int]]  # order, coefficient, sides


def _crossing(here: _At, own: Floats, of_touch: Floats, along: int) -> Meeting | str:
    """Curves that cross (1)."""
    across = len(here.z) + 1 - along
    side = _side(here, along)
    return 1, float(of_touch[across] - own[across]), (side, side)


def _side(here: _At, along: int) -> int:
    """Side (3) of the curve of the touch on which the orbits of a regular surface are motions."""
    by_z, by_a = here.plane.by_both(here.z, here.a)
    across = 1 - along
    moved = np.linalg.solve(by_z, -by_a[:, across])
    return _sign(float(here.row[: len(here.z)] @ moved + here.row[len(here.z) + across]))


def _tangency(here: _At, own: Floats, of_touch: Floats, along: int) -> Meeting | str:
    """Curves that are tangent (2)."""
    plane, z, a, row = here
    d, sizes = len(z), plane.sizes
    fold = CriticalMultiplier(plane, 1.0)
    of_fold = _rates(plane, fold, z, a)
    if of_fold is None:
        return "the curve of SN has no single tangent there"
    of_fold = of_fold / of_fold[d + along]
    left, _, right = np.linalg.svd(fold.matrix(z, a, 1.0))
    v, w = right[-1], left[:, -1] / plane.rows
    by_a = plane.by_both(z, a)[1]
    curvature = float(w @ plane.second(z, a, (v * sizes)[None])[0, :, :d] @ (v * sizes))
    opened = -curvature / (2.0 * float(w @ by_a[:, 1 - along]))
    touch, curve = (float((r - of_fold)[:d] / sizes @ v) for r in (of_touch, own))
    rate = float(row[:d] @ (v * sizes))
    rising = _sign(opened * touch * rate)  # of t: n - n_touch per change of row
    return 2, opened * (touch**2 - curve**2), (-rising, rising)


# ---- orbits with one impact more or fewer --------------------------------------------------------


def neighbour(point: Touching) -> _At | None:
    """Orbits with one impact more or fewer; None if they have none left."""
    kind, nearest, segment = ZERO, point.nearest, -1
    if point.kind == GR:
        assert nearest is not None
        signature, guess = with_touch(point.orbit, nearest)
        segment = nearest.segment
    else:
        found = without_impact(point.orbit, point.segment)
        if found is None or found[0].eventless:
            return None
        signature, guess, nearest = found
        kind = GR
    system = point.orbit.system
    problem = OrbitProblem(system, signature, "")
    z = problem.packed(guess.states, guess.durations)
    plane = OrbitPlane(
        system, signature, point.plane.names, scale_of(problem, z), point.plane.events
    )
    return _At(plane, z, point.a, opening(plane, z, point.a, kind, nearest, segment))


def _beyond(
    point: Touching, other: _At | None, along: int
) -> tuple[tuple[int, int], int, str, tuple[NewCurve, ...]]:
    """Sides of the other orbits, their number of impacts, why they are not critical, or their curve."""
    if other is None:
        side = 0
        if point.plane.turn.any():
            side = _sign(free_gap_rate(point.plane, point.z, point.a, 1 - along))
        why = f"without its only impact the motion is the linear forced one, which has no {point.curve.label}"
        return (side, side), 0, why, ()
    count, side = len(other.plane.signature.impacts), 0
    if _is_regular(other.plane, other.z, other.a):
        side = _side(other, along)
    if not point.curve.critical:
        return (side, side), count, "", ()
    mu = other.plane.multipliers(other.z, other.a)
    if _are_critical(point.curve, mu):
        return (side, side), count, "", (NewCurve(point.curve.label, 1),)
    listed = ", ".join(f"{m:.6g}" if abs(m) < 1.0 / SINGULAR_RELATIVE else "infinite" for m in mu)
    why = f"orbits with {count} impacts have no {point.curve.label} there: their multipliers are {listed}"
    return (side, side), count, why, ()


def _are_critical(kind: PointKind, mu: Complexes) -> bool:
    """Whether multipliers are those of a kind, or undetermined (5)."""
    if np.all(np.isnan(mu)):
        return True
    (critical,) = kind.critical
    if critical is None:
        i, j = critical_pair(mu)
        return bool(abs(mu[i] * mu[j] - 1.0) <= AT_CRITICAL)
    return bool(np.nanmin(np.abs(mu - critical)) <= AT_CRITICAL)


def _same_orbits(point: Touching) -> tuple[NewCurve, ...]:
    """The other one of SN and PD (5), else on PD the touch of the doubled orbits, if the doubling moves it."""
    if point.kind == ZERO and point.curve.critical not in ((), (None,)):
        least = [_least(point.plane, point.z, point.a, mu) for mu in (1.0, -1.0)]
        if max(least) <= SINGULAR_RELATIVE:
            partner = PD if point.curve == SN else SN
            return (NewCurve(partner.label, 1),)
    if point.curve.critical != (-1.0,):
        return ()
    doubling = CriticalMultiplier(point.plane, -1.0).start(point.z, point.a)
    row = opening(point.plane, point.z, point.a, point.kind, point.nearest, point.segment)
    scaled = row[: len(doubling)] * point.plane.sizes
    felt = abs(float(scaled @ doubling)) > SINGULAR_RELATIVE * float(np.linalg.norm(scaled))
    return (NewCurve(point.kind.label, 2),) if felt else ()


def free_gap_rate(plane: OrbitPlane, z: Floats, a: Pair, across: int) -> float:
    """Derivative (4) of the gap of the forced motion without impacts by one of the parameters.

    It is the orbit of a plane whose only impact is a touch.
    """
    n = plane.mechanism.degrees
    compiled = plane.compiled(a) if across == 0 else plane.by_second(a)
    states, durations = plane.unpacked(z)
    impacts = list(plane.impacts)
    parts = compiled.linearise(states, durations, impacts)
    in_time = np.zeros((1, 2 * n + 2))
    in_time[0, -1] = 1.0
    rate_by = compiled.second(states, durations, impacts, in_time)[1][0]
    m, stop = compiled.mechanism, impacts[0]
    row = np.array(m.rigid_stops[stop.contact].row)
    lift = accelerations(m, row)
    flight = parts.after_by[0, : 2 * n].copy()
    kick = (1.0 + stop.restitution(m.rigid_stops)) * lift / (row @ lift)
    flight[n:] += np.outer(kick, rate_by)
    later = -durations[0] * float(compiled.omega_orders[1]) / compiled.omega  # dT / da
    forced = flight[:, -1] + flight[:, -2] * later
    own, gap = plane.kept[:-1], parts.gap_by[0]  # but for the phase
    moved = np.linalg.solve(
        flight[own][:, own] - plane.reflected(np.eye(plane.size))[:-1, :-1], -forced[own]
    )
    return -stop.side * float(gap[own] @ moved + gap[-2] * later + gap[-1])
