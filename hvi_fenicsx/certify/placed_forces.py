"""The forces on the body, place by place: loads, and what supports, contact, laws and springs give. Nondimensional."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import ufl
from dolfinx import fem
from mpi4py import MPI

from ..effects import Place
from ..problem.contact_surface import Surface, own_nodes
from ..problem.problem import Problem
from ..problem.vectors import NodalForces, nodal, nodal_values
from ..typing import Array
from .contact_state import ContactState, Forces

SECOND = ".second"
"""What the name of an interface is followed by where the forces on its second body are meant."""


@dataclass(frozen=True)
class PlacedForces:
    """All that acts on the body, by the name of the place; all together are in balance.

    Given strains (heat) are not among them: no force belongs to them.

    Attributes:
        loads: the loads.
        reactions: what supports, contact, laws and springs put on the body. Where two parts prescribe the same
            component of a vertex, its reaction counts for the first of them.
    """

    loads: Mapping[str, NodalForces]
    reactions: Mapping[str, NodalForces]

    def resultants(self, comm: MPI.Comm) -> dict[str, Array]:
        """The resultant of all that acts at each place, (d,) each. Collective.

        Args:
            comm: of the mesh.
        """
        found: dict[str, Array] = {}
        for name, forces in [*self.loads.items(), *self.reactions.items()]:
            found[name] = found.get(name, 0.0) + forces.values.sum(axis=0)
        return {name: np.asarray(comm.allreduce(force)) for name, force in found.items()}


def loads(problem: Problem) -> dict[str, NodalForces]:
    """The loads by the name of their place. Collective.

    Args:
        problem: what is solved.
    """
    found: dict[str, NodalForces] = {}
    for name, form in problem.loads.items():
        if name not in problem.bulk.strains:
            _add(found, name.rpartition(".")[0], NodalForces.of(nodal_values(form)))
    return found


def reactions(
    problem: Problem, u: fem.Function, forces: Forces, states: tuple[ContactState, ...]
) -> dict[str, NodalForces]:
    """What supports, contact, laws and springs put on the body, by the name of the place. Collective.

    Args:
        problem: what was solved.
        u: its solution, ghosts updated.
        forces: at u.
        states: of the parts of Γc at u.
    """
    found = _springs(problem, u)
    left = forces.reaction.copy()
    for state in states:
        own = traction(state) * state.surface.weights[:, None]
        np.subtract.at(left, state.surface.blocks, own)
        for name, acting in _on_bodies(problem, state.surface, own):
            _add(found, name, acting)
    for one in problem.prescribed:
        own_dofs = one.dofs[one.dofs < left.size]
        support = np.zeros_like(left)
        support.ravel()[own_dofs] = left.ravel()[own_dofs]
        left.ravel()[own_dofs] = 0.0
        _add(found, one.part, NodalForces.of(support))
    return found


def _on_bodies(problem: Problem, surface: Surface, own: Array) -> Iterator[tuple[str, NodalForces]]:
    """The forces (m, d) at a part's vertices; of an interface, those on each of the two bodies. Collective."""
    if problem.interface_of(surface) is None:
        yield surface.part, NodalForces(surface.blocks, own)
        return
    every = np.zeros((problem.space.dofmap.index_map.size_local, own.shape[1]))
    every[surface.blocks] = own
    acting, first = problem.on_bodies(every), np.zeros(len(every), dtype=bool)
    first[own_nodes(problem.space, surface.facets)] = True
    yield surface.part, NodalForces.of(np.where(first[:, None], acting, 0.0))
    yield f"{surface.part}{SECOND}", NodalForces.of(np.where(first[:, None], 0.0, acting))


def second_tractions(problem: Problem, states: Sequence[ContactState]) -> Array:
    """The tractions on the second sides of interfaces at the vertices that this rank owns, NaN elsewhere, (n, d).

    Nodal forces over what the first side covers of the vertex's area. Collective.

    Args:
        problem: what was solved.
        states: of the parts of Γc.
    """
    found = np.full((problem.space.dofmap.index_map.size_local, problem.dimension), np.nan)
    for state in states:
        interface = problem.interface_of(state.surface)
        if interface is not None:
            areas, forces = np.zeros_like(found), np.zeros_like(found)
            areas[state.surface.blocks] = state.surface.weights[:, None]
            forces[state.surface.blocks] = traction(state) * state.surface.weights[:, None]
            covered, acting = -problem.on_bodies(areas), problem.on_bodies(forces)
            here = own_nodes(problem.space, problem.domain.facets([interface.sides.second]))
            here = here[covered[here, 0] > 0.0]
            found[here] = acting[here] / covered[here]
    return found


def _springs(problem: Problem, u: fem.Function) -> dict[str, NodalForces]:
    """The forces of effects that add stiffness without being a material. Collective."""
    found: dict[str, NodalForces] = {}
    for where, effect, contribution in problem.contributions:
        if effect.place is not Place.MATERIAL:
            for form in contribution.bilinear:
                _add(found, where or "body", NodalForces.of(-nodal(ufl.action(form, u))))
    return found


def _add(found: dict[str, NodalForces], name: str, forces: NodalForces) -> None:
    found[name] = found[name] + forces if name in found else forces


def traction(state: ContactState) -> Array:
    """The traction that contact and laws put on the body, (m, d).

    Args:
        state: of their part.
    """
    found = np.zeros_like(state.surface.normals)
    tied = state.surface.tied
    if tied or state.bounds is not None or any(law.term.direction.normal for law in state.laws):
        found += state.pressure[:, None] * state.surface.normals
    if tied or state.resists_slip:
        found -= np.einsum("mk,mkd->md", state.friction, state.surface.tangents)
    return found
