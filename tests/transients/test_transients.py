"""Free decay, sine sweeps, force records: against closed forms and an integrator with events."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy import signal
from scipy.integrate import solve_ivp

import vibroimpact as vi
from vibroimpact.transients.driven import Lines, driven, simulate_driven

DAMPER = vi.ImpactDamper(
    mass_ratio=0.1, omega_n=1.0, zeta=0.02, restitution=0.6, half_clearance=0.5, omega=1.0
)
FRAME = vi.ImpactDamper.from_physical(
    M1=120.0, M2=6.0, K=303e3, C=242.0, F0=400.0, Omega=50.0, D=0.006, restitution=0.5
)


LARGEST = vi.Mechanism(
    mass=np.eye(20), damping=np.eye(20), stiffness=np.eye(20),
    elements=(vi.RigidStop((1.0,) * 20, upper=1.0),),
)  # fmt: skip


def noise(samples: int, step: float, seed: int = 3, size: float = 1.0) -> tuple[Any, Any]:
    rng = np.random.default_rng(seed)
    return step * np.arange(samples), size * rng.normal(size=samples)


def oscillator(*parts: Any, zeta: float = 0.05, **more: Any) -> vi.Mechanism:
    given: dict[str, Any] = {"mass": [[1.0]], "damping": [[2.0 * zeta]], "stiffness": [[1.0]]}
    return vi.Mechanism(**(given | more), elements=parts)


# ---- records: the motion -------------------------------------------------------------------------


def integrated(
    record: vi.ForceRecord, system: vi.ImpactDamper, end: float
) -> tuple[list[float], Any]:
    """Impacts and final state of a damper under a force on x1 by an integrator, sample by sample."""
    mu, delta, r, zeta = system.mass_ratio, system.half_clearance, system.restitution, system.zeta

    def rates(t: float, y: Any) -> list[float]:
        force = float(record.at(t)) if acts else 0.0
        return [y[2], y[3], force - 2.0 * zeta * y[2] - y[0], 0.0]

    def gap(side: float) -> Any:
        def margin(_: float, y: Any) -> float:
            return float(delta - side * (y[1] - y[0]))

        margin.terminal, margin.direction = True, -1.0  # type: ignore[attr-defined]
        return margin

    acts = True
    y, t, hits = np.zeros(4), float(record.time[0]), []
    for until in [*record.time[1:], end]:
        acts = until <= record.time[-1]  # no force after the last sample
        while t < until:
            found = solve_ivp(
                rates, (t, until), y, method="DOP853", rtol=1e-12, atol=1e-13,
                events=(gap(1.0), gap(-1.0)),
            )  # fmt: skip
            t, y = float(found.t[-1]), found.y[:, -1]
            if found.status == 1:
                hits.append(t)
                closing = (1.0 + r) * (y[3] - y[2]) / (1.0 + mu)
                y[2] += mu * closing
                y[3] -= closing
    return hits, y


def test_impacts_under_a_random_record_are_those_of_an_integrator_with_events() -> None:
    time, values = noise(30, 0.7)
    record = vi.ForceRecord(time, values)
    damper = replace(DAMPER, half_clearance=1.0)  # no chatter, which an integrator cannot count
    response = vi.simulate_record(damper, record, after=4.0)
    end = float(time[-1]) + 4.0
    hits, y = integrated(record, damper, end)
    assert len(hits) > 10
    # the integrator's 1e-12 a step grows with the impacts, each of which may multiply it by some 2
    assert response.impact_times == pytest.approx(hits, abs=1e-8)
    assert np.concatenate(response.at(end)) == pytest.approx(y, abs=1e-8)


def test_without_impacts_the_response_is_that_of_a_first_order_hold() -> None:
    time, values = noise(400, 0.05)
    record = vi.ForceRecord(time, values, kind="base")
    wide = oscillator(vi.RigidStop((1.0,), upper=1e3))
    response = vi.simulate_record(wide, record)
    system = ([[0.0, 1.0], [-1.0, -0.1]], [[0.0], [-1.0]], np.eye(2), np.zeros((2, 1)))
    _, y, _ = signal.lsim(system, values, time)  # exact between samples, too
    position, velocity = response.at(time)
    assert position[:, 0] == pytest.approx(y[:, 0], abs=1e-12)
    assert velocity[:, 0] == pytest.approx(y[:, 1], abs=1e-12)


def test_a_record_of_samples_of_a_sine_tends_to_the_sine() -> None:
    time = np.linspace(0.0, 20.0, 4001)
    damper = replace(DAMPER, omega=1.3, half_clearance=1.0)
    sampled = vi.simulate_record(damper, vi.ForceRecord(time, np.sin(1.3 * time)))
    exact = vi.simulate(damper, vi.State((0.0, 0.0), (0.0, 0.0)), impacts=1000, t_max=20.0)
    hits = exact.time[exact.impacts]
    assert (
        len(hits) > 5
    )  # chords are (1.3 h)^2 / 12 = 4e-6 below the sine on the mean; impacts enlarge it
    assert sampled.impact_times == pytest.approx(hits, abs=4e-4)


PARTS = {
    "rigid": vi.RigidStop((1.0,), -0.3, 0.2, restitution=0.5),
    "soft": vi.SoftStop((1.0,), -0.3, 0.2, stiffness=30.0, damping=0.8),
    "friction": vi.Friction((1.0,), 0.2, 0.3),
    "belt": vi.Friction((1.0,), 0.2, belt_speed=0.1),
    "moving": vi.RigidStop((1.0,), upper=0.2, restitution=0.7,
                           motion=vi.Harmonic(2.0, (0.05,))),
}  # fmt: skip


@pytest.mark.parametrize("part", PARTS)
def test_energy_that_comes_in_is_stored_or_taken(part: str) -> None:
    time, values = noise(200, 0.1)
    machine = oscillator(PARTS[part])
    response = vi.simulate_record(machine, vi.ForceRecord(time, values))
    energies = response.energies
    assert response.complete
    assert energies.parts[0] != 0.0
    # integrals of some hundred flights, each to rounding of the energies
    assert abs(energies.balance) < 1e-12 * (energies.input + energies.dissipated)


@pytest.mark.parametrize("part", ["rigid", "friction", "belt"])
def test_more_corners_on_a_straight_record_change_nothing(part: str) -> None:
    """Rest on a stop, chatter and sticking survive the hand-over."""
    machine = oscillator(PARTS[part], zeta=0.3)
    m, factor = driven(machine, np.array([1.0]), 1.0)
    lines = Lines(*map(np.array, ([0.0], [0.1 * factor], [0.03 * factor], [30.0])))
    begin = np.linspace(0.0, 30.0, 301)[:-1]
    many = Lines(
        begin, factor * (0.1 + 0.03 * begin), np.full(300, 0.03 * factor), np.full(300, 0.1)
    )
    start = vi.State((0.0, 0.0), (0.4, 0.0))
    one, handed = (simulate_driven(m, start, given) for given in (lines, many))
    t = np.linspace(0.0, 30.0, 500)
    # 300 hand-overs of some units in the last place each
    assert handed.at(t)[0] == pytest.approx(one.at(t)[0], abs=1e-12)
    own = (vi.Status.RELEASE, vi.Status.CHANGE, vi.Status.CHATTER)
    for status in own:
        assert np.sum(handed.status == status) == np.sum(one.status == status)


def test_rest_on_a_stop_under_a_record_is_one_event_and_ends_when_the_force_lifts() -> None:
    ball = oscillator(
        vi.RigidStop((1.0,), lower=0.0, restitution=0.4), damping=[[0.0]], stiffness=[[0.0]],
        constant_force=(-1.0,),
    )  # fmt: skip
    time, values = noise(200, 0.05, size=0.2)
    values[-50:] = np.linspace(0.0, 2.0, 50)  # lifts at 1: half of the way
    response = vi.simulate_record(ball, vi.ForceRecord(time, values), vi.State((0.3,), (0.0,)))
    own = response.run.status[response.events]
    assert np.sum(own == vi.Status.STICK) == np.sum(own == vi.Status.RELEASE) == 1
    (lifted,) = response.run.time[response.run.status == vi.Status.RELEASE]
    assert lifted == pytest.approx(float(time[-50]) + 0.05 * 24.5, abs=1e-12)


def test_records_drive_a_machine_in_si_units_as_the_mechanism() -> None:
    time, values = noise(100, 0.01, size=5.0)
    record = vi.ForceRecord(time, values, kind="base")
    m1, m2, k, c = 120.0, 6.0, 303e3, 242.0
    plain = vi.Mechanism(
        mass=[[m1, 0.0], [0.0, m2]], damping=[[c, 0.0], [0.0, 0.0]], stiffness=[[k, 0.0], [0.0, 0.0]],
        elements=(vi.RigidStop((-1.0, 1.0), -0.003, 0.003, 0.5),),
    )  # fmt: skip
    frame, other = (vi.simulate_record(one, record, after=0.5) for one in (FRAME, plain))
    assert frame.impact_times == pytest.approx(other.impact_times, abs=1e-9)
    assert frame.impact_times.size > 5
    for number in ("peak", "rms", "largest_impulse"):
        here, there = (getattr(response, number) for response in (frame, other))
        here, there = (x() if callable(x) else x for x in (here, there))
        assert here == pytest.approx(there, rel=1e-8)
    assert frame.peak_acceleration() == pytest.approx(other.peak_acceleration(), rel=1e-8)
    assert frame.energies.input == pytest.approx(other.energies.input, rel=1e-8)
    assert frame.peak("x2 - x1") == pytest.approx(0.003, abs=1e-12)


def test_the_largest_impulse_is_that_of_the_jumps_of_momentum() -> None:
    time, values = noise(100, 0.3)
    response = vi.simulate_record(DAMPER, vi.ForceRecord(time, values))
    run, hit = response.run, response.run.impacts
    jumps = (run.velocity_after - run.velocity_before)[hit, 1] * DAMPER.mass_ratio
    assert response.largest_impulse == pytest.approx(np.abs(jumps).max(), rel=1e-9)


def test_peaks_lie_between_samples() -> None:
    """Half a triangle of force on a free mass: x'' = t, x = t^3 / 6, exactly; then it flies on."""
    free = oscillator(vi.RigidStop((1.0,), upper=1e3), damping=[[0.0]], stiffness=[[1.0]])
    response = vi.simulate_record(free, vi.ForceRecord([0.0, 1.0], [0.0, 1.0]), after=7.0)
    x, v = 1.0 - math.sin(1.0), 1.0 - math.cos(1.0)  # of x'' + x = t at t = 1
    assert response.peak() == pytest.approx(math.hypot(x, v), rel=1e-13)
    assert response.peak("v1") == pytest.approx(math.hypot(x, v), rel=1e-13)


def test_samples_on_a_line_are_merged_and_a_parabola_is_not() -> None:
    time = np.linspace(0.0, 1.0, 1001)
    for values, pieces in ((3.0 * time - 1.0, 1), (np.abs(time - 0.5), 2), (time**2, 1000)):
        assert len(vi.ForceRecord(time, values).pieces().begin) == pieces


def test_own_forces_act_on_request_only() -> None:
    record = vi.ForceRecord([0.0, 30.0], [0.0, 0.0])
    still, driven_on = (vi.simulate_record(DAMPER, record, own_forces=own) for own in (False, True))
    run = vi.simulate(DAMPER, vi.State((0.0, 0.0), (0.0, 0.0)), impacts=1000, t_max=30.0)
    assert still.peak() == 0.0
    t = np.linspace(0.0, 30.0, 200)  # chatter ends at other last bits
    assert driven_on.at(t)[0] == pytest.approx(run.at(t)[0], abs=1e-9)
    assert abs(driven_on.energies.balance) < 1e-12 * driven_on.energies.input


# ---- records: files and misuse -------------------------------------------------------------------


def written(folder: Path, text: str) -> Path:
    path = folder / "record.csv"
    path.write_text(text, encoding="utf-8")
    return path


@pytest.mark.parametrize(("text", "options"), [
    ("0,1\n0.5,2\n1,-1\n", {}),
    ("# shaker 3\ntime [ms]; load [kN]; note\n0; 0.001; a\n\n500; 0.002; b\n1000; -0.001; c\n",
     {"time_factor": 1e-3, "factor": 1e3, "values": "load [kN]"}),
    ("1\n2\n-1\n", {"step": 0.5}),
    ("0 9 1\n0.5 9 2\n1 9 -1\n", {"values": 2}),
    ("0\t1\n0.5\t2\n1\t-1\n", {}),
    ('"time", "load"\n0, "1"\n0.5, 2\n1, -1\n', {"values": "load"}),
    ('time,"load\n' + "0,1\n0.5,2\n" + "1,-1\n", {}),
])  # fmt: skip
def test_tables_of_every_kind_are_read(tmp_path: Path, text: str, options: dict[str, Any]) -> None:
    record = vi.ForceRecord.from_csv(written(tmp_path, text), **options)
    assert record.time == pytest.approx([0.0, 0.5, 1.0])
    assert record.values == pytest.approx([1.0, 2.0, -1.0])


@pytest.mark.parametrize(("text", "options", "said"), [
    ("0,1\n1,2\n0.5,3\n", {}, r"record.csv, line 3: time 0.5: must be greater than 1"),
    ("t,f\n0,1\n\n1,abc\n", {}, r"record.csv, line 4, column 1: 'abc': must be a finite number"),
    ("0,1\n1,nan\n", {}, r"line 2, column 1: 'nan'"),
    ("0;1,5\n1;2\n", {}, r"line 1, column 1: '1,5'.*a point, not a comma"),
    ("0,1\n1\n2,3\n", {}, r"line 2: has 1 columns; column 1"),
    ("1\n2\n", {}, r"has 1 columns, 0 to 0"),
    ("t,f\n0,1\n1,2\n", {"values": "g"}, r"column = 'g': .* by name: 't', 'f'"),
    ("0,1\n", {}, r"1 samples"),
    ("# nothing\n", {}, r"holds no samples"),
    ("0,1\n1," + 200_000 * "a" + "\n", {}, r"line 2, column 1: .aaa"),
])  # fmt: skip
def test_bad_tables_are_refused_with_file_line_and_value(
    tmp_path: Path, text: str, options: dict[str, Any], said: str
) -> None:
    with pytest.raises(vi.InvalidParameterError, match=said):
        vi.ForceRecord.from_csv(written(tmp_path, text), **options)


@pytest.mark.parametrize(("call", "said"), [
    (lambda: vi.ForceRecord([0, 1, 1], [0, 1, 2]), r"time\[2\] = 1.0: must be greater than time\[1\]"),
    (lambda: vi.ForceRecord([0, math.nan], [0, 1]), r"time\[1\] = nan"),
    (lambda: vi.ForceRecord([0, 1], [0, 1, 2]), r"values has shape \(3,\); expected \(2,\)"),
    (lambda: vi.ForceRecord([0], [0]), "2 or more"),
    (lambda: vi.ForceRecord([0, 1], [0, 1], kind="motion"), "force, base"),
    (lambda: vi.ForceRecord([0, 1], [0, 1], "y1"), "row"),
    (lambda: vi.ForceRecord.from_csv("missing.csv"), r"missing.csv: cannot be read"),
    (lambda: vi.simulate_record(DAMPER, vi.ForceRecord([0, 1], [0, 1], "x3")), "x3"),
    (lambda: vi.simulate_record(DAMPER, vi.ForceRecord([0, 1], [0, 1]), vi.State((0,), (0,))), "start"),
    (lambda: vi.simulate_record(DAMPER, [0, 1]), "a ForceRecord"),  # type: ignore[arg-type]
    (lambda: vi.simulate_record(DAMPER, vi.ForceRecord([0, 1], [0, 1])).at(2.0), r"\[0.0, 1.0\]"),
    (lambda: vi.simulate_record(LARGEST, vi.ForceRecord([0, 1], [0, 1])), "at most 19"),
    (lambda: vi.response_spectrum(vi.ForceRecord([0, 1], [0, 1]), [1.0, 0.0]), "> 0"),
    (lambda: vi.response_spectrum(vi.ForceRecord([0, 1], [0, 1]), [1.0], 1.0), r"zeta = 1.0: .*\[0, 1\)"),
    (lambda: vi.response_spectrum(vi.ForceRecord([0, 1], [0, 1]), [1], clearance=0.0), "> 0"),
    (lambda: vi.response_spectrum(vi.ForceRecord([0, 1], [0, 1]), [1e-3]), "at least 0.01"),
    (lambda: vi.free_decay(DAMPER, {"v3": 1.0}), "x1 to x2"),
    (lambda: vi.free_decay(DAMPER, {"v2": 1.0}, remaining=1.0), "remaining = 1.0"),
    (lambda: vi.free_decay(DAMPER, {"x1": 0.0}), "away from rest"),
    (lambda: vi.sine_sweep(DAMPER, "omega", (1.2, 0.8)), "bounds"),
    (lambda: vi.sine_sweep(DAMPER, "omega", (0.8, 1.2), points=5, rate=1.0), "one of them"),
    (lambda: vi.sine_sweep(DAMPER, "omega", (0.8, 1.2), row="v1"), "coordinates"),
    (lambda: vi.sine_sweep(DAMPER, "omega", (0.8, 1.2), rate=1e-9), "at most 100000 steps"),
])  # fmt: skip
def test_misuse_names_the_value_and_what_to_do(call: Any, said: str) -> None:
    with pytest.raises(vi.InvalidParameterError, match=said):
        call()


# ---- response spectra ----------------------------------------------------------------------------


def test_spectrum_of_a_triangular_pulse_is_that_of_the_textbook() -> None:
    """Biggs: of an isosceles triangle of length T on an undamped oscillator, after the pulse,

    amplification = sin^2(w T / 4) 4 / (w T).
    """
    omega = np.array([0.5, 1.0, 2.0, 3.0])  # largest after the pulse, as w T < pi
    found = vi.response_spectrum(vi.ForceRecord([0.0, 0.5, 1.0], [0.0, 1.0, 0.0]), omega, 0.0)
    assert found.pseudo_acceleration == pytest.approx(
        8.0 * np.sin(omega / 4.0) ** 2 / omega, rel=1e-13
    )


def test_spectra_without_stops_are_those_of_oscillators_that_do_not_reach_them() -> None:
    time, values = noise(100, 0.1)
    time[60:] += 40.0  # a long straight piece, over which many cycles pass
    omega = np.array([0.3, 1.0, 4.0, 11.0])
    for kind in ("force", "base"):
        record = vi.ForceRecord(time, values, kind=kind)  # type: ignore[arg-type]
        closed = vi.response_spectrum(record, omega, 0.03)
        simulated = vi.response_spectrum(record, omega, 0.03, clearance=1e3)
        # two recursions over 200 pieces
        assert closed.displacement == pytest.approx(simulated.displacement, rel=1e-11)
        assert closed.acceleration == pytest.approx(simulated.acceleration, rel=1e-11)


def test_stops_bound_the_displacement_and_count_their_impacts() -> None:
    time, values = noise(100, 0.1)
    found = vi.response_spectrum(
        vi.ForceRecord(time, values), [0.1, 0.2], unit="Hz", clearance=0.1, lower_clearance=0.2
    )
    assert found.displacement == pytest.approx(
        [0.2, 0.2], abs=1e-11
    )  # rounding of the steep record
    assert (found.impacts > 3).all()
    assert (found.impulse > 0.0).all()
    assert found.to_dataset()["displacement"].dims == ("frequency",)


# ---- free decay ----------------------------------------------------------------------------------


def test_decay_without_impacts_is_that_of_the_damped_oscillator() -> None:
    decay = vi.free_decay(DAMPER, {"v1": 1.0}, remaining=0.2)
    zeta, wd = DAMPER.zeta, math.sqrt(1.0 - DAMPER.zeta**2)
    peaks = (math.atan2(wd, zeta) + math.pi * np.arange(10)) / wd
    sizes = np.exp(-zeta * peaks) * (-1.0) ** np.arange(10)
    found = decay.envelope_without
    assert found is not None
    assert found.value[:10] == pytest.approx(sizes, rel=1e-12)
    assert found.time[:10] == pytest.approx(peaks, abs=1e-7)  # flat there: the root of rounding
    t = decay.time_without  # the last time at which |x| is the level
    level = 0.2 * sizes[0]
    assert abs(math.exp(-zeta * t) * math.sin(wd * t) / wd) == pytest.approx(level, rel=1e-12)
    assert np.abs(found.value[found.time > t]).max() < level


def test_decay_with_impacts_stays_below_the_level_from_its_time_on() -> None:
    decay = vi.free_decay(DAMPER, {"v1": 1.0})
    level = decay.remaining * decay.reference
    times = np.linspace(0.0, decay.duration, 400_001)
    x = decay.run.at(times)[0][:, 0]
    assert times[np.abs(x) >= level][-1] == pytest.approx(
        decay.time, abs=1e-3
    )  # the samples' distance
    assert decay.time < 0.7 * decay.time_without
    assert abs(decay.energies.balance) < 1e-12 * decay.energies.start
    # every extremum of the samples is one of the envelope
    turns = np.flatnonzero(np.diff(np.sign(np.diff(x)))) + 1
    assert len(turns) == len(decay.envelope.time)
    assert decay.envelope.time == pytest.approx(times[turns], abs=2e-3)


def test_decay_in_si_units_is_the_nondimensional_one() -> None:
    decay = vi.free_decay(FRAME, {"v1": 0.5})
    length, rate = 400.0 / 303e3, math.sqrt(303e3 / 120.0)
    scaled = replace(
        DAMPER, mass_ratio=0.05, zeta=FRAME.zeta, restitution=0.5, half_clearance=0.003 / length
    )
    plain = vi.free_decay(scaled, {"v1": 0.5 / (length * rate)})
    assert decay.impacts == plain.impacts > 10
    assert decay.time == pytest.approx(plain.time / rate, rel=1e-9)
    assert decay.reference == pytest.approx(plain.reference * length, rel=1e-12)
    assert decay.energies.start == pytest.approx(120.0 * 0.5**2 / 2.0, rel=1e-12)


def test_a_machine_that_comes_to_rest_on_a_stop_is_measured_from_there() -> None:
    """A preloaded mass on a soft and one on a rigid stop, both with their rest known."""
    rigid = oscillator(vi.RigidStop((1.0,), lower=0.0, restitution=0.3), constant_force=(-1.0,))
    soft = oscillator(vi.SoftStop((1.0,), lower=0.0, stiffness=9.0), constant_force=(-1.0,))
    for machine, rest in ((rigid, 0.0), (soft, -0.1)):
        decay = vi.free_decay(machine, {"x1": 0.5})
        assert decay.rest == pytest.approx(rest, abs=1e-12)
        assert decay.reference == pytest.approx(1.5, rel=1e-12)  # from -1 without stops
        assert decay.time < decay.time_without < math.inf


@pytest.mark.parametrize("machine", [
    oscillator(vi.RigidStop((1.0,), -1.0, 1.0, restitution=0.3), zeta=-0.01),
    oscillator(vi.RigidStop((1.0,), lower=0.0, restitution=0.5), damping=[[0.0]], stiffness=[[0.0]],
               constant_force=(-1.0,)),
])  # fmt: skip
def test_what_grows_or_falls_without_stops_is_compared_with_itself(machine: vi.Mechanism) -> None:
    decay = vi.free_decay(machine, {"x1": 0.5})
    assert math.isnan(decay.time_without)
    assert 0.5 <= decay.reference <= 1.0 + 1e-12


@pytest.mark.parametrize(("machine", "start"), [
    (replace(DAMPER, half_clearance=50.0), {"v1": 1.0}),  # no impact
    (replace(DAMPER, zeta=0.0, half_clearance=50.0), {"x1": 1.0}),  # never falls
    (oscillator(vi.RigidStop((1.0,), lower=0.0, restitution=0.3), constant_force=(-1.0,)), {"x1": 0.5}),
    (oscillator(vi.Friction((1.0,), 0.1)), {"x1": 2.0}),
])  # fmt: skip
def test_decays_that_end_in_other_ways_are_results(machine: Any, start: dict[str, float]) -> None:
    decay = vi.free_decay(machine, start, rest=0.0)
    if isinstance(machine, vi.ImpactDamper):
        assert decay.impacts == 0
        assert decay.time == decay.time_without or decay.time == pytest.approx(decay.time_without)
        assert math.isinf(decay.time) == (machine.zeta == 0.0)
    elif machine.rigid_stops:
        assert decay.resting == (0,)  # chatter, then rest
        assert decay.energies.end == pytest.approx(0.0, abs=1e-12)
    else:  # each half cycle takes 2 kinetic from the amplitude, which is below 10 % at last
        assert decay.time < decay.time_without
    assert "FreeDecay" in repr(decay)


# ---- sine sweeps ---------------------------------------------------------------------------------


def test_a_sweep_is_the_motion_whose_frequency_steps_at_whole_periods() -> None:
    swept = vi.sine_sweep(
        DAMPER, "omega", (0.8, 1.1), points=4, periods_per_step=3, way="both", progress=False
    )
    state = vi.State((0.0, 0.0), (0.0, 0.0))
    ways = (swept.values, swept.values[::-1])
    for row, values in enumerate(ways):
        peaks = []
        for omega in values:
            machine, end = replace(DAMPER, omega=omega), 3 * 2.0 * math.pi / omega
            run = vi.simulate(machine, state, impacts=10_000, t_max=end)
            peaks.append(np.abs(run.at(np.linspace(0.0, end * (1 - 1e-15), 20_001))[0][:, 0]).max())
            state = run.last
        found = swept.peak[row] if row == 0 else swept.peak[row][::-1]
        # a sampled peak is below the exact one by (omega h)^2 / 8 = 1e-7 of it
        assert found == pytest.approx(peaks, rel=1e-6)


def test_a_slow_sweep_of_a_linear_machine_gives_its_resonance_curve() -> None:
    wide = replace(DAMPER, half_clearance=1e3)
    swept = vi.sine_sweep(
        wide, "omega", (0.7, 1.4), points=15, periods_per_step=2000, progress=False
    )
    w, z = swept.values, wide.zeta
    curve = 1.0 / np.hypot(1.0 - w * w, 2.0 * z * w)
    # the change from the step before dies out in 1 / (zeta w), 1/250 of a step: twice that at most of
    # the mean square, for a change as large as the motion itself
    amplitude = swept.quantity("rms").values * math.sqrt(2.0)
    assert amplitude == pytest.approx(np.tile(curve, (2, 1)), rel=0.02)
    assert swept.hysteresis.shape == w.shape


def test_a_rate_sets_steps_whose_mean_rate_it_is() -> None:
    band, rate = (7.0, 9.0), 0.05  # Hz, Hz/s
    swept = vi.sine_sweep(FRAME, "omega", band, unit="Hz", rate=rate, way="up", progress=False)
    assert swept.duration == pytest.approx((band[1] - band[0]) / rate, rel=0.05)  # whole steps
    begin = swept.to_dataset()["time"].values[0]
    assert begin[:-1] * rate == pytest.approx(swept.values[:-1] - band[0], rel=1e-9)
    octaves = vi.sine_sweep(
        FRAME, "omega", band, unit="Hz", rate=0.01, spacing="log", way="up", progress=False
    )
    begin = octaves.to_dataset()["time"].values[0]
    assert begin[:-1] * 0.01 == pytest.approx(np.log2(octaves.values[:-1] / band[0]), rel=1e-9)


# ---- pictures ------------------------------------------------------------------------------------


@pytest.mark.usefixtures("no_windows")
def test_pictures_of_transients_have_units_and_all_curves() -> None:
    time, values = noise(50, 0.02, size=5.0)
    record = vi.ForceRecord(time, values, kind="base")
    response = vi.simulate_record(FRAME, record)
    assert response.plot("x2 - x1").get_ylabel() == "$x_{2} - x_{1}$ [mm]"
    assert record.plot().get_ylabel() == "$a$"
    decay = vi.free_decay(FRAME, {"v1": 0.5})
    ax = decay.plot()
    assert ax.get_xlabel() == "time $t$ [s]"
    assert any(text.get_text().startswith("without impacts: ") for text in ax.get_legend().texts)
    swept = vi.sine_sweep(FRAME, "omega", (6.0, 8.0), unit="Hz", points=5, progress=False)
    ax = swept.plot()
    assert ax.get_xlabel() == "forcing frequency $f$ [Hz]"
    assert np.asarray(ax.get_lines()[1].get_ydata()) == pytest.approx(swept.peak[1])
    spectrum = vi.response_spectrum(record, [1.0, 2.0, 5.0], unit="Hz")
    assert np.asarray(spectrum.plot().get_lines()[0].get_ydata()) == pytest.approx(
        spectrum.pseudo_acceleration
    )
    assert response.to_dataset()["peak"].values[0] == response.peak()
    assert decay.to_dataset()["time_to_fall"].item() == decay.time


def test_a_spectrum_without_a_number_is_printed() -> None:
    record = vi.ForceRecord([0.0, 1.0], [0.0, 1.0])
    found = vi.response_spectrum(record, [1.0])
    assert "nan" in repr(replace(found, displacement=np.array([np.nan])))
