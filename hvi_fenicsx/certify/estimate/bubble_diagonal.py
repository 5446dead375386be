"""The diagonal of the bubbles' stiffness, from energies of affine functions."""

from __future__ import annotations

import functools
import itertools
import math
from collections.abc import Iterator
from typing import Any

import numpy as np
import ufl
from dolfinx import fem

from ...mesh import nodes
from ...problem.problem import Problem
from ...problem.vectors import nodal_sum
from ...typing import Array
from .bubbles import Index, of_cell, quadrature, slope

_Slopes = tuple[float, ...]
"""The slopes of an affine function in the coordinates of the reference cell."""


def diagonal(problem: Problem, bubbles: fem.FunctionSpace) -> Array:
    """The diagonal of the bubbles' stiffness at the blocks that this rank owns, (n, d). Collective.

    On a cell in which the material is constant it is a sum of the energies of the affine functions λ_a and λ_a + λ_b
    (:func:`energy_shares`). At a bubble's own point no other bubble has a value, so a linear form whose quadrature
    points are these takes each sum to its bubble.

    Args:
        problem: whose elastic operator it is.
        bubbles: the space of bubbles.
    """
    v, integrals = ufl.TestFunction(bubbles), []
    densities = functools.cache(lambda slopes: _affine_densities(problem, slopes))
    for shares, places in _alike(problem).items():
        for number, integral in enumerate(_over_cells(problem.bulk.form)):
            each = (share * ufl.dot(densities(slopes)[number], v) for slopes, share in shares)
            integrals.append(integral.reconstruct(integrand=sum(each), metadata=_rule(places)))
    return nodal_sum(ufl.Form(integrals))


def _alike(problem: Problem) -> dict[tuple[tuple[_Slopes, float], ...], list[Index]]:
    """The bubbles of a cell by the shares that energies of affine functions have in theirs.

    The energies of λ_a + λ_b and of the others' sum are one, since all together are constant.
    """
    d, cell = problem.scales.dimension, problem.space.mesh.topology.cell_name()
    hats = np.vstack([-np.ones(d), np.eye(d)])
    slopes = [*hats, *(hats[a] + hats[b] for a, b in itertools.combinations(range(d + 1), 2))]
    upward = [tuple((slope * np.sign(slope[np.flatnonzero(slope)[0]])).tolist()) for slope in slopes]
    found: dict[tuple[tuple[_Slopes, float], ...], list[Index]] = {}
    for index in of_cell(nodes.degree(problem.space), cell):
        shares: dict[_Slopes, float] = {}
        for number, share in energy_shares(index, cell):
            shares[upward[number]] = shares.get(upward[number], 0.0) + share * 16 / ((d + 1) * (d + 2))
        found.setdefault(tuple(sorted(shares.items())), []).append(index)
    return found


def _rule(places: list[Index]) -> dict[str, Any]:
    """A quadrature rule of the points of some bubbles, each with the whole cell for its weight."""
    points = [[part / sum(index) for part in index[1:]] for index in places]
    weights = [1 / math.factorial(len(point)) for point in points]
    return {"quadrature_rule": "custom", "quadrature_points": points, "quadrature_weights": weights}


def _affine_densities(problem: Problem, slopes: _Slopes) -> list[Any]:
    """The energy densities of an affine function along each axis, vectors in UFL, by the operator's integrals.

    The function vanishes at the middle of the cell: where there is a foundation, its energy depends on that.
    """
    d, mesh = len(slopes), problem.space.mesh
    from_corner = ufl.SpatialCoordinate(mesh) - ufl.classes.CellVertices(mesh)[0, :]
    place = ufl.JacobianInverse(mesh) * from_corner - ufl.as_vector([1 / (d + 1)] * d)
    height = ufl.dot(ufl.as_vector(slopes), place)
    along = [height * ufl.as_vector([float(x) for x in axis]) for axis in np.eye(d)]
    each = [[integral.integrand() for integral in _over_cells(problem.bulk.between(w, w))] for w in along]
    return [ufl.as_vector(densities) for densities in zip(*each, strict=True)]


def _over_cells(form: Any) -> Iterator[Any]:
    """The integrals of a form over cells."""
    return (integral for integral in form.integrals() if integral.integral_type() == "cell")


@functools.cache
def energy_shares(index: Index, cell: str) -> list[tuple[int, float]]:
    """The energy of a bubble as a sum of those of affine functions: numbers and shares, times (d + 1)(d + 2)/16.

    The gradient is Σ ∂φ/∂λ_a ∇λ_a, so a(φ, φ) = Σ G_ab a(λ_a, λ_b), G_ab being the mean of ∂φ/∂λ_a ∂φ/∂λ_b.

    Args:
        index: of the bubble.
        cell: the name of the cell's shape.

    Returns:
        First of λ_a by a, then of λ_a + λ_b by pairs a < b; those that are zero are left out.
    """
    barycentric, weights = quadrature(cell, 4 * sum(index))
    slopes = [slope(index, corner, barycentric) for corner in range(len(index))]
    mean = np.array([[np.sum(weights * a * b) for b in slopes] for a in slopes])
    pairs = itertools.combinations(range(len(index)), 2)
    shares = [2 * mean[a, a] - mean[a].sum() for a in range(len(index))] + [mean[a, b] for a, b in pairs]
    rounded = np.round(np.array(shares) * len(index) * (len(index) + 1) / 16, 12)
    return [(number, float(share)) for number, share in enumerate(rounded) if share]
