"""Registry of machines, one line each. A machine is imported when it is first used.

General code never names a machine: it takes a system from the user, or its class from here by a
name from the command line, a file or a store.
"""

from __future__ import annotations

from collections.abc import Mapping
from importlib import import_module
from typing import TYPE_CHECKING, Any, NamedTuple, cast

from vibroimpact._core.errors import InvalidParameterError
from vibroimpact._core.words import meant

if TYPE_CHECKING:
    from vibroimpact.machines.machine import Machine

Cases = Mapping[str, Mapping[str, float]]


class Entry(NamedTuple):
    """Location of a machine's class, and of a function that returns its published cases."""

    place: str  # "module:Class" in this folder
    # "module:function"; the function returns parameters by name of the case. "" if there is none
    cases: str = ""


MACHINES = {
    "impact-damper": Entry("impact_damper:ImpactDamper", "published:cases"),
    "impact-oscillator": Entry("impact_oscillator:ImpactOscillator"),
    "vibration-hammer": Entry("vibration_hammer:VibrationHammer"),
    "gear-rattle": Entry("gear_rattle:GearRattle"),
    "gear-backlash": Entry("gear_backlash:GearBacklash"),
    "shaker": Entry("shaker:Shaker"),
    "wheelset": Entry("wheelset:Wheelset"),
    "rammer": Entry("rammer:Rammer"),
    "bouncing-ball": Entry("bouncing_ball:BouncingBall"),
    "fermi-ulam": Entry("fermi_ulam:FermiUlam"),
    "bilinear-oscillator": Entry("bilinear_oscillator:BilinearOscillator"),
    "soft-impact-oscillator": Entry("soft_impact_oscillator:SoftImpactOscillator"),
    "friction-oscillator": Entry("friction_oscillator:FrictionOscillator"),
    "dry-impact-oscillator": Entry("dry_impact_oscillator:DryImpactOscillator"),
    "block-on-belt": Entry("block_on_belt:BlockOnBelt"),
    "drill-string": Entry("drill_string:DrillString"),
    "capsule": Entry("vibro_impact_capsule:VibroImpactCapsule"),
    "mole": Entry("mole:Mole"),
    "energy-sink": Entry("energy_sink:EnergySink"),
    "ball-harvester": Entry("ball_harvester:BallHarvester"),
    "electromagnetic-harvester": Entry("electromagnetic_harvester:ElectromagneticHarvester"),
    "piezo-harvester": Entry("piezo_harvester:PiezoHarvester"),
    "pounding": Entry("pounding_structures:PoundingStructures"),
    "impact-pair": Entry("impact_pair:ImpactPair"),
    "dual-component": Entry("dual_component:DualComponent"),
    "cam-follower": Entry("cam_follower:CamFollower"),
    "multi-unit-damper": Entry("multi_unit_damper:MultiUnitDamper"),
}
DEFAULT = "impact-damper"  # if the command line names no machine
NICKNAMES = {"damper": ("impact-damper",), "oscillator": ("impact-oscillator",)}
SHORT_TABLES = {"damper": "impact-damper", "physical": "impact-damper.physical"}  # in TOML


def machine_of(name: str) -> type[Machine]:
    """Class of a machine by its name."""
    return cast("type[Machine]", _object(MACHINES[name].place))


def name_of(system: object) -> str | None:
    """Name of the machine to which a system belongs; None for any other system."""
    ours = {f"{__package__}.{entry.place}": name for name, entry in MACHINES.items()}
    places = (f"{kind.__module__}:{kind.__qualname__}" for kind in type(system).__mro__)
    return next((ours[place] for place in places if place in ours), None)


def machine_of_class(name: str) -> type[Machine] | None:
    """Machine whose class has this name; None if there is none."""
    found = (key for key, entry in MACHINES.items() if entry.place.endswith(f":{name}"))
    return next(map(machine_of, found), None)


def cases_of(name: str) -> Cases:
    """Published cases of a machine: parameters by name of the case."""
    cases = MACHINES[name].cases
    return cast(Cases, _object(cases)()) if cases else {}


def case_named(text: str) -> tuple[str, Mapping[str, float]]:
    """Machine and parameters of NAME/CASE, or of NAME, without parameters.

    Raises
    ------
    InvalidParameterError
        No such machine, or no such case; the message lists them.
    """
    name, _, case = text.partition("/")
    if text == name and name in MACHINES:
        return name, {}
    if name in MACHINES and case in cases_of(name):
        return name, cases_of(name)[case]
    if name in MACHINES:
        known = f", or with one of {', '.join(cases_of(name))}" if cases_of(name) else ""
        raise InvalidParameterError(f"case = {text!r}: must be {name} alone{known}.")
    if near := meant(name, MACHINES, NICKNAMES):
        raise InvalidParameterError(
            f"case = {text!r}: is no machine.{near} `vibroimpact machines` lists them."
        )
    named = "; ".join(f"{one}/{', '.join(cases_of(one))}" for one in MACHINES if cases_of(one))
    raise InvalidParameterError(
        f"case = {text!r}: must be one of {', '.join(MACHINES)}, or a case such as {named}. Or "
        "give --config."
    )


def _object(place: str) -> Any:
    module, _, name = place.partition(":")
    return getattr(import_module(f"{__package__}.{module}"), name)
