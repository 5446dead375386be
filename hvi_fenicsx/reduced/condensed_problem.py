"""An inequality on the unknowns of Γc alone, as arrays: the energy ½ xᵀS x - f(λ)ᵀx + Σ w j over lower ≤ x ≤ upper.

Nondimensional, and the same on all ranks.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.polynomial.polynomial import polyval

from ..effects import Direction
from ..laws import Mixity, Superpotential, VertexLaws
from ..typing import Array, Integers
from .condensed_stiffness import CondensedStiffness


@dataclass(frozen=True, kw_only=True)
class Bonds:
    """One law at m vertices of one part.

    Attributes:
        law: j.
        unknowns: numbers of the unknowns that it acts on, (m, k); k > 1 for a law on a length.
        signs: the law's argument is signs * x[unknowns] (k = 1), or the length of that vector, (m, k).
        opens: whether the first unknown is an opening, which counts in the length only where it is positive.
        mixity: how the energy of separation depends on the mode; None: it does not.
        weights: lumped areas times the law's multiplier, (m,).
        part: name of the part.
        direction: which displacement it acts on.
        points: the vertices, m, (m, 3).
    """

    law: Superpotential
    unknowns: Integers
    signs: Array
    weights: Array
    part: str
    direction: Direction
    points: Array
    opens: bool = False
    mixity: Mixity | None = None

    @property
    def radial(self) -> bool:
        """Whether the law acts on a length."""
        return self.opens or self.unknowns.shape[1] > 1

    @property
    def laws(self) -> VertexLaws:
        """The law at its vertices, over their coordinates: of a length that itself, else the unknown."""
        factors = np.ones(len(self.weights)) if self.radial else self.signs[:, 0]
        return VertexLaws(law=self.law, factors=factors, weights=self.weights)

    def argument(self, x: Array) -> Array:
        """What the law acts on, (m,).

        Args:
            x: the unknowns, (n,).
        """
        vectors = self.signs * x[self.unknowns]
        if self.opens:
            vectors[:, 0] = np.maximum(vectors[:, 0], 0.0)
        return np.linalg.norm(vectors, axis=1) if self.radial else vectors[:, 0]

    def energy(self, x: Array) -> float:
        """Σ w j.

        Args:
            x: the unknowns, (n,).
        """
        return float(self.weights @ self.law.value(self.argument(x)))


@dataclass(frozen=True, kw_only=True)
class PrescribedBonds:
    """One law at m vertices where the displacement that it acts on is prescribed.

    Attributes:
        law: j.
        weights: lumped areas times the law's multiplier, (m,).
        arguments: what the law acts on is arguments[0] + λ arguments[1], (2, m).
    """

    law: Superpotential
    weights: Array
    arguments: Array

    def energy(self, factor: float) -> float:
        """Σ w j.

        Args:
            factor: λ.
        """
        return float(self.weights @ self.law.value(self.arguments[0] + factor * self.arguments[1]))


@dataclass(frozen=True, kw_only=True)
class CondensedProblem:
    """The n unknowns of Γc that carry a bound or a law, and few others where a body could move about these.

    Attributes:
        elastic: S, symmetric, positive semidefinite.
        force: f of constant loads and prescribed displacements, (n,).
        force_rate: f of those that the factor scales, (n,).
        lower: bounds, -inf where there is none, (n,).
        upper: bounds, inf where there is none, (n,).
        bonds: the laws.
        prescribed_bonds: those at prescribed displacements.
        constant: c0, c1, c2: the energy has the constant c0 + c1 λ + c2 λ², (3,).
        applied: loads without thermal strain and the forces of prescribed displacements, constant and scaled; with
            ``applied_constant`` the product <g, u> = (applied[0] + λ applied[1])ᵀx + constant, (2, n).
        applied_constant: c0, c1, c2 likewise, (3,).
        points: the vertices of the unknowns, m, (n, 3).
        parts: the part whose contact bounds the unknown; empty where none does, (n,).
    """

    elastic: CondensedStiffness
    force: Array
    force_rate: Array
    lower: Array
    upper: Array
    bonds: tuple[Bonds, ...]
    prescribed_bonds: tuple[PrescribedBonds, ...] = ()
    constant: Array
    applied: Array
    applied_constant: Array
    points: Array
    parts: tuple[str, ...]

    @property
    def stiffness(self) -> Array:
        """S as an array, (n, n). Collective."""
        return self.elastic.array

    @property
    def size(self) -> int:
        """Number of unknowns n."""
        return len(self.force)

    def load(self, factor: float) -> Array:
        """The load f, (n,).

        Args:
            factor: λ.
        """
        return self.force + factor * self.force_rate

    def energy(self, x: Array, factor: float = 1.0) -> float:
        """½ a(u, u) - <g, u> + Σ w j(u) of the body in equilibrium with x.

        Args:
            x: the unknowns, (n,).
            factor: λ.
        """
        elastic = 0.5 * float(x @ (self.elastic @ x)) - float(self.load(factor) @ x) + self.constant_at(factor)
        return elastic + sum(bonds.energy(x) for bonds in self.bonds)

    def constant_at(self, factor: float) -> float:
        """The part of the energy that x does not change.

        Args:
            factor: λ.
        """
        return float(polyval(factor, self.constant)) + sum(bonds.energy(factor) for bonds in self.prescribed_bonds)

    def potential(self, x: Array, factor: float) -> float:
        """<g, u>: the loads times the displacements of the body in equilibrium with x.

        Args:
            x: the unknowns, (n,).
            factor: λ.
        """
        return float((self.applied[0] + factor * self.applied[1]) @ x + polyval(factor, self.applied_constant))
