"""Displacements and forces of all sites as functions of the coordinates along their graphs, and their derivatives."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy.sparse import csr_array

from ...system.spectrum import negative_directions
from ...typing import Array
from ..segments import Kind
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
        energies[len(self.one) : len(self.one) + len(self.radials)] = self.radials.energies(e)
        return Values(
            x=self._by_unknown(lengths, e),
            force=self._by_unknown(tractions * energies, e),
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
        radials, p = self.radials, slice(len(self.one), len(self.one) + len(self.radials))
        rest = values.s[p] <= self.thresholds.curve.no_length
        if not radials.differ or not np.any(rest):
            return None
        e = np.where(rest[radials.owner], radials.directions(direction), values.directions)
        energies = values.energies.copy()
        energies[p] = radials.energies(e)
        return replace(values, directions=e, energies=energies)

    def _by_unknown(self, values: Array, e: Array) -> Array:
        """What values along the sites are by unknown, (n,)."""
        m1, radials, found = len(self.one), self.radials, np.zeros(len(self.forces))
        found[self.one] = values[:m1]
        if not len(radials):
            return found
        parts = values[m1:][radials.owner] * e
        beside = radials.openings
        parts[beside] = np.where(radials.counts[beside], parts[beside], values[m1 + len(radials) :])
        found[radials.flat] = parts
        return found

    def _blocks(self, values: Values, name: str) -> tuple[Array, Array]:
        """The derivatives of vectors by z: diagonal, (N,), and what a site adds along its unit vector, (p,)."""
        m1, radials = len(self.one), self.radials
        p = len(radials)
        every = getattr(values, name)
        radial, s = every[m1 : m1 + p], values.s[m1 : m1 + p]
        lengths = (values.lengths if name == "moves" else values.tractions)[m1 : m1 + p]
        across = np.divide(lengths, s, out=radial.copy(), where=s > 0.0)
        diagonal = across[radials.owner]
        beside = radials.openings
        diagonal[beside] = np.where(radials.counts[beside], diagonal[beside], every[m1 + p :])
        return diagonal, radial - across

    def jacobian(self, values: Values) -> Array:
        """The derivative of S x + r by the coordinates, (n, n)."""
        stiffness, m1, radials = self.stiffness, len(self.one), self.radials
        found = np.zeros_like(stiffness)
        found[:, self.one] = stiffness[:, self.one] * values.moves[:m1]
        found[self.one, self.one] += values.rises[:m1]
        if not len(radials):
            return found
        flat, owner, e = radials.flat, radials.owner, values.directions
        across, more = self._blocks(values, "moves")
        moved = stiffness[:, flat]
        found[:, flat] = moved * across + (radials.summed(moved * e) * more)[:, owner] * e
        rows, others = radials.pairs
        found[flat[rows], flat[others]] += self._force_rates(values)
        return found

    def _force_rates(self, values: Values) -> Array:
        """The derivatives of the forces on lengths by the coordinates, for each of the pairs of unknowns."""
        radials, e, p = self.radials, values.directions, slice(len(self.one), len(self.one) + len(self.radials))
        (rows, others), owner, energies = radials.pairs, radials.owner, values.energies[p]
        rises, steeper = self._blocks(values, "rises")
        turned = radials.energy_rates(e, values.s[p])
        found = (steeper * energies)[owner[rows]] * e[rows] * e[others]
        found += values.tractions[p][owner[rows]] * e[rows] * turned[others]
        alone = rises * np.where(radials.counts, energies[owner], 1.0)
        return np.asarray(found + np.where(rows == others, alone[rows], 0.0))

    def displacement_rate(self, values: Values, direction: Array) -> Array:
        """How the displacements change along a direction of the coordinates, (n,).

        Args:
            values: at the point.
            direction: of the coordinates, (n,).
        """
        found, m1, radials = np.zeros(len(values.x)), len(self.one), self.radials
        found[self.one] = values.moves[:m1] * direction[self.one]
        if not len(radials):
            return found
        across, more = self._blocks(values, "moves")
        along = radials.along(values.directions, direction)
        found[radials.flat] = across * direction[radials.flat] + (more * along)[radials.owner] * values.directions
        return found

    def force_rate(self, values: Values, direction: Array) -> Array:
        """How the forces of laws and bounds change along a direction of the coordinates, (n,).

        Args:
            values: at the point.
            direction: of the coordinates, (n,).
        """
        found, m1, radials = np.zeros(len(values.x)), len(self.one), self.radials
        found[self.one] = values.rises[:m1] * direction[self.one]
        if len(radials):
            rows, others = radials.pairs
            parts = self._force_rates(values) * direction[radials.flat[others]]
            found[radials.flat] = np.bincount(rows, parts, minlength=len(radials.flat))
        return found

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

    def bond_force(self, k: int, values: Values) -> float:
        """The force of a site's laws alone, without that of a bound.

        Args:
            k: the site.
            values: of the sites.
        """
        return float(self._force[k] if self.segment(k).kind is Kind.BOUND else values.tractions[k])

    def unstable_directions(self, values: Values, negligible: float = 1e-12) -> int:
        """The number of directions in which the energy falls at constant loads.

        Args:
            values: of the sites.
            negligible: an eigenvalue that is zero, relative to the greatest.
        """
        basis, slopes = self.motions(values)
        ways = csr_array(basis.T)
        matrix = ways @ (ways @ self.stiffness).T + np.diag(slopes)
        return negative_directions(matrix, negligible) + len(self.on_drops())

    def motions(self, values: Values) -> tuple[Array, Array]:
        """The displacements that can change, as orthonormal columns (n, q), and the slopes of their forces, (q,)."""
        n, m1, radials = len(values.x), len(self.one), self.radials
        free = np.flatnonzero(values.moves[:m1])
        columns = [np.eye(n)[:, self.one[free]]]
        slopes = [values.rises[free] / values.moves[free]]
        for p in range(len(radials)):
            basis, steep = self._turning(p, values)
            columns, slopes = [*columns, basis], [*slopes, steep]
        for number, i in enumerate(radials.opening_unknowns):
            if not radials.counts[radials.openings[number]] and values.moves[m1 + len(radials) + number]:
                columns, slopes = [*columns, np.eye(n)[:, [i]]], [*slopes, np.zeros(1)]
        return np.concatenate(columns, axis=1), np.concatenate(slopes)

    def _turning(self, p: int, values: Values) -> tuple[Array, Array]:
        """Along a site's vector and across it: the columns that can change, (n, r), and their slopes, (r,)."""
        k, here = len(self.one) + p, (self.radials.owner == p) & self.radials.counts
        unknowns, e = self.radials.flat[here], values.directions[here]
        axes = _axes(e)
        moves, steep = bool(values.moves[k]), values.energies[k] * values.rises[k] / (values.moves[k] or 1.0)
        if values.lengths[k] > 0.0:
            across, turns = values.energies[k] * values.tractions[k] / values.lengths[k], True
        else:
            across, turns = steep, moves
        kept = np.array([moves, *[turns] * (len(e) - 1)][: len(e)], dtype=bool)
        found = np.zeros((len(values.x), len(e)))
        found[unknowns] = axes
        return found[:, kept], np.array([steep, *[across] * (len(e) - 1)][: len(e)])[kept]

    @property
    def bent(self) -> bool:
        """Whether the equations of the present cell are not linear."""
        return bool(np.any(self._bent))

    def reach(self, values: Values) -> Array:
        """How far the curved sites may move in one step, in units of s, (m,); infinite for the others."""
        return np.asarray(self._deviations.reach(values.lengths) / self.length)


def _axes(direction: Array) -> Array:
    """Orthonormal axes of which a unit vector is the first, as columns; none where the vector has no components."""
    if len(direction) == 2:
        return np.array([[direction[0], -direction[1]], [direction[1], direction[0]]])
    axes = np.linalg.svd(direction[None])[2].T if len(direction) > 1 else np.ones((len(direction), len(direction)))
    axes[:, :1] = direction[:, None]
    return axes
