"""Geometric multigrid on the levels of a mesh hierarchy; what is held on the finest level is held on all of them.

The coarse operators are the levels' own stiffness matrices, which nested iteration has assembled: no Galerkin product
is formed. An active set or a tangent of the laws changes only the rows of Γc, on every level (:meth:`.Level.update`). A
coarse unknown that would move a held one is held too (Hackbusch and Mittelmann 1983), so that the matrices remain the
Galerkin products, except where normals turn: the cycle converges for every active set.

Small levels are on fewer ranks, the coarsest on one (:mod:`.fewer_ranks`), which alone factorises it.
"""

from __future__ import annotations

from collections.abc import Mapping

from petsc4py import PETSc

from ..typing import Entities
from .fewer_ranks import PlacedMatrix, joined_ranks
from .levels import Levels
from .petsc_options import default_options, prefix
from .system import System


class Multigrid:
    """The multigrid preconditioner of a system. Creation is collective.

    Its levels and their memory stay when the active set changes: values are written anew, and the coarsest matrix is
    factorised again if it has changed.

    Args:
        system: the system on the finest level.
        levels: the coarser levels, finest first.
        options: defaults of the PC's options.

    Attributes:
        pc: the PC.
        matrix: the system's matrix, which it preconditions.
    """

    def __init__(self, system: System, levels: Levels, options: Mapping[str, object]) -> None:
        self._levels, self._options = levels, options
        self.pc, self.matrix = PETSc.PC().create(system.comm), system.jacobian.matrix
        self.pc.setOptionsPrefix(prefix())
        self.pc.setType(PETSc.PC.Type.MG)
        self.pc.setMGLevels(len(levels) + 1)
        self.pc.setOperators(self.matrix)
        self._placed = _placed(system, levels)
        for number, (level, matrix) in enumerate(zip(reversed(levels), reversed(self._placed[1:]), strict=True)):
            finer = self._placed[len(levels) - number - 1]
            self.pc.setMGInterpolation(number + 1, matrix.prolongation(level.interpolation, finer))
            smoother = self.pc.getMGSmoother(number) if number else self.pc.getMGCoarseSolve()
            smoother.setOperators(matrix.matrix, matrix.matrix)
        with default_options(options):
            self.pc.setFromOptions()

    def prepare(self, held: Entities) -> None:
        """Update the coarser levels, each from the next finer one. Collective."""
        for level, matrix in zip(self._levels, self._placed[1:], strict=True):
            level.update()
            matrix.update()
        with default_options(self._options):
            self.pc.setUp()

    def free(self) -> None:
        """Free the PETSc objects."""
        self.pc.destroy()
        for matrix in self._placed:
            matrix.free()


def _placed(system: System, levels: Levels) -> list[PlacedMatrix]:
    """The matrices of all levels, finest first, the coarsest on one rank. Collective."""
    ranks, least = system.comm.size, system.thresholds.rank_unknowns
    joined = [joined_ranks(level.system.dofs, ranks, least) for level in levels[:-1]]
    matrices = [one.jacobian.matrix for one in (system, *(level.system for level in levels))]
    return [PlacedMatrix(m, n) for m, n in zip(matrices, [1, *joined, ranks], strict=True)]
