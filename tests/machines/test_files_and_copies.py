"""A machine as a file and back, and with other values: the same from Python and on the command line."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import vibroimpact as vi
from vibroimpact.cli import main as cli
from vibroimpact.machines.json_text import system_of, text_of
from vibroimpact.machines.units import units_of
from vibroimpact.model.elements.table import KINDS
from vibroimpact.model.system import System

pytestmark = pytest.mark.usefixtures("own_folder")

HAMMER = vi.Mechanism(
    mass=[[40.0, 0.0], [0.0, 8.0]],
    damping=[[60.0, -20.0], [-20.0, 20.0]],
    stiffness=[[2e5, -1e5], [-1e5, 1e5]],
    forces=(vi.Harmonic(60.0, (100.0, 0.0)), vi.Harmonic(90.0, (0.0, 0.0), (1e-7, 3.0))),
    constant_force=(0.0, -78.48),
    elements=(
        vi.RigidStop((-1.0, 1.0), upper=0.003, restitution=(0.7, 0.6)),
        vi.SoftStop((1.0, 0.0), upper=0.2, stiffness=29.0, motion=vi.Harmonic(60.0, (0.05,))),
        vi.Friction((0.0, 1.0), 0.1, 0.15, load=vi.NormalLoad(1.0, (0.5, 0.0))),
        vi.PhaseSwitch(60.0, (0.0, 3.14), ((0.1, 0.0), (-0.1, 0.0))),
    ),
    impact_law="sequential",
    si=True,
)
START = vi.State((0.0, 0.001), (0.0, 0.5), 0.25)


def alone(*elements: vi.Element) -> vi.Mechanism:
    return vi.Mechanism(
        mass=[[1.0]],
        damping=[[0.1]],
        stiffness=[[1.0]],
        forces=(vi.Harmonic(1.0, (1.0,)),),
        elements=elements,
    )


LINE = vi.Harmonic(1.0, (0.0,), (0.5,))
ELEMENTS = {
    "rigid_stop": (
        alone(vi.RigidStop((1.0,), upper=1.0)),
        alone(vi.RigidStop((1.0,), lower=-1.0, restitution=(0.2, 0.0), motion=LINE, active=True)),
    ),
    "soft_stop": (
        alone(vi.SoftStop((1.0,), lower=-1.0)),
        alone(vi.SoftStop((1.0,), -1.0, 1.0, (2.0, 3.0), (0.0, 0.1), law="limited", motion=(LINE,))),
    ),
    "friction": (
        alone(vi.Friction((1.0,), 0.5)),
        alone(vi.Friction((1.0,), 0.5, 0.7, 0.3, load=vi.NormalLoad(1.0))),
        alone(vi.Friction((1.0,), 0.5, motion=LINE, load=vi.NormalLoad(0.0, (1.0,), (0.5,), LINE))),
    ),
    "phase_switch": (
        alone(vi.PhaseSwitch(1.0, (0.0, 3.0), row=(1.0,), stiffness=(0.0, 1.0))),
        alone(vi.PhaseSwitch(1.0, (0.0,), impulses=((0.5,),))),
        alone(vi.PhaseSwitch(1.0, (0.0, 3.0), ((0.1,), (0.0,)), row=(1.0,), damping=(0.2, 0.1))),
    ),
    "mode_switch": (
        vi.HybridSystem({"one": vi.LinearMode([[-1.0]])}, {}, ()).mechanism,
    ),
}  # fmt: skip


def hammer(omega: float = 60.0) -> vi.Mechanism:
    return HAMMER.replace(omega=omega)


@pytest.mark.parametrize(
    "machine",
    [
        HAMMER,
        vi.ImpactDamper.from_physical(
            M1=10.0, M2=0.8, K=4e4, C=40.0, F0=60.0, Omega=66.0, D=0.006, restitution=0.6
        ),
        vi.ImpactOscillator(zeta=0.05, omega=1.2, restitution=0.8, clearance=1.0),
    ],
)
def test_a_machine_and_its_start_come_back_from_a_file(machine: System) -> None:
    Path("m.toml").write_text(machine.to_toml(START), encoding="utf-8")  # type: ignore[attr-defined]
    read = vi.load_machine("m.toml")
    assert read == machine
    assert read.si == machine.si  # type: ignore[union-attr]
    assert vi.load_start("m.toml") == START
    assert system_of(text_of(read)).si == machine.si  # type: ignore[union-attr]


@pytest.mark.parametrize("kind", KINDS)
def test_every_field_of_an_element_comes_back_from_a_file(kind: str) -> None:
    """Elements with as many fields as they can have, and with as few: each of them false or empty where it may be."""
    for machine in ELEMENTS[kind]:
        Path("m.toml").write_text(machine.to_toml(), encoding="utf-8")
        read = vi.load_machine("m.toml")
        assert read == machine
        assert system_of(text_of(machine)) == machine


def test_a_family_is_written_as_its_mechanism() -> None:
    Path("m.toml").write_text(vi.Family(hammer).to_toml(), encoding="utf-8")
    assert vi.load_machine("m.toml") == hammer()
    assert vi.load_start("m.toml") is None


def ball(restitution: float = 0.5) -> vi.HybridSystem:
    return vi.HybridSystem(
        modes={"flight": vi.LinearMode([[0.0, 1.0], [0.0, 0.0]], constant=(0.0, -1.0))},
        guards={"floor": vi.LinearGuard((1.0, 0.0))},
        transitions=(
            vi.Transition("flight", "floor", "falling", "flight", [[1.0, 0.0], [0.0, -restitution]]),
        ),
    )  # fmt: skip


def test_a_family_of_hybrid_systems_is_written_as_its_mechanism() -> None:
    Path("m.toml").write_text(vi.Family(ball).to_toml(), encoding="utf-8")
    read, start = vi.load_machine("m.toml"), vi.State((0.5, 0.0), (0.0, 0.0))
    assert read == ball().mechanism
    np.testing.assert_array_equal(
        vi.simulate(read, start, t_max=2.5).time, vi.simulate(ball(), start, t_max=2.5).time
    )


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("to = 0", "to = 1", r"ways\[0\].to = 1: must be at most 0"),
        ("matrix = [[1.0, 0.0], ", "matrix = [", r"ways\[0\].matrix = .*: must be of shape \(2, 2\)"),
        ("constants = [[0.0, -1.0]]", "constants = []", "constants = .*: must be one for each of 1 modes"),
    ],
)  # fmt: skip
def test_modes_of_a_file_that_do_not_fit_are_refused(old: str, new: str, words: str) -> None:
    text = vi.Family(ball).to_toml()
    assert old in text
    Path("m.toml").write_text(text.replace(old, new), encoding="utf-8")
    with pytest.raises(vi.InvalidParameterError, match=words):
        vi.load_machine("m.toml")


def test_values_are_replaced_by_name_and_by_path() -> None:
    assert HAMMER.replace(omega=66.0).omega == 66.0
    moved = HAMMER.replace({"elements[0].upper": 0.004}, impact_law="moreau")
    assert (moved.elements[0].limit_at(1), moved.impact_law) == (0.004, "moreau")
    assert vi.Family(hammer).replace(omega=66.0).mechanism == HAMMER.replace(omega=66.0)
    oscillator = vi.ImpactOscillator(zeta=0.05, omega=1.2, restitution=0.8, clearance=1.0)
    assert oscillator.replace(lower_clearance=0.5).lower_clearance == 0.5
    for system in (HAMMER, vi.Family(hammer), oscillator):
        with pytest.raises(vi.InvalidParameterError, match=r"omgea.*omega"):
            system.replace(omgea=66.0)


def test_a_family_takes_defaults_and_says_what_it_misses() -> None:
    assert repr(vi.Family(hammer)) == "Family(hammer, omega=60.0)"
    with pytest.raises(vi.InvalidParameterError, match=r"<lambda>: has no parameter"):
        vi.Family(lambda: HAMMER)
    with pytest.raises(vi.InvalidParameterError, match=r"Give Family\(<lambda>, k=\.\.\.\)"):
        vi.Family(lambda k: HAMMER.replace(omega=k))


def test_omega_is_an_option_for_a_mechanism_too(capsys: pytest.CaptureFixture[str]) -> None:
    Path("m.toml").write_text(HAMMER.to_toml(START), encoding="utf-8")
    argv = ["simulate", "--config", "m.toml", "--t-max", "0.1", "--out", "r.nc"]
    assert cli.main([*argv, "--omega", "66"]) == 0
    assert vi.load("r.nc").system == HAMMER.replace(omega=66.0)
    assert cli.main([*argv, "--mass-ratio", "1"]) == cli.MISUSE
    assert "--mass-ratio: is not a parameter of a [mechanism], but --omega" in (
        capsys.readouterr().err
    )


def test_numbers_of_a_mechanism_have_units_by_their_path() -> None:
    units = units_of(HAMMER)
    paths = {
        "omega": "rad/s", "elements[0].upper": "m", "stiffness[0][1]": "N/m", "mass[0][0]": "kg",
        "forces[0].sine[1]": "N", "elements[1].motion[0].sine[0]": "m", "elements[0].restitution": "",
    }  # fmt: skip
    assert {path: units.unit(units.quantity_of(path)) for path in paths} == paths
    run = vi.simulate(HAMMER, START, t_max=0.1)
    assert run.to_dataset().position.units == "m"
