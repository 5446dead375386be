"""A scene as an assembled problem: mesh, forms, assembly, and whether a solution can exist."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from mpi4py import MPI

from ..certify import plausibility
from ..mesh import nodes
from ..mesh.domain import DEFAULT as MESH
from ..mesh.domain import Domain, check_affordable
from ..model import Model
from ..model.options import SolverTable
from ..problem.compose import Formulation
from ..problem.problem import Problem
from ..rigid import LoadFactors, Solvability
from ..runtime.cost import Timer
from ..runtime.log import logger, newton_step, warn
from ..solvers.method import Progress, SolveTask, checked, never
from ..system import existence
from ..system.system import System, assemble
from ..system.thresholds import DEFAULT, Thresholds

_PREPARED = logger("preparation")


@dataclass(frozen=True, kw_only=True)
class Preparation:
    """A scene as an assembled problem, before the solve.

    Attributes:
        scene: what the user asked for.
        model: the effects and their places.
        options: how to solve.
        system: the assembled problem.
        solvability: whether a solution can exist.
        timer: wall time by phase.
        warnings: sentences about numbers that may be mistakes, as far as they are known before the solve.
    """

    scene: Model
    model: Formulation
    options: SolverTable
    system: System
    solvability: Solvability
    timer: Timer
    warnings: tuple[str, ...] = ()

    @property
    def problem(self) -> Problem:
        """The problem that is assembled."""
        return self.system.problem

    def task(self, progress: Progress = newton_step, interrupted: Callable[[], bool] = never) -> SolveTask:
        """What is to be solved, and how.

        Args:
            progress: called at each Newton step; by default it is logged.
            interrupted: whether to stop (collective, asked at each Newton step).
        """
        return SolveTask(
            model=self.model,
            solvability=self.solvability,
            options=self.options,
            timer=self.timer,
            progress=progress,
            interrupted=interrupted,
        )

    def load_factors(self, *loads: str) -> LoadFactors:
        """Between which factors of some loads together the body is held, the others constant. Collective.

        Args:
            loads: ``part.traction`` or ``region.force`` (``body.force``), or just the part or region; none for the
                whole load.

        Raises:
            InputError: on all ranks alike: there is no such load.
        """
        return existence.load_factors(self.problem, self.system.forces, *loads)


def prepare(
    scene: Model,
    comm: MPI.Comm = MPI.COMM_WORLD,
    timer: Timer | None = None,
    domain: Domain | None = None,
    solvability: Solvability | None = None,
    thresholds: Thresholds = DEFAULT,
) -> Preparation:
    """Everything before the solve: mesh, forms, assembly, existence. Collective.

    Args:
        scene: what to solve.
        comm: the ranks.
        timer: where time goes; by default a new one.
        domain: the body on its mesh, where that exists already; by default it is meshed.
        solvability: whether a solution can exist, where that is known.
        thresholds: the numbers that tune the solvers.

    Raises:
        InputError: on all ranks alike.
    """
    timer = timer or Timer()
    options, model = checked(scene.solver), scene.formulation()
    with timer("mesh"):
        domain = domain or _meshed(scene, comm)
    system = assemble(domain, model, timer, thresholds)
    with timer("existence"):
        solvability = solvability or existence.solvability(system.problem, system.forces)
    margin = "" if solvability.margin is None else f", margin {solvability.margin:.3g}"
    _PREPARED.info("%d unknowns; existence: %s%s", system.dofs, solvability.state, margin)
    with timer("assembly"):
        system.attach_free_motions(solvability.loose)
        warnings = _warnings(scene, system, solvability)
    return Preparation(
        scene=scene,
        model=model,
        options=options,
        system=system,
        solvability=solvability,
        timer=timer,
        warnings=warnings,
    )


def _meshed(scene: Model, comm: MPI.Comm) -> Domain:
    """The body on its mesh; each shape knows what its own vertices take, but neither other bodies nor the degree."""
    domain, degree = scene.domain.build_hierarchy(comm, scene.dimension, MESH), scene.solver.degree or 1
    place, mend = ("solver.degree", "use degree 1, or fewer cells") if degree > 1 else ("domain", "use fewer cells")
    unknowns = domain.dimension * nodes.count(domain.mesh, degree)
    check_affordable(comm, unknowns, domain.dimension, place, mend)
    return domain


def _warnings(scene: Model, system: System, solvability: Solvability) -> tuple[str, ...]:
    """Warnings about numbers that may be mistakes, logged. Collective."""
    found = (
        *scene.domain.implausible(system.problem.domain.length),
        *plausibility.before_solving(system.problem, system.forces),
        *plausibility.of_existence(solvability),
    )
    warn(_PREPARED, found)
    return found
