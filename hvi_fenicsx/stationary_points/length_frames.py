"""The frames of vectors in which a law of their lengths is one of one component: along the vector, and across it.

About a point a length is ρ + τ²/(2ρ), ρ being the component along the vector and τ those across it. With the traction
t there, a law ψ of the length becomes ψ(|ρ|) + ½ (t/ρ) τ².
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..typing import Array, Integers, Mask
from .lengths import Lengths


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
    return np.asarray(out)
