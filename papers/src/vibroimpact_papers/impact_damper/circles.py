"""Invariant circles next to the Neimark-Sacker points, measured by simulation of the damper.

Method      Iterates of the half map: the states x after the impacts at stop A, and those at stop B
            mirrored. Of each, z on the centre manifold x = x0 + X(z) of the normal form solves
                z = <p, x - x0 - x_p dp - Re(h20 z^2) - h11 |z|^2>                          (1)
            by repetition. Weighted Birkhoff averages over the circle:
                radius <|z|>,  turn <arg(z'/z)>                                             (2)
            and from the extremes the half-width in each coordinate.
            Deviations of |z| from a circle change by e in
                T = 1 / (2 |Re(kappa) dp|) iterates.                                        (3)
            Circle that attracts: start on the prediction, and apart from that from the fixed point
            with its phase disturbed; wait a multiple of T.
            Circle that repels: on the half line z > 0 of the centre manifold the start is bisected
            between one that falls towards the fixed point and one that grows; a start that does
            neither stays for some T next to the circle, and is measured there.             (4)
Assumes     impacts at A and B in turn: others are reported
Accuracy    (1) leaves out third-order terms; except for the resonant one, which the normal form
            keeps, their mean over a circle is of fifth order, as the error of the predicted radius
            is. Deviations of the start decay by exp(-n) in n T; in (4) BISECTED grows to
            BISECTED exp(n)
Fails       a status in words: the motion does not alternate between the stops, or no circle lies
            within the bracket of (4); radius and turn are then nan
Reference   section 4 of the founding paper states the circle; (2): [das2017]
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import ArrayLike

from vibroimpact._core.types import Complexes, Floats
from vibroimpact.attractors.rotation import weighted_average
from vibroimpact.machines.impact_damper import ImpactDamper
from vibroimpact.model.state import State
from vibroimpact.normal_forms import NeimarkSacker
from vibroimpact.simulation.simulate import RunEnd
from vibroimpact.simulation.simulator import Simulator
from vibroimpact_papers.impact_damper.normal_forms import CriticalPoint
from vibroimpact_papers.impact_damper.plan import Plan
from vibroimpact_papers.impact_damper.symmetric_bifurcations import nus_of, orbits_by_sign

LARGEST = 0.1
"""Largest predicted radius, as a share of the radius at which a term that the normal form removes
is as large as z: the prediction holds far below that."""

DISTURBED = 0.1  # disturbance of the fixed point's phase, relative to the predicted half-width
FROM_INSIDE = 11.0
"""Waiting, in T, of a start at a tenth of the circle, before its deviation is that of a start on
the prediction: ln(99 / 2) to reach the circle, 7 more to fall below 1e-3."""

BRACKET = (0.75, 1.3)  # starts of (4), in predicted radii
LEFT = (0.7, 1.4)  # |z| in predicted radii at which a motion has fallen or grown
BISECTED = 1e-6  # width of the last bracket, in predicted radii
MOST_WAITS = 60  # in T: exp(-60) is far below rounding, so a motion that stays so long is on it
REPETITIONS = 100  # of (1) at most, a contraction by |h| |z|
ROUNDING = 4.0 * float(np.finfo(float).eps)  # relative change at which (1) has converged
ALTERNATE = "circle"
LOST = "the impacts are not at A and B in turn"
NO_BRACKET = "no circle between the ends of the bracket"


@dataclass(frozen=True)
class Circle:
    """Simulated invariant circle of the half map.

    Attributes
    ----------
    start
        "prediction", "fixed point" or "bisection".
    dp
        omega - omega_c.
    radius, turn
        (2); turn in radians per half iterate. nan if there is no circle.
    half_width
        In (x1, v1, v2, theta), shape (4,).
    off
        Largest distance of a point from the second-order centre manifold.
    impacts
        Number of impacts simulated before the points were taken.
    points
        States minus the critical one, shape (n_point, 4).
    status
        "circle", or the reason of the failure.
    """

    start: str
    dp: float
    radius: float
    turn: float
    half_width: Floats = field(repr=False)
    off: float
    impacts: int
    points: Floats = field(repr=False)
    status: str


@dataclass(frozen=True)
class Measured:
    """Circles of one critical point.

    Attributes
    ----------
    point
        The critical point.
    circles
        By start and distance; the distances of each start fall.
    other_side
        |z| after some T over |z| at the start, on the side without a circle, at the largest
        distance: below 1 where the fixed point attracts.
    """

    point: CriticalPoint
    circles: tuple[Circle, ...]
    other_side: float

    @property
    def main(self) -> tuple[Circle, ...]:
        """Return the circles measured at every distance."""
        return tuple(c for c in self.circles if c.start != "fixed point")

    @property
    def independent(self) -> tuple[Circle, ...]:
        """Return the circles reached from the disturbed fixed point."""
        return tuple(c for c in self.circles if c.start == "fixed point")

    @property
    def errors(self) -> Floats:
        """Relative errors of the predicted radius, |measured / predicted - 1|."""
        form = self.point.form
        return np.array([abs(c.radius / form.radius(c.dp) - 1.0) for c in self.main])

    @property
    def order(self) -> float:
        """Power of |dp| with which the relative error of the radius falls."""
        return observed_order([c.dp for c in self.main], self.errors)

    @property
    def off_order(self) -> float:
        """Power of |dp| with which the distance from the second-order manifold falls."""
        return observed_order([c.dp for c in self.main], [c.off for c in self.main])

    @property
    def turn_order(self) -> float:
        """Power of the radius in turn - arg(nu(omega)), nu of the fixed point at each omega."""
        excess = [c.turn - _angle_at(self.point, c.dp) for c in self.main]
        return observed_order([c.radius for c in self.main], excess)


def observed_order(x: ArrayLike, y: ArrayLike) -> float:
    """Return the power of |x| as which |y| falls, from the last two: the smallest distances."""
    across, up = (np.diff(np.log(np.abs(np.asarray(values)[-2:]))) for values in (x, y))
    return float((up / across)[0])


def offsets(form: NeimarkSacker, count: int) -> list[float]:
    """Return omega - omega_c at which circles are measured: the largest, its half, and so on."""
    radius = LARGEST * form.resonant_radius
    largest = form.side * (radius / form.radius(float(form.side))) ** 2
    return [largest / 2.0**k for k in range(count)]


def measure(point: CriticalPoint, plan: Plan) -> Measured:
    """Measure the circle of a critical point at a geometric sequence of distances.

    Notes
    -----
    Cost with the full plan: 1e7 impacts where the circle repels or a strong resonance makes the
    distances small; else a hundredth of that.
    """
    distances = offsets(point.form, plan.circle_offsets)
    if point.form.attracting:
        circles = [_on_prediction(point, dp, plan) for dp in distances]
        circles += [_from_inside(point, dp, plan) for dp in distances]
    else:
        circles = [bisected(point, dp, plan) for dp in distances]
    return Measured(point, tuple(circles), _other_side(point, distances[0], plan))


# --- three ways to a circle -----------------------------------------------------------------------


def _on_prediction(point: CriticalPoint, dp: float, plan: Plan) -> Circle:
    motion = Simulator(_damper(point, dp), _state(point, dp, point.form.radius(dp)))
    return _settled("prediction", point, dp, motion, plan.circle_settle, plan)


def _from_inside(point: CriticalPoint, dp: float, plan: Plan) -> Circle:
    push = DISTURBED * float(point.form.amplitude(dp)[-1])
    damper = _damper(point, dp)
    orbit = orbits_by_sign(damper)[point.bifurcation.sign]
    motion = Simulator(damper, orbit.state.perturbed(push))
    return _settled("fixed point", point, dp, motion, FROM_INSIDE + plan.circle_settle, plan)


def bisected(point: CriticalPoint, dp: float, plan: Plan) -> Circle:
    """Return the circle that repels, found between a start that falls and one that grows (4)."""
    low, high = BRACKET
    impacts = 0
    ends = [leaves(point, dp, share)[0] for share in BRACKET]
    if ends != [-1, 1]:
        return _none("bisection", dp, impacts, NO_BRACKET)
    while high - low > BISECTED:
        middle = (low + high) / 2.0
        way, spent = leaves(point, dp, middle)
        impacts += spent
        low, high = (middle, high) if way < 0 else (low, middle)
    start = _state(point, dp, (low + high) / 2.0 * point.form.radius(dp))
    circle = _settled("bisection", point, dp, Simulator(_damper(point, dp), start), 1.0, plan)
    return replace(circle, impacts=impacts)


def leaves(point: CriticalPoint, dp: float, share: float) -> tuple[int, int]:
    """Return -1 (falls to the fixed point), +1 (grows) or 0, and the impacts that it took."""
    radius, wait = point.form.radius(dp), round(_waiting(point, dp))
    motion = Simulator(_damper(point, dp), _state(point, dp, share * radius))
    for waits in range(1, MOST_WAITS + 1):
        end = motion.settle(wait)
        x, status = iterates(point, motion, 1)
        size = abs(z_of(point.form, x, dp)[-1]) / radius if len(x) else math.inf
        if end is not RunEnd.IMPACTS or status != ALTERNATE or size > LEFT[1]:
            return 1, waits * wait
        if size < LEFT[0]:
            return -1, waits * wait
    return 0, MOST_WAITS * wait


def _other_side(point: CriticalPoint, dp: float, plan: Plan) -> float:
    """Growth of |z| on the side without a circle."""
    radius = point.form.radius(dp)
    motion = Simulator(_damper(point, -dp), _state(point, -dp, radius))
    motion.settle(round(plan.circle_settle * _waiting(point, dp)))
    x, status = iterates(point, motion, 1)
    lost = status != ALTERNATE or not len(x)
    return math.inf if lost else float(abs(z_of(point.form, x, -dp)[-1])) / radius


# --- measuring ------------------------------------------------------------------------------------


def _settled(
    start: str, point: CriticalPoint, dp: float, motion: Simulator, waits: float, plan: Plan
) -> Circle:
    """Wait, take points, and measure the circle."""
    impacts = round(waits * _waiting(point, dp))
    motion.settle(impacts)
    x, status = iterates(point, motion, plan.circle_points)
    if status != ALTERNATE:
        return _none(start, dp, impacts, status)
    z = z_of(point.form, x, dp)
    return Circle(
        start=start,
        dp=dp,
        radius=float(weighted_average(np.abs(z))),
        turn=float(weighted_average(np.angle(z[1:] / z[:-1]))),
        half_width=np.ptp(x, axis=0) / 2.0,
        off=float(np.max(np.linalg.norm(x - point.form.on_manifold(z, dp), axis=1))),
        impacts=impacts,
        points=x,
        status=ALTERNATE,
    )


def iterates(point: CriticalPoint, motion: Simulator, count: int) -> tuple[Floats, str]:
    """Return the next iterates of the half map minus the critical state, and the status."""
    part = motion.record(count)
    sign = np.where(part.side > 0, 1.0, -1.0)[:, None]
    phase = part.phase + np.where(part.side > 0, 0.0, math.pi)
    x = np.column_stack([part.position[:, :1] * sign, part.velocity * sign, phase]) - point.state
    x[:, 3] = np.remainder(x[:, 3] + math.pi, 2.0 * math.pi) - math.pi
    alternate = len(x) == count and bool(np.all(part.side[1:] == -part.side[:-1]))
    return x, ALTERNATE if alternate else LOST


def z_of(form: NeimarkSacker, x: Floats, dp: float) -> Complexes:
    """Return z of states minus the critical one, shape (n, 4), by (1)."""
    assert form.unfolding is not None
    bar = form.p.conj()
    linear: Complexes = np.sum((x - form.unfolding.drift * dp) * bar, axis=1)
    square, both, other = np.sum(np.array([form.h20 / 2.0, form.h11, form.h20.conj() / 2.0]) * bar,
                                 axis=1)  # fmt: skip
    z = linear
    for _ in range(REPETITIONS):
        last, z = z, linear - square * z**2 - both * np.abs(z) ** 2 - other * z.conj() ** 2
        if np.all(np.abs(z - last) <= ROUNDING * np.abs(z)):
            break
    return z


def _none(start: str, dp: float, impacts: int, status: str) -> Circle:
    nan = math.nan
    return Circle(start, dp, nan, nan, np.full(4, nan), nan, impacts, np.empty((0, 4)), status)


def _waiting(point: CriticalPoint, dp: float) -> float:
    """T of (3)."""
    return 1.0 / (2.0 * abs(point.form.kappa.real * dp))


def _damper(point: CriticalPoint, dp: float) -> ImpactDamper:
    return replace(point.bifurcation.damper, omega=point.omega + dp)


def _state(point: CriticalPoint, dp: float, z: float) -> State:
    """Return the state on stop A at z > 0 on the centre manifold."""
    x = point.state + point.form.on_manifold(np.array([z + 0j]), dp)[0]
    x1, v1, v2, phase = map(float, x)
    turn = 2.0 * math.pi
    return _damper(point, dp).on_stop("A", x1=x1, v1=v1, v2=v2, phase=phase % turn)


def _angle_at(point: CriticalPoint, dp: float) -> float:
    """Return arg(nu) of the fixed point at a distance, in (0, pi)."""
    nus = nus_of(orbits_by_sign(_damper(point, dp))[point.bifurcation.sign])
    upper = nus[nus.imag > 0.0]
    return float(np.angle(upper[np.argmin(np.abs(upper - point.form.multiplier))]))
