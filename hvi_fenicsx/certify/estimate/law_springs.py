"""The laws as springs on bubbles: by how much their tractions rise as bubbles grow.

A law answers the bubbles. Where a bond is stiff beside a cell of the body, the answer to bubbles that were found
without it is more force than made them, and bubbles and law drive each other ever further. So springs that are as stiff
as the rising law hold the bubbles while they are found; what the law gives them then is evaluated as ever.
"""

from __future__ import annotations

from dolfinx import fem

from .block_forces import BlockForces, gathered, summed
from .law_traces import ErrorField, LawTraces


class LawSprings:
    """The springs of all laws at a displacement. Creation is collective.

    Args:
        traces: the laws between the nodes.
        error: added to u_h.
    """

    def __init__(self, traces: LawTraces, error: ErrorField) -> None:
        self._space = traces.bubbles
        self._rates = [traces.rising(state, law, error) for state in traces.states for law in state.laws]

    def diagonal(self) -> BlockForces:
        """Forces for a unit of each bubble, at the owned blocks. Collective."""
        return self._summed([points.squared(rates) for points, rates in self._rates])

    def times(self, e: fem.Function) -> BlockForces:
        """Forces of bubbles, at the owned blocks. Collective.

        Args:
            e: the bubbles, ghosts updated.
        """
        return self._summed([points.tested(rates * points.of_bubbles(e))[0] for points, rates in self._rates])

    def _summed(self, local: list[BlockForces]) -> BlockForces:
        """Contributions at local blocks as one at the owned blocks. Collective."""
        parts = [(force.blocks, force.values) for force in local]
        return gathered(self._space, summed(parts, self._space.dofmap.bs))
