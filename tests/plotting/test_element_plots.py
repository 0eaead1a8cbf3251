"""Pictures of machines with elements: the drawing, strips of states, forces, loops."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from matplotlib.axes import Axes
from matplotlib.colors import to_hex
from matplotlib.patches import Rectangle

import vibroimpact as vi
from vibroimpact import plotting
from vibroimpact.plotting import style

pytestmark = pytest.mark.usefixtures("no_windows")

PAIR = vi.Mechanism(
    mass=[[1.0, 0.0], [0.0, 0.5]], damping=[[0.06, -0.02], [-0.02, 0.02]],
    stiffness=[[5.0, -2.0], [-2.0, 2.0]], forces=(vi.Harmonic(1.8, (1.0, 0.0)),),
    elements=(
        vi.RigidStop((1.0, 0.0), upper=0.4, restitution=0.7),
        vi.SoftStop((-1.0, 1.0), -0.3, 0.2, stiffness=(20.0, 30.0), damping=0.4),
        vi.Friction((0.0, 1.0), 0.1, 0.15, belt_speed=0.05),
    ),
)  # fmt: skip


def one(*elements: Any, **more: Any) -> vi.Mechanism:
    given: dict[str, Any] = {"mass": [[1.0]], "damping": [[0.0]], "stiffness": [[1.0]]}
    return vi.Mechanism(**(given | more), elements=elements)


def texts(m: vi.Mechanism) -> list[str]:
    return [text.get_text() for text in plotting.plot_mechanism(m).texts]


def some_run() -> vi.Run:
    return vi.simulate(PAIR, vi.State((0.0, 0.0), (0.0, 0.0)), t_max=30.0)


# ---- the drawing ---------------------------------------------------------------------------------


def test_the_drawing_names_every_part_with_its_number_and_values() -> None:
    said = texts(PAIR)
    for wanted in ("$m_{1}=1$", "$m_{2}=0.5$", "$k=3$", "$k=2$", "$c=0.04$", "$c=0.02$"):
        assert said.count(wanted) == 1, wanted
    assert "rigid stop 0: $x_{1}=0.4$\n$R=0.7$" in said
    assert "soft stop 1: $x_{2}-x_{1}=-0.3,\\ 0.2$\n$k=20,\\ 30$, $c=0.4$" in said
    assert "friction 2: 0.1, static 0.15\nbelt 0.05" in said
    assert r"$F_{1}=\sin\,1.8\,t$" in said


def test_the_drawing_names_a_law_that_is_not_the_usual_one() -> None:
    for law, word in (("unilateral", ""), ("linear", ", linear"), ("limited", ", limited")):
        stop: Any = {"upper": 0.5, "stiffness": 9.0, "law": law}
        said = texts(one(vi.SoftStop((1.0,), damping=2.0, **stop)))
        assert f"soft stop 0: $x_{{1}}=0.5$\n$k=9$, $c=2${word}" in said
        assert "soft stop 0: $x_{1}=0.5$\n$k=9$" in texts(one(vi.SoftStop((1.0,), **stop)))


@pytest.mark.parametrize("element", [
    vi.RigidStop((1.0,), -0.2, 0.3, motion=vi.Harmonic(1.0, (0.1,))),
    vi.SoftStop((-1.0,), lower=0.1, stiffness=9.0),
    vi.SoftStop((1.0,), upper=-0.1, stiffness=9.0, damping=1.0, motion=vi.Harmonic(1.0, (0.1,))),
    vi.Friction((1.0,), 0.1, motion=vi.Harmonic(1.0, (0.1,))),
])  # fmt: skip
def test_every_element_to_the_ground_is_drawn(element: Any) -> None:
    assert any("0: " in text for text in texts(one(element)))


def test_stops_between_masses_are_drawn_where_these_approach_and_part() -> None:
    m = vi.Mechanism(
        mass=np.eye(3), damping=np.zeros((3, 3)), stiffness=np.eye(3),
        elements=(
            vi.RigidStop((1.0, -1.0, 0.0), -0.2, 0.3), vi.SoftStop((0.0, -1.0, 1.0), 0.0, 0.0),
            vi.RigidStop((1.0, 0.0, -1.0), upper=0.5), vi.Friction((0.0, 1.0, -1.0), 0.1),
        ),
    )  # fmt: skip
    ax = plotting.plot_mechanism(m)
    colours = [to_hex(line.get_color()).upper() for line in ax.get_lines()]
    # masses approach: a plate; they part: both halves of a lip, and the plate of a soft stop
    assert colours.count(style.BLUE) == 2 + 3
    assert colours.count(style.VERMILION) == 1 + 2
    said = [text.get_text() for text in ax.texts]
    assert any(text.startswith("rigid stop 1: $x_{1}-x_{3}=0.5$") for text in said)


def test_what_is_no_part_between_two_masses_is_listed() -> None:
    m = vi.Mechanism(
        mass=[[1.0, 0.2, 0.0], [0.2, 1.0, 0.0], [0.0, 0.0, 1.0]],
        damping=[[0.0, 0.3, 0.0], [-0.3, 0.0, 0.0], [0.0, 0.0, 0.0]], stiffness=np.eye(3),
        elements=(vi.RigidStop((1.0, 1.0, 1.0), upper=1.0),),
    )  # fmt: skip
    said = texts(m)
    assert "rigid stop 0: on $x_{1}+x_{2}+x_{3}$" in said
    assert "$m_{12}=0.2$ couples the masses" in said
    assert "$c_{12}-c_{21}=0.6$, gyroscopic" in said


def test_a_machine_is_drawn_from_its_mechanism() -> None:
    machine = vi.ImpactOscillator(
        zeta=0.05, omega=1.2, restitution=0.8, clearance=0.3, lower_clearance=0.2
    )
    said = texts(machine.mechanism)
    assert [text.get_text() for text in plotting.plot_mechanism(machine).texts] == said
    assert "rigid stop 0: $x_{1}=-0.2$\n$R=0.8$" in said


# ---- strips of states ----------------------------------------------------------------------------


def strips(ax: Axes, colour: str) -> list[Rectangle]:
    return [
        p
        for p in ax.patches
        if isinstance(p, Rectangle) and to_hex(p.get_facecolor()).upper() == colour
    ]


def test_a_history_shades_each_state_as_long_as_it_lasts() -> None:
    m = one(vi.Friction((1.0,), 0.1, 0.15, belt_speed=0.05), damping=[[0.2]])
    run = vi.simulate(m, vi.State((0.0,), (0.05,)), t_max=40.0)
    edges = np.concatenate([[0.0], run.time])
    sticks = run.all_states[:-1, 0] == vi.FrictionState.STICK
    ax = plotting.plot_history(run)
    shaded = sum(p.get_width() for p in strips(ax, style.GREEN))
    assert shaded == pytest.approx(np.diff(edges)[sticks].sum(), rel=1e-12)
    names = [text.get_text() for text in ax.get_legend().get_texts()]
    assert {"sticks", "slips backward"} <= {*names}
    assert "friction 0" in [text.get_text() for text in ax.texts]


def test_strips_lie_below_the_data_one_for_each_element() -> None:
    ax = plotting.plot_history(some_run())
    low = ax.get_ylim()[0]
    data = min(np.min(line.get_ydata()) for line in ax.get_lines() if len(line.get_xdata()) > 2)
    top = max(p.get_y() + p.get_height() for p in ax.patches)
    assert low + top * (ax.get_ylim()[1] - low) < data
    heights = {round(p.get_y(), 6) for p in ax.patches}
    assert len(heights) == 2  # the soft stop and friction; the rigid stop never rests


def test_a_stop_that_moves_is_drawn_where_it_is_met() -> None:
    table = vi.RigidStop((1.0,), lower=0.0, restitution=0.7, motion=vi.Harmonic(2.0, (0.3,)))
    m = one(table, stiffness=[[0.0]], constant_force=(-1.0,))
    run = vi.simulate(m, vi.State((1.0,), (0.0,), 0.4), impacts=5)
    ax = plotting.plot_history(run)
    (stop,) = (line for line in ax.get_lines() if line.get_color() == style.GREY)
    met = np.interp(run.time, np.asarray(stop.get_xdata()), np.asarray(stop.get_ydata()))
    # impacts are among the times drawn; the phase is rounded
    np.testing.assert_allclose(met, run.position[:, 0], atol=1e-13)


def test_a_system_of_rigid_stops_has_no_strips() -> None:
    m = one(vi.RigidStop((1.0,), upper=0.5, restitution=0.0), constant_force=(1.0,))
    run = vi.simulate(m, vi.State((0.0,), (0.0,)), t_max=5.0)
    assert not plotting.plot_history(run).patches


# ---- forces --------------------------------------------------------------------------------------


def test_the_forces_drawn_are_those_of_the_run_with_their_jumps() -> None:
    run = some_run()
    ax = plotting.plot_forces(run, 5.0, 20.0)
    lines = {str(line.get_label()): line for line in ax.get_lines()}
    for number, name in ((1, "soft stop 1"), (2, "friction 2")):
        t, f = (np.asarray(part) for part in lines[name].get_data())
        np.testing.assert_array_equal(f, run.forces(t)[:, number])
        assert {*run.time[(run.time > 5.0) & (run.time < 20.0)]} <= {*t}
    assert "rigid stop 0" not in lines
    (only,) = plotting.plot_forces(run, elements=[2]).get_lines()[1:]
    assert only.get_label() == "friction 2"


def test_the_area_of_a_friction_loop_is_the_energy_lost() -> None:
    kinetic, start = 0.1, 1.05
    run = vi.simulate(one(vi.Friction((1.0,), kinetic)), vi.State((start,), (0.0,)), t_max=20.0)
    ax = plotting.plot_hysteresis(run, 0, 0.0, float(run.time[1]))
    u, f = (np.asarray(part) for part in ax.get_lines()[-1].get_data())
    area = np.trapezoid(f, u)
    x = run.position[1, 0]
    # constant between turns, where the ordinate jumps within one rounding of the abscissa
    assert area == pytest.approx((start**2 - x**2) / 2.0, rel=1e-12)


def test_the_loop_of_a_soft_stop_is_its_law() -> None:
    k, c, upper = 29.0, 0.5, 0.4
    m = one(
        vi.SoftStop((1.0,), upper=upper, stiffness=k, damping=c, motion=vi.Harmonic(0.5, (0.1,)))
    )
    run = vi.simulate(m, vi.State((0.0,), (1.0,)), t_max=3.0)
    ax = plotting.plot_hysteresis(run, 0)
    u, f = (np.asarray(part) for part in ax.get_lines()[-1].get_data())
    assert (f[u < upper - 1e-12] == 0.0).all()
    assert f.max() > k * (u.max() - upper) * (1.0 - 1e-6)  # the dashpot adds to the spring
    assert "relative to the stop" in ax.get_xlabel()


def test_a_run_of_impulses_alone_has_no_forces_to_draw() -> None:
    run = vi.simulate(one(vi.RigidStop((1.0,), upper=0.5)), vi.State((0.0,), (1.0,)), impacts=3)
    with pytest.raises(vi.InvalidParameterError, match=r"impulses only\. For their times"):
        plotting.plot_forces(run)
    with pytest.raises(vi.InvalidParameterError, match="element = 1: must be -1 to 0"):
        plotting.plot_hysteresis(run, 1)


def test_a_history_draws_phase_switches_and_friction_whose_load_lifts_off() -> None:
    m = one(
        vi.PhaseSwitch(2.0, (0.0, np.pi), ((1.0,), (-1.0,))),
        vi.Friction((1.0,), 0.3, load=vi.NormalLoad(1.0, motion=vi.Harmonic(3.0, (0.0,), (2.0,)))),
        forces=(vi.Harmonic(1.1, (0.6,)),),
    )  # fmt: skip
    run = vi.simulate(m, vi.State((0.3,), (0.2,)), t_max=20.0, impacts=10_000)
    assert np.any(run.states[:, 1] == vi.FrictionState.LIFTED)
    names = [text.get_text() for text in plotting.plot_history(run).get_legend().get_texts()]
    assert {"lifted off", "sticks", "arc 1"} <= {*names}


def test_a_phase_switch_has_no_force_along_a_row_to_draw() -> None:
    switch = vi.PhaseSwitch(2.0, (0.0, np.pi), ((1.0,), (-1.0,)))
    start = vi.State((0.3,), (0.2,))
    run = vi.simulate(one(switch, vi.Friction((1.0,), 0.3)), start, t_max=5.0)
    labels = [str(line.get_label()) for line in plotting.plot_forces(run).get_lines()[1:]]
    assert labels == ["friction 1"]
    for numbers in ([0], [1, -2]):
        with pytest.raises(
            vi.InvalidParameterError, match=r"elements = .*: must be a stop or fric"
        ):
            plotting.plot_forces(run, elements=numbers)
    with pytest.raises(vi.InvalidParameterError, match="element = 0: must be a stop or friction"):
        plotting.plot_hysteresis(run, 0)
    alone = vi.simulate(one(switch), start, t_max=5.0)
    with pytest.raises(vi.InvalidParameterError, match="no soft stop or friction"):
        plotting.plot_forces(alone)
