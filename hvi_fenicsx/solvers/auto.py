"""What a scene gets that names no method: the branch iteration, begun again elsewhere where it finds no equilibrium.

The unbroken branch comes first. A narrowly smoothed law is then approached from the solution of the unsmoothed one. A
body that rolls or tips on its way to rest is put down as a rigid one first (:mod:`.rigid_start`). In the metastable
state the iteration may slide off while an equilibrium exists on other pieces of the laws: starts on the pieces of the
resting slips, with every bond broken, and a continuation in the smoothing look for it there. Where no equilibrium need
exist, the search ends after so many Newton steps.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from dataclasses import replace
from functools import cached_property

from petsc4py import PETSc

from ..errors import SolverError
from ..laws import Superpotential
from ..system import existence
from .branch import BranchIteration
from .continuation import Continuation
from .law_models import Majorant
from .method import Counts, SolveResult, resting_start
from .rigid_start import settled

_BROKEN = 1e6
"""Times the resting slip: beyond every kink."""
_BUDGET = 1000
"""Newton steps of all starts together, unless the body is held; those of the hard cases took at most 589."""


class Auto(BranchIteration):
    """The branch iteration with further starts where the first finds nothing."""

    _steps, _spent = 0, False

    def solve(self, start: PETSc.Vec | None = None, branches: PETSc.Vec | None = None) -> SolveResult:
        """A stationary point; that of the first start that finds one, else what the first start left. Collective."""
        told, self.solver.interrupted = self.solver.interrupted, lambda: told() or self._over()
        try:
            found = self._search(start, branches)
        finally:
            self.solver.interrupted = told
        if not self._spent:
            return found
        return replace(found, interrupted=False, reason=f"no equilibrium found in {_BUDGET} Newton steps")

    def _over(self) -> bool:
        """Asked once a Newton step: whether the search has gone on for long enough. Collective."""
        self._steps += 1
        self._spent = self._spent or (self._steps > _BUDGET and not self._held)
        return self._spent

    @cached_property
    def _held(self) -> bool:
        return existence.solvability(self.system.problem, self.system.forces).state == "held"

    def _search(self, start: PETSc.Vec | None, branches: PETSc.Vec | None) -> SolveResult:
        first = super().solve(start, branches)
        if first.converged or first.interrupted or not self.system.terms:
            return first
        counts = Counts()
        counts.add(first.counts)
        for other in self._others():
            counts.add(other.counts)
            if other.converged or other.interrupted:
                return replace(other, counts=counts)
        return first

    def _others(self) -> Iterator[SolveResult]:
        exact = [term.exact for term in self.system.terms]
        if any(law is not true for law, true in zip(self._laws, exact, strict=True)):
            for found in self._tried(self._anew(exact).solve):
                yield from self._beside(found)
        yield from self._settled()
        resting, _ = resting_start(self.solver, self._laws)
        for factor in (1.0, _BROKEN, -_BROKEN):
            pieces = resting.copy()
            pieces.scale(factor)
            yield from self._tried(self._anew().solve, None, pieces)
        yield from self._tried(Continuation(self.solver, self.settings).solve)

    def _settled(self) -> Iterator[SolveResult]:
        """From bodies at rest on their supports, bonds as they are there, or unbroken.

        Where bodies roll, closed contact is no start.
        """
        rested = settled(self.solver, self._majorants, 1e-4)
        if rested is None:
            return
        unbroken = rested[0].duplicate()
        unbroken.set(0.0)
        for bonds in (rested[0], unbroken):
            yield from self._tried(self._anew().solve, rested[0], bonds)

    def _majorants(self, x: PETSc.Vec) -> list[Majorant]:
        parts = zip(self._laws, self._cells(x), self._subgradients(x, 0.0), strict=True)
        return [Majorant(law, cells, xi) for law, cells, xi in parts]

    def _beside(self, exact: SolveResult) -> Iterator[SolveResult]:
        """From the unsmoothed law's solution: what sticks there is within the narrow band that smoothing leaves."""
        if exact.converged:
            yield from self._tried(self._anew().solve, self.system.unknowns(exact.u))

    def _anew(self, laws: Sequence[Superpotential] | None = None) -> BranchIteration:
        """A branch iteration of the same settings, by default on the same laws."""
        return BranchIteration(
            self.solver, self.settings, self._laws if laws is None else laws, self._epsilon, wary=True
        )

    @staticmethod
    def _tried(solve: Callable[..., SolveResult], *start: PETSc.Vec | None) -> Iterator[SolveResult]:
        """One attempt; a breakdown is no result."""
        with suppress(SolverError):
            yield solve(*start)
