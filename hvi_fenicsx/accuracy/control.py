"""Solve to a given accuracy, or within a given time: degree, mesh, ε and tolerances follow from the estimated error."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

from mpi4py import MPI

from ..scene import Scene
from . import degree_choice
from .adaptive import AdaptiveSolver
from .adaptive_run import AdaptiveRun
from .goal import AccuracyResult, DegreeChoice, Goal
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
    domain = solver.first_domain(scene, comm)

    def begun(degree: int) -> AdaptiveRun:
        run = AdaptiveRun(
            scene=scene.with_solver(degree=degree),
            domain=domain,
            goal=goal,
            solver=solver,
            report=report,
            thresholds=thresholds,
        )
        run.begin()
        return run

    run, choice = _begun(scene, begun, quadratic=degree_choice.at_once(goal, domain))
    if choice is not None:
        report(str(choice))
    found = run.finish()
    return replace(found, solution=replace(found.solution, scene=scene), choice=choice)


def _begun(
    scene: Scene, begun: Callable[[int], AdaptiveRun], *, quadratic: bool
) -> tuple[AdaptiveRun, DegreeChoice | None]:
    """The run on its first mesh, and how its degree was chosen where both were tried. Collective."""
    if scene.solver.degree is not None:
        return begun(scene.solver.degree), None
    other = begun(2) if quadratic else None
    if other is not None and other.steps and other.quantity.known_from_one_mesh:
        return other, None
    run = begun(1)
    if not degree_choice.worthwhile(run):
        return run, None
    other = other or begun(2)
    choice = degree_choice.between(run, other)
    return (other if choice.degree == 2 else run), choice
