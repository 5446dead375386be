"""How pictures look, and how they are saved: one width, one palette, one heading, large letters.

Colours are Okabe and Ito's, which colour-blind eyes can distinguish. A picture is 1200 pixels wide, and its letters are
sized to be read on a telephone, where it is shown at a third of that. Below the heading matplotlib lays out.
"""

from __future__ import annotations

import textwrap
from pathlib import Path
from typing import Any, Literal

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.collections import TriMesh
from matplotlib.colors import LinearSegmentedColormap
from matplotlib.figure import Figure
from matplotlib.tri import Triangulation
from PIL import Image
from PIL.PngImagePlugin import PngInfo

from ...runtime import writing
from ...typing import Array
from ..page import CAPTION
from ..reader import Result
from ..solution_arrays import NOTHING
from ..units import thousands

WIDTH, DPI, HEADING = 8.0, 150, 0.95
"""Width and height of the heading in inches, and pixels per inch."""
INK, GREY, PALE = "#222222", "#6b6b6b", "#c9c9c9"
BLUE, GREEN, VERMILION, PURPLE, ORANGE = "#0072B2", "#009E73", "#D55E00", "#AA4499", "#E69F00"
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
        "axes.formatter.useoffset": False,
        "lines.linewidth": 2.2,
        "lines.solid_capstyle": "round",
        "legend.frameon": False,
        "legend.fontsize": 11.5,
        "legend.labelspacing": 0.3,
    }
)


def shades(*colours: str) -> LinearSegmentedColormap:
    """A muted scale of colours, from its lowest value on."""
    return LinearSegmentedColormap.from_list("".join(colours), list(colours))


SLATE = shades("#eef2f5", "#54799a")
"""For |u|: quiet, so that what acts on the boundary stands out."""
EMBER = shades("#f8f6ee", "#f2c46d", VERMILION, "#55170a")
"""For the stress inside the body."""


def pressure_scale(lowest: float, largest: float) -> tuple[LinearSegmentedColormap, float, float]:
    """Colours for -σ_n; there is tension only where something adheres.

    Args:
        lowest: of -σ_n, N/m².
        largest: of |σ_n|, N/m².

    Returns:
        The colours, and the values at their ends, N/m².
    """
    if lowest < -NOTHING * largest:
        return shades(PURPLE, "#fdfaf7", VERMILION), -largest, largest
    return shades("#fdf3ec", VERMILION), 0.0, largest


def figure(height: float) -> Figure:
    """An empty picture of the common width, with room for its heading above a height in inches."""
    fig = Figure(figsize=(WIDTH, HEADING + height), dpi=DPI, facecolor="white", layout="constrained")
    FigureCanvasAgg(fig)
    resize(fig, height)
    return fig


def resize(fig: Figure, height: float) -> None:
    """Give a picture another height below its heading.

    Args:
        fig: the picture.
        height: inches.
    """
    fig.set_figheight(HEADING + height)
    engine = fig.get_layout_engine()
    assert engine is not None
    engine.set(rect=(0.01, 0.0, 0.98, height / (HEADING + height)), w_pad=0.1, h_pad=0.08)  # type: ignore[call-arg]


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
    lines = textwrap.wrap(textwrap.shorten(title, 2 * _LINE, placeholder=" …"), _LINE)
    size, top, second = (17, 0.19, 0.76) if len(lines) == 1 else (13.5, 0.12, 0.85)
    left, right, at = 0.3 / WIDTH, 1 - 0.3 / WIDTH, 1 - second / tall
    fig.text(left, 1 - top / tall, "\n".join(lines), size=size, weight="bold", va="top", linespacing=1.1)
    grey = fig.text(left, at, below, size=12, color=GREY)
    bold = fig.text(right, at, words, size=12, weight="bold", color=colour, ha="right")
    wide, other = (text.get_window_extent().width / fig.dpi for text in (grey, bold))
    grey.set_fontsize(min(12.0, 12.0 * (WIDTH - 0.8 - other) / wide))  # it is never written into what is at its right


def fill(axes: Axes, mesh: Triangulation, values: Array, ends: tuple[float, float], **look: Any) -> TriMesh:
    """Fill triangles in the colours of values at their corners: matplotlib's quickest way, without a path for each.

    Args:
        axes: where to.
        mesh: the triangles.
        values: at its points, (n,).
        ends: the values at the ends of the colours.
        look: as for matplotlib's collections.
    """
    filled = TriMesh(mesh, array=values, clim=ends, **look)
    axes.add_collection(filled, autolim=False)  # matplotlib's own limits are those of the paths
    axes.update_datalim([(end(mesh.x), end(mesh.y)) for end in (np.min, np.max)])
    axes.autoscale_view()
    return filled


def few_ticks(axes: Axes, axis: Literal["x", "y"], most: int = 4) -> None:
    """Number an axis at a few round values.

    Args:
        axes: the panel.
        axis: "x" or "y".
        most: so many numbers, about.
    """
    axes.locator_params(axis=axis, nbins=most, steps=[1, 2, 2.5, 5, 10])


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


def save(fig: Figure, path: Path, caption: str = "") -> None:
    """Write a picture, whole or not at all; without an alpha channel, which nothing needs, it is a quarter smaller.

    Args:
        fig: the picture.
        path: its file.
        caption: what a reader should see under it; it is kept in the file.

    Raises:
        NotWrittenError: it cannot be written.
    """
    canvas = FigureCanvasAgg(fig)
    canvas.draw()
    image, words = Image.fromarray(np.asarray(canvas.buffer_rgba())).convert("RGB"), PngInfo()
    if caption:
        words.add_itxt(CAPTION, caption)
    with writing.whole(path) as aside:  # more compression takes half as long again for a tenth of the size
        image.save(aside, "PNG", dpi=(DPI, DPI), compress_level=4, pnginfo=words)
