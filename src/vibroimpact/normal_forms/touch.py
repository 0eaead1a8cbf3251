"""Normal form at a touch: the map next to an orbit that grazes a stop.

Method      In the section of a fixed phase through the touch, with xi the distance from the orbit that ignores the stop
            (L its linear map, C the derivatives of its gap h at the touch, opening = dh/dp along it):
                xi -> L (xi + E delta^q),   delta = max(0, -C xi - opening dp)                          (1)
            delta is how far the motion that ignores the stop would pass it, E delta^q the leading term of the
            zero-time discontinuity mapping (theory.md, "At a touch"): q = 1/2 of a rigid stop, 3/2 of a spring, 1 of a
            dashpot that acts at once and never pulls. At the touch positions do not jump: C E = 0.
            Of a rigid stop y = delta^(1/2) and xi are of one size, and the next terms are kept too: with r and q the
            derivatives of h' and h'' by xi, a = h'', and j the next one by time
                xi -> L (xi + E y + y G xi + y^2 H),
                y^2 = -C xi - opening dp + (r xi)^2 / (2 a) (1 - q xi / a + j r xi / (3 a^2))           (1a)
            gamma_k = C L^k E says how far an impact opens the gap k turns later; with
                kappa_n = C (I - L^n)^-1 L^n E                                                          (2)
            an orbit with one impact in n turns has, to leading order,
                delta + kappa_n delta^q + opening dp = 0,                                               (3)
            and multipliers of  L^n (I - q delta^(q - 1) E C). Of a rigid stop they are a curve over y by (1a), where
            xi is the solution of linear equations                                                      (4)
            q = 1/2, y -> 0: the gap at its turn k is (C L^k (I - L^n)^-1 E - kappa_n) y, a multiplier grows as
            -gamma_n / (2 y).                                                                           (5)
            The touching orbit attracts at dp = 0 if and only if all gamma_k > 0: an impact y then lets no later one
            come before xi has shrunk; else the first gamma_k < 0 makes the next impact (|gamma_k| y)^(1/2), which is
            larger, and so on.                                                                          (6)
            All gamma_k > 0 and a leading multiplier 0 < nu < 1, c = lim gamma_k / nu^k: with y = c nu^n u, (1) tends
            to the map of one dimension x -> nu x + rho, of x > 0 rho - x^(1/2), as n grows. Its orbit with one impact
            in n turns is stable for  1/2 < u < (1 - nu) / nu,                                          (7)
            from a period doubling to where another turn touches; dp scales with nu^2 from n to n + 1. The intervals
            exist for nu < 2/3 and overlap for nu < 1/4.                                                (8)
Assumes     one touch, with acceleration a > 0; 1 is no multiplier of L, opening != 0
Accuracy    (1) leaves out terms of the relative order delta^(1/2), (1a) those of relative order delta; but of other
            impacts of the orbit the quadratic terms, too, and terms in y dp and dp^2. (7) is the limit dp -> 0,
            ``window`` uses (4)
Fails       ``Touch.scenario`` says UNDECIDED where a gamma_k is zero within rounding
Reference   Nordmark, J. Sound Vib. 145 (1991) 279, and Phys. Rev. E 55 (1997) 266; Chin, Ott, Nusse, Grebogi, Phys.
            Rev. E 50 (1994) 4427; Fredriksson, Nordmark, Proc. R. Soc. A 453 (1997) 1261; di Bernardo, Budd,
            Champneys, Kowalczyk, Piecewise-smooth Dynamical Systems (2008), chapters 6 and 7. (1a) and (6) to (8) are
            derived in theory.md, (T57c) to (T57h)
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from enum import Enum, StrEnum
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from vibroimpact._core.checks import check_count, numbers, real
from vibroimpact._core.errors import InvalidParameterError
from vibroimpact._core.types import Complexes, Flags, Floats
from vibroimpact.normal_forms.codimension_one import NS, PD, SN
from vibroimpact.normal_forms.critical import HALF_OF_THE_DIGITS
from vibroimpact.results.result import Result, along

SQUARE_ROOT = 0.5  # power of the depth at a rigid stop
OVERLAP_BELOW = 1.0 / 4.0  # windows of period adding overlap for a leading multiplier below (8)
ADDING_BELOW = 2.0 / 3.0  # and exist below this one
# The sign of gamma_k is looked at until all but the leading multiplier have fallen below this share of it.
NEGLIGIBLE_SHARE = 1e-12
MOST_TURNS = 10_000  # and no further
# The leading multiplier is single where the next modulus is smaller by this share.
SINGLE_SHARE = 1e-6
# Stability of an orbit with one impact is looked for at so many speeds, down to this share of the largest.
SPEEDS_LOOKED_AT = 300
LEAST_SHARE_OF_SPEED = 1e-4
# (1a) is used while y |G| is smaller.
LARGEST_CORRECTION = 1.0


class ContactLaw(StrEnum):
    """What acts at the touched stop, which decides the power of the penetration."""

    RIGID = "a rigid stop"
    SPRING = "a soft stop"
    PULLING = "a soft stop with a dashpot that may pull"
    PRESSING = "a soft stop with a dashpot that never pulls"

    @property
    def power(self) -> float:
        """Power q of the depth in the leading term."""
        return {ContactLaw.RIGID: 0.5, ContactLaw.PRESSING: 1.0}.get(self, 1.5)


class Scenario(Enum):
    """What becomes of the motion at a touch; ``sentence`` says it."""

    UNSTABLE = "the touching orbit is unstable, and so no motion stays near it"
    LEAVES = "the motion leaves the touching orbit: impacts grow to a finite speed at once"
    OVERLAPPING = (
        "period adding: one impact in n turns, n growing towards the touch, the windows of n and "
        "n + 1 overlap"
    )
    ADDING = (
        "period adding with chaos between: windows of one impact in n turns, n growing towards "
        "the touch"
    )
    CHAOS = "chaos at once, in a band that grows from zero; no windows of one impact in n turns"
    SMOOTH = "no bifurcation: the orbit goes on, with the contact and its stability unchanged"
    PERSISTS = "the orbit goes on with the contact, its multipliers jump"
    FOLD = (
        "a non-smooth fold: the orbits with and without the contact meet and exist on one side only"
    )
    UNDECIDED = "the leading terms do not decide"

    @property
    def sentence(self) -> str:
        """What happens."""
        return self.value


class Window(NamedTuple):
    """Range of the parameter in which an orbit with one impact in n turns is stable and is a motion."""

    turns: int
    low: float  # of dp
    high: float
    # what ends it on the side of the slower and of the faster impacts: the label of a bifurcation, "touch" where
    # another turn touches, "" where the expansion ends
    slow_end: str
    fast_end: str


class _Struck(NamedTuple):
    """Orbit with one impact in n turns."""

    dp: float
    speed: float
    room: float  # least gap at its other turns
    jacobian: Floats


class Added(NamedTuple):
    """Orbit with one impact in n turns of the touching orbit, as it begins at the touch."""

    turns: int
    side: (
        int  # sign of dp on which it begins; 0 where other turns pass the stop, so that it does not
    )
    stable: bool  # whether it is so next to the touch
    factor: float  # its impact speed is factor |dp|^exponent to leading order
    exponent: float
    push: float  # gamma_n
    reaction: float  # kappa_n


@dataclass(frozen=True, eq=False)
class Touch(Result):
    """Normal form (1) at a touch, for the solved map: the half map of a symmetric orbit.

    Attributes
    ----------
    kind
        Label of the kind of point.
    parameter, at
        Name of the parameter p, and its value at the touch; dp is counted from there.
    stop
        The stop that is touched, in words.
    law
        :class:`ContactLaw` of the stop.
    acceleration
        Acceleration a > 0 of the gap at the touch.
    opening
        Derivative of the least gap by the parameter, along the orbits that ignore the stop.
    coordinates
        Names of the d coordinates: positions and velocities, at the phase of the touch.
    linear
        L, the Jacobian of the solved map of the touching orbit from that phase, shape (d, d).
    jump
        E, shape (d,): a depth delta changes the state by E delta^q at once, to leading order.
    gap
        C, derivatives of the gap by the coordinates, shape (d,).
    rate, bend
        r and q, those of its rate and of its acceleration, shape (d,).
    jerk
        j, third derivative of the gap by time at the touch.
    cross, second
        G, shape (d, d), and H, shape (d,), of (1a) for a rigid stop; zero for a soft one.
    multipliers
        Those of L, largest modulus first, shape (d,).

    Examples
    --------
    A touch with a leading multiplier 1/5 and another one 0:

    >>> import numpy as np
    >>> from vibroimpact.normal_forms import ContactLaw, Touch
    >>> form = Touch("GR", "p", 0.0, "a stop", ContactLaw.RIGID, acceleration=0.5, opening=-1.0,
    ...              coordinates=("x1", "v1"), linear=np.array([[0.2, 1.0], [0.0, 0.0]]),
    ...              jump=np.array([0.0, 1.0]), gap=np.array([1.0, 0.0]), rate=np.array([0.0, 1.0]),
    ...              bend=np.zeros(2), jerk=0.0, cross=np.zeros((2, 2)), second=np.zeros(2))
    >>> form.scenario.name, form.window(2).slow_end
    ('OVERLAPPING', 'PD')
    """

    kind: str
    parameter: str
    at: float
    stop: str
    law: ContactLaw
    acceleration: float
    opening: float
    coordinates: tuple[str, ...]
    linear: Floats = field(metadata=along("coordinate", "by"), repr=False)
    jump: Floats = field(metadata=along("coordinate"), repr=False)
    gap: Floats = field(metadata=along("coordinate"), repr=False)
    rate: Floats = field(metadata=along("coordinate"), repr=False)
    bend: Floats = field(metadata=along("coordinate"), repr=False)
    jerk: float = field(repr=False)
    cross: Floats = field(metadata=along("coordinate", "by"), repr=False)
    second: Floats = field(metadata=along("coordinate"), repr=False)

    @cached_property
    def multipliers(self) -> Complexes:
        """Multipliers of the touching orbit that ignores the stop, largest modulus first."""
        values = np.linalg.eigvals(self.linear).astype(np.complex128)
        return values[np.lexsort((-values.imag, -np.round(np.abs(values), 9)))]

    @property
    def others_inside(self) -> bool:
        """Whether all multipliers of the touching orbit lie inside the unit circle."""
        return bool(np.all(np.abs(self.multipliers) < 1.0))

    @property
    def power(self) -> float:
        """Power q of the depth in (1)."""
        return self.law.power

    @property
    def side(self) -> int:
        """Sign of dp on which the orbit that ignores the stop passes it, and so is no motion."""
        return -int(math.copysign(1.0, self.opening))

    @property
    def speed_factor(self) -> float:
        """Factor of the law  speed = factor |dp|^(1/2)  of a first impact, on the side of the stop.

        It is the speed at which a motion that was on the orbit that ignores the stop meets it, and where all
        gamma_k > 0 no impact is faster, to leading order.
        """
        return math.sqrt(2.0 * self.acceleration * abs(self.opening))

    # ---- what an impact does later ---------------------------------------------------------------

    def pushes(self, turns: int) -> Floats:
        """gamma_k = C L^k E for k = 1 to ``turns``, shape (turns,)."""
        check_count("turns", turns, 1)
        state, found = self.jump, np.empty(turns)
        for k in range(turns):
            state = self.linear @ state
            found[k] = self.gap @ state
        return found

    def _several(self, turns: int) -> Floats:
        """L^n."""
        check_count("turns", turns, 1)
        return np.linalg.matrix_power(self.linear, turns)

    def reaction(self, turns: int = 1) -> float:
        """kappa_n of (2)."""
        whole = self._several(turns)
        return float(self.gap @ np.linalg.solve(np.eye(len(whole)) - whole, whole @ self.jump))

    @cached_property
    def leading(self) -> float:
        """The leading multiplier, where it is real, single and positive; else NaN."""
        values = self.multipliers
        first = complex(values[0])
        single = (
            len(values) == 1 or abs(values[1]) < (1.0 - SINGLE_SHARE) * abs(first)
        ) and first.real > 0.0
        return first.real if single and first.imag == 0.0 else math.nan

    @cached_property
    def returning(self) -> int:
        """First number k of turns after which an impact closes the gap, gamma_k < 0; 0 where none does.

        -1 where one is zero within rounding before that.
        """
        size = float(np.linalg.norm(self.gap) * np.linalg.norm(self.jump))
        radius = float(np.abs(self.multipliers[0]))
        if radius == 0.0:
            return -1
        state = self.jump
        for k in range(1, self._turns_that_decide + 1):
            state = self.linear @ state / radius
            push = float(self.gap @ state)
            if abs(push) <= HALF_OF_THE_DIGITS * size:
                return -1
            if push < 0.0:
                return k
        return 0 if math.isfinite(self.leading) else -1

    @property
    def _turns_that_decide(self) -> int:
        """Turns after which only the leading multiplier is left."""
        values = np.abs(self.multipliers)
        if not math.isfinite(self.leading):
            return MOST_TURNS
        share = float(values[1] / values[0]) if len(values) > 1 else 0.0
        if share == 0.0:
            return len(values)
        return min(
            MOST_TURNS, len(values) + math.ceil(math.log(NEGLIGIBLE_SHARE) / math.log(share))
        )

    @cached_property
    def scenario(self) -> Scenario:
        """What becomes of the motion near the touch, by (6) to (8) or by the power."""
        if self.power == SQUARE_ROOT:
            return self._of_square_root
        if not self.others_inside:
            return Scenario.UNSTABLE
        if self.power == 1.0:
            return Scenario.PERSISTS if 1.0 + self.reaction() > 0.0 else Scenario.FOLD
        return Scenario.SMOOTH

    @property
    def _of_square_root(self) -> Scenario:
        if not self.others_inside:
            return Scenario.UNSTABLE
        if self.returning:
            return Scenario.LEAVES if self.returning > 0 else Scenario.UNDECIDED
        if self.leading < OVERLAP_BELOW:
            return Scenario.OVERLAPPING
        return Scenario.ADDING if self.leading < ADDING_BELOW else Scenario.CHAOS

    # ---- orbits with one impact --------------------------------------------------------------------

    def with_contact(self, depth: float = 0.0, turns: int = 1) -> Complexes:
        """Multipliers (4) of an orbit with one impact in n turns at a depth; largest modulus first.

        Of a rigid stop the depth must be positive: one is infinite at zero.
        """
        whole = self._several(turns)
        if self.power < 1.0:
            if not depth > 0.0:
                raise InvalidParameterError(f"depth = {depth}: must be positive at a rigid stop.")
            values = np.linalg.eigvals(self._with_impact(math.sqrt(depth), turns).jacobian)
        else:
            slope = self.power * depth ** (self.power - 1.0)
            values = np.linalg.eigvals(whole - slope * np.outer(whole @ self.jump, self.gap))
        return values.astype(np.complex128)[np.argsort(-np.abs(values))]

    def _with_impact(self, y: float, turns: int) -> _Struck:
        """Orbit with one impact in n turns by (1a), at a rigid stop."""
        whole, eye = self._several(turns), np.eye(len(self.gap))
        forced = self.jump * y + self.second * y * y
        xi = np.asarray(
            np.linalg.solve(eye - whole @ (eye + y * self.cross), whole @ forced), np.float64
        )
        after = xi + forced + y * (self.cross @ xi)
        shift = -y * y - self.gap @ xi + self._earlier(xi)
        room, state = math.inf, after
        for _ in range(1, turns):
            state = self.linear @ state
            room = min(room, float(self.gap @ state - self._earlier(state) + shift))
        by_y = self.jump + self.cross @ xi + 2.0 * y * self.second
        slope = (self._earlier_by(xi) - self.gap) / (2.0 * y)
        jacobian = whole @ (eye + y * self.cross + np.outer(by_y, slope))
        return _Struck(float(shift) / self.opening, float(self._met(y, xi)), room, jacobian)

    def _earlier(self, xi: Floats) -> Any:
        """How far the least gap is below that at the phase of the touch (1a), of states in the last axis."""
        a, rate = self.acceleration, xi @ self.rate
        turned = 1.0 - xi @ self.bend / a + self.jerk * rate / (3.0 * a * a)
        return rate * rate / (2.0 * a) * turned

    def _met(self, y: Any, xi: Floats) -> Any:
        """Impact speeds at a rigid stop, to the order of (1a)."""
        a = self.acceleration
        turned = 1.0 + (xi @ self.bend - self.jerk / a * (xi @ self.rate)) / (2.0 * a)
        return math.sqrt(2.0 * a) * y * turned - 2.0 * self.jerk / (3.0 * a) * y * y

    def _earlier_by(self, xi: Floats) -> Floats:
        """Derivatives of ``_earlier`` at one state."""
        a, rate = self.acceleration, float(xi @ self.rate)
        turned = 1.0 - float(xi @ self.bend) / a + self.jerk * rate / (3.0 * a * a)
        bent = self.jerk / (3.0 * a * a) * self.rate - self.bend / a
        found: Floats = rate / a * turned * self.rate + rate * rate / (2.0 * a) * bent
        return found

    def _speeds(self, turns: int) -> Floats:
        """Values of y at which the orbit with one impact in n turns is looked at."""
        scale = abs(float(self.pushes(turns)[-1])) + abs(self.reaction(turns))
        bent = float(np.linalg.norm(self.cross, 2))
        most = min(scale / LEAST_SHARE_OF_SPEED, LARGEST_CORRECTION / bent if bent else math.inf)
        return np.geomspace(min(most, scale) * LEAST_SHARE_OF_SPEED, most, SPEEDS_LOOKED_AT)

    def orbits(self, turns: int = 1) -> tuple[Floats, Floats, Flags]:
        """Orbits with one impact in n turns at a rigid stop, in order of their speed.

        Returns
        -------
        dp, speed, stable
            Shape (m,); dp is NaN where another turn passes the stop.
        """
        self._refuse_soft()
        rows = []
        for y in self._speeds(turns):
            found = self._with_impact(float(y), turns)
            inside = bool(np.abs(np.linalg.eigvals(found.jacobian)).max() < 1.0)
            rows.append((found.dp if found.room > 0.0 else math.nan, found.speed, inside))
        dp, speed, stable = zip(*rows, strict=True)
        return np.array(dp), np.array(speed), np.array(stable)

    def _refuse_soft(self) -> None:
        if self.power != SQUARE_ROOT:
            raise InvalidParameterError(
                f"law = {self.law.value}: orbits of several turns are those of a rigid stop. Take added()."
            )

    def added(self, turns: int = 1) -> Added:
        """Orbit with one impact in n turns, as it begins at the touch."""
        push, reaction = float(self.pushes(turns)[-1]), self.reaction(turns)
        spent = math.sqrt(2.0 * self.acceleration)
        if self.power == SQUARE_ROOT:
            begins = self._begins(turns)
            side = -int(math.copysign(1.0, reaction * self.opening))
            factor = spent * abs(self.opening / reaction)
            return Added(turns, side * begins, False, factor, 1.0, push, reaction)
        if turns > 1:
            raise InvalidParameterError(
                f"turns = {turns}: a soft stop that is touched adds no orbits of several turns; must be 1."
            )
        held = 1.0 + reaction if self.power == 1.0 else 1.0
        side = int(math.copysign(1.0, held)) * self.side
        stable = bool(np.all(np.abs(self.with_contact()) < 1.0))
        factor = spent * math.sqrt(abs(self.opening / held))
        return Added(1, side, stable, factor, 0.5, push, reaction)

    def _begins(self, turns: int) -> bool:
        """Whether the orbit with one impact in n turns is a motion as y -> 0 (5)."""
        whole, reaction = self._several(turns), self.reaction(turns)
        state = np.linalg.solve(np.eye(len(whole)) - whole, self.jump)
        for _ in range(1, turns):
            state = self.linear @ state
            if not float(self.gap @ state) > reaction:
                return False
        return True

    def speed(self, dp: float, turns: int = 1) -> tuple[float, ...]:
        """Impact speeds of the orbits with one impact in n turns at dp, slowest first.

        By (4), of soft stops by (3).
        """
        from scipy.optimize import brentq

        dp = real("dp", dp)
        if self.power != SQUARE_ROOT:
            beyond = self.added(turns)
            found = dp * beyond.side > 0.0
            return (beyond.factor * math.sqrt(abs(dp)),) if found else ()
        at = self._speeds(turns)
        off = np.array([self._with_impact(float(y), turns).dp - dp for y in at])
        roots = [
            float(brentq(lambda y: self._with_impact(y, turns).dp - dp, at[k], at[k + 1]))
            for k in np.flatnonzero(off[:-1] * off[1:] < 0.0)
        ]
        every = (self._with_impact(y, turns) for y in roots)
        return tuple(found.speed for found in every if found.room > 0.0)

    def window(self, turns: int) -> Window | None:
        """Range of dp in which an orbit with one impact in n turns is stable and a motion; None without.

        By (4), of a rigid stop. The part with the slowest impacts, where there are several.
        """
        self._refuse_soft()
        at = self._speeds(turns)
        inside = np.array([min(self._margins(float(y), turns)) > 0.0 for y in at])
        if not inside.any():
            return None
        first = int(np.argmax(inside))
        after = np.flatnonzero(~inside[first:])
        last = first + int(after[0]) if after.size else 0
        low, slow_end = self._end(at, first, turns) if first else (float(at[0]), "")
        high, fast_end = self._end(at, last, turns) if last else (float(at[-1]), "")
        dp = sorted(self._with_impact(y, turns).dp for y in (low, high))
        return Window(turns, dp[0], dp[1], slow_end, fast_end)

    def _margins(self, y: float, turns: int) -> tuple[float, float]:
        """How far the orbit with one impact is from being unstable, and from touching at another turn."""
        found = self._with_impact(y, turns)
        return 1.0 - float(np.abs(np.linalg.eigvals(found.jacobian)).max()), found.room

    def _end(self, at: Floats, k: int, turns: int) -> tuple[float, str]:
        """End of a window between two values of y, and its name."""
        from scipy.optimize import brentq

        both = [self._margins(float(y), turns) for y in at[k - 1 : k + 1]]
        which = 1 if both[0][1] * both[1][1] < 0.0 else 0
        y = float(brentq(lambda y: self._margins(y, turns)[which], at[k - 1], at[k], rtol=1e-12))
        return y, "touch" if which else _named(complex(self.with_contact(y * y, turns)[0]))

    def windows(self, turns: int = 8) -> tuple[Window, ...]:
        """Windows of one impact in 1 to ``turns`` turns, those that exist."""
        check_count("turns", turns, 1)
        every = (self.window(n) for n in range(1, turns + 1))
        return tuple(window for window in every if window)

    # ---- the map itself ------------------------------------------------------------------------------

    def impacts(self, dp: ArrayLike, turns: int = 200, settle: int = 1000) -> Floats:
        """Impact speeds of the map (1), of rigid stops (1a), at some dp, settled from the orbit without impact.

        Parameters
        ----------
        dp
            Distances from the touch, shape (n,).
        turns, settle
            Turns that are kept, and those before.

        Returns
        -------
        ndarray of shape (n, turns)
            Zero in turns without impact; NaN where the map has run away.
        """
        shift = numbers("dp", dp).ravel() * self.opening
        check_count("turns", turns, 1)
        check_count("settle", settle, 0)
        xi = np.zeros((len(shift), len(self.gap)))
        speeds = np.zeros((len(shift), turns))
        with np.errstate(over="ignore", invalid="ignore"):
            for k in range(-settle, turns):
                early = self._earlier(xi) if self.power == SQUARE_ROOT else 0.0
                depth = np.maximum(0.0, -xi @ self.gap - shift + early)
                y = np.sqrt(depth)[:, None]
                if k >= 0 and self.power == SQUARE_ROOT:
                    speeds[:, k] = self._met(y[:, 0], xi)
                elif k >= 0:
                    speeds[:, k] = math.sqrt(2.0 * self.acceleration) * y[:, 0]
                struck = np.outer(depth**self.power, self.jump) + y * y * self.second
                xi = (xi + struck + y * (xi @ self.cross.T)) @ self.linear.T
        speeds[~np.isfinite(speeds)] = math.nan
        return speeds

    # ---- words ---------------------------------------------------------------------------------------

    @property
    def numbers(self) -> dict[str, Any]:
        """Quantities that are told, by name."""
        lead = {"leading": self.leading} if math.isfinite(self.leading) else {}
        return {
            "power": self.power, "acceleration": self.acceleration, "opening": self.opening, **lead,
            "push": float(self.pushes(1)[0]), "reaction": self.reaction(), "speed_factor": self.speed_factor,
        }  # fmt: skip

    @property
    def meaning(self) -> str:
        """Sentences: what happens at the touch, and to the orbit with one impact more."""
        more = self.added()
        where = {1: "above", -1: "below"}
        has = (
            f"the orbit with the impact begins {where[more.side]} {self.parameter} = {self.at:.9g}, "
            f"{'stable' if more.stable else 'unstable'}, its impact speed is {more.factor:.6g} "
            f"{'|dp|' if more.exponent == 1.0 else 'sqrt|dp|'}"
        )
        return f"{self.scenario.sentence}{self._because}; {has}"

    @property
    def _because(self) -> str:
        if self.scenario is Scenario.LEAVES:
            return f" (an impact closes the gap {_turns(self.returning)} later)"
        if math.isfinite(self.leading) and self.law is ContactLaw.RIGID and self.others_inside:
            return f" (leading multiplier {self.leading:.6g})"
        return ""

    def __str__(self) -> str:
        name = f"{self.kind} at {self.parameter} = {self.at:.9g}: {self.stop}, {self.law.value}"
        told = ", ".join(f"{key} = {value:.9g}" for key, value in self.numbers.items())
        return f"{name}\n  {told}\n  {self.meaning}"


def _turns(count: int) -> str:
    return "a turn" if count == 1 else f"{count} turns"


def _named(multiplier: complex) -> str:
    """Kind at which a multiplier on the unit circle is critical."""
    if multiplier.imag:
        return NS.label
    return SN.label if multiplier.real > 0.0 else PD.label
