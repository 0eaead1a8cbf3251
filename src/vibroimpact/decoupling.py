"""Any damping in second-order blocks: xi = rest + positions q + velocities q'.

Method      What of the normal form moves alone is a block as it is; the kernel finds the blocks of
            what is coupled (src/bindings/decouple).
Fails       None: such blocks would lose too many digits, or be no oscillators; a constant force
            drives what no spring holds
Reference   theory.md, "Flight"
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from vibroimpact import _kernel, linear
from vibroimpact.columns import Column, agreed
from vibroimpact.linear import Matrix, Vector, absolute, apply, dot, product, transpose
from vibroimpact.reduction import Reduced
from vibroimpact.scalars import ROUNDING
from vibroimpact.vibrations import NormalForm, diagonal


class Decoupled(NamedTuple):
    """Blocks q'' = -k q - c q' + a.

    Columns of ``positions`` and ``velocities`` are those of the blocks, and so are those of the
    matrices of the way back: from the momenta N^T M N (xi - rest) and N^T M N xi', ``q_of_x`` and
    ``q_of_v`` transposed give q, ``v_of_x`` and ``v_of_v`` give q'.
    """

    k: Vector
    c: Vector
    a: Vector
    rest: Vector
    positions: Matrix
    velocities: Matrix
    q_of_x: Matrix
    q_of_v: Matrix
    v_of_x: Matrix
    v_of_v: Matrix


def decoupled(r: Reduced, form: NormalForm) -> Decoupled | None:
    """The blocks of a reduced system whose damping is not classical; None if there are none."""
    n = len(form.shape)
    coupled = [i for i in range(n) if form.coupling(i) > 0.0]
    alone = [i for i in range(n) if i not in coupled]
    found = _blocks(_part(form.stiffness, coupled), _part(form.damping, coupled))
    push = apply(transpose(form.shape), r.constant)
    terms = apply(transpose(absolute(form.shape)), r.terms)
    rest = found and _rest(found, [push[i] for i in coupled], [terms[i] for i in coupled])
    if found is None or rest is None:
        return None
    own = [[row[i] for i in alone] for row in form.shape]
    shared = [[row[i] for i in coupled] for row in form.shape]
    none = linear.zeros(n, len(alone))
    k, c = ([diagonal(form.shape, a)[i] for i in alone] for a in (r.stiffness, r.damping))

    def beside(mine: Matrix, theirs: Matrix) -> Matrix:
        both = zip(mine, product(shared, theirs), strict=True)
        return [[*x, *y] for x, y in both]

    return Decoupled(
        [*k, *found.k],
        [*c, *found.c],
        [*(push[i] for i in alone), *[0.0] * len(coupled)],
        apply(shared, rest),
        beside(own, found.positions),
        beside(none, found.velocities),
        *(beside(own if i in (0, 3) else none, a) for i, a in enumerate(found.back)),
    )


class _Blocks(NamedTuple):
    k: Vector
    c: Vector
    positions: Matrix
    velocities: Matrix
    back: list[Matrix]  # columns: q from positions and velocities, then q' from them


def _part(a: Matrix, rows: list[int]) -> Matrix:
    return [[0.5 * (a[i][j] + a[j][i]) for j in rows] for i in rows]


def _rest(b: _Blocks, push: Vector, terms: Vector) -> Vector | None:
    """Where a constant force holds the coupled part; None where it does not.

    With p added to q and f to q', k q = f + c p and the second coordinate is -p.
    """
    _, q_of_v, _, v_of_v = map(transpose, b.back)

    def forces(a: Matrix, also: Matrix, by: Vector) -> Vector:
        both = zip(apply(a, by), b.c, apply(also, by), strict=True)
        return [f + c * p for f, c, p in both]

    at = list[float]()
    noise = forces(absolute(v_of_v), absolute(q_of_v), terms)
    for k, force, size in zip(b.k, forces(v_of_v, q_of_v, push), noise, strict=True):
        if not k > 0.0 and abs(force) > ROUNDING * len(push) * size:
            return None
        at.append(force / k if k > 0.0 else 0.0)
    p = apply(q_of_v, push)
    both = zip(b.positions, b.velocities, strict=True)
    return [dot(shown, at) - dot(also, p) for shown, also in both]


def _blocks(stiffness: Matrix, damping: Matrix) -> _Blocks | None:
    """Blocks of coupled systems of unit masses, in numbers of any kind."""
    numbers: list[Any] = [x for a in (stiffness, damping) for row in a for x in row]
    arrays = [x.values if isinstance(x, Column) else np.array(x) for x in numbers]
    grid = np.broadcast_shapes(*(x.shape for x in arrays))
    n, columns = len(stiffness), any(isinstance(x, Column) for x in numbers)
    table = np.array([np.broadcast_to(x, grid).ravel() for x in arrays]).T
    halves = np.ascontiguousarray(table.reshape(-1, 2, n, n).transpose(1, 0, 2, 3))
    found = _kernel.decouple(halves[0], halves[1])

    def as_given(values: NDArray[np.float64]) -> Any:
        return Column(values.reshape(grid)) if columns else float(values[0])

    def matrix(name: str) -> Matrix:
        return [[as_given(found[name][:, i, j]) for j in range(n)] for i in range(n)]

    if not agreed((found["found"] > 0.0).reshape(grid)):
        return None
    back = [
        [[as_given(found["back"][:, 2 * j + entry, first + i]) for j in range(n)] for i in range(n)]
        for entry in range(2)
        for first in (0, n)
    ]
    k, c = ([as_given(found[name][:, i]) for i in range(n)] for name in "kc")
    return _Blocks(k, c, matrix("positions"), matrix("velocities"), back)
