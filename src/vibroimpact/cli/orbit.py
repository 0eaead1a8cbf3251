"""Command vibroimpact orbit: the symmetric orbits of the impact damper and their multipliers."""

from __future__ import annotations

import argparse
from collections.abc import Sequence

import numpy as np
import xarray as xr

from vibroimpact import _kernel
from vibroimpact._core.checks import shown
from vibroimpact._core.errors import InvalidParameterError
from vibroimpact.cli import common
from vibroimpact.cli.output import Done
from vibroimpact.machines.impact_damper import ImpactDamper
from vibroimpact.orbits.orbit import Orbit
from vibroimpact.orbits.stability import flags, in_words
from vibroimpact.orbits.symmetric_damper import symmetric_orbits
from vibroimpact.plotting import plot_multipliers

SIGNS = (1, -1)  # in (14) of the paper, in the order of symmetric_orbits
EXAMPLE = "  vibroimpact orbit impact-damper/A --omega 1.2 --out multipliers.svg"


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add the options of this command."""
    common.add_system(parser)
    common.add_out(parser)


def run(arguments: argparse.Namespace) -> Done:
    """Find the orbits."""
    damper = common.case_of(arguments).system
    if not isinstance(damper, ImpactDamper):
        raise InvalidParameterError(f"system = {shown(damper)}: must be an impact damper.")
    orbits = symmetric_orbits(damper)
    if not orbits:
        raise common.Failure(
            f"no symmetric 1-1-1 orbit exists at omega = {damper.omega}: condition (16) of the "
            "paper fails."
        )
    return Done(
        [damper, *map(_described, SIGNS, orbits)],
        _dataset(damper, orbits),
        lambda: plot_multipliers(orbits, labels=list(map(_name, SIGNS, orbits))),
    )


def _name(sign: int, orbit: Orbit) -> str:
    return f"sign {sign:+d}, {in_words(orbit.stability, orbit.family_dimension)}"


def _described(sign: int, orbit: Orbit) -> str:
    sizes = ", ".join(f"{abs(value):.6g}" for value in orbit.multipliers)
    return (
        f"sign {sign:+d}: {orbit}\n  {orbit.state}\n"
        f"  moduli of the multipliers of the full map: {sizes}\n"
        f"  relative error of the determinant identity: {orbit.determinant_error:.1e}"
    )


def _dataset(damper: ImpactDamper, orbits: Sequence[Orbit]) -> xr.Dataset:
    nu = np.array([o.half_multipliers for o in orbits], dtype=complex)
    several, place = ("orbit", "multiplier"), ("orbit", "coordinate")
    return xr.Dataset(
        {
            "stability": ("orbit", np.array([o.stability for o in orbits], dtype=np.int8), flags()),
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
