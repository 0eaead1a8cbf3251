"""Numbers with units are told in the part or multiple of the unit that reads best."""

from __future__ import annotations

import math

import pytest

from vibroimpact._core.quantities import prefixed, with_unit


@pytest.mark.parametrize(
    ("values", "unit", "text"),
    [
        ((0.003,), "m", "3 mm"), ((0.002, 0.05), "m", "2 to 50 mm"), ((0.0, 4e-5), "m", "0 to 40 µm"),
        ((1200.0,), "m", "1200 m"), ((1200.0,), "N", "1.2 kN"), ((0.99999996,), "m", "1 m"), ((0.0,), "N", "0 N"),
        ((-0.25,), "m/s", "-250 mm/s"), ((0.02,), "kg", "0.02 kg"), ((0.02,), "", "0.02"),
        ((1e-15,), "m", "1e-06 nm"), ((math.inf,), "m", "inf m"), ((math.nan, 0.001), "m", "nan to 1 mm"),
        ((0.001, math.inf), "m", "1 to inf mm"),
    ],
)  # fmt: skip
def test_numbers_with_a_unit_read_as_engineers_write_them(
    values: tuple[float, ...], unit: str, text: str
) -> None:
    assert with_unit(*values, unit=unit) == text


def test_a_number_in_its_part_of_the_unit_lies_between_one_and_a_thousand() -> None:
    for exponent in range(-9, 12):
        for digit in (1.0, 9.99):
            size = digit * 10.0**exponent
            assert 1.0 <= size / prefixed(size, "N")[0] < 1000.0
