"""Symmetries of a machine: signed permutations of coordinates and elements that leave its equations as they are.

Method      The image of a motion x(theta) is y(theta) = G x(theta - turn) + c, G a signed permutation; a motion if
                G commutes with M, C and K,   K c = f0 - G f0,                                        (1)
                every force line of the amplitude A, in units of exp(i theta), has  G A = exp(i q turn) A,     (2)
                q being its frequency over that of the first line, and if every element k becomes an element j of the
                same kind: row_j G = s row_k, s = 1 or -1, with the limits of k, exchanged where s = -1, less
                s row_j c, and with motions as in (2).                                                (3)
            Signed permutations are found entry by entry, by (1); turn from the first line that acts, by (2); c
            from (1) and (3), by least squares.
Assumes     elements that are stops, or friction with a constant load
Accuracy    numbers that differ by SAME of the largest of their kind are equal
Fails       never: what is not understood has no symmetries
Reference   theory.md, (T82)
"""

from __future__ import annotations

import cmath
import itertools
import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np

from vibroimpact._core.scalars import is_infinite
from vibroimpact._core.types import Complexes, Floats
from vibroimpact.model.elements.element import Element
from vibroimpact.model.harmonic import Harmonic, by_frequency
from vibroimpact.model.mechanism import Mechanism, as_array
from vibroimpact.model.stop import Stop
from vibroimpact.model.system import System, mechanism_of

SAME = 2.0**-40
MOST_MATCHES = 256  # pairings of elements that are tried for one permutation of coordinates
MOST_CYCLES = 24  # of the first line, over which the phase is looked for


@dataclass(frozen=True)
class Symmetry:
    """Symmetry of a machine: the image of a motion x(theta) is +-x_j(theta - turn) + shift_i at coordinate i.

    Attributes
    ----------
    coordinates
        Of each coordinate i of the image j + 1, or -(j + 1) where the sign changes, shape (n,).
    shift
        What is added to each coordinate, shape (n,).
    elements
        Of each element k of the machine j + 1 if it becomes element j, or -(j + 1) where the sides are exchanged.
    turn
        Phase of the first forcing line by which the image is later, in radians from 0; 0 without forcing.
    """

    coordinates: tuple[int, ...]
    shift: tuple[float, ...]
    elements: tuple[int, ...]
    turn: float

    @property
    def source(self) -> list[int]:
        """Number j of each coordinate of the image."""
        return [abs(j) - 1 for j in self.coordinates]

    @property
    def signs(self) -> Floats:
        """Sign of each coordinate of the image."""
        signs: Floats = np.sign(np.array(self.coordinates, dtype=float))
        return signs

    @property
    def is_mirror(self) -> bool:
        """Whether every coordinate is its own image with the other sign, about a centre."""
        return self.coordinates == tuple(-(i + 1) for i in range(len(self.coordinates)))

    @property
    def is_involution(self) -> bool:
        """Whether the image of the image is the motion itself, whole periods later."""
        return all(
            numbers[abs(j) - 1] * (1 if j > 0 else -1) == i + 1
            for numbers in (self.coordinates, self.elements)
            for i, j in enumerate(numbers)
        )

    def stop(self, stop: Stop) -> Stop:
        """Stop at which the image of an impact is."""
        if not 0 <= stop.contact < len(self.elements):  # a phase
            return stop.opposite
        j = self.elements[stop.contact]
        return Stop(abs(j) - 1, stop.side if j > 0 else -stop.side)

    def change(self, changes: Floats) -> Floats:
        """Images of changes of (x, v, theta) in rows."""
        n, source, out = len(self.coordinates), self.source, changes.copy()
        for first in (0, n):
            out[:, first : first + n] = self.signs * changes[:, [first + j for j in source]]
        return out

    def image(self, states: Floats, later: float) -> Floats:
        """Images of states (x, v, theta) in rows, later by a phase."""
        out = self.change(states)
        out[:, : len(self.shift)] += self.shift
        out[:, -1] += later
        return out

    def __str__(self) -> str:
        names = [f"{'-' if j < 0 else ''}x{abs(j)}" for j in self.coordinates]
        moved = [
            f"{name} + {c:.9g}" if c else name for name, c in zip(names, self.shift, strict=True)
        ]
        later = f", {self.turn / math.pi:.9g} pi later" if self.turn else ""
        return (
            f"({', '.join(f'x{i + 1}' for i in range(len(moved)))}) -> ({', '.join(moved)}){later}"
        )


def symmetries(system: System) -> tuple[Symmetry, ...]:
    """Find the symmetries of a machine, without the identity.

    Parameters
    ----------
    system
        A machine, a mechanism or a family of them.

    Returns
    -------
    tuple of Symmetry
        One for each signed permutation of coordinates, first that which changes every sign; none of a machine with
        elements of which none are known here: phase switches, friction whose load varies.

    Notes
    -----
    Cost: some ms for two coordinates; permutations are built entry by entry, and given up at the first entry that
    K, C or M refuses.

    Examples
    --------
    >>> import vibroimpact as vi
    >>> stop = vi.RigidStop((1.0,), lower=-1.0, upper=3.0, restitution=0.7)
    >>> m = vi.Mechanism(mass=[[1.0]], damping=[[0.1]], stiffness=[[2.0]], elements=(stop,),
    ...                  constant_force=(2.0,), forces=(vi.Harmonic(1.0, (1.0,)),))
    >>> [str(symmetry) for symmetry in vi.symmetries(m)]
    ['(x1) -> (-x1 + 2), 1 pi later']
    """
    return symmetries_of(mechanism_of(system))


@lru_cache(maxsize=64)
def symmetries_of(m: Mechanism) -> tuple[Symmetry, ...]:
    """Symmetries of a mechanism."""
    if any(e.mirrored is None for e in m.elements):
        return ()
    matrices = [as_array(part) for part in (m.mass, m.damping, m.stiffness)]
    found = (
        symmetry
        for numbers in _permutations(matrices, m.degrees, ())
        if (symmetry := _symmetry(m, numbers)) is not None
    )
    return tuple(sorted(found, key=lambda symmetry: not symmetry.is_mirror))


def _permutations(
    matrices: Sequence[Floats], n: int, begun: tuple[int, ...]
) -> Iterator[tuple[int, ...]]:
    """Signed permutations that commute with matrices, but for the identity (1)."""
    i = len(begun)
    if i == n:
        if begun != tuple(range(1, n + 1)):
            yield begun
        return
    taken = {abs(j) for j in begun}
    for j in (
        number * sign for number in range(1, n + 1) if number not in taken for sign in (1, -1)
    ):
        here = (*begun, j)
        source, signs = [abs(k) - 1 for k in here], np.sign(here)
        if all(
            _same(signs[i] * signs * a[source[i], source], a[i, : i + 1], a)
            and _same(signs[i] * signs * a[source, source[i]], a[: i + 1, i], a)
            for a in matrices
        ):
            yield from _permutations(matrices, n, here)


def _same(one: Any, other: Any, of: Any) -> bool:
    """Whether numbers are equal, relative to the largest of some numbers."""
    return bool(np.all(np.abs(np.subtract(one, other)) <= SAME * np.abs(of).max(initial=0.0)))


def _symmetry(m: Mechanism, numbers: tuple[int, ...]) -> Symmetry | None:
    """The symmetry with a signed permutation; None where there is none."""
    g = np.zeros((m.degrees, m.degrees))
    for i, j in enumerate(numbers):
        g[i, abs(j) - 1] = math.copysign(1.0, j)
    for matches in itertools.islice(_matches(m, g), MOST_MATCHES):
        turn = _turn(m, g, matches)
        shift = None if turn is None else _shift(m, g, matches)
        if turn is not None and shift is not None:
            elements = [0] * len(matches)
            for j, (k, s) in enumerate(matches):
                elements[k] = s * (j + 1)
            return Symmetry(numbers, tuple(shift.tolist()), tuple(elements), turn)
    return None


Match = tuple[int, int]  # (k, s) of (3), for an element j


def _matches(m: Mechanism, g: Floats) -> Iterator[tuple[Match, ...]]:
    """Pairings (3) of all elements by kind, row and numbers other than limits and motions."""
    candidates = [
        [
            (k, s)
            for k, other in enumerate(m.elements)
            for s in (1, -1)
            if _same(np.array(e.row) @ g, s * np.array(other.row), e.row) and _alike(e, other, s)
        ]
        for e in m.elements
    ]
    for chosen in itertools.product(*candidates):
        if len({k for k, _ in chosen}) == len(chosen):
            yield chosen


def _alike(e: Element, other: Element, s: int) -> bool:
    """Whether the numbers of element e are those of another one, its sides exchanged where s is -1."""
    if type(e) is not type(other) or e.damping_law != other.damping_law:
        return False
    pairs = zip(e.mirrored or (), other.mirrored or (), strict=True)
    return all(_same(here, there[::s], here) for here, there in pairs)


def _limits(e: Any) -> tuple[float, float]:
    """Lower and upper limit of a stop."""
    return e.lower, e.upper


def _amplitudes(lines: Iterable[Harmonic]) -> dict[float, Complexes]:
    """Amplitudes A of lines by frequency: the real part of A exp(i omega t)."""
    return {
        omega: np.array(line.cosine) - 1j * np.array(line.sine)
        for omega, line in by_frequency(lines).items()
    }


def _turn(m: Mechanism, g: Floats, matches: Sequence[Match]) -> float | None:
    """Phase (2) that all lines have; None where there is none."""
    forces = _amplitudes(m.forces)
    lines = [(omega / m.omega, g @ a, a) for omega, a in forces.items()]
    for j, (k, s) in enumerate(matches):
        here, there = (_amplitudes(m.elements[i].motion) for i in (j, k))
        if here.keys() != there.keys():
            return None
        lines += [(omega / m.omega, s * there[omega], here[omega]) for omega in here]
    acting = [(q, b, a) for q, b, a in lines if np.abs(a).max() > 0.0 or np.abs(b).max() > 0.0]
    if not acting:
        return 0.0
    q, b, a = acting[0]
    first = cmath.phase(complex(np.vdot(a, b))) % (2.0 * math.pi)
    for wound in range(math.ceil(MOST_CYCLES * q)):
        turn = (first + 2.0 * math.pi * wound) / q
        if all(_same(b, cmath.exp(1j * q * turn) * a, a) for q, b, a in acting):
            return float(turn)
    return None


def _shift(m: Mechanism, g: Floats, matches: Sequence[Match]) -> Floats | None:
    """C of (1) and (3); None where there is none."""
    k, f0 = as_array(m.stiffness), np.array(m.constant_force or np.zeros(m.degrees), dtype=float)
    rows, wanted, sizes = [*k], [*(f0 - g @ f0)], [float(np.abs(f0).max(initial=0.0))] * len(k)
    for j, (other, s) in enumerate(matches):
        e = m.elements[j]
        if not e.is_stop:
            continue
        here, there = (_limits(stop) for stop in (e, m.elements[other]))
        for mine, its in zip(here, there[::s], strict=True):
            if is_infinite(mine) != is_infinite(its):
                return None
            if not is_infinite(mine):
                rows.append(np.array(e.row))
                wanted.append(mine - s * its)
                sizes.append(max(abs(mine), abs(its)))
    matrix, right = np.array(rows), np.array(wanted)
    lengths = np.linalg.norm(matrix, axis=1)
    lengths[lengths == 0.0] = 1.0
    c = np.linalg.lstsq(matrix / lengths[:, None], right / lengths, rcond=None)[0]
    play = SAME * (np.array(sizes) + np.abs(matrix) @ np.abs(c))
    if np.any(np.abs(matrix @ c - right) > play):
        return None
    c[np.abs(c) <= SAME * max(sizes, default=0.0) / lengths.min()] = 0.0
    return np.asarray(c)
