"""Shares: time at rest, chatter, grazes."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from vibroimpact.model.mechanism import Mechanism
from vibroimpact.sweeps.observers.observer import AMOUNT, Observer, Variables, reals, whole


@dataclass(frozen=True)
class Shares(Observer):
    """Share of time at rest on a stop, completed chatter sequences, grazes."""

    name: ClassVar[str] = "shares"

    def variables(self, mechanism: Mechanism) -> Variables:  # noqa: ARG002
        """``share_at_rest``, ``chatters``, ``grazes``."""
        return {
            **reals("rest", {"share_at_rest": "share of time at rest on a stop"}, within=AMOUNT),
            "chatters": whole("counts", "completed chatter sequences", 0, "int32"),
            "grazes": whole("counts", "grazing contacts", 1, "int32"),
        }
