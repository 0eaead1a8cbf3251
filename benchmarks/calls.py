"""What each call costs, and how that grows with coordinates, impacts of an orbit, elements and points.

The machine is the impact damper in steady motion; with absorbers, which are more coordinates; gone round several
times, which are more impacts of one orbit; and with soft stops out of reach, which are watched at every step. Before
anything is timed the run from every orbit is asserted to be periodic, its determinant identity to hold, and elements
out of reach to change nothing. CPU times are printed, of all threads together: other work on the machine counts little.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

import vibroimpact as vi
from benchmarks.branches import damper, longer, seconds
from benchmarks.curves import carried, with_absorbers

DEGREES, IMPACTS, ELEMENTS = (4, 8), (4, 8), (2, 4)
OUT_OF_REACH = 1e3
PERIODS = 300  # of a member, and of what is observed
MEMBERS = 256
PERIODIC = 1e-9

Case = tuple[str, vi.Orbit]


@dataclass(slots=True)
class Row:
    """One line of the table: CPU time of a call by machine, in a unit."""

    call: str
    unit: str
    times: dict[str, float]


def base(degrees: int, elements: int = 0) -> vi.Orbit:
    """The symmetric orbit of set A with so many coordinates, and soft stops that nothing reaches."""
    plain = damper()
    at = next(orbit for orbit in vi.symmetric_orbits(plain) if orbit.stable)
    system = with_absorbers(plain, degrees)
    rows = np.eye(degrees)[np.arange(elements) % degrees]
    far = (vi.SoftStop(tuple(row), upper=OUT_OF_REACH, stiffness=1.0) for row in rows)
    system = replace(system, elements=(*system.elements, *far))
    return vi.find_orbit(system, carried(at.state, degrees), stops="AB", cycles=1)


def cases(*, quick: bool) -> Iterator[Case]:
    """The orbits, by what is more of them than of the first."""
    few = slice(1 if quick else None)
    first = base(2)
    yield "damper", first
    for n in DEGREES[few]:
        yield f"{n} coordinates", base(n)
    for n in IMPACTS[few]:
        yield f"{n} impacts", longer(first, n)
    for n in ELEMENTS[few]:
        yield f"{n} elements", base(2, n)


def assert_right(orbit: vi.Orbit, first: vi.Orbit) -> None:
    """The machine moves so, and what is out of its reach changes nothing."""
    assert orbit.converged, orbit
    assert orbit.admissible, orbit
    assert orbit.determinant_error < 1e-8, orbit
    around = len(orbit.signature.impacts)
    run = vi.simulate(orbit.system, orbit.state, impacts=2 * around)
    assert abs(run.time[-1] - run.time[-1 - around] - orbit.period) < PERIODIC, orbit
    if orbit.mechanism.degrees == 2:
        assert abs(orbit.states[0] - first.states[0]).max() < PERIODIC, orbit


# A call on an orbit's machine: its unit, seconds of it, and how many of what it is divided by there are.
Call = tuple[str, Callable[[vi.Orbit], Callable[[], int]]]


def _simulate(orbit: vi.Orbit) -> Callable[[], int]:
    return lambda: len(vi.simulate(orbit.system, orbit.state, impacts=2 * PERIODS))


def _section(orbit: vi.Orbit) -> Callable[[], int]:
    return lambda: len(vi.section(orbit.system, orbit.state, at=vi.AtStop(), points=PERIODS))


def _sweep(orbit: vi.Orbit) -> Callable[[], int]:
    name = "omega"
    values = orbit.mechanism.omega + np.linspace(0.0, 1e-3, MEMBERS)

    def members() -> int:
        vi.sweep(
            orbit.system, over={name: values}, start=orbit.state, settle_periods=PERIODS - 50,
            periods=50, workers=1, progress=False,
        )  # fmt: skip
        return MEMBERS

    return members


def _once(call: Callable[[vi.Orbit], object]) -> Callable[[vi.Orbit], Callable[[], int]]:
    return lambda orbit: lambda: int(call(orbit) is not None)


def _branch(points: int) -> Callable[[vi.Orbit], Callable[[], int]]:
    steps = vi.Steps(first=0.002, largest=0.005, points=points // 2)
    return lambda orbit: (
        lambda: len(vi.continue_orbit(orbit, "omega", (0.5, 1.5), steps=steps, progress=False))
    )


CALLS: dict[str, Call] = {
    "simulate": ("us an impact", _simulate),
    "section": ("us a point", _section),
    "sweep, 300 periods": ("us a member", _sweep),
    "classify": ("ms", _once(lambda o: vi.classify(o.system, o.state))),
    "lyapunov_exponent": ("ms", _once(lambda o: vi.lyapunov_exponent(o.system, o.state))),
    "lyapunov_spectrum": ("ms", _once(lambda o: vi.lyapunov_spectrum(o.system, o.state))),
    "find_orbit": ("ms", _once(lambda o: vi.find_orbit(o.system, o))),
    "multipliers": ("ms", _once(lambda o: vi.find_orbit(o.system, o).multipliers)),
    "continue_orbit, 50 points": ("ms a point", _branch(50)),
    "continue_orbit, 200 points": ("ms a point", _branch(200)),
    "amplitude and its derivative": (
        "ms", _once(lambda o: vi.measures.Amplitude("x1").along(o, "omega")),
    ),
}  # fmt: skip
FACTORS = {"us": 1e6, "ms": 1e3}


def seconds_each(call: Callable[[], int], rounds: int) -> float:
    """Median CPU time of a call, all its threads together, divided by what it returns."""
    count = call()  # builds what is kept, too
    return seconds(call, rounds, time.process_time) / count


def run(options: argparse.Namespace) -> dict[str, Any]:
    """Time every call on every machine."""
    orbits = dict(cases(quick=options.quick))
    for orbit in orbits.values():
        assert_right(orbit, orbits["damper"])
    table = []
    print(f"{'call':30} {'':12} " + " ".join(f"{name:>13}" for name in orbits))
    for name, (unit, made) in CALLS.items():
        factor = FACTORS[unit[:2]]
        times = {
            case: factor * seconds_each(made(orbit), options.rounds)
            for case, orbit in orbits.items()
        }
        table.append(Row(name, unit, times))
        print(f"{name:30} {unit:12} " + " ".join(f"{x:13.3g}" for x in times.values()))
    return {"rows": table}
