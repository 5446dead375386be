"""Geometric multigrid on the ladder, truncated at what is held (Kornhuber 1994, truncated monotone multigrid).

Held and prescribed unknowns are cut out of the prolongation, so that no coarse correction moves them; coarse operators
are Galerkin products with the prolongations so cut.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from petsc4py import PETSc

_EMPTY = 1e-14
"""A diagonal entry (an elastic one is about 1) that no fine unknown contributes to."""


def hang(pc: PETSc.PC, matrix: PETSc.Mat, prolongations: Sequence[PETSc.Mat], untouched: PETSc.Vec) -> None:
    """Make a PC the multigrid of a matrix. Collective.

    Args:
        pc: what to configure. matrix: the finest one, identity rows where unknowns are held.
        prolongations: to the finest mesh first, then on downwards. untouched: 1 where an unknown is free, else 0.
    """
    levels = len(prolongations) + 1
    pc.setType(PETSc.PC.Type.MG)
    pc.setMGLevels(levels)
    mask = untouched
    for below in range(levels - 2, -1, -1):
        cut = prolongations[levels - 2 - below].copy()
        cut.diagonalScale(mask, None)
        matrix = matrix.ptap(cut)
        mask = _filled(matrix)
        pc.setMGInterpolation(below + 1, cut)
        smoother = pc.getMGCoarseSolve() if below == 0 else pc.getMGSmoother(below)
        smoother.setOperators(matrix, matrix)


def _filled(matrix: PETSc.Mat) -> PETSc.Vec:
    """Put 1 on the diagonal of rows that nothing contributes to; 1 for the others, 0 for these."""
    diagonal = matrix.getDiagonal()
    empty = np.abs(diagonal.array_r) < _EMPTY
    mask = diagonal.duplicate()
    mask.array[:] = np.where(empty, 0.0, 1.0)
    diagonal.array[:] = np.where(empty, 1.0, diagonal.array_r)
    matrix.setDiagonal(diagonal)
    return mask
