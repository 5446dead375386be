"""Unknowns of Γc that carry nothing, eliminated from a stiffness of arrays beside those that stay."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Self

import numpy as np
from scipy.linalg import cho_factor, cho_solve
from scipy.linalg.lapack import dpstrf

from ..system.interior import Interior
from ..system.rigid_motions import Motions
from ..system.system import System
from ..typing import Array, Integers


@dataclass(frozen=True, kw_only=True)
class Elimination:
    """Which of n unknowns stay, and how the others follow them.

    Attributes:
        stay: numbers of those that stay, ascending, (s,).
        gone: of the others, likewise, (g,).
        coupling: their rows of the stiffness in the columns of those that stay, (g, s).
        factor: of the stiffness of those that are gone, by Cholesky; None where there are none.
    """

    stay: Integers
    gone: Integers
    coupling: Array
    factor: Any | None

    @classmethod
    def of_none(cls, size: int) -> Self:
        """All unknowns stay.

        Args:
            size: n.
        """
        every = np.arange(size)
        return cls(stay=every, gone=every[:0], coupling=np.zeros((0, size)), factor=None)

    @classmethod
    def of(cls, whole: Array, carrying: Integers, rounding: float) -> Self:
        """Eliminate what carries nothing, as far as the others hold the body.

        Args:
            whole: the stiffness, (n, n).
            carrying: numbers of the unknowns that carry something.
            rounding: of its entries, relative.
        """
        rest = np.setdiff1d(np.arange(len(whole)), carrying)
        gone = np.sort(rest[_regular(whole[np.ix_(rest, rest)], len(whole) * rounding)])
        if not gone.size:
            return cls.of_none(len(whole))
        stay = np.setdiff1d(np.arange(len(whole)), gone)
        return cls(
            stay=stay, gone=gone, coupling=whole[np.ix_(gone, stay)], factor=cho_factor(whole[np.ix_(gone, gone)])
        )

    def stiffness(self, whole: Array) -> Array:
        """The stiffness of those that stay, (s, s).

        Args:
            whole: of all, (n, n).
        """
        if not self.gone.size:
            return whole
        found = whole[np.ix_(self.stay, self.stay)] - self.coupling.T @ self._solve(self.coupling)
        return 0.5 * (found + found.T)

    def reduced(self, forces: Array) -> Array:
        """Forces on all unknowns as forces on those that stay, (s, ...).

        Args:
            forces: (n, ...).
        """
        return forces[self.stay] - self.coupling.T @ self._solve(forces[self.gone])

    def completed(self, values: Array, forces: Array) -> Array:
        """All unknowns, in balance where they are gone, (n,).

        Args:
            values: of those that stay, (s,).
            forces: on all, (n,).
        """
        found = np.empty(len(forces))
        found[self.stay] = values
        found[self.gone] = self._solve(forces[self.gone] - self.coupling @ values)
        return found

    def works(self, some: Array, others: Array) -> Array:
        """The work of some forces on what others displace of those that are gone, the rest standing, (k, l).

        Args:
            some: on all unknowns, (n, k).
            others: likewise, (n, l).
        """
        return self._solve(some[self.gone]).T @ others[self.gone]

    def _solve(self, right: Array) -> Array:
        """The inverse stiffness of those that are gone times columns."""
        return right if self.factor is None else cho_solve(self.factor, right)


def _regular(matrix: Array, tolerance: float) -> Integers:
    """Numbers of the unknowns in a greatest regular part of a semidefinite matrix (pivoted Cholesky)."""
    if not matrix.size:
        return np.empty(0, np.int64)
    _, pivots, rank, _ = dpstrf(matrix, tol=tolerance * float(np.max(np.diag(matrix))), lower=1)
    return pivots[:rank] - 1


_UNSEEN = 1e-10
"""A motion that moves no condensed unknown, relative to the one that moves them most."""


def balanced(
    system: System, interior: Interior, stay: Integers, stiffness: Array, force: Array, loads: Array
) -> tuple[Array, Array]:
    """A stiffness and condensed loads as rounding has not changed them along rigid motions. Collective.

    The motions are those that the supports of bodies leave; none where something resists them, or the unknowns do not
    see each.

    Args:
        system: the system.
        interior: its unknowns of Γc.
        stay: those of them that the condensed problem has.
        stiffness: symmetric, (n, n).
        force: condensed loads, (n, k).
        loads: the same on the bodies, this rank's, (local unknowns, k).

    Returns:
        A stiffness whose forces along the motions are zero, and loads whose work in them is that on the bodies.
    """
    fields = _fields(system)
    q, triangle = np.linalg.qr(interior.gathered(fields)[stay])
    lengths = np.abs(np.diagonal(triangle))
    if len(lengths) < fields.shape[1] or np.any(lengths <= _UNSEEN * np.max(lengths, initial=0.0)):
        return stiffness, force
    work = np.linalg.solve(triangle.T, system.comm.allreduce(fields.T @ loads))
    defect = stiffness @ q
    found = stiffness - defect @ q.T - q @ (defect.T - (q.T @ defect) @ q.T)
    return 0.5 * (found + found.T), force + q @ (work - q.T @ force)


def _fields(system: System) -> Array:
    """The motions at this rank's unknowns, (local unknowns, j)."""
    problem = system.problem
    if problem.bulk.foundation is not None or system.comm.allreduce(len(system.pins)):
        return np.zeros((system.load.local_size, 0))
    fields = [field for body in problem.bodies for field in Motions.of(problem, body).fields]
    local = [system.frames.local_components(field) for field in fields]
    return np.array(local).reshape(len(fields), system.load.local_size).T
