"""The L."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, ClassVar, Literal, Self

from pydantic import model_validator

from ...geometry import Outline
from ...schema import Length, Mistake, validation_error, vector
from .plane import PlaneShape


class LShape(PlaneShape):
    """An L: a rectangle without a smaller rectangle at its upper right corner."""

    normals: ClassVar[Mapping[str, int | None]] = {
        **{"left": 0, "right": 0, "bottom": 1, "top": 1},
        **{"inner_right": 0, "inner_top": 1},
    }

    shape: Literal["l_shape"] = "l_shape"
    """sides left, right, bottom, top, and inner_right, inner_top, which meet at the re-entrant corner"""
    size: Annotated[tuple[Length, Length], vector(2)]
    """width and height, m, a list of 2; the lower left corner is the origin"""
    cut: Annotated[tuple[Length, Length], vector(2)]
    """width and height of the smaller rectangle, m, a list of 2"""
    mesh_size: Length
    """edge length of the triangles, m"""

    @model_validator(mode="after")
    def _leaves_an_l(self) -> Self:
        if self.cut[0] >= self.size[0] or self.cut[1] >= self.size[1]:
            raise validation_error([Mistake(("cut",), "must be smaller than size in both directions")])
        return self

    def outline(self) -> Outline:
        """The six sides."""
        (w, h), (a, b) = self.size, self.cut
        points = [(0.0, 0.0), (w, 0.0), (w, h - b), (w - a, h - b), (w - a, h), (0.0, h)]
        return Outline.polygon(points, ["bottom", "right", "inner_top", "inner_right", "top", "left"], self.mesh_size)
