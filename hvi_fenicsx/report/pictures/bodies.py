"""The pictures of a body: its scene, how it is deformed, the stress in it, and how it escapes."""

from __future__ import annotations

import re
import textwrap
from collections.abc import Iterator
from typing import Any

import numpy as np
from matplotlib.artist import Artist
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from ..body_mesh import BodyMesh
from ..reader import Result
from ..units import quantity, thousands, unit_for
from .canvas import Scale
from .plane import PlaneCanvas
from .regions import regions
from .registry import picture
from .shape import PartGeometry, deform, escaping, followed, part_geometries, undeformed
from .sides import borne_loads, held_sides, loaded_sides, roles_by_side, touches
from .style import BLUE, EMBER, GREY, INK, PALE, SLATE, VERMILION

PEAK = 0.005
"""Part of the body's volume whose stress may be beyond the end of a scale, which a peak in a corner would spoil."""
LINE = 40
"""Letters in one line beside the legend."""
_UNITS = {"displacement": ("m", "m"), "moment": ("N", "N\u202fm")}
"""The units of what drives a part as a whole, in the plane and in space."""
_MINUS = re.compile(r"(?<=[\s(])-(?=[\dxyz])")
"""A minus; other hyphens are of names."""


def _canvas(result: Result, subject: str, contacts: list[Any]) -> Any:
    """The canvas for a body; one in space is seen from where the contact parts with these facets are seen best."""
    if result.body.dimension == 2:
        return PlaneCanvas(result, subject)
    from .space import SpaceCanvas  # loads VTK

    normals = [result.body.mean_normal(facets) * float(result.body.sizes(facets).sum()) for facets in contacts]
    return SpaceCanvas(result, subject, normals)


@picture(
    "scene",
    caption="The scene: the undeformed body with its supports, loads and contact parts.",
    wanted=lambda result: bool(result.sides),
)
def scene(result: Result) -> Figure:
    """Draw the undeformed body, its parts by name."""
    rest, found, areas = undeformed(result.body), list(roles_by_side(result)), regions(result)
    contacts = [side for side, roles in found if touches(roles)]
    canvas = _canvas(result, "the scene", [side.facets for side in contacts])
    held = held_sides(result)
    canvas.show(rest, areas, "#eef2f5" if result.body.dimension == 2 else PALE)
    names = [side.part for side in contacts], [support.side.part for support in held]
    canvas.sides(rest, [side for side, _ in found], *names)
    canvas.supports(rest, held)
    canvas.loads(rest, loaded_sides(result))
    if len(areas) <= len(_UNITS) + 2:
        canvas.key(*(Patch(fc=area.tint, ec=INK, label=area.name or "no named region") for area in areas))
    canvas.key(*_inside(result))
    extent = " × ".join(quantity(float(c), "m") for c in result.body.extents[: result.body.dimension])
    extent += f" (drawn {rest.stretched})" if rest.stretched else ""
    cells = f"{thousands(len(result.body.cells))} {'triangles' if result.body.dimension == 2 else 'tetrahedra'}"
    canvas.remarks += [(extent, INK), (cells, GREY), ("blue: names of the parts", BLUE)]
    return canvas.finish()


def _inside(result: Result) -> Iterator[Artist]:
    """The legend's lines on what has no arrow: what acts everywhere, and moments and displacements of a part."""
    d = result.body.dimension
    parts = [f"“{part}”: {key} {_said(value, key, d)}" for part, key, value in result.driven if key != "force"]
    for words in [*parts, *(f"and {words}" for words in result.within)]:
        yield Line2D([], [], color="none", label=textwrap.fill(words, LINE))


def _said(value: Any, key: str, dimension: int) -> str:
    """A number with its unit, or those of a list in brackets; what is no number as it stands in the scene."""
    if isinstance(value, list):
        return f"({', '.join(_said(one, key, dimension) for one in value)})"
    unit = _UNITS.get(key, ("", ""))[dimension - 2]
    return quantity(float(value), unit) if isinstance(value, int | float) and unit else str(value)


@picture(
    "body",
    caption="The deformed body, its displacements magnified, with what acts on it.",
    wanted=lambda result: result.body.displacement is not None,
)
def body(result: Result) -> Figure:
    """Draw the deformed body in the colours of its displacement."""
    parts = part_geometries(result)
    shape, canvas = deform(result.body, parts), _canvas(result, "deformed body", [part.facets for part in parts])
    largest = float(shape.amount.max())
    unit = unit_for(largest, "m")
    words = f"displacement |u|, up to {unit.text(largest)}"
    canvas.scales.append(Scale(SLATE, 0.0, largest / unit.size, words, shape.scales))
    canvas.paint(shape, shape.amount, SLATE, largest)
    return _loaded(canvas, result, shape, parts, pressure=True)


@picture(
    "stress",
    caption="Stress in the body (von Mises), constant in each cell; the scale may end below a peak in a corner.",
    wanted=lambda result: result.body.von_mises is not None,
)
def stress(result: Result) -> Figure:
    """Draw the deformed body, each cell in the colour of its stress."""
    parts, values = part_geometries(result), result.body.von_mises
    assert values is not None
    shape, canvas = deform(result.body, parts), _canvas(result, "stress in the body", [part.facets for part in parts])
    end, largest = stress_end(result.body), float(values.max())
    unit = unit_for(end, "Pa")
    words = f"von Mises stress, {'peak' if end < largest else 'up to'} {unit.text(largest)}"
    canvas.scales.append(Scale(EMBER, 0.0, end / unit.size, words, shape.scales))
    canvas.paint(shape, values, EMBER, end, by_cell=True)
    return _loaded(canvas, result, shape, parts, pressure=False)


def _loaded(canvas: Any, result: Result, shape: Any, parts: list[PartGeometry], *, pressure: bool) -> Figure:
    """Add what acts on a deformed body."""
    canvas.supports(shape, held_sides(result))
    canvas.contacts(shape, parts, pressure=pressure)
    canvas.loads(shape, borne_loads(result))
    return canvas.finish()


def stress_end(body: BodyMesh) -> float:
    """Where the scale of the stress ends, N/m²: at the largest one, or where a share ``PEAK`` of the body has more."""
    values = body.von_mises
    assert values is not None
    order = np.argsort(values)
    share = np.cumsum(body.volumes[order]) / body.volumes.sum()
    end, largest = float(values[order][np.searchsorted(share, 1.0 - PEAK)]), float(values.max())
    return end if 0.0 < 1.25 * end < largest else largest


@picture(
    "escape",
    caption="The rigid motion along which the load carries the body away.",
    wanted=lambda result: result.body.escape_mode is not None,
)
def escape(result: Result) -> Figure:
    """Draw the body, its ghost moved along the motion, and the motion in words."""
    rest, canvas = undeformed(result.body), _canvas(result, "rigid motion", [])
    canvas.show(rest, [], PALE)
    canvas.supports(rest, held_sides(result))
    canvas.loads(rest, loaded_sides(result))
    mover = rest.as_drawn.moving()
    motion = escaping(mover)
    posts = followed(mover, motion)
    ways = np.stack([motion.at(posts, part) for part in np.linspace(0.0, 1.0, 25)], axis=1)
    canvas.ghost(mover, motion.at(mover.points), ways)
    words = f"the body at rest, {rest.stretched}" if rest.stretched else "the body at rest"
    ghost = Patch(fc="#fbe3d3", ec=VERMILION, ls="--", label="its ghost, on its way")
    canvas.key(Patch(fc=PALE, ec=INK, label=words), ghost)
    motion_words = _MINUS.sub("−", str(result.solvability.get("direction") or "a rigid motion"))
    canvas.remarks += [("The load moves the body by", GREY)]
    canvas.remarks += [(line, VERMILION) for line in textwrap.wrap(motion_words, 3 * LINE // 4)]
    return canvas.finish()
