"""Solve to a given accuracy, or within a given time: degree, mesh, ε and tolerances follow from the estimated error."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

from mpi4py import MPI

from ..scene import Scene
from . import degree_choice
from .adaptive import AdaptiveSolver
from .adaptive_run import AdaptiveRun
from .goal import AccuracyResult, Goal
from .thresholds import CONTROL, ControlThresholds


def solve_to_goal(
    scene: Scene,
    comm: MPI.Comm,
    goal: Goal,
    solver: AdaptiveSolver,
    report: Callable[[str], None],
    thresholds: ControlThresholds = CONTROL,
) -> AccuracyResult:
    """Refine until the goal is reached, or cannot be; at the cheaper degree where the scene states none. Collective.

    Args:
        scene: what to solve; its mesh sets where to begin (:func:`.adaptive.coarsest`), its ε is the largest.
        comm: the ranks.
        goal: what is asked for.
        solver: timer, progress and interruption.
        report: called with a line about each mesh.
        thresholds: how mesh, smoothing and tolerance follow from the error.

    Raises:
        InputError: on all ranks alike: the scene has no such quantity, or does not fit its mesh.
    """

    def begun(degree: int) -> AdaptiveRun:
        run = AdaptiveRun(
            scene=scene.with_solver(degree=degree),
            comm=comm,
            goal=goal,
            solver=solver,
            report=report,
            thresholds=thresholds,
        )
        run.begin()
        return run

    choice, run = None, begun(scene.solver.degree or 1)
    if scene.solver.degree is None and degree_choice.worthwhile(run):
        other = begun(2)
        choice = degree_choice.between(run, other)
        report(str(choice))
        run = other if choice.degree == 2 else run
        del other
    found = run.finish()
    return replace(found, solution=replace(found.solution, scene=scene), choice=choice)
