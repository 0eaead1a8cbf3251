"""Imports: what is not used is not loaded, and every public name is there."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import pytest

import vibroimpact as vi

HEAVY = ("numpy", "scipy", "scipy.spatial", "xarray", "pandas", "matplotlib", "vibroimpact_papers")


EVERY_HELP = """
from vibroimpact.cli.main import COMMANDS, main
for command in COMMANDS:
    main([command, "--help"])
    main([command, "--colour", "1"])
"""


def loaded_by(code: str) -> set[str]:
    """Which of the heavy modules are loaded after some code, in a process of its own."""
    shown = f"import json, sys; print(json.dumps([m for m in {HEAVY!r} if m in sys.modules]))"
    done = subprocess.run(
        [sys.executable, "-c", f"{code}\n{shown}"], capture_output=True, text=True, check=True
    )
    return set(json.loads(done.stdout.splitlines()[-1]))


@pytest.mark.parametrize(
    ("code", "allowed"),
    [
        ("import vibroimpact", set()),
        ("from vibroimpact.cli.main import main; main(['--help'])", set()),
        ("from vibroimpact.cli.main import main; main(['sectoin'])", set()),
        ("from vibroimpact.cli.main import main; main(['reproduce', '--help'])", set()),
        (EVERY_HELP, {"numpy"}),
        ("from vibroimpact.cli.main import main; main(['machines'])", {"numpy"}),
        ("import vibroimpact as vi; vi.simulate, vi.ImpactDamper", {"numpy"}),
        ("import vibroimpact as vi; vi.section, vi.lyapunov_exponent", {"numpy"}),
        ("import vibroimpact as vi; vi.lyapunov_spectrum", {"numpy"}),
        ("import vibroimpact as vi; vi.classify, vi.symmetric_orbits", {"numpy"}),
        ("import vibroimpact as vi; vi.sweep, vi.plane", {"numpy", "xarray", "pandas"}),
    ],
)
def test_what_is_not_used_is_not_loaded(code: str, allowed: set[str]) -> None:
    assert loaded_by(code) <= allowed


def test_every_public_name_is_found_and_listed() -> None:
    assert set(vi.__all__) <= set(dir(vi))
    assert [name for name in dir(vi) if name.startswith("_")] == ["__version__"]
    assert not {"re", "Path", "Any", "annotations", "import_module"} & {*dir(vi)}
    assert all(getattr(vi, name) is not None for name in vi.__all__)
    assert vi.__version__ == vi._kernel.version()


def test_every_import_of_the_stub_is_understood() -> None:
    stub = Path(vi.__file__).with_suffix(".pyi").read_text("utf-8")
    assert len(vi._ROOMS) == stub.count("\nfrom ")


def test_a_name_that_is_not_there_is_an_attribute_error() -> None:
    with pytest.raises(AttributeError, match="no attribute 'simulation_of'"):
        _ = vi.simulation_of
