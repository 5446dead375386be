"""The method where none is named: the branch iteration from unbroken bonds, and where that fails, the load path.

Loading decides which equilibrium is meant, or that there is none (:func:`follow`). Where its path is not
followed, or ends before the whole load, few other starts are tried. Each buys cases that nothing else solves (the hard
cases, docs/hard-cases.md): the pieces of the slips at rest, and every bond broken, where the iteration slides off in
the metastable state; where laws push, Newton's method through narrowing smoothings, which finds equilibria that are no
minimum of the energy (:mod:`.continuation`); and where Γc has few unknowns, what a search of all equilibria has found
after a number of boxes. Where an equilibrium may not exist, the search ends after a number of Newton steps.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from dataclasses import replace

import numpy as np
from petsc4py import PETSc

from ..equilibrium_search.condensed_form import scalar_problem
from ..equilibrium_search.search import few_boxes
from ..equilibrium_search.thresholds import LIMITS
from ..errors import InputError, SolverError
from ..laws import Superpotential
from ..laws.smoothing import SmoothedLaw
from ..paths.full_load import FullLoad, at_full_load
from ..paths.state import PathOptions
from ..paths.thresholds import DEFAULT as FOLLOWING
from ..paths.vertex_laws import is_straight
from ..reduced.condensation import Condensation
from ..reduced.condensed_problem import CondensedProblem
from ..runtime.mpi import on_root_asking
from ..system.system import System
from ..typing import Array
from . import continuation
from .branch import BranchIteration
from .method import Borne, SolveContext, SolveResult
from .resting_start import resting_start


class _StepLimit:
    """Whether to stop: the user asks for it, or all starts together have taken too many Newton steps (None: any).

    A start may have a limit of its own; its steps count for that alone.
    """

    def __init__(self, interrupted: Callable[[], bool], most: int | None) -> None:
        self._interrupted, self._most = interrupted, most
        self._steps, self.exceeded = 0, False
        self._left: int | None = None

    @property
    def cut(self) -> bool:
        """Whether the start has taken more steps than it may."""
        return self._left is not None and self._left < 0

    def __call__(self) -> bool:
        """Asked once a Newton step. Collective."""
        if self._interrupted():
            return True
        if self._left is not None:
            self._left -= 1
            return self.cut
        self._steps += 1
        self.exceeded = self.exceeded or (self._most is not None and self._steps > self._most)
        return self.exceeded

    def next_start(self, most: int | None = None) -> None:
        """Another start begins, with a limit of its own or without one."""
        self._left = most


class Auto(BranchIteration):
    """The branch iteration, with further starts where the first finds no equilibrium."""

    name = "auto"
    label = "branch"
    takes_smoothing = True

    def __init__(self, context: SolveContext) -> None:
        self._held, self._interrupted = context.solvability.state == "held", context.solver.interrupted
        most = None if self._held else context.system.thresholds.search_steps
        self._limit = _StepLimit(context.solver.interrupted, most)
        super().__init__(replace(context, solver=context.solver.with_interruption(self._limit)))

    def solve(self, start: PETSc.Vec | None = None, branches: PETSc.Vec | None = None) -> SolveResult:
        """A stationary point from the first start that finds one, else the result of the first start. Collective.

        Args:
            start: where to begin; by default the resting start.
            branches: a displacement that says on which pieces of the laws to begin.
        """
        found = self._search(start, branches)
        if not self._limit.exceeded:
            return found
        reason = f"no equilibrium found in {self.thresholds.search_steps} Newton steps"
        return replace(found, interrupted=False, reason=reason)

    def _search(self, start: PETSc.Vec | None, branches: PETSc.Vec | None) -> SolveResult:
        follows = start is None and branches is None and self.options.start == "unbroken"
        self._limit.next_start(self._most_without_path() if follows else None)
        first = super().solve(start, branches)
        cut = self._limit.cut
        self._limit.next_start()
        if first.converged or (first.interrupted and not cut):
            return first
        if follows and (along := self._along_path(first)) is not None:
            return along
        if cut:
            first = BranchIteration(self.context, self._laws, self._epsilon).solve()
        if first.converged or first.interrupted:
            return first
        return self._first_of(self._others(), first) or first

    def _first_of(self, others: Iterator[SolveResult], first: SolveResult) -> SolveResult | None:
        """The first result that converged or was interrupted; to the counts of the first the iterations of all add."""
        for found in others:
            first.counts.add(found.counts)
            if found.converged or (found.interrupted and not self._limit.cut):
                return replace(found, counts=first.counts)
        return None

    def _most_without_path(self) -> int | None:
        """Newton steps of a start before the path is followed, which takes longer where it is a curve; None: any."""
        laws = [term.exact for term in self.system.terms]
        if not any(softens(law) for law in laws):
            return None
        return self.thresholds.few_steps if _are_straight(laws) else self.options.max_iterations

    def _along_path(self, first: SolveResult) -> SolveResult | None:
        """The equilibrium on the load path, or that there is none on it; None where this is not known. Collective.

        A body that is held has an equilibrium, be it off the path.
        """
        with self.context.timer("setup"):
            path = follow(self.system, self._interrupted)
        if path is None:
            return None
        x, reason, borne = path
        if x is None:
            return None if self._held else self._off_path(first, reason, borne)
        for found in self._attempt(self._iteration().solve, x):
            found.counts.add(first.counts)
            if found.converged or found.interrupted:
                return found
        return None

    def _off_path(self, first: SolveResult, reason: str, borne: Borne | None) -> SolveResult:
        """An equilibrium from other starts, to which loading leads by a jump if at all; else that its path has none.

        Each start gets few steps: what laws hold is found in a few, what slides away takes hundreds. Collective.
        """
        found = self._first_of(self._others(2 * self.thresholds.few_steps), first)
        if found is not None:
            return replace(found, off_path=reason)
        self._limit.next_start()
        reason = f"no equilibrium on the loading path: {reason}"
        return replace(first, interrupted=False, reason=reason, borne=borne)

    def _others(self, most: int | None = None) -> Iterator[SolveResult]:
        """Results from other starts, one after the other, each in so many Newton steps at most."""
        yield from self._on_other_pieces(most)
        self._limit.next_start()
        yield from self._from_exact()
        growths = [term.exact.growth for term in self.system.terms]
        if any(min(growth.minus, growth.plus) < 0.0 for growth in growths):
            yield from self._attempt(continuation.solve, self.context)
        self._limit.next_start()
        for x in searched(self.system, self._interrupted):
            yield from self._attempt(self._iteration().solve, x)

    def _on_other_pieces(self, most: int | None) -> Iterator[SolveResult]:
        """On the pieces of the slips at rest, and with every bond broken, to either side."""
        resting, _ = resting_start(self.solver, self._laws)
        for factor in (1.0, self.thresholds.runaway, -self.thresholds.runaway):
            pieces = resting.copy()
            pieces.scale(factor)
            self._limit.next_start(most)
            yield from self._attempt(self._iteration().solve, None, pieces)

    def _from_exact(self) -> Iterator[SolveResult]:
        """Start smoothed laws from the equilibrium of the laws themselves."""
        exact = [term.exact for term in self.system.terms]
        if all(law is true for law, true in zip(self._laws, exact, strict=True)):
            return
        for found in self._attempt(BranchIteration(self.context, exact, self._epsilon, check_bounded=True).solve):
            if found.converged:
                yield from self._attempt(self._iteration().solve, self.system.unknowns(found.u))

    def _iteration(self) -> BranchIteration:
        """A branch iteration in the same context, on the same laws."""
        return BranchIteration(self.context, self._laws, self._epsilon, check_bounded=True)

    @staticmethod
    def _attempt(solve: Callable[..., SolveResult], *start: PETSc.Vec | None) -> Iterator[SolveResult]:
        """The result of one attempt; none where the method breaks down."""
        with suppress(SolverError):
            yield solve(*start)


class ConvexProgramme(Auto):
    """The quadratic programme on one system, one convex step, else the load path; call :meth:`solve` once."""

    name = "convex"
    description = "one convex quadratic programme by SNES VI (reduced space)"
    in_scenes = False

    def solve(self, start: PETSc.Vec | None = None, branches: PETSc.Vec | None = None) -> SolveResult:
        """The minimiser, or what was reached. Collective.

        Args:
            start: where to begin; by default with contact closed.
            branches: as of :meth:`.BranchIteration.solve`.
        """
        found = super().solve(start)
        found.counts.branch = 0  # it is not iterated
        return found

    def _others(self, most: int | None = None) -> Iterator[SolveResult]:
        return iter(())

    def _tolerances(self) -> list[float]:
        return [self.options.tolerance]


def softens(law: Superpotential) -> bool:
    """Whether a law's traction falls other than by jumps, as far as it is known how steeply.

    A jump that is smoothed by a curve is one; one that is smoothed by a line falls along it.

    Args:
        law: the law.
    """
    graph, unsmoothed = law.graph, law.law if isinstance(law, SmoothedLaw) else law
    return 0.0 < unsmoothed.steepest_fall < np.inf if graph is None else bool(np.any(graph.slopes < 0.0))


def _are_straight(laws: Sequence[Superpotential]) -> bool:
    """Whether the tractions of all laws are piecewise linear."""
    return all(law.graph is not None for law in laws)


def follow(system: System, interrupted: Callable[[], bool]) -> tuple[PETSc.Vec | None, str, Borne | None] | None:
    """Where the load path leads, if it can be followed in short time; None where it cannot, or is lost. Collective.

    A path of other than piecewise linear equations is followed where laws soften and Γc has few unknowns.

    Args:
        system: the system; its tangent and what it holds are taken away.
        interrupted: whether to stop (collective); then None.

    Returns:
        The displacement under the whole load, in equilibrium, None where the path ends before; how it ended; and where
        it ends before, the last state that is borne, None where that is not known.
    """
    laws = [term.exact for term in system.terms]
    condensation = _condensed(
        system, system.thresholds.vertex_unknowns if _are_straight(laws) else _most_on_curve(system)
    )
    if condensation is None:
        return None
    found = _on_first_rank(system, condensation.problem, interrupted)
    start = None
    if found is not None:
        last, x = found.borne, None if found.x is None else condensation.expand(found.x)
        borne = None if last is None else Borne(u=condensation.displacement(last.x, last.factor), factor=last.factor)
        start = x, found.reason, borne
    condensation.free()
    return start


def searched(system: System, interrupted: Callable[[], bool]) -> list[PETSc.Vec]:
    """Equilibria that a search of few boxes finds, minimisers first; none where Γc has many unknowns. Collective.

    Args:
        system: the system; its tangent and what it holds are taken away.
        interrupted: whether to stop (collective).
    """
    condensation = _condensed(system, LIMITS.few_unknowns)
    if condensation is None:
        return []

    def found(ask: Callable[[], bool]) -> list[Array]:
        with suppress(np.linalg.LinAlgError, InputError):
            return [point.x for point in few_boxes(scalar_problem(condensation.problem), ask)]
        return []

    starts = [condensation.expand(x) for x in on_root_asking(system.comm, found, interrupted)]
    condensation.free()
    return starts


def _condensed(system: System, most: int) -> Condensation | None:
    """The system on the unknowns of Γc's vertices; None where they are more, or it cannot be had. Collective."""
    if system.comm.allreduce(len(system.jacobian.rows.dofs)) > most:
        return None
    system.jacobian.clear()
    with suppress(InputError, SolverError):
        return Condensation(system)
    return None


def _on_first_rank(system: System, problem: CondensedProblem, interrupted: Callable[[], bool]) -> FullLoad | None:
    """Where the path leads, the same on all ranks to the last digit. Collective."""
    if not is_straight(problem) and problem.size > _most_on_curve(system):
        return None

    def followed(ask: Callable[[], bool]) -> FullLoad | None:
        with suppress(np.linalg.LinAlgError, InputError):  # some edges in space have no path
            options = PathOptions(most_events=FOLLOWING.waits * problem.size)
            return at_full_load(problem, options, ask)
        return None

    return on_root_asking(system.comm, followed, interrupted)


def _most_on_curve(system: System) -> int:
    """The unknowns up to which a curve is followed: none where no law softens, which makes it worth while."""
    return system.thresholds.curve_unknowns if any(softens(term.exact) for term in system.terms) else 0
