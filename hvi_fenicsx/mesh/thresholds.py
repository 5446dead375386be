"""The numbers that tune how meshes, and mesh hierarchies, are made."""

from __future__ import annotations

import math
from dataclasses import dataclass


@dataclass(frozen=True, kw_only=True)
class MeshThresholds:
    """When coarser meshes are made, which of them are used, and how far cells are bent.

    Attributes:
        coarsest_block: cells each way of a block below which a coarser level does not help.
        bisected_edges: length of the edges of a marked tetrahedron that are bisected, relative to its longest one. All
            six edges would make a step of 4 to 5 times the unknowns; the longest and, in a sixth of a cube, the
            diagonals of its faces make it about 2.
        hierarchy_from: unknowns of a mesh file from which coarser meshes pay: with fewer, one factorisation takes less
            time than gmsh. Of a larger one, so many cells tell the sizes, regions and ranks of all.
        coarsest: unknowns of the coarsest mesh of a mesh file, about; of a block of more, whose cells cannot be halved,
            a coarser one pays.
        outline_turn: angle (radian) by which an outline turns at a vertex that is kept in any case, and by which it
            turns at most between two vertices that are kept: a coarse chord must stay near its curve. Twice as
            much is an edge of a surface.
        remeshed_size: part by which a coarser mesh's volume, or the area of a side, may differ.
        gmsh_seconds: seconds that gmsh has to read a mesh file, to mesh a script, and to remesh a body in space.
        least_jacobian: part of its straight size to which a curved cell may shrink anywhere.
    """

    coarsest_block: int = 4
    bisected_edges: float = 0.76
    hierarchy_from: int = 20_000
    coarsest: int = 2_500
    outline_turn: float = math.radians(20.0)
    remeshed_size: float = 0.25
    gmsh_seconds: float = 300.0
    least_jacobian: float = 0.2


DEFAULT = MeshThresholds()
