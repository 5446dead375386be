"""Which unknowns and laws each site has."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.sparse import csr_array

from ...reduced.condensed_problem import CondensedProblem
from ...typing import Integers
from ..thresholds import DEFAULT, Thresholds
from .chains import refuse_shared
from .radials import Radials
from .units import units
from .vertex_laws import VertexLaw


class SiteLaws:
    """The unknowns and laws of all m sites.

    Args:
        problem: the problem.
        laws: at its vertices.
        thresholds: of the path.

    Attributes:
        thresholds: of the path.
        vertices: the laws at all vertices.
        one: the unknowns of sites of one unknown, which come first, (m1,).
        radials: the p sites of laws on a length, which come next; then come the sites of their openings, (q,).
        laws: of each site; those of openings have none.
        of_lengths: which of the sites are those of lengths,
        of_openings: and of openings.
        site_of: the site of each unknown, of an opening that of its length, (n,).
        places: the number of each site of one unknown, and of each pair of unknowns of a length, in a matrix, (n, n).
        length: the unit of displacements.
        forces: the units of forces by unknown, (n,).

    Raises:
        InputError: a law on a length shares an unknown with another law or a bound.
    """

    def __init__(self, problem: CondensedProblem, laws: Sequence[VertexLaw], thresholds: Thresholds = DEFAULT) -> None:
        self._problem, self.thresholds, self.vertices = problem, thresholds, laws
        kinds = {law.unknowns: (law.opens, law.mixity) for law in laws if law.radial}
        lengths = sorted(kinds)
        self.radials = Radials(lengths, [kinds[group][0] for group in lengths], [kinds[group][1] for group in lengths])
        self.one = np.setdiff1d(np.arange(problem.size), self.radials.flat)
        by_unknowns: dict[tuple[int, ...], list[VertexLaw]] = {}
        for law in laws:
            by_unknowns.setdefault(law.unknowns, []).append(law)
        keys = [*((int(i),) for i in self.one), *lengths]
        openings = self.radials.opening_unknowns
        self.laws = [*(by_unknowns.get(key, []) for key in keys), *([] for _ in openings)]
        refuse_shared(problem, self.radials, laws)
        self.length, self.forces = units(problem, laws, self.radials.groups)
        self._force_units = self.forces[[*(key[0] for key in keys), *openings]]
        m1, last = len(self.one), len(self.one) + len(self.radials)
        self.of_lengths, self.of_openings = slice(m1, last), slice(last, None)
        self.site_of = np.empty(problem.size, dtype=np.int64)
        self.site_of[self.one], self.site_of[self.radials.flat] = np.arange(m1), m1 + self.radials.owner
        rows, columns = (np.concatenate([self.one, self.radials.flat[pair]]) for pair in self.radials.pairs)
        self.places = csr_array((np.arange(len(rows)), (rows, columns)), shape=(problem.size, problem.size))

    def __len__(self) -> int:
        return len(self.laws)

    def unknowns(self) -> list[Integers]:
        """The unknowns of each site."""
        return [self.unknowns_of(k) for k in range(len(self))]

    def unknowns_of(self, k: int) -> Integers:
        """The unknowns of a site."""
        p, opening = self.radial(k), self.opening(k)
        if p is not None:
            return self.radials.groups[p]
        return self.one[k : k + 1] if opening is None else self.radials.opening_unknowns[opening : opening + 1]

    def columns(self, k: int) -> Integers:
        """The unknowns whose equations depend on the segment of a site; of an opening, those of its length."""
        opening = self.opening(k)
        return self.unknowns_of(k) if opening is None else self.radials.groups[self._length_of(opening)]

    def _length_of(self, opening: int) -> int:
        return int(self.radials.owner[self.radials.openings[opening]])

    def radial(self, k: int) -> int | None:
        """The number among the sites of lengths of a site; None: it is none of these."""
        p = k - len(self.one)
        return p if 0 <= p < len(self.radials) else None

    def opening(self, k: int) -> int | None:
        """The number among the openings of a site; None: it is none of these."""
        number = k - len(self.one) - len(self.radials)
        return number if number >= 0 else None

    def laws_at(self, k: int) -> list[VertexLaw]:
        """The laws of a site; of an opening, those of its length."""
        opening = self.opening(k)
        if opening is None:
            return self.laws[k]
        return self.laws[len(self.one) + self._length_of(opening)]
