"""Energies of a simulated motion: what forces put in, what dashpots and stops take out.

Method      Integrals of products along the flights (flights.py): of a force f that acts along a row b
                input = integral of f b . v,                                                    (1)
            taken by a contact or element = -(1) of its force; an impact takes kinetic energy, too:
                (v . M v before - v . M v after) / 2,                                           (2)
            dashpots = integral of v . C v,    stored = v . M v / 2 + x . K x / 2 - f0 . x.          (3)
            A soft stop holds back part of what it takes while it is pressed.
Accuracy    rounding
Fails       phase switches, and matrices K that are not symmetric, do work that is not counted:
            it is the balance that is left
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np

from vibroimpact._core.types import Floats
from vibroimpact.measures.flights import Dual, Flights, Signal
from vibroimpact.model.mechanism import Mechanism
from vibroimpact.simulation.simulate import Run


@dataclass(frozen=True)
class Energies:
    """Energies of a motion from its start to its end.

    Attributes
    ----------
    start, end
        Stored energy, kinetic and potential, at the start and at the end.
    input
        Work of the forces.
    dashpots
        Energy that the dashpots take.
    parts
        Energy that each contact and element takes, numbered as in ``run.contact``: impacts, friction,
        soft stops.
    """

    start: float
    end: float
    input: float
    dashpots: float
    parts: tuple[float, ...]

    @property
    def dissipated(self) -> float:
        """Energy taken by dashpots, contacts and elements."""
        return self.dashpots + sum(self.parts)

    @property
    def balance(self) -> float:
        """Start + input - dissipated - end: zero to rounding where all forces are counted."""
        return self.start + self.input - self.dissipated - self.end


def energies_of(
    run: Run, flights: Flights, m: Mechanism, inputs: Sequence[tuple[Floats, Floats]] = ()
) -> Energies:
    """Energies of a run to its end.

    Parameters
    ----------
    run, flights
        The run and its flights.
    m
        Mechanism of the machine itself: the first of the coordinates of the run.
    inputs
        Further forces as pairs of rows over the coordinates of the run: the force is the first
        row . x, and acts along the second.
    """
    rows, n = flights.rows, m.degrees
    span = float(flights.durations.sum())

    def speed(along: Floats) -> Signal:
        return flights.signal(lambda code: rows.moved(code, along, 1))

    def work(force: Signal, along: Floats) -> float:
        return span * float(force.mean_product(speed(along)).value[0])

    wide = np.eye(rows.mechanism.degrees)
    put_in = sum(work(_along(flights, force), along) for force, along in inputs)
    for i in range(n):
        if any(line.sine[i] or line.cosine[i] for line in m.forces):
            put_in += work(flights.signal(partial(_line_force, flights, i)), wide[i])
    damping = np.array(m.damping)
    speeds = [speed(wide[i]) for i in range(n)]
    dashpots = sum(
        damping[i, j] * span * float(speeds[i].mean_product(speeds[j]).value[0])
        for i, j in np.argwhere(damping)
    )
    taken = _impact_losses(run, m)
    for number, e in enumerate(rows.mechanism.elements):
        if e.row:
            force = flights.signal(partial(rows.force, part=number))
            taken[number] -= work(force, np.array(e.row))
    first = np.array(run.start.position)[:n], np.array(run.start.velocity)[:n]
    last = (run.position[-1, :n], run.velocity_after[-1, :n]) if len(run) else first
    return Energies(
        _stored(m, *first), _stored(m, *last), float(put_in), float(dashpots), tuple(taken)
    )


def _along(flights: Flights, row: Floats) -> Signal:
    return flights.signal(lambda code: flights.rows.moved(code, row, 0))


def _line_force(flights: Flights, coordinate: int, _: int) -> Dual:
    """Harmonic force on a coordinate, as a row on Y."""
    m, size = flights.rows.mechanism, flights.rows.size
    row = np.zeros((1, size + 1))
    for number, line in enumerate(m.forces):
        at = 2 * (m.degrees + number)
        row[:, at], row[:, at + 1] = line.sine[coordinate], line.cosine[coordinate]
    return Dual(row, np.zeros_like(row))


def _impact_losses(run: Run, m: Mechanism) -> list[float]:
    """Work (2) of each contact and element."""
    n, mass = m.degrees, np.array(m.mass)
    before, after = run.velocity_before[:, :n], run.velocity_after[:, :n]
    lost = np.einsum("ki,ij,kj->k", before - after, mass, before + after) / 2.0
    found = np.zeros(len(m.elements))
    met = run.contact >= 0
    np.add.at(found, run.contact[met], lost[met])
    return [float(x) for x in found]


def _stored(m: Mechanism, x: Floats, v: Floats) -> float:
    """Energy (3) that the machine stores in a state."""
    return float(
        v @ np.array(m.mass) @ v / 2.0 + x @ np.array(m.stiffness) @ x / 2.0
        - np.array(m.constant_force) @ x
    )  # fmt: skip
