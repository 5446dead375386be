"""An obstacle that a force presses: how far it moves until contact bears the force.

The force R that contact bears is the derivative of the body's least energy by the obstacle's way; where the energy is
convex R never falls. The secant method solves R = F: for contact alone R is piecewise linear, and the last secant is
exact. Each step is a solve on the same matrices, with other bounds.
"""

from __future__ import annotations

from contextlib import suppress
from dataclasses import dataclass, replace

import numpy as np
from dolfinx import fem
from mpi4py import MPI
from scipy.optimize import newton

from ..errors import InputError
from ..problem.problem import BoundsForce, Problem
from ..problem.scaling import Scales
from ..runtime.log import logger
from ..system.system import System
from ..typing import Array
from . import nested_iteration
from .convergence import Counts
from .method import SolveTask
from .nested_iteration import CoarseStart, LevelSolution

_LOG = logger("solvers")
_MOST = 60
"""Solves at most."""
_DIGIT = float(np.finfo(np.float64).eps)


class _Ended(Exception):
    """A solve failed, or nothing bears the force as far as the body is long."""


@dataclass(frozen=True, kw_only=True)
class PressedObstacle:
    """An obstacle that a force presses, SI.

    Attributes:
        part: the boundary part.
        displacement: by which it has moved, m, (d,).
        force: N/m in 2D, N in 3D, (d,).
        borne: by contact, along the force, N/m or N.
        tolerance: relative, of the difference.
    """

    part: str
    displacement: Array
    force: Array
    borne: float
    tolerance: float

    @property
    def way(self) -> float:
        """By which it has moved along the force, m."""
        return float(self.displacement @ self.force / np.linalg.norm(self.force))

    @property
    def difference(self) -> float:
        """The distance of what is borne from the force, relative to it."""
        return float(abs(self.borne / np.linalg.norm(self.force) - 1.0))

    @property
    def passed(self) -> bool:
        """Whether contact bears the force."""
        return self.difference <= self.tolerance

    def __str__(self) -> str:
        unit = "N/m" if len(self.force) == 2 else "N"
        moved, force = (", ".join(f"{value:.6g}" for value in vector) for vector in (self.displacement, self.force))
        return (
            f"moved by ({moved}) m by the force ({force}) {unit}; contact bears it but for {self.difference:.1e} of it"
        )

    def summary(self) -> dict[str, object]:
        """The entry ``obstacle`` of ``summary.json``."""
        vectors = {"displacement": self.displacement.tolist(), "force": self.force.tolist()}
        return {"part": self.part, **vectors, "borne": self.borne, "difference": self.difference}


def pressed(problem: Problem) -> BoundsForce | None:
    """The force that presses an obstacle; None where all obstacles are held by their positions.

    Args:
        problem: the problem.

    Raises:
        InputError: on all ranks alike: forces press several obstacles.
    """
    found = [bounds.force for bounds in problem.bounds if bounds.force is not None]
    if len(found) > 1:
        names = " and ".join(force.name for force in found)
        raise InputError(f"boundary.{names}: a force may press one obstacle of a scene; give the others a displacement")
    return found[0] if found else None


def unsolved(problem: Problem, tolerance: float) -> PressedObstacle | None:
    """Where nothing was found: the obstacle as it is described, contact bears nothing; None where no force presses one.

    Args:
        problem: the problem.
        tolerance: relative, of what contact is to bear.
    """
    if (force := pressed(problem)) is None:
        return None
    return _obstacle(force, problem.scales, 0.0, 0.0, tolerance)


def _obstacle(force: BoundsForce, scales: Scales, way: float, borne: float, tolerance: float) -> PressedObstacle:
    """An obstacle by its way along the force and what is borne, both nondimensional."""
    return PressedObstacle(
        part=force.name.rpartition(".")[0],
        displacement=way * scales.displacement * force.direction,
        force=force.force * scales.force * force.direction,
        borne=borne * scales.force,
        tolerance=tolerance,
    )


def refuse(problem: Problem, what: str) -> None:
    """Refuse a problem with such an obstacle.

    Args:
        problem: the problem.
        what: is not done with it.

    Raises:
        InputError: on all ranks alike.
    """
    if (force := pressed(problem)) is not None:
        mend = "give the obstacle the displacement that `hvi run` finds for it"
        raise InputError(f"boundary.{force.name}: a force presses its obstacle, for which {what}; {mend}")


class ObstacleForceSolve:
    """A solve with an obstacle that a force presses; call :meth:`solve` once.

    Args:
        task: what is solved; whether a solution can exist, where the obstacle stands still.
        system: assembled, the obstacle where it is described.
    """

    def __init__(self, task: SolveTask, system: System) -> None:
        force = pressed(system.problem)
        assert force is not None
        self._task, self._system, self._force, self._counts = task, system, force, Counts()

    def solve(self, start: CoarseStart | fem.Function | None = None) -> tuple[LevelSolution, PressedObstacle]:
        """The solution and where the obstacle is. Collective.

        Args:
            start: a solution on a coarser mesh; or a displacement on the same mesh to begin at, m.
        """
        touch, force = self._first_touch(), self._force.force
        scales, way = self._system.problem.scales, start.way if isinstance(start, CoarseStart) else None
        first = touch + force if way is None else way / scales.displacement  # at first that of a block of this size
        found: list[tuple[LevelSolution, PressedObstacle]] = []

        def excess(way: float) -> float:
            """What contact bears beyond the force, 0 within the tolerance; nothing where the obstacle touches."""
            if way == touch:
                return -force
            if found and abs(way - touch) > scales.length / scales.displacement:
                raise _Ended
            new = self._at(way, found[-1][0] if found else start)
            self._counts.add(new.result.counts)
            found.append((new, self._pressed(new)))
            if not new.result.converged:
                raise _Ended
            return 0.0 if found[-1][1].passed else found[-1][1].borne / scales.force - force

        with suppress(_Ended):
            newton(excess, touch, x1=first, tol=_DIGIT, rtol=_DIGIT, maxiter=_MOST, disp=False)
        solution, obstacle = found[-1]
        return self._told(solution, obstacle), obstacle

    def _first_touch(self) -> float:
        """The way after which the obstacle touches the body at rest; behind it where it would overlap. Collective."""
        ways = [b.upper[b.force.rate < 0] / -b.force.rate[b.force.rate < 0] for b in self._system.bounds if b.force]
        least = min((float(np.min(way, initial=np.inf)) for way in ways), default=np.inf)
        return float(self._system.comm.allreduce(least, op=MPI.MIN))

    def _at(self, way: float, start: LevelSolution | CoarseStart | fem.Function | None) -> LevelSolution:
        """The solution with the obstacle there, from a start, else from the coarse meshes. Collective."""
        system = self._system.with_obstacles_of(self._system.problem.with_obstacle_at(way))
        metres = way * system.problem.scales.displacement
        if isinstance(start, CoarseStart):
            return nested_iteration.solve_from_coarser(self._task, system, start)
        effects = [(where, effect.obstacle_moved(metres)) for where, effect in self._task.model.effects]
        task = replace(self._task, model=replace(self._task.model, effects=effects))
        if isinstance(start, LevelSolution):
            return nested_iteration.solve_from(task, system, system.unknowns(start.result.u), start.levels)
        if isinstance(start, fem.Function):
            return nested_iteration.solve_from_displacement(task, system, start)
        return nested_iteration.solve(task, system)

    def _pressed(self, found: LevelSolution) -> PressedObstacle:
        """What contact bears: what the body's energy gains by a unit of the obstacle's way. Collective."""
        system = found.system
        x = system.unknowns(found.result.u)
        forces, borne, way = system.holding_forces(x), 0.0, 0.0
        for bounds in system.bounds:
            if bounds.force is not None:
                dofs, sign = bounds.component()
                free = ~np.isin(dofs, system.problem.fixed_here)  # at others the supports bear it
                borne += float(np.sum((bounds.force.rate * sign * forces[dofs])[free]))
                way = bounds.force.way
        borne, tolerance = float(system.comm.allreduce(borne)), self._task.options.tolerance
        return _obstacle(self._force, system.problem.scales, way, borne, tolerance)

    def _told(self, found: LevelSolution, obstacle: PressedObstacle) -> LevelSolution:
        """The solution with all counts; not converged where contact does not bear the force."""
        name, newton_steps = self._force.name, self._counts.newton
        _LOG.info("obstacle of %s: %d Newton steps, difference %.1e", name, newton_steps, obstacle.difference)
        result = replace(found.result, counts=self._counts)
        if result.converged and not obstacle.passed:
            reason = (
                f"contact of {name} bears {obstacle.borne / np.linalg.norm(obstacle.force):.6g} of the force at all "
                "positions that were tried; what it bears jumps there, or the laws give way"
            )
            result = replace(result, converged=False, reason=reason)
        return replace(found, result=result)
