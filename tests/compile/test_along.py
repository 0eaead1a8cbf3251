"""Compilation along parameters: recorded once and repeated, with the bits of the whole compilation."""

from __future__ import annotations

from collections.abc import Callable
from copy import deepcopy

import numpy as np
import pytest

import vibroimpact as vi
from vibroimpact._core.errors import InvalidParameterError
from vibroimpact._kernel import Recorded, Recording
from vibroimpact.compile.along import Along
from vibroimpact.compile.prescribed import compile_prescribed
from vibroimpact.machines.machine import example_of
from vibroimpact.machines.registry import MACHINES, machine_of
from vibroimpact.model.parameters import names_of, with_parameters

NEAR = (1.0, 1.0009765625, 0.9990234375)  # factors of a parameter


@pytest.mark.parametrize("name", MACHINES)
def test_a_repeated_compilation_has_the_bits_of_a_whole_one(name: str) -> None:
    system = example_of(machine_of(name))
    first, second = [n for n, x in names_of(system).items() if x and isinstance(x, float)][:2]
    names, values = (first, second), (names_of(system)[first], names_of(system)[second])
    along = Along(system, names, (0,))
    for factor in NEAR:
        here = values[0] * factor, values[1]
        for by in (0, 1):
            repeated = along.at(here, by)
            whole = compile_prescribed(
                with_parameters(system, dict(zip(names, here, strict=True))), names[by], (0,)
            )
            assert np.array_equal(repeated.values, whole.values)
            assert repeated.layout == whole.layout


def test_a_value_that_is_refused_is_refused_after_a_recording_too() -> None:
    along = Along(example_of(vi.ImpactDamper), ("restitution",), (0,))
    for x in (0.7, 0.8, 0.9):
        along.at((x,))
    with pytest.raises(InvalidParameterError, match="restitution"):
        along.at((1.1,))


def recorded(x: float) -> tuple[Recording, Recorded]:
    """A recording with one parameter."""
    recording = Recording()
    return recording, recording.parameter(x)


def test_operations_repeat_with_three_derivatives() -> None:
    recording, x = recorded(2.0)
    recording.close([x**3 / 6.0, 1.0 - x, 7.0, abs(-x)])
    found = recording.repeat([3.0], 0)
    assert found is not None
    assert found.T.tolist() == [
        [4.5, 4.5, 3.0, 1.0], [-2.0, -1.0, 0.0, 0.0], [7.0, 0.0, 0.0, 0.0], [3.0, 1.0, 0.0, 0.0],
    ]  # fmt: skip


@pytest.mark.parametrize(
    ("decide", "other"),
    [
        (lambda x: x < 2.5, 2.5),
        (lambda x: x <= 2.0, 2.1),
        (lambda x: x == 2.0, 2.1),
        (lambda x: bool(x), 0.0),
        (lambda x: abs(x), -2.0),
        (lambda x: x.rounded_down(1), 4.0),
        (lambda x: x.finite, float("inf")),
        (lambda x: x.value, 2.1),  # what is read as a float must not change
    ],
)
def test_a_decision_that_is_taken_otherwise_is_not_repeated(
    decide: Callable[[Recorded], object], other: float
) -> None:
    recording, x = recorded(2.0)
    decide(x)
    recording.close([x])
    assert recording.repeat([2.0], 0) is not None
    assert recording.repeat([other], 0) is None


def test_a_copy_records_anew() -> None:
    along = Along(example_of(vi.ImpactDamper), ("omega",), (0,))
    wanted = [along.at((x,)).values for x in (0.9, 1.0, 1.1)]
    copied = deepcopy(along)
    assert np.array_equal([copied.at((x,)).values for x in (0.9, 1.0, 1.1)], wanted)
