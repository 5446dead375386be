"""``contact.png`` in space: slip, -σ_t and contact pressure over a part laid flat."""

from __future__ import annotations

import textwrap
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import Colormap
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator
from matplotlib.tri import Triangulation

from ....typing import Array
from ...contact_part import ContactPart
from ...reader import Result
from ...units import Unit, quantity, unit_for
from ..deformed import part_geometries
from ..flat_parts import FlatPart, laid_flat
from ..legend import STEPS, ticks
from ..map_layout import MapLayout, layout
from ..raster import shade
from ..registry import picture
from ..style import BLUE, GREEN, GREY, HEADING, INK, WIDTH, area, figure, heading, pressure_scale, shades

ROOMY = 0.55
"""Part of the width at which a map ends that leaves room for words beside it."""
ARROWS, SHAFT = 13, 0.016
"""Along the longer side of a map, and how wide they are, inches."""


@picture("contact", dimension=3, of_part=True, caption="Along {part}: displacement, friction and pressure.")
def draw(result: Result, part: ContactPart) -> Figure:
    """Draw the three maps of a part.

    Args:
        result: the result.
        part: the part of Γc, in space.
    """
    geometry = next(geometry for geometry in part_geometries(result) if geometry.part.name == part.name)
    flat = laid_flat(geometry, result.body)
    rows: list[tuple[str, str, Array, Array | None, Colormap | None]] = [
        ("slip", "m", part.size("slip"), _vectors(part, flat, "slip"), shades(BLUE))
    ]
    if result.resists(part.name, "slip", "separation"):
        rows.append(("friction", "Pa", part.size("friction"), _vectors(part, flat, "friction"), shades(GREEN)))
    rows.append(("contact pressure", "Pa", part.pressure, None, None))
    places = layout(flat.ends[1] - flat.ends[0], len(rows))
    fig = figure(places.tall)
    heading(fig, result, f"on “{part.name}”")
    for i, (words, name, values, arrows, colours) in enumerate(rows):
        axes = area(fig, *places.corner(i), places.width, places.height)
        unit = unit_for(float(np.nanmax(np.abs(values), initial=0.0)), name)
        _map(fig, axes, flat, np.asarray(values / unit.size)[flat.rows], colours, _symbol(words, unit))
        _grey_where_lifted(axes, flat, part)
        if arrows is not None:
            _arrows(axes, flat, arrows)
        _frame(axes, flat, leftmost=places.leftmost(i), lowest=places.lowest(i))
    _notes(fig, part, flat, places)
    fig.text(1 - 0.3 / WIDTH, 0.25 / fig.get_figheight(), flat.how, size=12, color=GREY, ha="right")
    return fig


def _vectors(part: ContactPart, flat: FlatPart, quantity: str) -> Array:
    """A tangential field of the table along the map's coordinates.

    Args:
        part: the part of Γc.
        flat: the part laid flat.
        quantity: "slip" or "friction".
    """
    return flat.along(np.nan_to_num(part.vectors(quantity)))


def _symbol(words: str, unit: Unit) -> str:
    symbols = {"slip": "$|u_t|$", "friction": "$|\\sigma_t|$", "contact pressure": "$-\\sigma_n$"}
    return f"{words} {symbols[words]} in {unit.name}"


def _map(fig: Figure, axes: Axes, flat: FlatPart, values: Array, colours: Colormap | None, words: str) -> None:
    """Values as an image of the picture's own pixels, with a bar beside it, from zero; without colours, a pressure."""
    low, high = float(np.nanmin(values)), float(np.nanmax(np.abs(values)))
    scale = pressure_scale(low, high) if colours is None else (colours, 0.0, high)
    drawn = axes.imshow(
        _image(axes, flat, values),
        cmap=scale[0],
        vmin=scale[1],
        vmax=scale[2] or 1.0,
        origin="lower",
        aspect="auto",
        extent=_extent(flat),
    )
    box = axes.get_position()
    bar = fig.add_axes((box.x1 + 0.02, box.y0, 0.02, box.height))
    fig.colorbar(drawn, cax=bar)
    bar.yaxis.set_major_locator(ticks(scale[1:], _intervals(axes)))
    bar.spines[:].set_visible(False)
    axes.set_title(words, loc="left", size=14, parse_math=True)


def _extent(flat: FlatPart) -> tuple[float, float, float, float]:
    (left, bottom), (right, top) = flat.ends
    return float(left), float(right), float(bottom), float(top)


def _image(axes: Axes, flat: FlatPart, values: Array) -> Array:
    box = axes.get_window_extent()
    wide, tall = round(box.width), round(box.height)
    left, right, bottom, top = _extent(flat)
    scale = np.array([wide / (right - left), tall / ((top - bottom) or 1.0)])
    corners = np.nan_to_num(values)[flat.triangles]
    return shade((flat.points - [left, bottom]) * scale, flat.triangles, corners, (tall, wide))


def _grey_where_lifted(axes: Axes, flat: FlatPart, part: ContactPart) -> None:
    if part.idle.any():
        image = _image(axes, flat, part.idle[flat.rows].astype(float))
        veil = np.zeros((*image.shape, 4))
        veil[...] = (0.55, 0.55, 0.55, 0.0)
        veil[..., 3] = np.where(image > 0.5, 0.45, 0.0)
        axes.imshow(veil, origin="lower", aspect="auto", extent=_extent(flat))


def _arrows(axes: Axes, flat: FlatPart, vectors: Array) -> None:
    """A field along the part at the nodes of a coarse grid, whatever the mesh."""
    low, extent = flat.ends[0], flat.ends[1] - flat.ends[0]
    spacing = float(np.max(extent)) / ARROWS
    count = np.maximum(np.round(extent / spacing), 1).astype(int)
    pixels = (flat.points - low) / np.where(extent > 0.0, extent, 1.0) * count
    shape = (int(count[1]), int(count[0]))
    ways = np.stack([shade(pixels, flat.triangles, component[flat.triangles], shape) for component in vectors.T])
    ways *= 0.9 * spacing / (float(np.linalg.norm(vectors, axis=1).max()) or 1.0)
    ways[:, np.linalg.norm(ways, axis=0) < 0.05 * spacing] = np.nan
    x, y = (low[i] + (np.arange(count[i]) + 0.5) * extent[i] / count[i] for i in (0, 1))
    style: dict[str, Any] = {"angles": "xy", "scale_units": "xy", "scale": 1.0, "pivot": "mid"}
    axes.quiver(*np.meshgrid(x, y), *ways, **style, units="inches", width=SHAFT, color=INK, alpha=0.85)


def _frame(axes: Axes, flat: FlatPart, *, leftmost: bool, lowest: bool) -> None:
    left, right, bottom, top = _extent(flat)
    axes.set_xlim(left, right)
    axes.set_ylim(bottom, top)
    axes.spines[:].set_visible(False)
    unit = unit_for(max(map(abs, (left, right, bottom, top))), "m")
    for axis, intervals in ((axes.xaxis, _across(axes)), (axes.yaxis, _intervals(axes))):
        axis.set_major_locator(MaxNLocator(intervals, steps=STEPS))
        axis.set_major_formatter(lambda value, _: f"{value / unit.size:.4g}".replace("-", "−"))
    axes.tick_params(labelleft=leftmost, left=leftmost, labelbottom=lowest, bottom=lowest)
    if leftmost:
        axes.set_ylabel(f"{flat.names[1]} in {unit.name}")
    if lowest:
        axes.set_xlabel(f"{flat.names[0]} in {unit.name}")


def _intervals(axes: Axes) -> int:
    """Between the ticks of a map's height, so many that their numbers stand apart."""
    return max(1, min(4, int(axes.get_window_extent().height / axes.figure.dpi / 0.5)))


def _across(axes: Axes) -> int:
    """The same of its width."""
    return max(1, min(6, int(axes.get_window_extent().width / axes.figure.dpi / 0.7)))


def _notes(fig: Figure, part: ContactPart, flat: FlatPart, places: MapLayout) -> None:
    """Where the law drops, as a line on the map of the slip, and what grey means; both said there."""
    axes, said = fig.axes[0], list[str]()  # the map of the slip
    for drop in part.drops.T[part.drops[0] > 0.0]:
        slip, constant = part.size("slip") / drop, np.ptp(drop) == 0.0
        at = f"at {quantity(float(drop[0]), 'm')}" if constant else "at lengths that change"
        if np.nanmin(slip) < 1.0 < np.nanmax(slip):
            triangles = Triangulation(flat.points[:, 0], flat.points[:, 1], flat.triangles)
            axes.tricontour(triangles, slip[flat.rows], [1.0], colors=INK, linestyles="--")
            said.append(f"dashed: the law drops {at}")
        else:
            said.append(f"the law drops {at}, not reached")
    if part.idle.any():
        said.append(f"grey: lifted, up to {quantity(part.largest_gap, 'm')}")
    _say(fig, axes, said[-2:], places.columns)


def _say(fig: Figure, axes: Axes, said: list[str], columns: int) -> None:
    """Below the heading of two columns; of one beside the map and its bar if there is room, else above it."""
    box, tall = axes.get_position(), fig.get_figheight()
    style: dict[str, Any] = {"size": 12, "color": GREY}
    if columns == 1 and box.x1 < ROOMY:
        lines = [line for words in said for line in textwrap.wrap(words, 24)]
        fig.text(box.x1 + 0.13, box.y1, "\n".join(lines), va="top", linespacing=1.4, **style)
    else:
        above = box.y1 + 0.007 if columns == 1 else 1 - (HEADING + 0.15) / tall
        fig.text(1 - 0.3 / WIDTH, above, "; ".join(said), ha="right", va="bottom", **style)
