"""Common parts of the commands: options from signatures, values of options, the system, the start."""

from __future__ import annotations

import argparse
import inspect
import math
import re
import shlex
from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from dataclasses import replace
from typing import Any, cast

import numpy as np

from vibroimpact._core.checks import check_choice
from vibroimpact._core.docstrings import descriptions, head_of
from vibroimpact._core.errors import InvalidParameterError, VibroImpactError
from vibroimpact._core.types import Floats
from vibroimpact.machines.machine import Machine, parameters_of
from vibroimpact.machines.quantities import TURN, Measured, checked, number_in
from vibroimpact.machines.registry import DEFAULT, MACHINES, case_named, cases_of, machine_of
from vibroimpact.machines.toml_file import OF_STATE, PHYSICAL, Case, HybridCase, read_case
from vibroimpact.machines.units import Units, quantities_of
from vibroimpact.model.hybrid_system import HybridSystem
from vibroimpact.model.mechanism import Mechanism
from vibroimpact.model.parameters import names_of, with_parameters
from vibroimpact.model.state import STATE, State
from vibroimpact.model.system import mechanism_of
from vibroimpact.orbits.orbit import Orbit
from vibroimpact.orbits.symmetric_damper import has_symmetric_orbits, known_orbits
from vibroimpact.response.answers import rest_of
from vibroimpact.results.files import PICTURES
from vibroimpact.results.files import SUFFIXES as DATA
from vibroimpact.simulation.places import At, AtChange, AtPhase, AtStop
from vibroimpact.sweeps.axes import corners

System = Machine | Mechanism | HybridSystem
ROLE = re.compile(r":\w+:`~?(?:\w+\.)*(\w+)`")  # :func:`~vibroimpact.plane`
SIGNS = ("plus", "minus")  # in the order of known_orbits
PLACE = "Where section points are taken: A or B, the upper or the lower stop, B1 that of contact 1"
PHASE = "phase=THETA, once per forcing period"


def place_of(text: str) -> At:
    """Place of a section: A, B1, phase=0.5, change=0, change=0:stick."""
    kind, _, value = text.partition("=")
    element, _, takes = value.partition(":")
    try:
        match kind:
            case "phase":
                return AtPhase(float(value))
            case "change":
                return AtChange(int(element), takes or None)
            case _:
                return AtStop(cast(Any, text[:1]), int(text[1:] or 0))
    except ValueError:
        raise argparse.ArgumentTypeError(
            f"{text}: must be a stop such as A or B1, {PHASE[:11]}, change=ELEMENT or change=ELEMENT:STATE"
        ) from None


TYPES: dict[str, Callable[[str], Any]] = {  # of values in options, by the annotation in Python
    "int": int, "float": float, "AnyFloat": float, "int | None": int, "float | None": float,
    "tuple[float, ...]": lambda text: [float(number) for number in text.split("/")],
    "At | None": place_of, "AtStop | AtPhase | None": place_of,
}  # fmt: skip
GRID = "NAME=LOW:HIGH:COUNT"
RANGE = "NAME=LOW:HIGH"
MOST_AXIS_VALUES = 10**7  # an axis has so many values at most
TIMES = {1: "once", 2: "twice"}

Values = Mapping[str, Sequence[float] | Floats]  # of parameters by name: (low, high), or all


class Failure(VibroImpactError):  # noqa: N818 - a result, reported by the exit status
    """The requested result does not exist or could not be reached; the message gives the reason."""


def check_interrupted(*results: object) -> None:
    """Raise an interruption that a result reports, so that nothing is written."""
    for one in results:
        ends = getattr(one, "ends", ())
        if getattr(one, "interrupted", False) or any(
            getattr(end.reason, "name", "") == "INTERRUPTED" for end in ends
        ):
            raise KeyboardInterrupt


# ---- options from signatures ---------------------------------------------------------------------


def add_arguments_of(
    parser: argparse._ActionsContainer, function: Callable[..., Any], names: Iterable[str],
    number: Callable[[str], float] = float, **own: str,
) -> None:  # fmt: skip
    """Add an option per parameter of a function, with its default and its description.

    A text in ``own`` replaces a description that is written for Python only.
    """
    signature, texts = (
        inspect.signature(function),
        descriptions(function) | {"at": f"{PLACE}; {PHASE}."} | own,
    )
    for name in names:
        parameter = signature.parameters[name]
        kind, default = str(parameter.annotation), parameter.default
        text = ROLE.sub(r"\1", texts.get(name, "")).replace("%", "%%").replace("``", "")
        if kind == "bool":
            parser.add_argument(option(name), action="store_true", default=None, help=text)
            continue
        if default not in (parameter.empty, None, "", ()):
            text += f" (default: {default})"
        several = kind.startswith("Sequence")
        parser.add_argument(
            option(name),
            type=number if TYPES.get(kind) is float else TYPES.get(kind, str),
            nargs="+" if several else None,
            action="extend" if several else "store",
            metavar=name.rpartition("_")[2].upper(),
            help=text,
        )


def command_of(arguments: argparse.Namespace) -> str:
    """The command as it was typed."""
    return shlex.join(["vibroimpact", *arguments.words])


def option(name: str) -> str:
    """Name of an option from that of a parameter: --mass-ratio from mass_ratio."""
    return "--" + name.replace("_", "-")


def given(arguments: argparse.Namespace, names: Iterable[str]) -> dict[str, Any]:
    """Options that the user gave; the others have the defaults of the function."""
    values = {name: getattr(arguments, name, None) for name in names}
    return {name: value for name, value in values.items() if value is not None}


COORDINATES = "x1, x2, ..., v1, v2, ... just after the impact, phase of the force"


def add_axes(parser: argparse.ArgumentParser) -> None:
    """Add the options for the axes of a picture of a section."""
    for name, default in (("--x", "x1"), ("--y", "v1")):
        parser.add_argument(name, help=f"coordinate to draw: {COORDINATES} (default: {default})")


def add_title(parser: argparse._ActionsContainer) -> None:
    """Add the option for the title of a report."""
    parser.add_argument(
        "--title", help="heading of the report; by default what is measured, and of what machine"
    )


# ---- NAME=... ------------------------------------------------------------------------------------


def add_named(
    parser: argparse._ActionsContainer, name: str, form: str, text: str, *, required: bool = False
) -> None:
    """Add an option that takes values or a range by name, and may be repeated."""
    parser.add_argument(
        name, action=_Named, metavar=form, help=text, required=required, default={}
    )  # fmt: skip


def measured(text: str) -> float:
    """Number from the command line, "0.004" or "4 mm"."""
    try:
        return number_in(text)
    except ValueError as error:
        raise argparse.ArgumentTypeError(str(error)) from None


class _Named(argparse.Action):
    """Option NAME=...: a dictionary by name, in which each name is once."""

    def __call__(self, _: object, to: argparse.Namespace, text: Any, __: object = None) -> None:
        known, name = getattr(to, self.dest), text.partition("=")[0]
        if name in known:
            raise InvalidParameterError(
                f"{self.dest} = {name}: is given twice. Give each name once."
            )
        values, written = _values(text, self.dest, str(self.metavar))
        setattr(to, self.dest, {**known, name: values})
        units = getattr(to, "with_units", {})
        to.with_units = units | {(self.dest, name): [x for x in written if isinstance(x, Measured)]}


def _values(text: str, name: str, form: str) -> tuple[Sequence[float] | Floats, Sequence[float]]:
    """Range from LOW:HIGH; values from LOW:HIGH:COUNT, or from a list; and the numbers as written."""
    listed = text.partition("=")[2]
    separator = "," if form == GRID and ":" not in listed else ":"
    rule = f"must be {form} or NAME=A,B,..." if form == GRID else f"must be {form}"
    try:
        numbers = [number_in(number) for number in listed.split(separator)]
    except ValueError as error:
        if re.search(r"\d\s*[A-Za-zµ°%]", listed):
            raise InvalidParameterError(f"{name} = {text}: {error}.") from None
        numbers = [math.nan]
    if text.startswith("=") or (separator == ":" and len(numbers) != form.count(":") + 1):
        raise InvalidParameterError(f"{name} = {text}: {rule}.")
    if not np.isfinite(numbers).all():
        raise InvalidParameterError(f"{name} = {text}: {rule}, finite numbers.")
    if separator == ",":
        if len({*numbers}) < len(numbers):
            raise InvalidParameterError(f"{name} = {text}: must have each value once.")
        return np.array(numbers), numbers
    if form == GRID:
        if numbers[2] not in range(1, MOST_AXIS_VALUES + 1):
            raise InvalidParameterError(
                f"{name} = {text}: COUNT must be a whole number from 1 to {MOST_AXIS_VALUES}."
            )
        return np.linspace(numbers[0], numbers[1], int(numbers[2])), numbers
    if not numbers[0] < numbers[1]:
        raise InvalidParameterError(f"{name} = {text}: {rule} with LOW < HIGH.")
    return (float(numbers[0]), float(numbers[1])), numbers


def band_of(arguments: argparse.Namespace) -> tuple[str, Any]:
    """The one parameter of ``band`` and its bounds; one that is written in hertz is a band in hertz."""
    ((name, band),) = arguments.band.items()
    written = getattr(arguments, "with_units", {}).get(("band", name), [])
    if len(written) == len(band) and all(x.unit == "Hz" for x in written) and not arguments.unit:
        arguments.unit = "Hz"
        band = tuple(x / TURN for x in band)
    return name, band


def check_count(name: str, by_name: Values, count: int, form: str) -> None:
    """Refuse another number of parameters in an option that takes them by name."""
    if len(by_name) != count:
        raise InvalidParameterError(
            f"{name} = {', '.join(by_name)}: give --{name} {form} {TIMES[count]}."
        )  # fmt: skip


# ---- the system ----------------------------------------------------------------------------------


def add_system(parser: argparse.ArgumentParser) -> None:
    """Add the options that define the system: a machine, a case of it, a file, parameters."""
    name = parser.get_default("machine")
    machine, cases = machine_of(name), ", ".join(cases_of(name))
    group = parser.add_argument_group(
        "system",
        f"A named case or a file, and parameters of {name}, which replace those of the case. All "
        f"numbers, given and printed, are in the units of the machine: SI for a [{PHYSICAL}] file, for which "
        "others may be given with the number, 4mm or 45Hz.",
    )
    group.add_argument(
        "case", nargs="?", metavar="CASE",
        help=f"a machine, whose parameters are the options then: {', '.join(MACHINES)} (default: "
        f"{DEFAULT})" + f"; or a published case of it: {name}/{cases}" * bool(cases),
    )  # fmt: skip
    group.add_argument("--config", metavar="FILE", help="a system in TOML: docs/cli.md")
    add_arguments_of(group, machine, parameters_of(machine), measured)
    parser.set_defaults(check=check_case)


def check_case(arguments: argparse.Namespace) -> None:
    """Refuse a case that does not exist, or whose position hides the machine that it names."""
    if arguments.case and case_named(arguments.case)[0] != arguments.machine:
        raise InvalidParameterError(
            f"case = {arguments.case}: must come before the options, which are those of "
            f"{arguments.machine} here."
        )


def case_of(arguments: argparse.Namespace, over: Values | None = None, name: str = "over") -> Case:
    """Requested system; one of modes and guards begins in the mode in which its file starts.

    A parameter of a machine that nothing else fixes is in the middle of its values in ``over``, an
    option of this name.
    """
    case = any_case_of(arguments, over or {}, name)
    if isinstance(case, HybridCase):
        system, start = case.system, case.start
        if start is None:
            return Case(system)
        nothing = (0.0,) * system.states
        return Case(system.beginning_in(start.mode), State(start.state, nothing, start.phase))
    return case


def any_case_of(
    arguments: argparse.Namespace, over: Values | None = None, name: str = "over"
) -> Case | HybridCase:
    """Requested system, a mechanism or one that a file gives as modes and guards."""
    machine = machine_of(arguments.machine)
    known = parameters_of(machine)
    parameters = given(arguments, known)
    if arguments.case and arguments.config:
        raise InvalidParameterError(
            f"case = {arguments.case}, config = {arguments.config}: only one may be given."
        )
    if arguments.config:
        case = read_case(arguments.config)
        if isinstance(case, Case):
            _take_letters(arguments, type(case.system))
            case = _changed(case, parameters)
            _check_units(arguments, case.system)
            return case
        if parameters:
            raise InvalidParameterError(
                f"{option(next(iter(parameters)))}: is a parameter of a machine, and config = {arguments.config} is a "
                "[hybrid]. Change the file."
            )
        return case
    check_case(arguments)
    _take_letters(arguments, machine)
    check_names(name, over or {}, known)
    middle = {one: float(min(x) + max(x)) / 2.0 for one, x in (over or {}).items()}
    of_case = case_named(arguments.case)[1] if arguments.case else {}
    parameters = _plain(parameters, machine)
    case = Case(_built(arguments.machine, {**middle, **of_case, **parameters}))
    _check_units(arguments, case.system)
    return case


def _plain(parameters: Mapping[str, Any], system: Any) -> dict[str, Any]:
    """Parameters of a system, those with units in its own."""
    return {
        name: checked(name, value, _quantity_of(system, name), si=_is_si(system))
        for name, value in parameters.items()
    }


def _is_si(system: Any) -> bool:
    return not isinstance(system, type) and bool(getattr(system, "si", False))


def _quantity_of(system: Any, name: str) -> str:
    """Quantity of a parameter or a coordinate."""
    if name == "phase":
        return "angle"
    return Units(True, quantities_of(system)).quantity_of(name)


def _take_letters(arguments: argparse.Namespace, machine: Any) -> None:
    """Take parameters by the letters of files, D for two half clearances, by their own names."""
    letters, units = getattr(machine, "letters", {}), getattr(arguments, "with_units", {})
    for dest, letter in [key for key in units if key[1] in letters]:
        own, factor = letters[letter]
        given_here = getattr(arguments, dest)
        if own in given_here:
            raise InvalidParameterError(
                f"{option(dest)}: {letter} and {own} are the same. Give one."
            )
        values = {
            own if k == letter else k: _times(v, factor) if k == letter else v
            for k, v in given_here.items()
        }
        given_here.clear()
        given_here.update(values)
        units[dest, own] = units.pop((dest, letter))


def _times(values: Any, factor: float) -> Any:
    return tuple(factor * x for x in values) if isinstance(values, tuple) else factor * values


def _check_units(arguments: argparse.Namespace, system: Any) -> None:
    """Refuse units of other quantities than those that were named."""
    for (_, name), numbers in getattr(arguments, "with_units", {}).items():
        for number in numbers:
            checked(name, number, _quantity_of(system, name), si=_is_si(system))


def check_names(option: str, names: Iterable[str], known: Collection[str]) -> None:
    """Refuse a name that is not known."""
    for name in names:
        check_choice(option, name, known)


def _changed(case: Case, parameters: dict[str, Any]) -> Case:
    if not parameters:
        return case
    if not isinstance(case.system, Machine):
        known = names_of(case.system)
        if unknown := [name for name in parameters if name not in known]:
            raise InvalidParameterError(
                f"{option(unknown[0])}: is not a parameter of a [mechanism]"
                f"{', but ' + ', '.join(map(option, known)) + ' is' if known else ''}. Change the file."
            )
    return replace(case, system=case.system.replace(_plain(parameters, case.system)))


def _built(name: str, parameters: dict[str, Any]) -> Machine:
    machine = machine_of(name)
    required = [
        name for name, p in inspect.signature(machine).parameters.items()
        if p.default is p.empty
    ]  # fmt: skip
    missing = [option(one) for one in required if one not in parameters]
    if missing:
        case = next((f"a case such as {name}/{one}, or " for one in cases_of(name)), "")
        raise InvalidParameterError(
            f"{', '.join(missing)}: missing. Give {'it' if len(missing) == 1 else 'them'}"
            f"{'' if len(missing) == 1 else f', or {case}--config'}."
        )
    return machine(**parameters)


# ---- the start -----------------------------------------------------------------------------------

START = ("position", "velocity", "phase", "on_stop", "orbit", "perturb")  # options of add_start


def add_start(parser: argparse.ArgumentParser, *, at_orbit: bool = True) -> None:
    """Add the options for the system and the start.

    Parameters
    ----------
    parser
        The command.
    at_orbit
        Whether the default start is on a symmetric orbit in closed form, where there is one.
    """
    add_system(parser)
    machine = machine_of(parser.get_default("machine"))
    known = has_symmetric_orbits(machine)
    free = head_of(machine.free_start)
    default = (
        "the stable orbit, or else the first" if known and at_orbit else free[:1].lower() + free[1:]
    )
    group = parser.add_argument_group(
        "start",
        f"A state (--position and --velocity){', or a symmetric orbit' if known else ''}. Without "
        f"any: the start of the file, or else {default}.",
    )
    group.add_argument("--position", type=measured, nargs="+", metavar="X", help="x1 x2 ...")
    group.add_argument("--velocity", type=measured, nargs="+", metavar="V", help="v1 v2 ...")
    group.add_argument(
        "--phase", type=measured, metavar="THETA", help="phase of the force, radians"
    )
    places, speeds = (" ".join(names) for names in _on_stop_coordinates(machine))
    group.add_argument(
        "--on-stop", choices=("A", "B"),
        help=f"on this stop; then --position is {places or 'left out'}, and --velocity {speeds}",
    )  # fmt: skip
    parser.set_defaults(orbit=None, at_orbit=at_orbit)
    if known:
        group.add_argument(
            "--orbit", choices=SIGNS,
            help="the orbit with this sign in equation (14) of the paper: docs/theory.md, [14]",
        )  # fmt: skip
    group.add_argument("--perturb", type=float, metavar="AMOUNT", help="added to the phase")


def _on_stop_coordinates(system: object) -> tuple[list[str], list[str]]:
    """Positions and velocities that define a start on a stop."""
    on_stop = getattr(system, "on_stop", None)
    names = inspect.signature(on_stop).parameters if on_stop else ()
    return [n for n in names if n[0] == "x"], [n for n in names if n[0] == "v"]


def start_of(arguments: argparse.Namespace, case: Case, over: Values | None = None) -> State:
    """Requested start; the default one is between all stops over a grid of parameters, if there is such."""
    state = _explicit(arguments, case) or _default(arguments, case, over or {})
    return state if arguments.perturb is None else state.perturbed(arguments.perturb)


def _explicit(arguments: argparse.Namespace, case: Case) -> State | None:
    state, si = given(arguments, STATE), _is_si(case.system)
    for name, values in state.items():
        of = OF_STATE[name]
        state[name] = (
            [checked(name, x, of, si=si) for x in values]
            if isinstance(values, list)
            else checked(name, values, of, si=si)
        )
    stop = arguments.on_stop
    if not state and not stop:
        return None
    if stop and not arguments.orbit:
        return _on_stop(stop, state, case.system)
    if stop or arguments.orbit or not {"position", "velocity"} <= set(state):
        raise _incomplete_state(state)
    return State(**state)


def _incomplete_state(state: Iterable[str]) -> InvalidParameterError:
    return InvalidParameterError(
        f"start = {' '.join(map(option, state)) or '--on-stop'}: a state is --position and "
        "--velocity, optionally --phase or --on-stop, without --orbit."
    )


def _on_stop(stop: str, state: dict[str, Any], system: System) -> State:
    """State on a stop, from the remaining coordinates."""
    places, speeds = _on_stop_coordinates(system)
    values = [state.get("position", []), state.get("velocity", [])]
    if not speeds or [len(one) for one in values] != [len(places), len(speeds)]:
        position = f"--position {' '.join(places).upper()} and " if places else ""
        raise InvalidParameterError(
            f"on_stop = {stop}: needs {position}--velocity {' '.join(speeds).upper()}."
            if speeds
            else f"on_stop = {stop}: is not available for this system. Give --position, --velocity."
        )
    named = dict(zip([*places, *speeds], [*values[0], *values[1]], strict=True))
    put: Callable[..., State] = cast(Any, system).on_stop
    return put(stop, **named, phase=state.get("phase", 0.0))


def _default(arguments: argparse.Namespace, case: Case, over: Values) -> State:
    if case.start and not arguments.orbit:
        return case.start
    if begins_at_rest(arguments, case) or not isinstance(case.system, Machine):
        return rest_of(case.system)
    at_orbit = arguments.at_orbit and has_symmetric_orbits(type(case.system))
    if arguments.orbit or at_orbit:
        return symmetric_orbit(case.system, arguments.orbit).state
    return _free_start(case.system, over)


def begins_at_rest(arguments: argparse.Namespace, case: Case) -> bool:
    """Whether a command that may begin at rest does so: nothing else is given, and no orbit is known."""
    stated = case.start or given(arguments, (*STATE, "on_stop", "orbit"))
    return getattr(arguments, "or_rest", False) and not stated and not known_orbits(case.system)


def symmetric_orbit(system: System, sign: str | None = None) -> Orbit:
    """Symmetric orbit with a sign; by default the stable one, or else the first."""
    signs = zip(SIGNS, known_orbits(system), strict=False)
    wanted = [orbit for own, orbit in signs if sign in (None, own)]
    if not wanted:
        raise Failure(
            f"no symmetric 1-1-1 orbit exists at omega = {mechanism_of(system).omega}: condition (16) of the "
            "paper fails. Give another --omega, or --position and --velocity."
        )
    return next((orbit for orbit in wanted if orbit.stable), wanted[0])


def _free_start(machine: Machine, over: Values) -> State:
    """Default start that is behind no stop at all corners of the grid, if one of theirs is."""
    try:
        grid = {name: np.asarray(values) for name, values in over.items()}
        systems = [cast(Machine, with_parameters(machine, corner)) for corner in corners(grid)]
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


# ---- the files -----------------------------------------------------------------------------------


def add_out(
    parser: argparse.ArgumentParser,
    pictures: tuple[str, ...] = PICTURES,
    pages: tuple[str, ...] = (),
    data: tuple[str, ...] = DATA,
    animations: tuple[str, ...] = (),
) -> None:
    """Add the option for output files; ``pages`` are suffixes of reports."""
    parser.set_defaults(suffixes=data + pictures + pages + animations)
    kinds = {
        "the data": data, "a picture": pictures, "a page": pages, "an animation": animations,
    }  # fmt: skip
    listed = [f"{what} ({', '.join(suffixes)})" for what, suffixes in kinds.items() if suffixes]
    parser.add_argument(
        "--out", action="append", default=[], metavar="FILE",
        help=f"write {', '.join(listed[:-1])}{' or ' * (len(listed) > 1)}{listed[-1]}; may be "
        "repeated; an existing file is replaced",
    )  # fmt: skip
    if pictures:
        parser.add_argument(
            "--columns", type=int, choices=(1, 2),
            help="pictures for print, as wide as one column of a journal or two: 86 or 178 mm",
        )  # fmt: skip
