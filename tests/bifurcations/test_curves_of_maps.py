"""Curves of bifurcations of maps given by formulas, against closed forms."""

from __future__ import annotations

import math

import numpy as np
import pytest

import vibroimpact as vi

LOCATED = 1e-9  # what is promised of both parameters


def henon(r: float) -> vi.ExplicitMap:
    """The generalised Henon map (x, y) -> (y, alpha - beta x - y^2 + r x y)."""
    return vi.ExplicitMap(
        lambda x, p: [x[1], p[0] - p[1] * x[0] - x[1] ** 2 + r * x[0] * x[1]],
        dimension=2,
        parameters=("alpha", "beta"),
    )


def fixed_x(r: float, alpha: float, beta: float) -> float:
    """The fixed point x = y of larger x: (1 - r) x^2 + (1 + beta) x - alpha = 0."""
    return (-(1 + beta) + math.sqrt((1 + beta) ** 2 + 4 * (1 - r) * alpha)) / (2 * (1 - r))


def curve(r: float, kind: str, alpha: float, beta: float) -> vi.BifurcationCurve:
    x = fixed_x(r, alpha, beta)
    start = vi.map_bifurcation(kind, henon(r), (x, x), (alpha, beta))
    return vi.continue_bifurcation(start, ("alpha", "beta"), ((-3.0, 6.0), (-2.5, 2.5)))


# Exact points, from trace and determinant at the fixed point: det = beta - r x, trace = -2 x + r x.
POINTS = {
    0.5: {"R1": (-8 / 9, 1 / 3), "R2": (40 / 9, 5 / 3), "R3": (16 / 9, 4 / 3), "R4": (0.0, 1.0)},
    -0.1: {
        "R1": (-440 / 441, 23 / 21),
        "R2": (1240 / 441, 19 / 21),
        "R3": (520 / 441, 20 / 21),
        "R4": (0.0, 1.0),
    },
    0.0: {"R1": (-1.0, 1.0), "R2": (3.0, 1.0), "R3": (1.25, 1.0), "R4": (0.0, 1.0)},
}


@pytest.mark.parametrize("r", [0.5, -0.1])  # for r = 0 every point of it is degenerate
@pytest.mark.slow
def test_strong_resonances_of_the_henon_map_are_where_algebra_puts_them(r: float) -> None:
    # beta = 1 + r x on NS; at alpha = 0.2 that is one equation for x
    x = min(np.roots([1.0, 2.0, -0.2]), key=lambda root: abs(root - 0.1)).real
    found = curve(r, "NS", 0.2, 1.0 + r * x)
    for label, at in POINTS[r].items():
        point = found[f"{label}_1"]
        assert tuple(point.parameters.values()) == pytest.approx(at, abs=LOCATED)
    assert [p.kind for p in found.special_points if p.kind in POINTS[r]].count("R4") == 1


@pytest.mark.parametrize("r", POINTS)
@pytest.mark.parametrize("kind", ["SN", "PD"])
@pytest.mark.one_in(3)
def test_curves_of_folds_and_flips_pass_fold_flip_and_resonance(r: float, kind: str) -> None:
    label = {"SN": "R1", "PD": "R2"}[kind]
    # at beta = 0.5: 4 (1 - r) alpha = -(1 + beta)^2 on SN; on PD 1 + trace + det = 0
    if kind == "SN":
        alpha = -(1.5**2) / (4 * (1 - r))
    else:
        x = (1 + 0.5) / 2
        alpha = (1 - r) * x * x + 1.5 * x
    found = curve(r, kind, alpha, 0.5)
    assert tuple(found["LPPD_1"].parameters.values()) == pytest.approx((0.0, -1.0), abs=LOCATED)
    assert tuple(found[f"{label}_1"].parameters.values()) == pytest.approx(
        POINTS[r][label], abs=LOCATED
    )
    values = found.values
    x = np.array([found.orbit(k).x[0] for k in range(len(found))])
    trace, det = -2 * x + r * x, values[:, 1] - r * x
    critical = 1 - trace + det if kind == "SN" else 1 + trace + det
    assert np.abs(critical).max() < 1e-10  # rounding of x, whose derivative is infinite at folds


def test_delayed_logistic_map_has_r1_at_three() -> None:
    delayed = vi.ExplicitMap(
        lambda x, p: [p[0] * x[0] * (1.0 - x[1]) + p[1], x[0]],
        dimension=2,
        parameters=("r", "q"),
    )
    start = vi.map_bifurcation("NS", delayed, (0.5, 0.5), (2.0, 0.0))
    found = vi.continue_bifurcation(start, ("r", "q"), ((1.5, 4.0), (-1.0, 0.5)))
    point = found["R1_1"]
    assert tuple(point.parameters.values()) == pytest.approx((3.0, -1 / 3), abs=LOCATED)


def planted(dimension: int, matrix: object) -> vi.ExplicitMap:
    """A map x -> A(p) x + cubic terms, with a fixed point at 0."""
    return vi.ExplicitMap(
        lambda x, p: [row @ x + 0.1 * x[i] ** 3 for i, row in enumerate(matrix(p))],  # type: ignore[operator]
        dimension=dimension,
        parameters=("a", "b"),
    )


@pytest.mark.parametrize("apart", [1e-2, 1e-4, 1e-6])
@pytest.mark.slow
def test_two_resonances_within_a_step_are_both_found(apart: float) -> None:
    # the angle touches a quarter turn almost: it is pi / 2 at b = +-apart only
    def matrix(p: tuple[object, object]) -> np.ndarray:
        radius, angle = 1.0 + p[0], math.pi / 2 + p[1] ** 2 - apart**2  # type: ignore[operator]
        c, s = radius * np.cos(angle), radius * np.sin(angle)
        return np.array([[c, -s], [s, c]], dtype=object)

    start = vi.map_bifurcation("NS", planted(2, matrix), (0.0, 0.0), (0.0, -0.31))
    found = vi.continue_bifurcation(start, ("a", "b"), ((-0.1, 0.1), (-0.5, 0.5)))
    at = [p.parameters["b"] for p in found.special_points if p.kind == "R4"]
    assert at == pytest.approx([-apart, apart], abs=LOCATED)


def test_two_pairs_on_the_circle_and_a_flip_with_a_pair_are_named() -> None:
    def matrix(p: tuple[object, object]) -> np.ndarray:
        a, b = p
        first, second = np.cos(1.0), np.sin(1.0)
        c, s = np.cos(2.0), np.sin(2.0)
        whole = np.zeros((5, 5), dtype=object)
        r = 1.0 + a  # type: ignore[operator]
        whole[:2, :2] = [[r * first, -r * second], [r * second, r * first]]
        q = 1.0 + 0.5 * b  # type: ignore[operator]
        whole[2:4, 2:4] = [[q * c, -q * s], [q * s, q * c]]
        whole[4, 4] = -1.2 + b  # type: ignore[operator]
        return whole

    start = vi.map_bifurcation("NS", planted(5, matrix), np.zeros(5), (0.0, -0.4))
    found = vi.continue_bifurcation(start, ("a", "b"), ((-0.1, 0.1), (-0.5, 0.5)))
    at = {p.kind: p.parameters["b"] for p in found.special_points if p.kind != "BP"}
    assert at == pytest.approx({"NSNS": 0.0, "PDNS": 0.2}, abs=1e-8)


@pytest.mark.slow
def test_a_curve_of_cusps_normal_form_has_its_cusp_in_every_direction() -> None:
    # x -> x + a + b x - x^3, the parameters turned: SN is the semicubical parabola
    for angle in np.linspace(0.0, 2.0 * math.pi, 9):
        c, s = math.cos(angle), math.sin(angle)
        turned = vi.ExplicitMap(
            lambda x, p, c=c, s=s: [
                x[0] + (c * p[0] - s * p[1]) + (s * p[0] + c * p[1]) * x[0] - x[0] ** 3
            ],
            dimension=1,
            parameters=("a", "b"),
        )
        x = 0.2  # fold: b = 3 x^2, a = -2 x^3, turned back
        a, b = -2 * x**3, 3 * x**2
        start = vi.map_bifurcation("SN", turned, (x,), (c * a + s * b, -s * a + c * b))
        found = vi.continue_bifurcation(start, ("a", "b"), ((-1.0, 1.0), (-1.0, 1.0)))
        point = found["CP_1"]
        assert tuple(point.parameters.values()) == pytest.approx((0.0, 0.0), abs=LOCATED)
        assert [p.kind for p in found.special_points] == ["CP"]


def test_a_generalised_flip_is_found_where_the_cubic_coefficient_vanishes() -> None:
    # x -> -(1 + a) x + b x^3 - x^5: PD at a = 0, GPD at b = 0
    quintic = vi.ExplicitMap(
        lambda x, p: [-(1.0 + p[0]) * x[0] + p[1] * x[0] ** 3 - x[0] ** 5],
        dimension=1,
        parameters=("a", "b"),
    )
    start = vi.map_bifurcation("PD", quintic, [0.0], [0.0, 0.37])  # type: ignore[arg-type]  # lists will do
    found = vi.continue_bifurcation(start, ("a", "b"), ((-0.5, 0.5), (-1.0, 1.0)))
    assert tuple(found["GPD_1"].parameters.values()) == pytest.approx((0.0, 0.0), abs=LOCATED)


def test_a_chenciner_point_is_found_where_the_lyapunov_coefficient_vanishes() -> None:
    # z -> (1 + a) e^i z + b z |z|^2 in real coordinates
    def image(x: object, p: object) -> list[object]:
        c, s = math.cos(1.0), math.sin(1.0)
        square = x[0] ** 2 + x[1] ** 2  # type: ignore[index]
        grow = 1.0 + p[0] + p[1] * square  # type: ignore[index]
        return [grow * (c * x[0] - s * x[1]), grow * (s * x[0] + c * x[1])]  # type: ignore[index]

    flow = vi.ExplicitMap(image, dimension=2, parameters=("a", "b"))
    start = vi.map_bifurcation("NS", flow, (0.0, 0.0), (0.0, 0.37))
    found = vi.continue_bifurcation(start, ("a", "b"), ((-0.5, 0.5), (-1.0, 1.0)))
    assert tuple(found["CH_1"].parameters.values()) == pytest.approx((0.0, 0.0), abs=LOCATED)


@pytest.mark.slow
def test_neutral_saddles_beyond_a_resonance_are_said_to_be_no_bifurcation() -> None:
    x = math.sqrt(1.2) - 1.0
    found = curve(0.5, "NS", 0.2, 1.0 + 0.5 * x)
    real = np.abs(found.multipliers.imag).max(axis=1) < 1e-12
    assert found.neutral.any()
    np.testing.assert_array_equal(found.neutral, real)
    assert np.all(np.isnan(found.angle) == found.neutral)
