"""The axes of a study's pictures: errors in per cent, times, mesh widths, all logarithmic."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter

from ..report.pictures.style import GREY
from .error_norms import ERROR_NORMS
from .sentences import NEGLIGIBLE, seconds

LEAST = 1e-6
"""A smaller error is drawn on it."""
_BOTTOM = 1e-7
"""No axis of errors goes below it."""
_LINE = 0.17
"""Inches that a name takes in height: of points or lines closer than this only one is named."""


def error_axis(axes: Axes, quantity: str, own: float | None, shown: Sequence[float], note: str = "") -> None:
    """Make the y axis one of errors, logarithmic, in per cent; the reference's own error is a grey band from below.

    Args:
        axes: the panel.
        quantity: key of the error norm.
        own: the reference's own error; None where it is not known.
        shown: the errors that are drawn.
        note: at the right above the panel.
    """
    axes.set_yscale("log")
    low, high = span([max(e, LEAST) for e in shown])
    low = min(low, own / 2 if own and own > low / 30 else low) / 1.5
    low, high = max(_BOTTOM, 10.0 ** math.floor(math.log10(low))), 10.0 ** math.ceil(math.log10(high * 1.5))
    axes.set_ylim(low, high)
    if own is not None and own > low:
        axes.axhspan(low, own, color=GREY, alpha=0.16, lw=0, zorder=0)
        axes.text(0.995, low * 1.05, "the reference's own error ", transform=axes.get_yaxis_transform(), ha="right",
                  va="bottom", size=10, color=GREY)  # fmt: skip
    axes.tick_params(axis="y", which="minor", length=0)
    axes.yaxis.set_major_locator(LogLocator(numticks=6))
    axes.yaxis.set_major_formatter(FuncFormatter(lambda y, _: f"{_decimal(100 * y)} %"))
    axes.yaxis.set_minor_formatter(NullFormatter())
    axes.grid(which="major", color="#e6e6e6", lw=0.8)
    axes.set_axisbelow(True)
    axes.set_title(f"error in {_name(quantity)}", loc="left", size=13)
    axes.set_title(note, loc="right", size=11.5, color=GREY)


def _name(quantity: str) -> str:
    return ERROR_NORMS[quantity].name.replace("_t", "ₜ").replace("_n", "ₙ").replace("-", "−")


def time_axis(axes: Axes) -> None:
    """The x axes of all panels of a page: times, logarithmic."""
    figure_axes = axes.get_figure().axes  # type: ignore[union-attr]
    for here in figure_axes:
        here.set_xscale("log")
        here.xaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0), numticks=12))
        here.xaxis.set_major_formatter(FuncFormatter(lambda x, _: seconds(x)))
        here.xaxis.set_minor_formatter(NullFormatter())


def plain_log(axes: Axes) -> None:
    """The x axis: numbers, logarithmic."""
    axes.set_xscale("log")
    axes.xaxis.set_major_formatter(FuncFormatter(lambda x, _: _decimal(x)))
    axes.xaxis.set_minor_formatter(NullFormatter())
    axes.tick_params(axis="x", which="minor", length=0)


def _decimal(value: float) -> str:
    """A number without a power of ten, however small, since those of one axis should look alike."""
    return np.format_float_positional(value, precision=3, fractional=False, trim="-")


def apart(axes: Axes, one: float, other: float) -> bool:
    """Whether two errors are so far apart on the axis that both can be named.

    Args:
        axes: the panel.
        one: an error.
        other: an error.
    """
    low, high = axes.get_ylim()
    inches = axes.bbox.height / axes.figure.dpi
    return abs(math.log(one / other)) / math.log(high / low) * inches > _LINE


def span(values: Sequence[float]) -> tuple[float, float]:
    """The least and the largest value that is not negligible."""
    known = [v for v in values if v > NEGLIGIBLE] or [LEAST]
    return min(known), max(known)
