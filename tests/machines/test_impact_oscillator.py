"""The impact oscillator against closed forms: existence, multipliers, bifurcations, grazing, units.

Witness, without code of the library. With the forced response

    X = a cos(theta) + b sin(theta),  a = (1 - w^2) F / D,  b = 2 zeta w F / D,
    D = (1 - w^2)^2 + (2 zeta w)^2                                                          (1)

the free part y = x - X of an orbit with impacts of speed V at the phase phi of stop A has, from just
after one impact to just before the next, z = (y, y') -> E z with E = exp(A t). One impact per n
forcing periods, t = 2 pi n / w, at A alone, and the symmetric orbit, t = pi / w, which returns turned
(sign -1), have

    E z + (0, -(1 + e) V) sign = sign z   =>   z = V (p, q)                                 (2)
    s - p V = a cos(phi) + b sin(phi),   -(q + e) V / w = b cos(phi) - a sin(phi)           (3)
    (s - p V)^2 + ((q + e) V / w)^2 = F^2 / D:  a quadratic in V, a fold where both are one  (4)
    M = sign [[-e, 0], [-(1 + e) (s - F cos(phi)) / V, -e]] E,   det M = e^2 exp(-2 zeta t)  (5)

(5) in (x, v) from just after an impact to just after the next, by the saltation matrix: the free
acceleration at the stop is F cos(phi) - s - 2 zeta v, and its damping parts cancel. Period doubling:
1 + tr M + det M = 0.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from numpy.typing import NDArray
from scipy.linalg import expm
from scipy.optimize import brentq
from support.commands import opened

import vibroimpact as vi
from vibroimpact.cli import main as cli
from vibroimpact.machines.toml_file import read_case

pytestmark = pytest.mark.usefixtures("no_windows", "own_folder")

ROUNDING = 1e-11  # of a few 2 x 2 solves; orbits are solved to 1e-12 or better
ONE = vi.ImpactOscillator(zeta=0.05, omega=2.6, restitution=0.7, clearance=0.1)
TWO = vi.ImpactOscillator(zeta=0.03, omega=0.9, restitution=0.6, clearance=1.2, lower_clearance=1.2)
SI = {"M": 2.0, "K": 800.0, "C": 4.0, "F0": 10.0, "Omega": 50.0, "D": 0.003, "restitution": 0.7}


@dataclass(frozen=True)
class Witness:
    """An orbit of (2) to (5)."""

    phase: float
    speed: float
    matrix: NDArray[np.float64]

    @property
    def multipliers(self) -> NDArray[np.complex128]:
        values = np.linalg.eigvals(self.matrix).astype(complex)
        return values[np.lexsort((-values.imag, -np.abs(values).round(12)))]


def closed_form(
    o: vi.ImpactOscillator, *, n: int = 1, symmetric: bool = False
) -> tuple[float, list[Witness]]:
    """The discriminant of (4) and its solutions, the slower first."""
    w, e, s, F = o.omega, o.restitution, o.clearance, o.force
    D = (1.0 - w * w) ** 2 + (2.0 * o.zeta * w) ** 2
    a, b = (1.0 - w * w) * F / D, 2.0 * o.zeta * w * F / D
    t, sign = (math.pi / w, -1.0) if symmetric else (2.0 * math.pi * n / w, 1.0)
    E = expm(np.array([[0.0, 1.0], [-1.0, -2.0 * o.zeta]]) * t)
    p, q = np.linalg.solve(E - sign * np.eye(2), [0.0, sign * (1.0 + e)])
    A, B, C = p * p + ((q + e) / w) ** 2, -2.0 * s * p, s * s - F * F / D
    found = []
    if B * B >= 4.0 * A * C:
        for V in np.sort(np.roots([A, B, C])):
            up, across = s - p * V, -(q + e) * V / w
            phase = math.atan2(b * up - a * across, a * up + b * across)
            push = F * math.cos(phase) - s
            jump = np.array([[-e, 0.0], [(1.0 + e) * push / V, -e]])
            found.append(Witness(phase % (2.0 * math.pi), float(V), sign * jump @ E))
    return B * B - 4.0 * A * C, found


def found_by_library(
    o: vi.ImpactOscillator, witness: Witness, *, n: int = 1, symmetric: bool = False
) -> vi.Orbit:
    """The orbit that Newton's method finds near the witness, 1% away."""
    start = o.on_stop("A", v1=-o.restitution * witness.speed * 1.01, phase=witness.phase + 0.01)
    states = np.array([[*start.position, *start.velocity, start.phase]])
    duration = math.pi / o.omega if symmetric else n * o.period
    guess = vi.Guess(states, np.array([duration]))
    impacts = "AB" if symmetric else "A"
    return vi.find_orbit(o, guess, stops=impacts, cycles=n, symmetric=symmetric)


# ---- one stop ------------------------------------------------------------------------------------


@pytest.mark.parametrize("n", [1, 2, 3])
@pytest.mark.parametrize("share", [-0.6, 0.0, 0.5])
@pytest.mark.parametrize("zeta", [0.0, 0.05, 1.3])
def test_an_orbit_with_one_impact_is_that_of_the_closed_form(
    n: int, share: float, zeta: float
) -> None:
    """At a share of the amplitude of the forced response (4) has one positive solution."""
    omega = 2.6 * n
    size = 1.7 / math.hypot(1.0 - omega**2, 2.0 * zeta * omega)
    oscillator = replace(ONE, omega=omega, clearance=share * size, zeta=zeta, force=1.7)
    (witness,) = (one for one in closed_form(oscillator, n=n)[1] if one.speed > 0.0)
    orbit = found_by_library(oscillator, witness, n=n)
    assert orbit.converged
    assert orbit.symbol == f"{n}-1-0"
    assert orbit.states[0, 1] == pytest.approx(-0.7 * witness.speed, rel=ROUNDING)
    assert math.cos(orbit.states[0, 2] - witness.phase) == pytest.approx(1.0, abs=1e-14)
    np.testing.assert_allclose(orbit.multipliers, witness.multipliers, rtol=1e-9, atol=1e-9)


def test_the_product_of_the_multipliers_is_that_of_restitution_and_damping() -> None:
    for zeta, e, omega in ((0.0, 1.0, 2.6), (0.05, 0.7, 2.6), (0.2, 0.3, 3.1), (0.6, 0.9, 2.2)):
        oscillator = replace(ONE, zeta=zeta, restitution=e, omega=omega, clearance=0.0)
        (witness,) = (one for one in closed_form(oscillator)[1] if one.speed > 0.0)
        orbit = found_by_library(oscillator, witness)
        expected = e**2 * math.exp(-2.0 * zeta * oscillator.period)
        assert np.prod(orbit.multipliers).real == pytest.approx(expected, rel=1e-10)


@pytest.mark.slow
def test_a_branch_folds_and_doubles_its_period_where_the_closed_form_does() -> None:
    def doubling(omega: float) -> float:
        matrix = closed_form(replace(ONE, omega=omega))[1][-1].matrix
        return 1.0 + float(np.trace(matrix) + np.linalg.det(matrix))

    def fold(clearance: float) -> float:
        return closed_form(replace(ONE, clearance=clearance))[0]

    orbit = found_by_library(ONE, closed_form(ONE)[1][-1])
    branch = vi.continue_orbit(orbit, "omega", (2.2, 3.2), inadmissible=True)
    places = [p.parameter for p in branch.special_points if p.kind == "PD"]
    expected = [
        brentq(doubling, low, high, xtol=1e-14)
        for low, high in pairwise(np.linspace(2.2, 3.2, 400))
        if doubling(low) * doubling(high) < 0.0
    ]
    assert expected
    np.testing.assert_allclose(sorted(places), expected, rtol=1e-10)
    branch = vi.continue_orbit(orbit, "clearance", (0.0, 1.0), inadmissible=True)
    folds = [p.parameter for p in branch.special_points if p.kind == "SN"]
    assert folds == pytest.approx([brentq(fold, 0.0, 1.0, xtol=1e-14)], rel=1e-9)


def test_stability_is_that_of_the_motion() -> None:
    stable = replace(ONE, omega=2.1, clearance=0.0)
    witness = closed_form(stable)[1][-1]
    assert np.abs(witness.multipliers).max() < 1.0
    settled = vi.section(stable, stable.free_start(), points=1, settle_events=400)
    assert settled.last.velocity[0] == pytest.approx(-0.7 * witness.speed, rel=1e-9)


def test_the_first_impact_from_the_steady_motion_has_the_speed_of_the_closed_form() -> None:
    size = 1.0 / math.hypot(1.0 - 2.6**2, 0.1 * 2.6)  # zeta = 0.05
    lag = math.atan2(0.1 * 2.6, 1.0 - 2.6**2)
    for eps in (1e-1, 1e-4, 1e-7):
        near = replace(ONE, clearance=size * (1.0 - eps))
        run = vi.simulate(near, vi.State((-size,), (0.0,), lag + math.pi), impacts=1)
        speed = 2.6 * math.sqrt(size**2 - near.clearance**2)
        assert run.velocity_before[0, 0] == pytest.approx(speed, rel=1e-8)
        assert speed == pytest.approx(2.6 * size * math.sqrt(2.0 * eps), rel=eps)
    clear = replace(ONE, clearance=size * (1.0 + 1e-7))
    run = vi.simulate(clear, vi.State((-size,), (0.0,), lag + math.pi), impacts=1, t_max=200.0)
    assert not run.impacts.any()


def test_a_pressed_oscillator_bounces_to_rest_and_lets_go_with_the_force() -> None:
    """With slow forcing the mass rests on the stop while force cos(theta) > clearance."""
    pressed = vi.ImpactOscillator(zeta=0.1, omega=0.05, restitution=0.5, clearance=-0.3)
    run = vi.simulate(pressed, pressed.free_start(), impacts=400)
    kinds = {vi.Status(int(status)) for status in run.status}
    assert {vi.Status.CHATTER, vi.Status.RELEASE} <= kinds
    released = run.time[run.status == vi.Status.RELEASE]
    np.testing.assert_allclose(np.cos(0.05 * released), -0.3, rtol=1e-9)


# ---- two stops -----------------------------------------------------------------------------------


@pytest.mark.parametrize("omega", [0.9, 1.3])
def test_the_symmetric_orbit_is_that_of_the_closed_form(omega: float) -> None:
    oscillator = replace(TWO, omega=omega)
    witness = closed_form(oscillator, symmetric=True)[1][-1]
    orbit = found_by_library(oscillator, witness, symmetric=True)
    assert orbit.symbol == "1-1-1"
    assert orbit.symmetric
    assert orbit.states[0, 1] == pytest.approx(-0.6 * witness.speed, rel=ROUNDING)
    full = np.linalg.eigvals(witness.matrix @ witness.matrix)
    assert sorted(np.abs(orbit.multipliers)) == pytest.approx(sorted(np.abs(full)), rel=1e-9)
    product = 0.6**4 * math.exp(-2.0 * 0.03 * oscillator.period)
    assert np.prod(orbit.multipliers).real == pytest.approx(product, rel=1e-10)


def test_an_infinite_lower_clearance_is_no_stop() -> None:
    assert replace(TWO, lower_clearance=math.inf) == replace(TWO, lower_clearance=None)
    assert math.isinf(replace(TWO, lower_clearance=None).mechanism.rigid_stops[0].lower)


def test_starts_on_the_stops_are_where_the_stops_are() -> None:
    uneven = replace(TWO, lower_clearance=0.4)
    assert uneven.on_stop("A", v1=-1.0, phase=0.5) == vi.State((1.2,), (-1.0,), 0.5)
    assert uneven.on_stop("B", v1=1.0, phase=0.5) == vi.State((-0.4,), (1.0,), 0.5)
    assert uneven.free_start().position == pytest.approx((0.4,))
    with pytest.raises(vi.InvalidParameterError, match="Give lower_clearance"):
        ONE.on_stop("B", v1=1.0, phase=0.0)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"zeta": -0.1}, "zeta = -0.1: must be >= 0"),
        ({"omega": 0.0}, "omega = 0.0: must be > 0"),
        ({"restitution": 1.2}, r"restitution = 1.2: must be in \[0, 1\]"),
        ({"clearance": math.inf}, "clearance = inf: must be a finite number"),
        ({"lower_clearance": -1.2}, "their sum must be > 0"),
        ({"lower_clearance": -math.inf}, "lower_clearance = -inf: must be a finite number"),
        ({"force": 0.0}, "force = 0.0: must be > 0"),
        ({"si": 3}, "si = 3: must be True or False"),
        ({"omega_n": 0.0}, "omega_n = 0.0: must be"),
        ({"stiffness": 2.0}, "Give omega_n, or K to ImpactOscillator.from_physical"),
        ({"half_clearance": 1.0}, "Give clearance"),
    ],
)
def test_values_out_of_range_are_refused(change: dict[str, float], message: str) -> None:
    with pytest.raises(vi.InvalidParameterError, match=message):
        vi.ImpactOscillator(
            **({"zeta": 0.03, "omega": 0.9, "restitution": 0.6, "clearance": 1.2} | change)
        )


# ---- SI units ------------------------------------------------------------------------------------


def test_a_physical_oscillator_moves_as_the_mechanism_in_si_units() -> None:
    given = vi.ImpactOscillator.from_physical(**SI, D_lower=0.05)
    plain = vi.Mechanism(
        mass=[[2.0]], damping=[[4.0]], stiffness=[[800.0]],
        forces=(vi.Harmonic(50.0, (0.0,), (10.0,)),),
        elements=(vi.RigidStop((1.0,), -0.05, 0.003, 0.7),),
    )  # fmt: skip
    one = vi.simulate(given, vi.State((0.0,), (0.0,)), impacts=12)
    other = vi.simulate(plain, vi.State((0.0,), (0.0,)), impacts=12)
    np.testing.assert_allclose(one.time, other.time, rtol=1e-9)
    np.testing.assert_allclose(one.velocity_after, other.velocity_after, rtol=1e-8, atol=1e-12)


def test_a_physical_oscillator_moves_as_the_nondimensional_one() -> None:
    given = vi.ImpactOscillator.from_physical(**SI, D_lower=0.05)
    length, rate = 10.0 / 800.0, 20.0  # F0 / K, sqrt(K / M)
    scaled = vi.ImpactOscillator(
        zeta=given.zeta, omega=50.0 / rate, restitution=0.7, clearance=0.003 / length,
        lower_clearance=0.05 / length,
    )  # fmt: skip
    one = vi.simulate(given, given.free_start(), impacts=12)
    other = vi.simulate(scaled, scaled.free_start(), impacts=12)
    np.testing.assert_allclose(one.time * rate, other.time, rtol=1e-12)
    np.testing.assert_allclose(one.position, other.position * length, rtol=1e-10)
    np.testing.assert_allclose(one.velocity_after, other.velocity_after * length * rate, rtol=1e-10)


def test_the_command_line_takes_and_draws_si_units(capsys: pytest.CaptureFixture[str]) -> None:
    table = "\n".join(f"{name} = {value}" for name, value in SI.items())
    Path("si.toml").write_text(f"[impact-oscillator.physical]\n{table}\n")
    assert cli.main(["simulate", "--config", "si.toml", "--impacts", "40", "--out", "h.png"]) == 0
    assert "omega=50.0, restitution=0.7, clearance=0.003" in capsys.readouterr().out
    argv = [
        "sweep",
        "--config",
        "si.toml",
        "--over",
        "clearance=0.001,0.003",
        "--settle-periods",
        "5",
    ]
    assert cli.main([*argv, "--periods", "5", "--variable", "n", "--out", "s.svg"]) == 0
    assert "clearance 1 to 3 mm (2)" in capsys.readouterr().out
    assert "clearance $s$ [mm]" in _xlabel(vi.ImpactOscillator.from_physical(**SI))


def _xlabel(oscillator: vi.ImpactOscillator) -> str:
    from vibroimpact import plotting

    over = {"clearance": [0.001, 0.002]}
    found = vi.sweep(
        oscillator,
        over=over,
        start=oscillator.free_start(),
        settle_periods=5,
        periods=5,
        progress=False,
    )
    return plotting.plot_along(found, variable="n").get_xlabel()


# ---- everything takes it -------------------------------------------------------------------------

PARAMETERS = ["--zeta", "0.05", "--omega", "2.6", "--restitution", "0.7", "--clearance", "0.1"]


def test_the_command_line_takes_its_parameters_and_its_starts() -> None:
    argv = ["simulate", "impact-oscillator", *PARAMETERS, "--impacts", "20", "--out", "r.nc"]
    assert cli.main(argv) == 0
    expected = vi.simulate(ONE, ONE.free_start(), impacts=20)
    xr.testing.assert_identical(opened("r.nc"), expected.to_dataset())
    assert cli.main([*argv, "--on-stop", "A", "--velocity", "-1", "--phase", "0.3"]) == 0
    expected = vi.simulate(ONE, ONE.on_stop("A", v1=-1.0, phase=0.3), impacts=20)
    xr.testing.assert_identical(opened("r.nc"), expected.to_dataset())


def test_a_file_holds_it_and_an_option_changes_it(capsys: pytest.CaptureFixture[str]) -> None:
    Path("o.toml").write_text(
        "[impact-oscillator]\nzeta = 0.03\nomega = 0.9\nrestitution = 0.6\nclearance = 1.2\n"
        "lower_clearance = 1.2\n[start]\nposition = [0.0]\nvelocity = [0.5]\n"
    )
    assert read_case("o.toml").system == TWO
    for config in (["--config", "o.toml"], ["--config=o.toml"]):
        assert cli.main(["simulate", *config, "--lower-clearance", "0.4"]) == 0
        said = capsys.readouterr().out
        assert repr(replace(TWO, lower_clearance=0.4)) in said
        assert "velocity=(0.5,)" in said


def test_a_plane_starts_clear_of_the_stop_at_every_point() -> None:
    argv = ["plane", "impact-oscillator", *PARAMETERS[:2], *PARAMETERS[4:6]]
    argv += [
        "--over",
        "omega=2.4:2.8:3",
        "--over",
        "clearance=-0.5:0.5:3",
        "--settle-periods",
        "50",
    ]
    assert cli.main([*argv, "--periods", "20", "--out", "p.nc", "--out", "p.png"]) == 0
    found = opened("p.nc")
    start = vi.State((-1.5,), (0.0,))  # free at clearance -0.5, the lowest
    over = {"omega": np.linspace(2.4, 2.8, 3), "clearance": np.linspace(-0.5, 0.5, 3)}
    middle = replace(ONE, omega=2.6, clearance=0.0)
    expected = vi.plane(
        middle, over=over, start=start, settle_periods=50, periods=20, progress=False
    )
    xr.testing.assert_equal(found, expected)


@pytest.mark.slow
def test_basins_sections_diagrams_and_branches_are_computed_from_the_command_line(
    capsys: pytest.CaptureFixture[str],
) -> None:
    short = ["--settle-periods", "60", "--periods", "20"]
    for command in (
        [
            "basins",
            *PARAMETERS,
            "--over",
            "x1=-1:0:3",
            "--over",
            "v1=-1:1:3",
            "--settle-periods",
            "100",
        ],
        ["section", *PARAMETERS, "--points", "20"],
        ["diagram", *PARAMETERS[:2], *PARAMETERS[4:], "--over", "omega=2.5:2.7:3", *short],
        ["branch", *PARAMETERS, "--bounds", "omega=2.5:2.7"],
        ["branch", *PARAMETERS[:2], *PARAMETERS[4:], "--bounds", "omega=2.5:2.7"],
        ["orbits", *PARAMETERS, "--most-cycles", "1", "--most-impacts", "1", "--starts", "10"],
    ):
        assert cli.main([command[0], "impact-oscillator", *command[1:]]) == 0
        assert "ImpactOscillator(zeta=0.05, omega" in capsys.readouterr().out


def test_what_is_of_the_damper_alone_is_refused(capsys: pytest.CaptureFixture[str]) -> None:
    words = ["simulate", "impact-oscillator", *PARAMETERS]
    assert cli.main([*words, "--orbit", "plus"]) == cli.MISUSE
    assert "--orbit: is no option of vibroimpact simulate" in capsys.readouterr().err
    assert cli.main([*words, "--on-stop", "A", "--position", "0", "--velocity", "1"]) == cli.MISUSE
    assert "on_stop = A: needs --velocity V1." in capsys.readouterr().err
    assert cli.main(["simulate", "impact-oscillator", "--omega", "1"]) == cli.MISUSE
    message = capsys.readouterr().err
    assert "--zeta, --restitution, --clearance: missing. Give them, or --config." in message
    assert cli.main(["branch", "--multipliers", "impact-oscillator", "--bounds", "omega=1:2"]) == 2
    assert "must come before the options" in capsys.readouterr().err


def test_a_sweep_in_a_store_and_its_repetition_are_the_same_bits() -> None:
    pytest.importorskip("zarr")
    over = {"lower_clearance": [1.0, 1.2], "omega": [0.8, 0.9, 1.0]}
    window = {"settle_periods": 20.0, "periods": 20.0, "progress": False}
    start = TWO.free_start()
    found = vi.sweep(TWO, over=over, start=start, observe=["symbol", "lyapunov"], **window)
    kept = vi.sweep(
        TWO, over=over, start=start, observe=["symbol", "lyapunov"], store="s.zarr", **window
    )
    xr.testing.assert_identical(found, kept.load())
    vi.save(found, "s.nc")
    xr.testing.assert_identical(vi.rerun_sweep(opened("s.nc"), progress=False), found)


def test_a_search_finds_the_closed_form_orbits_and_a_branch_of_one_is_stored() -> None:
    found = vi.find_orbits(ONE, most_cycles=1, most_impacts=1, starts=40)
    speeds = [one.speed for one in closed_form(ONE)[1] if one.speed > 0.0]
    listed = [-orbit.states[0, 1] / 0.7 for orbit in found.orbits if orbit.symbol == "1-1-0"]
    assert max(listed) == pytest.approx(max(speeds), rel=1e-9)
    assert all(min(abs(one - known) for known in speeds) < 1e-9 for one in listed)
    orbit = next(o for o in found.orbits if o.symbol == "1-1-0")
    branch = vi.continue_orbit(orbit, "clearance", (0.0, 0.15))
    vi.save(branch, "b.nc")
    back = vi.load("b.nc")
    assert back.family.system == branch.family.system
    np.testing.assert_array_equal(back.multipliers, branch.multipliers)
