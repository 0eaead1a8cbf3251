"""Special point of a branch, of a curve of bifurcations, or of a family of circles."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

from vibroimpact._core.checks import check_kind, refusal
from vibroimpact._core.types import Complexes, Count, Index, OneOrTwoBounds
from vibroimpact.compile.prescribed import GAP_WATCH
from vibroimpact.continuation import LocatedPoint
from vibroimpact.machines.units import units_of
from vibroimpact.normal_forms.critical import Refusal, Status
from vibroimpact.normal_forms.kind import PointKind
from vibroimpact.orbits.admissibility import Nearest
from vibroimpact.orbits.maps import why_no_map
from vibroimpact.orbits.orbit import Orbit

TOUCH_RELATIVE = 1e-7  # the overlap at a touch is smaller: square roots halve the digits


def is_motion(solution: Any, record: PointKind) -> bool:
    """Whether a solution is a motion of the machine; at a touch, apart from rounding there."""
    if not record.touch:
        return bool(getattr(solution, "admissible", True))  # fixed points of maps always are
    if isinstance(solution, Orbit):
        return solution.converged and not solution.why_inadmissible(TOUCH_RELATIVE)
    return True


@dataclass(frozen=True)
class NotFound:
    """Reason why nothing was found at a special point."""

    point: BifurcationPoint
    reason: str

    def __repr__(self) -> str:
        return f"NotFound at {self.point.label}: {self.reason}"


@dataclass(frozen=True, eq=False, repr=False, kw_only=True)
class BifurcationPoint(LocatedPoint):
    """Special point of a branch, or of a curve of bifurcations, on which there are two parameters.

    It has the attributes of a :class:`~vibroimpact.continuation.LocatedPoint`, too; on a curve its parameter is the
    second one.

    Attributes
    ----------
    record
        Record of its kind.
    label
        Kind and number along the branch, "NS1"; of a curve "R4_1", and for a weak resonance p/q "2/9_1".
    parameters
        Value of each parameter by name.
    orbit
        The orbit there; of a map the :class:`~vibroimpact.normal_forms.explicit.FixedPoint`, of a family of circles the
        :class:`~vibroimpact.tori.circle.Circle`.
    problem
        The equations that were followed.
    bounds
        Range of the parameter in which the branch was followed; of a curve both ranges.
    curve
        Kind of the curve on which it lies; None of a branch.
    nearest
        Stop that is touched, and where, if a gap vanishes between the impacts; else None.
    segment
        Number of the solved impact or flight to which it belongs; -1 where it belongs to none.
    images
        Number of places of the orbit at which it happens at once: 2 where the orbit is its own mirror image, and
        was not solved for as such.
    """

    record: PointKind
    label: str
    parameters: Mapping[str, float]
    orbit: Any
    problem: Any = field(repr=False)
    bounds: OneOrTwoBounds
    curve: PointKind | None = None
    nearest: Nearest | None = None
    segment: Index = -1
    images: Count = 1

    @property
    def kind(self) -> str:
        """Label of its kind."""
        return self.record.label

    @property
    def name(self) -> str:
        """Name of the parameter; of a curve that of the second one."""
        return [*self.parameters][-1]

    @property
    def meaning(self) -> str:
        """Sentence about what happens at the point."""
        return self.record.of_element if self.of_element else self.record.meaning

    @property
    def of_element(self) -> bool:
        """Whether a touch, or another change of the sequence, is that of an element's guard."""
        if not self.record.of_element or not isinstance(self.orbit, Orbit):
            return False
        if self.nearest:
            return self.nearest.watch != GAP_WATCH
        signature, rigid = self.orbit.signature, len(self.orbit.mechanism.rigid_stops)
        both = signature.impacts[self.segment], signature.solved[self.segment]
        return any(stop.contact >= rigid for stop in both)

    @property
    def resonance(self) -> tuple[int, int] | None:
        """(p, q) of a strong or a weak resonance p/q; else None."""
        p, weak, q = self.test.partition("/")
        return (int(p), int(q)) if weak else self.record.resonance

    @property
    def multipliers(self) -> Complexes:
        """Floquet multipliers of the full map; on a curve those of the map whose resonance it is, the solved one."""
        on_branch = self.curve is None
        found: Complexes = (
            self.orbit.multipliers
            if on_branch
            else self.problem.multipliers(self.z, self.parameter)
        )
        return found

    @property
    def admissible(self) -> bool:
        """Whether the orbit is a motion of the machine, apart from rounding at a touch."""
        return is_motion(self.orbit, self.record)

    @cached_property
    def normal_form(self) -> Any:
        """Normal form, of the half map for a symmetric orbit; or a refusal with the reason."""
        record = self.record
        if record.normal_form is None:
            rough = not record.function and self.curve is None
            why = "the map is not smooth there" if rough else "no normal form is known of this kind"
            if record.power:
                why = f"beyond it the map changes by the power {record.power} of the distance; no coefficient is known"
            reason = f"{self.kind} ({self.meaning}): {why}."
            return Refusal(self.kind, Status.NOT_SMOOTH, reason, self.multipliers)
        smooth = bool(record.critical)
        if smooth and isinstance(self.orbit, Orbit) and (why := why_no_map(self.orbit.problem)):
            return Refusal(self.kind, Status.NOT_SMOOTH, f"{self.kind}: {why}.", self.multipliers)
        given = self.problem.forms(self.z, self.parameter) if smooth else self
        located = {"located": True} if record.of_coefficient and self.curve else {}
        return record.normal_form(record, given, **located)

    def __repr__(self) -> str:
        units = units_of(getattr(self.orbit, "system", None))
        at = ", ".join(
            f"{name} = {units.of_parameter(name, value, digits=9)}"
            for name, value in self.parameters.items()
        )
        real = "" if self.admissible else ", not admissible"
        twice = ", there and at its mirror image" if self.images > 1 else ""
        return f"{self.label} at {at}: {self.meaning}{twice}{real}"


def check_point(point: Any, of: type, wanted: str) -> None:
    """Refuse what is no special point, and one of other equations than those of a type."""
    check_kind("point", point, BifurcationPoint, wanted)
    if not isinstance(point.problem, of):
        raise refusal("point", point, wanted)
