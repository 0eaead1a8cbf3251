"""Members of a sweep from the options: axes of the grid, the system, starts, observers."""

from __future__ import annotations

import argparse
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import fields, replace
from typing import Any, TypeVar, cast

import numpy as np

from vibroimpact._core.errors import InvalidParameterError
from vibroimpact._core.types import Floats
from vibroimpact.cli import common
from vibroimpact.machines.machine import Machine
from vibroimpact.machines.toml_file import Case
from vibroimpact.model.mechanism import Mechanism
from vibroimpact.model.parameters import with_parameters
from vibroimpact.model.state import STATE, State, names_of_state
from vibroimpact.model.system import mechanism_of
from vibroimpact.sweeps.axes import corners
from vibroimpact.sweeps.observers.observer import Observer
from vibroimpact.sweeps.observers.selection import observer_of
from vibroimpact.sweeps.starts import GridStarts, RandomStarts, Start

T = TypeVar("T")
Parse = Callable[[str, str], T]  # from NAME=... and the name of the option

GRID = "NAME=LOW:HIGH:COUNT"
RANGE = "NAME=LOW:HIGH"
MOST = 10**7  # values of an axis
MEASURE = (
    "What is measured: x1 (its amplitude), rms v1, transmissibility x1, power, contact force 0, "
    "impact speed and others: docs/design.md."
)
STATED = (*STATE, "on_stop", "orbit")


# ---- axes, system, starts ------------------------------------------------------------------------


def over_of(arguments: argparse.Namespace, count: int | None = None) -> dict[str, Floats]:
    """Axes of the grid; ``count`` is their required number."""
    over = _by_name(arguments.over, "over", _values)
    if count is not None and len(over) != count:
        times = {1: "once", 2: "twice"}[count]
        raise InvalidParameterError(f"over = {', '.join(over)}: give --over {GRID} {times}.")
    return over


def ranges_of(texts: list[str], option: str) -> dict[str, tuple[float, float]]:
    """Ranges NAME=LOW:HIGH by name."""
    return _by_name(texts, option, _range)


def add_band(parser: argparse._ActionsContainer, function: Callable[..., Any]) -> None:
    """Add what varies while a machine runs, its band, and what a function measures over it."""
    parser.add_argument(
        "--over", required=True, action="append", metavar=RANGE,
        help="the parameter, usually omega, and its band",
    )  # fmt: skip
    parser.add_argument("--unit", metavar="UNIT", help="Hz, of a band of forcing frequencies")
    common.add_arguments_of(parser, function, ["measure"], measure=MEASURE)


def band_of(arguments: argparse.Namespace) -> tuple[str, tuple[float, float]]:
    """The parameter that varies, and its band."""
    over = ranges_of(arguments.over, "over")
    if len(over) != 1:
        raise InvalidParameterError(f"over = {', '.join(over)}: give --over {RANGE} once.")
    return next(iter(over.items()))


def case_of(arguments: argparse.Namespace, over: dict[str, Floats]) -> Case:
    """System; a parameter that only the grid fixes has the middle of its axis."""
    if not arguments.config:
        _check_names("over", over, common.parameters_in(arguments))
        for name in over:
            if getattr(arguments, name) is None:
                setattr(arguments, name, float((over[name].min() + over[name].max()) / 2.0))
    return common.case_of(arguments)


def base_of(
    arguments: argparse.Namespace, case: Case, over: Mapping[str, Floats] | None = None
) -> State:
    """Requested state, or else the default start of the machine."""
    if common.given(arguments, STATED) or case.start or not isinstance(case.system, Machine):
        return common.start_of(arguments, case)
    start = _free_start(case.system, over or {})
    return start if arguments.perturb is None else start.perturbed(arguments.perturb)


def _free_start(machine: Machine, over: Mapping[str, Floats]) -> State:
    """Default start that is behind no stop at all corners of the grid, if one of theirs is."""
    try:
        systems = [cast(Machine, with_parameters(machine, corner)) for corner in corners(over)]
        mechanisms = [mechanism_of(system) for system in systems]
    except InvalidParameterError:
        return machine.free_start()  # the sweep refuses these values, with the reason
    starts = [one.free_start() for one in (machine, *systems)]
    clear = (start for start in starts if all(_is_clear(start, m) for m in mechanisms))
    return next(clear, starts[0])


def _is_clear(start: State, mechanism: Mechanism) -> bool:
    """Whether a start lies between all stops."""
    places = [(contact, np.dot(contact.row, start.position)) for contact in mechanism.rigid_stops]
    return all(contact.lower <= place <= contact.upper for contact, place in places)


def start_of(arguments: argparse.Namespace, case: Case, over: Mapping[str, Floats]) -> Start:
    """One start or many."""
    base = base_of(arguments, case, over)
    random = common.given(arguments, ["starts", "seed"])
    if arguments.grid:
        if random or arguments.vary:
            raise InvalidParameterError("grid: excludes --starts, --seed and --vary.")
        return GridStarts(_coordinates(arguments.grid, "grid", base, _values), base)
    if "starts" not in random:
        if random or arguments.vary:
            raise InvalidParameterError("seed, vary: are for random starts. Give --starts COUNT.")
        return base
    return _random(arguments, base)


def _random(arguments: argparse.Namespace, base: State) -> RandomStarts:
    if arguments.starts < 1 or not arguments.vary:
        raise InvalidParameterError(
            f"starts = {arguments.starts}: must be >= 1, with --vary {RANGE}, a coordinate and "
            "its range."
        )
    ranges = _coordinates(arguments.vary, "vary", base, _range)
    return RandomStarts(arguments.starts, arguments.seed or 0, ranges, base)


# ---- NAME=... ------------------------------------------------------------------------------------


def _coordinates(texts: list[str], option: str, base: State, parse: Parse[T]) -> dict[str, T]:
    """Values or ranges of coordinates of the start, by name."""
    found = _by_name(texts, option, parse)
    _check_names(option, found, names_of_state(len(base.position)))
    return found


def _check_names(option: str, names: Iterable[str], known: Sequence[str]) -> None:
    for name in names:
        if name not in known:
            raise InvalidParameterError(f"{option} = {name}: must be one of {', '.join(known)}.")


def _by_name(texts: list[str], option: str, parse: Parse[T]) -> dict[str, T]:
    """Parsed values of NAME=..., by name; each name once."""
    found: dict[str, T] = {}
    for text in texts:
        name = text.partition("=")[0]
        if name in found:
            raise InvalidParameterError(f"{option} = {name}: is given twice. Give each name once.")
        found[name] = parse(text, option)
    return found


def _values(text: str, option: str) -> Floats:
    """Values from LOW:HIGH:COUNT, or from a list."""
    form = f"{GRID} or NAME=A,B,..."
    parts = _parts(text, option, form)
    if len(parts) == 1:
        values = _numbers(parts[0].split(","), text, option, form)
        if len(set(values)) < len(values):
            raise InvalidParameterError(f"{option} = {text}: must have each value once.")
        return np.array(values)
    if len(parts) != 3:
        raise InvalidParameterError(f"{option} = {text}: must be {form}.")
    low, high, count = _numbers(parts, text, option, form)
    if count not in range(1, MOST + 1):
        raise InvalidParameterError(
            f"{option} = {text}: COUNT must be a whole number from 1 to {MOST}."
        )
    return np.linspace(low, high, int(count))


def _range(text: str, option: str) -> tuple[float, float]:
    """Range from LOW:HIGH."""
    parts = _parts(text, option, RANGE)
    if len(parts) != 2:
        raise InvalidParameterError(f"{option} = {text}: must be {RANGE}.")
    low, high = _numbers(parts, text, option, RANGE)
    if not low < high:
        raise InvalidParameterError(f"{option} = {text}: must be {RANGE} with LOW < HIGH.")
    return low, high


def _parts(text: str, option: str, form: str) -> list[str]:
    """Parts of a text after the name."""
    name, _, values = text.partition("=")
    if not name:
        raise InvalidParameterError(f"{option} = {text}: must be {form}.")
    return values.split(":")


def _numbers(parts: list[str], text: str, option: str, form: str) -> list[float]:
    """Parse finite numbers."""
    try:
        numbers = [float(part) for part in parts]
    except ValueError:
        numbers = [np.nan]
    if not np.isfinite(numbers).all():
        raise InvalidParameterError(f"{option} = {text}: must be {form}, finite numbers.")
    return numbers


# ---- observers -----------------------------------------------------------------------------------


OPTIONS: dict[str, tuple[Callable[[str], Any], str]] = {  # by type: parser, words
    "int": (int, "a whole number"),
    "float": (float, "a number"),
    "StopName": (str, "A or B"),
    "str": (str, "a name"),
    "tuple[float, ...]": (lambda text: [float(x) for x in text.split("/")], "numbers, as 1/-1"),
}


def observed(arguments: argparse.Namespace) -> list[Observer]:
    """Observers with their options."""
    texts = [text.strip() for text in arguments.observe.split(",")]
    return [_observer(text) for text in texts if text]


def _observer(text: str) -> Observer:
    """Observer from NAME, or NAME:OPTION=VALUE:..."""
    name, *options = text.split(":")
    plain = cast(Any, observer_of(name))
    types = {f.name: str(f.type) for f in fields(plain)}
    given = {}
    for option in options:
        key, _, value = option.partition("=")
        if key not in types:
            allowed = f"one of {', '.join(types)}" if types else "left out"
            raise InvalidParameterError(f"observe = {text}: {key!r} must be {allowed}.")
        if key in given:
            raise InvalidParameterError(f"observe = {text}: {key} is given twice.")
        parse, words = OPTIONS[types[key]]
        try:
            given[key] = parse(value)
        except ValueError:
            raise InvalidParameterError(f"observe = {text}: {key} must be {words}.") from None
    return cast(Observer, replace(plain, **given))
