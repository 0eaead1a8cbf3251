"""``python -m benchmarks``: check answers first, time them, print the tables; all parts, or those that are named."""

from __future__ import annotations

import argparse
import json
from collections.abc import Sequence
from dataclasses import asdict
from importlib import import_module
from pathlib import Path
from typing import Any

from benchmarks import machine

# A file of this folder each, with a function ``run`` of the options, which returns what it measured.
PARTS = (
    "trajectories",
    "ensembles",
    "branches",
    "curves",
    "cascade",
    "elements",
    "observers",
    "design",
    "calls",
)


def main(argv: Sequence[str] | None = None) -> int:
    """Run the benchmarks."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks", description=__doc__)
    parser.add_argument(
        "parts", nargs="*", metavar="PART", help=f"{', '.join(PARTS)}; by default all"
    )
    parser.add_argument("--quick", action="store_true", help="sizes that only show that it runs")
    parser.add_argument("--rounds", type=int, default=5, help="runs of each; the median is printed")
    parser.add_argument("--seed", type=int, default=20, help="seed of starts and flights")
    parser.add_argument("--json", type=Path, help="also write all numbers to this file")
    parser.add_argument("--plot", type=Path, help="draw how ensembles scale (svg, png, pdf)")
    options = parser.parse_args(argv)
    if unknown := {*options.parts} - {*PARTS}:
        parser.error(f"{', '.join(unknown)}: must be of {', '.join(PARTS)}")
    options.rounds = 1 if options.quick else options.rounds
    content: dict[str, Any] = {"machine": machine.show(), "seed": options.seed}
    for name in options.parts or PARTS:
        print(f"\n== {name}")
        content[name] = import_module(f"benchmarks.{name}").run(options)
    if options.json:
        options.json.write_text(json.dumps(content, indent=2, default=asdict) + "\n")
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
