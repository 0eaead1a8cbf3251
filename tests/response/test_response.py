"""Frequency responses against closed forms, brute force and each other."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import matplotlib as mpl
import numpy as np
import pytest

import vibroimpact as vi
from vibroimpact import plotting
from vibroimpact.model.parameters import with_parameter
from vibroimpact.orbits.stability import Stability
from vibroimpact.plotting.report import comparison_sentence
from vibroimpact.response import compare
from vibroimpact.response.answers import Answer
from vibroimpact.response.band import band_of
from vibroimpact.response.compare import comparison
from vibroimpact.response.curves import curve_of_branch

BAND = (1.1, 1.7)
OSCILLATOR = vi.ImpactOscillator(zeta=0.05, omega=1.0, restitution=0.7, clearance=1.5)
FRAME = vi.ImpactDamper.from_physical(
    M1=120.0, M2=6.0, K=120.0 * (16.0 * math.pi) ** 2, C=0.04 * 120.0 * 16.0 * math.pi, F0=400.0,
    Omega=16.0 * math.pi, D=0.02, restitution=0.6,
)  # fmt: skip


@pytest.fixture(scope="module")
def response() -> vi.Response:
    return vi.frequency_response(
        OSCILLATOR, "omega", BAND, points=20, starts=6, most_branches=1, depth=0, progress=False
    )


@pytest.fixture(scope="module")
def frame() -> vi.Response:
    """A frame of 120 kg, 8 Hz, 2 % damping, 400 N, with a ball of 6 kg; nothing is chaotic."""
    return vi.frequency_response(
        FRAME,
        "omega",
        (6.0, 6.8),
        unit="Hz",
        points=5,
        starts=6,
        most_branches=1,
        depth=0,
        progress=False,
    )


def amplitude(omega: float) -> float:
    """Of the linear oscillator."""
    return 1.0 / abs(complex(1.0 - omega**2, 0.1 * omega))


# ---- branches ------------------------------------------------------------------------------------


def pressed(k: float, w: float) -> vi.Mechanism:
    """Two coupled masses, the first of which meets a rigid and a soft stop."""
    return vi.Mechanism(
        mass=[[1.0, 0.0], [0.0, 0.5]], damping=[[0.1, -0.02], [-0.02, 0.1]], stiffness=[[k, -0.3], [-0.3, 0.8]],
        forces=(vi.Harmonic(w, (1.0, 0.1)),),
        elements=(
            vi.RigidStop((1.0, 0.0), lower=-0.6, restitution=0.7),
            vi.SoftStop((1.0, -0.5), upper=0.3, stiffness=20.0, damping=0.5),
        ),
    )  # fmt: skip


CHATTERS = vi.Mechanism(
    mass=[[1.0, 0.0], [0.0, 0.7]], damping=[[0.3, -0.1], [-0.1, 0.2]], stiffness=[[0.5, -0.4], [-0.4, 1.0]],
    constant_force=(-1.0, -0.2), forces=(vi.Harmonic(0.5, (1.6, 0.3)),),
    elements=(vi.RigidStop((1.0, 0.0), lower=0.0, restitution=0.4),),
)  # fmt: skip
DAMPER = vi.ImpactDamper(
    mass_ratio=0.1, omega_n=0.5, zeta=0.045, restitution=0.8, half_clearance=5.0, omega=1.2
)


@pytest.mark.parametrize(
    ("system", "name", "bounds"),
    [(vi.Family(pressed, k=1.0, w=0.8), "k", (1.0, 1.01)), (DAMPER, "omega", (1.2, 1.21)),
     (CHATTERS, "omega", (0.5, 0.5001))],
    ids=["stops", "damper", "chatter"],
)  # fmt: skip
def test_orbits_of_a_branch_measured_together_are_those_measured_one_by_one(
    system: Any, name: str, bounds: tuple[float, float]
) -> None:
    """Of one orbit the derivative is from a linear system of its own, of a branch from the tangent."""
    start = vi.State((0.0, 0.0), (0.0, 0.5))
    orbit = vi.find_orbit(system, vi.simulate(system, start, impacts=1500))
    branch = vi.continue_orbit(orbit, name, bounds, steps=vi.Steps(points=8), progress=False)
    for measure in (
        "x1", "a1 - a2", "peak x2 - x1", "rms v1", "harmonic 3 x1", "transmissibility x1", "power",
        "power of dashpots", "contact force 0", "impulse", "impact speed", "impact rate",
    ):  # fmt: skip
        measured = vi.measure_of(system, measure)
        curve = curve_of_branch(branch, measured)
        for k in (0, len(branch) - 1):
            at = int(np.argmin(np.abs(curve.parameter - branch.values[k])))
            alone = measured.along(branch.orbit(k), name)
            found = curve.value[at], curve.derivative[at]
            assert found == pytest.approx(alone, rel=1e-10, abs=1e-10), measure


@pytest.mark.slow
def test_the_motion_without_impacts_begins_where_it_touches_the_stop(
    response: vi.Response,
) -> None:
    free = response.curves[0]
    # 1 / 1.5^2 = (1 - w^2)^2 + 0.01 w^2, a quadratic in w^2
    square = max(np.roots([1.0, 0.01 - 2.0, 1.0 - 1.0 / 1.5**2]))
    (touch,) = [point.parameter for point in free.special_points]
    assert touch == pytest.approx(math.sqrt(square), rel=1e-10)
    assert free.value == pytest.approx([amplitude(w) for w in free.parameter], rel=1e-12)
    assert free.parameter.min() == touch
    assert (free.stability == Stability.STABLE).all()


def test_what_does_not_exist_is_in_a_response_when_asked_for(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(compare, "COMPARED_POINTS", 12)
    asked: dict[str, Any] = {"points": 5, "starts": 0, "most_branches": 0, "progress": False}
    whole = vi.frequency_response(OSCILLATOR, "omega", BAND, inadmissible=True, **asked)
    (free,) = whole.curves
    (touch,) = [point.parameter for point in free.special_points]
    beyond = free.parameter[1:] <= touch
    assert (free.stability == np.where(beyond, Stability.INADMISSIBLE, Stability.STABLE)).all()
    assert free.parameter.min() == BAND[0]
    assert ":" in {line.get_linestyle() for line in whole.plot(marks=False).get_lines()}
    none = vi.frequency_response(OSCILLATOR, "omega", (0.9, 1.1), **asked)
    assert none.curves == ()
    assert none.notes[0] == "no motion without impacts: it would cross a stop all over the band"


@pytest.mark.slow
def test_motions_without_impacts_are_one_curve_also_of_a_measure_that_vanishes_on_them() -> None:
    """A branch of orbits with impacts goes on without; of these the third harmonic is rounding, here and there."""
    machine = vi.Mechanism(
        mass=[[1.0]], damping=[[0.05]], stiffness=[[1.0]], forces=(vi.Harmonic(1.0, (1.0,)),),
        elements=(vi.RigidStop((1.0,), upper=3.0, restitution=0.7),),
    )  # fmt: skip
    found = vi.frequency_response(
        machine, "omega", (0.8, 0.85), measure="harmonic 3 x1", points=2, starts=1, most_branches=2, depth=1,
        settle_periods=60, periods=30, progress=False,
    )  # fmt: skip
    assert [curve.symbol for curve in found.curves if "-0-0" in curve.symbol] == ["1-0-0"]
    assert len(found.curves) > 1


def test_a_response_goes_on_where_the_sequence_changes() -> None:
    """Friction begins to stick where the mass reverses; amplitudes are those of simulation on both sides."""
    machine = vi.Mechanism(
        mass=[[1.0]], damping=[[0.1]], stiffness=[[1.0]], forces=(vi.Harmonic(0.7, (0.0,), (1.5,)),),
        elements=(vi.Friction((1.0,), kinetic=1.0, static=1.1),),
    )  # fmt: skip
    found = vi.frequency_response(
        machine, "omega", (0.74, 0.755), points=2, starts=0, most_branches=2, depth=0,
        settle_periods=40, periods=10, progress=False,
    )  # fmt: skip
    first, second = sorted(found.curves, key=lambda curve: curve.parameter.min())
    assert first.parameter.max() == pytest.approx(second.parameter.min(), abs=1e-12)
    assert (first.parameter.min(), second.parameter.max()) == (0.74, 0.755)
    assert all((curve.stability == Stability.STABLE).all() for curve in found.curves)
    for omega in (0.743, 0.752):
        (answer,) = found.at(omega)
        period = 2.0 * math.pi / omega
        run = vi.simulate(
            with_parameter(machine, "omega", omega), vi.State((2.0,), (0.0,)), t_max=41.0 * period
        )
        x = run.at(np.linspace(40.0 * period, 41.0 * period, 2001))[0]
        # sampled beside the reversal, where x'' is at most 3
        assert answer.value == pytest.approx(np.ptp(x) / 2.0, abs=1.5 * (period / 2000.0) ** 2)


def test_the_branch_from_a_simulated_orbit_ends_at_the_touch(response: vi.Response) -> None:
    (branch,) = response.curves[1:]
    assert branch.symbol == "1-1-0"
    ((zero, value),) = [
        (point, value)
        for point, value in zip(branch.special_points, branch.special_values, strict=True)
        if point.kind == "ZERO"
    ]
    assert zero.parameter == pytest.approx(response.curves[0].special_points[0].parameter, rel=1e-7)
    assert value == pytest.approx(OSCILLATOR.clearance, rel=1e-6)


def test_the_worst_is_a_maximum_of_orbits_that_brute_force_finds(response: vi.Response) -> None:
    worst = response.worst
    assert worst.motion == "1-1-0"
    assert worst.stable
    assert worst.derivative == pytest.approx(0.0, abs=1e-9)
    near = worst.parameter + np.linspace(-2e-3, 2e-3, 41)
    state = worst.orbit.state if worst.orbit else None
    assert isinstance(state, vi.State)
    members = vi.sweep(OSCILLATOR, over={"omega": near}, start=state, settle_periods=400, progress=False,
                       observe=vi.measure_of(OSCILLATOR, "x1").observers)  # fmt: skip
    found = vi.measure_of(OSCILLATOR, "x1").of_sweep(members)
    assert worst.value >= float(found.max()) - 1e-12
    assert worst.value == pytest.approx(float(found.max()), rel=1e-6)  # (1e-4)^2 u'' / 2


def test_every_steady_motion_at_a_frequency_is_listed(response: vi.Response) -> None:
    found = response.at(1.5)
    assert [(a.motion, a.stable, a.admissible) for a in found] == [
        ("1-1-0", True, True), ("1-1-0", False, True), ("1-0-0", True, True)
    ]  # fmt: skip
    for answer in found:
        assert answer.orbit is not None
        system = with_parameter(OSCILLATOR, "omega", 1.5)
        assert vi.measure_of(system, "x1").of_orbit(answer.orbit) == pytest.approx(answer.value)
    assert [a.members > 0 for a in found] == [True, False, True]
    assert response.at(1.69)[0].value == pytest.approx(amplitude(1.69), rel=1e-12)


def test_between_two_points_the_derivatives_lead_to_the_orbit_there(response: vi.Response) -> None:
    branch = response.curves[1]
    stable = np.flatnonzero(branch.stability == Stability.STABLE)
    k = int(stable[len(stable) // 4])  # away from the fold
    middle = float(branch.parameter[k : k + 2].mean())
    motion = branch.motion_near(k, middle)
    assert motion is not None
    step = abs(float(np.diff(branch.parameter[k : k + 2])[0]))
    value = response.measure.of_orbit(motion)
    assert branch.between(k, middle) == pytest.approx(value, abs=100.0 * step**4 + 1e-12)


@pytest.mark.slow
def test_a_soft_stop_has_the_contact_force_of_its_response() -> None:
    def stopped(w: float) -> vi.Mechanism:
        return vi.Mechanism(
            mass=[[1.0]], damping=[[0.1]], stiffness=[[1.0]], forces=(vi.Harmonic(w, (1.0,)),),
            elements=(vi.SoftStop((1.0,), upper=1.5, stiffness=10.0, damping=0.2),),
        )  # fmt: skip

    found = vi.frequency_response(
        vi.Family(stopped, w=1.0), "w", (1.15, 1.2), measure="contact force", points=3, starts=2,
        most_branches=1, depth=0, progress=False,
    )  # fmt: skip
    system = with_parameter(found.system, "w", 1.2)
    state = found.at(1.2)[0].state
    assert state is not None
    run = vi.simulate(system, state, t_max=4.0 * math.pi / 1.2)
    force = -run.forces(np.linspace(0.0, 4.0 * math.pi / 1.2, 40_001))[:, 0]
    assert found.at(1.2)[0].value == pytest.approx(force.max(), rel=1e-6)
    assert found.worst.parameter == pytest.approx(1.2)


# ---- simulation ----------------------------------------------------------------------------------


def test_chaos_is_an_answer_of_its_own_with_rms_below_peak() -> None:
    damper = vi.ImpactDamper(mass_ratio=0.1, omega_n=0.5, zeta=0.045, restitution=0.8,
                             half_clearance=5.0, omega=0.35)  # fmt: skip
    found = vi.frequency_response(
        damper, "omega", (0.345, 0.35), points=2, starts=3, most_branches=0, progress=False
    )
    assert {answer.motion for answer in found.unexplained} == {"chaotic"}
    for answer in found.unexplained:
        assert 0.0 < answer.rms < answer.value <= answer.peak
        assert answer.members <= 5
    assert found.worst in found.unexplained or found.worst.motion == "chaotic"


def test_starts_on_a_grid_are_joined_to_the_same_answers() -> None:
    base = vi.State((0.0,), (0.0,))
    grid = vi.GridStarts({"x1": [-1.0, 0.0], "v1": [0.0, 2.0]}, base)
    found = vi.frequency_response(
        OSCILLATOR, "omega", (1.5, 1.55), points=2, starts=grid, most_branches=0, progress=False
    )
    for answers in found.answers:
        assert sorted(answer.motion for answer in answers) == ["1-1-0", "no impacts"]
        assert sum(answer.members for answer in answers) == 2 + 4  # up and down, and the grid


@pytest.mark.slow
def test_coexisting_motions_of_a_frame_are_in_hertz_and_metres(frame: vi.Response) -> None:
    silent, striking = sorted(frame.at(6.4), key=lambda answer: answer.value)
    assert (silent.motion, striking.motion) == ("1-0-0", "1-1-1")
    assert [a.stability for a in (silent, striking)] == [Stability.NEUTRAL, Stability.STABLE]
    w, wn = 12.8 * math.pi, 16.0 * math.pi
    metres = 400.0 / 120.0 / abs(complex(wn**2 - w**2, 0.04 * wn * w))
    assert silent.value == pytest.approx(metres, rel=1e-9)
    assert silent.parameter_shown == pytest.approx(6.4)
    data = frame.to_dataset()
    assert data["value_of_point"].attrs["units"] == "m"
    assert data["value_of_point"].attrs["quantity"] == "length"
    assert float(data["omega_of_point"].max()) == pytest.approx(2.0 * math.pi * 6.8)


def test_a_ball_that_stands_in_its_gap_is_neutral_and_decides_nothing() -> None:
    play = replace(FRAME, half_clearance=0.014)
    found = vi.frequency_response(
        play,
        "omega",
        (8.3, 8.8),
        unit="Hz",
        points=2,
        starts=3,
        most_branches=1,
        depth=0,
        progress=False,
    )
    silent = found.largest(neutral=True)
    assert silent.value == pytest.approx(
        0.014, rel=1e-9
    )  # where the ball, in the middle, is touched
    assert (silent.stability, silent.attracting) == (Stability.NEUTRAL, False)
    assert "1-0-0, without impacts, neutral, one of a 1-parameter family" in repr(silent)
    assert found.worst.value < 0.5 * silent.value
    assert "1-1-1, with impacts, stable" in repr(found.worst)
    # the witness: the ball still, and with a drift of 1 mm/s
    w, wn = 16.8 * math.pi, 16.0 * math.pi
    x = 400.0 / 120.0 / complex(wn**2 - w**2, 0.04 * wn * w)
    times = np.linspace(190.0, 200.0, 20_001)
    for drift, amplitude in ((0.0, abs(x)), (1e-3, found.at(8.4)[1].value)):
        start = vi.State((x.imag, 0.0), (w * x.real, drift))
        run = vi.simulate(with_parameter(play, "omega", w), start, t_max=200.0, impacts=2**20)
        assert np.ptp(run.at(times)[0][:, 0]) / 2.0 == pytest.approx(amplitude, rel=1e-4)


# ---- pictures and comparisons --------------------------------------------------------------------


def test_linear_machines_beside_a_response_are_the_closed_forms(
    frame: vi.Response, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(compare, "COMPARED_POINTS", 12)
    p, opened = comparison(frame, "linear")
    g = p / FRAME.omega_n
    static = FRAME.force / FRAME.mass / FRAME.omega_n**2
    assert opened == pytest.approx(static / np.abs(1.0 - g**2 + 0.04j * g), rel=1e-10)
    _, tuned = comparison(frame, "tuned")
    damper = vi.tuned_damper(0.05, 0.02)
    # the optimum is known to the root of rounding
    assert tuned == pytest.approx(static * damper.amplification(g), rel=1e-8)


@pytest.mark.usefixtures("no_windows")
def test_the_picture_has_si_units_and_lines_by_stability(
    frame: vi.Response, response: vi.Response, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(compare, "COMPARED_POINTS", 12)
    ax = frame.plot(compare=("linear", "tuned"))
    assert ax.get_xlabel() == "forcing frequency $f$ [Hz]"
    assert ax.get_ylabel() == "amplitude of $x_{1}$ [mm]"
    assert ax.get_xlim() == pytest.approx((5.988, 6.812))  # marks at the ends are whole
    decibel = frame.plot(decibel=True)
    assert decibel.get_ylabel() == "amplitude of $x_{1}$ [dB re 1 m]"
    ax = plotting.plot_response(response, marks=False)
    styles = {line.get_linestyle() for line in ax.get_lines()}
    assert {"-", "--"} <= styles
    assert ":" not in styles
    assert mpl.rcParams["font.family"] != ["STIXGeneral"]  # the user's again


# ---- misuse and interruption ---------------------------------------------------------------------


def test_a_response_is_told_as_simulated_first_and_with_one_curve_more_after_each_branch() -> None:
    told: list[vi.Response] = []
    found = vi.frequency_response(
        OSCILLATOR, "omega", (0.9, 1.1), points=3, starts=1, most_branches=1, depth=0,
        so_far=told.append, progress=False,
    )  # fmt: skip
    first = len(told[0].curves)
    assert all(curve.branch is None for curve in told[0].curves)
    assert len(found.curves) > first
    for more, one in enumerate(told):
        assert one.curves == found.curves[: first + more]
    assert told[-1].curves == found.curves
    assert all(one.answers == found.answers for one in told)


def test_an_interruption_keeps_the_curves_found() -> None:
    def stop(report: vi.ProgressReport) -> None:
        if report.text.startswith("branch 0"):
            raise KeyboardInterrupt

    found = vi.frequency_response(
        OSCILLATOR, "omega", (1.4, 1.5), points=3, starts=1, progress=stop
    )
    assert found.interrupted
    assert found.curves[0].symbol == "1-0-0"
    assert len(found.answers) == 3


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"bounds": (1.0, 0.5)}, "low < high"), ({"bounds": (0.0, 1.0)}, "must be > 0"),
        ({"parameter": "omeg"}, "one of zeta, omega"), ({"measure": "loudness"}, "'impact rate'"),
        ({"unit": "kHz"}, "must be one of , Hz"), ({"parameter": "zeta", "unit": "Hz"}, "not the forcing"),
        ({"points": 1}, ">= 2"), ({"starts": -1}, ">= 0"), ({"progress": 3}, "True, a function"),
        ({"so_far": "plot"}, "a function of a Response"),
    ],
)  # fmt: skip
def test_what_makes_no_response_is_refused(changes: dict[str, Any], words: str) -> None:
    given: dict[str, Any] = {"parameter": "omega", "bounds": (0.5, 1.0)} | changes
    with pytest.raises(vi.InvalidParameterError, match=words):
        vi.frequency_response(OSCILLATOR, **given)


def test_a_place_outside_the_band_and_a_missing_free_mass_are_refused(
    response: vi.Response,
) -> None:
    with pytest.raises(vi.InvalidParameterError, match=r"in the band, \[1.1, 1.7\]"):
        response.at(2.0)
    with pytest.raises(vi.InvalidParameterError, match="free masses beside it"):
        comparison(response, "tuned")
    ball = vi.Mechanism(mass=[[1.0]], damping=[[0.0]], stiffness=[[1.0]],
                        elements=(vi.RigidStop((1.0,), upper=1.0),))  # fmt: skip
    with pytest.raises(vi.InvalidParameterError, match="no forcing"):
        vi.frequency_response(ball, "stiffness[0][0]", (1.0, 2.0))


@pytest.mark.parametrize("factor", [1e-7, 1.23456789, 1234567.0])
@pytest.mark.parametrize("order", [0, 1])
def test_a_row_of_any_size_scales_its_value_peak_and_rms(factor: float, order: int) -> None:
    def table(x: float) -> Any:
        return vi.frequency_response(
            OSCILLATOR, "omega", (1.1, 1.2), measure=vi.measures.Amplitude((x,), order=order),
            points=2, starts=1, settle_periods=50, periods=10, most_branches=0, progress=False,
        ).to_dataset()  # fmt: skip

    one, many = table(1.0), table(factor)
    for name in ("value_of_answer", "rms_of_answer", "peak_of_answer"):
        assert np.isfinite(one[name]).any()
        np.testing.assert_allclose(many[name], factor * one[name], rtol=1e-12)


def test_a_response_without_a_stable_motion_says_so() -> None:
    found = vi.frequency_response(
        OSCILLATOR, "omega", (1.1, 1.2), points=2, start=vi.State((10.0,), (0.0,)), starts=0,
        most_branches=0, progress=False,
    )  # fmt: skip
    assert "no stable motion was found" in repr(found)


@pytest.mark.slow
def test_a_ball_that_is_not_met_leaves_as_much_and_touching_begins_at_a_force_or_a_gap() -> None:
    small = replace(FRAME, force=0.004)
    found = vi.frequency_response(
        small, "omega", (7.9, 8.1), unit="Hz", points=2, starts=0, most_branches=0, progress=False
    )
    # |X| is largest at sqrt(1 - 2 zeta^2) omega_n
    peak = 0.004 / 120.0 / (16.0 * math.pi) ** 2 / (0.04 * math.sqrt(1.0 - 0.02**2))
    assert found.worst.value == pytest.approx(peak, rel=1e-9)
    assert compare.touching_factor(found) == pytest.approx(0.01 / peak, rel=1e-6)
    words = comparison_sentence(found, "linear")
    assert words.startswith("That is as much as without the damper: no stop is met.")
    assert f"{0.01 / peak * 0.004:.4g} N" in words
    assert "dB" not in words


def test_a_band_that_fits_the_machine_in_hertz_only_is_questioned() -> None:
    with pytest.warns(UserWarning, match=r"8 Hz \(50.2.* Give unit = 'Hz'"):
        band_of(FRAME, "omega", (6.0, 10.0))
    band_of(FRAME, "omega", (6.0, 10.0), "Hz")
    band_of(OSCILLATOR, "omega", (0.1, 0.2))  # whose numbers have no units


@pytest.mark.parametrize(
    ("symbol", "silent"),
    [("1-0-0", True), ("2-0-0,0-0 (contact 1)", True), ("1-1-0", False), ("10-0-10", False), ("5-inf-inf", False),
     ("1-0-0,0-1", False), ("chaotic", False), ("not periodic", False)],
)  # fmt: skip
def test_a_motion_is_silent_where_its_symbol_counts_no_impacts_at_all(
    symbol: str, silent: bool
) -> None:
    assert Answer(1.0, 1.0, symbol).silent == silent


def test_a_ball_that_rests_anywhere_is_not_the_worst_where_simulated_motions_hit() -> None:
    """The resonance of a spindle stays within the clearance, but a ball with any speed hits."""
    spindle = vi.ImpactDamper.from_physical(
        M1=12.0, M2=0.4, K=9.6e5, C=130.0, F0=60.0, Omega=282.7, D=4e-3, restitution=0.6
    )
    found = vi.frequency_response(
        spindle, "omega", (44.0, 46.0), unit="Hz", points=3, starts=0, most_branches=0, settle_periods=100,
        periods=50, progress=False,
    )  # fmt: skip
    silent = found.curves[0]
    peak = 60.0 / 12.0 / (282.8427 * 130.0 / 12.0)  # F0 / (M1 omega_n C / M1)
    assert silent.value.max() == pytest.approx(peak, rel=1e-3)  # its maximum is one of its points
    assert found.largest(neutral=True).value == pytest.approx(peak, rel=1e-3)
    assert found.worst.attracting
    assert found.worst.value < 0.8 * peak


def test_a_motion_of_three_periods_is_measured_over_whole_periods_of_its_own() -> None:
    def before_a_stop(omega: float) -> vi.Mechanism:
        return vi.Mechanism(
            mass=[[1.0]], damping=[[0.05]], stiffness=[[1.0]], forces=(vi.Harmonic(omega, (1.0,)),),
            elements=(vi.RigidStop((1.0,), upper=0.0, restitution=0.8),),
        )  # fmt: skip

    found = vi.frequency_response(
        vi.Family(before_a_stop, omega=6.1), "omega", (6.0, 6.2), measure=vi.measures.Harmonic("x1", harmonic=1.0),
        points=2, starts=0, start=vi.State((-1.0,), (0.0,)), settle_periods=1000, most_branches=2, progress=False,
    )  # fmt: skip
    assert [curve.symbol for curve in found.curves if curve.branch] == ["3-1-0"]
    assert not found.unexplained
    for omega, (answer,) in zip((6.0, 6.2), found.answers, strict=True):
        assert answer.motion == "3-1-0"
        span, n = 6.0 * math.pi / omega, 6000
        t = span * np.arange(n) / n
        run = vi.simulate(before_a_stop(omega), answer.state, t_max=span)
        x = run.at(t)[0][:, 0]
        # the rule of rectangles: its error is below (span / n)^2 of the largest velocity over span, 2e-7
        expected = abs(2.0 * np.mean(x * np.exp(-1j * omega * t)))
        assert answer.value == pytest.approx(expected, abs=1e-6)
