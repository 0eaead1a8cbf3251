"""Repetition of a sweep from the attributes of its dataset."""

from __future__ import annotations

import inspect
from collections.abc import Callable
from itertools import product
from typing import Any

import numpy as np

from vibroimpact._core.checks import check_kind, shown, unknown_keyword
from vibroimpact._core.errors import InvalidParameterError
from vibroimpact._core.lazy import xr
from vibroimpact._core.progress import interruptible
from vibroimpact._core.texts import json_of
from vibroimpact.machines.json_text import system_of
from vibroimpact.model.parameters import with_parameters
from vibroimpact.model.state import State, names_of_state
from vibroimpact.model.system import System, mechanism_of
from vibroimpact.simulation.places import AtPhase, AtStop
from vibroimpact.sweeps.analyses.basins import basins
from vibroimpact.sweeps.analyses.diagram import bifurcation_sweep
from vibroimpact.sweeps.analyses.plane import multistability, plane
from vibroimpact.sweeps.observers.selection import described_observers
from vibroimpact.sweeps.starts import ListedStarts, RandomStarts, Start
from vibroimpact.sweeps.sweep import sweep


@interruptible
def rerun_sweep(found: xr.Dataset, *, system: System | None = None, **options: Any) -> xr.Dataset:
    """Repeat a sweep, plane, basins, diagram or count from its attributes and axes.

    Parameters
    ----------
    found
        A result of :func:`~vibroimpact.sweep`, :func:`~vibroimpact.plane`,
        :func:`~vibroimpact.basins`, :func:`~vibroimpact.bifurcation_sweep` or
        :func:`~vibroimpact.multistability`, or such a dataset from a file.
    system
        The system, if it is code that no file holds: a :class:`~vibroimpact.Family`, a class of
        one's own.
    **options
        Options of that function that replace the stored ones: ``settle_periods=4000``, ``progress=False``.

    Returns
    -------
    Dataset
        Bit for bit the same, with the same version of the package and the same options.

    Raises
    ------
    InvalidParameterError
        A dataset of another origin, or a part of one; a missing system, or another one; a diagram
        from listed starts, which it does not hold.

    Examples
    --------
    >>> import vibroimpact as vi
    >>> damper = vi.ImpactDamper(mass_ratio=0.1, omega_n=0.5, zeta=0.045, restitution=0.8,
    ...                          half_clearance=5.0, omega=1.2)
    >>> found = vi.sweep(damper, over={"omega": [1.1, 1.2]}, start=vi.State((0, 0), (0, 1)),
    ...                  progress=False)
    >>> vi.rerun_sweep(found, progress=False).identical(found)
    True
    """
    check_kind("found", found, xr.Dataset, "a Dataset, as vi.sweep gives")
    if system is not None:
        mechanism_of(system)
    name = found.attrs.get("made_by", "")
    if name not in MAKERS:
        raise InvalidParameterError(
            f"found: was made by none of {', '.join(MAKERS)}, or has lost its attributes."
        )
    make, shared = MAKERS[name]
    known = list(inspect.signature(make).parameters)
    if unknown := [name for name in options if name not in known]:
        raise unknown_keyword("rerun_sweep", unknown[0], known)
    try:
        made, given = _system(found, system), _arguments(found, shared)
    except InvalidParameterError:
        raise
    except (LookupError, ValueError, TypeError, AttributeError, StopIteration) as error:
        raise InvalidParameterError(
            f"found: its attributes are damaged ({error!r}). Give what vi.{name} returned."
        ) from error
    return make(made, **given | options)


def _arguments(found: xr.Dataset, shared: tuple[str, ...]) -> dict[str, Any]:
    """Arguments of the call: those of its sweep, and those that were written down."""
    _check_whole(found)
    attrs = found.attrs
    read: dict[str, Callable[[], Any]] = {
        "over": lambda: {name: found[name].values for name in _axes(found)},
        "start": lambda: _start(found),
        "observe": lambda: described_observers(json_of("observe", attrs["observe"])),
        "follow": lambda: attrs["follow"] or None,
        "settle_periods": lambda: float(attrs["settle_periods"]),
        "periods": lambda: float(attrs["periods"]),
        "most_impacts": lambda: int(attrs["most_impacts"]),
    }
    own = json_of("call", attrs["call"])
    if kept := {*own} & {*HOW}:
        raise ValueError(f"{', '.join(sorted(kept))}: is never written down")
    objects: dict[str, Callable[[Any], Any]] = {
        "start": lambda state: State(**state),
        "observe": described_observers,
        "at": lambda at: AtStop(**at) if "stop" in at else AtPhase(**at),
    }
    written = {name: objects.get(name, lambda x: x)(value) for name, value in own.items()}
    return {name: read[name]() for name in shared} | written


def _system(found: xr.Dataset, given: System | None) -> System:
    """System of the attributes, or the given one if it is equal."""
    described = found.attrs["system"]
    if given is None:
        stored = system_of(found.attrs["system_numbers"])
        if stored is None:
            raise InvalidParameterError(
                f"system = None: {described} is code, which no dataset holds. Give the same system."
            )
        return stored
    ends = [found[name].values[[0, -1]].tolist() for name in _swept(found)]  # in any order now
    corners = (dict(zip(_swept(found), values, strict=True)) for values in product(*ends))
    if all(repr(with_parameters(given, corner)) != described for corner in corners):
        raise InvalidParameterError(f"system = {shown(given)}: was {described}. Give that one.")
    return given


def _check_whole(found: xr.Dataset) -> None:
    """Refuse a part of a dataset."""
    sizes = json_of("sizes", found.attrs["sizes"])
    for name, size in sizes.items():
        have = found.sizes.get(name, 0)
        if have != size or (name != "start" and name not in found.coords):
            raise InvalidParameterError(
                f"found: is a part of what was made, {have} of {size} values of {name}. Give the "
                f"whole, or call vi.{found.attrs['made_by']}."
            )


def _swept(found: xr.Dataset) -> list[str]:
    """Names of the parameters that were swept."""
    return [name for name in found.attrs["swept"].split(", ") if name]


def _axes(found: xr.Dataset) -> list[str]:
    """Names of the axes in their order: parameters that were swept, coordinates of the start."""
    described = json_of("start", found.attrs["start"])
    names = {*_swept(found), *(described["over"] if described["kind"] == "grid" else ())}
    return [str(name) for name in found["end"].dims if name in names]


def _start(found: xr.Dataset) -> Start:
    """Starts; those of a list from their coordinates, of a grid the state that its axes vary."""
    described = json_of("start", found.attrs["start"])
    kind = described.pop("kind")
    if kind == "listed":
        return _listed(found)
    base = State(**described.pop("base"))
    if kind == "random":
        return RandomStarts(base=base, **described)
    return base


def _listed(found: xr.Dataset) -> ListedStarts:
    degrees = len(json_of("mechanism", found.attrs["mechanism"])["mass"])
    names = names_of_state(degrees)
    if not {*names} <= {*found.coords}:
        raise InvalidParameterError("found: does not hold its listed starts. Give start=... .")
    columns = np.stack([found[name].values for name in names], axis=1)
    return ListedStarts(columns[:, :degrees], columns[:, degrees:-1], columns[:, -1])


HOW = ("store", "backend", "workers", "client", "tile", "progress")  # a dataset does not say this
WINDOW = ("settle_periods", "periods", "most_impacts")
SWEEP = ("over", "start", "observe", "follow", *WINDOW)
MAKERS: dict[str, tuple[Callable[..., xr.Dataset], tuple[str, ...]]] = {
    "sweep": (sweep, SWEEP),
    "plane": (plane, SWEEP),
    "multistability": (multistability, tuple(name for name in SWEEP if name != "observe")),
    "basins": (basins, WINDOW),
    "bifurcation_sweep": (bifurcation_sweep, ("over", "start", *WINDOW)),
}  # by name: the function, and those of its arguments that are those of its sweep
