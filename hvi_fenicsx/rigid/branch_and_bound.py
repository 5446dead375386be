"""Global minima of functionals whose slip integrals may have negative factors: branch and bound over cones of slips.

A law whose growth falls below zero on both sides together makes a slip integral with a negative factor, which is
concave. On a cone with as many edges as dimensions, a concave positively homogeneous function is nowhere below the
linear one with the same values on the edges. So on each cone of slips a convex functional bounds the true one from
below, and :class:`.CuttingPlanes` minimises it. The cone with the lowest bound is divided through the motion that
attains it, until the bound meets the lowest value attained. Slips of one dimension, as on a straight floor, need no
division.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from heapq import heappop, heappush
from itertools import count, product

import numpy as np
from typing_extensions import override

from ..errors import SolverError
from ..typing import Array, magnitude
from .cutting_planes import CuttingPlanes, Functional, Minimum, Polytope, ball, faces, idle
from .motions import DEFAULT


@dataclass(frozen=True)
class ConcavePart:
    """The slip integrals of a functional that have negative factors.

    Attributes:
        functional: the functional.
        programme: its slip integrals.
        basis: orthonormal rows that span their slips, (q, k).
    """

    functional: Functional
    programme: CuttingPlanes
    basis: Array

    @classmethod
    def of(cls, f: Functional, programme: CuttingPlanes) -> ConcavePart:
        """Find the slips of the negative factors.

        Args:
            f: a functional with negative factors.
            programme: its slip integrals.
        """
        k = len(f.linear)
        rows = [
            g.rows.reshape(-1, k)
            for b, g in zip(f.factors, programme.integrals, strict=True)
            if b < 0.0 and g.rows.size
        ]
        _, sizes, right = np.linalg.svd(np.linalg.qr(np.vstack([np.zeros((k, k)), *rows]), mode="r"))
        return cls(f, programme, right[sizes > DEFAULT.rounding * max(sizes[0], 1e-300)])

    def bound(self, edges: Array) -> Functional:
        """The convex functional that is a lower bound on the motions with slips in a cone, and its region.

        Args:
            edges: of the cone, columns (q, q).
        """
        shares = np.linalg.solve(edges, self.basis)
        f, sides = self.functional, -shares / np.linalg.norm(shares, axis=1, keepdims=True)
        concave = replace(f, linear=np.zeros_like(f.linear), factors=np.minimum(f.factors, 0.0))
        values = [self.programme.evaluate(concave, edge @ self.basis) for edge in edges.T]
        return replace(
            f,
            linear=f.linear + np.array(values) @ shares,
            factors=np.maximum(f.factors, 0.0),
            cone=np.vstack([f.cone, sides]),
        )

    def divide(self, edges: Array, y: Array, depth: int) -> Iterator[Array]:
        """The parts of a cone: through the slip of a motion, every third time half and half.

        Args:
            edges: of the cone, columns (q, q).
            y: the motion, (k,).
            depth: how often the cone was divided before.
        """
        slip = self.basis @ y
        shares = np.linalg.solve(edges, slip)
        inner = np.flatnonzero(shares > DEFAULT.dropped * magnitude(shares))
        if depth % 3 == 2 or len(inner) < 2:
            cosines = edges.T @ edges
            inner = np.array(np.unravel_index(np.argmin(cosines), cosines.shape))
            slip = edges[:, inner].sum(axis=1)
        for j in inner:
            part = edges.copy()
            part[:, j] = slip / np.linalg.norm(slip)
            yield part


class GlobalProgramme(CuttingPlanes):
    """Cutting planes for factors of any sign."""

    @override
    def minimise(self, f: Functional, region: Polytope, give_up: float = np.inf) -> Minimum | None:
        """Minimum of f over region and cone; None if that is empty or nothing in it is small enough.

        Args:
            f: the functional, with its cone.
            region: where to search.
            give_up: values above this are of no interest.

        Raises:
            SolverError: the gap between value and bound does not close.
        """
        if not np.any(f.factors < 0.0):
            return super().minimise(f, region, give_up)
        part = ConcavePart.of(f, self)
        if not len(part.basis):  # no motion slips where the growth is negative
            return super().minimise(replace(f, factors=np.maximum(f.factors, 0.0)), region, give_up)
        return self._search(part, region, give_up)

    def sphere(self, f: Functional, across: Array, aim: float) -> Minimum | None:
        """Minimum of f over the cone and |y| = 1, one search for each face; None if there is no such y.

        Args:
            f: the functional, with its cone.
            across: motions (q, k) to which y is to be orthogonal.
            aim: a value of at most this will do.

        Raises:
            SolverError: the gap between value and bound does not close.
        """
        best: Minimum | None = None
        for face in faces(self.frame, across):
            found = self.minimise(f, face, np.inf if best is None else best.value)
            best = found if best is None or (found is not None and found.value < best.value) else best
            if best is not None and best.value <= aim:
                break
        return best

    def ratio(self, f: Functional, load: Array, least: float) -> tuple[float, Array | None]:
        """The largest λ with λ load·y <= f(y) on the cone, and the motion that limits it (None if none does).

        (inf, None): no λ is too large; (-inf, y): none is small enough, for y forbids it. Dinkelbach's iteration: λ
        only falls, each motion below the current plane lowers it; so the minima stay bounded, and they share cuts.

        Args:
            f: the functional, with its cone.
            load: its work on the basis motions, (k,).
            least: works of at most this size for a unit motion count as none.

        Raises:
            SolverError: the gap between value and bound does not close.
        """
        start = super().minimise(replace(f, linear=-load, factors=0.0 * f.factors), ball(self.frame))
        if start is None or -start.value <= least:  # it only ever holds, unless a motion it does no work on escapes
            idling = self.minimise(f, idle(self.frame, load))
            return (np.inf, None) if idling is None or idling.value >= -least else (-np.inf, idling.y)
        factor, y = self.evaluate(f, start.y) / -start.value, start.y
        for _ in range(DEFAULT.max_rounds):
            found = self.minimise(f.minus(load, factor), ball(self.frame))
            if found is None or found.value >= 0.0:
                return factor, y
            work = float(load @ found.y)
            if work <= least:
                return (factor, y) if found.value >= -DEFAULT.rounding * self.scale else (-np.inf, found.y)
            lower = self.evaluate(f, found.y) / work
            if lower >= factor:
                return factor, y
            factor, y = lower, found.y
        raise SolverError(f"rigid motions: no load factor after {DEFAULT.max_rounds} minima")

    def _search(self, part: ConcavePart, region: Polytope, give_up: float) -> Minimum | None:
        numbers, depth = count(), 0
        best = Minimum(give_up, np.empty(0), -np.inf)
        waiting: list[tuple[float, int, Array, Array, int]] = []
        # the first cones cover all slips; the edges of each are columns (q, q)
        cones: Iterator[Array] = (np.diag(signs) for signs in product((1.0, -1.0), repeat=len(part.basis)))
        for _ in range(DEFAULT.max_rounds):
            for edges in cones:
                found = super().minimise(part.bound(edges), region, best.value)
                if found is not None:
                    value = self.evaluate(part.functional, found.y)
                    best = Minimum(value, found.y, found.lower) if value < best.value else best
                    heappush(waiting, (found.lower, next(numbers), edges, found.y, depth))
            gap = best.value - waiting[0][0] if waiting else 0.0
            if gap <= DEFAULT.rounding * self.scale:
                return replace(best, lower=best.value - gap) if best.y.size else None
            _, _, edges, y, depth = heappop(waiting)
            cones, depth = part.divide(edges, y, depth), depth + 1
        raise SolverError(f"rigid motions: {DEFAULT.max_rounds} cones left a gap in a growth that is not convex")
