"""Normal forms at a touch: the discontinuity mapping, the linear map, and what follows, beside own simulations."""

from __future__ import annotations

import math
from dataclasses import replace
from functools import cache
from types import SimpleNamespace

import mpmath as mp
import numpy as np
import pytest
from scipy.linalg import expm

import vibroimpact as vi
from vibroimpact.branches.kinds import GR, ZERO
from vibroimpact.branches.touch import TouchedMap, jump_at
from vibroimpact.compile.prescribed import GAP_WATCH, End, compile_prescribed
from vibroimpact.normal_forms import ContactLaw, Refusal, Scenario, Touch
from vibroimpact.orbits.admissibility import Nearest

# ---- the zero-time discontinuity mapping ----------------------------------------------------------

MASS = ((2.0, 0.3), (0.3, 1.0))
DAMPING = ((0.5, -0.2), (-0.2, 0.3))
STIFFNESS = ((3.0, -1.0), (-1.0, 2.0))
FORCE = (-1.1, -0.8)
ROW = (1.0, -0.6)
LIMIT = 0.4
K, C, R = 3.0, 0.7, 0.6

LAWS = {
    "rigid": vi.RigidStop(ROW, upper=LIMIT, restitution=R),
    "spring": vi.SoftStop(ROW, upper=LIMIT, stiffness=K),
    "linear": vi.SoftStop(ROW, upper=LIMIT, stiffness=K, damping=C, law="linear"),
    "unilateral": vi.SoftStop(ROW, upper=LIMIT, stiffness=K, damping=C),
    "limited": vi.SoftStop(ROW, upper=LIMIT, stiffness=K, damping=C, law="limited"),
}
POWERS = {"rigid": 0.5, "spring": 1.5, "linear": 1.5, "unilateral": 1.0, "limited": 1.5}


def mechanism(law: str) -> vi.Mechanism:
    return vi.Mechanism(
        mass=MASS, damping=DAMPING, stiffness=STIFFNESS, constant_force=FORCE, elements=(LAWS[law],)
    )


def rates() -> tuple[np.ndarray, np.ndarray]:
    """A and b of y' = A y + b, y = (x, v), of the free flight."""
    M, Cm, Km, f = (np.array(one) for one in (MASS, DAMPING, STIFFNESS, FORCE))
    A = np.block(
        [[np.zeros((2, 2)), np.eye(2)], [-np.linalg.solve(M, Km), -np.linalg.solve(M, Cm)]]
    )
    return A, np.append(np.zeros(2), np.linalg.solve(M, f))


def touching_state() -> tuple[np.ndarray, float]:
    """A state with gap and rate zero, and the acceleration of the gap h = LIMIT - ROW x."""
    row = np.array(ROW)
    v = np.array([0.3, 0.5])  # ROW v = 0
    x = np.array([0.7, 0.5])  # ROW x = 0.4
    A, b = rates()
    y = np.concatenate([x, v])
    assert row @ x == pytest.approx(LIMIT)
    assert row @ v == pytest.approx(0.0, abs=1e-15)
    a = -row @ (A @ y + b)[2:]
    assert a > 0.5
    return y, float(a)


@cache
def jump(law: str) -> tuple[ContactLaw, np.ndarray]:
    m = mechanism(law)
    solved = SimpleNamespace(compiled=compile_prescribed(m), kept_in=(0, 1, 2, 3))
    end = End(0, 1, 0, GAP_WATCH if law == "rigid" else 0)
    lift = np.linalg.solve(np.array(MASS), -np.array(ROW))
    push = np.append(np.append(np.zeros(2), lift), 0.0)
    nothing = np.zeros(0)
    at = TouchedMap(
        solved, nothing, nothing, 0.0, touching_state()[1], push, float(-np.array(ROW) @ lift)
    )
    named, E = jump_at(at, end)
    return named, E[:4]


@pytest.mark.parametrize("law", LAWS)
def test_the_kernel_changes_a_passing_motion_by_the_leading_term(law: str) -> None:
    """(D(x) - x) / depth^q -> E with an error of the order depth^(1/2) or smaller."""
    A, b = rates()
    whole = np.zeros((5, 5))
    whole[:4, :4], whole[:4, 4] = A, b
    y0, a = touching_state()
    named, E = jump(law)
    assert named.power == POWERS[law]

    def free(y: np.ndarray, t: float) -> np.ndarray:
        return (expm(whole * t) @ np.append(y, 1.0))[:4]

    errors = []
    for depth in (1e-4, 1e-6):
        y = y0.copy()
        y[0] += depth  # ROW x = LIMIT + depth, and the rate stays zero
        tau = 4.0 * math.sqrt(2.0 * depth / a)
        before = free(y, -tau)
        run = vi.simulate(mechanism(law), vi.State(before[:2], before[2:]), t_max=2.0 * tau)
        x, v = run.at([2.0 * tau])[:2]
        back = free(np.concatenate([x[0], v[0]]), -tau)
        errors.append(np.abs((back - y) / depth**named.power - E).max() / np.abs(E).max())
    assert errors[1] < 0.02
    assert errors[0] / errors[1] > 8.0


@pytest.mark.parametrize("law", LAWS)
def test_fifty_digits_of_the_mapping_agree_with_the_leading_term(law: str) -> None:
    """The same by mpmath alone, at a depth of 1e-16: the rest is of the order 1e-8."""
    with mp.workdps(50):
        M, Cm, Km = (mp.matrix([list(r) for r in one]) for one in (MASS, DAMPING, STIFFNESS))
        r = mp.matrix(ROW)
        inverse = M**-1

        def field(k: float, c: float) -> mp.matrix:
            """Flow with spring and dashpot of the stop at work, of (x, v, 1)."""
            F = mp.zeros(5)
            F[0, 2] = F[1, 3] = 1
            stiff, damp = Km + k * r * r.T, Cm + c * r * r.T
            push = inverse * (mp.matrix(FORCE) + k * mp.mpf(LIMIT) * r)
            for i in range(2):
                for j in range(2):
                    F[2 + i, j] = -(inverse * stiff)[i, j]
                    F[2 + i, 2 + j] = -(inverse * damp)[i, j]
                F[2 + i, 4] = push[i]
            return F

        def flow(F: mp.matrix, y: mp.matrix, t: mp.mpf) -> mp.matrix:
            out, term = y.copy(), y.copy()
            for n in range(1, 20):  # |F t| is below 1e-7
                term = F * term * (t / n)
                out += term
            return out

        def time_of(value: object, F: mp.matrix, y: mp.matrix, guess: mp.mpf) -> mp.mpf:
            return mp.findroot(lambda t: value(flow(F, y, t)), guess, tol=mp.mpf(10) ** -80)  # type: ignore[operator]

        gap = lambda y: mp.mpf(LIMIT) - r[0] * y[0] - r[1] * y[1]  # noqa: E731
        closing = lambda y: r[0] * y[2] + r[1] * y[3]  # noqa: E731
        depth = mp.mpf(10) ** -16
        y = mp.matrix([mp.mpf(x) for x in (0.7, 0.5, 0.3, 0.5)] + [1])
        y[1] = (y[0] - mp.mpf(LIMIT) - depth) / mp.mpf(0.6)
        y[0] = mp.mpf(LIMIT) + depth + mp.mpf(0.6) * y[1]
        y[2] = mp.mpf(0.6) * y[3]
        free = field(0, 0)
        a = -(r.T * (free * y)[2:4])[0]
        T = mp.sqrt(2 * depth / a)
        t = time_of(gap, free, y, -T)
        z, spent = flow(free, y, t), t
        k, c = mp.mpf(K), mp.mpf(C)
        pressed = lambda y: k * -gap(y) + c * closing(y)  # noqa: E731
        behind = lambda y: k * -gap(y) - c * closing(y)  # noqa: E731
        parts: dict[str, list[tuple[mp.matrix, object, mp.mpf]]] = {
            "spring": [(field(k, 0), gap, 2 * T)],
            "linear": [(field(k, c), gap, 2 * T)],
            "unilateral": [(field(k, c), pressed, T), (free, gap, T)],
            # c s' is above k s, then between, then below - k s: forces 2 k s, k s + c s', 0
            "limited": [
                (field(2 * k, 0), behind, T),
                (field(k, c), pressed, mp.mpf(0)),
                (free, gap, T),
            ],
        }
        if law == "rigid":
            w = inverse * r / (r.T * inverse * r)[0]
            speed = closing(z)
            for i in range(2):
                z[2 + i] -= (1 + mp.mpf(R)) * w[i] * speed
        for F, until, guess in parts.get(law, []):
            t = time_of(until, F, z, guess)
            z, spent = flow(F, z, t), spent + t
        z = flow(free, z, -spent)
        named, E = jump(law)
        found = [float((z[i] - y[i]) / depth**named.power) for i in range(4)]
    np.testing.assert_allclose(found, E, atol=1e-7 * np.abs(E).max())


# ---- one degree of freedom: the linear map in closed form ------------------------------------------


def amplitude(zeta: float, omega: float) -> float:
    return 1.0 / math.hypot(1.0 - omega**2, 2.0 * zeta * omega)


def oscillator(zeta: float, omega: float, **more: float) -> vi.ImpactOscillator:
    return vi.ImpactOscillator(zeta=zeta, omega=omega, restitution=0.8, **more)


def frequency_of(leading: float, zeta: float) -> float:
    """Frequency at which the slower multiplier over a period is this one."""
    return 2.0 * math.pi * (zeta - math.sqrt(zeta**2 - 1.0)) / -math.log(leading)


def free_map(zeta: float, time: float) -> np.ndarray:
    """Flow of the free oscillator."""
    return expm(np.array([[0.0, 1.0], [-1.0, -2.0 * zeta]]) * time)


def point_at(orbit: vi.Orbit, parameter: str, value: float, **place: object) -> vi.BifurcationPoint:
    """A special point as a branch has it, without following one."""
    return vi.BifurcationPoint(
        record=GR if "nearest" in place else ZERO, label="", parameters={parameter: value}, problem=None, bounds=None,
        orbit=replace(orbit, parameter=parameter), test="", parameter=value, z=np.zeros(0), tangent=np.zeros(0),
        arclength=0.0, error=0.0, crossing=0, **place,
    )  # fmt: skip


def phase_of_touch(zeta: float, omega: float) -> float:
    """Of the largest displacement, under the force cos(theta)."""
    return math.atan2(2.0 * zeta * omega, 1.0 - omega**2)


@cache
def zero_speed(zeta: float, omega: float, parameter: str = "clearance") -> vi.BifurcationPoint:
    """The touch of the forced motion, as an orbit with one impact of speed zero."""
    A, period = amplitude(zeta, omega), 2.0 * math.pi / omega
    machine = oscillator(zeta, omega, clearance=A)
    guess = vi.Guess(np.array([[A, 0.0, phase_of_touch(zeta, omega)]]), np.array([period]))
    orbit = vi.find_orbit(machine, guess, stops=["A"], cycles=1)
    assert abs(orbit.linearised.rate[0]) < 1e-12
    return point_at(orbit, parameter, getattr(machine, parameter), segment=0)


def form_of(zeta: float, omega: float, parameter: str = "clearance") -> Touch:
    form = zero_speed(zeta, omega, parameter).normal_form
    assert isinstance(form, Touch)
    return form


@pytest.mark.parametrize(("zeta", "omega"), [(0.05, 0.8), (1.2, 1.8)])
def test_the_linear_map_is_the_exponential_of_the_free_oscillator(
    zeta: float, omega: float
) -> None:
    form, A = form_of(zeta, omega), amplitude(zeta, omega)
    np.testing.assert_allclose(form.linear, free_map(zeta, 2.0 * math.pi / omega), atol=1e-12)
    assert form.acceleration == pytest.approx(A * omega**2, rel=1e-9)
    np.testing.assert_allclose(form.gap, [-1.0, 0.0])
    np.testing.assert_allclose(form.jump, [0.0, -1.8 * math.sqrt(2.0 * A * omega**2)], rtol=1e-9)
    assert form.opening == pytest.approx(1.0)


def test_the_opening_over_frequency_is_that_of_the_amplitude() -> None:
    form = form_of(0.05, 0.8, "omega")
    h = 1e-5
    slope = (amplitude(0.05, form.at + h) - amplitude(0.05, form.at - h)) / (2.0 * h)
    assert form.opening == pytest.approx(-slope, rel=1e-7)


def test_the_speed_of_the_orbit_with_the_impact_grows_as_its_law_says() -> None:
    """Linear in dp, with an error in proportion to dp."""
    point = zero_speed(0.05, 0.8)
    added = point.normal_form.added()
    errors = []
    for dp in (-2e-3, -1e-3):
        near = vi.find_orbit(
            replace(point.orbit.system, clearance=point.parameter + dp), point.orbit
        )
        speed = float(np.abs(near.linearised.rate[0]))
        assert not near.stable
        errors.append(speed / (added.factor * abs(dp)) - 1.0)
    assert added.side == -1
    assert abs(errors[1]) < 2e-3
    assert errors[0] / errors[1] == pytest.approx(2.0, rel=0.05)


@pytest.mark.parametrize("turns", [3, 4])
def test_orbits_with_one_impact_in_several_turns_have_the_predicted_multipliers(turns: int) -> None:
    """In the middle of its window, which is in proportion to 0.15^(2 n): the error falls with it."""
    zeta, omega = 1.2, frequency_of(0.15, 1.2)
    form, A = form_of(zeta, omega), amplitude(zeta, omega)
    window = form.window(turns)
    assert window is not None
    assert (window.slow_end, window.fast_end) == ("PD", "touch")
    dp = -math.sqrt(window.low * window.high)
    machine = oscillator(zeta, omega, clearance=A + dp)
    run = vi.simulate(machine, vi.State((-0.1,), (0.0,)), t_max=300 * 2.0 * math.pi / omega)
    waits = np.round(np.diff(run.time[-10:-1]) * omega / (2.0 * math.pi))
    np.testing.assert_array_equal(waits, turns)
    orbit = vi.find_orbit(machine, run, stops=["A"], cycles=turns)
    (speed,) = form.speed(dp, turns)
    tolerance = 0.15 ** (turns - 1)
    assert np.abs(orbit.linearised.rate[-1]) == pytest.approx(speed, rel=tolerance)
    predicted = form.with_contact(speed**2 / (2.0 * form.acceleration), turns)
    assert orbit.multipliers[0].real == pytest.approx(predicted[0].real, rel=tolerance)


def test_the_windows_of_period_adding_tend_to_those_of_the_map_of_one_dimension() -> None:
    """Limits 3/4 and (1 - nu) / nu, in units of (c nu^n)^2: (7) and (3) solved by hand."""
    nu = 0.5
    form = form_of(1.2, frequency_of(nu, 1.2))
    n = 12
    window = form.window(n)
    assert window is not None
    unit = form.pushes(60)[-1] / nu**60 * nu**n
    u = (1.0 - nu) / nu
    assert -window.high * form.opening / unit**2 == pytest.approx(0.25 + 0.5, rel=1e-3)
    assert -window.low * form.opening / unit**2 == pytest.approx(u**2 + u, rel=1e-3)


@pytest.mark.parametrize(
    ("leading", "expected"),
    [(0.15, Scenario.OVERLAPPING), (0.5, Scenario.ADDING), (0.8, Scenario.CHAOS)],
)
def test_the_leading_multiplier_decides_the_scenario(leading: float, expected: Scenario) -> None:
    """And simulation does what it says: windows that overlap, or not, or irregular impacts of small speed."""
    zeta, omega = 1.2, frequency_of(leading, 1.2)
    form, A = form_of(zeta, omega), amplitude(zeta, omega)
    assert form.leading == pytest.approx(leading)
    assert form.returning == 0
    assert form.scenario is expected
    windows = {w.turns: w for w in form.windows(9)}
    if expected is Scenario.CHAOS:
        assert not {7, 8, 9} & set(windows)
        dp = -1e-5
        machine = oscillator(zeta, omega, clearance=A + dp)
        run = vi.simulate(
            machine, vi.State((A - 0.01,), (0.0,)), t_max=8000 * 2.0 * math.pi / omega
        )
        settled = slice(len(run.time) // 2, None)
        waits = np.round(np.diff(run.time[settled]) * omega / (2.0 * math.pi))
        assert len(np.unique(waits)) > 5
        fastest = np.abs(run.rate_before[settled]).max()
        assert fastest < 1.01 * form.speed_factor * math.sqrt(-dp)
        return
    overlap = windows[6].low < windows[5].high
    assert overlap == (expected is Scenario.OVERLAPPING)


def test_motions_leave_the_touch_where_a_later_turn_is_pushed_back() -> None:
    """Underdamped: gamma_3 < 0. A millionth beyond the touch impacts are finite, and are those predicted."""
    form = form_of(0.05, 0.8)
    assert form.returning == 3
    assert form.scenario is Scenario.LEAVES
    dp = -1e-8
    machine = oscillator(0.05, 0.8, clearance=amplitude(0.05, 0.8) + dp)
    run = vi.simulate(machine, vi.State((0.0,), (0.0,)), t_max=4000.0)
    assert np.abs(run.rate_before[-50:]).max() > 100.0 * form.speed_factor * math.sqrt(-dp)


def test_next_to_resonance_the_next_terms_give_the_speed_that_leading_ones_miss() -> None:
    """C L^2 E is small there: y^2 competes with the terms of (1a). What is left falls with dp."""
    form, errors = form_of(0.05, 0.8), []
    for dp in (-1e-2, -1e-3):
        machine = oscillator(0.05, 0.8, clearance=amplitude(0.05, 0.8) + dp)
        run = vi.simulate(machine, vi.State((0.0,), (0.0,)), t_max=4000.0)
        seen = np.abs(run.rate_before[-20:-1])
        assert np.ptp(seen) < 1e-9
        (speed,) = form.speed(dp, 2)
        assert seen[0] > 1.3 * form.speed_factor * math.sqrt(-dp)
        errors.append(abs(seen[0] / speed - 1.0))
    assert errors[0] < 1e-2
    assert errors[0] / errors[1] == pytest.approx(10.0, rel=0.3)


def test_the_mapping_with_its_next_terms_leaves_an_error_of_third_order() -> None:
    """The exact mapping of the oscillator, by mpmath alone, at a state of size s with a depth of size s^2."""
    form, kept = form_of(0.05, 0.8), 1.8
    left = []
    with mp.workdps(40):
        zeta, omega = mp.mpf("0.05"), mp.mpf("0.8")
        A = 1 / mp.sqrt((1 - omega**2) ** 2 + (2 * zeta * omega) ** 2)
        w = mp.sqrt(1 - zeta**2)

        def free(x: object, v: object, t: object) -> tuple[object, object]:
            e, c, s = mp.exp(-zeta * t), mp.cos(w * t), mp.sin(w * t)
            return e * (x * c + (v + zeta * x) / w * s), e * (v * c - (x + zeta * v) / w * s)

        for size in ("1e-2", "1e-3"):
            xi = [mp.mpf(size) * one for one in (mp.mpf("-0.3"), mp.mpf("0.7"))]
            dp = xi[0] - mp.mpf(size) ** 2
            gap = lambda t, xi=xi, dp=dp: A + dp - A * mp.cos(omega * t) - free(*xi, t)[0]  # noqa: E731
            rate = lambda t, xi=xi: A * omega * mp.sin(omega * t) - free(*xi, t)[1]  # noqa: E731
            least = mp.findroot(rate, xi[1] / (A * omega**2))
            y = mp.sqrt(-gap(least))
            met = mp.findroot(gap, least - y * mp.sqrt(2 / A) / omega)
            x, v = free(*xi, met)
            exact = free(x, v + mp.mpf(kept) * rate(met), -met)
            z = np.array([float(one) for one in xi])
            depth = -float(form.gap @ z) - form.opening * float(dp) + form._earlier(z)
            root = math.sqrt(depth)
            found = z + form.jump * root + root * form.cross @ z + depth * form.second
            left.append(
                [
                    root - float(y),
                    *(found - [float(one) for one in exact]),
                    form._met(root, z) + float(rate(met)),
                ]
            )
    ratios = np.abs(left[0]) / np.abs(left[1])
    assert np.all(ratios > 500.0)


def test_a_symmetric_orbit_is_looked_at_by_its_half_map() -> None:
    zeta, omega = 0.3, 0.8
    A = amplitude(zeta, omega)
    machine = oscillator(zeta, omega, clearance=A, lower_clearance=A)
    family = vi.Family(
        lambda gap: replace(machine, clearance=gap, lower_clearance=gap).mechanism, gap=A
    )
    guess = vi.Guess(np.array([[A, 0.0, phase_of_touch(zeta, omega)]]), np.array([math.pi / omega]))
    orbit = vi.find_orbit(family, guess, stops=["A", "B"], cycles=1, symmetric=True)
    assert orbit.symmetric
    form = point_at(orbit, "gap", A, segment=0).normal_form
    np.testing.assert_allclose(form.linear, -free_map(zeta, math.pi / omega), atol=1e-12)
    assert form.opening == pytest.approx(1.0)


# ---- soft stops -----------------------------------------------------------------------------------


@pytest.mark.parametrize("law", ["spring", "linear", "unilateral", "limited"])
def test_orbits_that_press_a_soft_stop_have_the_predicted_multipliers(law: str) -> None:
    """To the next order of the depth: a hundredth of it leaves a tenth or less of the error, relative to E."""
    zeta, omega, gap = 0.05, 0.8, amplitude(0.05, 0.8)
    damping = 0.0 if law == "spring" else 0.3
    family = lambda value: vi.Family(  # noqa: E731
        lambda at: vi.Mechanism(
            mass=[[1.0]], damping=[[2.0 * zeta]], stiffness=[[1.0]],
            forces=[vi.Harmonic(omega, (0.0,), (1.0,))],
            elements=[vi.SoftStop((1.0,), upper=at, stiffness=2.0, damping=damping,
                                  law="unilateral" if law == "spring" else law)],
        ),
        at=value,
    )  # fmt: skip
    errors = []
    for dp in (-1e-4, -1e-6):
        near = vi.find_orbit(family(gap + dp), vi.State((gap + dp,), (0.0,), 0.1))
        form = soft_form(near, family(gap), gap)
        added = form.added()
        assert (added.side, added.stable, near.stable) == (-1, True, True)
        depth = added.factor**2 * -dp / (2.0 * form.acceleration)
        assert np.abs(near.states[:, 1]).max() == pytest.approx(
            math.sqrt(2.0 * form.acceleration * depth), rel=0.02
        )
        effect = depth ** (form.power - 1.0)
        errors.append(np.abs(near.multipliers[0] - form.with_contact(depth)[0]) / effect)
    assert errors[0] / errors[1] > 8.0
    assert errors[1] < 0.01


def soft_form(near: vi.Orbit, family: vi.Family, gap: float) -> Touch:
    """Form at the touch from an orbit next to it, whose short flights take no time there."""
    period, m = 2.0 * math.pi / 0.8, len(near.durations)
    states = np.tile([gap, 0.0, phase_of_touch(0.05, 0.8)], (m, 1))
    longest = int(np.argmax(near.durations))
    states[longest + 1 :, 2] += 2.0 * math.pi
    orbit = replace(
        near,
        system=family,
        states=states,
        durations=np.where(near.durations > 1.0, period, 0.0),
        residual=0.0,
    )
    nearest = Nearest(0.0, 0, 1, longest, period, watch=0)
    form = point_at(orbit, "at", gap, nearest=nearest).normal_form
    assert isinstance(form, Touch), form
    assert form.opening == pytest.approx(1.0)
    return form


# ---- refusals, files ------------------------------------------------------------------------------


def test_an_orbit_that_touches_twice_is_refused_by_name() -> None:
    point = zero_speed(0.05, 0.8)
    once = point.orbit
    later = once.states + np.array([0.0, 0.0, 2.0 * math.pi])
    twice = replace(
        once, signature=once.signature.repeated(2), states=np.vstack([once.states, later]),
        durations=np.tile(once.durations, 2),
    )  # fmt: skip
    form = point_at(twice, "clearance", point.parameter, segment=0).normal_form
    assert isinstance(form, Refusal)
    assert "two touches at once" in form.reason


def test_a_parameter_that_does_not_move_the_touch_is_refused() -> None:
    """The restitution: the touching orbit has no impact."""
    point = zero_speed(0.05, 0.8)
    form = point_at(point.orbit, "restitution", 0.8, segment=0).normal_form
    assert isinstance(form, Refusal)
    assert "restitution does not move" in form.reason


def test_a_saved_normal_form_comes_back_and_has_a_dataset(tmp_path) -> None:
    form = form_of(1.2, 1.8)
    vi.save(form, tmp_path / "form.nc")
    again = vi.load(tmp_path / "form.nc")
    np.testing.assert_array_equal(again.linear, form.linear)
    assert again.law is form.law
    assert again.scenario is form.scenario
    data = form.to_dataset()
    assert data["linear"].dims == ("coordinate", "by")
    assert data.attrs["opening"] == form.opening


def test_the_map_itself_settles_on_the_windows_it_predicts() -> None:
    form = form_of(1.2, frequency_of(0.5, 1.2))
    for window in form.windows(6)[2:]:
        dp = -math.sqrt(window.low * window.high)
        struck = np.flatnonzero(form.impacts([dp], turns=10 * window.turns)[0])
        np.testing.assert_array_equal(np.diff(struck), window.turns)
