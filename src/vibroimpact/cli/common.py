"""What the commands share: options from signatures, the system, the start, the files."""

from __future__ import annotations

import argparse
import inspect
import math
import re
from collections.abc import Callable, Iterable, Mapping
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

from vibroimpact._core.checks import check_target
from vibroimpact._core.errors import InvalidParameterError, VibroImpactError
from vibroimpact.cli.output import DATA
from vibroimpact.closed_forms.symmetric_orbits import symmetric_orbits
from vibroimpact.machines import published
from vibroimpact.machines.impact_damper import ImpactDamper
from vibroimpact.machines.toml_file import Case, read_case
from vibroimpact.model.mechanism import Mechanism
from vibroimpact.model.state import STATE, State
from vibroimpact.plotting.style import PICTURES
from vibroimpact.plotting.units import Units, of_name, units_of

System = ImpactDamper | Mechanism
PARAMETERS = tuple(f for f in inspect.signature(ImpactDamper).parameters if f != "scales")
ORBIT = "the stable orbit, or else the first"
ROLE = re.compile(r":\w+:`~?(?:\w+\.)*(\w+)`")  # :func:`~vibroimpact.plane`
SIGNS = {"plus": 1, "minus": -1}
TYPES: dict[str, Callable[[str], Any]] = {
    "int": int, "float": float, "int | None": int, "float | None": float,
}  # fmt: skip


class Failure(VibroImpactError):  # noqa: N818 - an outcome, reported by the exit status
    """What was asked for does not exist or could not be reached; the message says why."""


# ---- options from signatures ---------------------------------------------------------------------


def add_arguments_of(
    parser: argparse._ActionsContainer, function: Callable[..., Any], names: Iterable[str],
    **own: str,
) -> None:  # fmt: skip
    """Add an option per parameter of a function, with its default and its description.

    A text of its ``own`` stands for the description, where that is written for Python alone.
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


def option(name: str) -> str:
    """mass_ratio -> --mass-ratio."""
    return "--" + name.replace("_", "-")


def descriptions(function: Callable[..., Any]) -> dict[str, str]:
    """The texts of a numpydoc section Parameters, by name."""
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
    """The options that the user gave; the rest is left to the defaults of the function."""
    values = {name: getattr(arguments, name) for name in names}
    return {name: value for name, value in values.items() if value is not None}


# ---- the system ----------------------------------------------------------------------------------


def add_system(parser: argparse.ArgumentParser) -> None:
    """Add the options that say which system: a named case, a file, parameters."""
    group = parser.add_argument_group(
        "system",
        "A named case or a file, and parameters, which replace those of the case. All numbers "
        "given here are scaled, of a [physical] file too: t = T sqrt(K / M1), x = K X / F0. What "
        "is printed or drawn in SI units says its units.",
    )
    group.add_argument(
        "case", nargs="?", metavar="CASE",
        help="impact-damper/A, B or C: a set of the paper; impact-damper/2c: one of its panels",
    )  # fmt: skip
    group.add_argument("--config", metavar="FILE", help="a system in TOML: docs/cli.md")
    add_arguments_of(group, ImpactDamper, PARAMETERS)


def case_of(arguments: argparse.Namespace) -> Case:
    """The system that was asked for."""
    parameters = given(arguments, PARAMETERS)
    if arguments.case and arguments.config:
        raise InvalidParameterError(
            f"case = {arguments.case}, config = {arguments.config}: only one may be given."
        )
    if arguments.config:
        return _changed(read_case(arguments.config), parameters)
    known = _named(arguments.case) if arguments.case else {}
    return Case(_damper(known | parameters))


def _changed(case: Case, parameters: dict[str, Any]) -> Case:
    if not parameters:
        return case
    if not isinstance(case.system, ImpactDamper):
        raise InvalidParameterError(
            f"{option(next(iter(parameters)))}: is no parameter of a [mechanism]. Change the file."
        )
    return replace(case, system=replace(case.system, **parameters))


def _named(name: str) -> dict[str, Any]:
    sets = {f"impact-damper/{key}": value for key, value in published.parameter_sets().items()}
    panels = {f"impact-damper/{panel.name}": panel for panel in published.panels()}
    if name in sets:
        return asdict(sets[name].parameters)
    if name in panels and isinstance(panels[name].omega, float):
        panel = panels[name]
        return _named(f"impact-damper/{panel.set}") | {"omega": panel.omega}
    raise InvalidParameterError(
        f"case = {name!r}: must be one of {', '.join(sets)}, or a panel at one omega such as "
        "impact-damper/2c. Or give parameters or --config."
    )


def _damper(parameters: dict[str, Any]) -> ImpactDamper:
    required = [
        name for name, p in inspect.signature(ImpactDamper).parameters.items()
        if p.default is p.empty
    ]  # fmt: skip
    missing = [option(name) for name in required if name not in parameters]
    if missing:
        raise InvalidParameterError(
            f"{', '.join(missing)}: missing. Give {'it' if len(missing) == 1 else 'them'}"
            f"{'' if len(missing) == 1 else ', or a case such as impact-damper/A, or --config'}."
        )
    return ImpactDamper(**parameters)


# ---- the start -----------------------------------------------------------------------------------


def add_start(parser: argparse.ArgumentParser, default: str = ORBIT) -> None:
    """Add the options that say where to start, and what is taken without them."""
    group = parser.add_argument_group(
        "start",
        "A state (--position and --velocity), or a symmetric orbit of the damper. Without any: the "
        f"start of the file, or else {default}.",
    )
    group.add_argument("--position", type=float, nargs="+", metavar="X", help="x1 x2 ..., scaled")
    group.add_argument("--velocity", type=float, nargs="+", metavar="V", help="v1 v2 ..., scaled")
    group.add_argument("--phase", type=float, metavar="THETA", help="phase of the force, radians")
    group.add_argument("--on-stop", choices=("A", "B"), help="put x2 there; --position is x1 alone")
    group.add_argument(
        "--orbit",
        choices=tuple(SIGNS),
        help="the orbit with this sign in equation (14) of the paper: docs/theory.md, [14]",
    )
    group.add_argument("--perturb", type=float, metavar="AMOUNT", help="added to the phase")


def start_of(arguments: argparse.Namespace, case: Case) -> State:
    """The start that was asked for."""
    state = _explicit(arguments, case) or _default(arguments, case)
    return state if arguments.perturb is None else state.perturbed(arguments.perturb)


def _explicit(arguments: argparse.Namespace, case: Case) -> State | None:
    state = given(arguments, STATE)
    stop = arguments.on_stop
    if not state and not stop:
        return None
    if arguments.orbit or not {"position", "velocity"} <= set(state):
        raise InvalidParameterError(
            f"start = {' '.join(map(option, state)) or '--on-stop'}: a state is --position and "
            "--velocity, with --phase or --on-stop if wanted, and without --orbit."
        )
    if not stop:
        return State(**state)
    place, speed = state["position"], state["velocity"]
    if not isinstance(case.system, ImpactDamper) or len(place) != 1 or len(speed) != 2:
        raise InvalidParameterError(
            f"on_stop = {stop}: needs an impact damper, --position X1 and --velocity V1 V2."
        )
    return case.system.on_stop(
        stop, x1=place[0], v1=speed[0], v2=speed[1], phase=state.get("phase", 0.0)
    )


def _default(arguments: argparse.Namespace, case: Case) -> State:
    if case.start and not arguments.orbit:
        return case.start
    if not isinstance(case.system, ImpactDamper):
        raise InvalidParameterError("start: missing. Give --position and --velocity, or [start].")
    orbits = symmetric_orbits(case.system)
    if not orbits:
        raise InvalidParameterError(
            f"omega = {case.system.omega}: no symmetric orbit exists here to start from. "
            "Give --position and --velocity."
        )
    if arguments.orbit:
        return next(o.state for o in orbits if o.sign == SIGNS[arguments.orbit])
    return next((o.state for o in orbits if o.stable), orbits[0].state)


# ---- SI units ------------------------------------------------------------------------------------


def in_si(system: System, state: State, time: float | None = None) -> str:
    """A line with a state in SI units, and one with the system; none for a nondimensional one."""
    units = units_of(system)
    if not units.si or not isinstance(system, ImpactDamper):
        return ""
    at = "" if time is None else f" at t = {units.told('time', time)}"
    cycles = system.omega * units.factor("frequency") / (2.0 * math.pi)
    return (
        f"\nin SI units: {state_in(units, state)}{at}"
        f"\n  forcing {units.told('force', system.force)} at "
        f"{units.told('frequency', system.omega)} ({cycles:.6g} Hz), natural frequency "
        f"{units.told('frequency', system.omega_n)}, half clearance "
        f"{units.told('length', system.half_clearance)}"
    )


def state_in(units: Units, state: State) -> str:
    """Places and velocities of a state."""
    x, v = units.told("length", *state.position), units.told("velocity", *state.velocity)
    return f"x = {x}, v = {v}"


def ranges_in_si(system: object, axes: Mapping[str, tuple[float, float]]) -> str:
    """Ranges of parameters or of coordinates of the start in SI units; none of plain numbers."""
    units = units_of(system)
    measured = {name: of_name(name) for name in axes}
    return ", ".join(
        f"{name} {low * units.factor(measured[name]):.6g} to {units.told(measured[name], high)}"
        for name, (low, high) in axes.items()
        if units.unit(measured[name])
    )


# ---- the files -----------------------------------------------------------------------------------


def add_out(parser: argparse.ArgumentParser) -> None:
    """Add the option for output files."""
    parser.add_argument(
        "--out", action="append", default=[], type=Path, metavar="FILE",
        help=f"write the data ({', '.join(DATA)}) or a picture ({', '.join(PICTURES)}); may be "
        "repeated; an existing file is replaced",
    )  # fmt: skip


def targets_of(arguments: argparse.Namespace) -> list[Path]:
    """The files to write, checked before anything is computed."""
    paths: list[Path] = arguments.out
    for path in paths:
        check_target(path, DATA + PICTURES)
    return paths


def listed(paths: list[Path]) -> str:
    """A line that names the files written."""
    return f"\nwrote {', '.join(map(str, paths))}" if paths else ""
