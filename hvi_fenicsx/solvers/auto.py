"""What a scene gets that names no method: the branch iteration, begun again elsewhere where it finds no equilibrium.

The unbroken branch comes first. A narrowly smoothed law is then approached from the solution of the unsmoothed one. In
the metastable state the iteration may slide off while an equilibrium exists on other pieces of the laws: starts on the
pieces of the resting slips, with every bond broken, and a continuation in the smoothing look for it there.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

from petsc4py import PETSc

from ..errors import SolverError
from .base import Counts, Solved, resting_start
from .branch import BranchIteration
from .continuation import Continuation

_BROKEN = 1e6
"""Times the resting slip: beyond every kink."""


class Auto(BranchIteration):
    """The branch iteration with further starts where the first finds nothing."""

    def solve(self, start: PETSc.Vec | None = None, branches: PETSc.Vec | None = None) -> Solved:
        """A stationary point; that of the first start that finds one, else what the first start left. Collective."""
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

    def _others(self) -> Iterator[Solved]:
        exact = [term.exact for term in self.system.terms]
        if any(law is not true for law, true in zip(self._laws, exact, strict=True)):
            for found in self._tried(BranchIteration(self.solver, self.settings, exact)):
                yield from self._beside(found)
        resting, _ = resting_start(self.solver, self._laws, 1e-4)
        for factor in (1.0, _BROKEN, -_BROKEN):
            pieces = resting.copy()
            pieces.scale(factor)
            yield from self._tried(BranchIteration(self.solver, self.settings, self._laws, self._epsilon), pieces)
        yield from self._tried(Continuation(self.solver, self.settings))

    def _beside(self, exact: Solved) -> Iterator[Solved]:
        """From the unsmoothed law's solution: what sticks there is within the narrow band that smoothing leaves."""
        if exact.converged:
            method = BranchIteration(self.solver, self.settings, self._laws, self._epsilon)
            try:
                yield method.solve(self.system.unknowns(exact.u))
            except SolverError:
                return

    def _tried(self, method: BranchIteration | Continuation, *pieces: PETSc.Vec) -> Iterator[Solved]:
        """One attempt; a breakdown is no result."""
        try:
            yield method.solve(None, *pieces) if isinstance(method, BranchIteration) else method.solve()
        except SolverError:
            return
