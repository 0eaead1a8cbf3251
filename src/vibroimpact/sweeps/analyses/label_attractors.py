"""The attractors that the members of an ensemble end on: labelled, named, counted.

Method      A member without a label is classified (:func:`vibroimpact.classify`) from where it
            ended; the points of that attractor are compared with the last section points of every
            member without one (matching.py); and so on. First those that return to where they
            were, then others: where one turns out to be on its way to a periodic or a known
            attractor, or to none, others may be, too. Then all without a label go on from where
            they ended, 8, then 64 times as long, and are looked at once more             (1)
            An attractor whose own points lie on a known one of its kind and type is that one.
            Members at rest share a label, one for each set of stops that they rest on; so do those
            that never impact, and those that impact, but not on the section: one per symbol.
Assumes     members of one system
Accuracy    that of matching.py
Fails       "not matched": after ``most`` classifications, or after going on twice
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field, replace
from string import ascii_lowercase
from typing import NamedTuple

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from vibroimpact._core.types import Floats, Integers, Rows
from vibroimpact.attractors.classify import Attractor, classify
from vibroimpact.attractors.matching import TOLERANCE, KnownAttractor, known_attractor, proportional
from vibroimpact.attractors.point_sets import Kind
from vibroimpact.model.state import State
from vibroimpact.model.stop import StopName
from vibroimpact.model.system import System
from vibroimpact.simulation.sections import Scale
from vibroimpact.sweeps.analyses.member_table import ExtendRun, Table
from vibroimpact.sweeps.analyses.motion_codes import NO_IMPACTS, flags, motions
from vibroimpact.sweeps.states import States

Words = NDArray[np.str_]

NOT_MATCHED = -1
LONGER, OFTEN = 8, 2  # times as long each time, and how many times
MANY = 64  # members in flight: fewer go on whatever the others do


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
    def left(self) -> Rows:
        """The members without a label."""
        return np.flatnonzero(self.values == NOT_MATCHED)

    def add(self, found: Found) -> int:
        """A new attractor; its label."""
        self.found.append(found)
        return len(self.found) - 1

    def join(self, found: Found, members: Rows) -> None:
        """Members of an attractor that is known by its kind and its word, or is new."""
        key = found.kind, found.word
        same = (i for i, one in enumerate(self.found) if (one.kind, one.word) == key)
        label = next(same, None)
        self.values[members] = self.add(found) if label is None else label


def label_attractors(
    system: System, members: xr.Dataset, begun: Floats, extend: ExtendRun, *, contact: int,
    stop: StopName, tolerance: float = TOLERANCE, most: int = 64,
) -> tuple[xr.DataArray, tuple[Found, ...], States]:  # fmt: skip
    """Label the attractor of every member; label 0 has the most members.

    Parameters
    ----------
    system
        What the members are motions of.
    members
        With the observers section, symbol, impacts and final.
    begun
        Phases of the starts, in the order of ``end``.
    extend
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
    codes = motions(members)
    table = Table.of(system, members, codes, begun)
    labels = Labels(np.where(table.codes < NO_IMPACTS, table.codes, NOT_MATCHED))
    search = Search(labels, contact, stop, tolerance, most)
    table = _searched(search, table, extend)
    return *_coded(labels, codes), table.ends


class Class(NamedTuple):
    """What members of an attractor look like: its points, and the symbol of one of them."""

    shape: KnownAttractor
    symbol: Integers

    def among(self, table: Table, rows: Rows) -> Rows:
        """Those of some members that are on it."""
        alike = _alike(table.symbols[rows], self.symbol, self.shape)
        return rows[alike & self.shape.contains(table.points[rows])]


@dataclass
class Search:
    """The attractors that are known, and the members that are looked at to find more.

    Attributes
    ----------
    labels, classes
        Of the members; what those of each attractor look like.
    classified
        Members that made a class: by what they settle on, not by what they did.
    left_out
        Members that classify said nothing of, until they have gone on.
    """

    labels: Labels
    contact: int
    stop: StopName
    tolerance: float
    most: int
    classes: dict[int, Class] = field(default_factory=dict)
    classified: list[int] = field(default_factory=list)
    left_out: set[int] = field(default_factory=set)

    def look(self, table: Table, *, last: bool) -> None:
        """Label what is known, and classify: members that have settled, then others (1)."""
        self.left_out.clear()
        self._match(table)
        for settled in (True, False):
            while (member := self._next(table, settled=settled, last=last)) is not None:
                new = self._classify(table, member)
                if not last and (new is None or (not settled and new.kind == Kind.PERIODIC)):
                    break

    def _match(self, table: Table) -> None:
        """Label the members that are on a known attractor, at rest, or settled elsewhere."""
        for label, one in self.classes.items():
            self.labels.values[one.among(table, self.labels.left)] = label
        left = self.labels.left
        silent = left[table.silent[left]]
        words = np.array(table.without_impacts(silent))
        rest = words != Kind.SILENT
        _by_word(self.labels, table, silent[rest], words[rest], Kind.SILENT)
        elsewhere = left[table.settled[left] & ~table.seen[left]]
        words = np.array(table.symbol_words(elsewhere))
        _by_word(self.labels, table, elsewhere, words, Kind.PERIODIC)

    def _next(self, table: Table, *, settled: bool, last: bool) -> int | None:
        """A member to classify; before the last look none that hardly comes to the section."""
        wanted = table.seen & ~table.silent & (table.settled == settled)
        if not (settled or last):
            wanted &= table.full
        left = self.labels.left
        found = (int(i) for i in left[wanted[left]] if int(i) not in self.left_out)
        return next(found, None) if self.most else None

    def _classify(self, table: Table, member: int) -> Found | None:
        """Classify a member and label those like it; the attractor if it is a new one."""
        self.most -= 1
        attractor = classify(
            table.system, table.ends.state(member), contact=self.contact, stop=self.stop
        )
        own = _points(attractor, table.scale)
        if attractor.kind is Kind.SILENT or not len(own):
            self.left_out.add(member)
            return None
        here = Class(self._shape(attractor, own), table.symbols[member])
        found, classes = _found(attractor), self.classes.items()
        same = (i for i, one in classes if _one(self.labels.found[i], one.shape, found, own))
        known_as = next(same, None)
        label = self.labels.add(found) if known_as is None else known_as
        self.classes.setdefault(label, here)
        self.labels.values[here.among(table, self.labels.left)] = label
        self.labels.values[member] = label
        self.classified.append(member)
        return found if known_as is None else None

    def _shape(self, attractor: Attractor, own: Floats) -> KnownAttractor:
        """What is on an attractor; its gap is in units of its own, which are no larger."""
        curve = attractor.shape.curve
        gap = curve.widest_gap if curve and attractor.kind is Kind.QUASIPERIODIC else 0.0
        return known_attractor(own, attractor.kind is Kind.PERIODIC, self.tolerance, gap)

    def to_extend(self, table: Table, flew: int) -> Rows:
        """Who goes on: all without a label; of many in flight none where as many flew before."""
        left = self.labels.left
        flying = table.silent[left]
        if MANY < flying.sum() == flew:
            left = left[~flying]
        return left


def _searched(search: Search, table: Table, extend: ExtendRun) -> Table:
    """Look, and let members without a label go on, until all have one or have gone on enough."""
    flew = -1
    for often in range(OFTEN + 1):
        search.look(table, last=often == OFTEN)
        left = search.labels.left
        if not left.size or often == OFTEN:
            break
        rows, flew = search.to_extend(table, flew), int(table.silent[left].sum())
        table = table.extended(rows, extend, LONGER ** (often + 1))
    _rest(search.labels, table, extend)
    strayed = np.array(search.classified, dtype=np.intp)
    strayed = strayed[~table.settled[strayed]]
    return table.extended(strayed, extend, LONGER**OFTEN) if strayed.size else table


def _rest(labels: Labels, table: Table, extend: ExtendRun) -> None:
    """Label what impacts, but not on the section, and what has no impact for long."""
    left = labels.left
    silent = table.silent[left]
    elsewhere = left[~table.seen[left] & ~silent]
    words = np.array(table.symbol_words(elsewhere))
    _by_word(labels, table, elsewhere, words, Kind.UNDECIDED)
    if silent.any():
        times = LONGER if silent.sum() > MANY else LONGER**OFTEN
        table = table.extended(left[silent], extend, times, whole=True)
        still = left[silent & table.silent[left]]
        _by_word(labels, table, still, np.array(table.without_impacts(still)), Kind.SILENT)


def _by_word(labels: Labels, table: Table, members: Rows, words: Words, kind: Kind) -> None:
    """One attractor per word that says what members do."""
    for word in dict.fromkeys(words.tolist()):
        here = members[words == word]
        labels.join(Found(str(kind), word, table.ends.state(int(here[0]))), here)


def _points(attractor: Attractor, scale: Scale) -> Floats:
    """The points of an attractor; of a periodic orbit one turn."""
    section = attractor.section
    points = scale.points(section.position, section.velocity, section.phase)
    return points[-attractor.shape.period :] if attractor.shape.period else points


def _alike(symbols: Integers, first: Integers, shape: KnownAttractor) -> NDArray[np.bool_]:
    """Members whose symbol allows them to move as the first one does, (3) of matching.py."""
    if not shape.periodic:
        return np.asarray((symbols == first).all(axis=1))
    settling = symbols[:, 1:].sum(axis=1) == 0
    return np.asarray(settling | proportional(symbols, first))


def _one(one: Found, shape: KnownAttractor, other: Found, points: Floats) -> bool:
    """Whether an attractor is one that is known: same kind and type, points on its points."""
    alike = (one.kind, one.word) == (other.kind, other.word)
    return alike and bool(shape.contains(points[None])[0])


def _found(attractor: Attractor) -> Found:
    word = attractor.symbol or str(attractor.kind)
    exponent, state = attractor.exponent.value, attractor.section.last
    return Found(str(attractor.kind), word, state, exponent, attractor)


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
