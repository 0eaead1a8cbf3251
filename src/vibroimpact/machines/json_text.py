"""Systems as JSON text and back, with the same numbers to the last bit."""

from __future__ import annotations

import json
import math
from dataclasses import asdict
from typing import Any, cast

from vibroimpact.machines.registry import machine_of_class, name_of
from vibroimpact.model.elements import Element, NormalLoad
from vibroimpact.model.harmonic import Harmonic
from vibroimpact.model.mechanism import KINDS, Contact, Mechanism, kind_of
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
        "contact_names": system.contact_names,
        "forces": [asdict(line) for line in system.forces],
        "contacts": [_stored(contact) for contact in system.contacts],
        **({"elements": [_kinded(e) for e in system.elements]} if system.elements else {}),
        **({"impact_law": system.impact_law} if system.impact_law != MOREAU else {}),
    }


def _kinded(element: Element) -> dict[str, Any]:
    return {"kind": kind_of(element), **_stored(element)}


def _stored(part: Contact | Element) -> dict[str, Any]:
    """Fields of a part, but for stops at infinity, which JSON has not, and motions of none."""
    return {
        name: value
        for name, value in asdict(part).items()
        if not (name == "motion" and not value)
        and (not isinstance(value, float) or math.isfinite(value))
    }


def _restored(make: Any, stored: dict[str, Any]) -> Any:
    """A part of its fields; lists were tuples."""
    given: dict[str, Any] = {}
    for name, value in stored.items():
        if name == "motion":
            given[name] = tuple(Harmonic(**line) for line in value)
        elif name == "load":
            given[name] = value and _restored(NormalLoad, value)
        else:
            given[name] = tuple(value) if isinstance(value, list) else value
    return make(**given)


def system_of(text: str) -> System | None:
    """System of a text of :func:`text_of`; None if the system is code."""
    numbers = json.loads(text)
    kind = numbers.pop("type")
    if kind != "Mechanism":
        machine = machine_of_class(kind) if numbers else None  # None for a class of the user
        return cast(System, machine(**numbers)) if machine else None
    contacts = [_restored(Contact, pair) for pair in numbers.pop("contacts")]
    elements = [_restored(KINDS[e.pop("kind")], e) for e in numbers.pop("elements", [])]
    forces = [Harmonic(**line) for line in numbers.pop("forces")]
    names = tuple(numbers.pop("contact_names"))
    return Mechanism(
        contacts=tuple(contacts), forces=tuple(forces), contact_names=names,
        elements=tuple(elements), **numbers,
    )  # fmt: skip
