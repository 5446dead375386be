"""Γc at its vertices: where each contact part's nodes are, their normals, tangents and lumped areas.

Vertex (trapezoidal) quadrature makes every boundary term a sum over these nodes (paper, section 4.2).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import ufl
from dolfinx import fem
from mpi4py import MPI

from ..errors import InputError
from ..geometry import spot, tangents
from ..typing import Array, Entities, Integers
from . import facet_integrals
from .vectors import nodal


@dataclass(frozen=True, slots=True, kw_only=True)
class Surface:
    """The vertices of one boundary part that this rank owns (m of them).

    Attributes:
        part: its name.
        facets: its local facets.
        blocks: local indices of its vertices (blocks of the space), (m,).
        points: the vertices, m, (m, 3).
        normals: outward unit normals (:mod:`.contact_normals`), (m, d).
        measured: the unit normals along which the scene states the gap; they differ from `normals` only where the part
            shares a vertex with a prescribed component or with another part, (m, d).
        tangents: unit tangents (:func:`tangents`), (m, d-1, d).
        weights: lumped area of each vertex over L^(d-1), (m,).
        tied: whether the displacement is held at zero: that of two bodies that are glued, relative to each other.
    """

    part: str
    facets: Entities
    blocks: Entities
    points: Array
    normals: Array
    measured: Array
    tangents: Array
    weights: Array
    tied: bool = False

    @property
    def dofs(self) -> Integers:
        """The scalar dofs of these vertices, shape (m, d)."""
        d = self.normals.shape[1]
        return self.blocks[:, None].astype(np.int64) * d + np.arange(d)

    def values(self, u: Array) -> Array:
        """The vectors at these vertices of a local array of a P1 vector field; shape (m, d)."""
        return u.reshape(-1, self.normals.shape[1])[self.blocks]

    def spot(self, i: int) -> str:
        """Where its vertex i is, for messages."""
        return spot(self.points[i, : self.normals.shape[1]])


def make_surface(
    part: str,
    space: fem.FunctionSpace,
    vertices: Array,
    facets: Entities,
    measure: Any,
    area: float,
) -> Surface:
    """The vertices of a part, with the mean normals of the facets there. Collective.

    Args:
        part: its name.
        space: P1 vectors.
        vertices: the local vertices of the mesh, m, (n, 3).
        facets: the part's local facets.
        measure: ds with vertex quadrature over the part, SI.
        area: L^(d-1), what the weights are divided by.

    Raises:
        InputError: on all ranks alike: a vertex is on none but facets inside the body, which have no outward normal.
    """
    dimension = space.mesh.geometry.dim
    dofs = fem.locate_dofs_topological(space, dimension - 1, facets)
    blocks = np.unique(dofs[dofs < space.dofmap.index_map.size_local]).astype(np.int32)
    test = ufl.TestFunction(space)
    normal = nodal(ufl.inner(ufl.FacetNormal(space.mesh), test) * measure)[blocks]
    weights: Array = _weights(space, normal, test, measure, blocks) / area
    if space.mesh.comm.allreduce(bool(np.any(weights == 0.0)), op=MPI.LOR):
        raise InputError(f"boundary.{part}: contact and laws act on the body's surface, and facets of it lie inside")
    normals = normal / np.linalg.norm(normal, axis=1, keepdims=True)
    return Surface(
        part=part,
        facets=facets,
        blocks=blocks,
        points=vertices[blocks],
        normals=normals,
        measured=normals,
        tangents=tangents(normals),
        weights=weights,
    )


def _weights(space: fem.FunctionSpace, normal: Array, test: Any, measure: Any, blocks: Entities) -> Any:
    """The integrals of the basis functions, (m,); of curved cells the sizes of those times the normal.

    With the latter a uniform pressure has exactly the forces of its nodal values, whatever the curve.
    """
    if facet_integrals.is_curved(space):
        return np.asarray(np.linalg.norm(normal, axis=1))
    ones = ufl.as_vector([fem.Constant(space.mesh, 1.0)] * space.mesh.geometry.dim)
    return np.asarray(nodal(ufl.inner(ones, test) * measure)[blocks, 0])


def component_dofs(blocks: Entities, directions: Array) -> tuple[Integers, Array]:
    """The scalar dofs (m,) of directions along an axis of their vertex's frame, and the directions' signs (m,).

    Args:
        blocks: local indices of the vertices, (m,).
        directions: unit vectors, each along an axis, (m, d).
    """
    axis = np.argmax(np.abs(directions), axis=1)
    return blocks.astype(np.int64) * directions.shape[1] + axis, np.sign(directions[np.arange(len(axis)), axis])
