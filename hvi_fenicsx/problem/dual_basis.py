"""The relative displacement of two sides at the nodes of the first, by a dual basis (Wohlmuth 2000).

For the nodes i that carry contact and laws there are functions ψ_i of the first side's facets with
∫ψ_i φ_j = δ_ij ∫φ_j for all such j, and Σψ_i = 1 wherever the second side is. The relative displacement at i is

    w_i = (∫ψ_i u_first - ∫ψ_i u_second) / ∫ψ_i,

its weight ∫ψ_i. A node that carries nothing (beyond the end of the second side, prescribed, on another part) leaves
its share to its neighbours (Cichosz and Bischoff 2011), and a facet of none but such nodes to the nearest one that
carries. So affine fields are reproduced, and the forces of both sides balance, whatever the meshes, and wherever the
second side ends.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from itertools import combinations

import numpy as np
from dolfinx import fem
from petsc4py import PETSc
from scipy.sparse import bsr_array, csr_array, diags_array, eye_array, kron

from ..geometry import ROUNDING
from ..typing import Array, Integers, Mask, magnitude
from .facet_overlaps import OverlapPoints, Overlaps
from .facets import Facets
from .scaling import DEFAULT


@dataclass(frozen=True, kw_only=True)
class RelativeRows:
    """Rows over all N nodes of the mesh: one for each node of the first side that carries something.

    Attributes:
        weights: ∫ψ_i, by node of the mesh, 0 for all others, m^(d-1), (N,).
        first: ∫ψ_i φ_j / ∫ψ_i on the first side, (N, N).
        second: that on the second, (N, N), or what it is for vectors, (N d, N d).
    """

    weights: Array
    first: csr_array
    second: csr_array


def relative_rows(first: Facets, second: Facets, overlaps: Overlaps, kept: Mask, size: int) -> RelativeRows:
    """The rows of two sides.

    Args:
        first: the side that carries contact and laws.
        second: the other one.
        overlaps: of their facets.
        kept: whether a node of the first side's facets carries anything, (f, n).
        size: N.
    """
    points = overlaps.points(first.degree)
    functions = first.functions(points.on_first)
    basis, carriers = _coefficients(points, functions, kept), first.nodes.copy()
    for facet, node in adopted(first, overlaps, kept).items():
        basis[facet, 0], carriers[facet, 0] = 1.0, node
    values = np.einsum("pik,pk->pi", basis[points.first], functions)  # ψ at the points
    values *= points.weights[:, None]
    rows = carriers[points.first]
    weights = np.bincount(rows.ravel(), weights=values.ravel(), minlength=size).astype(np.float64)
    values *= np.divide(1.0, weights, out=np.zeros(size), where=weights > 0.0)[rows]
    return RelativeRows(
        weights=weights,
        first=_sums(rows, rows, values, functions, size),
        second=_sums(rows, second.nodes[points.second], values, second.functions(points.on_second), size),
    )


def rigid_rows(rows: RelativeRows, places: Array, meets: Array) -> RelativeRows:
    """The rows with the second side's displacement where the nodes of the first meet it, off its facets.

    It is that of the facets, and what the rotation that is nearest to the displacements of their nodes adds: so rigid
    motions are exact.

    Args:
        rows: of the nodes' functions.
        places: the coefficients of the nodes' positions, m, (N, d).
        meets: where the second side is met by those nodes of the first that carry something, m, (m, d).
    """
    own, d = np.flatnonzero(rows.weights), places.shape[1]
    met, spins = rows.second[own], np.array([np.outer(b, a) - np.outer(a, b) for a, b in combinations(np.eye(d), 2)])
    shares, row = abs(met), np.repeat(np.arange(len(own)), np.diff(met.indptr))
    centres = shares @ places / shares.sum(axis=1)[:, None]
    turns = np.einsum("kd,rde->kre", places[met.indices] - centres[row], spins)
    moments = shares.data[:, None, None] * turns
    inertia = np.add.reduceat(moments @ turns.transpose(0, 2, 1), met.indptr[:-1])
    way = meets - met @ places
    way[np.abs(way) <= 10.0 * DEFAULT.rounding * magnitude(places)] = 0.0  # where sides are flat
    lever = np.einsum("id,rde->ier", way, spins)
    entries = (lever @ np.linalg.pinv(inertia, ROUNDING))[row] @ moments + met.data[:, None, None] * np.eye(d)
    vectors = bsr_array((entries, met.indices, rows.second.indptr), (places.size, places.size))
    return replace(rows, second=csr_array(vectors))


def adopted(first: Facets, overlaps: Overlaps, kept: Mask) -> dict[int, int]:
    """The facets without a node of their own that carries something, and the nearest such node of a neighbour.

    Its ψ is 1 there: it stays orthogonal to the functions of all nodes that carry something.

    Args:
        first: the side that carries contact and laws.
        overlaps: of its facets.
        kept: whether a node of its facets carries anything, (f, n).
    """
    found = {}
    for facet in np.setdiff1d(overlaps.first, np.flatnonzero(kept.any(axis=1))):
        near = kept & np.any(np.isin(first.nodes, first.nodes[facet]), axis=1, keepdims=True)
        if near.any():
            away = np.linalg.norm(first.points[near] - first.corners[facet].mean(axis=0), axis=1)
            found[int(facet)] = int(first.nodes[near][np.argmin(np.round(away / away.max(), 9))])
    return found


def _sums(rows: Integers, columns: Integers, values: Array, functions: Array, size: int) -> csr_array:
    """Sums of values (p, n) times functions (p, n) at rows and columns."""
    entries, *at = np.broadcast_arrays(np.einsum("pi,pk->pik", values, functions), rows[:, :, None], columns[:, None])
    found = csr_array((entries.ravel(), [one.ravel() for one in at]), (size, size))
    found.eliminate_zeros()
    return found


def _coefficients(points: OverlapPoints, functions: Array, kept: Mask) -> Array:
    """ψ_i = Σ_k basis_ik φ_k on each facet, zero rows where a node carries nothing, (f, n, n)."""
    count, each = kept.shape
    mass = np.zeros((count, each, each))
    products = np.einsum("p,pk,pj->pkj", points.weights, functions, functions)
    np.add.at(mass, points.first, products)
    areas, spread = mass.sum(axis=1), means(kept).transpose(0, 2, 1)
    own = kept & areas.any(axis=1, keepdims=True)
    gram = np.where(own[:, :, None] & own[:, None], spread @ mass, np.eye(each))
    return areas[:, :, None] * np.linalg.solve(gram, spread)


def means(kept: Mask) -> Array:
    """Weights (f, n, n) by which nodes that carry something (f, n) stay as they are, others are the mean of these."""
    count = kept.shape[1]
    shares = kept / np.maximum(kept.sum(axis=1, keepdims=True), 1)
    return np.where(kept[:, :, None], np.eye(count), shares[:, None, :])


@dataclass(frozen=True)
class Coupling:
    """The way between displacements u and unknowns û, both in Cartesian components.

    Attributes:
        space: of the displacements.
        matrix: T.
        inverse: T⁻¹.
    """

    space: fem.FunctionSpace
    matrix: PETSc.Mat
    inverse: PETSc.Mat

    def product(self, multiply: Callable[[PETSc.Vec, PETSc.Vec], None], values: Array) -> Array:
        """A product with a local array, of which the owned values count, in its shape, ghosts updated. Collective.

        Args:
            multiply: by one of the matrices or its transpose.
            values: of the owned vertices first.
        """
        function = fem.Function(self.space)
        right, left = self.matrix.createVecs()
        right.array[:] = values.ravel()[: right.local_size]
        multiply(right, left)
        function.x.array[: left.local_size] = left.array_r
        function.x.scatter_forward()
        right.destroy()
        left.destroy()
        return function.x.array[: values.size].reshape(values.shape)


def coupled(space: fem.FunctionSpace, interfaces: Sequence[RelativeRows]) -> Coupling | None:
    """The coupling of interfaces; None where there are none. Collective.

    Args:
        space: of the displacements.
        interfaces: the rows of each; no node with a weight is combined by another.
    """
    if not interfaces:
        return None
    d, numbers = space.dofmap.index_map_bs, space.dofmap.index_map
    size, (start, end) = numbers.size_global * d, np.array(numbers.local_range) * d
    same = inverse = forward = csr_array(eye_array(size, format="csr")[start:end])
    for one in interfaces:
        rows = csr_array(kron(one.first, np.eye(d)) - one.second)
        scale = rows.diagonal()[start:end]
        change = rows[start:end] - diags_array((scale != 0.0).astype(float)) @ same
        inverse = inverse + change
        over = np.divide(1.0, scale, out=np.zeros_like(scale), where=scale != 0.0)
        forward = forward - diags_array(over) @ change
    return Coupling(space, _petsc_matrix(space, forward), _petsc_matrix(space, inverse))


def _petsc_matrix(space: fem.FunctionSpace, rows: csr_array) -> PETSc.Mat:
    """This rank's rows of a matrix over the components of all nodes. Collective."""
    d, index_map, whole = space.dofmap.index_map_bs, space.dofmap.index_map, csr_array(rows)
    whole.eliminate_zeros()
    whole.sort_indices()
    size = index_map.size_local * d, index_map.size_global * d
    arrays = whole.indptr.astype(PETSc.IntType), whole.indices.astype(PETSc.IntType), whole.data
    matrix = PETSc.Mat().createAIJ((size, size), bsize=d, csr=arrays, comm=space.mesh.comm)
    matrix.assemble()
    return matrix
