"""How the maps of a part stand in their picture: one below the other, or two by two where they are narrow."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from ...typing import Array
from .style import HEADING

ACROSS, TALLEST = {1: 5.8, 2: 2.6}, {1: 2.75, 2: 4.0}
"""Inches: the widest and the tallest map, by the number of columns."""
LEAST = 0.6
"""Inches: as tall a map is at least."""
LEFT, BAR, GAP, FOOT = 0.95, 0.85, 0.62, 0.75
"""Inches: left of the maps, right of each for its bar, above each for its title, below the last."""
AS_LARGE = 0.75
"""In two columns maps are at least so large a part of what they are in one."""


@dataclass(frozen=True, kw_only=True)
class MapLayout:
    """Maps of one size in rows.

    Attributes:
        count: how many there are.
        columns: how many stand side by side.
        width: of a map, inches.
        height: of a map, inches.
    """

    count: int
    columns: int
    width: float
    height: float

    @property
    def rows(self) -> int:
        """How many rows there are."""
        return math.ceil(self.count / self.columns)

    @property
    def tall(self) -> float:
        """The height of the picture, inches."""
        return HEADING + self.rows * (self.height + GAP) + FOOT

    def corner(self, i: int) -> tuple[float, float]:
        """The lower left corner of a map, inches."""
        row, column = divmod(i, self.columns)
        return LEFT + column * (self.width + BAR), FOOT + (self.rows - 1 - row) * (self.height + GAP)

    def leftmost(self, i: int) -> bool:
        """Whether a map is the first of its row, and has the axis upwards."""
        return i % self.columns == 0

    def lowest(self, i: int) -> bool:
        """Whether there is none below a map, which then has the axis across."""
        return i + self.columns >= self.count


def layout(extent: Array, count: int) -> MapLayout:
    """The layout of maps.

    Args:
        extent: width and height of what each shows, m, (2,).
        count: how many there are.
    """
    wide, tall = (float(side) for side in np.maximum(extent, 1e-12))
    scales = {columns: min(ACROSS[columns] / wide, TALLEST[columns] / tall) for columns in (1, 2)}
    columns = 2 if count > 1 and scales[2] >= AS_LARGE * scales[1] else 1
    scale = scales[columns]
    return MapLayout(count=count, columns=columns, width=scale * wide, height=max(scale * tall, LEAST))
