"""``contact.png``: slip, -σ_t and contact pressure of a part, as curves along it or as maps of it laid flat."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import Colormap
from matplotlib.figure import Figure
from matplotlib.patches import Patch
from matplotlib.tri import Triangulation
from scipy.spatial import cKDTree

from ...typing import Array
from ..contact_part import ContactPart
from ..reader import Result
from ..units import Unit, quantity, unit_for
from .flat_parts import FlatPart, laid_flat
from .registry import picture
from .shape import part_geometries
from .style import (
    BLUE,
    GREEN,
    GREY,
    HEADING,
    INK,
    ORANGE,
    VERMILION,
    WIDTH,
    area,
    figure,
    heading,
    pressure_scale,
    shades,
)  # fmt: skip

MARKED = 80
"""Vertices up to which each is marked."""
IN_RANGE = 1.6
"""A drop of the law is drawn if it lies within this many times the largest displacement."""
ARROWS = 13
"""Along the longer side of a map."""


@dataclass(frozen=True)
class Field:
    """What is drawn of a part.

    Attributes:
        words: what it is, with its symbol.
        unit: its unit, with the prefix that suits it.
        values: by vertex, (m,).
        colour: of the curve or the map.
        drops: where the law drops, by vertex, (m, j).
        kind: "slip", "friction", "opening", "penetration" or "pressure".
    """

    words: str
    unit: Unit
    values: Array
    colour: str
    drops: Array
    kind: str


def _fields(result: Result, part: ContactPart) -> Iterator[Field]:
    """From the top: slip and friction, what a normal law acts on, the pressure; a law that it lacks has no field."""
    flat = result.body.dimension == 2
    rows: list[tuple[str, str, Array, str, str]] = [
        ("slip", "slip $u_t$" if flat else "slip $|u_t|$", part.size("slip"), "m", BLUE)
    ]
    if result.resists(part.name, "slip", "separation"):
        rows.append(
            (
                "friction",
                "friction $-\\sigma_t$" if flat else "friction $|\\sigma_t|$",
                part.size("friction"),
                "Pa",
                GREEN,
            )
        )
    if flat and result.resists(part.name, "opening", "separation"):
        rows.append(("opening", "opening $-u_n$", -part["u_n"], "m", BLUE))
    if flat and result.resists(part.name, "penetration"):
        rows.append(("penetration", "penetration $u_n$", part["u_n"], "m", BLUE))
    rows.append(("pressure", "contact pressure $-\\sigma_n$", part.pressure, "Pa", VERMILION))
    for kind, words, values, name, colour in rows:
        unit = unit_for(float(np.nanmax(np.abs(values), initial=0.0)), name)
        yield Field(words, unit, values, colour, _drops(result, part, kind), kind)


def _drops(result: Result, part: ContactPart, kind: str) -> Array:
    """Where the law of a part drops at each vertex, m, (m, j); of friction the result has it."""
    if kind == "slip":
        return part.drops
    if kind in ("opening", "penetration"):
        law, multipliers = result.law(part.name, kind), result.multipliers(part, kind)
        if law is not None and multipliers is not None:
            return multipliers[1][:, None] * law.concave.kinks
    return np.empty((len(part), 0))


@picture("contact", of_part=True, caption="Along {part}: displacement, friction and pressure.")
def contact(result: Result, part: ContactPart) -> Figure:
    """Draw what happens on a part of Γc.

    Args:
        result: the result.
        part: its part.
    """
    return _curves(result, part) if result.body.dimension == 2 else _maps(result, part)


def _curves(result: Result, whole: ContactPart) -> Figure:
    """A panel for each field over the length along the part."""
    signs = _signs(whole) if _is_even(result, whole) else np.ones(len(whole))
    part, along = whole, ""
    if np.any(signs != signs[0]):
        own = {name: signs * whole[name] for name in ("u_t1", "friction_t1")}
        part, along = replace(whole, columns={**whole.columns, **own}), " along s"
    part = _worth_seeing(part)
    fields, length = list(_fields(result, part)), unit_for(float(np.max(part["s"])), "m")
    fig = figure(HEADING + 2.37 * len(fields) + 0.72)
    heading(fig, result, f"on “{part.name}”")
    for above, field in enumerate(reversed(fields)):
        axes = area(fig, 0.95, 0.72 + 2.37 * above, 6.75, 1.75)
        _panel(axes, result, part, field, length)
        axes.set_title(f"{field.words}{along if field.kind in ('slip', 'friction') else ''} in {field.unit.name}",
                       loc="left", size=14, parse_math=True)  # fmt: skip
        axes.tick_params(labelbottom=above == 0)
    fig.axes[0].set_xlabel(f"s along “{part.name}” in {length.name}")
    if part.lifted.any():
        key = Patch(fc=ORANGE, alpha=0.3, label=f"lifted, up to {quantity(whole.largest_gap, 'm')}")
        place = (1 - 0.3 / WIDTH, 1 - (HEADING + 0.08) / fig.get_figheight())
        fig.legend(handles=[key], loc="center right", bbox_to_anchor=place, frameon=False, fontsize=12, borderpad=0.0,
                   borderaxespad=0.0)  # fmt: skip
    return fig


def _is_even(result: Result, part: ContactPart) -> bool:
    """Whether the law of a part is the same in both directions."""
    law = result.law(part.name)
    return law.even if law is not None else not result.resists(part.name, "slip")


def _signs(part: ContactPart) -> Array:
    """-1 where the tangent looks against growing s, as it does on a curved part beyond 45°, else 1, (m,)."""
    along = np.gradient(part.points[:, :2], axis=0) if len(part) > 1 else np.zeros((1, 2))
    return np.where(np.sum(part.tangents[:, 0] * along, axis=1) < 0.0, -1.0, 1.0)


def _worth_seeing(part: ContactPart) -> ContactPart:
    """The part; if it is closed on a fifth of it only, that stretch and its neighbourhood."""
    s, closed = part["s"], part["s"][part["contact"] == 1.0]
    if len(closed) < 2 or 5 * np.ptp(closed) > np.ptp(s):
        return part
    near = (s >= closed.min() - np.ptp(closed)) & (s <= closed.max() + np.ptp(closed))
    columns = {name: values[near] for name, values in part.columns.items()}
    return replace(
        part, columns=columns, vertices=part.vertices[near], normal=part.normal[near], drops=part.drops[near]
    )


def _panel(axes: Axes, result: Result, part: ContactPart, field: Field, length: Unit) -> None:
    """A curve, with what the laws say of it."""
    s, values = np.asarray(part["s"] / length.size, dtype=np.float64), np.asarray(field.values / field.unit.size)
    marker: dict[str, Any] = {"marker": "o" if len(s) <= MARKED else "", "ms": 4.5 if len(s) <= MARKED // 2 else 3.0}
    axes.plot(s, values, color=field.colour, **marker)
    note = ""
    if field.kind == "friction":
        note = _law(axes, result, part, s, field) or _fallen(axes, part, s, values)
    elif field.kind == "pressure":
        axes.fill_between(s, values, color=field.colour, alpha=0.15, lw=0)
        off = part.lifted
        axes.plot(s[off], values[off], "o", mfc="white", mec=field.colour, ms=6, zorder=5)
        extreme = float(field.values[np.nanargmax(np.abs(values))]) if np.isfinite(values).any() else 0.0
        note = f"largest {'tension ' if extreme < 0.0 else ''}{field.unit.text(abs(extreme))}"
    else:
        note = _dropping(axes, s, field)
    axes.set_title(note, loc="right", size=11.5, color=GREY)
    for start, end in _lifted_spans(part):
        axes.axvspan(start / length.size, end / length.size, color=ORANGE, alpha=0.16, lw=0)
    axes.axhline(0.0, color=GREY, lw=0.8, zorder=1)  # zero is always in sight
    axes.update_datalim([(s[0], 0.0)])
    axes.margins(0.015, 0.06)
    axes.locator_params(axis="y", nbins=4, steps=[1, 2, 2.5, 5, 10])
    axes.grid(axis="y", color="#e6e6e6", lw=0.8)
    axes.set_axisbelow(True)


_DASHED: dict[str, Any] = {"color": INK, "ls": (0, (4, 3)), "lw": 1.4, "zorder": 4}


def _dropping(axes: Axes, s: Array, field: Field) -> str:
    """Draw where the law drops, as far as it is near and on the side of the displacements; says what the lines mean."""
    if not field.drops.size:
        return ""
    low, high = min(float(np.nanmin(field.values)), 0.0), max(float(np.nanmax(field.values)), 0.0)
    near = (field.drops <= IN_RANGE * high) & (field.drops >= IN_RANGE * low)
    shown = near.any(axis=0)
    for drop in np.where(near, field.drops, np.nan)[:, shown].T:
        axes.plot(s, drop / field.unit.size, **_DASHED)
    if np.any(np.ptp(field.drops, axis=0) > 0.0):
        return "dashed: the law drops there" if shown.any() else "the law drops beyond, not reached"
    named = field.drops[0, shown] if shown.any() else field.drops[0]
    said = " and ".join(
        ("±" if -k in named and k else "") + quantity(k, "m") for k in named if k >= 0.0 or -k not in named
    )
    return f"dashed: the law drops at {said}" if shown.any() else f"the law drops at {said}, not reached"


def _law(axes: Axes, result: Result, part: ContactPart, s: Array, field: Field) -> str:
    """Draw what the law itself would give where it was smoothed; says what the lines mean."""
    law = result.law(part.name) if result.summary.get("smoothing") else None
    if law is None or (multipliers := result.multipliers(part)) is None:
        return ""
    multiplier, stretch = multipliers
    low, high = (multiplier * end for end in law.interval(part.slip.astype(np.float64) / stretch))
    for bound in (low, high) if np.any(high > low) else (low,):
        axes.plot(s, bound / field.unit.size, **_DASHED)
    return "dashed: the law itself, unsmoothed"


def _fallen(axes: Axes, part: ContactPart, s: Array, values: Array) -> str:
    """Mark the vertices that have left the law's first piece; says what the mark means."""
    fallen = part["branch_t"] > 0
    if not fallen.any():
        return ""
    axes.plot(s[fallen], values[fallen], "o", mfc="white", mec=GREEN, ms=6)
    return f"hollow: past the drop ({np.count_nonzero(fallen)} of {len(fallen)} vertices)"


def _lifted_spans(part: ContactPart) -> Iterator[tuple[float, float]]:
    """Stretches of s whose vertices are lifted; each vertex stands for half the way to its neighbours."""
    s = part["s"]
    middles = np.concatenate([s[:1], (s[1:] + s[:-1]) / 2, s[-1:]])
    changes = np.flatnonzero(np.diff(np.concatenate([[0], part.lifted.astype(int), [0]])))
    return ((float(middles[a]), float(middles[b])) for a, b in changes.reshape(-1, 2))


def _maps(result: Result, part: ContactPart) -> Figure:
    """A map of each field, one below the other, of the part laid flat."""
    geometry = next(geometry for geometry in part_geometries(result) if geometry.part.name == part.name)
    flat, fields = laid_flat(geometry, result.body), list(_fields(result, part))
    wide, tall = (float(side) for side in np.maximum(np.ptp(flat.points, axis=0), 1e-12))
    columns = 2 if tall > 0.9 * wide and len(fields) > 1 else 1
    width = min(5.9, 2.75 * wide / tall) if columns == 1 else min(2.6, 3.8 * wide / tall)
    height = max(width * tall / wide, 0.6)
    rows = -(-len(fields) // columns)
    fig = figure(HEADING + rows * (height + 0.75) + 0.75)
    heading(fig, result, f"on “{part.name}”")
    for i, field in enumerate(fields):
        row, column = divmod(i, columns)
        axes = area(fig, 0.95 + column * (width + 0.95), 0.75 + (rows - 1 - row) * (height + 0.75), width, height)
        _map(fig, axes, flat, part, field)
        axes.tick_params(labelleft=column == 0)
        if column == 0:
            axes.set_ylabel(f"{flat.names[1]} in {flat.unit.name}")
        axes.set_xlabel(f"{flat.names[0]} in {flat.unit.name}" if i + columns >= len(fields) else "")
    said = [*_drop_lines(fig.axes[0], flat, part)]
    if part.idle.any():
        said.append(f"grey: lifted, up to {quantity(part.largest_gap, 'm')}")
    up = 1 - (HEADING + 0.2) / fig.get_figheight()
    fig.text(1 - 0.3 / WIDTH, up, "; ".join(said), size=12, color=GREY, ha="right")
    fig.text(1 - 0.3 / WIDTH, 0.2 / fig.get_figheight(), flat.how, size=12, color=GREY, ha="right")
    return fig


def _map(fig: Figure, axes: Axes, flat: FlatPart, part: ContactPart, field: Field) -> None:
    """Values as colours, with a bar beside it, from zero; a field along the part as arrows too."""
    values = np.nan_to_num(field.values / field.unit.size)
    low, high = float(values.min()), float(np.abs(values).max())
    colours: Colormap = shades(field.colour)
    scale = (colours, 0.0, high) if field.kind != "pressure" else pressure_scale(low, high)
    drawn = axes.tripcolor(
        flat.triangulation, values[flat.rows], shading="gouraud", cmap=scale[0], vmin=scale[1], vmax=scale[2] or 1.0
    )
    idle = part.idle[flat.rows][flat.triangulation.triangles].all(axis=1)
    if idle.any():
        grey = Triangulation(flat.triangulation.x, flat.triangulation.y, flat.triangulation.triangles[idle])
        axes.tripcolor(grey, np.zeros(len(flat.rows)), cmap="gray", vmin=-1, vmax=1, alpha=0.45, antialiased=False)
    box = axes.get_position()
    bar = fig.add_axes((box.x1 + 0.02, box.y0, 0.02, box.height))
    fig.colorbar(drawn, cax=bar, ticks=None if high > 0.0 else [0.0])
    bar.spines[:].set_visible(False)
    axes.set_title(f"{field.words} in {field.unit.name}", loc="left", size=14, parse_math=True)
    if field.kind != "pressure":
        _arrows(axes, flat, part, field.kind)
    axes.spines[:].set_visible(False)
    axes.locator_params(axis="x", nbins=int(np.clip(box.width * WIDTH / 0.7, 1, 6)), steps=[1, 2, 2.5, 5, 10])
    axes.locator_params(axis="y", nbins=4, steps=[1, 2, 2.5, 5, 10])
    for axis in (axes.xaxis, axes.yaxis):
        axis.set_major_formatter(lambda value, _: f"{value / flat.unit.size:.4g}".replace("-", "−"))


def _arrows(axes: Axes, flat: FlatPart, part: ContactPart, quantity: str) -> None:
    """A tangential quantity at the nodes of a coarse grid, whatever the mesh."""
    vectors = flat.along(np.nan_to_num(part.vectors(quantity)))
    low, extent = flat.points.min(axis=0), np.ptp(flat.points, axis=0)
    spacing = float(np.max(extent)) / ARROWS
    sides = (np.arange(low[i] + spacing / 2, low[i] + max(extent[i], spacing), spacing) for i in (0, 1))
    nodes = np.stack(np.meshgrid(*sides), axis=-1).reshape(-1, 2)
    away, nearest = cKDTree(flat.points).query(nodes)
    ways = vectors * 0.9 * spacing / (float(np.linalg.norm(vectors, axis=1).max()) or 1.0)
    shown = np.unique(nearest[(away < spacing) & (np.linalg.norm(ways[nearest], axis=1) > 0.05 * spacing)])
    axes.quiver(
        *flat.points[shown].T, *ways[shown].T, angles="xy", scale_units="xy", scale=1.0, pivot="mid", units="inches",
        width=0.016, color=INK, alpha=0.85,
    )  # fmt: skip


def _drop_lines(axes: Axes, flat: FlatPart, part: ContactPart) -> Iterator[str]:
    """Draw where the slip is that at which the law drops, and say so."""
    for drop in part.drops.T[part.drops[0] > 0.0]:
        slip = part.size("slip") / drop
        at = f"at {quantity(float(drop[0]), 'm')}" if np.ptp(drop) == 0.0 else "at lengths that change"
        reached = bool(np.nanmin(slip) < 1.0 < np.nanmax(slip))
        if reached:
            axes.tricontour(flat.triangulation, slip[flat.rows], [1.0], colors=INK, linestyles="--")
        yield f"dashed: the law drops {at}" if reached else f"the law drops {at}, not reached"
