"""Draw every figure from its dataset alone."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import matplotlib as mpl
import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.backends.backend_svg import FigureCanvasSVG
from matplotlib.figure import Figure

from vibroimpact._core.errors import InvalidParameterError
from vibroimpact.machines.impact_damper import ImpactDamper
from vibroimpact.model.state import State
from vibroimpact.plotting import (
    plot_basins,
    plot_bifurcation_diagram,
    plot_circle_error,
    plot_circle_half_width,
    plot_circles,
    plot_curves,
    plot_history,
    plot_mechanism,
    plot_multipliers,
    plot_phase_portrait,
    plot_plane,
    plot_tongue,
    style,
)
from vibroimpact.results.files import result_of
from vibroimpact.simulation.simulate import Run, simulate
from vibroimpact_papers.impact_damper.resonances import tongues_from
from vibroimpact_papers.impact_damper.unfolding import RADII, REACH

COLOURS = (style.BLUE, style.VERMILION, style.GREEN, style.PURPLE)
COLUMNS = 3
PANEL_SIZE = (3.0, 2.5)  # inches
CIRCLE_SIZE = (3.3, 2.7)
LEAST_WINDOW = 0.02  # of the half clearance: a fixed point is shown in a window so wide
MARGIN = 0.08
PIXELS_PER_INCH = 160
BRANCH = 1
# Around a resonance: curves of other orbits that begin there, and that of one critical multiplier.
BORN = {"1:4": "folds of 2-2-2", "1:2": "Neimark-Sacker, doubled orbit"}
SIMPLE = {"1:2": "symmetry breaking", "1:1": "fold"}
SCALED = {"1:2": r"\dot x/|m_1|", "1:1": r"\dot x/|m_1|^{3/4}"}
DASHES = ("--", ":", "-.")
# The most frequent of the three sets together, so that their planes have the same colours.
PLANE_SYMBOLS = ("1-1-1", "2-2-2", "3-3-3", "3-4-4", "5-5-5", "7-7-7", "4-4-4")


def open_data(path: Path) -> xr.Dataset:
    """Read a data file."""
    with xr.open_dataset(path, engine="h5netcdf") as data:
        return data.load()


def redraw(data: xr.Dataset | tuple[xr.Dataset, ...]) -> Figure:
    """Draw the figure of a dataset, or of several datasets of one figure.

    Raises
    ------
    InvalidParameterError
        No figure is drawn from such data.
    """
    parts = data if isinstance(data, tuple) else (data,)
    name = str(parts[0].attrs.get("figure"))
    draw = next((f for prefix, f in _DRAW.items() if name.startswith(prefix)), None)
    if draw is None:
        raise InvalidParameterError(
            f"figure = {name!r}: must start with one of {', '.join(_DRAW)}. Use an untouched file."
        )
    with mpl.rc_context(style.RC):
        return draw(*parts)


def save_both(figure: Figure, stem: Path) -> None:
    """Write a figure as SVG and PNG; equal figures give equal files.

    Drawn three times: for its layout, and for each file. ``savefig`` would draw it once more for each.
    """
    with mpl.rc_context(style.RC):
        figure.draw_without_rendering()
        figure.set_layout_engine("none")
        figure.dpi = PIXELS_PER_INCH  # of what is stored as pixels in the SVG, which has 72
        svg, png = FigureCanvasSVG(figure), FigureCanvasAgg(figure)
        svg.print_svg(stem.with_suffix(".svg"), metadata={"Date": None})  # type: ignore[no-untyped-call]
        figure.dpi = PIXELS_PER_INCH
        png.print_png(stem.with_suffix(".png"))  # type: ignore[no-untyped-call]


def damper_from(attrs: Mapping[Any, Any], omega: float) -> ImpactDamper:
    """Return the damper that the attributes of a file describe."""
    names = ("mass_ratio", "omega_n", "zeta", "restitution", "half_clearance", "force")
    given: dict[str, Any] = {name: float(attrs[name]) for name in names}
    return ImpactDamper(**given, omega=omega)


def run_from(data: xr.Dataset) -> Run:
    """Repeat the run of a file from its attributes: the same bits."""
    a = data.attrs
    start = State(tuple(a["start_position"]), tuple(a["start_velocity"]), float(a["start_phase"]))
    return simulate(damper_from(a, float(a["omega"])), start, impacts=int(a["impacts"]))


# --- one function per sort of figure ------------------------------------------------------------


def _grid(count: int, size: tuple[float, float], columns: int) -> tuple[Figure, list[Axes]]:
    rows = -(-count // columns)
    figure = Figure(figsize=(size[0] * columns, size[1] * rows), layout="constrained")
    axes = [figure.add_subplot(rows, columns, i + 1) for i in range(count)]
    return figure, axes


def _mechanism(data: xr.Dataset) -> Figure:
    figure, axes = _grid(1, (6.0, 3.0), 1)
    plot_mechanism(damper_from(data.attrs, float(data.attrs["omega"])), ax=axes[0])
    return figure


def _history(data: xr.Dataset) -> Figure:
    figure, axes = _grid(1, (8.0, 3.6), 1)
    plot_history(run_from(data), ax=axes[0])
    return figure


def _portrait(data: xr.Dataset) -> Figure:
    figure, axes = _grid(2, (4.2, 3.4), 2)
    run = run_from(data)
    plot_phase_portrait(run, row=(1.0, 0.0), ax=axes[0])
    plot_phase_portrait(run, row=(-1.0, 1.0), ax=axes[1])
    for stop, colour in ((1.0, style.BLUE), (-1.0, style.VERMILION)):
        place = stop * float(data.attrs["half_clearance"])
        axes[1].axvline(place, color=colour, linewidth=2.0, zorder=0)
    return figure


def _diagram(data: xr.Dataset) -> Figure:
    figure, axes = _grid(2, (8.4, 2.9), 1)
    for ax, variable in zip(axes, ("x1", "v1"), strict=True):
        plot_bifurcation_diagram(data, variable=variable, ax=ax)
    axes[1].get_legend().remove()  # type: ignore[union-attr]
    axes[0].set_xlabel("")
    for ax in axes:
        ax.margins(x=0.01)
    return figure


def _plane(data: xr.Dataset) -> Figure:
    """Draw the plane, with a ring at every frequency of the paper, at its clearance."""
    figure, axes = _grid(1, (6.4, 3.9), 1)
    plot_plane(data, symbols=PLANE_SYMBOLS, ax=axes[0])
    omega = data["paper_omega"].values
    clearance = np.full(omega.shape, float(data.attrs["half_clearance"]))
    axes[0].plot(omega, clearance, linestyle="none", marker="o", markersize=4.0,
                 markerfacecolor="white", markeredgecolor=style.BLACK, clip_on=False)  # fmt: skip
    return figure


def _strong(plane: xr.Dataset, *parts: xr.Dataset) -> Figure:
    """Draw curves of bifurcations over a plane, with the frequencies of the paper."""
    figure, axes = _grid(1, (7.6, 5.4), 1)
    ax = axes[0]
    plot_plane(plane, symbols=PLANE_SYMBOLS, ax=ax)
    curves = [result_of(part) for part in parts if "tongue" not in part.attrs]
    plot_curves(curves, ax=ax)
    for tongue in tongues_from(curves, [part for part in parts if "tongue" in part.attrs]):
        plot_tongue(tongue, ax=ax)
    own = float(plane.attrs["half_clearance"])
    for name, marker, size in (("paper_omega", "o", 3.6), ("printed_omega", "v", 6.5)):
        omega = plane[name].values
        ax.plot(omega, np.full(omega.shape, own), linestyle="none", marker=marker, markersize=size,
                markerfacecolor="white", markeredgecolor=style.BLACK, zorder=3.8)  # fmt: skip
    return figure


def _families(data: xr.Dataset) -> Figure:
    """Draw circles over simulated points, and rotation number and smoothness of the family."""
    names = data["panel"].values.tolist()
    figure, axes = _grid(len(names) + 2, PANEL_SIZE, COLUMNS)
    for i, (name, ax) in enumerate(zip(names, axes, strict=False)):
        one = data.isel(panel=i)
        style.points(ax, *one["simulated"].values.T, color=style.SKY, markersize=4.5)
        ax.plot(*one["circle"].values.T, color=style.BLACK, linewidth=0.8)
        ax.set(xlabel="$x_1$", ylabel="" if i % COLUMNS else r"$\dot x_{1+}$")
        ax.locator_params(nbins=4)
        ax.set_title(
            f"({name[1:]})  $\\omega={float(one['panel_omega']):.10g}$, "
            f"$\\rho={float(one['panel_rotation']):.6f}$",
            loc="left", fontsize=8.5,
        )  # fmt: skip
    _rotation(axes[-2], data)
    _smoothness(axes[-1], data)
    return figure


def _rotation(ax: Axes, data: xr.Dataset) -> None:
    """Draw the rotation number along the family, with the panels and the locked motions."""
    ax.plot(data["circle_omega"], data["rotation"], color=style.BLUE, linewidth=1.2)
    ax.plot(data["panel_omega"], data["panel_rotation"], linestyle="none", marker="o",
            markersize=4.0, color=style.BLACK, label="circles shown")  # fmt: skip
    lock = data["locked_omega"].values
    if lock.size:
        locked = data["locked_p"].values / data["locked_q"].values
        ax.plot(lock, locked, linestyle="none", marker="D", markersize=4.5,
                markerfacecolor="white", markeredgecolor=style.VERMILION, label="locked")  # fmt: skip
        seen: set[tuple[int, int]] = set()
        for w, p, q in zip(lock, data["locked_p"].values, data["locked_q"].values, strict=True):
            if (int(p), int(q)) not in seen:
                ax.annotate(f"{p}/{q}", (w, p / q), (0.0, 6.0), textcoords="offset points",
                            ha="center", fontsize=8.0, color=style.VERMILION)  # fmt: skip
                seen.add((int(p), int(q)))
    ax.margins(0.08, 0.15)
    ax.set(xlabel=r"$\omega$", ylabel=r"rotation number $\rho$")
    ax.locator_params(nbins=4)
    ax.legend(fontsize=7.5, loc="best")


def _smoothness(ax: Axes, data: xr.Dataset) -> None:
    """Draw the leading normal multiplier and the least angle along the family."""
    ax.plot(data["circle_omega"], data["leading"], color=style.BLUE, linewidth=1.2,
            label="normal multiplier")  # fmt: skip
    ax.plot(data["circle_omega"], data["least_angle"], color=style.VERMILION, linewidth=1.2,
            linestyle="--", label=r"$\sin\alpha$, least angle")  # fmt: skip
    ax.set(xlabel=r"$\omega$", ylim=(0.0, 1.3), yticks=(0.0, 0.5, 1.0))
    ax.locator_params(axis="x", nbins=4)
    ax.legend(fontsize=7.5, loc="upper left")


def _unfolding(data: xr.Dataset) -> Figure:
    """Draw the parameters of the sectors, and in each the portraits, predicted over simulated."""
    count, name = data.sizes["sector"], str(data.attrs["resonance"])
    height = 5.3 if count < 5 else 6.0
    figure = Figure(figsize=(2.45 * (count + 1.25), height), layout="constrained")
    grid = figure.add_gridspec(2, count + 1, width_ratios=[1.35, *[1.0] * count])
    _around(figure.add_subplot(grid[:, 0]), data)
    up = SCALED.get(name, r"\mathrm{Im}\,z")
    for i in range(count):
        pair = [figure.add_subplot(grid[row, i + 1]) for row in range(2)]
        for ax, how in zip(pair, ("predicted", "simulated"), strict=True):
            _portrait_of_z(ax, data.isel(sector=i), how, float(data.attrs["unit"]))
            ax.set_ylabel(f"{how}\n${up}$" if i == 0 else "")
        pair[0].set_title(f"({i + 1}) {data['words'].values[i]}", fontsize=8.5, loc="left")
        pair[0].set_xlabel("")
        pair[1].set_xlabel(r"$x/|m_1|^{1/2}$" if name in SCALED else r"$\mathrm{Re}\,z$")
    return figure


def _around(ax: Axes, data: xr.Dataset) -> None:
    """Draw the curves that meet at the point, and where the portraits are."""
    name = str(data.attrs["resonance"])
    own = name in SIMPLE  # drawn in the plane of (m1, m2)
    if own:
        ax.axvline(0.0, color=style.GREEN, linewidth=1.4, label=SIMPLE[name])
    ax.plot(*data["torus"].values.T, color=style.BLACK, linewidth=1.4, label="Neimark-Sacker")
    if np.isfinite(data["born"].values).any():
        ax.plot(*data["born"].values.T, color=style.BLUE, linewidth=1.4, label=BORN[name])
    _predicted_lines(ax, data)
    point = (0.0, 0.0) if own else (data.attrs["point_omega"], data.attrs["point_half_clearance"])
    ax.plot(*point, marker="o", color=style.BLACK, markersize=5.5, linestyle="none", label=name)
    at = np.column_stack([data["mu_real"], data["mu_imag"]]) if own else data["sector_at"].values
    ax.plot(*at.T, marker="s", color=style.VERMILION, markersize=4.5, linestyle="none",
            label="portraits")  # fmt: skip
    for i, (x, y) in enumerate(at):
        ax.annotate(str(i + 1), (x, y), (6.0, -3.0), textcoords="offset points", fontsize=9.0,
                    color=style.VERMILION)  # fmt: skip
    reach = REACH * np.abs(at - point).max(axis=0)
    ax.set(xlim=(point[0] - reach[0], point[0] + reach[0]),
           ylim=(point[1] - reach[1], point[1] + reach[1]),
           xlabel=r"$m_1$" if own else r"forcing frequency $\omega$",
           ylabel=r"$m_2$" if own else r"half clearance $\delta$")  # fmt: skip
    ax.locator_params(axis="x", nbins=3)
    ax.legend(fontsize=7.5, loc="lower left", bbox_to_anchor=(0.0, 1.0), ncols=1)


def _predicted_lines(ax: Axes, data: xr.Dataset) -> None:
    """Draw the lines that theory predicts, those of one name alike."""
    words = [str(w) for w in np.atleast_1d(data.attrs["line_words"])]
    values = data["lines"].values
    ends = np.flatnonzero(np.isnan(values[:, 0]))
    for name, dash in zip(dict.fromkeys(words), DASHES, strict=False):
        parts = [part for part, w in zip(np.split(values, ends), words, strict=False) if w == name]
        ax.plot(*np.concatenate(parts).T, color=style.ORANGE, linewidth=1.2, linestyle=dash,
                label=name)  # fmt: skip


def _portrait_of_z(ax: Axes, one: xr.Dataset, name: str, unit: float) -> None:
    """Draw trajectories in the plane of z, coloured by the radius of their starts."""
    x, y = one[f"{name}_real"].values, one[f"{name}_imag"].values
    gap = np.full((len(x) // len(RADII), 1), np.nan)
    for i, colour in enumerate((style.BLUE, style.GREEN, style.ORANGE)):
        u, v = (np.hstack([np.split(part, len(RADII))[i], gap]).ravel() for part in (x, y))
        if name == "predicted":
            ax.plot(u, v, color=colour, linewidth=0.6, rasterized=True)
        else:
            style.points(ax, u, v, color=colour, markersize=1.0)
    ax.plot(one["periodic_real"], one["periodic_imag"], linestyle="none", marker="o",
            markersize=4.0, markerfacecolor="white", markeredgecolor=style.BLACK, zorder=4)  # fmt: skip
    points = np.hypot(one["periodic_real"].values, one["periodic_imag"].values)
    reach = max(2.1 * unit, 1.15 * float(np.nanmax(points, initial=0.0)))
    ax.set(xlim=(-reach, reach), ylim=(-reach, reach), aspect="equal")
    ax.locator_params(nbins=4)


def _spectra(*parts: xr.Dataset) -> Figure:
    """Draw the exponents of each set over the frequency, with their errors."""
    figure, axes = _grid(len(parts), (8.4, 2.5), 1)
    for ax, data in zip(axes, parts, strict=True):
        ax.axhline(0.0, color=style.GREY, linewidth=0.7)
        for i, colour in zip(range(data.sizes["order"]), COLOURS, strict=False):
            one = data.isel(order=i)
            value = np.where(np.isfinite(one["exponent"].values), one["exponent"].values, np.nan)
            ax.errorbar(one["omega"], value, one["error"].values, color=colour, marker=".",
                        markersize=4.0, linewidth=0.7, elinewidth=0.7,
                        label=rf"$\chi_{i + 1}$")  # fmt: skip
        ax.set_title(f"set {data.attrs['set']}", loc="left")
        ax.set(xlabel=r"forcing frequency $\omega$", ylabel=r"exponents $\chi_i$ per time")
        ax.margins(x=0.01)
    axes[0].legend(ncols=4, fontsize=8.0, loc="lower left", bbox_to_anchor=(0.7, 1.0))
    for ax in axes[:-1]:
        ax.set_xlabel("")
    return figure


def _basins(data: xr.Dataset) -> Figure:
    figure, axes = _grid(1, (6.0, 4.2), 1)
    plot_basins(data, ax=axes[0])
    return figure


def _multipliers(*parts: xr.Dataset) -> Figure:
    """Draw one row per set: nu left, lambda right, for the paper's branch."""
    figure, axes = _grid(2 * len(parts), (4.4, 3.7), 2)
    for data, pair in zip(parts, zip(axes[::2], axes[1::2], strict=True), strict=True):
        branch = data.sel(sign=BRANCH)
        nu = branch["nu_real"].values + 1j * branch["nu_imag"].values
        known = np.isfinite(nu[:, 0]) & (branch["admissible"].values > 0)
        omega = branch["omega"].values[known]
        for ax, half, power in zip(pair, (True, False), (1, 2), strict=True):
            plot_multipliers(nu[known] ** power, omega=omega, half=half, ax=ax)
            what = r"half map, $\nu$" if half else r"full map, $\lambda=\nu^2$"
            ax.set_title(f"set {data.attrs['set']}: {what}", loc="left")
            reach = max(1.0, float(np.abs(nu[known] ** power).max())) * (1.0 + MARGIN)
            ax.set(xlim=(-reach, reach), ylim=(-reach, reach))
    return figure


def _circles(*parts: xr.Dataset) -> Figure:
    """Draw one row per Neimark-Sacker point: half-widths, error of the radius, circles."""
    figure, axes = _grid(COLUMNS * len(parts), CIRCLE_SIZE, COLUMNS)
    for i, data in enumerate(parts):
        row = axes[COLUMNS * i : COLUMNS * (i + 1)]
        for draw, ax in zip((plot_circle_half_width, plot_circle_error, plot_circles), row,
                            strict=True):  # fmt: skip
            draw(data, ax=ax)
        born = "attracting" if data.attrs["attracting"] else "repelling"
        name = f"set {data.attrs['set']}, $\\omega_c={data.attrs['omega_critical']:.6f}$"
        row[0].set_title(f"{name}, {born}", loc="left")
    return figure


def _panels(data: xr.Dataset) -> Figure:
    """Draw a grid of sections, with one colour per coexisting attractor."""
    names = list(dict.fromkeys(data["panel"].values.tolist()))
    figure, axes = _grid(len(names), PANEL_SIZE, min(COLUMNS, len(names)))
    least = LEAST_WINDOW * float(data.attrs["half_clearance"])
    for name, ax in zip(names, axes, strict=True):
        _panel(ax, data, name, least)
    for ax in axes[:-COLUMNS]:
        ax.set_xlabel("")
    for i, ax in enumerate(axes):
        ax.set_ylabel("" if i % COLUMNS else ax.get_ylabel())
    return figure


def rows_of(data: xr.Dataset, panel: str) -> list[dict[str, Any]]:
    """Return the rows of one panel with their points, one per attractor, and all its starts."""
    ends = np.cumsum(data["row_size"].values)
    rows: dict[int, dict[str, Any]] = {}
    for i in np.flatnonzero(data["panel"].values == panel):
        part = slice(int(ends[i] - data["row_size"].values[i]), int(ends[i]))
        start = str(data["start"].values[i])
        row = rows.setdefault(int(data["attractor"].values[i]), {"starts": []})
        row["starts"].append(start)
        if len(row) == 1:
            row |= {"x1": data["x1"].values[part], "v1": data["v1"].values[part],
                    "name": str(data["name"].values[i]),
                    "omega": float(data["omega"].values[i])}  # fmt: skip
    return [rows[key] for key in sorted(rows)]


def _panel(ax: Axes, data: xr.Dataset, panel: str, least: float) -> None:
    rows = rows_of(data, panel)
    for row, colour in zip(rows, COLOURS, strict=False):
        style.points(ax, row["x1"], row["v1"], color=colour, **_marker(row))
    for values, limit in (("x1", ax.set_xlim), ("v1", ax.set_ylim)):
        limit(*_window(np.concatenate([row[values] for row in rows]), least))
    ax.set(xlabel="$x_1$", ylabel=r"$\dot x_{1+}$")
    ax.locator_params(nbins=4)
    lines = [(f"({panel[1:]})  $\\omega={rows[0]['omega']:.10g}$", style.BLACK, 10.0)]
    for row, colour in zip(rows, COLOURS, strict=False):
        starts = "" if len(rows) == 1 else f" ({', '.join(row['starts'])})"
        lines.append((row["name"] + starts, colour, 8.0))
    for above, (text, colour, size) in enumerate(reversed(lines)):
        ax.annotate(text, (0.0, 1.0), (0.0, 4.0 + 10.0 * above), xycoords="axes fraction",
                    textcoords="offset points", color=colour, fontsize=size)  # fmt: skip


def _marker(row: dict[str, Any]) -> dict[str, Any]:
    """Style of the marks: large dots for few places, small ones, as pixels, for many."""
    places = np.unique(np.round(np.column_stack([row["x1"], row["v1"]]), 6), axis=0)
    return {"markersize": 5.0 if len(places) < 20 else 2.5 if len(places) < 200 else 0.9}


def _window(values: np.ndarray[Any, np.dtype[np.float64]], least: float) -> tuple[float, float]:
    low, high = float(values.min()), float(values.max())
    half = max((high - low) * (0.5 + MARGIN), least / 2.0)
    middle = (low + high) / 2.0
    return middle - half, middle + half


_DRAW: Mapping[str, Callable[..., Figure]] = {
    "mechanism": _mechanism,
    "history": _history,
    "portrait": _portrait,
    "diagram": _diagram,
    "multipliers": _multipliers,
    "figure": _panels,
    "section": _panels,
    "circles": _circles,
    "plane": _plane,
    "strong": _strong,
    "unfolding": _unfolding,
    "spectra": _spectra,
    "families": _families,
    "basins": _basins,
}
