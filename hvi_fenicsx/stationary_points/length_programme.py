"""Convex programmes with laws of lengths: Newton's method in the frames of the vectors.

Each step solves exactly a convex programme with laws of one component each (:mod:`length_frames`). It lowers the
energy, unless the point is the minimiser.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ..laws.arc import Arc
from ..typing import Array, Mask
from .convex_programme import Chains, minimise
from .length_frames import Frames, left_out, parts, unknowns_of
from .lengths import Lengths
from .scalar_problem import ScalarProblem
from .thresholds import ProgrammeThresholds


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


@dataclass(frozen=True, kw_only=True)
class LengthProgramme:
    """Minimise ½ xᵀAx - bᵀx + Σ ψᵢ + Σ ½ d ⟨-opening⟩², ψ being convex; those of lengths do not fall.

    Attributes:
        a: A (n, n), symmetric, positive semidefinite.
        b: (n,).
        chains: ψ, n of the unknowns and m of the lengths, these from zero on.
        lengths: of the vectors.
        lower: bounds of the vectors' unknowns, (n,).
        upper: bounds of them, (n,).
        shut: d, (m,).
        thresholds: how many steps, and what is rounding.
    """

    a: Array
    b: Array
    chains: Sequence[Sequence[Arc]]
    lengths: Lengths
    lower: Array
    upper: Array
    shut: Array
    thresholds: ProgrammeThresholds

    @classmethod
    def of(
        cls, problem: ScalarProblem, a: Array, b: Array, chains: Sequence[Sequence[Arc]], shut: Array
    ) -> LengthProgramme:
        """A programme on the vectors and bounds of a problem.

        Args:
            problem: the problem.
            a: A.
            b: b.
            chains: ψ.
            shut: d.
        """
        return cls(
            a=a,
            b=b,
            chains=chains,
            lengths=problem.lengths,
            lower=problem.lower,
            upper=problem.upper,
            shut=shut,
            thresholds=problem.thresholds.programmes,
        )

    @cached_property
    def _stack(self) -> Chains:
        return Chains.of(self.chains)

    @cached_property
    def _mirrored(self) -> list[list[Arc]]:
        return [[*(_negative(a) for a in reversed(c)), *c] for c in self.chains[len(self.b) :]]

    @cached_property
    def _radius(self) -> Array:
        return self._stack.high[len(self.b) :]

    def _ends(self, vectors: Array) -> tuple[Array, Array]:
        """Bounds of the vectors' components, far from a point where there are none, (m, 3) each."""
        lengths = self.lengths
        far = (2.0 * self._radius + 10.0 * np.abs(vectors).max(axis=1))[:, None]
        bounds = np.stack([b[lengths.unknowns] for b in (self.lower, self.upper)])
        ends = np.sort(np.multiply(lengths.factors, bounds, out=np.zeros_like(bounds), where=lengths.there), axis=0)
        return np.maximum(ends[0], -far), np.minimum(ends[1], far)

    @cached_property
    def _stiffness(self) -> Array:
        """A stiffness of each vector, (m,)."""
        own = np.diag(self.a)[self.lengths.unknowns]
        each = np.divide(own, self.lengths.factors**2, out=np.zeros_like(own), where=self.lengths.there)
        return np.maximum(each.max(axis=1), 1e-3 * float(np.max(each, initial=0.0)) or 1.0)

    def value(self, x: Array) -> float:
        """The objective.

        Args:
            x: an admissible point, (n,).
        """
        laws = self._stack.energy(np.concatenate([x, self.lengths.of(x)])).sum()
        negative = np.where(self.lengths.opens, np.minimum(self.lengths.vectors(x)[:, 0], 0.0), 0.0)
        return float(0.5 * x @ (self.a @ x) - self.b @ x + laws + 0.5 * self.shut @ negative**2)

    def minimiser(self, start: Array) -> Array:
        """A point at which no step lowers the objective.

        Args:
            start: where to begin, (n,).
        """
        x = self._admissible(start)
        value = self.value(x)
        for _ in range(self.thresholds.newton_steps):
            found = self._better(x, value, near_zero=True) or self._better(x, value, near_zero=False)
            if found is None:
                break
            x, value, last = found
            if last:
                break
        return x

    def multipliers(self, x: Array) -> Array:
        """Forces of the bounds of the vectors' unknowns at a minimiser, (n,).

        Args:
            x: the minimiser, (n,).
        """
        lengths = self.lengths
        here, vectors = self._tangent(x, near_zero=False), lengths.vectors(x)
        pull = np.where(here.out, 0.0, vectors) * np.where(here.moving, here.across, 0.0)[:, None]
        pull[:, 0] += np.where(lengths.opens, self.shut * np.minimum(vectors[:, 0], 0.0), 0.0)
        laws = np.zeros(len(x))
        laws[lengths.members] = (pull * lengths.factors)[lengths.there]
        return self.bound_forces(x, laws)

    def bound_forces(self, x: Array, laws: Array) -> Array:
        """Forces of the bounds that are met, such that the laws' forces are left for the vectors' unknowns, (n,).

        Args:
            x: a point, (n,).
            laws: forces of the laws on the vectors' unknowns, (n,).
        """
        force = self.b - self.a @ x
        wanted = np.where(self._own, force, laws)
        return np.where(x <= self.lower, np.maximum(wanted - force, 0.0), 0.0) + np.where(
            x >= self.upper, np.minimum(wanted - force, 0.0), 0.0
        )

    def borne(self, size: Array) -> tuple[Array, Array]:
        """What the laws bear just before some lengths, and what they hold at zero, (m,) each.

        Args:
            size: the lengths, (m,).
        """
        n = len(self.b)
        low, _ = self._stack.interval(np.concatenate([self._stack.low[:n], np.minimum(size, self._radius)]))
        return np.maximum(low[n:], 0.0), np.maximum(self._stack.after[n:, 0], 0.0)

    def _admissible(self, x: Array) -> Array:
        low, high = self._stack.low[: len(x)], self._stack.high[: len(x)]
        x = np.where(self._own, np.clip(x, low, high), np.clip(x, self.lower, self.upper))
        size = self.lengths.of(x)
        share = np.divide(self._radius, size, out=np.ones_like(size), where=size > self._radius)
        return unknowns_of(self.lengths, x, self.lengths.vectors(x) * share[:, None])

    @cached_property
    def _own(self) -> Mask:
        """Which unknowns are in no vector, (n,)."""
        own = np.ones(len(self.b), dtype=np.bool_)
        own[self.lengths.members] = False
        return own

    def _better(self, x: Array, value: float, *, near_zero: bool) -> tuple[Array, float, bool] | None:
        """A point of lower energy, its energy, and whether it is the last.

        A step that is short, or changes the energy by rounding only, is taken whole as the last one: the bound is off
        by the forces it leaves times the lengths that are allowed, which are not small.
        """
        goal = self._step(x, self._tangent(x, near_zero=near_zero))
        whole = self._admissible(goal)
        if self._short(goal - x, x):
            return whole, value, True
        least = self.thresholds.settled * (abs(value) + float(np.abs(self.b) @ np.abs(x)))
        for share in self.thresholds.step_shares:
            trial = self._admissible(x + share * (goal - x))
            after = self.value(trial)
            if after < value - least:
                return trial, after, self._short(trial - x, x)
        return (whole, value, True) if self.value(whole) <= value + least else None

    def _short(self, step: Array, x: Array) -> bool:
        pull = float(np.abs(self.a @ step).max())
        short = self.thresholds.short
        return bool(np.abs(step).max() <= short * np.abs(x).max() and pull <= short * float(np.abs(self.b).max()))

    def _tangent(self, x: Array, *, near_zero: bool) -> Tangent:
        """Frames and curvatures at a point; vectors that forces would hold at zero may be held there already."""
        lengths, n = self.lengths, len(self.b)
        along = lengths.along(self.b - self.a @ x)
        out = left_out(lengths, x, along, (self.lower, self.upper))
        z, g = np.where(out, 0.0, lengths.vectors(x)), np.where(out, 0.0, along)
        size, start = np.linalg.norm(z, axis=1), self._stack.after[n:, 0]
        step = z + g / self._stiffness[:, None] if near_zero else g / self._stiffness[:, None]
        held = (start > 0.0) & (np.linalg.norm(step, axis=1) <= start / self._stiffness) & ((size == 0.0) | near_zero)
        way = np.where((size > 0.0)[:, None], z, g)
        frames = Frames.along(lengths, way)
        traction = self._traction(size, np.divide((z * g).sum(axis=1), size, out=np.zeros_like(size), where=size > 0.0))
        across = np.divide(traction, size, out=self._stack.slopes[n:, 0].copy(), where=size > 0.0)
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
        stack, n, near = self._stack, len(self.b), self.thresholds.close * self._radius
        low = np.zeros(n + len(size))
        below, above = np.maximum(size - near, 0.0), np.minimum(size + near, self._radius)
        least, _ = stack.interval(np.concatenate([low[:n], below]))
        _, most = stack.interval(np.concatenate([low[:n], above]))
        return np.clip(force, np.maximum(least[n:], 0.0), np.maximum(most[n:], 0.0))

    def _step(self, x: Array, here: Tangent) -> Array:
        """The solution of the programme in the frames, as unknowns."""
        frames, lengths = here.frames, self.lengths
        chains = Chains.of(self._local(here))
        found = minimise(frames.matrix(self.a), frames.forces(self.b), chains, frames.into(x), self.thresholds)
        y = parts(lengths, found.x)
        vectors = frames.turned(y)
        rows = np.arange(len(y))
        ahead = np.abs(y[rows, frames.axis])
        at_joint = (
            np.any(self._stack.ends[len(x) :] == ahead[:, None], axis=1) & ~np.any(here.out, axis=1) & here.moving
        )
        size = np.linalg.norm(vectors, axis=1)
        share = np.divide(ahead, size, out=np.ones_like(size), where=at_joint & (size > 0.0))
        return unknowns_of(lengths, found.x, vectors * share[:, None])

    def _local(self, here: Tangent) -> list[Sequence[Arc]]:
        """The laws in the frames, one of each component."""
        result: list[Sequence[Arc]] = list(self.chains[: len(self.b)])
        for v, k in zip(*np.nonzero(self.lengths.there), strict=True):
            result[self.lengths.unknowns[v, k]] = self._component(here, int(v), int(k))
        return result

    def _component(self, here: Tangent, v: int, k: int) -> Sequence[Arc]:
        low, high = float(here.ends[0][v, k]), float(here.ends[1][v, k])
        if here.out[v, k]:
            return self._left_out(here, v, k)
        if here.held[v]:
            return [_parabola(0.0, 0.0)]
        if k == here.frames.axis[v]:
            return self._mirrored[v]
        if not here.moving[v] and here.start[v] > 0.0:
            return [_parabola(0.0, 0.0)]
        kept = here.frames.turns[v, k, k] == 1.0
        far = 2.0 * float(self._radius[v])
        return [_parabola(low if kept else -far, high if kept else far, float(here.across[v]))]

    def _left_out(self, here: Tangent, v: int, k: int) -> Sequence[Arc]:
        """The law of a component that does not count at the point: behind zero it does."""
        low, high = float(here.ends[0][v, k]), float(here.ends[1][v, k])
        start = 0.0 if here.moving[v] else float(here.start[v])
        across = float(here.across[v])
        shut = float(self.shut[v]) if self.lengths.opens[v] and k == 0 else across
        below = [_parabola(low, 0.0, shut, 0.0 if self.lengths.opens[v] and k == 0 else -start)] if low < 0.0 else []
        above = [_parabola(0.0, high, across, start)] if high > 0.0 else []
        return [*below, *above] or [_parabola(0.0, 0.0)]


def _parabola(low: float, high: float, slope: float = 0.0, traction: float = 0.0) -> Arc:
    return Arc(low, high, 0.0, 0.0, traction, slope)


def _negative(arc: Arc) -> Arc:
    return Arc(-arc.high, -arc.low, -arc.anchor, arc.value, -arc.traction, arc.slope)
