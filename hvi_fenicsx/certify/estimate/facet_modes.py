"""Facets in Legendre modes: data sampled within them, and what displacement of the body a traction in a mode causes.

A traction of wave number k on a half-space moves its surface by an amplitude proportional to 1/k. The Legendre mode of
degree l oscillates over a facet as a wave of l + ½ half-lengths does, and the edge bubble is the wave of one. So the
compliance of the bubble gives that of the modes, whatever the material: times what a half-space is more compliant than
a bubble, which reaches one cell deep, and over l + ½.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import basix
import numpy as np

from ...problem.problem import Problem
from ...typing import Array, Entities
from .boundary_data import FacetSamples, sample
from .contact_facets import ContactFacets
from .edge_bubbles import BubbleStiffness
from .thresholds import Thresholds


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


def facet_modes(problem: Problem, stiffness: BubbleStiffness, facets: Entities, thresholds: Thresholds) -> FacetModes:
    """The modes on boundary facets. Collective.

    Args:
        problem: the mesh.
        stiffness: of the bubbles.
        facets: the local facets.
        thresholds: how many modes.
    """
    at, d = sample(problem, stiffness.space, facets, thresholds), problem.scales.dimension
    degree, kind = thresholds.data_degree[d], basix.CellType.interval if d == 2 else basix.CellType.triangle
    legendre: Any = basix.tabulate_polynomials(basix.PolynomialType.legendre, kind, degree, at.barycentric[:, 1:])
    values = legendre / math.sqrt(math.factorial(d - 1))
    degrees = np.concatenate([np.full(math.comb(n + d - 2, d - 2), n) for n in range(degree + 1)])
    compliance = thresholds.half_space * _compliance(stiffness, at.facets)
    return FacetModes(at.facets, at.corners, at.barycentric, at.weights, values, degrees, compliance)


def _compliance(stiffness: BubbleStiffness, facets: ContactFacets) -> Array:
    """∫ b² over the facets of an edge's bubble b, over its energy: the mean of each facet's edges, (f, d).

    An edge in space has two facets.
    """
    d = facets.vertices.shape[1]
    square = {2: 8 / 15, 3: 2 * 8 / 45}[d] * facets.areas
    rates = stiffness.rates()[facets.edges]
    return np.asarray(square[:, None] * rates.mean(axis=1))
