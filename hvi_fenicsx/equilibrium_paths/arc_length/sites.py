"""Displacements and forces of all sites as functions of the coordinates along their graphs, and their derivatives."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy.sparse import csr_array

from ...reduced.condensed_stiffness import negative_directions, rounding_of
from ...typing import Array, Mask
from ..neutral import Unresisted, unresisted
from .blocks import Blocks
from .site_graphs import SiteGraphs


@dataclass(frozen=True, kw_only=True)
class Values:
    """What a cell gives at its coordinates.

    Attributes:
        x: displacements, (n,).
        force: of laws and bounds, (n,).
        lengths: of the displacements by site, (m,).
        tractions: forces along them by site, (m,).
        moves: derivatives of the lengths by s, (m,).
        rises: derivatives of the tractions by s, (m,).
        s: by site, (m,).
        directions: of the sites of lengths, (N,).
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
class Motions:
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


class Sites(SiteGraphs):
    """All sites, each on one segment of its graph: :class:`.SiteGraphs`, and what a cell gives at its coordinates."""

    def values(self, z: Array) -> Values:
        """Displacements, forces and their derivatives.

        Args:
            z: the coordinates, (n,).
        """
        s, e = self.polar(z)
        tau = s - self._base
        lengths, tractions = self._x + self._moves * tau, self._force + self._rises * tau
        more, slopes = self._deviations.values(lengths)
        tractions, rises = tractions + more, self._rises + slopes * self._moves
        energies = np.ones(len(s))
        energies[self.of_lengths] = self.radials.energies(e)
        forces, spread = tractions * energies, self.site_of[self.radials.flat]
        return Values(
            x=self._by_unknown(lengths, lengths[spread] * e),
            force=self._by_unknown(forces, forces[spread] * e),
            lengths=lengths,
            tractions=tractions,
            moves=self._moves,
            rises=rises,
            s=s,
            directions=e,
            energies=energies,
        )

    def setting_out(self, values: Values, direction: Array) -> Values | None:
        """The values with the mode in which lengths of 0, but for rounding, grow; None where no mode matters.

        Args:
            values: at the point.
            direction: of the coordinates, (n,).
        """
        radials, p = self.radials, self.of_lengths
        rest = values.s[p] <= self.thresholds.curve.no_length
        if not radials.differ or not np.any(rest):
            return None
        e = np.where(rest[radials.owner], radials.directions(direction), values.directions)
        energies = values.energies.copy()
        energies[p] = radials.energies(e)
        return replace(values, directions=e, energies=energies)

    def unmoved(self, values: Values) -> Mask:
        """Which sites have not left 0 but for rounding, (m,): there is nothing to remember.

        Args:
            values: of the sites.
        """
        return np.asarray(np.abs(values.lengths) <= self.thresholds.curve.rounding * self.length)

    def allowances(self, values: Values, rates: Array, fastest: float) -> Array:
        """How near to an end of its segment a site is there, (m,): on a steep segment a short way is a large force.

        Of a site that stands but for rounding the way says nothing.

        Args:
            values: of the sites.
            rates: how fast s changes, (m,).
            fastest: how fast the fastest coordinate does.
        """
        curve, size = self.thresholds.curve, 1.0 + np.abs(values.s)
        steep = np.maximum(np.abs(values.rises) / self._force_units, 1.0)
        steep[np.abs(rates) <= curve.undecided * fastest] = 1.0
        return np.asarray(np.maximum(curve.rounding / steep, curve.left) * size)

    def turning_back(self, values: Values, rates: Array) -> Mask:
        """Which bonds with memory go back, (m,); a vector that has not left 0 passes it instead.

        Args:
            values: of the sites.
            rates: how fast the sites go along their graphs, (m,).
        """
        passes = np.isinf(self.low) & (self.outward > 0.0) & self.unmoved(values)
        return (rates * self.outward < 0.0) & ~passes

    def _by_unknown(self, values: Array, parts: Array) -> Array:
        """What sites have by unknown, (n,).

        Args:
            values: of the sites, (m,).
            parts: of the unknowns of sites of lengths, (N,).
        """
        found = np.empty(len(self.forces))
        found[self.one], found[self.radials.flat] = values[: len(self.one)], self._beside(values, parts)
        return found

    def _beside(self, values: Array, parts: Array) -> Array:
        """Parts of the unknowns of sites of lengths; of an opening that does not count, what its own site has, (N,)."""
        openings, counts = self.radials.openings, self.radials.counts
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
        radials, e, p = self.radials, values.directions, self.of_lengths
        found = self._of_vectors(values, values.energies * values.tractions, values.energies * values.rises)
        turned = values.tractions[p][radials.owner] * radials.energy_rates(e, values.s[p])
        return replace(found, right=found.right + turned)

    def _of_vectors(self, values: Values, sizes: Array, rates: Array) -> Blocks:
        """The derivatives of vectors that have the directions of z.

        Args:
            values: of the sites.
            sizes: of the vectors by site, (m,).
            rates: their derivatives by s, (m,).
        """
        p, owner, e = self.of_lengths, self.radials.owner, values.directions
        across = np.divide(sizes[p], values.s[p], out=rates[p].copy(), where=values.s[p] > 0.0)
        return Blocks(
            sites=self,
            ones=rates[: len(self.one)],
            diagonal=self._beside(rates, across[owner]),
            left=e,
            right=(rates[p] - across)[owner] * e,
        )

    def unresisted(self, values: Values, rate: Array) -> Unresisted:
        """The rigid motions that nothing resists; none while something else holds the body back.

        A length whose traction vanishes resists its own turning less and less: that is nothing before it is rounding.

        Args:
            values: at the point.
            rate: the load that grows, (n,).
        """
        if not len(self.rigid) or self.stiffness is not self._problem.stiffness:
            return Unresisted.none(rate)
        none = self.thresholds.curve.unresisted * float(np.max(self.forces, initial=0.0)) / self.length
        resists = np.flatnonzero(~(np.abs(self._slopes(values)) <= none))  # nan where nothing moves
        return unresisted(self.rigid, (self._axes(values.directions).sparse[resists] @ self.rigid.T).T, rate)

    def held_stiffness(self, held: Array | None) -> Array:
        """The stiffness with springs against motions that are as stiff as the body, (n, n).

        Args:
            held: the motions, as orthonormal rows, (d, n); None for none.
        """
        if held is None or not len(held):
            return self.stiffness
        return np.asarray(self.stiffness + held.T @ held * (np.max(self.forces) / self.length))

    def jacobian(self, values: Values, held: Array | None = None) -> Array:
        """The derivative of S x + r by the coordinates, (n, n).

        Args:
            values: at the point.
            held: motions that springs hold, as orthonormal rows, (d, n); None for none.
        """
        moved = self.moved(values).sparse @ self.held_stiffness(held)
        return np.asarray(moved.T + self.risen(values).sparse.toarray())  # S and the first blocks are symmetric

    def along(self, values: Values, motion: Array) -> Array:
        """What a motion is along the displacements of the sites, (m,).

        Args:
            values: at the point.
            motion: by unknown, (n,).
        """
        return np.concatenate(
            [
                motion[self.one],
                self.radials.along(values.directions, motion),
                motion[self.radials.opening_unknowns],
            ]
        )

    def bond_forces(self, values: Values) -> Array:
        """The forces of the laws of each site alone, without those of bounds, (m,).

        Args:
            values: of the sites.
        """
        return np.where(self._bound, self._force, values.tractions)

    def unstable_directions(self, values: Values, negligible: float = 1e-12) -> int:
        """The number of directions in which the energy falls at constant loads.

        Args:
            values: of the sites.
            negligible: an eigenvalue that is zero, relative to the greatest.
        """
        motions = self.motions(values)
        stiff = np.diag(motions.elastic) + np.abs(motions.slopes)
        stiff = np.where(stiff > rounding_of(self.stiffness), stiff, np.max(stiff, initial=1e-300))
        sizes = np.sqrt(stiff)  # else what is stiff, as a length that has just left 0 is across, would hide the rest
        return negative_directions(motions.matrix / np.outer(sizes, sizes), negligible) + len(self.on_drops())

    def motions(self, values: Values) -> Motions:
        """The displacements that can change.

        Args:
            values: of the sites.
        """
        slopes = self._slopes(values)
        free = np.flatnonzero(~np.isnan(slopes))
        ways = self._axes(values.directions).sparse[free]
        return Motions(ways=ways, elastic=ways @ (ways @ self.stiffness).T, slopes=slopes[free])

    def _axes(self, directions: Array) -> Blocks:
        """Orthonormal axes of each site, the first that counts along its vector.

        They are those of its unknowns, reflected as Householder (1958) does; what does not count keeps its own.
        """
        mirror, halves = self.radials.mirrors(directions)
        ones, left = np.ones(len(self.one)), -mirror / halves[self.radials.owner]
        return Blocks(sites=self, ones=ones, diagonal=np.ones(len(mirror)), left=left, right=mirror)

    def _slopes(self, values: Values) -> Array:
        """How forces change with displacements along the axes of all sites, (n,); nan where these do not move."""
        radials, p, lengths = self.radials, self.of_lengths, values.lengths[self.of_lengths]
        rises, moves = values.energies * values.rises, values.moves
        along = np.divide(rises, moves, out=np.full(len(self), np.nan), where=moves != 0.0)
        tractions = values.energies[p] * values.tractions[p]
        across = np.where(values.s[p] > 0.0, np.nan, along[p])  # what rests at 0 is held across the way it sets out
        np.divide(tractions, lengths, out=across, where=lengths > 0.0)
        return self._by_unknown(along, np.where(radials.leads(), along[p][radials.owner], across[radials.owner]))

    @property
    def bent(self) -> bool:
        """Whether the equations of the present cell are not linear."""
        return bool(np.any(self._bent))

    def reach(self, values: Values) -> Array:
        """How far the curved sites may move in one step, in units of s, (m,); infinite for the others."""
        return np.asarray(self._deviations.reach(values.lengths) / self.length)
