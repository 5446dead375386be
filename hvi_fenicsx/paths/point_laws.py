"""Which unknowns and laws each contact point has: one unknown, or the vector of a law on a length."""

from __future__ import annotations

from collections.abc import Callable, Collection, Sequence

import numpy as np
from scipy.sparse import csr_array

from ..errors import InputError
from ..laws import Mixity
from ..reduced.condensed_problem import CondensedProblem
from ..typing import Array, Integers, Mask, magnitude
from .thresholds import ROUNDING
from .vertex_laws import VertexLaw, is_straight, vertex_laws


class PointLaws:
    """The unknowns and laws of all m points.

    Args:
        problem: the problem.
        remember: numbers of the problem's bonds that remember.

    Attributes:
        check: is called before each step and passage; it may raise an error to end them.
        vertices: the laws at all vertices.
        one: the unknowns of points of one unknown, which come first, (m1,).
        vectors: the p points of laws on a length, which come next; then come the points of their openings, (q,).
        unknowns: of each point.
        laws: of each point; those of openings have none.
        of_lengths: which of the points are those of lengths,
        of_openings: and of openings.
        point_of: the point of each unknown, of an opening that of its length, (n,).
        straight: whether the graphs of all are straight between their ends; coordinates then have units.
        order: of the points, random numbers from 0.5 to 1.5, (m,): the same on any number of ranks.
        places: the number of each point of one unknown, and of each pair of unknowns of a length, in a matrix, (n, n).
        scale: the size of displacements.
        length: the unit of displacements along graphs; 1 where all are straight.
        forces: the units of forces by unknown, (n,).

    Raises:
        InputError: a law on a length shares an unknown with another law or a bound.
    """

    def __init__(self, problem: CondensedProblem, remember: Collection[int] = ()) -> None:
        laws = vertex_laws(problem, remember)
        self.check: Callable[[], None] = lambda: None
        self._problem, self.vertices = problem, laws
        kinds = {law.unknowns: (law.bonds.opens, law.bonds.mixity) for law in laws if law.bonds.radial}
        lengths = sorted(kinds)
        self.vectors = VectorPoints(
            lengths, [kinds[group][0] for group in lengths], [kinds[group][1] for group in lengths]
        )
        self.one = np.setdiff1d(np.arange(problem.size), self.vectors.flat)
        by_unknowns: dict[tuple[int, ...], list[VertexLaw]] = {}
        for law in laws:
            by_unknowns.setdefault(law.unknowns, []).append(law)
        openings = self.vectors.opening_unknowns
        self.unknowns: list[Integers] = [*self.one[:, None], *self.vectors.groups, *openings[:, None]]
        self.laws = [by_unknowns.get(tuple(group), []) for group in self.unknowns]
        refuse_shared(problem, self.vectors, laws)
        self.straight = is_straight(problem)
        self.scale, forces = units(problem, laws, self.vectors.groups)
        self.length, self.forces = (1.0, np.ones_like(forces)) if self.straight else (self.scale, forces)
        firsts = [group[0] for group in self.unknowns]
        self._force_units = self.forces[firsts]
        m1, last = len(self.one), len(self.one) + len(self.vectors)
        self.of_lengths, self.of_openings = slice(m1, last), slice(last, None)
        self.order = np.empty(len(self))
        self.order[np.lexsort(problem.points[firsts].T)] = np.random.default_rng(0).uniform(0.5, 1.5, len(self))
        self.point_of = np.empty(problem.size, dtype=np.int64)
        self.point_of[self.one], self.point_of[self.vectors.flat] = np.arange(m1), m1 + self.vectors.owner
        rows, columns = (np.concatenate([self.one, self.vectors.flat[pair]]) for pair in self.vectors.pairs)
        self.places = csr_array((np.arange(len(rows)), (rows, columns)), shape=(problem.size, problem.size))

    def __len__(self) -> int:
        return len(self.laws)

    def owner(self, k: int) -> int:
        """The point whose laws act on a point: itself; of an opening, that of its length."""
        return int(self.point_of[self.unknowns[k][0]])

    def radial(self, k: int) -> int | None:
        """The number among the points of lengths of a point; None: it is none of these."""
        p = k - len(self.one)
        return p if 0 <= p < len(self.vectors) else None

    def is_opening(self, k: int) -> bool:
        """Whether a point is an opening."""
        return k >= self.of_openings.start


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
    elastic = magnitude(problem.force_rate / diagonal)
    length = max(lengths, default=max(elastic, float(np.max(bounds[np.isfinite(bounds)], initial=0.0))) or 1.0)
    for group in groups:
        diagonal[group] = diagonal[group].mean()
    return float(length), diagonal * float(length)


class VectorPoints:
    """The p points of laws on a length, with N unknowns together, of which q are openings.

    Args:
        groups: the unknowns of each point, an opening first.
        opens: of each point, whether its first unknown is an opening.
        mixities: of each point, how the energy of separation depends on the mode; None: it does not.

    Attributes:
        groups: the unknowns of each point.
        flat: all of them, one point after the other, (N,).
        owner: number of the point of each, (N,).
        pairs: the numbers among the N of each two unknowns of one point, and of each with itself.
        openings: numbers among the N of the openings, (q,).
        counts: which of the N count, (N,).
    """

    def __init__(
        self, groups: Sequence[tuple[int, ...]], opens: Sequence[bool], mixities: Sequence[Mixity | None]
    ) -> None:
        self.groups = [np.array(group, dtype=np.int64) for group in groups]
        self.flat = np.concatenate([np.empty(0, np.int64), *self.groups])
        self.owner = np.repeat(np.arange(len(groups)), [len(group) for group in groups])
        self._firsts = np.cumsum([0, *[len(group) for group in groups]])[:-1]
        self.pairs = np.nonzero(self.owner[:, None] == self.owner)
        self.openings = self._firsts[np.array(opens, dtype=bool)] if groups else np.empty(0, np.int64)
        self.counts: Mask = np.ones(len(self.flat), dtype=bool)
        self._slips = np.ones(len(self.flat))
        self._slips[self.openings] = 0.0
        criteria = [c for number, c in enumerate(mixities) if c is not None and c not in mixities[:number]]
        self._criteria = [(c, np.array([p for p, own in enumerate(mixities) if own == c])) for c in criteria]

    def __len__(self) -> int:
        return len(self.groups)

    @property
    def opening_unknowns(self) -> Integers:
        """The unknowns that are openings, (q,)."""
        return self.flat[self.openings]

    @property
    def differ(self) -> bool:
        """Whether any energy of separation depends on the mode."""
        return bool(self._criteria)

    def counted(self, p: int) -> int:
        """How many unknowns of a point count."""
        return int(np.count_nonzero(self.counts[self.owner == p]))

    def polar(self, z: Array) -> tuple[Array, Array]:
        """The lengths of the vectors, (p,), and unit vectors, (N,): of the length 0 the first unknown that counts.

        Args:
            z: all coordinates, (n,) or more.
        """
        if not self.groups:
            return np.zeros(0), np.zeros(0)
        vectors = np.where(self.counts, z[self.flat], 0.0)
        lengths = np.sqrt(self._sums(vectors**2))
        if np.all(lengths > 0.0):
            return lengths, vectors / lengths[self.owner]
        spread = lengths[self.owner]
        found = np.divide(vectors, spread, out=np.zeros_like(vectors), where=spread > 0.0)
        found[self.leads() & (spread == 0.0)] = 1.0
        return lengths, found

    def leads(self) -> Mask:
        """Which of the N are the first of their point that counts, (N,)."""
        found = np.zeros(len(self.flat), dtype=bool)
        counted = np.flatnonzero(self.counts)
        found[counted[np.unique(self.owner[counted], return_index=True)[1]]] = True
        return found

    def mirrors(self, directions: Array) -> tuple[Array, Array]:
        """What the first unknown that counts is reflected at onto the unit vector, (N,), and half its square, (p,).

        Args:
            directions: the unit vectors, (N,).
        """
        found = directions + self.leads() * np.where(directions < 0.0, -1.0, 1.0)
        return found, np.maximum(0.5 * self._sums(found**2), 0.5)  # at least 1 but where nothing counts

    def along(self, directions: Array, change: Array) -> Array:
        """The products of unit vectors with a change of the coordinates, (p,).

        Args:
            directions: the unit vectors, (N,).
            change: of all coordinates, (n,) or more.
        """
        return self._sums(directions * change[self.flat])

    def energies(self, directions: Array) -> Array:
        """By what the mode mixity multiplies the forces of each point, (p,).

        Args:
            directions: the unit vectors, (N,).
        """
        found = np.ones(len(self))
        for criterion, points in self._criteria:
            found[points] = criterion.energy(self._shares(directions)[points])
        return found

    def energy_rates(self, directions: Array, lengths: Array) -> Array:
        """The derivatives of these by the coordinates, (N,).

        Args:
            directions: the unit vectors, (N,).
            lengths: of the vectors, (p,).
        """
        share, slopes = self._shares(directions), np.zeros(len(self))
        for criterion, points in self._criteria:
            slopes[points] = criterion.slope(share[points])
        per_length = np.divide(2.0 * slopes, lengths, out=np.zeros_like(slopes), where=lengths > 0.0)
        return per_length[self.owner] * directions * (self._slips - share[self.owner])

    def _shares(self, directions: Array) -> Array:
        """The share of the slip in the square of each length, (p,)."""
        return np.minimum(self._sums(self._slips * directions**2), 1.0)

    def _sums(self, values: Array) -> Array:
        return np.asarray(np.bincount(self.owner, values, minlength=len(self)), dtype=np.float64)


def refuse_shared(problem: CondensedProblem, vectors: VectorPoints, laws: Sequence[VertexLaw]) -> None:
    """Refuse what has no graph of its own: unknowns that a law on a length shares with another law or a bound.

    Args:
        problem: the problem.
        vectors: the points of laws on a length.
        laws: at all vertices.

    Raises:
        InputError: there are such unknowns, or openings with a bound above 0.
    """
    seen, openings = vectors.flat, vectors.opening_unknowns
    with_one = [i for law in laws if not law.bonds.radial for i in law.unknowns]
    low = np.isfinite(problem.lower)
    low[openings] = problem.lower[openings] > 0.0
    bounded = np.flatnonzero(low | np.isfinite(problem.upper))
    shared = np.intersect1d(seen, np.concatenate([np.array(with_one, dtype=np.int64), bounded]))
    if len(np.unique(seen)) == len(seen) and not shared.size:
        return
    raise InputError(
        "path: at a vertex a law acts on |u_t| or on opening and slip, and contact or another law on a component of "
        "it; such an edge has no path yet. Leave one of them away there, or let the parts not meet. Cohesion beside "
        "contact has a path where nothing bounds the opening from above, and the gap is not negative"
    )
