"""The attractors that the members of an ensemble end on: labelled, named, counted.

Method      The first member without a label is classified (:func:`vibroimpact.classify`) from its
            final state; the points of that attractor are compared with the last section points of
            every member without one (matching.py); and so on until all are labelled. An attractor
            whose own points lie on a known one of its kind and type is that one: its member was
            still on the way there, as others may be, so that all without a label go on from where
            they ended, 8, then 64 times as long, and are compared once more.
            Members that do not impact share a label, one for each set of stops that they rest on;
            those in flight go on before: a free mass may drift slowly towards its next impact.
            Members that impact, but not on the section, share one per symbol.
Assumes     members of one system
Accuracy    that of matching.py
Fails       after ``most`` classifications the members left have the label of "not matched"
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, field, replace
from string import ascii_lowercase
from typing import NamedTuple

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from vibroimpact.attractors import Attractor, classify
from vibroimpact.ensembles.matching import TOLERANCE, Known, known, proportional, scale_of
from vibroimpact.ensembles.motions import NO_IMPACTS, flags, motions, symbol, symbols_of
from vibroimpact.ensembles.states import States
from vibroimpact.iterates import Kind
from vibroimpact.motion import Stop
from vibroimpact.sections import Scale
from vibroimpact.simulate import System, mechanism_of
from vibroimpact.state import STATE, State

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]

Longer = Callable[[States, int], xr.Dataset]  # members that go on, so many times as long

NOT_MATCHED = -1
FLYING = "no impacts"
LONGER, OFTEN = 8, 2  # times as long each time, and how many times
UNIT = 64.0 * np.finfo(float).eps  # a stop and a state on it agree within so much of their size


@dataclass(frozen=True)
class Found:
    """An attractor of an ensemble.

    Attributes
    ----------
    kind
        "periodic", "quasiperiodic", "chaotic", "undecided", "without impacts".
    word
        Its name without the letter: n-p-q, or the kind.
    state
        A state on it.
    exponent
        Largest Lyapunov exponent per unit of time; nan where there is none.
    attractor
        What ``classify`` said, if it was asked.
    """

    kind: str
    word: str
    state: State
    exponent: float = float("nan")
    attractor: Attractor | None = field(default=None, repr=False)


@dataclass
class Labels:
    """Labels of members, filled step by step."""

    values: Integers
    found: list[Found] = field(default_factory=list)

    @property
    def left(self) -> NDArray[np.intp]:
        """The members without a label."""
        return np.flatnonzero(self.values == NOT_MATCHED)

    def add(self, found: Found, members: NDArray[np.intp]) -> int:
        """A new attractor with its members; its label."""
        self.values[members] = len(self.found)
        self.found.append(found)
        return len(self.found) - 1

    def join(self, found: Found, members: NDArray[np.intp]) -> None:
        """Members of an attractor that is known by its kind and its word, or is new."""
        key = found.kind, found.word
        same = (i for i, one in enumerate(self.found) if (one.kind, one.word) == key)
        label = next(same, None)
        if label is None:
            self.add(found, members)
        else:
            self.values[members] = label


def labelled(
    system: System, members: xr.Dataset, longer: Longer, *, contact: int, stop: Stop,
    tolerance: float = TOLERANCE, most: int = 64,
) -> tuple[xr.DataArray, tuple[Found, ...], States]:  # fmt: skip
    """Label the attractor of every member; label 0 has the most members.

    Parameters
    ----------
    system
        What the members are motions of.
    members
        With the observers section, symbol, impacts and final.
    longer
        Runs members with the same observers from where they ended.
    contact, stop
        The section.
    tolerance
        Relative distance below which two periodic members are one orbit.
    most
        Classifications.

    Returns
    -------
    DataArray
        Labels with the dims of ``end``, -1 where not matched, below it an outcome; meanings in
        ``flag_values`` and ``flag_meanings``.
    tuple of Found
        The attractors in the order of the labels.
    States
        Where every member ended, in the order of ``end``; those that went on, after that.
    """
    table = _flown(Table.of(system, members), longer, most)
    labels = Labels(np.where(table.codes < NO_IMPACTS, table.codes, NOT_MATCHED))
    _by_words(labels, table)
    table = _by_classes(labels, table, longer, contact, stop, tolerance, most)
    return *_coded(labels, motions(members)), States(table.position, table.velocity, table.phase)


@dataclass(frozen=True)
class Table:
    """What the matching looks at, one row per member."""

    system: System
    scale: Scale
    codes: Integers
    points: Floats
    symbols: Integers
    position: Floats
    velocity: Floats
    phase: Floats

    @classmethod
    def of(cls, system: System, members: xr.Dataset, scale: Scale | None = None) -> Table:
        """The columns of an ensemble, in the order of ``end``; in its own units if none given."""
        dims = members["end"].dims

        def column(name: str) -> Floats:
            array = members[name].transpose(*dims, ...).values
            return np.asarray(array).reshape(-1, *array.shape[len(dims) :])

        scale = scale or scale_of(members)
        codes = motions(members).values.ravel().astype(np.int64)
        section = (column(f"section_{kind}") for kind in STATE)
        symbols = symbols_of(members)
        symbols = symbols.reshape(-1, symbols.shape[-1])
        final = (column(f"final_{kind}") for kind in STATE)
        return cls(system, scale, codes, scale.points(*section), symbols, *final)

    def gone_on(self, rows: NDArray[np.intp], longer: Longer, times: int) -> Table:
        """With these members so many times as long, where they reach the end of that."""
        states = States(self.position[rows], self.velocity[rows], self.phase[rows])
        more = Table.of(self.system, longer(states, times), self.scale)
        through = more.codes >= NO_IMPACTS
        names = ("codes", "points", "symbols", "position", "velocity", "phase")
        columns = {name: getattr(self, name).copy() for name in names}
        for name, column in columns.items():
            column[rows[through]] = getattr(more, name)[through]
        return replace(self, **columns)

    @property
    def seen(self) -> NDArray[np.bool_]:
        """Which members have a point on the section."""
        return np.asarray(np.isfinite(self.points[:, 0]).all(axis=-1))

    @property
    def flying(self) -> NDArray[np.intp]:
        """The members without impacts that do not rest on a stop."""
        silent = np.flatnonzero(self.codes == NO_IMPACTS)
        return np.compress(np.array(self.resting(silent)) == FLYING, silent)

    def state(self, member: int) -> State:
        """Where a member ended."""
        return State(
            tuple(self.position[member]), tuple(self.velocity[member]), float(self.phase[member])
        )

    def symbol_words(self, members: NDArray[np.intp]) -> list[str]:
        """The symbol of each member, or that it is not periodic."""
        return [symbol(row) if row[1:].any() else "not periodic" for row in self.symbols[members]]

    def resting(self, members: NDArray[np.intp]) -> list[str]:
        """Whether each member is in flight or on which stops it rests."""
        stops = [""] * len(members)
        for name, rests in _stops(self.system, self.position[members]):
            joined = (f"{before} and {name}" if before else name for before in stops)
            stops = [new if r else old for new, old, r in zip(joined, stops, rests, strict=True)]
        return [f"at rest on stop {on}" if on else FLYING for on in stops]


def _stops(system: System, position: Floats) -> Iterator[tuple[str, NDArray[np.bool_]]]:
    """The name of every stop, and which positions (m, n) lie on it."""
    contacts = mechanism_of(system).contacts
    for number, law in enumerate(contacts):
        row = np.array(law.row)
        u, size = position @ row, np.abs(position) @ np.abs(row)
        for name, limit in (("A", law.upper), ("B", law.lower)):
            if np.isfinite(limit):
                on = np.abs(u - limit) <= UNIT * (size + abs(limit))
                yield (name if len(contacts) == 1 else f"{name}{number}"), on


def _flown(table: Table, longer: Longer, most: int) -> Table:
    """With those in flight as long as some of them impact after all, or where they are few."""
    times = 1
    for _ in range(OFTEN):
        flying = table.flying
        if not flying.size:
            break
        times *= LONGER
        table = table.gone_on(flying, longer, times)
        if flying.size == table.flying.size > most:
            break
    return table


def _by_words(labels: Labels, table: Table) -> None:
    """Label the members that have no point on the section: by what they do instead."""
    silent = labels.left[table.codes[labels.left] == NO_IMPACTS]
    _by_key(labels, silent, table.resting(silent), table, Kind.SILENT)
    elsewhere = labels.left[~table.seen[labels.left]]
    returns = table.symbols[elsewhere, 1:].any(axis=1)
    for some, kind in ((elsewhere[returns], Kind.PERIODIC), (elsewhere[~returns], Kind.UNDECIDED)):
        _by_key(labels, some, table.symbol_words(some), table, kind)


def _by_key(
    labels: Labels, members: NDArray[np.intp], words: list[str], table: Table, kind: Kind
) -> None:
    """One attractor per word."""
    for word in dict.fromkeys(words):
        here = members[np.array(words) == word]
        labels.join(Found(str(kind), word, table.state(int(here[0]))), here)


class Class(NamedTuple):
    """What members of an attractor look like: its points, and the symbol of one of them."""

    shape: Known
    symbol: Integers

    def among(self, table: Table, rows: NDArray[np.intp]) -> NDArray[np.intp]:
        """Those of some members that are on it."""
        alike = _alike(table.symbols[rows], self.symbol, self.shape)
        return rows[alike & self.shape.holds(table.points[rows])]


def _by_classes(
    labels: Labels, table: Table, longer: Longer, contact: int, stop: Stop, tolerance: float,
    most: int,
) -> Table:  # fmt: skip
    """Classify one member after another until all have a label; the table as it is then."""
    classes: dict[int, Class] = {}
    times, firsts = 1, list[int]()
    for _ in range(most):
        left = labels.left
        if not left.size:
            break
        first = int(left[0])
        attractor = classify(table.system, table.state(first), contact=contact, stop=stop)
        own = _points(attractor, table.scale)
        if not len(own):
            _unseen(labels, attractor, table, first)
            continue
        here = Class(known(own, attractor.kind is Kind.PERIODIC, tolerance), table.symbols[first])
        same = (i for i, c in classes.items() if _one(labels.found[i], c.shape, attractor, own))
        label = next(same, None)
        if label is None:
            label = labels.add(_found(attractor), left[:1])
            classes[label] = here
            firsts.append(first)
        elif times < LONGER**OFTEN:
            times *= LONGER
            table = table.gone_on(np.append(left, firsts), longer, times)
            _match(labels, table, classes)
        labels.values[here.among(table, labels.left)] = label
        labels.values[first] = label
    return table


def _match(labels: Labels, table: Table, classes: dict[int, Class]) -> None:
    """Label the members that look like those of a known attractor, or do not come back."""
    for label, one in classes.items():
        labels.values[one.among(table, labels.left)] = label
    _by_words(labels, table)


def _unseen(labels: Labels, attractor: Attractor, table: Table, member: int) -> None:
    """A member that leaves the section for good after its window: with others of its kind."""
    found = replace(_found(attractor), state=table.state(member))
    same = (i for i, other in enumerate(labels.found) if other.kind == found.kind)
    label = next(same, None)
    if label is None:
        labels.add(found, np.array([member]))
    else:
        labels.values[member] = label


def _points(attractor: Attractor, scale: Scale) -> Floats:
    """The points of an attractor; of a periodic orbit one turn."""
    section = attractor.section
    points = scale.points(section.position, section.velocity, section.phase)
    return points[-attractor.shape.period :] if attractor.shape.period else points


def _alike(symbols: Integers, first: Integers, shape: Known) -> NDArray[np.bool_]:
    """Members whose symbol allows them to move as the first one does, (3) of matching.py."""
    if not shape.periodic:
        return np.asarray((symbols == first).all(axis=1))
    settling = symbols[:, 1:].sum(axis=1) == 0
    return np.asarray(settling | proportional(symbols, first))


def _one(found: Found, shape: Known, attractor: Attractor, points: Floats) -> bool:
    """Whether an attractor is one that is known: same kind and type, points on its points."""
    alike = (found.kind, found.word) == (str(attractor.kind), _word(attractor))
    return alike and bool(shape.holds(points[None])[0])


def _found(attractor: Attractor) -> Found:
    exponent = attractor.exponent.value
    state = attractor.section.last
    return Found(str(attractor.kind), _word(attractor), state, exponent, attractor)


def _word(attractor: Attractor) -> str:
    return attractor.symbol or str(attractor.kind)


def _coded(labels: Labels, codes: xr.DataArray) -> tuple[xr.DataArray, tuple[Found, ...]]:
    """Sort the attractors by their numbers of members, and name them."""
    counts = np.bincount(labels.values[labels.values >= 0], minlength=len(labels.found))
    order = np.argsort(-counts, kind="stable")
    rank = np.empty(len(order) + 1, dtype=np.int64)
    rank[order] = np.arange(len(order))
    values = np.where(labels.values >= 0, rank[np.maximum(labels.values, 0)], labels.values)
    found = _named([labels.found[i] for i in order])
    words = dict(enumerate(one.word for one in found)) | {NOT_MATCHED: "not matched"}
    words |= {code: said for code, said in flags(codes).items() if code < NO_IMPACTS}
    present = [code for code in words if (values == code).any()]
    attrs = {
        "flag_values": np.array(present, dtype=np.int32),
        "flag_meanings": " ".join(words[code].replace(" ", "_") for code in present),
    }
    shaped = values.reshape(codes.shape).astype(np.int32)
    return xr.DataArray(shaped, dims=codes.dims, attrs=attrs), found


def _named(found: Iterable[Found]) -> tuple[Found, ...]:
    """Names such as "1-1-1 a"; motions that do not impact need no letter."""
    used: dict[str, int] = {}
    named = []
    for one in found:
        number = used[one.word] = used.get(one.word, -1) + 1
        silent = one.kind == str(Kind.SILENT)
        named.append(one if silent else replace(one, word=f"{one.word} {_letters(number)}"))
    return tuple(named)


def _letters(number: int) -> str:
    """a, b, ..., z, aa, ab, ..."""
    count = len(ascii_lowercase)
    more = _letters(number // count - 1) if number >= count else ""
    return more + ascii_lowercase[number % count]
