"""Convex programmes with laws ψ of lengths, by cuts: as ψ never falls, ψ(δ) is at least ψ(u·v) for any unit vector u.

In a frame along u such a cut is a law of one component, and the programme one of :mod:`.convex_programme`, whose bound
holds for all directions. Nothing is lost where u is the direction of the minimiser's vector, or of the force on it
where it is zero. Directions come from the same programme with the stiffness ψ'/δ that a length has across the vector.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ..typing import Array, Mask, magnitude
from .arcs import ArcTable
from .convex_programme import Optimum, minimise, never
from .lengths import Frames, left_out, parts, unknowns_of
from .scalar_problem import ScalarProblem
from .thresholds import LIMITS


@dataclass(frozen=True, kw_only=True)
class _Frame:
    """The vectors at a point: their frames, components that do not count, which are at zero, and what the laws do.

    Attributes:
        frames: along the vectors.
        way: in which these are, (m, 3).
        out: components that do not count, (m, 3).
        held: whether forces hold a vector at zero, (m,).
        start: what a law holds there before the vector moves, (m,).
        across: stiffness across the vector, (m,).
    """

    frames: Frames
    way: Array
    out: Mask
    held: Mask
    start: Array
    across: Array


@dataclass(frozen=True, kw_only=True)
class LengthProgramme:
    """Minimise ½ xᵀAx - bᵀx + Σ ψᵢ + Σ ½ d ⟨-opening⟩² on a box, ψ being convex; those of lengths do not fall.

    Attributes:
        problem: whose vectors these are.
        a: A (n, n), symmetric, positive semidefinite.
        b: (n,).
        laws: ψ, n of the unknowns and m of the lengths, these from zero on.
        shut: d, (m,).
        low: of the box, (n + m,).
        high: of the box, (n + m,).
        cut: whether to end with the point that is there, since the search stops.
    """

    problem: ScalarProblem
    a: Array
    b: Array
    laws: ArcTable
    shut: Array
    low: Array
    high: Array
    cut: Callable[[], bool] = never

    def minimiser(self, start: Array) -> Array:
        """A point of the box at which no step lowers the objective.

        Args:
            start: where to begin, (n,).
        """
        x = self._admissible(start)
        value = self._value(x)
        for _ in range(LIMITS.most_steps):
            found = self._better(x, value)
            if found is None or self.cut():
                break
            x, value = found
        return x

    def bound(self, x: Array) -> Optimum:
        """The minimum of the programme with cuts, which is no higher.

        Args:
            x: where directions are taken from, (n,).
        """
        return self._solved(x, self._frame(x), bounding=True)

    def _value(self, x: Array) -> float:
        laws = self.laws.energy(self.problem.arguments(x)).sum()
        lengths = self.problem.lengths
        behind = np.where(lengths.opens, np.minimum(lengths.vectors(x)[:, 0], 0.0), 0.0)
        return float(0.5 * x @ (self.a @ x) - self.b @ x + laws + 0.5 * self.shut @ behind**2)

    def _better(self, x: Array, value: float) -> tuple[Array, float] | None:
        """A point of lower objective on the way to the solution in the frames; vectors near zero may be held there."""
        goal = self._solved(x, self._frame(x), bounding=False).x
        least = LIMITS.rounding * (abs(value) + float(np.abs(self.b) @ np.abs(x)))
        for halvings in range(8):
            trial = self._admissible(x + 0.5**halvings * (goal - x))
            after = self._value(trial)
            if after < value - least:
                return trial, after
        return None

    def _admissible(self, x: Array) -> Array:
        lengths = self.problem.lengths
        x = np.clip(x, *self._ends)
        size = lengths.of(x)
        share = np.divide(self._radius, size, out=np.ones_like(size), where=size > self._radius)
        return unknowns_of(lengths, x, lengths.vectors(x) * share[:, None])

    @cached_property
    def _radius(self) -> Array:
        """The largest lengths that are allowed, (m,)."""
        return self.laws.last[len(self.b) :]

    def _frame(self, x: Array) -> _Frame:
        lengths, n = self.problem.lengths, len(self.b)
        along = lengths.along(self.b - self.a @ x)
        out = left_out(lengths, x, along, self._ends)
        z, g = np.where(out, 0.0, lengths.vectors(x)), np.where(out, 0.0, along)
        size, start = np.linalg.norm(z, axis=1), self.laws.after[n:, 0]
        step = z + g / self._stiffness[:, None]
        held = (start > 0.0) & (np.linalg.norm(step, axis=1) <= start / self._stiffness)
        force = np.divide((z * g).sum(axis=1), size, out=np.zeros_like(size), where=size > 0.0)
        least, most = self.laws.interval(np.concatenate([self.laws.low[:n, 0], np.minimum(size, self._radius)]))
        traction = np.clip(force, np.maximum(least[n:], 0.0), np.maximum(most[n:], 0.0))
        way = np.where((size > 0.0)[:, None], z, g)
        return _Frame(
            frames=Frames.along(lengths, way),
            way=way,
            out=out,
            held=held,
            start=np.where(size > 0.0, 0.0, np.maximum(start, 0.0)),
            across=np.divide(traction, size, out=self.laws.slopes[n:, 0].copy(), where=size > 0.0),
        )

    def _solved(self, x: Array, here: _Frame, *, bounding: bool) -> Optimum:
        """The programme in the frames; its solution as unknowns, on a joint of a law where the component along is."""
        frames, lengths, n = here.frames, self.problem.lengths, len(x)
        chains: list[Array] = [self.laws.rows(i) for i in range(n)]
        for v, k in zip(*np.nonzero(lengths.there), strict=True):
            chains[lengths.unknowns[v, k]] = np.array(list(self._component(here, int(v), int(k), bounding)))
        matrix, force = frames.matrix(self.a), frames.forces(self.b)
        found = minimise(matrix, force, ArcTable.of(chains), self._begin(frames, x), self.cut)
        y = parts(lengths, found.x)
        vectors, ahead = frames.turned(y), np.abs(y[np.arange(len(y)), frames.axis])
        size = np.linalg.norm(vectors, axis=1)
        on_joint = np.any(self.laws.ends[n:] == ahead[:, None], axis=1) & ~here.out.any(axis=1) & (ahead > 0.0)
        share = np.divide(ahead, size, out=np.ones_like(size), where=on_joint & (not bounding))
        safe = found.bound - self._rounding(found.x)
        return Optimum(x=unknowns_of(lengths, found.x, vectors * share[:, None]), bound=safe)

    def _begin(self, frames: Frames, x: Array) -> Array:
        """The point in the frames; components along vectors that only rounding keeps off a joint are there."""
        y, rows = frames.into(x), np.arange(len(frames.axis))
        axis, joints = self.problem.lengths.unknowns[rows, frames.axis], self.laws.ends[len(x) :]
        size = np.abs(y[axis])
        at = joints[rows, np.argmin(np.abs(joints - size[:, None]), axis=1)]
        y[axis] = np.where(np.abs(at - size) <= LIMITS.rounding * size, np.copysign(at, y[axis]), y[axis])
        return y

    def _rounding(self, y: Array) -> float:
        """What the frames may change of the energy of a point in them, by rounding."""
        lengths, size = self.problem.lengths, np.abs(y)
        each = np.abs(parts(lengths, y)).sum(axis=1)[:, None] / np.where(lengths.there, np.abs(lengths.factors), 1.0)
        size[lengths.members] = each[lengths.there]
        sizes = 0.5 * size @ (np.abs(self.a) @ size) + np.abs(self.b) @ size
        return float(12.0 * np.finfo(float).eps * sizes)

    def _component(self, here: _Frame, v: int, k: int, bounding: bool) -> Iterator[list[float]]:
        """The arcs of the law of one component in its frame."""
        opening, across = bool(self.problem.lengths.opens[v]), 0.0 if bounding else float(here.across[v])
        start = 0.0 if bounding else float(here.start[v])
        far = float(self._far[v])
        if here.out[v, k]:
            low, high = (float(end[v, k]) for end in self._sides)
            behind = opening and k == 0
            if low < 0.0:
                yield _parabola(low, min(high, 0.0), *((float(self.shut[v]), 0.0) if behind else (across, -start)))
            if high > 0.0 or low >= 0.0:
                yield _parabola(max(low, 0.0), high, across, start)
        elif here.held[v] and not bounding:
            yield _parabola(0.0, 0.0)
        elif k == here.frames.axis[v]:
            yield from self._along(here, v, one_sided=bounding and opening and not here.out[v, 0])
        else:
            yield _parabola(-far, far, across, 0.0)

    def _along(self, here: _Frame, v: int, *, one_sided: bool) -> list[list[float]]:
        """The arcs of a cut u·v, on both sides of zero alike; one-sided where a negative opening would count in -u."""
        rows: list[list[float]] = [list(map(float, row)) for row in self.laws.rows(len(self.b) + v)]
        turned = [[-high, -low, -anchor, value, -rate, slope] for low, high, anchor, value, rate, slope in rows[::-1]]
        if not one_sided:
            return [*turned, *rows]
        _, _, anchor, value, rate, slope = rows[0]
        far, least = float(self._far[v]), value + (0.5 * slope * anchor - rate) * anchor
        if here.frames.turns[v, here.frames.axis[v]] @ here.way[v] > 0.0:
            return [[-far, 0.0, 0.0, least, 0.0, 0.0], *rows]
        return [*turned, [0.0, far, 0.0, least, 0.0, 0.0]]

    @cached_property
    def _ends(self) -> tuple[Array, Array]:
        """Where the unknowns end: in vectors at the problem's bounds, or far away, (n,) each."""
        problem, n = self.problem, len(self.b)
        low, high, members = self.low[:n].copy(), self.high[:n].copy(), problem.lengths.members
        far = 2.0 * magnitude([low, high])
        low[members], high[members] = np.maximum(problem.lower, -far)[members], np.minimum(problem.upper, far)[members]
        return low, high

    @cached_property
    def _sides(self) -> tuple[Array, Array]:
        """Where the vectors' components end, (m, 3) each."""
        ends = np.sort([self.problem.lengths.vectors(end) for end in self._ends], axis=0)
        return ends[0], ends[1]

    @cached_property
    def _far(self) -> Array:
        """The longest vector, openings that do not count included, (m,)."""
        return np.linalg.norm(np.max(np.abs(self._sides), axis=0), axis=1)

    @cached_property
    def _stiffness(self) -> Array:
        """A stiffness of each vector, (m,)."""
        lengths = self.problem.lengths
        own = np.diag(self.a)[lengths.unknowns]
        each = np.divide(own, lengths.factors**2, out=np.zeros_like(own), where=lengths.there)
        return np.maximum(each.max(axis=1), 1e-3 * float(np.max(each, initial=0.0)) or 1.0)


def _parabola(low: float, high: float, slope: float = 0.0, traction: float = 0.0) -> list[float]:
    """An arc about zero."""
    return [low, high, 0.0, 0.0, traction, slope]
