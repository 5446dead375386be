"""A state on the curves of its graphs, and its change by small loads."""

from __future__ import annotations

from collections.abc import Collection

import numpy as np

from ...reduced.condensed_problem import CondensedProblem
from ...typing import Array
from ..state import PathState
from .felt import factors, felt
from .sites import Sites
from .vertex_laws import vertex_laws


class CurvedGraphs:
    """A state in the coordinates along its graphs.

    Args:
        problem: the problem.
        remember: numbers of the problem's bonds that remember.
        state: the state.

    Attributes:
        x: displacements, (n,).
        force: of laws and bounds, with what bonds remember, (n,).
    """

    def __init__(self, problem: CondensedProblem, remember: Collection[int], state: PathState) -> None:
        self._factors = factors(problem)
        known = felt(problem, self._factors)
        self._sites = Sites(known, vertex_laws(known, remember))
        self._sites.put(state.position.numbers, state.memory)
        self._z = state.position.small.copy()
        self._read()

    def _read(self) -> None:
        values = self._sites.values(self._z)
        self.x, self.force = values.x / self._factors, values.force * self._factors

    def take(self, load: Array) -> None:
        """Move along the graphs until a small load more is carried, at the same factor, or an end is reached.

        Args:
            load: (n,).

        Raises:
            numpy.linalg.LinAlgError: the equations are singular.
        """
        matrix, rank = self._sites.jacobian(self._sites.values(self._z)), self._sites.thresholds.curve.rank
        self._z = self._z + np.linalg.lstsq(matrix, load / self._factors, rcond=rank)[0]
        s = self._sites.s(self._z)
        for k in np.flatnonzero((s < self._sites.low) | (s > self._sites.high)):
            self._sites.leave(self._z, int(k), forward=bool(s[k] > self._sites.high[k]))
        self._read()
