"""Quantities with units in files and on the command line are the numbers of SI units."""

from __future__ import annotations

import math
from pathlib import Path

import pytest

import vibroimpact as vi
from vibroimpact._core.quantities import UNITS
from vibroimpact.cli import main as cli
from vibroimpact.machines.quantities import checked, number_in
from vibroimpact.machines.toml_file import Case, read_case

pytestmark = pytest.mark.usefixtures("own_folder")

NUMBERS = {
    "M1": 12.0,
    "M2": 0.4,
    "K": 9.6e5,
    "C": 30.0,
    "F0": 20.0,
    "Omega": 90.0 * math.pi,
    "D": 4e-3,
}
WRITTEN = {
    "M1": "12 kg", "M2": "400 g", "K": "960 N/mm", "C": "30 N s/m", "F0": "0.02kN", "Omega": "45 Hz",
    "D": "4 mm",
}  # fmt: skip


def machine(**changes: str) -> Path:
    lines = [f'{name} = "{value}"' for name, value in (WRITTEN | changes).items()]
    Path("m.toml").write_text("\n".join(["[physical]", *lines, "restitution = 0.6"]))
    return Path("m.toml")


def test_a_file_with_units_is_the_machine_in_si_units() -> None:
    case = read_case(machine())
    expected = vi.ImpactDamper.from_physical(**NUMBERS, restitution=0.6)
    assert isinstance(case, Case)
    for name in ("mass", "mass_ratio", "omega_n", "zeta", "force", "omega", "half_clearance"):
        assert getattr(case.system, name) == pytest.approx(getattr(expected, name), rel=1e-15)


@pytest.mark.parametrize("quantity", UNITS)
def test_every_quantity_is_understood_in_its_si_unit(quantity: str) -> None:
    assert checked("it", number_in(f"2.5 {UNITS[quantity]}"), quantity, si=True) == 2.5


@pytest.mark.parametrize(
    ("text", "value"), [("50 um", 5e-5), ("0.3mm", 3e-4), ("7 ms", 7e-3), ("1e-3 kg mm", 1e-6)]
)
def test_a_number_with_a_unit_is_rounded_once(text: str, value: float) -> None:
    assert number_in(text) == value


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("4mm", 4e-3),
        ("2700 rpm", 90.0 * math.pi),
        ("5 %", 0.05),
        ("180 deg", math.pi),
        ("1e-3", 1e-3),
    ],
)
def test_numbers_with_units(text: str, value: float) -> None:
    assert number_in(text) == pytest.approx(value, rel=1e-15)


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"D": "4 kg"}, "D = 4 kg: must be a length"),
        ({"D": "4 parsec"}, "mm"),
        ({"M1": "4 mm"}, "a mass"),
    ],
)
def test_a_wrong_unit_is_said_to_be_one(changes: dict[str, str], words: str) -> None:
    with pytest.raises(vi.InvalidParameterError, match=words):
        read_case(machine(**changes))


def test_a_machine_whose_numbers_have_no_units_takes_none() -> None:
    with pytest.raises(vi.InvalidParameterError, match="have none"):
        checked("half_clearance", number_in("4 mm"), "length", si=False)


def test_letters_of_files_name_parameters(capsys: pytest.CaptureFixture[str]) -> None:
    argv = ["sweep", "--config", str(machine()), "--over", "D=2mm:6mm:3", "--periods", "2"]
    assert cli.main([*argv, "--settle-periods", "1", "--out", "s.nc"]) == 0
    found = vi.load("s.nc")
    assert found["half_clearance"].values == pytest.approx([1e-3, 2e-3, 3e-3], rel=1e-15)
    assert cli.main([*argv[:3], "--over", "D=2kg:6kg:3"]) == cli.MISUSE
    assert "must be a length" in capsys.readouterr().err
    damper = vi.ImpactDamper.from_physical(**NUMBERS, restitution=0.6)
    with pytest.raises(vi.InvalidParameterError, match=r"is half_clearance = 0\.5 D"):
        vi.sweep(damper, over={"D": [1.0]}, start=damper.free_start(), progress=False)


def test_a_motion_without_a_start_begins_at_rest(capsys: pytest.CaptureFixture[str]) -> None:
    Path("o.toml").write_text(
        "[mechanism]\nmass = [[1.0]]\ndamping = [[0.1]]\nstiffness = [[1.0]]\n"
        "[[mechanism.forces]]\nomega = 1.0\nsine = [1.0]\n"
        '[[mechanism.elements]]\nkind = "rigid_stop"\nrow = [1.0]\nupper = 0.5\n'
    )
    assert cli.main(["simulate", "--config", "o.toml", "--impacts", "2"]) == 0
    text = capsys.readouterr().out
    assert "between the stops: no start is given" in text
    assert "position=(0.0,), velocity=(0.0,)" in text
