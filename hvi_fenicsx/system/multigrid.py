"""Geometric multigrid on the ladder, in which what is held on the finest rung is held on all of them.

The coarse operators are the rungs' own stiffness matrices, which nested iteration has assembled: no Galerkin product is
formed. An active set or a tangent of the laws touches only the rows of Γc, on every rung (:meth:`.Below.follow`). A
coarse unknown that would move a held one is held too (Hackbusch and Mittelmann 1983), so that the matrices remain the
Galerkin products, but for normals that turn: the cycle converges whatever the active set is.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping

from petsc4py import PETSc

from ..typing import Entities
from .coarser_level import Below
from .petsc_options import PREFIX, below_the_users
from .system import System


def descended(system: System) -> Iterator[tuple[System, Below]]:
    """Each rung with the one below it, from the system's own down."""
    while system.below is not None:
        yield system, system.below
        system = system.below.system


class Multigrid:
    """A PC that is the multigrid of a system. Creation is collective.

    Its levels and their memory stay when the active set changes: values are written anew, and the coarsest matrix is
    factorised again if any of its own has changed.

    Args:
        system: the finest rung. options: of the PC, below the user's own.

    Attributes:
        pc, matrix: the PC, and the system's matrix, of which it is.
    """

    def __init__(self, system: System, options: Mapping[str, object]) -> None:
        self._rungs, self._options = list(descended(system)), options
        self.pc, self.matrix = PETSc.PC().create(system.comm), system.matrix
        self.pc.setOptionsPrefix(PREFIX)
        self.pc.setType(PETSc.PC.Type.MG)
        self.pc.setMGLevels(len(self._rungs) + 1)
        self.pc.setOperators(self.matrix)
        for level, (finer, below) in enumerate(reversed(self._rungs)):
            self.pc.setMGInterpolation(level + 1, below.cut(finer))
            smoother = self.pc.getMGSmoother(level) if level else self.pc.getMGCoarseSolve()
            smoother.setOperators(below.system.matrix, below.system.matrix)
        with below_the_users(options):
            self.pc.setFromOptions()

    def prepare(self, held: Entities) -> None:
        """Make the rungs below hold what the system holds, each what the one above does. Collective."""
        for finer, below in self._rungs:
            below.follow(finer)
        with below_the_users(self._options):
            self.pc.setUp()

    def free(self) -> None:
        """Free the PETSc objects."""
        self.pc.destroy()
