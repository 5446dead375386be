"""Adaptivity: solve, estimate, mark, refine, transfer, and again: a scene climbs a ladder of meshes made to measure.

Cells are marked by Dörfler's bulk criterion (Dörfler 1996) on the estimated error by cell.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from dolfinx import fem
from mpi4py import MPI
from petsc4py import PETSc

from ..certify.estimate.estimator import Estimate
from ..mesh import refinement, transfer
from ..mesh.domain import Domain, Refinement
from ..runtime.mpi import agree, total
from ..runtime.timing import Timer
from ..scene import Scene
from ..solvers.method import Progress, silent
from ..typing import Entities
from ..workflow import Prepared, Solution, finish, prepare

_CLOSE, _CORRECTIONS = 1.05, 2
"""How near to the share wanted is near enough, and how often the marking is corrected for it."""


@dataclass(frozen=True)
class Rung:
    """One mesh of the ladder, solved.

    Attributes:
        prepared, solution: what was solved on it, and what was found. step: the prolongation from the rung below to
            its unknowns, None on the first.
    """

    prepared: Prepared
    solution: Solution
    step: PETSc.Mat | None

    @property
    def comm(self) -> MPI.Comm:
        """The communicator."""
        return self.prepared.system.comm

    @property
    def dofs(self) -> int:
        """Global number of unknowns."""
        return self.prepared.system.dofs


@dataclass(frozen=True)
class Climber:
    """What all rungs share.

    Attributes:
        timer: where time goes. progress, interrupted: see :mod:`.method`.
        existence: whether it is asked for on each mesh anew, not on the first only.
    """

    timer: Timer
    progress: Progress = silent
    interrupted: Callable[[], bool] = lambda: False
    existence: bool = False

    def begin(self, scene: Scene, comm: MPI.Comm) -> Rung:
        """A scene solved on its own mesh, without a coarser one. Collective.

        Raises:
            InputError: the scene does not fit its mesh, on all ranks alike.
        """
        prepared = prepare(scene, comm, self.timer)
        return Rung(prepared, finish(prepared, self.progress, self.interrupted), None)

    def up(self, rung: Rung, nesting: Refinement, scene: Scene, ahead: fem.Function | None = None) -> Rung:
        """The next rung: its scene solved on the refined mesh, from the solution on the rung below. Collective.

        Args:
            rung: the one below. nesting: the refined mesh. scene: to solve on it.
            ahead: a displacement on the rung below that is nearer to the next one's than its own solution. At a drop
                neighbouring vertices may each be the last before it, all in equilibrium; a start decides which.
        """
        prepared, below = self._prepared(rung, scene, nesting.domain), rung.prepared.system
        with self.timer("setup"):
            step = transfer.between(prepared.system, below, nesting)
            prepared.system.below = transfer.stacked(step, below)
        return self._solved(rung, prepared, step, ahead)

    def again(self, rung: Rung, scene: Scene) -> Rung:
        """The same mesh with another solver table. Collective."""
        prepared, below = self._prepared(rung, scene, rung.prepared.problem.domain), rung.prepared.system
        prepared.system.below = below.below
        return self._solved(rung, prepared, _identity(below.load))

    def _prepared(self, rung: Rung, scene: Scene, body: Domain) -> Prepared:
        return prepare(scene, rung.comm, self.timer, body, None if self.existence else rung.solution.solvability)

    def _solved(self, rung: Rung, prepared: Prepared, step: PETSc.Mat, ahead: fem.Function | None = None) -> Rung:
        found = rung.solution.solve_result
        if found is not None and ahead is not None:
            found = replace(found, u=ahead)
        start = (rung.prepared.system, found, step) if found is not None else None
        return Rung(prepared, finish(prepared, self.progress, self.interrupted, start), step)


def _identity(like: PETSc.Vec) -> PETSc.Mat:
    sizes = like.getSizes()
    return PETSc.Mat().createConstantDiagonal((sizes, sizes), 1.0, comm=like.comm)


def refined(rung: Rung, bulk: float) -> Refinement:
    """The mesh with so much of the squared error refined; the whole mesh where nothing was estimated. Collective."""
    domain, estimate = rung.prepared.problem.domain, rung.solution.estimate
    with rung.prepared.timer("mesh"):
        if estimate is None or bulk >= 1.0 or estimate.discretisation == 0.0:
            return refinement.uniform(domain)
        return refinement.marked(domain, marked(rung.comm, estimate, bulk))


def sparing(rung: Rung, share: float) -> Refinement:
    """The mesh with so much of the squared error refined, neighbours that are cut with the marked cells included.

    On coarse meshes they are many: to mark such a share would refine far more than it. Collective.
    """
    bulk, step = share, refined(rung, share)
    for _ in range(_CORRECTIONS):
        if (reached := _refined_share(rung, step, bulk)) <= _CLOSE * share:
            break
        bulk *= share / reached
        step = refined(rung, bulk)
    return step


def _refined_share(rung: Rung, step: Refinement, bulk: float) -> float:
    """Of the squared error: a marked cell counts in full, others by the cuts they have beside a marked one's."""
    found = rung.solution.estimate
    if found is None or found.discretisation == 0.0:
        return 0.0
    squares, chosen = found.cells**2, marked(rung.comm, found, bulk)
    cuts = squares * (np.bincount(step.parents, minlength=len(squares))[: len(squares)] - 1.0)
    own, cut, all_cut = (total(rung.comm, float(a.sum())) for a in (squares[chosen], cuts[chosen], cuts))
    return own / found.discretisation**2 * all_cut / cut


def marked(comm: MPI.Comm, estimate: Estimate, bulk: float) -> Entities:
    """The cells (local, owned) of the largest errors, which make up this share of the squared error. Collective.

    The threshold is one for all ranks; cells that tie with the last one are marked too, so symmetry stays.
    """
    squares = estimate.cells**2
    everything = np.sort(np.concatenate(agree(comm, squares)))[::-1]
    running = np.cumsum(everything)
    last = min(int(np.searchsorted(running, bulk * running[-1])), len(everything) - 1)
    return np.flatnonzero(squares >= everything[last] * (1 - 1e-9)).astype(np.int32)


def coarsest(scene: Scene) -> Scene:
    """The scene on the mesh to begin with: its own, made coarser as far as its shape allows."""
    return scene.changed(domain=scene.domain.coarsest())
