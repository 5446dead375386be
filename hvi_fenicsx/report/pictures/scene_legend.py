"""What a picture of a scene says beside the body: which parts are contact parts, what acts inside, the size."""

from __future__ import annotations

import textwrap
from collections.abc import Iterable, Mapping
from typing import Any

from matplotlib.artist import Artist
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from ..body_mesh import BodyMesh
from ..reader import Result
from ..units import quantity, thousands
from .legend import FOOT
from .style import BLUE, GREY, INK, WIDTH

LETTERS = 40
"""In one line of the legend."""
UNITS = {"displacement": ("m", "m"), "moment": ("N", "N\u202fm")}
"""The units of what drives a part as a whole, in the plane and in space."""


def touches(roles: Iterable[Mapping[str, Any]]) -> bool:
    """Whether contact or a law acts on a part, from the roles of its effects."""
    return any(role["bounded"] or role["laws"] for role in roles)


def inside(result: Result) -> list[Artist]:
    """The legend's lines on what has no arrow: what acts everywhere, and moments and displacements of a part."""
    d = result.body.dimension
    parts = [f"“{part}”: {key} {_said(value, key, d)}" for part, key, value in result.driven if key != "force"]
    lines = [*parts, *(f"and {words}" for words in result.within)]
    return [Line2D([], [], color="none", label="\n".join(textwrap.wrap(words, LETTERS))) for words in lines]


def _said(value: Any, key: str, dimension: int) -> str:
    """A number with its unit, or those of a list in brackets; what is no number as it stands in the scene."""
    if isinstance(value, list):
        return f"({', '.join(_said(one, key, dimension) for one in value)})"
    unit = UNITS.get(key, ("", ""))[dimension - 2]
    return quantity(float(value), unit) if isinstance(value, int | float) and unit else str(value)


def say(fig: Figure, body: BodyMesh, stretched: str = "") -> None:
    """Write the body's extent and how many cells it has.

    Args:
        fig: the picture.
        body: the body.
        stretched: how the picture is stretched, in words.
    """
    extent = " × ".join(quantity(float(c), "m") for c in body.extents[: body.dimension])
    extent += f" (drawn {stretched})" if stretched else ""
    tall = fig.get_figheight()
    for line, words in enumerate(
        (extent, f"{thousands(len(body.cells))} {'triangles' if body.dimension == 2 else 'tetrahedra'}")
    ):
        fig.text(0.3 / WIDTH, (FOOT - 0.45 - 0.35 * line) / tall, words, size=13, color=GREY if line else INK)
    fig.text(0.3 / WIDTH, (FOOT - 1.15) / tall, "blue: names of the parts", size=12.5, color=BLUE)
