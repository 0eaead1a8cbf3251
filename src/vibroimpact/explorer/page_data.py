"""What the page knows of a machine: its parameters, recordings of its compile step, what is drawn.

Method      A machine is compiled once with inputs for its parameters (recording.py). Numbers of the compiled system
            stand in one list, in the order in which web/kernel/page.cpp takes them; entries that depend on
            parameters are patched. Recordings are made at the values that the machine has, and at others near
            them that go another way through the code; of a machine without rates of its own also with the pace
            of the motion as an input (compile/pace.py).
Assumes     the modes that motions meet at these values are those that they meet elsewhere
Fails       values that no recording covers: the page says so, and asks the command's server for one
"""

from __future__ import annotations

import json
import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import fields
from typing import Any, NamedTuple, cast

import numpy as np

from vibroimpact._core.checks import shown
from vibroimpact._core.columns import Split
from vibroimpact._core.docstrings import descriptions, head_of
from vibroimpact._core.errors import InvalidParameterError, VibroImpactError
from vibroimpact.compile.hybrid import hybrid_of
from vibroimpact.compile.tables import stacks_of
from vibroimpact.explorer.recording import NUMBER, OPERANDS, OPERATIONS, Recording, repeated
from vibroimpact.machines.machine import CHECK, Machine, example_of
from vibroimpact.machines.registry import MACHINES, cases_of, machine_of, name_of
from vibroimpact.machines.units import quantities_of, units_of
from vibroimpact.model.hybrid_system import HybridSystem
from vibroimpact.model.mechanism import Mechanism, element_labels, links
from vibroimpact.model.parameters import names_of, parameter_value, with_parameters
from vibroimpact.model.state import State
from vibroimpact.model.system import System, mechanism_of
from vibroimpact.simulation.simulate import simulate

PACE = "pace"  # the input of a recording beside the parameters
MOST_RECORDINGS = 8  # of a machine, in a page
TRIED = 24  # so many other values of the parameters are tried
IMPACTS = 400  # of the motions that say which modes are met
SYSTEM = ("omegas", "kappas", "steps", "impulse", "mobility", "shift", "restitution", "reset_shift")
BLOCKS, DENSE = ("k", "c", "a"), ("b", "constant", "norm", "growth")
MODE = (
    "rows",
    "gains",
    "lower",
    "upper",
    "to_x",
    "to_v",
    "offset",
    "from_x",
    "from_v",
    "particular",
)
WATCHES = (
    "mode_step", "map_shift", "watch_rows", "watch_gains", "watch_lower", "watch_upper", "element_rows",
)  # fmt: skip
Data = dict[str, Any]


def page_name(system: System) -> str:
    """Name of a system on the page: that of its machine, or "mechanism"."""
    return name_of(system) or "mechanism"


def values_of(system: System) -> dict[str, float]:
    """The parameters that the page varies, with their values; of a mechanism, numbers by path."""
    if isinstance(system, HybridSystem):
        return {}
    if isinstance(system, Mechanism):
        return {path: parameter_value(system, path) for path in _paths(system)}
    floats = names_of(system).items()
    return {name: value for name, value in floats if not isinstance(value, int)}


def _paths(m: Mechanism) -> list[str]:
    """Paths of the numbers of a mechanism that are not zero."""
    found = ["omega"] if m.forces else []
    for name in ("mass", "damping", "stiffness"):
        a = getattr(m, name)
        found += [
            f"{name}[{i}][{j}]" for i in range(m.degrees) for j in range(i, m.degrees) if a[i][j]
        ]
    for k, line in enumerate(m.forces):
        for part in ("sine", "cosine"):
            found += [f"forces[{k}].{part}[{i}]" for i, x in enumerate(getattr(line, part)) if x]
    for k, e in enumerate(m.elements):
        for one in fields(cast(Any, e)):
            path = f"elements[{k}].{one.name}"
            try:
                parameter_value(m, path)
            except VibroImpactError:
                continue
            found.append(path)
    return found


def recording_of(
    system: System, values: Mapping[str, float], codes: Sequence[int] = (), pace: float = 0.0
) -> Data:
    """The compile step of a system written down, at these values of its parameters.

    Parameters
    ----------
    system
        A machine, or a mechanism.
    values
        Of all the parameters that are inputs; those of :func:`values_of`, or others.
    codes
        Modes needed in addition to those that are built at first.
    pace
        Of the motion, where it is not zero: then it is an input too.

    Returns
    -------
    dict
        As the page has it: inputs, constants, code, conditions, patches, numbers, sizes, structure.

    Raises
    ------
    InvalidParameterError
        Values that the system refuses, or modes that cannot be compiled.
    TypeError
        Code that cannot be written down: damping that is not classical, in blocks.
    """
    names = [*values, PACE] if pace else [*values]
    r, columns = Recording(len(names)), list[Any]()
    inputs = {name: r.input(i, v) for i, (name, v) in enumerate(values.items())}
    with np.errstate(all="ignore"):
        m = mechanism_of(with_parameters(system, inputs))
        given: Any = r.input(len(values), pace) if pace else 0.0
        if any(element.whole for element in m.switching):
            raise InvalidParameterError(
                f"system = {shown(system)}: the page computes mechanisms, and it is a hybrid system. Take "
                "simulate, section, classify, continue_orbit."
            )
        h = hybrid_of(m, given)
        others = [code for code in codes if code not in h.codes]
        stacks = stacks_of(h, (1,), others, columns)
    entries = [r.entry(x) for x in columns]
    order = [stacks.pace[name] for name in ("own", "most", "parts")]
    order += [stacks.systems[name] for name in SYSTEM]
    modes = [mode | mode["flow"] | mode["piecewise"] for mode in stacks.modes]
    for name in (*(DENSE if h.dense else BLOCKS), *MODE, *(WATCHES if stacks.piecewise else ())):
        order += [mode[name] for mode in modes]
    numbers, patches = list[float](), list[int]()
    for stack in order:
        for place, column in stack.columns.items():
            patches += [len(numbers) + place, entries[column]]
        numbers += stack.shared.ravel().tolist()
    degrees, contacts, lines = stacks.sizes
    return {
        "inputs": names,
        **_compact(r, patches),
        "numbers": numbers,
        "dense": h.dense, "mixed": h.mixed, "piecewise": stacks.piecewise, "sequential": stacks.sequential,
        "degrees": degrees, "lines": lines, "contacts": contacts, "elements": len(stacks.elements),
        "resets": len(h.resets), "parts": len(stacks.pace["parts"].shared),
        "codes": [mode["code"] for mode in modes],
        "side": [x for mode in modes for x in mode["side"]],
        "states": [e.states for e in stacks.elements],
        "soft": [int(e.soft) for e in stacks.elements],
        "joint": [int(e.joint) for e in stacks.elements],
        "watch_counts": [len(mode["watch_element"]) for mode in modes] if stacks.piecewise else [],
        **{
            name: [x for mode in modes for x in mode.get(name, ())]
            for name in ("watch_element", "watch_held", "watch_reset")
        },
    }  # fmt: skip


def _compact(r: Recording, patches: list[int]) -> Data:
    """Operations on which anything depends, with entries numbered anew."""
    kept = r.needed(patches[1::2])
    used = {i for at in kept for i in r.operands(at)} | {*patches[1::2], *r.conditions}
    constants = [i for i in r.constants if i in used]
    number = {i: i for i in range(r.inputs)}
    number |= {i: r.inputs + k for k, i in enumerate((*constants, *kept))}
    code, lists, tables, found = list[list[int]](), list[int](), 0, dict[int, int]()
    for at in kept:
        name, *operands = r.operations[at]
        if name == NUMBER["decouple"]:
            n = math.isqrt(len(operands) // 2)
            code.append([name, n, len(lists), tables])
            lists += [number[i] for i in operands]
            found[at], tables = tables, tables + 2 * n + 6 * n * n
        elif name == NUMBER["taken"]:
            code.append([name, number[operands[0]], found[operands[0]] + operands[1], 0])
        else:
            code.append([name, *(number[i] for i in operands), *[0] * (3 - len(operands))])
    return {
        "constants": [r.constants[i] for i in constants],
        "code": code,
        "lists": lists,
        "tables": tables,
        "conditions": [[number[i], int(truth)] for i, truth in r.conditions.items()],
        "patches": [x if i % 2 == 0 else number[x] for i, x in enumerate(patches)],
    }


def covers(recording: Data, values: Mapping[str, float], pace: float = 0.0) -> bool:
    """Whether a recording gives the system at these values of its inputs."""
    inputs = {**values, PACE: pace}
    if (PACE in recording["inputs"]) != bool(pace):
        return False
    return repeated([inputs[name] for name in recording["inputs"]], recording) is not None


def recordings_of(system: System, values: Mapping[str, float] | None = None) -> list[Data]:
    """Recordings of a system at its values, and at others that go another way through the code."""
    at = values_of(system) if values is None else dict(values)
    found, tried, codes = list[Data](), list[tuple[dict[str, float], float]](), set[int]()
    for one in (at, *_others(at)):
        met = _met(system, one)
        if met is not None:
            codes |= met.codes
            tried += [(one, 0.0), (one, met.pace)] if met.pace else [(one, 0.0)]
    for one, pace in tried:
        if len(found) == MOST_RECORDINGS:
            break
        if any(covers(each, one, pace) for each in found):
            continue
        try:
            found.append(_with_codes(system, one, codes, pace))
        except (VibroImpactError, ArithmeticError, TypeError, Split):
            if not found:
                raise
    return found


def _with_codes(
    system: System, values: Mapping[str, float], codes: Iterable[int], pace: float
) -> Data:
    """The recording with those of the modes that it can have."""
    try:
        return recording_of(system, values, sorted(codes), pace)
    except VibroImpactError:
        return recording_of(system, values, (), pace)


class _Met(NamedTuple):
    """Modes beside those that are built at first, and a pace of which some motion may be.

    The pace is zero where the machine's own rates serve for all motions.
    """

    codes: set[int]
    pace: float


def _met(system: System, values: Mapping[str, float]) -> _Met | None:
    """What a motion at these values meets; None where the system refuses them."""
    try:
        changed = with_parameters(system, values)
        try:
            run = simulate(changed, start_of(changed), impacts=IMPACTS, t_max=_long(changed))
            codes, most = {*run._compiled.codes}, run._compiled.most_pace
        except VibroImpactError:  # the start is not one for these values
            codes, most = set[int](), hybrid_of(mechanism_of(changed)).most_pace
    except (VibroImpactError, ArithmeticError):
        return None
    return _Met(codes, 0.0 if most > 2.0**-20 else 4.0)


def _others(values: Mapping[str, float]) -> list[dict[str, float]]:
    """Other values, which the system may refuse: each parameter halved, doubled, zero, and all at random."""
    random = np.random.default_rng(1)
    tried = [{**values, name: x * f} for name, x in values.items() for f in (0.5, 2.0, 0.0) if x]
    tried += [{**values, name: 0.1} for name, x in values.items() if not x]
    factors = np.exp(random.uniform(-0.7, 0.7, (TRIED, len(values))))
    tried += [
        {n: x * f for (n, x), f in zip(values.items(), row, strict=True)}
        for row in factors.tolist()
    ]
    return tried


def _long(system: System) -> float:
    omega = mechanism_of(system).omega
    return 2.0 * math.pi / omega * IMPACTS if omega else 100.0


def start_of(system: System) -> State:
    """The start of the machine, or all zero."""
    if isinstance(system, Machine):
        return system.free_start()
    zero = (0.0,) * mechanism_of(system).degrees
    return State(zero, zero)


def machine_data(system: System, start: State | None = None) -> Data:
    """Everything that the page knows of a machine.

    Parameters
    ----------
    system
        A machine, or a mechanism.
    start
        Where its motion begins; its own start by default.
    """
    name, m, at = name_of(system), mechanism_of(system), start or start_of(system)
    units, quantities = units_of(system), quantities_of(system)
    checks = _checks(system)
    cases = cases_of(name) if name else {}
    values, about = values_of(system), descriptions(type(system))
    return {
        "name": page_name(system),
        "title": head_of(type(system)),
        "python": _python(system, name),
        "si": units.si,
        "parameters": [
            {
                "name": one, "value": value, "about": about.get(one, ""),
                "unit": units.unit(quantities[one].quantity) if one in quantities else "",
                "check": checks.get(one, "real"),
            }
            for one, value in values.items()
        ],
        "fixed": _fixed(system, values),
        "cases": {case: {k: v for k, v in row.items() if k in values} for case, row in cases.items()},
        "start": {"x": [*at.position], "v": [*at.velocity], "phase": at.phase},
        "elements": [
            {
                "label": label, "rigid": e.rigid, "stop": e.is_stop, "row": [*e.row],
                "states": {int(k): look.words for k, look in e.looks.items()},
                "motion": [[_line(m, line.omega), *line.sine, *line.cosine] for line in e.motion],
            }
            for label, e in zip(element_labels(m), m.elements, strict=True)
        ],
        "links": [
            [kind, i, -1 if j is None else j]
            for kind, a in (("spring", m.stiffness), ("dashpot", m.damping))
            for i, j, _ in links(a)
        ],
        "recordings": recordings_of(system, values),
    }  # fmt: skip


def catalogue() -> dict[str, Machine]:
    """Every machine of the catalogue, by name, at its example."""
    return {name: example_of(machine_of(name)) for name in MACHINES}


def _checks(system: System) -> dict[str, str]:
    """What is allowed for each parameter, as the name of its check."""
    if isinstance(system, Mechanism):
        return {}
    checks = {one.name: one.metadata.get(CHECK) for one in fields(cast(Any, system))}
    return {name: _allowed(check, name) for name, check in checks.items() if check}


def _allowed(check: Any, name: str) -> str:
    """The numbers that a check takes: "positive" has no zero, "nonnegative" has it, "fraction" ends at 1."""
    below, zero, one, two = (_takes(check, name, x) for x in (-1.0, 0.0, 1.0, 2.0))
    if below or not one:
        return "real"
    return "positive" if not zero else "nonnegative" if two else "fraction"


def _takes(check: Any, name: str, value: float) -> bool:
    try:
        check(name, value)
    except VibroImpactError:
        return False
    return True


def _fixed(system: System, values: Mapping[str, float]) -> Data:
    """Parameters that the page does not vary: counts, words, flags that are not the default."""
    if isinstance(system, Mechanism):
        return {}
    return {
        one.name: getattr(system, one.name)
        for one in fields(cast(Any, system))
        if one.name not in values and getattr(system, one.name) != one.default
    }


def _python(system: System, name: str | None) -> str:
    return f"vi.machines.{type(system).__name__}" if name else ""


def _line(m: Mechanism, omega: float) -> int:
    """Number of the forcing line of this frequency."""
    return next(i for i, force in enumerate(m.forces) if force.omega == omega)


# ---- as text -------------------------------------------------------------------------------------


def json_text(data: Any) -> str:
    """Text of JSON; 1e999, which it has, is read as infinite."""
    return json.dumps(data, separators=(",", ":")).replace("Infinity", "1e999")


def text_of(machines: Mapping[str, Data], chosen: str, others: Mapping[str, str]) -> str:
    """Machines as the text that the page reads: JSON, recordings in differences, which compress to half the size.

    ``others`` are the titles of those that the page has to ask for, by name.
    """
    packed = {
        name: {**data, "recordings": list(map(packed_of, data["recordings"]))}
        for name, data in machines.items()
    }
    whole = {
        "chosen": chosen, "operands": [*OPERANDS.values()], "machines": packed, "others": others,
    }  # fmt: skip
    return json_text(whole)


def packed_of(recording: Data) -> Data:
    """A recording whose entries are counted back from where they are used."""
    at, code = len(recording["inputs"]) + len(recording["constants"]), list[int]()
    for number, *operands in recording["code"]:
        name, count = OPERATIONS[number], OPERANDS[OPERATIONS[number]]
        plain = name in ("decouple", "taken")
        code += [number, *(operands if plain else (at - i for i in operands[:count]))]
        at += 1
    patches = np.array(recording["patches"], dtype=int).reshape(-1, 2)
    apart = np.diff(patches, axis=0, prepend=np.zeros((1, 2), dtype=int))
    return {**recording, "code": code, "patches": apart.T.ravel().tolist()}
