"""Kinds of special points of branches, of codimension one: the table to which a new kind is added.

Smooth ones are those of maps (normal_forms/codimension_one.py), to which this adds what begins there. The others are of
orbits alone. A kind whose test function is a ``function`` of the orbit's states, flight times and parameters needs
nothing else: it is found on branches and on curves, and followed in two parameters.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Any

from vibroimpact._core.checks import refusal, shown
from vibroimpact._core.errors import InvalidParameterError
from vibroimpact.branches.beginning import branching, doubled, grown, neighbouring, shrunk
from vibroimpact.branches.chatter import chatter_end
from vibroimpact.branches.family import (
    CHATTER,
    EVENT,
    EXTREMUM,
    FLIGHT,
    PROGRESS,
    REST,
    SPEED,
    STICK,
    OrbitFamily,
)
from vibroimpact.branches.touch import touch
from vibroimpact.normal_forms import codimension_one as maps
from vibroimpact.normal_forms.kind import PointKind, by_label

Function = Callable[[Any, Any, Any], Any]
"""g(states, durations, parameters): arrays of numbers, shapes (m, 2n + 1) and (m,), and parameters by name."""

SN, NS = maps.SN, maps.NS
BREAKING = replace(maps.BREAKING, begins=branching)
PD = replace(maps.PD, begins=doubled, in_half_map=BREAKING)
BP = replace(maps.BP, begins=branching, in_half_map=BREAKING)
GR = PointKind(
    "GR", "grazing", "grazing: a stop is touched between the impacts", touch=True, begins=grown, normal_form=touch,
    of_element="grazing: a limit of an element is only touched",
)  # fmt: skip
ZERO = PointKind(
    "ZERO", "zero impact speed", "zero impact speed: an impact becomes a touch", touch=True, test=SPEED, begins=shrunk,
    normal_form=touch, of_element="zero rate: a limit of an element is only touched",
)  # fmt: skip
SIM = PointKind(
    "SIM", "two impacts at once", "two impacts at once: beyond it they change order", touch=True, test=FLIGHT,
    of_element="two events at once: beyond it their sequence is another",
)  # fmt: skip
STICKING = PointKind(
    "STICK", "onset of sticking", "onset of sticking: a plastic impact no longer opens at once", test=STICK,
    touch=True, begins=neighbouring, of_element="onset of sticking: friction no longer reverses at once",
)  # fmt: skip
RESTING = PointKind(
    "REST", "rest begins", "rest begins or ends: a stop is rested on for no time", touch=True, test=REST,
    begins=neighbouring, of_element="stick begins or ends: friction sticks for no time",
)  # fmt: skip
CHATTERING = PointKind(
    "CHAT", "chatter is completed", "completed chatter begins or ends: the rest after it takes no time, and sequences "
    "of ever more impacts accumulate there", touch=True, test=CHATTER, begins=neighbouring, normal_form=chatter_end,
)  # fmt: skip
CROSSING = PointKind(
    "CS", "crossing-sliding", "crossing-sliding: a plastic impact that opens at once begins to rest, or ends to",
    touch=True, begins=neighbouring, power=2,
    of_element="crossing-sliding: a slip that reverses begins to stick in between, or ends to",
)  # fmt: skip
SLIDING_TOUCH = PointKind(
    "GS", "grazing-sliding", "grazing-sliding: a slip that goes on begins to stick in between, or ends to",
    touch=True, begins=neighbouring, power=1,
)  # fmt: skip
SWITCHING = PointKind(
    "SS", "switching-sliding", "switching-sliding: a rest begins to open once before it lasts, or ends to",
    touch=True, begins=neighbouring, power=3,
    of_element="switching-sliding: a stick begins to slip back once before it lasts, or ends to",
)  # fmt: skip
ADDING = PointKind(
    "AS", "adding-sliding", "adding-sliding: a rest begins to open once in between, or ends to", touch=True,
    begins=neighbouring, power=2,
    of_element="adding-sliding: a stick begins to slip once in between, or ends to",
)  # fmt: skip
STANDING = PointKind(
    "STILL", "no progress", "zero progress: beyond it the machine advances the other way", test=PROGRESS,
)  # fmt: skip
EXTREME = PointKind(
    "PEAK", "extremal progress", "extremal progress: beside it the machine advances less, or more", test=EXTREMUM,
)  # fmt: skip
LEVEL = PointKind("level", "level of a function", "level: a function keeps its value")
ONE = by_label((
    SN, PD, NS, BP, GR, ZERO, SIM, STICKING, RESTING, CHATTERING, CROSSING, SLIDING_TOUCH, SWITCHING,
    ADDING, STANDING, EXTREME, LEVEL,
))  # fmt: skip

OF_TESTS = {kind.test: kind for kind in ONE.values() if kind.test}
EVENTS = by_label(kind for kind in ONE.values() if kind.function)


def events_of(given: Mapping[str, Function] | None) -> dict[str, PointKind]:
    """Kinds with a test function of their own: those of the table, and a user's by their labels.

    Raises
    ------
    InvalidParameterError
        What is no mapping of labels to functions; a label of the table, or one with a digit at its end.
    """
    if given is None:
        return EVENTS
    if not isinstance(given, Mapping):
        raise refusal("test_functions", given, "a mapping of labels to functions of an orbit")
    for label, function in given.items():
        if not str(label).isalpha() or label in ONE:
            raise InvalidParameterError(
                f"test_functions: label {label!r}: must be a word of letters, none of {', '.join(ONE)}."
            )
        if not callable(function):
            raise refusal(f"test_functions[{label!r}]", function, "a function of an orbit")
    return EVENTS | {
        label: PointKind(label, label, f"{label} is zero", function=function)
        for label, function in given.items()
    }


def kind_of_test(family: OrbitFamily, name: str) -> tuple[PointKind, int]:
    """Kind of the zeros of a test function, and the number of the segment or -1."""
    word, _, rest = name.partition(" ")
    if word == EVENT:
        return family.events[rest], -1
    return OF_TESTS[word].of_map(symmetric=family.signature.symmetric), int(rest) if rest else -1


def checked_value(name: str, function: Any, arguments: tuple[Any, Any, Any]) -> float:
    """Value of a user's function at the start, which must be a number."""
    try:
        value = float(function(*arguments))
    except (TypeError, ValueError, IndexError, KeyError, AttributeError) as error:
        raise InvalidParameterError(
            f"{name} = {shown(function)}: failed ({error}). It takes states, durations, parameters and returns "
            "a number."
        ) from error
    if not math.isfinite(value):
        raise InvalidParameterError(
            f"{name} = {shown(function)}: is {value} at the start; it must be finite there."
        )
    return value
