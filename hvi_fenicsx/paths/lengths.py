"""The points of laws on a length: which unknowns they have, and which of these count.

The coordinate of such a point is a vector z of its unknowns; displacement and force have its direction. An opening
counts only while it is positive: where its z is negative it is free, or pressed against a bound, and the rest of the
vector is the length. So z is continuous over all of these.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ..laws import Mixity
from ..typing import Array, Integers, Mask


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

    def lengths(self, z: Array) -> Array:
        """The lengths of the vectors, (p,).

        Args:
            z: all coordinates, (n,) or more.
        """
        return self.polar(z)[0]

    def directions(self, z: Array) -> Array:
        """Unit vectors, (N,); where the length is 0 the first unknown that counts.

        Args:
            z: all coordinates, (n,) or more.
        """
        return self.polar(z)[1]

    def polar(self, z: Array) -> tuple[Array, Array]:
        """The lengths of the vectors, (p,), and their directions as above, (N,).

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
        return np.asarray(per_length[self.owner] * directions * (self._slips - share[self.owner]))

    def _shares(self, directions: Array) -> Array:
        """The share of the slip in the square of each length, (p,)."""
        return np.minimum(self._sums(self._slips * directions**2), 1.0)

    def _sums(self, values: Array) -> Array:
        return np.asarray(np.bincount(self.owner, values, minlength=len(self)), dtype=np.float64)
