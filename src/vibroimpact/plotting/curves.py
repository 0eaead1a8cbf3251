"""Plot of curves of bifurcations in the plane of two parameters, alone or over a plane of motions."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple, cast

import numpy as np
from matplotlib.axes import Axes

from vibroimpact._core.checks import check_flag, check_kind, ends_of, refusal
from vibroimpact._core.errors import InvalidParameterError
from vibroimpact._core.types import Floats
from vibroimpact.bifurcations.curve import BifurcationCurve, CodimensionTwoPoint
from vibroimpact.bifurcations.of_orbits import OrbitPlane
from vibroimpact.bifurcations.stretches import Meaning, stretches
from vibroimpact.plotting import style
from vibroimpact.plotting.branch_looks import KINDS, MARKERS, parameter_label
from vibroimpact.plotting.labels import Labels
from vibroimpact.plotting.units import Units, units_of

COLOURS = {
    "SN": style.BLUE, "PD": style.VERMILION, "NS": style.BLACK, "BP": style.GREEN,
    "GR": style.ORANGE, "ZERO": style.SKY, "SIM": style.PURPLE, "level": "#7A5A3A",
}  # fmt: skip
OF_CURVES = KINDS | {"BP": "symmetry breaking", "level": "level of a function"}
LOOKS: dict[Meaning, dict[str, Any]] = {
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
OF_POINTS = {  # marker and words of points of codimension two
    "CP": (">", "cusp"),
    "GPD": ("D", "generalised flip"),
    "CH": ("h", "Chenciner point"),
    "R1": ("o", "strong resonance"),
    "R2": ("o", "strong resonance"),
    "R3": ("o", "strong resonance"),
    "R4": ("o", "strong resonance"),
    "LPPD": ("d", "fold-flip"),
    "LPNS": ("<", "fold and Neimark-Sacker"),
    "PDNS": ("p", "flip and Neimark-Sacker"),
    "NSNS": ("8", "two pairs"),
    "WEAK": ("o", "weak resonance"),
    "BP": (MARKERS["BP"], "curves cross"),
    "GR": (MARKERS["GR"], "orbit grazes"),
    "ZERO": (MARKERS["ZERO"], "impact speed zero"),
    "SIM": (MARKERS["SIM"], "impacts coincide"),
    "STICK": (MARKERS["STICK"], "sticking begins"),
}
OPEN = ("WEAK", "BP", "GR", "ZERO", "SIM", "STICK")  # markers, white inside
WEAK = 6.0  # points: labels of weak resonances
SAME = 2e-3  # of the axes: two curves pass one point there
COLUMNS, ROW = 3, 0.17  # of the legend; height of a row in inches

Ranges = tuple[tuple[float, float], tuple[float, float]]


class _View(NamedTuple):
    """Names of the two parameters as drawn, and their factors."""

    names: tuple[str, str]
    factors: Floats

    def drawn(self, curve: BifurcationCurve, values: Floats) -> Floats:
        """Values of both parameters in the order and the units of the axes."""
        order = [curve.names.index(name) for name in self.names]
        found: Floats = np.asarray(values)[:, order] * self.factors
        return found


def plot_curves(
    curves: Sequence[BifurcationCurve],
    *,
    ax: Axes | None = None,
    points: bool = True,
    bounds: Ranges | None = None,
) -> Axes:
    """Draw curves of bifurcations: a colour for each kind, dotted where the orbits are not admissible.

    Parameters
    ----------
    curves
        Curves in the same two parameters. Those of the first one, in its order, are the axes.
    ax
        Axes to draw on, as those that :func:`plot_plane` returned: their limits, labels and legends are kept. A new
        figure if not given.
    points
        Mark and label the points of codimension two: "R4_2" is the point ``curve["R4_2"]``, "2/9" a weak resonance.
        Labels without space are left out.
    bounds
        Ranges of the two parameters that are shown, scaled as for ``continue_bifurcation``; by default those of the
        curves, or the limits of ``ax``.

    Returns
    -------
    Axes
        The Axes drawn on. Neutral saddles, which are no bifurcations, are thin, grey and dashed.
    """
    curves = _checked(curves)
    check_flag("points", points)
    view, units = _view(curves)
    shown = None if bounds is None else _limits(bounds) * view.factors[:, None]
    entries = _entries(curves, points=points)
    height = 1.4 * style.HEIGHT + -(-len(entries) // COLUMNS) * ROW
    with style.drawing(ax, width=1.6 * style.WIDTH, height=height) as drawn_on:
        kept = (drawn_on.get_xlim(), drawn_on.get_ylim()) if drawn_on.has_data() else None
        for curve in curves:
            _curve(drawn_on, curve, view, halo=kept is not None)
        limits = shown if shown is not None else kept
        if limits is not None:
            drawn_on.set(xlim=tuple(limits[0]), ylim=tuple(limits[1]))
        else:
            style.widen_constant(drawn_on)
            drawn_on.set(xlim=drawn_on.get_xlim(), ylim=drawn_on.get_ylim())
        if kept is None:
            drawn_on.set(
                xlabel=parameter_label(view.names[0], units),
                ylabel=parameter_label(view.names[1], units),
            )
        _legend(drawn_on, entries)
        if points:
            _special_points(drawn_on, curves, view)
    return drawn_on


# ---- what is drawn -------------------------------------------------------------------------------


def _checked(curves: Any) -> Sequence[BifurcationCurve]:
    """Return the curves, or refuse what is none, and curves in other parameters."""
    check_kind("curves", curves, (list, tuple), "a list of curves")
    for i, curve in enumerate(curves):
        wanted = "a BifurcationCurve, as continue_bifurcation gives"
        check_kind(f"curves[{i}]", curve, BifurcationCurve, wanted)
    names = {tuple(sorted(curve.names)) for curve in curves}
    if len(names) != 1:
        listed = "; ".join(sorted(", ".join(pair) for pair in names)) or "no parameters"
        raise InvalidParameterError(f"curves in {listed}: need one or more in the same two.")
    return cast(Sequence[BifurcationCurve], curves)


def _view(curves: Sequence[BifurcationCurve]) -> tuple[_View, Units]:
    planes = [curve.problem.equations for curve in curves]
    units = units_of(*(p.system if isinstance(p, OrbitPlane) else None for p in planes))
    names = curves[0].names
    factors = [units.factor(units.quantity_of(name)) for name in names]
    return _View(names, np.array(factors)), units


def _limits(bounds: Any) -> Floats:
    if not isinstance(bounds, tuple | list) or len(bounds) != 2:
        raise refusal("bounds", bounds, "((low, high), (low, high)), one range per parameter")
    return np.array([ends_of(f"bounds[{i}]", pair) for i, pair in enumerate(bounds)])


def _curve(ax: Axes, curve: BifurcationCurve, view: _View, *, halo: bool) -> None:
    """Draw the stretches of a curve."""
    for part in stretches(curve):
        across, up = view.drawn(curve, part.values).T
        if halo:
            ax.plot(across, up, label="_", **HALO)
        ax.plot(across, up, dash_capstyle="butt", **_look(curve.kind, part.meaning))


def _look(kind: str, meaning: Meaning) -> dict[str, Any]:
    """Line of a kind of curve; bifurcations lie above the others."""
    return {"color": COLOURS[kind], "zorder": 3.0 - 0.1 * meaning} | LOOKS[meaning]


def _marker(kind: str) -> dict[str, Any]:
    """Marker of a point: black for strong ones, white where the orbit touches or curves cross."""
    weak, filled = kind == "WEAK", kind not in OPEN
    return {
        "linestyle": "none", "marker": OF_POINTS[kind][0], "zorder": 4,
        "markersize": 2.6 if weak else 4.8 if filled else 4.5,
        "markerfacecolor": style.BLACK if filled else "white",
        "markeredgecolor": "white" if filled else style.BLACK,
        "markeredgewidth": 0.6 if weak or filled else 0.8,
    }  # fmt: skip


def _special_points(ax: Axes, curves: Sequence[BifurcationCurve], view: _View) -> None:
    """Mark the points, one where several curves pass, and label them, the most important first."""
    labels = Labels(ax)
    span = np.array([np.ptp(ax.get_xlim()), np.ptp(ax.get_ylim())])
    seen: list[tuple[str, Floats]] = []
    every = [(curve, point) for curve in curves for point in curve.special_points]
    for curve, point in sorted(every, key=lambda pair: _rank(pair[1])):
        values = np.array([[point.parameters[name] for name in curve.names]])
        at = view.drawn(curve, values)[0]
        if any(k == point.kind and np.all(np.abs(at - b) < SAME * span) for k, b in seen):
            continue
        seen.append((point.kind, at))
        ax.plot(*at, **_marker(point.kind))
        if point.kind == "WEAK":
            labels.add(_text(point), at[0], at[1], style.BLACK, size=WEAK, led=False)
        else:
            labels.add(_text(point), at[0], at[1], style.BLACK)
    labels.place()


def _rank(point: CodimensionTwoPoint) -> int:
    """Zero, or of a weak resonance p/q its q: the longer the period, the weaker."""
    return point.resonance[1] if point.kind == "WEAK" and point.resonance else 0


def _text(point: CodimensionTwoPoint) -> str:
    """Label of a point, with its number as a subscript; of a weak resonance only the fraction."""
    word, _, number = point.label.partition("_")
    return word if point.kind == "WEAK" else f"{word}$_{{{number}}}$"


def _entries(curves: Sequence[BifurcationCurve], *, points: bool) -> list[dict[str, Any]]:
    """Looks of the legend with their words."""
    kinds = {curve.kind for curve in curves}
    found = [
        _look(kind, Meaning.BIFURCATION) | {"label": OF_CURVES[kind]}
        for kind in COLOURS
        if kind in kinds
    ]
    meanings = {part.meaning for curve in curves for part in stretches(curve)}
    for meaning, words in WORDS.items():
        if meaning in meanings:
            found.append({"color": style.BLACK} | LOOKS[meaning] | {"label": words})
    marked = {point.kind for curve in curves for point in curve.special_points if points}
    words_of = {words: kind for kind, (_, words) in OF_POINTS.items() if kind in marked}
    found += [_marker(kind) | {"label": words} for words, kind in words_of.items()]
    return found


def _legend(ax: Axes, entries: Sequence[dict[str, Any]]) -> None:
    """Legend above the axes; one that is there already stays."""
    before = ax.get_legend()
    lines = [ax.plot([], [], **entry)[0] for entry in entries]
    legend = ax.legend(
        handles=lines, loc="lower left", bbox_to_anchor=(0.0, 1.0), ncols=COLUMNS,
        borderaxespad=0.0, borderpad=0.2, columnspacing=1.2, handlelength=1.8,
    )  # fmt: skip
    if before is not None and before is not legend:
        ax.add_artist(before)
        before.set_clip_on(False)  # else the layout takes no account of it
