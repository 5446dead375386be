"""Nested iteration: each level of the mesh hierarchy starts from the solution on the next coarser level.

That solution gives displacement, active set and pieces of the laws, so that one or two steps remain on the finest mesh;
the prolongations also serve its geometric multigrid. Meshes without a hierarchy, and small ones, are solved directly.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from dolfinx import fem
from petsc4py import PETSc

from ..errors import InputError
from ..mesh import nodes
from ..mesh.transfer import DegreeTransfer, Transfer
from ..problem.compose import Formulation
from ..runtime.log import logger
from ..system.held_solver import LinearSettings
from ..system.multigrid import Level, Levels, prolongation, with_coarser_system
from ..system.system import System, assemble
from ..typing import Integers
from .convergence import Counts
from .method import SolveContext, SolveResult, SolverTable, SolveTask
from .quadratic import LinearSolve, choose

_LOG = logger("solvers")


@dataclass(frozen=True, kw_only=True)
class LevelSolution:
    """The result on one level, and the coarser levels that were used.

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
    """A solution on a coarser mesh, as the start on a finer one.

    Attributes:
        system: the system on the coarser mesh.
        result: what was found there.
        prolongation: from the coarser system's unknowns to the finer one's.
        levels: the coarser levels of the finer system.
        way: by which a force has moved an obstacle, m; None: no force presses one.
    """

    system: System
    result: SolveResult
    prolongation: PETSc.Mat
    levels: Levels
    way: float | None = None


def linear_settings(system: System, options: SolverTable) -> LinearSettings:
    """How a system's linear equations will be solved: by multigrid where it has a mesh hierarchy.

    Args:
        system: the assembled problem.
        options: method and linear solver.
    """
    kind = choose(options, system)
    nested = _has_coarser(system) and (kind.takes_start or kind is LinearSolve)
    return LinearSettings.choose(system, options.linear_solver, levels=nested)


def _has_coarser(system: System) -> bool:
    """Whether there is a coarser mesh, and the system is large enough for it to pay."""
    domain, degree = system.problem.domain, nodes.degree(system.problem.space)
    return system.dofs >= system.thresholds.nested_from and (degree > 1 or domain.coarsening is not None)


def solve(task: SolveTask, system: System) -> LevelSolution:
    """Solve a system; with a mesh hierarchy and a method that takes a start, from the coarsest level on. Collective.

    Args:
        task: what is solved.
        system: assembled on the finest mesh.

    Raises:
        SolverError: a convex step raised the energy.
    """
    kind = choose(task.options, system)
    coarser = _coarser_system(task, system) if kind.takes_start else None
    if coarser is None:
        levels = coarser_levels(task, system) if kind is LinearSolve else ()
        return _solved(task, system, levels)
    coarse, transfer = coarser
    coarse.attach_free_motions(system.free_motions.modes if system.free_motions else ())
    tolerance = max(system.thresholds.coarse_tolerance, task.options.tolerance)
    found = solve(task.with_options(tolerance=tolerance), coarse)
    with task.timer("setup"):
        step = prolongation(system, coarse, transfer)
    levels = (Level(system, coarse, step), *found.levels)
    return solve_from_coarser(
        task, system, CoarseStart(system=coarse, result=found.result, prolongation=step, levels=levels)
    )


def _solved(task: SolveTask, system: System, levels: Levels, *start: PETSc.Vec, steady: bool = False) -> LevelSolution:
    """What the method finds on one level. Collective."""
    kind = choose(task.options, system)
    _LOG.info("level of %d unknowns: method %s", system.dofs, kind.label)
    result = kind(SolveContext.create(task, system, levels, steady=steady)).solve(*start)
    return LevelSolution(system=system, levels=levels, result=result)


def solve_from_coarser(task: SolveTask, system: System, start: CoarseStart) -> LevelSolution:
    """Solve a system from a solution on a coarser mesh. Collective.

    Args:
        task: what is solved.
        system: assembled on the finer mesh.
        start: the solution on the coarser mesh.

    Raises:
        SolverError: a convex step raised the energy.
    """
    known, levels = start.result, start.levels
    if known.interrupted or task.interrupted():
        return _stopped(system, start)
    takes = known.converged and choose(task.options, system).takes_start
    first = (prolonged(start, system),) if takes else ()
    result = _solved(task, system, levels, *first, steady=known.steady).result
    off_path = known.off_path
    if not first or not (result.converged or result.interrupted):
        result = _solved(task, system, levels).result if first else result
        off_path = result.off_path
    counts = Counts()
    counts.add(known.counts)
    counts.add(result.counts)
    steady = result.steady and (known.steady or known.levels == 1)  # a single coarser level says too little
    result = replace(result, counts=counts, levels=known.levels + 1, steady=steady, off_path=off_path)
    return LevelSolution(system=system, levels=levels, result=result)


def _stopped(system: System, start: CoarseStart) -> LevelSolution:
    """What was found on the coarser mesh: where the solve is to stop, nothing is set up for it any more. Collective."""
    result = replace(
        start.result,
        u=system.displacement(prolonged(start, system)),
        converged=False,
        reason="interrupted",
        interrupted=True,
        levels=start.result.levels + 1,
        borne=None,
    )
    return LevelSolution(system=system, levels=start.levels, result=result)


def solve_from_displacement(task: SolveTask, system: System, u: fem.Function) -> LevelSolution:
    """Solve a system from a displacement on its own mesh, such as the solution of a similar load. Collective.

    Args:
        task: what is solved.
        system: assembled.
        u: the displacement, m.

    Raises:
        SolverError: a convex step raised the energy.
    """
    first = system.unknowns(u)
    first.scale(1.0 / system.problem.scales.displacement)
    return solve_from(task, system, first)


def solve_from(task: SolveTask, system: System, first: PETSc.Vec, levels: Levels | None = None) -> LevelSolution:
    """Solve a system from unknowns near its solution, and where that fails from the coarse meshes. Collective.

    Args:
        task: what is solved.
        system: assembled.
        first: the unknowns, changed in place; not used by a method that takes no start.
        levels: its coarser levels; None where they are not known.
    """
    if choose(task.options, system).takes_start:
        make_admissible(first, system)
        found = _solved(task, system, coarser_levels(task, system) if levels is None else levels, first)
        if found.result.converged or found.result.interrupted:
            return found
    return solve(task, system)


def coarser_levels(task: SolveTask, system: System) -> Levels:
    """The coarser levels for the multigrid of an equation, which needs no solutions on them. Collective.

    Args:
        task: what is solved.
        system: assembled on the finest mesh.
    """
    coarser = _coarser_system(task, system)
    if coarser is None:
        return ()
    coarse, transfer = coarser
    levels = coarser_levels(task, coarse)
    with task.timer("setup"):
        return (Level(system, coarse, prolongation(system, coarse, transfer)), *levels)


def _coarser_system(task: SolveTask, system: System) -> tuple[System, Transfer] | None:
    """The next coarser system, of degree 1 first, then on coarser meshes, and the transfer from it. Collective.

    None where the system is small or has none, or a piece of a side is lost on the coarser mesh, or meets another one.
    """
    if not _has_coarser(system):
        return None
    if nodes.degree(system.problem.space) > 1:
        return _of_degree_one(task, system), DegreeTransfer()
    with task.timer("mesh"):
        coarser = system.problem.domain.coarser()
    assert coarser is not None
    domain, transfer = coarser
    try:
        return assemble(domain, _coarser_model(task.model, system), task.timer, system.thresholds), transfer
    except InputError:
        if all(part.where is None for part in task.model.parts.values()):
            raise
        return None


def _of_degree_one(task: SolveTask, system: System) -> System:
    """The system of degree 1 on the same mesh. Collective."""
    return assemble(system.problem.domain, _coarser_model(task.model, system), task.timer, system.thresholds)


def _coarser_model(model: Formulation, system: System) -> Formulation:
    """The model of the next coarser level, of degree 1.

    Below degree 2 a nearly incompressible body that is too large for a direct solver is softened, and stays so on the
    levels below: of degree 1 no multigrid solves it, and this one only gives a start.
    """
    limits, mesh, ratio = system.thresholds, system.problem.domain.mesh, system.problem.bulk.volumetric_ratio
    if model.degree == 1:
        return model
    small = limits.is_direct(mesh.geometry.dim * nodes.count(mesh, 1), mesh.geometry.dim)
    softened = 0.0 < ratio <= limits.volumetric_ratio or not small
    return replace(model, degree=1, volumetric_ratio=limits.volumetric_ratio if softened else np.inf)


def refined_levels(
    task: SolveTask, system: System, coarse: System, below: Levels, transfer: Transfer
) -> tuple[PETSc.Mat, Levels]:
    """The way to a system from the one on the mesh that was refined, and the system's coarser levels. Collective.

    At degree 2 these are degree 1 on the same mesh and then on the coarser ones. A small system has none.

    Args:
        task: what is solved.
        system: assembled on the refined mesh.
        coarse: on the mesh that was refined.
        below: the coarser levels of that one.
        transfer: from that mesh.
    """
    step = prolongation(system, coarse, transfer)
    if system.dofs < system.thresholds.nested_from:
        return step, ()
    if nodes.degree(system.problem.space) == 1:
        return step, with_coarser_system(system, coarse, below, step)
    linear = _of_degree_one(task, system)
    linear.attach_free_motions(system.free_motions.modes if system.free_motions else ())
    coarser = below[0].system if below else _of_degree_one(task, coarse)
    levels = with_coarser_system(linear, coarser, below[1:], prolongation(linear, coarser, transfer))
    return step, (Level(system, linear, prolongation(system, linear, DegreeTransfer())), *levels)


def prolonged(start: CoarseStart, system: System) -> PETSc.Vec:
    """The coarse solution on the finer mesh, within its bounds and with its prescribed values. Collective.

    Args:
        start: the coarse solution, and the way from there.
        system: on the finer mesh.
    """
    coarse = start.system
    x, known = system.load.duplicate(), coarse.unknowns(start.result.u)
    start.prolongation.mult(known, x)
    _interpolate_relative(x, known, start, system)
    x.scale(coarse.problem.scales.displacement / system.problem.scales.displacement)
    make_admissible(x, system)
    return x


def _interpolate_relative(x: PETSc.Vec, known: PETSc.Vec, start: CoarseStart, system: System) -> None:
    """Interpolate relative displacements on interfaces themselves: what is closed, or sticks, stays so. Collective.

    Interpolated displacements of both sides have others between the coarse vertices, since their meshes do not match.

    Args:
        x: the displacement on the finer mesh; its relative displacements are overwritten.
        known: the one on the coarser mesh.
        start: the way from there.
        system: on the finer mesh.
    """
    if not system.problem.interfaces:
        return
    own, shares, values = x.duplicate(), x.duplicate(), known.duplicate()
    at = _relative_dofs(start.system)
    values.array[at] = 1.0
    start.prolongation.mult(values, shares)
    values.array[at] = known.array_r[at]
    start.prolongation.mult(values, own)
    fine = _relative_dofs(system)
    fine = fine[shares.array_r[fine] > 1.0 - system.thresholds.held_weight]
    x.array[fine] = own.array_r[fine]


def _relative_dofs(system: System) -> Integers:
    """The unknowns (local, owned) that are relative displacements."""
    return np.concatenate([one.surface.dofs.ravel() for one in system.problem.interfaces])


def make_admissible(x: PETSc.Vec, system: System) -> None:
    """Move unknowns within their bounds, onto a bound that only rounding keeps them from, and to prescribed values.

    Args:
        x: the unknowns, changed in place.
        system: with bounds and prescribed values.
    """
    at, d = system.jacobian.rows.dofs, system.problem.dimension
    near = system.thresholds.near * system.references.at(at // d)
    values, lower, upper = (vector.array_r[at] for vector in (x, system.lower, system.upper))
    values = np.where(values <= lower + near, lower, np.where(values >= upper - near, upper, values))
    x.array[at] = values
    system.prescribe(x)
