"""Figures: what is drawn is the data, and nothing outside the picture changes."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

import matplotlib as mpl
import matplotlib.pyplot as plt
import numpy as np
import pytest
import xarray as xr
from matplotlib.axes import Axes
from numpy.typing import NDArray

import vibroimpact as vi
from vibroimpact import plotting
from vibroimpact.plotting import style

pytestmark = pytest.mark.usefixtures("no_windows")

SET_A = vi.ImpactDamper(
    mass_ratio=0.1, omega_n=0.5, zeta=0.045, restitution=0.8, half_clearance=5.0, omega=1.2
)
BALL = vi.Mechanism(
    mass=((1.0,),),
    damping=((0.0,),),
    stiffness=((0.0,),),
    constant_force=(-9.8,),
    elements=(vi.RigidStop((1.0,), lower=0.0, restitution=0.5),),
)
OMEGAS = np.array([1.1, 1.15, 1.2])


def some_run() -> vi.Run:
    return vi.simulate(SET_A, vi.symmetric_orbits(SET_A)[0].state.perturbed(0.05), impacts=40)


def some_section(points: int = 50) -> vi.Section:
    start = vi.symmetric_orbits(SET_A)[0].state.perturbed(0.05)
    return vi.section(SET_A, start, points=points, settle_events=0)


def some_path() -> list[vi.Orbit]:
    return [vi.symmetric_orbits(replace(SET_A, omega=float(w)))[0] for w in OMEGAS]


def some_diagram() -> xr.Dataset:
    values = np.arange(12.0).reshape(2, 3, 2)
    values[0, 0, 0] = np.nan
    return xr.Dataset(
        {"v1": (("direction", "omega", "point"), values)},
        coords={"omega": OMEGAS, "direction": ["down", "up"]},
    )


PLOTS = {
    "mechanism": lambda ax: plotting.plot_mechanism(SET_A, ax=ax),
    "history": lambda ax: plotting.plot_history(some_run(), ax=ax),
    "history of any system": lambda ax: plotting.plot_history(
        vi.simulate(BALL, vi.State((1.0,), (0.0,)), t_max=1.0), ax=ax
    ),
    "phase portrait": lambda ax: plotting.plot_phase_portrait(some_run(), ax=ax),
    "section": lambda ax: plotting.plot_section(some_section(), ax=ax, label="section"),
    "multipliers": lambda ax: plotting.plot_multipliers(some_path(), ax=ax),
    "diagram": lambda ax: plotting.plot_bifurcation_diagram(some_diagram(), ax=ax),
}


def drawn(ax: Axes, label: str) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """The data of the line with this label."""
    (line,) = (line for line in ax.get_lines() if line.get_label() == label)
    return np.asarray(line.get_xdata(), dtype=float), np.asarray(line.get_ydata(), dtype=float)


@pytest.mark.parametrize("name", PLOTS)
def test_a_plot_leaves_the_users_settings_alone(name: str) -> None:
    before = dict(mpl.rcParams)
    PLOTS[name](None)
    assert dict(mpl.rcParams) == before


@pytest.mark.parametrize("name", PLOTS)
def test_a_plot_draws_on_the_axes_it_is_given(name: str) -> None:
    figure, ax = plt.subplots()
    assert PLOTS[name](ax) is ax
    assert plt.get_fignums() == [figure.number]


@pytest.mark.parametrize("name", sorted(set(PLOTS) - {"mechanism"}))
def test_both_axes_have_a_label_with_a_symbol(name: str) -> None:
    ax = PLOTS[name](None)
    assert "$" in ax.get_xlabel()
    assert "$" in ax.get_ylabel()


@pytest.mark.parametrize("suffix", ["svg", "png", "pdf"])
def test_the_same_data_give_the_same_file(tmp_path: Path, suffix: str) -> None:
    files = [tmp_path / f"{n}.{suffix}" for n in (1, 2)]
    for path in files:
        plotting.save(PLOTS["section"](None), path)
    assert files[0].read_bytes() == files[1].read_bytes()


def test_the_drawing_names_every_parameter() -> None:
    texts = " ".join(text.get_text() for text in plotting.plot_mechanism(SET_A).texts)
    for shown in (r"\mu=0.1", r"\omega_n=0.5", r"\zeta=0.045", "R=0.8", r"\delta=5", r"\omega=1.2"):
        assert shown in texts


def test_the_stops_are_drawn_where_they_are_and_the_free_mass_between_them() -> None:
    ax = plotting.plot_history(some_run())
    t, upper = drawn(ax, r"stop A: $x_1+\delta$")
    lower = drawn(ax, r"stop B: $x_1-\delta$")[1]
    free = drawn(ax, "$x_2$")[1]
    assert t[0] == 0.0
    rounding = 8.0 * np.finfo(float).eps * np.abs(upper).max()  # a few operations each
    np.testing.assert_allclose(upper - lower, 2.0 * SET_A.half_clearance, rtol=0.0, atol=rounding)
    assert np.all(free <= upper + rounding)
    assert np.all(free >= lower - rounding)


def test_every_impact_in_the_window_is_marked() -> None:
    run = some_run()
    ax = plotting.plot_history(run, run.time[4], run.time[14])
    marked = [line for line in ax.get_lines() if line.get_marker() in ("^", "v")]
    times = np.sort(np.concatenate([np.asarray(line.get_xdata()) for line in marked]))
    np.testing.assert_array_equal(times, run.time[4:15])


def test_a_fixed_stop_is_drawn_for_a_contact_of_one_coordinate() -> None:
    ax = PLOTS["history of any system"](None)
    levels = [line.get_ydata() for line in ax.get_lines() if len(line.get_xdata()) == 2]
    assert [0.0, 0.0] in [list(level) for level in levels]


def test_the_jumps_of_the_portrait_are_the_impacts() -> None:
    run = some_run()
    ax = plotting.plot_phase_portrait(run)
    x, v = (np.asarray(part, dtype=float).reshape(-1, 3) for part in ax.get_lines()[1].get_data())
    np.testing.assert_array_equal(x[:, 0], run.position[:, 0])
    np.testing.assert_array_equal(v[:, 0], run.velocity_before[:, 0])
    np.testing.assert_array_equal(v[:, 1], run.velocity_after[:, 0])


def test_the_portrait_of_the_contact_coordinate_stays_between_the_stops() -> None:
    ax = plotting.plot_phase_portrait(some_run(), row=(-1.0, 1.0))
    u = np.asarray(ax.get_lines()[0].get_xdata(), dtype=float)
    assert np.nanmax(np.abs(u)) <= SET_A.half_clearance * (1.0 + 1e-15 * 16)
    assert ax.get_xlabel() == "$x_{2}-x_{1}$"


def test_a_section_is_drawn_as_place_and_velocity_after_the_impact() -> None:
    section = some_section()
    (line,) = plotting.plot_section(section).get_lines()
    np.testing.assert_array_equal(line.get_xdata(), section.position[:, 0])
    np.testing.assert_array_equal(line.get_ydata(), section.velocity[:, 0])


def test_a_damper_in_si_units_is_drawn_in_them() -> None:
    si = vi.ImpactDamper.from_physical(
        M1=10.0, M2=0.8, K=4e4, C=40.0, F0=60.0, Omega=66.0, D=0.006, restitution=0.6
    )
    length, rate = 60.0 / 4e4, np.sqrt(4e3)
    plain = vi.ImpactDamper(
        mass_ratio=0.08, omega_n=1.0, zeta=si.zeta, restitution=0.6, half_clearance=0.003 / length,
        omega=66.0 / rate,
    )  # fmt: skip
    both = [
        (si, vi.State((0.0, 0.0), (0.0, length * rate))),
        (plain, vi.State((0.0, 0.0), (0.0, 1.0))),
    ]
    sections = [vi.section(d, start, points=20, settle_events=0) for d, start in both]
    runs = [vi.simulate(d, start, impacts=20) for d, start in both]
    drawn = [plotting.plot_section(section) for section in sections]
    drawn += [plotting.plot_phase_portrait(run) for run in runs]
    drawn += [plotting.plot_history(run) for run in runs]
    labels = ["$x_{1}$ [mm]", r"$\dot x_{1+}$ [mm/s]", "$x_{1}$ [mm]", r"$\dot x_{1}$ [mm/s]"]
    labels += ["time $t$ [s]", r"$x_1,\ x_2$ [mm]"]
    assert [w for ax in drawn[::2] for w in (ax.get_xlabel(), ax.get_ylabel())] == labels
    assert not any("[" in w for ax in drawn[1::2] for w in (ax.get_xlabel(), ax.get_ylabel()))
    for k, factors in ((0, (length, length * rate)), (2, (length, length * rate)),
                       (4, (1.0 / rate, length))):  # fmt: skip
        for line, other in zip(drawn[k].get_lines(), drawn[k + 1].get_lines(), strict=True):
            expected = np.asarray(other.get_xydata()) * factors
            size = np.nanmax(np.abs(expected))
            np.testing.assert_allclose(line.get_xydata(), expected, rtol=1e-9, atol=1e-9 * size)


def test_many_points_become_pixels_and_few_stay_vectors() -> None:
    few = plotting.plot_section(some_section(10)).get_lines()[0]
    many = plotting.plot_section(some_section(style.MOST_VECTOR_POINTS + 1)).get_lines()[0]
    assert not few.get_rasterized()
    assert many.get_rasterized()


def test_an_unknown_coordinate_is_refused_with_the_known_ones() -> None:
    with pytest.raises(vi.InvalidParameterError, match=r"'x3': must be one of x1, x2, v1, v2"):
        plotting.plot_section(some_section(), x="x3")


@pytest.mark.parametrize("half", [True, False])
def test_multipliers_are_drawn_where_they_are(half: bool) -> None:
    path = some_path()
    ax = plotting.plot_multipliers(path, half=half)
    (points,) = ax.collections
    shown = points.get_offsets()
    expected = np.concatenate([o.half_multipliers if half else o.multipliers for o in path])
    np.testing.assert_array_equal(np.asarray(shown), np.stack([expected.real, expected.imag], 1))


def test_the_unit_circle_has_radius_one() -> None:
    ax = plotting.plot_multipliers(np.zeros((1, 1)))
    for line in ax.get_lines()[2:]:
        radius = np.hypot(*np.asarray(line.get_data(), dtype=float))
        np.testing.assert_allclose(radius, 1.0, rtol=4.0 * np.finfo(float).eps)


def test_orbits_and_their_multipliers_give_the_same_points() -> None:
    path = some_path()
    from_orbits = plotting.plot_multipliers(path).collections[0].get_offsets()
    values = np.array([orbit.half_multipliers for orbit in path])
    from_values = plotting.plot_multipliers(values, omega=OMEGAS).collections[0].get_offsets()
    np.testing.assert_array_equal(np.asarray(from_orbits), np.asarray(from_values))


@pytest.mark.parametrize(("values", "omega"), [(np.zeros(3), None), (np.zeros((3, 4)), [1.0])])
def test_multipliers_of_the_wrong_shape_are_refused(values: object, omega: object) -> None:
    with pytest.raises(vi.InvalidParameterError, match="path has shape"):
        plotting.plot_multipliers(values, omega=omega)  # type: ignore[arg-type]


def test_each_direction_has_its_colour_and_missing_points_are_left_out() -> None:
    ax = plotting.plot_bifurcation_diagram(some_diagram())
    up, down, both = ax.get_lines()
    assert up.get_color() != down.get_color()
    assert [len(line.get_xdata()) for line in (up, down, both)] == [6, 5, 0]
    np.testing.assert_array_equal(np.unique(np.asarray(up.get_xdata())), OMEGAS)


def test_where_up_and_down_agree_the_points_are_black_and_the_legend_says_so() -> None:
    """A periodic motion that is the same, one that is not, and two samples of one closed curve."""
    turns = 2.0 * np.pi * np.arange(60) * (math.sqrt(5.0) - 1.0) / 2.0
    same, other = np.tile([1.0, -1.0], 30), np.tile([0.5, -0.5], 30)
    up = np.stack([same, same, np.cos(turns)])
    down = np.stack([same[::-1] + 1e-12, other, np.cos(turns + 1.0)])
    diagram = xr.Dataset(
        {"v1": (("direction", "omega", "point"), np.stack([up, down]))},
        coords={"omega": OMEGAS, "direction": ["up", "down"]},
    )
    ax = plotting.plot_bifurcation_diagram(diagram)
    legend = ax.get_legend()
    assert legend is not None
    assert [text.get_text() for text in legend.get_texts()][-1] == "both ways"
    at = [set(np.asarray(line.get_xdata())) for line in ax.get_lines()]
    assert at == [{OMEGAS[1]}, {OMEGAS[1]}, {OMEGAS[0], OMEGAS[2]}]


def test_values_without_an_impact_are_on_the_axis_and_marked_at_its_foot() -> None:
    """Upwards the motion begins to impact at the third value, downwards it ends at the second."""
    up = np.array([[np.nan, np.nan], [np.nan, np.nan], [1.0, 2.0]])
    down = np.array([[np.nan, np.nan], [3.0, np.nan], [1.0, 2.0]])
    diagram = xr.Dataset(
        {
            "v1": (("direction", "omega", "point"), np.stack([up, down])),
            "end": (("direction", "omega"), np.zeros((2, 3), dtype=np.int8)),
        },
        coords={"omega": OMEGAS, "direction": ["up", "down"]},
    )
    ax = plotting.plot_bifurcation_diagram(diagram)
    foot = [line for line in ax.get_lines() if line.get_marker() == "s" and len(line.get_xdata())]
    assert [list(np.asarray(line.get_xdata())) for line in foot] == [
        [OMEGAS[0], OMEGAS[1]],
        [OMEGAS[0]],
    ]
    assert ax.get_xlim()[0] < OMEGAS[0] < OMEGAS[2] < ax.get_xlim()[1]
    legend = ax.get_legend()
    assert legend is not None
    assert "no impact" in legend.get_texts()[-1].get_text()
    diagram["end"][0, 0] = 1  # the cap was reached: not a motion without impacts
    ax = plotting.plot_bifurcation_diagram(diagram)
    foot = [line for line in ax.get_lines() if line.get_marker() == "s" and len(line.get_xdata())]
    assert list(np.asarray(foot[0].get_xdata())) == [OMEGAS[1]]


def test_orbits_with_names_have_marks_of_their_own() -> None:
    orbits = vi.symmetric_orbits(SET_A)
    names = ["sign +1", "sign -1"]
    ax = plotting.plot_multipliers([o.half_multipliers for o in orbits], labels=names)
    lines = [line for line in ax.get_lines() if line.get_label() in names]
    assert [line.get_label() for line in lines] == names
    assert len({(line.get_marker(), line.get_color()) for line in lines}) == len(orbits) == 2
    np.testing.assert_array_equal(lines[1].get_xdata(), orbits[1].half_multipliers.real)
    with pytest.raises(vi.InvalidParameterError, match="as many names as orbits, 2"):
        plotting.plot_multipliers([o.half_multipliers for o in orbits], labels=names[:1])


def test_an_unknown_variable_of_a_diagram_is_refused() -> None:
    with pytest.raises(vi.InvalidParameterError, match=r"'x9': must be one of v1\."):
        plotting.plot_bifurcation_diagram(some_diagram(), variable="x9")


def test_colours_are_told_apart_by_lightness_too() -> None:
    def lightness(colour: str) -> float:
        red, green, blue = mpl.colors.to_rgb(colour)
        return math.fsum((0.2126 * red, 0.7152 * green, 0.0722 * blue))

    assert abs(lightness(style.BLUE) - lightness(style.ORANGE)) > 0.25
