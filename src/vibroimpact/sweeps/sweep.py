"""Sweeps: any observers over any parameters of any system, from any starts."""

from __future__ import annotations

import math
import os
from collections.abc import Generator, Iterable, Iterator, Mapping, Sequence
from contextlib import closing, contextmanager
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from vibroimpact._core.checks import (
    LARGEST_COUNT,
    check_count,
    check_progress,
    memory_here,
    names_arguments,
    nonnegative,
    path_of,
    positive,
    refusal,
    shown,
)
from vibroimpact._core.errors import ClusterLostError, InvalidParameterError, warn
from vibroimpact._core.lazy import xr
from vibroimpact._core.progress import (
    INTERRUPTED,
    STORE_WOULD_KEEP,
    ProgressOption,
    Reporter,
    interruptible,
)
from vibroimpact._core.types import Arrays
from vibroimpact.compile.pace import paced_parts, paces_of
from vibroimpact.model.mechanism import Mechanism, accelerations
from vibroimpact.model.parameters import with_parameters
from vibroimpact.model.system import System, mechanism_of
from vibroimpact.sweeps.axes import corners, parameter_axes
from vibroimpact.sweeps.execution.backends import backend_of
from vibroimpact.sweeps.execution.compute import Done
from vibroimpact.sweeps.execution.store import Store, opened
from vibroimpact.sweeps.execution.tiles import (
    Tile,
    compiled_bytes,
    members_per_tile,
    tile_shape,
    tiles_of,
)
from vibroimpact.sweeps.member_status import MemberStatus
from vibroimpact.sweeps.observers.observer import Observer
from vibroimpact.sweeps.observers.selection import resolve, rounds
from vibroimpact.sweeps.plan import Plan, Window
from vibroimpact.sweeps.schema import Schema, schema_of
from vibroimpact.sweeps.specification import SweepSpec, specification_of
from vibroimpact.sweeps.starts import Start, Starts, grid_of, starts_of

# By default a member may have, at each stop and in every cycle of its fastest motion, a chatter
# down to rounding, log(eps) / log(restitution) impacts, and so many more; stops with a greater
# restitution count as this one.
MORE_IMPACTS = 64
LARGEST_COUNTED_RESTITUTION = 0.999
ROUNDING_UNIT = float(np.finfo(float).eps)
EVENTS_OF_HYBRID_SYSTEMS = 2.0**24
LONGEST_PERIODS = 1e100  # times stay finite up to so many forcing periods
EXAMINED_STARTS = 4096.0  # the default of most_impacts is found from so many starts


@names_arguments()
@interruptible
def sweep(
    system: System,
    *,
    over: Mapping[str, ArrayLike],
    start: Start,
    observe: str | Observer | Sequence[str | Observer] = "symbol",
    follow: str | None = None,
    settle_periods: float = 250,
    periods: float = 50,
    most_impacts: int | None = None,
    store: str | os.PathLike[str] | None = None,
    backend: str = "threads",
    workers: int | None = None,
    client: Any = None,
    tile: int | None = None,
    progress: ProgressOption = True,
) -> xr.Dataset:
    """Run many members, in parameters and starts, and observe each as it runs.

    Parameters
    ----------
    system
        A :class:`~vibroimpact.Mechanism`, or anything with a ``mechanism``, such as
        :class:`~vibroimpact.ImpactDamper`.
    over
        Values by name, each (k,), finite, all different: of parameters of the system, and of coordinates of the
        start, x1, x2, ..., v1, v2, ..., phase [rad]. May be empty if there are several starts.
    start
        A :class:`~vibroimpact.State`, which gives the coordinates that ``over`` does not vary. Or, with parameters
        alone in ``over``, :class:`~vibroimpact.RandomStarts`, :class:`~vibroimpact.GridStarts` or
        :class:`~vibroimpact.ListedStarts`.
    observe
        Observers: names, or observers with options such as ``vi.observe.Section(points=50)``, one
        or several.
    follow
        Name of one parameter: each member starts from the final state at the former value;
        upwards, or with a minus sign (``"-omega"``) downwards. It settles at every value.
    settle_periods, periods
        Length of a run before, and while, it is observed, in forcing periods (first forcing
        line), >= 0 and > 0. In units of time for a system without forcing.
    most_impacts
        Impacts (at all stops) that end a run; the status is then MAX_IMPACTS, and the only results are
        ``time`` and ``final``. By default more than ordinary motion has: room for a chatter
        down to rounding at every stop in every cycle of the fastest motion. At most 2^50.
    store
        A folder for the results, in Zarr's format (needs the extra ``store``), for sweeps larger
        than memory or of long duration. If it exists, the sweep resumes. ``~`` is the home folder.
    backend
        "threads" of this process; "dask", a cluster (needs the extra ``cluster``).
    workers
        Number of threads; ignored for an existing cluster. By default one per core.
    client
        A ``distributed.Client``, or the address of a scheduler, for "dask". By default the client
        in use, otherwise a cluster of this process alone.
    tile
        Number of members computed, and stored, together. By default about a second's work. The
        results do not depend on it.
    progress
        True shows it on standard error after 2 s; a function gets a :class:`~vibroimpact.ProgressReport` after
        every tile of members.

    Returns
    -------
    Dataset
        Dimensions: the parameters, then "start" or the coordinates of the starts, then those of
        the observers. Always with ``end`` and ``time``, the reason and the time of the end of each
        run. Results are those of whole windows: where a run ended before, whole numbers are 0 and
        others NaN, except for the state of ``final``. :func:`~vibroimpact.rerun_sweep` repeats the
        sweep from the attributes. Data from a store are read only where they are used.

    Raises
    ------
    InvalidParameterError
        An unknown name, no values, values that the system refuses, a start of the wrong size, a
        store of another sweep; without a store, more results than memory.
    StoreError
        A store that cannot be written; finished tiles are kept.
    ClusterLostError
        The connection to the cluster was lost; finished tiles are kept in the store.
    BackendUnavailableError
        Zarr or Dask is not installed.
    KeyboardInterrupt
        With a message how to continue.

    Notes
    -----
    Every member has the same bits whatever the backend, the tile, the order and the number of
    threads. A followed motion whose stop has moved past it is put on the stop, the
    centre of mass in its place; a start behind a stop is a status.

    Examples
    --------
    >>> import numpy as np
    >>> import vibroimpact as vi
    >>> damper = vi.ImpactDamper(mass_ratio=0.1, omega_n=0.5, zeta=0.045, restitution=0.8,
    ...                          half_clearance=5.0, omega=1.2)
    >>> plane = vi.sweep(damper, over={"omega": [1.1, 1.2], "half_clearance": [4.0, 5.0, 6.0]},
    ...                  start=vi.State((0.0, 0.0), (0.0, 1.0)), progress=False)
    >>> dict(plane.sizes)
    {'omega': 2, 'half_clearance': 3}
    """
    plan = plan_of(system, over, start, observe, follow, settle_periods, periods, most_impacts)
    path = None if store is None else path_of("store", store)
    compute_tiles = backend_of(backend)
    if client is not None and backend != "dask":
        raise InvalidParameterError(f"client = {shown(client)}: is for backend = 'dask'.")
    for name, value in (("workers", workers), ("tile", tile)):
        if value is not None:
            check_count(name, value, 1)
    check_progress(progress)
    specification = specification_of(plan)
    schema = schema_of(plan, specification)
    sizes = tile_shape(plan.shape, tile or _members(plan, schema), plan.followed)
    capped = 0
    with _sink(path, schema, specification, sizes, strict=tile is not None) as sink:
        missing = sink.missing
        try:
            with (
                closing(compute_tiles(plan, missing, workers, client)) as results,
                closing(_shown(results, missing, progress)) as finished,
            ):
                for done, arrays in finished:
                    sink.write(done, arrays)
                    capped += int((arrays["end"] == MemberStatus.MAX_IMPACTS).sum())
        except KeyboardInterrupt:
            raise KeyboardInterrupt(f"{INTERRUPTED}{sink.kept}") from None
        except ClusterLostError as error:
            raise ClusterLostError(f"{error}; {sink.kept}") from error.__cause__
    if capped:
        warn(
            f"{capped} of {plan.size} members have no results: they had {plan.window.most_impacts} "
            "impacts before the end of their windows. Raise most_impacts, or examine one of them."
        )
    return sink.dataset()


def plan_of(
    system: System,
    over: Mapping[str, ArrayLike],
    start: Start,
    observe: str | Observer | Sequence[str | Observer],
    follow: str | None,
    settle_periods: float,
    periods: float,
    most_impacts: int | None,
) -> Plan:
    """Check the arguments of a sweep."""
    over, start = grid_of(system, over, start)
    axes = parameter_axes(system, over)
    first = with_parameters(system, {name: float(axis[0]) for name, axis in axes.items()})
    mechanism = mechanism_of(first)
    starts = starts_of(start, mechanism.degrees)
    if not axes and not starts.dims:
        raise InvalidParameterError("over = {}: names no parameter, and there is one start only.")
    _check_follow(follow, axes)
    length = nonnegative("settle_periods", settle_periods) + positive("periods", periods)
    if length > LONGEST_PERIODS:
        raise refusal("settle_periods + periods", length, f"at most {LONGEST_PERIODS:g}")
    if most_impacts is None:
        ends = (mechanism_of(with_parameters(system, corner)) for corner in corners(axes))
        most = max(_ordinary(one, length, starts) for one in (mechanism, *ends))
        if most > LARGEST_COUNT:
            raise InvalidParameterError(
                f"settle_periods + periods = {length:g}: must be shorter, or give most_impacts."
            )
        most_impacts = 2 ** math.ceil(math.log2(most))  # eigenvalues differ between machines
    check_count("most_impacts", most_impacts, 1, LARGEST_COUNT)
    window = Window(float(settle_periods), float(periods), int(most_impacts))
    return Plan(first, axes, starts, resolve(observe), window, follow)


def _ordinary(mechanism: Mechanism, length: float, starts: Starts) -> float:
    """Upper estimate of impacts of ordinary motion in so many forcing periods or units of time."""
    if any(element.whole for element in mechanism.switching):
        return EVENTS_OF_HYBRID_SYSTEMS  # nothing says how fast their modes follow each other
    stiffness, damping = np.array(mechanism.stiffness), np.array(mechanism.damping)
    for element in mechanism.switching:
        if sides := element.stiffest:
            square = np.outer(element.row, element.row)
            largest_k, largest_c = map(max, zip(*sides, strict=True))
            stiffness, damping = stiffness + largest_k * square, damping + largest_c * square
    stiff, damp = (
        float(np.abs(np.linalg.eigvals(accelerations(mechanism, part))).max())
        for part in (stiffness, damping)
    )
    fastest = max(math.sqrt(stiff) + damp, *(force.omega for force in mechanism.forces), 0.0)
    if mechanism.omega:
        cycles = length * (1.0 + fastest / mechanism.omega)
    else:
        cycles = 1.0 + length * max(fastest, _fastest_pace(mechanism, starts)) / (2.0 * math.pi)
    chatters = sum(
        MORE_IMPACTS
        + math.log(ROUNDING_UNIT)
        / math.log(min(max(r, ROUNDING_UNIT), LARGEST_COUNTED_RESTITUTION))
        for contact in mechanism.rigid_stops
        for r in contact.restitutions
    )
    return cycles * (chatters + MORE_IMPACTS * len(mechanism.switching))


def _fastest_pace(mechanism: Mechanism, starts: Starts) -> float:
    """The fastest pace of the motions from some starts (compile/pace.py), the first ones if there are many."""
    most = int(EXAMINED_STARTS ** (1.0 / max(1, len(starts.dims))))
    states = starts.block(tuple(slice(0, min(n, most)) for n in starts.dims.values())).states()
    parts = np.array(paced_parts(mechanism)).reshape(1, -1, mechanism.degrees + 5)
    one = np.zeros(len(states.phase), dtype=np.intp)
    endless = np.full(len(one), math.inf)
    none = np.zeros(1)
    found = paces_of(parts, none, none, one, states.position, states.velocity, endless)
    return float(found.max())


def _check_follow(follow: Any, axes: Mapping[str, object]) -> None:
    """Refuse to follow anything but an axis of parameters."""
    known = [sign + name for name in axes for sign in ("", "-")]
    if follow is None or (isinstance(follow, str) and follow in known):
        return
    allowed = " or one of " + ", ".join(map(repr, known)) if known else ": over has no parameter"
    raise refusal("follow", follow, f"None{allowed}")


def _members(plan: Plan, schema: Schema) -> int:
    """Default number of members of a tile."""
    cycles = (plan.window.settle_periods + plan.window.periods) * len(rounds(plan.observers))
    size = schema.member_bytes + compiled_bytes(plan.mechanism)
    along = 1 if plan.followed is None else plan.shape[plan.followed]
    return members_per_tile(plan.size, cycles, size, along)


@contextmanager
def _sink(
    path: Path | None,
    schema: Schema,
    specification: SweepSpec,
    sizes: tuple[int, ...],
    *,
    strict: bool,
) -> Iterator[Memory | Store]:
    """Receiver of results: a store, or memory."""
    if path is None:
        yield Memory(schema, sizes)
    else:
        with opened(path, schema, specification, sizes, strict=strict) as store:
            yield store


class Memory:
    """Results in memory, taken as :class:`~vibroimpact.sweeps.execution.store.Store` takes them."""

    def __init__(self, schema: Schema, sizes: tuple[int, ...]) -> None:
        size = math.prod(schema.grid.values()) * schema.member_bytes
        if size > memory_here():
            raise InvalidParameterError(
                f"over, start, observe: results of {size / 1e9:.3g} GB, more than the memory "
                "here. Give store=..., a folder to keep them in, or fewer values."
            )
        self.schema, self.arrays = schema, schema.empty()
        self.missing = list(tiles_of(tuple(schema.grid.values()), sizes))
        self.kept = "nothing is kept. " + (
            STORE_WOULD_KEEP
            if len(self.missing) > 1
            else "It was one tile, which no store keeps in part: the same call begins anew."
        )

    def write(self, tile: Tile, results: Arrays) -> None:
        """Store the results of a tile."""
        for name, array in self.arrays.items():
            array[tile.place] = results[name]

    def dataset(self) -> xr.Dataset:
        """All results."""
        return self.schema.dataset(self.arrays)


def _shown(
    results: Iterable[Done], missing: Sequence[Tile], progress: ProgressOption
) -> Generator[Done, None, None]:
    """Yield results, and report the progress after each."""
    total = sum(tile.size for tile in missing)
    with Reporter(progress, "sweep") as report:
        yield from report.track(results, total, "members", size=lambda done: done[0].size)
