"""The diagonal of the bubbles' stiffness, from energies of affine functions."""

from __future__ import annotations

import functools
import itertools
import math
from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np
import ufl
from dolfinx import fem

from ...mesh import nodes
from ...problem.problem import Problem
from ...problem.vectors import nodal_sum
from ...typing import Array
from .bubbles import Index, of_cell, quadrature, shape, slope


def diagonal(problem: Problem, bubbles: fem.FunctionSpace) -> Array:
    """The diagonal of the bubbles' stiffness at the blocks that this rank owns, (n, d). Collective.

    On a cell in which the material is constant it is a sum of the energies of the affine functions λ_a and λ_a + λ_b
    (:func:`energy_shares`); what a foundation adds is that of a constant, by the mean of the bubble's square. At a
    bubble's own point no other bubble has a value, so a linear form whose quadrature points are these takes each
    energy to the bubbles that have a share in it.

    Args:
        problem: whose elastic operator it is.
        bubbles: the space of bubbles.
    """
    v, integrals = ufl.TestFunction(bubbles), []
    for form, height, shares in _energies(problem):
        each = [_over_cells(_energy(problem, form, height, axis)) for axis in range(problem.scales.dimension)]
        for along in zip(*each, strict=True):
            density = ufl.dot(ufl.as_vector([integral.integrand() for integral in along]), v)
            for share in sorted(set(shares.values())):
                rule = _rule([index for index, own in shares.items() if own == share])
                integrals.append(along[0].reconstruct(integrand=share * density, metadata=rule))
    return nodal_sum(ufl.Form(integrals))


def _energies(problem: Problem) -> Iterator[tuple[Any, Any, Mapping[Index, float]]]:
    """Functions whose energies make up those of a cell's bubbles: the form, the function, the bubbles' shares.

    The energies of λ_a + λ_b and of the others' sum are one, since all together are constant.
    """
    d, cell = problem.scales.dimension, problem.space.mesh.topology.cell_name()
    hats, of_bubbles = np.vstack([-np.ones(d), np.eye(d)]), of_cell(nodes.degree(problem.space), cell)
    slopes = [*hats, *(hats[a] + hats[b] for a, b in itertools.combinations(range(d + 1), 2))]
    upward = [tuple((one * np.sign(one[np.flatnonzero(one)[0]])).tolist()) for one in slopes]
    of_slopes: dict[tuple[float, ...], dict[Index, float]] = {}
    for index in of_bubbles:
        for number, share in energy_shares(index, cell):
            shares = of_slopes.setdefault(upward[number], {})
            shares[index] = shares.get(index, 0.0) + share * 16 / ((d + 1) * (d + 2))
    mesh = problem.space.mesh
    place = ufl.JacobianInverse(mesh) * (ufl.SpatialCoordinate(mesh) - ufl.classes.CellVertices(mesh)[0, :])
    for affine, shares in of_slopes.items():
        yield problem.bulk.material, ufl.dot(ufl.as_vector(affine), place), shares
    if problem.bulk.foundation is not None:
        squares = {index: _mean_square(index, cell) for index in of_bubbles}
        yield problem.bulk.foundation, fem.Constant(mesh, 1.0), squares


def _energy(problem: Problem, form: Any, height: Any, axis: int) -> Any:
    """The form of the energy of a function along an axis, in UFL."""
    d, arguments = problem.scales.dimension, problem.bulk.form.arguments()
    moved = ufl.as_vector([height if i == axis else 0.0 for i in range(d)])
    return ufl.replace(form, dict.fromkeys(arguments, moved))


def _over_cells(form: Any) -> list[Any]:
    """The integrals of a form over cells."""
    return [integral for integral in form.integrals() if integral.integral_type() == "cell"]


def _rule(places: list[Index]) -> dict[str, Any]:
    """A quadrature rule of the points of some bubbles, each with the whole cell for its weight."""
    points = [[part / sum(index) for part in index[1:]] for index in places]
    weights = [1 / math.factorial(len(point)) for point in points]
    return {"quadrature_rule": "custom", "quadrature_points": points, "quadrature_weights": weights}


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


@functools.cache
def _mean_square(index: Index, cell: str) -> float:
    """The mean of the square of a bubble over a cell.

    Args:
        index: of the bubble.
        cell: the name of the cell's shape.
    """
    barycentric, weights = quadrature(cell, 2 * sum(index))
    return float(np.round(np.sum(weights * shape(index, barycentric) ** 2), 12))
