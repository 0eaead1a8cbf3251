"""``python -m benchmarks.gpu``: members on a CUDA device beside this processor.

Equal bits are asserted before anything is timed. Two ensembles: one damper from many starts, whose
tables all threads read, and as many dampers as members, each with tables of its own. Timed is the
kernel that runs the members, and beside it the whole call: copies, building, results.
"""

from __future__ import annotations

import argparse
import json
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import asdict, dataclass, field
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

import vibroimpact as vi
from benchmarks import machine, operations
from benchmarks.case import SET_A, Floats, random_starts
from benchmarks.ensemble_run import WINDOW, assert_all_had_their_impacts
from benchmarks.equality import ImpactsDifferError
from vibroimpact.compile.many_systems import RunsOf
from vibroimpact.compile.tables import Stacks
from vibroimpact.sweeps.execution.batch import Members, batch_of, run_members
from vibroimpact.sweeps.execution.cuda.batch import Machine, Memory
from vibroimpact.sweeps.execution.cuda.card import Card, open_card
from vibroimpact.sweeps.execution.cuda.program import Kernels, cuda_core
from vibroimpact.sweeps.execution.cuda_backend import runs_on
from vibroimpact.sweeps.observers.observer import Final

Values = dict[str, Floats]

COMPARED = 4096  # members whose bits are compared
COUNTED_STARTS = 8  # of which operations are counted
PEAK_THREADS = 2**20
PEAK_FUSED = 8 * 16384  # per thread: chains and steps of peak.cu
NEAR = 0.02  # relative width of the parameters of many dampers: all of them impact


@dataclass
class Timed:
    """A machine whose launches are timed, by name of the kernel."""

    machine: Machine
    seconds: dict[str, float] = field(default_factory=dict)

    def free(self) -> int:
        """Bytes of memory that are free."""
        return self.machine.free()

    @contextmanager
    def memory(self) -> Iterator[Memory]:
        """Memory for one piece of work."""
        with self.machine.memory() as memory:
            yield TimedMemory(memory, self.seconds)


class TimedMemory:
    """A ``Memory`` whose launches are timed."""

    def __init__(self, memory: Memory, seconds: dict[str, float]) -> None:
        self._seconds, self._launch = seconds, memory.launch
        self.put, self.room, self.get = memory.put, memory.room, memory.get

    def launch(self, kernels: Kernels, name: str, threads: int, argument: int) -> None:
        """Run so many threads of a kernel with an address, and wait for them."""
        begin = time.perf_counter()
        self._launch(kernels, name, threads, argument)
        self._seconds[name] = self._seconds.get(name, 0.0) + time.perf_counter() - begin


def damper() -> vi.ImpactDamper:
    """The damper of the benchmarks."""
    return vi.ImpactDamper(**asdict(SET_A))


def ensembles(count: int, rng: np.random.Generator) -> dict[str, Values]:
    """Parameters of the dampers, by what the ensemble is called."""
    near = {
        name: getattr(SET_A, name) * (1.0 + NEAR * rng.uniform(-1.0, 1.0, count))
        for name in ("omega", "half_clearance")
    }
    return {"one damper": {}, "as many dampers": near}


def members_of(starts: Floats, values: Values, impacts: int) -> Members:
    """Members that end at an impact."""
    count = len(starts)
    position = starts[:, 0:2].copy()
    if values:  # on the stop of its own damper
        position[:, 1] = position[:, 0] + values["half_clearance"]
    return Members(
        system=(np.arange(count) if values else np.zeros(count)).astype(np.int32),
        position=position,
        velocity=starts[:, 2:4].copy(),
        phase=starts[:, 4].copy(),
        settle=np.zeros(count),
        observe=np.full(count, WINDOW),
        most_impacts=impacts,
    )


def assert_equal_bits(values: Values, members: Members, runs: RunsOf) -> None:
    """Run some members on the device and on this processor.

    Raises
    ------
    ImpactsDifferError
        One of their results differs in a bit.
    """
    rows = np.arange(min(COMPARED, len(members.system)))
    some, few = members.of(rows, members.system[rows]), {n: x[rows] for n, x in values.items()}
    here = run_members(batch_of(damper(), few), some, (Final(),))
    there = run_members(batch_of(damper(), few, runs), some, (Final(),))
    for name, one in here.items():
        if one.tobytes() != there[name].tobytes():
            different = int(np.sum(one != there[name]))
            raise ImpactsDifferError(f"{name}: {different} numbers of the device differ")


def measure(
    name: str, values: Values, starts: Floats, impacts: int, rounds: int, device: Machine
) -> dict[str, Any]:
    """Impacts per second of one ensemble: on the device, in a whole call, on one core."""
    timed = Timed(device)
    runs = partial(runs_on, timed)
    members = members_of(starts, values, impacts)
    assert_equal_bits(values, members, runs)
    batch, total = batch_of(damper(), values, runs), impacts * len(starts)
    kernel, call = list[float](), list[float]()
    for _ in range(rounds):
        timed.seconds.clear()
        begin = time.perf_counter()
        assert_all_had_their_impacts(run_members(batch, members, ()))
        call.append(time.perf_counter() - begin)
        kernel.append(timed.seconds["run"])
    return {
        "ensemble": name,
        "device": total / float(np.median(kernel)),
        "whole call": total / float(np.median(call)),
        "one core": _on_one_core(values, members, impacts),
    }


@machine.one_core()
def _on_one_core(values: Values, members: Members, impacts: int) -> float:
    """Impacts per second of one core of this processor, from some of the members."""
    rows = np.arange(min(COMPARED, len(members.system)))
    some: NDArray[np.int32] = members.system[rows]
    few = {n: x[rows] for n, x in values.items()}
    batch = batch_of(damper(), few, Stacks.kernel)
    begin = time.perf_counter()
    assert_all_had_their_impacts(run_members(batch, members.of(rows, some), ()))
    return impacts * len(rows) / (time.perf_counter() - begin)


def peak(card: Card) -> float:
    """Operations per second that the card reaches, a fused one counted as two."""
    core = cuda_core()
    source = Path(__file__).with_name("peak.cu").read_text()
    options = core.ProgramOptions(std="c++20", arch=card.arch)
    code = bytes(core.Program(source, "c++", options).compile("cubin").code)
    kernel = card.load(code).get_kernel("peak")
    with card.memory() as memory:
        address = memory.room(8 * PEAK_THREADS)
        card.start(kernel, PEAK_THREADS, address)
        begin = time.perf_counter()
        card.start(kernel, PEAK_THREADS, address)
        return 2.0 * PEAK_THREADS * PEAK_FUSED / (time.perf_counter() - begin)


def parse(argv: Sequence[str] | None) -> argparse.Namespace:
    """Parse the command line."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.gpu", description=__doc__)
    parser.add_argument("--members", type=int, default=2**20, help="members of each ensemble")
    parser.add_argument("--impacts", type=int, default=500, help="impacts per member")
    parser.add_argument("--rounds", type=int, default=5, help="the median is printed")
    parser.add_argument("--seed", type=int, default=20, help="seed of starts and dampers")
    parser.add_argument("--json", type=Path, help="also write the numbers to this file")
    return parser.parse_args(argv)


def main(argv: Sequence[str] | None = None) -> int:
    """Measure, and print the card, its driver and the numbers."""
    options = parse(argv)
    card = open_card()
    about = {"card": card.name, "architecture": card.arch, "CUDA of the driver": card.driver}
    about |= machine.describe()
    print("\n".join(f"{key}: {value}" for key, value in about.items()))
    rng = np.random.default_rng(options.seed)
    starts, top = random_starts(SET_A, options.members, rng), peak(card)
    work = operations.per_impact(starts[:COUNTED_STARTS], SET_A, options.impacts)
    print(f"peak: {top:.3g} operations per second; {work:.0f} operations per impact")
    rows = [
        measure(name, values, starts, options.impacts, options.rounds, card)
        for name, values in ensembles(options.members, rng).items()
    ]
    for row in rows:
        print(
            f"{row['ensemble']}: {row['device']:.3g} impacts per second, "
            f"{row['device'] * work / top:.1%} of the peak, "
            f"{row['device'] / row['one core']:.0f} x one core; "
            f"whole call {row['whole call']:.3g}"
        )
    if options.json:
        found = {"machine": about, "peak": top, "operations": work, "rows": rows}
        options.json.write_text(json.dumps(found, indent=2) + "\n")
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
