"""Geometric multigrid on the ladder, in which what is held on the finest rung is held on all of them.

The coarse operators are the rungs' own stiffness matrices, which nested iteration has assembled: no Galerkin product is
formed. An active set or a tangent of the laws touches only the rows of Γc, on every rung (:meth:`.System.follow`). A
coarse unknown that would move a held one is held too (Hackbusch and Mittelmann 1983), so that the matrices remain the
Galerkin products of the prolongations so cut: the cycle converges whatever the active set is.
"""

from __future__ import annotations

from collections.abc import Iterator

from petsc4py import PETSc

from ..system import System


def ladder(system: System) -> list[System]:
    """The system and the rungs below it, finest first."""
    return [system, *(ladder(system.below.system) if system.below else [])]


def hang(pc: PETSc.PC, system: System) -> None:
    """Make a PC the multigrid of a system as it stands, with what it holds. Collective."""
    pc.setType(PETSc.PC.Type.MG)
    pc.setMGLevels(len(ladder(system)))
    pc.setOperators(system.matrix)
    for level, (coarse, cut) in enumerate(reversed(list(_followed(system)))):
        pc.setMGInterpolation(level + 1, cut)
        smoother = pc.getMGSmoother(level) if level else pc.getMGCoarseSolve()
        smoother.setOperators(coarse.matrix, coarse.matrix)


def _followed(system: System) -> Iterator[tuple[System, PETSc.Mat]]:
    """The rungs below, each made to follow the one above, with the prolongation from it; finest first. Collective."""
    while system.below is not None:
        coarse, step = system.below.system, system.below.prolongation
        coarse.follow(system, step)
        cut = step.copy()
        cut.diagonalScale(_movable(system), _movable(coarse))
        yield coarse, cut
        system = coarse


def _movable(system: System) -> PETSc.Vec:
    """1 for the unknowns that are neither held nor prescribed, else 0."""
    mask = system.load.duplicate()
    mask.set(1.0)
    mask.array[system.immovable] = 0.0
    return mask
