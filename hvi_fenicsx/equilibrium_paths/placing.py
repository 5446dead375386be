"""On which segments the unknowns are, at an equilibrium that is given by its displacements and forces."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ..reduced.condensed_stiffness import CondensedStiffness
from ..typing import Array, Integers
from .cells import Cells
from .segments import Segment


def place(
    stiffness: CondensedStiffness,
    chains: Sequence[tuple[Segment, ...]],
    x: Array,
    force: Array,
    known: Integers | None = None,
    rounding: float = 1e-9,
) -> Cells:
    """The cell of an equilibrium; of several segments that meet there the one that holds best.

    Args:
        stiffness: S.
        chains: the segments of each unknown.
        x: the displacements, (n,).
        force: of laws and bounds, (n,).
        known: numbers of the segments, where they are known, (n,).
        rounding: distance from a segment that is none, relative to the greatest force.
    """
    size = float(np.max(np.abs(force), initial=0.0)) + float(np.max(np.abs(stiffness @ x), initial=0.0)) or 1.0
    scale = stiffness.diagonal
    numbers, coordinates = np.zeros(len(x), dtype=np.int64), np.zeros(len(x))
    for i, chain in enumerate(chains):
        at = float(x[i]), float(force[i])
        numbers[i] = known[i] if known is not None else _best(chain, *at, float(scale[i]), rounding * size)
        coordinates[i] = _snapped(chain[numbers[i]], *at)
    return Cells(stiffness, chains, numbers, coordinates)


def _best(chain: Sequence[Segment], x: float, force: float, stiffness: float, allowed: float) -> int:
    far = [segment.distance(x, force, stiffness) for segment in chain]
    near = [i for i, distance in enumerate(far) if distance <= max(allowed, min(far))]
    return max(near, key=lambda i: chain[i].hold)


def _snapped(segment: Segment, x: float, force: float) -> float:
    """The coordinate; the end itself where it is that but for rounding."""
    found = segment.coordinate(x, force)
    length = segment.high - segment.low
    for end in (segment.low, segment.high):
        if abs(found - end) <= 1e-12 * (length if np.isfinite(length) else abs(found)):
            return end
    return found
