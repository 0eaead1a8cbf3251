"""``tests/cpp/engine_test.cpp`` as tests run it: its systems, their starts, and what they come to."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING

import numpy as np

import vibroimpact as vi
from support.builds import BUILDS, output
from support.system_file import system_text
from vibroimpact import _cpu

if TYPE_CHECKING:
    from pathlib import Path

SEED = 20211121
SETS = {  # parameter sets of the founding paper: chaotic, with chatter and sticking
    "A": ({"mass_ratio": 0.1, "omega_n": 0.5, "zeta": 0.045, "restitution": 0.8}, 5.0, 0.970453),
    "B": ({"mass_ratio": 0.04, "omega_n": 0.6, "zeta": 0.025, "restitution": 0.7}, 8.0, 0.9386),
    "C": ({"mass_ratio": 0.05092, "omega_n": 1.0, "zeta": 0.015, "restitution": 0.7}, 6.0, 0.4205),
    # soon steady: flights are repeated
    "A, steady": ({"mass_ratio": 0.1, "omega_n": 0.5, "zeta": 0.045, "restitution": 0.8}, 5.0, 1.2),
}


COUPLED = "coupled"  # as large as the damper


def system_of(name: str) -> vi.Mechanism:
    """One of the sets at one of its frequencies, or two masses that dashpots couple."""
    if name == COUPLED:
        return vi.Mechanism(
            mass=[[1.0, 0.0], [0.0, 0.6]],
            damping=[[0.12, -0.02], [-0.02, 0.03]],
            stiffness=[[2.0, -0.8], [-0.8, 1.2]],
            forces=(vi.Harmonic(0.8, (1.0, 0.3)),),
            elements=(vi.RigidStop((0.0, 1.0), -0.5, 0.5, 0.7),),
        )
    rest, half_clearance, omega = SETS[name]
    return vi.ImpactDamper(**rest, half_clearance=half_clearance, omega=omega).mechanism


def starts_of(name: str, count: int) -> list[vi.State]:
    """Seeded starts: on stop A, leaving it, or about the middle."""
    rng = np.random.default_rng(SEED)
    if name == COUPLED:
        return [
            vi.State(tuple(x), tuple(v), phase)
            for x, v, phase in zip(
                rng.normal(0.0, 0.05, (count, 2)),
                rng.normal(0.0, 1.0, (count, 2)),
                rng.uniform(0.0, 6.28, count),
                strict=True,
            )
        ]
    rest, half_clearance, omega = SETS[name]
    damper = vi.ImpactDamper(**rest, half_clearance=half_clearance, omega=omega)
    return [
        damper.on_stop("A", x1=x1, v1=v1, v2=v1 - leave, phase=phase)
        for x1, v1, leave, phase in zip(
            rng.normal(0.0, 1.0, count),
            rng.normal(0.0, 1.0, count),
            rng.exponential(2.0, count),
            rng.uniform(0.0, 6.28, count),
            strict=True,
        )
    ]


def run(folder: Path, build: str, name: str, what: str, events: int, starts: int = 16) -> str:
    """What engine_test says about one set."""
    file = folder / f"{name}-{starts}.txt"
    if not file.exists():
        file.write_text(system_text(system_of(name), starts_of(name, starts)))
    mixed = (
        name == COUPLED or build == "gcc, neon"
    )  # where it is built anyway, it runs the others, too
    program = "engine_test_mixed" if mixed else "engine_test"
    return output(folder, program, build, str(file), what, str(events))


# FNV-1a of 16 starts of 400 events each: a change means other bits, to be announced as breaking.
GOLDEN = {"A": "5b8883dfc378ab1f", "B": "8ae3a4916f5cfbb3", "C": "fa94d54b65692dc1",
          "A, steady": "45ca182198039713", COUPLED: "67dfbdb09bc58510"}  # fmt: skip
LANES = {"avx512": "8", "avx2": "4", "baseline": "2"}  # that a register has


def lanes_of(build: str) -> list[str]:
    """What packs it compiles: as wide as its registers."""
    return [LANES[_cpu.supported()[0] if build == "clang" else BUILDS[build].target]]


def check_lanes(said: str, build: str, name: str) -> None:
    """Packs of all widths that a build has gave the bits of single runs, with and without tangents."""
    for what in ("lanes", "tangents"):
        found = re.findall(rf"{what} (\d) equal, statuses (\d+)", said)
        assert [lanes for lanes, _ in found] == lanes_of(build)
        if name == "C":  # chatter (bit 2), stick (3) and release (4) happened in the lanes too
            assert all(int(statuses) & 0b11100 == 0b11100 for _, statuses in found)
