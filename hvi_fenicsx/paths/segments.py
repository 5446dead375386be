"""The graph of force over displacement of one unknown, with its laws and bounds, as a chain of segments.

Pieces of laws have a slope. Where a law jumps, and at a bound, the displacement stands and the force moves. All of them
form one continuous curve, which a coordinate runs along.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ..typing import Array
from .thresholds import ROUNDING
from .vertex_laws import VertexLaw

_SIDES = ("left", "right")


@dataclass(frozen=True, slots=True, kw_only=True)
class Segment:
    """A straight part of the graph; its coordinate τ grows along the graph, the displacement never falls.

    Attributes:
        x: displacement at τ = 0.
        force: at τ = 0.
        slope: of the force over the displacement; of a piece.
        rise: of the force over τ where the displacement stands, as at a jump: 1, or -1 at a drop; 0 on a piece.
        bound: whether it is a bound.
        low: least τ.
        high: greatest τ.
        outward: on a piece or jump that a bond with memory has not passed yet, the direction in which it does, 1 or -1;
            else 0.
    """

    x: float
    force: float
    slope: float = 0.0
    rise: float = 0.0
    bound: bool = False
    low: float
    high: float
    outward: int = 0

    def displacement(self, coordinate: float) -> float:
        """The displacement at τ."""
        return self.x if self.rise else self.x + coordinate

    def coordinate(self, x: float, force: float) -> float:
        """The τ of a displacement (or, where it stands, of a force), at most that of an end.

        Args:
            x: the displacement.
            force: the force.
        """
        wanted = (force - self.force) / self.rise if self.rise else x - self.x
        return min(max(wanted, self.low), self.high)

    def force_at(self, x: float) -> float:
        """The force at a displacement on the segment; where it stands, the one nearest to zero."""
        return self.force + (self.rise or self.slope) * self.coordinate(x, 0.0)

    @property
    def hold(self) -> tuple[int, float]:
        """How well a segment holds, for comparison: bounds, rising jumps, pieces by their slope, drops."""
        if not self.rise:
            return 0, self.slope
        if self.bound:
            return 2, 0.0
        return (1, 0.0) if self.rise > 0.0 else (-1, 0.0)


def extremes(chain: Sequence[Segment], *, remembers: bool) -> Array:
    """The least and the greatest force that a point may yet have from each segment on, beside the one that it has.

    Where bonds that remember have been is a secant from there to 0 afterwards.

    Args:
        chain: the k segments.
        remembers: whether all laws of the point do.

    Returns:
        The forces, (k, 2).
    """
    x, forces = np.array([_end(s, s.low) for s in chain] + [_end(chain[-1], chain[-1].high)]).T
    found = np.tile([forces.min(), forces.max()], (len(chain), 1))
    for side in (1, -1) if remembers else ():
        beyond = np.maximum.accumulate([s.outward * side for s in chain[::side]])[::side] > 0
        rest = forces[(x * side < 0.0) | ((x == 0.0) & (forces * side <= 0.0))]
        for column, end in enumerate((np.minimum, np.maximum)):
            ahead = end.accumulate(forces[::-side])[::-side]
            left = ahead[1:] if side > 0 else ahead[:-1]
            found[beyond, column] = end(left, end.reduce(rest, initial=0.0))[beyond]
    return found


def _end(segment: Segment, coordinate: float) -> tuple[float, float]:
    """Displacement and force at an end."""
    rate = segment.rise or segment.slope
    return segment.displacement(coordinate), segment.force + (rate * coordinate if rate else 0.0)


def piece_at(chain: Sequence[Segment], x: float, rounding: float, *, forward: bool) -> int:
    """The number of the piece on which a displacement is or, but for rounding, at an end; of two the next one.

    Args:
        chain: the segments.
        x: the displacement.
        rounding: relative.
        forward: whether the next one is the one after it.
    """
    pieces = [n for n, s in enumerate(chain) if not s.rise]
    away = [abs(chain[n].displacement(chain[n].coordinate(x, 0.0)) - x) for n in pieces]
    near = [n for n, way in zip(pieces, away, strict=True) if way <= max(rounding * abs(x), min(away))]
    return near[-1] if forward else near[0]


def chain(laws: Sequence[VertexLaw], lower: float, upper: float) -> tuple[Segment, ...]:
    """The segments of an unknown, from the least displacement to the greatest.

    Breaks at which nothing changes are left out. A piece has τ = 0 at 0 where that is on it, so that rest is exact.

    Args:
        laws: those that act on it.
        lower: its lower bound, or -inf.
        upper: its upper bound, or inf.
    """
    if lower == upper:
        return (Segment(x=lower, force=0.0, rise=1.0, bound=True, low=-math.inf, high=math.inf),)
    every = sorted({float(b) for law in laws for b in law.graph.breaks if lower < b < upper})
    ends = [lower, *(b for b in every if any(law.changes(b) for law in laws)), upper]
    places = np.unique([x for x in (*ends, 0.0) if math.isfinite(x)])
    sides = [np.array([law.force(places, side) for law in laws]).reshape(-1, len(places)) for side in _SIDES]
    left, right, size = (
        dict(zip(places, total, strict=True))
        for total in (*(part.sum(axis=0) for part in sides), np.abs(sides).sum(axis=(0, 1)))
    )
    found: list[Segment] = []
    if math.isfinite(lower):
        found.append(Segment(x=lower, force=right[lower], rise=1.0, bound=True, low=-math.inf, high=0.0))
    for start, end in itertools.pairwise(ends):
        if start > lower and abs(right[start] - left[start]) > ROUNDING * size[start]:
            found.append(_jump(laws, start, left[start], right[start]))
        anchor = 0.0 if start < 0.0 < end else start if math.isfinite(start) else end
        found.append(_piece(laws, start, end, anchor, (left if anchor == end else right)[anchor]))
    if math.isfinite(upper):
        found.append(Segment(x=upper, force=left[upper], rise=1.0, bound=True, low=0.0, high=math.inf))
    return tuple(found)


def _jump(laws: Sequence[VertexLaw], at: float, left: float, right: float) -> Segment:
    fresh = at != 0.0 and not all(law.has_passed(at) for law in laws)
    rise, outward = math.copysign(1.0, right - left), int(np.sign(at)) if fresh else 0
    return Segment(x=at, force=left, rise=rise, low=0.0, high=abs(right - left), outward=outward)


def _piece(laws: Sequence[VertexLaw], start: float, end: float, anchor: float, force: float) -> Segment:
    middle = between(start, end)
    turns = (
        not law.has_passed(middle) and ((law.curved and not start < 0.0 < end) or not law.returns(middle))
        for law in laws
    )
    return Segment(
        x=anchor,
        force=force,
        slope=math.fsum(law.slope(middle) for law in laws),
        low=start - anchor,
        high=end - anchor,
        outward=int(np.sign(middle)) if any(turns) else 0,
    )


def between(start: float, end: float) -> float:
    """A displacement inside an interval, of the sign of the interval.

    Args:
        start: its low end, or -inf.
        end: its high end, or inf.
    """
    if math.isfinite(start) and math.isfinite(end):
        return 0.5 * (start + end)
    if math.isfinite(start):
        return start + 1.0 + abs(start)
    return end - 1.0 - abs(end) if math.isfinite(end) else 0.0


def from_zero(found: tuple[Segment, ...]) -> tuple[Segment, ...]:
    """The segments of a length: instead of a bound at 0 the traction at rest, which may have any direction.

    Args:
        found: the segments above a bound at 0.
    """
    rest = found[0].force
    if rest == 0.0:
        return found[1:]
    jump = Segment(x=0.0, force=0.0, rise=float(np.sign(rest)), low=0.0, high=abs(rest))
    return (jump, *found[1:])


def beside_opening(lower: float) -> tuple[Segment, ...]:
    """The segments of an opening: pressed against its bound, free while it is negative, part of a length.

    Args:
        lower: the bound, at most 0; or -inf.
    """
    found = [Segment(x=0.0, force=0.0, low=0.0, high=math.inf)]
    if lower < 0.0:
        found.insert(0, Segment(x=0.0, force=0.0, low=lower, high=0.0))
    if math.isfinite(lower):
        found.insert(0, Segment(x=lower, force=0.0, rise=1.0, bound=True, low=-math.inf, high=0.0))
    return tuple(found)
