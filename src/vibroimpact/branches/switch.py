"""Branch switching: other branches of orbits through a special point."""

from __future__ import annotations

from vibroimpact._core.checks import check_flag, range_of
from vibroimpact._core.errors import InvalidParameterError
from vibroimpact._core.progress import ProgressOption, Reporter, interruptible
from vibroimpact.branches.beginning import begins_at
from vibroimpact.branches.branch import Branch
from vibroimpact.branches.continue_orbit import following
from vibroimpact.branches.family import OrbitFamily
from vibroimpact.branches.going_on import going_on, no_motions, parted, trimmed
from vibroimpact.branches.point import BifurcationPoint, NotFound, check_point
from vibroimpact.branches.stop_rules import RuleError, StopWhen
from vibroimpact.continuation import Steps
from vibroimpact.continuation.walk import check_steps


@interruptible
def switch_branch(
    point: BifurcationPoint,
    bounds: tuple[float, float] | None = None,
    *,
    steps: Steps | None = None,
    stop_when: StopWhen | None = None,
    inadmissible: bool = False,
    progress: ProgressOption = True,
) -> Branch | NotFound:
    """Follow the other branch through a special point.

    Parameters
    ----------
    point
        A special point of a branch at which orbits begin: the kinds in kinds.py with ``begins``, and every touch.
    bounds
        (low, high) of the parameter; by default those of the point's branch.
    steps, stop_when, inadmissible, progress
        As for :func:`~vibroimpact.continue_orbit`; from a point that is no motion orbits are followed, motions or not,
        in any case.

    Returns
    -------
    Branch or NotFound
        :class:`NotFound` states the reason: another kind of point (at which the same orbits
        continue, or a circle is born), a start that did not converge, or orbits that are no motions.

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
    check_flag("inadmissible", inadmissible)
    inadmissible = inadmissible or not point.admissible
    begins = begins_at(point)
    if begins is None:
        return NotFound(point, f"at a point of kind {point.kind} no other branch of orbits begins")
    start = begins(point, (low, high))
    if isinstance(start, NotFound):
        return start
    try:
        with Reporter(progress, "branch") as report:
            told = report.counted("points", point.name)
            follow = following((low, high), steps, stop_when, told, inadmissible=inadmissible)
            branch = follow(start)
            if inadmissible:
                return branch
            found, borders = trimmed(branch)
            if not found.admissible.any():
                return NotFound(point, f"{no_motions(found)}: inadmissible=True follows them")
            return going_on(found, parted(borders, point)[0], follow)
    except RuleError:
        raise
    except InvalidParameterError as error:  # the start does not converge
        return NotFound(point, str(error))
