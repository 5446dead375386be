"""What the balance of forces, weighed by displacements, proves of a cell: no stationary point, or a smaller cell.

Each stationary point x with tractions t has (x + y)·(Sx + t - f) = 0 for all weights y; what bounds bear adds nothing
negative if y is at most -b at a lower bound b, and at least at an upper one. With a diagonal D for which M = S - D is
positive semidefinite, and any point p, xᵀMx is at least 2 pᵀMx - pᵀMp. So the sum of hᵢ(xᵢ, tᵢ) over all laws, with

    hᵢ = dᵢ xᵢ² + xᵢ tᵢ + (2Mp + Sy - f)ᵢ xᵢ + yᵢ tᵢ,

is at most pᵀMp + y·f. On each arc hᵢ is a parabola, so its least value is known. Weights and point may come from
anywhere; the rounding of all products is allowed for, and how far M may be off positive semidefinite.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.linalg import LinAlgError, cholesky

from ..typing import Array, Mask
from .scalar_problem import ScalarProblem
from .thresholds import EPSILON, LIMITS
from .tightening import widened


@dataclass(frozen=True, kw_only=True)
class Split:
    """S = M + D on a cell.

    Attributes:
        diagonal: d, (n,).
        matrix: M, (n, n).
        short: M is at least minus this.
    """

    diagonal: Array
    matrix: Array
    short: float

    @classmethod
    def of(cls, problem: ScalarProblem, diagonal: Array) -> Split:
        """M = S - D, if its factorisation ends; else with the negative part of D alone.

        The factors of M + δ are exact for a matrix that is off by n machine epsilons of the trace (Rump 2006, BIT 46).

        Args:
            problem: the problem.
            diagonal: d, (n,).
        """
        for d in (diagonal, np.minimum(diagonal, 0.0)):
            matrix = problem.stiffness - np.diag(d)
            short = (len(d) + 2) * EPSILON * float(np.abs(np.diag(problem.stiffness)).sum() + np.abs(d).sum())
            try:
                cholesky(matrix + short * np.eye(len(d)), lower=True)
                break
            except LinAlgError:
                continue
        else:
            short = np.inf
        return cls(diagonal=d, matrix=matrix, short=2.0 * short)


@dataclass(frozen=True, kw_only=True)
class Graphs:
    """The arcs of all laws in a cell: their tractions are offset + slope x from begin to end, (n, m) each."""

    begin: Array
    end: Array
    meets: Mask
    offset: Array
    slope: Array

    @classmethod
    def of(cls, problem: ScalarProblem, low: Array, high: Array) -> Graphs:
        """The arcs that have more than a point in common with a cell; at a joint alone all that meet there.

        Args:
            problem: the problem.
            low: of the cell, (n,), finite.
            high: of the cell, (n,), finite.
        """
        arcs = problem.arcs
        begin, end = np.maximum(arcs.low, low[:, None]), np.minimum(arcs.high, high[:, None])
        meets = arcs.meets(low, high) | ((low == high)[:, None] & (begin <= end))
        return cls(
            begin=np.where(meets, begin, 0.0),
            end=np.where(meets, end, 0.0),
            meets=np.asarray(meets),
            offset=arcs.tractions - arcs.slopes * arcs.anchors,
            slope=arcs.slopes,
        )

    def size(self) -> Array:
        """The largest sum of the parts of a traction, (n,)."""
        far = np.maximum(np.abs(self.begin), np.abs(self.end))
        return np.asarray(np.where(self.meets, np.abs(self.offset) + np.abs(self.slope) * far, 0.0).max(axis=1))


@dataclass(frozen=True, kw_only=True)
class Weighed:
    """The parabolas h of a cell for some weights: a x² + b x + c on each arc.

    Attributes:
        graphs: the arcs.
        a: (n, m).
        b: (n, m).
        c: (n, m).
        least: the least of each h, (n,).
        total: the sum of all least values, less what it may be at a stationary point, and less its rounding.
        rounding: what was taken off for it.
    """

    graphs: Graphs
    a: Array
    b: Array
    c: Array
    least: Array
    total: float
    rounding: float

    @property
    def excludes(self) -> bool:
        """Whether no stationary point is in the cell."""
        return self.total > 0.0

    def smaller(self, low: Array, high: Array) -> tuple[Array, Array] | None:
        """A smaller cell: h is nowhere larger than what all other laws leave it; None if nothing is left.

        Args:
            low: of the cell, (n,).
            high: of the cell, (n,).
        """
        left = self.least - self.total + self.rounding
        first, last = self._below(left)
        first, last = first.min(axis=1), last.max(axis=1)
        if np.any(first > last):
            return None
        return widened(low, high, first, last)

    def _below(self, most: Array) -> tuple[Array, Array]:
        """The first and the last place on each arc where h is at most this; (inf, -inf) where it is nowhere."""
        begin, end, c = self.graphs.begin, self.graphs.end, self.c - most[:, None]
        with np.errstate(invalid="ignore", divide="ignore", over="ignore"):
            root = np.sqrt(np.maximum(self.b * self.b - 4.0 * self.a * c, 0.0))
            q = -0.5 * (self.b + np.copysign(root, self.b))
            places = np.stack([begin, end, q / self.a, c / q])
            values = (self.a * places[:2] + self.b) * places[:2] + c
            holds = np.concatenate([values <= 0.0, (places[2:] >= begin) & (places[2:] <= end)])
        holds &= self.graphs.meets
        return np.where(holds, places, np.inf).min(axis=0), np.where(holds, places, -np.inf).max(axis=0)


def weighed(problem: ScalarProblem, split: Split, ends: tuple[Array, Array], weights: Array, point: Array) -> Weighed:
    """The parabolas of a cell, and what they prove.

    Args:
        problem: the problem.
        split: M and D.
        ends: of the cell, (n,) each, finite.
        weights: y, (n,); those that bounds do not allow are changed.
        point: p, (n,).
    """
    low, high = ends
    graphs, y = Graphs.of(problem, low, high), allowed(problem, low, high, weights)
    bent = split.matrix @ point
    along = 2.0 * bent + problem.stiffness @ y - problem.force
    a = split.diagonal[:, None] + graphs.slope
    b, c = graphs.offset + along[:, None] + y[:, None] * graphs.slope, y[:, None] * graphs.offset
    least = _least(graphs, a, b, c)
    off = _rounding(problem, split, graphs, (low, high), y, point)
    total = float(least.sum() - point @ bent - y @ problem.force) - off
    return Weighed(graphs=graphs, a=a, b=b, c=c, least=least, total=total, rounding=off)


def allowed(problem: ScalarProblem, low: Array, high: Array, weights: Array) -> Array:
    """Weights by which what bounds bear adds nothing negative, (n,).

    Args:
        problem: the problem.
        low: of the cell, (n,).
        high: of the cell, (n,).
        weights: (n,).
    """
    most = np.where(low <= problem.lower, -problem.lower, np.inf)
    least = np.where(high >= problem.upper, -problem.upper, -np.inf)
    return np.maximum(np.minimum(weights, most), least)


def _least(graphs: Graphs, a: Array, b: Array, c: Array) -> Array:
    with np.errstate(invalid="ignore", divide="ignore", over="ignore"):
        turn = np.clip(np.where(a > 0.0, -0.5 * b / a, graphs.begin), graphs.begin, graphs.end)
        values = np.stack([(a * x + b) * x + c for x in (graphs.begin, turn, graphs.end)]).min(axis=0)
    return np.asarray(np.where(graphs.meets, values, np.inf).min(axis=1))


def _rounding(
    problem: ScalarProblem, split: Split, graphs: Graphs, ends: tuple[Array, Array], y: Array, point: Array
) -> float:
    """What rounding, and an M that is not quite semidefinite, can be."""
    far = np.maximum(np.abs(ends[0]), np.abs(ends[1]))
    apart = np.maximum(np.abs(ends[0] - point), np.abs(ends[1] - point))
    weight, bent = np.abs(y), np.abs(split.matrix) @ np.abs(point)
    size = (3.0 * np.abs(point) + 2.0 * far) @ bent + far @ (np.abs(problem.stiffness) @ weight)
    size += (far + weight) @ (np.abs(problem.force) + graphs.size()) + np.abs(split.diagonal) @ far**2
    return LIMITS.rounding * float(size) + split.short * float(apart @ apart)
