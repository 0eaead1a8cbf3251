"""Command vibroimpact orbit: the symmetric orbits of a damper, or the orbit on which a motion settles."""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from vibroimpact import _kernel
from vibroimpact._core.lazy import xr
from vibroimpact.cli import common
from vibroimpact.cli.branch import STATED, orbit_of
from vibroimpact.cli.output import Done
from vibroimpact.machines.impact_damper import ImpactDamper
from vibroimpact.machines.toml_file import Case
from vibroimpact.orbits.orbit import Orbit
from vibroimpact.orbits.stability import Stability, in_words
from vibroimpact.orbits.symmetric_damper import symmetric_orbits
from vibroimpact.results.result import meanings

if TYPE_CHECKING:
    from matplotlib.axes import Axes

SIGNS = (1, -1)  # in (14) of the paper, in the order of symmetric_orbits
EXAMPLE = "  vibroimpact orbit impact-damper/A --omega 1.2 --out multipliers.svg"


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add the options of this command."""
    common.add_start(parser)
    common.add_out(parser)


def run(arguments: argparse.Namespace) -> Done:
    """Find the orbits."""
    case = common.case_of(arguments)
    damper = case.system
    if not isinstance(damper, ImpactDamper) or common.given(arguments, STATED) or case.start:
        return _from_the_start(arguments, case)
    orbits = symmetric_orbits(damper)
    if not orbits:
        raise common.Failure(
            f"no symmetric 1-1-1 orbit exists at omega = {damper.omega}: condition (16) of the "
            "paper fails."
        )
    return Done(
        [damper, *map(_described, SIGNS, orbits)],
        _dataset(damper, orbits),
        lambda: _picture(orbits),
    )


def _from_the_start(arguments: argparse.Namespace, case: Case) -> Done:
    """The orbit to which the motion from the start settles."""
    orbit = orbit_of(arguments, case)
    said = [case.system, orbit, orbit.state, f"  moduli of the multipliers: {_moduli(orbit)}"]
    return Done(said, orbit, lambda: _one_picture(orbit))


def _one_picture(orbit: Orbit) -> Axes:
    from vibroimpact.plotting import plot_multipliers

    return plot_multipliers([orbit], labels=[orbit.symbol])


def _moduli(orbit: Orbit) -> str:
    return ", ".join(f"{abs(value):.6g}" for value in orbit.multipliers)


def _picture(orbits: Sequence[Orbit]) -> Axes:
    from vibroimpact.plotting import plot_multipliers

    return plot_multipliers(orbits, labels=list(map(_name, SIGNS, orbits)))


def _name(sign: int, orbit: Orbit) -> str:
    return f"sign {sign:+d}, {in_words(orbit.stability, orbit.family_dimension)}"


def _described(sign: int, orbit: Orbit) -> str:
    return (
        f"sign {sign:+d}: {orbit}\n  {orbit.state}\n"
        f"  moduli of the multipliers of the full map: {_moduli(orbit)}\n"
        f"  relative error of the determinant identity: {orbit.determinant_error:.1e}"
    )


def _dataset(damper: ImpactDamper, orbits: Sequence[Orbit]) -> xr.Dataset:
    nu = np.array([o.half_multipliers for o in orbits], dtype=complex)
    several, place = ("orbit", "multiplier"), ("orbit", "coordinate")
    return xr.Dataset(
        {
            "stability": (
                "orbit",
                np.array([o.stability for o in orbits], dtype=np.int8),
                meanings(Stability),
            ),
            "inadmissible_reason": ("orbit", [o.inadmissible_reason for o in orbits]),
            "position": (place, [o.state.position for o in orbits]),
            "velocity": (place, [o.state.velocity for o in orbits]),
            "phase": ("orbit", [o.state.phase for o in orbits]),
            "half_multiplier_real": (several, nu.real),
            "half_multiplier_imaginary": (several, nu.imag),
            "determinant_error": ("orbit", [o.determinant_error for o in orbits]),
        },
        coords={"sign": ("orbit", list(SIGNS))},
        attrs={"system": repr(damper), "version": _kernel.version()},
    )
