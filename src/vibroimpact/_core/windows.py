"""Windows of one length that cover segments of time, each with Chebyshev series in [-1, 1]."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.polynomial import chebyshev

from vibroimpact._core.types import Floats, Integers


@dataclass(frozen=True, eq=False)
class Windows:
    """Windows of segments, one after the other; the last one of a segment may reach beyond its end."""

    length: float  # of a window
    durations: Floats  # of the segments, shape (m,)
    # segment of each window, and its start since that of the segment, shape (w,)
    segment: Integers
    start: Floats
    # windows of the start and of the end of each segment, shape (m,)
    first: Integers
    last: Integers

    @classmethod
    def over(cls, durations: Floats, length: float) -> Windows:
        """The windows of segments of these durations, one at least in each."""
        counts = np.maximum(1, np.ceil(durations / length)).astype(np.int64)
        after = np.cumsum(counts)
        first = after - counts
        segment = np.repeat(np.arange(len(counts)), counts)
        start = (np.arange(len(segment)) - first[segment]) * length
        return cls(length, durations, segment, start, first, after - 1)

    @property
    def counts(self) -> Integers:
        """Number of the windows of each segment."""
        return self.last - self.first + 1

    @cached_property
    def begun(self) -> Floats:
        """Time at which each segment begins, since the first one."""
        times: Floats = np.cumsum(self.durations) - self.durations
        return times

    @cached_property
    def ends(self) -> Floats:
        """Place of the end of each segment in its last window."""
        return self.place(self.last, self.durations)

    def place(self, windows: Integers, since: Floats) -> Floats:
        """Places in [-1, 1] of times since the starts of segments."""
        x: Floats = 2.0 * (since - self.start[windows]) / self.length - 1.0
        return x

    def since(self, windows: Integers, x: Floats) -> Floats:
        """Times since the starts of segments of places in windows."""
        times: Floats = self.start[windows] + self.length * (1.0 + x) / 2.0
        return times

    def times(self, windows: Integers, x: Floats) -> Floats:
        """Times since the first segment began of places in windows."""
        times: Floats = (
            self.begun[self.segment[windows]] + self.start[windows] + self.length * (1.0 + x) / 2.0
        )
        return times

    def inside(self, windows: Integers, x: Floats) -> tuple[Integers, Floats]:
        """Return the places that are within their segments."""
        x = np.clip(x, -1.0, 1.0)
        kept = self.since(windows, x) <= self.durations[self.segment[windows]]
        return windows[kept], x[kept]

    def at(self, times: Floats) -> tuple[Integers, Floats]:
        """Windows and places of times since the first segment began."""
        segment = np.searchsorted(self.begun, times, side="right") - 1
        segment = np.clip(segment, 0, len(self.begun) - 1)
        since = np.minimum(times - self.begun[segment], self.durations[segment])
        window = self.first[segment] + (since / self.length).astype(int)
        window = np.minimum(window, self.last[segment])
        return window, self.place(window, since)


def values_at(series: Floats, windows: Integers, x: Floats | float) -> Floats:
    """Values of series (k, w) at places in windows."""
    return np.asarray(chebyshev.chebval(x, series[:, windows], tensor=False), dtype=float)
