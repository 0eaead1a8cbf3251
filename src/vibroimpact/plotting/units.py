"""Units of a picture: SI where the system has physical scales, none where it is nondimensional."""

from __future__ import annotations

from typing import NamedTuple

from vibroimpact.damper import Scales, scales_of


class Units(NamedTuple):
    """Factors of what is drawn, and whether these are SI units."""

    scales: Scales
    si: bool

    def label(self, text: str, unit: str) -> str:
        """A label with its unit: s, m, m/s or rad/s."""
        return f"{text} [{unit}]" if self.si else text


def units_of(system: object) -> Units:
    """The units of a system's pictures."""
    scales = scales_of(system)
    return Units(scales or Scales(), scales is not None)
