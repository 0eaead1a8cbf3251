"""Harmonic lines: forces on the coordinates, and motions of stops and belts."""

from __future__ import annotations

from collections.abc import Iterable, Sized
from dataclasses import dataclass
from typing import Any

from vibroimpact._core.checks import names_arguments, positive, refusal, vector
from vibroimpact._core.errors import InvalidParameterError

HARMONIC_MOTION = "A periodic motion is a sum of a few: its Fourier series."
HARMONIC_ONLY = "A force is a sum of harmonic lines: one Harmonic each."


@names_arguments(
    amplitude="Give sine and cosine, a number for each coordinate.",
    phase="A sin(omega t + phi) is sine = A cos(phi), cosine = A sin(phi).",
)
@dataclass(frozen=True, slots=True)
class Harmonic:
    """A forcing line: ``sine sin(omega t) + cosine cos(omega t)`` on the coordinates.

    Parameters
    ----------
    omega
        Angular frequency, > 0.
    sine, cosine
        Force amplitudes, one per coordinate, shape (n,). ``cosine`` defaults to zero. For the
        motion of a stop or of a belt one amplitude, shape (1,).
    """

    omega: float
    sine: tuple[float, ...]
    cosine: tuple[float, ...] = ()

    def __post_init__(self) -> None:
        object.__setattr__(
            self, "omega", positive("omega", self.omega, "For a constant force use constant_force.")
        )
        object.__setattr__(self, "sine", vector("sine", self.sine, None, HARMONIC_ONLY))
        cosine = (0.0,) * len(self.sine) if empty(self.cosine) else self.cosine
        object.__setattr__(self, "cosine", vector("cosine", cosine, len(self.sine), HARMONIC_ONLY))


def empty(value: object) -> bool:
    """Whether a value is a sequence without entries."""
    return isinstance(value, Sized) and not len(value)


def by_frequency(lines: Iterable[Harmonic]) -> dict[float, Harmonic]:
    """Lines by their frequency, those of one frequency added up."""
    out: dict[float, Harmonic] = {}
    for line in lines:
        before = out.get(line.omega)
        out[line.omega] = line if before is None else _sum(before, line)
    return out


def _sum(one: Harmonic, other: Harmonic) -> Harmonic:
    sine = tuple(a + b for a, b in zip(one.sine, other.sine, strict=True))
    cosine = tuple(a + b for a, b in zip(one.cosine, other.cosine, strict=True))
    return Harmonic(one.omega, sine, cosine)


def as_lines(name: str, value: Any) -> tuple[Harmonic, ...]:
    """Return one line or several with one amplitude each as a tuple, or raise naming it."""
    lines = (value,) if isinstance(value, Harmonic) else value
    if not isinstance(lines, tuple | list) or not all(isinstance(x, Harmonic) for x in lines):
        raise refusal(name, value, "a Harmonic, or several in a tuple", HARMONIC_MOTION)
    for line in lines:
        if len(line.sine) != 1:
            raise InvalidParameterError(
                f"{name}: has {len(line.sine)} amplitudes, and moves in one direction. Give "
                "sine=(a,) and, if wanted, cosine=(b,)."
            )
    return tuple(lines)
