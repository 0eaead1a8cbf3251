"""A copy of the package's sources that a test may change, and a program that runs with it."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from pathlib import Path
from typing import cast

from support.builds import ROOT
from vibroimpact import _cpu, _kernel

PACKAGE = ROOT / "src" / "vibroimpact"


def package_copy(folder: Path) -> Path:
    """The sources in ``folder/src`` beside the built modules of the package that is tested."""
    package = folder / "src" / "vibroimpact"
    shutil.copytree(PACKAGE, package, ignore=shutil.ignore_patterns("*.so", "__pycache__"))
    for built in (_cpu, _kernel._module):
        shutil.copy(cast(str, built.__file__), package)
    return package


def run_with(
    folder: Path, code: str, *arguments: str, **variables: str
) -> subprocess.CompletedProcess[str]:
    """Run a program in a folder, with the copy of the package that stands there."""
    paths = os.pathsep.join([str(folder / "src"), str(ROOT / "tests")])
    return subprocess.run(
        [sys.executable, "-c", code, *arguments],
        cwd=folder, capture_output=True, text=True, check=False,
        env=os.environ
        | {"PYTHONPATH": paths, "MPLBACKEND": "agg", "VIBROIMPACT_TARGET": _kernel.target}
        | variables,
    )  # fmt: skip
