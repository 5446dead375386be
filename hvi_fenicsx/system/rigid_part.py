"""The rigid part of the unknowns, which strains nothing.

A body may travel 1e6 times as far as it deforms. The rounding of its stresses then is that of its travel, and its
elastic forces no longer balance each other. Those of the rest do, however far the body is from its place. Of a body
that travels less nothing is taken off, since to take it off rounds too.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Self

import numpy as np
from dolfinx import fem
from petsc4py import PETSc

from ..problem.problem import Problem
from ..problem.thresholds import DEFAULT
from ..problem.vectors import null_space
from ..typing import Integers
from . import existence, free_motions


class RigidPart:
    """What rigid motions make up of the unknowns.

    Args:
        motions: their fields in the components of the unknowns, orthonormal (Euclidean).
        moving: which body each of them moves.
        bodies: of which body each owned unknown is.
        travel: of a body, relative to its deformation, from which on it is taken off.
    """

    def __init__(
        self,
        motions: Sequence[PETSc.Vec],
        moving: Sequence[int],
        bodies: Integers,
        travel: float = DEFAULT.travel,
    ) -> None:
        self._rows = np.array([motion.array_r for motion in motions])
        self._moving, self._bodies, self._travel = np.array(moving), bodies, travel
        self._rest = motions[0].duplicate()
        self._comm = motions[0].comm.tompi4py()

    @classmethod
    def of(cls, problem: Problem, unknowns: Callable[[fem.Function], PETSc.Vec]) -> Self | None:
        """That of the motions which conditions leave and the elastic operator does not see; None for none. Collective.

        Across an interface they leave no strain only up to the rounding of its integrals, so they are not taken there.

        Args:
            problem: the problem.
            unknowns: makes the unknowns of a displacement field.
        """
        if problem.bulk.foundation is not None or problem.interfaces:
            return None
        modes = existence.motions(problem, contact_closed=False)
        motions = [unknowns(field) for field in free_motions.fields(problem, modes)]
        if not motions:
            return None
        for motion in motions:
            motion.array[problem.fixed_here] = 0.0
        null_space(motions)
        d = problem.scales.dimension
        bodies = problem.bodies.labels[np.arange(motions[0].local_size) // d]
        return cls(motions, [mode.body for mode in modes], bodies)

    def without(self, x: PETSc.Vec) -> PETSc.Vec:
        """The unknowns without the travel of bodies that travel far; overwritten by the next call. Collective."""
        shares = self._comm.allreduce(self._rows @ x.array_r)
        rest, count = x.array_r - shares @ self._rows, int(self._moving.max()) + 1
        strained = self._comm.allreduce(np.bincount(self._bodies, rest**2, minlength=count)[:count])
        travelled = np.bincount(self._moving, shares**2)
        taken = shares * (travelled > self._travel**2 * strained)[self._moving]
        self._rest.array[:] = x.array_r - taken @ self._rows
        return self._rest
