"""The coarser levels under a system, and how they take part in its multigrid."""

from __future__ import annotations

from functools import cached_property
from typing import Any

import numpy as np
import numpy.typing as npt
from petsc4py import PETSc

from ..mesh.transfer import Transfer
from ..typing import Array
from .system import System

_GROWTH = 3.0
"""Factor by which unknowns grow from one level of a multigrid to the next, at least."""
_MOVES = 0.2
"""Weight by which an unknown moves another, at least: of those that move a vertex, one in space has 1/4 or more."""


class Level:
    """A coarser level under a finer one.

    Attributes:
        finer: the system above it.
        system: its own.
        prolongation: from its unknowns to the finer one's.
    """

    def __init__(self, finer: System, system: System, prolongation: PETSc.Mat) -> None:
        self.finer, self.system, self.prolongation = finer, system, prolongation

    @property
    def interpolation(self) -> PETSc.Mat:
        """The prolongation without what is prescribed on either level. Collective when first used."""
        return self._masked.matrix

    @cached_property
    def _masked(self) -> _MaskedProlongation:
        return _MaskedProlongation(self)

    def follow(self) -> None:
        """Make the level take the finer one's tangent and hold what that holds. Collective.

        W K is restricted and lumped. An unknown is held where it moves something held (Hackbusch and Mittelmann 1983),
        so that J stays the finer one's Galerkin product and the body as well supported. On a curved part the tangent
        of one vertex has a little of its neighbour's normal: held for that, it would keep the coarse body from sliding.
        """
        fine, own = self.finer.jacobian, self.system.jacobian
        at = own.rows.dofs
        tangent = np.empty_like(own.rows.tangent)
        for column in range(tangent.shape[1]):
            moved = self._masked.restricted(fine.rows.tangent[:, :, column].ravel())
            tangent[:, :, column] = moved[at].reshape(tangent.shape[:2])
        moves = np.abs(self._masked.restricted(np.isin(fine.rows.dofs, fine.held))[at])
        own.take(tangent, at[moves > _MOVES].astype(np.int32))


Levels = tuple[Level, ...]
"""The coarser levels of a system, the finest of them first; each one's system is the next one's ``finer``."""


def prolongation(fine: System, coarse: System, transfer: Transfer) -> PETSc.Mat:
    """The prolongation between the unknowns of two systems, local ones where normals are slanted. Collective.

    Args:
        fine: the finer system.
        coarse: the system on the next coarser mesh.
        transfer: how the finer mesh came from the coarser one.
    """
    points = fine.problem.points, coarse.problem.points
    step = transfer.prolongation(fine.problem.space, coarse.problem.space, points)
    if coarse.rotation is not None:
        step = step.matMult(coarse.rotation)
    return step if fine.rotation is None else fine.rotation.transposeMatMult(step)


def stacked(finer: System, coarser: System, below: Levels, step: PETSc.Mat) -> Levels:
    """The levels of a system; a coarser one of nearly its size is passed over. Collective.

    Multigrid wants levels that grow by a factor, or a cycle costs more than a few sweeps of the finest.

    Args:
        finer: the system.
        coarser: the system on the next coarser mesh.
        below: its own levels.
        step: the prolongation from its unknowns.
    """
    if not below or step.size[0] >= _GROWTH * below[0].prolongation.size[1]:
        return (Level(finer, coarser, step), *below)
    return (Level(finer, below[0].system, step.matMult(below[0].prolongation)), *below[1:])


class _MaskedProlongation:
    """A prolongation (``matrix``) in which what is prescribed has no part, and its rows of Γc. Creation is collective.

    What is held keeps its part in it: a diagonal of 1e20 times an elastic one leaves it where it is on every level.
    """

    def __init__(self, level: Level) -> None:
        finer = level.finer
        self.matrix = level.prolongation.copy()
        self.matrix.diagonalScale(_unprescribed(finer), _unprescribed(level.system))
        rows = (finer.jacobian.rows.dofs + finer.load.owner_range[0]).astype(PETSc.IntType)
        self._traces = self.matrix.createSubMatrix(PETSc.IS().createGeneral(rows, comm=finer.comm), None)
        self._on, self._off = self._traces.createVecLeft(), self._traces.createVecRight()

    def restricted(self, values: npt.NDArray[Any]) -> Array:
        """Values at the finer level's unknowns of Γc, restricted to the coarse unknowns. Collective."""
        self._on.array[:] = values
        self._traces.multTranspose(self._on, self._off)
        return np.asarray(self._off.array_r)


def _unprescribed(system: System) -> PETSc.Vec:
    """1 for the unknowns that are not prescribed, else 0."""
    mask = system.load.duplicate()
    mask.set(1.0)
    mask.array[system.problem.fixed_here] = 0.0
    return mask
