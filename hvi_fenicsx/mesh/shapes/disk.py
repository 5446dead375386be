"""A disk and its lower half, which touch y = 0 at the origin."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import TYPE_CHECKING, ClassVar, Literal

from ...geometry import Outline
from ...schema import Length
from .base import DEFAULT, Thresholds
from .plane import PlaneShape, vertices


class Round(PlaneShape):
    """A disk or a part of it that touches y = 0 at the origin, where its mesh may be finer.

    Class attributes:
        part: of the disk.
    """

    mesh_sizes: ClassVar[tuple[str, ...]] = ("mesh_size", "mesh_size_below")
    part: ClassVar[float]

    if TYPE_CHECKING:
        radius: float
        mesh_size_below: float | None

    @property
    def finest(self) -> float:
        """The mesh size at the lowest point, m."""
        return self.mesh_size_below or self.mesh_size

    def box_area(self) -> float:
        """Area of the square around the whole disk, m²."""
        return 4.0 * self.radius**2

    def unknowns(self, dimension: int, thresholds: Thresholds = DEFAULT) -> float:
        """About how many unknowns the mesh has."""
        return 2.0 * vertices(math.pi * self.radius**2 * self.part, self.mesh_size, self.finest)


class Disk(Round):
    """A disk whose lowest point is the origin."""

    part: ClassVar[float] = 1.0
    normals: ClassVar[Mapping[str, int | None]] = {"lower_arc": None, "upper_arc": None}

    shape: Literal["disk"] = "disk"
    """the centre is (0, radius); sides lower_arc, upper_arc"""
    radius: Length
    """radius of the disk, m"""
    mesh_size: Length
    """edge length of the triangles, m"""
    mesh_size_below: Length | None = None
    """edge length at the lowest point, m; it grows with the distance from there; by default `mesh_size`"""

    def outline(self) -> Outline:
        """Four arcs, the lowest point being a corner."""
        r, coarse = self.radius, self.mesh_size
        sides = [("lower_arc", (0.0, r))] * 2 + [("upper_arc", (0.0, r))] * 2
        return Outline([(-r, r), (0.0, 0.0), (r, r), (0.0, 2 * r)], sides, [coarse, self.finest, coarse, coarse])


class HalfDisk(Round):
    """The lower half of a disk whose lowest point is the origin."""

    part: ClassVar[float] = 0.5
    normals: ClassVar[Mapping[str, int | None]] = {"arc": None, "top": 1}

    shape: Literal["half_disk"] = "half_disk"
    """the centre is (0, radius); sides arc, top (the flat side)"""
    radius: Length
    """radius of the disk, m"""
    mesh_size: Length
    """edge length of the triangles, m"""
    mesh_size_below: Length | None = None
    """edge length at the lowest point, m; it grows with the distance from there; by default `mesh_size`"""

    def outline(self) -> Outline:
        """Two arcs, the lowest point being a corner, and the flat top."""
        r, coarse = self.radius, self.mesh_size
        sides = [("arc", (0.0, r)), ("arc", (0.0, r)), ("top", None)]
        return Outline([(-r, r), (0.0, 0.0), (r, r)], sides, [coarse, self.finest, coarse])
