"""Displacements and forces of all points as functions of the coordinates along their graphs, and their derivatives."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy.sparse import csr_array

from ..reduced.condensed_stiffness import ZERO, negative_directions, rounding_of
from ..typing import Array, Mask, magnitude
from .point_laws import PointLaws
from .rigid_motions import Unresisted, without
from .statuses import PointStatuses
from .thresholds import DEFAULT, ROUNDING


@dataclass(frozen=True, kw_only=True)
class Values:
    """What a cell gives at its coordinates.

    Attributes:
        x: displacements, (n,).
        force: of laws and bounds, (n,).
        lengths: of the displacements by point, (m,).
        tractions: forces along them by point, (m,).
        moves: derivatives of the lengths by s, (m,).
        rises: derivatives of the tractions by s, (m,).
        s: by point, (m,).
        directions: of the points of lengths, (N,).
        energies: by what the mode mixity multiplies the tractions, (m,).
    """

    x: Array
    force: Array
    lengths: Array
    tractions: Array
    moves: Array
    rises: Array
    s: Array
    directions: Array
    energies: Array


@dataclass(frozen=True, kw_only=True)
class FreeMotions:
    """The displacements that can change at a point, q of them.

    Attributes:
        ways: they as orthonormal rows, (q, n).
        elastic: the stiffness S along them, (q, q).
        slopes: those of the forces of laws and bounds, (q,).
    """

    ways: csr_array
    elastic: Array
    slopes: Array

    @property
    def matrix(self) -> Array:
        """How all forces change with them, (q, q)."""
        return self.elastic + np.diag(self.slopes)


class ContactPoints(PointStatuses):
    """All points, each on one segment of its graph, and what these give at its coordinates."""

    def values(self, z: Array) -> Values:
        """Displacements, forces and their derivatives.

        Args:
            z: the coordinates, (n,).
        """
        s, e = (z, np.empty(0)) if self.straight else self.polar(z)
        tau = s - self._base
        x, force = self._x + self._moves * tau, self._force + self._rises * tau
        found = Values(
            x=x,
            force=force,
            lengths=x,
            tractions=force,
            moves=self._moves,
            rises=self._rises,
            s=s,
            directions=e,
            energies=np.ones(len(s)),
        )
        return found if self.straight else self._of_curves(found)

    def _of_curves(self, chords: Values) -> Values:
        """The values with what chords of curved laws lack, and of vectors."""
        lengths, e, energies = chords.lengths, chords.directions, chords.energies
        more, slopes = self._deviations.values(lengths)
        energies[self.of_lengths] = self.vectors.energies(e)
        tractions = chords.tractions + more
        forces, spread = tractions * energies, self.point_of[self.vectors.flat]
        x, force = self._by_unknown(lengths, lengths[spread] * e), self._by_unknown(forces, forces[spread] * e)
        return replace(chords, x=x, force=force, tractions=tractions, rises=chords.rises + slopes * chords.moves)

    def setting_out(self, values: Values, direction: Array) -> Values | None:
        """The values with the mode in which lengths of 0, but for rounding, grow; None where no mode matters.

        Args:
            values: at the point.
            direction: of the coordinates, (n,).
        """
        vectors, p = self.vectors, self.of_lengths
        rest = values.s[p] <= ROUNDING
        if not vectors.differ or not np.any(rest):
            return None
        e = np.where(rest[vectors.owner], vectors.polar(direction)[1], values.directions)
        energies = values.energies.copy()
        energies[p] = vectors.energies(e)
        return replace(values, directions=e, energies=energies)

    def unmoved(self, values: Values) -> Mask:
        """Which points have not left 0 but for rounding, (m,): there is nothing to remember.

        Args:
            values: of the points.
        """
        return np.abs(values.lengths) <= DEFAULT.reached * self.length

    def allowances(self, values: Values, rates: Array, fastest: float) -> Array:
        """How near to an end of its segment a point is there, (m,): on a steep segment a short way is a large force.

        Of a point that stands but for rounding the way says nothing.

        Args:
            values: of the points.
            rates: how fast s changes, (m,).
            fastest: how fast the fastest coordinate does.
        """
        size = 1.0 + np.abs(values.s)
        steep = np.maximum(np.abs(values.rises) / self._force_units, 1.0)
        steep[np.abs(rates) * steep <= DEFAULT.reached * fastest] = 1.0
        return np.maximum(DEFAULT.reached / steep, DEFAULT.digits) * size

    def turning_back(self, values: Values, rates: Array) -> Mask:
        """Which bonds with memory go back, (m,); a vector that has not left 0 passes it instead.

        Args:
            values: of the points.
            rates: how fast the points go along their graphs, (m,).
        """
        passes = np.isinf(self.low) & (self.outward > 0.0) & self.unmoved(values)
        return (rates * self.outward < 0.0) & ~passes

    def _by_unknown(self, values: Array, parts: Array) -> Array:
        """What points have by unknown, (n,).

        Args:
            values: of the points, (m,).
            parts: of the unknowns of points of lengths, (N,).
        """
        found = np.empty(len(self.forces))
        found[self.one], found[self.vectors.flat] = values[: len(self.one)], self._beside(values, parts)
        return found

    def _beside(self, values: Array, parts: Array) -> Array:
        """Parts of the unknowns of lengths; of an opening that does not count, what its own point has, (N,)."""
        openings, counts = self.vectors.openings, self.vectors.counts
        parts[openings] = np.where(counts[openings], parts[openings], values[self.of_openings])
        return parts

    def moved(self, values: Values) -> Blocks:
        """The derivatives of the displacements by the coordinates.

        Args:
            values: at the point.
        """
        return self._of_vectors(values, values.lengths, values.moves)

    def risen(self, values: Values) -> Blocks:
        """The derivatives of the forces of laws and bounds by the coordinates.

        Args:
            values: at the point.
        """
        vectors, e, p = self.vectors, values.directions, self.of_lengths
        found = self._of_vectors(values, values.energies * values.tractions, values.energies * values.rises)
        turned = values.tractions[p][vectors.owner] * vectors.energy_rates(e, values.s[p])
        return replace(found, right=found.right + turned)

    def _of_vectors(self, values: Values, sizes: Array, rates: Array) -> Blocks:
        """The derivatives of vectors that have the directions of z.

        Args:
            values: of the points.
            sizes: of the vectors by point, (m,).
            rates: their derivatives by s, (m,).
        """
        p, owner, e = self.of_lengths, self.vectors.owner, values.directions
        across = np.divide(sizes[p], values.s[p], out=rates[p].copy(), where=values.s[p] > 0.0)
        return Blocks(
            points=self,
            ones=rates[: len(self.one)],
            diagonal=self._beside(rates, across[owner]),
            left=e,
            right=(rates[p] - across)[owner] * e,
        )

    def resisting(self, values: Values) -> Mask:
        """The axes along which displacements are resisted; all of them while something else holds the body back, (n,).

        A length whose traction vanishes resists its own turning less and less: that is nothing before it is rounding.

        Args:
            values: at the point.
        """
        held_back = self.elastic is not self._problem.elastic
        return held_back | ~(np.abs(self._slopes(values)) <= DEFAULT.none * self.stiffest)  # nan: it stands

    def unresisted(self, values: Values, rate: Array) -> Unresisted:
        """The rigid motions that nothing resists.

        Args:
            values: at the point.
            rate: the load that grows, (n,).
        """
        if not len(self.rigid):
            return Unresisted(motions=self.rigid, rate=rate)
        axes = self._axes(values.directions)
        parts = np.array([axes @ motion for motion in self.rigid])[:, self.resisting(values)]
        return Unresisted(motions=without(self.rigid, parts, DEFAULT.none), rate=rate)

    def are_outdone(self, values: Values, load: Array, motion: Array) -> bool:
        """Whether laws and bounds, as they remember, can nowhere balance a load along the rigid part of a motion.

        Args:
            values: of the points, each of which is an unknown.
            load: the load, (n,).
            motion: displacements, (n,).
        """
        along = self.rigid.T @ (self.rigid @ motion)
        along *= np.sign(load @ along)
        moved = np.abs(along) > DEFAULT.none * magnitude(along)
        forces = values.tractions
        ends = np.where(along > 0.0, np.maximum(self.greatest, forces), np.minimum(self.least, forces))
        most = ends[moved] @ along[moved]
        return bool(load @ along > most + DEFAULT.none * np.abs(load) @ np.abs(along))

    def held_stiffness(self, held: Array | None) -> Array:
        """The stiffness with springs against motions that are as stiff as the body, (n, n).

        Args:
            held: the motions, as orthonormal rows, (d, n); None for none.
        """
        if held is None or not len(held):
            return self.stiffness
        return self.stiffness + held.T @ held * self.stiffest

    def jacobian(self, values: Values, held: Array | None = None) -> Array:
        """The derivative of S x + r by the coordinates, (n, n).

        Args:
            values: at the point.
            held: motions that springs hold, as orthonormal rows, (d, n); None for none.
        """
        moved = self.moved(values).sparse @ self.held_stiffness(held)
        return moved.T + self.risen(values).sparse.toarray()  # S and the first blocks are symmetric

    def bond_forces(self, values: Values) -> Array:
        """The forces of the laws of each point alone, without those of bounds, (m,).

        Args:
            values: of the points.
        """
        return np.where(self._bound, self._force, values.tractions)

    def unstable_directions(self, values: Values, negligible: float = 1e-12) -> int:
        """The number of directions in which the energy falls at constant loads.

        Args:
            values: of the points.
            negligible: an eigenvalue that is zero, relative to the greatest.
        """
        if self.straight:
            return self.elastic.negative_directions(self.moving, self.slope, negligible) + len(self.on_drops())
        motions = self.motions(values)
        stiff = np.diag(motions.elastic) + np.abs(motions.slopes)
        stiff = np.where(stiff > rounding_of(self.stiffness), stiff, np.max(stiff, initial=1e-300))
        sizes = np.sqrt(stiff)  # else what is stiff, as a length that has just left 0 is across, would hide the rest
        return negative_directions(motions.matrix / np.outer(sizes, sizes), negligible) + len(self.on_drops())

    def is_held(self, values: Values) -> bool:
        """Whether no displacement that can change meets no stiffness, or a negative one.

        Args:
            values: of the points.
        """
        if self.straight:
            return not self.elastic.is_singular(self.moving, self.slope)
        return not negative_directions(self.motions(values).matrix, -ZERO, rounding_of(self.stiffness))

    def motions(self, values: Values) -> FreeMotions:
        """The displacements that can change.

        Args:
            values: of the points.
        """
        slopes = self._slopes(values)
        free = np.flatnonzero(~np.isnan(slopes))
        ways = self._axes(values.directions).sparse[free]
        return FreeMotions(ways=ways, elastic=ways @ (ways @ self.stiffness).T, slopes=slopes[free])

    def _axes(self, directions: Array) -> Blocks:
        """Orthonormal axes of each point, the first that counts along its vector.

        They are those of its unknowns, reflected as Householder (1958) does; what does not count keeps its own.
        """
        mirror, halves = self.vectors.mirrors(directions)
        ones, left = np.ones(len(self.one)), -mirror / halves[self.vectors.owner]
        return Blocks(points=self, ones=ones, diagonal=np.ones(len(mirror)), left=left, right=mirror)

    def _slopes(self, values: Values) -> Array:
        """How forces change with displacements along the axes of all points, (n,); nan where these do not move."""
        vectors, p, lengths = self.vectors, self.of_lengths, values.lengths[self.of_lengths]
        rises, moves = values.energies * values.rises, values.moves
        along = np.divide(rises, moves, out=np.full(len(self), np.nan), where=moves != 0.0)
        tractions = values.energies[p] * values.tractions[p]
        across = np.where(values.s[p] > 0.0, np.nan, along[p])  # what rests at 0 is held across the way it sets out
        np.divide(tractions, lengths, out=across, where=lengths > 0.0)
        return self._by_unknown(along, np.where(vectors.leads(), along[p][vectors.owner], across[vectors.owner]))

    @property
    def bent(self) -> bool:
        """Whether the equations of the present cell are not linear."""
        return bool(np.any(self._bent))

    def reach(self, values: Values) -> Array:
        """How far the curved points may move in one step, in units of s, (m,); infinite for the others."""
        return self._deviations.reach(values.lengths, DEFAULT.reach) / self.length


@dataclass(frozen=True, kw_only=True)
class Blocks:
    """A number for each point of one unknown, and for each point of a length a diagonal and the product of two vectors.

    Attributes:
        points: the points; those of lengths have N unknowns together.
        ones: the numbers, (m1,).
        diagonal: by unknown of a length, (N,).
        left: the first of the two vectors, likewise.
        right: the second one.
    """

    points: PointLaws
    ones: Array
    diagonal: Array
    left: Array
    right: Array

    def __matmul__(self, x: Array) -> Array:
        """The product with a vector, (n,)."""
        vectors, found = self.points.vectors, np.empty_like(x)
        found[self.points.one] = self.ones * x[self.points.one]
        products = vectors.along(self.right, x)[vectors.owner]
        found[vectors.flat] = self.diagonal * x[vectors.flat] + self.left * products
        return found

    @property
    def sparse(self) -> csr_array:
        """The matrix, (n, n)."""
        (rows, others), places = self.points.vectors.pairs, self.points.places
        blocks = self.left[rows] * self.right[others] + np.where(rows == others, self.diagonal[rows], 0.0)
        entries = np.concatenate([self.ones, blocks])[places.data]
        return csr_array((entries, places.indices, places.indptr), shape=places.shape)
