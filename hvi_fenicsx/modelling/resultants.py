"""The forces on the body, part by part: loads, what contact and laws give, reactions of supports. Nondimensional."""

from __future__ import annotations

import numpy as np
from dolfinx import fem

from ..certify import contact_state
from ..certify.contact_state import ContactState
from ..effects import Direction
from ..problem.problem import Problem
from ..problem.vectors import nodal
from ..typing import Array


def by_part(problem: Problem, u: fem.Function, states: tuple[ContactState, ...]) -> dict[str, Array]:
    """The resultant of all that acts on the body at each place, (d,) by the name of the place. Collective.

    Together they are in balance. Where two parts prescribe the same component of a vertex, its reaction counts for the
    first of them.

    Args:
        problem: what was solved.
        u: its solution, ghosts updated.
        states: of the parts of Γc.
    """
    d = problem.scales.dimension
    found: dict[str, Array] = {}
    for name, form in problem.linear.items():
        _add(found, name.rpartition(".")[0], nodal(form).sum(axis=0))
    reaction = contact_state.forces(problem, u).reaction
    for state in states:
        own = _traction(state) * state.surface.weights[:, None]
        np.subtract.at(reaction, state.surface.blocks, own)
        _add(found, state.surface.part, own.sum(axis=0))
    left = np.where(np.isin(np.arange(reaction.size), problem.fixed_here), reaction.ravel(), 0.0)
    for part, dofs in problem.held:
        own_dofs = dofs[dofs < left.size]
        forces = np.asarray(np.bincount(own_dofs % d, weights=left[own_dofs], minlength=d), dtype=np.float64)
        left[own_dofs] = 0.0
        _add(found, part, forces)
    comm = problem.domain.mesh.comm
    return {name: np.asarray(comm.allreduce(force)) for name, force in found.items()}


def _add(found: dict[str, Array], name: str, force: Array) -> None:
    found[name] = found.get(name, 0.0) + force


def _traction(state: ContactState) -> Array:
    """The traction that contact and laws put on the body, (m, d)."""
    traction = np.zeros_like(state.surface.normals)
    if state.bounds is not None or any(law.term.direction is not Direction.SLIP for law in state.laws):
        traction += state.pressure[:, None] * state.surface.normals
    if any(law.term.direction is Direction.SLIP for law in state.laws):
        traction -= np.einsum("mk,mkd->md", state.friction, state.surface.tangents)
    return traction
