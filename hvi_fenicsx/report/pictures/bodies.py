"""The pictures of a body: its scene, how it is deformed, the stress in it, and how it escapes."""

from __future__ import annotations

import textwrap
from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING

import numpy as np
from matplotlib.colors import Colormap
from matplotlib.figure import Figure
from matplotlib.patches import Patch

from ...typing import Array, Integers
from ..body_mesh import BodyMesh
from ..page import said
from ..reader import Result
from ..units import quantity, thousands, unit_for
from .plane import PlaneCanvas
from .shape import (
    TINTS,
    deform,
    escaping,
    held_sides,
    loaded_sides,
    part_geometries,
    regions,
    roles_by_side,
    touches,
    undeformed,
)
from .style import BLUE, EMBER, GREY, INK, SLATE, VERMILION

if TYPE_CHECKING:
    from .space import SpaceCanvas

PEAK = 0.005
"""Part of the body's volume whose stress may be beyond the end of a scale, which a peak in a corner would spoil."""
LINE = 40
"""Letters in one line of the legend."""
MOST_NAMED = 4
"""Lines of the legend that regions may take."""


def _canvas(result: Result, subject: str, contacts: Mapping[str, Integers]) -> PlaneCanvas | SpaceCanvas:
    """The canvas for a body; one in space is seen from where its contact parts (facets by name) are seen best."""
    if result.body.dimension == 2:
        return PlaneCanvas(result, subject)
    from .space import SpaceCanvas  # loads VTK

    outer = [facets for name, facets in contacts.items() if not result.between_bodies(name)]
    return SpaceCanvas(result, subject, [result.body.area_vectors(facets).sum(axis=0) for facets in outer])


def scene(result: Result) -> Figure:
    """Draw the undeformed body, its parts by name."""
    rest, found, areas = undeformed(result.body), list(roles_by_side(result)), regions(result)
    contacts, held = [side for side, roles in found if touches(roles)], held_sides(result)
    canvas = _canvas(result, "the scene", {side.part: side.facets for side in contacts})
    canvas.show(rest, areas)
    parts = [side.part for side in contacts]
    canvas.sides(rest, [side for side, _ in found], parts, [support.side.part for support in held])
    canvas.supports(rest, held)
    canvas.loads(rest, loaded_sides(result))
    if len(areas) <= MOST_NAMED:
        canvas.key(*(Patch(fc=area.tint, ec=INK, label=area.name) for area in areas))
    for words in _inside(result):
        canvas.remark(textwrap.fill(words, LINE))
    extent = " × ".join(quantity(float(c), "m") for c in result.body.extents[: result.body.dimension])
    cells = f"{thousands(len(result.body.cells))} {'triangles' if result.body.dimension == 2 else 'tetrahedra'}"
    canvas.remark(extent + (f" (drawn {rest.stretched})" if rest.stretched else ""))
    canvas.remark(cells, GREY)
    canvas.remark("blue: names of the parts", BLUE)
    return canvas.finish()


def _inside(result: Result) -> Iterator[str]:
    """What has no arrow: what acts everywhere, and moments and displacements of a part."""
    units = {"displacement": "m", "moment": "N" if result.body.dimension == 2 else "N\u202fm"}
    for part, key, value in result.driven:
        if key != "force":
            yield f"“{part}”: {key} {said(value)} {units.get(key, '')}".rstrip()
    yield from (f"and {words}" for words in result.within)


def body(result: Result) -> Figure:
    """Draw the deformed body in the colours of its displacement."""
    u = result.body.displacement
    assert u is not None
    amount = np.linalg.norm(np.nan_to_num(u), axis=1)
    return _painted(result, "deformed body", amount, SLATE, float(amount.max()), "displacement |u|, up to", "m")


def stress(result: Result) -> Figure:
    """Draw the deformed body, each cell in the colour of its stress."""
    values, end = result.body.von_mises, stress_end(result.body)
    assert values is not None
    words = f"von Mises stress, {'peak' if end < values.max() else 'up to'}"
    return _painted(result, "stress in the body", values, EMBER, end, words, "Pa", by_cell=True)


def _painted(
    result: Result, subject: str, values: Array, colours: Colormap, end: float, words: str, unit_name: str,
    *, by_cell: bool = False,
) -> Figure:  # fmt: skip
    """The deformed body in the colours of values, with what acts on it in equilibrium: all loads, or what is borne."""
    parts, unit = part_geometries(result), unit_for(end, unit_name)
    shape = deform(result.body, parts)
    canvas = _canvas(result, subject, {geometry.part.name: geometry.facets for geometry in parts})
    canvas.paint(shape, values, colours, end, by_cell=by_cell)
    canvas.bar(colours, 0.0, end / unit.size, f"{words} {unit.text(float(values.max()))}; {shape.scales}")
    canvas.supports(shape, held_sides(result))
    canvas.contacts(shape, parts if result.body.dimension == 2 or not by_cell else [])
    canvas.loads(shape, loaded_sides(result, 1.0 if result.last_borne is None else float(result.last_borne["factor"])))
    return canvas.finish()


def stress_end(body: BodyMesh) -> float:
    """Where the scale of the stress ends, N/m²: at the largest one, or where a share ``PEAK`` of the body has more."""
    values = body.von_mises
    assert values is not None
    end = float(np.quantile(values, 1.0 - PEAK, weights=body.volumes, method="inverted_cdf"))
    largest = float(values.max())
    return end if 0.0 < 1.25 * end < largest else largest


def escape(result: Result) -> Figure:
    """Draw the body, its ghost moved along the motion, and the motion in words."""
    rest, canvas = undeformed(result.body), _canvas(result, "rigid motion", {})
    canvas.show(rest, [])
    canvas.supports(rest, held_sides(result))
    canvas.loads(rest, loaded_sides(result))
    mover = rest.as_drawn.moving()
    canvas.ghost(mover, *escaping(mover))
    words = f"the body at rest, {rest.stretched}" if rest.stretched else "the body at rest"
    ghost = Patch(fc="#fbe3d3", ec=VERMILION, ls="--", label="its ghost, on its way")
    canvas.key(Patch(fc=TINTS[0], ec=INK, label=words), ghost)
    motion_words = str(result.solvability.get("direction") or "a rigid motion").replace(" -", " −")
    canvas.remark(textwrap.fill(f"The load moves the body by {motion_words}", LINE), VERMILION)
    return canvas.finish()
