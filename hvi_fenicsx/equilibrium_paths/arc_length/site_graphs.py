"""The graphs of all sites as chains of segments, where each site is on its own, and what their laws remember.

A site is an unknown with its laws and bounds, or the two unknowns of a law on |u_t|. Its graph of force over
displacement is one continuous line, vertical where a law jumps and at a bound (:mod:`..segments`); s runs along it,
nondimensional. The coordinate of a site of two unknowns is a vector z of length s: displacement and force have its
direction. So sticking, sliding, a drop at a fixed length and what is remembered all have smooth equations.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ...system.condensed_problem import CondensedProblem
from ...typing import Array, Integers
from ..graphs import Passed
from ..segments import Component, Kind, Segment, chain
from .chains import fresh, from_zero, refuse_shared
from .deviations import Deviations
from .vertex_laws import VertexLaw, shares


@dataclass(frozen=True, kw_only=True)
class Kept:
    """Where sites were.

    Attributes:
        numbers: of their segments, (m,).
        chains: their segments.
        bases: where s was at the coordinate 0 of each.
        passed: what their laws remembered.
    """

    numbers: Integers
    chains: list[tuple[Segment, ...]]
    bases: list[Array]
    passed: list[Passed | None]


class SiteGraphs:
    """All sites, each on one segment of its graph.

    Args:
        problem: the problem.
        laws: at its vertices.

    Attributes:
        one: the unknowns of sites of one unknown, which come first, (m1,).
        two: the unknowns of the others, (p, 2).
        numbers: of the segments on which the sites are, (m,).
        low: least s, (m,).
        high: greatest s, (m,).
        outward: where bonds with memory go on, 1 or -1; else 0, (m,).
        length: the unit of displacements.
        forces: the units of forces by unknown, (n,).
        stiffness: S, or another one while a body moves, (n, n).

    Raises:
        InputError: a law on |u_t| shares an unknown with another law or a bound.
    """

    def __init__(self, problem: CondensedProblem, laws: Sequence[VertexLaw]) -> None:
        self._problem, self.stiffness = problem, problem.stiffness
        radial = sorted({law.unknowns for law in laws if len(law.unknowns) == 2})
        self.two = np.array(radial, dtype=np.int64).reshape(-1, 2)
        self.one = np.setdiff1d(np.arange(problem.size), self.two)
        keys = [(int(i),) for i in self.one] + radial
        self.laws = [[law for law in laws if law.unknowns == key] for key in keys]
        refuse_shared(problem, self.two, laws)
        self.length, self.forces = self._units(laws)
        self._force_units = np.concatenate([self.forces[self.one], self.forces[self.two[:, 0]]])
        self._deviations = Deviations(self.laws)
        m = len(keys)
        self.numbers = np.zeros(m, dtype=np.int64)
        self.low, self.high, self.outward = np.zeros(m), np.zeros(m), np.zeros(m)
        self._base, self._x, self._force = np.zeros(m), np.zeros(m), np.zeros(m)
        self._moves, self._rises, self._bent = np.zeros(m), np.zeros(m), np.zeros(m, dtype=bool)
        self._chains: list[tuple[Segment, ...]] = [()] * m
        self._bases: list[Array] = [np.zeros(0)] * m
        for k in range(m):
            self.rebuild(k)

    def __len__(self) -> int:
        return len(self.numbers)

    def unknowns(self) -> list[Integers]:
        """The unknowns of each site."""
        return [*self.one.reshape(-1, 1), *self.two]

    def _units(self, laws: Sequence[VertexLaw]) -> tuple[float, Array]:
        problem = self._problem
        diagonal = np.diag(problem.stiffness).copy()
        diagonal[diagonal <= 0.0] = np.max(diagonal, initial=0.0) or 1.0
        lengths = {law.group: law.law.length_scale for law in laws}.values()
        bounds = np.abs(np.concatenate([problem.lower, problem.upper]))
        elastic = np.max(np.abs(problem.force_rate) / diagonal, initial=0.0)
        length = max(lengths, default=max(elastic, float(np.max(bounds[np.isfinite(bounds)], initial=0.0))) or 1.0)
        for pair in self.two:
            diagonal[pair] = diagonal[pair].mean()
        return float(length), diagonal * float(length)

    # -- graphs

    def rebuild(self, k: int) -> None:
        """Make the segments of a site with what its laws remember now.

        Args:
            k: the site.
        """
        self._chains[k] = self._made(k)
        self._bases[k] = self._based(k)

    def _made(self, k: int) -> tuple[Segment, ...]:
        laws, problem = self.laws[k], self._problem
        parts = [
            Component(
                graph=law.graph(), weight=law.weight, passed=None if law.passed is None else law.passed.displacements
            )
            for law in laws
        ]
        if k >= len(self.one):
            return from_zero(chain(parts, 0.0, np.inf), laws)
        i = int(self.one[k])
        found = chain(parts, float(problem.lower[i]), float(problem.upper[i]))
        return tuple(fresh(s, laws) for s in found)

    def _based(self, k: int) -> Array:
        """Where s is at the coordinate 0 of each segment."""
        found, at = np.zeros(len(self._chains[k])), 0.0
        for number, segment in enumerate(self._chains[k]):
            unit = self.unit(k, segment)
            if np.isfinite(segment.low):
                found[number] = at - segment.low / unit
                at += (segment.high - segment.low) / unit
            else:
                found[number] = -segment.high / unit if np.isfinite(segment.high) else 0.0
        return found

    def unit(self, k: int, segment: Segment) -> float:
        """The unit of a segment's own coordinate.

        Args:
            k: the site.
            segment: one of its segments.
        """
        return float(self._force_units[k]) if segment.rise else self.length

    def segment(self, k: int) -> Segment:
        """Where a site is."""
        return self._chains[k][self.numbers[k]]

    def chain(self, k: int) -> tuple[Segment, ...]:
        """The segments of a site."""
        return self._chains[k]

    def enter(self, k: int, number: int) -> None:
        """Put a site on a segment.

        Args:
            k: the site.
            number: of the segment.
        """
        segment, base = self._chains[k][number], float(self._bases[k][number])
        unit = self.unit(k, segment)
        self.numbers[k], self._base[k] = number, base
        self.low[k], self.high[k], self.outward[k] = base + segment.low / unit, base + segment.high / unit, 0
        if k >= len(self.one) and number == 0:
            self.low[k] = -np.inf  # a length passes through 0
        self._x[k], self._force[k] = segment.x, segment.force
        self._moves[k] = 0.0 if segment.rise else unit
        self._rises[k] = (segment.rise or segment.slope) * unit
        self.outward[k] = segment.outward
        bent = self._deviations.enter(k, segment)
        self._bent[k] = bent or (k >= len(self.one) and not self._proportional(k))

    def _proportional(self, k: int) -> bool:
        """Whether displacement and force are multiples of s on the present segment."""
        x = (self._x[k] - self._moves[k] * self._base[k]) / self.length
        force = (self._force[k] - self._rises[k] * self._base[k]) / self._force_units[k]
        return bool(abs(x) + abs(force) <= 1e-12)

    def coordinate(self, k: int, x: float, force: float) -> float:
        """The s of a displacement and its force on the present segment.

        Args:
            k: the site.
            x: along the site's direction.
            force: likewise.
        """
        segment = self.segment(k)
        return float(self._base[k] + segment.coordinate(x, force) / self.unit(k, segment))

    def set(self, z: Array, k: int, s: float) -> None:
        """Change the coordinates of a site to another s in the same direction.

        Args:
            z: all coordinates, changed, (n,) or more.
            k: the site.
            s: the new one.
        """
        m1 = len(self.one)
        if k < m1:
            z[self.one[k]] = s
        else:
            z[self.two[k - m1]] = s * self.directions(z)[k - m1]

    def s(self, z: Array) -> Array:
        """The coordinates along the graphs, (m,)."""
        return np.concatenate([z[self.one], np.hypot(*z[self.two].T)])

    def directions(self, z: Array) -> Array:
        """Unit vectors of the sites of two unknowns, (p, 2)."""
        vectors = z[self.two]
        lengths = np.hypot(*vectors.T)
        found = np.tile([1.0, 0.0], (len(vectors), 1))
        some = lengths > 0.0
        found[some] = vectors[some] / lengths[some, None]
        return found

    def rates(self, z: Array, direction: Array) -> Array:
        """How s changes along a direction of the coordinates, (m,); a length of 0 grows in each of them.

        Args:
            z: the coordinates, (n,).
            direction: of them, (n,).
        """
        vectors = direction[self.two]
        radial = np.einsum("pk,pk->p", self.directions(z), vectors)
        radial = np.where(np.any(z[self.two] != 0.0, axis=1), radial, np.hypot(*vectors.T))
        return np.concatenate([direction[self.one], radial])

    def on_drops(self) -> list[int]:
        """The sites where a law drops."""
        return [k for k in range(len(self)) if self.segment(k).rise < 0.0 and self.segment(k).kind is Kind.JUMP]

    # -- memory

    def kept(self) -> Kept:
        """Where all sites are and what their laws remember, for :meth:`restore`."""
        passed = [law.passed for several in self.laws for law in several]
        return Kept(numbers=self.numbers.copy(), chains=list(self._chains), bases=list(self._bases), passed=passed)

    def restore(self, kept: Kept) -> None:
        """Go back to where all sites were.

        Args:
            kept: as :meth:`kept` found it.
        """
        self._chains, self._bases = list(kept.chains), list(kept.bases)
        for law, passed in zip((law for several in self.laws for law in several), kept.passed, strict=True):
            law.passed = passed
        for k, number in enumerate(kept.numbers):
            self.enter(k, int(number))

    def remember(self, k: int, x: float, traction: float) -> None:
        """Let a site's laws note where they have been, and take its segments anew.

        Args:
            k: the site.
            x: along the site's direction.
            traction: the force there.
        """
        for law, share in zip(self.laws[k], self.shares(k, x, traction), strict=True):
            law.remember(x, share)
        self.rebuild(k)

    def shares(self, k: int, x: float, force: float) -> list[float]:
        """The tractions of a site's laws that give a force together.

        Args:
            k: the site.
            x: along the site's direction.
            force: of all its laws.
        """
        return shares(self.laws[k], x, force)
