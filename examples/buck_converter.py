"""A hybrid system: a buck converter under current control, whose period doubles at half its supply.

The switch closes at every tick of a clock, and opens when the current i reaches its peak:
i' = supply - load, then i' = -load. From tick to tick i -> peak - load (1 - (peak - i) / (supply - load)),
of slope -load / (supply - load), which is -1 where the load takes half of the supply.
"""

from __future__ import annotations

import argparse

import numpy as np

import vibroimpact as vi
from vibroimpact.plotting import save, style

STILL, TICK = [[0.0, 0.0], [0.0, 0.0]], [0.0, -1.0]
START, TICKS = vi.State((1.5, 0.0), (0.0, 0.0)), vi.AtChange(0, "MODE_0")


def converter(load: float = 1.0, supply: float = 3.0, peak: float = 2.0) -> vi.HybridSystem:
    """The current, and a clock that runs from 0 to 1."""
    on, off = (vi.LinearMode(STILL, [drive - load, 1.0]) for drive in (supply, 0.0))
    return vi.HybridSystem(
        modes={"on": on, "off": off},
        guards={"peak": vi.LinearGuard([1.0, 0.0], peak), "tick": vi.LinearGuard([0.0, 1.0], 1.0)},
        transitions=(
            vi.Transition("on", "peak", "rising", "off"),
            vi.Transition("off", "tick", "rising", "on", shift=TICK),
            vi.Transition("on", "tick", "rising", "on", shift=TICK),
        ),
    )


def main(out: str | None = None) -> None:
    """Follow the orbit over the load, and draw it among what simulation settles on."""
    family = vi.Family(converter)
    orbit = vi.find_orbit(family, vi.simulate(family, START, t_max=60.0))
    print(f"multiplier {orbit.multipliers[0].real:.12f}, closed form {-1.0 / 2.0}")
    branch = vi.continue_orbit(orbit, "load", (1.0, 1.9), inadmissible=True)
    (doubling,) = branch.special_points
    print(f"{doubling.label} at load = {doubling.parameters['load']:.12f}, closed form {3.0 / 2.0}")
    loads = np.linspace(1.0, 1.9, 61)
    with style.drawing(None) as ax:
        for load in loads:
            ticks = vi.section(family.replace(load=load), START, at=TICKS, points=40)
            ax.plot(np.full(40, load), ticks.x1, ".", color=style.BLUE, markersize=1.5)
        ax.plot(loads, 2.0 - loads * (1.0 - loads / 3.0), color=style.GREY, linestyle=":")
        ax.axvline(1.5, color=style.GREY, linestyle=":")
        ax.set(xlabel="load (the supply is 3)", ylabel="current at a tick")
    if out:
        save(ax, out)
    else:
        print("no picture is written: give --out FILE")


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--out", metavar="FILE", help="where to write the picture (SVG, PNG, PDF)")
    main(parser.parse_args().out)
