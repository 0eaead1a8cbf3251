"""Draw the rooms of the package and of the kernel, and who imports whom, for docs/architecture.md.

    python tools/architecture_picture.py            write docs/pictures/architecture.svg
    python tools/architecture_picture.py --check    end with 1 where it is not up to date

Ends with 1 where an import goes upwards, too.

Rows are the layers that pyproject.toml lists for the linter of imports. An arrow goes from a room to
one that it imports; arrows that follow from others are left out.
"""

from __future__ import annotations

import ast
import re
import sys
import tomllib
from itertools import product
from pathlib import Path

import matplotlib.pyplot as plt
from matplotlib.axes import Axes

ROOT = Path(__file__).resolve().parents[1]
PICTURE = ROOT / "docs" / "pictures" / "architecture.svg"
KERNEL = [  # rows of the kernel, from what runs many motions down to numbers
    ["ensemble", "simd"], ["observe"], ["engine", "orbit"], ["transition"], ["search"], ["system"],
    ["flow"], ["numeric"],
]  # fmt: skip
COLUMNS = {  # across, where not in the middle
    "cli": 0.42, "explorer": 0.62, "plotting": 0.42, "design": 0.2, "transients": 0.62, "response": 0.36,
    "measures": 0.30, "bifurcations": 0.78, "tori": 1.05, "sweeps": 0.04, "branches": 0.62,
    "orbits": 0.56, "attractors": 0.40, "simulation": 0.42, "compile": 0.44, "machines": 0.62,
    "normal_forms": 0.88, "continuation": 1.12, "_core": 0.62, "_kernel": 0.62,
    "ensemble": 0.35, "simd": 0.75, "orbit": 0.95,
}  # fmt: skip
BLUE, GREY = "#0072B2", "#555555"

Edges = set[tuple[str, str]]


def layers() -> list[list[str]]:
    """Rooms of the package, row by row from the top."""
    settings = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["tool"]["importlinter"]
    return [re.split(r"\s*[:|]\s*", row) for row in settings["contracts"][0]["layers"]]


def python_edges() -> Edges:
    """(importing room, imported room) of every import in the package."""
    package, found = ROOT / "src" / "vibroimpact", Edges()
    for path in package.rglob("*.py"):
        here = path.relative_to(package).parts
        for node in ast.walk(ast.parse(path.read_text("utf-8"))):
            if isinstance(node, ast.ImportFrom) and (node.module or "").startswith("vibroimpact"):
                parts = (node.module or "").split(".")[1:]
                there = parts or [alias.name for alias in node.names]
                found.add((here[0].removesuffix(".py"), there[0]))
    return {(a, b) for a, b in found if a != b}


def kernel_edges() -> Edges:
    """(including room, included room) of every header."""
    folder, found = ROOT / "include" / "vibroimpact", Edges()
    for path in folder.rglob("*.hpp"):
        here = path.relative_to(folder).parts[0]
        found |= {(here, b) for b in re.findall(r'#include "vibroimpact/(\w+)/', path.read_text())}
    return {(a, b) for a, b in found if a != b}


def reduced(edges: Edges, rooms: set[str]) -> Edges:
    """Edges between rooms that do not follow from others."""
    edges = {(a, b) for a, b in edges if a in rooms and b in rooms}
    reach = set(edges)
    for _ in rooms:
        reach |= {(a, d) for (a, b), (c, d) in product(reach, edges) if b == c}
    longer = {(a, d) for (a, b), (c, d) in product(edges, reach) if b == c}
    return edges - longer


def climbs(rows: list[list[str]], edges: Edges) -> Edges:
    """Edges that do not lead to a lower row."""
    level = {room: y for y, row in enumerate(rows) for room in row}
    return {(a, b) for a, b in edges if {a, b} <= {*level} and level[a] >= level[b]}


def draw(ax: Axes, title: str, rows: list[list[str]], edges: Edges) -> None:
    """Boxes row by row, and arrows downwards."""
    places = {
        room: (COLUMNS.get(room, 0.5), -float(y)) for y, row in enumerate(rows) for room in row
    }
    for room, (x, y) in places.items():
        ax.text(
            x, y, room, ha="center", va="center", fontsize=9,
            bbox={"boxstyle": "round,pad=0.35", "facecolor": "white", "edgecolor": BLUE},
            zorder=3,
        )  # fmt: skip
    for a, b in sorted(edges):
        (x0, y0), (x1, y1) = places[a], places[b]
        arrow = {"arrowstyle": "-|>", "color": GREY, "linewidth": 0.9, "shrinkA": 0, "shrinkB": 0}
        ax.annotate("", (x1, y1 + 0.24), (x0, y0 - 0.24), arrowprops=arrow)
    ax.set(xlim=(-0.05, 1.2), ylim=(0.6 - len(rows), 0.7), title=title)
    ax.set_axis_off()


def halves() -> dict[str, tuple[list[list[str]], Edges]]:
    """Rooms and arrows of the package and of the kernel."""
    return {
        "src/vibroimpact": (layers(), python_edges()),
        "include/vibroimpact": (KERNEL, kernel_edges()),
    }


def pictured() -> dict[str, tuple[list[list[str]], Edges]]:
    """Those arrows only that do not follow from others."""
    return {
        name: (rows, reduced(edges, {room for row in rows for room in row}))
        for name, (rows, edges) in halves().items()
    }


def stated() -> str:
    """The arrows in words, kept in the picture."""
    lines = [
        f"{name}: " + ", ".join(f"{a} to {b}" for a, b in sorted(edges))
        for name, (_, edges) in pictured().items()
    ]
    return "<!-- " + "; ".join(lines) + " -->"


def main(arguments: list[str]) -> int:
    """Write or check the picture."""
    upwards = [f"{a} to {b}" for half in halves().values() for a, b in climbs(*half)]
    if upwards:
        print("imports go upwards:", ", ".join(upwards))
        return 1
    if arguments == ["--check"]:
        return int(not PICTURE.read_text("utf-8").rstrip().endswith(stated()))
    plt.rcParams.update({"svg.hashsalt": "architecture", "svg.fonttype": "none"})
    figure, axes = plt.subplots(1, 2, figsize=(9.0, 7.4), width_ratios=(1.4, 1.0))
    for ax, (name, (rows, edges)) in zip(axes, pictured().items(), strict=True):
        draw(ax, name, rows, edges)
    figure.tight_layout()
    figure.savefig(PICTURE, metadata={"Date": None})
    text = PICTURE.read_text("utf-8")
    PICTURE.write_text(
        "\n".join(line.rstrip() for line in text.splitlines()) + f"\n{stated()}\n", "utf-8"
    )
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
