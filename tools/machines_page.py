"""Write docs/machines.md: the catalogue from its classes, and 78 published models, which of them are described.

python tools/machines_page.py            write the page
python tools/machines_page.py --check    exit 1 if the page is not what would be written
"""

from __future__ import annotations

import sys
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

from vibroimpact._core.docstrings import head_of
from vibroimpact.machines.registry import MACHINES, machine_of

PAGE = Path(__file__).resolve().parents[1] / "docs" / "machines.md"

TURNS = "large rotations: forces that are not linear in the coordinates"
SMOOTH = "a smooth nonlinear force"
HERTZ = "Hertz's law of contact; several soft stops approximate it"
DELAY = "forces with a delay"
NOISE = "random forces; a given record is simulated by `simulate_record`"
MANY = "more than 20 coordinates"
PERIODIC = "coefficients that vary smoothly with time; steps are a `PhaseSwitch`"


class Model(NamedTuple):
    """A published model: its name, what it needs, its entry in the catalogue, what it lacks."""

    name: str
    needs: str = "rigid stops"
    entry: str = ""
    lacks: str = ""


MODELS = (
    Model(
        "impact oscillator, one stop (Shaw & Holmes, Nordmark, Budd & Dux)",
        entry="impact-oscillator",
    ),
    Model("impact oscillator, two stops", entry="impact-oscillator"),
    Model("impact damper (the founding paper)", entry="impact-damper"),
    Model("multi-unit impact damper", entry="multi-unit-damper"),
    Model("vibro-impact energy sink, ball in a cavity", entry="energy-sink"),
    Model("bouncing ball on a table (Holmes)", "a stop that moves", "bouncing-ball"),
    Model("column of balls, two bouncing balls"),
    Model("gear rattle, rigid teeth (Mason & Piiroinen)", entry="gear-rattle"),
    Model("inertial shaker, impact-forming machine (Luo)", entry="shaker"),
    Model("vibrating hammer with clearance", entry="vibration-hammer"),
    Model("dual-component system (Luo & Xie 2003)", entry="dual-component"),
    Model("three masses, Hopf-Hopf bifurcation (Xie & Ding 2005)"),
    Model("inverted pendulum between walls, linearised", "rigid stops, negative stiffness"),
    Model("self-excited oscillator with a stop (Peterka)", "rigid stops, negative damping"),
    Model(
        "energy harvester, ball in a capsule (Serdukova, Kuske, Yurchenko)", entry="ball-harvester"
    ),
    Model("pounding of structures on a ground that shakes", entry="pounding"),
    Model("beam or rod on a rigid stop, up to 10 modes"),
    Model("nonsmooth modes: a chain with a stop, elastic"),
    Model(
        "bilinear oscillator (Shaw & Holmes, Ing et al.)", "soft stops", "soft-impact-oscillator"
    ),
    Model("two masses, soft impacts with preload (Peterka, Pavlovskaia)", "soft stops"),
    Model("gear backlash, constant mesh stiffness", "soft stops", "gear-backlash"),
    Model("suspension bridge hangers", "soft stops", "bilinear-oscillator"),
    Model("moored ship, articulated tower", "soft stops", "bilinear-oscillator"),
    Model("vibratory roller whose drum lifts off", "soft stops"),
    Model("two masses with a unilateral spring (NLvib)", "soft stops"),
    Model("impact metamaterial, a chain", "soft stops"),
    Model("vertical hopper", "soft stops"),
    Model("rocking block, slender (Hogan)", "modes and guards"),
    Model("atomic force microscope with a liquid bridge", "modes and guards"),
    Model("friction oscillator on a belt", "friction", "block-on-belt"),
    Model("two masses with friction (Siconos)", "friction"),
    Model("drill string, stick-slip", "friction", "drill-string"),
    Model("train brakes (Siconos)", "friction"),
    Model(
        "impact oscillator with dry friction (Cone & Zadoks)",
        "rigid stops, friction",
        "dry-impact-oscillator",
    ),
    Model("energy sink with dry friction (Youssef 2025)", "rigid stops, friction"),
    Model("forced oscillator with Jenkins elements (NLvib)", "sliders, soft stops"),
    Model("brake squeal with lift-off", "friction with a load, soft stops"),
    Model("vibration-driven slider, anisotropic friction", "friction and a constant force, drift"),
    Model("vibro-impact driver, pile (Luo)", "sliders, drift", "rammer"),
    Model("percussive drilling (Krivtsov & Wiercigroch)", "sliders, drift"),
    Model("conveyor with hopping parts", "friction with a load, drift"),
    Model("woodpecker toy (Siconos)", "friction, drift", lacks="impulses of friction at impacts"),
    Model("vibro-impact capsule (Liu 2013)", "soft stops, friction, drift", "capsule"),
    Model("rammer on plastic soil", "soft stops, sliders, drift", "rammer"),
    Model("ground moling, frictional slider (Pavlovskaia)", "soft stops, sliders, drift", "mole"),
    Model(
        "electromagnetic harvester with stops",
        "rigid stops, a first-order state",
        "electromagnetic-harvester",
    ),
    Model(
        "piezoelectric harvester with an end stop (Ai 2019)",
        "soft stops, a first-order state",
        "piezo-harvester",
    ),
    Model(
        "airfoil with an impacting flap", "rigid stops, first-order states, K and C not symmetric"
    ),
    Model("airfoil with freeplay", "soft stops, first-order states, K and C not symmetric"),
    Model(
        "wheelset, linear creep, rigid flanges (Meijaard & de Pater)",
        "rigid stops, K not symmetric",
        "wheelset",
    ),
    Model("bogie with creep that saturates (Kaas-Petersen)", "soft stops", lacks=SMOOTH),
    Model("Jeffcott rotor in a snubber ring (Karpenko)", "soft stops", lacks=TURNS),
    Model("rotor rub with friction (Chu & Zhang)", "soft stops, friction", lacks=TURNS),
    Model("gyroscopic rotor, bouncing partial contact", "soft stops", lacks=TURNS),
    Model("gear pair, mesh stiffness that varies", "soft stops", lacks=PERIODIC),
    Model("Fermi-Ulam accelerator", "a stop that moves", "fermi-ulam"),
    Model(
        "bouncing ball, any periodic motion of the table",
        "a stop that moves, up to 12 lines",
        "bouncing-ball",
    ),
    Model("cam and follower (Alzate)", "a stop that moves, up to 12 lines", "cam-follower"),
    Model("print hammer, a pulse", "phase switches"),
    Model("valve train with surge of the spring", "soft stops that move, up to 12 lines"),
    Model("oscillator with a shock at its second stop (2017)", "an active stop"),
    Model("relief valve (Hos, Fotsch)", "a first-order state", lacks=SMOOTH),
    Model("impact Duffing oscillator", lacks=SMOOTH),
    Model("van der Pol oscillator with an impact damper (Chatterjee & Mallik)", lacks=SMOOTH),
    Model("MEMS switch, electrostatic", lacks=SMOOTH),
    Model("Duffing oscillator with Hertz contact (Skurativskyi et al.)", "friction", lacks=HERTZ),
    Model("heat-exchanger tube with a loose support", "soft stops", lacks=DELAY),
    Model("delayed bilinear oscillator", "soft stops", lacks=DELAY),
    Model("stick-slip-impact, electrostatic (COCO)", "friction", lacks=SMOOTH),
    Model("church bell and clapper", lacks=TURNS),
    Model("impacting pendulum", lacks=TURNS),
    Model("bouncing rod, spring-loaded inverted pendulum", lacks=TURNS),
    Model("slider-crank with clearance (Siconos)", "friction", lacks=TURNS),
    Model("vibro-impact oscillator under white noise (Sykora 2024)", lacks=NOISE),
    Model("gear rattle, random loading (Wen & Yang)", lacks=NOISE),
    Model("pounding in an earthquake, Kelvin-Voigt contact", "soft stops, a record"),
    Model("granular particle damper", "friction", lacks=f"{MANY}; {HERTZ}"),
    Model("guitar string on frets (Siconos)", lacks=MANY),
)


def page() -> str:
    """The whole page."""
    described = sum(not model.lacks for model in MODELS)
    named = sum(bool(model.entry) for model in MODELS)
    return "\n".join(
        [
            "# Machines",
            "",
            "Written by `tools/machines_page.py`.",
            "",
            "A machine of the catalogue has a name. Every command takes it, `vibroimpact simulate shaker --omega",
            "5`; so does a file, as a table `[shaker]`, or `[shaker.physical]` with numbers in SI units; in",
            "Python it is `vi.machines.Shaker(omega=5.0)`, or `vi.machines.Shaker.from_physical(...)`. Most",
            "parameters have defaults, in units of their own, that make an example. `vibroimpact show shaker`",
            "says the equations, the parameters with their units, the source and what to try; `vibroimpact",
            "machines --out gallery.html` draws all of them. What has no name is a `Mechanism`:",
            "[describe-your-machine.md](describe-your-machine.md).",
            "",
            "## The catalogue",
            "",
            "| name | `vi.machines.` | what it is |",
            "|---|---|---|",
            *_catalogue(),
            "",
            "The tests compare each with a number that this package has not made: closed forms of periodic",
            "motions, of free periods, stick-slip times, sets of blows, lift-off. Sources are named as far as",
            "they are known; numbers of equations that were not to be had are called so.",
            "",
            "## Published models",
            "",
            f"Of {len(MODELS)} models that a survey of the literature and of public code met, {described} are",
            f"described by mechanisms, and {named} of these are cases of a machine of the catalogue. What each",
            "of the others lacks stands beside it.",
            "",
            "| model | needs | described | in the catalogue | lacks |",
            "|---|---|---|---|---|",
            *_models(),
            "",
            "Converters and walkers, a buck converter or a rimless wheel, are no mechanisms: they are hybrid systems,",
            "[describe-your-machine.md](describe-your-machine.md#what-is-no-mechanism).",
            "",
        ]
    )


def _catalogue() -> Iterator[str]:
    for name in MACHINES:
        machine = machine_of(name)
        yield f"| `{name}` | `{machine.__name__}` | {head_of(machine)} |"


def _models() -> Iterator[str]:
    for model in MODELS:
        entry = f"`{model.entry}`" if model.entry else ""
        yield f"| {model.name} | {model.needs} | {'no' if model.lacks else 'yes'} | {entry} | {model.lacks} |"


if __name__ == "__main__":
    if sys.argv[1:] == ["--check"]:
        sys.exit(PAGE.read_text("utf-8") != page())
    PAGE.write_text(page(), "utf-8")
