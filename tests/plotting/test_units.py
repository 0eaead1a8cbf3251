"""A damper in SI units moves as the nondimensional one; what is drawn and told of it has its units.

The witness of every factor is a formula in the physical values: t = T sqrt(K / M1), x = K X / F0.
"""

from __future__ import annotations

import json
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
from matplotlib.axis import Axis
from matplotlib.collections import QuadMesh

import vibroimpact as vi
from vibroimpact import plotting
from vibroimpact.cli import main as cli
from vibroimpact.plotting import style

M1, K, F0, OMEGA, D = 10.0, 4.0e4, 60.0, 80.0, 6.0e-3
SI = vi.ImpactDamper.from_physical(
    M1=M1, M2=0.8, K=K, C=40.0, F0=F0, Omega=OMEGA, D=D, restitution=0.6
)
RATE = np.sqrt(K / M1)
METRES, SPEED, NEWTONS = F0 / K, F0 / K * RATE, F0
WATTS = NEWTONS * SPEED
PLAIN = vi.ImpactDamper(
    mass_ratio=0.08, omega_n=1.0, zeta=40.0 / (2.0 * np.sqrt(K * M1)), restitution=0.6,
    half_clearance=D / 2.0 / METRES, omega=OMEGA / RATE,
)  # fmt: skip
PARAMETERS = {
    "omega": ("rad/s", RATE), "omega_n": ("rad/s", RATE), "half_clearance": ("m", METRES),
    "force": ("N", NEWTONS), "mass": ("kg", M1), "mass_ratio": ("", 1.0), "restitution": ("", 1.0),
    "zeta": ("", 1.0),
}  # fmt: skip
CLOSE = 1e-9  # rounding, grown in some thirty impacts


class Shown(NamedTuple):
    """How often a number that is drawn is that of the nondimensional damper, and its unit."""

    unit: str
    factor: float


NUMBER = Shown("", 1.0)


@pytest.fixture(autouse=True)
def closed_figures() -> Iterator[None]:
    yield
    plt.close("all")


def start_of(damper: vi.ImpactDamper) -> vi.State:
    return vi.State((0.0, 0.0), (0.0, SPEED if damper.si else 1.0))


PARTS = {"µ": 1e-6, "m": 1e-3, "": 1.0, "k": 1e3}


def assert_labels(si: Axes, plain: Axes, across: Shown, up: Shown) -> None:
    for here, there, shown in ((si.xaxis, plain.xaxis, across), (si.yaxis, plain.yaxis, up)):
        assert_axis(here, there.get_label_text(), shown.unit)


def assert_axis(axis: Axis, label: str, unit: str) -> None:
    """The label names a part or multiple of the unit, and the ticks are numbers of these where the data are in SI."""
    if not unit:
        assert axis.get_label_text() == label
        return
    prefix = axis.get_label_text().removeprefix(f"{label} [").removesuffix(f"{unit}]")
    assert axis.get_label_text() == f"{label} [{prefix}{unit}]"
    texts = [one.get_text().replace("\N{MINUS SIGN}", "-") for one in axis.get_ticklabels()]
    said = np.array([float(text) for text in texts])
    offset = axis.get_major_formatter().get_offset()
    said += float(offset.replace("\N{MINUS SIGN}", "-") or 0.0)
    assert len(said) > 2
    np.testing.assert_allclose(said * PARTS[prefix], axis.get_ticklocs(), rtol=1e-12, atol=1e-12)
    low, high = np.abs(axis.get_view_interval())
    assert prefix == "" or 1.0 <= max(low, high) / PARTS[prefix] < 1000.0


def assert_drawn(
    draw: Callable[[vi.ImpactDamper], Axes], across: Shown, up: Shown, close: float = CLOSE
) -> None:
    """Labels end with the units, and every line and cell is that of the plain damper times (x, y).

    Marks at the foot, whose ordinates are shares of the axes, are left out.
    """
    si, plain = draw(SI), draw(PLAIN)
    assert_labels(si, plain, across, up)
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
            np.testing.assert_allclose(here, there * factor, rtol=close, atol=close * size)


def swept(
    damper: vi.ImpactDamper, *names: str, observe: str | vi.observe.Extremes = "symbol"
) -> xr.Dataset:
    over = {name: getattr(damper, name) * np.array([0.9, 1.0, 1.05]) for name in names}
    return vi.sweep(
        damper, over=over, start=start_of(damper), observe=observe, settle_periods=5, periods=10,
        progress=False,
    )  # fmt: skip


def diagram(damper: vi.ImpactDamper) -> xr.Dataset:
    return vi.bifurcation_sweep(
        damper, over={"omega": damper.omega_n * np.linspace(1.2, 1.4, 7)}, start=start_of(damper),
        points=5, settle_periods=5, periods=10, progress=False,
    )  # fmt: skip


@cache
def branch(damper: vi.ImpactDamper, parameter: str = "omega") -> vi.Branch:
    own = getattr(damper, parameter)
    orbit = vi.symmetric_orbits(damper)[0]
    return vi.continue_orbit(orbit, parameter, (0.95 * own, 1.05 * own))


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

    close = 1e-5 if observe == "lyapunov" else CLOSE  # the first tangent is another in other units
    assert_drawn(draw, Shown("rad/s", RATE), shown, close)


def test_the_colours_of_a_plane_are_in_si_units() -> None:
    def bar(damper: vi.ImpactDamper) -> Axes:
        found = swept(damper, "omega", "force", observe="power")
        return plotting.plot_plane(found, variable="power").figure.axes[1]

    si, plain = bar(SI), bar(PLAIN)
    assert_axis(si.yaxis, plain.get_ylabel(), "W")
    np.testing.assert_allclose(si.get_ylim(), np.multiply(plain.get_ylim(), WATTS), rtol=CLOSE)


@pytest.mark.parametrize(
    ("variable", "shown"),
    [("v1", Shown("m/s", SPEED)), ("x2", Shown("m", METRES)), ("phase", NUMBER)],
)
def test_a_bifurcation_diagram_is_in_si_units(variable: str, shown: Shown) -> None:
    assert_drawn(
        lambda damper: plotting.plot_bifurcation_diagram(diagram(damper), variable=variable),
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
@pytest.mark.one_in(3)
def test_a_branch_is_drawn_in_si_units(variable: str, shown: Shown) -> None:
    si, plain = (plotting.plot_branches([branch(one)], variable=variable) for one in (SI, PLAIN))
    assert_labels(si, plain, Shown("rad/s", RATE), shown)
    here, there = (ax.get_lines()[0].get_xydata() for ax in (si, plain))
    for row in (0, -1):  # points between these are where the steps lead
        np.testing.assert_allclose(
            here[row], there[row] * (RATE, shown.factor), rtol=CLOSE, atol=CLOSE * shown.factor
        )


@pytest.mark.parametrize("name", PARAMETERS)
@pytest.mark.slow
def test_a_branch_has_its_parameter_in_si_units(name: str) -> None:
    followed = branch(SI, name)
    ax = plotting.plot_branches([followed], bounds=followed.bounds)
    plain = plotting.plot_branches([branch(PLAIN, name)])
    assert_axis(ax.xaxis, plain.get_xlabel(), PARAMETERS[name][0])
    own = getattr(SI, name)
    low, high = ax.get_xlim()
    assert 0.94 * own < low < 0.951 * own
    assert 1.049 * own < high < 1.06 * own


def test_multipliers_are_coloured_by_a_frequency_in_si_units() -> None:
    def bars(damper: vi.ImpactDamper) -> list[Axes]:
        one = branch(damper)
        path = [
            orbit
            for part in (1.1, 1.2)
            for orbit in vi.symmetric_orbits(replace(damper, omega=part * damper.omega_n))
        ]
        drawn = plotting.plot_branch_multipliers(one), plotting.plot_multipliers(path)
        return [ax.figure.axes[1] for ax in drawn]

    for si, plain in zip(bars(SI), bars(PLAIN), strict=True):
        assert si.get_ylabel() == plain.get_ylabel() + " [rad/s]"
        np.testing.assert_allclose(si.get_ylim(), np.multiply(plain.get_ylim(), RATE), rtol=1e-12)


def test_basins_are_in_si_units() -> None:
    def draw(damper: vi.ImpactDamper) -> Axes:
        length, speed = (METRES, SPEED) if damper.si else (1.0, 1.0)
        over = {"x1": [-0.5 * length, 0.0, 0.5 * length], "v2": [-speed, speed]}
        found = vi.basins(
            damper, over=over, start=start_of(damper), settle_periods=40, progress=False
        )
        return plotting.plot_basins(found)

    assert_drawn(draw, Shown("m", METRES), Shown("m/s", SPEED))


def test_the_drawing_of_a_damper_says_its_si_values() -> None:
    said = [text.get_text() for text in plotting.plot_mechanism(SI).texts]
    (line,) = [text for text in said if "delta=" in text]
    assert r"$\delta=3\,\mathrm{mm}$" in line
    assert r"$\omega=80\,\mathrm{rad/s}$" in line
    assert r"$\mu=0.08$, " in line


def said(capsys: pytest.CaptureFixture[str], damper: vi.ImpactDamper, command: str) -> str:
    """What a command prints of a damper given by parameters in a file."""
    rows = [f"{name} = {getattr(damper, name)!r}" for name in PARAMETERS]
    Path("damper.toml").write_text("\n".join(["[damper]", *rows, f"si = {damper.si}".lower()]))
    assert cli.main([*command.split(), "--config", "damper.toml"]) == 0
    return capsys.readouterr().out


@pytest.mark.usefixtures("own_folder")
@pytest.mark.parametrize(
    ("command", "words"),
    [
        ("orbits --most-cycles 1 --most-impacts 2 --starts 5", " µm"),
        ("response --band omega=60:70 --measure power --points 2 --starts 0 --most-branches 0 --settle-periods 1",
         "dissipated power over omega 60 to 70 rad/s"),
    ],
)  # fmt: skip
def test_a_command_names_units_of_a_machine_in_si_alone(
    command: str, words: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert words in said(capsys, SI, command)
    plain = said(capsys, replace(SI, si=False), command)
    assert not [unit for unit in (" µm", "rad/s", " W at") if unit in plain]


@pytest.mark.usefixtures("own_folder")
@pytest.mark.slow
def test_a_normal_form_has_its_place_and_widths_in_the_units_of_the_machine(
    capsys: pytest.CaptureFixture[str],
) -> None:
    facts = []
    for damper, unit, length in ((SI, RATE, METRES), (PLAIN, 1.0, 1.0)):
        wide = replace(damper, half_clearance=6.5 * length, restitution=0.8)
        command = f"normal-form --bounds omega={0.9 * unit}:{1.3 * unit} --at NS1 --json"
        facts.append(json.loads(said(capsys, wide, command)))
    here, there = facts
    assert here["value"] == pytest.approx(there["value"] * RATE, rel=CLOSE)
    assert here["coordinates"] == ["x1", "v1", "v2", "phase"]
    factors = np.array([METRES, SPEED, SPEED, 1.0]) / np.sqrt(RATE)
    expected = np.array(there["half_width_law"]) * factors
    np.testing.assert_allclose(here["half_width_law"], expected, rtol=1e-6)


def test_axes_in_several_scales_are_read_in_parts_of_their_unit() -> None:
    _, ax = plt.subplots()
    for scale, unit, prefix in (("linear", "m", "m"), ("log", "N", "k")):
        ax.clear()
        with style.drawing(ax):
            size = 0.003 if prefix == "m" else 3000.0
            ax.plot([0.01 * size, size], [0.0, 1.0])
            ax.set(xscale=scale, xlabel=f"place [{unit}]", ylabel="share")
        assert ax.get_xlabel() == f"place [{prefix}{unit}]"
        assert ax.get_ylabel() == "share"
        decade = ax.xaxis.get_major_formatter()(PARTS[prefix])
        assert decade in ("1.0", r"$\mathdefault{10^{0}}$")
    assert ax.format_xdata(3000.0) == "3"


@pytest.mark.parametrize("scale", ["linear", "log"])
def test_axes_that_are_drawn_on_again_keep_the_unit_of_their_data(scale: str) -> None:
    with style.drawing(None) as ax:
        ax.plot([0.0, 1.0], [0.0005, 0.004])
        ax.set(xlabel="share", yscale=scale, ylabel="place [m]")
    for size, prefix in ((0.003, "m"), (3.0, ""), (0.005, "")):
        with style.drawing(ax):
            ax.plot([0.0, 1.0], [0.0005, size])
        assert ax.get_ylabel() == f"place [{prefix}m]"
        assert ax.format_ydata(0.003) == f"{0.003 / PARTS[prefix]:g}"
