"""What counts as zero, as equal and as enough in the analysis of rigid motions."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any


@dataclass(frozen=True, kw_only=True)
class Thresholds:
    """Limits of the analysis; everything it compares is nondimensional and of order 1.

    Attributes:
        rank: singular values this small beside the largest count as zero.
        short_row: a row this short constrains no rigid motion: what is left of it is rounding.
        tie: a margin this small beside the work of the loads is an equality.
        dropped: coefficients of at most this size, the largest tried first, that the motion which is named may do
            without.
        feasible: violation of a cone's row of unit length that still counts as none.
        max_rounds: linear programmes for one minimum; friction in 3D needs about 40.
        tight_gap: gap between value and lower bound, over the scale, that ends the search.
        loose_gap: gap that will do where it shrinks no more.
        patience: linear programmes without a smaller gap after which it counts as shrinking no more.
        shrunk: what a gap must fall to, of the last smallest, to count as smaller.
        at_edge: distance from the edge of a box, over its half width, within which a position is at the edge.
        touching: distance from its bound, over the largest bound, at which a vertex rests on it.
        independent: part of a support's row that must not be spanned by others.
        rest_gap: energy by which a position at rest may be above the least one, over the largest work.
        rest_rounds: linear programmes for a position at rest, at most; it is a start, so the best position will do.
        farthest: a displacement of so many times p0 L / E0 is a body that slides away.
        max_cones: divisions of a cone of slips for one minimum, where a growth is not convex.
        part_of_gap: how exactly the bound on such a cone is computed, relative to the gap that is left in all.
        inside: share of an edge of such a cone, relative to the largest, from which a slip is inside of the cone.
        solver_tolerances: of HiGHS, with and without presolve, the narrowest first; where rounding leaves it without a
            verdict, the next.
    """

    rank: float = 1e-9
    short_row: float = 1e-10
    tie: float = 1e-9
    dropped: tuple[float, ...] = (1e-3, 1e-4, 1e-5, 1e-6, 1e-7, 1e-8)
    feasible: float = 1e-10
    max_rounds: int = 500
    tight_gap: float = 1e-13
    loose_gap: float = 1e-9
    patience: int = 4
    shrunk: float = 0.9
    at_edge: float = 1e-9
    touching: float = 1e-7
    independent: float = 1e-6
    rest_gap: float = 1e-10
    rest_rounds: int = 200
    farthest: float = 1e8
    max_cones: int = 2_000
    part_of_gap: float = 0.1
    inside: float = 1e-3
    solver_tolerances: tuple[tuple[bool, float], ...] = ((False, 1e-10), (True, 1e-10), (False, 1e-9), (True, 1e-9))

    def solver_options(self) -> list[dict[str, Any]]:
        """The options of HiGHS to be tried one after the other."""
        names = "primal_feasibility_tolerance", "dual_feasibility_tolerance"
        return [
            {"presolve": presolve, **dict.fromkeys(names, tolerance)} for presolve, tolerance in self.solver_tolerances
        ]


DEFAULT = Thresholds()
