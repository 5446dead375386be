"""Do the forces balance? At every vertex, and along every rigid motion of a body that its supports leave.

Rounding of the stresses excuses no net force: only what rounding makes of the sum of the forces does.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator, Sequence

import numpy as np
from dolfinx import fem, la

from ..mesh import nodes
from ..problem import spaces
from ..problem.problem import Problem
from ..problem.references import References
from ..problem.vectors import NodalForces
from ..runtime.mpi import largest
from ..system import rigid_motions as rigid_balance
from ..system.rigid_motions import ActingForces, Holder, Motions
from ..typing import Array
from .contact_state import ContactState, Forces


def unbalanced(problem: Problem, reaction: Array, parts: Sequence[ContactState]) -> Array:
    """The reaction without what supports, contact and laws may carry: zero in equilibrium; (blocks, d).

    Args:
        problem: the supports.
        reaction: internal forces minus loads, (blocks, d).
        parts: contact and laws.
    """
    rest = reaction.copy()
    rest.reshape(-1)[problem.fixed_here] = 0.0
    for state in parts:
        carried = [law.term.directions for law in state.laws]
        if state.bounds is not None:
            carried.append(state.surface.normals[:, None, :])
        for directions in carried:
            here = rest[state.surface.blocks]
            along = np.einsum("mkd,md->mk", directions, here)
            rest[state.surface.blocks] = here - np.einsum("mk,mkd->md", along, directions)
    return rest


def rounding_sample(problem: Problem, u: Array) -> Array:
    """Forces of a displacement's last digits, shuffled: what rounding makes of its forces, (blocks, d). Collective.

    Args:
        problem: what was solved.
        u: nondimensional, a local array.
    """
    shuffled = fem.Function(problem.space)
    signs = np.random.default_rng(problem.comm.rank).choice([-1.0, 1.0], len(u))
    shuffled.x.array[:] = u * signs * np.finfo(float).eps
    shuffled.x.scatter_forward()
    return problem.combined(problem.bulk.force(shuffled))


def net_forces(
    references: References,
    forces: Forces,
    states: Sequence[ContactState],
    u: fem.Function,
    carried: Array | None = None,
) -> Array:
    """The largest net force or moment along a rigid motion that nothing carries, by body. Collective.

    It is relative to the loads' net force along the same motion, or to what contact and laws carry or could carry
    there. What rounding makes of the sum of these forces is taken off; what it makes of the stresses is not.

    Args:
        references: of the problem that was solved.
        forces: at u.
        states: of the parts of Γc at u; none where it is known what contact and laws carry.
        u: nondimensional, ghosts updated.
        carried: this, nodal forces at this rank's vertices, (vertices, d); they could carry nothing else.
    """
    problem = references.problem
    foundation = -problem.combined(problem.bulk.foundation_force(u))
    given = [foundation] if carried is None else [foundation, carried]
    left, holders = sum(given, forces.pushing), [holder for state in states for holder in _holders(state)]
    for one in (holder.forces for holder in holders):
        left[one.blocks] += one.values
    acting = ActingForces(
        left=left,
        loads=NodalForces.of(forces.pushing),
        carried=[NodalForces.of(force) for force in given],
        holders=holders,
    )
    closed = [(state.surface, state.contact) for state in states]
    motions, able = (Motions.of(problem, body, closed) for body in problem.bodies), rigid_balance.capable(problem)
    return np.array([rigid_balance.along(references, one, acting, able).beyond_rounding for one in motions])


def _holders(state: ContactState) -> Iterator[Holder]:
    """What contact and laws of a part give, as far as they may, and what else they might give."""
    surface = state.surface

    def holder(direction: Array, weights: Array, *tractions: Array) -> Holder:
        return Holder(surface.blocks, direction, *(weights * traction for traction in tractions))

    if state.bounds is not None:
        yield holder(surface.normals, surface.weights, allowed_pressure(state), *_pressures(state))
    for law in state.laws:
        low, high = law.term.law.interval(law.argument, law.near)
        for k in range(law.allowed.shape[1]):
            least, most = -high, -low
            if (length := law.term.length) is not None:
                stuck, given = law.argument <= law.near, -law.allowed[:, k]
                pull = length.factors[k] * high
                least = np.where(stuck, -pull, given)
                most = np.where(stuck, pull * length.two_sided()[k], given)
            yield holder(law.term.directions[:, k], law.term.weights, -law.allowed[:, k], least, most)


def _pressures(state: ContactState) -> tuple[Array, Array]:
    """The least and the largest σ_n that contact may carry, (m,): no pull at the upper bound, no push at the lower."""
    return np.where(state.on_upper, -np.inf, 0.0), np.where(state.on_lower, np.inf, 0.0)


def allowed_pressure(state: ContactState) -> Array:
    """The part of σ_n on its bounds that contact may carry, (m,)."""
    return np.clip(state.contact_pressure, *_pressures(state))


_STEPS = 12
"""Steps of the lattice of points on a facet's edges."""


def largest_penetration(problem: Problem, states: Sequence[ContactState]) -> float | None:
    """The largest penetration anywhere on Γc, nondimensional, at least 0; None at degree 1. Collective.

    Args:
        problem: what was solved.
        states: of its parts.
    """
    if nodes.degree(problem.space) == 1:
        return None
    found = 0.0
    for state in states:
        if state.bounds is not None:
            for beyond in (state.normal - state.bounds.upper, state.bounds.lower - state.normal):
                found = max(found, _largest(problem, state, beyond))
    return largest(problem.comm, found)


def _largest(problem: Problem, state: ContactState, beyond: Array) -> float:
    """The largest value on this rank's facets of a function with coefficients at a part's nodes, (m,). Collective."""
    everywhere = la.vector(problem.space.dofmap.index_map)
    everywhere.array[:] = -np.inf
    everywhere.array[state.surface.blocks] = beyond
    everywhere.scatter_forward()
    steps = itertools.product(range(_STEPS + 1), repeat=problem.dimension)
    lattice = np.array([step for step in steps if sum(step) == _STEPS]) / _STEPS
    functions = spaces.simplex_functions(nodes.degree(problem.space), lattice, spaces.edge_share(problem.space))
    local = everywhere.array[nodes.facet_nodes(problem.space, state.surface.facets)]
    return float(np.max(local[np.all(np.isfinite(local), axis=1)] @ functions.T, initial=0.0))
