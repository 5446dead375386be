"""The balance of forces in a cell where all laws are smooth: its equations, and a solution of them.

The unknowns are u = (x, s): with Sx + κz - f = 0 goes ½(|z|² - r²) = 0 for each vector z whose secant κ is not constant
in the cell. On an arc g = a + b r of its law s is r, and κ = b + a/r; on a drop r is fixed, and s is κ. All entries of
the derivative are simple in x and s, so a cell needs no intervals of directions. The equations go on behind the ends of
the cell. So where they have one solution at most in the cell and about a solution that is known, and that one is no
stationary point, there is none in the cell.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ..typing import Array, Integers, Mask
from .boxes import Box
from .cell_parts import at_bounds
from .length_ranges import Ranges, times
from .scalar_problem import ArcTable, ScalarProblem

EPSILON = float(np.finfo(float).eps)


@dataclass(frozen=True, kw_only=True)
class SmoothSystem:
    """The equations of one cell.

    Attributes:
        problem: the problem.
        free: unknowns that are not fixed, (k,).
        fixed: the values of the others, (n,); of free ones zero.
        slopes: of the laws of one component, and constant secants, (n,).
        offsets: of the tractions of these, (n,).
        curved: vectors with a length or a secant of their own, (l,).
        seen: which of their components count, (l, 3).
        a: of their arcs, (l,).
        b: of their arcs, (l,).
        drops: which of them are on a drop, (l,).
        r: their lengths there, (l,).
        ends: the intervals of u, (2, k + l).
    """

    problem: ScalarProblem
    free: Integers
    fixed: Array
    slopes: Array
    offsets: Array
    curved: Integers
    seen: Mask
    a: Array
    b: Array
    drops: Mask
    r: Array
    ends: Array

    @classmethod
    def of(cls, problem: ScalarProblem, cell: Box) -> SmoothSystem | None:
        """The equations of a cell; None where a law or a bound is not smooth there.

        Args:
            problem: the problem.
            cell: with the unknowns, the lengths and their tractions, (n + 2m,).
        """
        ranges = Ranges.of(problem, cell)
        unfixed = ranges.x[0] < ranges.x[1]
        own, meets = _met(ranges)
        seen, drops = _seen(ranges), (ranges.r[0] == ranges.r[1]) & (ranges.r[0] > 0.0)
        acts = np.any(seen & unfixed[problem.lengths.unknowns], axis=1)
        several = np.any(unfixed & (own.sum(axis=1) > 1)) or np.any(acts & ~drops & (meets.sum(axis=1) > 1))
        if several or _is_cornered(ranges, cell):
            return None
        slopes, offsets = _lines(problem.arcs, own, unfixed)
        b, a = _lines(ranges.laws, meets, np.ones(len(meets), dtype=np.bool_))
        straight = ~drops & (np.abs(a) <= ranges.laws.rounding)
        for v, c in zip(*np.nonzero(seen & straight[:, None]), strict=True):
            slopes[problem.lengths.unknowns[v, c]] += problem.lengths.factors[v, c] ** 2 * b[v]
        curved = np.flatnonzero(acts & ~straight)
        own_ends = np.where(drops, ranges.secants, ranges.r)[:, curved]
        return cls(
            problem=problem,
            free=np.flatnonzero(unfixed),
            fixed=np.where(unfixed, 0.0, ranges.x[0]),
            slopes=slopes,
            offsets=offsets,
            curved=curved,
            seen=seen[curved],
            a=np.where(drops, 0.0, a)[curved],
            b=np.where(drops, 0.0, b)[curved],
            drops=drops[curved],
            r=ranges.r[0, curved],
            ends=np.concatenate([ranges.x[:, unfixed], own_ends], axis=1),
        )

    @property
    def start(self) -> Array:
        """The middle of the cell, (k + l,)."""
        return np.asarray(0.5 * self.ends[0] + 0.5 * self.ends[1])

    def from_point(self, x: Array) -> Array:
        """A place to begin, (k + l,), with the lengths of a point.

        Args:
            x: the point, (n,).
        """
        own = np.where(self.drops, self.start[len(self.free) :], self.problem.lengths.of(x)[self.curved])
        return np.clip(np.concatenate([x[self.free], own]), *self.ends)

    def smaller(self, cell: Box, ends: Array) -> Box:
        """The cell with smaller intervals; none becomes a place.

        Args:
            cell: the cell.
            ends: intervals of u, (2, k + l).
        """
        n, m, k = self.problem.size, len(self.problem.lengths), len(self.free)
        places, kept = [*self.free, *(n + self.curved)], np.concatenate([np.ones(k, dtype=np.bool_), ~self.drops])
        kept &= ends[0] < ends[1]
        low, high = cell.low.copy(), cell.high.copy()
        chosen = np.array(places, dtype=np.int64)[kept]
        low[chosen], high[chosen] = ends[0, kept], ends[1, kept]
        for j in np.flatnonzero(self.drops):
            g = ends[:, k + j] * self.r[j]
            low[n + m + self.curved[j]] = max(low[n + m + self.curved[j]], g[0] * (1.0 - 4.0 * EPSILON))
            high[n + m + self.curved[j]] = min(high[n + m + self.curved[j]], g[1] * (1.0 + 4.0 * EPSILON))
        return replace(cell, low=low, high=high, x=np.clip(cell.x, low[:n], high[:n]))

    def x(self, u: Array) -> Array:
        """The unknowns of a solution, (n,).

        Args:
            u: (k + l,).
        """
        x = self.fixed.copy()
        x[self.free] = u[: len(self.free)]
        return x

    def solution(self, start: Array) -> Array | None:
        """The solution that Newton's method finds; None where it finds none.

        Args:
            start: where to begin, (k + l,).
        """
        u, limits = start, self.problem.thresholds.points
        before = np.inf
        for _ in range(limits.newton_steps):
            rest, error = self.rest(u)
            derivative = self.derivative(np.stack([u, u]))[0]
            if not np.all(np.isfinite(derivative)):
                return None
            try:
                step = np.linalg.solve(derivative, -rest)
            except np.linalg.LinAlgError:
                return None
            size = float(np.max(np.abs(step), initial=0.0))
            if np.all(np.abs(rest) <= error) and size >= 0.5 * before:
                return u
            u, before = u + step, size
        return u if np.all(np.abs(self.rest(u)[0]) <= 4.0 * self.rest(u)[1]) else None

    def near(self, u: Array) -> Array:
        """How near to a computed solution all is the same point, (k + l,).

        Args:
            u: the solution, (k + l,).
        """
        size = self.problem.thresholds.points.accuracy * (1.0 + float(np.max(np.abs(self.x(u)), initial=0.0)))
        own = u[len(self.free) :]
        return np.concatenate([np.full(len(self.free), size), np.where(self.drops, size * np.abs(own) + size, size)])

    def secants(self, own: Array) -> Array:
        """κ, (..., l).

        Args:
            own: r, or κ on drops, (..., l).
        """
        with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
            return np.asarray(np.where(self.drops, own, self.b + self.a / own))

    def _parts(self, x: Array) -> tuple[Array, Array]:
        """The components z of curved vectors that count, and z times their factors, (..., l, 3)."""
        lengths, v = self.problem.lengths, self.curved
        factors = np.where(self.seen, lengths.factors[v], 0.0)
        at = x[..., lengths.unknowns[v]]
        return factors * at, factors**2 * at

    def rest(self, u: Array) -> tuple[Array, Array]:
        """What is missing in the equations, and its rounding error, (k + l,) each.

        Args:
            u: (k + l,).
        """
        problem, x, own = self.problem, self.x(u), u[len(self.free) :]
        kappa, lengths = self.secants(own), problem.lengths
        z, weighed = self._parts(x)
        laws = self.slopes * x + self.offsets
        sizes = np.abs(self.slopes * x) + np.abs(self.offsets) + np.abs(problem.stiffness) @ np.abs(x)
        places = lengths.unknowns[self.curved][self.seen]
        laws[places] += (kappa[:, None] * weighed)[self.seen]
        with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
            parts = np.where(self.drops, np.abs(kappa), np.abs(self.b) + np.abs(self.a / own))
        sizes[places] += (parts[:, None] * np.abs(weighed))[self.seen]
        r = np.where(self.drops, self.r, own)
        forces = (problem.stiffness @ x + laws - problem.force)[self.free]
        rest = np.concatenate([forces, 0.5 * ((z**2).sum(axis=1) - r**2)])
        sizes = np.concatenate([(sizes + np.abs(problem.force))[self.free], (z**2).sum(axis=1) + r**2])
        return rest, problem.thresholds.cells.roundings * len(x) * EPSILON * sizes

    def derivative(self, ends: Array) -> Array:
        """The interval of the derivative on intervals of u, (2, k + l, k + l).

        Args:
            ends: these intervals, (2, k + l).
        """
        problem, k, n = self.problem, len(self.free), self.problem.size
        lengths = problem.lengths
        x = np.stack([self.x(end) for end in ends])
        own = ends[:, k:]
        kappa = np.sort(self.secants(own), axis=0)
        with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
            bent = np.where(self.drops, 1.0, np.sort(-self.a / own**2, axis=0))
        weighed = np.sort(self._parts(x)[1], axis=0)
        whole = np.zeros((2, n + len(self.curved), n + len(self.curved)))
        whole[:, :n, :n] = problem.stiffness + np.diag(self.slopes)
        by_length = times(bent[:, :, None], weighed)
        for j, c in zip(*np.nonzero(self.seen), strict=True):
            i, factor = lengths.unknowns[self.curved[j], c], lengths.factors[self.curved[j], c]
            whole[:, i, i] += factor**2 * kappa[:, j]
            whole[:, i, n + j] = by_length[:, j, c]
            whole[:, n + j, i] = weighed[:, j, c]
        for j in np.flatnonzero(~self.drops):
            whole[:, n + j, n + j] = -own[::-1, j]
        kept = np.concatenate([self.free, n + np.arange(len(self.curved))])
        return whole[:, kept[:, None], kept]


def _met(ranges: Ranges) -> tuple[Mask, Mask]:
    """Which arcs the laws of one component, and those of lengths, meet in a cell, (n, ...) and (m, ...)."""
    rest = np.zeros(len(ranges.problem.lengths))
    own = ranges.problem.arcs.meets(*(np.concatenate([end, rest]) for end in ranges.x))
    return own[: ranges.problem.size], ranges.laws.meets(*ranges.r)


def _seen(ranges: Ranges) -> Mask:
    """Which components of the vectors count in a cell, (m, 3)."""
    lengths = ranges.problem.lengths
    seen = lengths.there & ~ranges.at_zero[:, None]
    seen[:, 0] &= ~(lengths.opens & (ranges.vectors[1, :, 0] <= 0.0))
    return np.asarray(seen)


def _is_cornered(ranges: Ranges, cell: Box) -> bool:
    """Whether a bound, an opening or a length of zero is within the cell, not at its end."""
    box = replace(cell, low=ranges.x[0], high=ranges.x[1])
    bound, zero = at_bounds(ranges.problem, box), ranges.at_zero & (ranges.r[1] > 0.0)
    return bool(np.any((ranges.x[0] < ranges.x[1]) & bound) or np.any(ranges.mixed) or np.any(zero))


def _lines(arcs: ArcTable, meets: Mask, there: Mask) -> tuple[Array, Array]:
    """Slope and offset of the traction on the first arc that each law meets, zero where it is not there, (n,) each."""
    k, rows = np.argmax(meets, axis=1), np.arange(len(meets))
    slopes = np.where(there, arcs.slopes[rows, k], 0.0)
    return slopes, np.where(there, arcs.tractions[rows, k] - slopes * arcs.anchors[rows, k], 0.0)
