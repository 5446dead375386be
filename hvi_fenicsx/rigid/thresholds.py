"""What counts as zero, as equal and as enough in the analysis of rigid motions."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import product
from typing import Any

import numpy as np


@dataclass(frozen=True, kw_only=True)
class RigidThresholds:
    """Limits of the analysis; everything it compares is nondimensional and of order 1.

    Attributes:
        rounding: what counts as zero: a singular value beside the largest, a coefficient of a motion, a margin beside
            the work of the loads, a gap between value and lower bound that shrinks no more, a distance from an edge.
        exact: the same where rows have unit length and nothing was summed up: a row that constrains no motion, the
            violation of one, an energy above the least one.
        dropped: coefficients of at most this size may be left out of the motion that is named; the largest is tried
            first, then its tenths. So small a share of an edge of a cone of slips, relative to the largest, is none.
        max_rounds: linear programmes for one minimum; friction in 3D needs about 40.
        tight_gap: gap between value and lower bound, over the scale, that ends the search.
        patience: linear programmes without a smaller gap after which it counts as shrinking no more.
        shrunk: what a gap must fall to, of the last smallest, to count as smaller.
        touching: distance from its bound, over the largest bound, at which a vertex rests on it; part of a support's
            row that must not be spanned by others.
        farthest: a displacement of so many times p0 L / E0 is a body that slides away.
        max_cones: divisions of a cone of slips for one minimum, where a growth is not convex.
        part_of_gap: how exactly the bound on such a cone is computed, relative to the gap that is left in all.
    """

    rounding: float = 1e-9
    exact: float = 1e-10
    dropped: float = 1e-3
    max_rounds: int = 500
    tight_gap: float = 1e-13
    patience: int = 4
    shrunk: float = 0.9
    touching: float = 1e-7
    farthest: float = 1e8
    max_cones: int = 2_000
    part_of_gap: float = 0.1

    def dropped_sizes(self) -> list[float]:
        """The sizes up to which coefficients may be left out, the largest first; all are above rounding."""
        tenths = round(np.log10(self.dropped / self.rounding))
        return [self.dropped / 10.0**k for k in range(tenths)]

    def linear_programme(self, *problem: Any) -> Any:
        """What HiGHS finds, its options narrow at first, wider where rounding leaves it without a verdict.

        Args:
            *problem: as for ``scipy.optimize.linprog``, up to the bounds.

        Returns:
            Its result: the status is 0 where a minimum was found, 2 where nothing is admissible.
        """
        # Imported here: it takes longer than the analysis of a scene that needs no linear programme.
        from scipy.optimize import linprog

        names = "primal_feasibility_tolerance", "dual_feasibility_tolerance"
        for tolerance, presolve in product((self.exact, self.rounding), (False, True)):
            options = {"presolve": presolve, **dict.fromkeys(names, tolerance)}
            found = linprog(*problem, method="highs-ds", options=options)
            if found.status in (0, 2):
                break
        return found


DEFAULT = RigidThresholds()
