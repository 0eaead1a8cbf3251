"""Rules that end a branch before the end of its range or its number of points.

A rule is a function of an orbit. It is called at every point of a branch, in order and away from
the start, with the start first, and returns True, or the reason as a text, where the branch is to
end.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from vibroimpact._core.checks import check_count, nonnegative, refusal
from vibroimpact._core.errors import InvalidParameterError
from vibroimpact._core.types import Floats
from vibroimpact.branches.family import OrbitFamily
from vibroimpact.branches.vanishing import passed_over
from vibroimpact.continuation.walk import BeginRule, StopRule
from vibroimpact.orbits.orbit import Orbit
from vibroimpact.orbits.stability import NEUTRAL_DISTANCE


class RuleError(InvalidParameterError):
    """A rule returned neither a truth value nor a text."""


Rule = Callable[[Orbit], bool | str]


@dataclass(frozen=True)
class Inadmissible:
    """Rule of :func:`inadmissible`; it counts separately in each direction of each branch."""

    beyond: float
    points: int

    def begin(self, span: float) -> Rule:
        """Rule for one direction, in a parameter range of a given length."""
        travelled, count, last = 0.0, 0, 0.0

        def ended(orbit: Orbit) -> str:
            nonlocal travelled, count, last
            before, last = last, orbit.parameter_value
            if orbit.admissible:
                travelled, count = 0.0, 0
                return ""
            travelled += abs(last - before) if count else 0.0
            count += 1
            if travelled <= self.beyond * span and count <= self.points:
                return ""
            return f"not admissible along {count} points, {travelled / span:.3g} of the range"

        return ended


StopWhen = Rule | Inadmissible | Sequence[Rule | Inadmissible]
AT_ONCE = Inadmissible(0.0, 0)  # ends a branch at the first orbit that is no motion


def inadmissible(*, beyond: float = 0.05, points: int = 100) -> Inadmissible:
    """End a branch after a long part that is not admissible.

    Parameters
    ----------
    beyond
        Share of the parameter's range, >= 0; both directions at a fold add up.
    points
        Number of points, >= 0. The branch ends where either is exceeded.

    Raises
    ------
    InvalidParameterError
        A share that is negative or not finite, a count that is not an integer >= 0.
    """
    share = nonnegative("beyond", beyond, "It is a share of the range.")
    check_count("points", points, 0)
    return Inadmissible(share, points)


def unstable(*, multipliers: int = 1) -> Rule:
    """End a branch where more than so many multipliers, >= 0, are outside the unit circle.

    Raises
    ------
    InvalidParameterError
        A count that is not an integer >= 0.
    """
    check_count("multipliers", multipliers, 0)

    def ended(orbit: Orbit) -> str:
        outside = int((np.abs(orbit.multipliers) > 1.0 + NEUTRAL_DISTANCE).sum())
        return f"{outside} multipliers outside the unit circle" if outside > multipliers else ""

    return ended


def listed(stop_when: StopWhen | None) -> list[Any]:
    """Rules of the user as a list."""
    if isinstance(stop_when, list | tuple):
        return list(stop_when)
    return [] if stop_when is None else [stop_when]


def stop_rule(
    stop_when: StopWhen | None,
    family: OrbitFamily,
    bounds: tuple[float, float],
    *more: Inadmissible,
) -> BeginRule | None:
    """Rule of a continuation from those of the user and more, started separately in each direction.

    A branch of a machine with elements ends where its sequence does, too.

    Raises
    ------
    InvalidParameterError
        An object that is not a rule.
    """
    given = [*listed(stop_when), *more]
    if family.signature.flights:
        given.append(passed_over)
    if not given:
        return None
    for rule in given:
        known = isinstance(rule, Inadmissible) or callable(rule)
        if not known or rule in (inadmissible, unstable):
            raise refusal(
                "stop_when",
                rule,
                "a function of an orbit, vi.stop.inadmissible(...), vi.stop.unstable(...), or a "
                "list of them",
            )

    def begin() -> StopRule:
        rules = [
            rule.begin(bounds[1] - bounds[0]) if isinstance(rule, Inadmissible) else rule
            for rule in given
        ]

        def reason(z: Floats, p: float) -> str:
            orbit = family.kept_orbit(z, p)
            return next(filter(None, [_reason(rule, rule(orbit)) for rule in rules]), "")

        return reason

    return begin


def _reason(rule: Rule, verdict: Any) -> str:
    """Result of a rule as a text, empty where the branch continues."""
    if isinstance(verdict, str):
        return verdict
    if isinstance(verdict, bool | np.bool_):
        return getattr(rule, "__name__", repr(rule)) if verdict else ""
    raise RuleError(
        f"stop_when returned {verdict!r}: must return True, False or the reason as a text."
    )
