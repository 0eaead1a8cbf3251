"""The compiled kernel: of the modules that are installed, the best for this processor.

Each module, ``_kernel_avx512``, ``_kernel_avx2``, ``_kernel_baseline``, is the whole kernel
compiled for one instruction set; all give the same bits. The environment variable
``VIBROIMPACT_TARGET`` names one to be used instead of the best.
"""

from __future__ import annotations

import importlib
import importlib.util
import os
import platform
from typing import Any

from vibroimpact._cpu import supported


def installed(targets: list[str]) -> list[str]:
    """Return the instruction sets for which there is a module."""
    return [t for t in targets if importlib.util.find_spec(f"vibroimpact._kernel_{t}")]


def chosen(usable: list[str], wanted: str | None) -> str:
    """The instruction set to use, of those that are installed and run here, best first."""
    if not usable:
        raise ImportError(
            f"vibroimpact was built for other processors than this one ({platform.machine()}). "
            "Reinstall it on this machine."
        )
    if wanted is not None and wanted not in usable:
        raise ImportError(
            f"VIBROIMPACT_TARGET = {wanted!r}: must be one of {', '.join(usable)}, which are "
            "installed and run on this processor."
        )
    return wanted or usable[0]


target: str = chosen(installed(supported()), os.environ.get("VIBROIMPACT_TARGET"))
_module: Any = importlib.import_module(f"vibroimpact._kernel_{target}")
globals().update({name: value for name, value in vars(_module).items() if name[:2] != "__"})
