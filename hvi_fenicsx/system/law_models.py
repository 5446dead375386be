"""Models of a law j = H - G in one nonlinear solve, in which each vertex stays in one cell between H's kinks.

H's kinks (Tresca, |u_t| at zero, upward jumps) stay in the convex step: bounds on its slip keep each vertex in the cell
between two kinks, where H is smooth up to the ends. A vertex on a kink that cannot carry its force moves on to the next
cell.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

from ..laws import ConvexPart, Superpotential
from ..typing import Array, Integers
from .thresholds import DEFAULT


@dataclass(frozen=True)
class Cells:
    """For each of m vertices, the cell [lower, upper] between two kinks of H in which it stays.

    For a law of |u_t| in 3D there is one kink, at zero, and two cells: stuck (0) and free (1).

    Attributes:
        kinks: the kinks of H, ascending.
        index: number of each vertex's cell, (m,).
        ramp: for a law of |u_t|, the slip up to which the traction of a free vertex grows from zero, so that its
            direction may still turn; a vertex whose slip remains smaller is stuck. 0 for laws of a signed slip.
    """

    kinks: Array
    index: Integers
    ramp: float = 0.0

    @classmethod
    def around(cls, part: ConvexPart, x: Array, *, radial: bool = False) -> Cells:
        """The cells that hold x; on a kink the cell to its right, for a law of |u_t| the stuck one.

        Args:
            part: H.
            x: arguments, (m,).
            radial: whether it is a law of |u_t|.
        """
        side: Literal["left", "right"] = "left" if radial else "right"
        ramp = 0.0
        if radial and len(part.kinks):
            ramp = DEFAULT.first_ramp * max(float(np.max(x, initial=0.0)), DEFAULT.coarse_tolerance)
        return cls(part.kinks, np.searchsorted(part.kinks, x, side=side), ramp)

    @property
    def lower(self) -> Array:
        """Lower ends; -inf where there is none."""
        return np.concatenate([[-np.inf], self.kinks])[self.index]

    @property
    def upper(self) -> Array:
        """Upper ends; inf where there is none."""
        return np.concatenate([self.kinks, [np.inf]])[self.index]

    def moved(self, step: Integers) -> Cells:
        """The cells after each vertex moved to a neighbouring one, or stayed; if any moved to the right, half the ramp.

        Args:
            step: -1, 0 or 1, (m,).
        """
        return Cells(self.kinks, self.index + step, self.ramp / 2.0 if np.any(step > 0) else self.ramp)


UNDIVIDED = Cells(np.empty(0), np.zeros(1, dtype=np.int64))
"""The whole line as one cell."""


@dataclass(frozen=True)
class VertexModel:
    """What takes the place of a law j = H - G at its vertices: j itself, or with ξ ∈ ∂G its majorant H - ξ.

    Attributes:
        law: j.
        cells: where each vertex stays; undivided, the mean of both sides counts at kinks, as in the paper's formula.
        xi: ξ, (m,): the majorant is nowhere less than j, and equal at the arguments of ξ, up to a constant; None: j.
        secant_from: the stiffness is the secant's H'/x, of slips of this at least, where it exceeds the tangent's.
            Where H'/x falls with |x| that parabola is greater than H, so that full steps lower the energy
            (iteratively reweighted least squares; Kačanov); None: the tangent's.
    """

    law: Superpotential
    cells: Cells = UNDIVIDED
    xi: Array | None = None
    secant_from: float | None = None

    def value(self, x: Array) -> Array:
        """Energy per area."""
        return self.law.value(x) if self.xi is None else self.law.convex.value(x) - self.xi * x

    def derivative(self, x: Array) -> Array:
        """H' less ξ, or less the middle of G's interval."""
        concave = self.law.concave
        falling = (concave.left(x) + concave.right(x)) / 2 if self.xi is None else self.xi
        return self._inside(x) - falling

    def second(self, x: Array) -> Array:
        """H'', of j less G''."""
        if self.xi is None:
            return self._curvature(x) - self.law.concave.second(x)
        if self.secant_from is None:
            return self._curvature(x)
        secant = np.abs(self._inside(x)) / np.maximum(np.abs(x), self.secant_from)
        return np.maximum(self._curvature(x), secant)

    def _inside(self, x: Array) -> Array:
        """Derivative of H, continued from inside of the cell to its ends."""
        part, cells = self.law.convex, self.cells
        if cells is UNDIVIDED:
            return (part.left(x) + part.right(x)) / 2
        if cells.ramp > 0:
            return part.right(np.maximum(x, cells.ramp)) * np.minimum(x / cells.ramp, 1.0)
        at_lower, at_upper = x <= cells.lower, x >= cells.upper
        lower, upper = np.where(at_lower, cells.lower, x), np.where(at_upper, cells.upper, x)
        return np.where(at_lower, part.right(lower), np.where(at_upper, part.left(upper), part.right(x)))

    def _curvature(self, x: Array) -> Array:
        """Second derivative of H; on the ramp, that of the ramp."""
        part, ramp = self.law.convex, self.cells.ramp
        if ramp > 0:
            steep = part.right(np.array([ramp])) / ramp
            return np.where(x < ramp, steep, part.second(np.maximum(x, ramp)))
        return part.second(x)


@dataclass(frozen=True)
class TangentAtRest:
    """The law's tangent at zero slip, x ↦ H'(0)x + ½ H''(0) x²: it holds a body at the start.

    Attributes:
        law: j.
    """

    law: Superpotential

    def value(self, x: Array) -> Array:
        """Energy per area."""
        return self.derivative(np.zeros_like(x)) * x + self.second(x) * x**2 / 2

    def derivative(self, x: Array) -> Array:
        """The middle of ∂j(0) plus H''(0) x."""
        zero = np.zeros_like(x)
        lo, hi = self.law.interval(zero)
        return (lo + hi) / 2 + self.second(x) * x

    def second(self, x: Array) -> Array:
        """H''(0)."""
        return self.law.convex.second(np.zeros_like(x))
