"""Narrowing smoothings: over branch iterations; and over Newton steps, for equilibria that are no minimum.

A descent leads away from these, which may be on a drop. Smoothed widely, a law that pushes at once is nearly straight:
its equation has a solution, and Newton's method finds it from where springs would hold the body, if not at one width
then at a narrower one. As the width narrows, vertices that stay within it are on the drop. At each width they are held
there, as by a support, until the drop carries what they take up.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np
from petsc4py import PETSc

from ..laws import Superpotential
from ..laws.catalogue import LinearSpring
from ..laws.smoothing import QUADRATIC
from ..typing import Array
from .branch import BranchIteration
from .convergence import Counts
from .method import Method, SolveContext, SolveResult


def solve(context: SolveContext) -> SolveResult:
    """A stationary point of the wanted laws. Collective.

    Args:
        context: the system and how to solve it.
    """
    x, drops = context.system.undisplaced(), list[Array]()
    for term in context.system.terms:  # no smoothing leads to where a kink has a traction of one sign only
        at = term.argument(x.array_r)
        drops.append(np.where(np.isin(at, term.law.concave.kinks), at, np.nan))
    still = BranchIteration(context).newton(x, drops)
    if still.converged:
        return still
    found = held = BranchIteration(context, [LinearSpring(stiffness=1.0)] * len(context.system.terms)).solve()
    counts = Counts()
    for one in (still, held):
        counts.add(one.counts)
    for width in widths(context, 1.0 / context.system.thresholds.narrowest) if held.converged else ():
        start, laws = (
            found if found.converged else held,
            [QUADRATIC.relative(t.exact, width) for t in context.system.terms],
        )
        found = BranchIteration(context, laws, width).newton(context.system.unknowns(start.u))
        counts.add(found.counts)
        if not found.converged:
            continue
        exact = BranchIteration(context).newton(x := context.system.unknowns(found.u), _drops(context, laws, x))
        counts.add(exact.counts)
        if exact.converged:
            return replace(exact, counts=counts)
    return replace(held, converged=False, counts=counts)


def _drops(context: SolveContext, smoothed: Sequence[Superpotential], x: PETSc.Vec) -> list[Array]:
    """The kink of G on which a vertex is, since its smoothed traction lies between those of both sides, else NaN."""
    found: list[Array] = []
    for term, smooth in zip(context.system.terms, smoothed, strict=True):
        concave, between = term.law.concave, smooth.concave.left(term.argument(x.array_r))
        on = np.full(len(between), np.nan)
        for kink, low, high in zip(
            concave.kinks, concave.left(concave.kinks), concave.right(concave.kinks), strict=True
        ):
            on[(between > low) & (between < high)] = kink
        found.append(on)
    return found


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
        thresholds = self.system.thresholds
        loose = context.with_options(tolerance=max(thresholds.coarse_tolerance, self.options.tolerance))
        for width in widths(context, 1.0):
            laws = [QUADRATIC.relative(t.exact, width) for t in self.system.terms]
            found = BranchIteration(loose, laws, width, check_bounded=True).solve(start)
            counts.add(found.counts)
            if found.converged:
                start = self.system.unknowns(found.u)
        last = BranchIteration(context, check_bounded=True).solve(start)
        counts.add(last.counts)
        return replace(last, method=self.name, counts=counts)


def widths(context: SolveContext, first: float) -> Iterator[float]:
    """Relative widths of the smoothing that a continuation goes through, down to the wanted one.

    Args:
        context: with the wanted width.
        first: the widest.
    """
    width, thresholds = first, context.system.thresholds
    while width > max(thresholds.narrowest, context.epsilon or 0.0):
        yield width
        width /= 2.0
