"""Numbers as people read them: SI prefixes, round factors, thin spaces between thousands, a minus that is no hyphen."""

from __future__ import annotations

import math
from dataclasses import dataclass

from ..geometry import ROUNDING

_PREFIXES = {-12: "p", -9: "n", -6: "µ", -3: "m", 0: "", 3: "k", 6: "M", 9: "G", 12: "T"}
_NARROW = "\N{NARROW NO-BREAK SPACE}"


@dataclass(frozen=True)
class Unit:
    """A unit with its prefix.

    Attributes:
        size: of the unit, in the unit without its prefix.
        name: with the prefix.
    """

    size: float
    name: str

    def text(self, value: float) -> str:
        """A value in this unit, to three digits."""
        return f"{self.number(value)}{_NARROW}{self.name}"

    def number(self, value: float) -> str:
        """The same without the unit, for a column that names it at its head."""
        return _digits(value / self.size)


def unit_for(largest: float, name: str) -> Unit:
    """The unit whose prefix brings the largest value between 1 and 1000, if there is one; no prefix for zero.

    Args:
        largest: in the unit without a prefix.
        name: of the unit without a prefix.
    """
    if not (math.isfinite(largest) and largest != 0.0):
        return Unit(1.0, name)
    exponent = 3 * math.floor(math.log10(abs(largest) * (1.0 + 1e-9)) / 3)
    least = 0 if name == "Pa" else -12  # mPa would be read as MPa
    most = 3 if name == "m" else 12  # nobody says megametre
    nearest = min(max(exponent, least), most)
    return Unit(10.0**nearest, _PREFIXES[nearest] + name)


def quantity(value: float, name: str) -> str:
    """A value with the prefix that suits it.

    Args:
        value: in the unit without a prefix.
        name: of the unit without a prefix.
    """
    return unit_for(value, name).text(value)


def round_below(value: float) -> float:
    """The largest of 1, 2, 5, 10, 20, ... (and their fractions) that is not above a positive value."""
    if not (math.isfinite(value) and value > 0.0):
        return 1.0
    power = 10.0 ** math.floor(math.log10(value))
    return max(step for step in (0.5, 1.0, 2.0, 5.0) if step * power <= value * (1.0 + 1e-9)) * power


def times(factor: float) -> str:
    """A magnification in words."""
    return "displacements to scale" if factor == 1.0 else f"displacements × {_digits(factor)}"


def number(value: float, digits: int = 6) -> str:
    """A number without a unit, very large and small ones with a power of ten.

    Args:
        value: the number.
        digits: that are significant.
    """
    text = f"{value:.{digits}g}"
    if "e" not in text and not 0 < abs(value) < 1e-3 and abs(value) < 1e5:
        return text.replace("-", "−")
    mantissa, exponent = f"{value:.{digits - 1}e}".split("e")
    mantissa = (mantissa.rstrip("0").rstrip(".") if "." in mantissa else mantissa).replace("-", "−")
    power = "10" + str(int(exponent)).translate(str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹"))
    return mantissa.replace("1", power) if mantissa in ("1", "−1") else f"{mantissa}·{power}"


def unless_noise(value: float, beside: float) -> float:
    """A value; zero where it is rounding.

    Args:
        value: it.
        beside: the largest size of what is beside it.
    """
    return value if abs(value) > ROUNDING * beside else 0.0


def thousands(whole: int) -> str:
    """A whole number, its thousands apart."""
    return f"{whole:,}".replace(",", _NARROW)


def _digits(value: float) -> str:
    if value == 0.0:
        return "0"
    if not 1e-4 <= abs(value) < 1e9:
        return number(value, 3)
    decimals = max(0, 2 - math.floor(math.log10(abs(value))))
    text = f"{value:,.{decimals}f}".replace(",", _NARROW).replace("-", "−")
    return text.rstrip("0").rstrip(".") if "." in text else text
