"""What the Python layer adds: a plane of two parameters against the kernel alone.

The plane is asked for as a user does (`vibroimpact.sweep`, one thread, in memory). The kernel alone
is the same members in one call of the compiled extension, everything prepared. Both must give the
same numbers, and the symbols of some points must agree with counting the impacts of `simulate`.
"""

from __future__ import annotations

import math
import time
from collections.abc import Sequence
from dataclasses import asdict, dataclass, replace
from statistics import median
from typing import Any

import numpy as np
import xarray as xr

import vibroimpact as vi
from benchmarks.case import SET_A
from benchmarks.equality import ImpactsDifferError
from vibroimpact.model.parameters import with_parameters
from vibroimpact.sweeps.execution.batch import Members, batch_of, run_members
from vibroimpact.sweeps.observers.selection import resolve
from vibroimpact.sweeps.sweep import plan_of

RANGES = {"omega": (0.9, 1.1), "half_clearance": (1.0, 10.0)}
SETTLE, PERIODS = 250, 50
LARGE = 1000  # points along each side of the plane that is extrapolated to
COUNTED = 5  # points whose impacts are counted
MOST_IMPACTS = 10**6  # of one of them: never reached


@dataclass(frozen=True, slots=True)
class Overhead:
    """A plane, one thread.

    Attributes
    ----------
    observers
        What was observed.
    side
        Points along each side.
    sweep_seconds, kernel_seconds
        Medians over the rounds.
    """

    observers: str
    side: int
    sweep_seconds: float
    kernel_seconds: float

    @property
    def ratio(self) -> float:
        """Time of the sweep over that of the kernel."""
        return self.sweep_seconds / self.kernel_seconds

    @property
    def large_seconds(self) -> float:
        """Time of a plane of `LARGE` times `LARGE` points at the same cost per point."""
        return self.sweep_seconds * (LARGE / self.side) ** 2


class _Timed:
    """A kernel that adds up the time spent in it."""

    def __init__(self, kernel: Any) -> None:
        self.kernel, self.seconds = kernel, 0.0

    def run(self, **arguments: Any) -> Any:
        begin = time.perf_counter()
        found = self.kernel.run(**arguments)
        self.seconds += time.perf_counter() - begin
        return found


class Plane:
    """Set A over frequency and clearance, from one start."""

    def __init__(self, side: int, observers: Sequence[str]) -> None:
        self.side, self.observers = side, tuple(observers)
        self.over = {name: np.linspace(*ends, side) for name, ends in RANGES.items()}
        self.damper = vi.ImpactDamper(**asdict(SET_A))
        self.start = vi.State((0.0, 0.0), (0.0, 1.0))

    def swept(self) -> xr.Dataset:
        """Return the dataset of the sweep."""
        return vi.sweep(
            self.damper, over=self.over, start=self.start, observe=list(self.observers),
            settle_periods=SETTLE, periods=PERIODS, workers=1, progress=False,
        )  # fmt: skip

    def kernel_alone(self) -> tuple[dict[str, Any], float]:
        """Return what the kernel finds, and the seconds in it."""
        mesh = np.meshgrid(*self.over.values(), indexing="ij")
        batch = batch_of(self.damper, dict(zip(self.over, map(np.ravel, mesh), strict=True)))
        kernels = tuple(_Timed(kernel) for kernel in batch.kernels)
        plan = plan_of(
            self.damper, self.over, self.start, list(self.observers), None, SETTLE, PERIODS, None
        )
        period, count = 2.0 * math.pi / batch.omega, batch.count
        members = Members(
            system=np.arange(count, dtype=np.int32),
            position=np.tile(self.start.position, (count, 1)),
            velocity=np.tile(self.start.velocity, (count, 1)),
            phase=np.full(count, self.start.phase),
            settle=SETTLE * period,
            observe=PERIODS * period,
            most_impacts=plan.window.most_impacts,
        )
        timed: Any = replace(batch, kernels=kernels)
        found = run_members(timed, members, resolve(list(self.observers)))
        return found, sum(kernel.seconds for kernel in kernels)

    def system_at(self, i: int, j: int) -> Any:
        """Return the damper of one point."""
        names = zip(self.over, (i, j), strict=True)
        return with_parameters(self.damper, {name: float(self.over[name][k]) for name, k in names})


def assert_same(plane: Plane) -> None:
    """Raise `ImpactsDifferError` unless sweep and kernel agree, and symbols with `simulate`."""
    swept, (kernel, _) = plane.swept(), plane.kernel_alone()
    for name, values in kernel.items():
        found = swept[name].values.reshape(values.shape)
        if not np.array_equal(found, values, equal_nan=values.dtype.kind == "f"):
            raise ImpactsDifferError(f"{name}: the sweep differs from the kernel alone")
    periodic = np.argwhere(swept["n"].values > 0)
    for i, j in periodic[:: max(1, len(periodic) // COUNTED)][:COUNTED]:
        at = swept.isel(omega=i, half_clearance=j)
        expected = [int(at[name]) * PERIODS / int(at["n"]) for name in ("p", "q")]
        counted = _impacts(plane, plane.system_at(i, j))
        if any(abs(e - c) > int(at["n"]) for e, c in zip(expected, counted, strict=True)):
            raise ImpactsDifferError(f"{at.coords}: {expected} impacts expected, {counted} counted")


def _impacts(plane: Plane, system: Any) -> list[int]:
    """Count the impacts at stops A and B in the observed periods, with `simulate`."""
    end = (SETTLE + PERIODS) * system.period
    run = vi.simulate(system, plane.start, impacts=MOST_IMPACTS, t_max=end)
    late = run.impacts & (run.time > SETTLE * system.period)
    return [int(np.count_nonzero(run.side[late] == side)) for side in (1, -1)]


def measure(side: int, observers: Sequence[str], rounds: int) -> Overhead:
    """Assert equal results, then time sweep and kernel in turn."""
    plane, spent = Plane(side, observers), []
    assert_same(plane)
    for _ in range(rounds):
        begin = time.perf_counter()
        plane.swept()
        spent.append((time.perf_counter() - begin, plane.kernel_alone()[1]))
    sweep, kernel = (median(column) for column in zip(*spent, strict=True))
    return Overhead(", ".join(observers), side, sweep, kernel)


def table(rows: Sequence[Overhead]) -> str:
    """Format the planes."""
    lines = [
        f"{'observed':20} {'points':>9} {'sweep s':>9} {'kernel s':>9} {'ratio':>6} "
        f"{LARGE} x {LARGE} s"
    ]
    lines += [
        f"{row.observers:20} {f'{row.side} x {row.side}':>9} {row.sweep_seconds:9.3g} "
        f"{row.kernel_seconds:9.3g} {row.ratio:6.3f} {row.large_seconds:11.3g}"
        for row in rows
    ]
    return "\n".join(lines)
