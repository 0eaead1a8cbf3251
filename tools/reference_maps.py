"""Tables of derivatives, normal forms and periodic orbits, for `reference_values.py`."""

from __future__ import annotations

import tomllib
from itertools import chain
from typing import TYPE_CHECKING

from reference_toml import (
    SHOWN,
    TESTS,
    gaps,
    header,
    mechanism_lines,
    numbers,
    table,
    text,
    texts,
)  # fmt: skip
from witness.bifurcations import torus_test
from witness.damper import paper_set
from witness.multilinear import form, stencil, step
from witness.periodic import (
    Orbit,
    determinant,
    inadmissible,
    monodromy,
    multipliers,
    phase,
    solve,
)  # fmt: skip
from witness.periodic_cases import Flight, Special, cases, flights, specials
from witness.periodic_damper import STATE, Torus, at_orbit, polished, torus
from witness.periodic_one_sided import Family
from witness.periodic_torus import orbit_torus
from witness.precision import decimal, digits, exact, mp
from witness.symmetric import orbit

if TYPE_CHECKING:
    from typing import Any

    from witness.multilinear import Map, Vector
    from witness.periodic_damper import Which

CARRIED = 135  # digits carried by derivatives; two step sizes agree to AGREE of them
AGREE = 40
EXPANDED = {  # symmetric orbits whose maps are expanded, and those where P is too
    "A": ("0.93", "1.01", "1.2"), "B": ("0.8", "0.95", "1.02"), "C": ("0.43", "0.448"),
}  # fmt: skip
ALSO_FULL = {("A", "1.2"), ("B", "0.8"), ("C", "0.448")}
PARAMETERS = ("omega", "half_clearance", "mass_ratio", "restitution", "zeta", "omega_n", "force")
ONE_SIDED = (  # omega, restitution, periods, sign of cos(phase), wall, guess of the speed
    ("3.7", "0.8", 2, 1, "0", "0.666", "0.151"),
    ("2.8", "0.8", 1, -1, "0", "0.336", "0.493"),
)


def forms(f: Map, point: Vector, requests: dict[str, Any]) -> dict[str, list[Vector]]:
    """The partial derivatives asked for, from two step sizes that must agree."""
    results = []
    for h in (step(), step() * 1000):
        s = stencil(f, point, h)
        results.append({k: list(form(s, *r).values()) for k, r in requests.items()})
    for name, vectors in results[0].items():
        pairs = zip(
            chain.from_iterable(vectors), chain.from_iterable(results[1][name]), strict=True
        )
        if any(abs(a - b) > mp.mpf(10) ** -AGREE * max(1, abs(a)) for a, b in pairs):
            raise RuntimeError(f"{name}: the step sizes disagree")
    return results[0]


def derivative_table() -> list[str]:
    """Derivatives of impact maps in phase space and by parameters."""
    out = header(
        "Central differences in 150 digits; two step sizes agree to 40.",
        "first, second, third: the partial derivatives, vectors of all components of the map,",
        "one for every sorted index: (0), (1), ..; (0, 0), (0, 1), .., (1, 1), ..; (0, 0, 0), ..",
        "",
        "damper: the map in (v1+, x1, v2+, theta) on stop A just after impact, x2 = x1 +",
        "half_clearance, at the fixed point `point`, a symmetric 1-1-1 orbit of the paper's set.",
        "half: to stop B, impact, then (x, v, theta) -> (-x, -v, theta - pi); full: both impacts,",
        "theta - 2 pi. Parameter derivatives hold the four coordinates fixed.",
        "by_NAME: d/dNAME; by_omega_first, by_omega_second: of first, second by omega;",
        "by_omega_omega: second derivative by omega.",
        "",
        "flight: the map (q, v, theta) -> the same after one impact, of a start on a stop, for",
        "q'' mass + q' damping + q stiffness = sine sin(theta) + cosine cos(theta). Derivatives",
        "are of the map of the whole space, q off the stop included. by: entries of the",
        "matrices (with their mirror images) and the derivative by each; by_first: of first.",
    )
    with digits(CARRIED):
        for name, omegas in EXPANDED.items():
            for omega in omegas:
                for which in ("half", "full") if (name, omega) in ALSO_FULL else ("half",):
                    out += ["", "[[damper]]", f'set = "{name}"', f'omega = "{omega}"', "sign = 1"]
                    out += [f'map = "{which}"', *damper_derivatives(name, omega, which)]
        for flight in flights():
            out += ["", "[[flight]]", f'name = "{flight.name}"', *flight_derivatives(flight)]
    return out


def damper_derivatives(name: str, omega: str, which: Which) -> list[str]:
    """Derivatives of the map of one orbit."""
    found = orbit(paper_set(name, omega), 1)
    s = at_orbit(found, which, PARAMETERS)
    by = {f"by_{p}": (0, (), (4 + i,)) for i, p in enumerate(PARAMETERS)}
    requests = {"first": (1, STATE), "second": (2, STATE), "third": (3, STATE), **by}
    requests |= {"by_omega_first": (1, STATE, (4,)), "by_omega_second": (2, STATE, (4,))}
    requests |= {"by_omega_omega": (0, (), (4, 4))}
    values = forms(s.f, s.z, requests)
    out = [f"point = {texts(s.z[:4])}"]
    for key, vectors in values.items():
        flat = len(requests[key]) == 3 and requests[key][0] == 0
        out += [f"{key} = {numbers(vectors[0])}"] if flat else table(key, vectors)
    return out


def flight_derivatives(f: Flight) -> list[str]:
    """Derivatives of one flight and impact."""
    size, place = len(f.start), range(len(f.start))
    requests = {"first": (1, place), "second": (2, place)}
    requests |= {"third": (3, place)} if size <= 3 else {}
    for i in range(len(f.parameters)):
        requests |= {f"by {i}": (0, (), (size + i,)), f"by_first {i}": (1, place, (size + i,))}
    values = forms(f.map(f.parameters), f.point(f.parameters), requests)
    image = f.map()(f.point())
    out = [*mechanism_lines(f.mechanism), f"gap = {gaps([f.gap])}", f"point = {texts(f.point())}"]
    out += [f"image = {texts(image)}"]
    for key in ("first", "second", "third"):
        out += table(key, values[key]) if key in values else []
    for i, (matrix, row, column) in enumerate(f.parameters):
        out += ["", "[[flight.by]]", f'entry = ["{matrix}", {row}, {column}]']
        out += [
            f"value = {numbers(values[f'by {i}'][0])}",
            *table("first", values[f"by_first {i}"]),
        ]
    return out


def normal_form_table() -> list[str]:
    """The coefficient of the Neimark-Sacker points, of half and full map."""
    out = header(
        "Neimark-Sacker points of the symmetric 1-1-1 orbits, coordinates (v1+, x1, v2+, theta).",
        "z -> nu z (1 + d |z|^2), x = x0 + 2 Re(z q), |q| = 1, <p, q> = 1, 0 < arg nu < pi: half",
        "map `d`, full map `d_full` (2 d or its conjugate). growth = d|nu|/d omega, turning =",
        "d arg nu/d omega; squared_radius = -growth / Re d = |z|^2 / (omega - omega_c): its sign",
        "is the side of the circle; ratio = Im d / Re d. No phase of q is chosen: |q_i| are given.",
        "orbit: the same for the period map of another orbit, after its first impact, on stop A.",
    )
    known = tomllib.loads((TESTS / "reference" / "bifurcations.toml").read_text("utf-8"))
    with digits(CARRIED):
        for p in known["bifurcation"]:
            if p["kind"] == "NS":
                damper = polished(
                    paper_set(p["set"], p["omega"]), p["sign"], p["omega"], torus_test
                )
                point = torus(damper, p["sign"], mp.mpc(*p["nu"]))
                out += ["", "[[torus]]", f'set = "{p["set"]}"', f"sign = {p['sign']}"]
                out += [f"omega = {text(damper.omega)}", *torus_lines(point)]
        case = next(s for s in specials() if s.kind == "NS")
        out += ["", "[[orbit]]", f'name = "{case.name}"', *orbit_torus_lines(case)]
    return out


def torus_lines(t: Torus) -> list[str]:
    """One Neimark-Sacker point."""
    d, nu = t.half.d, t.half.nu
    return [
        f"nu = {texts((nu.real, nu.imag))}",
        f"d = {numbers((d.real, d.imag))}",
        f"d_full = {numbers((t.full.d.real, t.full.d.imag))}",
        f'ratio = "{decimal(d.imag / d.real, SHOWN)}"',
        f'growth = "{decimal(t.growth, SHOWN)}"',
        f'turning = "{decimal(t.turning, SHOWN)}"',
        f'squared_radius = "{decimal(t.squared_radius, SHOWN)}"',
        f"q_moduli = {numbers(map(abs, t.half.q))}",
        f"supercritical = {str(t.supercritical).lower()}",
    ]


def orbit_torus_lines(case: Special) -> list[str]:
    """A Neimark-Sacker point of an orbit that is not symmetric."""
    t = orbit_torus(case, paper_set("A", 1))
    d, nu = t.form.d, t.form.nu
    return [
        'set = "A"',
        f"signature = {gaps(case.signature)}",
        f"omega = {text(t.omega)}",
        f"point = {texts(t.point)}",
        f"nu = {texts((nu.real, nu.imag))}",
        f"d = {numbers((d.real, d.imag))}",
        f'ratio = "{decimal(d.imag / d.real, SHOWN)}"',
        f'growth = "{decimal(t.growth, SHOWN)}"',
        f'turning = "{decimal(t.turning, SHOWN)}"',
        f'squared_radius = "{decimal(-t.growth / d.real, SHOWN)}"',
        f"q_moduli = {numbers(map(abs, t.form.q))}",
        f"supercritical = {str(d.real < 0).lower()}",
    ]


def periodic_table() -> list[str]:
    """Orbits that are not symmetric, or no damper's."""
    out = header(
        "orbit: signature of (contact, side) in the order of the impacts, over `cycles` forcing",
        "periods; times of the flights that lead to them; after: (q, v) after each, phases there;",
        "closing: the gap's rate just before. q, v, theta of the last impact start the period.",
        "determinant: of the period map, prod R^2 exp(-T tr(M^-1 C)).",
        "one_sided: x'' + x = cos(omega t), x <= wall, one impact of speed V in `periods`, from",
        "the closed form; fold and doubling: where, along the family of walls, multiplier +1, -1.",
        "special: where along a branch in `free` a multiplier is +1 (SN), -1 (PD), a pair has",
        "modulus 1 (NS), a gap's minimum within a flight is zero (GR), an impact speed is (V).",
        "grazing: the amplitude at which the COCO oscillator's steady motion touches its wall.",
    )
    for c in cases():
        o = solve(c.mechanism, c.signature, c.cycles, c.guess, c.times)
        if abs(mp.det(monodromy(o)) / determinant(o) - 1) > mp.mpf("1e-45"):
            raise RuntimeError(f"{c.name}: the determinant is wrong")
        out += ["", "[[orbit]]", f'name = "{c.name}"', *mechanism_lines(c.mechanism)]
        out += orbit_lines(o)
    for special in specials():
        out += ["", "[[special]]", f'name = "{special.name}"', f'kind = "{special.kind}"']
        out += [f'free = "{special.free}"', *special_lines(special)]
    for omega, restitution, periods, sign, wall, speed, doubling in ONE_SIDED:
        f = Family(omega, restitution, periods, sign)
        out += ["", "[[one_sided]]", f'omega = "{omega}"', f'restitution = "{restitution}"']
        out += [f"periods = {periods}", f'wall = "{wall}"', *family_lines(f, wall, speed, doubling)]
    for omega in ("1", "0.5", "1.2", "1.5"):
        w = exact(omega)
        graze = mp.hypot(1 - w**2, exact("0.1") * w)
        out += ["", "[[grazing]]", f'omega = "{omega}"', f"amplitude = {text(graze)}"]
    return out


def orbit_lines(o: Orbit) -> list[str]:
    """One periodic orbit."""
    mu, reason = multipliers(o), inadmissible(o)
    sign = {"lower": 1, "upper": -1}
    closing = [sign[side] * mp.fdot(map(exact, o.mechanism.contacts[c].row), b.v)
               for (c, side), b in zip(o.signature, o.before, strict=True)]  # fmt: skip
    return [
        f"signature = {gaps(o.signature)}", f"cycles = {o.cycles}", f"times = {texts(o.times)}",
        "after = [", *(f"  {texts([*z.q, *z.v])}," for z in o.after), "]",
        f"phases = {texts(map(phase, o.after))}",
        f"closing = {texts(closing)}",
        f"multipliers_real = {texts(x.real for x in mu)}",
        f"multipliers_imag = {texts(x.imag for x in mu)}",
        f"determinant = {text(determinant(o))}",
        f"stable = {str(abs(mu[0]) < 1).lower()}",
        f"admissible = {str(reason is None).lower()}",
    ]  # fmt: skip


def special_lines(s: Special) -> list[str]:
    """One special point: the system, with the parameter at its value, and the orbit."""
    value, o = s.found()
    mu = multipliers(o) if s.kind != "V" else []  # a vanishing speed has none
    last = o.after[-1]
    return [
        f"value = {text(value)}", *mechanism_lines(o.mechanism),
        f"signature = {gaps(o.signature)}", f"cycles = {o.cycles}", f"times = {texts(o.times)}",
        f"last = {texts([*last.q, *last.v])}", f"phase = {text(phase(last))}",
        f"multipliers_real = {texts(x.real for x in mu)}",
        f"multipliers_imag = {texts(x.imag for x in mu)}",
    ]  # fmt: skip


def family_lines(f: Family, wall: str, speed: str, doubling: str) -> list[str]:
    """An orbit of a one-sided oscillator and the special points of its family."""
    V, (fold_sign, fold) = f.speed(wall, speed), f.fold()
    at_fold, V_double = (
        Family(f.omega, f.restitution, f.periods, fold_sign),
        f.doubling_speed(doubling),
    )
    mu = f.multipliers(V)
    return [
        f"speed = {text(V)}", f"phase = {text(f.phase(V))}",
        f"multipliers_real = {texts(x.real for x in mu)}",
        f"multipliers_imag = {texts(x.imag for x in mu)}",
        f"fold_speed = {text(fold)}", f"fold_wall = {text(at_fold.wall(fold))}",
        f"doubling_speed = {text(V_double)}", f"doubling_wall = {text(f.wall(V_double))}",
    ]  # fmt: skip
