"""Misprinted equations of the paper: printed and corrected form, and the residual of each.

`misprints()` is the table. Each residual is evaluated at a case, by default `default_case()`; rows
on the normal form use maps with planted coefficients and ignore the case.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable
from dataclasses import dataclass

import vibroimpact as vi
from vibroimpact_papers.impact_damper import normal_form_residuals as normal_form
from vibroimpact_papers.impact_damper import parameter_sets
from vibroimpact_papers.impact_damper.misprint_residuals import (
    Case,
    Letters,
    contact_corrected,
    contact_printed,
    crossing,
    determinant,
    forced_response,
    h_printed,
    half_period_position,
    impact,
    initial_velocity,
    m_printed,
    momentum,
    momentum_at_s_zero,
    period_change,
    psi_printed,
    restitution,
    stiffness,
)

_PLANTED = "map with planted coefficients"


@dataclass(frozen=True, slots=True)
class Misprint:
    """One misprint, with the residual of the printed and of the corrected formula at a case."""

    where: str
    printed: str
    corrected: str
    why: str
    residual_printed: Callable[[Case], float]
    residual_corrected: Callable[[Case], float]
    case: str = "set A, omega = 1.2, stable orbit"


def default_case() -> Case:
    """Return set A at omega = 1.2, where the paper and we find a stable 1-1-1 orbit."""
    damper = vi.ImpactDamper(**dataclasses.asdict(parameter_sets()["A"].parameters), omega=1.2)
    return Case.of(damper)


def misprints() -> tuple[Misprint, ...]:
    """Return every misprint of sections 2 to 4 and of the appendix that changes a result."""
    return (*_model(), *_orbit(), *_perturbed_motion(), *_normal_form())


def _at(residual: Callable[[Letters], float]) -> Callable[[Case], float]:
    """Evaluate a residual of the paper's letters at a case."""
    return lambda case: residual(Letters.of(case))


def _model() -> tuple[Misprint, ...]:
    return (
        Misprint(
            "scaling before (3)",
            "omega_n = sqrt(K/M1), t = T sqrt(K/M1)",
            "t = T w0, x = M1 w0^2 X / F0, delta = M1 w0^2 D / (2 F0), any frequency w0",
            "the printed scaling makes the coefficient of x1 in (3) equal to 1, not omega_n^2",
            _at(lambda p: stiffness(p, 1)),
            _at(lambda p: stiffness(p, 1 / p.wn)),
        ),
        Misprint(
            "(8), A",
            "1/omega_n^2 (...)^(1/2)",
            "1 / (omega_n^2 (...)^(1/2))",
            "read from left to right the root multiplies; it divides",
            _at(lambda p: forced_response(p, 1 / (p.wn**4 * p.A), p.psi)),
            _at(lambda p: forced_response(p, p.A, p.psi)),
        ),
        Misprint(
            "(8), psi",
            "arctan(2 zeta gamma / (1 - gamma^2))",
            "atan2(2 zeta gamma, 1 - gamma^2)",
            "omega > omega_n in sets A and B: the lag lies between pi/2 and pi",
            _at(lambda p: forced_response(p, p.A, psi_printed(p))),
            _at(lambda p: forced_response(p, p.A, p.psi)),
        ),
    )


def _orbit() -> tuple[Misprint, ...]:
    return (
        Misprint(
            "(11), line 4",
            "x2(0) - x1'(0) = delta",
            "x2(0) - x1(0) = delta",
            "a velocity in place of a position",
            _at(lambda p: abs(p.x1 + p.delta - p.v1 - p.delta)),
            lambda case: abs(
                float(case.orbit.state.position[1] - case.orbit.state.position[0])
                - case.damper.half_clearance
            ),
        ),
        Misprint(
            "(11), line 5",
            "x2(pi/omega) - x1(pi/omega) = delta",
            "x2(pi/omega) - x1(pi/omega) = -delta",
            "line 1 gives x_i(pi/omega) = -x_i(0): the free mass is at the other stop",
            _at(lambda p: abs(-(p.x1 + p.delta) + p.x1 - p.delta)),
            _at(lambda p: abs(-(p.x1 + p.delta) + p.x1 + p.delta)),
        ),
        Misprint(
            "(12), a_k2",
            "(1 + m)(delta + A sin tau_0)",
            "(1 - m)(delta + A sin tau_0)",
            "contact: a_12 = x2(0) = x1(0) + delta",
            _at(lambda p: abs((1 + p.m) * p.X - p.x1 - p.delta)),
            _at(lambda p: abs((1 - p.m) * p.X - p.x1 - p.delta)),
        ),
        Misprint(
            "(13), b_k2",
            "d (1 + m)(delta + A sin tau_0)",
            "d (1 - m)(delta + A sin tau_0)",
            "the free mass goes from x2(0) to -x2(0) in pi/omega",
            _at(lambda p: abs(2 * (p.x1 + p.delta) - p.d * (1 + p.m) * p.X * math.pi / p.w)),
            _at(lambda p: abs(2 * (p.x1 + p.delta) - p.d * (1 - p.m) * p.X * math.pi / p.w)),
        ),
        Misprint(
            "(13), b_k1",
            "pi m n (delta + A sin tau_0)",
            "m n (delta + A sin tau_0)",
            "x1(pi/omega) = -x1(0)",
            _at(lambda p: half_period_position(p, math.pi * p.mn * p.X)),
            _at(lambda p: half_period_position(p, p.mn * p.X)),
        ),
        Misprint(
            "(14)",
            "tau_0 = arccos(...)",
            "cos tau_0 = (...), sin tau_0 = cos tau_0 / h - q, tau_0 by atan2",
            "arccos loses the quadrant: the minus sign has sin tau_0 < 0",
            lambda case: contact_printed(case.other_sign()),
            lambda case: contact_corrected(case.other_sign()),
            "set A, omega = 1.2, orbit with the minus sign",
        ),
        Misprint(
            "(15), m",
            "s mu d e1 / ((e1^2 + 2 c e1 + 1) eta omega_n - (s e1 d + c e1 + 1) mu)",
            "2 s mu d e1 / ((e1^2 + 2 c e1 + 1) eta omega_n + 2 s mu d e1)",
            "momentum at the impact: x1'(0) + x1'(pi/omega) + 2 mu x2'(0) = 0",
            _at(lambda p: momentum(p, m_printed(p))),
            _at(lambda p: momentum(p, p.m)),
        ),
        Misprint(
            "(15), h",
            "h = (mu - R)(...) ... / (pi omega (1 + R)) + ... / (d gamma)",
            "-(d (1-m)(1 - R - 2 mu R)/(1+R) + zeta omega_n m + eta omega_n m n) / omega",
            "restitution (6) at the impact",
            _at(lambda p: restitution(p, h_printed(p))),
            _at(lambda p: restitution(p, p.h)),
        ),
        Misprint(
            "(15), n",
            "n = (1 + c e1) / (s e1)",
            "m n = 2 mu d (1 + c e1) / ((e1^2 + 2 c e1 + 1) eta omega_n + 2 s mu d e1)",
            "n is infinite at s = 0, where the orbit and the product m n are regular",
            lambda _: math.inf,
            momentum_at_s_zero,
            "set A, omega = eta omega_n, where s = 0",
        ),
    )


def _perturbed_motion() -> tuple[Misprint, ...]:
    return (
        Misprint(
            "(18)",
            "Delta theta = omega (Delta t1 - Delta t2)",
            "Delta theta = omega (Delta t1 + Delta t2)",
            "the two flight times add up",
            lambda case: period_change(case, -1),
            lambda case: period_change(case, 1),
            "set A, omega = 1.2, stable orbit with x2' raised by 1 %",
        ),
        Misprint(
            "(19), b_11",
            "+ zeta omega_n sin(tau_0 + Delta tau), and only the last term over eta omega_n",
            "(x1' - A omega cos - zeta omega_n A sin + zeta omega_n x1) / (eta omega_n)",
            "x1'(0) = -zeta omega_n a_11 + eta omega_n b_11 + A omega cos; shown with the bracket",
            _at(lambda p: initial_velocity(p, 1.0)),
            _at(lambda p: initial_velocity(p, -p.A)),
        ),
        Misprint(
            "(20)",
            "coefficients of x1' and x2' exchanged in both rows; x2'+ before the impact",
            "the impact law (7); x2'-",
            "(20) must be (5) and (6)",
            _at(lambda p: impact(p, exchanged=True)),
            _at(lambda p: impact(p, exchanged=False)),
        ),
        Misprint(
            "(30), row 2",
            "df3/d(x2'), df4/d(tau)",
            "df2/d(x2'), df2/d(tau)",
            "det Df = R^4 exp(-4 pi zeta omega_n / omega) exactly",
            lambda case: determinant(case, as_printed=True),
            lambda case: determinant(case, as_printed=False),
        ),
        Misprint(
            "(A2), (B3)",
            "d|lambda_1| / dv > 0 with v = omega",
            "v = -omega at the upper points of sets A and B, and for set C",
            "the orbit is stable above the point: the modulus falls as omega grows",
            lambda case: crossing(case, 1),
            lambda case: crossing(case, -1),
            "set A, omega = 1.005 and 1.011",
        ),
    )


def _normal_form() -> tuple[Misprint, ...]:
    return (
        Misprint(
            "(37)",
            "phi + theta + f_3 r^3",
            "phi + theta + f_3 r^2",
            "z' = lambda z + c z^2 conj(z) turns by theta + Im(conj(lambda) c) r^2",
            lambda _: normal_form.angle(3),
            lambda _: normal_form.angle(2),
            _PLANTED,
        ),
        Misprint(
            "(39)",
            "(1 - 2 lambda_0) conj(lambda_0) g20 g11 / (2 (1 - lambda_0))",
            "(1 - 2 lambda_0) conj(lambda_0)^2 g20 g11 / (2 (1 - lambda_0))",
            "f_1 must not depend on a quadratic change of coordinates",
            lambda _: normal_form.first_coefficient(1),
            lambda _: normal_form.first_coefficient(2),
            _PLANTED,
        ),
        Misprint(
            "(A6)",
            "d^3 F_2, d^3 F_1 over two variables",
            "second derivatives",
            "G_10 is the coefficient of y_k z; a quadratic map has no third derivative",
            lambda _: normal_form.g10(third_derivatives=True),
            lambda _: normal_form.g10(third_derivatives=False),
            _PLANTED,
        ),
        Misprint(
            "(A7), order",
            "d^3 F_2, d^3 F_1 over two variables",
            "second derivatives",
            "G_01 is the coefficient of y_k conj(z)",
            lambda _: normal_form.g01(1, third_derivatives=True),
            lambda _: normal_form.g01(1, third_derivatives=False),
            _PLANTED,
        ),
        Misprint(
            "(A7), sign",
            "i (d^2 F_2 / dy_1 dy_k - d^2 F_1 / dy_2 dy_k)",
            "i (d^2 F_2 / dy_1 dy_k + d^2 F_1 / dy_2 dy_k)",
            "2 d/d conj(z) = d/dy_1 + i d/dy_2",
            lambda _: normal_form.g01(-1, third_derivatives=False),
            lambda _: normal_form.g01(1, third_derivatives=False),
            _PLANTED,
        ),
        Misprint(
            "(A10)",
            "-2 i d^2 F_k / dy_1 dy_2",
            "+2 i d^2 F_k / dy_1 dy_2",
            "H_02 belongs to conj(z)^2, as the conj(lambda)^2 of (A8) says; -2 i gives H_20",
            lambda _: normal_form.h02(-1),
            lambda _: normal_form.h02(1),
            _PLANTED,
        ),
    )
