"""Write the stubs by which editors and type checkers see `vi.observe` and `vi.machines`.

python tools/name_stubs.py            write them (make stubs does)
python tools/name_stubs.py --check    end with 1 where one is not up to date
"""

from __future__ import annotations

import sys
from collections.abc import Iterable
from pathlib import Path

from vibroimpact.machines.registry import MACHINES, machine_of
from vibroimpact.sweeps.observers.table import OBSERVERS

PACKAGE = Path(__file__).parents[1] / "src/vibroimpact"
STUBS = {
    "sweeps/observers": OBSERVERS.values(),
    "machines": [machine_of(name) for name in MACHINES],
}


def stub(classes: Iterable[type]) -> str:
    """An import for every class of a table."""
    found = sorted((kind.__module__, kind.__name__) for kind in classes)
    lines = [imported(module, name) for module, name in found]
    return f'"""Written by tools/name_stubs.py."""\n\n{"".join(lines)}'


def imported(module: str, name: str) -> str:
    """The import of a class, in lines that a formatter leaves as they are."""
    line = f"from {module} import {name} as {name}\n"
    return line if len(line) <= 101 else f"from {module} import (\n    {name} as {name},\n)\n"


if __name__ == "__main__":
    texts = {PACKAGE / room / "__init__.pyi": stub(classes) for room, classes in STUBS.items()}
    if sys.argv[1:] == ["--check"]:
        sys.exit(any(path.read_text("utf-8") != text for path, text in texts.items()))
    for path, text in texts.items():
        path.write_text(text, "utf-8")
