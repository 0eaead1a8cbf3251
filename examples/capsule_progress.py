"""How fast does the vibro-impact capsule creep, over the frequency of its motor?"""

from __future__ import annotations

import argparse

import vibroimpact as vi
from vibroimpact.plotting import save, style


def main(out: str | None = None) -> None:
    """Follow its orbit in the frequency, and draw the progress per period."""
    capsule = vi.machines.VibroImpactCapsule()
    settled = vi.simulate(capsule, vi.State((0.0, 0.0), (0.0, 0.0)), impacts=200)
    orbit = vi.find_orbit(capsule, settled)
    print(f"at omega = {capsule.omega} it advances by {orbit.progress[1]:.9f} a period")
    branch = vi.continue_orbit(orbit, "omega", (1.0, 1.3))
    print(branch)
    least = branch["PEAK1"].parameter
    with style.drawing(None) as ax:
        ax.plot(branch.values, branch.progress[:, 1], color=style.BLUE)
        ax.axvline(least, color=style.GREY, linestyle=":")
        ax.set(xlabel=r"forcing frequency $\omega$", ylabel="progress per period")
    if out:
        save(ax, out)
    else:
        print("no picture is written: give --out FILE")


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--out", metavar="FILE", help="where to write the picture (SVG, PNG, PDF)")
    main(parser.parse_args().out)
