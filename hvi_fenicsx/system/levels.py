"""The coarser levels of a system, as its multigrid uses them."""

from __future__ import annotations

from functools import cached_property
from typing import Any

import numpy as np
import numpy.typing as npt
from petsc4py import PETSc

from ..mesh import nodes
from ..mesh.transfer import Transfer
from ..problem.problem import Problem
from ..typing import Array
from .system import System


class Level:
    """A level and the next finer one.

    Attributes:
        finer: the system on the next finer level.
        system: the system on this level.
        prolongation: from this level's unknowns to those of the finer one.
    """

    def __init__(self, finer: System, system: System, prolongation: PETSc.Mat) -> None:
        self.finer, self.system, self.prolongation = finer, system, prolongation

    def of_systems(self, finer: System, system: System) -> Level:
        """The same level of other systems that have these unknowns, prescribed ones and parts of Γc too. Collective.

        Args:
            finer: on the next finer level.
            system: on this level.
        """
        found = Level(finer, system, self.prolongation)
        found._masked = self._masked
        return found

    @property
    def interpolation(self) -> PETSc.Mat:
        """The prolongation without the unknowns prescribed on either level. Collective when first used."""
        return self._masked.matrix

    @cached_property
    def _masked(self) -> _MaskedProlongation:
        return _MaskedProlongation(self)

    def update(self) -> None:
        """Take over the finer level's tangent and held unknowns. Collective.

        W K is restricted and lumped: what it makes of a displacement that is the same at all vertices, which in
        components of the local frames is none, where these turn along the part or at its corners. A coarse unknown is
        held where it moves a held fine one (Hackbusch and Mittelmann 1983), so that J remains the finer level's
        Galerkin product, and the body as well supported. On a curved part the tangent at a vertex has a small component
        along its neighbour's normal: unknowns of such small weight are not held, since that would keep the coarse body
        from sliding.
        """
        fine, own = self.finer.jacobian, self.system.jacobian
        at = own.rows.dofs
        axes, own_axes = self._axes
        forces, moved = fine.rows.tangent @ axes, np.empty_like(own.rows.tangent)
        for direction in range(moved.shape[2]):
            restricted = self._masked.restricted(forces[:, :, direction].ravel())
            moved[:, :, direction] = restricted[at].reshape(moved.shape[:2])
        weights = np.abs(self._masked.restricted(np.isin(fine.rows.dofs, fine.held))[at])
        held = at[weights > self.finer.thresholds.held_weight].astype(np.int32)
        own.set_restricted(moved @ own_axes.transpose(0, 2, 1), held)

    def free(self) -> None:
        """Free the system and the way to it; what other problems on the mesh share stays. Collective."""
        self.__dict__.pop("_masked", None)
        del self.prolongation
        self.system.free()

    @cached_property
    def _axes(self) -> tuple[Array, Array]:
        """The local axes at the vertices of Γc on the finer level and on this one, rows, (m, d, d)."""
        return _axes_on_contact(self.finer), _axes_on_contact(self.system)


def _axes_on_contact(system: System) -> Array:
    """The local axes at the vertices of Γc that this rank owns, as rows, (m, d, d)."""
    rows = system.jacobian.rows
    if system.frames is None:
        return np.broadcast_to(np.eye(rows.tangent.shape[1]), rows.tangent.shape)
    return system.frames.at(rows.vertices)


Levels = tuple[Level, ...]
"""The coarser levels of a system, the finest of them first; the system of each is ``finer`` of the next."""


def prolongation(fine: System, coarse: System, transfer: Transfer) -> PETSc.Mat:
    """The prolongation between the unknowns of two systems, in their local components. Collective.

    Args:
        fine: the finer system.
        coarse: the system on the next coarser mesh.
        transfer: the transfer from the coarser mesh to the finer one.
    """
    step = _of_displacements(fine.problem, coarse.problem, transfer)
    if coarse.problem.coupling is not None:
        step = step.matMult(coarse.problem.coupling.matrix)
    if fine.problem.coupling is not None:
        step = fine.problem.coupling.inverse.matMult(step)
    if coarse.rotation is not None:
        step = step.matMult(coarse.rotation)
    return step if fine.rotation is None else fine.rotation.transposeMatMult(step)


def _of_displacements(fine: Problem, coarse: Problem, transfer: Transfer) -> PETSc.Mat:
    """The prolongation between displacements in Cartesian components. Collective."""
    name, points = f"prolongation from degree {nodes.degree(coarse.space)}", (fine.points, coarse.points)
    return fine.once(name, None, lambda: transfer.prolongation(fine.space, coarse.space, points))


def with_coarser_system(finer: System, coarser: System, levels: Levels, step: PETSc.Mat) -> Levels:
    """The coarser levels of a system; the coarser system is left out where it is of nearly the same size. Collective.

    The unknowns must grow by a factor from level to level, or a multigrid cycle costs more than a few sweeps of the
    finest level.

    Args:
        finer: the system.
        coarser: the system on the next coarser mesh.
        levels: the coarser levels of that one.
        step: the prolongation from its unknowns.
    """
    if not levels or step.size[0] >= finer.thresholds.level_growth * levels[0].prolongation.size[1]:
        return (Level(finer, coarser, step), *levels)
    return (Level(finer, levels[0].system, step.matMult(levels[0].prolongation)), *levels[1:])


class _MaskedProlongation:
    """A prolongation (``matrix``) that is zero for prescribed unknowns, and its rows of Γc. Creation is collective.

    Held unknowns keep their weights in it: their large diagonal leaves them as they are on every level.
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
