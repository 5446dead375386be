"""The graphs of all sites as chains of segments, where each site is on its own, and what their laws remember.

A site is an unknown with its laws and bounds, or the unknowns of a law on a length (:mod:`.radials`). Its graph of
force over displacement is one continuous line, vertical where a law jumps and at a bound (:mod:`..segments`); s runs
along it, nondimensional. The coordinate of a site of a length is a vector z of length s: displacement and force have
its direction. So sticking, sliding, a drop at a fixed length and what is remembered all have smooth equations. An
opening has a site of its own beside, without a law: what it does where it is not positive.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ...reduced.condensed_problem import CondensedProblem
from ...typing import Array, Integers
from ..graphs import Passed
from ..segments import Component, Kind, Segment, chain
from ..thresholds import DEFAULT, Thresholds
from .chains import beside_opening, fresh, from_zero
from .deviations import Deviations
from .site_laws import SiteLaws
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


class SiteGraphs(SiteLaws):
    """All sites, each on one segment of its graph.

    Args:
        problem: the problem.
        laws: at its vertices.
        thresholds: of the path.

    Attributes:
        numbers: of the segments on which the sites are, (m,).
        low: least s, (m,).
        high: greatest s, (m,).
        outward: where bonds with memory go on, 1 or -1; else 0, (m,).
        stiffness: S, or another one while a body moves, (n, n).
        rigid: the displacements that S does not resist, as orthonormal rows, (k, n).

    Raises:
        InputError: a law on a length shares an unknown with another law or a bound.
    """

    def __init__(self, problem: CondensedProblem, laws: Sequence[VertexLaw], thresholds: Thresholds = DEFAULT) -> None:
        super().__init__(problem, laws, thresholds)
        self.stiffness, self.rigid = problem.stiffness, problem.elastic.rigid
        self._deviations = Deviations(self.laws, thresholds.curve)
        m = len(self.laws)
        self.numbers = np.zeros(m, dtype=np.int64)
        self.low, self.high, self.outward = np.zeros(m), np.zeros(m), np.zeros(m)
        self._base, self._x, self._force = np.zeros(m), np.zeros(m), np.zeros(m)
        self._moves, self._rises = np.zeros(m), np.zeros(m)
        self._bound, self._curved, self._bent = (np.zeros(m, dtype=bool) for _ in range(3))
        self._chains: list[tuple[Segment, ...]] = [()] * m
        self._bases: list[Array] = [np.zeros(0)] * m
        for k in range(m):
            self.rebuild(k)

    # -- graphs

    def rebuild(self, k: int) -> None:
        """Make the segments of a site with what its laws remember now.

        Args:
            k: the site.
        """
        self._chains[k] = self._made(k)
        self._bases[k] = self._based(k)

    def _made(self, k: int) -> tuple[Segment, ...]:
        laws, problem, opening = self.laws[k], self._problem, self.opening(k)
        if opening is not None:
            return beside_opening(float(problem.lower[self.radials.opening_unknowns[opening]]))
        parts = [
            Component(
                graph=law.graph(),
                weight=law.weight,
                passed=None if law.passed is None else law.passed.displacements,
                curved=law.curved,
            )
            for law in laws
        ]
        if self.radial(k) is not None:
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
        return found if self.opening(k) is None else found - found[-1]

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
        if self.radial(k) is not None and number == 0:
            self.low[k] = -np.inf  # a length passes through 0
        self._x[k], self._force[k] = segment.x, segment.force
        self._moves[k] = 0.0 if segment.rise else unit
        self._rises[k] = (segment.rise or segment.slope) * unit
        self._bound[k] = segment.kind is Kind.BOUND
        self.outward[k] = segment.outward
        self._curved[k] = self._deviations.enter(k, segment)
        self._bent[k] = self._curved[k] or self._turns(k)
        self._count(k, counts=number == len(self._chains[k]) - 1)

    def _count(self, k: int, *, counts: bool) -> None:
        """Let the opening that a site is count in its length, or not."""
        opening = self.opening(k)
        if opening is None:
            return
        self.radials.counts[self.radials.openings[opening]] = counts
        of = len(self.one) + int(self.radials.owner[self.radials.openings[opening]])
        self._bent[of] = self._curved[of] or self._turns(of)

    def _turns(self, k: int) -> bool:
        """Whether a site's vector may turn without its force being a multiple of it."""
        p = self.radial(k)
        if p is None or self.radials.counted(p) <= 1:
            return False
        return any(law.mixity is not None for law in self.laws[k]) or not self._proportional(k)

    def _proportional(self, k: int) -> bool:
        """Whether displacement and force are multiples of s on the present segment."""
        x = (self._x[k] - self._moves[k] * self._base[k]) / self.length
        force = (self._force[k] - self._rises[k] * self._base[k]) / self._force_units[k]
        return bool(abs(x) + abs(force) <= 1e-12)

    def enter_next(self, k: int, *, forward: bool) -> None:
        """Put a site on the segment next to its own.

        Args:
            k: the site.
            forward: whether on the one that comes after its own.
        """
        self.enter(k, int(self.numbers[k]) + (1 if forward else -1))

    def leave(self, z: Array, k: int, *, forward: bool) -> None:
        """Put a site on the segment next to its own, at the end at which they meet.

        Args:
            z: all coordinates, changed, (n,).
            k: the site.
            forward: whether on the one that comes after its own.
        """
        end = float(self.high[k] if forward else self.low[k])
        self.enter_next(k, forward=forward)
        self.set(z, k, end)

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
        p = self.radial(k)
        if p is None:
            z[self.unknowns_of(k)] = s
        else:
            here = self.radials.owner == p
            group = self.radials.groups[p]
            z[group] = np.where(self.radials.counts[here], s * self.directions(z)[here], z[group])

    def polar(self, z: Array) -> tuple[Array, Array]:
        """The coordinates along the graphs, (m,), and the unit vectors of the sites of lengths, (N,).

        Args:
            z: the coordinates, (n,).
        """
        lengths, directions = self.radials.polar(z)
        return np.concatenate([z[self.one], lengths, z[self.radials.opening_unknowns]]), directions

    def s(self, z: Array) -> Array:
        """The coordinates along the graphs, (m,)."""
        return self.polar(z)[0]

    def directions(self, z: Array) -> Array:
        """Unit vectors of the sites of lengths, (N,)."""
        return self.radials.directions(z)

    def rates(self, z: Array, direction: Array) -> Array:
        """How s changes along a direction of the coordinates, (m,); a length of 0, but for rounding, grows in each.

        Args:
            z: the coordinates, (n,).
            direction: of them, (n,).
        """
        radials = self.radials
        lengths, directions = radials.polar(z)
        moved = lengths > self.thresholds.curve.no_length
        along = np.where(moved, radials.along(directions, direction), radials.lengths(direction))
        return np.concatenate([direction[self.one], along, direction[radials.opening_unknowns]])

    def on_drops(self) -> list[int]:
        """The sites where a law drops."""
        return [int(k) for k in np.flatnonzero((self._moves == 0.0) & (self._rises < 0.0) & ~self._bound)]

    # -- memory

    @property
    def memory(self) -> Array | None:
        """What the laws at all vertices remember, (v, 4), as :meth:`.VertexLaw.memory`; None where none does."""
        if all(law.passed is None for law in self.vertices):
            return None
        return np.array([law.memory() for law in self.vertices])

    def put(self, numbers: Integers, memory: Array | None) -> None:
        """Put all sites where they were at a state of a path.

        Args:
            numbers: of their segments, (m,).
            memory: as :attr:`memory` was.
        """
        if memory is not None:
            for row, law in enumerate(self.vertices):
                law.restore(memory[row, :])
        for k, number in enumerate(numbers):
            self.rebuild(k)
            self.enter(k, int(number))

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
