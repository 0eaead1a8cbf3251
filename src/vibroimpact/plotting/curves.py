"""Plots of curves of bifurcations in the plane of two parameters, and of tongues between two of them."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import AbstractContextManager
from typing import Any, cast

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import QuadMesh
from matplotlib.text import Annotation

from vibroimpact._core.checks import check_flag, check_kind, ends_of, refusal
from vibroimpact._core.errors import InvalidParameterError
from vibroimpact._core.types import Floats
from vibroimpact.bifurcations.curve import BifurcationCurve, units_of_curves
from vibroimpact.bifurcations.kinds import WEAK
from vibroimpact.bifurcations.stretches import Meaning, stretches
from vibroimpact.bifurcations.tongue import Tongue
from vibroimpact.bifurcations.tongue_region import region_of
from vibroimpact.branches.kinds import SN
from vibroimpact.branches.point import BifurcationPoint
from vibroimpact.machines.units import Units
from vibroimpact.normal_forms.kind import PointKind
from vibroimpact.plotting import style
from vibroimpact.plotting.branch_looks import in_order, look_of, parameter_label
from vibroimpact.plotting.labels import Labels

LINES: dict[Meaning, dict[str, Any]] = {
    Meaning.BIFURCATION: {"linestyle": "-", "linewidth": 1.3},
    Meaning.INADMISSIBLE: {"linestyle": (0, (0.9, 1.3)), "linewidth": 1.3},
    Meaning.NEUTRAL: {"linestyle": (0, (4.0, 2.0)), "linewidth": 0.7, "color": style.GREY},
}
WORDS = {Meaning.INADMISSIBLE: "not admissible", Meaning.NEUTRAL: "neutral saddle"}
HALO: dict[str, Any] = {
    "color": "white",
    "linewidth": 3.5,
    "zorder": 2.5,
}  # of lines over coloured planes
WEAK_LABEL_POINTS = 6.0  # labels of weak resonances are so high
SAME_POINT_OF_AXES = 2e-3  # curves that are so near, relative to the axes, pass one point
LEGEND_COLUMNS = 3  # the legend has so many columns
LEGEND = "vibroimpact curves"  # marks a legend to which later curves are added
INSIDE: dict[str, Any] = {  # of the region between the sides of a tongue
    "facecolor": style.SKY, "alpha": 0.45, "edgecolor": "none", "zorder": 2.6,
}  # fmt: skip
OVER: dict[str, Any] = {  # the same over coloured planes
    "fill": False, "hatch": "////", "edgecolor": style.BLACK, "linewidth": 0.0, "zorder": 2.4,
}  # fmt: skip
HATCH_POINTS = 0.5  # lines of hatching are so wide

Pair = tuple[float, float]
Ranges = tuple[Pair, Pair]
Names = tuple[str, str]


def plot_curves(
    curves: BifurcationCurve | Sequence[BifurcationCurve],
    *,
    ax: Axes | None = None,
    marks: bool = True,
    bounds: Ranges | None = None,
) -> Axes:
    """Draw curves of bifurcations: a colour for each kind, dotted where the orbits are not admissible.

    Parameters
    ----------
    curves
        A curve, or several in the same two parameters. Those of the first one, in its order, are the axes.
    ax
        Axes to draw on, as those that :func:`plot_plane` returned: their limits, labels and legends are kept. A new
        figure if not given.
    marks
        Mark and label the points of codimension two: "R4_2" is the point ``curve["R4_2"]``, "2/9" a weak resonance.
        Labels without space are left out.
    bounds
        Ranges of the two parameters that are shown; by default those of the
        curves, or the limits of ``ax``.

    Returns
    -------
    Axes
        The Axes drawn on. Neutral saddles, which are no bifurcations, are thin, grey and dashed.
    """
    curves = _checked(curves)
    check_flag("marks", marks)
    names, units = curves[0].names, units_of_curves(curves)
    shown = None if bounds is None else _limits(bounds)
    entries = _entries(curves, points=marks)
    with _axes(ax, len(entries)) as drawn_on:
        kept = _limits_of(drawn_on)
        for curve in curves:
            _curve(drawn_on, curve, names, halo=kept is not None)
        _framed(drawn_on, names, units, kept, shown)
        _legend(drawn_on, entries)
        if marks:
            _special_points(drawn_on, curves, names)
    return drawn_on


def plot_tongue(tongue: Tongue, *, ax: Axes | None = None) -> Axes:
    """Draw both sides of a tongue, its tip, and the region of locked orbits between the sides.

    Parameters
    ----------
    tongue
        A result of :func:`vibroimpact.tongue`.
    ax
        Axes to draw on, as those that :func:`plot_plane` or :func:`plot_curves` returned for the same parameters: their
        limits, labels and legends are kept. A new figure if not given.

    Returns
    -------
    Axes
        The Axes drawn on. The region is filled, or hatched over a coloured plane. In it there are locked orbits, stable
        or not. It ends where the first of the two sides turns back or ends; beyond, only the curves are drawn.
    """
    check_kind("tongue", tongue, Tongue, "a Tongue, as vi.tongue gives")
    names, units = tongue.sides[0].names, units_of_curves(tongue.sides)
    p, q = tongue.resonance
    entries = [
        _look(SN, Meaning.BIFURCATION) | {"label": f"sides of the tongue {p}/{q}"},
        *_entries(tongue.sides, points=False)[1:],
        _marker(WEAK) | {"label": WEAK.name},
    ]
    x, y = (tongue.tip.parameters[name] for name in names)
    with _axes(ax, len(entries)) as drawn_on:
        kept = _limits_of(drawn_on)
        region = _drawn(tongue.sides[0], names, region_of(tongue).corners)
        plane = any(isinstance(one, QuadMesh) for one in drawn_on.collections)
        with mpl.rc_context({"hatch.linewidth": HATCH_POINTS}):
            drawn_on.fill(*region.T, **(OVER if plane else INSIDE))
        for side in tongue.sides:
            _curve(drawn_on, side, names, halo=kept is not None)
        drawn_on.plot(x, y, **_marker(WEAK))
        _framed(drawn_on, names, units, kept, None)
        _legend(drawn_on, entries)
        _label_tip(drawn_on, _text(tongue.tip), float(x), float(y))
    return drawn_on


# ---- what is drawn -------------------------------------------------------------------------------


def _checked(curves: Any) -> Sequence[BifurcationCurve]:
    """Return the curves, or refuse what is none, and curves in other parameters."""
    curves = [curves] if isinstance(curves, BifurcationCurve) else curves
    check_kind("curves", curves, (list, tuple), "a curve, or a list of curves")
    for i, curve in enumerate(curves):
        wanted = "a BifurcationCurve, as continue_bifurcation gives"
        check_kind(f"curves[{i}]", curve, BifurcationCurve, wanted)
    names = {tuple(sorted(curve.names)) for curve in curves}
    if len(names) != 1:
        listed = "; ".join(sorted(", ".join(pair) for pair in names)) or "no parameters"
        raise InvalidParameterError(f"curves in {listed}: need one or more in the same two.")
    return cast(Sequence[BifurcationCurve], curves)


def _drawn(curve: BifurcationCurve, names: Names, values: Floats) -> Floats:
    """Values of both parameters in the order of the axes."""
    found: Floats = np.asarray(values)[:, [curve.names.index(name) for name in names]]
    return found


def _limits(bounds: Any) -> Floats:
    if not isinstance(bounds, tuple | list) or len(bounds) != 2:
        raise refusal("bounds", bounds, "((low, high), (low, high)), one range per parameter")
    return np.array([ends_of(f"bounds[{i}]", pair) for i, pair in enumerate(bounds)])


def _axes(ax: Axes | None, entries: int) -> AbstractContextManager[Axes]:
    """Axes with room for a legend."""
    height = 1.4 * style.HEIGHT + -(-entries // LEGEND_COLUMNS) * style.LEGEND_ROW_INCHES
    return style.drawing(ax, width=1.6 * style.WIDTH, height=height)


def _limits_of(ax: Axes) -> tuple[Pair, Pair] | None:
    """Limits that are kept: those of axes with data."""
    return (ax.get_xlim(), ax.get_ylim()) if ax.has_data() else None


def _framed(
    ax: Axes, names: Names, units: Units, kept: tuple[Pair, Pair] | None, shown: Floats | None
) -> None:
    """Fix the limits, and name the axes of a new figure."""
    limits = shown if shown is not None else kept
    if limits is not None:
        ax.set(xlim=tuple(limits[0]), ylim=tuple(limits[1]))
    else:
        style.widen_constant(ax)
        ax.set(xlim=ax.get_xlim(), ylim=ax.get_ylim())
    if kept is None:
        ax.set(
            xlabel=parameter_label(names[0], units),
            ylabel=parameter_label(names[1], units),
        )


def _curve(ax: Axes, curve: BifurcationCurve, names: Names, *, halo: bool) -> None:
    """Draw the stretches of a curve."""
    for part in stretches(curve):
        across, up = _drawn(curve, names, part.values).T
        if halo:
            ax.plot(across, up, label="_", **HALO)
        ax.plot(across, up, dash_capstyle="butt", **_look(curve.record, part.meaning))


def _look(kind: PointKind, meaning: Meaning) -> dict[str, Any]:
    """Line of a kind of curve; bifurcations lie above the others."""
    return {"color": look_of(kind).colour, "zorder": 3.0 - 0.1 * meaning} | LINES[meaning]


def _marker(kind: PointKind) -> dict[str, Any]:
    """Marker of a point: black where it is one of maps, white where the orbit touches or curves cross."""
    weak, filled = kind == WEAK, bool(kind.critical)
    return {
        "linestyle": "none", "marker": look_of(kind).marker, "zorder": 4,
        "markersize": 2.6 if weak else 4.8 if filled else 4.5,
        "markerfacecolor": style.BLACK if filled else "white",
        "markeredgecolor": "white" if filled else style.BLACK,
        "markeredgewidth": 0.6 if weak or filled else 0.8,
    }  # fmt: skip


def _special_points(ax: Axes, curves: Sequence[BifurcationCurve], names: Names) -> None:
    """Mark the points, one where several curves pass, and label them, the most important first."""
    labels = Labels(ax)
    span = np.array([np.ptp(ax.get_xlim()), np.ptp(ax.get_ylim())])
    seen: list[tuple[PointKind, Floats]] = []
    every = [(curve, point) for curve in curves for point in curve.special_points]
    for curve, point in sorted(every, key=lambda pair: _rank(pair[1])):
        values = np.array([[point.parameters[name] for name in curve.names]])
        at = _drawn(curve, names, values)[0]
        if any(
            k == point.record and np.all(np.abs(at - b) < SAME_POINT_OF_AXES * span)
            for k, b in seen
        ):
            continue
        seen.append((point.record, at))
        ax.plot(*at, **_marker(point.record))
        if point.record == WEAK:
            labels.add(_text(point), at[0], at[1], style.BLACK, size=WEAK_LABEL_POINTS, led=False)
        else:
            labels.add(_text(point), at[0], at[1], style.BLACK)
    labels.place()


def _label_tip(ax: Axes, text: str, x: float, y: float) -> None:
    """Label the tip, unless the curve on which it lies has its label there."""
    written = (t for t in ax.texts if isinstance(t, Annotation) and t.get_text() == text)
    if not any(np.allclose(t.xy, (x, y), rtol=1e-9) for t in written):
        labels = Labels(ax)
        labels.add(text, x, y, style.BLACK)
        labels.place()


def _rank(point: BifurcationPoint) -> int:
    """Zero, or of a weak resonance p/q its q: the longer the period, the weaker."""
    return point.resonance[1] if point.record == WEAK and point.resonance else 0


def _text(point: BifurcationPoint) -> str:
    """Label of a point, with its number as a subscript; of a weak resonance only the fraction."""
    word, _, number = point.label.partition("_")
    return word if point.record == WEAK else f"{word}$_{{{number}}}$"


def _entries(curves: Sequence[BifurcationCurve], *, points: bool) -> list[dict[str, Any]]:
    """Looks of the legend with their texts."""
    found = [
        _look(kind, Meaning.BIFURCATION) | {"label": kind.name}
        for kind in in_order(curve.record for curve in curves)
    ]
    meanings = {part.meaning for curve in curves for part in stretches(curve)}
    for meaning, words in WORDS.items():
        if meaning in meanings:
            found.append({"color": style.BLACK} | LINES[meaning] | {"label": words})
    marked = in_order(point.record for curve in curves for point in curve.special_points if points)
    by_name = {kind.name: kind for kind in marked}
    found += [_marker(kind) | {"label": name} for name, kind in by_name.items()]
    return found


def _legend(ax: Axes, entries: Sequence[dict[str, Any]]) -> None:
    """Legend above the axes: that of earlier curves is extended, another one stays beside it."""
    before = ax.get_legend()
    lines: list[Any] = []
    if before is not None and before.get_gid() == LEGEND:
        lines = [*before.legend_handles]
        before = None
    known = {line.get_label() for line in lines}
    lines += [ax.plot([], [], **entry)[0] for entry in entries if entry["label"] not in known]
    legend = style.legend_outside(ax, columns=LEGEND_COLUMNS, handles=lines, handlelength=1.8)
    legend.set_gid(LEGEND)
    if before is not None and before is not legend:
        ax.add_artist(before)
        before.set_clip_on(False)  # else the layout takes no account of it
