"""The section of the report on planes and basins: pictures, shares, and sentences around them."""

from __future__ import annotations

import xarray as xr

from vibroimpact.plotting.page import Block, Cell, Table, Text
from vibroimpact.sweeps.analyses.basins import attractor_state
from vibroimpact.sweeps.analyses.motion_codes import categories
from vibroimpact_papers.impact_damper.findings import Findings, Pictures

LISTED = 4  # motions that a caption names


def ensemble_blocks(found: Findings, pictures: Pictures) -> list[Block]:
    """Return the planes of all sets and the basins."""
    blocks: list[Block] = [
        Text(
            (
                "Each point of a plane is one machine, started with both masses in the middle and "
                "the free one moving. Its colour is the symbol n-p-q of the motion on which it "
                "settles: n forcing periods, p impacts at stop A and q at stop B until it "
                "repeats. Rings are the frequencies of the paper, at its clearance. Chaotic: a "
                "disturbance grows by more than e^10 in the window. Not periodic: a closed curve, "
                "weak chaos, or a motion that settles more slowly than was waited for.",
            )
        )
    ]
    for name in found.sets:
        data = found.ensembles[f"plane-{name}"]
        blocks += pictures.figure(
            f"plane-{name}", f"Plane of set {name}", _caption(data),
            f"Plane of set {name}, coloured by the symbol of the motion",
        )  # fmt: skip
    return blocks + _basins(found, pictures)


def _caption(data: xr.Dataset) -> str:
    """Return the most frequent motions with their shares."""
    present = sorted(categories(data["motion"]), key=lambda one: -one.members)[:LISTED]
    total = data["motion"].size
    listed = ", ".join(f"{one.words} at {100.0 * one.members / total:.0f}%" for one in present)
    return f"{data.sizes['omega']} x {data.sizes['half_clearance']} machines: {listed}."


def _basins(found: Findings, pictures: Pictures) -> list[Block]:
    data = next((d for name, d in found.ensembles.items() if name.startswith("basins")), None)
    if data is None:
        return []
    figure, omega = str(data.attrs["figure"]), float(data.attrs["omega"])
    text = (
        f"At \u03c9 = {omega:.10g}, a frequency of Fig. 4, attractors coexist in set "
        f"{data.attrs['set']}: the same machine settles on one or another, as it is started. Each "
        "point is a start of the main mass, the free mass in the middle with velocity 1. Near a "
        "boundary of the basins no measurement of the start is good enough to say where it leads."
    )
    return [
        Text((text,)),
        *pictures.figure(
            figure, f"Basins of set {data.attrs['set']}",
            "Marks: states on the attractors at whole numbers of forcing periods.",
            "Basins of attraction over place and velocity of the main mass",
        ),
        Table(
            ("attractor", "share of starts", "exponent", "a state on it: x1, x2; v1, v2; phase"),
            _rows(data),
        ),
    ]  # fmt: skip


def _rows(data: xr.Dataset) -> list[list[Cell]]:
    rows: list[list[Cell]] = []
    for i, name in enumerate(map(str, data["name"].values)):
        state = attractor_state(data, name)
        place, speed = (", ".join(f"{x:.9g}" for x in p) for p in (state.position, state.velocity))
        share, exponent = float(data["share"][i]), float(data["exponent"][i])
        on_it = f"{place}; {speed}; {state.phase:.9g}"
        rows.append([name, f"{100.0 * share:.3g}%", f"{exponent:.3g}", on_it])
    return rows
