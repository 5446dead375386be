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
from ..rigid import Solvability
from ..runtime.log import logger
from ..system.held_solver import LinearSettings
from ..system.multigrid import Level, Levels, prolongation, with_coarser_system
from ..system.system import System, assemble
from ..typing import Integers
from . import quadratic
from .convergence import Counts
from .method import Method, RunControl, SolveContext, SolveResult, SolverOptions
from .quadratic import LinearSolve
from .thresholds import Thresholds

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


def linear_settings(system: System, options: SolverOptions) -> LinearSettings:
    """How a system's linear equations will be solved: by multigrid where it has a mesh hierarchy.

    Args:
        system: the assembled problem.
        options: method, linear solver and thresholds.
    """
    kind = quadratic.choose(options, system)
    nested = _has_coarser(system, options) and (kind.takes_start or kind is LinearSolve)
    return LinearSettings.choose(system, options.linear_solver, options.thresholds.linear, levels=nested)


def _has_coarser(system: System, options: SolverOptions) -> bool:
    """Whether there is a coarser mesh, and the system is large enough for it to pay."""
    domain, degree = system.problem.domain, nodes.degree(system.problem.space)
    return system.dofs >= options.thresholds.nested_from and (degree > 1 or domain.coarsening is not None)


def solve(
    model: Formulation, system: System, solvability: Solvability, options: SolverOptions, control: RunControl
) -> LevelSolution:
    """Solve a system; with a mesh hierarchy and a method that takes a start, from the coarsest level on. Collective.

    Args:
        model: what is solved, for the coarser meshes.
        system: assembled on the finest mesh.
        solvability: whether a solution can exist.
        options: method, tolerance, limits.
        control: timer, progress and interruption.

    Raises:
        SolverError: a convex step raised the energy.
    """
    kind = quadratic.choose(options, system)
    nested = _has_coarser(system, options)
    coarser = _coarser_system(model, system, control) if nested and kind.takes_start else None
    if coarser is None:
        levels = coarser_levels(model, system, options, control) if nested and kind is LinearSolve else ()
        context = SolveContext.create(system, levels, solvability, options, control)
        _log_level(system, kind)
        return LevelSolution(system=system, levels=levels, result=kind(context).solve())
    coarse, transfer = coarser
    coarse.attach_free_motions(system.free_motions.modes if system.free_motions else ())
    found = solve(model, coarse, solvability, _with_coarse_tolerance(options), control)
    with control.timer("setup"):
        step = prolongation(system, coarse, transfer)
    levels = (Level(system, coarse, step), *found.levels)
    start = CoarseStart(system=coarse, result=found.result, prolongation=step, levels=levels)
    return solve_from_coarser(system, start, solvability, options, control)


def solve_from_coarser(
    system: System, start: CoarseStart, solvability: Solvability, options: SolverOptions, control: RunControl
) -> LevelSolution:
    """Solve a system from a solution on a coarser mesh. Collective.

    Args:
        system: assembled on the finer mesh.
        start: the solution on the coarser mesh.
        solvability: whether a solution can exist.
        options: method, tolerance, limits.
        control: timer, progress and interruption.

    Raises:
        SolverError: a convex step raised the energy.
    """
    if start.result.interrupted or control.interrupted():
        return _stopped(system, start, options.thresholds)
    kind, found = quadratic.choose(options, system), start.result
    takes = found.converged and kind.takes_start
    first = prolonged(start, system, options.thresholds) if takes else None
    context = SolveContext.create(system, start.levels, solvability, options, control, steady=found.steady)
    _log_level(system, kind)
    result = kind(context).solve() if first is None else kind(context).solve(first)
    if first is not None and not result.converged and not result.interrupted:
        first = None
        result = kind(SolveContext.create(system, start.levels, solvability, options, control)).solve()
    counts = Counts()
    counts.add(found.counts)
    counts.add(result.counts)
    steady = result.steady and (found.steady or found.levels == 1)  # a single coarser level says too little
    off_path = result.off_path if first is None else found.off_path
    result = replace(result, counts=counts, levels=found.levels + 1, steady=steady, off_path=off_path)
    return LevelSolution(system=system, levels=start.levels, result=result)


def _stopped(system: System, start: CoarseStart, thresholds: Thresholds) -> LevelSolution:
    """What was found on the coarser mesh: where the solve is to stop, nothing is set up for it any more. Collective."""
    u = system.displacement(prolonged(start, system, thresholds))
    result = replace(
        start.result,
        u=u,
        converged=False,
        reason="interrupted",
        interrupted=True,
        levels=start.result.levels + 1,
        borne=None,
    )
    return LevelSolution(system=system, levels=start.levels, result=result)


def solve_from_displacement(
    model: Formulation,
    system: System,
    u: fem.Function,
    solvability: Solvability,
    options: SolverOptions,
    control: RunControl,
) -> LevelSolution:
    """Solve a system from a displacement on its own mesh, such as the solution of a similar load. Collective.

    Args:
        model: what is solved, for the coarser meshes.
        system: assembled.
        u: the displacement, m.
        solvability: whether a solution can exist.
        options: method, tolerance, limits.
        control: timer, progress and interruption.

    Raises:
        SolverError: a convex step raised the energy.
    """
    kind = quadratic.choose(options, system)
    if not kind.takes_start:
        return solve(model, system, solvability, options, control)
    levels = coarser_levels(model, system, options, control)
    first = system.unknowns(u)
    first.scale(1.0 / system.problem.scales.displacement)
    make_admissible(first, system, options.thresholds)
    _log_level(system, kind)
    context = SolveContext.create(system, levels, solvability, options, control)
    result = kind(context).solve(first)
    if result.converged or result.interrupted:
        return LevelSolution(system=system, levels=levels, result=result)
    return solve(model, system, solvability, options, control)


def _log_level(system: System, kind: type[Method]) -> None:
    _LOG.info("level of %d unknowns: method %s", system.dofs, kind.label)


def coarser_levels(model: Formulation, system: System, options: SolverOptions, control: RunControl) -> Levels:
    """The coarser levels for the multigrid of an equation, which needs no solutions on them. Collective.

    Args:
        model: what is solved.
        system: assembled on the finest mesh.
        options: from which size on a coarser level pays.
        control: where time goes.
    """
    if not _has_coarser(system, options):
        return ()
    coarser = _coarser_system(model, system, control)
    if coarser is None:
        return ()
    coarse, transfer = coarser
    levels = coarser_levels(model, coarse, options, control)
    with control.timer("setup"):
        return (Level(system, coarse, prolongation(system, coarse, transfer)), *levels)


def _coarser_system(model: Formulation, system: System, control: RunControl) -> tuple[System, Transfer] | None:
    """The next coarser system, of degree 1 first, then on coarser meshes, and the transfer from it. Collective.

    None where a piece of a side is lost on the coarser mesh, or meets another one there.
    """
    domain = system.problem.domain
    if nodes.degree(system.problem.space) > 1:
        return _of_degree_one(model, system, control), DegreeTransfer()
    with control.timer("mesh"):
        coarser = domain.coarser()
    assert coarser is not None
    domain, transfer = coarser
    try:
        return assemble(domain, _coarser_model(model, system), control.timer, system.thresholds), transfer
    except InputError:
        if all(part.where is None for part in model.parts.values()):
            raise
        return None


def _of_degree_one(model: Formulation, system: System, control: RunControl) -> System:
    """The system of degree 1 on the same mesh. Collective."""
    return assemble(system.problem.domain, _coarser_model(model, system), control.timer, system.thresholds)


def _coarser_model(model: Formulation, system: System) -> Formulation:
    """The model of the next coarser level, of degree 1.

    Below degree 2 a nearly incompressible body that is too large for a direct solver is softened, and stays so on the
    levels below: of degree 1 no multigrid solves it, and this one only gives a start.
    """
    limits, mesh, ratio = system.thresholds, system.problem.domain.mesh, system.problem.bulk.volumetric_ratio
    if model.degree == 1:
        return model
    large = mesh.geometry.dim * nodes.count(mesh, 1) > limits.largest_rubber[mesh.geometry.dim]
    softened = 0.0 < ratio <= limits.volumetric_ratio or large
    return replace(model, degree=1, volumetric_ratio=limits.volumetric_ratio if softened else np.inf)


def refined_levels(
    model: Formulation,
    system: System,
    coarse: System,
    below: Levels,
    transfer: Transfer,
    options: SolverOptions,
    control: RunControl,
) -> tuple[PETSc.Mat, Levels]:
    """The way to a system from the one on the mesh that was refined, and the system's coarser levels. Collective.

    At degree 2 these are degree 1 on the same mesh and then on the coarser ones. A small system has none.

    Args:
        model: what is solved.
        system: assembled on the refined mesh.
        coarse: on the mesh that was refined.
        below: the coarser levels of that one.
        transfer: from that mesh.
        options: from which size on a coarser level pays.
        control: where time goes.
    """
    step = prolongation(system, coarse, transfer)
    if system.dofs < options.thresholds.nested_from:
        return step, ()
    if nodes.degree(system.problem.space) == 1:
        return step, with_coarser_system(system, coarse, below, step)
    linear = _of_degree_one(model, system, control)
    linear.attach_free_motions(system.free_motions.modes if system.free_motions else ())
    coarser = below[0].system if below else _of_degree_one(model, coarse, control)
    levels = with_coarser_system(linear, coarser, below[1:], prolongation(linear, coarser, transfer))
    return step, (Level(system, linear, prolongation(system, linear, DegreeTransfer())), *levels)


def _with_coarse_tolerance(options: SolverOptions) -> SolverOptions:
    """The options with the tolerance of a coarser level."""
    tolerance = max(options.thresholds.coarse_tolerance, options.tolerance)
    return options.model_copy(update={"tolerance": tolerance})


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


def prolonged(start: CoarseStart, system: System, thresholds: Thresholds) -> PETSc.Vec:
    """The coarse solution on the finer mesh, within its bounds and with its prescribed values. Collective.

    Args:
        start: the coarse solution, and the way from there.
        system: on the finer mesh.
        thresholds: what counts as on a bound.
    """
    coarse = start.system
    x, known = system.load.duplicate(), coarse.unknowns(start.result.u)
    start.prolongation.mult(known, x)
    _interpolate_relative(x, known, start, system)
    x.scale(coarse.problem.scales.displacement / system.problem.scales.displacement)
    make_admissible(x, system, thresholds)
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


def make_admissible(x: PETSc.Vec, system: System, thresholds: Thresholds) -> None:
    """Move unknowns within their bounds, onto a bound that only rounding keeps them from, and to prescribed values.

    Args:
        x: the unknowns, changed in place.
        system: with bounds and prescribed values.
        thresholds: what counts as on a bound.
    """
    at, d = system.jacobian.rows.dofs, system.problem.scales.dimension
    near = thresholds.near * system.references.at(at // d)
    values, lower, upper = (vector.array_r[at] for vector in (x, system.lower, system.upper))
    values = np.where(values <= lower + near, lower, np.where(values >= upper - near, upper, values))
    x.array[at] = values
    system.prescribe(x)
