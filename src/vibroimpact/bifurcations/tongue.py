"""Arnold tongues of locked orbits, from a weak resonance on a Neimark-Sacker curve.

Method      on the centre manifold (unfold.py) a circle of radius r with rotation p/q exists at
                da = -K^-1 (Re d, Im d) r^2,  K = [Re kappa; Im kappa],  kappa = conj(nu) dnu/da     (1)
            Points r exp(i (phi + 2 pi p j / q)), j = 0 ... q - 1, are nearly an orbit of period q. With phi held and
            a_1 free, Newton's method finds one; along a_1 its branch has a fold on either side: the sides of the
            tongue at this a_2, followed as curves of SN in both parameters                          (2)
            At the tip the sides come together, with a width                ~ r^(q - 2)              (3)
            so that r is enlarged until rounding no longer hides it.
Assumes     q >= 5 and Re d != 0 at the tip
Accuracy    that of curves of SN
Fails       ``NotFound`` with a sentence
Reference   Kuznetsov, Elements of Applied Bifurcation Theory, section 7.3; (3) Arnold (1977)
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from contextlib import suppress
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from vibroimpact._core.errors import InvalidParameterError
from vibroimpact._core.lazy import xr
from vibroimpact._core.progress import ProgressOption, Reporter, interruptible
from vibroimpact._core.types import Floats, Positive
from vibroimpact.bifurcations.augmented import Augmented, Bounds, is_inside
from vibroimpact.bifurcations.curve import BifurcationCurve, of_curves, with_units_of
from vibroimpact.bifurcations.emanating import (
    Slice,
    checked_bounds,
    emanating,
    on_slice,
    uninterrupted,
)
from vibroimpact.bifurcations.equations import Equations
from vibroimpact.bifurcations.kinds import WEAK
from vibroimpact.bifurcations.starting_orbits import Born, solution_at
from vibroimpact.bifurcations.unfold import Centre, centre
from vibroimpact.branches.kinds import NS, SN
from vibroimpact.branches.point import BifurcationPoint, NotFound, check_point
from vibroimpact.continuation import LocatedPoint, Steps
from vibroimpact.continuation.panel import FOLD
from vibroimpact.continuation.walk import check_steps
from vibroimpact.normal_forms.critical import Refusal
from vibroimpact.normal_forms.neimark_sacker import NeimarkSacker, neimark_sacker
from vibroimpact.results.result import Result

SMALLEST_RADIUS = 0.04  # r is so large at least, relative to the size of the orbit
LARGEST_RADIUS = 0.5  # r is so large at most
RADIUS_GROWTH = 1.5  # r grows by this factor from one try to the next
LARGEST_RADIUS_GROWTH = 4.0  # r grows by no larger factor
# Phi q / (2 pi) is tried in this order: near a fold Newton's method has no room.
TRIED_PHASES = (0.5, 0.25, 0.0, 0.75)
PHASE_STEP = 1e-4  # a step of phi, in radians, tells its direction
SLICE_SPAN = 0.02  # the parameter on a slice has this size, as a change of log nu
# Folds that are nearer, as a change of log nu, make equations that are nearly singular twice.
LEAST_FOLD_DISTANCE = 1e-9
TINY = float(np.finfo(float).tiny)
# Nearer to the tip, relative to the radius of the start, both sides are one to rounding.
TIP_OF_RADIUS = 0.8
SIDES = Steps(first=0.05, largest=1.0, tolerance=1e-6, points=600)
ALONG = Steps(first=0.02, largest=0.5, points=200)


@dataclass(frozen=True, eq=False)
class Tongue(Result):
    """Tongue of orbits locked p/q in the plane of two parameters.

    Attributes
    ----------
    tip
        The weak resonance at which it begins.
    sides
        The two curves of folds between which the locked orbits exist.
    radius
        Distance from the orbit, on the centre manifold, at which the sides were found.
    """

    tip: BifurcationPoint
    sides: tuple[BifurcationCurve, BifurcationCurve]
    radius: Positive = field(repr=False)

    @property
    def resonance(self) -> tuple[int, int]:
        """(p, q)."""
        assert self.tip.resonance is not None
        return self.tip.resonance

    def width(self, value: float) -> float:
        """Extent of the tongue in the first parameter at a value of the second; NaN where a side does not reach it.

        Where a side reaches it more than once, the part next to the tip counts.
        """
        firsts = [_first_at(side, self.tip, value) for side in self.sides]
        return abs(firsts[0] - firsts[1])

    def to_dataset(self) -> xr.Dataset:
        """Convert to an xarray dataset: points and special points of both sides, with the number of the side."""
        names = self.sides[0].names
        data = super().to_dataset().assign(of_curves(self.sides, names))
        return with_units_of(self.sides, names, data)

    def __repr__(self) -> str:
        p, q = self.resonance
        lines = [f"Tongue {p}/{q} from {self.tip!r}", *(f"  {side!r}" for side in self.sides)]
        return "\n".join(lines)


@interruptible
def tongue(
    point: BifurcationPoint,
    bounds: tuple[Bounds, Bounds] | None = None,
    *,
    steps: Steps | None = None,
    progress: ProgressOption = True,
) -> Tongue | NotFound:
    """Follow both sides of the tongue of locked orbits that begins at a weak resonance.

    Parameters
    ----------
    point
        A weak resonance on a curve of NS: ``curve["2/9_1"]``.
    bounds
        ((low, high), (low, high)) of both parameters; by default those of the curve.
    steps
        Step lengths of the sides, number of points. Points are exact whatever the tolerance, by default 1e-6.
    progress
        True shows it on standard error after 2 s; a function gets a :class:`~vibroimpact.ProgressReport` after
        every panel of a side.

    Returns
    -------
    Tongue or NotFound
        :class:`NotFound` states the reason.

    Raises
    ------
    InvalidParameterError
        Another point; bounds that are empty or without the tip.

    Notes
    -----
    An interruption is raised further: half a tongue is none. Locked orbits close after q iterates of the map: for a
    symmetric orbit, of the half map, so that they are symmetric where q is odd. Cost: some ten times that of a branch
    of these orbits.
    """
    check_point(point, Augmented, "a weak resonance, such as curve['2/9_1']")
    check_steps(steps, progress)
    if point.record != WEAK or point.resonance is None:
        raise InvalidParameterError(
            f"point = {point.label}: tongues begin at weak resonances, such as curve['2/9_1']."
        )
    inside = checked_bounds(point, bounds)
    origin = solution_at(point)
    form = neimark_sacker(NS, origin.equations.forms(origin.z, origin.a), parameter=False)
    if isinstance(form, Refusal):
        return NotFound(point, form.reason)
    p, q = point.resonance
    manifold = centre(*origin, complex(np.exp(2j * math.pi * p / q)))
    with Reporter(progress, f"tongue {p}/{q}") as report:
        told = report.counted("points", point.name)
        for start in _starts(manifold, form, (p, q), inside, report.say):
            with suppress(InvalidParameterError):  # a fold too near to the tip to be followed
                sides = []
                for fold in start.folds:
                    born = Born(start.slice.solution(fold))
                    sides.append(
                        emanating(SN, origin, born, inside, steps or SIDES, told, TIP_OF_RADIUS)
                    )
                    uninterrupted(sides[-1].curve)
                first, second = sides
                if min(len(first), len(second)) > 1:
                    return Tongue(point, (first, second), start.radius)
    return NotFound(
        point, "no locked orbit between two folds was found near the tip, within the bounds"
    )


class _Start(NamedTuple):
    slice: Slice
    folds: tuple[LocatedPoint, LocatedPoint]
    radius: float


def _starts(
    manifold: Centre, form: NeimarkSacker, resonance: tuple[int, int], bounds: tuple[Bounds, Bounds],
    tell: Callable[[str], object],
) -> Iterator[_Start]:  # fmt: skip
    """Folds on both sides of a locked orbit (2), at radii r at which they are well apart."""
    equations = manifold.equations.repeated(resonance[1])
    unit = float(np.abs(manifold.v / manifold.equations.sizes).max())
    r, largest = SMALLEST_RADIUS / unit, LARGEST_RADIUS / unit
    while r <= largest:
        tell(f"looking for locked orbits at {r * unit:.2g} of the sizes of the orbit from the tip")
        tries = (
            _slice(manifold, form, resonance, r, phase, equations, bounds) for phase in TRIED_PHASES
        )
        found = next(filter(None, tries), None)
        apart = _apart(manifold, found) if found else 0.0
        if found and apart >= LEAST_FOLD_DISTANCE:
            yield found
        growth = (
            (2.0 * LEAST_FOLD_DISTANCE / apart) ** (1.0 / (resonance[1] - 2))
            if apart
            else RADIUS_GROWTH
        )  # (3)
        r *= min(LARGEST_RADIUS_GROWTH, max(RADIUS_GROWTH, growth))


def _apart(manifold: Centre, found: _Start) -> float:
    """Distance of the folds, as a change of log nu."""
    first, second = found.folds
    return float(abs(manifold.slopes[found.slice.along] * (first.parameter - second.parameter)))


def _slice(
    manifold: Centre, form: NeimarkSacker, resonance: tuple[int, int], r: float, phase: float,
    equations: Equations, bounds: tuple[Bounds, Bounds],
) -> _Start | None:  # fmt: skip
    """The folds around a locked orbit at radius r; None where there is no such orbit, or no fold."""
    p, q = resonance
    da = manifold.offset(-form.d) * r * r  # (1)
    a = manifold.at(da)
    if not is_inside(a, bounds):
        return None
    rates = manifold.slopes / manifold.nu
    # the parameter that leads across the tongue, whose axis is -d, most steeply
    steepness = np.abs((rates * form.d.conjugate()).imag) / np.maximum(np.abs(rates), TINY)
    along = int(np.argmax(steepness))
    piece = Slice(equations, along, a[1 - along], SLICE_SPAN / float(abs(rates[along])))
    points = r * np.exp(2j * math.pi * (phase + p * np.arange(q)) / q)
    unroll = manifold.equations.unrolled
    start = unroll(manifold.z, manifold.moved(points, da))
    turned = unroll(manifold.z, manifold.moved(points * np.exp(1j * PHASE_STEP), da))
    try:
        curve = on_slice(
            piece, start, a[along], bounds[along],
            tangent=np.append((turned - start) / PHASE_STEP, 0.0), terminal=(FOLD,), steps=ALONG,
        )  # fmt: skip
    except InvalidParameterError:  # Newton's method does not converge
        return None
    folds = list(curve.named(FOLD))
    return _Start(piece, (folds[0], folds[-1]), r) if len(folds) > 1 else None


def _first_at(side: BifurcationCurve, tip: BifurcationPoint, second: float) -> float:
    """First parameter of a side where the second has a value, next to the tip."""
    from scipy.interpolate import CubicHermiteSpline

    values = side.values
    off = values[:, 1] - second
    at = np.flatnonzero(off[:-1] * off[1:] <= 0.0)
    if not at.size:
        return math.nan
    aside = np.array([tip.parameters[name] for name in side.names])
    nearest = at[int(np.argmin(np.linalg.norm(values[at] - aside, axis=1)))]
    seconds, firsts = values[nearest : nearest + 2, 1], values[nearest : nearest + 2, 0]
    tangents = side.curve.tangent[nearest : nearest + 2]
    slopes = tangents[:, -2] / tangents[:, -1]
    if not np.all(np.isfinite(slopes)) or seconds[0] == seconds[1]:
        return float(firsts[0])
    return float(CubicHermiteSpline(*_rising(seconds, firsts, slopes))(second))


def _rising(x: Floats, y: Floats, slopes: Floats) -> tuple[Floats, Floats, Floats]:
    """Two places in the order of x."""
    order = np.argsort(x)
    return x[order], y[order], slopes[order]
