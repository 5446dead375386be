"""Solve to a given accuracy, or within a given time: mesh, ε and tolerances follow from the estimated error.

The mesh is refined adaptively until the estimate is small enough. The three parts of the error are balanced: the mesh
has the largest share; smoothing and solver get what is small beside it.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import Any

from mpi4py import MPI

from ..errors import ExitCode
from ..mesh.refinement import Refinement
from ..runtime import memory
from ..runtime.mpi import largest
from ..scene import Scene
from ..solution import Solution
from . import adaptive, cost_forecast, quantities
from .adaptive import AdaptiveLevel, AdaptiveSolver
from .cost_forecast import AdaptiveStep, Cost
from .thresholds import CONTROL, ControlThresholds

_LARGEST = 2**31 - 1
"""Unknowns that PETSc's default integers can number."""


@dataclass(frozen=True)
class Goal:
    """What is asked for: an accuracy of a quantity, or the best within a time, or both.

    Attributes:
        accuracy: relative error; None: as small as the time allows.
        quantity: name of the target quantity.
        seconds: time budget, s; None: no limit.
    """

    accuracy: float | None
    quantity: str = "energy"
    seconds: float | None = None

    def as_dict(self) -> dict[str, Any]:
        """For ``summary.json``."""
        return {"requested": self.accuracy, "quantity": self.quantity, "time_budget": self.seconds}


@dataclass(frozen=True, kw_only=True)
class AccuracyResult:
    """What was reached for a goal.

    Attributes:
        goal: what was asked for.
        level: the last mesh.
        solution: its solution, as that of the scene.
        steps: all meshes.
        why: it ended, in words; None where the goal was reached.
        more: what a tenth of the error would cost.
    """

    goal: Goal
    level: AdaptiveLevel
    solution: Solution
    steps: tuple[AdaptiveStep, ...]
    why: str | None
    more: Cost | None

    @property
    def exit_code(self) -> int:
        """The solution's, or *not converged* where the accuracy was not reached."""
        missed = self.goal.accuracy is not None and self.why is not None
        return self.solution.exit_code or (ExitCode.NOT_CONVERGED if missed else ExitCode.CERTIFIED)

    def as_dict(self) -> dict[str, Any]:
        """For ``summary.json``."""
        last = self.steps[-1] if self.steps else None
        return {
            **self.goal.as_dict(),
            "estimated": last.error if last else None,
            "reached": self.why is None,
            "why": self.why,
            "tolerance": last.tolerance if last else None,
            "epsilon": last.epsilon if last else None,
            "ten_times_more": self.more.as_dict() if self.more else None,
            "levels": [step.as_dict() for step in self.steps],
        }


def reach(
    scene: Scene,
    comm: MPI.Comm,
    goal: Goal,
    solver: AdaptiveSolver,
    tell: Callable[[str], None],
    thresholds: ControlThresholds = CONTROL,
) -> AccuracyResult:
    """Refine until the goal is reached, or cannot be. Collective.

    Args:
        scene: what to solve; its mesh sets where to begin (:func:`.adaptive.coarsest`), its ε the largest.
        comm: the ranks.
        goal: what is asked for.
        solver: timer, progress and interruption.
        tell: called with a line about each mesh.
        thresholds: how mesh, smoothing and tolerance follow from the error.

    Raises:
        InputError: on all ranks alike: the scene has no such quantity, or does not fit its mesh.
    """
    return _AdaptiveRun(scene, comm, goal, solver, tell, thresholds).run()


@dataclass
class _AdaptiveRun:
    """One run to a goal. Everything it decides on is the same on all ranks."""

    scene: Scene
    comm: MPI.Comm
    goal: Goal
    solver: AdaptiveSolver
    tell: Callable[[str], None]
    thresholds: ControlThresholds
    steps: list[AdaptiveStep] = field(default_factory=list)
    failures: int = 0

    def run(self) -> AccuracyResult:
        self.base, self.room = memory.peak(self.comm), memory.limit() * self.thresholds.usable_memory
        self.quantity = quantities.find(self.goal.quantity)()
        self.solver = replace(self.solver, existence=self.quantity.needs_existence)
        begin, start = adaptive.coarsest(self.scene), time.perf_counter()
        level = self.solver.begin(
            _solved_with(begin, min(self.thresholds.coarsest_tolerance, begin.solver.tolerance * 1e3)), self.comm
        )
        why = self._note(level, start)
        while why is None and not self._done():
            start = time.perf_counter()
            found = self._next(level)
            if isinstance(found, str):
                why = found
            else:
                level = found
                why = self._note(level, start)
        return self._result(level, why)

    def _result(self, level: AdaptiveLevel, why: str | None) -> AccuracyResult:
        solution = replace(level.solution, scene=self.scene)
        more = None
        if self.steps and math.isfinite(self.steps[-1].error) and self.steps[-1].error > 0:
            wanted = (self.goal.accuracy or self.steps[-1].error) / 10
            more = cost_forecast.cost(self.steps, wanted, self.scene.dimension, self.base)
        if self.goal.accuracy is None and self.steps:
            why = None
        return AccuracyResult(
            goal=self.goal, level=level, solution=solution, steps=tuple(self.steps), why=why, more=more
        )

    def _note(self, level: AdaptiveLevel, start: float) -> str | None:
        """Record a level; why to stop at it, or None. Collective."""
        solution = level.solution
        if solution.solve_result is None or solution.solve_result.interrupted:
            return solution.reason
        self.quantity.add(level)
        if solution.estimate is None:
            self.failures += 1
            self.tell(f"{level.dofs:,} unknowns: {solution.reason}")
            return solution.reason if self.failures >= self.thresholds.failures else None
        self.failures = 0
        self.steps.append(self._step(level, largest(self.comm, time.perf_counter() - start)))
        self.tell(_line(len(self.steps), self.steps[-1], self.solver.timer.total))
        return None

    def _step(self, level: AdaptiveLevel, seconds: float) -> AdaptiveStep:
        estimate = level.solution.estimate
        assert estimate is not None
        norm, smoothing = estimate.energy_norm or 1.0, self.quantity.smoothing()
        return AdaptiveStep(
            dofs=level.dofs,
            error=self.quantity.error(),
            discretisation=estimate.discretisation / norm,
            smoothing=smoothing,
            algebraic=estimate.algebraic / norm,
            epsilon=level.solution.epsilon,
            tolerance=level.solution.scene.solver.tolerance,
            seconds=seconds,
            memory=memory.peak(self.comm),
        )

    def _done(self) -> bool:
        if not self.steps or self.failures:
            return False
        return self.steps[-1].error <= (self.goal.accuracy or 0.0)

    def _next(self, level: AdaptiveLevel) -> AdaptiveLevel | str:
        """The next level, or why there is none. Collective."""
        if len(self.steps) >= self.thresholds.most_levels:
            return f"{self.thresholds.most_levels} meshes were not enough"
        if too_much := self._unaffordable():
            return too_much
        scene = self._with_next_tolerances(level.solution.scene)
        if (
            self.failures == 1
            and (tight := self.thresholds.tighter * scene.solver.tolerance) >= self.thresholds.finest_tolerance
        ):
            return self.solver.again(level, _solved_with(scene, tight))
        if self._mesh_suffices():
            return self.solver.again(level, scene)
        bulk = self._bulk()
        refined = (
            adaptive.refined(level, bulk)
            if bulk == self._most
            else adaptive.refined_with_neighbours(level, bulk, self.thresholds)
        )
        return self._unaffordable_step(refined) or self.solver.refine(level, refined, scene, self.quantity.ahead())

    def _bulk(self) -> float:
        """How much of the squared error to refine: no more than takes the estimate to where it should be."""
        known = self.quantity.known_from_one_mesh
        if not self.steps or self.failures or self.goal.accuracy is None or not known:
            return self._most
        mesh, smoothing, _ = self.quantity.parts(self.steps[-1])
        left = (
            math.sqrt(max((self.thresholds.aim * self.goal.accuracy) ** 2 - smoothing**2, 0.0)) / mesh
            if mesh > 0
            else 1.0
        )
        # On Γc errors fall as the square of the energy norm's. Halving the edges of what is marked leaves a quarter.
        needed = (1 - (left**2 if self.quantity.in_energy_norm else left)) / 0.75
        return min(self._most, max(self.thresholds.smallest_bulk, needed))

    @property
    def _most(self) -> float:
        """Share of the squared error that a step refines that is not the last."""
        on_contact = self.quantity.known_from_one_mesh and not self.quantity.in_energy_norm
        if on_contact:
            return self.thresholds.bulk_on_contact
        return self.thresholds.bulk_2d if self.scene.dimension == 2 else self.thresholds.bulk_3d

    def _mesh_suffices(self) -> bool:
        """Whether ε or the tolerance, not the mesh, is what the next step must change."""
        if not self.steps or self.failures:
            return False
        mesh, smoothing, algebraic = self.quantity.parts(self.steps[-1])
        if smoothing > max(mesh, self._allowed(mesh)):
            return self._smoothing_falls()
        wanted = self.thresholds.aim * (self.goal.accuracy or 0.0)
        return mesh <= wanted < max(smoothing, algebraic) * 2

    def _smoothing_falls(self) -> bool:
        """Whether a smaller ε on the same mesh, where that was tried last, made smoothing's part smaller."""
        before = self.steps[-2] if len(self.steps) > 1 else None
        return (
            before is None or before.dofs != self.steps[-1].dofs or self.steps[-1].smoothing < 0.99 * before.smoothing
        )

    def _allowed(self, mesh: float) -> float:
        """What smoothing may take: a share of what is asked for, or all that a mesh which is good enough leaves."""
        if self.goal.accuracy is None:
            return self.thresholds.smoothing * mesh
        return max(
            self.thresholds.smoothing * self.goal.accuracy,
            math.sqrt(max((self.thresholds.aim * self.goal.accuracy) ** 2 - mesh**2, 0.0)),
        )

    def _with_next_tolerances(self, scene: Scene) -> Scene:
        """ε and tolerance for the next step, from the parts of the last one's error."""
        if not self.steps:
            return scene
        last = self.steps[-1]
        estimate = last.discretisation if self.goal.accuracy is None else self.goal.accuracy
        error = min(last.error, max(last.discretisation, estimate))
        wanted = self.thresholds.algebraic * (error if self.quantity.in_energy_norm else min(error, estimate))
        if last.algebraic > 0.1 * max(last.discretisation, estimate):
            wanted = min(wanted, 0.1 * last.tolerance)
        low, high = self.thresholds.finest_tolerance, self.thresholds.coarsest_tolerance
        mesh, smoothing, _ = self.quantity.parts(last)
        allowed = self._allowed(mesh)
        factor = max(0.8 * allowed / smoothing, self.thresholds.narrowest_step) if smoothing > allowed else 1.0
        return _narrowed(_solved_with(scene, min(max(wanted, low), high)), factor)

    def _unaffordable(self) -> str | None:
        """Whether the accuracy needs more memory than there is: said before it is tried."""
        known = [step for step in self.steps if math.isfinite(step.error)]
        if (
            len(known) < (1 if self.quantity.in_energy_norm else self.thresholds.meshes_before_forecast)
            or self.goal.accuracy is None
        ):
            return None
        needed = cost_forecast.cost(self.steps, self.goal.accuracy, self.scene.dimension, self.base)
        if needed.dofs <= _LARGEST and needed.memory <= self.room:
            return None
        return (
            f"{self.goal.accuracy:g} would need about {needed.dofs:.1e} unknowns and {needed.memory / 1024:.3g} GB; "
            f"{self.room / 1024:.3g} GB can be used"
        )

    def _unaffordable_step(self, refined: Refinement) -> str | None:
        """Whether the next step would exceed the time or the memory. Collective."""
        mesh, d = refined.domain.mesh, refined.domain.dimension
        dofs = d * int(mesh.topology.index_map(0).size_global)
        if not self.steps:
            return None
        if (needed := cost_forecast.memory(self.steps, dofs, d, self.base)) > self.room:
            return f"the next mesh of {dofs:,} unknowns would need {needed / 1024:.3g} GB"
        expected = largest(self.comm, self.solver.timer.total) + cost_forecast.seconds(self.steps, dofs)
        if self.goal.seconds is not None and expected > self.goal.seconds:
            return f"the next mesh of {dofs:,} unknowns would end after {expected:.0f} s"
        return None


def _solved_with(scene: Scene, tolerance: float) -> Scene:
    return scene.with_solver(tolerance=tolerance)


def _narrowed(scene: Scene, factor: float) -> Scene:
    """The scene with a smaller ε; the same where it does not smooth."""
    solver = scene.solver
    widths = {name: getattr(solver, name) for name in ("epsilon", "epsilon_absolute")}
    changed = {name: factor * width for name, width in widths.items() if width is not None}
    return scene.with_solver(**changed)


def _line(level: int, step: AdaptiveStep, elapsed: float) -> str:
    width = "" if step.epsilon is None else f", ε {step.epsilon:.2g}"
    error = f"error {step.error:.2e}" if math.isfinite(step.error) else "no error yet"
    return (
        f"mesh {level}: {step.dofs:,} unknowns, {error} (energy norm: mesh {step.discretisation:.1e}, smoothing "
        f"{step.smoothing:.1e}, solver {step.algebraic:.1e}), tolerance {step.tolerance:.0e}{width}, {elapsed:.1f} s"
    )
