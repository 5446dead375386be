"""The numbers that tune the error estimates."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, kw_only=True)
class EstimateThresholds:
    """How accurately the estimates are computed.

    Attributes:
        facet_degree: of the quadrature of the laws on a facet, at degree 1 and 2: a drop within an edge is met to a
            fourteenth of its length at degree 1, to a thirty-second at degree 2, whose edges are longer. On the
            intersections of the facets of two bodies, which are smaller, half of it.
        tolerance: of a solve for bubbles, in the energy norm, and of one with the system's matrix, relative residual:
            an energy is right to about its square.
        rough_tolerance: the same where the answer is a small part or is taken up by a next round: what the solver left,
            and bubbles that are found again beside nodes that moved, at degree 1; such bubbles at degree 2, and nodes
            among those rounds.
        bubble_steps: conjugate gradient steps at most of a solve for bubbles; bisections of the body's motion along a
            normal, where a gap varies within facets.
        rounds: of the active set of the bounds between the nodes, and of corrections of the nodes' answer to bubbles by
            the laws, at most.
        vertex_tolerance: the same, where conjugate gradients on the bubbles solve for the nodes at each step.
        data_degree: of the modes by which the data on a facet are sampled, in the plane and in space.
        coupled_rounds: times at most that bubbles and nodes are solved for in turns; sweeps over a facet's points for a
            shift of a gap.
        rounding: nondimensional norms up to this are rounding: a body that meets no force has no error, not 100 % of
            nothing.
        coupled: error of the bubbles alone, relative to |||u_h|||, from which the nodes are found with them, at degree
            1 and 2: at degree 2 always, or up to 40 % of the error is not seen.
        coupled_change: relative change in energy norm of both, and of the laws' force, up to which no further round is
            needed.
        answer_change: relative change in energy norm of that answer up to which no further round is needed.
        coarse: the mesh's error over the norm of the solution, above which the numbers are rough.
    """

    facet_degree: tuple[int, int] = (12, 30)
    tolerance: float = 0.1
    rough_tolerance: tuple[float, float] = (0.3, 0.2)
    bubble_steps: int = 30
    rounds: int = 4
    vertex_tolerance: float = 1e-6
    data_degree: tuple[int, int] = (14, 6)
    coupled_rounds: int = 12
    rounding: float = 1e-12
    coupled: tuple[float, float] = (0.3, 0.0)
    coupled_change: float = 0.02
    answer_change: float = 0.05
    coarse: float = 0.1


DEFAULT = EstimateThresholds()
