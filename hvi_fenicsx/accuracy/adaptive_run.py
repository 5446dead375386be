"""One run to a goal at one degree: the mesh is refined until the error is small enough, or memory or time end.

How mesh, ε and tolerances follow from the estimated error: :mod:`.error_balance`.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from dataclasses import dataclass, field, replace

from mpi4py import MPI

from ..mesh import nodes
from ..mesh.domain import Domain
from ..mesh.refinement import Refinement
from ..runtime import memory
from ..runtime.mpi import largest
from ..scene import Scene
from . import adaptive, cost_forecast, quantities
from .adaptive import AdaptiveLevel, AdaptiveSolver
from .cost_forecast import AdaptiveStep, Cost, Elements
from .error_balance import ErrorBalance, with_tolerance
from .goal import AccuracyResult, Goal
from .thresholds import CONTROL, ControlThresholds

_LARGEST = 2**31 - 1
"""Unknowns that PETSc's default integers can number."""


@dataclass(kw_only=True)
class AdaptiveRun:
    """One run to a goal. Everything it decides on is the same on all ranks.

    Attributes:
        scene: what to solve; its ε is the largest.
        domain: the body on the first mesh (:meth:`.AdaptiveSolver.first_domain`).
        goal: what is asked for.
        solver: timer, progress and interruption.
        report: called with a line about each mesh.
        thresholds: how mesh, smoothing and tolerance follow from the error.
        steps: the meshes whose error is known.
    """

    scene: Scene
    domain: Domain
    goal: Goal
    solver: AdaptiveSolver
    report: Callable[[str], None]
    thresholds: ControlThresholds = CONTROL
    steps: list[AdaptiveStep] = field(default_factory=list)

    def __post_init__(self) -> None:
        self.comm: MPI.Comm = self.domain.mesh.comm
        self.elements = Elements(dimension=self.scene.dimension, degree=self.scene.solver.degree or 1)
        self.base, self.room = memory.peak(self.comm), memory.room(self.comm) * self.thresholds.usable_memory
        self.quantity = quantities.find(self.goal.quantity)()
        self.solver = replace(self.solver, existence=self.quantity.needs_existence)
        self.balance = ErrorBalance(
            accuracy=self.goal.accuracy, quantity=self.quantity, elements=self.elements, thresholds=self.thresholds
        )
        self._failures = 0
        self._why: str | None = None
        self.level: AdaptiveLevel
        self._estimated: AdaptiveLevel | None = None
        self._asked = self.solver.interrupted
        self.solver = replace(self.solver, interrupted=self._interrupted)

    def begin(self) -> None:
        """Solve on the first mesh. Collective.

        Raises:
            InputError: on all ranks alike: the scene has no such quantity, or does not fit its mesh.
        """
        start = time.perf_counter()
        self.level = self._first()
        self._why = self._record(self.level, start)

    @property
    def open(self) -> bool:
        """Whether there is more to do."""
        return self._why is None and not self._done()

    def finish(self) -> AccuracyResult:
        """Refine until the goal is reached, or cannot be. Collective."""
        while self.open:
            if self._estimated is not None and self._asked():
                self._give_up(self._estimated, "interrupted")
                break
            start = time.perf_counter()
            found = self._next(self.level)
            if isinstance(found, str):
                self._why = found
            elif self._estimated is not None and _is_stopped(found):
                late = f"the mesh of {found.dofs:,} unknowns was not solved when the time had passed"
                self._give_up(self._estimated, "interrupted" if self._asked() else late)
            else:
                self.level = found
                self._why = self._record(self.level, start)
        return AccuracyResult(
            goal=self.goal,
            level=self.level,
            solution=self.level.solution,
            degree=self.elements.degree,
            steps=tuple(self.steps),
            why=None if self.goal.accuracy is None and self.steps else self._why,
            more=self._cost_of_more(),
            interrupted=self._why is not None and self._asked(),
        )

    def _interrupted(self) -> bool:
        """Whether the solve on a mesh shall stop. Collective."""
        return self._asked() or self._overrun()

    def _overrun(self) -> bool:
        """Whether the time has passed, and there is a mesh whose solution can be given. Collective."""
        if self.goal.seconds is None or self._estimated is None:
            return False
        return largest(self.comm, self.solver.timer.total) > self.goal.seconds

    def _give_up(self, kept: AdaptiveLevel, why: str) -> None:
        """Keep the last mesh with an error instead of one whose solve was stopped."""
        self.level, self._failures, self._why = kept, 0, why
        self.report(why)

    def _first(self) -> AdaptiveLevel:
        """The coarsest mesh that sees the data, solved to a loose tolerance. Collective."""
        scene = adaptive.coarsest(self.scene)
        tolerance = min(self.thresholds.coarsest_tolerance, scene.solver.tolerance * 1e3)
        return self.solver.begin_resolved(with_tolerance(scene, tolerance), self.domain, self.thresholds)

    def _cost(self, accuracy: float) -> Cost:
        return cost_forecast.cost(self.steps, accuracy, self.elements, self.base, self.quantity.power_of_energy)

    def _cost_of_more(self) -> Cost | None:
        """What the accuracy asked for would cost, or a tenth of the error where it was reached or none was asked."""
        if not self.steps or not math.isfinite(self.steps[-1].error) or self.steps[-1].error <= 0:
            return None
        wanted = (self.goal.accuracy or self.steps[-1].error) / 10
        if self.goal.accuracy is not None and self.steps[-1].error > self.goal.accuracy:
            wanted = self.goal.accuracy
        needed = self._cost(wanted)
        return needed if math.isfinite(needed.dofs) else None

    def _record(self, level: AdaptiveLevel, start: float) -> str | None:
        """Record a level; why to stop at it, or None. Collective."""
        solution = level.solution
        if solution.solve_result is None or solution.solve_result.interrupted:
            return solution.reason
        self.quantity.add(level)
        if solution.estimate is None and solution.converged:
            return "the error of a law whose energy of separation depends on the mode is not estimated"
        if solution.estimate is None:
            self._failures += 1
            self.report(f"{level.dofs:,} unknowns: {solution.reason}")
            return solution.reason if self._failures >= self.thresholds.failures else None
        self._failures = 0
        self._estimated = level
        self.steps.append(self._step(level, largest(self.comm, time.perf_counter() - start)))
        self.report(_line(len(self.steps), self.steps[-1], self.solver.timer.total))
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
        if not self.steps or self._failures:
            return False
        return self.steps[-1].error <= (self.goal.accuracy or 0.0)

    def _next(self, level: AdaptiveLevel) -> AdaptiveLevel | str:
        """The next level, or why there is none. Collective."""
        if len(self.steps) >= self.thresholds.most_levels:
            return f"{self.thresholds.most_levels} meshes were not enough"
        if self.goal.seconds is None and (too_much := self._unaffordable()):
            return too_much  # within a given time the best that can be had is wanted
        scene = level.solution.scene
        if self.steps:
            scene = self.balance.next_scene(scene, self.steps[-1])
        tighter = self.thresholds.tighter * scene.solver.tolerance
        if self._failures == 1 and tighter >= self.thresholds.finest_tolerance:
            return self.solver.again(level, with_tolerance(scene, tighter))
        if self._known and self.balance.mesh_suffices(self.steps):
            return self.solver.again(level, scene)
        refined = self._refined(level)
        return self._unaffordable_step(refined) or self.solver.refine(level, refined, scene, self.quantity.ahead())

    @property
    def _known(self) -> bool:
        """Whether the last mesh has an error."""
        return bool(self.steps) and not self._failures

    def _refined(self, level: AdaptiveLevel) -> Refinement:
        """The refined mesh of the next step. Collective."""
        most = self.balance.largest_bulk
        bulk = self.balance.bulk(self.steps[-1]) if self._known else most
        if bulk == most:
            return adaptive.refined(level, bulk)
        return adaptive.refined_with_neighbours(level, bulk, self.thresholds)

    def _unaffordable(self) -> str | None:
        """Why the accuracy needs more memory than there is, before it is tried; None where it does not."""
        known = [step for step in self.steps if math.isfinite(step.error)]
        fewest = 1 if self.quantity.in_energy_norm else self.thresholds.meshes_before_forecast
        if len(known) < fewest or self.goal.accuracy is None:
            return None
        needed = self._cost(self.goal.accuracy)
        if needed.dofs <= _LARGEST and needed.memory <= self.room:
            return None
        if not math.isfinite(needed.dofs):
            return f"{self.goal.accuracy:g} is beyond any number of unknowns"
        return (
            f"{self.goal.accuracy:g} would need about {needed.dofs:.1e} unknowns and {needed.memory / 1024:.3g} GB; "
            f"{self.room / 1024:.3g} GB can be used"
        )

    def _unaffordable_step(self, refined: Refinement) -> str | None:
        """Why the next step would exceed the time or the memory; None where it does not. Collective."""
        dofs = refined.domain.dimension * nodes.count(refined.domain.mesh, self.elements.degree)
        if not self.steps:
            return None
        if (needed := cost_forecast.memory(self.steps, dofs, self.elements, self.base)) > self.room:
            return f"the next mesh of {dofs:,} unknowns would need {needed / 1024:.3g} GB"
        expected = largest(self.comm, self.solver.timer.total) + cost_forecast.seconds(self.steps, dofs)
        if self.goal.seconds is not None and expected > self.goal.seconds:
            return f"the next mesh of {dofs:,} unknowns would end after {expected:.0f} s"
        return None


def _is_stopped(level: AdaptiveLevel) -> bool:
    """Whether a solve was stopped, by a signal or by the time."""
    result = level.solution.solve_result
    return result is not None and result.interrupted


def _line(level: int, step: AdaptiveStep, elapsed: float) -> str:
    width = "" if step.epsilon is None else f", ε {step.epsilon:.2g}"
    error = f"error {step.error:.2e}" if math.isfinite(step.error) else "no error yet"
    return (
        f"mesh {level}: {step.dofs:,} unknowns, {error} (energy norm: mesh {step.discretisation:.1e}, smoothing "
        f"{step.smoothing:.1e}, solver {step.algebraic:.1e}), tolerance {step.tolerance:.0e}{width}, {elapsed:.1f} s"
    )
