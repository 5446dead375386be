"""An accuracy, or a time, bought: mesh, ε and tolerances chosen so that the estimated error is below what was asked.

The ladder is climbed adaptively until the estimate says so. The three parts of the error are balanced: the mesh has the
largest share, smoothing and solver get what is small beside it and no more.
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
from ..workflow import Solution
from . import adaptive, cost_forecast, quantities
from .adaptive import AdaptiveLevel, AdaptiveSolver
from .cost_forecast import AdaptiveStep, Cost

_BULK = {2: 0.75, 3: 0.5}
"""Share of the squared error that one step refines, by dimension."""
_BULK_ON_CONTACT = 0.5
"""The same for errors on Γc: they fall as the square of the energy norm's, so a smaller share goes as far."""
_SMALLEST_BULK = 0.2
_AIM = 0.9
"""Of the accuracy asked for: where the last step aims."""
_SMOOTHING = 0.3
"""Of the accuracy asked for, what smoothing may take."""
_TOLD = 4
"""Meshes with an error of a quantity without an estimator, before it is told what a goal needs."""
_NARROWEST_STEP = 1 / 3
"""Of ε: what smoothing changes may fall much faster than ε, and a leap would take it to nothing."""
_ALGEBRAIC = 0.03
"""Of the estimated error, the solver's relative tolerance."""
TOLERANCES = 1e-10, 1e-4
"""Of the solver, the least and the greatest."""
_TIGHTER = 1e-3
"""Of the tolerance, where a mesh has no certified solution at first: a loose one may end where the law is undecided."""
_FAILURES = 4
"""Times in a row without a certified solution after which no equilibrium is expected."""
_MOST_RUNGS = 80
_USABLE = 0.8
"""Of the machine's memory."""
_LARGEST = 2**31 - 1
"""Unknowns that PETSc's default integers can number."""


@dataclass(frozen=True)
class Goal:
    """What is asked for: an accuracy (relative) of a quantity, or the best within a time (s), or both."""

    accuracy: float | None
    quantity: str = "energy"
    seconds: float | None = None

    def as_dict(self) -> dict[str, Any]:
        """For ``summary.json``."""
        return {"requested": self.accuracy, "quantity": self.quantity, "time_budget": self.seconds}


@dataclass(frozen=True)
class Reached:
    """Where a climb ended.

    Attributes:
        goal: what was asked for. rung: the last mesh. solution: its solution, as that of the scene. steps: the rungs.
        why: it ended, in words; None where the goal was reached. more: what a tenth of the error would cost.
    """

    goal: Goal
    rung: AdaptiveLevel
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


def reach(scene: Scene, comm: MPI.Comm, goal: Goal, solver: AdaptiveSolver, tell: Callable[[str], None]) -> Reached:
    """Climb until the goal is reached, or cannot be. Collective.

    Args:
        scene: what to solve; its mesh sets where to begin (:func:`.adaptive.coarsest`), its ε the largest.
        comm: the ranks. goal: what is wanted. solver: timer, progress, interruption. tell: of each rung, in a line.

    Raises:
        InputError: on all ranks alike: the scene has no such quantity, or does not fit its mesh.
    """
    return _Climb(scene, comm, goal, solver, tell).run()


@dataclass
class _Climb:
    """One climb. Everything it decides on is the same on all ranks."""

    scene: Scene
    comm: MPI.Comm
    goal: Goal
    solver: AdaptiveSolver
    tell: Callable[[str], None]
    steps: list[AdaptiveStep] = field(default_factory=list)
    failures: int = 0

    def run(self) -> Reached:
        self.base, self.room = memory.peak(self.comm), memory.limit() * _USABLE
        self.quantity = quantities.find(self.goal.quantity)()
        self.solver = replace(self.solver, existence=self.quantity.needs_existence)
        begin, start = adaptive.coarsest(self.scene), time.perf_counter()
        rung = self.solver.begin(_solved_with(begin, min(TOLERANCES[1], begin.solver.tolerance * 1e3)), self.comm)
        why = self._note(rung, start)
        while why is None and not self._done():
            start = time.perf_counter()
            found = self._next(rung)
            if isinstance(found, str):
                why = found
            else:
                rung = found
                why = self._note(rung, start)
        return self._reached(rung, why)

    def _reached(self, rung: AdaptiveLevel, why: str | None) -> Reached:
        solution = replace(rung.solution, scene=self.scene)
        more = None
        if self.steps and math.isfinite(self.steps[-1].error) and self.steps[-1].error > 0:
            wanted = (self.goal.accuracy or self.steps[-1].error) / 10
            more = cost_forecast.cost(self.steps, wanted, self.scene.dimension, self.base)
        if self.goal.accuracy is None and self.steps:
            why = None
        return Reached(self.goal, rung, solution, tuple(self.steps), why, more)

    def _note(self, rung: AdaptiveLevel, start: float) -> str | None:
        """Record a rung; why to stop at it, or None. Collective."""
        solution = rung.solution
        if solution.solve_result is None or solution.solve_result.interrupted:
            return solution.reason
        self.quantity.add(rung)
        if solution.estimate is None:
            self.failures += 1
            self.tell(f"{rung.dofs:,} unknowns: {solution.reason}")
            return solution.reason if self.failures >= _FAILURES else None
        self.failures = 0
        self.steps.append(self._step(rung, largest(self.comm, time.perf_counter() - start)))
        self.tell(_line(len(self.steps), self.steps[-1], self.solver.timer.total))
        return None

    def _step(self, rung: AdaptiveLevel, seconds: float) -> AdaptiveStep:
        estimate = rung.solution.estimate
        assert estimate is not None
        norm, smoothing = estimate.energy_norm or 1.0, self.quantity.smoothing()
        return AdaptiveStep(
            dofs=rung.dofs,
            error=self.quantity.error(),
            discretisation=estimate.discretisation / norm,
            smoothing=smoothing,
            algebraic=estimate.algebraic / norm,
            epsilon=rung.solution.epsilon,
            tolerance=rung.solution.scene.solver.tolerance,
            seconds=seconds,
            memory=memory.peak(self.comm),
        )

    def _done(self) -> bool:
        if not self.steps or self.failures:
            return False
        return self.steps[-1].error <= (self.goal.accuracy or 0.0)

    def _next(self, rung: AdaptiveLevel) -> AdaptiveLevel | str:
        """The next rung, or why there is none. Collective."""
        if len(self.steps) >= _MOST_RUNGS:
            return f"{_MOST_RUNGS} meshes were not enough"
        if too_much := self._unaffordable():
            return too_much
        scene = self._sharper(rung.solution.scene)
        if self.failures == 1 and (tight := _TIGHTER * scene.solver.tolerance) >= TOLERANCES[0]:
            return self.solver.again(rung, _solved_with(scene, tight))
        if self._mesh_will_do():
            return self.solver.again(rung, scene)
        bulk = self._bulk()
        nesting = adaptive.refined(rung, bulk) if bulk == self._most else adaptive.sparing(rung, bulk)
        return self._too_long(nesting) or self.solver.refine(rung, nesting, scene, self.quantity.ahead())

    def _bulk(self) -> float:
        """How much of the squared error to refine: no more than takes the estimate to where it should be."""
        known = self.quantity.known_from_one_mesh
        if not self.steps or self.failures or self.goal.accuracy is None or not known:
            return self._most
        mesh, smoothing, _ = self.quantity.parts(self.steps[-1])
        left = math.sqrt(max((_AIM * self.goal.accuracy) ** 2 - smoothing**2, 0.0)) / mesh if mesh > 0 else 1.0
        # On Γc errors fall as the square of the energy norm's. Halving the edges of what is marked leaves a quarter.
        needed = (1 - (left**2 if self.quantity.in_energy_norm else left)) / 0.75
        return min(self._most, max(_SMALLEST_BULK, needed))

    @property
    def _most(self) -> float:
        """Of the squared error, what one step refines that is not the last."""
        on_contact = self.quantity.known_from_one_mesh and not self.quantity.in_energy_norm
        return _BULK_ON_CONTACT if on_contact else _BULK[self.scene.dimension]

    def _mesh_will_do(self) -> bool:
        """Whether ε or the tolerance, not the mesh, is what the next rung must change."""
        if not self.steps or self.failures:
            return False
        mesh, smoothing, algebraic = self.quantity.parts(self.steps[-1])
        if smoothing > max(mesh, self._allowed(mesh)):
            return self._smoothing_falls()
        wanted = _AIM * (self.goal.accuracy or 0.0)
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
            return _SMOOTHING * mesh
        return max(_SMOOTHING * self.goal.accuracy, math.sqrt(max((_AIM * self.goal.accuracy) ** 2 - mesh**2, 0.0)))

    def _sharper(self, scene: Scene) -> Scene:
        """ε and tolerance for the next rung, from the parts of the last one's error."""
        if not self.steps:
            return scene
        last = self.steps[-1]
        estimate = last.discretisation if self.goal.accuracy is None else self.goal.accuracy
        error = min(last.error, max(last.discretisation, estimate))
        wanted = _ALGEBRAIC * (error if self.quantity.in_energy_norm else min(error, estimate))
        if last.algebraic > 0.1 * max(last.discretisation, estimate):
            wanted = min(wanted, 0.1 * last.tolerance)
        low, high = TOLERANCES
        mesh, smoothing, _ = self.quantity.parts(last)
        allowed = self._allowed(mesh)
        factor = max(0.8 * allowed / smoothing, _NARROWEST_STEP) if smoothing > allowed else 1.0
        return _narrowed(_solved_with(scene, min(max(wanted, low), high)), factor)

    def _unaffordable(self) -> str | None:
        """Whether the accuracy needs more memory than there is: said before it is tried."""
        known = [step for step in self.steps if math.isfinite(step.error)]
        if len(known) < (1 if self.quantity.in_energy_norm else _TOLD) or self.goal.accuracy is None:
            return None
        needed = cost_forecast.cost(self.steps, self.goal.accuracy, self.scene.dimension, self.base)
        if needed.dofs <= _LARGEST and needed.memory <= self.room:
            return None
        return (
            f"{self.goal.accuracy:g} would need about {needed.dofs:.1e} unknowns and {needed.memory / 1024:.3g} GB; "
            f"{self.room / 1024:.3g} GB can be used"
        )

    def _too_long(self, nesting: Refinement) -> str | None:
        """Whether the next rung would exceed the time or the memory. Collective."""
        mesh, d = nesting.domain.mesh, nesting.domain.dimension
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
