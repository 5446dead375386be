"""Is an equilibrium a local minimiser of the energy? First the directional derivatives, then the curvature.

Where the energy falls to first order in an admissible direction, it is none. Else, where no law softens, it is one.
Otherwise the inertia of the true Hessian on the active subspace decides, if it is asked for: by Sylvester's law the
number of negative pivots of an LDLᵀ factorisation is the number of negative eigenvalues, so the sign of the smallest is
known without computing it. Components in which the energy grows to first order in each admissible direction cannot move
and are held; other ones at a bound or a kink may move one way only: positive with them free means a minimiser, negative
with them held means none, anything else stays undecided.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager

import numpy as np
from dolfinx import fem
from mpi4py import MPI

from ..problem.problem import Problem
from ..problem.references import References
from ..runtime.timing import Timer
from ..solvers.law_models import Cells, VertexModel
from ..system.factorisation import Factorisation, form_of
from ..system.system import System
from ..typing import Array, Integers
from .directional import Growth, growth

LOCAL_MINIMISER, NO_MINIMISER, UNDECIDED = "local minimiser", "not a minimiser", "undecided"
_PREFIX = "inertia_"


def status(references: References, u: fem.Function, forces: Array, tolerance: float, *, inertia: bool) -> str:
    """Whether a certified u is a local minimiser. Collective.

    Args:
        references: of the problem, with the laws that were solved.
        u: nondimensional, ghosts updated.
        forces: internal forces minus loads at the owned blocks, (blocks, d).
        tolerance: relative traction up to which a growth of the energy is none.
        inertia: whether to factorise the Hessian where the laws leave it open.
    """
    problem = references.problem
    comm = problem.domain.mesh.comm
    found = growth(references, problem.relative(u.x.array), forces, tolerance)
    if comm.allreduce(bool(np.any(found.falls)), op=MPI.LOR):
        return NO_MINIMISER
    if not comm.allreduce(bool(np.any(found.softens)), op=MPI.LOR):
        return LOCAL_MINIMISER
    return _by_inertia(problem, u, found) if inertia else UNDECIDED


def _by_inertia(problem: Problem, u: fem.Function, found: Growth) -> str:
    """The status by one or two factorisations. Collective."""
    system = System(problem, Timer())
    x = system.unknowns(u)
    models = []
    for term in system.terms:
        argument = term.argument(x.array_r)
        models.append(VertexModel(term.law, Cells.around(term.law.convex, argument, radial=term.radial)))
    system.jacobian.set_rates(system.equations.tangents(x, models))
    strong, weak = np.flatnonzero(found.strong), np.flatnonzero(found.weak)
    with negative_eigenvalues(system) as negative:
        if negative(strong) == 0:
            status = LOCAL_MINIMISER
        else:
            status = NO_MINIMISER if (negative(np.union1d(strong, weak)) or 0) > 0 else UNDECIDED
    system.free()
    return status


@contextmanager
def negative_eigenvalues(system: System) -> Iterator[Callable[[Integers], int | None]]:
    """How many eigenvalues of a system's matrix are negative, by factorisations.

    The function takes the dofs (local, owned) that are held, and says None where the factorisation failed. Collective.

    Args:
        system: the system, with the tangents that are set.
    """
    form = form_of(system, _PREFIX)

    def negative(held: Integers) -> int | None:
        factors = Factorisation(form, form.matrix(), own_prefix=_PREFIX)
        factors.allow_negative()
        factors.factorise(held)
        count = None if factors.failure else factors.negative
        factors.free()
        return count

    yield negative
    form.free()
