"""Supports, contact and laws whose part ends within a facet: they act on this facet as a whole, or not at all.

Where a part ends that holds the body firmly, its traction is K/√(2πr), as at the tip of a crack. Moving the end by δ
then costs the energy G δ for each length of the end, with G = K·L⁻¹·K/4 (Irwin; half of a crack, L⁻¹ of
:mod:`.half_space`), and the squared energy norm of the difference is twice that. K follows from the mean traction over
the facets at the end, 2K/√(2πh). A law that gives way has a bounded traction, which is too much beyond the end, or
lacks before it, as a load does (:mod:`.part_ends`).
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from dolfinx import fem, la

from ...mesh import facets as facet_sizes
from ...mesh import nodes
from ...problem import part_areas, spaces
from ...problem.problem import Problem
from ...typing import Array, Entities, Mask
from ..contact_state import ContactState
from .facet_modes import FacetModes


def energies(on: FacetModes, missing: Array, tractions: Array) -> Array:
    """η_K² of facets on which a firm hold ends elsewhere than in the scene, (f,).

    Args:
        on: the facets.
        missing: 1 at the sample points that the mesh does not hold, -1 at those that it holds too much, (f, q).
        tractions: the mean ones over the facets at the end, (f, d).
    """
    moved = np.sum(on.weights * missing, axis=1)
    costs = np.pi**2 / 4.0 * np.abs(moved) * on.facets.areas * np.sum(tractions**2 * on.compliance, axis=1)
    return np.asarray(costs * np.where(moved > 0.0, _of_lacking(on.facets.degree, np.abs(moved)), 1.0))


def _of_lacking(degree: int, share: Array) -> Array:
    """What the cost of moving the end is multiplied by where u_h is not held on a share of the facet, (f,).

    u_h lies on the scene's own end too late, and what it costs is not orthogonal to what the mesh costs: both
    together have the square of the latter and 2 ∫ p·u_h ds less the cost, p being the traction of the true solution.
    Had u_h the true opening √r, the integral would be the cost; it has that which interpolates it from node to node.
    """
    if degree == 1:
        work = 4.0 / 3.0 * np.sqrt(share)
    else:
        work = 4.0 / 3.0 * (2.0**1.5 - 1.0) * np.sqrt(share) - 16.0 / 15.0 * (2.0**1.5 - 2.0) * share**1.5
    return np.asarray(np.maximum(4.0 / np.pi * work - 1.0, 0.0))


def firmness(on: FacetModes, rates: Array) -> Array:
    """How far a law holds as a support does, from 0 to 1 along each axis, (f, d).

    Args:
        on: the facets.
        rates: by which its tractions rise with the displacement, means over the facets at the end, (f, d).
    """
    beside = rates * on.compliance
    return np.asarray(beside / (1.0 + beside))


def mean(on: FacetModes, ends: Array) -> Array:
    """The mean over those corners of each facet at which a part ends, (f, d).

    Args:
        on: the facets.
        ends: as :func:`at_ends` gives them, local blocks (n, d).
    """
    values = ends[on.facets.corners]
    count = np.any(values, axis=2).sum(axis=1)
    return np.asarray(values.sum(axis=1) / np.maximum(count, 1)[:, None])


def yielding(problem: Problem, part: str, states: Sequence[ContactState]) -> tuple[Array, Array]:
    """What laws of a part put on the body where they are off their kinks, and how fast it rises; owned blocks (n, d).

    Args:
        problem: what was solved.
        part: its name.
        states: of the parts of Γc.

    Returns:
        Nodal forces, and those for a unit of displacement along each axis.
    """
    forces = np.zeros((problem.space.dofmap.index_map.size_local, problem.scales.dimension))
    rates = np.zeros_like(forces)
    for state in (state for state in states if state.surface.part == part):
        for law in state.laws:
            weights = np.where(law.on_convex_kink(), 0.0, state.surface.weights)
            vectors = np.einsum("mk,mkd->md", law.carried, law.term.directions)
            np.subtract.at(forces, state.surface.blocks, weights[:, None] * vectors)
            rising = law.term.law.convex.second(law.argument) - law.term.law.concave.second(law.argument)
            rising = weights * law.term.multiplier * np.maximum(rising, 0.0) / law.term.stretch
            np.add.at(rates, state.surface.blocks, rising[:, None] * np.sum(law.term.directions**2, axis=1))
    return forces, rates


def at_ends(problem: Problem, part: Entities, beyond: Entities, forces: Array, reaction: Array) -> Array:
    """The mean tractions over the facets of a part that meet at a vertex of its end, local blocks (n, d). Collective.

    What holds the body beyond the end as well, along the same axis, is no end and is taken off.

    Args:
        problem: what was solved.
        part: the local facets of the part.
        beyond: those of the same sides that are not in it.
        forces: on the part, owned blocks (n, d).
        reaction: of everything, owned blocks (n, d).
    """
    here, there = (_areas(problem, facets) for facets in (part, beyond))
    own = _means(problem, part, forces, here, here > 0.0)
    other = _means(problem, beyond, reaction, there, here == 0.0)
    left = np.where(own * other > 0.0, np.sign(own) * np.maximum(np.abs(own) - np.abs(other), 0.0), own)
    return np.where(((here > 0.0) & (there > 0.0))[:, None], left, 0.0)


def _areas(problem: Problem, facets: Entities) -> Array:
    """The lumped areas of facets at the local nodes, nondimensional, (n,). Collective."""
    found = la.vector(problem.space.dofmap.index_map)
    owned = part_areas.lumped(problem, facets) / problem.scales.length ** (problem.scales.dimension - 1)
    found.array[: len(owned)] = owned
    found.scatter_forward()
    return np.asarray(found.array, dtype=np.float64)


def _means(problem: Problem, facets: Entities, forces: Array, areas: Array, counted: Mask) -> Array:
    """The mean traction over the facets that meet at a vertex, of the nodes that count, local blocks (n, d).

    Collective.
    """
    space, d, owned = problem.space, problem.scales.dimension, len(forces)
    field, count = fem.Function(space), la.vector(space.dofmap.index_map)
    values = field.x.array.reshape(-1, d)
    values[:owned] = forces / np.where(areas > 0.0, areas, np.inf)[:owned, None]
    field.x.scatter_forward()
    on = nodes.facet_nodes(space, facet_sizes.owned(problem.domain.mesh, facets))
    weights = spaces.facet_weights(space, np.ones(len(on))) * counted[on]
    whole = weights.sum(axis=1)
    means = np.einsum("fn,fnd->fd", weights, values[on]) / np.where(whole > 0.0, whole, np.inf)[:, None]
    values[:] = 0.0
    for corner in on[:, :d].T:
        np.add.at(values, corner, means)
        np.add.at(count.array, corner, 1.0)
    for vector in (field.x, count):
        vector.scatter_reverse(la.InsertMode.add)
        vector.scatter_forward()
    return np.asarray(values / np.maximum(count.array, 1.0)[:, None])
