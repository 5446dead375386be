"""The numbers that tune the error estimates."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from .. import thresholds


@dataclass(frozen=True, kw_only=True)
class Thresholds:
    """How accurately the estimates are computed.

    Attributes:
        near: distance (of u0) from a kink or a bound that counts as being on it; variation of a gap that is rounding.
        facet_degree: of the quadrature of the laws on a facet, by the degree of the solution: a drop within an edge is
            met to a fourteenth of its length at degree 1, to a thirty-second at degree 2, whose edges are longer.
        interface_degree: the same on the intersections of the facets of two bodies, which are smaller.
        bubble_tolerance: of a solve for bubbles, in the energy norm: their energy is right to about its square.
        bubble_tolerance_again: the same of what is left, where they are found again beside nodes that moved, by the
            degree of the solution.
        bubble_steps: conjugate gradient steps at most of such a solve.
        bubble_rounds: of the active set of the bounds between the nodes, at most.
        dual_tolerance: of a solve with the system's matrix, relative residual: the energy is right to about its square.
        left_tolerance: the same of what the solver left, which is far below the mesh's error.
        foundation: stiffness per area, in units of E0/L, in the place of a law that is flat everywhere: it may be all
            that could hold a motion.
        vertex_tolerance: the same, where conjugate gradients on the bubbles solve for the nodes at each step.
        data_degree: of the modes by which the data on a facet are sampled, by dimension.
        gap_shifts: bisections of the body's motion along a normal, where a gap varies within facets.
        gap_sweeps: sweeps over a facet's points in each of them.
        rounding: nondimensional norms up to this are rounding: a body that meets no force has no error, not 100 % of
            nothing.
        coupled: error of the bubbles alone, relative to |||u_h|||, from which the nodes are found with them, by the
            degree of the solution: at degree 2 always, or up to 40 % of the error is not seen.
        coupled_rounds: times at most that bubbles and nodes are solved for in turns.
        coupled_change: relative change in energy norm of both up to which no further round is needed.
        answer_tolerance: of a solve for the nodes among those rounds: the next one takes up what it leaves.
        answer_rounds: times at most that the nodes' answer to the bubbles is corrected by the laws'.
        answer_settled: change of the laws' force relative to the largest one, up to which the nodes need not follow it.
        answer_change: relative change in energy norm of that answer up to which no further round is needed.
        coarse: the mesh's error over the norm of the solution, above which the numbers are rough.
    """

    near: float = thresholds.DEFAULT.near
    facet_degree: Mapping[int, int] = field(default_factory=lambda: {1: 12, 2: 30})
    interface_degree: Mapping[int, int] = field(default_factory=lambda: {1: 6, 2: 15})
    bubble_tolerance: float = 0.1
    bubble_tolerance_again: Mapping[int, float] = field(default_factory=lambda: {1: 0.3, 2: 0.2})
    bubble_steps: int = 30
    bubble_rounds: int = 4
    dual_tolerance: float = 0.1
    left_tolerance: float = 0.3
    foundation: float = 1e-8
    vertex_tolerance: float = 1e-6
    data_degree: Mapping[int, int] = field(default_factory=lambda: {2: 14, 3: 6})
    gap_shifts: int = 20
    gap_sweeps: int = 12
    rounding: float = 1e-12
    coupled: Mapping[int, float] = field(default_factory=lambda: {1: 0.3, 2: 0.0})
    coupled_rounds: int = 12
    coupled_change: float = 0.02
    answer_tolerance: float = 0.2
    answer_rounds: int = 4
    answer_settled: float = 0.02
    answer_change: float = 0.05
    coarse: float = 0.1


DEFAULT = Thresholds()
