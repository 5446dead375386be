"""One law at the vertices of Γc, a row each: its traction along a coordinate, its energy, and what a bond remembers.

The coordinate is an unknown, or the length of several (:mod:`.lengths`). A bond with memory unloads along the secant to
the greatest coordinate so far, and beyond it follows the law: its graph is another table (physics of damage).
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ..typing import Array, Integers
from .base import Superpotential
from .traction_graph import TractionGraph

_ROUNDING = 1e-12
"""Relative, a difference of displacements that is none."""


@dataclass(frozen=True, kw_only=True, eq=False)
class VertexLaws:
    """One law at m vertices. Coordinates, tractions along them and energies have shape (m,).

    Attributes:
        law: j, of the factor times the coordinate.
        factors: not zero, positive where the coordinate is a length, (m,).
        weights: lumped areas times what the law is multiplied by, (m,).
        memory: the least and the greatest coordinate so far, ≤ 0 and ≥ 0, and the tractions there, (m, 4); None: the
            vertices remember nothing.
    """

    law: Superpotential
    factors: Array
    weights: Array
    memory: Array | None = None

    @property
    def with_memory(self) -> VertexLaws:
        """The same vertices, which remember, and have been nowhere yet; a linear law has nothing to remember."""
        return self if self.law.is_linear else replace(self, memory=np.zeros((len(self.weights), 4)))

    def at(self, rows: Integers | slice) -> VertexLaws:
        """Some of the vertices.

        Args:
            rows: their numbers.
        """
        memory = None if self.memory is None else self.memory[rows]
        return replace(self, factors=self.factors[rows], weights=self.weights[rows], memory=memory)

    def limits(self, x: Array) -> tuple[Array, Array]:
        """The limits of the traction along the coordinate from the left and from the right, (..., m) each.

        Args:
            x: coordinates, one or more of each vertex, (..., m).
        """
        left, right = self._limits_at_first(x)
        if self.memory is None:
            return left, right
        low, high, back = self.memory[:, 0], self.memory[:, 1], self._secants(x) * x
        return np.where((x > low) & (x <= high), back, left), np.where((x >= low) & (x < high), back, right)

    def recoverable(self, x: Array, traction: Array) -> Array:
        """What the vertices give back on the way to zero: w j, or the triangle under the secant with memory.

        Args:
            x: coordinates.
            traction: along them.
        """
        plain = 0.5 * x * traction if self.memory is not None else self.law.value(self.factors * x)
        return self.weights * plain

    def dissipated(self, x: Array, traction: Array) -> Array:
        """The energy that is lost for good once the vertices have been at x, or where they were before.

        Args:
            x: coordinates.
            traction: along them.
        """
        if self.memory is None:
            return np.zeros_like(x)
        been = self._reached(x, traction)
        ends, tractions = been[:, :2], been[:, 2:]
        taken = self.law.value((self.factors[:, None] * ends).ravel()) - self.law.value(np.zeros(1))
        lost = taken.reshape(ends.shape) - 0.5 * ends * tractions
        return self.weights * (lost[:, 1] if self.law.even else lost.sum(axis=1))

    def remembering(self, x: Array, traction: Array) -> VertexLaws:
        """The laws once the vertices have been at x.

        Args:
            x: coordinates.
            traction: along them.
        """
        return self if self.memory is None else replace(self, memory=self._reached(x, traction))

    def graph(self, number: int, ends: Array | None = None) -> TractionGraph:
        """The traction of a vertex over its coordinate, with memory; of a curved law its chords.

        Args:
            number: the vertex.
            ends: further coordinates at which the chords of a curved law meet it, (k,).
        """
        graph = self.law.graph or self._chords(number, np.empty(0) if ends is None else ends)
        found = graph.along(float(self.factors[number]))
        return found if self.memory is None else found.remembering(self.memory[number])

    def _chords(self, number: int, ends: Array) -> TractionGraph:
        known = np.union1d(self.law.breaks, self.factors[number] * np.append(ends, self._memory[number, :2]))
        return TractionGraph.chords(known, self.law.left(known), self.law.right(known))

    def _limits_at_first(self, x: Array) -> tuple[Array, Array]:
        at, forward = self.factors * x, self.factors > 0.0
        left, right = (limit(at.ravel()).reshape(at.shape) for limit in (self.law.left, self.law.right))
        return self.factors * np.where(forward, left, right), self.factors * np.where(forward, right, left)

    def _secants(self, x: Array) -> Array:
        """Traction over coordinate where a bond turned, on the side of x; 0 where it has not been."""
        low, high, low_traction, high_traction = self._memory.T
        end, there = np.where(x < 0.0, low, high), np.where(x < 0.0, low_traction, high_traction)
        return np.divide(there, end, out=np.zeros_like(x), where=end != 0.0)

    def _reached(self, x: Array, traction: Array) -> Array:
        """The memory once the vertices have been at x: both sides of an even law remember the same."""
        side = np.column_stack([x < 0.0, x > 0.0])
        if self.law.even:
            side, sign = np.broadcast_to(x[:, None] != 0.0, side.shape), np.sign(x)[:, None] * [-1.0, 1.0]
        else:
            sign = np.ones_like(side, dtype=float)
        at, there, ends = sign * x[:, None], sign * traction[:, None], self._memory[:, :2]
        beyond = side & (np.abs(at) >= np.abs(ends) * (1.0 - _ROUNDING))
        same = np.abs(at - ends) <= _ROUNDING * np.abs(at)
        return np.column_stack([np.where(beyond & ~same, at, ends), np.where(beyond, there, self._memory[:, 2:])])

    @property
    def _memory(self) -> Array:
        return np.zeros((len(self.weights), 4)) if self.memory is None else self.memory
