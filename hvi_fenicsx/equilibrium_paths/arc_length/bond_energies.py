"""What bonds give back and have lost, where that depends on what they remember or on the mode of their site."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass

import numpy as np

from ...reduced.condensed_problem import CondensedProblem
from ...typing import Array, Integers
from .law_rows import LawRows, law_rows
from .sites import Sites, Values
from .vertex_laws import VertexLaw


@dataclass(frozen=True, kw_only=True)
class _Group:
    """One law at r vertices.

    Attributes:
        rows: the law in arrays.
        laws: the laws of the vertices.
        sites: their numbers, (r,).
        shared: the vertices at whose site another law acts, too.
    """

    rows: LawRows
    laws: list[VertexLaw]
    sites: Integers
    shared: list[int]

    def tractions(self, sites: Sites, lengths: Array, forces: Array) -> Array:
        """What each vertex has of the force at its site, (r,).

        Args:
            sites: all sites.
            lengths: of the displacements by site, (m,).
            forces: of all laws of each site, (m,).
        """
        found = np.asarray(forces[self.sites] / self.rows.bonds.weights)
        for row in self.shared:
            k, law = int(self.sites[row]), self.laws[row]
            shares = sites.shares(k, float(lengths[k]), float(forces[k]))
            found[row] = next(share for other, share in zip(sites.laws[k], shares, strict=True) if other is law)
        return found

    def memory(self) -> Array:
        """What the vertices remember, (r, 4)."""
        return np.array([law.memory() for law in self.laws])


class BondEnergies:
    """The energies of the bonds with memory, and of those whose energy depends on the mode.

    Args:
        problem: the problem.
        sites: its sites.

    Attributes:
        numbers: of these among the problem's bonds.
    """

    def __init__(self, problem: CondensedProblem, sites: Sites) -> None:
        self._sites = sites
        remember = {law.group for law in sites.vertices if law.passed is not None}
        self.numbers = sorted(remember | {n for n, bonds in enumerate(problem.bonds) if bonds.mixity is not None})
        self._groups = [_group(n, problem, remember, sites) for n in self.numbers]

    def __call__(self, values: Values) -> tuple[float, Array, Array]:
        """What they give back, what each has lost for 1 at its mode, and the scales by mode, (b,).

        Args:
            values: of the sites.
        """
        back, forces = 0.0, self._sites.bond_forces(values)
        lost: list[Array] = []
        scales: list[Array] = []
        for group in self._groups:
            x, scale = values.lengths[group.sites], values.energies[group.sites]
            traction = group.tractions(self._sites, values.lengths, forces)
            back += float(scale @ group.rows.recoverable(x, traction))
            lost.append(group.rows.dissipated(x, traction, group.memory()))
            scales.append(scale)
        return back, np.concatenate([np.zeros(0), *lost]), np.concatenate([np.zeros(0), *scales])


def _group(number: int, problem: CondensedProblem, remember: Collection[int], sites: Sites) -> _Group:
    laws = [law for law in sites.vertices if law.group == number]
    at = sites.site_of[[law.unknowns[0] for law in laws]]
    shared = [row for row, k in enumerate(at) if len(sites.laws[k]) > 1]
    return _Group(rows=law_rows(problem, remember)[number], laws=laws, sites=at, shared=shared)
