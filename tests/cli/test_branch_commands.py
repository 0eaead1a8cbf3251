"""The commands branch and normal-form: what they say and write is the library's."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
import pytest
from support.commands import WALL, assert_nothing_written, said

import vibroimpact as vi
from vibroimpact.cli import main as cli
from vibroimpact.normal_forms import NeimarkSacker

pytestmark = pytest.mark.usefixtures("no_windows", "own_folder")

CASE = "impact-damper/A"
SET_A = vi.ImpactDamper(
    mass_ratio=0.1, omega_n=0.5, zeta=0.045, restitution=0.8, half_clearance=5.0, omega=1.05
)


@pytest.fixture(scope="module")
def expected() -> vi.Branch:
    """Of the stable symmetric orbit at the middle of the range."""
    return vi.continue_orbit(vi.symmetric_orbits(SET_A)[0], "omega", (0.9, 1.2))


def numbers(argv: list[str], capsys: pytest.CaptureFixture[str]) -> dict[str, object]:
    found: dict[str, object] = json.loads(said(["normal-form", *argv, "--json"], capsys))
    return found


# ---- branch --------------------------------------------------------------------------------------


@pytest.mark.slow
def test_branch_writes_and_says_the_branch_of_the_library(
    expected: vi.Branch, capsys: pytest.CaptureFixture[str]
) -> None:
    out = said(
        ["branch", CASE, "--bounds", "omega=0.9:1.2", "--out", "b.nc", "--out", "b.svg"], capsys
    )
    assert repr(expected) in out
    assert out.endswith("wrote b.nc, b.svg\n")
    np.testing.assert_array_equal(vi.load("b.nc").curve.z, expected.curve.z)
    assert Path("b.svg").read_text(encoding="utf-8").startswith("<?xml")


@pytest.mark.slow
def test_omega_and_the_sign_of_the_orbit_may_be_given(capsys: pytest.CaptureFixture[str]) -> None:
    argv = ["branch", CASE, "--omega", "1.1", "--orbit", "minus", "--bounds", "omega=1.09:1.11"]
    out = said([*argv, "--out", "b.nc"], capsys)
    _, minus = vi.symmetric_orbits(replace(SET_A, omega=1.1))
    branch = vi.continue_orbit(minus, "omega", (1.09, 1.11))
    assert repr(branch) in out
    np.testing.assert_array_equal(vi.load("b.nc").curve.z, branch.curve.z)


def test_orbits_that_are_no_motions_are_followed_on_request(
    capsys: pytest.CaptureFixture[str],
) -> None:
    words = ["branch", CASE, "--bounds", "omega=0.5065:0.508", "--out", "b.nc"]
    said(words, capsys)
    exists = vi.load("b.nc")
    assert exists.admissible.all()
    said([*words, "--inadmissible"], capsys)
    whole = vi.load("b.nc")
    np.testing.assert_array_equal(whole.admissible, whole.values >= exists.values.min())
    assert whole.values.min() == 0.5065


def test_another_parameter_of_a_panel_varies_around_its_value(
    capsys: pytest.CaptureFixture[str],
) -> None:
    out = said(
        ["branch", "impact-damper/2c", "--bounds", "restitution=0.78:0.82"],
        capsys,
    )
    assert "restitution 0.78 to 0.82" in out


@pytest.mark.slow
def test_switch_goes_from_branch_to_branch(capsys: pytest.CaptureFixture[str]) -> None:
    argv = ["branch", CASE, "--bounds", "omega=0.666:0.708", "--switch", "BP1", "--switch", "PD1"]
    out = said([*argv, "--variable", "x1", "--out", "b.nc", "--out", "b.png"], capsys)
    assert out.count("Branch of") == 3
    assert vi.load("b.nc").symbol == "2-2-2"
    assert out.count("1-1-1 orbits") == 2
    assert "PD1 at omega = 0.666281189:" in out


@pytest.mark.slow
def test_a_rule_ends_every_branch(capsys: pytest.CaptureFixture[str]) -> None:
    argv = ["branch", CASE, "--bounds", "omega=0.70:0.75", "--switch", "BP1"]
    argv += ["--stop-when", "unstable=0", "--stop-when", "inadmissible=0.5", "--out", "b.nc"]
    out = said(argv, capsys)
    rules = [vi.stop.unstable(multipliers=0), vi.stop.inadmissible(beyond=0.5)]
    damper = replace(SET_A, omega=0.725)
    orbits = vi.symmetric_orbits(damper)
    start = next((orbit for orbit in orbits if orbit.stable), orbits[0])
    first = vi.continue_orbit(start, "omega", (0.70, 0.75), stop_when=rules)
    second = vi.switch_branch(first["BP1"], stop_when=rules)
    assert out.count("the rule stop_when ended it: 1 multipliers outside the unit circle") == sum(
        end.reason == "the rule stop_when ended it"
        for branch in (first, second)
        for end in branch.curve.ends
    )
    np.testing.assert_array_equal(vi.load("b.nc").curve.z, second.curve.z)


@pytest.mark.parametrize("rule", ["chaotic=1", "inadmissible", "inadmissible=-1", "unstable=0.5"])
def test_an_unknown_rule_is_refused_with_those_there_are(
    rule: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert cli.main(["branch", CASE, "--bounds", "omega=0.9:1.2", "--stop-when", rule]) == 2
    assert f"{rule!r}: must be inadmissible=SHARE" in capsys.readouterr().err


def test_the_multipliers_are_drawn_on_request(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    drawn: list[vi.Branch] = []

    def stand_in(branch: vi.Branch) -> plt.Axes:
        drawn.append(branch)
        return plt.subplots()[1]

    monkeypatch.setattr("vibroimpact.plotting.plot_branch_multipliers", stand_in)
    argv = ["branch", CASE, "--bounds", "omega=1.04:1.06", "--multipliers", "--out", "m.png"]
    said(argv, capsys)
    assert [branch.symbol for branch in drawn] == ["1-1-1"]


@pytest.mark.slow
def test_a_mechanism_starts_from_what_its_motion_settles_to(
    capsys: pytest.CaptureFixture[str],
) -> None:
    Path("wall.toml").write_text(WALL, encoding="utf-8")
    argv = ["branch", "--config", "wall.toml", "--bounds", "elements[0].restitution=0.68:0.72"]
    out = said([*argv, "--out", "b.nc"], capsys)
    loaded = vi.load("b.nc")
    orbit = vi.find_orbit(loaded.family.system, vi.State((0.0,), (0.0,)))
    branch = vi.continue_orbit(orbit, "elements[0].restitution", (0.68, 0.72))
    assert repr(branch) in out
    np.testing.assert_array_equal(loaded.curve.z, branch.curve.z)


def test_a_damper_with_a_state_starts_from_what_it_settles_to(
    capsys: pytest.CaptureFixture[str],
) -> None:
    argv = ["branch", CASE, "--bounds", "omega=1.15:1.25", "--position", "0", "0"]
    out = said([*argv, "--velocity", "0", "1", "--omega", "1.2"], capsys)
    assert "Branch of 1-1-1 orbits, omega 1.15 to 1.25" in out
    assert "100% of it stable" in out


# ---- normal-form ---------------------------------------------------------------------------------


def test_normal_form_prints_the_numbers_of_the_library(
    expected: vi.Branch, capsys: pytest.CaptureFixture[str]
) -> None:
    found = numbers([CASE, "--bounds", "omega=0.9:1.2", "--at", "NS2"], capsys)
    point = expected["NS2"]
    form = point.normal_form
    assert isinstance(form, NeimarkSacker)
    assert found["value"] == point.parameter
    assert found["d"] == [form.d.real, form.d.imag]
    assert found["side"] == form.side
    assert found["supercritical"] is form.supercritical
    assert found["attracting"] is form.attracting
    assert found["warnings"] == list(form.warnings)
    assert found["coordinates"] == ["x1", "v1", "v2", "phase"]
    # laws hold at any distance: r and half widths by sqrt|dp|, the angle by dp
    dp = -1e-4
    assert form.radius(dp) == pytest.approx(found["radius_law"] * 1e-2, rel=1e-12)
    np.testing.assert_allclose(form.amplitude(dp), np.array(found["half_width_law"]) * 1e-2)
    turned = form.angle + found["angle_slope"] * dp  # type: ignore[operator]
    assert form.turn(dp) == pytest.approx(turned, rel=1e-12)
    # the second route shares the multilinear forms only: rounding times their conditions
    assert found["f1"] == pytest.approx(-form.d.real, rel=1e-9)


def test_near_a_strong_resonance_it_warns(capsys: pytest.CaptureFixture[str]) -> None:
    out = said(["normal-form", CASE, "--bounds", "omega=0.9:0.95", "--at", "NS1"], capsys)
    assert "warning: |nu^4 - 1| = 0.0234, near the strong resonance 1:4" in out
    assert "1/4 0.02337" in out
    assert "supercritical: a circle, attracting, for omega > 0.931845377" in out


@pytest.mark.parametrize(
    ("argv", "words"),
    [
        (["--at", "BP1"], "supercritical: two orbits, mirror images of each other, attracting"),
        (["--switch", "BP1", "--at", "PD1"], "supercritical: an orbit of twice the period"),
        (["--switch", "BP1", "--at", "BP1"], "pitchfork"),
    ],
)
def test_every_kind_of_point_is_described(
    argv: list[str], words: str, capsys: pytest.CaptureFixture[str]
) -> None:
    base = [CASE, "--bounds", "omega=0.666:0.708", *argv]
    out = said(["normal-form", *base], capsys)
    assert words in out
    assert "for omega < 0." in out
    assert "half width / sqrt|dp|: x1 " in out


@pytest.mark.slow
def test_a_fold_is_described(capsys: pytest.CaptureFixture[str]) -> None:
    argv = [CASE, "--bounds", "omega=0.6:0.71", "--switch", "BP1", "--switch", "GR1", "--at", "SN1"]
    out = said(["normal-form", *argv], capsys)
    assert "two orbits for omega < 0.66127683" in out


# ---- misuse and failure --------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("argv", "message"),
    [
        (["branch", CASE, "--bounds", "omega=1.2:0.9"], "LOW < HIGH"),
        (["branch", CASE, "--omega", "0.5", "--bounds", "omega=0.9:1.2"], "must hold omega = 0.5"),
        (
            ["branch", "impact-damper/2c", "--bounds", "nothing=0.9:1.2"],
            "bounds = 'nothing': must be one of mass_ratio",
        ),
        (
            ["branch", CASE, "--bounds", "omega=1.04:1.06", "--switch", "BP1"],
            "label = 'BP1': there is no special point here",
        ),
        (["branch", CASE, "--bounds", "omega=1.0:1.1", "--out", "b.txt"], "must end in"),
        (["normal-form", CASE, "--bounds", "omega=1.0:1.05", "--at", "NS9"], "must be one of NS1"),
    ],
)
def test_misuse_is_refused_with_what_is_allowed(
    argv: list[str], message: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert_nothing_written(argv, cli.MISUSE, message, capsys)


@pytest.mark.parametrize(
    ("argv", "message"),
    [
        (
            ["branch", CASE, "--half-clearance", "500", "--bounds", "omega=1.0:1.2"],
            "no symmetric 1-1-1 orbit exists at omega = 1.1",
        ),
        (["branch", CASE, "--bounds", "omega=1.0:1.05", "--switch", "NS1"], "no other branch"),
    ],
)
def test_what_does_not_exist_is_a_failure_with_the_reason(
    argv: list[str], message: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert cli.main([*argv]) == cli.FAILED
    assert message in capsys.readouterr().err
    assert not list(Path().iterdir())


def test_a_motion_that_leads_to_no_orbit_is_a_failure(
    capsys: pytest.CaptureFixture[str],
) -> None:
    """Without a spring, its weight lets the mass fall from the wall for ever."""
    falls = WALL.replace("damping = [[0.1]]", "damping = [[0.0]]\nconstant_force = [-1.0]")
    falls = falls.replace("stiffness = [[1.0]]", "stiffness = [[0.0]]")
    Path("falls.toml").write_text(falls, encoding="utf-8")
    assert cli.main(["branch", "--config", "falls.toml", "--bounds", "omega=0.7:0.9"]) == cli.FAILED
    assert "no periodic orbit was found" in capsys.readouterr().err


# ---- a touch -------------------------------------------------------------------------------------


@pytest.mark.slow
def test_normal_form_at_a_touch_says_what_follows_and_its_windows(
    capsys: pytest.CaptureFixture[str],
) -> None:
    machine = ["impact-oscillator", "--zeta", "1.2", "--omega", "4.86", "--restitution", "0.8"]
    start = ["--clearance", "0.04", "--position", "-0.01", "--velocity", "0"]
    argv = [*machine, *start, "--bounds", "clearance=0.0385:0.0405", "--at", "GR1"]
    facts = numbers(argv, capsys)
    assert facts["scenario"] == "ADDING"
    windows = {one["turns"]: one for one in facts["windows"]}  # type: ignore[attr-defined]
    assert (windows[5]["slow_end"], windows[5]["fast_end"]) == ("PD", "touch")
    out = said(["normal-form", *argv], capsys)
    assert "period adding with chaos between" in out
    assert f"one impact in 5: clearance - {facts['value']:.9g} from" in out
