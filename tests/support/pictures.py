"""What a picture shows."""

from __future__ import annotations

from itertools import pairwise
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

ROUNDING_INCHES = 0.01  # a pixel, about


def words(ax: Axes) -> list[str]:
    """Texts of the legend."""
    legend = ax.get_legend()
    assert legend is not None
    return [text.get_text() for text in legend.get_texts()]


def assert_nothing_is_cut(figure: Figure) -> None:
    """All that is drawn lies within the figure, and tick labels do not touch."""
    figure.draw_without_rendering()
    box, (width, height) = figure.get_tightbbox(), figure.get_size_inches()
    assert min(box.x0, box.y0) > -ROUNDING_INCHES
    assert max(box.x1 - width, box.y1 - height) < ROUNDING_INCHES
    for ax in figure.axes:
        low, high = sorted(ax.get_xlim())
        labels = [  # none where another axes shows them
            label.get_window_extent() for label, at in zip(ax.get_xticklabels(), ax.get_xticks(), strict=False)
            if ax.axison and low <= at <= high and label.get_text()
        ]  # fmt: skip
        assert all(left.x1 < right.x0 for left, right in pairwise(labels))
