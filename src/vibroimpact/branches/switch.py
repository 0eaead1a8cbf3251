"""Branch switching: other branches of orbits through a special point."""

from __future__ import annotations

from vibroimpact._core.checks import range_of
from vibroimpact._core.errors import InvalidParameterError
from vibroimpact._core.progress import ProgressOption, Reporter, interruptible
from vibroimpact.branches.beginning import neighbouring
from vibroimpact.branches.branch import Branch
from vibroimpact.branches.continue_orbit import followed
from vibroimpact.branches.family import OrbitFamily
from vibroimpact.branches.point import BifurcationPoint, NotFound, check_point
from vibroimpact.branches.stop_rules import RuleError, StopWhen, stop_rule
from vibroimpact.continuation import Steps
from vibroimpact.continuation.walk import check_steps


@interruptible
def switch_branch(
    point: BifurcationPoint,
    bounds: tuple[float, float] | None = None,
    *,
    steps: Steps | None = None,
    stop_when: StopWhen | None = None,
    progress: ProgressOption = True,
) -> Branch | NotFound:
    """Follow the other branch through a special point.

    Parameters
    ----------
    point
        A special point of a branch at which orbits begin: the kinds in kinds.py with ``begins``, and where an element
        changes its sequence of states every touch.
    bounds
        (low, high) of the parameter; by default those of the point's branch.
    steps, stop_when, progress
        As for :func:`~vibroimpact.continue_orbit`.

    Returns
    -------
    Branch or NotFound
        :class:`NotFound` states the reason: another kind of point (at which the same orbits
        continue, or a circle is born), or a start that did not converge.

    Raises
    ------
    InvalidParameterError
        Not a special point; a range that is empty, without the point or no wider than rounding; a
        ``stop_when`` that is not a rule.
    """
    check_point(point, OrbitFamily, "a special point of a branch, such as branch['PD1']")
    check_steps(steps, progress)
    wanted = point.bounds if bounds is None else bounds
    low, high = range_of("bounds", wanted, point.name, point.parameter)
    begins = neighbouring if point.of_element else point.record.begins
    if begins is None:
        return NotFound(point, f"at a point of kind {point.kind} no other branch of orbits begins")
    start = begins(point, (low, high))
    if isinstance(start, NotFound):
        return start
    begin = stop_rule(stop_when, start.family, (low, high))
    try:
        with Reporter(progress, "branch") as report:
            told = report.counted("points", point.name)
            return followed(start, (low, high), steps, begin, told)
    except RuleError:
        raise
    except InvalidParameterError as error:  # the start does not converge
        return NotFound(point, str(error))
