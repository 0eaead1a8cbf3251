"""Results in plain words, for readers who do not know the field: numbers with units, motions."""

from __future__ import annotations

import math
import re

from vibroimpact._core.quantities import with_unit
from vibroimpact.response.answers import SILENT, Answer, is_silent

SHOWN_DIGITS = 4
SYMBOL = re.compile(r"(\d+)-(\d+-\d+(?:,\d+-\d+)*)(?: \(contact .*\))?")
KINDS = {  # what a motion does, the calmest first
    SILENT: "has no impacts",
    "one": "repeats every forcing period, with impacts",
    "several": "repeats after several forcing periods, with impacts",
    "not periodic": "does not repeat exactly: two rhythms, or a slow change",
    "chaotic": "is irregular (chaotic) and never repeats",
}


def number(value: float, unit: str = "", *, digits: int = SHOWN_DIGITS) -> str:
    """A number to a few digits with its unit, in mm or kN where that reads better."""
    if not math.isfinite(value):
        return "unbounded" if math.isinf(value) else "not known"
    return with_unit(value, unit=unit, digits=digits)


def kind_of(motion: str) -> str:
    """Key of :data:`KINDS` for the name of a motion."""
    if motion in KINDS:
        return motion
    if is_silent(motion):
        return SILENT
    return "one" if motion.startswith("1-") else "several"


def motion_in_words(motion: str) -> str:
    """Say what a motion does, from its name: "repeats every forcing period, with 1 impact ..."."""
    kind = kind_of(motion)
    found = SYMBOL.fullmatch(motion)
    if found is None or kind == SILENT:
        return KINDS[kind]
    cycles, pairs = int(found[1]), [pair.split("-") for pair in found[2].split(",")]
    period = "every forcing period" if cycles == 1 else f"every {cycles} forcing periods"
    counts = [int(count) for pair in pairs for count in pair]
    if len(counts) > 2:
        return f"repeats {period}, with {_impacts(sum(counts))} at all stops together"
    a, b = counts
    if a == b:
        return f"repeats {period}, with {_impacts(a)} at each stop"
    each = [f"{_impacts(n)} at stop {stop}" for n, stop in ((a, "A"), (b, "B")) if n]
    return f"repeats {period}, with {' and '.join(each)}"


def _impacts(count: int) -> str:
    return "1 impact" if count == 1 else f"{count} impacts"


def value_of(answer: Answer) -> str:
    """Value that is measured of a motion, with its unit."""
    return number(answer.value, answer.shown.unit)


def place_of(answer: Answer) -> str:
    """Place of a motion on the band, with its unit."""
    return number(answer.parameter_shown, answer.shown.unit_across)
