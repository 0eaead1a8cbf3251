"""Invariant circles with their rotation number, stability, smoothness and admissibility."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from vibroimpact._core.checks import numbers
from vibroimpact._core.errors import InvalidParameterError
from vibroimpact._core.lazy import xr
from vibroimpact._core.types import AnyAmount, Complexes, Floats, Share
from vibroimpact.compile.prescribed import CHATTER_WATCH, GAP_WATCH, PHASE_WATCH, End
from vibroimpact.machines.units import units_of
from vibroimpact.model.stand_ins import stand_ins
from vibroimpact.model.state import State, names_of_state
from vibroimpact.model.system import System, mechanism_of
from vibroimpact.normal_forms.explicit import ExplicitMap
from vibroimpact.orbits.admissibility import (
    PLAY_OF_AMPLITUDE,
    Nearest,
    amplitudes,
    least_gaps,
    relative_gap,
)
from vibroimpact.orbits.problem import Signature
from vibroimpact.orbits.reversals import held_reversal
from vibroimpact.orbits.stability import Stability, stability_of
from vibroimpact.results.result import Result, along
from vibroimpact.tori.fourier import (
    at_phases,
    coefficients,
    decay,
    phases,
    resampled,
    roughness,
    tail,
)
from vibroimpact.tori.maps import CircleMap, Images, SignatureMap
from vibroimpact.tori.normal import (
    Bundle,
    NormalDirection,
    NormalStability,
    leading_direction,
    least_angle,
    normal_stability,
)
from vibroimpact.tori.solve import FOUND, Trial, matrix_of, radius

FEWEST_PHASES = 129  # gaps are taken at so many phases at least
MOST_ZOOMS = 8  # the least gap is zoomed in so often, each time by a factor of four
ZOOM_POINTS = 9  # a zoom takes so many points
RESOLVED_TAIL = 1e-12  # derivatives along the circle are resolved where their tail is smaller
MOST_TIMES_NODES = 3  # or at so many times the nodes of the circle
LARGEST_NAMED_DENOMINATOR = 64  # resonances p/q up to this q are named


class Approach(NamedTuple):
    """Nearest approach to a stop along a circle, at the phase phi in turns."""

    gap: float
    phi: float
    nearest: Nearest | None


@dataclass(frozen=True, eq=False)
class Circle(Result):
    """Invariant circle of a map: a closed curve u with F(u(phi)) = u(phi + rho), phi in turns.

    F is the half map H of a symmetric signature, the full map P of another, or a formula. One that
    is not ``converged`` is neither admissible nor stable; its numbers are those of the last iterate.

    Attributes
    ----------
    system
        The system, or the :class:`ExplicitMap`.
    signature
        Impacts and cycles of one iterate of P, with elements all events and the modes between; None for a formula.
    parameter
        Name of the parameter along which it was found; "" for none.
    value
        Value of the parameter; of a formula, p.
    points
        The curve at the nodes phi = j / N, shape (N, d), N odd: the coordinates of the section of
        the first event, as those of :func:`full_map`, or of the formula. The phase of the forcing
        is continuous along the curve, not folded to one cycle.
    times
        Flight times from each node, shape (N, m); m = 0 for a formula.
    rotation_number
        rho, turns of the circle per iterate of F, in [0, 1). A circle found from a motion or a
        normal form is oriented so that rho <= 1/2, and continued without a jump.
    residual
        Largest |F(u(phi)) - u(phi + rho)| at the nodes and half way between them, each coordinate
        in units of its size on the circle.
    status
        "converged", or a sentence with the reason of the failure.
    """

    system: System | ExplicitMap
    signature: Signature | None
    parameter: str
    value: float
    points: Floats = field(metadata=along("phi", "coordinate"), repr=False)
    times: Floats = field(metadata=along("phi", "flight", quantity="time"), repr=False)
    rotation_number: Share
    residual: AnyAmount
    status: str
    map: CircleMap = field(repr=False)

    @property
    def converged(self) -> bool:
        """Whether the equations hold to the tolerance."""
        return self.status == FOUND

    @property
    def _nowhere(self) -> bool:
        """Whether there is not even a guess of it."""
        return not np.isfinite(self.points).all()

    @property
    def nodes(self) -> int:
        """Number N of nodes."""
        return len(self.points)

    @property
    def symmetric(self) -> bool:
        """Whether it was solved as its own mirror image, on the half map."""
        return self.signature is not None and self.signature.symmetric

    @property
    def full_rotation_number(self) -> float:
        """Turns per iterate of the full map P, in [0, 1): 2 rho for a circle of the half map."""
        return (2.0 if self.symmetric else 1.0) * self.rotation_number % 1.0

    @property
    def trial(self) -> Trial:
        """The unknowns of its equations."""
        return Trial(self.points, self.rotation_number, self.value, self.times)

    @cached_property
    def coefficients(self) -> Complexes:
        """Fourier coefficients c_0 .. c_K of the curve, shape (K + 1, d); c_-k is conj(c_k)."""
        return coefficients(self.points)

    def at(self, phi: ArrayLike) -> Floats:
        """Points of the curve at phases in turns, shape (m,), as an array (m, d)."""
        return at_phases(self.points, np.atleast_1d(numbers("phi", phi)).ravel() % 1.0)

    def states(self, phi: ArrayLike) -> Floats:
        """States (x, v, theta) just after the first event of the signature at phases, shape (m, 2n + 1)."""
        return self._impacting.states(self.at(phi), self.value)

    def state(self, phi: float = 0.0) -> State:
        """A state on the circle, for simulation."""
        row = self.states([phi])[0]
        n = len(row) // 2
        return State(tuple(row[:n]), tuple(row[n : 2 * n]), float(row[-1]) % (2.0 * math.pi))

    @property
    def _impacting(self) -> SignatureMap:
        if not isinstance(self.map, SignatureMap):
            raise InvalidParameterError("states: a formula has no states. Use at(phi).")
        return self.map

    # ---- smoothness -------------------------------------------------------------------------------

    @property
    def _scaled(self) -> Floats:
        return self.points / self.map.sizes

    @property
    def radius(self) -> float:
        """Root mean square distance from its centre, coordinates in units of their sizes."""
        return radius(self.points, self.map.sizes)

    @cached_property
    def decay(self) -> float:
        """Fall of ln |c_k| per harmonic: 2 pi times the width of the strip in which u is analytic."""
        return decay(self._scaled)

    @cached_property
    def roughness(self) -> float:
        """|u''| / (2 pi |u'|) in the mean square: 1 for an ellipse; grows where a circle breaks."""
        return roughness(self._scaled)

    @property
    def resonance(self) -> tuple[int, int]:
        """The p/q, q <= 64, with the least q |q rho - p|: the tongue that is felt most."""
        qs = np.arange(1, LARGEST_NAMED_DENOMINATOR + 1)
        ps = np.rint(qs * self.rotation_number).astype(int)
        best = int(np.argmin(qs * np.abs(qs * self.rotation_number - ps)))
        common = math.gcd(int(ps[best]), int(qs[best]))
        return int(ps[best]) // common, int(qs[best]) // common

    # ---- normal stability -------------------------------------------------------------------------

    @cached_property
    def _images(self) -> Images:
        return self.map.images(self.points, self.value, self.times)

    @cached_property
    def normal(self) -> NormalStability:
        """Exponents and bundles normal to the circle; NaN where there is not even a guess of it."""
        if self._nowhere:
            return NormalStability(np.full(self.points.shape[1] - 1, np.nan), ())
        points, by_point, noise = self._resolved
        zeros = self.map.forgotten if isinstance(self.map, SignatureMap) else 0
        return normal_stability(points, by_point, self.rotation_number, noise, zeros)

    @cached_property
    def _resolved(self) -> tuple[Floats, Floats, float]:
        """Scaled points and derivatives on nodes that resolve both, and the error left."""
        sizes, count = self.map.sizes, self.nodes
        while True:  # derivatives have more harmonics than the circle
            count = 2 * count + 1
            points, times = resampled(self.points, count), resampled(self.times, count)
            by_point = self.map.images(points, self.value, times).by_point * sizes / sizes[:, None]
            noise = tail(by_point)
            if noise <= RESOLVED_TAIL or count >= MOST_TIMES_NODES * self.nodes:
                return points / sizes, by_point, noise

    def leading_direction(self) -> NormalDirection:
        """Normal direction of the largest exponent along the circle, for switching."""
        points, by_point, _ = self._resolved
        return leading_direction(points, by_point, self.rotation_number)

    @property
    def normal_exponents(self) -> Floats:
        """Lyapunov exponents normal to the circle, per iterate of F, largest first, (d - 1,)."""
        return self.normal.exponents

    @property
    def normal_multipliers(self) -> Complexes:
        """Exponentials of the exponents, with their signs, shape (d - 1,).

        The imaginary part is nan where there is no sign, but a modulus: for the members of a
        complex pair, and where the invariant direction comes back reversed (a Moebius band).
        """
        return self.normal.multipliers

    @property
    def bundles(self) -> tuple[Bundle, ...]:
        """Kind of each normal direction: positive, negative, one-sided (Moebius), pair."""
        return self.normal.bundles

    @property
    def stability(self) -> Stability:
        """Whether it is stable, neutral, unstable, or not admissible, by its normal exponents."""
        return stability_of(np.exp(self.normal_exponents), admissible=self.admissible)

    @property
    def stable(self) -> bool:
        """Whether it is admissible, with all normal exponents below 0."""
        return self.stability is Stability.STABLE

    @cached_property
    def least_angle(self) -> float:
        """Least angle between the circle and its normal invariant directions, radians.

        Coordinates are in units of their sizes. It tends to 0 where the circle loses its
        normal hyperbolicity, the usual way in which circles break; at a fold of circles, too.
        """
        matrix = matrix_of(self._images, self.trial, self.trial, self.map.sizes, 1.0)
        return least_angle(self._scaled, self.rotation_number, matrix[:, :-1])

    # ---- admissibility ----------------------------------------------------------------------------

    @cached_property
    def nearest(self) -> Approach:
        """Least gap to a stop along the circle, with its phase, stop, flight and time.

        With elements the margins of all their guards count, each relative to its amplitude.
        """
        if not isinstance(self.map, SignatureMap):
            return Approach(math.inf, 0.0, None)
        if self._nowhere:
            return Approach(math.nan, math.nan, None)
        least, width = self._least_gap(self._grid), 1.0 / len(self._grid)
        for _ in range(MOST_ZOOMS if least.nearest else 0):
            near = least.phi + width * np.linspace(-1.0, 1.0, ZOOM_POINTS)
            least, width = min(least, self._least_gap(near), key=self._relative), width / 4.0
        return least._replace(phi=least.phi % 1.0)

    @property
    def _grid(self) -> Floats:
        """Phases at which gaps are taken."""
        return phases(max(self.nodes, FEWEST_PHASES))

    def _flights(self, phi: Floats) -> tuple[Floats, Floats, tuple[End, ...]]:
        """States at the start of all flights from some phases, their times and their ends."""
        points, guess = self.at(phi), at_phases(self.times, phi)
        times = self._impacting.images(points, self.value, guess).times
        states = self._impacting.departures(points, self.value, times)
        return states, times.ravel(), self._impacting.problem.ends * len(phi)

    @cached_property
    def _amplitudes(self) -> dict[tuple[int, int], float]:
        """Sizes of the gaps along the circle, by contact and watch."""
        return amplitudes(self._impacting.problem.compiled(self.value), *self._flights(self._grid))

    def _relative(self, here: Approach) -> float:
        return relative_gap(here.nearest, self._amplitudes) if here.nearest else math.inf

    def _least_gap(self, phi: Floats) -> Approach:
        """Least gap in the flights from some phases; ``segment`` counts within one iterate."""
        problem, flights = self._impacting.problem, self._flights(phi)
        begun = problem.signature.impacts[: len(problem.ends)] * len(phi)
        hidden = stand_ins(problem.mechanism)
        found = least_gaps(problem.compiled(self.value), *flights, begun, hidden).values()
        if not found:
            return Approach(math.inf, 0.0, None)
        here = min(found, key=lambda near: relative_gap(near, self._amplitudes))
        node, segment = divmod(here.segment, len(problem.ends))
        return Approach(here.gap, float(phi[node]), here._replace(segment=segment))

    @property
    def clearance_to_grazing(self) -> float:
        """Gap, or margin of an element's guard, at the nearest approach; infinite where none has an extremum."""
        return self.nearest.gap

    @cached_property
    def _rates(self) -> Floats:
        """Rates at which the guards at the ends of the flights are reached along the circle, (N, m)."""
        return resampled(self._images.rates, max(self.nodes, FEWEST_PHASES | 1))

    @property
    def least_impact_speed(self) -> float:
        """Smallest closing speed of an impact along the circle; negative from behind."""
        if self._nowhere:
            return math.nan
        rates = self._rates
        if isinstance(self.map, SignatureMap):
            rates = rates[:, self.map.problem.struck]
        return float(rates.min(initial=math.inf))

    @property
    def admissible(self) -> bool:
        """Whether the circle consists of motions of the machine; of a formula, if it converged."""
        return not self.inadmissible_reason

    @cached_property
    def inadmissible_reason(self) -> str:
        """Violated gap with the phase on the circle, or an impact from behind; "" where none is."""
        if not self.converged:
            return self.status
        if not isinstance(self.map, SignatureMap):
            return ""
        if self.times.min() <= 0.0:
            return f"a flight takes the time {self.times.min():.6g}: two events change order"
        for k, end in enumerate(self.map.problem.ends):
            rate = float(self._rates[:, k].min())
            if rate <= 0.0 and end.watch not in (CHATTER_WATCH, PHASE_WATCH):
                what = (
                    "an impact comes"
                    if end.watch == GAP_WATCH
                    else f"a limit of element {end.contact} is reached"
                )
                return f"{what} from behind, at {abs(rate):.6g}"
        gap, phi, nearest = self.nearest
        if (
            nearest is None
            or gap >= -PLAY_OF_AMPLITUDE * self._amplitudes[nearest.contact, nearest.watch]
        ):
            states, _, ends = self._flights(self._grid)
            return (
                held_reversal(self.map.system_at(self.value), states, ends)
                if self.map.signature.flights
                else ""
            )
        return f"at phase {phi:.6g} of the circle {nearest}"

    # ---- results ----------------------------------------------------------------------------------

    def to_dataset(self) -> xr.Dataset:
        """Convert the circle to an xarray dataset, with what is normal to it and whether it is admissible."""
        data = (
            super()
            .to_dataset()
            .assign(
                normal_exponent=("normal", self.normal_exponents),
                bundle=(
                    "normal",
                    [str(kind) for kind in self.bundles]
                    or ["unknown"] * len(self.normal_exponents),
                ),
            )
        )
        if isinstance(self.map, SignatureMap) and self.signature is not None:
            known = names_of_state(mechanism_of(self.map.system).degrees)
            names = [known[i] for i in self.map.kept]
            data["points"].attrs |= units_of(self.map.system).of_entries(names)
            data = data.assign_coords(coordinate=names)
        return data.assign_coords(phi=phases(self.nodes)).assign_attrs(
            clearance=self.clearance_to_grazing,
            stability=self.stability.words,
            inadmissible_reason=self.inadmissible_reason,
        )

    def __repr__(self) -> str:
        if not self.converged:
            return f"Circle({self.status})"
        values = ", ".join(f"{x:.6g}" for x in self.normal_exponents)
        why = f"\n  {self.inadmissible_reason}" if not self.admissible else ""
        return (
            f"Circle of the {'half map' if self.symmetric else 'map'}, {self.stability.words}, rotation number "
            f"{self.rotation_number:.12g}\n"
            f"  {self.nodes} nodes, residual {self.residual:.1e}, normal exponents {values}{why}"
        )

    def __str__(self) -> str:
        if not self.converged:
            return repr(self)
        (p, q), gap = self.resonance, self.clearance_to_grazing
        full = f"; {self.full_rotation_number:.12g} turns per full map" if self.symmetric else ""
        clear = f"clearance to grazing {gap:.6g}" if math.isfinite(gap) else (
            "no gap has an extremum between events"
        )  # fmt: skip
        lines = [
            repr(self),
            f"  near the resonance {p}/{q}{full}",
            f"  normal directions: {', '.join(map(str, self.bundles))}",
            f"  smoothness: decay {self.decay:.6g} per harmonic, roughness {self.roughness:.6g}, least angle "
            f"{self.least_angle:.6g}",
            f"  {clear}; least impact speed {self.least_impact_speed:.6g}",
            f"  passes through {self.state()}",
        ]
        return "\n".join(lines)
