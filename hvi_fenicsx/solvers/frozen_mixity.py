"""Laws whose energy of separation depends on the mode: the mixity is frozen, solved, and taken anew until it stands.

With the mixity frozen such a law has a potential (:mod:`..laws.lengths`), which any method solves. The certificate says
by how much the mixity of the last state differs from the frozen one.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from dolfinx import fem

from ..problem.problem import Problem
from ..runtime.log import logger
from ..runtime.mpi import largest
from ..system.system import System
from ..system.thresholds import DEFAULT
from ..typing import Array, magnitude
from . import nested_iteration
from .convergence import Counts
from .method import SolveTask
from .nested_iteration import LevelSolution

_LOG = logger("solvers")
_ROUNDS = 60
"""Solves at most; the certificate tells where they do not end."""


def settled(task: SolveTask, found: LevelSolution) -> LevelSolution:
    """A solution whose mode mixity is the frozen one; the same where no law asks for it. Collective.

    Args:
        task: what is solved.
        found: a solution with any mixity.

    Raises:
        SolverError: a convex step raised the energy.
    """
    if found.system.problem.has_potential:
        return found
    counts = Counts()
    counts.add(found.result.counts)
    for _ in range(_ROUNDS):
        if not found.result.converged or found.result.interrupted:
            break
        anew = _energies(found.system.problem, found.result.u)
        change = _change(found.system, anew)
        _LOG.info("the energies of separation change by %.1e with the mode mixity", change)
        if change <= found.system.thresholds.margin * task.options.tolerance:
            break
        for term, energies in zip(found.system.terms, anew, strict=True):
            term.energies[:] = energies
        first = found.system.unknowns(found.result.u)
        found = nested_iteration.solve_from(task, found.system, first, found.levels)
        counts.add(found.result.counts)
    return replace(found, result=replace(found.result, counts=counts))


def freeze(problem: Problem, u: fem.Function) -> None:
    """Freeze all energies of separation at the mode mixity of a displacement. Collective.

    Args:
        problem: the problem.
        u: the displacement, nondimensional, ghosts updated.
    """
    for term, energies in zip(problem.terms, _energies(problem, u), strict=True):
        term.energies[:] = energies


def _energies(problem: Problem, u: fem.Function) -> list[Array]:
    """The energies of separation at the mode mixity of a displacement, by term, (m,) each. Collective."""
    found, values = [], problem.relative(u.x.array)
    for term in problem.terms:
        components = term.slip(values)
        size = largest(problem.comm, magnitude(components))
        found.append(term.energies_of(components, np.full(len(components), DEFAULT.near * size)))
    return found


def _change(system: System, energies: Sequence[Array]) -> float:
    """The largest relative change of the energies of separation. Collective."""
    changes = (magnitude(e / t.energies - 1.0) for t, e in zip(system.terms, energies, strict=True))
    return largest(system.comm, float(max(changes, default=0.0)))
