"""What MUMPS counted while it factorised a matrix: the size of the factors, and what solves cost against it."""

from __future__ import annotations

import numpy as np
from petsc4py import PETSc

_FACTOR_FLOPS = 3  # RINFOG: operations of the elimination
_FACTOR_ENTRIES = 29  # INFOG: numbers in the factors; in millions with a minus, where they are many
_NEGATIVE_PIVOTS = 12  # INFOG
_FLOPS_PER_ENTRY = 4.0  # a solve multiplies and adds each number twice, forth and back
_LEAST = 30.0  # solves; measured: 13 to 45 in the plane, where other things than operations take the time


def entries(pc: PETSc.PC) -> float:
    """Numbers in the factors, over all ranks; infinite where the solver does not tell.

    Args:
        pc: a factorised matrix.
    """
    if pc.getFactorSolverType() != "mumps":
        return np.inf
    count = pc.getFactorMatrix().getMumpsInfog(_FACTOR_ENTRIES)
    return float(count if count >= 0 else -1e6 * count)


def negative_pivots(pc: PETSc.PC) -> int:
    """The number of negative pivots, which is that of negative eigenvalues (Sylvester's law of inertia).

    Args:
        pc: a symmetric matrix, factorised by MUMPS.
    """
    return int(pc.getFactorMatrix().getMumpsInfog(_NEGATIVE_PIVOTS))


def solves_worth(pc: PETSc.PC) -> float:
    """Number of right-hand sides whose solution costs as much as the factorisation; 0 where the solver does not tell.

    By operations. In space, by processor time, it is 0.8 to 1.2 of this (648 to 14,739 unknowns).

    Args:
        pc: a factorised matrix.
    """
    if pc.getFactorSolverType() != "mumps":
        return 0.0
    flops = pc.getFactorMatrix().getMumpsRinfog(_FACTOR_FLOPS)
    return float(max(_LEAST, flops / (_FLOPS_PER_ENTRY * max(entries(pc), 1.0))))
