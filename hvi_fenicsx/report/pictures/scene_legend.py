"""What a picture of a scene says beside the body: which parts are contact parts, what acts inside, the size."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np
from matplotlib.artist import Artist
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from ..body_mesh import BodyMesh
from ..reader import Result
from ..units import quantity, thousands
from .legend import FOOT
from .style import BLUE, GREY, INK, WIDTH


def touches(roles: Iterable[Mapping[str, Any]]) -> bool:
    """Whether contact or a law acts on a part, from the roles of its effects."""
    return any(role["bounded"] or role["laws"] for role in roles)


def inside(result: Result) -> list[Artist]:
    """The legend's lines on what acts everywhere and has no place in a drawing."""
    return [Line2D([], [], color="none", label=f"and {words}") for words in result.within]


def say(fig: Figure, body: BodyMesh) -> None:
    """Write the body's extent and how many cells it has.

    Args:
        fig: the picture.
        body: the body.
    """
    extent = " × ".join(quantity(float(c), "m") for c in np.ptp(body.points, axis=0)[: body.dimension])
    tall = fig.get_figheight()
    for line, words in enumerate(
        (extent, f"{thousands(len(body.cells))} {'triangles' if body.dimension == 2 else 'tetrahedra'}")
    ):
        fig.text(0.3 / WIDTH, (FOOT - 0.45 - 0.35 * line) / tall, words, size=13, color=GREY if line else INK)
    fig.text(0.3 / WIDTH, (FOOT - 1.15) / tall, "blue: names of the parts", size=12.5, color=BLUE)
