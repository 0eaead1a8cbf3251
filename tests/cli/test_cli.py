"""The command line: its output is the library's, its errors say what to do, it leaves no debris."""

from __future__ import annotations

import dataclasses
import inspect
import math
import os
import re
import shlex
import signal
import subprocess
import sys
import types
from pathlib import Path
from typing import NamedTuple

import matplotlib.pyplot as plt
import numpy as np
import pytest
import xarray as xr
from support.commands import opened
from vibroimpact_papers.judged import Word

import vibroimpact as vi
from vibroimpact.cli import main as cli
from vibroimpact.machines.json_text import system_of, text_of
from vibroimpact.machines.published import panels, parameter_sets
from vibroimpact.machines.toml_file import read_case
from vibroimpact.orbits.stability import Stability

pytestmark = pytest.mark.usefixtures("no_windows", "own_folder")

CASE = ["impact-damper/A", "--omega", "1.2"]
SET_A = vi.ImpactDamper(
    mass_ratio=0.1, omega_n=0.5, zeta=0.045, restitution=0.8, half_clearance=5.0, omega=1.2
)


def refused(argv: list[str], capsys: pytest.CaptureFixture[str]) -> str:
    """The message of a misuse, after which nothing is left behind."""
    before = sorted(Path().rglob("*"))
    assert cli.main(argv) == cli.MISUSE
    assert sorted(Path().rglob("*")) == before
    return capsys.readouterr().err


# ---- the output is the library's -----------------------------------------------------------------


def test_simulate_writes_the_run_of_the_library() -> None:
    assert (
        cli.main(["simulate", *CASE, "--perturb", "1e-3", "--impacts", "50", "--out", "r.nc"]) == 0
    )
    start = vi.symmetric_orbits(SET_A)[0].state.perturbed(1e-3)
    expected = vi.simulate(SET_A, start, impacts=50).to_dataset()
    xr.testing.assert_identical(opened("r.nc"), expected)


def test_section_writes_the_section_of_the_library() -> None:
    argv = ["section", *CASE, "--position", "0", "0", "--velocity", "0", "-1e0", "--points", "30"]
    assert cli.main([*argv, "--settle-events", "7", "--at", "B", "--out", "s.nc"]) == 0
    start = vi.State((0.0, 0.0), (0.0, -1.0))
    expected = vi.section(SET_A, start, at=vi.AtStop("B"), points=30, settle_events=7)
    xr.testing.assert_identical(opened("s.nc"), expected.to_dataset())


def test_orbit_writes_the_orbits_of_the_library() -> None:
    assert cli.main(["orbit", *CASE, "--out", "o.nc"]) == 0
    data, orbits = opened("o.nc"), vi.symmetric_orbits(SET_A)
    nu = data.half_multiplier_real.values + 1j * data.half_multiplier_imaginary.values
    np.testing.assert_array_equal(nu, [orbit.half_multipliers for orbit in orbits])
    assert [Stability(k).words for k in data.stability.values] == ["stable", "unstable"]
    assert list(data.sign) == [1, -1]


@pytest.mark.parametrize("command", ["simulate", "orbit", "section"])
@pytest.mark.parametrize("suffix", ["svg", "png", "pdf"])
def test_every_command_draws_a_picture(command: str, suffix: str) -> None:
    assert cli.main([command, *CASE, "--out", f"p.{suffix}"]) == 0
    assert Path(f"p.{suffix}").stat().st_size > 1000
    assert not plt.get_fignums()


def test_several_files_are_written_at_once_and_old_ones_replaced() -> None:
    Path("r.nc").write_text("an old file")
    assert cli.main(["simulate", *CASE, "--impacts", "9", "--out", "r.nc", "--out", "h.svg"]) == 0
    assert opened("r.nc").sizes["event"] == 9
    assert sorted(path.name for path in Path().iterdir()) == ["h.svg", "r.nc"]


def test_the_case_names_are_those_of_the_paper(capsys: pytest.CaptureFixture[str]) -> None:
    for name, known in parameter_sets().items():
        omega = str(known.omega_range[0])
        cli.main(["orbit", f"impact-damper/{name}", "--omega", omega])
        assert f"half_clearance={known.parameters.half_clearance}" in capsys.readouterr().out
    panel = next(panel for panel in panels() if panel.name == "2c")
    cli.main(["orbit", "impact-damper/2c"])
    assert f"omega={panel.omega}" in capsys.readouterr().out


def test_an_option_replaces_the_value_of_the_case(capsys: pytest.CaptureFixture[str]) -> None:
    assert cli.main(["orbit", *CASE, "--restitution", "0.75"]) == 0
    assert "restitution=0.75" in capsys.readouterr().out


def test_a_start_on_a_stop_is_that_of_the_library() -> None:
    argv = ["--on-stop", "B", "--position", "0.5", "--velocity", "0", "2", "--phase", "-1e-1"]
    assert cli.main(["simulate", *CASE, *argv, "--impacts", "5", "--out", "r.nc"]) == 0
    start = SET_A.on_stop("B", x1=0.5, v1=0.0, v2=2.0, phase=-0.1)
    np.testing.assert_array_equal(opened("r.nc").time, vi.simulate(SET_A, start, impacts=5).time)


def test_version_and_help_end_well(capsys: pytest.CaptureFixture[str]) -> None:
    assert cli.main(["--version"]) == 0
    assert vi.__version__ in capsys.readouterr().out
    assert cli.main(["--help"]) == 0


@pytest.mark.parametrize("command", cli.COMMANDS)
def test_help_shows_an_example_that_is_understood(
    command: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert cli.main([command, "--help"]) == 0
    assert cli.module_of(command).EXAMPLE in capsys.readouterr().out
    cli.parser().parse_args(shlex.split(cli.module_of(command).EXAMPLE)[1:])


@pytest.mark.parametrize("command", cli.COMMANDS)
def test_help_has_no_markup_of_docstrings(command: str, capsys: pytest.CaptureFixture[str]) -> None:
    cli.main([command, "--help"])
    shown = capsys.readouterr().out
    assert not re.search(r":\w+:`|``|default: None", shown)


def test_help_shows_the_defaults_of_the_functions(capsys: pytest.CaptureFixture[str]) -> None:
    cli.main(["section", "--help"])
    shown = " ".join(capsys.readouterr().out.split())
    default = inspect.signature(vi.section).parameters["settle_events"].default
    assert re.search(rf"--settle-events EVENTS [^()]*\([^()]*\)[^()]*\(default: {default}\)", shown)


# ---- files that describe a system ----------------------------------------------------------------

DAMPER = """
[damper]
mass_ratio = 0.1
omega_n = 0.5
zeta = 0.045
restitution = 0.8
half_clearance = 5.0
omega = 1.2
[start]
position = [0.0, 0.0]
velocity = [0.0, 1.0]
"""
MECHANISM = """
[mechanism]
mass = [[1.0]]
damping = [[0.0]]
stiffness = [[0.0]]
constant_force = [-9.8]
elements = [{ kind = "rigid_stop", row = [1.0], lower = 0.0, restitution = [0.5, 0.5] }]
[start]
position = [1.0]
velocity = [0.0]
"""


def test_a_damper_and_its_start_are_read_from_a_file() -> None:
    Path("run.toml").write_text(DAMPER)
    assert cli.main(["simulate", "--config", "run.toml", "--impacts", "5", "--out", "r.nc"]) == 0
    expected = vi.simulate(SET_A, vi.State((0.0, 0.0), (0.0, 1.0)), impacts=5)
    xr.testing.assert_identical(opened("r.nc"), expected.to_dataset())


def test_a_damper_in_si_units_is_read_from_a_file(capsys: pytest.CaptureFixture[str]) -> None:
    Path("si.toml").write_text(
        "[physical]\nM1 = 10.0\nM2 = 0.8\nK = 4e4\nC = 40.0\nF0 = 60.0\nOmega = 66.0\nD = 0.006\n"
        "restitution = 0.6\n"
    )
    cli.main(["orbit", "--config", "si.toml"])
    damper = vi.ImpactDamper.from_physical(
        M1=10.0, M2=0.8, K=4e4, C=40.0, F0=60.0, Omega=66.0, D=0.006, restitution=0.6
    )
    assert capsys.readouterr().out.startswith(str(damper))
    arguments = ["simulate", "--config", "si.toml", "--impacts", "40", "--out", "r.nc"]
    assert cli.main([*arguments, "--position", "0", "0", "--velocity", "0", "1"]) == 0
    expected = vi.simulate(damper, vi.State((0.0, 0.0), (0.0, 1.0)), impacts=40)
    xr.testing.assert_identical(opened("r.nc"), expected.to_dataset())


def test_a_section_at_a_phase_is_that_of_the_library() -> None:
    Path("run.toml").write_text(DAMPER)
    arguments = ["section", "--config", "run.toml", "--points", "20", "--settle-events", "5"]
    assert cli.main([*arguments, "--at", "phase=0.5", "--out", "s.nc", "--out", "s.png"]) == 0
    expected = vi.section(
        SET_A, vi.State((0.0, 0.0), (0.0, 1.0)), at=vi.AtPhase(0.5), points=20, settle_events=5
    )
    xr.testing.assert_identical(opened("s.nc"), expected.to_dataset())


BELT = """
[mechanism]
mass = [[1.0]]
damping = [[0.0]]
stiffness = [[1.0]]

[[mechanism.elements]]
kind = "friction"
row = [1.0]
kinetic = 0.1
static = 0.2
belt_speed = 0.05

[start]
position = [0.0]
velocity = [0.0]
"""


def test_a_section_at_a_change_of_state_is_that_of_the_library(
    capsys: pytest.CaptureFixture[str],
) -> None:
    Path("belt.toml").write_text(BELT)
    arguments = ["section", "--config", "belt.toml", "--points", "4", "--settle-events", "3"]
    assert (
        cli.main([*arguments, "--at", "change=0:backward", "--out", "s.nc", "--out", "s.png"]) == 0
    )
    assert opened("s.nc").position.values.ravel() == pytest.approx(0.2)  # the static level
    assert cli.main([*arguments, "--at", "change=0"]) == 0
    assert "4 points where friction 0 changes" in capsys.readouterr().out
    assert cli.main([*arguments, "--at", "change"]) == 2
    assert "change: must be a stop such as A or B1, phase=THETA" in capsys.readouterr().err


def test_any_mechanism_is_read_from_a_file() -> None:
    Path("ball.toml").write_text(MECHANISM)
    assert cli.main(["simulate", "--config", "ball.toml", "--t-max", "2", "--out", "b.nc"]) == 0
    data = opened("b.nc")
    rest = float(data.time[data.status == vi.Status.CHATTER][0])
    assert rest == pytest.approx(3.0 * np.sqrt(2.0 / 9.8), rel=1e-14)  # closed form


ELEMENTS = """
[mechanism]
mass = [[1.0, 0.0], [0.0, 1.0]]
damping = [[0.1, 0.3], [-0.3, 0.1]]
stiffness = [[2.0, -1.0], [-1.0, 1.0]]
[[mechanism.forces]]
omega = 1.3
sine = [1.0, 0.0]
[[mechanism.elements]]
kind = "soft_stop"
row = [1.0, 0.0]
upper = 0.3
stiffness = 29.0
damping = [0.0, 0.5]
law = "limited"
motion = { omega = 1.3, sine = [0.1] }
[[mechanism.elements]]
kind = "friction"
row = [1.0, -1.0]
kinetic = 0.2
static = 0.3
belt_speed = 0.1
motion = [{ omega = 1.3, sine = [0.1], cosine = [0.05] }, { omega = 2.6, sine = [0.02] }]
[[mechanism.elements]]
kind = "rigid_stop"
row = [0.0, 1.0]
lower = -0.5
restitution = 0.7
[mechanism.elements.motion]
omega = 2.6
sine = [0.1]
[start]
position = [0.0, 0.0]
velocity = [0.0, 0.0]
"""
TWICE = vi.Harmonic(2.6, (0.1,))
WITH_ELEMENTS = vi.Mechanism(
    mass=[[1.0, 0.0], [0.0, 1.0]], damping=[[0.1, 0.3], [-0.3, 0.1]],
    stiffness=[[2.0, -1.0], [-1.0, 1.0]], forces=(vi.Harmonic(1.3, (1.0, 0.0)),),
    elements=(
        vi.SoftStop((1.0, 0.0), upper=0.3, stiffness=29.0, damping=(0.0, 0.5), law="limited",
                    motion=vi.Harmonic(1.3, (0.1,))),
        vi.Friction((1.0, -1.0), 0.2, 0.3, 0.1,
                    (vi.Harmonic(1.3, (0.1,), (0.05,)), vi.Harmonic(2.6, (0.02,)))),
        vi.RigidStop((0.0, 1.0), lower=-0.5, restitution=0.7, motion=TWICE),
    ),
)  # fmt: skip


def test_elements_and_their_motions_are_read_from_a_file(
    capsys: pytest.CaptureFixture[str],
) -> None:
    Path("machine.toml").write_text(ELEMENTS)
    assert read_case("machine.toml").system == WITH_ELEMENTS
    arguments = ["simulate", "--config", "machine.toml", "--t-max", "20", "--out", "r.nc"]
    assert cli.main([*arguments, "--out", "r.png"]) == 0
    expected = vi.simulate(WITH_ELEMENTS, vi.State((0.0, 0.0), (0.0, 0.0)), t_max=20.0)
    xr.testing.assert_identical(opened("r.nc"), expected.to_dataset())
    assert "soft stop 1 " in capsys.readouterr().out
    assert Path("r.png").stat().st_size > 0


def test_a_mechanism_is_put_on_the_moving_base_of_its_file() -> None:
    base = "base_motion = {omega = 1.3, sine = [0.1]}\nbase_direction = [1.0, 0.0]\n"
    Path("machine.toml").write_text(ELEMENTS.replace("[mechanism]\n", f"[mechanism]\n{base}"))
    motion = vi.Harmonic(1.3, (0.1,))
    assert read_case("machine.toml").system == WITH_ELEMENTS.on_moving_base(motion, (1.0, 0.0))
    wrong = base.replace("[0.1]", "[0.1, 0.2]")
    Path("machine.toml").write_text(ELEMENTS.replace("[mechanism]\n", f"[mechanism]\n{wrong}"))
    with pytest.raises(vi.InvalidParameterError, match=r"machine.toml.*base_motion.*2 amplitudes"):
        read_case("machine.toml")


HYBRID = """
[hybrid.modes.on]
matrix = [[-1.0]]
constant = [3.0]
[hybrid.modes.off]
matrix = [[-1.0]]
[hybrid.guards.upper]
row = [1.0]
level = 2.0
[hybrid.guards.lower]
row = [1.0]
level = 1.0
[[hybrid.transitions]]
mode = "on"
guard = "upper"
direction = "rising"
to = "off"
[[hybrid.transitions]]
mode = "off"
guard = "lower"
direction = "falling"
to = "on"
"""
IN_ON = """[start]
mode = "on"
state = [1.0]
"""


def test_a_relay_in_a_file_switches_at_the_times_of_its_closed_form() -> None:
    """Between 1 and 2 it rises by 3 - 2 exp(-t) and falls by 2 exp(-t): log 2 each."""
    Path("relay.toml").write_text(HYBRID + IN_ON)
    arguments = ["simulate", "--config", "relay.toml", "--t-max", "8", "--out", "r.nc"]
    assert cli.main([*arguments, "--out", "r.png"]) == 0
    run = opened("r.nc")
    np.testing.assert_allclose(run.time[:-1], np.log(2.0) * np.arange(1, 12), rtol=1e-14)
    assert run.modes.values[0] == "on"
    assert Path("r.png").stat().st_size > 0


def test_a_relay_in_a_file_has_the_orbit_of_its_closed_form(
    capsys: pytest.CaptureFixture[str],
) -> None:
    """Twice log 2, from either mode; the orbit is what all other commands start from."""
    for mode, state in (("on", 1.0), ("off", 2.0)):
        start = f'[start]\nmode = "{mode}"\nstate = [{state}]\n'
        Path("relay.toml").write_text(HYBRID + start)
        assert cli.main(["orbit", "--config", "relay.toml"]) == 0
        assert f"period {2.0 * math.log(2.0):.6g}" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("text", "arguments", "said"),
    [
        (HYBRID, ["simulate"], "starts in a mode. Give [start]"),
        (HYBRID + IN_ON, ["simulate", "--impacts", "9"], "--impacts: .*no impacts.*--t-max"),
        (HYBRID + IN_ON, ["simulate", "--omega", "1"], "--omega: is a parameter of a machine"),
        (HYBRID + IN_ON, ["simulate", "--position", "7"], "--position: a [hybrid] starts as"),
        (HYBRID + IN_ON, ["simulate", "--window", "0", "1"], "--window: .* drawn as a whole"),
        (HYBRID.replace("rising", "up") + IN_ON, ["simulate"], "direction"),
        (HYBRID.replace("row =", "rows =") + IN_ON, ["simulate"], "[hybrid.guards.upper]: .*rows"),
        (HYBRID.replace('to = "on"', 'to = "of"') + IN_ON, ["simulate"], "of"),
        ("hybrid = 3", ["simulate"], "[hybrid] must be a table"),
    ],
)  # fmt: skip
def test_a_mistake_in_a_hybrid_system_of_a_file_is_named(
    text: str, arguments: list[str], said: str, capsys: pytest.CaptureFixture[str]
) -> None:
    Path("relay.toml").write_text(text)
    command, *more = arguments
    assert cli.main([command, "--config", "relay.toml", *more]) == cli.MISUSE
    assert re.search(said.replace("[", r"\["), capsys.readouterr().err)


def test_a_mechanism_with_elements_is_kept_in_a_text_to_the_last_bit() -> None:
    third = vi.SoftStop((1.0, 0.0), lower=-1 / 3, upper=2 / 3, stiffness=(1 / 7, 1 / 9))
    for m in (WITH_ELEMENTS, dataclasses.replace(WITH_ELEMENTS, elements=(third,))):
        assert system_of(text_of(m)) == m


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ('kind = "friction"', 'kind = "brake"', r"elements\]\] 2: kind = 'brake'; must be one of"),
        ('kind = "friction"\n', "", r"elements\]\] 2: kind: missing; must be one of \"rigid_stop"),
        ("kinetic = 0.2\n", "", r"elements\]\] 2: kinetic: missing"),
        ("kinetic", "mu", r"elements\]\] 2: mu: .*coefficient times normal load"),
        ("stiffness = 29.0", "stiffness = -29.0", r"elements\]\] 1: stiffness = -29\.0: must be"),
        ("motion = { omega", "motion = { omgea", r"elements\]\] 1: motion: omgea: .*mean omega"),
        ("motion = { omega = 1.3, ", "motion = { ", r"1: motion: omega: missing"),
        ("sine = [0.1] }", "sine = [0.1, 0.2] }", r"1: motion: has 2 amplitudes"),
        ("row = [0.0, 1.0]", "row = [1.0]", r"\[mechanism\]: elements\[0\]\.row has shape"),
    ],
)
def test_a_mistake_in_an_element_is_named_with_its_table_and_key(
    old: str, new: str, said: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert old in ELEMENTS
    Path("machine.toml").write_text(ELEMENTS.replace(old, new, 1))
    assert cli.main(["simulate", "--config", "machine.toml"]) == 2
    assert re.search(said, capsys.readouterr().err)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        (
            "[damper]\nmas = 1.0\n",
            r"\[damper\]: mas: is no argument of ImpactDamper, which takes mass_ratio",
        ),
        (
            "[damper]\nmass_ratio = 0.1\n",
            r"\[damper\]: omega_n, zeta, restitution, half_clearance, omega: missing",
        ),
        (DAMPER.replace("0.045", "-0.045"), r"zeta = -0.045: must be >= 0"),
        (DAMPER.replace("0.045", "nan"), r"zeta = nan: must be"),
        (DAMPER + "[colour]\n", r"must hold one of \[damper\], \[physical\], \[mechanism\]"),
        ("", "holds nothing; must hold one of"),
        ("[damper\n", "is not valid TOML"),
        (MECHANISM.replace("lower", "upper_"), r"elements\]\]: upper_: .*mean upper"),
        (MECHANISM.replace("[[1.0]]", "[[-1.0]]"), "mass: must be positive definite"),
        (DAMPER.replace("[0.0, 0.0]", "[9.0, 0.0]"), "behind the lower stop"),
    ],
)
def test_a_bad_file_is_refused_with_the_reason(
    text: str, said: str, capsys: pytest.CaptureFixture[str]
) -> None:
    Path("run.toml").write_text(text)
    message = refused(["simulate", "--config", "run.toml", "--out", "r.nc"], capsys)
    assert re.search(said, message)


# ---- misuse --------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("argv", "said"),
    [
        ([], "required: COMMAND"),
        (["fly"], "fly: is no command"),
        (["orbit", "impact-damper/A", "--om", "1"], "--om: is no option of vibroimpact orbit. Did you mean --omega?"),
        (["orbit", "--colour", "red"], "--colour: is no option of vibroimpact orbit"),
        (["orbit", "impact-damper/D", "--omega", "1"], "D': must be impact-damper alone, or with one of A, B"),
        (["orbit", "impact-damper/3a"], "'impact-damper/3a': must be impact-damper alone, or with one of A, B"),
        (["orbit", "impact-damper/A"], "--omega: missing. Give it"),
        (["orbit"], "--mass-ratio, --omega-n, --zeta, --restitution, --half-clearance, --omega: m"),
        (["orbit", "impact-damper/A", "--omega", "0"], "omega = 0.0: must be > 0"),
        (["orbit", "impact-damper/A", "--omega", "nan"], "omega = nan: must be a finite"),
        (["orbit", *CASE, "--restitution", "1.5"], r"restitution = 1.5: must be in \[0, 1\]"),
        (["orbit", *CASE, "--mass-ratio", "-1"], "mass_ratio = -1.0: must be > 0"),
        (["orbit", *CASE, "--half-clearance", "0"], "half_clearance = 0.0: must be > 0"),
        (["simulate", *CASE, "--impacts", "0"], "impacts = 0: must be an integer >= 1"),
        (["simulate", *CASE, "--impacts", "many"], "invalid int value: 'many'"),
        (["simulate", *CASE, "--t-max", "-1"], "t_max = -1.0: must be > 0"),
        (["simulate", *CASE, "--position", "9", "0", "--velocity", "0", "0"], "behind the low"),
        (["simulate", *CASE, "--position", "0", "--velocity", "0", "0"], "velocity"),
        (["simulate", *CASE, "--velocity", "0", "0"], "a state is --position and --velocity"),
        (["simulate", *CASE, "--on-stop", "A"], "needs --position X1 and --velocity V1 V2"),
        (["section", *CASE, "--at", "C"], "stop = 'C': must be"),
        (["section", *CASE, "--points", "0"], "points = 0: must be an integer >= 1"),
        (["section", *CASE, "--x", "x9", "--out", "p.svg"], "'x9': must be one of x1, x2"),
        (["orbit", "--config", "no.toml"], "no.toml: cannot be read"),
        (["orbit", *CASE, "--config", "no.toml"], "only one may be given"),
        (["orbit", *CASE, "--out", "o.docx"], "o.docx: must end in .nc, .csv, .xlsx, .svg, .png, .pdf"),
        (["orbit", *CASE, "--out", "no/o.nc"], "no must be a folder. Make it first"),
        (["reproduce", "impact-hammer", "--out", "r"], "'impact-hammer': must be all, or of"),
        (["reproduce", "impact-damper"], "out: missing"),
    ],
    ids=" ".join,
)  # fmt: skip
def test_misuse_is_refused_with_value_and_remedy(
    argv: list[str], said: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert re.search(said, refused(argv, capsys))


def test_a_folder_in_the_place_of_a_file_is_refused(capsys: pytest.CaptureFixture[str]) -> None:
    Path("o.nc").mkdir()
    assert "is a folder. Name a file" in refused(["orbit", *CASE, "--out", "o.nc"], capsys)


def test_a_file_in_the_place_of_a_folder_is_refused(capsys: pytest.CaptureFixture[str]) -> None:
    Path("f").write_text("")
    assert "f must be a folder" in refused(["orbit", *CASE, "--out", "f/o.nc"], capsys)


def test_an_unwritable_folder_is_refused_before_anything_is_computed(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(os, "access", lambda *_: False)  # root may write everywhere
    message = refused(["orbit", *CASE, "--out", "o.nc"], capsys)
    assert "cannot be written (no permission)" in message


def test_a_full_disk_leaves_the_old_file_and_no_other(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def full(_: int) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(os, "fsync", full)
    Path("o.nc").write_text("old")
    message = refused(["orbit", *CASE, "--out", "m.svg", "--out", "o.nc"], capsys)
    assert "cannot be written (No space left on device: " in message
    assert Path("o.nc").read_text() == "old"


# ---- numerical failure, interruption -------------------------------------------------------------


@pytest.mark.parametrize("command", ["orbit", "section"])
def test_an_orbit_that_does_not_exist_is_a_failure(
    command: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert cli.main([command, "impact-damper/A", "--omega", "5", "--out", "o.nc"]) == cli.FAILED
    assert "condition (16) of the paper fails" in capsys.readouterr().err
    assert not Path("o.nc").exists()


@pytest.mark.parametrize("command", ["simulate", "section"])
def test_a_motion_that_stops_impacting_is_a_failure(
    command: str, capsys: pytest.CaptureFixture[str]
) -> None:
    argv = [command, "impact-damper/A", "--omega", "5", "--out", "r.nc"]
    start = ["--position", "0", "0", "--velocity", "0", "0"]
    assert cli.main([*argv, *start]) == cli.FAILED
    assert "will come any more" in capsys.readouterr().err
    assert not Path("r.nc").exists()


HELD = """
import os, sys, threading
from vibroimpact.cli import main as cli

def hold(_):
    print("writing", flush=True)
    threading.Event().wait()

os.fsync = hold
sys.exit(cli.main(sys.argv[1:]))
"""


@pytest.mark.slow
def test_ctrl_c_while_writing_leaves_nothing_behind() -> None:
    argv = [sys.executable, "-c", HELD, "orbit", *CASE, "--out", "m.svg", "--out", "o.nc"]
    with subprocess.Popen(
        argv,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        preexec_fn=lambda: signal.signal(
            signal.SIGINT, signal.SIG_DFL
        ),  # background jobs ignore it
    ) as job:
        assert job.stdout is not None
        assert job.stdout.readline() == "writing\n"
        job.send_signal(signal.SIGINT)
        _, message = job.communicate(timeout=60)
    assert job.returncode == cli.INTERRUPTED
    assert "interrupted; nothing was written" in message
    assert not list(Path().iterdir())


def test_the_package_runs_as_a_program() -> None:
    done = subprocess.run(
        [sys.executable, "-m", "vibroimpact", "orbit", "impact-damper/A", "--omega", "-1"],
        capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert done.returncode == cli.MISUSE
    assert done.stderr == "vibroimpact: omega = -1.0: must be > 0. The force must be periodic.\n"


# ---- reproduce -----------------------------------------------------------------------------------


def test_reproduce_hands_the_folder_to_the_case(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    asked: list[Path] = []

    def stand_in_for(out: Path) -> types.SimpleNamespace:
        asked.append(out)
        return types.SimpleNamespace(score={Word.AGREES: 3, Word.DIFFERS: 2})

    name = "vibroimpact_papers.impact_damper.reproduce"
    stand_in = types.ModuleType(name)
    stand_in.reproduce = stand_in_for  # type: ignore[attr-defined]
    monkeypatch.setitem(sys.modules, name, stand_in)
    assert cli.main(["reproduce", "impact-damper", "--out", "folder"]) == 0
    assert asked == [Path("folder")]
    shown = capsys.readouterr().out
    assert "3 agrees, 2 differs" in shown
    assert str(Path("folder/report.html")) in shown


def test_reproduce_lists_the_publications_with_their_titles(
    capsys: pytest.CaptureFixture[str],
) -> None:
    assert cli.main(["reproduce"]) == 0
    shown = capsys.readouterr().out
    assert "impact-damper" in shown
    assert "a paper redone" in shown


def test_several_publications_have_a_folder_each(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    asked: list[Path] = []

    class Paper(NamedTuple):
        name: str

        def load(self) -> Paper:
            return self

        def reproduce(self, out: Path) -> types.SimpleNamespace:
            asked.append(out)
            return types.SimpleNamespace(score={Word.AGREES: 1})

    papers = [Paper("two"), Paper("one")]
    monkeypatch.setattr("vibroimpact.cli.reproduce.entry_points", lambda group: papers)  # noqa: ARG005
    out = tmp_path / "all"
    assert cli.main(["reproduce", "all", "--out", str(out)]) == 0
    assert asked == [out / "one", out / "two"]
    assert "two: 1 agrees" in capsys.readouterr().out


def test_reproduce_refuses_a_file_in_the_place_of_its_folder(
    capsys: pytest.CaptureFixture[str],
) -> None:
    Path("folder").write_text("mine")
    message = refused(["reproduce", "impact-damper", "--out", "folder"], capsys)
    assert "is not a folder" in message


def test_without_the_package_of_publications_reproduce_says_how_to_get_it(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr("vibroimpact.cli.reproduce.entry_points", lambda group: [])  # noqa: ARG005
    assert cli.main(["reproduce", "impact-damper", "--out", "folder"]) == cli.FAILED
    assert "no publications are installed" in (message := capsys.readouterr().err)
    assert "pip install ./papers" in message
