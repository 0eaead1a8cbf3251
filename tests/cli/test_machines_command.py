"""Commands machines and show: the catalogue in words and pictures."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from vibroimpact.cli import main as cli
from vibroimpact.machines.machine import Machine, example_of, parameters_of
from vibroimpact.machines.registry import MACHINES, machine_of
from vibroimpact.plotting.gallery import parameter_rows, plot_known_for

pytestmark = pytest.mark.usefixtures("no_windows", "own_folder")


def test_machines_lists_every_machine_once(capsys: pytest.CaptureFixture[str]) -> None:
    assert cli.main(["machines"]) == 0
    first = [line.split()[0] for line in capsys.readouterr().out.splitlines() if line]
    assert first[:-1] == [*MACHINES]


@pytest.mark.parametrize("name", MACHINES)
def test_show_has_equations_parameters_source_and_what_to_try(
    name: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert cli.main(["show", name]) == 0
    shown = capsys.readouterr().out
    machine = machine_of(name)
    assert "(1)" in shown or name.startswith("impact-damper")
    assert f"source: {machine.source}" in shown
    for parameter in parameters_of(machine):
        assert f"\n{parameter} " in shown
    for command, _ in machine.to_try:
        assert f"vibroimpact {command}" in shown


def test_every_parameter_is_shown_with_its_default_and_its_unit() -> None:
    rows = {row.parameter: row for row in parameter_rows(machine_of("shaker"))}
    assert (rows["gravity"].default, rows["gravity"].unit) == ("4", "m/s²")
    assert (rows["restitution"].default, rows["restitution"].unit) == ("0.5", "")
    assert rows["mass"].meaning == "M of the table with the unbalance, > 0."
    oscillator = {row.parameter: row for row in parameter_rows(machine_of("impact-oscillator"))}
    assert oscillator["zeta"].default == ""  # there is none
    assert oscillator["lower_clearance"].default == "none"


def test_show_draws_a_machine_and_writes_its_page() -> None:
    assert cli.main(["show", "mole", "--out", "mole.svg", "--out", "mole.html"]) == 0
    assert b"<svg" in Path("mole.svg").read_bytes()
    page = Path("mole.html").read_text(encoding="utf-8")
    assert page.count("data:image/svg+xml") == 2
    assert "Pavlovskaia" in page


@pytest.mark.parametrize("name", MACHINES)
def test_a_machine_says_what_it_is_known_for(name: str) -> None:
    machine = machine_of(name)
    known = machine.known_for
    assert known is not Machine.known_for
    assert known.caption.endswith(".")
    changed = dict(known.parameters)
    if known.over:
        changed[known.over[0]] = known.over[1]
    replace(example_of(machine), **changed)  # parameters that it has


@pytest.mark.slow
@pytest.mark.parametrize("name", ["fermi-ulam", "bouncing-ball", "block-on-belt", "rammer"])
def test_what_a_machine_is_known_for_is_drawn(name: str) -> None:
    ax = plot_known_for(machine_of(name))
    assert ax.lines or ax.collections


def test_an_unknown_machine_and_a_file_of_data_are_refused(
    capsys: pytest.CaptureFixture[str],
) -> None:
    assert cli.main(["show", "shakr"]) == cli.MISUSE
    assert "shaker" in capsys.readouterr().err
    assert cli.main(["machines", "--out", "machines.nc"]) == cli.MISUSE
    assert "must end in .html" in capsys.readouterr().err
