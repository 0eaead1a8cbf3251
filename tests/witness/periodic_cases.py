"""The orbits and maps of the tables, with guesses good to a few digits.

A guess is (q, v, theta) after the last impact of the signature, and the flight times; `solve`
of `periodic` takes it to full precision. The guesses come from simulations in double precision.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from .damper import PAPER_SETS
from .mechanism import Contact, Line, Mechanism
from .periodic import (
    doubling_test,
    fold_test,
    grazing_test,
    moved,
    special,
    speed_test,
    through,
    torus_test,
)
from .precision import Real, exact, mp

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from .multilinear import Map, Vector
    from .periodic import Gap, Orbit

A, B = (0, "upper"), (0, "lower")  # the stops of the damper


@dataclass(frozen=True)
class Case:
    """An orbit to be found."""

    name: str
    mechanism: Mechanism
    signature: tuple[Gap, ...]
    cycles: int
    guess: Sequence[Real]
    times: Sequence[Real]


def one_sided(
    k: str, c: str, amplitude: str, omega: str, wall: Real, restitution: str
) -> Mechanism:
    """x'' + c x' + k x = amplitude cos(omega t), x <= wall."""
    return Mechanism(
        [[1]],
        [[c]],
        [[k]],
        [Line(omega, [0], [amplitude])],
        [Contact([1], None, wall, restitution)],
    )


def damper(name: str, omega: Real, half_clearance: Real = None) -> Mechanism:
    """One of the paper's dampers: q = (x1, x2), u = x2 - x1, stop A where u is largest."""
    p = {key: exact(value) for key, value in PAPER_SETS[name].items()}
    if half_clearance is not None:
        p["half_clearance"] = exact(half_clearance)
    return Mechanism(
        mass=[[1, 0], [0, p["mass_ratio"]]],
        damping=[[2 * p["zeta"] * p["omega_n"], 0], [0, 0]],
        stiffness=[[p["omega_n"] ** 2, 0], [0, 0]],
        lines=[Line(omega, [1, 0], [0, 0])],
        contacts=[Contact([-1, 1], -p["half_clearance"], p["half_clearance"], p["restitution"])],
    )


def chain(omega: str) -> Mechanism:
    """Three masses in a row, damping not proportional, one stop on one side, two on the other."""
    return Mechanism(
        mass=[[1, 0, 0], [0, "0.5", 0], [0, 0, "0.2"]],
        damping=[["0.08", "-0.03", 0], ["-0.03", "0.05", "-0.01"], [0, "-0.01", "0.02"]],
        stiffness=[[2, -1, 0], [-1, "1.5", "-0.25"], [0, "-0.25", "0.25"]],
        lines=[Line(omega, [1, 0, 0], [0, "0.25", 0])],
        contacts=[
            Contact([-1, 1, 0], "-0.5", None, "0.75"),
            Contact([0, -1, 1], -1, "0.75", "0.75"),
        ],
    )


def cases() -> list[Case]:
    """The orbits that no closed form gives, and the impact oscillator of COCO."""
    wall = (0, "upper")
    lower, right, left = (0, "lower"), (1, "lower"), (1, "upper")
    return [
        Case("coco_1_1", one_sided("1", "0.1", "1", "1", 1, "0.8"), (wall,), 1,
             (1, "-1.3566", "0.07595"), ("6.2832",)),
        Case("damper_1_1_1_asymmetric", damper("A", "0.705"), (B, A), 1,
             ("2.459598", "7.459598", "-0.388984", "-3.729545", "4.920102"),
             ("4.047829", "4.864490")),
        Case("damper_1_1_2", damper("A", "0.625"), (A, B, B), 1,
             ("-1.806787", "-6.806787", "2.737959", "4.568522", "2.543876"),
             ("3.533863", "3.823321", "2.695912")),
        Case("damper_2_2_2", damper("A", "0.95"), (A, B, A, B), 2,
             ("-1.503943", "-6.503943", "0.551599", "5.125366", "1.785728"),
             ("2.567507", "5.182587", "3.125397", "2.352268")),
        Case("damper_2_2_4", damper("C", "0.9"), (A, B, B, A, B, B), 2,
             ("-0.8546677457", "-6.8546677457", "6.6287168535", "9.0935185451", "0.1766719851"),
             ("2.1692993649", "2.8268633380", "1.6252643201", "2.5181207353", "2.9810282241",
              "1.8420580335")),
        Case("chain_1_5", chain("1.125"), (right, lower, left, left, lower), 1,
             ("-0.6177071054", "-1.1177071054", "-1.2705912847",
              "-0.0908110279", "0.5905030042", "-1.9303345975", "1.0025223977"),
             ("0.3257169237", "0.3363570796", "1.9679006880", "1.2359008107", "1.7191781044")),
    ]  # fmt: skip


@dataclass(frozen=True)
class Special:
    """A special point of a branch: the kind, where to look, and what varies."""

    name: str
    kind: str  # SN, PD, NS, GR, or V where an impact speed vanishes
    free: str  # the name of the parameter
    build: Callable[[Real], Mechanism]
    signature: tuple[Gap, ...]
    cycles: int
    near: Real
    guess: Sequence[Real]
    times: Sequence[Real]
    test: Callable[[Orbit], Real]

    def found(self) -> tuple[Real, Orbit]:
        (at,), orbit = special(self.build, self.signature, self.cycles, self.guess, self.times,
                               (self.near,), (self.test,))  # fmt: skip
        return at, orbit


def specials() -> list[Special]:
    """Special points of branches through the orbits of `cases` and of one-sided oscillators."""
    wall, right = (0, "upper"), (1, "lower")

    def coco(omega: Real = 1, amplitude: Real = 1) -> Mechanism:
        return one_sided("1", "0.1", amplitude, omega, 1, "0.8")

    def dux(stop: Real) -> Mechanism:
        return one_sided("1", "0", "1", "2.8", stop, "0.8")

    def damper_a(omega: Real) -> Mechanism:
        return damper("A", omega)

    return [
        Special("coco", "SN", "omega", coco, (wall,), 1, "1.75014262",
                (1, "-3.04103813", "1.9902"), ("3.590099",), fold_test),
        Special("coco", "SN", "amplitude", lambda A: coco(amplitude=A), (wall,), 1, "0.09997075",
                (1, "-0.003289225", "1.5466"), ("6.2831853",), fold_test),
        Special("coco", "V", "omega", coco, (wall,), 1, "1.4106736",
                (1, "0", "3.00005"), ("4.454030",), speed_test(0)),
        Special("budd_dux_doubled", "SN", "wall", dux, (wall, wall), 2, "0.09173841",
                ("0.09173841", "-0.30651211", "0.91840"), ("3.4966935", "0.9912958"), fold_test),
        Special("damper_1_1_1_asymmetric", "PD", "omega", damper_a, (B, A), 1, "0.6662",
                ("2.19396060", "7.19396060", "-1.55457033", "-5.29684089", "5.37683852"),
                ("2.90595055", "6.52826162"), doubling_test),
        Special("damper_1_1_2", "PD", "omega", damper_a, (A, B, B), 1, "0.604",
                ("-2.08485553", "-7.08485553", "3.17993568", "5.03867056", "2.54259122"),
                ("3.46067746", "4.37811492", "2.56383230"), doubling_test),
        Special("damper_1_1_2", "NS", "omega", damper_a, (A, B, B), 1, "0.654",
                ("-0.37281775", "-5.37281775", "2.56194535", "4.29034946", "2.82444597"),
                ("3.18572511", "3.17355128", "3.24804058"), torus_test),
        Special("damper_2_2_2", "SN", "omega", damper_a, (A, B, A, B), 2, "0.98",
                ("-1.99172546", "-6.99172546", "-0.30689026", "4.30266944", "1.60598541"),
                ("2.89407041", "4.84742661", "2.83682474", "2.24450540"), fold_test),
        Special("chain_1_5", "PD", "omega", chain, (right, B, (1, "upper"), (1, "upper"), B), 1,
                "1.256", ("-0.27622925", "-0.77622925", "-1.08969775", "0.34383975", "0.67176379",
                          "-1.59996725", "1.38447856"),
                ("0.30050196", "0.14204002", "1.49325221", "2.01550361", "1.05123828"),
                doubling_test),
        Special("chain_1_5", "GR", "omega", chain, (right, B, (1, "upper"), (1, "upper"), B), 1,
                "0.999", ("-1.27259652", "-1.77259652", "-2.05168307", "-1.31499720",
                          "0.12817015", "-3.87888408", "0.31087879"),
                ("0.17717859", "0.44390744", "3.65432265", "1.25030508", "0.76376103"),
                grazing_test(2, right, "2.47")),
    ]  # fmt: skip


@dataclass(frozen=True)
class Flight:
    """A map (q, v, theta) -> the same after one impact, and entries of the matrices to vary."""

    name: str
    mechanism: Mechanism
    start: Sequence[Real]
    gap: Gap
    time: Real  # a guess
    parameters: Sequence[tuple[str, int, int]]  # matrix, row, column; symmetric matrices stay so

    def map(self, parameters: Sequence[tuple[str, int, int]] = ()) -> Map:
        """The map; the changes of the parameters named follow the 2n + 1 coordinates."""
        size = len(self.start)

        def f(z: Vector) -> Vector:
            m = self.mechanism
            for (matrix, i, j), change in zip(parameters, z[size:], strict=True):
                m = moved(m, matrix, change, i, j)
                m = m if i == j else moved(m, matrix, change, j, i)
            return through(m, z[:size], [self.gap], [exact(self.time)])

        return f

    def point(self, parameters: Sequence[tuple[str, int, int]] = ()) -> Vector:
        return [exact(x) for x in self.start] + [mp.mpf(0)] * len(parameters)


def flights() -> list[Flight]:
    """Where closed forms are singular: critical damping, equal frequencies, free masses."""
    wall = (0, "upper")
    return [
        Flight("critical_damping", one_sided("1", "2", "1", "0.75", "0.125", "0.8"),
               ("0.125", "-0.5", "1"), wall, "6.945", (("damping", 0, 0), ("stiffness", 0, 0))),
        Flight("equal_frequencies", Mechanism(
            [[1, 0], [0, 1]], [["0.125", 0], [0, "0.125"]], [[1, 0], [0, 1]],
            [Line("0.75", [1, 0], [0, "0.5"])], [Contact([-1, 1], "-0.5", "0.5", "0.75")]),
               ("0.25", "0.75", "0.5", "-0.25", "1"), (0, "lower"), "0.8872",
               (("stiffness", 1, 1), ("stiffness", 0, 1), ("damping", 1, 1), ("mass", 1, 1))),
        Flight("free_mass", Mechanism(
            [[1, 0], [0, "0.125"]], [["0.0625", 0], [0, 0]], [[1, 0], [0, 0]],
            [Line("0.75", [1, 0], [0, "0.25"])], [Contact([-1, 1], "-2", "2", "0.75")]),
               ("0.25", "2.25", "0.5", "-1", "1"), (0, "lower"), "2.445",
               (("stiffness", 1, 1), ("stiffness", 0, 1), ("damping", 1, 1), ("mass", 1, 1))),
    ]  # fmt: skip
