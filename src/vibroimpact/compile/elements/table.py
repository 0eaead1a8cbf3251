"""Table of the elements: the class of their rows, by kind."""

from __future__ import annotations

from typing import Any

from vibroimpact.compile.elements.element import ElementRows
from vibroimpact.compile.elements.friction import FrictionRows
from vibroimpact.compile.elements.mode_switch import ModeSwitchRows
from vibroimpact.compile.elements.phase_switch import PhaseSwitchRows
from vibroimpact.compile.elements.soft_stop import SoftStopRows

ROWS: dict[str, type[ElementRows[Any]]] = {
    "soft_stop": SoftStopRows,
    "friction": FrictionRows,
    "phase_switch": PhaseSwitchRows,
    "mode_switch": ModeSwitchRows,
}
