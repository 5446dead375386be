"""The numbers that tune how linear systems are solved."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field


@dataclass(frozen=True, kw_only=True)
class Thresholds:
    """When which linear solver is used, and when it is set up anew.

    Attributes:
        largest_direct: unknowns up to which a direct solve is the faster one, by dimension (docs/benchmarks.md).
        drift: change of a law's nodal stiffness, relative to an elastic one (about 1), up to which a Krylov method
            keeps its preconditioner.
        slow: iterations from which a direct solver takes over where it can: at 65 a Newton step costs twice as much
            as with it.
        condensing: unknowns of Γc for which condensing costs as much as one factorisation of the whole matrix
            (measured: 13 to 45).
    """

    largest_direct: Mapping[int, int] = field(default_factory=lambda: {2: 60_000, 3: 15_000})
    drift: float = 0.3
    slow: int = 50
    condensing: int = 30


DEFAULT = Thresholds()
