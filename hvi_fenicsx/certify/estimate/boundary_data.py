"""The data on the boundary that vary in space, and samples of them within facets."""

from __future__ import annotations

import functools
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from dolfinx import fem

from ...formula import SpatialValue
from ...problem import spaces
from ...problem.problem import Bounds, Problem
from ...typing import Array, Entities
from .bubbles import quadrature
from .contact_facets import ContactFacets, contact_facets
from .thresholds import EstimateThresholds


def varies(value: SpatialValue | None) -> bool:
    """Whether a value varies in space and is known between nodes."""
    return value is not None and value.everywhere and not value.is_number


def tractions(problem: Problem) -> Iterator[tuple[Entities, int, SpatialValue]]:
    """The facets, the component and the value of each traction that varies."""
    for where, effect, _ in problem.contributions:
        load = effect.surface_load()
        if where is None or load is None:
            continue
        for axis, value in enumerate(load.components):
            if varies(value):
                yield problem.part_facets[where], axis, value


def gaps(problem: Problem) -> Iterator[tuple[Bounds, SpatialValue | None, SpatialValue | None]]:
    """The bounds of each part of the boundary with contact, and the values of lower and upper -u·n that vary."""
    stated = [b for where, _, c in problem.contributions if where is not None for b in c.bounds]
    for bounds, values in zip(problem.bounds, stated, strict=True):
        if problem.interface_of(bounds.surface) is not None:
            continue
        lower, upper = (value if varies(value) else None for value in (values.lower, values.upper))
        yield bounds, lower, upper


def everything(problem: Problem) -> Iterator[tuple[Entities, SpatialValue]]:
    """The facets and the value of all that varies on the boundary."""
    for facets, _, value in tractions(problem):
        yield facets, value
    for part in problem.prescribed:
        if varies(part.value):
            yield part.facets, part.value
    for bounds, *values in gaps(problem):
        yield from ((bounds.surface.facets, value) for value in values if value is not None)


@dataclass(frozen=True)
class FacetSamples:
    """Sample points (q of them) within facets (f).

    Attributes:
        facets: whose cells this rank owns.
        nodes: their nodes, corners first, m, (f, n, 3).
        barycentric: the sample points in barycentric coordinates, (q, d).
        weights: of the points; their sum is 1, (q,).
    """

    facets: ContactFacets
    nodes: Array
    barycentric: Array
    weights: Array

    @property
    def corners(self) -> Array:
        """The vertices, m, (f, d, 3)."""
        return self.nodes[:, : self.facets.dimension]

    def interpolated(self, at_nodes: Array, at: Array | None = None) -> Array:
        """Values at the nodes, interpolated at points, (f, q).

        Args:
            at_nodes: the values, (f, n).
            at: the points in barycentric coordinates, (q, d); by default the sample points.
        """
        points = self.barycentric if at is None else at
        return np.asarray(at_nodes @ spaces.simplex_functions(self.facets.degree, points).T)

    def of(self, value: SpatialValue, at: Array | None = None) -> Array:
        """A value at points, SI, (f, q).

        Args:
            value: on the boundary.
            at: the points in barycentric coordinates, (q, d); by default the sample points.
        """
        points = self.points if at is None else self.places(at)
        return value.at(points.reshape(-1, 3)).reshape(points.shape[:2])

    @functools.cached_property
    def points(self) -> Array:
        """The sample points, m, (f, q, 3)."""
        return self.places(self.barycentric)

    def places(self, at: Array) -> Array:
        """Points of the facets, on the curve where a facet is curved, m, (f, q, 3).

        Args:
            at: in barycentric coordinates, (q, d).
        """
        return np.asarray(np.einsum("qn,fni->fqi", spaces.simplex_functions(self.facets.degree, at), self.nodes))

    def beyond_nodes(self, value: SpatialValue, at: Array | None = None) -> Array:
        """What interpolation between the nodes leaves of a value at points, SI, (f, q).

        Args:
            value: on the boundary.
            at: the points in barycentric coordinates, (q, d); by default the sample points.
        """
        at_nodes = value.at(self.nodes.reshape(-1, 3)).reshape(self.nodes.shape[:2])
        return np.asarray(self.of(value, at) - self.interpolated(at_nodes, at))


def sample(
    problem: Problem, bubbles: fem.FunctionSpace, facets: Entities, thresholds: EstimateThresholds
) -> FacetSamples:
    """Samples of boundary facets, exact for products of the modes of the data. Collective.

    Args:
        problem: the mesh.
        bubbles: the space of bubbles.
        facets: the local facets.
        thresholds: the degree of the modes.
    """
    found, d = contact_facets(problem, bubbles, facets), problem.scales.dimension
    barycentric, weights = quadrature("interval" if d == 2 else "triangle", 2 * thresholds.data_degree[d - 2])
    return FacetSamples(found, problem.positions[found.nodes], barycentric, weights)
