"""Vectors of unknowns on whose lengths laws act: a slip in space, or an opening and a slip together."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ..typing import Array, Integers, Mask


@dataclass(frozen=True, kw_only=True)
class Lengths:
    """The vectors factors * x[unknowns], m of them, of up to three components; no unknown is in two of them.

    The length δ of a vector leaves out a first component that is an opening and negative.

    Attributes:
        unknowns: numbers, (m, 3); those behind the last component do not matter.
        factors: 0 behind the last component, (m, 3).
        opens: whether the first component is an opening, (m,).
    """

    unknowns: Integers
    factors: Array
    opens: Mask

    @classmethod
    def none(cls) -> Lengths:
        """No vector."""
        return cls(
            unknowns=np.empty((0, 3), dtype=np.int64), factors=np.empty((0, 3)), opens=np.empty(0, dtype=np.bool_)
        )

    def __len__(self) -> int:
        return len(self.opens)

    @cached_property
    def there(self) -> Mask:
        """Which components there are, (m, 3)."""
        return self.factors != 0.0

    @cached_property
    def members(self) -> Integers:
        """All unknowns of the vectors, one after the other."""
        return self.unknowns[self.there]

    def vectors(self, x: Array) -> Array:
        """The vectors, (m, 3).

        Args:
            x: the unknowns, (n,).
        """
        return self.factors * x[self.unknowns]

    def felt(self, vectors: Array) -> Array:
        """The vectors without openings that are negative, (m, 3).

        Args:
            vectors: (m, 3).
        """
        result = vectors.copy()
        result[self.opens, 0] = np.maximum(result[self.opens, 0], 0.0)
        return result

    def of(self, x: Array) -> Array:
        """The lengths δ, (m,).

        Args:
            x: the unknowns, (n,).
        """
        return np.linalg.norm(self.felt(self.vectors(x)), axis=1)

    def along(self, forces: Array) -> Array:
        """Forces on unknowns as forces along the vectors' components, (m, 3).

        Args:
            forces: (n,).
        """
        return np.divide(forces[self.unknowns], self.factors, out=np.zeros_like(self.factors), where=self.there)

    def diagonal(self, d: Array, size: int) -> Array:
        """The diagonal, (n,), of the quadratic form Σ dᵢ |vector i|².

        Args:
            d: (m,).
            size: number of unknowns n.
        """
        result = np.zeros(size)
        result[self.members] = (d[:, None] * self.factors**2)[self.there]
        return result

    def within(self, low: Array, high: Array) -> tuple[Array, Array]:
        """The least and the largest lengths in a box, (m,) each.

        Args:
            low: of the unknowns, (n,).
            high: of the unknowns, (n,).
        """
        ends = np.stack([self.vectors(low), self.vectors(high)])
        below, above = self.felt(ends.min(axis=0)), self.felt(ends.max(axis=0))
        least = np.where((below <= 0.0) & (above >= 0.0), 0.0, np.minimum(np.abs(below), np.abs(above)))
        most = np.maximum(np.abs(below), np.abs(above))
        return np.linalg.norm(least, axis=1), np.linalg.norm(most, axis=1)


@dataclass(frozen=True, kw_only=True)
class Frames:
    """Frames of m vectors: a reflection each, whose column ``axis`` is along the vector.

    Axes across which the direction has no component stay as they are.

    Attributes:
        lengths: the vectors.
        turns: (m, 3, 3), symmetric and orthogonal.
        axis: (m,).
    """

    lengths: Lengths
    turns: Array
    axis: Integers

    @classmethod
    def along(cls, lengths: Lengths, directions: Array) -> Frames:
        """The frames of some directions.

        Args:
            lengths: the vectors.
            directions: (m, 3); where one is zero, the first axis.
        """
        size = np.linalg.norm(directions, axis=1, keepdims=True)
        unit = np.divide(directions, size, out=np.zeros_like(directions), where=size > 0.0)
        rows, axis = np.arange(len(unit)), np.argmax(np.abs(unit), axis=1)
        normal = unit.copy()
        normal[rows, axis] += np.where(unit[rows, axis] < 0.0, -1.0, 1.0)
        square = np.sum(normal**2, axis=1)[:, None, None]
        turns = np.eye(3) - 2.0 * normal[:, :, None] * normal[:, None, :] / square
        return cls(lengths=lengths, turns=turns, axis=axis)

    def matrix(self, a: Array) -> Array:
        """A symmetric matrix of the unknowns in the frames, (n, n).

        Args:
            a: (n, n).
        """
        half = self._columns(a)
        return self._columns(np.ascontiguousarray(half.T))

    def _columns(self, a: Array) -> Array:
        lengths, result = self.lengths, a.copy()
        scaled = np.divide(
            a[:, lengths.unknowns], lengths.factors, out=np.zeros((len(a), *lengths.factors.shape)), where=lengths.there
        )
        result[:, lengths.members] = np.einsum("imk,mkl->iml", scaled, self.turns)[:, lengths.there]
        return result

    def forces(self, b: Array) -> Array:
        """Forces on the unknowns in the frames, (n,).

        Args:
            b: (n,).
        """
        result = b.copy()
        result[self.lengths.members] = self.turned(self.lengths.along(b))[self.lengths.there]
        return result

    def turned(self, vectors: Array) -> Array:
        """Vectors in their frames, or back, (m, 3).

        Args:
            vectors: (m, 3).
        """
        return np.einsum("mkl,ml->mk", self.turns, vectors)

    def into(self, x: Array) -> Array:
        """The unknowns, those of vectors replaced by components in the frames, (n,).

        Args:
            x: (n,).
        """
        result = x.copy()
        result[self.lengths.members] = self.turned(self.lengths.vectors(x))[self.lengths.there]
        return result


def unknowns_of(lengths: Lengths, x: Array, vectors: Array) -> Array:
    """The unknowns with other vectors, (n,).

    Args:
        lengths: the vectors' unknowns.
        x: all unknowns, (n,).
        vectors: (m, 3).
    """
    result = x.copy()
    result[lengths.members] = vectors[lengths.there] / lengths.factors[lengths.there]
    return result


def parts(lengths: Lengths, y: Array) -> Array:
    """The components that stand for the vectors' unknowns, (m, 3); 0 where there is none.

    Args:
        lengths: the vectors.
        y: (n,).
    """
    return np.where(lengths.there, y[lengths.unknowns], 0.0)


def left_out(lengths: Lengths, x: Array, along: Array, bounds: tuple[Array, Array]) -> Mask:
    """Components that do not count at a point: negative openings, and zeros that forces press on their bound, (m, 3).

    Args:
        lengths: the vectors.
        x: the point, (n,).
        along: forces along the components, (m, 3).
        bounds: of the unknowns, (n,) each.
    """
    z, at = lengths.vectors(x), x[lengths.unknowns]
    push = np.where(lengths.factors < 0.0, -along, along)
    low, high = (b[lengths.unknowns] for b in bounds)
    out = (z == 0.0) & lengths.there & ((at <= low) & (push < 0.0) | (at >= high) & (push > 0.0))
    out[:, 0] |= lengths.opens & ((z[:, 0] < 0.0) | (z[:, 0] == 0.0) & (along[:, 0] < 0.0))
    return out
