"""Second-order status where a law has negative curvature: the inertia of the true Hessian on the active subspace.

By Sylvester's law the number of negative pivots of an LDLᵀ factorisation is the number of negative eigenvalues, so the
sign of the smallest is known without computing it. Strongly active vertices (a bound or a convex kink that carries a
force) cannot move to first order and are held; weakly active ones may move one way only: positive with them free
means a minimiser, negative with them held means none, anything else stays undecided.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from dolfinx import fem
from petsc4py import PETSc

from ..problem.problem import Problem
from ..runtime.timing import Timer
from ..solvers.law_models import Cells, ExactLaw
from ..system.system import System, compile_forms
from ..typing import Integers, Mask
from .contact_state import ContactState, LawState

LOCAL_MINIMISER, NO_MINIMISER, UNDECIDED = "local minimiser", "not a minimiser", "undecided"
_NEGATIVE_PIVOTS = 12
"""MUMPS's INFOG entry."""


def by_inertia(problem: Problem, u: fem.Function, states: Sequence[ContactState], tolerance: float) -> str:
    """The status of a certified u, by one or two factorisations. Collective.

    Args:
        problem: with the laws that were solved.
        u: nondimensional, ghosts updated.
        states: of Γc at u.
        tolerance: relative traction above which a constraint is strongly active.
    """
    system = System(problem, compile_forms(problem), Timer())
    x = system.unknowns(u)
    models = []
    for term in system.terms:
        argument = term.argument(x.array_r)
        models.append(ExactLaw(term.law, Cells.around(term.law.convex, argument, radial=term.radial)))
    system.jacobian.set_rates(system.tangents(x, models))
    strong, weak = _active(system, states, tolerance)
    if _negative(system, strong) == 0:
        return LOCAL_MINIMISER
    return NO_MINIMISER if _negative(system, np.union1d(strong, weak)) > 0 else UNDECIDED


def _active(system: System, states: Sequence[ContactState], tolerance: float) -> tuple[Integers, Integers]:
    """Local dofs that constraints hold strongly and weakly."""
    strong: list[Integers] = [np.empty(0, np.int64)]
    weak: list[Integers] = [np.empty(0, np.int64)]
    by_part = {s.surface.part: s for s in states}
    for bounds in system.bounds:
        state = by_part[bounds.surface.part]
        dofs, _ = bounds.component()
        loaded = np.abs(state.contact_pressure) > tolerance
        strong.append(dofs[state.contact & loaded])
        weak.append(dofs[state.contact & ~loaded])
    for term in system.terms:
        state = by_part[term.surface.part]
        held, loose = _kinks(next(law for law in state.laws if law.term.direction is term.direction), tolerance)
        dofs = term.surface.dofs
        touched = np.any(np.abs(term.directions) > 0.5, axis=1)
        strong.append(dofs[held[:, None] & touched])
        weak.append(dofs[loose[:, None] & touched])
    return np.unique(np.concatenate(strong)), np.unique(np.concatenate(weak))


def _kinks(law: LawState, tolerance: float) -> tuple[Mask, Mask]:
    """Whether a vertex sits within a convex kink, or at the edge of what it carries."""
    on = law.on_convex_kink()
    low, high = law.term.law.interval(law.argument, law.near)
    margin = tolerance * law.term.traction_scale
    inside = (law.traction > low + margin) & (law.traction < high - margin)
    return on & inside, on & ~inside


def _negative(system: System, held: Integers) -> int:
    """Negative eigenvalues of the Hessian with some dofs held. Collective."""
    matrix = system.jacobian.matrix.copy()
    start = system.load.owner_range[0]
    matrix.zeroRowsColumns((held + start).astype(PETSc.IntType), diag=1.0)
    matrix.setOption(PETSc.Mat.Option.SYMMETRIC, True)
    matrix.setOption(PETSc.Mat.Option.SPD, False)
    pc = PETSc.PC().create(system.comm)
    pc.setOperators(matrix)
    pc.setType("cholesky")
    pc.setFactorSolverType("mumps")
    pc.setUp()
    count = int(pc.getFactorMatrix().getMumpsInfog(_NEGATIVE_PIVOTS))
    pc.destroy()
    matrix.destroy()
    return count
