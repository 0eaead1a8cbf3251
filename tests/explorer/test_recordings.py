"""Recordings of the compile step: repeated for other parameters they give its numbers, to the last bit."""

from __future__ import annotations

import json
from collections.abc import Mapping

import numpy as np
import pytest

import vibroimpact as vi
from vibroimpact.compile.hybrid import hybrid_of
from vibroimpact.compile.tables import stacks_of
from vibroimpact.explorer.page_data import (
    MODE,
    SYSTEM,
    covers,
    machine_data,
    packed_of,
    recording_of,
    text_of,
    values_of,
)
from vibroimpact.explorer.recording import OPERANDS, Recording, repeated
from vibroimpact.model.parameters import with_parameters
from vibroimpact.model.system import System, mechanism_of

# without elements, with a soft stop, and with damping that is not classical, which takes src/decouple
SYSTEMS: dict[str, tuple[System, dict[str, float]]] = {
    "damper": (
        vi.ImpactDamper(**vi.ImpactDamper.example),
        {"omega": 0.83, "mass_ratio": 0.17, "half_clearance": 3.3},
    ),
    "soft": (vi.machines.SoftImpactOscillator(), {"omega": 0.71, "gap": 0.9, "zeta": 0.03}),
    "hammer": (vi.machines.VibrationHammer(damping=0.3), {"damping": 0.4, "ram_mass": 0.8}),
}


def numbers_of(system: System, values: Mapping[str, float]) -> list[np.ndarray]:
    """Numbers of the compiled system, as sweeps compile it alone."""
    hybrid = hybrid_of(mechanism_of(with_parameters(system, values)))
    stacks = stacks_of(hybrid, (1,))
    parts = [stacks.systems[name] for name in SYSTEM]
    parts += [mode[name] for name in MODE for mode in stacks.modes]
    return [part.shared.ravel() for part in parts]


@pytest.mark.parametrize("name", SYSTEMS)
def test_a_recording_repeated_at_other_values_has_the_bits_of_the_compile_step(name: str) -> None:
    system, changes = SYSTEMS[name]
    at = values_of(system)
    recording = recording_of(system, at)
    elsewhere = {**at, **changes}
    entries = repeated([elsewhere[one] for one in recording["inputs"]], recording)
    assert entries is not None
    numbers = np.array(recording["numbers"])
    patches = np.array(recording["patches"]).reshape(-1, 2)
    numbers[patches[:, 0]] = np.array(entries)[patches[:, 1]]
    bits = {x.tobytes() for x in numbers_of(system, elsewhere)}
    whole = numbers.tobytes()
    assert len(patches) > 30
    assert all(part in whole for part in bits)
    assert not all(x.tobytes() in whole for x in numbers_of(system, at))


def test_values_that_the_machine_refuses_or_that_branch_elsewhere_are_not_covered() -> None:
    system, _ = SYSTEMS["damper"]
    at = values_of(system)
    recording = recording_of(system, at)
    assert covers(recording, {**at, "omega": 0.9})
    assert not covers(recording, {**at, "half_clearance": -1.0})
    assert not covers(recording, {**at, "zeta": 0.0})  # the block has no damping then
    assert not covers(recording, at, pace=4.0)  # its pace is no input


def test_terms_that_are_zero_whatever_the_inputs_are_left_out() -> None:
    r = Recording(1)
    x = r.input(0, 3.0)
    some = x * x + x  # may be -0, as x may
    assert r.entry((some + 0.0 * x).values) != r.entry(some.values)  # -0 + 0 is 0
    whole = 0.0 + x * x
    assert r.entry((whole + 0.0 * x).values) == r.entry(whole.values)
    assert r.entry((0.0 + 0.0 * x).values) in r.constants


def test_what_cannot_be_written_down_is_no_silent_constant() -> None:
    x = Recording(1).input(0, 3.0)
    with pytest.raises(TypeError):
        np.cumsum(x.values)


def test_the_text_of_the_page_is_json_with_infinite_limits() -> None:
    data = machine_data(vi.machines.BouncingBall())
    text = text_of({"ball": data}, "ball", {})
    whole = json.loads(text)
    packed = whole["machines"]["ball"]["recordings"][0]
    assert np.isinf(packed["numbers"]).any()
    assert packed == packed_of(data["recordings"][0])
    flat, count = packed["code"], 0
    while flat:
        flat = flat[1 + whole["operands"][flat[0]] :]
        count += 1
    assert count == len(data["recordings"][0]["code"])
    assert whole["operands"] == [*OPERANDS.values()]
