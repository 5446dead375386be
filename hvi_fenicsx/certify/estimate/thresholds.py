"""The numbers that tune the error estimates."""

from __future__ import annotations

from dataclasses import dataclass

from .. import thresholds


@dataclass(frozen=True, kw_only=True)
class Thresholds:
    """How accurately the estimates are computed.

    Attributes:
        near: distance (of u0) from a kink or a bound that counts as being on it.
        facet_degree: of the quadrature of the laws on a facet: a drop within an edge is met to a fourteenth of its
            length.
        bubble_tolerance: of a solve for bubbles, in the energy norm: their energy is right to about its square.
        bubble_steps: conjugate gradient steps at most of such a solve.
        bubble_rounds: of the active set of the bounds at midpoints, at most.
        dual_tolerance: of a solve with the system's matrix, relative residual: the energy is right to about its square.
        vertex_tolerance: the same, where conjugate gradients on the bubbles solve for the vertices at each step.
        rounding: nondimensional norms up to this are rounding: a body that meets no force has no error, not 100 % of
            nothing.
        contact_rounds: times that the bubbles are solved for where the errors on Γc are estimated.
        answer_rounds: times at most that the vertices' answer to the bubbles is corrected by the laws'.
        answer_change: relative change in energy norm of that answer up to which no further round is needed.
    """

    near: float = thresholds.DEFAULT.near
    facet_degree: int = 12
    bubble_tolerance: float = 0.1
    bubble_steps: int = 30
    bubble_rounds: int = 4
    dual_tolerance: float = 0.1
    vertex_tolerance: float = 1e-6
    rounding: float = 1e-12
    contact_rounds: int = 2
    answer_rounds: int = 4
    answer_change: float = 0.05


DEFAULT = Thresholds()
