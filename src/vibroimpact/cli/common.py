"""Common parts of the commands: options from signatures, the system, the start, the files."""

from __future__ import annotations

import argparse
import inspect
import re
import shlex
from collections.abc import Callable, Iterable, Mapping
from dataclasses import replace
from enum import Enum
from pathlib import Path
from typing import Any, Protocol, cast

from vibroimpact._core.checks import check_target
from vibroimpact._core.errors import InvalidParameterError, VibroImpactError
from vibroimpact.machines.machine import Machine, parameters_of
from vibroimpact.machines.registry import DEFAULT, MACHINES, case_named, cases_of, machine_of
from vibroimpact.machines.toml_file import PHYSICAL, Case, HybridCase, read_case
from vibroimpact.model.mechanism import Mechanism
from vibroimpact.model.state import STATE, State
from vibroimpact.model.system import mechanism_of
from vibroimpact.orbits.symmetric_damper import has_symmetric_orbits, known_orbits
from vibroimpact.plotting.style import PICTURES
from vibroimpact.results.files import SUFFIXES as DATA
from vibroimpact.simulation.places import At, AtChange, AtPhase, AtStop

System = Machine | Mechanism
ORBIT = "the stable orbit, or else the first"
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


TYPES: dict[str, Callable[[str], Any]] = {
    "int": int, "float": float, "int | None": int, "float | None": float,
    "At | None": place_of, "AtStop | AtPhase | None": place_of,
}  # fmt: skip


class _End(Protocol):
    @property
    def reason(self) -> Enum: ...


class _Followed(Protocol):
    """What a continuation returns."""

    @property
    def ends(self) -> tuple[_End, _End]: ...


class Failure(VibroImpactError):  # noqa: N818 - a result, reported by the exit status
    """The requested result does not exist or could not be reached; the message gives the reason."""


def check_interrupted(*results: _Followed) -> None:
    """Raise an interruption that a continuation reports as the reason of an end, so that nothing is written."""
    if any(end.reason.name == "INTERRUPTED" for one in results for end in one.ends):
        raise KeyboardInterrupt


# ---- options from signatures ---------------------------------------------------------------------


def add_arguments_of(
    parser: argparse._ActionsContainer, function: Callable[..., Any], names: Iterable[str],
    **own: str,
) -> None:  # fmt: skip
    """Add an option per parameter of a function, with its default and its description.

    A text in ``own`` replaces a description that is written for Python only.
    """
    signature, texts = inspect.signature(function), descriptions(function) | own
    for name in names:
        parameter = signature.parameters[name]
        text = ROLE.sub(r"\1", texts.get(name, "")).replace("%", "%%").replace("``", "")
        if parameter.default not in (parameter.empty, None):
            text += f" (default: {parameter.default})"
        parser.add_argument(
            option(name),
            type=TYPES.get(str(parameter.annotation), str),
            nargs="+" if str(parameter.annotation).startswith("Sequence") else None,
            metavar=name.rpartition("_")[2].upper(),
            help=text,
        )


def command_of(arguments: argparse.Namespace) -> str:
    """The command as it was typed."""
    return shlex.join(["vibroimpact", *arguments.words])


def option(name: str) -> str:
    """Name of an option from that of a parameter: --mass-ratio from mass_ratio."""
    return "--" + name.replace("_", "-")


def descriptions(function: Callable[..., Any]) -> dict[str, str]:
    """Texts of a numpydoc section Parameters, by name."""
    section = (inspect.getdoc(function) or "").partition("Parameters\n----------\n")[2]
    texts: dict[str, str] = {}
    names: list[str] = []
    for line in section.partition("\n\n")[0].splitlines():
        if line.startswith(" "):
            texts |= {name: f"{texts.get(name, '')} {line.strip()}".strip() for name in names}
        else:
            names = line.partition(" : ")[0].split(", ")
    return texts


def given(arguments: argparse.Namespace, names: Iterable[str]) -> dict[str, Any]:
    """Options that the user gave; the others have the defaults of the function."""
    values = {name: getattr(arguments, name) for name in names}
    return {name: value for name, value in values.items() if value is not None}


# ---- the system ----------------------------------------------------------------------------------


def add_system(parser: argparse.ArgumentParser) -> None:
    """Add the options that define the system: a machine, a case of it, a file, parameters."""
    name = parser.get_default("machine")
    machine, cases = machine_of(name), ", ".join(cases_of(name))
    group = parser.add_argument_group(
        "system",
        f"A named case or a file, and parameters of {name}, which replace those of the case. All "
        f"numbers, given and printed, are in the units of the machine: SI for a [{PHYSICAL}] file.",
    )
    group.add_argument(
        "case", nargs="?", metavar="CASE",
        help=f"a machine, whose parameters are the options then: {', '.join(MACHINES)} (default: "
        f"{DEFAULT})" + f"; or a published case of it: {name}/{cases}" * bool(cases),
    )  # fmt: skip
    group.add_argument("--config", metavar="FILE", help="a system in TOML: docs/cli.md")
    add_arguments_of(group, machine, parameters_of(machine))
    parser.set_defaults(check=check_case)


def parameters_in(arguments: argparse.Namespace) -> tuple[str, ...]:
    """Names of the parameters that are options of the command line."""
    return parameters_of(machine_of(arguments.machine))


def check_case(arguments: argparse.Namespace) -> None:
    """Refuse a case that does not exist, or whose position hides the machine that it names."""
    if arguments.case and case_named(arguments.case)[0] != arguments.machine:
        raise InvalidParameterError(
            f"case = {arguments.case}: must come before the options, which are those of "
            f"{arguments.machine} here."
        )


def case_of(arguments: argparse.Namespace) -> Case:
    """Requested system, a mechanism."""
    case = any_case_of(arguments)
    if isinstance(case, HybridCase):
        raise _no_mechanism(arguments.config)
    return case


def _no_mechanism(path: str) -> InvalidParameterError:
    return InvalidParameterError(
        f"config = {path}: [hybrid] is no mechanism. Take vibroimpact simulate, without parameters of a "
        "machine."
    )


def any_case_of(arguments: argparse.Namespace) -> Case | HybridCase:
    """Requested system, a mechanism or one that a file gives as modes and guards."""
    parameters = given(arguments, parameters_in(arguments))
    if arguments.case and arguments.config:
        raise InvalidParameterError(
            f"case = {arguments.case}, config = {arguments.config}: only one may be given."
        )
    if arguments.config:
        case = read_case(arguments.config)
        if isinstance(case, Case):
            return _changed(case, parameters)
        if parameters:
            raise _no_mechanism(arguments.config)
        return case
    check_case(arguments)
    return Case(_built(arguments.machine, {**parameters_of_case(arguments), **parameters}))


def parameters_of_case(arguments: argparse.Namespace) -> Mapping[str, float]:
    """Parameters of the case."""
    return case_named(arguments.case)[1] if arguments.case else {}


def _changed(case: Case, parameters: dict[str, Any]) -> Case:
    if not parameters:
        return case
    if not isinstance(case.system, Machine):
        raise InvalidParameterError(
            f"{option(next(iter(parameters)))}: is not a parameter of a [mechanism]. Change the "
            "file."
        )
    return replace(case, system=replace(cast(Any, case.system), **parameters))


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


def add_start(parser: argparse.ArgumentParser, *, at_orbit: bool = True) -> None:
    """Add the options for the start.

    Parameters
    ----------
    parser
        The command.
    at_orbit
        Whether the default start is on a symmetric orbit in closed form, where there is one.
    """
    machine = machine_of(parser.get_default("machine"))
    known = has_symmetric_orbits(machine)
    group = parser.add_argument_group(
        "start",
        f"A state (--position and --velocity){', or a symmetric orbit' if known else ''}. Without "
        f"any: the start of the file, or else {ORBIT if known and at_orbit else _free(machine)}.",
    )
    group.add_argument("--position", type=float, nargs="+", metavar="X", help="x1 x2 ...")
    group.add_argument("--velocity", type=float, nargs="+", metavar="V", help="v1 v2 ...")
    group.add_argument("--phase", type=float, metavar="THETA", help="phase of the force, radians")
    places, speeds = (" ".join(names) for names in _on_stop_coordinates(machine))
    group.add_argument(
        "--on-stop", choices=("A", "B"),
        help=f"on this stop; then --position is {places or 'left out'}, and --velocity {speeds}",
    )  # fmt: skip
    parser.set_defaults(orbit=None)
    if known:
        group.add_argument(
            "--orbit", choices=SIGNS,
            help="the orbit with this sign in equation (14) of the paper: docs/theory.md, [14]",
        )  # fmt: skip
    group.add_argument("--perturb", type=float, metavar="AMOUNT", help="added to the phase")


START = ("position", "velocity", "phase", "on_stop", "orbit", "perturb")  # options of add_start


def _free(machine: type[Machine]) -> str:
    """Default start of a machine in words, from its docstring."""
    words = (inspect.getdoc(machine.free_start) or "").partition("\n")[0].rstrip(".")
    return words[:1].lower() + words[1:]


def _on_stop_coordinates(system: object) -> tuple[list[str], list[str]]:
    """Positions and velocities that define a start on a stop."""
    on_stop = getattr(system, "on_stop", None)
    names = inspect.signature(on_stop).parameters if on_stop else ()
    return [n for n in names if n[0] == "x"], [n for n in names if n[0] == "v"]


def start_of(arguments: argparse.Namespace, case: Case) -> State:
    """Requested start."""
    state = _explicit(arguments, case) or _default(arguments, case)
    return state if arguments.perturb is None else state.perturbed(arguments.perturb)


def _explicit(arguments: argparse.Namespace, case: Case) -> State | None:
    state = given(arguments, STATE)
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
        if not state.keys() - {"phase"}:
            raise _incomplete_state(state)
        position = f"--position {' '.join(places).upper()} and " if places else ""
        raise InvalidParameterError(
            f"on_stop = {stop}: needs {position}--velocity {' '.join(speeds).upper()}."
            if speeds
            else f"on_stop = {stop}: is not available for this system. Give --position, --velocity."
        )
    named = dict(zip([*places, *speeds], [*values[0], *values[1]], strict=True))
    put: Callable[..., State] = cast(Any, system).on_stop
    return put(stop, **named, phase=state.get("phase", 0.0))


def _default(arguments: argparse.Namespace, case: Case) -> State:
    if case.start and not arguments.orbit:
        return case.start
    if not isinstance(case.system, Machine):
        raise InvalidParameterError("start: missing. Give --position and --velocity, or [start].")
    if not has_symmetric_orbits(type(case.system)):
        return case.system.free_start()
    orbits = known_orbits(case.system)
    if not orbits:
        raise InvalidParameterError(
            f"omega = {mechanism_of(case.system).omega}: no symmetric orbit exists here to start "
            "from. Give --position and --velocity."
        )
    if arguments.orbit:
        return orbits[SIGNS.index(arguments.orbit)].state
    return next((o.state for o in orbits if o.stable), orbits[0].state)


# ---- the files -----------------------------------------------------------------------------------


def add_out(parser: argparse.ArgumentParser, *, pages: tuple[str, ...] = ()) -> None:
    """Add the option for output files; ``pages`` are suffixes of reports."""
    parser.add_argument(
        "--out", action="append", default=[], type=Path, metavar="FILE",
        help=f"write the data ({', '.join(DATA)}), a picture ({', '.join(PICTURES)})"
        + (f" or a report ({', '.join(pages)})" if pages else "")
        + "; may be repeated; an existing file is replaced",
    )  # fmt: skip


def targets_of(arguments: argparse.Namespace, *, pages: tuple[str, ...] = ()) -> list[Path]:
    """Files to write, checked before anything is computed."""
    paths: list[Path] = arguments.out
    for path in paths:
        check_target(path, DATA + PICTURES + pages)
    return paths


def listed(paths: list[Path]) -> str:
    """Line with the names of the files written."""
    return f"\nwrote {', '.join(map(str, paths))}" if paths else ""
