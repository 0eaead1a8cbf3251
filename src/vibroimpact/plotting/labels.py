"""Text next to points, each where it covers least of the lines, points and other text."""

from __future__ import annotations

from itertools import pairwise
from typing import NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.patheffects import withStroke
from numpy.typing import NDArray

Floats = NDArray[np.float64]

SIZE = 7.5  # points
LETTER = 0.62  # width of a letter, relative to SIZE
DIRECTIONS = (
    (1.0, 1.0), (-1.0, 1.0), (1.0, -1.0), (-1.0, -1.0), (0.0, 1.0), (0.0, -1.0), (1.0, 0.0),
    (-1.0, 0.0), (0.5, 1.0), (-0.5, 1.0), (0.5, -1.0), (-0.5, -1.0),
)  # fmt: skip
DISTANCES = (5.0, 11.0, 18.0, 26.0, 34.0)  # points, nearest first
OF_TEXT, OF_LINE = 8.0, 1.0  # cost of covering a label, a sample of a line
FARTHER = 0.35  # cost of a point of distance
SPACING = 3.0  # points between two samples of a line
PER_INCH = 72.0
HALO = withStroke(linewidth=1.6, foreground="white")


class _Wanted(NamedTuple):
    text: str
    x: float
    y: float
    colour: str


class Labels:
    """Labels of an Axes, placed together once its lines are drawn."""

    def __init__(self, ax: Axes) -> None:
        self.ax = ax
        self.wanted: list[_Wanted] = []

    def add(self, text: str, x: float, y: float, colour: str) -> None:
        """A label for the point (x, y)."""
        if np.isfinite(x) and np.isfinite(y):
            self.wanted.append(_Wanted(text, x, y, colour))

    def place(self) -> None:
        """Write the labels, one after another where each costs least."""
        figure = self.ax.get_figure(root=True)
        assert figure is not None
        figure.draw_without_rendering()  # so that the layout is final
        busy, taken, frame = self._lines(), np.empty((0, 4)), self._frame()
        for label in self.wanted:
            at = self._points(np.array([[label.x, label.y]]))[0]
            size = np.array([LETTER * SIZE * len(label.text), SIZE])
            boxes = [_box(at, size, d, r) for r in DISTANCES for d in DIRECTIONS]
            far = [r for r in DISTANCES for _ in DIRECTIONS]
            costs = [_cost(b, r, busy, taken, frame) for b, r in zip(boxes, far, strict=True)]
            best = boxes[int(np.argmin(costs))]
            taken = np.vstack([taken, best])
            offset = (best[:2] + best[2:]) / 2.0 - at
            self.ax.annotate(
                label.text, (label.x, label.y), tuple(offset), textcoords="offset points",
                ha="center", va="center", fontsize=SIZE, color=label.colour, zorder=5,
                arrowprops=_leader(offset), annotation_clip=True, path_effects=[HALO],
            )  # fmt: skip

    def _points(self, data: Floats) -> Floats:
        """Data coordinates in points on the page."""
        figure = self.ax.get_figure(root=True)
        assert figure is not None
        places: Floats = self.ax.transData.transform(data) * (PER_INCH / figure.dpi)
        return places

    def _frame(self) -> Floats:
        (left, right), (low, high) = self.ax.get_xlim(), self.ax.get_ylim()
        corners = self._points(np.array([[left, low], [right, high]]))
        return np.concatenate([corners.min(axis=0), corners.max(axis=0)])

    def _lines(self) -> Floats:
        """Samples of everything drawn, in points on the page."""
        samples = [np.empty((0, 2))]
        for line in self.ax.get_lines():
            data = np.column_stack([np.asarray(d, dtype=float) for d in line.get_data()])
            corners = self._points(data[np.isfinite(data).all(axis=1)])
            samples.append(corners)
            if line.get_linestyle() != "None":
                samples += [_filled(first, last) for first, last in pairwise(corners)]
        return np.vstack(samples)


def _filled(first: Floats, last: Floats) -> Floats:
    """Samples between two corners of a line."""
    count = min(int(np.hypot(*(last - first)) / SPACING), 200)
    return first + (last - first) * (np.arange(1, count + 1) / (count + 1))[:, None]


def _box(at: Floats, size: Floats, direction: tuple[float, float], distance: float) -> Floats:
    """(left, low, right, high) of a text that lies in a direction from a point."""
    unit = np.array(direction) / np.hypot(*direction)
    middle = at + unit * distance + np.array(direction) * size / 2.0
    return np.concatenate([middle - size / 2.0, middle + size / 2.0])


def _cost(box: Floats, distance: float, busy: Floats, taken: Floats, frame: Floats) -> float:
    inside = np.all((busy > box[:2]) & (busy < box[2:]), axis=1).sum()
    apart = np.any((taken[:, 2:] < box[:2]) | (taken[:, :2] > box[2:]), axis=1)
    outside = float(np.any(box[:2] < frame[:2]) or np.any(box[2:] > frame[2:]))
    covered = OF_LINE * min(float(inside), 10.0) + OF_TEXT * float((~apart).sum())
    return covered + FARTHER * distance + OF_TEXT * outside


def _leader(offset: Floats) -> dict[str, object] | None:
    """A thin line to a label that is far from its point."""
    if np.hypot(*offset) < DISTANCES[2]:
        return None
    return {"arrowstyle": "-", "linewidth": 0.4, "color": "#8C8C8C", "shrinkA": 3.0, "shrinkB": 3.0}
