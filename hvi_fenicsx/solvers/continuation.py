"""SNES VI on the smoothed problem with ε-continuation: from a wide smoothing to the one that was asked for.

Each width is solved from the last one's solution. Where the scene smooths nothing, the last step solves the law itself.
"""

from __future__ import annotations

from dataclasses import replace

from ..laws.smoothing import QUADRATIC
from .active_set import ActiveSetSolver
from .branch import BranchIteration
from .method import Counts, Settings, SolveResult

_WIDTHS = (1.0, 1e-1, 1e-2, 1e-3)
"""Relative widths that are passed through, as long as they are wider than the wanted one."""


class Continuation:
    """The continuation on one system; call :meth:`solve` once."""

    name = "snes_vi"
    words = "a continuation in the smoothing over branch iterations"
    takes_start = False

    def __init__(self, solver: ActiveSetSolver, settings: Settings) -> None:
        self.solver, self.settings = solver, settings

    def solve(self) -> SolveResult:
        """A stationary point of the wanted law, reached along the widths. Collective."""
        counts, start = Counts(), None
        loose = replace(self.settings, tolerance=max(1e-4, self.settings.tolerance))
        for width in (w for w in _WIDTHS if w > (self.settings.epsilon or 0.0)):
            laws = [QUADRATIC.relative(t.exact, width) for t in self.solver.system.terms]
            found = BranchIteration(self.solver, loose, laws, width, wary=True).solve(start)
            counts.add(found.counts)
            if found.converged:
                start = self.solver.system.unknowns(found.u)
        last = BranchIteration(self.solver, self.settings, wary=True).solve(start)
        counts.add(last.counts)
        return replace(last, method=self.name, counts=counts)
