"""SNES VI on the smoothed problem with ε-continuation: from a wide smoothing to the wanted one.

Each width starts from the solution of the width before. Where the scene smooths nothing, the last step solves the law
itself.
"""

from __future__ import annotations

from dataclasses import replace

from petsc4py import PETSc

from ..laws.smoothing import QUADRATIC
from .branch import BranchIteration
from .method import Method
from .result import Counts, SolveResult


class Continuation(Method):
    """The continuation on one system; call :meth:`solve` once."""

    name = "snes_vi"
    description = "a continuation in the smoothing over branch iterations"
    takes_pieces = False

    def solve(self, start: PETSc.Vec | None = None) -> SolveResult:
        """A stationary point of the wanted law. Collective.

        Args:
            start: not used; each width starts from the solution of the width before.
        """
        counts, start, context = Counts(), None, self.context
        thresholds = self.options.thresholds.branch
        loose = context.with_options(tolerance=max(thresholds.loose_tolerance, self.options.tolerance))
        for width in (w for w in thresholds.widths if w > (context.epsilon or 0.0)):
            laws = [QUADRATIC.relative(t.exact, width) for t in self.system.terms]
            found = BranchIteration(loose, laws, width, check_bounded=True).solve(start)
            counts.add(found.counts)
            if found.converged:
                start = self.system.unknowns(found.u)
        last = BranchIteration(context, check_bounded=True).solve(start)
        counts.add(last.counts)
        return replace(last, method=self.name, counts=counts)
