"""Progress of a long work: told to a function, or displayed on standard error."""

from __future__ import annotations

import functools
import inspect
import math
import os
import sys
import time
from collections.abc import Callable, Iterable, Iterator
from contextlib import suppress
from dataclasses import dataclass, field
from typing import Any, NamedTuple, TextIO, TypeVar, cast

from vibroimpact._core.errors import warn

Item = TypeVar("Item")
Work = TypeVar("Work", bound=Callable[..., Any])

UNITS = (
    ("years", 31557600.0),
    ("days", 86400.0),
    ("hours", 3600.0),
    ("minutes", 60.0),
    ("seconds", 1.0),
)
BAR_CHARACTERS = 24  # the bar has so many characters
REDRAW_SECONDS = 0.1  # the bar is drawn so often
MEASURED_SECONDS = 0.5  # from so much work the rest is estimated
ANNOUNCED_SECONDS = 60.0  # work that takes longer is announced
# A count that takes less than a minute, at 3 ms each; of more, a beginning is measured first.
PROBED = 2**14
FIRST_PROBE = 2**10  # a probe begins with so much of it, doubled until it tells enough
# What is expected to take a smaller share of ANNOUNCED_SECONDS is not measured longer.
CLEARLY_SHORT_SHARE = 1 / 8
PATIENCE_SECONDS = 2.0  # a work that takes less shows nothing
INTERRUPTED = ": interrupted; "  # between the name of a function and what is kept of its work
STORE_WOULD_KEEP = "With a store (store=..., --store) the same call would go on."
LOGGING_SECONDS = 60.0  # a stage that lasts has a line so often, where there is no terminal


class ProgressReport(NamedTuple):
    """Progress of a work, which a function given as ``progress`` is told.

    ``progress=print`` prints it as a sentence.

    Attributes
    ----------
    stage
        What is done.
    done
        How much of it: points, circles, members, machines.
    total
        Of so many; None where the end is not known.
    text
        The whole report in words.
    """

    stage: str
    done: int
    total: int | None
    text: str

    def __str__(self) -> str:
        return f"{self.stage}: {self.text}"


ProgressOption = bool | Callable[[ProgressReport], object] | None


@dataclass
class Display:
    """Show the stage, the fraction done and the time left.

    On a terminal one line is redrawn; elsewhere each stage prints one line when it begins, and one
    a minute.

    Parameters
    ----------
    stages
        Number of stages of the whole job.
    stream
        Stream to write to; standard error if not given.
    quiet
        Write nothing at all.
    patience
        Write nothing of the first so many seconds of a stage.
    """

    stages: int
    stream: TextIO | None = None
    quiet: bool = False
    patience: float = 0.0
    _name: str = field(default="", init=False)
    _number: int = field(default=0, init=False)
    _drawn: float = field(default=0.0, init=False)
    _from: float = field(default=0.0, init=False)

    def stage(self, name: str) -> None:
        """Begin the next stage."""
        self._number, self._name, self._drawn = self._number + 1, name, time.monotonic()
        self._from = self._drawn + self.patience
        if self.patience:
            self._drawn = -math.inf
        else:
            self._line("")

    def show(self, report: ProgressReport) -> None:
        """Show a report of the work of this stage."""
        self.note(report.text)

    def note(self, text: str) -> None:
        """Show how far a stage without a known end has come."""
        now = time.monotonic()
        if now >= self._from and now - self._drawn >= (
            REDRAW_SECONDS if self._live else LOGGING_SECONDS
        ):
            self._drawn = now
            self._line(f": {text}")

    def _line(self, text: str) -> None:
        head = f"[{self._number}/{self.stages}] {self._name}{text}"
        self._write(f"\r\033[K{head}" if self._live else f"{head}\n")

    def track(
        self,
        name: str,
        items: Iterable[Item],
        total: int,
        *,
        size: Callable[[Item], int] = lambda _: 1,
        unit: str = "",
    ) -> Iterator[Item]:
        """Begin a stage and yield its items, showing how much is done.

        Parameters
        ----------
        size
            Share of the total that an item makes.
        unit
            Unit of the total, to show the rate per second.
        """
        self.stage(name)
        begin, done = time.monotonic(), 0
        self._draw(name, done, total, begin, unit)
        for item in items:
            yield item
            done += size(item)
            self._draw(name, done, total, begin, unit)

    def close(self) -> None:
        """Remove the live line."""
        if self._live:
            self._write("\r\033[K")

    @property
    def _live(self) -> bool:
        stream = self.stream or sys.stderr
        return not self.quiet and stream is not None and stream.isatty()

    def _draw(self, name: str, done: int, total: int, begin: float, unit: str) -> None:
        now = time.monotonic()
        live = self._live
        rest = REDRAW_SECONDS if live else LOGGING_SECONDS
        ends = live and done in (0, total)
        if now < self._from or (now - self._drawn < rest and not ends):
            return
        self._drawn = now
        filled = BAR_CHARACTERS * done // max(total, 1)
        left = f" {(now - begin) * (total - done) / done:4.0f} s left" if done else ""
        rate = f" {done / (now - begin):.3g} {unit}/s" if unit and done else ""
        bar = "#" * filled + "." * (BAR_CHARACTERS - filled)
        text = f"[{self._number}/{self.stages}] {name:<32.32} {bar}{rate}{left}"
        self._write(f"\r\033[K{text}" if live else f"{text}\n")

    def _write(self, text: str) -> None:
        stream = self.stream or sys.stderr
        if not self.quiet and stream is not None:
            with suppress(OSError):  # a display that nobody can see ends no work
                stream.write(text)
                stream.flush()


class Reporter:
    """Tells how far one stage has come: on standard error where it lasts, to a function, or to nobody.

    Parameters
    ----------
    progress
        True, a function, or False or None.
    stage
        What is done.
    """

    def __init__(self, progress: ProgressOption, stage: str) -> None:
        self._to = progress if callable(progress) else None
        self._bar = Display(1, quiet=progress is not True, patience=PATIENCE_SECONDS)
        self._stage, self._begun = stage, False

    def __enter__(self) -> Reporter:
        return self

    def __exit__(self, *_: object) -> None:
        self._bar.close()

    def say(self, text: str, done: int = 0, total: int | None = None) -> None:
        """Report a text."""
        self._begin()
        self._tell(text, done, total)
        self._bar.note(text)

    def counted(self, what: str, name: str) -> Callable[[int, float], None]:
        """A function of a count and the value of a parameter that tells both."""
        self._begin()
        return lambda count, value: self.say(f"{count} {what}, {name} = {value:.6g}", count)

    def track(
        self,
        items: Iterable[Item],
        total: int,
        what: str,
        *,
        size: Callable[[Item], int] = lambda _: 1,
    ) -> Iterator[Item]:
        """Yield items, and tell after each how many of the total are done.

        Parameters
        ----------
        what
            Things that are counted, in the plural.
        size
            How many of them an item stands for.
        """
        done = 0
        for item in self._bar.track(self._stage, items, total, size=size, unit=what):
            yield item
            done += size(item)
            self._tell(f"{done} of {total} {what}", done, total)

    def _begin(self) -> None:
        if not self._begun:
            self._begun = True
            self._bar.stage(self._stage)

    def _tell(self, text: str, done: int, total: int | None) -> None:
        if self._to is not None:
            self._to(ProgressReport(self._stage, done, total, text))


class Announcement:
    """Warns once of a counted work whose rest will take above a minute, from the time of what is done.

    Parameters
    ----------
    name, count
        Name of the count, and the count.
    """

    def __init__(self, name: str, count: float) -> None:
        self.name, self.count, self._begin = name, count, time.monotonic()
        self.measured = False

    def after(self, done: float) -> None:
        """Estimate the rest, if enough is done for it."""
        if (
            self.measured
            or done <= 0
            or (spent := time.monotonic() - self._begin) < MEASURED_SECONDS
        ):
            return
        self.measured = True
        self.say(spent * (self.count - done) / done)

    def say(self, left: float) -> None:
        """Warn if so many seconds are long."""
        if left > ANNOUNCED_SECONDS:
            unit, size = next((u, s) for u, s in UNITS if left >= s)
            warn(
                f"{self.name} = {self.count}: will take some {left / size:.3g} {unit}. Ctrl-C ends it."
            )


def announce_measured(name: str, count: int, work: Callable[[int], object]) -> None:
    """Announce a long work in one call, on so many items; see :func:`expected`."""

    def beginning(part: int) -> float:
        work(part)
        return part / count

    Announcement(name, count).say(expected(count, beginning))


def expected(most: int, beginning: Callable[[int], float]) -> float:
    """Seconds that a long work in one call takes, from a beginning of it; 0 where it is short.

    In parts the work would have other last bits, so a beginning of it is done apart, of about a quarter of a second.

    Parameters
    ----------
    most
        Items of the work, at most.
    beginning
        Does so many of them, and returns the share of the work that this is.
    """
    part = FIRST_PROBE
    while most >= PROBED and part < most:
        begin = time.monotonic()
        share = beginning(part)
        spent = time.monotonic() - begin
        whole = spent / share if share > 0.0 else math.inf
        if whole < CLEARLY_SHORT_SHARE * ANNOUNCED_SECONDS:
            break
        if spent > MEASURED_SECONDS / 4.0:
            return whole
        part *= 2
    return 0.0


def counting(name: str, count: int) -> Iterator[int]:
    """Yield 0, 1, ... below the count, and announce a long work."""
    announcement = Announcement(name, count)
    for number in range(count):
        announcement.after(number)
        yield number


def interruptible(work: Work) -> Work:
    """Give an interruption of a function a sentence: what was interrupted, what is kept, how to go on.

    One rule for all: a function that has found something returns it, with a status or a flag that says that it was
    interrupted; one that has nothing to return raises KeyboardInterrupt with this sentence. What a function called
    inside has said of a store stays, if this one has a store, too.
    """

    @functools.wraps(work)
    def answering(*args: Any, **given: Any) -> Any:
        try:
            return work(*args, **given)
        except KeyboardInterrupt as stop:
            kept = str(stop).partition(INTERRUPTED)[2]
            about = inspect.signature(work)
            named = {name: one.kind for name, one in about.parameters.items()}
            if "store" not in named and inspect.Parameter.VAR_KEYWORD not in named.values():
                kept = "nothing is kept. The same call begins anew."
            elif not kept:
                kept = _kept_in((about.bind(*args, **given).arguments | given).get("store"))
            raise KeyboardInterrupt(f"{work.__name__}{INTERRUPTED}{kept}") from None

    return cast(Work, answering)


def _kept_in(store: Any) -> str:
    """Sentence on a store, or on none."""
    if store is None:
        return f"nothing is kept. {STORE_WOULD_KEEP}"
    if not os.path.exists(os.path.expanduser(store)):
        return f"nothing is in {os.fspath(store)!r} yet. The same call begins anew."
    return f"what was finished is in {os.fspath(store)!r}: the same call goes on there."
