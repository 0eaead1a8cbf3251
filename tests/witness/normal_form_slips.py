"""The paper's section 4 and appendix, as printed and as they hold: algebra without a damper.

The coefficient (39) is measured on maps with a planted normal form

    N(z) = lambda z (1 + d |z|^2),  Phi = phi N phi^-1
    phi(z) = z + p z^2/2 + q z zbar + r zbar^2/2

whose radius obeys r -> r + Re(d) r^3, so f1 = -Re d whatever p, q, r. The appendix is measured on
a random polynomial map, whose coefficients of z, zbar and w are read off by substitution.
"""

from __future__ import annotations

from typing import Any

from .precision import Real, mp

Series = dict[tuple[int, int], Any]  # coefficients of z^i zbar^j
DEGREE = 3


def _product(f: Series, g: Series) -> Series:
    out: Series = {}
    for (i, j), a in f.items():
        for (k, m), b in g.items():
            if i + j + k + m <= DEGREE:
                out[i + k, j + m] = out.get((i + k, j + m), 0) + a * b
    return out


def _conjugate(f: Series) -> Series:
    return {(j, i): mp.conj(a) for (i, j), a in f.items()}


def _sum(*terms: tuple[Any, Series]) -> Series:
    out: Series = {}
    for factor, f in terms:
        for key, a in f.items():
            out[key] = out.get(key, 0) + factor * a
    return out


def _compose(f: Series, inner: Series) -> Series:
    """f(inner, conj inner), truncated."""
    out: Series = {}
    bar = _conjugate(inner)
    for (i, j), a in f.items():
        term: Series = {(0, 0): mp.mpc(1)}
        for factor in [inner] * i + [bar] * j:
            term = _product(term, factor)
        out = _sum((1, out), (a, term))
    return out


def planted_map(lam: Any, d: Any, p: Any, q: Any, r: Any) -> Series:
    """phi N phi^-1 to third order."""
    identity: Series = {(1, 0): mp.mpc(1)}
    bend: Series = {(2, 0): p / 2, (1, 1): q, (0, 2): r / 2}
    phi, inverse = _sum((1, identity), (1, bend)), identity
    for _ in range(DEGREE):  # inverse = z - bend(inverse), right to one more order each time
        inverse = _sum((1, identity), (-1, _compose(bend, inverse)))
    return _compose(_compose(phi, {(1, 0): lam, (2, 1): lam * d}), inverse)


def cubic_coefficient(f: Series, *, power: int) -> Real:
    """(39) with conj(lambda_0)^power in its first term: 1 as printed, 2 as it holds."""
    lam = f[1, 0]
    g20, g11, g02, g21 = 2 * f[2, 0], f[1, 1], 2 * f[0, 2], 2 * f[2, 1]
    bar = mp.conj(lam)
    first = (1 - 2 * lam) * bar**power / (2 * (1 - lam)) * g20 * g11
    return first.real + abs(g11) ** 2 / 2 + abs(g02) ** 2 / 4 - (bar * g21).real / 2


def planted_entry() -> tuple[str, str, Real, Real]:
    """(39) on a planted normal form."""
    d = mp.mpc("-0.7", "0.4")
    f = planted_map(
        mp.expj(mp.mpf("1.1")),
        d,
        mp.mpc("0.3", "-0.5"),
        mp.mpc("-0.2", "0.9"),
        mp.mpc("0.6", "0.1"),
    )
    residuals = [abs(cubic_coefficient(f, power=k) + d.real) for k in (1, 2)]
    return ("(39)", "conj(lambda_0) for its square", residuals[0], residuals[1])


def rotation_entry() -> tuple[str, str, Real, Real]:
    """(37): the turn of N(z) beyond arg(lambda) is Im(d) r^2 to leading order, not r^3."""
    d, r = mp.mpc("-0.7", "0.4"), mp.mpf(10) ** -30
    turn = mp.arg(1 + d * r * r)
    return (
        "(37)",
        "angle grows with r^3 for r^2",
        abs(turn / (d.imag * r**3) - 1),
        abs(turn / (d.imag * r**2) - 1),
    )


def appendix_entries() -> list[tuple[str, str, Real, Real]]:
    """(A6), (A7), (A10) on a quadratic F; y1 = (z + zbar) / 2, y2 = (z - zbar) / (2 i)."""
    f11, f12, f22 = mp.mpc("0.3", "-0.8"), mp.mpc("0.5", "0.2"), mp.mpc("-0.4", "0.7")  # F1 + i F2
    f13, f23 = mp.mpc("0.9", "-0.1"), mp.mpc("0.25", "0.6")
    i = mp.mpc(0, 1)
    # substitution: y_1 w -> (z + zbar) w / 2, y_2 w -> (z - zbar) w / (2 i)
    zw, zbarw = f13 / 2 + f23 / (2 * i), f13 / 2 - f23 / (2 * i)
    d1, d2 = f13, f23  # second derivatives with y_k of F1 + i F2
    third = 0  # the printed third derivatives vanish for a quadratic map
    a6 = (d1.real + d2.imag) / 2 + i * (d1.imag - d2.real) / 2
    a7 = (d1.real - d2.imag) / 2 + i * (d1.imag + d2.real) / 2
    a6_printed, a7_printed = (
        (d1.real + third) / 2 + i * d1.imag / 2,
        (d1.real - third) / 2 + i * d1.imag / 2,
    )
    a7_sign = (d1.real - d2.imag) / 2 + i * (d1.imag - d2.real) / 2
    # H_k is real: the coefficient of zbar^2 / 2 from f11 y1^2 + f12 y1 y2 + f22 y2^2
    r11, r12, r22 = f11.real, f12.real, f22.real
    zbar2 = 2 * (r11 / 4 - r12 / (4 * i) - r22 / 4)
    a10 = [(2 * r11 - 2 * r22 + sign * 2 * i * r12) / 4 for sign in (-1, 1)]
    return [
        ("(A6)", "third derivatives for second", abs(a6_printed - zw), abs(a6 - zw)),
        ("(A7)", "third derivatives for second", abs(a7_printed - zbarw), abs(a7 - zbarw)),
        ("(A7)", "sign in the imaginary part", abs(a7_sign - zbarw), abs(a7 - zbarw)),
        ("(A10)", "-2i for +2i", abs(a10[0] - zbar2), abs(a10[1] - zbar2)),
    ]


def normal_form_entries() -> list[tuple[str, str, Real, Real]]:
    """All of them, in the order of the paper."""
    return [rotation_entry(), planted_entry(), *appendix_entries()]
