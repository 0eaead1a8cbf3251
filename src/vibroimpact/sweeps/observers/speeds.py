"""Speeds: statistics of impact speeds."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from vibroimpact.model.mechanism import Mechanism
from vibroimpact.sweeps.observers.observer import AMOUNT, Observer, Variables, reals


@dataclass(frozen=True)
class Speeds(Observer):
    """Impact speeds, the rates at which gaps close; completed chatter has none."""

    name: ClassVar[str] = "speeds"

    def variables(self, mechanism: Mechanism) -> Variables:  # noqa: ARG002
        """``speed_mean``, ``speed_rms``, ``speed_smallest``, ``speed_largest``."""
        kinds = {"mean": "mean", "rms": "root mean square", "smallest": "smallest"}
        kinds |= {"largest": "largest"}
        texts = {f"speed_{k}": f"{text} impact speed" for k, text in kinds.items()}
        return reals("statistics", texts, quantity="velocity", within=AMOUNT)
