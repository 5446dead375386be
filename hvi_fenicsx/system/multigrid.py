"""Geometric multigrid on the levels of a mesh hierarchy; what is held on the finest level is held on all of them.

The coarse operators are the levels' own stiffness matrices, which nested iteration has assembled: no Galerkin product
is formed. An active set or a tangent of the laws changes only the rows of Γc, on every level (:meth:`.Level.update`). A
coarse unknown that would move a held one is held too (Hackbusch and Mittelmann 1983), so that the matrices remain the
Galerkin products, except where normals turn: the cycle converges for every active set.
"""

from __future__ import annotations

from collections.abc import Mapping

from petsc4py import PETSc

from ..typing import Entities
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
        for number, level in enumerate(reversed(levels)):
            self.pc.setMGInterpolation(number + 1, level.interpolation)
            smoother = self.pc.getMGSmoother(number) if number else self.pc.getMGCoarseSolve()
            smoother.setOperators(level.system.jacobian.matrix, level.system.jacobian.matrix)
        with default_options(options):
            self.pc.setFromOptions()

    def prepare(self, held: Entities) -> None:
        """Update the coarser levels, each from the next finer one. Collective."""
        for level in self._levels:
            level.update()
        with default_options(self._options):
            self.pc.setUp()

    def free(self) -> None:
        """Free the PETSc objects."""
        self.pc.destroy()
