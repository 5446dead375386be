"""The defect of u_h in the bubbles: minimise ½a(e, e) - ρ(e) among the bubbles that the constraints admit.

ρ is the residual with all that the body feels pointwise: loads, thermal strain, the laws between the nodes. The
constraints are those of :mod:`.bubble_constraints`.
"""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
from dolfinx import fem
from mpi4py import MPI

from ...typing import Array, Entities
from .bubble_constraints import BubbleBounds, Constraints
from .bubble_stiffness import BubbleStiffness, Springs
from .thresholds import DEFAULT, EstimateThresholds


class LeastEnergy:
    """The admissible bubbles of least energy, an active set method, a few rounds. Creation is collective.

    Args:
        bubbles: take the result.
        stiffness: a(e, e).
        under: what they must meet.
        load: ρ, (n, d); it becomes the residual.
        thresholds: how accurately.

    Attributes:
        residual: ρ - a(e, ·), what is held included, (n, d); a change of the load is to be added to it.
        energy: a(e, e).
    """

    def __init__(
        self,
        bubbles: fem.Function,
        stiffness: BubbleStiffness,
        under: Constraints,
        load: Array,
        thresholds: EstimateThresholds = DEFAULT,
    ) -> None:
        self._bubbles, self._stiffness, self._under, self._thresholds = bubbles, stiffness, under, thresholds
        self.residual, self.energy, self._parts, self._begun = load, 0.0, under.bounds, False
        self._e = bubbles.x.array[: load.size].reshape(load.shape)
        self._special = _union([*(p.blocks for p in under.bounds), *(p.blocks for p in under.prescribed)])
        for given in under.prescribed:
            self._e[given.blocks, given.component] = given.values

    def find(self) -> None:
        """Find them; from the second time on from those that were found before. Collective."""
        stiffness, limits, e = self._stiffness, self._thresholds, self._e
        self._parts = tuple(p.updated(self._guess(p), self.residual[p.blocks]) for p in self._parts)
        tolerance = limits.rough_tolerance if self._begun else limits.tolerance
        goal = max(tolerance**2 * stiffness.square(self.residual, self._descent), limits.rounding**2)
        for _ in range(limits.rounds):
            self._put_on_bounds()
            steps = limits.bubble_steps
            self.energy += stiffness.solve(self.residual, e, self._descent, goal=goal, max_steps=steps)
            changed = tuple(p.updated(e[p.blocks], self.residual[p.blocks]) for p in self._parts)
            same = all(np.array_equal(a.side, b.side) for a, b in zip(self._parts, changed, strict=True))
            self._parts = changed
            if stiffness.comm.allreduce(same, op=MPI.LAND):
                break
        self._bubbles.x.scatter_forward()

    def find_beside(self, springs: Springs) -> None:
        """Find them while springs answer their growth; the residual and the energy stay those without. Collective.

        Args:
            springs: what answers.
        """
        if not self._stiffness.hold(springs):
            self.find()
            return
        before = springs.times(self._bubbles)
        work = self._stiffness.work(self._e, before) if self._begun else 0.0
        self.find()
        force = springs.times(self._bubbles)
        grown = force - before if self._begun else force
        self.residual[grown.blocks] += grown.values
        self.energy += work - self._stiffness.work(self._e, force)

    def _guess(self, part: BubbleBounds) -> Array:
        """The bubbles of a part as they are, at first what the diagonal alone makes of the load, (k, d)."""
        at = part.blocks
        if self._begun:
            return self._e[at]
        return np.where(self._under.free(at), self._stiffness.diagonal_solve(self.residual[at], at), self._e[at])

    def _put_on_bounds(self) -> None:
        """Put the bubbles on the bounds that hold them; the residual follows, at first what is prescribed, too."""
        before = self._e[self._special] if self._begun else 0.0
        for part in self._parts:
            part.put_on_bounds(self._e)
        step = self._e[self._special] - before
        self._e[self._special] -= step
        self._begun = True
        self.energy += self._stiffness.move(self.residual, self._e, self._special, step)

    def _descent(self, r: Array) -> Array:
        return self._stiffness.descent(r, (*self._under.prescribed, *self._parts), self._special)


def _union(parts: Iterable[Entities]) -> Entities:
    """All of some blocks, sorted."""
    return np.unique(np.concatenate([np.empty(0, np.int32), *parts]))


def find_least_energy(
    bubbles: fem.Function,
    stiffness: BubbleStiffness,
    under: Constraints,
    load: Array,
    thresholds: EstimateThresholds = DEFAULT,
) -> None:
    """Find the admissible bubbles of least energy under a load. Collective.

    Args:
        bubbles: take the result, ghosts updated; zero before.
        stiffness: a(e, e).
        under: what they must meet.
        load: ρ, (n, d), overwritten.
        thresholds: how accurately.
    """
    LeastEnergy(bubbles, stiffness, under, load, thresholds).find()
