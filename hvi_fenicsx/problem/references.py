"""What residual forces, tractions and distances are relative to, body by body: one answer for solvers and certificate.

Bodies share no force, so none may hide behind another's stress. Forces are relative to the loads of a body. Where it is
moved too (by prescribed values, bounds, laws that push), they are relative to what its supports, contact and laws take
up, if that is more. What prescribed values make of the equations next to them depends on the mesh and says nothing
about the body's forces.
"""

from __future__ import annotations

import functools
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt
from dolfinx import fem, la
from mpi4py import MPI

from ..mesh import facets as facet_sizes
from ..mesh import nodes
from ..typing import Array, Entities, Integers, Mask
from .facets import function_integrals
from .law_term import LawTerm
from .problem import Problem
from .scaling import DEFAULT


@dataclass(frozen=True)
class References:
    """The references of one problem; all arrays by body have the length B.

    Attributes:
        problem: the problem.
        load: Euclidean norm of the nodal loads that no support takes up at once, by body.
        scale: stress in units of p0, and displacement in units of u0, that drives the body, at most 1, by body.
        moved: whether something else than loads drives the body, by body.
        driven: whether anything drives it, by body.
        holding: which scalar dofs of this rank's vertices supports, contact and laws act on, (n,).
    """

    problem: Problem
    load: Array
    scale: Array
    moved: Mask
    driven: Mask
    holding: Mask

    def norms(self, values: Array) -> Array:
        """Euclidean norms of values at this rank's vertices, any shape of (vertices, d), by body. Collective."""
        by_vertex = values.reshape(-1, self.problem.dimension)
        squares = np.einsum("vd,vd->v", by_vertex, by_vertex)  # a sum over a short axis is much slower
        return np.sqrt(_sums(self.problem, squares))

    def largest(self, blocks: npt.NDArray[np.integer], values: Array) -> Array:
        """The largest of values (m,) at vertices, at least 0, by body. Collective.

        Args:
            blocks: the vertices, local, (m,).
            values: what is compared; what is no number counts as infinite.
        """
        labels, known = self.problem.bodies.labels[blocks], np.where(np.isnan(values), np.inf, values)
        found = np.array([np.max(known, initial=0.0, where=labels == body) for body in range(self.count)])
        self.problem.comm.Allreduce(MPI.IN_PLACE, found, op=MPI.MAX)
        return found

    @property
    def count(self) -> int:
        """B."""
        return len(self.problem.bodies.bodies)

    def at(self, blocks: npt.NDArray[np.integer]) -> Array:
        """``scale`` at local vertices (m,), (m,)."""
        return self.scale[self.problem.bodies.labels[blocks]]

    def displacements(self, u: Array) -> Array:
        """The largest component of a displacement, by body; where nothing drives, at least its scale. Collective.

        Of a body that nothing drives only rounding moves, and rounding is relative to no displacement.

        Args:
            u: at this rank's vertices, in units of u0, any shape of (vertices, d).
        """
        sizes = functools.reduce(np.maximum, np.abs(u.reshape(-1, self.problem.dimension)).T)
        found = self.largest(np.arange(len(sizes)), sizes)
        return np.where(self.driven & (found > 0.0), found, np.maximum(found, self.scale))

    def forces(self, u: Array, internal: Array) -> Array:
        """What residual forces at u are relative to, as Euclidean norms of nodal forces, by body. Collective.

        Where loads and reactions are less than a small part of stiffness times displacement (a body that moves as a
        whole), that part.

        Args:
            u: at this rank's vertices, in units of u0, (vertices, d).
            internal: the elastic forces there, likewise; only those at supports, contact and laws are looked at.
        """
        held: Array = np.zeros(self.count)
        if np.any(self.moved):
            held = np.where(self.moved, self.norms(np.where(self.holding, internal.ravel(), 0.0)), 0.0)
        least = DEFAULT.least_force * self.displacements(u) * self.surface
        return np.maximum(np.maximum(self.load, held), least)

    @functools.cached_property
    def surface(self) -> Array:
        """Norm of the nodal forces of a unit traction on a block of unit size with as many vertices, by body.

        Collective when first used.
        """
        d, owned = self.problem.dimension, self.problem.space.dofmap.index_map.size_local
        return _sums(self.problem, np.ones(owned)) ** (-(d - 1) / (2 * d))

    def traction_scale(self, term: LawTerm) -> Array:
        """What a law's j' is judged by at its vertices: its own size, but at least a share of the body's, (m,).

        A linear law has no size of its own.
        """
        own = 0.0 if term.exact.is_linear else term.exact.traction_scale
        return np.maximum(own, DEFAULT.law_scale * self.at(term.surface.blocks) / term.multiplier)


def of(problem: Problem, load: Array) -> References:
    """The references of a problem. Collective.

    Args:
        problem: the problem.
        load: the nodal loads at this rank's vertices, not lifted, (vertices, d).
    """
    n, d = load.shape
    holding = np.zeros(n * d, dtype=bool)
    for surface in problem.surfaces:
        holding[surface.dofs] = True
    holding[problem.fixed_here] = True
    free = load.copy()
    free.reshape(-1)[problem.fixed_here] = 0.0
    everywhere = np.ones(len(problem.bodies.bodies))
    found = References(problem, everywhere, everywhere, everywhere > 0, everywhere > 0, holding)
    loaded, moved = _sums(problem, np.linalg.norm(load, axis=1)), demanded(problem)
    drive = np.maximum(loaded, moved)
    scale = np.where(drive > 0.0, drive / (np.max(drive) or 1.0), 1.0)
    return replace(found, load=found.norms(free), scale=scale, moved=moved > 0.0, driven=drive > 0.0)


def demanded(problem: Problem) -> Array:
    """The sum of what laws push at rest, or the largest displacement that is demanded, by body. Collective.

    Args:
        problem: the problem.
    """
    force, displacement = np.zeros((2, len(problem.bodies.bodies)))
    for term in problem.terms:
        rest = np.zeros(len(term.surface.blocks))
        force += _sums(problem, term.weights * _outside(rest, *term.law.interval(rest)), term.surface.blocks)
    for bounds in problem.bounds:
        away = _outside(np.zeros_like(bounds.lower), bounds.lower, bounds.upper)
        np.maximum.at(displacement, problem.bodies.labels[bounds.surface.blocks], away)
    prescribed = fem.Function(problem.space)
    for condition in (one.condition for one in problem.prescribed):
        condition.set(prescribed.x.array)
    sizes = np.max(np.abs(prescribed.x.array.reshape(-1, problem.dimension)), axis=1)
    np.maximum.at(displacement, problem.bodies.labels, sizes)
    problem.comm.Allreduce(MPI.IN_PLACE, displacement, op=MPI.MAX)
    return np.maximum(force, displacement)


def _outside(x: Array, lower: Array, upper: Array) -> Array:
    return np.maximum(np.maximum(lower - x, x - upper), 0.0)


def _sums(problem: Problem, values: Array, blocks: Entities | slice = slice(None)) -> Array:
    """Sums of values at this rank's vertices, or at some of them, by body, over all ranks. Collective."""
    labels = problem.bodies.labels[blocks][: len(values)]
    found = np.bincount(labels, weights=values, minlength=len(problem.bodies.bodies))
    return problem.comm.allreduce(found)


def lumped(problem: Problem, facets: Entities) -> Array:
    """The lumped length (m) or area (m²) of facets at each vertex that this rank owns, (n,). Collective.

    Args:
        problem: the problem.
        facets: local facets.
    """
    own = facet_sizes.owned(problem.domain.mesh, facets)
    found = la.vector(problem.space.dofmap.index_map)
    if len(own):
        np.add.at(found.array, nodes.facet_nodes(problem.space, own), function_integrals(problem.space, own))
    found.scatter_reverse(la.InsertMode.add)
    return found.array[: problem.space.dofmap.index_map.size_local]


def elastic_forces(problem: Problem, u: fem.Function) -> Array:
    """a(u, v) of the test functions by cells, (blocks, d): strains first, travel leaves them its rounding. Collective.

    Args:
        problem: the bodies.
        u: nondimensional, ghosts updated.
    """
    bulk, strains = problem.bulk, strained(problem, u)
    if strains is u or bulk.foundation is None:
        return bulk.force(strains)
    travel = fem.Function(problem.space)
    travel.x.array[:] = u.x.array - strains.x.array
    return bulk.force(strains) + bulk.foundation_force(travel)


def strained(problem: Problem, u: fem.Function) -> fem.Function:
    """A displacement, of each body that travels far without the rigid motion that is nearest to it. Collective.

    Args:
        problem: the bodies.
        u: nondimensional, ghosts updated.

    Returns:
        u itself where none is.
    """
    comm, found = problem.comm, u
    for places, owned, motions in problem.once("rigid motions of displacements", None, lambda: _motions(problem)):
        values = u.x.array[places]
        with np.errstate(invalid="ignore"):  # what is no number is told by who judges it
            share = comm.allreduce(motions[:, :owned] @ values[:owned])
            rest = values - share @ motions
        if share @ share > DEFAULT.travel**2 * comm.allreduce(rest[:owned] @ rest[:owned]):
            found = u.copy() if found is u else found
            found.x.array[places] = rest
    return found


def _motions(problem: Problem) -> list[tuple[Integers, int, Array]]:
    """The rigid motions of each body, collective: places of its local values, those of this rank first; their number.

    The motions are orthonormal over all ranks.
    """
    points, d = problem.points / problem.scales.length, problem.dimension
    here, every = problem.space.dofmap.index_map.size_local, list[tuple[Integers, int, Array]]()
    for body in problem.bodies:
        blocks = np.flatnonzero(problem.bodies.labels == body.index)
        fields = problem.bodies.fields(points[blocks], blocks, body).transpose(1, 0, 2)
        places = (blocks[:, None] * d + np.arange(d)).ravel()
        values, owned = fields.reshape(len(fields), -1), d * int(np.count_nonzero(blocks < here))
        factor = np.linalg.cholesky(problem.comm.allreduce(values[:, :owned] @ values[:, :owned].T))
        every.append((places, owned, np.linalg.solve(factor, values)))
    return every
