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
    of_nodes = points.at_nodes if law.term.radial else points.components_at_nodes
    ends = of_nodes(law.argument[:, None])[:, :, 0]
    low, high = ends.min(axis=1, initial=np.inf), ends.max(axis=1, initial=-np.inf)
    height = np.zeros(len(ends))
    for kink, jump in zip(of.concave.kinks, of.concave.jumps, strict=True):
        height += jump * ((low < kink) & (kink < high))
    return height


class _Coupled:
    """The forms and constraints of bubbles and nodes that are found together. Creation is collective.

    Args:
        traces: the laws between the nodes.
        inverse: of the system.

    Attributes:
        error: as it is known so far.
    """

    def __init__(self, traces: LawTraces, inverse: DualNorm) -> None:
        problem, space = traces.problem, traces.bubbles
        self._traces, self._inverse, self._thresholds = traces, inverse, traces.thresholds
        self._longest = 0.0
        self._stiffness = BubbleStiffness(problem, space)
        self._constraints = defect.constraints(problem, traces.u, space)
        self._residual = problem.bulk.residual_in(space, traces.u, problem.linear.values())
        nodes, bubbles = fem.Function(problem.space), fem.Function(space)
        self.error = ErrorField(nodes, bubbles)
        self._of_nodes = problem.bulk.force_in(space, nodes)
        self._on_nodes = problem.bulk.force_in(problem.space, nodes + bubbles)
        self._energies = problem.bulk.energy_in_cells(nodes + bubbles)

    def squares(self) -> Array:
        """η_K² of the owned cells. Collective."""
        return np.maximum(self._energies.values()[:, 0], 0.0)

    def find_bubbles(self, *, first: bool) -> None:
        """Find the bubbles that belong to the nodes. Collective.

        Args:
            first: whether nothing is known yet.
        """
        load, _ = self._traces.tested(None if first else self.error)
        np.subtract(self._residual, load, out=load)
        if not first:
            load -= self._of_nodes.values()
        defect.find_least_energy(self.error.bubbles, self._stiffness, self._constraints, load, self._thresholds)

    def move_nodes(self) -> None:
        """Move the nodes as the bubbles ask; the laws answer that, so it takes a few rounds. Collective."""
        problem, nodes = self._traces.problem, self.error.nodes
        for _ in range(self._thresholds.answer_rounds):
            _, laws = self._traces.tested(self.error)
            step, length = self._inverse.solve(laws - problem.combined(self._on_nodes.values()))
            nodes.x.array[:] += step.x.array
            self._longest = max(self._longest, length)
            if length <= self._thresholds.answer_change * self._longest:
                break
        self._inverse.keep_within_bounds(nodes)


def of_solution(traces: LawTraces, inverse: DualNorm) -> tuple[ErrorField, Array]:
    """Bubbles and nodes in turns, each under the influence of the other, until their energy settles. Collective.

    Args:
        traces: the laws between the nodes.
        inverse: of the system.

    Returns:
        The estimated error, and η_K² of the owned cells.
    """
    coupled, size, comm = _Coupled(traces, inverse), 0.0, traces.problem.domain.mesh.comm
    for number in range(traces.thresholds.coupled_rounds):
        coupled.find_bubbles(first=number == 0)
        coupled.move_nodes()
        cells = coupled.squares()
        before, size = size, float(np.sqrt(total(comm, float(cells.sum()))))
        if abs(size - before) <= traces.thresholds.coupled_change * size:
            break
    return coupled.error, cells
