"""SNES VI on the smoothed problem with ε-continuation: from a wide smoothing to the one that was asked for.

Each width is solved from the last one's solution. Where the scene smooths nothing, the last step solves the law itself.
"""

from __future__ import annotations

from dataclasses import replace

from petsc4py import PETSc

from ..laws.smoothing import QUADRATIC
from .branch import BranchIteration
from .method import Method
from .result import Counts, SolveResult

_WIDTHS = (1.0, 1e-1, 1e-2, 1e-3)
"""Relative widths that are passed through, as long as they are wider than the wanted one."""


class Continuation(Method):
    """The continuation on one system; call :meth:`solve` once."""

    name = "snes_vi"
    words = "a continuation in the smoothing over branch iterations"
    takes_pieces = False

    def solve(self, start: PETSc.Vec | None = None) -> SolveResult:
        """A stationary point of the wanted law, reached along the widths. Collective.

        Args:
            start: not used; each width starts from the last one's solution.
        """
        counts, start, context = Counts(), None, self.context
        options = replace(context.options, tolerance=max(self._loose, context.options.tolerance))
        loose = replace(context, options=options)
        for width in (w for w in _WIDTHS if w > (context.epsilon or 0.0)):
            laws = [QUADRATIC.relative(t.exact, width) for t in self.system.terms]
            found = BranchIteration(loose, laws, width, check_bounded=True).solve(start)
            counts.add(found.counts)
            if found.converged:
                start = self.system.unknowns(found.u)
        last = BranchIteration(context, check_bounded=True).solve(start)
        counts.add(last.counts)
        return replace(last, method=self.name, counts=counts)

    @property
    def _loose(self) -> float:
        return self.options.thresholds.loose_tolerance
