"""Plot of a frequency response: branches, simulated motions, linear machines beside it."""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from typing import Any, NamedTuple

import numpy as np
from matplotlib.axes import Axes

from vibroimpact._core.checks import check_choice, check_flag, check_kind, refusal
from vibroimpact._core.types import Floats, Integers
from vibroimpact.machines.units import Units, units_of
from vibroimpact.normal_forms.kind import PointKind
from vibroimpact.orbits.stability import Stability
from vibroimpact.plotting import style
from vibroimpact.plotting.branch_looks import band_label, marker_of
from vibroimpact.plotting.branches import LINES
from vibroimpact.response.compare import COMPARISONS, comparison, decibels
from vibroimpact.response.curves import ResponseCurve
from vibroimpact.response.response import Response
from vibroimpact.response.tuned import TunedDamper

BESIDE = {"linear": (style.GREY, "linear, stops open"), "tuned": (style.GREEN, "tuned mass damper")}
WITHOUT = "without impacts"
SIMULATED, SEEN = style.VERMILION, style.SILVER
STRETCH_SHARES = (0.0, 0.25, 0.5, 0.75)  # values are taken at these shares of a stretch
# Values of motions that do not settle are cut off above so many times those of what settles.
TOP_FACTOR = 1.15
# the motion without impacts is drawn up to so many times the largest that settles
UNSETTLED_FACTOR = 3.0
MARGIN_OF_BAND = 0.015  # the axes are wider than the band by so much at each end
SHOWN_DECIBELS = 60.0  # values that are farther below the largest are cut off


class _Axes(NamedTuple):
    """Scales of both axes: factor of the band, whether in decibels, and of which quantity."""

    over: float
    decibel: bool
    quantity: str

    def y(self, values: Any) -> Floats:
        given = np.asarray(values, dtype=float)
        return decibels(given, self.quantity) if self.decibel else given


def plot_response(
    response: Response, *, ax: Axes | None = None, decibel: bool = False,
    compare: Sequence[str] = (), marks: bool = True,
) -> Axes:  # fmt: skip
    """Draw a frequency response: stable solid, neutral dash-dotted, unstable dashed, not admissible dotted.

    Motions that are on no branch are points, those of a torus or chaos with their rms where a row
    is measured; simulated motions on branches are pale points behind these.

    Parameters
    ----------
    response
        A result of :func:`vibroimpact.frequency_response`.
    decibel
        Draw 20 lg of the value, 10 lg of a power.
    compare
        Draw beside it "linear", the machine with all stops open, and "tuned", with a tuned mass
        damper of the same mass in place of the free masses.
    marks
        Mark special points next to admissible orbits.
    """
    check_kind("response", response, Response, "a Response, as vi.frequency_response gives")
    check_flag("decibel", decibel)
    check_flag("marks", marks)
    if isinstance(compare, str) or not isinstance(compare, Iterable):
        raise refusal("compare", compare, f"several of {', '.join(COMPARISONS)}")
    for one in compare:
        check_choice("compare", one, list(COMPARISONS))
    units = units_of(response.system)
    quantity = response.measure.dimension
    axes = _Axes(response.band.factor, decibel, quantity)
    with style.drawing(ax, width=1.9 * style.WIDTH, height=1.4 * style.HEIGHT) as ax:
        beside = {one: comparison(response, one) for one in compare}
        for one, (p, values) in beside.items():
            colour, text = BESIDE[one]
            ax.plot(
                p * axes.over, axes.y(values), color=colour, linewidth=1.0, label=text, zorder=2
            )
        _simulated(ax, response, axes)
        _curves(ax, response, axes)
        if marks:
            _marks(ax, response, axes)
        _limits(ax, response, axes, [values for _, values in beside.values()])
        ax.set(
            xlabel=band_label(response.band, units),
            ylabel=_ordinate(response, units, decibel=decibel),
        )
        style.legend_outside(ax, columns=4)
    return ax


def _ordinate(response: Response, units: Units, *, decibel: bool) -> str:
    unit = units.unit(response.measure.dimension)
    text = re.sub(r"\b([xva])(\d+)", r"$\1_{\2}$", response.measure.label)
    if not decibel:
        return units.label(text, response.measure.dimension)
    return f"{text} [dB{f' re 1 {unit}' if unit else ''}]"


def _simulated(ax: Axes, response: Response, axes: _Axes) -> None:
    """Points: pale for motions on branches, coloured for others, their rms smaller."""
    off = response.unexplained
    apart = {id(answer) for answer in off}
    on = [a for many in response.answers for a in many if id(a) not in apart]
    style.points(
        ax, np.array([a.parameter for a in on]) * axes.over, axes.y([a.value for a in on]),
        color=SEEN, markersize=3.4, zorder=1,
    )  # fmt: skip
    if off:
        p = np.array([a.parameter for a in off]) * axes.over
        looks = {"color": SIMULATED, "zorder": 3}
        style.points(ax, p, axes.y([a.value for a in off]), markersize=2.2, **looks,
                     label="simulated, on no branch")  # fmt: skip
        rms = np.array([a.rms for a in off])
        both = {one.dimension for one in response.simulation.measures}
        if (
            np.isfinite(rms).any()
            and len(both) == 1
            and not response.measure.label.startswith("rms")
        ):
            style.points(ax, p, axes.y(rms), marker="_", markersize=3.0, markeredgewidth=0.7, **looks,
                         label="their rms")  # fmt: skip


def _curves(ax: Axes, response: Response, axes: _Axes) -> None:
    named: set[str] = set()
    for curve in response.curves:
        without = curve.branch is None
        colour = style.BLACK if without else style.BLUE
        p, values, stability = (
            _drawn(curve) if without else (curve.parameter, curve.value, curve.stability)
        )
        p, y = p * axes.over, axes.y(values)
        for kind in Stability:
            for begin, end in _runs(stability == kind):
                text = _silent(kind) if without else _named(kind)
                label = (
                    None
                    if text in named or (without and any(one.startswith(WITHOUT) for one in named))
                    else text
                )
                named |= {text} if label else set()
                ax.plot(
                    p[begin : end + 1], y[begin : end + 1], color=colour, linestyle=LINES[kind],
                    linewidth=1.4 if kind == Stability.STABLE else 0.8, label=label, zorder=4,
                )  # fmt: skip


def _drawn(curve: ResponseCurve) -> tuple[Floats, Floats, Integers]:
    """A curve with points between its own, by its derivatives: a resonance is sharp."""
    p = curve.parameter
    inner = [
        (k, p[k] + share * (p[k + 1] - p[k])) for k in range(len(p) - 1) for share in STRETCH_SHARES
    ]
    places = np.append([place for _, place in inner], p[-1])
    values = np.append([curve.between(k, float(place)) for k, place in inner], curve.value[-1])
    return places, values, np.repeat(curve.stability, len(STRETCH_SHARES))


def _silent(kind: Stability) -> str:
    return WITHOUT + ("" if kind == Stability.STABLE else f", {kind.words}")


def _named(kind: Stability) -> str:
    return "stable orbits" if kind == Stability.STABLE else kind.words


def _runs(mask: Any) -> list[tuple[int, int]]:
    """First and last point of each run of stretches."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], mask, [False]]).astype(int)))
    return list(zip(edges[::2].tolist(), edges[1::2].tolist(), strict=True))


def _marks(ax: Axes, response: Response, axes: _Axes) -> None:
    known: set[PointKind] = set()
    for curve in response.curves:
        for point, value in zip(curve.special_points, curve.special_values, strict=True):
            if not point.admissible:
                continue
            label = point.record.name if point.record not in known else None
            known.add(point.record)
            looks = marker_of(point.record) | {"markersize": 3.4, "zorder": 5}
            ax.plot([point.parameter * axes.over], axes.y([value]), label=label, **looks)


def _limits(ax: Axes, response: Response, axes: _Axes, others: list[Floats]) -> None:
    """The band, and the values that occur: what does not settle does not set the scale."""
    band = response.band
    band_margin = MARGIN_OF_BAND * (band.high - band.low)  # marks at both ends are whole
    ax.set_xlim((band.low - band_margin) * axes.over, (band.high + band_margin) * axes.over)
    values = [abs(a.value) for many in response.answers for a in many]
    values += [float(np.nanmax(np.abs(part))) for part in others]
    values = [x for x in values if np.isfinite(x) and x > 0.0]
    if not values:
        return
    silent = [c.value for c in response.curves if c.branch is None]
    largest = max(
        (float(np.abs(part[np.isfinite(part)]).max(initial=0.0)) for part in silent), default=0.0
    )
    top = float(axes.y([max(*values, min(largest, UNSETTLED_FACTOR * max(values)))])[0])
    if axes.decibel:
        low = max(float(axes.y([min(values)])[0]), top - SHOWN_DECIBELS)
        ax.set_ylim(low - 3.0, top + 3.0)
    else:
        ax.set_ylim(0.0, TOP_FACTOR * top)


def plot_tuned_damper(damper: TunedDamper, *, ax: Axes | None = None) -> Axes:
    """Draw the amplification of a machine with a tuned mass damper over the forcing frequency.

    Parameters
    ----------
    damper
        A result of :func:`vibroimpact.tuned_damper`.
    """
    check_kind("damper", damper, TunedDamper, "a TunedDamper, as vi.tuned_damper gives")
    ratio = np.linspace(0.0, 2.0 * max(1.0, damper.frequency_ratio, damper.peak_at[0]), 1000)
    with style.drawing(ax) as ax:
        ax.plot(ratio, damper.amplification(ratio), color=style.GREEN)
        ax.set(xlabel=r"frequency ratio $\Omega/\omega_n$", ylabel="amplification $|X|$")
    return ax
