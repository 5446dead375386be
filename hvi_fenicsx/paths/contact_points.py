"""Which unknowns and laws each point has."""

from __future__ import annotations

from collections.abc import Collection, Sequence

import numpy as np
from scipy.sparse import csr_array

from ..reduced.condensed_problem import CondensedProblem
from ..typing import Array, Integers
from .lengths import VectorPoints
from .segments import refuse_shared
from .thresholds import DEFAULT, ROUNDING, FollowingThresholds
from .vertex_laws import VertexLaw, is_straight, vertex_laws


class PointLaws:
    """The unknowns and laws of all m points.

    Args:
        problem: the problem.
        remember: numbers of the problem's bonds that remember.
        thresholds: of the path.

    Attributes:
        thresholds: of the path.
        vertices: the laws at all vertices.
        one: the unknowns of points of one unknown, which come first, (m1,).
        vectors: the p points of laws on a length, which come next; then come the points of their openings, (q,).
        laws: of each point; those of openings have none.
        of_lengths: which of the points are those of lengths,
        of_openings: and of openings.
        point_of: the point of each unknown, of an opening that of its length, (n,).
        straight: whether the graphs of all are straight between their ends; coordinates then have units.
        order: of the points, numbers from 0.5 to 1.5 that look like random ones, (m,): the same on any number of ranks.
        places: the number of each point of one unknown, and of each pair of unknowns of a length, in a matrix, (n, n).
        scale: the size of displacements.
        length: the unit of displacements along graphs; 1 where all are straight.
        forces: the units of forces by unknown, (n,).

    Raises:
        InputError: a law on a length shares an unknown with another law or a bound.
    """

    def __init__(
        self, problem: CondensedProblem, remember: Collection[int] = (), thresholds: FollowingThresholds = DEFAULT
    ) -> None:
        laws = vertex_laws(problem, remember)
        self._problem, self.thresholds, self.vertices = problem, thresholds, laws
        kinds = {law.unknowns: (law.bonds.opens, law.bonds.mixity) for law in laws if law.bonds.radial}
        lengths = sorted(kinds)
        self.vectors = VectorPoints(
            lengths, [kinds[group][0] for group in lengths], [kinds[group][1] for group in lengths]
        )
        self.one = np.setdiff1d(np.arange(problem.size), self.vectors.flat)
        by_unknowns: dict[tuple[int, ...], list[VertexLaw]] = {}
        for law in laws:
            by_unknowns.setdefault(law.unknowns, []).append(law)
        keys = [*((int(i),) for i in self.one), *lengths]
        openings = self.vectors.opening_unknowns
        self.laws = [*(by_unknowns.get(key, []) for key in keys), *([] for _ in openings)]
        refuse_shared(problem, self.vectors, laws)
        self.straight = is_straight(problem)
        self.scale, forces = units(problem, laws, self.vectors.groups)
        self.length, self.forces = (1.0, np.ones_like(forces)) if self.straight else (self.scale, forces)
        self._force_units = self.forces[[*(key[0] for key in keys), *openings]]
        m1, last = len(self.one), len(self.one) + len(self.vectors)
        self.of_lengths, self.of_openings = slice(m1, last), slice(last, None)
        self.order = _order(problem, [int(self.unknowns_of(k)[0]) for k in range(len(self))])
        self.point_of = np.empty(problem.size, dtype=np.int64)
        self.point_of[self.one], self.point_of[self.vectors.flat] = np.arange(m1), m1 + self.vectors.owner
        rows, columns = (np.concatenate([self.one, self.vectors.flat[pair]]) for pair in self.vectors.pairs)
        self.places = csr_array((np.arange(len(rows)), (rows, columns)), shape=(problem.size, problem.size))

    def __len__(self) -> int:
        return len(self.laws)

    def unknowns(self) -> list[Integers]:
        """The unknowns of each point."""
        return [self.unknowns_of(k) for k in range(len(self))]

    def unknowns_of(self, k: int) -> Integers:
        """The unknowns of a point."""
        p, opening = self.radial(k), self.opening(k)
        if p is not None:
            return self.vectors.groups[p]
        return self.one[k : k + 1] if opening is None else self.vectors.opening_unknowns[opening : opening + 1]

    def columns(self, k: int) -> Integers:
        """The unknowns whose equations depend on the segment of a point; of an opening, those of its length."""
        opening = self.opening(k)
        return self.unknowns_of(k) if opening is None else self.vectors.groups[self._length_of(opening)]

    def _length_of(self, opening: int) -> int:
        return int(self.vectors.owner[self.vectors.openings[opening]])

    def radial(self, k: int) -> int | None:
        """The number among the points of lengths of a point; None: it is none of these."""
        p = k - len(self.one)
        return p if 0 <= p < len(self.vectors) else None

    def opening(self, k: int) -> int | None:
        """The number among the openings of a point; None: it is none of these."""
        number = k - len(self.one) - len(self.vectors)
        return number if number >= 0 else None

    def laws_at(self, k: int) -> list[VertexLaw]:
        """The laws of a point; of an opening, those of its length."""
        opening = self.opening(k)
        if opening is None:
            return self.laws[k]
        return self.laws[len(self.one) + self._length_of(opening)]


def units(problem: CondensedProblem, laws: Sequence[VertexLaw], groups: Sequence[Integers]) -> tuple[float, Array]:
    """The unit of displacements, and those of forces by unknown, (n,).

    Args:
        problem: the problem.
        laws: at its vertices.
        groups: unknowns that share one unit.
    """
    diagonal = problem.elastic.diagonal.copy()
    largest = float(np.max(diagonal, initial=0.0)) or 1.0
    diagonal[diagonal <= ROUNDING * largest] = largest
    lengths = {law.group: law.law.length_scale for law in laws}.values()
    bounds = np.abs(np.concatenate([problem.lower, problem.upper]))
    elastic = np.max(np.abs(problem.force_rate) / diagonal, initial=0.0)
    length = max(lengths, default=max(elastic, float(np.max(bounds[np.isfinite(bounds)], initial=0.0))) or 1.0)
    for group in groups:
        diagonal[group] = diagonal[group].mean()
    return float(length), diagonal * float(length)


def _order(problem: CondensedProblem, firsts: list[int]) -> Array:
    """Numbers that look like random ones, from the vertices of the first unknowns of points, (m,)."""
    scale = float(np.max(np.abs(problem.points), initial=0.0)) or 1.0
    places = np.round(problem.points[firsts] / scale, 6)
    seen: dict[bytes, int] = {}
    found = np.empty(len(firsts))
    for k in range(len(firsts)):
        place = (places[k, :] + 0.0).tobytes()
        number = seen[place] = seen.get(place, 0) + 1
        mixed = np.sin(float(np.dot(places[k], (12.9898, 78.233, 37.719))) + 4.1 * number) * 43_758.5453
        found[k] = 0.5 + mixed - np.floor(mixed)
    return found
