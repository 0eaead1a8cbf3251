"""Continue folds and period doublings of impacting orbits in two parameters with AUTO-07p.

The boundary-value problem is that of curves.f90. A start is an orbit of run.py; its variation is
integrated here by Runge and Kutta's method, and is an eigenvector of the map over all flights.
"""

from __future__ import annotations

import json
import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

NAMES = {1: "k", 2: "c", 3: "A", 4: "w", 5: "d", 6: "e", 7: "T1", 8: "T2", 9: "V1", 10: "V2",
         12: "phase1", 13: "phase2", 14: "mu", 15: "sigma1", 16: "sigma2"}  # fmt: skip
NUMBERS = {name: number for number, name in NAMES.items()}
STEPS = 2000  # of Runge and Kutta's method over a flight
ROWS = 200  # of them written
MULTIPLIER = {"SN": 1.0, "PD": -1.0}

Row = list[float]


class Flight:
    """A flight from the wall back to it, with its variations by speed and phase at its start.

    A row is (x, v, theta, xi_1, eta_1, xi_2, eta_2); columns 1 start with (0, 1, 0), 2 with
    (0, 0, 1) in (xi, eta, zeta), and zeta keeps its value.
    """

    def __init__(self, p: Mapping[str, float], T: float, speed: float, phase: float) -> None:
        self.p, self.T = p, T
        row, h = [p["d"], -p["e"] * speed, phase, 0.0, 1.0, 0.0, 0.0], T / STEPS
        self.rows = [row]
        for _ in range(STEPS):
            k1 = self.rate(row)
            k2 = self.rate(along(row, h / 2, k1))
            k3 = self.rate(along(row, h / 2, k2))
            k4 = self.rate(along(row, h, k3))
            row = [
                y + h / 6 * (a + 2 * b + 2 * c + d)
                for y, a, b, c, d in zip(row, k1, k2, k3, k4, strict=True)
            ]
            self.rows.append(row)

    def rate(self, row: Row) -> Row:
        x, v, theta, xi1, eta1, xi2, eta2 = row
        p = self.p
        force = p["A"] * math.cos(theta) - p["c"] * v - p["k"] * x
        more1 = -p["c"] * eta1 - p["k"] * xi1
        more2 = -p["c"] * eta2 - p["k"] * xi2 - p["A"] * math.sin(theta)
        return [v, force, p["w"], eta1, more1, eta2, more2]

    def sigma(self, eta: float, zeta: float) -> float:
        """Variation of the time, so that the varied flight ends on the wall too."""
        end = self.rows[-1]
        return -(eta * end[3] + zeta * end[5]) / end[1]

    def varied(self, i: int, eta: float, zeta: float) -> Row:
        """(x, v, theta, xi, eta, zeta) at a step."""
        row, sigma = self.rows[i], self.sigma(eta, zeta)
        shift = [i / STEPS * sigma * rate for rate in self.rate(row)[:3]]
        own = (eta * row[3] + zeta * row[5], eta * row[4] + zeta * row[6], zeta)
        return [*row[:3], *(a + b for a, b in zip(own, shift, strict=True))]

    def after(self, eta: float, zeta: float) -> tuple[float, float]:
        """Variation of speed and phase after the impact at the end."""
        end = self.varied(STEPS, eta, zeta)
        return -self.p["e"] * end[4], end[5]


def along(row: Row, h: float, rate: Row) -> Row:
    return [y + h * r for y, r in zip(row, rate, strict=True)]


def flights_of(p: Mapping[str, float], at: Mapping[str, float], count: int) -> list[Flight]:
    """The flights of an orbit that AUTO found."""
    last = at[f"V{count}"], at[f"phase{count}"] - 2 * math.pi * count
    found = []
    for i in range(1, count + 1):
        found.append(Flight(p, at[f"T{i}"], *last))
        last = at[f"V{i}"], at[f"phase{i}"]
    return found


def eigenvector(flights: Sequence[Flight]) -> tuple[float, Row]:
    """The outermost multiplier, which must be real, and its unit vector (eta, zeta)."""
    columns = []
    for start in ((1.0, 0.0), (0.0, 1.0)):
        w = start
        for flight in flights:
            w = flight.after(*w)
        columns.append(w)
    (a, c), (b, d) = columns
    root = math.sqrt((a - d) ** 2 / 4 + b * c)
    mu = max((a + d) / 2 + root, (a + d) / 2 - root, key=abs)
    vector = max(([b, mu - a], [mu - d, c]), key=lambda u: math.hypot(*u))
    return mu, [u / math.hypot(*vector) for u in vector]


def write_start(flights: Sequence[Flight], vector: Row, file: Path) -> list[float]:
    """Write flights and variations in the columns of AUTO; give the variations of the times."""
    variations = [tuple(vector)]
    for flight in flights:
        variations.append(flight.after(*variations[-1]))
    lines = []
    for i in range(0, STEPS + 1, STEPS // ROWS):
        row = [i / STEPS]
        for flight, w in zip(flights, variations, strict=False):
            row += flight.varied(i, *w)
        lines.append(" ".join(f"{a:.16e}" for a in row))
    file.write_text("\n".join(lines) + "\n")
    return [flight.sigma(*w) for flight, w in zip(flights, variations, strict=False)]


def measured(count: int) -> list[str]:
    """What is free or measured beside the two parameters."""
    return [f"{name}{i}" for name in ("T", "sigma", "V", "phase") for i in range(1, count + 1)]


def started(
    p: Mapping[str, float], at: Mapping[str, float], count: int
) -> tuple[float, dict[int, float]]:
    """Write the start at an orbit; give its multiplier, and the parameters."""
    flights = flights_of(p, at, count)
    mu, vector = eigenvector(flights)
    sigmas = write_start(flights, vector, Path("curve.dat"))
    values = {NUMBERS[k]: v for k, v in p.items()}
    for i, (flight, sigma) in enumerate(zip(flights, sigmas, strict=True)):
        values |= {7 + i: flight.T, 15 + i: sigma}
    return mu, values


def continue_curve(
    auto: Any, constants: Mapping[str, Any], p: Mapping[str, float], at: Mapping[str, float],
    count: int, kind: str, free: tuple[str, str], record: Sequence[float],
) -> list[Any]:  # fmt: skip
    """Follow a bifurcation both ways from near an orbit with so many flights.

    First the multiplier is led to its value along the second parameter. Then both vary; points are
    recorded at values of the first one, and the curve ends beyond the outermost of them, or where a
    speed is zero.
    """
    wanted = MULTIPLIER[kind]
    inner = [NUMBERS[name] for name in measured(count)]
    own = {**constants, "e": "curves", "NDIM": 6 * count, "NBC": 8 * count + 1, "ILP": 0, "ISP": 0,
           "STOP": [], "parnames": NAMES, "dat": "curve"}  # fmt: skip
    mu, values = started(p, at, count)
    led = auto.run(
        PAR=values | {14: mu}, ICP=[14, NUMBERS[free[1]], *inner], UZR={-14: wanted},
        RL0=-1e9, RL1=1e9, DS=math.copysign(1e-3, wanted - mu), **own,
    )("UZ1")  # fmt: skip
    p = {**p, free[1]: float(led[free[1]])}
    _, values = started(p, {name: float(led[name]) for name in measured(count)}, count)
    speeds = {-NUMBERS[f"V{i}"]: 0.0 for i in range(1, count + 1)}
    points: list[Any] = []
    for ds in (-1e-2, 1e-2):
        part = auto.run(
            PAR=values | {14: wanted}, ICP=[*(NUMBERS[name] for name in free), *inner],
            RL0=record[0] - 1e-3, RL1=record[-1] + 1e-3, DS=ds,
            UZR={NUMBERS[free[0]]: list(record), **speeds}, **own,
        )  # fmt: skip
        points = [*points[::-1], *part("UZ")]
    return points


def curve_lines(
    name: str, p: Mapping[str, float], count: int, kind: str, free: tuple[str, str],
    points: Sequence[Any],
) -> list[str]:  # fmt: skip
    """The recorded points of a curve: both parameters, times, speeds, phases."""
    out = ["", "[[curve]]", f'name = "{name}"', f'kind = "{kind}"', f"flights = {count}"]
    out += [f"free = {json.dumps(free)}"]
    out += [f"{k} = {v}" for k, v in p.items() if k not in free]
    columns = [*free, *(c for c in measured(count) if not c.startswith("sigma"))]
    out += [f"columns = {json.dumps(columns)}", "points = ["]
    out += [f"  {json.dumps([float(point[key]) for key in columns])}," for point in points]
    return [*out, "]"]
