"""Newton's method for convex programmes with laws of lengths, in the frames of the vectors.

Each step solves exactly a convex programme with laws of one component each (:mod:`.length_frames`). It lowers the
energy, unless the point is the minimiser.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ..typing import Array, Mask
from .arcs import ArcTable
from .convex_programme import minimise, never
from .length_programme import LengthProgramme
from .lengths import Frames, left_out, parts, unknowns_of


@dataclass(frozen=True, kw_only=True)
class Tangent:
    """What laws and forces do at a point.

    Attributes:
        frames: along the vectors.
        out: components that do not count, (m, 3).
        held: whether a vector is held at zero, (m,).
        moving: whether its length is positive, (m,).
        ends: of each component, (m, 3) each.
        start: traction at zero, (m,).
        across: stiffness across the vector, (m,).
    """

    frames: Frames
    out: Mask
    held: Mask
    moving: Mask
    ends: tuple[Array, Array]
    start: Array
    across: Array


class LengthNewton:
    """The method for one programme.

    Args:
        programme: the programme.
        cut: whether to end with the point that is there, since the search stops.
    """

    def __init__(self, programme: LengthProgramme, cut: Callable[[], bool] = never) -> None:
        self._programme, self._lengths, self._limits = programme, programme.lengths, programme.thresholds
        self._cut = cut
        self._a, self._b = programme.a, programme.b

    def minimiser(self, start: Array) -> Array:
        """A point at which no step lowers the objective.

        Args:
            start: where to begin, (n,).
        """
        x = self._programme.admissible(start)
        value = self._programme.value(x)
        for _ in range(self._limits.most_steps):
            found = self._better(x, value, near_zero=True) or self._better(x, value, near_zero=False)
            if found is None:
                break
            x, value, last = found
            if last or self._cut():
                break
        return x

    def multipliers(self, x: Array) -> Array:
        """Forces of the bounds of the vectors' unknowns at a minimiser, (n,).

        Args:
            x: the minimiser, (n,).
        """
        lengths = self._lengths
        here, vectors = self._tangent(x, near_zero=False), lengths.vectors(x)
        pull = np.where(here.out, 0.0, vectors) * np.where(here.moving, here.across, 0.0)[:, None]
        pull[:, 0] += np.where(lengths.opens, self._programme.shut * np.minimum(vectors[:, 0], 0.0), 0.0)
        laws = np.zeros(len(x))
        laws[lengths.members] = (pull * lengths.factors)[lengths.there]
        return self._programme.bound_forces(x, laws)

    def _better(self, x: Array, value: float, *, near_zero: bool) -> tuple[Array, float, bool] | None:
        """A point of lower energy, its energy, and whether it is the last.

        A step that is short, or changes the energy by rounding only, is taken whole as the last one: the bound is off
        by the forces it leaves times the lengths that are allowed, which are not small.
        """
        goal = self._step(x, self._tangent(x, near_zero=near_zero))
        whole = self._programme.admissible(goal)
        if self._short(goal - x, x):
            return whole, value, True
        least = self._limits.settled * (abs(value) + float(np.abs(self._b) @ np.abs(x)))
        for share in self._limits.step_shares:
            trial = self._programme.admissible(x + share * (goal - x))
            after = self._programme.value(trial)
            if after < value - least:
                return trial, after, self._short(trial - x, x)
        return (whole, value, True) if self._programme.value(whole) <= value + least else None

    def _short(self, step: Array, x: Array) -> bool:
        pull = float(np.abs(self._a @ step).max())
        short = self._limits.short
        return bool(np.abs(step).max() <= short * np.abs(x).max() and pull <= short * float(np.abs(self._b).max()))

    def _tangent(self, x: Array, *, near_zero: bool) -> Tangent:
        """Frames and curvatures at a point; vectors that forces would hold at zero may be held there already."""
        lengths, n = self._lengths, len(self._b)
        along = lengths.along(self._b - self._a @ x)
        out = left_out(lengths, x, along, (self._programme.lower, self._programme.upper))
        z, g = np.where(out, 0.0, lengths.vectors(x)), np.where(out, 0.0, along)
        size, start = np.linalg.norm(z, axis=1), self._programme.stack.after[n:, 0]
        step = z + g / self._stiffness[:, None] if near_zero else g / self._stiffness[:, None]
        held = (start > 0.0) & (np.linalg.norm(step, axis=1) <= start / self._stiffness) & ((size == 0.0) | near_zero)
        way = np.where((size > 0.0)[:, None], z, g)
        frames = Frames.along(lengths, way)
        traction = self._traction(size, np.divide((z * g).sum(axis=1), size, out=np.zeros_like(size), where=size > 0.0))
        across = np.divide(traction, size, out=self._programme.stack.slopes[n:, 0].copy(), where=size > 0.0)
        return Tangent(
            frames=frames,
            out=out,
            held=held,
            moving=size > 0.0,
            ends=self._ends(lengths.vectors(x)),
            start=start,
            across=across,
        )

    def _traction(self, size: Array, force: Array) -> Array:
        """The tractions of the laws at lengths, nearest to forces at joints, (m,)."""
        stack, n, near = self._programme.stack, len(self._b), self._limits.close * self._programme.radius
        low = np.zeros(n + len(size))
        below, above = np.maximum(size - near, 0.0), np.minimum(size + near, self._programme.radius)
        least, _ = stack.interval(np.concatenate([low[:n], below]))
        _, most = stack.interval(np.concatenate([low[:n], above]))
        return np.clip(force, np.maximum(least[n:], 0.0), np.maximum(most[n:], 0.0))

    def _step(self, x: Array, here: Tangent) -> Array:
        """The solution of the programme in the frames, as unknowns."""
        frames, lengths = here.frames, self._lengths
        chains = ArcTable.of(self._local(here))
        matrix, force = frames.matrix(self._a), frames.forces(self._b)
        found = minimise(matrix, force, chains, frames.into(x), self._limits, self._cut)
        y = parts(lengths, found.x)
        vectors = frames.turned(y)
        rows = np.arange(len(y))
        ahead = np.abs(y[rows, frames.axis])
        joints = self._programme.stack.ends[len(x) :]
        at_joint = np.any(joints == ahead[:, None], axis=1) & ~np.any(here.out, axis=1) & here.moving
        size = np.linalg.norm(vectors, axis=1)
        share = np.divide(ahead, size, out=np.ones_like(size), where=at_joint & (size > 0.0))
        return unknowns_of(lengths, found.x, vectors * share[:, None])

    def _local(self, here: Tangent) -> list[Array]:
        """The laws in the frames, one of each component."""
        result = list(self._programme.chains[: len(self._b)])
        for v, k in zip(*np.nonzero(self._lengths.there), strict=True):
            result[self._lengths.unknowns[v, k]] = self._component(here, int(v), int(k))
        return result

    def _component(self, here: Tangent, v: int, k: int) -> Array:
        low, high = float(here.ends[0][v, k]), float(here.ends[1][v, k])
        if here.out[v, k]:
            return self._left_out(here, v, k)
        if here.held[v]:
            return _parabola(0.0, 0.0)
        if k == here.frames.axis[v]:
            return self._mirrored[v]
        if not here.moving[v] and here.start[v] > 0.0:
            return _parabola(0.0, 0.0)
        kept = here.frames.turns[v, k, k] == 1.0
        far = 2.0 * float(self._programme.radius[v])
        return _parabola(low if kept else -far, high if kept else far, float(here.across[v]))

    def _left_out(self, here: Tangent, v: int, k: int) -> Array:
        """The law of a component that does not count at the point: behind zero it does."""
        low, high = float(here.ends[0][v, k]), float(here.ends[1][v, k])
        start = 0.0 if here.moving[v] else float(here.start[v])
        across = float(here.across[v])
        opens = bool(self._lengths.opens[v]) and k == 0
        shut = float(self._programme.shut[v]) if opens else across
        below = [_parabola(low, 0.0, shut, 0.0 if opens else -start)] if low < 0.0 else []
        above = [_parabola(0.0, high, across, start)] if high > 0.0 else []
        return np.concatenate([*below, *above] or [_parabola(0.0, 0.0)])

    @cached_property
    def _mirrored(self) -> list[Array]:
        return [np.concatenate([_negative(c), c]) for c in self._programme.chains[len(self._b) :]]

    def _ends(self, vectors: Array) -> tuple[Array, Array]:
        """Bounds of the vectors' components, far from a point where there are none, (m, 3) each."""
        lengths = self._lengths
        far = (2.0 * self._programme.radius + 10.0 * np.abs(vectors).max(axis=1))[:, None]
        bounds = np.stack([b[lengths.unknowns] for b in (self._programme.lower, self._programme.upper)])
        ends = np.sort(np.multiply(lengths.factors, bounds, out=np.zeros_like(bounds), where=lengths.there), axis=0)
        return np.maximum(ends[0], -far), np.minimum(ends[1], far)

    @cached_property
    def _stiffness(self) -> Array:
        """A stiffness of each vector, (m,)."""
        own = np.diag(self._a)[self._lengths.unknowns]
        each = np.divide(own, self._lengths.factors**2, out=np.zeros_like(own), where=self._lengths.there)
        return np.maximum(each.max(axis=1), 1e-3 * float(np.max(each, initial=0.0)) or 1.0)


def _parabola(low: float, high: float, slope: float = 0.0, traction: float = 0.0) -> Array:
    """A chain of one arc."""
    return np.array([[low, high, 0.0, 0.0, traction, slope]])


def _negative(chain: Array) -> Array:
    """A chain on a line that is turned round."""
    low, high, anchor, value, traction, slope = chain[::-1].T
    return np.column_stack([-high, -low, -anchor, value, -traction, slope])
