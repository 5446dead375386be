"""What the unknowns of Γc's vertices carry: bounds, laws, obstacles that are moved."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ..errors import InputError
from ..runtime.mpi import agree
from ..typing import Array, Integers
from . import condensed_laws
from .interior import Interior
from .system import System


@dataclass(frozen=True, kw_only=True)
class Carriers:
    """The vertices' unknowns, the same on all ranks.

    Attributes:
        lower: bounds, (n,).
        upper: bounds, (n,).
        points: vertices, m, (n, 3).
        parts: the part whose contact bounds the unknown, (n,).
        carrying: numbers of those that carry a bound or a law.
        shift: by how much obstacles that the factor moves have moved the bounds, which are those without, (n,).
    """

    lower: Array
    upper: Array
    shift: Array
    points: Array
    parts: tuple[str, ...]
    carrying: Integers

    def of(self, chosen: Integers) -> Carriers:
        """Those of some unknowns, among which are all that carry.

        Args:
            chosen: their numbers, ascending, (m,).
        """
        return replace(
            self,
            lower=self.lower[chosen],
            upper=self.upper[chosen],
            shift=self.shift[chosen],
            points=self.points[chosen],
            parts=tuple(self.parts[i] for i in chosen),
            carrying=np.searchsorted(chosen, self.carrying),
        )


def find(system: System, interior: Interior, laws: condensed_laws.CondensedLaws, moved: Array) -> Carriers:
    """What the kept unknowns carry. Collective.

    Args:
        system: the system.
        interior: which unknowns are kept.
        laws: on them.
        moved: by how much obstacles that the factor moves have moved the bounds, (local unknowns,).

    Raises:
        InputError: on all ranks alike: a law acts along a displacement along which an obstacle is moved.
    """
    lower, upper, shift = (interior.gathered(v) for v in (system.lower.array_r, system.upper.array_r, moved))
    bounded = np.isfinite(lower) | np.isfinite(upper)
    with_law = [b.unknowns.ravel() for b in laws.bonds]
    d = system.problem.scales.dimension
    named = np.full(system.load.local_size, "", dtype=object)
    for bounds in system.bounds:
        named[bounds.component()[0]] = bounds.surface.part
    _refuse_laws(laws, shift)
    return Carriers(
        lower=lower - shift,
        upper=upper - shift,
        shift=shift,
        points=np.concatenate(agree(system.comm, system.problem.points[interior.kept // d])),
        parts=tuple(str(p) if b else "" for p, b in zip(interior.gathered(named), bounded, strict=True)),
        carrying=np.unique(np.concatenate([np.flatnonzero(bounded), *with_law])).astype(np.int64),
    )


def _refuse_laws(laws: condensed_laws.CondensedLaws, shift: Array) -> None:
    """Laws act on the body's own displacement, which is not that relative to an obstacle."""
    for bonds in laws.bonds:
        if np.any(shift[bonds.unknowns] != 0.0):
            raise InputError(
                f"boundary.{bonds.part}: the path moves an obstacle along the displacement that this "
                "law acts on; leave the vertices that both parts share out of one of them (where)"
            )
