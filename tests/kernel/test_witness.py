"""The high-precision references, checked against identities and against other people's values."""

from __future__ import annotations

import tomllib
from dataclasses import replace
from pathlib import Path
from random import Random

import pytest
from witness import damper as dm
from witness import mechanism as mc
from witness import misprints, symmetric
from witness.precision import digits, exact, mp

REFERENCE = Path(__file__).parents[1] / "reference"
TIGHT = mp.mpf(10) ** -48  # 50 digits, less what a few flights lose


def table(name: str) -> dict:
    return tomllib.loads((REFERENCE / f"{name}.toml").read_text(encoding="utf-8"))


def as_mechanism(d: dm.Damper) -> mc.Mechanism:
    return mc.Mechanism(
        mass=[[1, 0], [0, d.mass_ratio]],
        damping=[[2 * d.zeta * d.omega_n, 0], [0, 0]],
        stiffness=[[d.omega_n**2, 0], [0, 0]],
        lines=[mc.Line(d.omega, [d.force, 0], [0, 0])],
        contacts=[mc.Contact([-1, 1], -d.half_clearance, d.half_clearance, d.restitution)],
    )


def difference(a: dm.State, b: mc.State) -> mp.mpf:
    return max(abs(x - y) for x, y in zip((a.x1, a.x2, a.v1, a.v2), (*b.q, *b.v), strict=True))


ZETAS = ["0", "0.045", "0.99999999999999", "1", "1.00000000000001", "2.5"]


@pytest.mark.parametrize("zeta", ZETAS)
def test_closed_form_and_taylor_series_fly_alike(zeta: str) -> None:
    d = replace(dm.paper_set("A", "1.2"), zeta=exact(zeta))
    z = dm.state(1, "0.3", "0.5", "-0.2", phase="0.7")
    other = mc.state([1, "0.5"], ["0.3", "-0.2"], phases=["0.7"])
    assert difference(dm.flight(d, z, "7.3"), mc.flight(as_mechanism(d), other, "7.3")) < TIGHT


@pytest.mark.parametrize("zeta", ZETAS)
def test_derivative_bounds_hold_ever_after(zeta: str) -> None:
    d = replace(dm.paper_set("A", "1.2"), zeta=exact(zeta))
    m = dm.start(d.apart, mp.mpf(3), mp.mpf(-2), mp.mpf(0), mp.mpf(1))
    for order in (2, 3, 4):
        later = (abs(m.at(mp.mpf(k) / 4).derivative(order)) for k in range(80))
        assert max(later) <= m.bound(order)


def test_impacts_of_damper_and_mechanism_agree() -> None:
    d = dm.paper_set("A", "1.2")
    z = dm.state(1, "0.3", "0.5", "-0.2", phase="0.7")
    events = dm.simulate(d, z, 12)
    touches = mc.simulate(
        as_mechanism(d), mc.state([1, "0.5"], ["0.3", "-0.2"], phases=["0.7"]), 12
    )
    sides = {"lower": "B", "upper": "A"}
    assert [e.stop for e in events] == [sides[t.side] for t in touches]
    assert abs(events[-1].time - touches[-1].time) < mp.mpf(10) ** -45
    assert difference(events[-1].before, touches[-1].before) < mp.mpf(10) ** -45


def test_more_digits_change_nothing() -> None:
    z = dm.state(1, "0.25", "0.5", "-0.25", phase="0.75")
    times = []
    for count in (50, 80):
        with digits(count):
            times.append(dm.simulate(dm.paper_set("B", "0.96"), z, 10)[-1].time)
    assert abs(times[0] - times[1]) < mp.mpf(10) ** -45


def test_impact_keeps_momentum_and_reverses_speed() -> None:
    d = dm.paper_set("C", "0.42")
    z = dm.state(1, "0.3", 7, "1.9", phase=1)
    after, mu, R = dm.impact(d, z), d.mass_ratio, d.restitution
    u = z.v2 - z.v1
    assert abs(after.v1 + mu * after.v2 - z.v1 - mu * z.v2) < TIGHT
    assert abs(after.v2 - after.v1 + R * u) < TIGHT
    energy = [(s.v1**2 + mu * s.v2**2) / 2 for s in (z, after)]
    assert abs(energy[1] - energy[0] + (1 - R**2) * mu / (1 + mu) * u**2 / 2) < TIGHT


def test_scaling_law_is_exact() -> None:
    d, k = dm.paper_set("B", "0.96"), mp.mpf("1.7")
    scaled = replace(
        d, omega_n=k * d.omega_n, omega=k * d.omega, half_clearance=d.half_clearance / k**2
    )
    z = dm.state(1, "0.3", "0.5", "-0.2", phase="0.7")
    z2 = dm.State(z.x1 / k**2, z.v1 / k, z.x2 / k**2, z.v2 / k, z.s, z.c)
    for e, f in zip(dm.simulate(d, z, 10), dm.simulate(scaled, z2, 10), strict=True):
        assert e.stop == f.stop
        assert abs(f.time * k - e.time) < mp.mpf(10) ** -44


def first_peak(d: dm.Damper, z: dm.State) -> tuple[mp.mpf, mp.mpf]:
    """Time and height of the first maximum of x2 - x1."""

    def rate(t: mp.mpf) -> mp.mpf:
        s = dm.flight(d, z, t)
        return s.v2 - s.v1

    low = next(
        t for t in (mp.mpf(i) / 50 for i in range(1, 500)) if rate(t) > 0 > rate(t + mp.mpf("0.02"))
    )
    t = mp.findroot(rate, (low, low + mp.mpf("0.02")), solver="anderson", tol=mp.mpf(10) ** -120)
    s = dm.flight(d, z, t)
    return t, s.x2 - s.x1


@pytest.mark.parametrize("k", [1, 5, 13, 25, 40])
def test_near_grazing_is_decided(k: int) -> None:
    d = dm.paper_set("A", "1.2")
    z = dm.state(1, "0.3", 1, "0.3", phase="0.7")
    t, height = first_peak(d, z)
    small = mp.mpf(10) ** -k
    hit = dm.first_contact(replace(d, half_clearance=height - small), z, t_max=t + 1)
    assert hit is not None
    assert hit.stop == "A"
    assert 0 < t - hit.time < 3 * mp.sqrt(small)
    missed = dm.first_contact(
        replace(d, half_clearance=height + small), z, t_max=t + mp.mpf("0.01")
    )
    assert missed is None


def test_double_root_is_grazing() -> None:
    d = dm.paper_set("A", "1.2")
    z = dm.state(1, "0.3", 1, "0.3", phase="0.7")
    t, height = first_peak(d, z)
    touch = dm.first_contact(replace(d, half_clearance=height), z, t_max=t + 1)
    assert touch is not None
    assert touch.grazing
    assert abs(touch.time - t) < mp.mpf(10) ** -25


@pytest.mark.parametrize(
    "start", [(1.75, 0.75, 7.75, 0.6875, 2.6875), (2.25, 0.0, 8.25, -0.34375, 4.375)]
)
def test_chatter_ends_alike_wherever_it_is_completed(
    start: tuple[float, ...], monkeypatch: pytest.MonkeyPatch
) -> None:
    d = dm.paper_set("C", "0.4205")
    ends = []
    for speed in ("1e-17", "1e-20", "1e-24"):
        monkeypatch.setattr(dm, "CHATTER_SPEED", speed)
        events = dm.simulate(d, dm.state(*start[:4], phase=start[4]), 170, from_stop="A")
        ends.append(next(e for e in events if e.kind == "chatter"))
    for other in ends[1:]:  # the neglected terms are of order speed^3
        assert abs(other.time - ends[0].time) < mp.mpf(10) ** -45
        assert abs(other.after.v1 - ends[0].after.v1) < mp.mpf(10) ** -45


@pytest.mark.parametrize("case", table("chatter")["case"])
def test_stored_release_is_where_the_contact_force_vanishes(case: dict) -> None:
    values = table("chatter")["parameters"]
    d = dm.Damper(**values)
    sign = dm.SIGN[case["stop"]]
    time = mp.mpf(case["release_time"]) - mp.mpf(case["chatter_time"])
    x1, v1, x2, v2, s, c = map(mp.mpf, case["chatter_state"])
    begun = dm.state(x1, v1, x2, v2, phasor=(s, c))
    ended = dm.sticking(d, begun, time)
    forces = [
        sign * (d.force * z.s - 2 * d.zeta * d.omega_n * z.v1 - d.omega_n**2 * z.x1)
        for z in (begun, dm.sticking(d, begun, time / 2), ended)
    ]
    assert forces[0] > 0
    assert forces[1] > 0
    assert abs(forces[2]) < mp.mpf(10) ** -27  # 30 digits are stored
    stored = list(map(mp.mpf, case["release_state"]))
    assert (
        max(
            abs(a - b)
            for a, b in zip(
                stored, (ended.x1, ended.v1, ended.x2, ended.v2, ended.s, ended.c), strict=True
            )
        )
        < mp.mpf(10) ** -27
    )


ORBITS = [o for o in table("orbits")["orbit"] if o["exists"]]


@pytest.mark.parametrize("entry", ORBITS, ids=lambda o: f"{o['set']}{o['omega']}{o['sign']:+d}")
def test_orbits_return_to_themselves_with_the_exact_determinant(entry: dict) -> None:
    o = symmetric.orbit(dm.paper_set(entry["set"], entry["omega"]), entry["sign"])
    assert o is not None
    z = o.state
    stored = map(mp.mpf, entry["state"])
    assert all(
        abs(a - b) < mp.mpf(10) ** -27
        for a, b in zip(stored, (z.x1, z.v1, z.x2, z.v2, z.s, z.c), strict=True)
    )
    far = dm.flight(o.damper, z, o.half_period)
    after = dm.impact(o.damper, far)
    conditions = (
        after.x1 + z.x1,
        after.x2 + z.x2,
        after.v1 + z.v1,
        after.v2 + z.v2,
        z.s**2 + z.c**2 - 1,
    )
    assert max(map(abs, conditions)) < TIGHT
    ratio = mp.det(symmetric.half_jacobian(o)) / symmetric.determinant(o.damper)
    assert abs(ratio - 1) < TIGHT


@pytest.mark.parametrize(("name", "omega"), [("A", "1.2"), ("B", "1.0"), ("C", "0.448")])
def test_half_map_derivative_agrees_with_differences(name: str, omega: str) -> None:
    o = symmetric.orbit(dm.paper_set(name, omega), 1)
    assert o is not None
    point = [o.state.v1, o.state.x1, o.state.v2, o.state.phase]
    step, J = mp.mpf(10) ** -13, symmetric.half_jacobian(o)
    for j in range(4):
        values = [
            symmetric.half_map(o.damper, [p + k * step * (i == j) for i, p in enumerate(point)])
            for k in (-2, -1, 1, 2)
        ]
        for i in range(4):
            a, b, c, d = (v[i] for v in values)
            assert abs((8 * (c - b) - (d - a)) / (12 * step) - J[i, j]) < mp.mpf(10) ** -40


@pytest.mark.parametrize(
    "point",
    table("bifurcations")["bifurcation"],
    ids=lambda p: f"{p['set']}-{p['kind']}-{p['omega'][:7]}",
)
def test_stored_bifurcations_lie_on_the_unit_circle(point: dict) -> None:
    d = dm.paper_set(point["set"], point["omega"])
    if point["kind"] == "SN":
        assert abs(symmetric.coefficients(d).discriminant) < mp.mpf(10) ** -26
        return
    o = symmetric.orbit(d, point["sign"])
    assert o is not None
    nu = mp.mpc(*point["nu"])
    assert abs(abs(nu) - 1) < mp.mpf(10) ** -28
    nearest = min(symmetric.half_multipliers(o), key=lambda v: abs(v - nu))
    assert abs(nearest - nu) < mp.mpf(10) ** -25
    if point["kind"] == "NS":
        assert (float(point["growth"]) > 0) == (point["stable"] == "below")


def test_bouncing_ball_accumulates_where_it_should() -> None:
    ball = table("published")["bouncing_ball"]
    g, e = mp.mpf(ball["g"]), mp.mpf(ball["restitution"])
    m = mc.Mechanism(
        [[1]], [[0]], [[0]], contacts=[mc.Contact([1], 0, None, e)], constant_force=[-g]
    )
    touches = mc.simulate(m, mc.state([ball["h"]], [0]), 40)
    last = touches[-1]
    rest = 2 * e * -last.before.v[0] / (g * (1 - e))
    assert abs(last.time + rest - 3 * mp.sqrt(2 / g)) < mp.mpf(10) ** -45
    assert abs(last.time + rest - mp.mpf(ball["accumulation"])) < mp.mpf(10) ** -18


def forced_oscillator(
    k: str, c: str, amplitude: mp.mpf, omega: str, wall: str, e: str
) -> mc.Mechanism:
    line = mc.Line(omega, [0], [amplitude])
    return mc.Mechanism([[1]], [[c]], [[k]], [line], [mc.Contact([1], None, wall, e)])


def test_coco_impact_oscillator_has_its_orbit_and_multiplier_product() -> None:
    p = table("published")["coco_impact_oscillator"]
    m = forced_oscillator(
        p["k"], p["c"], exact(p["amplitude"]), p["omega"], p["wall"], p["restitution"]
    )
    e, T = mp.mpf(p["restitution"]), 2 * mp.pi / mp.mpf(p["omega"])
    E = mc.transition(m, T)
    free = (E - mp.eye(2)) ** -1 * mp.matrix([0, -(1 + 1 / e)])  # free part per unit of v+
    size = exact(p["amplitude"]) / mp.mpf(p["c"])  # at resonance the response is size * sin(t)

    def phasor(v: mp.mpf) -> tuple[mp.mpf, mp.mpf]:
        return (1 - free[0] * v) / size, v * (1 - free[1]) / size

    v = mp.findroot(
        lambda v: sum(x * x for x in phasor(v)) - 1, mp.mpf(p["printed_velocity_after"])
    )
    start = mc.state([p["wall"]], [v], phasors=[phasor(v)])
    touch = mc.first_contact(m, start, t_max=100, leaving=(0, "upper"))
    assert touch is not None
    assert abs(touch.time - T) < mp.mpf(10) ** -45
    assert abs(v - mp.mpf(p["printed_velocity_after"])) < mp.mpf("0.01")
    assert abs(mp.atan2(*phasor(v)) - mp.mpf(p["printed_phase"])) < mp.mpf("0.001")
    product = mp.det(mc.saltation(m, touch.before, 0) * E)
    assert abs(product - e**2 * mp.exp(-mp.mpf(p["c"]) * T)) < mp.mpf(10) ** -45
    assert abs(product - mp.mpf(p["multiplier_product"])) < mp.mpf(10) ** -17


def steady_start(omega: str, amplitude: mp.mpf) -> tuple[mc.Mechanism, mc.State]:
    """The COCO oscillator on its periodic response, a quarter turn before its maximum."""
    p = table("published")["coco_impact_oscillator"]
    m = forced_oscillator(p["k"], p["c"], amplitude, omega, p["wall"], p["restitution"])
    w, c = mp.mpf(omega), mp.mpf(p["c"])
    response = amplitude / mp.mpc(1 - w**2, c * w)  # x = Re(response e^(i w t)), theta = w t
    theta = -mp.pi / 2 - mp.arg(response)
    return m, mc.state([0], [w * abs(response)], phases=[theta])


def test_coco_grazing_curve_separates_contact_from_none() -> None:
    p = table("published")["coco_grazing"]
    for omega, printed in zip(p["omega"], p["amplitude"], strict=True):
        w = mp.mpf(omega)
        amplitude = mp.sqrt((1 - w**2) ** 2 + (w / 10) ** 2)
        assert abs(amplitude - mp.mpf(printed)) < mp.mpf(10) ** -14
        for factor, touches in ((1 + mp.mpf(10) ** -20, True), (1 - mp.mpf(10) ** -20, False)):
            m, z = steady_start(omega, amplitude * factor)
            assert (mc.first_contact(m, z, t_max=mp.pi / w) is not None) == touches


def test_impact_speed_grows_as_a_square_root_past_grazing() -> None:
    p = table("published")["coco_grazing"]
    for small, ratio in zip(p["epsilon"], p["speed_ratio"], strict=True):
        eps = mp.mpf(small)
        m, z = steady_start("1", (1 + eps) / 10)
        touch = mc.first_contact(m, z, t_max=10)
        assert touch is not None
        assert (
            abs(touch.before.v[0] / mp.sqrt(2 * eps) - mp.mpf(ratio)) < eps**2 + mp.mpf(10) ** -12
        )


@pytest.mark.parametrize("i", [0, 1])
def test_budd_dux_orbits_return(i: int) -> None:
    p = {k: v[i] for k, v in table("published")["budd_dux"].items()}
    m = forced_oscillator("1", "0", mp.mpf(1), p["omega"], p["wall"], p["restitution"])
    w, speed = mp.mpf(p["omega"]), mp.mpf(p["speed"])
    start = mc.state(
        [p["wall"]], [-mp.mpf(p["restitution"]) * speed], phases=[w * mp.mpf(p["time"])]
    )
    touch = mc.first_contact(m, start, t_max=100, leaving=(0, "upper"))
    assert touch is not None
    assert abs(touch.time - 2 * mp.pi * p["periods"] / w) < mp.mpf(10) ** -12
    assert abs(touch.before.v[0] - speed) < mp.mpf(10) ** -12


def random_mechanism(n: int, random: Random) -> mc.Mechanism:
    """Positive mass and stiffness, non-proportional damping, two incommensurate lines."""

    def gram(shift: float) -> list[list[float]]:
        rows = [[random.gauss(0, 1) for _ in range(n)] for _ in range(n)]
        return [
            [sum(a * b for a, b in zip(r, s, strict=True)) + shift * (r is s) for s in rows]
            for r in rows
        ]

    contacts = [mc.Contact([1] + [0] * (n - 1), -0.5, 0.625, 0.75)]
    if n > 1:
        contacts.append(mc.Contact([1, -1] + [0] * (n - 2), None, 0.75, 0.5))
    damping = [[x / 16 for x in row] for row in gram(0)]
    lines = [mc.Line(1.125, [1] + [0] * (n - 1), [0.25] * n), mc.Line(0.7071, [0.5] * n, [0] * n)]
    return mc.Mechanism(gram(n), damping, gram(0), lines, contacts)


@pytest.mark.parametrize("n", [1, 2, 3, 6])
def test_determinant_identity_holds_for_random_mechanisms(n: int) -> None:
    m = random_mechanism(n, Random(n))  # noqa: S311
    touches = mc.simulate(m, mc.state([0.125] * n, [0.5] * n, phases=[0.25, 0.5]), 4, t_max=200)
    assert touches
    before, variation, product = mp.mpf(0), mp.eye(2 * n), mp.mpf(1)
    for t in touches:
        variation = (
            mc.saltation(m, t.before, t.contact) * mc.transition(m, t.time - before) * variation
        )
        before, product = t.time, product * exact(m.contacts[t.contact].restitution) ** 2
    trace = sum(m.blocks["C"][i][i] for i in range(n))
    assert abs(mp.det(variation) / (product * mp.exp(-trace * before)) - 1) < mp.mpf(10) ** -44


def test_impact_sequence_variation_agrees_with_differences() -> None:
    m = random_mechanism(2, Random(7))  # noqa: S311
    step = mp.mpf(10) ** -25
    touch = mc.first_contact(m, mc.state([0.125, 0.125], [0.5, 0.5], phases=[0.25, 0.5]), t_max=99)
    assert touch is not None
    T = touch.time + mp.mpf("0.01")

    def passed(q0: mp.mpf) -> mp.matrix:
        t = mc.first_contact(m, mc.state([q0, 0.125], [0.5, 0.5], phases=[0.25, 0.5]), t_max=99)
        assert t is not None
        z = mc.flight(m, mc.impact(m, t.before, t.contact), T - t.time)
        return mp.matrix(z.q + z.v)

    slope = (passed(exact(0.125) + step) - passed(exact(0.125) - step)) / (2 * step)
    chain = (
        mc.transition(m, T - touch.time)
        * mc.saltation(m, touch.before, touch.contact)
        * mc.transition(m, touch.time)
    )
    assert mp.norm(slope - chain[:, 0]) < mp.mpf(10) ** -35


@pytest.mark.parametrize("entry", misprints.all_entries(), ids=lambda e: f"{e.where} {e.what}")
def test_misprints_fail_and_corrections_hold(entry: misprints.Misprint) -> None:
    assert entry.holds < mp.mpf(10) ** -45
    assert entry.printed > mp.mpf(10) ** -3


@pytest.mark.parametrize("index", range(len(table("misprints")["misprint"])))
def test_stored_misprint_residuals_are_reproduced(index: int) -> None:
    stored, entry = table("misprints")["misprint"][index], misprints.all_entries()[index]
    assert (stored["where"], stored["what"]) == (entry.where, entry.what)
    printed = mp.mpf(stored["printed"])
    assert printed == entry.printed or abs(printed / entry.printed - 1) < mp.mpf(10) ** -11
