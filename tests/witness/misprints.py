"""The paper's equations as printed and as they hold, evaluated in high precision.

Each entry measures both forms against something that is not the equation itself: the closed
form of the motion, the impact law, an exact determinant, a planted normal form. A residual is
the modulus of the difference; `holds` must vanish to working precision and `printed` must not.
Unless said otherwise the point is set A at omega = 1.2, on the stable orbit (plus sign of (14)).

Slips of notation without a residual of their own: (A1) conj(lambda_2) for conj(lambda_1); after
(18) "Equation (12)" for (18); (19) a prime too many in b_11, a dot missing in b_12; (25) a dot
on Delta x'_10; (27)-(29) v for v - v_c; the second condition of (16) follows from the first.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

from .damper import State, first_contact, flight, impact, paper_set
from .normal_form_slips import normal_form_entries
from .precision import Real, mp
from .symmetric import Orbit, coefficients, determinant, free_flow, half_jacobian, orbit


@dataclass(frozen=True)
class Misprint:
    """Residuals of one equation in both forms."""

    where: str
    what: str
    printed: Real
    holds: Real


@dataclass(frozen=True)
class Symbols:
    """The paper's abbreviations, corrected where they have to be."""

    e1: Real
    s: Real
    c: Real
    d: Real
    eta: Real
    m: Real
    n: Real
    Y: Real  # delta + A sin tau_0
    A: Real
    sin: Real
    cos: Real


def _orbit(sign: int = 1) -> Orbit:
    found = orbit(paper_set("A", "1.2"), sign)
    assert found is not None
    return found


@cache
def _symbols(sign: int = 1) -> Symbols:
    o = _orbit(sign)
    d, k = o.damper, coefficients(o.damper)
    eta = mp.sqrt(1 - d.zeta**2)
    angle = eta * d.omega_n * mp.pi / d.omega
    e1 = mp.exp(-mp.pi * d.zeta * d.omega_n / d.omega)
    s, c, dd = mp.sin(angle), mp.cos(angle), 2 * d.omega / mp.pi
    w = 2 * s * d.mass_ratio * dd * e1
    m = w / ((e1**2 + 2 * c * e1 + 1) * eta * d.omega_n + w)
    P, Q = d.apart.forced()
    sin = (P * o.state.s + Q * o.state.c) / k.amplitude
    cos = (P * o.state.c - Q * o.state.s) / k.amplitude
    Y = d.half_clearance + k.amplitude * sin
    return Symbols(e1, s, c, dd, eta, m, (1 + c * e1) / (s * e1), Y, k.amplitude, sin, cos)


def _entry(where: str, what: str, truth: Real, printed: Real, holds: Real) -> Misprint:
    return Misprint(where, what, abs(printed - truth), abs(holds - truth))


def conditions() -> list[Misprint]:
    """(11): at A the gap is one of positions; at B it is -delta."""
    o = _orbit()
    z, delta = o.state, o.damper.half_clearance
    far = flight(o.damper, z, o.half_period)
    return [
        _entry("(11)", "x2(0) - x1'(0) = delta for x2(0) - x1(0)", delta, z.x2 - z.v1, z.x2 - z.x1),
        _entry("(11)", "x2 - x1 = delta at pi/omega for -delta", far.x2 - far.x1, delta, -delta),
    ]


def forced_response() -> list[Misprint]:
    """psi and A against the motion: (k - omega^2 + 2 i sigma omega) A e^(-i psi) = 1."""
    d = paper_set("A", "1.2")
    g = d.omega / d.omega_n
    size = mp.hypot(1 - g**2, 2 * d.zeta * g)
    A = 1 / (d.omega_n**2 * size)
    stiffness = mp.mpc(d.omega_n**2 - d.omega**2, 2 * d.zeta * d.omega_n * d.omega)
    branch, quadrant = mp.atan(2 * d.zeta * g / (1 - g**2)), mp.atan2(2 * d.zeta * g, 1 - g**2)
    return [
        _entry(
            "psi",
            "arctan of a quotient for atan2",
            1,
            *(stiffness * A * mp.expj(-p) for p in (branch, quadrant)),
        ),
        _entry(
            "A",
            "1/omega_n^2 (...)^(1/2) for 1/(omega_n^2 (...)^(1/2))",
            abs(1 / stiffness),
            size / d.omega_n**2,
            A,
        ),
    ]


def constants() -> list[Misprint]:
    """(12), (13) against the initial state; the sine coefficient of x1 against its free part."""
    o, p = _orbit(), _symbols()
    P, Q = o.damper.apart.forced()
    z, d = o.state, o.damper
    h, dh = z.x1 - P * z.s - Q * z.c, z.v1 - d.omega * (P * z.c - Q * z.s)
    b11 = (dh + d.zeta * d.omega_n * h) / (p.eta * d.omega_n)
    swing = d.zeta * d.omega_n * p.A * p.sin
    loose = z.v1 - p.A * d.omega * p.cos + d.zeta * d.omega_n * p.sin
    return [
        _entry("(12)", "a_12 carries 1 + m for 1 - m", z.x2, (1 + p.m) * p.Y, (1 - p.m) * p.Y),
        _entry(
            "(13)",
            "b_12 carries 1 + m for 1 - m",
            z.v2,
            -p.d * (1 + p.m) * p.Y,
            -p.d * (1 - p.m) * p.Y,
        ),
        _entry(
            "(13)", "b_11 carries pi m n for m n", b11, mp.pi * p.m * p.n * p.Y, p.m * p.n * p.Y
        ),
        _entry(
            "(19)",
            "b_11: the sine term lacks -A, and only the last term is divided",
            b11,
            loose + z.x1 / p.eta * d.zeta,
            (z.v1 - p.A * d.omega * p.cos - swing + d.zeta * d.omega_n * z.x1)
            / (p.eta * d.omega_n),
        ),
    ]


def phase_and_slopes() -> list[Misprint]:
    """(14), (15) against the orbit solved from its conditions."""
    d, k, p = _orbit().damper, coefficients(_orbit().damper), _symbols()
    mu, R, g = d.mass_ratio, d.restitution, d.omega / d.omega_n
    m_true = -k.a / (1 - k.a)
    below = (p.e1**2 + 2 * p.c * p.e1 + 1) * p.eta * d.omega_n
    m_printed = p.s * mu * p.d * p.e1 / (below - (p.s * p.e1 * p.d + p.c * p.e1 + 1) * mu)
    h_printed = (
        (mu - R) * (d.omega * (1 + 2 * p.m) + mp.pi * p.m * (1 + 2 * p.c * p.e1))
        + mp.pi * p.m * p.n * (1 + mu)
    ) / (mp.pi * d.omega * (1 + R)) + (
        2 * p.m * p.e1 * (p.s * p.eta - p.c * d.zeta)
        - p.d * p.e1 * p.m * p.n * (p.s * d.zeta + p.c * p.eta)
    ) / (p.d * g)
    h_holds = -2 / mp.pi * (1 - p.m) * (1 - R - 2 * mu * R) / (1 + R) - p.m / g * (
        d.zeta + p.eta * p.n
    )
    minus = _symbols(-1)
    low = min((p, minus), key=lambda x: x.sin)
    return [
        _entry(
            "(14)",
            "arccos loses the quadrant",
            low.sin,
            mp.sin(mp.acos(low.cos)),
            low.cos / k.r - k.q,
        ),
        _entry("(15) m", "factor 2 and denominator", m_true, m_printed, p.m),
        _entry("(15) h", "does not satisfy the restitution law", k.r, h_printed, h_holds),
    ]


def singular_n() -> Misprint:
    """(15) n at s = 0, where the orbit is regular: m n has a limit and the system a solution."""
    d = paper_set("A", 1)
    eta = mp.sqrt(1 - d.zeta**2)
    d = paper_set("A", eta * d.omega_n)  # the free part turns by pi in half a period
    k, E = coefficients(d), free_flow(d, mp.pi / d.omega)
    e1 = mp.exp(-mp.pi * d.zeta * d.omega_n / d.omega)
    limit = 2 * d.mass_ratio * (2 * d.omega / mp.pi) * (1 - e1) / ((1 - e1) ** 2 * eta * d.omega_n)
    solved = (k.b + d.zeta * d.omega_n * k.a) / (eta * d.omega_n * (1 - k.a))
    spread = abs(E[0, 1])  # e1 s / (eta omega_n): what n divides by
    return Misprint(
        "(15) n",
        "singular at s = 0",
        mp.inf if spread < mp.mpf(10) ** -50 else spread,
        abs(limit - solved),
    )


def perturbed_map() -> list[Misprint]:
    """(18) and (20) on a perturbed motion, (30) by the determinant of the full map."""
    o = _orbit()
    d, z, T = o.damper, o.state, o.half_period
    shifted = State(
        z.x1 + mp.mpf("0.01"), z.v1, z.x2 + mp.mpf("0.01"), z.v2 + mp.mpf("0.02"), z.s, z.c
    )
    first = first_contact(d, shifted, t_max=9, from_stop="A")
    assert first is not None
    second = first_contact(d, impact(d, first.before), t_max=9, from_stop="B")
    assert second is not None
    dt1, dt2 = first.time - T, second.time - T
    end, total = second.before, flight(d, z, 2 * T)
    turned = mp.atan2(end.s * total.c - end.c * total.s, end.c * total.c + end.s * total.s)
    mu, R = d.mass_ratio, d.restitution
    one, two = (1 - mu * R) / (1 + mu), mu * (1 + R) / (1 + mu)
    after = impact(d, end)
    return [
        _entry(
            "(18)",
            "Delta t1 - Delta t2 for the sum",
            turned,
            d.omega * (dt1 - dt2),
            d.omega * (dt1 + dt2),
        ),
        _entry(
            "(20)",
            "coefficients of x1', x2' exchanged (row 1)",
            after.v1,
            two * end.v1 + one * end.v2,
            one * end.v1 + two * end.v2,
        ),
        _entry(
            "(20)",
            "coefficients of x1', x2' exchanged (row 2)",
            after.v2,
            ((mu - R) * end.v1 + (1 + R) * end.v2) / (1 + mu),
            ((1 + R) * end.v1 + (mu - R) * end.v2) / (1 + mu),
        ),
        _entry(
            "(20)",
            "x2' after the impact for before",
            after.v1,
            one * end.v1 + two * after.v2,
            one * end.v1 + two * end.v2,
        ),
        _derivative_matrix(o),
    ]


def _derivative_matrix(o: Orbit) -> Misprint:
    """(30): row 2 holds derivatives of f3 and f4 in its last columns; the determinant tells."""
    DH = half_jacobian(o)
    DP = DH * DH
    printed = DP.copy()
    printed[1, 2], printed[1, 3] = DP[2, 2], DP[3, 3]
    return _entry(
        "(30)", "row 2 has f3, f4 for f2", determinant(o.damper) ** 2, mp.det(printed), mp.det(DP)
    )


def printed_multipliers() -> list[Misprint]:
    """Section 5: the product of the printed multipliers against the exact determinant."""
    printed = {
        "A": ("0.99176", ("0.2730961", "0.9619876"), ("0.3047823", "0.2773642")),
        "B": ("0.976327", ("0.0000048", "1.000037"), ("0.2026327", "0.6311391")),
        "C": ("0.43186", ("1.0000031", "0.00000272"), ("0.2054234", "0.4398154")),
    }
    entries = []
    for name, (omega, *pairs) in printed.items():
        product = mp.mpf(1)
        for re, im in pairs:
            product *= mp.mpf(re) ** 2 + mp.mpf(im) ** 2
        damper = paper_set(name, omega)  # type: ignore[arg-type]
        found = orbit(damper, 1)
        assert found is not None
        DH = half_jacobian(found)
        entries.append(
            _entry(
                f"section 5, set {name}",
                "product of the multipliers",
                determinant(damper) ** 2,
                product,
                mp.det(DH * DH),
            )
        )
    return entries


def all_entries() -> list[Misprint]:
    """Every entry, in the order of the paper."""
    algebra = [Misprint(*e) for e in normal_form_entries()]
    return [
        *conditions(),
        *forced_response(),
        *constants(),
        *phase_and_slopes(),
        singular_n(),
        *perturbed_map(),
        *algebra,
        *printed_multipliers(),
    ]
