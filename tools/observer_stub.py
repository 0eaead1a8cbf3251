"""Write src/vibroimpact/sweeps/observers/__init__.pyi, by which editors and type checkers see `vi.observe`.

python tools/observer_stub.py            write it (make stubs does)
python tools/observer_stub.py --check    end with 1 where it is not up to date
"""

from __future__ import annotations

import sys
from pathlib import Path

from vibroimpact.sweeps.observers.table import OBSERVERS

STUB = Path(__file__).parents[1] / "src/vibroimpact/sweeps/observers/__init__.pyi"


def stub() -> str:
    """An import for every observer of the kernel's table."""
    classes = sorted((kind.__module__, kind.__name__) for kind in OBSERVERS.values())
    lines = [f"from {module} import {name} as {name}\n" for module, name in classes]
    return f'"""Written by tools/observer_stub.py."""\n\n{"".join(lines)}'


if __name__ == "__main__":
    if sys.argv[1:] == ["--check"]:
        sys.exit(STUB.read_text("utf-8") != stub())
    STUB.write_text(stub(), "utf-8")
