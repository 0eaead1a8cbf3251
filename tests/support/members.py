"""Members of an ensemble, and the records of the same motions."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

import vibroimpact as vi
from support.systems import ball, oscillator, paper_damper, random_mechanism
from vibroimpact.simulation.simulate import Status
from vibroimpact.sweeps.execution.batch import Batch, Members, batch_of, run_members
from vibroimpact.sweeps.observers.selection import resolve

Arrays = dict[str, Any]


@dataclass(frozen=True)
class Case:
    """A motion and a window of time."""

    system: Any
    state: vi.State
    settle: float
    observe: float

    @property
    def mechanism(self) -> vi.Mechanism:
        return self.system if isinstance(self.system, vi.Mechanism) else self.system.mechanism

    def record(self) -> vi.Run:
        """Every event up to the end of the window."""
        return vi.simulate(
            self.system, self.state, impacts=100_000, t_max=self.settle + self.observe
        )

    def member(self, *observers: Any, most_impacts: int = 100_000) -> Arrays:
        """What observers say of the window."""
        found = run(
            batch_of(self.system, {}), [self.state], self.settle, self.observe, observers,
            most_impacts=most_impacts,
        )  # fmt: skip
        return {name: values[0] for name, values in found.items()}


def run(
    batch: Batch, states: list[vi.State], settle: float, observe: Any, observers: Any,
    *, system: Any = 0, most_impacts: int = 100_000,
) -> Arrays:  # fmt: skip
    """Members with these starts; each may have a system and a length of its own."""
    count = len(states)
    members = Members(
        system=np.broadcast_to(system, count).astype(np.int32),
        position=np.array([s.position for s in states]),
        velocity=np.array([s.velocity for s in states]),
        phase=np.array([s.phase for s in states]),
        settle=np.full(count, settle),
        observe=np.broadcast_to(observe, count).astype(float),
        most_impacts=most_impacts,
    )
    return run_members(batch, members, resolve(list(observers)))


def alone_like(found: Arrays, i: int, system: Any, state: vi.State, length: float) -> vi.Run:
    """The motion of member i simulated alone; it ends with the member's bits."""
    run = vi.simulate(system, state, impacts=100_000, t_max=length)
    assert run.position[-1].tobytes() == found["final_position"][i].tobytes(), i
    assert run.velocity_after[-1].tobytes() == found["final_velocity"][i].tobytes(), i
    return run


def chain() -> vi.Mechanism:
    """Three masses, classically damped, with a gap between neighbours."""
    return vi.Mechanism(
        mass=[[1.0, 0.0, 0.0], [0.0, 0.5, 0.0], [0.0, 0.0, 0.7]],
        damping=[[0.05, 0.0, 0.0], [0.0, 0.0, 0.0], [0.0, 0.0, 0.0]],
        stiffness=[[1.0, 0.0, 0.0], [0.0, 0.3, 0.0], [0.0, 0.0, 0.0]],
        forces=(vi.Harmonic(0.9, (1.0, 0.0, 0.0)),),
        elements=(
            vi.RigidStop((-1.0, 1.0, 0.0), -1.0, 1.0, 0.6),
            vi.RigidStop((0.0, -1.0, 1.0), -1.0, 1.5, (0.5, 0.7)),
        ),
    )


def cases() -> dict[str, Case]:
    """Chaotic; with chatter and rest on stops; two contacts, of each flow; without forcing."""
    mixed = random_mechanism(np.random.default_rng(3), 3, contacts=2, lines=2)
    free = random_mechanism(np.random.default_rng(3), 3, contacts=2, lines=2, stiff_rank=2)
    dense = replace(free, constant_force=(0.0, 0.1, 0.0))  # which no spring holds
    at_rest = vi.State((0.0,) * 3, (0.1, 0.2, -0.1), 0.3)
    return {
        "chaotic": Case(
            paper_damper("B", 0.96, restitution=0.5), vi.State((0.0, 0.0), (0.0, 1.0)), 101.7, 200.0
        ),
        "chatter": Case(
            paper_damper("C", 0.4205, restitution=0.3),
            vi.State((0.0, 0.0), (0.0, 1.0)),
            203.3,
            300.0,
        ),
        "two contacts": Case(chain(), at_rest, 50.1, 120.0),
        "coupled": Case(mixed, at_rest, 20.1, 60.0),
        "dense": Case(dense, at_rest, 20.1, 60.0),
        "ball": Case(ball(0.9), vi.State((1.0,), (0.0,)), 1.1, 3.3),
    }


def beating() -> tuple[vi.Mechanism, Any]:
    """A mass that three forcing lines drive, far from its stops, and its motion."""
    lines = ((1.0, 0.7), (2.3, -0.4), (7.0, 0.35))

    def u(t: Any, order: int = 0) -> Any:
        return sum(-f * w ** (order - 2) * np.sin(w * t + order * np.pi / 2) for w, f in lines)

    forces = tuple(vi.Harmonic(w, (f,)) for w, f in lines)
    return oscillator(stiffness=0.0, damping=0.0, forces=forces), u


def impacts_in_window(case: Case, record: vi.Run, *statuses: Status) -> Any:
    """Which events of the record an observer sees."""
    wanted = statuses or (Status.IMPACT, Status.SIMULTANEOUS, Status.CHATTER)
    return (record.time >= case.settle) & np.isin(record.status, wanted)
