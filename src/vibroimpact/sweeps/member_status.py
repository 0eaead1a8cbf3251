"""Status of the members of an ensemble: reasons for the end of their runs."""

from __future__ import annotations

from vibroimpact._core.codes import NamedCode
from vibroimpact.simulation.simulate import RunEnd

NOT_COMPUTED = -1  # value of ``end`` of a member whose tile is not in the store yet


class MemberStatus(NamedCode):
    """Reason for the end of a member's run; ``sentence`` gives it in words."""

    OK = 0
    MAX_IMPACTS = 1
    UNDECIDED = 2
    STALLED = 3
    MISSING = 4
    INITIAL_PENETRATION = 5
    INTERRUPTED = 6
    DIVERGED = 8
    STEPS = 9

    @property
    def sentence(self) -> str:
        """The reason in words."""
        return _SENTENCES[self]


_SENTENCES = {
    MemberStatus.OK: "the end of the window was reached",
    MemberStatus.MAX_IMPACTS: "most_impacts was reached, or four times as many events, before the window ended",
    MemberStatus.MISSING: "a set of closed contacts could not be compiled",
    MemberStatus.INITIAL_PENETRATION: "the start lies behind a stop",
}
_SENTENCES |= {end: RunEnd[end.name].sentence for end in MemberStatus if end not in _SENTENCES}
