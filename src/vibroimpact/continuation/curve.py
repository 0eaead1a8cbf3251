"""Continued curve: its points, its special points, and the reasons of its ends."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from enum import StrEnum

from vibroimpact._core.labels import counted
from vibroimpact._core.types import (
    Amounts,
    AnyAmount,
    AnyFloats,
    Count,
    Counts,
    Floats,
    Rising,
    Sign,
)
from vibroimpact.results.result import along, rows, sized


class Stopped(StrEnum):
    """Reasons for the end of a curve, of a branch, or of a family of circles."""

    RANGE = "the parameter reached the end of its range"
    EVENT = "a terminal event was reached"
    CLOSED = "the curve returned to its start"
    REPEATED = "beyond this branch point the same solutions repeat"
    POINTS = "the number of points was reached"
    STEP = "the step fell below its minimum"
    BORN = "the circle shrinks to a periodic orbit (Neimark-Sacker)"
    BREAKING = "the circle loses its smoothness"
    RULE = "the rule stop_when ended it"
    NO_MOTION = "its orbits are no motions of the machine beyond this point"
    INTERRUPTED = "it was interrupted"
    NOT_FOLLOWED = "it was not followed in this direction"


@dataclass(frozen=True)
class End:
    """One end of a curve.

    Attributes
    ----------
    reason
        Why the curve stopped.
    detail
        Details: the name of the event, or the failure below the minimal step.
    parameter
        The parameter at the bifurcation of BORN.
    """

    reason: Stopped
    detail: str = ""
    parameter: float | None = None

    def __str__(self) -> str:
        return f"{self.reason.value}{': ' if self.detail else ''}{self.detail}"


@dataclass(frozen=True, eq=False, kw_only=True)
class LocatedPoint:
    """A zero of a test function on a curve.

    Attributes
    ----------
    test
        The test function; those of folds and simple branch points are built in (panel.py).
    parameter
        Value of the parameter.
    z
        The solution there, shape (d,).
    tangent
        Unit tangent there in the metric of ``Problem.scale``, in unscaled unknowns with the
        parameter last, shape (d + 1,).
    arclength
        Position along the curve, scaled arclength from its start.
    error
        Estimated error of ``parameter``.
    crossing
        +1 where the test function rises with the arclength, -1 where it falls.
    """

    test: str
    parameter: float
    z: Floats = field(metadata=sized("unknown"), repr=False)
    tangent: Floats = field(metadata=sized("direction"), repr=False)
    arclength: float
    error: AnyAmount
    crossing: Sign


@dataclass(frozen=True)
class Unresolved:
    """Part of a curve where zeros of a test function may have been missed.

    Attributes
    ----------
    name
        The test function.
    first, last
        Indices of the points at the ends of the part.
    reason
        "not finite", "zero everywhere", or that its expansion does not converge.
    """

    name: str
    first: Count
    last: Count
    reason: str


@dataclass(frozen=True, eq=False)
class Curve:
    """Points of a solution curve, in order of its arclength.

    Attributes
    ----------
    parameter
        Shape (n,).
    z
        Solutions, shape (n, d).
    tangent
        Unit tangents in the metric of ``Problem.scale``, in unscaled unknowns with the
        parameter last, shape (n, d + 1).
    arclength
        Scaled arclength from the start, negative before it, shape (n,).
    residual
        Largest |F_i|, relative to the length of its row of the scaled Jacobian, shape (n,).
    steps
        Evaluations of F that each point took, shape (n,).
    panel
        Number of the panel of each point, 0, 1, ... along the curve, shape (n,).
    tests
        Values of each test function, shape (n,).
    special
        Special points in order of the arclength.
    ends
        Why the curve ended before its start and after it.
    start
        Index of the starting point.
    unresolved
        Parts where test functions could not be resolved.
    rejected
        Panels that were tried and rejected.
    """

    parameter: Floats = field(metadata=sized("point"), repr=False)
    z: Floats = field(metadata=along("point", "unknown"))
    tangent: Floats = field(metadata=along("point", "direction"))
    arclength: Rising = field(metadata=along("point"))
    residual: Amounts = field(metadata=along("point"))
    steps: Counts = field(metadata=along("point"))
    panel: Counts = field(metadata=along("point"))
    tests: Mapping[str, AnyFloats] = field(metadata=sized("point"), repr=False)
    special: tuple[LocatedPoint, ...] = field(metadata=rows("zero"))
    ends: tuple[End, End]
    start: Count
    unresolved: tuple[Unresolved, ...] = field(metadata=rows("unresolved"))
    rejected: Count

    def __len__(self) -> int:
        return len(self.parameter)

    @property
    def interrupted(self) -> bool:
        """Whether an interruption ended it."""
        return any(end.reason is Stopped.INTERRUPTED for end in self.ends)

    def named(self, name: str) -> Iterator[LocatedPoint]:
        """The special points of one test function, in order."""
        return (point for point in self.special if point.test == name)

    def __repr__(self) -> str:
        found = counted(point.test for point in self.special)
        return (
            f"Curve of {len(self)} points, parameter {self.parameter.min():.8g} to "
            f"{self.parameter.max():.8g}, {found}\n"
            f"  before the start: {self.ends[0]}\n  after the start: {self.ends[1]}"
        )
