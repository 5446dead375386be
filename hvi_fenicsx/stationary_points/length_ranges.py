"""What laws of lengths can do in a cell, and the cell as one of springs with an error, a problem of one component each.

A vector z of length r bears κz with the secant κ = g(r)/r, g being the traction of its law. A cell has intervals of the
components, of r and of g; so κ and each component of the traction have intervals, too. The traction of a component
differs from c + sz, for a constant c and a slope s, by an error that is known: small where r is nearly known, and no
larger than g itself. So each test of cells that allows for an error of the forces serves for vectors.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from ..laws.arc import Arc
from ..typing import Array, Mask
from .arcs import FREE, INF, Chain, scaled
from .boxes import Box
from .lengths import Lengths
from .scalar_problem import ArcTable, ScalarProblem

SLOPES = (0.0, 0.25, 0.5, 0.75, 1.0)
"""Slopes that are tried, as shares of the interval of the secants; and none."""


def times(one: Array, other: Array) -> Array:
    """The products of intervals, (2, ...); zero times anything is zero.

    Args:
        one: first and last ends, (2, ...).
        other: the same.
    """
    with np.errstate(invalid="ignore"):
        ends = np.stack([np.nan_to_num(a * b, nan=0.0, posinf=INF, neginf=-INF) for a in one for b in other])
    return np.stack([ends.min(axis=0), ends.max(axis=0)])


def meet(one: Array, other: Array) -> Array:
    """What intervals have in common, (2, ...); empty where the first end is above the second.

    Args:
        one: first and last ends, (2, ...).
        other: the same.
    """
    return np.stack([np.maximum(one[0], other[0]), np.minimum(one[1], other[1])])


@dataclass(frozen=True, kw_only=True)
class Ranges:
    """Intervals of a cell, (2, ...): first and last ends.

    Attributes:
        problem: the problem.
        x: the unknowns, (2, n).
        r: the lengths, (2, m).
        g: the sizes of their tractions, (2, m).
    """

    problem: ScalarProblem
    x: Array
    r: Array
    g: Array

    @classmethod
    def of(cls, problem: ScalarProblem, cell: Box) -> Ranges:
        """The intervals of a cell.

        Args:
            problem: the problem.
            cell: with the unknowns, the lengths and their tractions, (n + 2m,).
        """
        ends = np.stack([cell.low, cell.high])
        n, m = problem.size, len(problem.lengths)
        return cls(problem=problem, x=ends[:, :n], r=ends[:, n : n + m], g=ends[:, n + m :])

    def cell(self, like: Box) -> Box:
        """The intervals as a cell.

        Args:
            like: what else is known of it.
        """
        low, high = (np.concatenate([self.x[k], self.r[k], self.g[k]]) for k in (0, 1))
        x = np.clip(like.x, self.x[0], self.x[1])
        return replace(like, low=low, high=high, x=x)

    @property
    def lengths(self) -> Lengths:
        """The vectors."""
        return self.problem.lengths

    @cached_property
    def laws(self) -> ArcTable:
        """The laws of the lengths."""
        return ArcTable.of(self.problem.chains[self.problem.size :])

    @cached_property
    def vectors(self) -> Array:
        """The components z of the vectors, (2, m, 3)."""
        return np.sort(np.stack([self.lengths.vectors(end) for end in self.x]), axis=0)

    @cached_property
    def felt(self) -> Array:
        """The components without openings that are negative, (2, m, 3)."""
        return np.stack([self.lengths.felt(end) for end in self.vectors])

    @cached_property
    def starts(self) -> Array:
        """The tractions just behind r = 0, (m,)."""
        return self.laws.rates(np.zeros(len(self.lengths)))[0]

    @cached_property
    def at_zero(self) -> Mask:
        """Where r may be zero, with a traction of any direction, (m,)."""
        return np.asarray((self.r[0] <= 0.0) & (self.starts > self.laws.rounding))

    @cached_property
    def secants(self) -> Array:
        """κ = g/r, (2, m)."""
        with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
            wide = np.stack([self.g[0] / self.r[1], self.g[1] / self.r[0]])
            k = self.arc_secants
        wide = np.where(np.isnan(wide), np.array([[0.0], [INF]]), wide)
        return np.where(self.at_zero, np.array([[0.0], [INF]]), meet(wide, k))

    @cached_property
    def arc_secants(self) -> Array:
        """κ of the arcs on the interval of r, (2, m): at their ends, since it is monotone between."""
        arcs, (low, high) = self.laws, self.r
        begin, end = np.maximum(arcs.low, low[:, None]), np.minimum(arcs.high, high[:, None])
        meets = arcs.meets(low, high) | ((low == high)[:, None] & (begin <= end))
        offset = arcs.tractions - arcs.slopes * arcs.anchors
        offset = np.where(np.abs(offset) <= arcs.rounding[:, None], 0.0, offset)
        with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
            ends = np.stack([arcs.slopes + np.where(offset == 0.0, 0.0, offset / at) for at in (begin, end)])
        least = np.where(meets, ends.min(axis=0), INF).min(axis=1)
        return np.stack([least, np.where(meets, ends.max(axis=0), -INF).max(axis=1)])

    @cached_property
    def tractions(self) -> Array:
        """The components of the tractions, (2, m, 3)."""
        with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
            low, high = self.felt
            short, far = self.r[0][:, None], self.r[1][:, None]
            first = np.where(low < 0.0, low / short, low / far)
            last = np.where(high > 0.0, high / short, high / far)
        ways = np.stack([np.clip(np.nan_to_num(first), -1.0, 1.0), np.clip(np.nan_to_num(last), -1.0, 1.0)])
        ways = np.where(self.at_zero[:, None], np.array([-1.0, 1.0])[:, None, None], ways)
        opens = self.lengths.opens & self.at_zero
        ways[0, opens, 0] = 0.0
        ways[1, opens, 0] = self.vectors[1, opens, 0] >= 0.0
        ways = np.where(self.lengths.there, ways, 0.0)
        by_size = times(self.g[:, :, None], ways)
        by_secant = times(self.secants[:, :, None], self.felt)
        return np.where(self.at_zero[:, None], by_size, meet(by_size, by_secant))

    @cached_property
    def alone(self) -> Mask:
        """Components beside which all others of their vector are zero: the law is one of this component, (m, 3)."""
        zero = (self.felt[0] == 0.0) & (self.felt[1] == 0.0)
        return np.asarray(~zero & ((~zero).sum(axis=1) == 1)[:, None])

    @cached_property
    def mixed(self) -> Mask:
        """Where an opening may be positive or negative, (m,)."""
        low, high = self.vectors[:, :, 0]
        return np.asarray(self.lengths.opens & (low < 0.0) & (high > 0.0) & ~self.at_zero)

    @cached_property
    def springs(self) -> tuple[Array, Array, Array]:
        """c, s and the largest error of c + s z for each component's traction, (m, 3) each."""
        low, high = np.where(np.isfinite(self.secants), self.secants, 0.0)
        opens = np.zeros(self.lengths.there.shape, dtype=np.bool_)
        opens[:, 0] = self.mixed
        shut = np.zeros(opens.shape, dtype=np.bool_)
        shut[:, 0] = self.lengths.opens & (self.vectors[1, :, 0] <= 0.0) & ~self.at_zero
        best = [np.full(opens.shape, INF) for _ in range(3)]
        for share in (None, *SLOPES):
            slope = np.zeros_like(low) if share is None else low + share * (high - low)
            slope = np.where(self.at_zero, 0.0, slope)[:, None]
            borne = times(slope + 0.0 * self.felt, self.felt)
            off = meet(times(self.secants[:, :, None] - slope, self.felt), self.tractions - borne[::-1])
            off = np.where(self.at_zero[:, None], self.tractions, off)
            middle = np.where(opens, 0.0, 0.5 * (off[0] + off[1]))
            error = np.where(shut, 0.0, np.maximum(np.abs(off[1] - middle), np.abs(off[0] - middle)))
            error = np.where(self.alone, 0.0, error)
            better = error < best[2]
            for old, new in zip(best, (np.where(shut, 0.0, middle), np.where(shut, 0.0, slope), error), strict=True):
                old[better] = np.broadcast_to(new, error.shape)[better]
        return best[0], best[1], best[2]

    def as_springs(self) -> ScalarProblem:
        """The cell's problem with springs in place of the vectors' laws."""
        problem, lengths = self.problem, self.lengths
        constant, slope, error = self.springs
        chains = list(problem.chains[: problem.size])
        errors = np.zeros(problem.size) + problem.force_error
        for v, k in zip(*np.nonzero(lengths.there), strict=True):
            factor, i = float(lengths.factors[v, k]), int(lengths.unknowns[v, k])
            if self.alone[v, k]:
                law = problem.chains[problem.size + v]
                chains[i] = scaled(_one_sided(law) if k == 0 and lengths.opens[v] else law, 1.0, factor)
                continue
            halved = bool(k == 0 and self.mixed[v])
            opening = factor if halved else 0.0
            chains[i] = _spring(factor * float(constant[v, k]), factor**2 * float(slope[v, k]), opening)
            size = abs(constant[v, k]) + abs(slope[v, k]) * float(np.abs(self.vectors[:, v, k]).max())
            errors[i] += abs(factor) * (error[v, k] + problem.thresholds.cells.widened * size)
        return replace(problem, chains=tuple(chains), lengths=Lengths.none(), force_error=errors)


def _one_sided(law: Chain) -> Chain:
    """The law of an opening, which bears nothing on the negative side."""
    return (FREE[0]._replace(high=0.0), *(a._replace(low=max(a.low, 0.0)) for a in law if a.high > 0.0))


def _spring(constant: float, slope: float, opening: float) -> Chain:
    """A spring; of an opening, which has the sign of the unknown times this number, on the positive side only."""
    if not opening:
        return (Arc(-INF, INF, 0.0, 0.0, constant, slope),)
    free, held = Arc(-INF, INF, 0.0, 0.0, 0.0, 0.0), Arc(-INF, INF, 0.0, 0.0, 0.0, slope)
    first, last = (free, held) if opening > 0.0 else (held, free)
    return (first._replace(high=0.0), last._replace(low=0.0))
