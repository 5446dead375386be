"""The segments of sites where they differ from those of one unknown with piecewise linear laws, and what is refused."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from ...errors import InputError
from ...reduced.condensed_problem import CondensedProblem
from ..segments import Kind, Segment, between
from .radials import Radials
from .vertex_laws import VertexLaw


def from_zero(found: tuple[Segment, ...], laws: Sequence[VertexLaw]) -> tuple[Segment, ...]:
    """The segments of a length: instead of a bound at 0 the traction at rest, which may have any direction.

    Args:
        found: the segments above a bound at 0.
        laws: that act on the length.
    """
    rest = found[0].force
    ahead = tuple(fresh(s, laws) for s in found[1:])
    if rest == 0.0:
        return ahead
    return (Segment(kind=Kind.JUMP, x=0.0, force=0.0, rise=float(np.sign(rest)), low=0.0, high=abs(rest)), *ahead)


def fresh(segment: Segment, laws: Sequence[VertexLaw]) -> Segment:
    """A piece that a curved law with memory has not passed is fresh, whatever its chord; one through 0 goes both ways.

    Args:
        segment: the piece, or another segment.
        laws: of its site.
    """
    if segment.rise or segment.outward:
        return segment
    first, last = segment.x + segment.low, segment.x + segment.high
    if first < 0.0 < last:
        return segment
    middle = between(first, last)
    for law in laws:
        ends = (-np.inf, np.inf) if law.passed is None else law.passed.displacements
        if law.curved and not ends[0] < middle < ends[1]:
            return replace(segment, outward=int(np.sign(middle)))
    return segment


def beside_opening(lower: float) -> tuple[Segment, ...]:
    """The segments of an opening: pressed against its bound, free while it is negative, part of a length.

    Args:
        lower: the bound, at most 0; or -inf.
    """
    found = [Segment(kind=Kind.PIECE, x=0.0, force=0.0, low=0.0, high=math.inf)]
    if lower < 0.0:
        found.insert(0, Segment(kind=Kind.PIECE, x=0.0, force=0.0, low=lower, high=0.0))
    if math.isfinite(lower):
        found.insert(0, Segment(kind=Kind.BOUND, x=lower, force=0.0, rise=1.0, low=-math.inf, high=0.0))
    return tuple(found)


def refuse_shared(problem: CondensedProblem, radials: Radials, laws: Sequence[VertexLaw]) -> None:
    """Refuse what has no graph of its own: unknowns that a law on a length shares with another law or a bound.

    Args:
        problem: the problem.
        radials: the sites of laws on a length.
        laws: at all vertices.

    Raises:
        InputError: there are such unknowns, or openings with a bound above 0.
    """
    seen, openings = radials.flat, radials.opening_unknowns
    with_one = [i for law in laws if not law.radial for i in law.unknowns]
    low = np.isfinite(problem.lower)
    low[openings] = problem.lower[openings] > 0.0
    bounded = np.flatnonzero(low | np.isfinite(problem.upper))
    shared = np.intersect1d(seen, np.concatenate([np.array(with_one, dtype=np.int64), bounded]))
    if len(np.unique(seen)) == len(seen) and not shared.size:
        return
    raise InputError(
        "path: at a vertex a law acts on |u_t| or on opening and slip, and contact or another law on a component of "
        "it; such an edge has no path yet. Leave one of them away there, or let the parts not meet. Cohesion beside "
        "contact has a path where nothing bounds the opening from above, and the gap is not negative"
    )
