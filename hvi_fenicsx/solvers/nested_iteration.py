"""Nested iteration: each level of the mesh hierarchy starts from the solution on the coarser one.

Displacement, active set and pieces of the laws come with it, so that one or two steps remain on the finest mesh; the
prolongations also build its geometric multigrid. Meshes without a hierarchy, and small ones, are solved as they are.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

from petsc4py import PETSc

from ..mesh.transfer import Transfer
from ..problem.compose import Model
from ..rigid import Solvability
from ..runtime.log import logger
from ..system.assemble import assemble
from ..system.held_solver import LinearSettings
from ..system.levels import Level, Levels, prolongation
from ..system.system import System
from . import registry
from .context import RunControl, SolveContext
from .method import Method
from .options import SolverOptions
from .quadratic import LinearSolve
from .result import Counts, SolveResult

_LOG = logger("solvers")


@dataclass(frozen=True, kw_only=True)
class LevelSolution:
    """A system solved, and the coarser levels that it was solved with.

    Attributes:
        system: the assembled problem.
        levels: its coarser levels, none where there is no mesh hierarchy.
        result: what the method found.
    """

    system: System
    levels: Levels
    result: SolveResult


@dataclass(frozen=True, kw_only=True)
class CoarseStart:
    """A solution on a coarser mesh to start from.

    Attributes:
        system: on the coarser mesh.
        result: what was found there.
        prolongation: from its unknowns to the finer system's.
        levels: the coarser levels of the finer system.
    """

    system: System
    result: SolveResult
    prolongation: PETSc.Mat
    levels: Levels


def linear_settings(system: System, options: SolverOptions) -> LinearSettings:
    """How a system's linear equations will be solved: by multigrid where it has a mesh hierarchy.

    Args:
        system: the assembled problem.
        options: method, linear solver and thresholds.
    """
    kind = registry.choose(options, system)
    nested = _has_coarser(system, options) and (kind.takes_start or kind is LinearSolve)
    return LinearSettings.choose(system, options.linear_solver, options.thresholds.linear, levels=nested)


def _has_coarser(system: System, options: SolverOptions) -> bool:
    """Whether there is a coarser mesh, and it pays."""
    return system.dofs >= options.thresholds.nested_from and system.problem.domain.coarsening is not None


def solve(
    model: Model, system: System, solvability: Solvability, options: SolverOptions, control: RunControl
) -> LevelSolution:
    """Solve a system, from the coarsest level up where there is one and the method takes a start. Collective.

    Args:
        model: what is solved, for the coarser meshes.
        system: assembled on the finest mesh.
        solvability: the verdict on existence.
        options: method, tolerance, limits.
        control: timer, progress and interruption.

    Raises:
        SolverError: a convex step raised the energy.
    """
    kind = registry.choose(options, system)
    nested = _has_coarser(system, options)
    if not nested or not kind.takes_start:
        levels = hierarchy(model, system, options, control) if nested and kind is LinearSolve else ()
        context = SolveContext.create(system, levels, solvability, options, control)
        _log_level(system, kind)
        return LevelSolution(system=system, levels=levels, result=kind(context).solve())
    coarse, transfer = _assembled(model, system, control)
    coarse.attach_free_motions(system.free_motions.modes if system.free_motions else ())
    found = solve(model, coarse, solvability, _loosened(options), control)
    with control.timer("setup"):
        step = prolongation(system, coarse, transfer)
    levels = (Level(system, coarse, step), *found.levels)
    start = CoarseStart(system=coarse, result=found.result, prolongation=step, levels=levels)
    return ascend(system, start, solvability, options, control)


def ascend(
    system: System, start: CoarseStart, solvability: Solvability, options: SolverOptions, control: RunControl
) -> LevelSolution:
    """Solve a system from a solution on a coarser mesh. Collective.

    Args:
        system: assembled on the finer mesh.
        start: the solution on the coarser mesh.
        solvability: the verdict on existence.
        options: method, tolerance, limits.
        control: timer, progress and interruption.

    Raises:
        SolverError: a convex step raised the energy.
    """
    kind, found = registry.choose(options, system), start.result
    first = _prolonged(start, system) if found.converged and kind.takes_start else None
    context = SolveContext.create(system, start.levels, solvability, options, control, steady=found.steady)
    _log_level(system, kind)
    result = kind(context).solve() if first is None else kind(context).solve(first)
    if first is not None and not result.converged and not result.interrupted:
        result = kind(SolveContext.create(system, start.levels, solvability, options, control)).solve()
    counts = Counts()
    counts.add(found.counts)
    counts.add(result.counts)
    steady = result.steady and (found.steady or found.levels == 1)  # one level that stood is no sign yet
    result = replace(result, counts=counts, levels=found.levels + 1, steady=steady)
    return LevelSolution(system=system, levels=start.levels, result=result)


def _log_level(system: System, kind: type[Method]) -> None:
    _LOG.info("level of %d unknowns: method %s", system.dofs, kind.label)


def hierarchy(model: Model, system: System, options: SolverOptions, control: RunControl) -> Levels:
    """The coarser levels for the multigrid of an equation, which needs no start. Collective.

    Args:
        model: what is solved.
        system: assembled on the finest mesh.
        options: from which size on a coarser level pays.
        control: where time goes.
    """
    if not _has_coarser(system, options):
        return ()
    coarse, transfer = _assembled(model, system, control)
    below = hierarchy(model, coarse, options, control)
    with control.timer("setup"):
        return (Level(system, coarse, prolongation(system, coarse, transfer)), *below)


def _assembled(model: Model, system: System, control: RunControl) -> tuple[System, Transfer]:
    """The system on the next coarser mesh, and the transfer from that mesh. Collective."""
    with control.timer("mesh"):
        coarser = system.problem.domain.coarser()
    assert coarser is not None
    domain, transfer = coarser
    return assemble(domain, model, control.timer, system.thresholds), transfer


def _loosened(options: SolverOptions) -> SolverOptions:
    """The options with a tolerance that suits a start."""
    return replace(options, tolerance=max(options.thresholds.coarse_tolerance, options.tolerance))


def _prolonged(start: CoarseStart, system: System) -> PETSc.Vec:
    """The coarse solution on the finer mesh, within its bounds and with its prescribed values. Collective."""
    coarse = start.system
    x = system.load.duplicate()
    start.prolongation.mult(coarse.unknowns(start.result.u), x)
    x.scale(coarse.problem.scales.displacement / system.problem.scales.displacement)
    x.pointwiseMax(x, system.lower)
    x.pointwiseMin(x, system.upper)
    system.prescribe(x)
    return x
