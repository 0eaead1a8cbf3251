r"""Structures: mass, damping and stiffness of many parts, with the places at which stops and forces act.

Of a chain, masses m_1, ..., m_n in a row: k_0 and c_0 hold the first on the ground, k_i and c_i join
the masses i and i + 1, and k_n, where it is given, holds the last one.

Of natural frequencies w_j and mode shapes phi_j, with the modal masses m_j, in modal coordinates,

    m_j (q_j'' + 2 zeta_j w_j q_j' + w_j^2 q_j) = sum_p phi_j(p) f_p,   u(p) = sum_j phi_j(p) q_j        (1)

so that a place p is the row of the shapes there, for stops and for forces.

Of matrices M, K from finite elements, by Craig and Bampton (1968): the coordinates b of contacts and forces
are kept, the others i follow by static modes and move in the first modes with b held,

    x_i = -K_ii^-1 K_ib x_b + Phi q,   K_ii Phi = M_ii Phi w^2,   Phi^T M_ii Phi = 1                     (2)
    M_bb' = M_bb + M_bi S + S^T M_ib + S^T M_ii S,  S = -K_ii^-1 K_ib,  M_bq = (M_bi + S^T M_ii) Phi     (3)
    K_bb' = K_bb + K_bi S,   K_bq = 0,   K_qq = w^2

Static displacements of the kept coordinates are exact, and natural frequencies are never below those of the whole. A
damping ratio, the same for all modes of the reduced structure, gives C = M V 2 zeta w V^T M, with their
shapes V, V^T M V = 1.
"""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, cast

import numpy as np
from numpy.typing import ArrayLike

from vibroimpact._core.checks import (
    check_choice,
    check_count,
    check_kind,
    names_arguments,
    nonnegative,
    numbers,
    path_of,
    real,
    refusal,
    vector,
)
from vibroimpact._core.errors import InvalidParameterError
from vibroimpact.model.elements.element import Element
from vibroimpact.model.harmonic import Harmonic, as_lines, empty
from vibroimpact.model.mechanism import Mechanism

MOST_COORDINATES = 20  # of a mechanism
# Matrix Market; NumPy's format; sparse matrices of scipy.sparse.save_npz.
MATRICES = (".mtx", ".npy", ".npz")


@names_arguments(contacts="Give elements to mechanism(...), with row=structure.row(place).")
@dataclass(frozen=True, eq=False)
class Structure:
    """Linear structure with named places, to which stops, friction and forces are added.

    Parameters
    ----------
    mass, damping, stiffness
        Matrices of shape (n, n).
    places
        Rows of shape (n,) by name: the displacement of a place is row . x.

    Raises
    ------
    InvalidParameterError
        A matrix that is not square, or a row of another length.

    Examples
    --------
    >>> import vibroimpact as vi
    >>> beam = vi.Structure.of_modes([3.5, 22.0], {"tip": [2.0, -2.0]}, zeta=0.01)
    >>> machine = beam.mechanism(
    ...     [vi.RigidStop(beam.row("tip"), upper=0.1, restitution=0.6)],
    ...     forces={"tip": vi.Harmonic(3.0, (0.5,))})
    >>> machine.degrees
    2
    """

    mass: tuple[tuple[float, ...], ...]
    damping: tuple[tuple[float, ...], ...]
    stiffness: tuple[tuple[float, ...], ...]
    places: Mapping[str, tuple[float, ...]]

    def __post_init__(self) -> None:
        size = 0
        for name in ("mass", "damping", "stiffness"):
            matrix = numbers(name, getattr(self, name))
            if matrix.ndim != 2 or matrix.shape != (size or len(matrix),) * 2:
                raise InvalidParameterError(
                    f"{name} has shape {matrix.shape}; expected {(size, size) if size else '(n, n)'}."
                )
            size = len(matrix)
            object.__setattr__(self, name, tuple(map(tuple, matrix.tolist())))
        rows = {
            str(p): vector(f"places[{p!r}]", row, size)
            for p, row in _by_name("places", self.places, "rows").items()
        }
        object.__setattr__(self, "places", rows)

    @classmethod
    def chain(
        cls,
        masses: Sequence[float],
        stiffnesses: Sequence[float],
        dampings: Sequence[float] = (),
    ) -> Structure:
        """Make a row of masses; its places are "x1", "x2", ... and the gaps "x1-x2", ....

        Parameters
        ----------
        masses
            n of them.
        stiffnesses
            n of them, of which the first holds the first mass on the ground, 0 where nothing does; or
            n + 1, of which the last holds the last mass.
        dampings
            As many dashpots beside them; none where left out.
        """
        m = vector("masses", masses)
        n = len(m)
        check_count("masses, their number", n, 1, MOST_COORDINATES)
        links = vector("stiffnesses", stiffnesses)
        dashpots = (0.0,) * len(links) if empty(dampings) else vector("dampings", dampings)
        for name, values in (("stiffnesses", links), ("dampings", dashpots)):
            if len(values) not in (n, n + 1) or len(values) != len(links):
                raise InvalidParameterError(
                    f"{name}: {len(values)} are given; must be {n} or {n + 1} for {n} masses, and as many "
                    "dampings as stiffnesses."
                )
        unit = np.eye(n)
        ends = [unit[0], *(unit[i + 1] - unit[i] for i in range(n - 1)), unit[-1]]
        matrices = [
            sum((k * np.outer(row, row) for k, row in zip(values, ends, strict=False)), 0.0 * unit)
            for values in (dashpots, links)
        ]
        places = {f"x{i + 1}": tuple(unit[i].tolist()) for i in range(n)}
        gaps = {f"x{i + 1}-x{i + 2}": tuple((unit[i] - unit[i + 1]).tolist()) for i in range(n - 1)}
        return cls._made((np.diag(m), *matrices), {**places, **gaps})

    @classmethod
    def of_modes(
        cls,
        frequencies: Sequence[float],
        shapes: Mapping[str, Sequence[float]],
        *,
        zeta: float | Sequence[float] = 0.0,
        masses: Sequence[float] = (),
    ) -> Structure:
        """Make a structure of natural frequencies and mode shapes, measured or from a textbook.

        Parameters
        ----------
        frequencies
            Natural frequencies w_j, angular, >= 0; 0 is a rigid motion.
        shapes
            At each place, by its name, the value of every mode shape there.
        zeta
            Damping ratios >= 0, one for all modes or one each.
        masses
            Modal masses > 0; 1 where left out: shapes normalised by the mass.
        """
        w = np.array([nonnegative("frequencies", x) for x in vector("frequencies", frequencies)])
        n = len(w)
        check_count("frequencies, their number", n, 1, MOST_COORDINATES)
        m = np.ones(n) if empty(masses) else np.array(vector("masses", masses, n))
        each = isinstance(zeta, Sequence | np.ndarray)
        z = np.array(vector("zeta", zeta, n) if each else [nonnegative("zeta", zeta)] * n)
        if not (m > 0.0).all():
            raise refusal("masses", m.tolist(), "> 0")
        if (z < 0.0).any():
            raise refusal("zeta", z.tolist(), ">= 0")
        rows = _by_name("shapes", shapes, "values of the mode shapes")
        with np.errstate(over="ignore", invalid="ignore"):  # what is infinite is refused by name
            parts = np.diag(m), np.diag(2.0 * z * w * m), np.diag(w * w * m)
        return cls._made(parts, rows)

    @classmethod
    def of_matrices(
        cls,
        mass: ArrayLike,
        stiffness: ArrayLike,
        places: Mapping[str, int],
        *,
        modes: int = 4,
        zeta: float = 0.0,
    ) -> Structure:
        """Make a structure of the matrices of finite elements, reduced by Craig and Bampton, (2) and (3).

        Parameters
        ----------
        mass, stiffness
            Matrices, dense or of scipy.sparse, symmetric, shape (n, n).
        places
            Numbers of the coordinates that are kept, from 0, by name: those of contacts and forces. With them
            held the structure must not move freely.
        modes
            Number of modes kept beside them, >= 0.
        zeta
            Damping ratio >= 0 of all modes of the reduced structure.
        """
        M, K = _sparse("mass", mass), _sparse("stiffness", stiffness)
        if M.shape != K.shape:
            raise InvalidParameterError(
                f"stiffness has shape {K.shape}; expected {M.shape}, that of mass."
            )
        kept = _kept(_by_name("places", places, "numbers of coordinates"), M.shape[0])
        free = np.setdiff1d(np.arange(M.shape[0]), kept)
        check_count("modes", modes, 0, min(len(free), MOST_COORDINATES - len(kept)))
        ratio = nonnegative("zeta", zeta)
        reduced = _craig_bampton(M, K, kept, free, modes)
        unit = np.eye(len(kept) + modes)
        rows = {str(p): tuple(unit[i].tolist()) for i, p in enumerate(places)}
        return cls._made((reduced[0], _ratio_damping(*reduced, ratio), reduced[1]), rows)

    @classmethod
    def of_files(
        cls,
        mass: str | os.PathLike[str],
        stiffness: str | os.PathLike[str],
        places: Mapping[str, int],
        *,
        modes: int = 4,
        zeta: float = 0.0,
    ) -> Structure:
        """Make a structure of files of matrices: Matrix Market (.mtx), NumPy (.npy), sparse ones of SciPy (.npz).

        Parameters
        ----------
        mass, stiffness
            The files.
        places, modes, zeta
            As for :meth:`of_matrices`.
        """
        matrices = _read("mass", mass), _read("stiffness", stiffness)
        return cls.of_matrices(*matrices, places, modes=modes, zeta=zeta)

    @classmethod
    def _made(cls, matrices: Sequence[Any], places: Mapping[str, tuple[float, ...]]) -> Structure:
        mass, damping, stiffness = (tuple(map(tuple, np.asarray(x).tolist())) for x in matrices)
        return cls(mass, damping, stiffness, places)

    def row(self, place: str, other: str | None = None) -> tuple[float, ...]:
        """Row of a place, for an element; or of its displacement relative to another place."""
        for one in (place, *([other] if other is not None else [])):
            check_choice("place", one, [*self.places])
        here = self.places[place]
        if other is None:
            return here
        return tuple(x - y for x, y in zip(here, self.places[other], strict=True))

    def mechanism(
        self,
        elements: Sequence[Element],
        *,
        forces: Mapping[str, Harmonic | Sequence[Harmonic]] | None = None,
        constant_force: Mapping[str, float] | None = None,
    ) -> Mechanism:
        """Return the structure with stops, friction and forces.

        Parameters
        ----------
        elements
            Each with a row of :meth:`row`.
        forces
            At each place, by its name: a :class:`Harmonic` with one amplitude, or several.
        constant_force
            At each place: a force.
        """
        lines: dict[float, list[Any]] = {}
        nothing = np.zeros(len(self.mass))
        for place, given in _by_name("forces", {} if forces is None else forces, "forces").items():
            row = np.array(self.row(place))
            for one in as_lines(f"forces[{place!r}]", given):
                at = lines.setdefault(one.omega, [nothing, nothing])
                lines[one.omega] = [at[0] + one.sine[0] * row, at[1] + one.cosine[0] * row]
        constant = nothing
        for place, force in _by_name(
            "constant_force", {} if constant_force is None else constant_force, "forces"
        ).items():
            constant = constant + real(f"constant_force[{place!r}]", force) * np.array(
                self.row(place)
            )
        return Mechanism(
            mass=[list(row) for row in self.mass],
            damping=[list(row) for row in self.damping],
            stiffness=[list(row) for row in self.stiffness],
            forces=tuple(Harmonic(w, tuple(s), tuple(c)) for w, (s, c) in lines.items()),
            constant_force=tuple(constant.tolist()),
            elements=cast(Any, elements),
        )


def _by_name(name: str, given: Any, what: str) -> Mapping[str, Any]:
    check_kind(name, given, Mapping, f"a mapping: {what} by name of the place")
    return cast(Mapping[str, Any], given)


def _read(name: str, given: Any) -> Any:
    """Matrix of a file."""
    path = path_of(name, given)
    if path.suffix not in MATRICES:
        raise refusal(name, str(given), f"a file {', '.join(MATRICES[:-1])} or {MATRICES[-1]}")
    from scipy.io import mmread
    from scipy.sparse import load_npz

    readers = dict(zip(MATRICES, (mmread, np.load, load_npz), strict=True))
    try:
        return readers[path.suffix](path)
    except (OSError, ValueError) as error:
        raise InvalidParameterError(
            f"{name} = {path}: must be a matrix in Matrix Market, NumPy's or scipy.sparse's format ({error})."
        ) from error


def _sparse(name: str, given: Any) -> Any:
    """A square matrix, of scipy.sparse."""
    from scipy.sparse import csc_matrix

    dense = given if hasattr(given, "tocsc") else numbers(name, given)
    if dense.ndim != 2 or dense.shape[0] != dense.shape[1]:
        raise InvalidParameterError(f"{name} has shape {dense.shape}; expected (n, n).")
    if dense.dtype.kind not in "iuf":
        raise refusal(name, given, "numbers")
    return csc_matrix(dense)


def _kept(places: Mapping[str, int], size: int) -> Any:
    """Numbers of the kept coordinates."""
    for place, at in places.items():
        check_count(f"places[{place!r}]", at, 0, size - 1)
    numbered = [*places.values()]
    if not numbered or len({*numbered}) < len(numbered):
        raise refusal("places", dict(places), "one coordinate at least, each once")
    return np.array(numbered)


def _craig_bampton(M: Any, K: Any, kept: Any, free: Any, modes: int) -> tuple[Any, Any]:
    """Mass and stiffness by (2) and (3)."""
    from scipy.linalg import eigh
    from scipy.sparse.linalg import eigsh, splu

    def block(matrix: Any, rows: Any, columns: Any) -> Any:
        return matrix[rows][:, columns]

    M_ii, K_ii = block(M, free, free).tocsc(), block(K, free, free).tocsc()
    M_ib, K_ib = (block(x, free, kept).toarray() for x in (M, K))
    try:
        static = -splu(K_ii).solve(K_ib) if len(free) else K_ib
    except RuntimeError:
        raise InvalidParameterError(
            "stiffness: with the places held the structure can move freely. Name more places, or hold it."
        ) from None
    if not modes:
        squares, shapes = np.zeros(0), np.zeros((len(free), 0))
    elif modes < len(free) // 2:
        squares, shapes = eigsh(K_ii, modes, M_ii, sigma=0.0)
    else:
        squares, shapes = eigh(K_ii.toarray(), M_ii.toarray(), subset_by_index=(0, modes - 1))
    order = np.argsort(squares)
    squares, shapes = squares[order], shapes[:, order]
    shapes = shapes * np.sign(
        shapes[np.abs(shapes).argmax(axis=0), np.arange(modes)]
    )  # no other choice of signs
    cross = M_ib.T @ static
    mass = block(M, kept, kept).toarray() + cross + cross.T + static.T @ (M_ii @ static)
    joint = (M_ib.T + (M_ii @ static).T) @ shapes
    stiff = block(K, kept, kept).toarray() + K_ib.T @ static
    zero = np.zeros((len(kept), modes))
    whole = np.block([[(mass + mass.T) / 2.0, joint], [joint.T, np.eye(modes)]])
    return whole, np.block([[(stiff + stiff.T) / 2.0, zero], [zero.T, np.diag(squares)]])


def _ratio_damping(mass: Any, stiffness: Any, zeta: float) -> Any:
    """Damping matrix with one ratio for all modes."""
    from scipy.linalg import eigh

    squares, shapes = eigh(stiffness, mass)
    across = mass @ shapes
    of_one = across @ np.diag(2.0 * np.sqrt(np.maximum(squares, 0.0))) @ across.T
    with np.errstate(over="ignore", invalid="ignore"):  # what is infinite is refused by name
        return zeta * of_one
