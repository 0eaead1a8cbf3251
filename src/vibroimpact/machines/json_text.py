"""Systems as JSON text and back, with the same numbers to the last bit."""

from __future__ import annotations

import json
import math
from dataclasses import asdict
from typing import Any, cast

from vibroimpact._core.errors import InvalidParameterError
from vibroimpact._core.texts import json_of
from vibroimpact.machines.registry import machine_of_class, name_of
from vibroimpact.model.elements.element import Element
from vibroimpact.model.elements.table import KINDS
from vibroimpact.model.harmonic import Harmonic
from vibroimpact.model.mechanism import Mechanism
from vibroimpact.model.system import System

MOREAU = "moreau"  # the law of texts that name none


def text_of(system: System) -> str:
    """Text of a system for a file; only the name if the system is code of the user."""
    return json.dumps({"type": type(system).__name__, **_numbers(system)})


def _numbers(system: System) -> dict[str, Any]:
    if name_of(system):
        return asdict(cast(Any, system))
    if not isinstance(system, Mechanism):
        return {}
    return {
        "mass": system.mass,
        "damping": system.damping,
        "stiffness": system.stiffness,
        "constant_force": system.constant_force,
        "forces": [asdict(line) for line in system.forces],
        "elements": [_stored(e) for e in system.elements],
        **({"impact_law": system.impact_law} if system.impact_law != MOREAU else {}),
        **({"si": True} if system.si else {}),
    }


def _stored(element: Element) -> dict[str, Any]:
    """Kind and fields of an element, but for stops at infinity, which JSON has not, and motions of none."""
    return {"kind": element.kind} | {
        name: value
        for name, value in asdict(cast(Any, element)).items()
        if not (name == "motion" and not value)
        and (not isinstance(value, float) or math.isfinite(value))
    }


def _restored(make: Any, stored: Any) -> Any:
    """A value, or the record of a class made of its fields; lists were tuples."""
    if isinstance(stored, list):
        return tuple(_restored(make, one) for one in stored)
    if make is None or stored is None:
        return stored
    records = getattr(make, "records", {})
    return make(**{name: _restored(records.get(name), value) for name, value in stored.items()})


def system_of(text: Any) -> System | None:
    """System of a text of :func:`text_of`; None if the system is code.

    Raises
    ------
    InvalidParameterError
        Another text.
    """
    numbers = json_of("system", text)
    try:
        return _system_of(numbers)
    except InvalidParameterError:
        raise
    except (LookupError, TypeError, ValueError, AttributeError, RecursionError) as error:
        raise InvalidParameterError(f"system: is described otherwise ({error!r}).") from error


def _system_of(numbers: Any) -> System | None:
    kind = numbers.pop("type")
    if not isinstance(kind, str):
        raise TypeError(f"type = {kind}")
    if kind != "Mechanism":
        machine = machine_of_class(kind) if numbers else None  # None for a class of the user
        return cast(System, machine(**numbers)) if machine else None
    elements = tuple(_restored(KINDS[e.pop("kind")], e) for e in numbers.pop("elements"))
    forces = _restored(Harmonic, numbers.pop("forces"))
    return Mechanism(forces=forces, elements=elements, **numbers)
