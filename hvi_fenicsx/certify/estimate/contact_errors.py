"""The estimated errors of the slip and of -σ_t on Γc: the defect's influence on the vertices, by the system's inverse.

The bubbles e of the defect say what a finer mesh would add between the vertices. Tested with P1 functions, they and the
laws between the vertices leave a force on u_h, and what moves under it is the error at the vertices.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from dolfinx import fem, la

from ...effects import Direction
from ...problem.problem import Problem
from ...runtime.mpi import total
from ...system.levels import Levels
from ...system.system import System
from ...typing import Array
from ..certificate import Examination
from ..contact_state import ContactState
from . import defect, edge_bubbles
from .dual_norm import Dual
from .law_traces import Along, Change, law, pointwise

_TIMES, _ROUNDS = 2, 4
_PLACE = 1 / (2 * np.sqrt(12))
"""Of a facet: the standard deviation of a drop's place, which may be anywhere in half of it."""
_SETTLED = 0.05
"""Of the correction's energy norm, what a further round may change."""


@dataclass(frozen=True)
class OnContact:
    """Estimated errors on Γc, relative: of the slip in L2, of -σ_t in L1 (0 without a law along Γc).

    ``moved`` is u_h with its estimated error at the vertices, nondimensional.
    """

    slip: float
    friction: float
    moved: fem.Function


def on_contact(system: System, levels: Levels, u: fem.Function, examination: Examination) -> OnContact:
    """Estimate the errors of slip and -σ_t, what smoothing changes included. Collective.

    Args:
        system: what was solved.
        levels: its coarser levels; none where there is no mesh hierarchy.
        u: its solution, nondimensional, ghosts updated.
        examination: of the same u.

    Nearly incompressible regions are not for this: their averaged pressure is not in the bubbles' force.
    """
    inverse = Dual(system, levels, u)
    change = _change(system, u, examination, inverse)
    unsure = _unsure(system.problem, u, examination, inverse, change)
    inverse.destroy()
    slips = [_slip(system.problem, state, u, change, unsure) for state in examination.states]
    tractions = [
        _traction(system.problem, state, number, u, change, unsure)
        for state in examination.states
        for number, law in enumerate(state.laws)
        if law.term.direction is Direction.SLIP
    ]
    comm = system.comm
    apart, whole = (total(comm, sum(pair[i] for pair in slips)) for i in (0, 1))
    known, unknown, carried = (total(comm, sum(sizes[i] for sizes in tractions)) for i in (0, 1, 2))
    away = float(np.hypot(known, unknown))
    change.vertices.x.array[:] += u.x.array
    return OnContact(float(np.sqrt(ratio(apart, whole))), ratio(away, carried), change.vertices)


def ratio(part: float, whole: float) -> float:
    """Part over whole; infinite where there is no whole, but 0 of nothing."""
    return part / whole if whole > 0 else (np.inf if part > 0 else 0.0)


def _change(system: System, u: fem.Function, examination: Examination, inverse: Dual) -> Change:
    """The defect with its influence on the vertices and, from the second time on, theirs on it. Collective."""
    problem = system.problem
    space, moved = edge_bubbles.space(problem.domain.mesh), fem.Function(problem.space)
    change, stiffness = None, edge_bubbles.Stiffness(problem, space)
    residual = problem.bulk.residual_in(space, u, problem.linear.values())
    for _ in range(_TIMES):
        edges, _ = pointwise(problem, space, u, examination.states, change)
        load = residual - edges - problem.bulk.force_in(space, moved)
        change = Change(moved, defect.least(stiffness, u, load))
        _answer(problem, u, examination, inverse, change)
    assert change is not None
    return change


def _answer(problem: Problem, u: fem.Function, examination: Examination, inverse: Dual, change: Change) -> None:
    """Move the vertices as the bubbles ask; the laws answer that, so it takes a few rounds. Collective."""
    size, bubbling = 0.0, problem.bulk.force_in(problem.space, change.edges)
    for _ in range(_ROUNDS):
        _, laws = pointwise(problem, change.edges.function_space, u, examination.states, change)
        step, length = inverse.solve(laws - problem.bulk.force_in(problem.space, change.vertices) - bubbling)
        change.vertices.x.array[:] += step.x.array
        size = max(size, length)
        if length <= _SETTLED * size:
            break


def _unsure(problem: Problem, u: fem.Function, examination: Examination, inverse: Dual, change: Change) -> fem.Function:
    """What the vertices may move because bubbles do not see where in half an edge a drop lies, P1. Collective.

    The facets' places are independent of each other, so n of them add up to a root of n times the effect of one.
    """
    d, comm = problem.scales.dimension, problem.domain.mesh.comm
    force, count = fem.Function(problem.space), 0
    for state in examination.states:
        for number in range(len(state.laws)):
            along, tau = _drops(problem, change.edges.function_space, u, state, number)
            force.x.array[:] += along.tested(tau)[1].ravel()
            count += int(np.count_nonzero(np.any(tau, axis=(1, 2))))
    force.x.scatter_reverse(la.InsertMode.add)
    owned = problem.space.dofmap.index_map.size_local
    moved, _ = inverse.solve(force.x.array.reshape(-1, d)[:owned])
    moved.x.array[:] /= np.sqrt(max(comm.allreduce(count), 1))
    return moved


def _drops(
    problem: Problem, space: fem.FunctionSpace, u: fem.Function, state: ContactState, number: int
) -> tuple[Along, Array]:
    """A law's drops on the facets within which they lie, spread over their uncertain share of them, (f, q, k)."""
    term = state.laws[number].term
    along, concave = Along(problem, space, state.surface, term.directions), term.exact.concave
    ends = along.at_vertices(state.laws[number].argument[:, None])[:, :, 0]
    height = np.zeros(len(ends))
    for kink, jump in zip(concave.kinks, concave.jumps, strict=True):
        height += jump * ((ends.min(axis=1, initial=np.inf) < kink) & (kink < ends.max(axis=1, initial=-np.inf)))
    slip = along.linear(u)
    length = np.linalg.norm(slip, axis=2, keepdims=True)
    unit = np.divide(slip, length, out=np.zeros_like(slip), where=length > 0)
    return along, _PLACE * height[:, None, None] * unit


def _slip(
    problem: Problem, state: ContactState, u: fem.Function, change: Change, unsure: fem.Function
) -> tuple[float, float]:
    """∫ of the squares of the slip's change and of the slip over this rank's share of a part. Collective."""
    along = Along(problem, change.edges.function_space, state.surface, state.surface.tangents)
    added, slip = along.linear(change.vertices) + along.quadratic(change.edges), along.linear(u)
    fields = added, along.linear(unsure), slip
    squares = [float(np.sum(along.weights * np.sum(values**2, axis=2))) for values in fields]
    return squares[0] + squares[1], squares[2]


def _traction(
    problem: Problem, state: ContactState, number: int, u: fem.Function, change: Change, unsure: fem.Function
) -> tuple[float, float, float]:
    """∫ of the law's change against the interpolated nodal tractions, of what is unsure of it, of those. Collective."""
    space, further = change.edges.function_space, fem.Function(problem.space)
    further.x.array[:] = change.vertices.x.array + unsure.x.array
    along, nodal, tau = law(problem, space, u, state, number, change)
    _, _, other = law(problem, space, u, state, number, Change(further, change.edges))
    known, unknown, carried = (
        float(np.sum(along.weights * np.linalg.norm(values, axis=2))) for values in (tau - nodal, other - tau, nodal)
    )
    return known, unknown, carried
