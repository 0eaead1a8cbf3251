"""A panel: a piece of a curve, expanded in Chebyshev polynomials of its projected arclength.

Method      from a node y_0 with unit tangent t_0 the points F(y_j) = 0, <t_0, y_j - y_0> = s_j at
            the K + 1 Chebyshev points s_j of [0, h]; guesses by Hermite extrapolation (1) of the
            nodes before
            a panel is resolved when the tail of the expansion of y(s) is below tolerance h and
            that of every test function below tolerance times its largest value; for dp/ds
            rounding is allowed, too                                                          (2)
            built-in test functions, both analytic along the curve:
            SN  dp/ds       BP  det [J; t_0]                                                     (3)
            next length: h (safety / (tail / allowed))^(1/K)                                     (4)
Assumes     F analytic; the tangent turns by less than ``turn`` within a panel
Accuracy    that of (2); nodes to Newton's tolerance
Fails       the sentences of ``Failure``: Newton, the turn, the expansion of y. A test function
            that shorter panels do not resolve (a kink, a pole, noise) does not stop the curve: it
            is listed in ``Panel.unresolved``
Reference   [trefethen2013] ch. 8 for (2); [kuznetsov2004] sec. 10.2 for (3)
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from vibroimpact._core.types import Floats
from vibroimpact.continuation.expansion import DEGREE, Expansion, positions
from vibroimpact.continuation.newton import (
    Attempt,
    Determinant,
    NewtonStatus,
    Node,
    correct,
    determinants,
    largest_of,
)
from vibroimpact.continuation.problem import Scaled

FOLD, BRANCH_POINT = "SN", "BP"
BUILT_IN = (FOLD, BRANCH_POINT)
NOT_FINITE = "not finite"
EXTRAPOLATED_NODES = 3  # the extrapolation (1) uses so many nodes, each with its tangent
SAFETY_FACTOR = 0.3  # (4) aims at this part of what is allowed
# After a failure of Newton's iteration. Not 1/2: with a branch point at the end of a panel the next
# panel would end there, too, and so on, ever closer to it.
FAILURE_LENGTH_FACTOR = 0.6
LEAST_LENGTH_FACTOR = 0.2  # (4) multiplies a length by so much at least
LARGEST_LENGTH_FACTOR = 3.0  # (4) multiplies a length by so much at most
LEAST_TOLERANCE = 1e-13  # the tolerance of the expansion of y is so large at least


@dataclass(frozen=True)
class Panel:
    """A resolved piece of the curve.

    Attributes
    ----------
    row
        Unit tangent t_0 at its first node.
    nodes
        K + 1 nodes in order, the first is the last of the panel before.
    curve
        Expansion of y(s), s in [0, h].
    tests
        Expansion of each test function by name; ``None`` where a value is not finite.
    unresolved
        Test functions that do not satisfy (2), with the reason.
    reference
        The determinant of (3) is given relative to this one.
    demand
        Largest of tail / allowed in (2), at most 1.
    """

    row: Floats
    nodes: tuple[Node, ...]
    curve: Expansion
    tests: Mapping[str, Expansion]
    unresolved: dict[str, str]  # grows where a zero cannot be refined
    reference: Determinant
    demand: float

    @property
    def length(self) -> float:
        """Length h in projected arclength."""
        return self.curve.high

    def determinant(self, node: Node) -> float:
        """The branch-point function (3) at a node."""
        return determinants([node], [self.row])[0].over(self.reference)


@dataclass(frozen=True)
class Failure:
    """A panel that was not accepted."""

    reason: str  # the failure, half a sentence
    factor: float = FAILURE_LENGTH_FACTOR  # the length to try next, relative to the one that failed
    # names of the test functions that are the only cause; empty if the curve itself is one
    tests: frozenset[str] = frozenset()
    # the first Newton attempt that ended outside the bounds of p, if that is the reason
    outside: Attempt | None = None


@dataclass(frozen=True)
class Standard:
    """Conditions for accepting a panel."""

    turn: float  # largest turn of the tangent, radians
    tolerance: float  # tolerance of (2)
    # test functions that need not satisfy (2)
    excused: frozenset[str] = field(default_factory=frozenset)


@dataclass
class Trace:
    """Nodes found so far on one panel, with their s."""

    s: list[float]
    nodes: list[Node]

    def guess(self, s: float) -> Floats:
        """Hermite extrapolation (1) from the latest nodes, by divided differences."""
        return hermite(self.s[-EXTRAPOLATED_NODES:], self.nodes[-EXTRAPOLATED_NODES:], s)


def hermite(at: list[float], nodes: list[Node], s: float) -> Floats:
    """Polynomial through the nodes with their directions, evaluated at s (1)."""
    x = [t for t in at for _ in range(2)]
    column = [node.ahead for node in nodes for _ in range(2)]
    value, product = column[0].copy(), 1.0
    for order in range(1, len(x)):
        column = [
            nodes[i // 2].direction
            if x[i] == x[i + order]
            else (column[i + 1] - column[i]) / (x[i + order] - x[i])
            for i in range(len(x) - order)
        ]
        product *= s - x[order - 1]
        value += product * column[0]
    return value


def trace(
    problem: Scaled, origin: Node, length: float, standard: Standard, last: Node | None
) -> Trace | Failure:
    """Solve for the nodes of a panel; ``last`` is its end node if that is known already."""
    row = origin.tangent
    first = replace(origin, direction=row)
    traced = Trace([0.0], [first])
    base, ahead = float(row @ origin.y), math.cos(standard.turn)
    for s in positions(0.0, length)[1:]:
        if last is not None and s == length:
            node = _with_direction(last, row)
        else:
            attempt = correct(problem, traced.guess(s), row, base + s)
            if attempt.node is None:
                outside = attempt if attempt.status is NewtonStatus.OUTSIDE else None
                return Failure(attempt.status.value, outside=outside)
            node = attempt.node
        if float(row @ node.tangent) < ahead:
            return Failure(f"the tangent turned by more than {standard.turn:.2g} rad")
        traced.s.append(float(s))
        traced.nodes.append(node)
    return traced


def _with_direction(node: Node, row: Floats) -> Node:
    """A node whose direction is scaled to another row."""
    along = node.direction / float(row @ node.direction)
    return replace(node, direction=along)


def build(
    problem: Scaled, origin: Node, length: float, standard: Standard, last: Node | None = None
) -> Panel | Failure:
    """Try a panel of the given length from a node."""
    traced = trace(problem, origin, length, standard, last)
    if isinstance(traced, Failure):
        return traced
    curve = Expansion(0.0, length, np.array([node.ahead for node in traced.nodes]))
    noise = max(node.step for node in traced.nodes)
    allowed = standard.tolerance * length + 2.0 * noise + LEAST_TOLERANCE
    demand = float(curve.tail.max()) / allowed
    if not demand <= 1.0:
        return Failure("the curve bends too sharply", _factor(demand))
    return _with_tests(problem, traced, curve, standard, demand)


def _with_tests(
    problem: Scaled, traced: Trace, curve: Expansion, standard: Standard, demand: float
) -> Panel | Failure:
    """Evaluate the test functions at the nodes, and check (2) for them."""
    row = traced.nodes[0].direction
    found = determinants(traced.nodes, [row] * len(traced.nodes))
    reference = largest_of(found)
    values = test_values(problem, traced.nodes, [own.over(reference) for own in found])
    tests = {name: Expansion(0.0, curve.high, of_nodes) for name, of_nodes in values.items()}
    demands = {name: _demand(f, standard.tolerance) for name, f in tests.items()}
    if demands[FOLD] > 1.0:
        noise = max(_noise(problem, node, row) for node in traced.nodes)
        demands[FOLD] = _demand(tests[FOLD], standard.tolerance, noise)
    short = {name for name, d in demands.items() if d > 1.0} - standard.excused
    if short:
        most = max(demands[name] for name in short)
        reason = f"test function {', '.join(sorted(short))} is not resolved"
        return Failure(reason, _factor(most), frozenset(short))
    unresolved = {
        name: why for name, f in tests.items() if (why := _reason_unresolved(f, demands[name]))
    }
    held = [demand, *(d for d in demands.values() if d <= 1.0)]
    return Panel(row, tuple(traced.nodes), curve, tests, unresolved, reference, max(held))


def test_values(
    problem: Scaled, nodes: Sequence[Node], of_branch_points: Sequence[float]
) -> dict[str, Floats]:
    """All test functions at nodes: those of (3), of which the second is given, then the problem's own."""
    slopes = np.array([node.direction[-1] for node in nodes])
    built_in = {FOLD: slopes, BRANCH_POINT: np.array(of_branch_points)}
    return built_in | problem.watched(np.array([node.y for node in nodes]))


def _noise(problem: Scaled, node: Node, row: Floats) -> float:
    """Change of dp/ds when a node is solved for once more: large next to a branch point."""
    again = correct(problem, node.ahead, row, float(row @ node.y), tolerance=math.inf).node
    return abs(float(again.direction[-1] - node.direction[-1])) if again else 0.0


def _demand(f: Expansion, tolerance: float, noise: float = 0.0) -> float:
    """Ratio of the tail to the allowed tail (2); 0 for a function that no shorter panel would resolve better."""
    if not np.all(np.isfinite(f.values)):
        return 0.0
    size = float(np.abs(f.values).max())
    return float(f.tail / (tolerance * size + noise)) if size > 0.0 else 0.0


def _reason_unresolved(f: Expansion, demand: float) -> str:
    """Reason why a test function is not resolved on a panel; empty if it is."""
    if not np.all(np.isfinite(f.values)):
        return NOT_FINITE
    if not np.any(f.values):
        return "zero everywhere"
    return "not resolved: a kink, a pole or noise" if demand > 1.0 else ""


def _factor(demand: float) -> float:
    """Change of length (4) after a rejection."""
    if not math.isfinite(demand):
        return LEAST_LENGTH_FACTOR
    return float(max(LEAST_LENGTH_FACTOR, min(0.7, (SAFETY_FACTOR / demand) ** (1.0 / DEGREE))))


def growth(panel: Panel) -> float:
    """Change of length (4) after a panel was accepted."""
    if panel.demand == 0.0:
        return LARGEST_LENGTH_FACTOR
    return float(
        max(
            LEAST_LENGTH_FACTOR,
            min(LARGEST_LENGTH_FACTOR, (SAFETY_FACTOR / panel.demand) ** (1.0 / DEGREE)),
        )
    )
