"""The error that bubbles, nodes and laws make together.

The bubbles alone, on nodes that stay, see too little of it on a mesh that is too coarse for the bending of a body.
And a law that drops ties them together:
what drops within an edge leaves a force on the nodes. They move, the place of the drop moves with them, and
the force with that place. On one mesh several neighbouring nodes may be the last before the drop, each of them in
equilibrium, so the place is wrong by several edges: more than the bubbles of one edge see.
"""

from __future__ import annotations

import numpy as np
from dolfinx import fem
from mpi4py import MPI

from ...laws import Superpotential
from ...problem.problem import Problem
from ...runtime.mpi import total
from ...typing import Array
from ..law_state import LawState
from . import defect
from .bubble_stiffness import BubbleStiffness
from .dual_norm import DualNorm
from .law_traces import ErrorField, LawTraces, Trace


def within_facets(traces: LawTraces) -> bool:
    """Whether a law, as it is solved, drops between the nodes of a facet. Collective."""
    found = [
        bool(np.any(heights(traces.part(state.surface, law.term.directions), law, law.term.law)))
        for state in traces.states
        for law in state.laws
    ]
    return bool(traces.problem.domain.mesh.comm.allreduce(any(found), op=MPI.LOR))


def heights(points: Trace, law: LawState, of: Superpotential) -> Array:
    """By how much the law drops within each facet, (f,). Collective.

    Args:
        points: of the law's part.
        law: its state.
        of: the law, as it is or as it is solved.
    """
    ends = points.at_nodes(law.argument[:, None])[:, :, 0]
    low, high = ends.min(axis=1, initial=np.inf), ends.max(axis=1, initial=-np.inf)
    height = np.zeros(len(ends))
    for kink, jump in zip(of.concave.kinks, of.concave.jumps, strict=True):
        height += jump * ((low < kink) & (kink < high))
    return height


def of_solution(traces: LawTraces, inverse: DualNorm) -> ErrorField:
    """Bubbles and nodes in turns, each under the influence of the other, until their energy settles. Collective.

    Args:
        traces: the laws between the nodes.
        inverse: of the system.
    """
    problem, thresholds, error, size = traces.problem, traces.thresholds, None, 0.0
    at_nodes, stiffness = fem.Function(problem.space), BubbleStiffness(problem, traces.bubbles)
    residual = problem.bulk.residual_in(traces.bubbles, traces.u, problem.linear.values())
    for _ in range(thresholds.coupled_rounds):
        between, _ = traces.tested(error)
        load = residual - between - problem.bulk.force_in(traces.bubbles, at_nodes)
        error = ErrorField(at_nodes, defect.least_energy(stiffness, traces.u, load, thresholds))
        _move_nodes(traces, inverse, error)
        inverse.keep_within_bounds(error.nodes)
        before, size = size, float(np.sqrt(total(stiffness.comm, float(squares(problem, error).sum()))))
        if abs(size - before) <= thresholds.coupled_change * size:
            break
    assert error is not None
    return error


def squares(problem: Problem, error: ErrorField) -> Array:
    """η_K² of the owned cells. Collective.

    Args:
        problem: what was solved.
        error: its estimated error.
    """
    return problem.bulk.energy_by_cell(error.nodes + error.bubbles)


def _move_nodes(traces: LawTraces, inverse: DualNorm, error: ErrorField) -> None:
    """Move the nodes as the bubbles ask; the laws answer that, so it takes a few rounds. Collective."""
    problem, thresholds = traces.problem, traces.thresholds
    size, bubbling = 0.0, problem.bulk.force_in(problem.space, error.bubbles)
    for _ in range(thresholds.answer_rounds):
        _, laws = traces.tested(error)
        internal = problem.bulk.force_in(problem.space, error.nodes) + bubbling
        step, length = inverse.solve(laws - problem.combined(internal))
        error.nodes.x.array[:] += step.x.array
        size = max(size, length)
        if length <= thresholds.answer_change * size:
            break
