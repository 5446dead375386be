"""The segments of sites where they differ from those of one unknown with piecewise linear laws, and what is refused."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from ...errors import InputError
from ...system.condensed_problem import CondensedProblem
from ...typing import Integers
from ..segments import Kind, Segment
from .deviations import between
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
    """A piece that a curved law with memory has not passed is fresh, whatever its chord.

    Args:
        segment: the piece, or another segment.
        laws: of its site.
    """
    if segment.rise or segment.outward:
        return segment
    middle = between(segment.x + segment.low, segment.x + segment.high)
    for law in laws:
        ends = (-np.inf, np.inf) if law.passed is None else law.passed.displacements
        if law.curved and not ends[0] < middle < ends[1]:
            return replace(segment, outward=int(np.sign(middle)))
    return segment


def refuse_shared(problem: CondensedProblem, two: Integers, laws: Sequence[VertexLaw]) -> None:
    """Refuse what has no graph of its own: unknowns that a law on |u_t| shares with another law or a bound.

    Args:
        problem: the problem.
        two: the unknowns of laws on |u_t|, (p, 2).
        laws: at all vertices.

    Raises:
        InputError: there are such unknowns.
    """
    seen = two.ravel()
    with_one = [i for law in laws if len(law.unknowns) == 1 for i in law.unknowns]
    bounded = np.flatnonzero(np.isfinite(problem.lower) | np.isfinite(problem.upper))
    shared = np.intersect1d(seen, np.concatenate([np.array(with_one, dtype=np.int64), bounded]))
    if len(np.unique(seen)) == len(seen) and not shared.size:
        return
    raise InputError(
        "path: at a vertex a law acts on |u_t|, and contact or another law on a component of u_t; such an edge has no "
        "path yet. Leave one of them away there, or let the parts not meet"
    )
