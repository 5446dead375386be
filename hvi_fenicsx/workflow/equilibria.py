"""Equilibria of whole bodies: a search on the condensed problem, and each point it finds expanded and certified."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from ..certify.second_order import LOCAL_MINIMISER, NO_MINIMISER, UNDECIDED
from ..certify.uniqueness import is_convex
from ..equilibrium_search.condensed_form import scalar_problem
from ..equilibrium_search.scalar_problem import ScalarProblem
from ..equilibrium_search.search import Found, Keep, Saved, Task, find
from ..equilibrium_search.stationarity import Kind, StationaryPoint, stationary_point
from ..equilibrium_search.thresholds import LIMITS
from ..errors import SolverError
from ..reduced.condensation import Condensation
from ..runtime.mpi import agree
from ..solvers import frozen_mixity, obstacle_force
from ..solvers.method import SolveResult
from ..typing import Array, magnitude
from .solution import Solution
from .solving import Preparation, certified, finish

NONE = Found(complete=True, proven=True, reason="no solution exists")
"""What is found where the load moves a body away."""
FALLS = "no lowest energy: it falls without limit as the load moves a body away"
"""What is told of a body that the load can move away from its equilibrium."""
NO_POTENTIAL = (
    "no lowest energy: an energy of separation depends on the mode (mixity), so the laws have no potential whose "
    "equilibria could be compared; without --lowest some equilibria are looked for"
)
"""What is told of laws that are no derivatives of an energy."""

KINDS = {LOCAL_MINIMISER: Kind.MINIMISER, NO_MINIMISER: Kind.SADDLE, UNDECIDED: Kind.UNDECIDED}
"""What an equilibrium is by its certificate."""


class Equilibria:
    """The equilibria of a scene. Creation is collective.

    Args:
        prepared: the scene, assembled.
        interrupted: whether to stop (collective), asked while the body is condensed.

    Attributes:
        problem: the condensed problem; None where no solution exists, and nothing is searched.

    Raises:
        InputError: on all ranks alike: a law is of a kind that is not searched.
        Interrupted: on all ranks alike: it is to stop.
    """

    def __init__(self, prepared: Preparation, interrupted: Callable[[], bool] = lambda: False) -> None:
        obstacle_force.refuse(prepared.problem, "equilibria are not searched")
        self._prepared = prepared
        self.problem: ScalarProblem | None = None
        if prepared.solvability.state != "escapes":
            with prepared.timer("assembly"):
                self._condensation = Condensation(prepared.system, interrupted=interrupted)
                self.problem = scalar_problem(self._condensation.problem)

    def find(
        self,
        *,
        lowest: bool,
        gap: float,
        stop: Callable[[], bool],
        report: Callable[[str], None],
        saved: Saved | None = None,
        keep: Keep = lambda _: None,
    ) -> Found:
        """Search; all ranks do the same. Collective.

        Args:
            lowest: the lowest energy with a proof; else all.
            gap: what that proof may leave open, relative to the energy.
            stop: asked before each box and inside long steps, by all ranks.
            report: told how far it is.
            saved: what an earlier search left.
            keep: keeps what is left while the search goes on.

        Raises:
            InputError: an earlier search was for something else.
        """
        if self.problem is None:
            return NONE
        if not lowest and saved is None and (only := self._only()) is not None:
            return only
        task = Task(
            problem=self.problem,
            lowest=lowest,
            gap=gap,
            stop=stop,
            report=report,
            saved=saved,
            keep=keep,
            bounded=self._prepared.solvability.state == "held",
            has_potential=self._prepared.problem.has_potential,
            no_lowest=self._no_lowest,
            known=() if lowest or saved is not None or stop() else self._known(stop),
            exact=self._exact,
            refined=self._refined,
        )
        with self._prepared.timer("solve"):
            return find(task)

    @property
    def _no_lowest(self) -> str:
        if not self._prepared.problem.has_potential:
            return NO_POTENTIAL
        return FALLS if self._prepared.solvability.state == "metastable" else ""

    def _only(self) -> Found | None:
        """The only equilibrium, where convexity proves that it is the only one; else None. Collective."""
        system = self._prepared.system
        if not is_convex(system):
            return None
        known = finish(self._prepared, estimating=False)
        result, examined, only = known.solve_result, known.examination, known.uniqueness
        if result is None or examined is None or only is None or only.state != "unique":
            return None
        x, reason = self._condensation.restricted(result.u), f"the only equilibrium, proven: {only.why}"
        return Found.only(x, examined.energy, reason)

    def _known(self, stop: Callable[[], bool]) -> tuple[Array, ...]:
        """The equilibrium that a run finds, if it finds one, (n,). Collective."""
        found = finish(self._prepared, interrupted=stop, estimating=False)
        if not found.converged or found.solve_result is None:
            return ()
        return (self._condensation.restricted(found.solve_result.u),)

    def _exact(self, x: Array) -> StationaryPoint | None:
        """The equilibrium near a point. Collective.

        Args:
            x: the point, (n,).
        """
        assert self.problem is not None
        if not len(self.problem.lengths):
            return stationary_point(self.problem, self._condensation.problem, x)
        known = self.solution(StationaryPoint(x=x, energy=np.nan, kind=Kind.UNDECIDED))
        if not known.converged or known.solve_result is None or known.examination is None:
            return None
        found, examined = self._condensation.restricted(known.solve_result.u), known.examination
        kind = KINDS[examined.certificate.second_order] if self._prepared.problem.has_potential else Kind.UNDECIDED
        return StationaryPoint(x=found, energy=examined.energy, kind=kind)

    def _refined(self, tolerance: float, within: Array) -> ScalarProblem:
        """The problem with polylines near curved laws."""
        return scalar_problem(self._condensation.problem, tolerance=tolerance, within=within)

    def _check_same(self, x: Array) -> None:
        """Refuse points that differ from rank to rank. Collective."""
        comm, allowed = self._prepared.system.comm, LIMITS.accuracy * magnitude(x)
        same = magnitude(comm.bcast(x) - x) <= allowed
        if not all(agree(comm, same)):
            raise SolverError("the ranks found different equilibria; run on one")

    def solution(self, point: StationaryPoint) -> Solution:
        """The whole bodies at a stationary point, certified. Collective.

        Args:
            point: from :meth:`find`.

        Raises:
            SolverError: on all ranks alike: they found different points.
        """
        self._check_same(point.x)
        u = self._condensation.displacement(point.x)
        frozen_mixity.freeze(self._prepared.problem, u)
        found = SolveResult(u=u, method="stationary points of the condensed problem", converged=True, reason=point.kind)
        known = certified(self._prepared, found)
        if known.converged or self.problem is None or not (self.problem.error or len(self.problem.lengths)):
            return known
        u.x.array[:] *= self._prepared.problem.scales.displacement  # the point is not exact
        return finish(self._prepared, start=u, estimating=False)

    def free(self) -> None:
        """Free the condensed body; no solution can be asked for any more. Collective."""
        if self.problem is not None:
            self._condensation.free()
