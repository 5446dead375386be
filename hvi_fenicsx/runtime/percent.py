"""A share of one as a percentage, as lines on the terminal and sentences have it."""

from __future__ import annotations


def percent(share: float) -> str:
    """Two digits and no power of ten, or all digits before the point.

    Args:
        share: of one; from about 1e-6 on.
    """
    return f"{100.0 * share:.0f} %" if share >= 0.1 else f"{100.0 * share:.2g} %"
