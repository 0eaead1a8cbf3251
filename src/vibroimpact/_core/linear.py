"""Small dense linear algebra in a fixed order of operations.

Systems are compiled with these few routines instead of a BLAS, whose sums are ordered differently
on different processors: the same mechanism gives the same bits everywhere. Matrices are lists of
rows of floats, or of other numbers (scalars.py); sizes are those of mechanisms, up to a few tens.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray

from vibroimpact._core.errors import InvalidParameterError
from vibroimpact._core.scalars import (
    above,
    anywhere,
    choose,
    greatest,
    numeric_value,
    rounded_down,
    sign_of,
    square_root,
)

Vector = list[float]
Matrix = list[list[float]]

ROUNDED = 2.0**-40  # a sum that is smaller, relative to its terms, is zero


def zeros(rows: int, columns: int) -> Matrix:
    """A matrix of zeros."""
    return [[0.0] * columns for _ in range(rows)]


def identity(n: int) -> Matrix:
    """The unit matrix."""
    return [[1.0 if i == j else 0.0 for j in range(n)] for i in range(n)]


def transpose(a: Matrix) -> Matrix:
    """Rows become columns."""
    return [list(column) for column in zip(*a, strict=True)]


def product(a: Matrix, b: Matrix) -> Matrix:
    """A B, sums in index order."""
    columns = transpose(b) if b and b[0] else []
    return [[dot(row, column) for column in columns] for row in a]


def apply(a: Matrix, x: Vector) -> Vector:
    """A x."""
    return [dot(row, x) for row in a]


def dot(x: Sequence[float], y: Sequence[float]) -> float:
    """Sum of products in index order."""
    total = 0.0
    for xi, yi in zip(x, y, strict=True):
        total += xi * yi
    return total


def plus(a: Matrix, b: Matrix, factor: float = 1.0) -> Matrix:
    """A + factor B."""
    return [
        [x + factor * y for x, y in zip(ra, rb, strict=True)] for ra, rb in zip(a, b, strict=True)
    ]


def absolute(a: Matrix) -> Matrix:
    """Absolute values of the entries."""
    return [[abs(x) for x in row] for row in a]


def largest(a: Matrix) -> float:
    """The largest absolute entry."""
    return greatest(abs(x) for row in a for x in row)


def row_sum_norm(a: Matrix) -> float:
    """The largest sum of absolute values in a row."""
    return greatest(sum(abs(x) for x in row) for row in a)


def cholesky(a: Matrix) -> Matrix | None:
    """Lower triangle L with A = L L^T, or None where A is not positive definite."""
    n = len(a)
    low = zeros(n, n)
    for i in range(n):
        for j in range(i + 1):
            rest = a[i][j] - dot(low[i][:j], low[j][:j])
            if i != j:
                low[i][j] = rest / low[j][j]
            elif rest > 0.0:
                low[i][i] = square_root(rest)
            else:
                return None
    return low


def dependent(a: Matrix, low: Matrix | None) -> int | None:
    """First coordinate that A cannot tell from those before it, to rounding; None where there is none.

    A pivot of Cholesky's L, if there is one, is the diagonal entry less a sum of squares: the part
    that the coordinates before leave of it, the same in any units of the coordinates. None too where
    A is not even semidefinite to rounding.
    """
    if low is None:
        return _fails_by_rounding(a)
    for i in range(len(a)):
        if anywhere(above(ROUNDED * a[i][i], low[i][i] * low[i][i])):
            return i
    return None


def _fails_by_rounding(a: Matrix) -> int | None:
    for i in range(len(a)):
        block = [row[: i + 1] for row in a[: i + 1]]
        if cholesky(block) is None:
            values = _eigenvalues(block)
            return i if values is not None and values[0] > -ROUNDED * values[-1] else None
    return None


def condition_number(a: Matrix) -> float:
    """Condition number of a symmetric matrix in balanced units, for messages: no unit takes part.

    Infinite where A is not positive definite; of systems together, that of the first.
    """
    values = _eigenvalues(a)
    return math.inf if values is None or values[0] <= 0.0 else float(values[-1] / values[0])


def balancing(a: Matrix) -> list[int]:
    """Exponents of the powers of two D for which the diagonal of D A D is within 1/2 and 2."""
    return [-(math.frexp(numeric_value(a[i][i]))[1] // 2) for i in range(len(a))]


def _eigenvalues(a: Matrix) -> NDArray[np.float64] | None:
    """Eigenvalues of D A D, D of powers of two, with a diagonal within 1/2 and 2; None if none is."""
    rows = [[numeric_value(x) for x in row] for row in a]
    if min(rows[i][i] for i in range(len(a))) <= 0.0:
        return None
    units = balancing(a)
    both = [
        [math.ldexp(math.ldexp(x, p), q) for x, q in zip(row, units, strict=True)]
        for row, p in zip(rows, units, strict=True)
    ]
    return np.linalg.eigvalsh(np.array(both))


def solve_lower(low: Matrix, b: Matrix) -> Matrix:
    """L^-1 B by forward substitution."""
    out: Matrix = []
    for i, row in enumerate(low):
        rest = list(b[i])
        for j in range(i):
            rest = [r - row[j] * x for r, x in zip(rest, out[j], strict=True)]
        out.append([r / row[i] for r in rest])
    return out


def solve_upper(low: Matrix, b: Matrix) -> Matrix:
    """L^-T B by back substitution."""
    n = len(low)
    out: Matrix = [[] for _ in range(n)]
    for i in reversed(range(n)):
        rest = list(b[i])
        for j in range(i + 1, n):
            rest = [r - low[j][i] * x for r, x in zip(rest, out[j], strict=True)]
        out[i] = [r / low[i][i] for r in rest]
    return out


def solve_definite(a: Matrix, b: Matrix, what: str = "mass") -> Matrix:
    """A^-1 B for positive definite A; ``what`` names it in an error."""
    return solver_of_definite(a, what)(b)


def unit_of(a: Matrix) -> float:
    """A power of two near to the largest entry: roots of A / unit have the same bits in any unit of A."""
    size = largest(a)
    return rounded_down(choose(above(size, 0.0), size, 1.0), 1)


def over(a: Matrix, unit: float) -> Matrix:
    """A / unit."""
    return [[x / unit for x in row] for row in a]


def solver_of_definite(a: Matrix, what: str = "mass") -> Callable[[Matrix], Matrix]:
    """B -> A^-1 B for positive definite A = L D L^T, L with unit diagonal; ``what`` names it in an error.

    Without roots: in units of the rows that are powers of two the digits are the same.
    """
    n, low, pivots = len(a), identity(len(a)), list[float]()
    for i in range(n):
        for j in range(i):
            parts = [x * d for x, d in zip(low[i][:j], pivots, strict=False)]
            low[i][j] = (a[i][j] - dot(parts, low[j][:j])) / pivots[j]
        parts = [x * d for x, d in zip(low[i][:i], pivots, strict=True)]
        pivots.append(a[i][i] - dot(parts, low[i][:i]))
        if not pivots[i] > 0.0:
            raise _singular(a, what)

    def solve(b: Matrix) -> Matrix:
        inside = solve_lower(low, b)
        return solve_upper(
            low, [[x / d for x in row] for row, d in zip(inside, pivots, strict=True)]
        )

    return solve


def lower_triangle(a: Matrix, what: str = "mass") -> Matrix:
    """L with A = L L^T, or raise naming A, with its condition number."""
    low = cholesky(a)
    if low is None:
        raise _singular(a, what)
    return low


def _singular(a: Matrix, what: str) -> InvalidParameterError:
    return InvalidParameterError(
        f"{what}: is singular to rounding (condition number {condition_number(a):.1e} in balanced "
        "units). Move masses or rows of contacts and friction that nearly coincide apart, or join "
        "them."
    )


def solve_regular(a: Matrix, b: Matrix) -> Matrix:
    """A^-1 B by elimination without pivoting, for A whose symmetric part is definite."""
    rows = [[*x, *y] for x, y in zip(a, b, strict=True)]
    n = len(a)
    for i in range(n):
        for j in range(i + 1, n):
            factor = rows[j][i] / rows[i][i]
            rows[j] = [y - factor * x for x, y in zip(rows[i], rows[j], strict=True)]
    for i in reversed(range(n)):
        rows[i] = [x / rows[i][i] for x in rows[i]]
        for j in range(i):
            factor = rows[j][i]
            rows[j] = [y - factor * x for x, y in zip(rows[i], rows[j], strict=True)]
    return [row[n:] for row in rows]


def eliminated(a: Matrix, sizes: Vector) -> tuple[Matrix, list[int]]:
    """L with L A upper triangular, for A whose symmetric part is semidefinite, and rows without pivot.

    A pivot is none where rounding of terms of this size may have left it; such rows take no part in
    the elimination.
    """
    n, lost = len(a), list[int]()
    rows = [[*x, *y] for x, y in zip(a, identity(n), strict=True)]
    for i in range(n):
        if abs(rows[i][i]) <= ROUNDED * sizes[i]:
            lost.append(i)
            continue
        for j in range(i + 1, n):
            factor = rows[j][i] / rows[i][i]
            rows[j] = [y - factor * x for x, y in zip(rows[i], rows[j], strict=True)]
    return [row[n:] for row in rows], lost


def symmetric_eigenvectors(a: Matrix, sweeps: int = 60) -> Matrix:
    """Orthogonal V with V^T A V diagonal, by cyclic Jacobi rotations in fixed order.

    A diagonal matrix gives exactly the unit matrix. References: Golub and Van Loan, Matrix
    Computations (2013), section 8.5.
    """
    n = len(a)
    work, vectors = [list(row) for row in a], identity(n)
    for _ in range(sweeps):
        rotated = False
        for p in range(n - 1):
            for q in range(p + 1, n):
                rotated |= _rotate(work, vectors, p, q)
        if not rotated:
            break
    return vectors


def _rotate(a: Matrix, v: Matrix, p: int, q: int) -> bool:
    """Annihilate a[p][q] unless it is already below rounding of the diagonal."""
    off = a[p][q]
    wanted = above(abs(off), 2.0**-60 * square_root(abs(a[p][p] * a[q][q])))
    if not anywhere(wanted):
        return False
    ratio = (a[q][q] - a[p][p]) / (2.0 * choose(wanted, off, 1.0))
    t = sign_of(ratio) / (abs(ratio) + square_root(1.0 + ratio * ratio))
    c = 1.0 / square_root(1.0 + t * t)
    s = t * c

    def turned(x: float, y: float) -> tuple[float, float]:
        return choose(wanted, c * x - s * y, x), choose(wanted, s * x + c * y, y)

    for row in a:
        row[p], row[q] = turned(row[p], row[q])
    both = [turned(x, y) for x, y in zip(a[p], a[q], strict=True)]
    a[p], a[q] = [x for x, _ in both], [y for _, y in both]
    a[p][q], a[q][p] = (choose(wanted, 0.0, x) for x in (off, a[q][p]))
    for row in v:
        row[p], row[q] = turned(row[p], row[q])
    return True


def null_space(rows: Matrix, units: Sequence[int] = ()) -> Matrix | None:
    """Columns spanning {x: rows x = 0}, by Gauss-Jordan elimination with pivoting.

    Returns None where the rows are linearly dependent. With units, exponents of two, entries are
    compared as if coordinate j were measured in 2^units[j].
    """
    n = len(rows[0])
    if units:
        found = null_space([[x * 2.0**u for x, u in zip(row, units, strict=True)] for row in rows])
        return found and [[x * 2.0**u for x in row] for row, u in zip(found, units, strict=True)]
    work = [list(row) for row in rows]
    if len(rows) > n:
        return None
    pivots: list[int] = []
    for i, row in enumerate(work):
        pivot = max((j for j in range(n) if j not in pivots), key=lambda j: abs(row[j]))
        if abs(row[pivot]) <= ROUNDED * max(map(abs, rows[i])):
            return None
        work[i] = [x / row[pivot] for x in row]
        pivots.append(pivot)
        for k in range(len(work)):
            if k != i:
                factor = work[k][pivot]
                work[k] = [x - factor * y for x, y in zip(work[k], work[i], strict=True)]
    free = [j for j in range(n) if j not in pivots]
    basis = zeros(n, len(free))
    for column, j in enumerate(free):
        basis[j][column] = 1.0
        for i, pivot in enumerate(pivots):
            basis[pivot][column] = -work[i][j]
    return basis
