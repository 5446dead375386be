"""``escape.png``: where a body goes that nothing holds. Its ghost, moved along the motion, and the motion in words."""

from __future__ import annotations

import textwrap
from pathlib import Path

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import FancyArrowPatch, Patch, PathPatch
from matplotlib.path import Path as DrawnPath

from ...typing import Array
from ..reader import Result
from ..vtu import Body
from . import plane_marks as marks
from .body_plane import canvas
from .boundary_chains import chains, closed_path
from .deformed import Deformed
from .finite_motion import fitted, followed
from .legend import FOOT, legend
from .loads_supports import loads, supports
from .style import GREY, INK, PALE, VERMILION, WIDTH, heading, save

WAY = np.linspace(0.0, 1.0, 25)


def draw(path: Path, result: Result, body: Body) -> None:
    """Draw a plane body and its ghost."""
    mover = body.moving("escape_mode")
    motion = fitted(mover, mover.fields["escape_mode"])
    rest = Deformed(body, np.zeros_like(body.points), 1.0)
    drawn = [*marks.supports(rest, supports(result, body)), *marks.loads(rest, loads(result, body))]
    ghost, posts = motion.at(mover.points), followed(mover, motion)
    ways = np.stack([motion.at(posts, part)[:, :2] for part in WAY], axis=1)
    reached = [body.points[:, :2], ghost[:, :2], ways.reshape(-1, 2), *(mark.extent for mark in drawn)]
    made, axes = canvas(np.concatenate(reached))
    heading(made, result, "rigid motion")
    _bodies(axes, body, mover, ghost)
    for mark in drawn:
        mark.draw(axes)
    for way in ways:
        arrow(axes, way)
    say(made, result, [*keys(), *marks.keys(drawn)])
    save(made, path)


def _bodies(axes: Axes, body: Body, mover: Body, ghost: Array) -> None:
    axes.add_patch(PathPatch(closed_path(body.points, chains(body.boundary)), fc=PALE, ec=INK, lw=1.6, zorder=1))
    loops = chains(mover.boundary)
    axes.add_patch(PathPatch(closed_path(ghost, loops), fc="none", ec=VERMILION, lw=2, ls=(0, (5, 3)), zorder=4))
    axes.add_patch(PathPatch(closed_path(ghost, loops), fc=VERMILION, alpha=0.12, lw=0, zorder=3))


def arrow(axes: Axes, way: Array) -> None:
    """An arrow along points (n, 2)."""
    drawn = FancyArrowPatch(
        path=DrawnPath(way), arrowstyle="-|>,head_length=9,head_width=5", color=VERMILION, lw=3.2, zorder=7, shrinkB=0
    )
    drawn.set_clip_on(False)
    axes.add_patch(drawn)


def keys() -> list[Artist]:
    """The legend's lines for the two bodies."""
    ghost = Patch(fc="#fbe3d3", ec=VERMILION, ls="--", label="its ghost, on its way")
    return [Patch(fc=PALE, ec=INK, label="the body at rest"), ghost]


def say(made: Figure, result: Result, keys: list[Artist]) -> None:
    """The motion in words, and what the marks mean."""
    words = str(result.solvability.get("direction") or "a rigid motion")
    tall = made.get_figheight()
    made.text(0.3 / WIDTH, (FOOT - 0.28) / tall, "The load moves the body by", size=12.5, color=GREY, va="top")
    lines = textwrap.wrap(words, 27 if len(words) < 60 else 40)
    size = 16 if len(lines) <= 2 and len(words) < 60 else 11.5
    made.text(0.3 / WIDTH, (FOOT - 0.56) / tall, "\n".join(lines), size=size, weight="bold", color=VERMILION, va="top")
    legend(made, keys)


__all__ = ["WAY", "arrow", "draw", "keys", "say"]
