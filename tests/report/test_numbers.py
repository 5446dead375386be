"""Numbers on pictures and pages: a minus that is no hyphen, a power of ten that is no letter."""

from __future__ import annotations

import pytest

from hvi_fenicsx.report import units


@pytest.mark.parametrize(
    ("value", "digits", "text"),
    [(-24.6832, 6, "−24.6832"), (1.43e-07, 3, "1.43·10⁻⁷"), (-4.71e-12, 2, "−4.7·10⁻¹²"), (2.15e11, 6, "2.15·10¹¹")],
)
def test_a_number_has_neither_a_hyphen_nor_a_letter(value: float, digits: int, text: str) -> None:
    assert units.number(value, digits) == text


def test_a_quantity_has_three_digits_and_a_prefix_or_a_power_of_ten() -> None:
    said = [units.quantity(*one).split() for one in ((1e-9, "Pa"), (8.49e-21, "m"), (2.5e24, "Pa"), (0.8912, "Pa"))]
    assert said == [["10⁻⁹", "Pa"], ["8.49·10⁻⁹", "pm"], ["2.5·10¹²", "TPa"], ["0.891", "Pa"]]


def test_a_force_that_is_rounding_beside_the_largest_is_zero() -> None:
    assert [units.unless_noise(value, 1.5e4) for value in (-83e-9, -2.0e-5, 3.0)] == [0.0, -2.0e-5, 3.0]
