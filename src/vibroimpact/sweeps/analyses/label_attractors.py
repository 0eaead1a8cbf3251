"""Attractors of the members of an ensemble: labelled, named, counted.

Method      A member without a label is classified (:func:`vibroimpact.classify`) from where it
            ended; the points of that attractor are compared with the last section points of every
            member without one (matching.py); and so on. First those whose symbol is periodic, then
            others, until one of these settles on a periodic or a known attractor, or on none: the
            others may not have settled either. Then all without a label are continued from their
            final states, 8, then 64 times as long, and classified once more              (1)
            An attractor whose own points lie on a known one of its kind and type is that one.
            Members at rest share a label, one for each set of stops that they rest on; so do those
            that never impact, and those that impact, but not on the section: one per symbol.
Assumes     members of one system
Accuracy    that of matching.py
Fails       "not matched": after ``most_classified`` classifications, or after the second continuation
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field, replace
from string import ascii_lowercase
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from vibroimpact._core.lazy import xr
from vibroimpact._core.types import Floats, Integers, Rows
from vibroimpact.attractors.classify import Attractor, classify
from vibroimpact.attractors.matching import (
    MEMBER_DISTANCE,
    KnownAttractor,
    known_attractor,
    proportional,
)
from vibroimpact.attractors.point_sets import Kind
from vibroimpact.model.state import State
from vibroimpact.model.system import System
from vibroimpact.results.result import words_of_codes
from vibroimpact.simulation.places import At, AtStop
from vibroimpact.simulation.sections import Scale
from vibroimpact.sweeps.analyses.member_table import ExtendRun, Table
from vibroimpact.sweeps.analyses.motion_codes import NO_IMPACTS, motions
from vibroimpact.sweeps.starts import States

Words = NDArray[np.str_]

NOT_MATCHED = -1
EXTENSION_FACTOR = 8  # each extension multiplies the window by this factor
MOST_EXTENSIONS = 2  # a window is extended so often at most
FEW_MEMBERS = 64  # so many members in flight, or fewer, are extended in any case


@dataclass(frozen=True)
class LabelledAttractor:
    """Attractor of an ensemble."""

    kind: str  # "periodic", "quasiperiodic", "chaotic", "undecided", "without impacts"
    word: str  # its name without the letter: n-p-q, or the kind
    state: State  # a state on it
    # largest Lyapunov exponent per unit of time; nan where there is none
    exponent: float = float("nan")
    # result of `classify`, if it was called
    attractor: Attractor | None = field(default=None, repr=False)


@dataclass
class Labels:
    """Labels of members, filled step by step."""

    values: Integers
    found: list[LabelledAttractor] = field(default_factory=list)

    @property
    def left(self) -> Rows:
        """Members without a label."""
        return np.flatnonzero(self.values == NOT_MATCHED)

    def add(self, found: LabelledAttractor) -> int:
        """Add a new attractor and return its label."""
        self.found.append(found)
        return len(self.found) - 1

    def join(self, found: LabelledAttractor, members: Rows) -> None:
        """Label members of an attractor, a known one of the same kind and word or a new one."""
        key = found.kind, found.word
        same = (i for i, one in enumerate(self.found) if (one.kind, one.word) == key)
        label = next(same, None)
        self.values[members] = self.add(found) if label is None else label


def label_attractors(
    system: System, members: xr.Dataset, begun: Floats, extend: ExtendRun, *,
    at: At, tolerance: float = MEMBER_DISTANCE, most_classified: int = 64,
) -> tuple[xr.DataArray, tuple[LabelledAttractor, ...], States]:  # fmt: skip
    """Label the attractor of every member; label 0 has the most members.

    Parameters
    ----------
    system
        System of the members.
    members
        Sweep with the observers section, symbol, impacts and final.
    begun
        Phases of the starts, in the order of ``end``.
    extend
        Function that continues members from their final states, with the same observers.
    at
        Where the points are.
    tolerance
        Relative distance below which two periodic members are one orbit.
    most_classified
        Largest number of classifications.

    Returns
    -------
    DataArray
        Labels with the dims of ``end``, -1 where not matched, below it a status; meanings in
        ``flag_values`` and ``flag_meanings``.
    tuple of LabelledAttractor
        The attractors in the order of the labels.
    States
        Final state of every member, after its continuation if any, in the order of ``end``.
    """
    codes = motions(members)
    table = Table.of(system, members, codes, begun)
    labels = Labels(np.where(table.codes < NO_IMPACTS, table.codes, NOT_MATCHED))
    search = Search(labels, at, tolerance, most_classified)
    table = _searched(search, table, extend)
    return *_coded(labels, codes), table.ends


class Class(NamedTuple):
    """Class of the members of an attractor: its points, and the symbol of one member."""

    shape: KnownAttractor
    symbol: Integers

    def among(self, table: Table, rows: Rows) -> Rows:
        """Return the rows of the members that are on the attractor."""
        alike = _alike(table.symbols[rows], self.symbol, self.shape)
        return rows[alike & self.shape.contains(table.points[rows])]


@dataclass
class Search:
    """Search for the attractors of members, with those found so far.

    Attributes
    ----------
    labels, classes
        Labels of the members; the class of each attractor.
    classified
        Members that were classified: their class is that of the attractor on which they settle.
    left_out
        Members for which ``classify`` found no attractor with points, until they are continued.
    """

    labels: Labels
    at: At
    tolerance: float
    most_classified: int
    classes: dict[int, Class] = field(default_factory=dict)
    classified: list[int] = field(default_factory=list)
    left_out: set[int] = field(default_factory=set)

    def classify_all(self, table: Table, *, last: bool) -> None:
        """Label members of known attractors, then classify: settled ones first (1)."""
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
        elsewhere = left[table.settled[left] & ~table.on_section[left]]
        words = np.array(table.symbol_words(elsewhere))
        _by_word(self.labels, table, elsewhere, words, Kind.PERIODIC)

    def _next(self, table: Table, *, settled: bool, last: bool) -> int | None:
        """Next member to classify; before the last round only those with all section points."""
        wanted = table.on_section & ~table.silent & (table.settled == settled)
        if not (settled or last):
            wanted &= table.full
        left = self.labels.left
        found = (int(i) for i in left[wanted[left]] if int(i) not in self.left_out)
        return next(found, None) if self.most_classified else None

    def _classify(self, table: Table, member: int) -> LabelledAttractor | None:
        """Classify a member and label matching ones; return the attractor if it is new."""
        self.most_classified -= 1
        attractor = classify(table.system, table.ends.state(member), at=self.at)
        own = _points(attractor, table.scale)
        elsewhere = isinstance(attractor.section.at, AtStop) == table.strobed  # not on this section
        if attractor.kind is Kind.SILENT or not len(own) or elsewhere:
            self.left_out.add(member)
            return None
        here = Class(self._points_of(attractor, own), table.symbols[member])
        found, classes = _found(attractor), self.classes.items()
        same = (i for i, one in classes if _is_same(self.labels.found[i], one.shape, found, own))
        known_as = next(same, None)
        label = self.labels.add(found) if known_as is None else known_as
        self.classes.setdefault(label, here)
        self.labels.values[here.among(table, self.labels.left)] = label
        self.labels.values[member] = label
        self.classified.append(member)
        return found if known_as is None else None

    def _points_of(self, attractor: Attractor, own: Floats) -> KnownAttractor:
        """Points of an attractor for matching; its gap is in its own units, which are no larger."""
        curve = attractor.shape.curve
        gap = curve.widest_gap if curve and attractor.kind is Kind.QUASIPERIODIC else 0.0
        return known_attractor(own, attractor.kind is Kind.PERIODIC, self.tolerance, gap)

    def to_extend(self, table: Table, flew: int) -> Rows:
        """Members to continue: all unlabelled, except many in flight of unchanged number."""
        left = self.labels.left
        flying = table.silent[left]
        if FEW_MEMBERS < flying.sum() == flew:
            left = left[~flying]
        return left


def _searched(search: Search, table: Table, extend: ExtendRun) -> Table:
    """Classify, and continue members without a label, until all have one or the rounds end."""
    flew = -1
    for round_ in range(MOST_EXTENSIONS + 1):
        search.classify_all(table, last=round_ == MOST_EXTENSIONS)
        left = search.labels.left
        if not left.size or round_ == MOST_EXTENSIONS:
            break
        rows, flew = search.to_extend(table, flew), int(table.silent[left].sum())
        table = table.extended(rows, extend, EXTENSION_FACTOR ** (round_ + 1))
    _rest(search.labels, table, extend)
    strayed = np.array(search.classified, dtype=np.intp)
    strayed = strayed[~table.settled[strayed]]
    return (
        table.extended(strayed, extend, EXTENSION_FACTOR**MOST_EXTENSIONS)
        if strayed.size
        else table
    )


def _rest(labels: Labels, table: Table, extend: ExtendRun) -> None:
    """Label members that impact, but not on the section, and those without impacts for long."""
    left = labels.left
    silent = table.silent[left]
    elsewhere = left[~table.on_section[left] & ~silent]
    words = np.array(table.symbol_words(elsewhere))
    _by_word(labels, table, elsewhere, words, Kind.UNDECIDED)
    if silent.any():
        times = (
            EXTENSION_FACTOR if silent.sum() > FEW_MEMBERS else EXTENSION_FACTOR**MOST_EXTENSIONS
        )
        table = table.extended(left[silent], extend, times, whole=True)
        still = left[silent & table.silent[left]]
        _by_word(labels, table, still, np.array(table.without_impacts(still)), Kind.SILENT)


def _by_word(labels: Labels, table: Table, members: Rows, words: Words, kind: Kind) -> None:
    """Label members by words that describe their motion, one attractor per word."""
    for word in dict.fromkeys(words.tolist()):
        here = members[words == word]
        labels.join(LabelledAttractor(str(kind), word, table.ends.state(int(here[0]))), here)


def _points(attractor: Attractor, scale: Scale) -> Floats:
    """Section points of an attractor; one period of a periodic orbit."""
    section = attractor.section
    points = scale.points(section.position, section.velocity, section.phase)
    return points[-attractor.shape.period :] if attractor.shape.period else points


def _alike(symbols: Integers, first: Integers, shape: KnownAttractor) -> NDArray[np.bool_]:
    """Mask of members whose symbol is compatible with the first one, (3) of matching.py."""
    if not shape.periodic:
        return np.asarray((symbols == first).all(axis=1))
    settling = symbols[:, 1:].sum(axis=1) == 0
    return np.asarray(settling | proportional(symbols, first))


def _is_same(
    one: LabelledAttractor, shape: KnownAttractor, other: LabelledAttractor, points: Floats
) -> bool:
    """Whether an attractor is a known one: same kind and type, points on its points."""
    alike = (one.kind, one.word) == (other.kind, other.word)
    return alike and bool(shape.contains(points[None])[0])


def _found(attractor: Attractor) -> LabelledAttractor:
    word = attractor.symbol or str(attractor.kind)
    exponent, state = attractor.exponent.value, attractor.section.last
    return LabelledAttractor(str(attractor.kind), word, state, exponent, attractor)


def _coded(
    labels: Labels, codes: xr.DataArray
) -> tuple[xr.DataArray, tuple[LabelledAttractor, ...]]:
    """Sort the attractors by their numbers of members, and name them."""
    counts = np.bincount(labels.values[labels.values >= 0], minlength=len(labels.found))
    order = np.argsort(-counts, kind="stable")
    rank = np.empty(len(order) + 1, dtype=np.int64)
    rank[order] = np.arange(len(order))
    values = np.where(labels.values >= 0, rank[np.maximum(labels.values, 0)], labels.values)
    found = _named([labels.found[i] for i in order])
    words = dict(enumerate(one.word for one in found)) | {NOT_MATCHED: "not matched"}
    words |= {code: text for code, text in words_of_codes(codes).items() if code < NO_IMPACTS}
    present = [code for code in words if (values == code).any()]
    attrs = {
        "flag_values": np.array(present, dtype=np.int32),
        "flag_meanings": " ".join(words[code].replace(" ", "_") for code in present),
    }
    shaped = values.reshape(codes.shape).astype(np.int32)
    return xr.DataArray(shaped, dims=codes.dims, attrs=attrs), found


def _named(found: Iterable[LabelledAttractor]) -> tuple[LabelledAttractor, ...]:
    """Attractors with names such as "1-1-1 a"; motions without impacts have no letter."""
    used: dict[str, int] = {}
    named = []
    for one in found:
        number = used[one.word] = used.get(one.word, -1) + 1
        silent = one.kind == str(Kind.SILENT)
        named.append(one if silent else replace(one, word=f"{one.word} {_letters(number)}"))
    return tuple(named)


def _letters(number: int) -> str:
    """Letters of a number: a, b, ..., z, aa, ab, ..."""
    count = len(ascii_lowercase)
    more = _letters(number // count - 1) if number >= count else ""
    return more + ascii_lowercase[number % count]
