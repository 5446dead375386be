"""Above the limit load: the last state that is borne, in the place of a body on its way off.

Where ``auto`` has followed the load path to its end, that state is known; else the path is followed here, as where
obstacles are moved: on the path of ``auto`` they stay where they have been moved to.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

from ..certify import plausibility
from ..errors import InputError, SolverError
from ..model import PathTable
from ..paths.state import End
from ..paths.vertex_laws import is_straight
from ..problem.problem import FactoredProblem, Problem
from ..reduced import loading
from ..runtime.log import logger
from ..solvers import frozen_mixity, obstacle_force
from ..solvers.method import Borne, never
from ..workflow import LastBorne, Preparation, Solution
from ..workflow.solving import examine

_LOG = logger("path")


def in_place_of(prepared: Preparation, failed: Solution, interrupted: Callable[[], bool] = never) -> Solution:
    """The last state that is borne, where no solution was found and the body may come off; else what was found.

    The factor of loads, prescribed displacements and moved obstacles grows from 0; bonds have no memory. Collective.

    Args:
        prepared: the scene.
        failed: what was found of it.
        interrupted: whether to stop (collective).
    """
    if not _may_come_off(prepared, failed):
        return failed
    assert failed.solve_result is not None
    moved = any(bounds.move is not None for bounds in prepared.problem.bounds)  # which `auto` does not scale
    if (known := failed.solve_result.borne) is not None and not moved:
        factored = FactoredProblem(prepared.problem, loading.load_names(prepared.system))
        return _shown(prepared, factored.at(known.factor), known, failed)
    _LOG.info("no equilibrium found under the whole load: the load is followed from 0 to the last state that is borne")
    try:
        return _at_the_limit(prepared, failed, interrupted)
    except (InputError, SolverError) as error:
        _LOG.info("the load cannot be followed: %s", error)
        return failed


def _at_the_limit(prepared: Preparation, failed: Solution, interrupted: Callable[[], bool]) -> Solution:
    """The state of the largest factor below that of the whole load; else what was found. Collective."""
    from .following import PathRun  # two hundred modules, which few runs want

    run = PathRun(prepared, PathTable(memory=False))
    if not is_straight(run.condensed) and 2 * run.condensed.size > prepared.system.thresholds.curve_unknowns:
        run.free()
        return failed
    path = run.follow(interrupted=interrupted)
    factor = path.rows[path.peak].factor if path.rows else 0.0
    found = run.state(path.peak) if 0.0 < factor < 1.0 and path.end != End.INTERRUPTED else None
    run.free()
    assert failed.solve_result is not None
    if path.end == End.INTERRUPTED:
        return replace(failed, solve_result=replace(failed.solve_result, interrupted=True))
    if found is None:
        return failed
    problem, u = found
    return _shown(prepared, problem, Borne(u=u, factor=factor), failed)


def _may_come_off(prepared: Preparation, failed: Solution) -> bool:
    """Whether there is a limit load to look for, and a path to it takes little time. Collective."""
    if failed.converged or failed.solve_result is None or failed.solve_result.interrupted:
        return False
    system, problem = prepared.system, prepared.problem
    if failed.solvability.state == "held" or not problem.has_potential or obstacle_force.pressed(problem) is not None:
        return False
    if system.comm.allreduce(len(system.jacobian.rows.dofs)) > system.thresholds.vertex_unknowns:
        return False
    system.jacobian.clear()
    return True


def _shown(prepared: Preparation, problem: Problem, borne: Borne, failed: Solution) -> Solution:
    """The last state that is borne, certified under its load. Collective."""
    assert failed.solve_result is not None
    u = borne.u
    frozen_mixity.freeze(problem, u)
    found = examine(prepared, problem, u)
    return replace(
        failed,
        problem=problem,
        solve_result=replace(failed.solve_result, u=u),
        examination=found,
        warnings=prepared.warnings + plausibility.of_solution(problem, found, u),
        last_borne=LastBorne(factor=borne.factor, whole_load=failed),
    )
