"""``contact.png``: slip, -σ_t and contact pressure of a part, as curves along it or as maps of it laid flat."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Patch
from matplotlib.tri import Triangulation

from ...typing import Array, Integers, Mask, magnitude
from ..body_mesh import BodyMesh
from ..reader import Result
from ..solution_arrays import ContactPart
from ..units import Unit, quantity, unit_for
from .shape import PartGeometry, part_geometries, sparse
from .style import (
    BLUE,
    GREEN,
    GREY,
    INK,
    ORANGE,
    VERMILION,
    WIDTH,
    few_ticks,
    figure,
    fill,
    heading,
    pressure_scale,
    shades,
)

MARKED = 80
"""Vertices up to which each is marked."""
ARROWS = 13
"""Along the longer side of a map."""


@dataclass(frozen=True)
class Field:
    """What is drawn of a part.

    Attributes:
        kind: "slip", "friction", "opening", "penetration" or "pressure".
        words: what it is, with its symbol.
        values: by vertex, (m,).
        name: of its unit.
        colour: of the curve or the map.
    """

    kind: str
    words: str
    values: Array
    name: str
    colour: str

    @property
    def unit(self) -> Unit:
        """Its unit, with the prefix that suits it."""
        return unit_for(magnitude(np.nan_to_num(self.values)), self.name)


def _fields(result: Result, part: ContactPart) -> Iterator[Field]:
    """From the top: slip and friction, what a normal law acts on, the pressure; a law that it lacks has no field."""
    flat = result.body.dimension == 2
    yield Field("slip", "slip $u_t$" if flat else "slip $|u_t|$", part.size("slip"), "m", BLUE)
    if result.resists(part.name, "slip", "separation"):
        words = "friction $-\\sigma_t$" if flat else "friction $|\\sigma_t|$"
        yield Field("friction", words, part.size("friction"), "Pa", GREEN)
    if flat and result.resists(part.name, "opening", "separation"):
        yield Field("opening", "opening $-u_n$", -part["u_n"], "m", BLUE)
    if flat and result.resists(part.name, "penetration"):
        yield Field("penetration", "penetration $u_n$", part["u_n"], "m", BLUE)
    yield Field("pressure", "contact pressure $-\\sigma_n$", part.pressure, "Pa", VERMILION)


def contact(result: Result, part: ContactPart) -> Figure:
    """Draw what happens on a part of Γc.

    Args:
        result: the result.
        part: its part.
    """
    return _curves(result, part) if result.body.dimension == 2 else _maps(result, part)


def _curves(result: Result, whole: ContactPart) -> Figure:
    """A panel for each field over the length along the part."""
    signs = _signs(whole)
    own = {name: signs * whole[name] for name in ("u_t1", "friction_t1")}
    part = replace(whole, columns={**whole.columns, **own}, drops=signs[:, None] * whole.drops)
    along = " along s" if np.any(signs != signs[0]) else ""
    fields, length = list(_fields(result, part)), unit_for(float(np.max(part["s"])), "m")
    fig = figure(2.4 * len(fields) + 0.4)
    heading(fig, result, f"on “{part.name}”")
    panels = fig.subplots(len(fields), 1, sharex=True, squeeze=False)[:, 0]
    for axes, field in zip(panels, fields, strict=True):
        _panel(axes, part, field, length)
        words = f"{field.words}{along if field.kind in ('slip', 'friction') else ''} in {field.unit.name}"
        axes.set_title(words, loc="left", size=14, parse_math=True)
    panels[-1].set_xlabel(f"s along “{part.name}” in {length.name}")
    panels[-1].set_xlim(*_worth_seeing(part) / length.size)
    if part.lifted.any():
        key = Patch(fc=ORANGE, alpha=0.3, label=f"lifted, up to {quantity(whole.largest_gap, 'm')}")
        fig.legend(handles=[key], loc="outside lower right")
    return fig


def _signs(part: ContactPart) -> Array:
    """-1 where the tangent looks against growing s, as it does on a curved part beyond 45°, else 1, (m,)."""
    along = np.gradient(part.points[:, :2], axis=0) if len(part) > 1 else np.zeros((1, 2))
    return np.where(np.sum(part.tangents[:, 0] * along, axis=1) < 0.0, -1.0, 1.0)


def _worth_seeing(part: ContactPart) -> Array:
    """From where to where: if it is closed on a fifth of it only, that stretch and its neighbourhood."""
    s, closed = part["s"], part["s"][part.active]
    room = np.ptp(closed) if len(closed) > 1 else np.inf
    return s[[0, -1]] if 5 * room > np.ptp(s) else np.clip(closed[[0, -1]] + [-room, room], s[0], s[-1])


def _panel(axes: Axes, part: ContactPart, field: Field, length: Unit) -> None:
    """A curve, with what the laws say of it."""
    s, values = part["s"] / length.size, field.values / field.unit.size
    axes.plot(s, values, color=field.colour, marker="o" if len(s) <= MARKED else "", ms=3.6)
    if field.kind == "slip" and part.drops.size:
        seen = axes.dataLim.frozen()
        axes.plot(s, part.drops / field.unit.size, color=INK, ls=(0, (4, 3)), lw=1.4, zorder=4)
        axes.dataLim.set(seen)  # where no slip reaches a drop, it is out of sight
        axes.set_title(_drops_in_words(part.drops), loc="right", size=11.5, color=GREY)
    elif field.kind == "pressure":
        axes.fill_between(s, values, color=field.colour, alpha=0.15, lw=0)
    everywhere = axes.get_xaxis_transform()
    axes.fill_between(s, 0.0, 1.0, where=list(part.lifted), transform=everywhere, color=ORANGE, alpha=0.16, lw=0)
    axes.axhline(0.0, color=GREY, lw=0.8, zorder=1)  # zero is always in sight
    axes.margins(0.015, 0.06)
    few_ticks(axes, "y")
    axes.grid(axis="y", color="#e6e6e6", lw=0.8)
    axes.set_axisbelow(True)


def _maps(result: Result, part: ContactPart) -> Figure:
    """A map of each field, one below the other, of the part laid flat."""
    geometry = next(geometry for geometry in part_geometries(result) if geometry.part.name == part.name)
    flat, fields = laid_flat(geometry, result.body), list(_fields(result, part))
    wide, tall = (float(side) for side in np.maximum(np.ptp(flat.points, axis=0), 1e-12))
    height = float(np.clip((WIDTH - 2) * tall / wide, 0.8, 8.5 / len(fields)))
    fig = figure(len(fields) * (height + 0.9) + 0.4)
    heading(fig, result, f"on “{part.name}”")
    panels = fig.subplots(len(fields), 1, sharex=True, sharey=True, squeeze=False)[:, 0]
    for axes, field in zip(panels, fields, strict=True):
        _map(fig, axes, flat, part, field)
        axes.set_ylabel(f"{flat.names[1]} in {flat.unit.name}")
    panels[-1].set_xlabel(f"{flat.names[0]} in {flat.unit.name}")
    said = [*_drop_lines(panels[0], flat, part)]
    said += [f"grey: lifted, up to {quantity(part.largest_gap, 'm')}"] if part.idle.any() else []
    said += [flat.how] if flat.how else []
    fig.supxlabel("; ".join(said), size=12, color=GREY)
    return fig


def _map(fig: Figure, axes: Axes, flat: FlatPart, part: ContactPart, field: Field) -> None:
    """Values as colours, with a bar beside it, from zero; a field along the part as arrows too."""
    values = np.nan_to_num(field.values / field.unit.size)
    largest = magnitude(values)
    colours, low, high = pressure_scale(float(values.min()), largest)
    if field.kind != "pressure":
        colours, low = shades("#f4f4f1", field.colour), 0.0
    mesh, idle = flat.mesh, part.idle[flat.facets].all(axis=1)
    drawn = fill(axes, mesh, values, (low, high or 1.0), cmap=colours)
    if idle.any():
        grey = Triangulation(mesh.x, mesh.y, flat.facets[idle])
        # seams would be seen through colours that are blended at corners
        axes.tripcolor(grey, np.zeros(len(values)), cmap="gray", vmin=-1, vmax=1, alpha=0.45, antialiased=False)
    bar = fig.colorbar(drawn, ax=axes, ticks=None if largest > 0.0 else [0.0], aspect=12)
    bar.outline.set_visible(False)  # type: ignore[operator]
    axes.set_title(f"{field.words} in {field.unit.name}", loc="left", size=14, parse_math=True)
    if field.kind != "pressure":
        _arrows(axes, flat, np.einsum("md,mwd->mw", np.nan_to_num(part.vectors(field.kind)), flat.ways))
    axes.spines[:].set_visible(False)
    axes.set_aspect("equal")
    wide, tall = np.ptp(flat.points, axis=0)
    few_ticks(axes, "x", 4 if wide > tall / 2 else 1)
    few_ticks(axes, "y")


def _arrows(axes: Axes, flat: FlatPart, vectors: Array) -> None:
    """Vectors at the vertices nearest to the nodes of a coarse grid, whatever the mesh."""
    spacing, unit = float(np.max(np.ptp(flat.points, axis=0))) / ARROWS, flat.unit.size
    shown = sparse(flat.points, spacing)
    ways = vectors[shown] * 0.9 * spacing / (magnitude(np.linalg.norm(vectors, axis=1)) or 1.0)
    axes.quiver(
        *flat.points[shown].T / unit, *ways.T / unit, angles="xy", scale_units="xy", scale=1.0, pivot="mid",
        units="inches", width=0.016, minlength=0, color=INK, alpha=0.85,
    )  # fmt: skip


def _drop_lines(axes: Axes, flat: FlatPart, part: ContactPart) -> Iterator[str]:
    """Draw where the slip is that at which the law drops, and say so."""
    for drop in part.drops.T[part.drops[0] > 0.0]:
        slip = part.size("slip") / drop
        if np.nanmin(slip) < 1.0 < np.nanmax(slip):
            axes.tricontour(flat.mesh, slip, [1.0], colors=INK, linestyles="--")
        yield _drops_in_words(drop)


def _drops_in_words(drops: Array) -> str:
    """Where a law drops, in words: at one slip, or at one for each vertex."""
    least, most = float(np.abs(drops).min()), magnitude(drops)
    words = quantity(most, "m") if least == most else f"{quantity(least, 'm')} to {quantity(most, 'm')}"
    return f"the law drops (dashed) at {words}"


CLOSED = 0.5
"""A part whose normals add up to less than this share of its area goes round the axis that they are most across."""


@dataclass(frozen=True, kw_only=True)
class FlatPart:
    """A part laid flat.

    Attributes:
        points: its vertices, m, (m, 2).
        facets: its facets by its vertices, (k, 3); none across the cut of one that was unrolled.
        ways: the unit vectors along which the two coordinates grow at each vertex, (m, 2, 3).
        names: of the coordinates.
        how: it was laid flat, in words; empty of a plane part along coordinate axes.
    """

    points: Array
    facets: Integers
    ways: Array
    names: tuple[str, str]
    how: str

    @property
    def unit(self) -> Unit:
        """The unit of the coordinates."""
        return unit_for(magnitude(self.points), "m")

    @property
    def mesh(self) -> Triangulation:
        """Its facets, in that unit."""
        x, y = self.points.T / self.unit.size
        return Triangulation(x, y, self.facets)


def laid_flat(geometry: PartGeometry, body: BodyMesh) -> FlatPart:
    """Lay a part flat: along the two coordinate axes that are most along it, or unrolled.

    Args:
        geometry: where the part lies on the body.
        body: the body.
    """
    points, triangles = geometry.part.points, geometry.row[geometry.facets]
    mean = body.area_vectors(geometry.facets).sum(axis=0) / body.sizes(geometry.facets).sum()
    if np.linalg.norm(mean) < CLOSED:
        return _unrolled(points, triangles, geometry.part.normal, ~geometry.part.idle)
    seen = int(np.argmax(np.abs(mean)))
    kept = [i for i in range(3) if i != seen]
    return FlatPart(
        points=points[:, kept],
        facets=triangles,
        ways=np.broadcast_to(np.eye(3)[kept], (len(points), 2, 3)),
        names=("xyz"[kept[0]], "xyz"[kept[1]]),
        how="" if abs(mean[seen]) > 1.0 - 1e-6 else f"seen along {'xyz'[seen]}",
    )


def _unrolled(points: Array, triangles: Integers, normals: Array, touches: Mask) -> FlatPart:
    """Angle times mean radius, and the coordinate that the normals are most across; cut opposite to contact."""
    axis = int(np.argmin(np.sum(normals**2, axis=0)))
    across = [i for i in range(3) if i != axis]
    arms = points[:, across]
    arms = arms - np.linalg.lstsq(np.column_stack([2.0 * arms, np.ones(len(arms))]), np.sum(arms**2, axis=1))[0][:2]
    angles, radius = np.arctan2(arms[:, 1], arms[:, 0]), float(np.linalg.norm(arms, axis=1).mean())
    start = float(np.angle(np.sum(np.exp(1j * angles[touches])))) - np.pi
    angles = start + np.mod(angles - start, 2.0 * np.pi)
    ways = np.zeros((len(points), 2, 3))
    ways[:, 0, across] = np.column_stack([-np.sin(angles), np.cos(angles)])
    ways[:, 1, axis] = 1.0
    return FlatPart(
        points=np.column_stack([radius * angles, points[:, axis]]),
        facets=triangles[np.ptp(angles[triangles], axis=1) < np.pi],
        ways=ways,
        names=(f"way round, 0 towards +{'xyz'[across[0]]},", "xyz"[axis]),
        how=f"unrolled about {'xyz'[axis]}",
    )
