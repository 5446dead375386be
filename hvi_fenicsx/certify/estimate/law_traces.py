"""The laws between the vertices: what they give pointwise along Γc, tested with edge bubbles and with P1 functions.

The discrete problem knows a law at the vertices only (trapezoidal rule). Between them the slip of u_h is linear, the
nodal tractions are interpolated linearly to τ_h, and the law wants τ ∈ ∂j(u_t): here the nearest such τ to τ_h.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import basix
import numpy as np
from dolfinx import fem, la

from ...laws import Superpotential
from ...problem.contact_surface import Surface
from ...problem.problem import Problem
from ...typing import Array, Entities
from ..contact_state import ContactState
from ..thresholds import DEFAULT
from .edge_bubbles import quadrature

_DEGREE = 12
"""Of the facet rule: a drop inside an edge is met to a fourteenth of its length."""


@dataclass(frozen=True)
class Facets:
    """Facets of Γc (f of them), each with its d vertices and its edges between them.

    Attributes:
        vertices: P1 blocks (f, d). edges: bubble blocks (f, k). pairs: positions of an edge's ends in ``vertices``.
        areas: over L^(d-1), (f,).
    """

    vertices: Entities
    edges: Entities
    pairs: Sequence[tuple[int, int]]
    areas: Array


def facets(problem: Problem, bubbles: fem.FunctionSpace, local: Entities) -> Facets:
    """The vertices and edges of boundary facets whose cell this rank owns."""
    topology, d = problem.domain.mesh.topology, problem.scales.dimension
    topology.create_connectivity(d - 1, d)
    topology.create_connectivity(d, d - 1)
    of_facet, of_cell = topology.connectivity(d - 1, d), topology.connectivity(d, d - 1)
    cells = of_facet.array[of_facet.offsets[local]]
    owned = cells < topology.index_map(d).size_local
    cells, local = cells[owned], local[owned]
    number = np.argmax(of_cell.array.reshape(-1, d + 1)[cells] == local[:, None], axis=1)
    vertices = np.empty((len(local), d), dtype=np.int32)
    pairs = [(a, b) for a in range(d) for b in range(a + 1, d)]
    edges = np.empty((len(local), len(pairs)), dtype=np.int32)
    cell_edges = [tuple(e) for e in basix.topology(basix.CellType[topology.cell_name()])[1]]
    for i in range(d + 1):
        here, corners = number == i, [v for v in range(d + 1) if v != i]
        vertices[here] = problem.space.dofmap.list[cells[here]][:, corners]
        numbers = [cell_edges.index((corners[a], corners[b])) for a, b in pairs]
        edges[here] = bubbles.dofmap.list[cells[here]][:, numbers]
    points = np.asarray(problem.points[vertices] / problem.scales.length)
    return Facets(vertices, edges, pairs, _areas(points))


def _areas(points: Array) -> Array:
    """Of segments or triangles (f, d, 3)."""
    sides = points[:, 1:] - points[:, :1]
    if sides.shape[1] == 1:
        return np.asarray(np.linalg.norm(sides[:, 0], axis=1))
    return np.asarray(np.linalg.norm(np.cross(sides[:, 0], sides[:, 1]), axis=1) / 2)


def nearest(law: Superpotential, slip: Array, traction: Array) -> Array:
    """The admissible tractions of a law nearest to given ones.

    Args:
        law: j. slip, traction: (m, k); a signed slip has k = 1, else the law acts on the length of the vector.
    """
    if slip.shape[1] == 1:
        low, high = law.interval(slip[:, 0], DEFAULT.near)
        return np.asarray(np.clip(traction[:, 0], low, high)[:, None])
    length = np.linalg.norm(slip, axis=1)
    low, high = law.interval(length, DEFAULT.near)
    moving = (length > DEFAULT.near)[:, None]
    along = np.divide(slip, length[:, None], out=np.zeros_like(slip), where=moving)
    sliding = np.clip(np.sum(traction * along, axis=1), low, high)[:, None] * along
    size = np.linalg.norm(traction, axis=1)
    inside = np.divide(np.minimum(size, high), size, out=np.zeros_like(size), where=size > 0)
    return np.where(moving, sliding, inside[:, None] * traction)


def tractions(state: ContactState, number: int) -> Array:
    """The nodal tractions of one of a part's laws along its directions, (m, k)."""
    law = state.laws[number]
    return state.friction if law.term.radial else law.traction[:, None]


def spread(problem: Problem, surface: Surface, values: Array) -> Array:
    """Values at a part's owned vertices (m, k), k ≤ d, at all local vertices (n, k). Collective."""
    field = fem.Function(problem.space)
    d = problem.scales.dimension
    field.x.array.reshape(-1, d)[surface.blocks, : values.shape[1]] = values
    field.x.scatter_forward()
    return np.asarray(field.x.array.reshape(-1, d)[:, : values.shape[1]])


class Along:
    """Displacements along k directions of a part, at the q quadrature points of its f facets. Creation is collective.

    Attributes:
        weights: of the points, over L^(d-1), (f, q).
    """

    def __init__(self, problem: Problem, bubbles: fem.FunctionSpace, surface: Surface, directions: Array) -> None:
        self._problem, self._bubbles, self._surface = problem, bubbles, surface
        d = problem.scales.dimension
        self._facets = facets(problem, bubbles, surface.facets)
        each = [spread(problem, surface, directions[:, i]) for i in range(directions.shape[1])]
        self._vectors = np.stack([n[self._facets.vertices] for n in each], axis=2)  # (f, v, k, d)
        self._barycentric, weights = quadrature("interval" if d == 2 else "triangle", _DEGREE)
        self.weights: Array = self._facets.areas[:, None] * weights

    def at_vertices(self, values: Array) -> Array:
        """Values at the part's owned vertices (m, k) by facet, (f, d, k). Collective."""
        return np.asarray(spread(self._problem, self._surface, values)[self._facets.vertices])

    def interpolated(self, values: Array) -> Array:
        """Linear interpolation of values at the part's owned vertices (m, k); (f, q, k). Collective."""
        return self._linear(self.at_vertices(values))

    def linear(self, u: fem.Function) -> Array:
        """Of a P1 field, (f, q, k)."""
        blocks = u.x.array.reshape(-1, self._problem.scales.dimension)
        return self._linear(np.einsum("fvkd,fvd->fvk", self._vectors, blocks[self._facets.vertices]))

    def quadratic(self, e: fem.Function) -> Array:
        """Of edge bubbles, (f, q, k)."""
        blocks, result = e.x.array.reshape(-1, self._problem.scales.dimension), 0.0
        for i, shape, middle in self._bumps():
            at = np.einsum("fkd,fd->fk", middle, blocks[self._facets.edges[:, i]])
            result = result + at[:, None, :] * shape[None, :, None]
        return np.asarray(result)

    def tested(self, tau: Array) -> tuple[Array, Array]:
        """∫ τ·v ds of tractions (f, q, k) over this rank's facets: at edges and at vertices, local blocks (n, d)."""
        d, scaled = self._problem.scales.dimension, self.weights[:, :, None] * tau
        edges, vertices = np.zeros((_local(self._bubbles), d)), np.zeros((_local(self._problem.space), d))
        for i in range(d):
            share = np.einsum("fqk,q->fk", scaled, self._barycentric[:, i])
            np.add.at(vertices, self._facets.vertices[:, i], np.einsum("fk,fkd->fd", share, self._vectors[:, i]))
        for i, shape, middle in self._bumps():
            share = np.einsum("fqk,q->fk", scaled, shape)
            np.add.at(edges, self._facets.edges[:, i], np.einsum("fk,fkd->fd", share, middle))
        return edges, vertices

    def _linear(self, values: Array) -> Array:
        return np.asarray(np.einsum("qv,fvk->fqk", self._barycentric, values))

    def _bumps(self) -> Iterator[tuple[int, Array, Array]]:
        """Of each edge of a facet: its number, its bubble at the points (q,), its directions (f, k, d)."""
        for i, (a, b) in enumerate(self._facets.pairs):
            shape = 4 * self._barycentric[:, a] * self._barycentric[:, b]
            yield i, shape, (self._vectors[:, a] + self._vectors[:, b]) / 2


@dataclass(frozen=True)
class Change:
    """An estimated error of u_h: a P1 field and edge bubbles."""

    vertices: fem.Function
    edges: fem.Function


def law(
    problem: Problem,
    bubbles: fem.FunctionSpace,
    u: fem.Function,
    state: ContactState,
    number: int,
    change: Change | None,
) -> tuple[Along, Array, Array]:
    """One law between the vertices. Collective.

    Args:
        problem, bubbles, u, state: as solved. number: of the law within the state.
        change: what to add to u_h before the law, the unsmoothed one then, is asked; where a whole facet sticks (its
            vertices on a convex kink) nothing is.

    Returns:
        The points, the interpolated nodal tractions and those of the law nearest to them; (f, q, k) each.
    """
    own = state.laws[number]
    term = own.term
    along = Along(problem, bubbles, state.surface, term.directions)
    nodal, slip = along.interpolated(tractions(state, number)), along.linear(u)
    if change is not None:
        sticks = along.interpolated(own.on_convex_kink()[:, None].astype(float))
        added = along.linear(change.vertices) + along.quadratic(change.edges)
        slip = slip + np.where(sticks > 1 - own.near, 0.0, added)
    k, asked = slip.shape[2], term.law if change is None else term.exact
    return along, nodal, nearest(asked, slip.reshape(-1, k), nodal.reshape(-1, k)).reshape(slip.shape)


def pointwise(
    problem: Problem,
    bubbles: fem.FunctionSpace,
    u: fem.Function,
    states: Sequence[ContactState],
    change: Change | None = None,
) -> tuple[Array, Array]:
    """∫ τ·v ds of all laws tested with edge bubbles; the nodal forces minus that with P1; each (n, d). Collective."""
    d = problem.scales.dimension
    edges, vertices = np.zeros((_local(bubbles), d)), np.zeros((_local(problem.space), d))
    for state in states:
        for number, own in enumerate(state.laws):
            along, _, tau = law(problem, bubbles, u, state, number, change)
            at_edges, at_vertices = along.tested(tau)
            nodal = tractions(state, number) * state.surface.weights[:, None]
            edges += at_edges
            vertices -= at_vertices
            np.add.at(vertices, state.surface.blocks, np.einsum("mk,mkd->md", nodal, own.term.directions))
    return _gathered(bubbles, edges), _gathered(problem.space, vertices)


def _local(space: fem.FunctionSpace) -> int:
    return int(space.dofmap.index_map.size_local + space.dofmap.index_map.num_ghosts)


def _gathered(space: fem.FunctionSpace, values: Array) -> Array:
    """Local contributions (n_local, d) summed at the owned blocks, (n, d). Collective."""
    field = fem.Function(space)
    field.x.array[:] = values.ravel()
    field.x.scatter_reverse(la.InsertMode.add)
    return np.array(field.x.array.reshape(values.shape)[: space.dofmap.index_map.size_local])
