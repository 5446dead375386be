"""A state on the straight segments of its graphs, and its change by small loads."""

from __future__ import annotations

from collections.abc import Collection

import numpy as np

from ..reduced.condensed_problem import CondensedProblem
from ..typing import Array
from .bonds import BondTable
from .placing import place
from .state import PathState


class StraightGraphs:
    """A state in the coordinates along its segments.

    Args:
        problem: the problem; all its laws are piecewise linear.
        remember: numbers of the problem's bonds that remember.
        state: the state.

    Attributes:
        x: displacements, (n,).
        force: of laws and bounds, with what bonds remember, (n,).
    """

    def __init__(self, problem: CondensedProblem, remember: Collection[int], state: PathState) -> None:
        bonds = BondTable(problem, remember)
        if state.memory is not None:
            bonds.restore(state.memory)
        chains = [bonds.chain(i) for i in range(problem.size)]
        force = problem.load(state.factor) - problem.elastic @ state.x
        self._cells = place(problem.elastic, chains, state.x, force, state.position.numbers)
        self.x, self.force = self._cells.x, self._cells.force

    def take(self, load: Array) -> None:
        """Move along the segments until a small load more is carried, at the same factor, or an end is reached.

        Args:
            load: (n,).

        Raises:
            numpy.linalg.LinAlgError: the equations are singular.
        """
        cells = self._cells
        cells.tau += cells.inverse().solve(load)
        for i in np.flatnonzero((cells.tau < cells.low) | (cells.tau > cells.high)):
            self._pass_end(int(i))
        self.x, self.force = cells.x, cells.force

    def _pass_end(self, i: int) -> None:
        """Put an unknown at the end that it has passed, on the next segment."""
        forward = bool(self._cells.tau[i] > self._cells.high[i])
        self._cells.enter(i, *self._cells.beyond(i, forward=forward))
