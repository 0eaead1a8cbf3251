"""All bifurcations of the symmetric 1-1-1 branch of the impact damper in a range of omega.

Method. With alpha sin theta + beta cos theta = delta (orbits/symmetric_damper.py), orbits exist where
r^2 = alpha^2 + beta^2 >= delta^2, and the folds are the zeros of r^2 - delta^2, an analytic
function of omega. Between folds both signs of (14) are one smooth curve once the square root is
removed:

    omega = middle - half cos(s)         (a fold at both ends),
    omega = fold +- s^2                  (one fold),     omega = s  (none),

where cos(theta + lead) = +-sqrt(1 - delta^2 / r^2) changes sign with s. Along s the test functions

    symmetry breaking  w det(DH + I),     Neimark-Sacker  w^3 prod_{i<j} (1 - nu_i nu_j)

are analytic: w is the closing speed, which removes the pole of the saltation matrix (a rank-one
term, so at most of order one in the determinant and three in the product of pairs). Each is
expanded in Chebyshev polynomials, on an interval that is halved until the series on each piece has
fallen to rounding; all zeros of every piece are then found at once, so that two bifurcations within
any step are both found. What is assumed: the functions are analytic on the interval, as they are
for zeta > 0 and wherever w does not vanish identically, and no zero hides below 1e-10 of a
function's size. Zeros are then polished on the test function itself to rounding.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from fractions import Fraction

import numpy as np
from numpy.polynomial import chebyshev as series

from vibroimpact._core.chebyshev import RESOLVED_OF_LARGEST, fitted, nodes, real_zeros
from vibroimpact._core.checks import check_kind, ends_of, positive
from vibroimpact._core.errors import InvalidParameterError
from vibroimpact._core.types import Complexes, Floats
from vibroimpact.compile.hybrid import compile_mechanism
from vibroimpact.machines.impact_damper import ImpactDamper
from vibroimpact.model.state import State
from vibroimpact.orbits.orbit import Orbit
from vibroimpact.orbits.symmetric_damper import ONLY_CONTACT, STOP_B, on_circle, symmetric_orbits

RESONANCE_ORDER = 12  # resonances p/q up to this q are named
POINTS = 33  # samples per piece
DEEPEST = 30  # halvings of the interval before it is called unresolved
UNIT = 1e-6  # |nu| this close to 1: the pair with product 1 lies on the unit circle


class UnresolvedError(ArithmeticError):
    """The function is not analytic enough on this interval; ``args`` holds its ends."""


@dataclass(frozen=True)
class Bifurcation:
    """A bifurcation of the symmetric branch.

    Attributes
    ----------
    kind
        "SN" fold (nu = +1, the two signs of (14) meet), "BP" symmetry breaking (nu = -1: two
        mirror images are born), "NS" Neimark-Sacker (a pair nu on the unit circle).
    omega
        Location, to rounding of the test function (better than 1e-12).
    sign
        Sign in (14) of the orbit, 0 at a fold.
    half_multiplier, multiplier
        The critical nu (upper half plane) and lambda = nu^2.
    crossing
        "leaves" or "enters": direction in which the critical nu crosses the unit circle as omega
        increases; empty at a fold.
    damper, orbit
        The system and the orbit at the point; the bifurcation is one of the damper if the orbit is
        ``admissible``.
    """

    kind: str
    omega: float
    sign: int
    half_multiplier: complex
    crossing: str
    damper: ImpactDamper
    orbit: Orbit

    @property
    def multiplier(self) -> complex:
        """Critical multiplier lambda = nu^2."""
        return self.half_multiplier**2

    @property
    def half_angle(self) -> float:
        """Angle of nu in degrees, in [0, 180]."""
        return math.degrees(abs(np.angle(self.half_multiplier)))

    @property
    def angle(self) -> float:
        """Angle of lambda in degrees, in (-180, 180]."""
        return math.degrees(float(np.angle(self.multiplier)))

    @property
    def resonance(self) -> tuple[int, int]:
        """Nearest p/q of the half map with q <= 12: nu^q is nearly 1."""
        nearest = Fraction(self.half_angle / 360.0).limit_denominator(RESONANCE_ORDER)
        return nearest.numerator, nearest.denominator

    @property
    def resonance_distance(self) -> float:
        """Degrees between the angle of nu and that resonance."""
        p, q = self.resonance
        return abs(self.half_angle - 360.0 * p / q)

    @property
    def admissible(self) -> bool:
        """Whether the orbit at the point is a motion of the damper."""
        return self.orbit.admissible

    def __repr__(self) -> str:
        p, q = self.resonance
        real = "" if self.admissible else ", not admissible"
        return (
            f"{self.kind} at omega = {self.omega:.12f}, sign {self.sign:+d}: nu = "
            f"{self.half_multiplier:.6f} ({self.half_angle:.3f} deg, {self.resonance_distance:.3f} "
            f"from {p}/{q}){', ' + self.crossing if self.crossing else ''}{real}"
        )


def orbits_by_sign(damper: ImpactDamper) -> dict[int, Orbit]:
    """Return the symmetric orbits by their sign in (14)."""
    return dict(zip((1, -1), symmetric_orbits(damper), strict=False))


def nus_of(orbit: Orbit) -> Complexes:
    """Return the multipliers nu of the half map of a symmetric orbit."""
    assert orbit.half_multipliers is not None
    return orbit.half_multipliers


def half_map_jacobian(damper: ImpactDamper, state: State) -> tuple[Floats, float]:
    """DH at a symmetric orbit in (v1+, x1, v2+, theta), and the closing speed of its impacts.

    The flow over pi / omega, then the saltation of the impact: the moment of contact moves by
    dt = -du / u', and with it everything else (theory.md, "Saltation"). Valid for orbits that
    are not admissible too.
    """
    compiled = compile_mechanism(damper.mechanism)
    n, t, omega = 2, math.pi / damper.omega, damper.omega
    theta = state.phase
    flow = compiled.kernel.flow_matrix(t)
    tangent = np.zeros((2 * n, 4))  # d(x1, x2, v1, v2) by (v1, x1, v2, theta)
    tangent[[0, 1], 1] = 1.0
    tangent[2, 0] = tangent[3, 2] = 1.0
    arrived = flow[:, : 2 * n] @ tangent
    arrived[:, 3] += flow[:, 2 * n :] @ [math.cos(theta), -math.sin(theta)]
    start = np.concatenate([state.position, state.velocity])
    before = flow @ np.concatenate([start, [math.sin(theta), math.cos(theta)]])
    acceleration = compiled.kernel.acceleration(
        list(before[:n]), list(before[n:]), [theta + math.pi]
    )
    row = np.array(compiled.mechanism.rigid_stops[0].row)
    closing = float(row @ before[n:])
    shift = -(row @ arrived[:n]) / closing  # dt by each direction
    place = arrived[:n] + np.outer(before[n:], shift)
    speed = arrived[n:] + np.outer(acceleration, shift)
    after = compiled.kernel.impact_matrix(ONLY_CONTACT, STOP_B) @ speed
    phase = np.array([0.0, 0.0, 0.0, 1.0]) + omega * shift
    return np.stack([-after[0], -place[0], -after[1], phase]), -closing


def excess(damper: ImpactDamper, omega: float) -> float:
    """r^2 / delta^2 - 1: positive where the two orbits exist, zero at folds."""
    _, alpha, beta, _ = on_circle(replace(damper, omega=omega))
    return (alpha * alpha + beta * beta) / damper.half_clearance**2 - 1.0


def _test_functions(damper: ImpactDamper, omega: float, upper: bool) -> Floats:
    """(symmetry breaking, Neimark-Sacker) on one half of the curve cos(theta + lead) = +-sqrt."""
    here = replace(damper, omega=omega)
    w, alpha, beta, _ = on_circle(here)
    ratio = min(1.0, here.half_clearance / math.hypot(alpha, beta))
    rise = math.asin(ratio)
    theta = (rise if upper else math.pi - rise) - math.atan2(beta, alpha)
    x1, _, v1, v2 = (float(z) for z in w @ [math.sin(theta), math.cos(theta)])
    state = here.on_stop("A", x1=x1, v1=v1, v2=v2, phase=theta % (2.0 * math.pi))
    jacobian, closing = half_map_jacobian(here, state)
    nus = np.linalg.eigvals(jacobian)
    i, j = np.triu_indices(4, 1)
    pairs = float(np.real(np.prod(1.0 - nus[i] * nus[j])))
    flip = float(np.linalg.det(jacobian + np.eye(4)))
    return np.array([closing * flip, closing**3 * pairs])


@dataclass(frozen=True)
class _Chart:
    """Smooth piece of the branch: omega(s), and the half of the curve on which s lies."""

    low: float
    high: float
    omega: Callable[[float], float]
    upper: Callable[[float], bool]


def _charts(damper: ImpactDamper, low: float, high: float) -> tuple[list[float], list[_Chart]]:
    """Folds in [low, high], and charts of the pieces of the branch between them."""
    folds: list[float] = []

    def gap(omega: float) -> float:
        return excess(damper, omega)

    for a, b, coefficients in pieces(lambda omega: np.array([gap(omega)]), low, high):
        folds += _polished(gap, a, b, real_zeros(coefficients[:, 0]))
    edges = [low, *folds, high]
    charts: list[_Chart] = []
    for a, b in itertools.pairwise(edges):
        if b > a and gap((a + b) / 2) > 0.0:
            charts += _charts_between(a, b, a in folds, b in folds)
    return folds, charts


def _charts_between(a: float, b: float, fold_a: bool, fold_b: bool) -> list[_Chart]:
    middle, half, root = (a + b) / 2, (b - a) / 2, math.sqrt(b - a)
    if fold_a and fold_b:
        return [
            _Chart(0.0, 2.0 * math.pi, lambda s: middle - half * math.cos(s), lambda s: s < math.pi)
        ]
    if fold_a:
        return [_Chart(-root, root, lambda s: min(a + s * s, b), lambda s: s > 0.0)]
    if fold_b:
        return [_Chart(-root, root, lambda s: max(b - s * s, a), lambda s: s > 0.0)]
    return [_Chart(a, b, float, lambda _: True), _Chart(a, b, float, lambda _: False)]


def pieces(
    f: Callable[[float], Floats], low: float, high: float
) -> Iterator[tuple[float, float, Floats]]:
    """Resolved pieces (low, high, coefficients of shape (POINTS, k)) from left to right."""
    stack = [(low, high, 0)]
    points = nodes(POINTS)
    while stack:
        a, b, depth = stack.pop()
        values = np.array([f((a + b) / 2 + (b - a) / 2 * x) for x in points])
        coefficients = fitted(values)
        scale = np.abs(coefficients).max(axis=0)
        tail = np.abs(coefficients[-4:]).max(axis=0)
        if np.all(tail <= RESOLVED_OF_LARGEST * scale):
            yield a, b, coefficients
        elif depth == DEEPEST:
            raise UnresolvedError(a, b)
        else:
            middle = (a + b) / 2
            stack += [(middle, b, depth + 1), (a, middle, depth + 1)]


def _polished(f: Callable[[float], float], a: float, b: float, zeros: Floats) -> list[float]:
    """Zeros (in [-1, 1]) of a piece's series, moved to the changes of sign of f itself."""
    found: list[float] = []
    for x in zeros:
        at, reach = (a + b) / 2 + (b - a) / 2 * float(x), 1e-8 * (b - a)
        for _ in range(8):
            left, right = max(at - reach, a), min(at + reach, b)
            if f(left) * f(right) <= 0.0:
                at = bracketed_zero(f, left, right)
                break
            reach *= 4.0
        else:
            continue  # a zero just outside the piece belongs to its neighbour
        if not found or abs(at - found[-1]) > 1e-12 * (b - a):
            found.append(at)
    return found


def bracketed_zero(f: Callable[[float], float], low: float, high: float) -> float:
    """The zero of f, continuous with a change of sign, to the last bits (bisection)."""
    at_low = f(low)
    while True:
        middle = low + (high - low) / 2
        if middle in (low, high):
            return middle
        at_middle = f(middle)
        if at_middle == 0.0:
            return middle
        if (at_middle > 0.0) == (at_low > 0.0):
            low = middle
        else:
            high = middle


def symmetric_bifurcations(
    damper: ImpactDamper, omega: tuple[float, float]
) -> tuple[Bifurcation, ...]:
    """Find every bifurcation of the symmetric 1-1-1 orbits for omega in a range.

    Parameters
    ----------
    damper
        The system; its own omega is not used.
    omega
        (low, high), 0 < low < high.

    Returns
    -------
    tuple of Bifurcation
        In order of omega, both signs of (14), orbits that are not admissible included and marked.

    Raises
    ------
    InvalidParameterError
        An empty range, or a system without loss (zeta = 0 and R = 1): its multipliers stay on
        the unit circle.

    Notes
    -----
    None is skipped, for the reason in the module's docstring. Cost: some hundred closed-form
    orbits, about a second.

    Examples
    --------
    >>> import vibroimpact as vi
    >>> damper = vi.ImpactDamper(mass_ratio=0.1, omega_n=0.5, zeta=0.045, restitution=0.8,
    ...                          half_clearance=5.0, omega=1.0)
    >>> [point.kind for point in symmetric_bifurcations(damper, (1.0, 1.02))]
    ['NS']
    """
    check_kind("damper", damper, ImpactDamper, "an ImpactDamper")
    low, high = ends_of("omega", omega)
    positive("omega", low)
    if damper.zeta * damper.omega_n == 0.0 and damper.restitution == 1.0:
        raise InvalidParameterError(
            "zeta = 0, restitution = 1: without loss every multiplier stays on the unit circle. "
            "Add damping or take restitution < 1."
        )
    folds, charts = _charts(damper, low, high)
    points = [_fold(damper, at) for at in folds]
    for chart in charts:
        points += _on_chart(damper, chart)
    return tuple(sorted(points, key=lambda point: point.omega))


def _fold(damper: ImpactDamper, omega: float) -> Bifurcation:
    """Orbit at a fold, or where rounding leaves none, at the nearest omega that has one."""
    for step in range(64):
        for side in (1.0, -1.0):
            near = omega * (1.0 + side * step * 2.0**-52)
            there = replace(damper, omega=near)
            for orbit in symmetric_orbits(there):
                return Bifurcation("SN", omega, 0, 1.0 + 0.0j, "", there, orbit)
    raise ArithmeticError(f"no orbit next to the fold at omega = {omega}")


def _on_chart(damper: ImpactDamper, chart: _Chart) -> list[Bifurcation]:
    def tests(s: float) -> Floats:
        return _test_functions(damper, chart.omega(s), chart.upper(s))

    found: list[Bifurcation | None] = []
    for a, b, coefficients in pieces(tests, chart.low, chart.high):
        for k in range(2):
            found += _zeros_of(damper, chart, tests, k, (a, b), coefficients[:, k])
    return [point for point in found if point is not None]


def _zeros_of(
    damper: ImpactDamper,
    chart: _Chart,
    tests: Callable[[float], Floats],
    k: int,
    ends: tuple[float, float],
    coefficients: Floats,
) -> list[Bifurcation | None]:
    """Zeros of test function k on one resolved piece."""
    a, b = ends
    slope = series.chebder(coefficients)
    found = []
    for s in _polished(lambda s: float(tests(s)[k]), a, b, real_zeros(coefficients)):
        rising = float(series.chebval((2.0 * s - a - b) / (b - a), slope)) * _direction(chart, s)
        found.append(_identify(damper, chart, s, k, rising))
    return found


def _direction(chart: _Chart, s: float) -> float:
    """Sign of d omega / d s."""
    width = (chart.high - chart.low) / 1e6
    return 1.0 if chart.omega(s + width) > chart.omega(s - width) else -1.0


def _identify(
    damper: ImpactDamper, chart: _Chart, s: float, k: int, slope: float
) -> Bifurcation | None:
    """Bifurcation at a zero of test function k; None for a pair nu, 1/nu off the circle."""
    omega = chart.omega(s)
    there = replace(damper, omega=omega)
    orbits = orbits_by_sign(there)
    nearest = {sign: _nearest(orbit, k) for sign, orbit in orbits.items()}
    sign = min(nearest, key=lambda one: nearest[one][0])
    orbit, (_, nu, rest) = orbits[sign], nearest[sign]
    if abs(abs(nu) - 1.0) > UNIT:
        return None
    weight = orbit.least_impact_speed ** (1 if k == 0 else 3) * rest
    inward = slope * weight > 0.0  # the factor 1 - |nu|^2, or 1 + nu, grows
    crossing = "enters" if inward else "leaves"
    return Bifurcation("BP" if k == 0 else "NS", omega, sign, nu, crossing, there, orbit)


def _nearest(orbit: Orbit, k: int) -> tuple[float, complex, float]:
    """(distance from critical, the critical nu, product of the other factors of function k)."""
    nus = nus_of(orbit)
    if k == 0:
        at = int(np.argmin(np.abs(nus + 1.0)))
        rest = np.prod(np.delete(nus, at) + 1.0)
        return float(abs(nus[at] + 1.0)), complex(nus[at]), float(rest.real)
    i, j = np.triu_indices(4, 1)
    factors = 1.0 - nus[i] * nus[j]
    least = int(np.argmin(np.abs(factors)))
    nu = complex(nus[int(i[least])])
    others = np.prod(np.delete(factors, least))
    return float(abs(factors[least])), complex(nu.real, abs(nu.imag)), float(others.real)
