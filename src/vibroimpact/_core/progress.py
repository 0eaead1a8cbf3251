"""A small progress display on standard error."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import TextIO, TypeVar

Item = TypeVar("Item")

BAR = 24  # characters
REDRAW = 0.1  # seconds between two drawings of the bar
LOGGED = 60.0  # seconds between two lines of a stage that lasts, where there is no terminal


@dataclass
class Progress:
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
    """

    stages: int
    stream: TextIO | None = None
    quiet: bool = False
    _name: str = field(default="", init=False)
    _number: int = field(default=0, init=False)
    _drawn: float = field(default=0.0, init=False)

    def stage(self, name: str) -> None:
        """Begin the next stage."""
        self._number, self._name, self._drawn = self._number + 1, name, time.monotonic()
        self._line("")

    def note(self, text: str) -> None:
        """Show how far a stage without a known end has come."""
        now = time.monotonic()
        if now - self._drawn >= (REDRAW if self._live else LOGGED):
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
        self._drawn = begin = time.monotonic()
        done = 0
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
        return not self.quiet and (self.stream or sys.stderr).isatty()

    def _draw(self, name: str, done: int, total: int, begin: float, unit: str) -> None:
        now = time.monotonic()
        live = self._live
        rest = REDRAW if live else LOGGED
        if now - self._drawn < rest and not (live and done in (0, total)):
            return
        self._drawn = now
        filled = BAR * done // max(total, 1)
        left = f" {(now - begin) * (total - done) / done:4.0f} s left" if done else ""
        rate = f" {done / (now - begin):.3g} {unit}/s" if unit and done else ""
        bar = "#" * filled + "." * (BAR - filled)
        text = f"[{self._number}/{self.stages}] {name:<32.32} {bar}{rate}{left}"
        self._write(f"\r\033[K{text}" if live else f"{text}\n")

    def _write(self, text: str) -> None:
        if not self.quiet:
            stream = self.stream or sys.stderr
            stream.write(text)
            stream.flush()


class Sentences:
    """How far one stage has come, in sentences: on standard error, or to a function."""

    def __init__(self, progress: bool | Callable[[str], object], stage: str) -> None:
        self._to = progress if callable(progress) else None
        self._bar = Progress(1, quiet=progress is not True)
        self._bar.stage(stage)

    def say(self, text: str) -> None:
        """Report a sentence."""
        if self._to is not None:
            self._to(text)
        self._bar.note(text)

    def close(self) -> None:
        """Remove the live line."""
        self._bar.close()


@contextmanager
def interruptible(kept: str) -> Iterator[None]:
    """Give an interruption a message, if it has none yet: which part of the work is kept."""
    try:
        yield
    except KeyboardInterrupt as stop:
        raise KeyboardInterrupt(*(stop.args or (f"interrupted; {kept}.",))) from None
