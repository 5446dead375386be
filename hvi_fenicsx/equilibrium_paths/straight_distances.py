"""How far a state is from the straight segments of its graphs: what certifies it on Γc."""

from __future__ import annotations

from collections.abc import Collection

import numpy as np

from ..reduced.condensed_problem import CondensedProblem
from ..typing import Array
from .bonds import BondTable
from .segments import Segment
from .state import PathState


class StraightDistances:
    """The distances of the states of one path.

    Args:
        problem: the problem; all its laws are piecewise linear.
        remember: numbers of the problem's bonds that remember.
    """

    def __init__(self, problem: CondensedProblem, remember: Collection[int]) -> None:
        self._problem, self._bonds = problem, BondTable(problem, remember)
        self._rows: list[list[int]] = [[] for _ in range(problem.size)]
        for row, bond in enumerate(self._bonds.bonds):
            self._rows[bond.unknown].append(row)
        self._chains: dict[tuple[int, bytes], tuple[Segment, ...]] = {}

    def __call__(self, state: PathState, carried: Array | None = None) -> float:
        """The largest distance, relative to the forces.

        Args:
            state: the state.
            carried: forces of laws and bounds, (n,); by default what the condensed body leaves them.
        """
        problem = self._problem
        elastic, load = problem.elastic @ state.x, problem.load(state.factor)
        force, diagonal = load - elastic if carried is None else carried, problem.elastic.diagonal
        size = max(float(np.max(np.abs(f), initial=0.0)) for f in (elastic, load, problem.force_rate)) or 1.0
        chains = self._all_chains(state.memory)
        values = zip(chains, *(map(float, v) for v in (state.x, force, diagonal)), strict=True)
        away = (min(segment.distance(x, f, k) for segment in chain) for chain, x, f, k in values)
        return max(away, default=0.0) / size

    def _all_chains(self, memory: Array | None) -> list[tuple[Segment, ...]]:
        """The graphs of all unknowns; those with an equal memory are made once."""
        if memory is not None:
            self._bonds.restore(memory)
        return [self._chain(i, memory) for i in range(self._problem.size)]

    def _chain(self, unknown: int, memory: Array | None) -> tuple[Segment, ...]:
        key = unknown, b"" if memory is None else memory[self._rows[unknown]].tobytes()
        if key not in self._chains:
            self._chains[key] = self._bonds.chain(unknown)
        return self._chains[key]
