"""Second-order blocks for any damping: xi = rest + positions q + velocities q'.

Method      An uncoupled coordinate of the normal form is a block as it is; for each coupled group
            src/decouple finds the blocks. Where a group is the same in the coordinates given,
            these are used: in rotated ones soft parts beside stiff ones would lose digits.
Fails       returns None: the blocks would lose too many digits, or would not be oscillators; a
            constant force drives a block without stiffness
Reference   theory.md, "Flight"
"""

from __future__ import annotations

from collections.abc import Iterable
from itertools import chain
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from vibroimpact import _kernel
from vibroimpact._core import linear
from vibroimpact._core.columns import Column, agreed
from vibroimpact._core.linear import Matrix, Vector, apply, dot, product, transpose
from vibroimpact._core.scalars import ROUNDING_PER_TERM, greatest, least
from vibroimpact._core.types import Floats
from vibroimpact.compile.reduction import Reduced
from vibroimpact.compile.vibrations import NormalForm, alone, unit_form

# (slowest / fastest)^2 of blocks that are found in rotated coordinates: six digits are lost there.
WIDEST_RATE_RATIO = 2.0**-20


class Decoupled(NamedTuple):
    """Blocks q'' = -k q - c q' + a.

    Columns of ``positions`` and ``velocities`` are those of the blocks, and so are those of
    ``back``: transposed, its matrices give q of the momenta N^T M N (xi - rest) and N^T M N xi',
    then q' of these. For a group the same holds in its own coordinates, with unit masses.
    """

    k: Vector
    c: Vector
    a: Vector
    rest: Vector
    positions: Matrix
    velocities: Matrix
    back: tuple[Matrix, ...]
    balanced: Vector  # force on each block that its equilibrium, in ``rest``, has taken up


_ONE, _NONE = [[1.0]], [[0.0]]


def decoupled(r: Reduced, form: NormalForm) -> Decoupled | None:
    """Blocks of a reduced system whose damping is not classical; None if there are none."""
    groups, plain = form.groups(), unit_form(r)
    whole = plain.groups()
    forms = [plain if len(group) > 1 and group in whole else form for group in groups]
    single = *alone(r, form), apply(transpose(form.shape), r.constant)
    found = [
        _coupled(r, used, group, rotated=used is form)
        if len(group) > 1
        else _single(*([x[group[0]]] for x in single))
        for used, group in zip(forms, groups, strict=True)
    ]
    blocks = [x for x in found if x]
    if len(blocks) < len(groups):
        return None
    k, c, a, rest = (list(chain(*parts)) for parts in zip(*(b[:4] for b in blocks), strict=True))
    shapes = [_columns(used.shape, group) for used, group in zip(forms, groups, strict=True)]

    def joined(parts: Iterable[Matrix]) -> Matrix:
        products = [product(shape, part) for shape, part in zip(shapes, parts, strict=True)]
        return [list(chain(*rows)) for rows in zip(*products, strict=True)]

    return Decoupled(
        k, c, a, apply([list(chain(*rows)) for rows in zip(*shapes, strict=True)], rest),
        joined(b.positions for b in blocks), joined(b.velocities for b in blocks),
        tuple(map(joined, zip(*(b.back for b in blocks), strict=True))),
        list(chain(*(b.balanced for b in blocks))),
    )  # fmt: skip


def _columns(a: Matrix, which: list[int]) -> Matrix:
    return [[row[i] for i in which] for row in a]


def _single(k: Vector, c: Vector, a: Vector) -> Decoupled:
    """Block of an uncoupled coordinate."""
    return Decoupled(k, c, a, [0.0], _ONE, _NONE, (_ONE, _NONE, _NONE, _ONE), [0.0])


def _coupled(r: Reduced, form: NormalForm, group: list[int], *, rotated: bool) -> Decoupled | None:
    """Blocks of coupled coordinates, by the kernel; None where slow ones would lose digits."""
    stiffness, damping = (
        [[0.5 * (a[i][j] + a[j][i]) for j in group] for i in group]
        for a in (form.stiffness, form.damping)
    )
    found = _blocks(stiffness, damping)
    if found is None:
        return None
    rates = [k + c * c for k, c in zip(found.k, found.c, strict=True)]  # squares
    if rotated and least(rates) < WIDEST_RATE_RATIO * greatest(rates):
        return None
    down = transpose(_columns(form.shape, group))
    if _is_driven(found, apply(down, r.external), apply(linear.absolute(down), r.terms)):
        return None
    push = apply(down, r.constant)
    return found._replace(rest=_rest(found, push), balanced=_forces(found, push))


def _forces(b: Decoupled, push: Vector) -> Vector:
    """Force f + c p on every block, with p added to q and f to q'."""
    _, q_of_v, _, v_of_v = map(transpose, b.back)
    both = zip(apply(v_of_v, push), b.c, apply(q_of_v, push), strict=True)
    return [f + c * p for f, c, p in both]


def _is_driven(b: Decoupled, push: Vector, terms: Vector) -> bool:
    """Whether a constant force drives a block without stiffness."""
    sizes = _forces(b._replace(back=tuple(map(linear.absolute, b.back))), terms)
    noise = [ROUNDING_PER_TERM * len(push) * x for x in sizes]
    both = zip(b.k, _forces(b, push), noise, strict=True)
    return any(not k > 0.0 and abs(force) > least for k, force, least in both)


def _rest(b: Decoupled, push: Vector) -> Vector:
    """Rest position under a constant force: k q = f + c p, and the second coordinate is -p.

    Forces of stops do not act on blocks without stiffness, except by rounding.
    """
    at = [f / k if k > 0.0 else 0.0 for k, f in zip(b.k, _forces(b, push), strict=True)]
    p = apply(transpose(b.back[1]), push)
    both = zip(b.positions, b.velocities, strict=True)
    return [dot(shown, at) - dot(also, p) for shown, also in both]


def _blocks(stiffness: Matrix, damping: Matrix) -> Decoupled | None:
    """Blocks of coupled systems of unit masses, in numbers of any kind."""
    numbers: list[Any] = [x for a in (stiffness, damping) for row in a for x in row]
    arrays = [x.values if isinstance(x, Column) else np.array(x) for x in numbers]
    grid = np.broadcast_shapes(*(x.shape for x in arrays))
    n, columns = len(stiffness), any(isinstance(x, Column) for x in numbers)
    own = next((x.decoupled for x in arrays if hasattr(x, "decoupled")), _decoupled)
    found = own(
        arrays, grid, n
    )  # numbers that are written down (explorer/recording.py) do it themselves
    if not agreed((found["found"] > 0.0).reshape(grid)):
        return None

    def as_given(values: NDArray[Any]) -> Any:
        if values.dtype == object:
            return Column(values[0])
        return Column(values.reshape(grid)) if columns else float(values[0])

    def matrix(values: NDArray[Any]) -> Matrix:
        return [[as_given(values[:, i, j]) for j in range(n)] for i in range(n)]

    k, c = ([as_given(found[name][:, i]) for i in range(n)] for name in "kc")
    back = found["back"].reshape(-1, n, 2, 2, n)  # system, block, q or q', of x or v, coordinate
    ways = [back[:, :, entry, of].transpose(0, 2, 1) for entry in (0, 1) for of in (0, 1)]
    return Decoupled(
        k, c, [0.0] * n, [0.0] * n,
        matrix(found["positions"]), matrix(found["velocities"]), tuple(map(matrix, ways)), [0.0] * n,
    )  # fmt: skip


def _decoupled(arrays: list[Floats], grid: tuple[int, ...], n: int) -> dict[str, Floats]:
    table = np.array([np.broadcast_to(x, grid).ravel() for x in arrays]).T
    halves = np.ascontiguousarray(table.reshape(-1, 2, n, n).transpose(1, 0, 2, 3))
    return _kernel.decouple(halves[0], halves[1])
