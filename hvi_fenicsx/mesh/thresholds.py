"""The numbers that tune how mesh hierarchies are made."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, kw_only=True)
class Thresholds:
    """When coarser meshes of a mesh file are made, and which of them are used.

    Attributes:
        hierarchy_from: unknowns from which coarser meshes pay; below, one factorisation takes less than gmsh.
        coarsest: unknowns of the coarsest mesh, about.
        outline_area: part of a plane body's area by which that within the thinned outline may differ.
        remeshed_size: part by which a remeshed body's volume, or the area of a side, may differ.
        gmsh_seconds: seconds that gmsh has in any case to remesh a body in space.
        gmsh_seconds_per_triangle: seconds more for each triangle of its surface; it takes some 1e-4.
    """

    hierarchy_from: int = 20_000
    coarsest: int = 2_500
    outline_area: float = 0.1
    remeshed_size: float = 0.25
    gmsh_seconds: float = 5.0
    gmsh_seconds_per_triangle: float = 1e-3


DEFAULT = Thresholds()
