"""Systems: mechanisms, hybrid systems, and objects that have one as property ``mechanism``."""

from __future__ import annotations

from typing import Any, Protocol
from weakref import ref

from vibroimpact._core.checks import refusal
from vibroimpact.model.hybrid_system import HybridSystem
from vibroimpact.model.mechanism import Mechanism


class HasMechanism(Protocol):
    """Object with a property ``mechanism``."""

    @property
    def mechanism(self) -> Mechanism | HybridSystem:
        """Masses, springs, forces and stops; or modes, guards and transitions."""


System = HasMechanism | Mechanism | HybridSystem


def mechanism_of(system: System) -> Mechanism:
    """Mechanism of a system; for a frozen dataclass it is built and checked once."""
    if isinstance(system, Mechanism):
        return system
    known = _BUILT.get(id(system))
    if known and known[0]() is system:
        return known[1]
    mechanism = getattr(system, "mechanism", None)
    if isinstance(mechanism, HybridSystem):
        mechanism = mechanism.mechanism
    if not isinstance(mechanism, Mechanism):
        raise refusal(
            "system", system, "a Mechanism or HybridSystem, or have one, as a property mechanism"
        )
    if getattr(getattr(system, "__dataclass_params__", None), "frozen", False):
        _keep(system, mechanism)
    return mechanism


_BUILT: dict[int, tuple[ref[Any], Mechanism]] = {}  # by id of a system that exists


def _keep(system: Any, mechanism: Mechanism) -> None:
    key = id(system)
    try:
        _BUILT[key] = ref(system, lambda _: _BUILT.pop(key, None)), mechanism
    except TypeError:  # slots without room for weak references
        return
