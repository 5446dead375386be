"""What the mesh does not see of the data on the boundary: tractions, prescribed displacements and gaps within facets.

A traction that varies within a facet moves the body within the depth of a cell, where neither the solution nor the
bubbles follow; the energy is that of the displacement that it causes (:mod:`.facet_modes`), in modes from the degree of
the solution on, and of higher order where the mesh resolves the traction. Of a prescribed displacement the bubbles take
what twice the degree holds. A gap is known to the discrete problem at the nodes only. Within a facet its own variation
moves the pressure to where the gap is smallest; the pressure that solves this contact problem of one facet is found.
"""

from __future__ import annotations

import functools
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from dolfinx import fem
from mpi4py import MPI

from ...problem.problem import Bounds, PrescribedComponent, Problem
from ...runtime.mpi import total
from ...typing import Array, Entities
from ..contact_state import ContactState
from . import boundary_data
from .bubbles import of_facet, shape
from .contact_facets import PartTrace
from .facet_modes import FacetModes, facet_modes
from .facet_pressure import redistributed
from .thresholds import EstimateThresholds

_ALONG = 1e-6
"""Share of a mean normal along an axis from which it has a component there."""


def squares(
    problem: Problem, bubbles: fem.FunctionSpace, states: Sequence[ContactState], thresholds: EstimateThresholds
) -> Array:
    """η_K² of the owned cells that the data within facets add. Collective.

    Args:
        problem: what was solved.
        bubbles: the space of bubbles.
        states: of the parts of Γc at the solution.
        thresholds: how finely the data are sampled.
    """
    found = np.zeros(problem.domain.mesh.topology.index_map(problem.scales.dimension).size_local)

    known: dict[int, FacetModes] = {}

    def modes(facets: Entities) -> FacetModes:
        if id(facets) not in known:
            known[id(facets)] = facet_modes(problem, bubbles, facets, thresholds)
        return known[id(facets)]

    for facets, axis, value in boundary_data.tractions(problem):
        on = modes(facets)
        rest = on.energies(
            np.asarray(on.of(value) / problem.scales.stress), on.compliance[:, axis], lowest=on.facets.degree
        )
        np.add.at(found, on.facets.cells, rest)
    for part in problem.prescribed:
        if boundary_data.varies(part.value):
            on = modes(part.facets)
            np.add.at(found, on.facets.cells, _unprescribed(problem, on, part))
    for obstacle in _obstacles(problem, states, modes, thresholds.near):
        np.add.at(found, obstacle.on.facets.cells, _moved_pressure(problem, bubbles, obstacle, thresholds))
    return found


def _unprescribed(problem: Problem, on: FacetModes, part: PrescribedComponent) -> Array:
    """Energies of what interpolation of twice the degree leaves of a prescribed displacement, (f,)."""
    rest = on.beyond_nodes(part.value)
    for index in of_facet(on.facets.degree, problem.scales.dimension):
        there = on.beyond_nodes(part.value, np.array([index]) / sum(index))
        rest -= there * shape(index, on.barycentric)
    rest /= problem.scales.displacement
    return on.energies_of_displacements(rest, on.compliance[:, part.component])


@dataclass(frozen=True)
class _Obstacle:
    """One side's gap of a part with contact, nondimensional.

    Attributes:
        bounds: of the part.
        push: pressure of the body against it at the nodes, (m,).
        gap: distance from it at the nodes, (m,).
        within: what interpolation between the nodes leaves of the gap at the sample points, (f, q).
        on: the facets of the part.
    """

    bounds: Bounds
    push: Array
    gap: Array
    within: Array
    on: FacetModes


def _obstacles(
    problem: Problem, states: Sequence[ContactState], modes: Callable[[Entities], FacetModes], rounding: float
) -> Iterator[_Obstacle]:
    """The sides of the parts with contact whose gap varies within facets by more than rounding. Collective."""
    for bounds, lower, upper in boundary_data.gaps(problem):
        state = next(s for s in states if s.surface is bounds.surface)
        for value, sign, bound in ((lower, -1.0, bounds.upper), (upper, 1.0, -bounds.lower)):
            if value is None:
                continue
            on = modes(bounds.surface.facets)
            within = np.asarray(-sign * on.beyond_nodes(value) / problem.scales.displacement)
            if problem.domain.mesh.comm.allreduce(float(np.max(np.abs(within), initial=0.0)), op=MPI.MAX) > rounding:
                push, gap = sign * state.contact_pressure, bound + sign * state.normal
                yield _Obstacle(bounds, np.maximum(push, 0.0), np.maximum(gap, 0.0), within, on)


def _moved_pressure(
    problem: Problem, bubbles: fem.FunctionSpace, obstacle: _Obstacle, thresholds: EstimateThresholds
) -> Array:
    """Energies of what a gap's variation within the facets changes of the contact pressure, (f,). Collective."""
    surface, on = obstacle.bounds.surface, obstacle.on
    trace = PartTrace(problem, bubbles, surface, surface.normals[:, None, :], 1)
    normals = trace.at_nodes(surface.normals).mean(axis=1)
    compliance = np.sum(normals**2 * on.compliance, axis=1) / np.sum(normals**2, axis=1)
    pushes, gaps = (on.interpolated(trace.at_nodes(v[:, None])[:, :, 0]) for v in (obstacle.push, obstacle.gap))
    solve = functools.partial(
        redistributed,
        comm=problem.domain.mesh.comm,
        on=on,
        pushes=pushes,
        compliance=compliance,
        free=not _held(problem, surface.normals),
        thresholds=thresholds,
    )
    return on.energies(solve(gaps=gaps + obstacle.within) - solve(gaps=gaps), compliance, lowest=0)


def _held(problem: Problem, normals: Array) -> bool:
    """Whether a prescribed component holds the body against a translation along a part's mean normal. Collective."""
    mean = [abs(total(problem.domain.mesh.comm, float(along))) for along in normals.sum(axis=0)]
    return any(mean[part.component] > _ALONG * max(mean) for part in problem.prescribed)
