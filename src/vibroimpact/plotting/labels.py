"""Placement of text next to points, where it covers least of the lines and points.

No label covers another or leaves the axes; labels without space are left out.
"""

from __future__ import annotations

from itertools import pairwise
from typing import NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import QuadMesh
from matplotlib.font_manager import FontProperties
from matplotlib.patheffects import withStroke
from matplotlib.textpath import TextPath
from matplotlib.transforms import Transform
from numpy.typing import ArrayLike

from vibroimpact._core.types import Floats

LABEL_POINTS = 7.5  # labels are so high
DIRECTIONS = (
    (1.0, 1.0), (-1.0, 1.0), (1.0, -1.0), (-1.0, -1.0), (0.0, 1.0), (0.0, -1.0), (1.0, 0.0),
    (-1.0, 0.0), (0.5, 1.0), (-0.5, 1.0), (0.5, -1.0), (-0.5, -1.0),
)  # fmt: skip
DISTANCES = (5.0, 11.0, 18.0, 26.0, 34.0, 44.0, 56.0)  # points, nearest first
LED_POINTS = 18.0  # from this distance on a thin line leads to the label
DISTANCES_WITHOUT_LINE = tuple(distance for distance in DISTANCES if distance < LED_POINTS)
OF_LINE = 1.0  # cost of covering a sample of a line
OF_MARK = tuple((x, y) for x in (-1.0, 0.0, 1.0) for y in (-1.0, 0.0, 1.0))  # samples of a mark
COST_PER_POINT = 0.35  # a point of distance costs so much
PADDING_POINTS = 1.0  # a label has so much room around it, the halo included
# A label that only lies near is left out where it would cover more samples.
MOST_COVERED_SAMPLES = 4.0
SAMPLE_POINTS = 3.0  # two samples of a line are so far apart
PER_INCH = 72.0
HALO = withStroke(linewidth=1.6, foreground="white")


class _Label(NamedTuple):
    text: str
    x: float
    y: float
    colour: str
    size: float
    led: bool


class Labels:
    """Labels of an Axes, placed together once its lines are drawn."""

    def __init__(self, ax: Axes) -> None:
        self.ax = ax
        self.wanted: list[_Label] = []

    def add(
        self,
        text: str,
        x: float,
        y: float,
        colour: str,
        *,
        size: float = LABEL_POINTS,
        led: bool = True,
    ) -> None:
        """Add a label for the point (x, y), which may be as far as a line leads to it, or only near."""
        if np.isfinite(x) and np.isfinite(y):
            self.wanted.append(_Label(text, x, y, colour, size, led))

    def place(self) -> None:
        """Write the labels one after another, each at the place of least cost."""
        figure = self.ax.get_figure(root=True)
        assert figure is not None
        figure.draw_without_rendering()  # so that the layout is final
        busy, taken, frame = self._lines(), np.empty((0, 4)), self._frame()
        for label in self.wanted:
            at, size = (
                self._points(np.array([[label.x, label.y]]))[0],
                size_of_text(label.text, label.size),
            )
            free = [
                (_cost(box, distance, busy), tuple(box))
                for distance in (DISTANCES if label.led else DISTANCES_WITHOUT_LINE)
                for box in (_box(at, size, d, distance) for d in DIRECTIONS)
                if _is_free(box, taken, frame)
                and (label.led or _covered(box, busy) <= MOST_COVERED_SAMPLES)
            ]
            if not free:
                continue
            best = np.array(min(free)[1])
            taken = np.vstack([taken, best])
            offset = (best[:2] + best[2:]) / 2.0 - at
            self.ax.annotate(
                label.text, (label.x, label.y), tuple(offset), textcoords="offset points",
                ha="center", va="center", fontsize=label.size, color=label.colour, zorder=5,
                arrowprops=_leader(offset), annotation_clip=True, path_effects=[HALO],
            )  # fmt: skip

    def _points(self, data: ArrayLike, transform: Transform | None = None) -> Floats:
        """Coordinates, by default those of the data, in points on the page."""
        figure = self.ax.get_figure(root=True)
        assert figure is not None
        known = np.asarray(data, dtype=float)
        known = known[np.isfinite(known).all(axis=1)]
        places: Floats = (transform or self.ax.transData).transform(known)
        return places * (PER_INCH / figure.dpi)

    def _frame(self) -> Floats:
        (left, right), (low, high) = self.ax.get_xlim(), self.ax.get_ylim()
        corners = self._points(np.array([[left, low], [right, high]]))
        return np.concatenate([corners.min(axis=0), corners.max(axis=0)])

    def _lines(self) -> Floats:
        """Samples of everything drawn but areas, in points on the page."""
        samples = [np.empty((0, 2))]
        for line in self.ax.get_lines():
            corners = self._points(line.get_xydata(), line.get_transform())
            size = line.get_markersize() / 2.0 if line.get_marker() != "None" else 0.0
            samples += [corners + size * np.array(place) for place in OF_MARK]
            if line.get_linestyle() != "None":
                samples += [_filled(first, last) for first, last in pairwise(corners)]
        for collection in self.ax.collections:
            if isinstance(collection, QuadMesh):
                continue  # an area, of which every place is as good
            samples.append(self._points(np.asarray(collection.get_offsets())))
            samples += [self._points(path.vertices) for path in collection.get_paths()]
        return np.vstack(samples)


def _filled(first: Floats, last: Floats) -> Floats:
    """Samples between two corners of a line."""
    count = min(int(np.hypot(*(last - first)) / SAMPLE_POINTS), 200)
    return first + (last - first) * (np.arange(1, count + 1) / (count + 1))[:, None]


def _box(at: Floats, size: Floats, direction: tuple[float, float], distance: float) -> Floats:
    """(left, low, right, high) of a text that lies in a direction from a point."""
    unit = np.array(direction) / np.hypot(*direction)
    middle = at + unit * distance + np.array(direction) * size / 2.0
    return np.concatenate([middle - size / 2.0, middle + size / 2.0])


def size_of_text(text: str, points: float) -> Floats:
    """Width and height of a label in points: a line of text is as high as "lp"."""
    width, height = (
        TextPath((0.0, 0.0), part, size=points, prop=FontProperties()).get_extents().size[axis]
        for axis, part in enumerate((text, "lp"))
    )
    return np.array([width, height]) + 2.0 * PADDING_POINTS


def _is_free(box: Floats, taken: Floats, frame: Floats) -> bool:
    """Whether a label may lie there: inside the axes and clear of those written before."""
    inside = bool(np.all(box[:2] >= frame[:2]) and np.all(box[2:] <= frame[2:]))
    apart = np.any((taken[:, 2:] < box[:2]) | (taken[:, :2] > box[2:]), axis=1)
    return inside and bool(apart.all())


def _cost(box: Floats, distance: float, busy: Floats) -> float:
    return OF_LINE * min(_covered(box, busy), 10.0) + COST_PER_POINT * distance


def _covered(box: Floats, busy: Floats) -> float:
    """Number of samples under a label."""
    return float(np.all((busy > box[:2]) & (busy < box[2:]), axis=1).sum())


def _leader(offset: Floats) -> dict[str, object] | None:
    """Arrow style of the thin line to a label that is far from its point."""
    if np.hypot(*offset) < LED_POINTS:
        return None
    return {
        "arrowstyle": "-", "linewidth": 0.4, "color": "#8C8C8C", "shrinkA": 3.0, "shrinkB": 3.0,
        "path_effects": [withStroke(linewidth=1.0, foreground="white")],
    }  # fmt: skip
