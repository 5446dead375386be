"""Facets in Legendre modes: data sampled within them, and what displacement of the body a traction in a mode causes.

A traction of wave number k on a half-space moves its surface by an amplitude of L⁻¹/k (:mod:`.half_space`). The
Legendre mode of degree l oscillates over a facet as a wave of l + ½ half-lengths does: on a half-plane the energy of
its displacement is larger than that of this wave by 1 + 1/(4 l (l + 1)), since ∫ j_l(k)²/k dk = 1/(2 l (l + 1)).
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import basix
import numpy as np
from dolfinx import fem

from ...problem.problem import Problem
from ...problem.stiffness_tensor import stiffness_tensor
from ...typing import Array, Entities
from . import half_space
from .boundary_data import FacetSamples, sample
from .thresholds import EstimateThresholds


@dataclass(frozen=True)
class FacetModes(FacetSamples):
    """Legendre modes (m of them) on facets (f), at q sample points.

    Attributes:
        values: of the modes at the points, orthonormal under the weights, (m, q).
        degrees: of the modes, (m,).
        compliance: nondimensional displacement by traction of the wave of one half-length, along each axis, (f, d).
    """

    values: Array
    degrees: Array
    compliance: Array

    def coefficients(self, sampled: Array) -> Array:
        """The coefficients of sampled values (f, q), (f, m)."""
        return np.asarray((sampled * self.weights) @ self.values.T)

    def energies(self, tractions: Array, compliance: Array, lowest: int) -> Array:
        """Energies a(w, w) of the displacements w that tractions cause, (f,).

        Args:
            tractions: nondimensional, (f, q).
            compliance: of the facets in the direction of the tractions, (f,).
            lowest: degree from which modes count.
        """
        squares = self.coefficients(tractions) ** 2 / (self.degrees + 0.5)
        return np.asarray(self.facets.areas * compliance * np.sum(squares[:, self.degrees >= lowest], axis=1))

    def energies_of_displacements(self, displacements: Array, compliance: Array) -> Array:
        """Energies a(w, w) of displacements w, (f,).

        Args:
            displacements: nondimensional, (f, q).
            compliance: of the facets in the direction of the displacements, (f,).
        """
        squares = self.coefficients(displacements) ** 2 * (self.degrees + 0.5)
        return np.asarray(self.facets.areas / compliance * np.sum(squares, axis=1))


def facet_modes(
    problem: Problem, bubbles: fem.FunctionSpace, facets: Entities, thresholds: EstimateThresholds
) -> FacetModes:
    """The modes on boundary facets. Collective.

    Args:
        problem: the mesh.
        bubbles: the space of bubbles.
        facets: the local facets.
        thresholds: how many modes.
    """
    at, d = sample(problem, bubbles, facets, thresholds), problem.scales.dimension
    degree, kind = thresholds.data_degree[d - 2], basix.CellType.interval if d == 2 else basix.CellType.triangle
    legendre: Any = basix.tabulate_polynomials(basix.PolynomialType.legendre, kind, degree, at.barycentric[:, 1:])
    values = legendre / math.sqrt(math.factorial(d - 1))
    degrees = np.concatenate([np.full(math.comb(n + d - 2, d - 2), n) for n in range(degree + 1)])
    material = stiffness_tensor(problem.bulk, at.facets.cells)
    size = (math.factorial(d - 1) * at.facets.areas) ** (1 / (d - 1))  # in space, a leg of a right triangle
    compliance = size[:, None] / math.pi * half_space.surface_compliance(material, at.corners)
    return FacetModes(at.facets, at.nodes, at.barycentric, at.weights, values, degrees, compliance)
