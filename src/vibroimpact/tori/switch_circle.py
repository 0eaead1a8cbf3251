"""Doubled circle at a torus doubling.

Method      With e(phi) the leading normal direction, A(phi) e(phi) = lambda e(phi + rho), |lambda| = 1:
              - e closes and lambda = -1: two circles that the map exchanges; each is a circle of the
                second iterate,
                    u + a e,   rotation number 2 rho;                                            (1)
              - e comes back reversed (a Moebius band): one circle of twice the length,
                    u(2 phi) + a e(2 phi),   rotation number rho / 2, or (rho + 1) / 2 where e is
                carried to the other sheet.                                                      (2)
            The amplitude a is given, and the parameter is solved for with the curve: on the plane
            <e, u - u_1> = 0 (solve.py). At a = 0 the family of doubled circles crosses the other.
Assumes     the critical direction is the leading one
Accuracy    the circle's own residual
Fails       a status of the circle: no convergence, another direction
Reference   theory.md, "Invariant circles"
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from vibroimpact._core.checks import check_count, check_kind, positive, refusal, share
from vibroimpact._core.progress import interruptible
from vibroimpact.branches.kinds import PD
from vibroimpact.branches.point import BifurcationPoint
from vibroimpact.tori.circle import Circle
from vibroimpact.tori.find import circle_of, of_second_iterate, oriented, second_iterate
from vibroimpact.tori.fourier import at_phases, phases, resampled
from vibroimpact.tori.solve import FEWEST_NODES, MOST_NODES, TOLERANCE, Direction, Trial, solve

CRITICAL_EXPONENT = 1e-3  # a leading exponent that is so near to 0 is that of the event


@interruptible
def switch_circle(
    point: BifurcationPoint,
    *,
    amplitude: float = 0.05,
    tolerance: float = TOLERANCE,
    most_nodes: int = MOST_NODES,
) -> Circle:
    """Find the doubled circle next to a torus doubling.

    Parameters
    ----------
    point
        A torus doubling of a family, ``family["PD1"]``.
    amplitude
        Distance from the circle, as a share of its radius, in (0, 1).
    tolerance, most_nodes
        As of :func:`find_circle`.

    Returns
    -------
    Circle
        At the value of the parameter to which the amplitude belongs; continue it from there. Of the
        second iterate of the map where two circles are exchanged, of the map itself where there is
        one of twice the length. With ``converged`` False and a sentence where there is none.

    Raises
    ------
    InvalidParameterError
        An event of another kind, an amplitude outside (0, 1).

    Notes
    -----
    Cost: that of a circle with twice as many nodes.

    Examples
    --------
    >>> import numpy as np, vibroimpact as vi
    >>> def spin(x, p):  # a circle, and a direction z -> -p z + z^3 beside it
    ...     grow = 1.2 - 0.2 * (x[0]**2 + x[1]**2)
    ...     return [grow * (0.28 * x[0] - 0.96 * x[1]), grow * (0.96 * x[0] + 0.28 * x[1]),
    ...             -p * x[2] + x[2]**3]
    >>> circle = vi.find_circle(vi.ExplicitMap(spin, dimension=3), (1.0, 0.0, 0.0), p=0.9)
    >>> doubled = vi.switch_circle(vi.continue_circle(circle, "p", (0.8, 1.2))["PD1"])
    >>> bool(np.allclose(doubled.points[:, 2]**2, doubled.value - 1.0))  # z^2 = p - 1
    True
    """
    check_kind("point", point, BifurcationPoint, "a special point of a family of circles")
    circle = point.orbit
    if point.record != PD or not isinstance(circle, Circle):
        raise refusal("point", point, "a torus doubling", 'Take family["PD1"].')
    distance = share("amplitude", amplitude)
    tolerance = positive("tolerance", tolerance)
    check_count("most_nodes", most_nodes, FEWEST_NODES)
    if abs(circle.normal_exponents[0]) > CRITICAL_EXPONENT:
        status = "the critical direction is not the leading one: the circle was unstable before"
        return circle_of(circle.map, circle.trial, np.inf, status)
    leading, sizes = circle.leading_direction(), circle.map.sizes
    if leading.reversed:
        circle_map = circle.map
        across = resampled(leading.field, len(leading.field) + 1)  # odd
        guess = _twice_as_long(circle, len(across), leading.sign)
    else:
        circle_map, across = second_iterate(circle), leading.field
        guess = of_second_iterate(circle, len(across))
    across = across / float(np.sqrt((across**2).sum(axis=1).mean()))
    start = replace(guess, points=guess.points + distance * circle.radius * across * sizes)
    unit = abs(circle.value) or 1.0
    found = solve(
        circle_map, start, along=Direction(across, 0.0, 0.0, unit), tolerance=tolerance,
        most_nodes=most_nodes,
    )  # fmt: skip
    return oriented(circle_of(circle_map, found.trial, found.residual, found.status))


def _twice_as_long(circle: Circle, count: int, sign: float) -> Trial:
    """The circle passed twice (2)."""
    turns = 2.0 * phases(count)
    rho = (circle.rotation_number + (1.0 if sign < 0.0 else 0.0)) / 2.0
    return Trial(circle.at(turns), rho, circle.value, at_phases(circle.times, turns))
