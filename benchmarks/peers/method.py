"""What a method has to offer to be measured."""

from __future__ import annotations

from dataclasses import dataclass
from importlib import import_module
from typing import Any, Protocol

from benchmarks.case import Floats, Parameters


class UnavailableError(RuntimeError):
    """A method that cannot run here; the text says what is missing."""


def require(module: str, install: str) -> Any:
    """Import an optional module, or raise `UnavailableError` with how to install it."""
    try:
        return import_module(module)
    except ImportError as error:
        raise UnavailableError(f"{error}: pip install {install}") from error


@dataclass(frozen=True, slots=True)
class Result:
    """Impact times of every start and what they cost.

    Attributes
    ----------
    seconds : float
        Time of the simulation alone: compilation, reading and writing excluded.
    times : ndarray, shape (n_starts, impacts)
        Time of each impact since the start; NaN from the first impact that was not found.
    """

    seconds: float
    times: Floats


class Method(Protocol):
    """A way to simulate the impact damper."""

    @property
    def name(self) -> str:
        """Label of the row in the table."""

    @property
    def settings(self) -> str:
        """Tuning, in one line."""

    @property
    def max_starts(self) -> int | None:
        """Largest number of starts it is timed on (slow methods), None for all."""

    @property
    def tolerance(self) -> float:
        """Allowed difference of its impact times from the reference."""

    def run(self, starts: Floats, parameters: Parameters, impacts: int) -> Result:
        """Simulate `impacts` impacts from every start (columns: `case.START_COLUMNS`)."""
