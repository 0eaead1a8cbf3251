"""Every parameter over decades, frequencies far apart and nearly equal, modes that nearly coincide: at fifty digits.

Each flight of a run is compared with the exponential of the whole matrix (witness/exponential.py), from the
state after the event before it, at the exact time of the event: positions and velocities to ACCURATE of the
motion so far, no gap open beyond a stop on the way. What the last bit of the data decides is allowed: ULPS times
what numbers of the mechanism that are 2^-52 of themselves off do, which counts where springs or dashpots of very
different stiffnesses are added in one entry of a matrix, and in long flights, whose phases omega t are as much off.
A mechanism is answered so, or refused with the number.
"""

from __future__ import annotations

import itertools
import math
import re
from collections.abc import Iterable, Iterator
from dataclasses import replace
from fractions import Fraction
from typing import Any

import numpy as np
import pytest
from witness.exponential import Flow, fixed, real
from witness.precision import mp

import vibroimpact as vi

ACCURATE, ULPS = 1e-10, 64.0
PARTS = 6  # of a flight, at which gaps are looked at
Status = vi.Status
Case = tuple[str, vi.Mechanism, vi.State]


def one(
    mass: float = 1.0, stiffness: float = 1.0, damping: float = 0.1, constant: float = -0.5,
    lines: Iterable[tuple[float, float]] = ((1.3, 1.0),), restitution: float = 0.8,
    lower: float = 0.0, upper: float = math.inf,
) -> vi.Mechanism:  # fmt: skip
    """A mass above a stop; lines are frequencies and forces."""
    return vi.Mechanism(
        mass=[[mass]], damping=[[damping]], stiffness=[[stiffness]], constant_force=(constant,),
        elements=(vi.RigidStop((1.0,), lower, upper, restitution),),
        forces=tuple(vi.Harmonic(omega, (f,), (0.3 * f,)) for omega, f in lines),
    )  # fmt: skip


def two(
    masses: tuple[float, float] = (1.0, 0.5),
    springs: tuple[float, float, float] = (1.0, 1.0, 1.0),
    dashpots: tuple[float, float, float] = (0.05, 0.1, 0.2),
    constant: float = -0.3, lines: Iterable[tuple[float, float]] = ((1.3, 1.0),),
    restitution: float = 0.8, upper: float = math.inf,
) -> vi.Mechanism:  # fmt: skip
    """Two masses that meet: springs and dashpots to the left, between them, to the right."""

    def chain(parts: tuple[float, float, float]) -> list[list[float]]:
        left, between, right = parts
        return [[left + between, -between], [-between, between + right]]

    return vi.Mechanism(
        mass=[[masses[0], 0.0], [0.0, masses[1]]], damping=chain(dashpots), stiffness=chain(springs),
        constant_force=(0.0, constant), elements=(vi.RigidStop((-1.0, 1.0), 0.0, upper, restitution),),
        forces=tuple(vi.Harmonic(omega, (f, 0.2 * f), (0.3 * f, 0.0)) for omega, f in lines),
    )  # fmt: skip


def off_by_an_ulp(m: vi.Mechanism, seed: int) -> vi.Mechanism:
    """The mechanism with its numbers changed by 2^-52 of themselves, symmetric matrices alike."""
    rng = np.random.default_rng(seed)

    def change(x: float) -> float:
        return x * (1.0 + math.copysign(2.0**-52, rng.uniform(-1.0, 1.0)))

    def matrix(a: list[list[float]]) -> list[list[float]]:
        n, signs = len(a), rng.choice([-1.0, 1.0], (len(a), len(a)))
        return [
            [a[i][j] * (1.0 + 2.0**-52 * signs[min(i, j), max(i, j)]) for j in range(n)]
            for i in range(n)
        ]

    return replace(
        m, mass=matrix(m.mass), damping=matrix(m.damping), stiffness=matrix(m.stiffness),
        constant_force=tuple(map(change, m.constant_force)),
        forces=tuple(
            vi.Harmonic(change(f.omega), tuple(map(change, f.sine)), tuple(map(change, f.cosine)))
            for f in m.forces
        ),
    )  # fmt: skip


class Witness:
    """Flights of a mechanism, with phases that start as those of a run do: in doubles.

    Of a mechanism that is a little off one ``given``, the phases are off by what they come to at the end.
    """

    def __init__(self, m: vi.Mechanism, phase: float, given: vi.Mechanism | None = None) -> None:
        self.flow, forces = Flow(m), (given or m).forces
        self.phases = [mp.mpf(phase * (f.omega / forces[0].omega)) for f in forces]
        self.omegas = [Fraction(f.omega) for f in forces]

    def along(self, x: list[float], v: list[float], begin: Fraction, t: Fraction) -> Any:
        turns = [
            omega * begin + (omega - exact) * t
            for omega, exact in zip(self.flow.omegas, self.omegas, strict=True)
        ]
        turned = [
            phase + mp.mpf(turn.numerator) / turn.denominator
            for phase, turn in zip(self.phases, turns, strict=True)
        ]
        return self.flow.along(x, v, turned, t, PARTS)


def check_flights(m: vi.Mechanism, start: vi.State, run: vi.Run) -> None:
    """The property above, of every flight in the free mode but those whose chatter was summed."""
    n, witness, others = m.degrees, Witness(m, start.phase), list[Witness]()
    times = [
        Fraction(0),
        *(
            Fraction(a) + Fraction(b)
            for a, b in zip(run.time.tolist(), run._low.tolist(), strict=True)
        ),
    ]
    x, v = (
        [[*start.position], *run.position.tolist()],
        [[*start.velocity], *run.velocity_after.tolist()],
    )
    place, speed = max(map(abs, x[0])), max(map(abs, v[0]))
    for i in range(len(run)):
        flown = times[i + 1] - times[i]
        if flown <= 0 or run.all_codes[i] or run.status[i] == Status.CHATTER:
            continue
        given = (x[i], v[i], times[i], flown)
        states = witness.along(*given)
        paths = np.vectorize(real)(states[:, : 2 * n])
        place, speed = max(place, abs(paths[:, :n]).max()), max(speed, abs(paths[:, n:]).max())
        found = [*x[i + 1], *run.velocity_before[i].tolist()]
        errors = np.array(
            [abs(real(a - fixed(b))) for a, b in zip(states[-1], found, strict=False)]
        )
        behind = 0.0
        for contact in m.rigid_stops:
            u = paths[1:, :n] @ contact.row
            behind = max(behind, (contact.lower - u).max(), (u - contact.upper).max())
        allowed = ACCURATE * np.repeat([place, speed], n)
        if np.any(errors > allowed) or behind > allowed[0]:
            others = others or [Witness(off_by_an_ulp(m, k), start.phase, m) for k in range(3)]
            moved = [abs(np.vectorize(real)(states[-1] - w.along(*given)[-1])) for w in others]
            allowed += ULPS * np.max(moved, axis=0)[: 2 * n]
        assert np.all(errors <= allowed), (i, float(times[i + 1]), errors, allowed)
        assert behind <= allowed[:n].max(), (i, float(times[i + 1]), behind, allowed)


def check(case: Case, impacts: int = 5) -> bool:
    """Run and check a case; False where it is refused, with a number, or a clearance is lost in rounding."""
    name, m, start = case
    try:
        run = vi.simulate(m, start, impacts=impacts)
    except vi.InvalidParameterError as error:
        if not re.search(r"\d", str(error)):
            pytest.fail(f"{name}: {error}")
        return False
    check_flights(m, start, run)
    return run.end is not vi.RunEnd.DIVERGED


DECADES = {
    "mass": (-12, 12), "stiffness": (-24, 12), "damping": (-24, 6), "constant": (-24, 12), "force": (-24, 12),
    "omega": (-12, 12), "restitution": (-24, 16), "upper": (-12, 12), "place": (-12, 12),
}  # fmt: skip


def of_one(name: str, exponent: int) -> Iterator[Case]:
    """One mass with one number of a decade: damped, undamped, free, and falling freely."""
    x = 10.0**exponent
    for kind, given in {
        "damped": {}, "undamped": {"damping": 0.0}, "free": {"stiffness": 0.0},
        "falling": {"stiffness": 0.0, "damping": 0.0},
    }.items():  # fmt: skip
        if name in given:
            continue
        start = 1.0
        numbers: dict[str, Any] = dict(given)
        if name == "force":
            numbers["lines"] = [(1.3, x)]
        elif name == "omega":
            numbers["lines"] = [(x, 1.0)]
        elif name == "restitution":
            numbers[name] = x if exponent <= 0 else 1.0 - 1.0 / x
        elif name == "constant":
            numbers[name] = -x
        elif name == "place":
            numbers["lower"] = -x
        elif name == "upper":
            numbers[name], start = x, 0.5 * x
        else:
            numbers[name] = x
        yield f"{kind}, {name} 1e{exponent}", one(**numbers), vi.State((start,), (0.0,), 0.7)


def of_two(name: str, exponent: int) -> Iterator[Case]:
    x, gap = 10.0**exponent, 0.5
    numbers: dict[str, Any] = {}
    if name in ("left", "between", "right", "springs"):
        numbers["springs"] = tuple(
            x if name in (part, "springs") else 1.0 for part in ("left", "between", "right")
        )
    elif name == "dashpots":
        numbers["dashpots"] = (x, 2.0 * x, 0.5 * x)
    elif name == "first":
        numbers["masses"] = (x, 0.5)
    elif name == "force":
        numbers["lines"] = [(1.3, x)]
    elif name == "omega":
        numbers["lines"] = [(x, 1.0)]
    elif name == "upper":
        numbers[name], gap = x, 0.5 * min(x, 1.0)
    else:
        numbers[name] = x if exponent <= 0 else 1.0 - 1.0 / x
    yield f"two, {name} 1e{exponent}", two(**numbers), vi.State((0.2, 0.2 + gap), (0.0, 0.1), 0.7)


def decades(names: dict[str, tuple[int, int]], of: Any, step: int) -> Iterator[Case]:
    for name, (first, last) in names.items():
        for exponent in range(first, last + 1, step):
            yield from of(name, exponent)


TWO = {
    "left": (-24, 6), "between": (-24, 6), "right": (-24, 6), "springs": (-24, 6), "dashpots": (-24, 5),
    "first": (-12, 12), "force": (-24, 12), "omega": (-12, 8), "restitution": (-24, 16), "upper": (-12, 12),
}  # fmt: skip


@pytest.mark.parametrize("names", [*DECADES], ids=[*DECADES])
@pytest.mark.one_in(3)
def test_a_mass_with_a_number_of_any_decade_moves_as_at_fifty_digits(names: str) -> None:
    """Six decades apart; next, one decade apart."""
    answered = [check(case) for case in decades({names: DECADES[names]}, of_one, 6)]
    assert sum(answered) > len(answered) / 2


def test_two_masses_with_a_number_of_any_decade_move_as_at_fifty_digits() -> None:
    assert all(check(case) for case in decades(TWO, of_two, 15))


@pytest.mark.slow
def test_numbers_of_every_second_decade_are_computed_as_at_fifty_digits() -> None:
    both = itertools.chain(decades(DECADES, of_one, 2), decades(TWO, of_two, 3))
    answered = [check(case) for case in both]
    assert sum(answered) > 0.9 * len(answered)


DETUNINGS = [10.0**-e for e in range(1, 17)]


@pytest.mark.parametrize("damping", [0.0, 1e-12, 1e-8, 1e-4])
@pytest.mark.parametrize(("start", "force"), [(1.0, 1.0), (0.0, 1.0), (1.0, 1e-6)])
def test_beats_of_nearly_equal_frequencies_lose_no_digits(
    damping: float, start: float, force: float
) -> None:
    """Down to resonance itself, where no particular motion exists."""
    for detuning in [*DETUNINGS[::3], 0.0]:
        m = one(damping=damping, constant=0.0, lines=[(1.0 + detuning, force)], lower=-0.5)
        assert check((f"{detuning}", m, vi.State((start,), (0.0,), 0.7)))


@pytest.mark.parametrize("omega", [1.0, 0.9999, 1.00001])
def test_a_resonance_of_a_machine_on_its_stops_is_no_set_that_cannot_be_compiled(
    omega: float,
) -> None:
    """With the third mass held on its stop the others have the frequency 1: modes are built as they are needed."""
    unit = np.eye(3)
    m = vi.Mechanism(
        mass=unit, damping=np.zeros((3, 3)), constant_force=(0.0, -50.0, -50.0),
        stiffness=[[2.0, -1.0, 0.0], [-1.0, 2.0, -1.0], [0.0, -1.0, 2.0]],
        forces=(vi.Harmonic(omega, (1.0, 0.0, 0.0)),),
        elements=(vi.RigidStop(tuple(unit[1]), lower=0.0, restitution=0.0),
                  vi.RigidStop(tuple(unit[2]), lower=0.0, restitution=0.0),
                  vi.RigidStop(tuple(unit[0]), upper=1e6, restitution=0.5)),
    )  # fmt: skip
    run = vi.simulate(m, vi.State((0.0, 0.1, 0.1), (0.0, 0.0, 0.0)), t_max=50.0)
    assert run.end is vi.RunEnd.HORIZON


def test_a_resonance_grows_until_it_meets_a_stop() -> None:
    """x'' + x = 2 cos t from rest is t sin t."""
    m = vi.Mechanism(
        mass=[[1.0]], damping=[[0.0]], stiffness=[[1.0]],
        elements=(vi.RigidStop((1.0,), upper=2.5 * math.pi, restitution=0.5),),
        forces=(vi.Harmonic(1.0, (0.0,), (2.0,)),),
    )  # fmt: skip
    run = vi.simulate(m, vi.State((0.0,), (0.0,)), impacts=1)
    assert run.time[0] == pytest.approx(
        2.5 * math.pi, rel=1e-14
    )  # where t sin t rises with a slope of 1


@pytest.mark.parametrize("damping", [0.0, 0.1])
@pytest.mark.parametrize("forces", [(1.0, 1.0), (1e-6, 1.0)])
def test_frequencies_far_apart_lose_no_digits(damping: float, forces: tuple[float, float]) -> None:
    """Either may be the first, whose phase the start gives: that of the other is many turns then."""
    for stiffness, e in itertools.product((0.0, 1.0), (-9, -4, 1, 6)):
        for order in (1, -1):
            lines = [(1.3, forces[0]), (10.0**e, forces[1])][::order]
            m = one(stiffness=stiffness, damping=damping, lines=lines)
            assert check((f"{e}", m, vi.State((1.0,), (0.0,), 0.7)))


def nearly_defective(apart: float) -> Iterator[Case]:
    """Critical damping; equal modes, coupled weakly; modes that meet by damping or gyroscopic forces; Jordan blocks."""
    yield "critical", one(damping=2.0 * (1.0 + apart)), vi.State((1.0,), (0.0,), 0.7)
    unit = [[1.0, 0.0], [0.0, 1.0]]
    forms = {
        "equal": ([[1.0, -apart], [-apart, 1.0]], [[0.1, 0.0], [0.0, 0.1]]),
        "equal, damped unequally": ([[1.0, -apart], [-apart, 1.0]], [[0.0, 0.0], [0.0, 0.3]]),
        "met by damping": (
            [[1.05, -0.05], [-0.05, 1.05]],
            [[0.12 + 0.1 * apart, 0.0], [0.0, 0.02]],
        ),
        "gyroscopic": ([[1.0, 0.0], [0.0, 1.0 + apart]], [[0.1, 0.2], [-0.2, 0.1]]),
        "circulatory": ([[1.0, 0.1], [-0.1 * apart, 1.0]], [[0.1, 0.0], [0.0, 0.1]]),
    }
    for name, (stiffness, damping) in forms.items():
        m = replace(two(), mass=unit, stiffness=stiffness, damping=damping)
        yield name, m, vi.State((0.2, 0.7), (0.0, 0.1), 0.7)


def test_modes_that_nearly_coincide_lose_no_digits() -> None:
    for apart in (*DETUNINGS[::5], 0.0):
        assert all(check(case) for case in nearly_defective(apart))


@pytest.mark.slow
def test_modes_and_frequencies_that_coincide_to_any_digit_lose_none() -> None:
    for apart in [sign * x for x in DETUNINGS for sign in (1.0, -1.0)]:
        assert all(check(case) for case in nearly_defective(apart))
        for damping, force in itertools.product((0.0, 1e-10, 1e-6), (1.0, 1e-3)):
            m = one(damping=damping, constant=0.0, lines=[(1.0 + apart, force)], lower=-0.5)
            assert check((f"beat {apart}", m, vi.State((1.0,), (0.0,), 0.7)))
            both = one(damping=damping, lines=[(1.3, force), (1.3 * (1.0 + apart), -1.0)])
            assert check((f"both {apart}", both, vi.State((1.0,), (0.0,), 0.7)))


@pytest.mark.parametrize("phase", [2.0**20, 2e6, -1e7, 1e16, 1e300])
def test_a_start_may_have_any_phase(phase: float) -> None:
    """The run of the phase that is left of it: whole turns of 2 pi, at 400 digits."""
    with mp.workdps(400):
        left = mp.mpf(phase) - 2 * mp.pi * mp.nint(mp.mpf(phase) / (2 * mp.pi))
        left = float(left)
    start = vi.State((1.0,), (0.0,), phase)
    run = vi.simulate(one(), start, impacts=4)
    expected = vi.simulate(one(), vi.State((1.0,), (0.0,), left), impacts=4)
    np.testing.assert_allclose(run.time, expected.time, rtol=1e-14)
    starts = vi.GridStarts({"x1": [1.0, 0.5]}, start)
    found = vi.sweep(
        one(),
        over={},
        start=starts,
        settle_periods=0.0,
        periods=1.0,
        observe=["final"],
        progress=False,
    )
    expected = vi.simulate(one(), start, t_max=2.0 * math.pi / 1.3)
    assert found.final_position.values.ravel()[0] == expected.position[-1, 0]


def test_a_run_of_lines_without_a_common_period_goes_on_after_a_million_turns() -> None:
    m = one(lines=[(1.3, 1.0), (math.sqrt(2.0), 0.5)])
    last = replace(vi.simulate(m, vi.State((1.0,), (0.0,)), impacts=4).last, phase=2e7)
    assert vi.simulate(m, last, impacts=4).end is vi.RunEnd.IMPACTS
