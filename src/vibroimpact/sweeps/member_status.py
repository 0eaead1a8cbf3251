"""Status of the members of an ensemble: reasons for the end of their runs."""

from __future__ import annotations

from vibroimpact._core.reason import Reason
from vibroimpact.simulation.simulate import RunEnd

NOT_COMPUTED = -1  # value of ``end`` of a member whose tile is not in the store yet


class MemberStatus(Reason):
    """Reason for the end of a member's run, with a ``sentence``."""

    OK = 0, "the end of the window was reached"
    MAX_IMPACTS = (
        1,
        "most_impacts was reached, or four times as many events, before the window ended",
    )
    UNDECIDED = 2, RunEnd.UNDECIDED.sentence
    STALLED = 3, RunEnd.STALLED.sentence
    MISSING = 4, "a set of closed contacts could not be compiled"
    INITIAL_PENETRATION = 5, "the start lies behind a stop"
    INTERRUPTED = 6, RunEnd.INTERRUPTED.sentence
    DIVERGED = 8, RunEnd.DIVERGED.sentence
    STEPS = 9, RunEnd.STEPS.sentence
