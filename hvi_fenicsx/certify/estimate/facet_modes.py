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
from ...spatial_value import SpatialValue
from ...typing import Array, Entities
from .contact_facets import ContactFacets, contact_facets
from .edge_bubbles import BubbleStiffness, quadrature
from .thresholds import Thresholds


@dataclass(frozen=True)
class FacetModes:
    """Legendre modes (m of them) on facets (f), at q sample points.

    Attributes:
        facets: whose cells this rank owns.
        points: the sample points, m, (f, q, 3).
        barycentric: the same in barycentric coordinates, (q, d).
        weights: of the points; their sum is 1, (q,).
        values: of the modes at the points, orthonormal under the weights, (m, q).
        degrees: of the modes, (m,).
        compliance: nondimensional displacement by traction of the wave of one half-length, along each axis, (f, d).
    """

    facets: ContactFacets
    points: Array
    barycentric: Array
    weights: Array
    values: Array
    degrees: Array
    compliance: Array

    def of(self, value: SpatialValue) -> Array:
        """A value at the sample points, SI, (f, q)."""
        return value.at(self.points.reshape(-1, 3)).reshape(self.points.shape[:2])

    def linear(self, at_vertices: Array) -> Array:
        """Values at the facets' vertices (f, d), interpolated; (f, q)."""
        return np.asarray(at_vertices @ self.barycentric.T)

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
    found, d = contact_facets(problem, stiffness.space, facets), problem.scales.dimension
    degree = thresholds.data_degree[d]
    barycentric, weights = quadrature("interval" if d == 2 else "triangle", 2 * degree)
    points = np.einsum("qv,fvi->fqi", barycentric, problem.points[found.vertices])
    kind = basix.CellType.interval if d == 2 else basix.CellType.triangle
    legendre: Any = basix.tabulate_polynomials(basix.PolynomialType.legendre, kind, degree, barycentric[:, 1:])
    values = legendre / math.sqrt(math.factorial(d - 1))
    degrees = np.concatenate([np.full(math.comb(n + d - 2, d - 2), n) for n in range(degree + 1)])
    return FacetModes(
        found, points, barycentric, weights, values, degrees, thresholds.half_space * _compliance(stiffness, found)
    )


def _compliance(stiffness: BubbleStiffness, facets: ContactFacets) -> Array:
    """∫ b² over the facets of an edge's bubble b, over its energy: the mean of each facet's edges, (f, d).

    An edge in space has two facets.
    """
    d = facets.vertices.shape[1]
    square = {2: 8 / 15, 3: 2 * 8 / 45}[d] * facets.areas
    rates = stiffness.rates()[facets.edges]
    return np.asarray(square[:, None] * rates.mean(axis=1))
