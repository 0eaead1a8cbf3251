"""A run that moves: the machine lane by lane above its time history."""

from __future__ import annotations

import math
import shutil
import tempfile
from pathlib import Path
from typing import Any, NamedTuple

import matplotlib as mpl
import matplotlib.pyplot as plt
import numpy as np
from matplotlib.animation import FuncAnimation
from matplotlib.axes import Axes
from matplotlib.patches import Rectangle

from vibroimpact._core.checks import check_count, positive
from vibroimpact._core.errors import InvalidParameterError
from vibroimpact._core.types import Floats
from vibroimpact.machines.units import units_of
from vibroimpact.model.elements.element import Element
from vibroimpact.model.system import mechanism_of
from vibroimpact.plotting import style, symbols
from vibroimpact.plotting.element_states import motion_of
from vibroimpact.plotting.history import COLOURS, window_of
from vibroimpact.simulation.simulate import Run

BODY_WIDTH = 0.16  # of a body, relative to what is seen of its lane
BODY_HEIGHT = 0.56  # relative to the height of a lane
FLASH_SECONDS = 0.3  # an impact is seen so long
DOTS_PER_INCH = 100
MOST_FRAMES = 5000  # of an animation


class Place(NamedTuple):
    """Place of a stop: the coordinate that meets it, the one that carries it, or the ground, the sign of its row."""

    on: int
    carrier: int | None
    sign: float


def place_of(e: Element) -> Place | None:
    """Place of a stop of one coordinate, or of the difference of two; None for any other element."""
    where = [i for i, x in enumerate(e.row) if x]
    if not e.is_stop or not where or abs(e.row[where[0]]) != 1.0:
        return None
    if len(where) == 1:
        return Place(where[0], None, e.row[where[0]])
    if len(where) == 2 and e.row[where[0]] == -e.row[where[1]]:
        return Place(where[1], where[0], e.row[where[1]])
    return None


class Lanes:
    """Bodies and stops of a machine on axes, a lane for each coordinate."""

    def __init__(self, ax: Axes, run: Run, t: Floats, x: Floats) -> None:
        self.run, self.x, self.t = run, x, t
        m = mechanism_of(run.system)
        self.elements = m.elements
        self.stops = [
            (number, place, side, e.limit_at(side))
            for number, e in enumerate(m.elements)
            if (place := place_of(e))
            for side in (1, -1)
            if math.isfinite(e.limit_at(side))
        ]
        walls = [self._walls(i) for i in range(len(self.stops))]
        seen = [np.abs(x).max(), *(np.abs(wall).max() for wall in walls), 1e-300]
        self.half = BODY_WIDTH * float(max(seen))
        self.walls = [
            wall + side * place.sign * self.half
            for wall, (_, place, side, _) in zip(walls, self.stops, strict=True)
        ]
        edge = float(max(seen)) + 2.5 * self.half
        n = m.degrees
        ax.set(xlim=(-edge, edge), ylim=(-n + 0.5, 0.5))
        ax.axis("off")
        for i in range(n):
            ax.axhline(-i - BODY_HEIGHT / 2.0, color=style.SILVER, linewidth=0.6, zorder=0)
        self.bodies = [
            Rectangle((0.0, -i - BODY_HEIGHT / 2.0), 2.0 * self.half, BODY_HEIGHT,
                      facecolor=symbols.BODY, edgecolor=style.BLACK, lw=0.8)
            for i in range(n)
        ]  # fmt: skip
        for body in self.bodies:
            ax.add_patch(body)
        self.names = [
            ax.text(0.0, -i, f"$x_{{{i + 1}}}$", ha="center", va="center") for i in range(n)
        ]
        self.lines = [
            ax.plot([], [], color=style.BLUE if side > 0 else style.VERMILION, linewidth=2.4)[0]
            for _, _, side, _ in self.stops
        ]
        self.arms = [
            ax.plot([], [], color=line.get_color(), linewidth=0.8, zorder=0)[0]
            for line in self.lines
        ]
        self.flashes = [
            ax.plot([], [], "o", color=style.YELLOW, markersize=22.0, zorder=0)[0]
            for _ in self.stops
        ]

    def _walls(self, i: int) -> Floats:
        """Where a stop is at every time, for a coordinate without extent."""
        number, place, _, limit = self.stops[i]
        at = np.full(len(self.t), place.sign * limit)
        if place.carrier is not None:
            at = at + self.x[:, place.carrier]
        return at + place.sign * motion_of(self.run, self.elements[number].motion, self.t)

    def show(self, k: int, flash: float) -> None:
        """Draw frame k; an impact is seen for the time ``flash``."""
        run, now = self.run, self.t[k]
        for i, (body, name) in enumerate(zip(self.bodies, self.names, strict=True)):
            body.set_x(self.x[k, i] - self.half)
            name.set_x(self.x[k, i])
        recent = run.impacts & (run.time <= now) & (run.time > now - flash)
        parts = zip(self.stops, self.walls, self.lines, self.arms, self.flashes, strict=True)
        for (number, place, side, _), walls, line, arm, light in parts:
            at, y = walls[k], -place.on
            line.set_data([at, at], [y - BODY_HEIGHT / 2.0, y + BODY_HEIGHT / 2.0])
            if place.carrier is not None:
                above = -place.carrier
                arm.set_data([self.x[k, place.carrier], at, at], [above, above, y])
            hits = np.flatnonzero(recent & (run.contact == number) & (run.side == side))
            if hits.size:
                light.set_data([at], [y])
                light.set_alpha(float(1.0 - (now - run.time[hits[-1]]) / flash))
            else:
                light.set_data([], [])


def animate_run(
    run: Run,
    t0: float = 0.0,
    t1: float | None = None,
    *,
    seconds: float = 6.0,
    frames_per_second: int = 20,
) -> FuncAnimation:
    """Let a run move, as :meth:`Run.animate` says."""
    start, end = window_of(run, t0, t1)
    positive("seconds", seconds)
    check_count("frames_per_second", frames_per_second, 1, 100)
    frames = max(2, round(seconds * frames_per_second))
    if frames > MOST_FRAMES:
        raise InvalidParameterError(
            f"seconds = {seconds}: {frames} frames; at most {MOST_FRAMES}. Give fewer frames_per_second."
        )
    t = np.linspace(start, end, frames)
    x = run.at(t)[0]
    units = units_of(run.system)
    with mpl.rc_context(style.RC):
        height = 0.7 * x.shape[1] + 2.2
        figure, (above, below) = plt.subplots(
            2, 1, figsize=(6.0, height), layout="constrained", height_ratios=(0.7 * x.shape[1], 1.8)
        )
        plt.close(figure)  # the animation holds it
        lanes = Lanes(above, run, t, x)
        below.set(xlim=(start, end), xlabel=units.label("time $t$", "time"))
        fine = np.linspace(start, end, 2000)
        curves = run.at(fine)[0]
        for i in range(x.shape[1]):
            colour = COLOURS[i % len(COLOURS)]
            below.plot(fine, curves[:, i], color=colour, linewidth=0.8, label=f"$x_{{{i + 1}}}$")
        below.legend(loc="upper right", ncols=x.shape[1], frameon=False, fontsize=8.0)
        now = below.axvline(start, color=style.GREY, linewidth=0.8)

    def draw(k: int) -> list[Any]:
        lanes.show(k, FLASH_SECONDS * (end - start) / seconds)
        now.set_xdata([t[k], t[k]])
        return []

    return FuncAnimation(figure, draw, frames=frames, interval=1000.0 / frames_per_second)


def content_of_animation(animation: FuncAnimation, suffix: str) -> bytes:
    """Content of a file of an animation: .gif, or .mp4 where FFmpeg is installed."""
    with mpl.rc_context(style.RC), tempfile.TemporaryDirectory() as folder:
        if suffix == ".mp4" and not shutil.which("ffmpeg"):
            raise InvalidParameterError(
                "out: .mp4 needs the program ffmpeg, which is not installed. Write .gif."
            )
        path, writer = Path(folder) / f"run{suffix}", "ffmpeg" if suffix == ".mp4" else "pillow"
        animation.save(path, writer=writer, dpi=DOTS_PER_INCH)
        return path.read_bytes()
