"""The rows of every element, by its class."""

from __future__ import annotations

from typing import Any

from vibroimpact.compile.elements.element import ElementRows
from vibroimpact.compile.elements.friction import FrictionRows
from vibroimpact.compile.elements.phase_switch import PhaseSwitchRows
from vibroimpact.compile.elements.rigid_stop import RigidStopRows
from vibroimpact.compile.elements.soft_stop import SoftStopRows
from vibroimpact.model.elements.element import Element
from vibroimpact.model.elements.friction import Friction
from vibroimpact.model.elements.phase_switch import PhaseSwitch
from vibroimpact.model.elements.rigid_stop import RigidStop
from vibroimpact.model.elements.soft_stop import SoftStop

ROWS: dict[type[Element], type[ElementRows[Any]]] = {
    RigidStop: RigidStopRows,
    SoftStop: SoftStopRows,
    Friction: FrictionRows,
    PhaseSwitch: PhaseSwitchRows,
}
