"""Table of the elements, by their names in files."""

from __future__ import annotations

from vibroimpact.model.elements.element import Element
from vibroimpact.model.elements.friction import Friction
from vibroimpact.model.elements.mode_switch import ModeSwitch
from vibroimpact.model.elements.phase_switch import PhaseSwitch
from vibroimpact.model.elements.rigid_stop import RigidStop
from vibroimpact.model.elements.soft_stop import SoftStop

KINDS: dict[str, type[Element]] = {
    kind.kind: kind for kind in (RigidStop, SoftStop, Friction, PhaseSwitch, ModeSwitch)
}
