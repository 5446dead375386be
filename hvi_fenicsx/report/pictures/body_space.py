"""``body.png`` of a body in space: deformed over its edges, |u| on it, contact pressure on its parts.

A part that looks away from the eye, as the underside does, is drawn a second time beside the body, moved along its
normal: its footprint.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import Colormap
from matplotlib.figure import Figure

from ...typing import Array
from ..reader import Result
from ..units import quantity, times, unit_for
from ..vtu import Body
from . import vtk_loads
from .body_plane import canvas
from .deformed import Deformed, Footing, deform, footings, largest_stress
from .legend import colour_bar
from .loads_supports import loads
from .style import GREY, INK, PALE, SLATE, heading, pressure_scale, save
from .vtk_view import View, area_vectors, best_view, creases, render, surface

if TYPE_CHECKING:
    import pyvista

FACING = 0.15
"""Cosine from which a part is drawn where it is."""
LEGIBLE = 5000
"""Facets up to which their edges are drawn."""


@dataclass(frozen=True)
class Patched:
    """A contact part as drawn: its facets at the points (n, 3), and -σ_n by vertex, NaN where it is lifted."""

    foot: Footing
    points: Array
    away: Array
    """How far it is moved, (3,); zero for one that is drawn where it is."""

    @property
    def pressure(self) -> Array:
        """-σ_n by vertex of the body, NaN where it is lifted and off the part."""
        values = np.full(len(self.points), np.nan)
        part = self.foot.part
        values[self.foot.vertices] = np.where(part.idle, np.nan, part.pressure)
        return values


def draw(path: Path, result: Result, body: Body) -> None:
    """Draw the body with its loads and contact parts."""
    parts, pulled = footings(result, body), loads(result, body)
    shape = deform(body, parts)
    normals = [area_vectors(body.points, foot.facets).sum(axis=0) for foot in parts]
    view = best_view(normals)
    shown = [placed(shape, view, foot, normal) for foot, normal in zip(parts, normals, strict=True)]
    arrows = [vtk_loads.arrows(shape, load) for load in pulled]
    reached = [shape.points, body.points, *(s.points[s.foot.vertices] for s in shown)]
    reached += [end for tails, ways in arrows for end in (tails, tails + ways)]
    everything = np.concatenate(reached)
    made, axes = canvas(view.project(everything))
    heading(made, result, "deformed body")
    scale = pressure_scale(_lowest(parts), largest_stress(parts))
    depths = (float(view.depth(everything).min()), float(view.depth(everything).max()))
    render(axes, view, depths, partial(_fill, shape=shape, shown=shown, arrows=arrows, scale=scale))
    vtk_loads.labels(axes, view, shape, pulled)
    for patch in shown:
        guides(axes, view, shape, patch)
    _foot(made, shape, shown, scale)
    save(made, path)


def placed(shape: Deformed, view: View, foot: Footing, normal: Array) -> Patched:
    """A part where it is if it is seen there, else so far out along its normal that the body does not hide it."""
    unit = np.asarray(normal / (float(np.linalg.norm(normal)) or 1.0), dtype=np.float64)
    if float(unit @ view.toward) > FACING:
        return Patched(foot, shape.points + 1e-3 * shape.body.size * view.toward, np.zeros(3))
    seen = view.project(unit[None])[0]
    across = seen / float(np.linalg.norm(seen))
    everything = view.project(np.concatenate([shape.points, shape.body.points])) @ across
    own = view.project(shape.points[foot.vertices]) @ across
    way = (everything.max() - own.min() + 0.05 * shape.body.size) / float(np.linalg.norm(seen)) * unit
    return Patched(foot, shape.points + way, way)


def _fill(
    plotter: pyvista.Plotter,
    *,
    shape: Deformed,
    shown: list[Patched],
    arrows: list[tuple[Array, Array]],
    scale: tuple[Colormap, float, float],
) -> None:
    facets = shape.body.boundary
    skin = surface(shape.points, facets)
    skin.point_data["amount"] = shape.amount[skin.point_data["vertex"]]
    plotter.add_mesh(
        skin,
        scalars="amount",
        cmap=SLATE,
        clim=(0.0, float(shape.amount.max()) or 1.0),
        show_edges=len(facets) <= LEGIBLE,
        edge_color="white",
        edge_opacity=0.4,
        line_width=1,
        ambient=0.6,
        diffuse=0.45,
        show_scalar_bar=False,
    )
    plotter.add_mesh(creases(shape.points, facets), color=INK, line_width=3)
    plotter.add_mesh(creases(shape.body.points, facets), color=GREY, line_width=2)
    for part in shown:
        _fill_part(plotter, part, scale)
    for tails, ways in arrows:
        vtk_loads.fill(plotter, tails, ways)


def _fill_part(plotter: pyvista.Plotter, part: Patched, scale: tuple[Colormap, float, float]) -> None:
    patch = surface(part.points, part.foot.facets)
    patch.point_data["pressure"] = part.pressure[patch.point_data["vertex"]]
    plotter.add_mesh(
        patch,
        scalars="pressure",
        cmap=scale[0],
        clim=scale[1:],
        nan_color=PALE,
        show_scalar_bar=False,
        lighting=False,
    )
    plotter.add_mesh(creases(part.points, part.foot.facets), color=INK, line_width=3)


def guides(axes: Axes, view: View, shape: Deformed, patch: Patched) -> None:
    """Thin lines from a part on the body to its footprint, at its outermost points."""
    if not patch.away.any():
        return
    start = view.project(shape.points[patch.foot.vertices])
    end = view.project(patch.points[patch.foot.vertices])
    across = np.array([-(end - start)[0, 1], (end - start)[0, 0]])
    for i in (int(np.argmin(start @ across)), int(np.argmax(start @ across))):
        axes.plot(*np.array([start[i], end[i]]).T, color=GREY, lw=1.1, ls=(0, (2, 3)), zorder=0.5)


def _lowest(parts: list[Footing]) -> float:
    return min((float(np.nanmin(foot.part.pressure)) for foot in parts), default=0.0)


def _foot(made: Figure, shape: Deformed, shown: list[Patched], scale: tuple[Colormap, float, float]) -> None:
    most = float(shape.amount.max())
    unit = unit_for(most, "m")
    words = f"displacement |u|, up to {unit.text(most)}"
    colour_bar(made, SLATE, (0.0, most / unit.size), words, times(shape.factor))
    if shown:
        colours, low, high = scale
        unit = unit_for(high, "Pa")
        words = f"contact pressure, up to {unit.text(high)}" if low == 0.0 else f"contact pressure in {unit.name}"
        colour_bar(made, colours, (low / unit.size, high / unit.size), words, _remark(shown), at=3.75)


def _remark(shown: list[Patched]) -> str:
    """Where the footprints are, and what grey means on them."""
    gaps = [float(np.max(s.foot.part["gap"][s.foot.part.idle])) for s in shown if s.foot.part.idle.any()]
    lifted = [f"grey: lifted, up to {quantity(max(gaps), 'm')}"] if gaps else []
    away = [s.foot.part.name for s in shown if s.away.any()]
    return lifted[0] if lifted else f"“{'”, “'.join(away)}” drawn apart" if away else ""
