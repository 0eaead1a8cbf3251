"""What is drawn and told of a damper given by physical values is in SI units.

The witness of every factor is a formula in the physical values: t = T sqrt(K / M1), x = K X / F0.
"""

from __future__ import annotations

import json
import re
from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import NamedTuple

import matplotlib.pyplot as plt
import numpy as np
import pytest
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.collections import QuadMesh

import vibroimpact as vi
from vibroimpact import plotting
from vibroimpact.cli import main as cli

M1, K, F0, OMEGA, D = 10.0, 4.0e4, 60.0, 66.0, 6.0e-3
SI = vi.ImpactDamper.from_physical(
    M1=M1, M2=0.8, K=K, C=40.0, F0=F0, Omega=OMEGA, D=D, restitution=0.6
)
PLAIN = replace(SI, scales=vi.Scales())
START = vi.State((0.0, 0.0), (0.0, 1.0))
RATE = np.sqrt(K / M1)
METRES, SPEED, NEWTONS = F0 / K, F0 / K * RATE, F0
WATTS = NEWTONS * SPEED
PARAMETERS = {
    "omega": ("rad/s", RATE), "omega_n": ("rad/s", RATE), "half_clearance": ("m", METRES),
    "force": ("N", NEWTONS), "mass_ratio": ("", 1.0), "restitution": ("", 1.0), "zeta": ("", 1.0),
}  # fmt: skip
ROUNDING = 16.0 * np.finfo(float).eps


class Shown(NamedTuple):
    """How often a number that is drawn is that of the nondimensional damper, and its unit."""

    unit: str
    factor: float


NUMBER = Shown("", 1.0)


@pytest.fixture(autouse=True)
def closed_figures() -> Iterator[None]:
    yield
    plt.close("all")


def assert_drawn(draw: Callable[[vi.ImpactDamper], Axes], across: Shown, up: Shown) -> None:
    """Labels end with the units, and every line and cell is that of the plain damper times (x, y).

    Marks at the foot, whose ordinates are shares of the axes, are left out.
    """
    si, plain = draw(SI), draw(PLAIN)
    for text, other, shown in (
        (si.get_xlabel(), plain.get_xlabel(), across),
        (si.get_ylabel(), plain.get_ylabel(), up),
    ):
        assert text == other + f" [{shown.unit}]" * bool(shown.unit)
    pairs = zip(si.get_lines(), plain.get_lines(), strict=True)
    drawn = [
        (np.asarray(a.get_xydata()), np.asarray(b.get_xydata()))
        for a, b in pairs
        if b.get_transform() == plain.transData
    ]
    cells = ([c for c in ax.collections if isinstance(c, QuadMesh)] for ax in (si, plain))
    drawn += [(a.get_coordinates(), b.get_coordinates()) for a, b in zip(*cells, strict=True)]
    assert sum(len(b) for _, b in drawn) > 0
    for pair in drawn:
        for k, factor in enumerate((across.factor, up.factor)):
            here, there = (np.asarray(part)[..., k] for part in pair)
            size = np.abs(there[np.isfinite(there)]).max(initial=0.0) * factor
            np.testing.assert_allclose(here, there * factor, rtol=ROUNDING, atol=ROUNDING * size)


def swept(
    damper: vi.ImpactDamper, *names: str, observe: str | vi.observe.Extremes = "symbol"
) -> xr.Dataset:
    over = {name: getattr(damper, name) * np.array([0.9, 1.0, 1.05]) for name in names}
    return vi.sweep(
        damper,
        over=over,
        start=START,
        observe=observe,
        settle_periods=5,
        periods=10,
        progress=False,
    )


@cache
def diagram(damper: vi.ImpactDamper, scales: vi.Scales) -> xr.Dataset:
    over = {"omega": np.linspace(0.95, 1.2, 7)}
    return vi.bifurcation_sweep(
        replace(damper, scales=scales), over=over, start=START, points=5, settle_periods=5, periods=10,
        progress=False,
    )  # fmt: skip


@cache
def branch(damper: vi.ImpactDamper, scales: vi.Scales, parameter: str = "omega") -> vi.Branch:
    own = getattr(damper, parameter)
    orbit = vi.symmetric_orbits(replace(damper, scales=scales))[0]
    return vi.continue_orbit(orbit, parameter, (0.95 * own, 1.05 * own))


def test_scales_lead_back_to_the_physical_values() -> None:
    scales = SI.scales
    assert scales.mass == M1
    back = {
        OMEGA: SI.omega * scales.frequency, D: 2.0 * SI.half_clearance * scales.length,
        F0: SI.force * scales.force,
    }  # fmt: skip
    assert list(back.values()) == pytest.approx(list(back), rel=ROUNDING)


@pytest.mark.parametrize("name", PARAMETERS)
def test_a_plane_has_its_parameters_in_si_units(name: str) -> None:
    other = "omega" if name != "omega" else "half_clearance"
    assert_drawn(
        lambda damper: plotting.plot_plane(swept(damper, name, other), variable="n"),
        Shown(*PARAMETERS[name]), Shown(*PARAMETERS[other]),
    )  # fmt: skip


@pytest.mark.parametrize(
    ("observe", "variable", "shown"),
    [
        ("speeds", "speed_largest", Shown("m/s", SPEED)),
        ("power", "power", Shown("W", WATTS)),
        ("lyapunov", "lyapunov", Shown("1/s", RATE)),
        (vi.observe.Extremes(row=(-1.0, 1.0), label="gap"), "gap_largest", Shown("m", METRES)),
        ("impacts", "impacts_a", NUMBER),
        ("symbol", "n", NUMBER),
        ("symbol", "time", Shown("s", 1.0 / RATE)),
        ("settling", "settling", Shown("s", 1.0 / RATE)),
    ],
)
def test_what_is_observed_along_a_parameter_is_in_si_units(
    observe: str | vi.observe.Extremes, variable: str, shown: Shown
) -> None:
    def draw(damper: vi.ImpactDamper) -> Axes:
        found = swept(damper, "omega", observe=observe)
        return plotting.plot_along(found, variable=variable)

    assert_drawn(draw, Shown("rad/s", RATE), shown)


def test_the_colours_of_a_plane_are_in_si_units() -> None:
    def bar(damper: vi.ImpactDamper) -> Axes:
        found = swept(damper, "omega", "force", observe="power")
        return plotting.plot_plane(found, variable="power").figure.axes[1]

    si, plain = bar(SI), bar(PLAIN)
    assert (si.get_ylabel(), plain.get_ylabel()) == ("power [W]", "power")
    np.testing.assert_allclose(si.get_ylim(), np.multiply(plain.get_ylim(), WATTS), rtol=1e-12)


@pytest.mark.parametrize(
    ("variable", "shown"),
    [("v1", Shown("m/s", SPEED)), ("x2", Shown("m", METRES)), ("phase", NUMBER)],
)
def test_a_bifurcation_diagram_is_in_si_units(variable: str, shown: Shown) -> None:
    assert_drawn(
        lambda damper: plotting.plot_bifurcation_diagram(
            diagram(damper, damper.scales), variable=variable
        ),
        Shown("rad/s", RATE), shown,
    )  # fmt: skip


@pytest.mark.parametrize(
    ("variable", "shown"),
    [
        ("v1", Shown("m/s", SPEED)), ("x1", Shown("m", METRES)), ("phase", NUMBER),
        ("speed", Shown("m/s", SPEED)), ("clearance", Shown("m", METRES)),
        ("period", Shown("s", 1.0 / RATE)),
    ],
)  # fmt: skip
def test_a_branch_is_drawn_in_si_units(variable: str, shown: Shown) -> None:
    assert_drawn(
        lambda damper: plotting.plot_branches([branch(damper, damper.scales)], variable=variable),
        Shown("rad/s", RATE), shown,
    )  # fmt: skip


@pytest.mark.parametrize("name", PARAMETERS)
def test_a_branch_has_its_parameter_in_si_units(name: str) -> None:
    def draw(damper: vi.ImpactDamper) -> Axes:
        followed = branch(damper, damper.scales, name)
        return plotting.plot_branches([followed], bounds=followed.bounds)

    assert_drawn(draw, Shown(*PARAMETERS[name]), Shown("m/s", SPEED))
    factor, own = PARAMETERS[name][1], getattr(SI, name)
    low, high = draw(SI).get_xlim()
    assert 0.94 * own * factor < low < 0.951 * own * factor
    assert 1.049 * own * factor < high < 1.06 * own * factor


def test_attractors_behind_a_branch_are_in_its_units() -> None:
    assert_drawn(
        lambda damper: plotting.plot_branches(
            [branch(damper, damper.scales)], attractors=diagram(damper, damper.scales), stop=(0, 1)
        ),
        Shown("rad/s", RATE), Shown("m/s", SPEED),
    )  # fmt: skip


def test_multipliers_are_coloured_by_a_frequency_in_si_units() -> None:
    def bars(damper: vi.ImpactDamper) -> list[Axes]:
        one = branch(damper, damper.scales)
        path = [
            orbit for w in (1.1, 1.2) for orbit in vi.symmetric_orbits(replace(damper, omega=w))
        ]
        drawn = plotting.plot_branch_multipliers(one), plotting.plot_multipliers(path)
        return [ax.figure.axes[1] for ax in drawn]

    for si, plain in zip(bars(SI), bars(PLAIN), strict=True):
        assert si.get_ylabel() == plain.get_ylabel() + " [rad/s]"
        np.testing.assert_allclose(si.get_ylim(), np.multiply(plain.get_ylim(), RATE), rtol=1e-12)


def test_basins_are_in_si_units() -> None:
    def draw(damper: vi.ImpactDamper) -> Axes:
        over = {"x1": [-0.5, 0.0, 0.5], "v2": [-1.0, 1.0]}
        found = vi.basins(damper, over=over, start=START, settle_periods=40, progress=False)
        return plotting.plot_basins(found)

    assert_drawn(draw, Shown("m", METRES), Shown("m/s", SPEED))


def test_the_drawing_of_a_damper_says_its_si_values() -> None:
    said = [text.get_text() for text in plotting.plot_mechanism(SI).texts]
    (line,) = [text for text in said if "delta=" in text]
    assert r"$\delta=0.003$ m" in line
    assert r"$\omega=66$ rad/s" in line
    assert r"$\mu=0.08$, " in line


def said(
    capsys: pytest.CaptureFixture[str], folder: Path, command: str, *, plain: bool = False
) -> str:
    """What a command prints of the damper in a file, or of the same one given by parameters."""
    system = [f"--{name.replace('_', '-')}={getattr(SI, name)!r}" for name in PARAMETERS]
    if not plain:
        file = folder / "si.toml"
        file.write_text(
            f"[physical]\nM1 = {M1}\nM2 = 0.8\nK = {K}\nC = 40.0\nF0 = {F0}\nOmega = {OMEGA}\n"
            f"D = {D}\nrestitution = 0.6\n"
        )
        system = ["--config", str(file)]
    assert cli.main([*command.split(), *system]) == 0
    return capsys.readouterr().out


COMMANDS = {
    "branch --range 0.95 1.2": [
        f"in SI units: omega {0.95 * RATE:.6g} to {1.2 * RATE:.6g} rad/s, GR1 at 64.1",
    ],
    "branch --parameter half_clearance --range 1 4": [
        f"in SI units: half_clearance {METRES:.6g} to {4.0 * METRES:.6g} m, GR1 at ",
    ],
    "curve --range 0.95 1.2 --at GR1 --over half_clearance=1.9:2.1": [
        "  in SI units: omega ",
        " rad/s, half_clearance ",
    ],
    "sweep --over omega=1,1.1 --over force=0.5,2 --settle-periods 1 --periods 1": [
        f"in SI units: omega {RATE:.6g} to {1.1 * RATE:.6g} rad/s, force 30 to 120 N\n",
    ],
    "diagram --over half_clearance=1,2 --way up --settle-periods 1 --periods 1": [
        f"in SI units: half_clearance {METRES:.6g} to {2.0 * METRES:.6g} m\n",
    ],
    "plane --over omega=1,1.1 --over restitution=0.5,0.6 --settle-periods 1 --periods 1": [
        f"in SI units: omega {RATE:.6g} to {1.1 * RATE:.6g} rad/s\n",
    ],
    "basins --over x1=-1,1 --over v1=-1,1 --settle-periods 40": [
        f"in SI units: x1 -{METRES:.6g} to {METRES:.6g} m, v1 -{SPEED:.6g} to {SPEED:.6g} m/s",
        "in SI units: x = ",
    ],
    "orbits --cycles 1 --impacts 2 --starts 5": ["clearance [m]"],
    "response --over omega=1:1.1 --measure power --number 2 --starts 0 --most 0 --settle-periods 1": [
        f"dissipated power over omega {RATE:.6g} to {1.1 * RATE:.6g} rad/s",
        "W, at ",
    ],
    "simulate --impacts 5": [f"forcing {F0:g} N at {OMEGA:g} rad/s"],
}


@pytest.mark.parametrize("command", COMMANDS)
def test_every_command_prints_si_units_of_a_physical_damper_alone(
    command: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    printed = said(capsys, tmp_path, command)
    for words in COMMANDS[command]:
        assert words in printed
    assert not re.search(r"SI units|\[m\]", said(capsys, tmp_path, command, plain=True))


def test_the_printed_attractor_and_special_point_are_the_scaled_ones_in_si_units(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    printed = said(capsys, tmp_path, "basins --over x1=-1,1 --over v1=-1,1 --settle-periods 40")
    scaled = re.findall(r"position=\((\S+), \S+ velocity=\((\S+),", printed)[0]
    here = re.findall(r"SI units: x = (\S+), \S+ m, v = (\S+), \S+ m/s", printed)[0]
    expected = np.array(scaled, dtype=float) * (METRES, SPEED)
    np.testing.assert_allclose(np.array(here, dtype=float), expected, rtol=1e-5)
    printed = said(capsys, tmp_path, "branch --range 0.95 1.2")
    (omega,), (place,) = (
        re.findall(r"GR1 at omega = (\S+):", printed),
        re.findall(r"GR1 at (\d\S+)", printed),
    )
    assert float(place) == pytest.approx(float(omega) * RATE, rel=1e-5)


def test_a_normal_form_has_its_place_and_widths_in_si_units(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    command = "normal-form --range 0.9 1.3 --at NS1 --half-clearance 6.5 --restitution 0.8"
    facts = json.loads(said(capsys, tmp_path, f"{command} --json"))
    assert facts["si"]["value"] == pytest.approx(facts["value"] * RATE, rel=ROUNDING)
    assert facts["coordinates"] == ["x1", "v1", "v2", "phase"]
    assert facts["si"]["half_width_units"] == ["m", "m/s", "m/s", "rad"]
    factors = np.array([METRES, SPEED, SPEED, 1.0]) / np.sqrt(RATE)  # of dp in rad/s
    expected = np.array(facts["half_width_law"]) * factors
    np.testing.assert_allclose(facts["si"]["half_width_law"], expected, rtol=ROUNDING)
    last = said(capsys, tmp_path, command).splitlines()[-1]
    assert last.startswith(f"in SI units: omega = {facts['value'] * RATE:.9g} rad/s; half width")


def test_help_says_that_numbers_are_scaled(capsys: pytest.CaptureFixture[str]) -> None:
    for command, option in (("branch", "--range"), ("plane", "--over"), ("basins", "--over")):
        assert cli.main([command, "--help"]) == 0
        words = " ".join(capsys.readouterr().out.split())
        assert "All numbers given here are scaled, of a [physical] file too" in words
        assert re.search(rf"{option} [^-]*scaled, not in SI units", words.partition("options:")[2])
