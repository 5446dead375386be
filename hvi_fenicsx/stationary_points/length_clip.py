"""What intervals of forces leave of vectors, their lengths and the sizes of their tractions.

A vector z of length r bears t = κz with |t| = g(r) and κ = g(r)/r. So forces that are known to some part bound each of
these, and each bounds the others.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ..typing import Array
from .arcs import INF
from .graph_clip import GraphClip
from .length_ranges import Ranges, meet, times
from .lengths import Lengths
from .scalar_problem import ScalarProblem


class LengthClip:
    """The vectors of one problem.

    Args:
        problem: the problem.
    """

    def __init__(self, problem: ScalarProblem) -> None:
        m = len(problem.lengths)
        self._problem, self._widened = problem, problem.thresholds.cells.widened
        none = np.full(m, INF)
        alone = replace(
            problem,
            stiffness=np.zeros((m, m)),
            force=np.zeros(m),
            lower=-none,
            upper=none,
            chains=problem.chains[problem.size :],
            lengths=Lengths.none(),
            force_error=0.0,
            motions=None,
        )
        self._graphs = GraphClip(alone, np.zeros(m), joints_at_ends=False)

    def shorter(self, ranges: Ranges) -> Ranges | None:
        """The components and the lengths made smaller by each other, and g by the law; None if one is empty.

        Args:
            ranges: the intervals of a cell.
        """
        felt, wide = ranges.felt, self._widened
        least = np.where((felt[0] <= 0.0) & (felt[1] >= 0.0), 0.0, np.abs(felt).min(axis=0)) ** 2
        most = np.abs(felt).max(axis=0) ** 2
        r = np.stack(
            [
                np.maximum(ranges.r[0], np.sqrt(least.sum(axis=1)) * (1.0 - wide)),
                np.minimum(ranges.r[1], np.sqrt(most.sum(axis=1)) * (1.0 + wide)),
            ]
        )
        if np.any(r[0] > r[1]):
            return None
        squares = r[:, :, None] ** 2
        others = np.stack([part[:, [1, 0, 0]] + part[:, [2, 2, 1]] for part in (least, most)])
        reach = np.sqrt(np.maximum(squares[1] - others[0] + wide * (squares[1] + others[0]), 0.0))
        least = np.sqrt(np.maximum(squares[0] - others[1] - wide * (squares[0] + others[1]), 0.0))
        low, high = ranges.vectors
        opening = ranges.lengths.opens[:, None] & (np.arange(3) == 0)
        first, last = np.maximum(low, np.where(opening, -INF, -reach)), np.minimum(high, reach)
        first = np.where((least > 0.0) & (opening | (low > -least)), np.maximum(first, least), first)
        last = np.where((least > 0.0) & (high < least) & ~opening, np.minimum(last, -least), last)
        changed = self._with_vectors(replace(ranges, r=r), np.stack([first, last]))
        return None if changed is None else self._on_law(changed)

    def balanced(self, ranges: Ranges, forces: Array) -> Ranges | None:
        """What the forces that laws bear leave; None if one interval is empty.

        Args:
            ranges: the intervals of a cell.
            forces: on the unknowns, (2, n).
        """
        lengths, wide = self._problem.lengths, self._widened
        along = np.sort(np.stack([lengths.along(end) for end in forces]), axis=0)
        along = np.where(lengths.there, along, 0.0)
        sizes = wide * (np.where(np.isfinite(along), np.abs(along), 0.0) + np.abs(ranges.tractions)).sum(axis=0)
        t = meet(ranges.tractions, along)
        t = np.stack([t[0] - sizes, t[1] + sizes])
        if np.any(t[0] > t[1]):
            return None
        inside = (t[0] <= 0.0) & (t[1] >= 0.0)
        least, most = np.where(inside, 0.0, np.abs(t).min(axis=0)), np.abs(t).max(axis=0)
        size = np.stack([np.linalg.norm(least, axis=1) * (1.0 - wide), np.linalg.norm(most, axis=1) * (1.0 + wide)])
        g = meet(ranges.g, size)
        secants = self._secants(ranges, t)
        if np.any(g[0] > g[1]) or np.any(secants[0] > secants[1]):
            return None
        return self._along(replace(ranges, g=g), t, secants)

    def _secants(self, ranges: Ranges, t: Array) -> Array:
        """κ = t/z for each component that is not zero, (2, m)."""
        low, high = ranges.felt
        signed = ((low > 0.0) | (high < 0.0)) & ~ranges.at_zero[:, None]
        with np.errstate(divide="ignore", over="ignore"):
            inverse = np.where(signed, 1.0 / np.stack([high, low]), np.array([0.0, INF])[:, None, None])
            ways = times(t, inverse)
        sizes = self._widened * np.where(np.isfinite(ways), np.abs(ways), 0.0).max(axis=0)
        ways = np.where(signed, np.stack([ways[0] - sizes, ways[1] + sizes]), np.array([-INF, INF])[:, None, None])
        return meet(ranges.secants, np.stack([ways[0].max(axis=1), ways[1].min(axis=1)]))

    def _along(self, ranges: Ranges, t: Array, secants: Array) -> Ranges | None:
        """The lengths r = g/κ and the components z = t/κ."""
        wide = np.array([1.0 - self._widened, 1.0 + self._widened])
        known = ~ranges.at_zero & (secants[0] > 0.0)
        with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
            soft = np.where(known, 1.0 / secants[::-1], np.array([[0.0], [INF]]))
        r = np.where(known, meet(ranges.r, wide[:, None] * times(ranges.g, soft)), ranges.r)
        g = np.where(known, meet(ranges.g, wide[:, None] * times(ranges.r, secants)), ranges.g)
        ways = times(t, soft[:, :, None])
        sizes = self._widened * np.where(np.isfinite(ways), np.abs(ways), 0.0)
        ways = np.stack([ways[0] - sizes[0], ways[1] + sizes[1]])
        opening = ranges.lengths.opens[:, None] & (np.arange(3) == 0)
        ways[0] = np.where(opening & (ways[0] <= 0.0), -INF, ways[0])
        ways = np.where(known[:, None] & ranges.lengths.there, ways, np.array([-INF, INF])[:, None, None])
        if np.any(r[0] > r[1]) or np.any(g[0] > g[1]):
            return None
        changed = self._with_vectors(replace(ranges, r=r, g=g), meet(ranges.vectors, ways))
        return None if changed is None else self._on_law(changed)

    def _with_vectors(self, ranges: Ranges, vectors: Array) -> Ranges | None:
        """The intervals with smaller ones of components; what was one place stays it."""
        lengths = ranges.lengths
        if np.any((vectors[0] > vectors[1])[lengths.there]):
            return None
        x = ranges.x.copy()
        with np.errstate(divide="ignore", invalid="ignore"):
            ways = np.sort(vectors / lengths.factors, axis=0)
        there, members = lengths.there, lengths.members
        slack = self._widened * np.abs(ways)
        x[0, members] = np.maximum(x[0, members], (ways[0] - slack[0])[there])
        x[1, members] = np.minimum(x[1, members], (ways[1] + slack[1])[there])
        return None if np.any(x[0] > x[1]) else replace(ranges, x=x)

    def _on_law(self, ranges: Ranges) -> Ranges | None:
        """The lengths and the sizes of tractions that are on the laws' graphs; None if there are none."""
        known = ~ranges.at_zero
        least, most = np.where(known, ranges.g, np.array([[-INF], [INF]]))
        sizes = self._widened * np.where(known, np.abs(ranges.g), 0.0).max(axis=0)
        ends = self._graphs.clipped(ranges.r[0], ranges.r[1], least - sizes, most + sizes)
        if ends is None:
            return None
        r = meet(ranges.r, np.stack(ends))
        g = meet(ranges.g, law_range(ranges, r))
        return None if np.any(g[0] > g[1]) or np.any(r[0] > r[1]) else replace(ranges, r=r, g=g)


def law_range(ranges: Ranges, r: Array) -> Array:
    """The sizes of the tractions on intervals of the lengths, (2, m); from zero on where r may be zero.

    Args:
        ranges: with the laws.
        r: the lengths, (2, m).
    """
    arcs, (low, high) = ranges.laws, r
    begin, end = np.maximum(arcs.low, low[:, None]), np.minimum(arcs.high, high[:, None])
    meets = arcs.meets(low, high) | ((low == high)[:, None] & (begin <= end))
    with np.errstate(invalid="ignore"):
        ends = np.stack([arcs.tractions + arcs.slopes * (at - arcs.anchors) for at in (begin, end)])
    least = np.where(meets, ends.min(axis=0), INF).min(axis=1)
    most = np.where(meets, ends.max(axis=0), -INF).max(axis=1)
    wide = ranges.problem.thresholds.cells.widened * (np.abs(least) + np.abs(most))
    least = np.where((r[0] <= 0.0) & (ranges.starts > arcs.rounding), 0.0, least)
    return np.stack([least - wide, most + wide])
