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
from dataclasses import dataclass

import numpy as np
from dolfinx import fem
from petsc4py import PETSc
from scipy.sparse import coo_array, csr_array, diags_array, eye_array, kron

from ..typing import Array, Integers, Mask
from .facet_overlaps import OverlapPoints, Overlaps
from .facets import Facets


@dataclass(frozen=True, kw_only=True)
class RelativeRows:
    """Rows over all N nodes of the mesh: one for each node of the first side that carries something.

    Attributes:
        weights: ∫ψ_i, by node of the mesh, 0 for all others, m^(d-1), (N,).
        first: ∫ψ_i φ_j on the first side, (N, N).
        second: ∫ψ_i φ_k on the second, (N, N).
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
    return RelativeRows(
        weights=weights,
        first=_sums(rows, rows, values, functions, size),
        second=_sums(rows, second.nodes[points.second], values, second.functions(points.on_second), size),
    )


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
    shape = (*values.shape, functions.shape[1])
    entries = np.einsum("pi,pk->pik", values, functions)
    at = np.broadcast_to(rows[:, :, None], shape), np.broadcast_to(columns[:, None, :], shape)
    nonzero = np.broadcast_to(values[:, :, None] != 0.0, shape)
    pairs = at[0][nonzero], at[1][nonzero]
    return csr_array(coo_array((entries[nonzero], pairs), shape=(size, size)))


def _coefficients(points: OverlapPoints, functions: Array, kept: Mask) -> Array:
    """ψ_i = Σ_k basis_ik φ_k on each facet, zero rows where a node carries nothing, (f, n, n)."""
    count, each = kept.shape
    mass = np.zeros((count, each, each))
    products = np.einsum("p,pk,pj->pkj", points.weights, functions, functions)
    np.add.at(mass, points.first, products)
    basis = np.zeros((count, each, each))
    covered = np.zeros(count, dtype=bool)
    covered[points.first] = True
    for pattern in np.unique(kept[covered], axis=0):
        here, own = np.flatnonzero(covered & np.all(kept == pattern, axis=1)), np.flatnonzero(pattern)
        if len(own):
            spread = _shared(pattern)[own]  # φ of the kept nodes, with the shares of the others
            gram = spread @ mass[here][:, :, own]
            areas = mass[here].sum(axis=1)[:, own]
            basis[np.ix_(here, own)] = areas[:, :, None] * np.linalg.solve(
                gram, np.broadcast_to(spread, (len(here), *spread.shape))
            )
    return basis


def _shared(pattern: Mask) -> Array:
    """Functions that sum up to 1: those of kept nodes take equal shares of the others', (n, n)."""
    spread = np.eye(len(pattern))
    spread[:, ~pattern] = 1.0 / max(int(np.count_nonzero(pattern)), 1)
    return spread


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
    size, (start, end) = space.dofmap.index_map.size_global, space.dofmap.index_map.local_range
    inverse, forward = (csr_array(eye_array(size, format="csr")[start:end]) for _ in range(2))
    for one in interfaces:
        over = np.divide(1.0, one.weights, out=np.zeros(size), where=one.weights > 0.0)
        rows = csr_array((one.first - one.second).multiply(over[:, None]))
        diagonal = rows.diagonal()
        own = diags_array(diagonal[start:end], offsets=0) @ eye_array(size, format="csr")[start:end]
        rest, scale = rows[start:end] - own, diagonal[start:end]
        unit = diags_array((scale != 0.0).astype(float), offsets=0) @ eye_array(size, format="csr")[start:end]
        over = np.divide(1.0, scale, out=np.zeros_like(scale), where=scale != 0.0)
        inverse = inverse + rest + own - unit
        forward = forward - diags_array(over, offsets=0) @ (rest - unit) - unit
    return Coupling(space, _petsc_matrix(space, forward), _petsc_matrix(space, inverse))


def _petsc_matrix(space: fem.FunctionSpace, rows: csr_array) -> PETSc.Mat:
    """A matrix over vertices as one over their vectors, component by component. Collective."""
    d, index_map = space.dofmap.index_map_bs, space.dofmap.index_map
    whole = csr_array(kron(csr_array(rows), np.eye(d), format="csr"))
    whole.eliminate_zeros()
    whole.sort_indices()
    size = index_map.size_local * d, index_map.size_global * d
    arrays = whole.indptr.astype(PETSc.IntType), whole.indices.astype(PETSc.IntType), whole.data
    matrix = PETSc.Mat().createAIJ((size, size), bsize=d, csr=arrays, comm=space.mesh.comm)
    matrix.assemble()
    return matrix
