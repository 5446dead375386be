"""Adaptivity: solve, estimate, mark, refine, transfer, and so on: a scene is solved on a hierarchy of adapted meshes.

Cells are marked by Dörfler's bulk criterion (Dörfler 1996) on the estimated error by cell.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from dolfinx import fem
from mpi4py import MPI
from petsc4py import PETSc

from ..certify.contact_state import ContactState
from ..estimate import bubbles, data_errors
from ..mesh import nodes, refinement
from ..mesh.domain import Domain
from ..model import Model
from ..problem.problem import Problem
from ..runtime.cost import Timer
from ..runtime.mpi import agree, largest, total
from ..solvers.method import never
from ..solvers.nested_iteration import CoarseStart, refined_levels
from ..system.multigrid import Level, Levels
from ..typing import Entities, together
from ..workflow import Preparation, Solution, find_solution, prepare

_ROUNDING = float(np.sqrt(np.finfo(float).eps))
"""Deviations so small beside the largest value are rounding."""


@dataclass(frozen=True, kw_only=True)
class ControlThresholds:
    """How mesh and smoothing follow from the estimated error.

    Attributes:
        bulk: share of the squared error that one step refines in 2D; its square in 3D, and for errors on Γc.
        smoothing: part of the accuracy asked for that smoothing may take, and the factor on ε in one step.
        failures: meshes in a row without a certified solution after which no equilibrium is expected.
        unresolved: root mean square deviation of a value on the boundary from its linear interpolation, as a part of
            its range, from which the first mesh is refined.
        small: unknowns up to which the first mesh is refined for that.
    """

    bulk: float = 0.7
    smoothing: float = 0.3
    failures: int = 3
    unresolved: float = 0.1
    small: int = 20_000


CONTROL = ControlThresholds()


@dataclass(frozen=True, kw_only=True)
class AdaptiveLevel:
    """One mesh of an adaptive hierarchy, and the solution on it.

    Attributes:
        prepared: the assembled problem.
        solution: what was found.
        levels: the coarser levels that were used.
        step: the prolongation from the coarser mesh's unknowns; None on the first mesh.
    """

    prepared: Preparation
    solution: Solution
    levels: Levels
    step: PETSc.Mat | None

    @property
    def comm(self) -> MPI.Comm:
        """The communicator."""
        return self.prepared.system.comm

    @property
    def dofs(self) -> int:
        """Global number of unknowns."""
        return self.prepared.system.dofs

    @property
    def states(self) -> tuple[ContactState, ...]:
        """Those of the parts of Γc; none where nothing was solved."""
        return () if self.solution.examination is None else self.solution.examination.states


@dataclass(frozen=True, kw_only=True)
class AdaptiveSolver:
    """Solves a scene on ever finer meshes, each from the solution on the one before.

    Attributes:
        timer: where time goes.
        interrupted: whether to stop (collective, asked at each Newton step).
        existence: whether existence is analysed on each mesh, and not on the first only.
    """

    timer: Timer
    interrupted: Callable[[], bool] = never
    existence: bool = False

    def begin(self, scene: Model, comm: MPI.Comm) -> AdaptiveLevel:
        """Solve a scene on a coarse mesh, which is refined where the data on the boundary ask for it. Collective.

        Args:
            scene: what to solve; its mesh is made coarser as far as its shape allows.
            comm: the ranks.

        Raises:
            InputError: the scene does not fit its mesh, on all ranks alike.
        """
        scene = scene.changed(domain=scene.domain.coarsest())
        with self.timer("mesh"):
            domain = scene.domain.build_hierarchy(comm, scene.dimension)
        prepared = prepare(scene, comm, self.timer, domain)
        while prepared.system.dofs < CONTROL.small:
            cells = _unresolved(prepared.problem)
            if not comm.allreduce(len(cells)):
                break
            domain = refinement.marked(prepared.problem.domain, cells).domain
            prepared = prepare(scene, comm, self.timer, domain)
        found = find_solution(prepared, interrupted=self.interrupted)
        return AdaptiveLevel(prepared=prepared, solution=found.estimated(), levels=found.levels, step=None)

    def refine(
        self, level: AdaptiveLevel, refined: refinement.Refinement, scene: Model, ahead: fem.Function | None = None
    ) -> AdaptiveLevel:
        """Solve a scene on the refined mesh, from the solution on the coarser one. Collective.

        Args:
            level: the coarser mesh.
            refined: its refinement.
            scene: to solve on the refined mesh.
            ahead: a displacement on the coarser mesh that is nearer to the next solution than the solution there. The
                start decides which vertex is the last one before a drop of a law, as there may be an equilibrium for
                each of several neighbours.
        """
        prepared, coarse = self._prepared(level, scene, refined.domain), level.prepared.system
        with self.timer("setup"):
            step, levels = refined_levels(prepared.task(), prepared.system, coarse, level.levels, refined.transfer)
        return self._solved(level, prepared, levels, step, ahead)

    def again(self, level: AdaptiveLevel, scene: Model) -> AdaptiveLevel:
        """Solve a scene with another solver table on the same mesh. Collective.

        Args:
            level: the mesh, with an earlier solution.
            scene: to solve on it.
        """
        prepared, before = self._prepared(level, scene, level.prepared.problem.domain), level.prepared.system
        first = [Level(prepared.system, one.system, one.prolongation) for one in level.levels[:1]]
        sizes = before.load.getSizes()
        identity = PETSc.Mat().createConstantDiagonal((sizes, sizes), 1.0, comm=level.comm)
        return self._solved(level, prepared, (*first, *level.levels[1:]), identity)

    def _prepared(self, level: AdaptiveLevel, scene: Model, domain: Domain) -> Preparation:
        known = None if self.existence else level.solution.solvability
        return prepare(scene, level.comm, self.timer, domain, known)

    def _solved(
        self,
        level: AdaptiveLevel,
        prepared: Preparation,
        levels: Levels,
        step: PETSc.Mat,
        ahead: fem.Function | None = None,
    ) -> AdaptiveLevel:
        found, obstacle = level.solution.solve_result, level.solution.obstacle
        assert found is not None
        start = CoarseStart(
            system=level.prepared.system,
            result=found if ahead is None else replace(found, u=ahead),
            prolongation=step,
            levels=levels,
            way=None if obstacle is None else obstacle.way,
        )
        finer = find_solution(prepared, interrupted=self.interrupted, start=start)
        return AdaptiveLevel(prepared=prepared, solution=finer.estimated(), levels=finer.levels, step=step)


def refined(level: AdaptiveLevel, bulk: float) -> refinement.Refinement:
    """Refine the cells of the largest errors; all cells where nothing was estimated. Collective.

    Args:
        level: the mesh, with its estimate.
        bulk: part of the squared error whose cells are marked.
    """
    domain, estimate = level.prepared.problem.domain, level.solution.estimate
    with level.prepared.timer("mesh"):
        if estimate is None or bulk >= 1.0 or estimate.discretisation == 0.0:
            return refinement.uniform(domain)
        # Cells whose error equals the last one's are marked too, which keeps symmetry; alike on all ranks.
        squares = estimate.cells**2
        everything = np.sort(np.concatenate(agree(level.comm, squares)))[::-1]
        running = np.cumsum(everything)
        last = min(int(np.searchsorted(running, bulk * running[-1])), len(everything) - 1)
        cells = np.flatnonzero(squares >= everything[last] * (1 - 1e-9)).astype(np.int32)
        return refinement.marked(domain, cells)


def _unresolved(problem: Problem) -> Entities:
    """The owned cells at whose facets data vary otherwise than linearly, while on the part they do so. Collective.

    What no mesh has seen no estimate is sure of: a gap is first of all known at vertices. A load that jumps at one
    place does so within one facet of any mesh: it is the part as a whole that decides.
    """
    space, comm = bubbles.space(problem.space.mesh, nodes.degree(problem.space)), problem.comm
    found = list[Entities]()
    for facets, value in data_errors.everything(problem):
        at = data_errors.facet_modes(problem, space, facets)
        squares, area, values = at.beyond_nodes(value) ** 2 @ at.weights, at.facets.areas, at.of(value)
        low, high = (sign * largest(comm, float(np.max(sign * values, initial=-np.inf))) for sign in (-1.0, 1.0))
        allowed = max(CONTROL.unresolved * (high - low), _ROUNDING * max(abs(low), abs(high))) ** 2
        if total(comm, float(area @ squares)) > allowed * total(comm, float(np.sum(area))):
            found.append(at.facets.cells[squares > allowed])
    return np.unique(together(found)).astype(np.int32)


@dataclass(frozen=True, kw_only=True)
class AdaptiveStep:
    """One adaptive step: its cost and what it gave.

    Attributes:
        dofs: unknowns.
        error: estimated, relative, of the quantity asked for (infinite: none yet).
        discretisation: the mesh's part of the error in the energy norm, relative.
        smoothing: smoothing's part of the quantity's error, relative.
        algebraic: the solver's part of the error in the energy norm, relative.
        epsilon: relative width of the smoothing, or None.
        tolerance: of the solver.
        seconds: wall time of this step.
        memory: the program's peak so far, MB.
    """

    dofs: int
    error: float
    discretisation: float
    smoothing: float
    algebraic: float
    epsilon: float | None
    tolerance: float
    seconds: float
    memory: float
