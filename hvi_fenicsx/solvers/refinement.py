"""Iterative refinement: a solution once more, with the rounding of its elastic forces taken out of the equations.

The rows of a matrix round each on their own. On a mesh of equal cells they all round alike: then the elastic forces of
a body that turns far have a net force, which contact and laws carry or do not. Forces summed by cell have none. What
the two differ by at a solution becomes a load, and the inequality is solved again from there.
"""

from __future__ import annotations

from dataclasses import replace

from ..errors import SolverError
from ..rigid import Solvability
from ..runtime.log import logger
from ..system.levels import Levels
from ..system.system import System
from ..typing import Array
from . import registry
from .context import RunControl, SolveContext, SolverOptions
from .method import Counts, SolveResult

_LOG = logger("solvers")


def refined(
    system: System,
    levels: Levels,
    found: SolveResult,
    reaction: Array,
    solvability: Solvability,
    options: SolverOptions,
    control: RunControl,
) -> SolveResult | None:
    """The solution with exact elastic forces; None where the method cannot begin at one, or ends without. Collective.

    Args:
        system: what was solved.
        levels: its coarser levels.
        found: its solution.
        reaction: internal forces minus loads at the solution, summed by cell, Cartesian, (vertices, d).
        solvability: whether a solution can exist.
        options: method, tolerance, limits.
        control: timer, progress and interruption.
    """
    kind, start = registry.choose(options, system), system.unknowns(found.u)
    if not kind.takes_start:
        return None
    _LOG.info("rounding of the stiffness matrix: solved again with forces by cell")
    exact = system.with_elastic_residual(start, reaction)
    try:
        again = kind(SolveContext.create(exact, levels, solvability, options, control)).solve(start)
    except SolverError:
        return None
    counts = Counts()
    counts.add(found.counts)
    counts.add(again.counts)
    if not again.converged:
        return None
    return replace(again, counts=counts, levels=found.levels, borne=found.borne, off_path=found.off_path)
