"""How pictures look, and how they are saved: one width, one palette, one heading, large letters.

Colours are Okabe and Ito's, which colour-blind eyes can distinguish. A picture is 1200 pixels wide, and its letters are
sized to be read on a telephone, where it is shown at a third of that.
"""

from __future__ import annotations

import os
import textwrap
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.colors import LinearSegmentedColormap
from matplotlib.figure import Figure
from PIL import Image
from PIL.PngImagePlugin import PngInfo

from ...runtime import writing
from ..png_file import CAPTION
from ..reader import Result
from ..units import thousands
from .draw import UNFINISHED

WIDTH, DPI = 8.0, 150
"""In inches, and pixels per inch."""
INK, GREY, PALE = "#222222", "#6b6b6b", "#c9c9c9"
BLUE, GREEN, VERMILION, PURPLE, ORANGE = "#0072B2", "#009E73", "#D55E00", "#AA4499", "#E69F00"
HEADING = 0.95
"""Height of the heading, inches."""
_LINE = 50
"""Letters of a title in one line."""

matplotlib.rcParams.update(
    {
        "font.family": "DejaVu Sans",  # matplotlib's own; of a list it looks up each for every text
        "font.size": 13,
        "axes.edgecolor": GREY,
        "axes.labelcolor": INK,
        "axes.spines.top": False,
        "axes.spines.right": False,
        "xtick.color": GREY,
        "ytick.color": GREY,
        "text.color": INK,
        "text.parse_math": False,  # a title may hold a dollar
        "axes.unicode_minus": True,
        "lines.linewidth": 2.2,
        "lines.solid_capstyle": "round",
    }
)


def shades(dark: str, light: str = "#f4f4f1") -> LinearSegmentedColormap:
    """A muted scale of colours.

    Args:
        dark: its end.
        light: its beginning.
    """
    return LinearSegmentedColormap.from_list(dark, [light, dark])


SLATE = shades("#54799a", "#eef2f5")
"""For |u|: quiet, so that what acts on the boundary stands out."""
EMBER = LinearSegmentedColormap.from_list("ember", ["#f8f6ee", "#f2c46d", VERMILION, "#55170a"])
"""For the stress inside the body."""
_PRESSED = shades(VERMILION, "#fdf3ec")
_BOTH = LinearSegmentedColormap.from_list("both", [PURPLE, "#fdfaf7", VERMILION])


def pressure_scale(lowest: float, largest: float) -> tuple[LinearSegmentedColormap, float, float]:
    """Colours for -σ_n; there is tension only where something adheres.

    Args:
        lowest: of -σ_n, N/m².
        largest: of |σ_n|, N/m².

    Returns:
        The colours, and the values at their ends, N/m².
    """
    if lowest < -1e-6 * largest:
        return _BOTH, -largest, largest
    return _PRESSED, 0.0, largest


def figure(height: float) -> Figure:
    """An empty picture of the common width, its height in inches."""
    fig = Figure(figsize=(WIDTH, height), dpi=DPI, facecolor="white")
    FigureCanvasAgg(fig)
    return fig


def area(fig: Figure, left: float, bottom: float, width: float, height: float, **keys: Any) -> Axes:
    """Axes at a place given in inches.

    Args:
        fig: the picture.
        left: of the axes.
        bottom: of the axes.
        width: of the axes.
        height: of the axes.
        keys: of matplotlib's ``add_axes``.
    """
    tall = fig.get_figheight()
    return fig.add_axes((left / WIDTH, bottom / tall, width / WIDTH, height / tall), **keys)


def heading(fig: Figure, result: Result, subject: str) -> None:
    """Write the scene's title; below it what is shown, how large the problem was, its state, and its certificate.

    Args:
        fig: the picture.
        result: the result.
        subject: what is shown.
    """
    titled(fig, result.title, f"{subject} · {_facts(result)}", *_verdict(result))


def titled(fig: Figure, title: str, below: str, words: str = "", colour: str = INK) -> None:
    """Write a title in bold.

    Args:
        fig: the picture.
        title: the title.
        below: on the line below it.
        words: at the right of that line.
        colour: of these words.
    """
    tall = fig.get_figheight()
    title = textwrap.shorten(title, 2 * _LINE, placeholder=" …")
    lines = textwrap.wrap(title, _LINE) if len(title) > _LINE else [title]
    size, top, second = (17, 0.19, 0.76) if len(lines) == 1 else (13.5, 0.12, 0.85)
    fig.text(0.3 / WIDTH, 1 - top / tall, "\n".join(lines), size=size, weight="bold", va="top", linespacing=1.1)
    at = 1 - second / tall
    left = fig.text(0.3 / WIDTH, at, below, size=12, color=GREY, va="baseline")
    right = fig.text(1 - 0.3 / WIDTH, at, words, size=12, weight="bold", color=colour, ha="right", va="baseline")
    wide, other = (text.get_window_extent().width / fig.dpi for text in (left, right))
    left.set_fontsize(min(12.0, 12.0 * (WIDTH - 0.8 - other) / wide))  # it is never written into what is at its right


def _facts(result: Result) -> str:
    summary = result.summary
    facts = [f"{thousands(int(summary['dofs']))} unknowns"] if summary.get("dofs") else []
    facts += [f"state: {result.solvability['state']}"] if result.solvability.get("state") else []
    facts += [f"smoothing: {summary['smoothing']}"] if summary.get("smoothing") and result.solved else []
    return " · ".join(facts)


def _verdict(result: Result) -> tuple[str, str]:
    if result.certified:
        return "✓ certified", GREEN
    if not result.solved:
        return "✗ no solution exists", VERMILION
    if (last := result.last_borne) is not None:
        return f"✗ borne up to factor {last['factor']:.4g}", VERMILION
    return "✗ NOT certified", VERMILION


@contextmanager
def unfinished(path: Path) -> Iterator[Path]:
    """A name to write to; renamed to ``path`` when all went well, else removed."""
    aside = path.with_name(f".{path.stem}.{os.getpid()}{UNFINISHED}")
    with writing.told(path):
        try:
            yield aside
            os.replace(aside, path)
        finally:
            aside.unlink(missing_ok=True)


def save(fig: Figure, path: Path, caption: str = "") -> None:
    """Write a picture, whole or not at all; without an alpha channel, which nothing needs, it is a quarter smaller.

    More compression takes half as long again for a tenth of the size.

    Args:
        fig: the picture.
        path: its file.
        caption: what a reader should see under it; it is kept in the file.

    Raises:
        NotWrittenError: it cannot be written.
    """
    canvas = FigureCanvasAgg(fig)
    canvas.draw()
    image = Image.fromarray(np.asarray(canvas.buffer_rgba())).convert("RGB")
    words = PngInfo()
    if caption:
        words.add_itxt(CAPTION, caption)
    with unfinished(path) as aside:
        image.save(aside, dpi=(DPI, DPI), compress_level=4, pnginfo=words)
