"""The registry: general code names no machine, and takes every machine that is registered."""

from __future__ import annotations

import ast
import dataclasses
import math
import re
import shlex
from collections.abc import Iterator
from pathlib import Path

import pytest

import vibroimpact as vi
from vibroimpact._core.docstrings import descriptions
from vibroimpact.cli import main as cli
from vibroimpact.machines.json_text import system_of, text_of
from vibroimpact.machines.machine import Machine, example_of, parameters_of
from vibroimpact.machines.registry import (
    MACHINES,
    case_named,
    machine_of,
    machine_of_class,
    name_of,
)
from vibroimpact.machines.toml_file import read_case
from vibroimpact.machines.units import Quantity

pytestmark = pytest.mark.usefixtures("no_windows", "own_folder")

PACKAGE = Path(vi.__file__).parent
CLASSES = {name: machine_of(name) for name in MACHINES}
WITH_PARAMETERS = [
    c for c in cli.COMMANDS if c not in ("machines", "show", "reproduce", "switch", "tongue")
]
WORDS = {word for entry in MACHINES.values() for word in entry.place.split(":")}
PAPER = "vibroimpact_papers.impact_damper.circles"  # a publication, of that name too
OWN = {  # files that are about a machine, or list them
    "__init__.pyi", "machines/registry.py", "machines/published.py", "plotting/mechanism.py",
    "cli/orbit.py", "orbits/symmetric_damper.py",
    *(f"machines/{entry.place.partition(':')[0]}.py" for entry in MACHINES.values()),
}  # fmt: skip
GENERAL = [
    path
    for path in sorted(PACKAGE.rglob("*.py"))
    if path.relative_to(PACKAGE).as_posix() not in OWN
]


def fields_of(name: str) -> set[str]:
    return {f.name for f in dataclasses.fields(CLASSES[name])}  # type: ignore[arg-type]


def words_of(tree: ast.AST) -> Iterator[str]:
    """Names, attributes, modules and texts of a file, but for docstrings."""
    docs = {id(node.value) for node in ast.walk(tree) if isinstance(node, ast.Expr)}
    for node in ast.walk(tree):
        if isinstance(node, ast.Name):
            yield node.id
        elif isinstance(node, ast.Attribute):
            yield node.attr
        elif isinstance(node, ast.Import | ast.ImportFrom):
            yield from (getattr(node, "module", None) or "").split(".")
            yield from (part for alias in node.names for part in alias.name.split("."))
        elif isinstance(node, ast.Constant) and id(node) not in docs and node.value != PAPER:
            yield from re.findall(r"\w+", str(node.value))


def named(path: Path) -> set[str]:
    return WORDS & {*words_of(ast.parse(path.read_text(encoding="utf-8")))}


def sample(name: str) -> Machine:
    """The example of a machine."""
    return example_of(CLASSES[name])


# ---- general code --------------------------------------------------------------------------------


def test_no_general_module_names_a_machine() -> None:
    assert {path.name: found for path in GENERAL if (found := named(path))} == {}


def test_the_search_for_names_finds_them_where_they_are() -> None:
    assert "ImpactDamper" in named(PACKAGE / "cli" / "orbit.py")
    assert "impact_damper" in named(PACKAGE / "orbits" / "symmetric_damper.py")
    assert len(GENERAL) > 100


# ---- every machine -------------------------------------------------------------------------------


@pytest.mark.parametrize("name", MACHINES)
def test_a_machine_is_found_by_its_name_its_class_and_its_object(name: str) -> None:
    machine = sample(name)
    assert name_of(machine) == name
    assert machine_of_class(type(machine).__name__) is type(machine)
    assert case_named(name) == (name, {})
    assert getattr(vi.machines, type(machine).__name__) is type(machine)
    assert type(machine).__name__ in dir(vi.machines)


@pytest.mark.parametrize("name", MACHINES)
def test_a_machine_goes_to_json_and_back(name: str) -> None:
    machine = sample(name)
    back = system_of(text_of(machine))
    assert repr(back) == repr(machine)
    assert "Infinity" not in text_of(machine)


@pytest.mark.parametrize("name", MACHINES)
def test_a_machine_is_read_from_the_table_of_its_name(name: str) -> None:
    machine = sample(name)
    values = {p: getattr(machine, p) for p in parameters_of(type(machine))}
    lines = [f"{p} = {x!r}" for p, x in values.items() if x is not None]
    Path("machine.toml").write_text("\n".join([f"[{name}]", *lines]))
    assert read_case("machine.toml").system == machine


@pytest.mark.parametrize(
    ("command", "name"),
    [(command, "impact-oscillator") for command in WITH_PARAMETERS]
    + [("simulate", name) for name in MACHINES],
)
def test_help_lists_the_parameters_of_the_machine(
    command: str, name: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert cli.main([command, name, "--help"]) == 0
    shown = capsys.readouterr().out.partition("example:")[0]
    for other, machine in CLASSES.items():
        listed = {p for p in parameters_of(machine) if f"--{p.replace('_', '-')} " in shown}
        own = {*parameters_of(CLASSES[name])}
        assert listed == ({*parameters_of(machine)} & own if other != name else own)


@pytest.mark.parametrize("name", MACHINES)
def test_a_machine_can_be_differentiated_by_every_parameter(name: str) -> None:
    from vibroimpact.model.parameters import expanded, names_of

    machine = sample(name)
    counts = {f.name for f in dataclasses.fields(machine) if f.type == "int"}  # type: ignore[arg-type]
    for parameter in names_of(machine).keys() - counts:
        assert expanded(machine, parameter).degrees == machine.mechanism.degrees


@pytest.mark.parametrize("name", MACHINES)
def test_a_machine_moves_from_its_start(name: str) -> None:
    machine = sample(name)
    omega = machine.mechanism.omega or 0.1
    run = vi.simulate(machine, machine.free_start(), t_max=8.0 * math.pi / omega)
    assert run.end is vi.RunEnd.HORIZON
    assert len(run.time) > 2


@pytest.mark.parametrize("name", MACHINES)
def test_a_machine_says_where_it_comes_from_and_what_to_try(
    name: str, capsys: pytest.CaptureFixture[str]
) -> None:
    machine = CLASSES[name]
    assert len(machine.source) > 20
    assert machine.to_try
    for command, _ in machine.to_try:
        cli.parser().parse_args(shlex.split(command))
        assert shlex.split(command)[1].partition("/")[0] == name
    described = descriptions(machine)
    assert [*parameters_of(machine)] == [n for n in described if n != "si"]
    assert not capsys.readouterr().err


@pytest.mark.parametrize("name", [name for name in MACHINES if "si" in fields_of(name)])
def test_a_machine_in_si_units_needs_every_parameter_with_a_unit(name: str) -> None:
    machine = sample(name)
    values = {p: getattr(machine, p) for p in parameters_of(type(machine))}
    if "from_physical" in vars(type(machine)):
        return  # of engineers' numbers: test_impact_oscillator.py, and below
    made = type(machine).from_physical(**values)
    assert repr(made) == repr(machine).replace("si=False", "si=True")
    some = {p: x for p, x in values.items() if p != first_with_unit(machine)}
    with pytest.raises(vi.InvalidParameterError, match=f"{first_with_unit(machine)}: missing"):
        type(machine).from_physical(**some)
    lines = [f"{p} = {x!r}" for p, x in values.items() if x is not None]
    Path("si.toml").write_text("\n".join([f"[{name}.physical]", *lines]))
    assert repr(read_case("si.toml").system) == repr(made)


def first_with_unit(machine: Machine) -> str:
    """Name of the first parameter that has a unit and a default other than zero."""
    return next(
        f.name
        for f in dataclasses.fields(machine)  # type: ignore[arg-type]
        if f.metadata.get("quantity", Quantity()).quantity and f.default
    )


@pytest.mark.parametrize("name", MACHINES)
def test_a_machine_refuses_unknown_keywords_and_cannot_be_changed(name: str) -> None:
    machine = sample(name)
    with pytest.raises(vi.InvalidParameterError, match="colour: is no argument of"):
        dataclasses.replace(machine, colour=1.0)  # type: ignore[call-arg]
    with pytest.raises((dataclasses.FrozenInstanceError, TypeError)):
        machine.omega = 2.0  # type: ignore[attr-defined]


# ---- what is not there ---------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("case", "words"),
    [
        ("impact-dampr", "is no machine. Did you mean impact-damper? `vibroimpact machines`"),
        ("impact-dampr/A", "is no machine. Did you mean impact-damper? `vibroimpact machines`"),
        ("impact-damper/Z", "must be impact-damper alone, or with one of A, B, C, 2a"),
        ("gear-rattle/Z", "must be gear-rattle alone."),
        *(
            (case, f"must be one of {', '.join(MACHINES)}, or a case such as impact-damper/A, B")
            for case in ("/", "red")
        ),
    ],
)
def test_an_unknown_machine_or_case_is_answered_by_what_there_is(
    case: str, words: str, capsys: pytest.CaptureFixture[str]
) -> None:
    for more in ([], ["--omega", "1"], ["--clearance", "1"]):
        assert cli.main(["simulate", case, *more]) == cli.MISUSE
        assert f"case = {case!r}: {words}" in capsys.readouterr().err


def test_the_text_of_a_machine_holds_its_fields() -> None:
    text = (
        '{"type": "ImpactDamper", "mass_ratio": 0.1, "omega_n": 0.5, "zeta": 0.045, '
        '"restitution": 0.8, "half_clearance": 5.0, "omega": 1.2, "force": 1.0, '
        '"mass": 1.0, "si": false}'
    )
    damper = vi.ImpactDamper(
        mass_ratio=0.1, omega_n=0.5, zeta=0.045, restitution=0.8, half_clearance=5.0, omega=1.2
    )
    assert system_of(text) == damper
    assert text_of(damper) == text


def test_a_class_of_the_user_is_no_machine_whatever_its_name() -> None:
    class ImpactDamper:
        @property
        def mechanism(self) -> vi.Mechanism:
            raise NotImplementedError

    assert name_of(ImpactDamper()) is None
    assert system_of(text_of(ImpactDamper())) is None


def test_a_table_in_si_units_is_that_of_from_physical() -> None:
    values = {"M1": 10.0, "M2": 0.8, "K": 4e4, "C": 40.0, "F0": 60.0, "Omega": 66.0, "D": 0.006,
              "restitution": 0.6}  # fmt: skip
    lines = "\n".join(f"{name} = {value!r}" for name, value in values.items())
    for table in ("physical", "impact-damper.physical", "damper.physical"):
        Path("si.toml").write_text(f"[{table}]\n{lines}\n")
        damper = read_case("si.toml").system
        assert repr(damper) == repr(vi.ImpactDamper.from_physical(**values))
    Path("both.toml").write_text(f"[damper]\nomega = 1.0\n[damper.physical]\n{lines}\n")
    with pytest.raises(vi.InvalidParameterError, match="physical: is no argument of ImpactDamper"):
        read_case("both.toml")


def test_systems_survive_as_text() -> None:
    scaled = vi.ImpactDamper.from_physical(
        M1=10.0, M2=0.8, K=4.0e4, C=40.0, F0=60.0, Omega=66.0, D=6.0e-3, restitution=0.6
    )
    back = system_of(text_of(scaled))
    assert back == scaled
    assert isinstance(back, vi.ImpactDamper)
    two = vi.Mechanism(
        mass=((1.0, 0.1), (0.1, 1.0 / 3.0)), damping=((0.1, 0.0), (0.0, 0.2)),
        stiffness=((2.0, -1.0), (-1.0, 1.0)), constant_force=(0.0, -0.1),
        forces=(vi.Harmonic(1.0, (1.0, 0.0), (0.0, 0.5)), vi.Harmonic(2.0, (0.0, 0.1))),
        elements=(vi.RigidStop((1.0, 0.0), lower=-math.pi, restitution=(0.5, 0.25)),),
    )  # fmt: skip
    assert repr(system_of(text_of(two))) == repr(two)
    assert "Infinity" not in text_of(two)
