"""A system compiled at many values of its parameters, as a branch asks for it.

Method      The compilation is recorded once, as a list of operations on the parameters and of the comparisons made on
            the way; it is repeated at other values as long as each comparison has the same outcome, checks of values
            included (src/bindings/numeric/recording.hpp). Where one has not the system is compiled as always, which
            raises what is to be said, and recorded anew.
Accuracy    the bits of the whole compilation
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np

from vibroimpact._core.errors import InvalidParameterError
from vibroimpact._core.linear import Vector
from vibroimpact._core.types import Floats
from vibroimpact._kernel import Recording
from vibroimpact.compile.prescribed import (
    Compilation,
    Layout,
    Prescribed,
    compile_prescribed,
    with_derivatives,
)
from vibroimpact.model.mechanism import Mechanism
from vibroimpact.model.parameters import changed, expanded, with_parameter, with_parameters
from vibroimpact.model.system import System, mechanism_of

KEPT_RECORDINGS = 4  # of the latest stretches on which comparisons have the same outcomes


class _Recorded(NamedTuple):
    """A recorded compilation."""

    layout: Layout
    recording: Recording


class Along:
    """A system along parameters: compiled at any values of them, with derivatives by one.

    Parameters
    ----------
    system
        The system; its own values of these parameters are not used.
    names
        The parameters.
    codes
        Codes of the modes that its motions pass.
    """

    def __init__(self, system: System, names: tuple[str, ...], codes: tuple[int, ...]) -> None:
        self.system, self.names, self.codes = system, names, codes
        self._known: list[_Recorded] = []
        self._asked = 0  # how often a compilation was asked for
        self._repeated = 0  # how often one was repeated since the last recording

    def __reduce__(self) -> tuple[object, ...]:  # recordings are made again
        return Along, (self.system, self.names, self.codes)

    def system_at(self, values: tuple[float, ...]) -> System:
        """The system at values of the parameters."""
        return with_parameters(self.system, dict(zip(self.names, values, strict=True)))

    def at(self, values: tuple[float, ...], by: int = 0) -> Prescribed:
        """The system compiled at values of the parameters, with derivatives by the one of this number.

        Raises
        ------
        InvalidParameterError
            As :func:`compile_prescribed`.
        """
        for known in self._known:
            numbers = known.recording.repeat([*values], by)
            if numbers is not None:
                self._repeated += 1
                return Prescribed(
                    lambda: self.system_at(values), self.names[by], known.layout, numbers
                )
        compiled = compile_prescribed(
            self.system_at(values), self.names[by] if self.names else "", self.codes
        )
        self._asked += 1
        if self._asked == 2 or (self._asked > 2 and self._repeated):  # else it is not worth it
            self._record(values)
        return compiled

    def _record(self, values: tuple[float, ...]) -> None:
        """Record the compilation at values at which the system is one."""
        recording, self._repeated = Recording(), 0
        numbers = {n: recording.parameter(x) for n, x in zip(self.names, values, strict=True)}
        try:
            made = Compilation(mechanism_of(changed(self.system, numbers)), self.codes)
            recording.close(made.numbers)
        except (
            TypeError,
            InvalidParameterError,
        ):  # code of a user's that takes floats and jets only
            return
        self._known = [_Recorded(made.layout, recording), *self._known[: KEPT_RECORDINGS - 1]]


def numbers_along(
    system: System, name: str, values: Sequence[float], make: Callable[[Mechanism], Vector]
) -> Floats:
    """Numbers that are made of a system at values of a parameter, and their derivatives by it.

    Parameters
    ----------
    system
        The system; its own value of the parameter is not used.
    name, values
        The parameter, and its values (k,).
    make
        What makes numbers of a mechanism in numbers of any kind, N of it everywhere.

    Returns
    -------
    ndarray, shape (2, k, N)

    Raises
    ------
    InvalidParameterError
        As :func:`compile_prescribed`.
    """
    known: list[Recording] = []
    found = []
    for value in values:
        numbers = _repeated(known, value)
        if numbers is None and (recording := _recording_of(system, name, value, make)):
            known = [recording, *known[: KEPT_RECORDINGS - 1]]
            numbers = _repeated(known, value)
        if numbers is None:
            numbers = with_derivatives(make(expanded(with_parameter(system, name, value), name)))
        found.append(numbers[:2])
    return np.stack(found, axis=1)


def _repeated(known: list[Recording], value: float) -> Floats | None:
    tried = (recording.repeat([value], 0) for recording in known)
    return next((numbers for numbers in tried if numbers is not None), None)


def _recording_of(
    system: System, name: str, value: float, make: Callable[[Mechanism], Vector]
) -> Recording | None:
    """What makes numbers of a system, recorded; None where its code takes floats and jets only."""
    recording = Recording()
    try:
        varied = changed(system, {name: recording.parameter(value)})
        recording.close(make(mechanism_of(varied)))
    except (TypeError, InvalidParameterError):
        return None
    return recording
