"""The strip with a notch."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, ClassVar, Literal, Self

from pydantic import model_validator

from ...geometry import Outline
from ...schema import Length, Mistake, validation_error, vector
from .plane import PlaneShape


class NotchedStrip(PlaneShape):
    """A rectangle with a V-shaped notch in the middle of its top side."""

    normals: ClassVar[Mapping[str, int | None]] = {"left": 0, "right": 0, "bottom": 1, "top": 1, "notch": None}

    shape: Literal["notched_strip"] = "notched_strip"
    """sides left, right, bottom, top (both pieces), notch (both flanks)"""
    size: Annotated[tuple[Length, Length], vector(2)]
    """width and height, m, a list of 2; the lower left corner is the origin"""
    notch: Annotated[tuple[Length, Length], vector(2)]
    """width and depth of the notch, m, a list of 2"""
    mesh_size: Length
    """edge length of the triangles, m"""

    @model_validator(mode="after")
    def _leaves_a_strip(self) -> Self:
        if self.notch[0] >= self.size[0] or self.notch[1] >= self.size[1]:
            raise validation_error([Mistake(("notch",), "must be smaller than size in both directions")])
        return self

    def outline(self) -> Outline:
        """The seven sides, two of which are the notch and two the top."""
        (w, h), (a, b) = self.size, self.notch
        notch = [((w + a) / 2, h), (w / 2, h - b), ((w - a) / 2, h)]
        points = [(0.0, 0.0), (w, 0.0), (w, h), *notch, (0.0, h)]
        names = ["bottom", "right", "top", "notch", "notch", "top", "left"]
        return Outline.polygon(points, names, self.mesh_size)
