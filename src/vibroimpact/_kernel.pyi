from collections.abc import Sequence
from typing import Any, overload

import numpy
import numpy.typing


def version() -> str: ...

MAX_DEGREES: int = 20

MAX_CONTACTS: int = 16

MAX_LINES: int = 12

BLOCK_DEGREES: int = 10

BLOCK_CONTACTS: int = 8

BLOCK_LINES: int = 6

def sincos(x: float) -> tuple[float, float]:
    """Sine and cosine with the kernel's own bits."""

class Jet:
    """
    A number with infinitely small parts along three directions e1, e2, e3.

    ``coefficients[s]`` belongs to the product of the e_i in the bit mask s. With
    x + u e1 + v e2 + w e3 a function gives f at 0, D f[u] at 1, D f[v] at 2,
    D^2 f[u, v] at 3 and D^3 f[u, v, w] at 7. Comparisons look at values.
    """

    def __init__(self, value: float) -> None: ...

    @staticmethod
    def of(value: float, coefficients: Sequence[float]) -> Jet: ...

    @staticmethod
    def variable(value: float) -> Jet:
        """Seeded in all directions: derivatives are coefficients 1, 3 and 7."""

    @property
    def value(self) -> float: ...

    @property
    def coefficients(self) -> list[float]: ...

    @property
    def finite(self) -> bool: ...

    @overload
    def __add__(self, arg: Jet, /) -> Jet: ...

    @overload
    def __add__(self, arg: float, /) -> Jet: ...

    @overload
    def __sub__(self, arg: Jet, /) -> Jet: ...

    @overload
    def __sub__(self, arg: float, /) -> Jet: ...

    @overload
    def __mul__(self, arg: Jet, /) -> Jet: ...

    @overload
    def __mul__(self, arg: float, /) -> Jet: ...

    @overload
    def __truediv__(self, arg: Jet, /) -> Jet: ...

    @overload
    def __truediv__(self, arg: float, /) -> Jet: ...

    def __radd__(self, arg: float, /) -> Jet: ...

    def __rsub__(self, arg: float, /) -> Jet: ...

    def __rmul__(self, arg: float, /) -> Jet: ...

    def __rtruediv__(self, arg: float, /) -> Jet: ...

    def __neg__(self) -> Jet: ...

    def __pos__(self) -> Jet: ...

    def __abs__(self) -> Jet: ...

    def __pow__(self, arg: float, /) -> Jet: ...

    @overload
    def __lt__(self, arg: Jet, /) -> bool: ...

    @overload
    def __lt__(self, arg: float, /) -> bool: ...

    @overload
    def __le__(self, arg: Jet, /) -> bool: ...

    @overload
    def __le__(self, arg: float, /) -> bool: ...

    @overload
    def __gt__(self, arg: Jet, /) -> bool: ...

    @overload
    def __gt__(self, arg: float, /) -> bool: ...

    @overload
    def __ge__(self, arg: Jet, /) -> bool: ...

    @overload
    def __ge__(self, arg: float, /) -> bool: ...

    def __eq__(self, arg: object, /) -> bool: ...

    def __bool__(self) -> bool: ...

    def __hash__(self) -> int: ...

    def rounded_down(self, bits: int) -> float:
        """The value, > 0, rounded down to so many binary digits."""

    def sqrt(self) -> Jet: ...

    def exp(self) -> Jet: ...

    def log(self) -> Jet: ...

    def sin(self) -> Jet: ...

    def cos(self) -> Jet: ...

    def __repr__(self) -> str: ...

class Recorded:
    """
    A number of a recording. It has a value; derivatives come with repetition.
    """

    @overload
    def __add__(self, arg: Recorded, /) -> Recorded: ...

    @overload
    def __add__(self, arg: float, /) -> Recorded: ...

    @overload
    def __sub__(self, arg: Recorded, /) -> Recorded: ...

    @overload
    def __sub__(self, arg: float, /) -> Recorded: ...

    @overload
    def __mul__(self, arg: Recorded, /) -> Recorded: ...

    @overload
    def __mul__(self, arg: float, /) -> Recorded: ...

    @overload
    def __truediv__(self, arg: Recorded, /) -> Recorded: ...

    @overload
    def __truediv__(self, arg: float, /) -> Recorded: ...

    def __radd__(self, arg: float, /) -> Recorded: ...

    def __rsub__(self, arg: float, /) -> Recorded: ...

    def __rmul__(self, arg: float, /) -> Recorded: ...

    def __rtruediv__(self, arg: float, /) -> Recorded: ...

    @overload
    def __lt__(self, arg: Recorded, /) -> bool: ...

    @overload
    def __lt__(self, arg: float, /) -> bool: ...

    @overload
    def __le__(self, arg: Recorded, /) -> bool: ...

    @overload
    def __le__(self, arg: float, /) -> bool: ...

    @overload
    def __gt__(self, arg: Recorded, /) -> bool: ...

    @overload
    def __gt__(self, arg: float, /) -> bool: ...

    @overload
    def __ge__(self, arg: Recorded, /) -> bool: ...

    @overload
    def __ge__(self, arg: float, /) -> bool: ...

    def __neg__(self) -> Recorded: ...

    def __pos__(self) -> Recorded: ...

    def __abs__(self) -> Recorded: ...

    def __pow__(self, arg: float, /) -> Recorded: ...

    def __eq__(self, arg: object, /) -> bool: ...

    def __hash__(self) -> int: ...

    def __bool__(self) -> bool: ...

    @property
    def value(self) -> float: ...

    def rounded_down(self, bits: int) -> float: ...

    @property
    def finite(self) -> bool: ...

    def sqrt(self) -> Recorded: ...

    def exp(self) -> Recorded: ...

    def log(self) -> Recorded: ...

    def sin(self) -> Recorded: ...

    def cos(self) -> Recorded: ...

class Recording:
    """
    A computation with parameters, recorded once and repeated at other values of them.

    Numbers that depend on parameters are :class:`Recorded`. Comparisons of them are
    conditions: where one has another outcome the computation is not repeated. That of
    explorer/recording.py is another one, which the explorer's page repeats.
    """

    def __init__(self) -> None: ...

    def parameter(self, value: float) -> Recorded:
        """The next parameter."""

    def close(self, outputs: list[Any]) -> None:
        """End the recording with the numbers that it is made for."""

    def repeat(self, parameters: list[float], by: int) -> numpy.typing.NDArray[numpy.float64] | None:
        """
        The outputs with three derivatives by a parameter, in rows; None where a condition fails.
        """

def zeros_of_series(coefficients: numpy.typing.NDArray[numpy.float64], rounding: float) -> tuple[numpy.typing.NDArray[numpy.int64], numpy.typing.NDArray[numpy.float64]]:
    """
    Zeros in [-1, 1] of Chebyshev series in rows, with the numbers of their series.
    """

class Prescribed:
    def __init__(self, *, degrees: int, ratios: list[float], rate: float, steps: list[float], stops: list[tuple[int, bool, int]], values: numpy.typing.NDArray[numpy.float64]) -> None: ...

    def linearise(self, states: numpy.typing.NDArray[numpy.float64], durations: numpy.typing.NDArray[numpy.float64], stops: list[int]) -> dict[str, Any]: ...

    def second(self, states: numpy.typing.NDArray[numpy.float64], durations: numpy.typing.NDArray[numpy.float64], stops: list[int], directions: numpy.typing.NDArray[numpy.float64], by_parameter: bool) -> tuple[numpy.typing.NDArray[numpy.float64], numpy.typing.NDArray[numpy.float64]]: ...

    def forms(self, states: numpy.typing.NDArray[numpy.float64], durations: numpy.typing.NDArray[numpy.float64], stops: list[int], start: int, solved: int, period: numpy.typing.NDArray[numpy.float64], mode: int, directions: numpy.typing.NDArray[numpy.float64]) -> numpy.typing.NDArray[numpy.float64]: ...

    def chatter(self, state: numpy.typing.NDArray[numpy.float64], direction: numpy.typing.NDArray[numpy.float64], stop: int) -> tuple[numpy.typing.NDArray[numpy.float64], numpy.typing.NDArray[numpy.float64], numpy.typing.NDArray[numpy.float64], numpy.typing.NDArray[numpy.float64]]: ...

    def approach(self, states: numpy.typing.NDArray[numpy.float64], durations: numpy.typing.NDArray[numpy.float64], modes: list[int], guard_modes: list[int], rows: list[int], nodes: numpy.typing.NDArray[numpy.float64], window: float, flat: float) -> tuple[numpy.typing.NDArray[numpy.float64], numpy.typing.NDArray[numpy.float64], numpy.typing.NDArray[numpy.float64], numpy.typing.NDArray[numpy.float64]]: ...

    def fly(self, states: numpy.typing.NDArray[numpy.float64], modes: list[int], windows: list[int], nodes: numpy.typing.NDArray[numpy.float64], window: float) -> numpy.typing.NDArray[numpy.float64]: ...

class StopSign:
    """Ends the runs of members in all threads that obey it."""

    def __init__(self) -> None: ...

    def set(self) -> None: ...

    def is_set(self) -> bool: ...

def observers() -> dict[str, tuple[dict[str, tuple[Any, ...]], tuple[str, ...]]]:
    """
    Observers by name: their options, each with its kind and range, and their tables.
    """

def obey(sign: StopSign) -> None:
    """Let this thread obey a sign, which has to outlive it."""

class Batch:
    """
    Systems of one structure with different numbers, and the members that run in them.

    Arrays are C-contiguous float64. Those of systems are of one, as hybrid.Compiled gives
    them to System. Numbers that vary are in the columns (V, S), which are kept, not copied:
    `varied` has by name of an array the rows of their columns by place. Arrays of members
    have a leading axis of members.
    """

    def __init__(self, *, dense: bool, mixed: bool, sequential: bool, degrees: int, columns: numpy.typing.NDArray[numpy.float64], varied: dict[str, dict[int, int]], omegas: numpy.typing.NDArray[numpy.float64], kappas: numpy.typing.NDArray[numpy.float64], steps: numpy.typing.NDArray[numpy.float64], impulse: numpy.typing.NDArray[numpy.float64], mobility: numpy.typing.NDArray[numpy.float64], shift: numpy.typing.NDArray[numpy.float64], restitution: numpy.typing.NDArray[numpy.float64], damping: numpy.typing.NDArray[numpy.float64], piecewise: bool, elements: list[tuple[int, bool, bool]], reset_shift: numpy.typing.NDArray[numpy.float64], reset_matrix: numpy.typing.NDArray[numpy.float64], given: bool) -> None: ...

    def add_mode(self, *, code: int, varied: dict[str, dict[int, int]], flow: dict[str, numpy.typing.NDArray[numpy.float64]], rows: numpy.typing.NDArray[numpy.float64], gains: numpy.typing.NDArray[numpy.float64], lower: numpy.typing.NDArray[numpy.float64], upper: numpy.typing.NDArray[numpy.float64], side: list[int], to_x: numpy.typing.NDArray[numpy.float64], to_v: numpy.typing.NDArray[numpy.float64], offset: numpy.typing.NDArray[numpy.float64], from_x: numpy.typing.NDArray[numpy.float64], from_v: numpy.typing.NDArray[numpy.float64], particular: numpy.typing.NDArray[numpy.float64], piecewise: dict[str, Any]) -> None: ...

    def run(self, *, system: numpy.typing.NDArray[numpy.int32], position: numpy.typing.NDArray[numpy.float64], velocity: numpy.typing.NDArray[numpy.float64], phases: numpy.typing.NDArray[numpy.float64], settle: numpy.typing.NDArray[numpy.float64], observe: numpy.typing.NDArray[numpy.float64], most_impacts: int, observers: dict[str, Any]) -> dict[str, numpy.typing.NDArray[Any]]: ...

def decouple(stiffness: numpy.typing.NDArray[numpy.float64], damping: numpy.typing.NDArray[numpy.float64]) -> dict[str, numpy.typing.NDArray[numpy.float64]]:
    """
    Second-order blocks of x'' + D x' + A x = 0 for S systems, D and A symmetric, (S, n, n).

    Returns k and c of the blocks q'' = -k q - c q', (S, n); x = positions q + velocities q',
    (S, n, n); (q_1, q_1', q_2, ...) = back (x, x'), (S, 2n, 2n); found, (S), 0 where there are none
    to rounding, the rest being zero.
    """

def pace(parts: numpy.typing.NDArray[numpy.float64], own: numpy.typing.NDArray[numpy.float64], most: numpy.typing.NDArray[numpy.float64], system: numpy.typing.NDArray[numpy.int32], position: numpy.typing.NDArray[numpy.float64], velocity: numpy.typing.NDArray[numpy.float64], run: numpy.typing.NDArray[numpy.float64], elements: bool, slowest: float, fastest: float) -> numpy.typing.NDArray[numpy.float64]:
    """
    Rate at which each of N motions meets stops or slips, a power of two within slowest and fastest, (N); 0 where it meets nothing.

    parts, (S, P, n + 5), has for each system and part: row, lower, upper, largest pull, that of lines, speed of the belt;
    own, (S), fastest rates of the systems; most, (S), paces up to which they serve; system, (N), position and velocity, (N, n);
    run, (N), lengths of the runs, which count beside own rates only with elements.
    """

class Position:
    def copy(self) -> Position: ...

    @property
    def touching(self) -> list[float]: ...

    @property
    def rate(self) -> list[float]: ...

    @property
    def y(self) -> list[float]: ...

    @property
    def mode(self) -> int: ...

    @mode.setter
    def mode(self, arg: int, /) -> None: ...

    @property
    def states(self) -> int: ...

    @states.setter
    def states(self, arg: int, /) -> None: ...

class System:
    def __init__(self, *, dense: bool, mixed: bool, dimension: int, degrees: int, omegas: list[float], kappas: list[float], step: float, laws: list[tuple[list[float], list[float], list[float], float, float]], elements: list[tuple[int, bool, bool]], given: bool, sequential: bool) -> None: ...

    def add_mode(self, *, code: int, flow: dict[str, object], guards: list[tuple[list[float], float, float, float, int]], watches: list[tuple[list[float], float, float, float, int, bool, int, int]], to_x: numpy.typing.NDArray[numpy.float64], to_v: numpy.typing.NDArray[numpy.float64], offset: list[float], from_x: numpy.typing.NDArray[numpy.float64], from_v: numpy.typing.NDArray[numpy.float64], particular: numpy.typing.NDArray[numpy.float64], shift: list[float]) -> None: ...

    def start(self, x: list[float], v: list[float], phases: list[float]) -> dict[str, Any]: ...

    def add_reset(self, *, matrix: numpy.typing.NDArray[numpy.float64], shift: list[float]) -> int: ...

    def settle(self, at: Position) -> int: ...

    def simulate(self, at: Position, t_max: float, flight_limit: float, events: int, impacts: int) -> dict[str, Any]: ...

    def advance(self, at: Position, t_max: float, flight_limit: float, events: int, impacts: int) -> tuple[int, int, int]: ...

    def evaluate(self, mode: list[int], y: numpy.typing.NDArray[numpy.float64], dt: numpy.typing.NDArray[numpy.float64]) -> numpy.typing.NDArray[numpy.float64]: ...

    def tangents(self, x: list[float], v: list[float], phases: list[float], seeds: numpy.typing.NDArray[numpy.float64], t_max: float, flight_limit: float, events: int, impacts: int) -> dict[str, Any]: ...

    def lyapunov(self, at: Position, t_max: float, flight_limit: float, events: int, impacts: int, block: int) -> dict[str, Any]: ...

    def spectrum(self, at: Position, t_max: float, flight_limit: float, events: int, impacts: int, block: int, count: int) -> dict[str, Any]: ...

    def acceleration(self, x: list[float], v: list[float], phases: list[float]) -> numpy.typing.NDArray[numpy.float64]: ...

    def flow_matrix(self, dt: float) -> numpy.typing.NDArray[numpy.float64]: ...

    def impact_matrix(self, contact: int, side: int) -> numpy.typing.NDArray[numpy.float64]: ...
