"""The page's permalink: machine, parameters and start as the text after # in its address."""

from __future__ import annotations

from urllib.parse import parse_qsl, quote

from vibroimpact._core.errors import InvalidParameterError
from vibroimpact.explorer.page_data import page_name, values_of
from vibroimpact.model.parameters import with_parameters
from vibroimpact.model.state import State
from vibroimpact.model.system import System


def link_of(system: System, start: State) -> str:
    """The permalink of a system at a start."""
    words = {"machine": page_name(system)} | {k: repr(x) for k, x in values_of(system).items()}
    words |= {"x": _list(start.position), "v": _list(start.velocity), "phase": repr(start.phase)}
    return "&".join(
        f"{quote(name, safe='')}={quote(word, safe=',')}" for name, word in words.items()
    )


def read_link(link: str, system: System, start: State) -> tuple[System, State]:
    """System and start of a permalink; what it leaves out is as in those given.

    Raises
    ------
    InvalidParameterError
        Another machine, a parameter that this one does not have, values that it does not take.
    """
    words = dict(parse_qsl(link.replace("+", "%2B")))
    name, ours = words.pop("machine", ""), page_name(system)
    if name != ours:
        raise InvalidParameterError(
            f"link = {link!r}: must be of the machine {ours}. Give the other one."
        )
    place = {"position": start.position, "velocity": start.velocity, "phase": (start.phase,)}
    try:
        for key, field in (("x", "position"), ("v", "velocity"), ("phase", "phase")):
            if key in words:
                place[field] = tuple(map(float, words.pop(key).split(",")))
        values = {key: float(word) for key, word in words.items()}
    except ValueError:
        raise InvalidParameterError(f"link = {link!r}: must have numbers. Copy it again.") from None
    (phase,) = place["phase"]
    return with_parameters(system, values), State(place["position"], place["velocity"], phase)


def _list(numbers: tuple[float, ...]) -> str:
    return ",".join(map(repr, numbers))
