"""``scene.png`` of a plane body: undeformed, with the names of its parts, their loads, supports and contact."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.lines import Line2D
from matplotlib.patches import PathPatch

from ..reader import Result
from ..units import quantity, thousands
from ..vtu import Body
from . import plane_marks as marks
from .body_plane import canvas
from .boundary_chains import chains, closed_path
from .deformed import Deformed
from .legend import FOOT, legend
from .loads_supports import Side, loads, supports, tables
from .style import BLUE, GREY, INK, VERMILION, WIDTH, heading, save

ACTING = {"displacement", "traction"}
"""What has a drawing of its own; whatever else acts on a part colours it as a contact part."""
INSIDE = 0.045
"""How far inside of its part a name is written, of the body's size."""


def draw(path: Path, result: Result, body: Body) -> None:
    """Draw the scene of a plane body."""
    rest = Deformed(body, np.zeros_like(body.points), 1.0)
    drawn = [*marks.supports(rest, supports(result, body)), *marks.loads(rest, loads(result, body))]
    made, axes = canvas(np.concatenate([body.points[:, :2], *(mark.extent for mark in drawn)]))
    heading(made, result, "the scene")
    outline = closed_path(body.points, chains(body.boundary))
    axes.add_patch(PathPatch(outline, fc="#eef2f5", ec=INK, lw=1.6, joinstyle="round", zorder=1))
    found = list(tables(result, body))
    for side, table in found:
        _part(axes, body, side, table)
    for mark in drawn:
        mark.draw(axes)
    say(made, body)
    legend(made, [*keys(table for _, table in found), *marks.keys(drawn), *inside(result)])
    save(made, path)


def touches(table: Mapping[str, Any]) -> bool:
    """Whether contact or a law acts on a part."""
    return bool(set(table) - {"on"} - ACTING)


def keys(found: Iterator[Mapping[str, Any]]) -> list[Artist]:
    """The legend's line for contact parts, if there is one."""
    return (
        [Line2D([], [], color=VERMILION, lw=5, label="contact, friction or adhesion")]
        if any(map(touches, found))
        else []
    )


def inside(result: Result) -> list[Artist]:
    """The legend's lines on what acts everywhere and has no place in a drawing."""
    return [Line2D([], [], color="none", label=f"and {words}") for words in result.within]


def _part(axes: Axes, body: Body, side: Side, table: Mapping[str, Any]) -> None:
    """The part's line where something touches it, and its name inside of it."""
    line = body.points[side.vertices, :2]
    if touches(table):
        axes.plot(*line.T, color=VERMILION, lw=5, solid_capstyle="butt", zorder=2)
    middle, inward = len(line) // 2, -side.normals[len(line) // 2, :2]
    depth = min(INSIDE * body.size, float(np.ptp(body.points[:, :2], axis=0).min()) / 2)
    at = (line[(len(line) - 1) // 2] + line[middle]) / 2 + depth * inward
    upright = abs(inward[0]) > 0.8
    halo = {"boxstyle": "round,pad=0.1", "fc": "#eef2f5", "ec": "none", "alpha": 0.8}
    style: dict[str, Any] = {"ha": "center", "va": "center", "size": 12.5, "color": BLUE, "bbox": halo, "zorder": 8}
    axes.text(at[0], at[1], side.part, rotation=90 if upright else 0, **style)


def say(made: Any, body: Body) -> None:
    """The body's extent and how many cells it has."""
    extent = " × ".join(quantity(float(c), "m") for c in np.ptp(body.points, axis=0)[: body.dimension])
    tall = made.get_figheight()
    for line, words in enumerate(
        (extent, f"{thousands(len(body.cells))} {'triangles' if body.dimension == 2 else 'tetrahedra'}")
    ):
        made.text(0.3 / WIDTH, (FOOT - 0.45 - 0.35 * line) / tall, words, size=13, color=GREY if line else INK)
    made.text(0.3 / WIDTH, (FOOT - 1.15) / tall, "blue: names of the parts", size=12.5, color=BLUE)
