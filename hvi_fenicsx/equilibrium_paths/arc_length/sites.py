"""Displacements and forces of all sites as functions of the coordinates along their graphs, and their derivatives."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

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
        directions: of the sites of two unknowns, (p, 2).
    """

    x: Array
    force: Array
    lengths: Array
    tractions: Array
    moves: Array
    rises: Array
    s: Array
    directions: Array


class Sites(SiteGraphs):
    """All sites, each on one segment of its graph: :class:`.SiteGraphs`, and what a cell gives at its coordinates."""

    def values(self, z: Array) -> Values:
        """Displacements, forces and their derivatives.

        Args:
            z: the coordinates, (n,).
        """
        s, e = self.s(z), self.directions(z)
        tau = s - self._base
        lengths, tractions = self._x + self._moves * tau, self._force + self._rises * tau
        more, slopes = self._deviations.values(lengths)
        tractions, rises = tractions + more, self._rises + slopes * self._moves
        x, force, m1 = np.zeros(len(z)), np.zeros(len(z)), len(self.one)
        x[self.one], force[self.one] = lengths[:m1], tractions[:m1]
        x[self.two], force[self.two] = lengths[m1:, None] * e, tractions[m1:, None] * e
        return Values(
            x=x, force=force, lengths=lengths, tractions=tractions, moves=self._moves, rises=rises, s=s, directions=e
        )

    def jacobian(self, values: Values) -> Array:
        """The derivative of S x + r by the coordinates, (n, n)."""
        stiffness, m1 = self.stiffness, len(self.one)
        found = np.zeros_like(stiffness)
        found[:, self.one] = stiffness[:, self.one] * values.moves[:m1]
        found[self.one, self.one] += values.rises[:m1]
        i, j = self.two.T
        moved, risen = (_blocks(values, ends) for ends in ("moves", "rises"))
        for column, unknown in ((0, i), (1, j)):
            found[:, unknown] = stiffness[:, i] * moved[:, 0, column] + stiffness[:, j] * moved[:, 1, column]
            found[i, unknown] += risen[:, 0, column]
            found[j, unknown] += risen[:, 1, column]
        return found

    def displacement_rate(self, values: Values, direction: Array) -> Array:
        """How the displacements change along a direction of the coordinates, (n,).

        Args:
            values: at the point.
            direction: of the coordinates, (n,).
        """
        found, m1 = np.zeros(len(values.x)), len(self.one)
        found[self.one] = values.moves[:m1] * direction[self.one]
        found[self.two] = np.einsum("pij,pj->pi", _blocks(values, "moves"), direction[self.two])
        return found

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
        matrix = basis.T @ self.stiffness @ basis + np.diag(slopes)
        found = np.linalg.eigvalsh(matrix) if len(slopes) else np.empty(0)
        size = float(np.max(np.abs(found), initial=0.0))
        return int(np.count_nonzero(found < -negligible * size)) + len(self.on_drops())

    def motions(self, values: Values) -> tuple[Array, Array]:
        """The displacements that can change, as orthonormal columns (n, q), and the slopes of their forces, (q,)."""
        n, m1 = len(values.x), len(self.one)
        free = np.flatnonzero(values.moves[:m1])
        columns = [np.eye(n)[:, self.one[free]]]
        slopes = [values.rises[free] / values.moves[free]]
        for p, pair in enumerate(self.two):
            k, e = m1 + p, values.directions[p]
            along, across = np.zeros((n, 1)), np.zeros((n, 1))
            along[pair, 0], across[pair, 0] = e, (-e[1], e[0])
            if values.moves[k]:
                columns, slopes = [*columns, along], [*slopes, values.rises[k : k + 1] / values.moves[k]]
            if values.lengths[k]:
                columns = [*columns, across]
                slopes = [*slopes, values.tractions[k : k + 1] / values.lengths[k]]
            elif values.moves[k]:
                columns, slopes = [*columns, across], [*slopes, slopes[-1]]
        return np.concatenate(columns, axis=1), np.concatenate(slopes)

    @property
    def bent(self) -> bool:
        """Whether the equations of the present cell are not linear."""
        return bool(np.any(self._bent))

    def reach(self, values: Values) -> Array:
        """How far the curved sites may move in one step, in units of s, (m,); infinite for the others."""
        return np.asarray(self._deviations.reach(values.lengths) / self.length)


def _blocks(values: Values, name: str) -> Array:
    """The derivatives of vectors along e by z: radial and across, (p, 2, 2)."""
    e, m1 = values.directions, len(values.s) - len(values.directions)
    radial = getattr(values, name)[m1:]
    lengths = (values.lengths if name == "moves" else values.tractions)[m1:]
    across = np.divide(lengths, values.s[m1:], out=radial.copy(), where=values.s[m1:] > 0.0)
    outer = np.einsum("pi,pj->pij", e, e)
    return np.asarray(across[:, None, None] * (np.eye(2) - outer) + radial[:, None, None] * outer)
