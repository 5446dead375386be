"""How far solutions are from the reference solution: relative errors of the quantities that people ask for.

Every solution is first brought onto the reference's nodes, where the energy norm is that of the reference's stiffness
and integrals over Γc are sums over its lumped areas: exactly where the meshes are nested. A node takes the field of its
own body: where two meet, both have cells at it. Where the meshes are not nested (curved boundaries, meshes made anew) a
node outside of all cells takes its nearest cell's field, continued.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping
from dataclasses import dataclass

import numpy as np
from dolfinx import fem, geometry
from mpi4py import MPI
from scipy import sparse

from .. import compat
from ..geometry import in_space
from ..mesh import hierarchy, nodes, transfer
from ..problem import spaces
from ..report.solution_arrays import ContactPart, SolutionArrays
from ..runtime.mpi import joined
from ..typing import Array, Integers, Mask, magnitude
from ..workflow import Solution

NORMS: Mapping[str, tuple[str, str]] = {
    "energy_norm": ("displacement, energy norm", "the energy norm"),
    "u_t_l2": ("u_t on Γc, L2", "u_t (L2)"),
    "u_t_max": ("u_t on Γc, largest", "u_t (largest)"),
    "friction_l1": ("-σ_t on Γc, L1", "-σ_t (L1)"),
    "friction_l2": ("-σ_t on Γc, L2", "-σ_t (L2)"),
    "pressure_l1": ("-σ_n on Γc, L1", "-σ_n (L1)"),
    "pressure_l2": ("-σ_n on Γc, L2", "-σ_n (L2)"),
    "contact_set": ("area where one is closed and the other open, over the closed area", "the contact set"),
    "resultant": ("resultant of -σ_n, over the integral of its size", "the contact resultant"),
    "friction_force": ("resultant of -σ_t, over the integral of its size", "the friction force"),
}
"""The quantities whose errors are measured, in the order of the tables: what they are, and their names in sentences."""
Errors = Mapping[str, float | None]
"""Relative errors by the keys of :data:`NORMS`; None where there is nothing to measure."""
_KINDS = {1: "interval", 2: "triangle", 3: "tetrahedron"}


@dataclass(frozen=True)
class Fields:
    """A solution on the reference's n nodes, and on the m vertices of all parts of Γc, one part after the other.

    Attributes:
        u: the displacement, m, (n, d).
        slip: m, as vectors, (m, d): tangents may turn their sign from vertex to vertex of a curved part.
        friction: -σ_t, N/m², likewise; zero where no law acts along the part, since the residual there is rounding.
        pressure: σ_n, N/m², (m,); zero where neither contact nor a law acts across the part.
        closed: whether contact is closed, (m,).
    """

    u: Array
    slip: Array
    friction: Array
    pressure: Array
    closed: Mask


class ReferenceSolution:
    """The solution that others are measured against.

    Args:
        arrays: the solution.
        stiffness: of its mesh, in its numbering (:func:`stiffness`).
        joints: the parts of Γc at which two bodies meet.

    Attributes:
        own: its fields on its own nodes.
    """

    def __init__(self, arrays: SolutionArrays, stiffness: sparse.csr_array, joints: Collection[str] = ()) -> None:
        self._arrays, self._stiffness, self._joints = arrays, stiffness, joints
        parts, d = arrays.parts.values(), arrays.points.shape[1]
        self._ends = nodes.ends_of(cells_of(arrays), len(arrays.points), d)
        self._share = 0.0 if arrays.degree == 1 else spaces.EDGE_SHARE[d]
        self._weights = np.concatenate([np.empty(0), *(part.weight for part in parts)])
        self._normals = np.vstack([np.empty((0, d)), *(part.normal for part in parts)])
        self._bounded = any("contact" in part.columns for part in parts)
        self.own = self.transfer(arrays)

    def transfer(self, found: SolutionArrays) -> Fields:
        """A solution, which must have a displacement, on the reference's nodes."""
        u = in_bodies(found, self._arrays)
        rows: list[Array] = [np.empty((0, 2 * u.shape[1] + 2))]
        for name, own in self._arrays.parts.items():
            part, here = found.parts[name], u[own.vertices]
            values = np.hstack([part.vectors("slip"), _tractions(part)])
            told = on_part(found, part, values, self._arrays.points[own.vertices])
            if name not in self._joints:
                told[:, : u.shape[1]] = here - np.sum(here * own.normal, axis=1)[:, None] * own.normal
            rows.append(told)
        slip, friction, others = np.split(np.vstack(rows), [u.shape[1], 2 * u.shape[1]], axis=1)
        return Fields(u, slip, friction, others[:, 0], others[:, 1] > 0.5)

    def energy(self, u: Array) -> float:
        """√a(u, u) of a displacement (n, d), up to a factor; the stiffness is that of coefficients in its basis."""
        flat = (u - self._share * u[self._ends].sum(axis=1)).ravel() / (1 - 2 * self._share)
        return math.sqrt(max(0.0, float(flat @ (self._stiffness @ flat))))

    def errors(self, found: Fields, other: Fields | None = None) -> Errors:
        """How far a solution is from another, by quantity, relative to the reference's size.

        Args:
            found: the solution.
            other: from which it is measured; the reference where it is None.
        """
        true, other, weights = self.own, other or self.own, self._weights
        friction, pressure = found.friction - other.friction, (found.pressure - other.pressure)[:, None]
        far = _norms(found.slip - other.slip, friction, pressure, weights)
        sizes = _norms(true.slip, true.friction, true.pressure[:, None], weights)
        told = {key: _ratio(far[key], size) for key, size in sizes.items()}
        told["energy_norm"] = _ratio(self.energy(found.u - other.u), self.energy(true.u))
        wrong, closed = weights[found.closed != other.closed].sum(), weights[true.closed].sum()
        told["contact_set"] = _ratio(wrong, closed) if self._bounded else None
        forces = [float(np.linalg.norm(weights @ force)) for force in (pressure * self._normals, friction)]
        told["resultant"] = _ratio(forces[0], sizes["pressure_l1"])
        told["friction_force"] = _ratio(forces[1], sizes["friction_l1"])
        return {key: told[key] for key in NORMS}


def _tractions(part: ContactPart) -> Array:
    """-σ_t as vectors, σ_n and contact at a part's vertices, (m, d + 2)."""
    columns, bounded = part.columns, "contact" in part.columns
    friction = part.vectors("friction") if "friction_t1" in columns else np.zeros_like(part.normal)
    pressure = columns["sigma_n"] * (bounded or "branch_n" in columns)
    return np.column_stack([friction, pressure, columns["contact"] if bounded else np.zeros(len(pressure))])


def _norms(slip: Array, friction: Array, pressure: Array, weights: Array) -> dict[str, float]:
    """L1 and L2 norms of vectors (m, d) on Γc, and the largest slip."""
    found: dict[str, float] = {}
    for name, vectors in (("u_t", slip), ("friction", friction), ("pressure", pressure)):
        lengths = np.linalg.norm(vectors, axis=1)
        found |= {f"{name}_l1": float(weights @ lengths), f"{name}_l2": math.sqrt(float(weights @ lengths**2))}
    return found | {"u_t_max": magnitude(np.linalg.norm(slip, axis=1))}


def _ratio(error: float, size: float) -> float | None:
    return float(error / size) if size > 0.0 else None


def stiffness(solution: Solution) -> sparse.csr_array | None:
    """The matrix of a(u, v), nondimensional, on rank 0; None elsewhere. Collective.

    Its unknowns are the coefficients of the displacement in the basis of its space, by the nodes of ``solution.npz``.
    Its energy norm does not feel rigid motions.
    """
    problem = solution.problem
    matrix = problem.bulk.matrix()
    starts, columns, values = matrix.getValuesCSR()
    size, comm = matrix.getSize()[0], problem.comm
    matrix.destroy()
    counts, columns, values = (joined(comm, a) for a in (np.diff(starts), columns, values))
    return None if comm.rank else sparse.csr_array((values, columns, np.append(0, np.cumsum(counts))), (size, size))


def cells_of(arrays: SolutionArrays) -> Integers:
    """The cells of a solution by their nodes, corners first, (c, nodes)."""
    return arrays.cells if arrays.degree == 1 else nodes.joined(arrays.cells)


def mesh_width(arrays: SolutionArrays) -> float:
    """The edge of an equilateral cell as large as the largest one, m: it halves where a mesh is refined uniformly."""
    d = arrays.points.shape[1]
    corners = arrays.points[cells_of(arrays)[:, : d + 1]]
    largest = magnitude(np.linalg.det(corners[:, 1:] - corners[:, :1]))
    return float((largest * (2.0 / np.sqrt(3.0) if d == 2 else np.sqrt(2.0))) ** (1.0 / d))


def in_bodies(source: SolutionArrays, target: SolutionArrays) -> Array:
    """The displacement of a solution, which must have one, at the nodes of another one. On this process alone.

    Args:
        source: the solution.
        target: one of the same bodies.
    """
    cells, bodies, wanted = cells_of(source), _bodies(source), _bodies(target)
    boxes, found = _boxes(source, bodies), np.empty(target.points.shape)
    for body, box in enumerate(_boxes(target, wanted)):
        same = np.argmin(np.linalg.norm(boxes - box, axis=1))
        rows = wanted == body
        found[rows] = _in_body(source, cells[bodies[cells[:, 0]] == same], target.points[rows])
    return found


def _bodies(arrays: SolutionArrays) -> Integers:
    """Numbers of the connected meshes that the nodes belong to, (n,)."""
    cells = cells_of(arrays)
    pairs = np.column_stack([np.repeat(cells[:, 0], cells.shape[1]), cells.ravel()])
    return hierarchy.connected(pairs, len(arrays.points))[1]


def _boxes(arrays: SolutionArrays, bodies: Integers) -> Array:
    """The ends of each body along the axes, m, (bodies, 2d)."""
    points = (arrays.points[bodies == body] for body in range(bodies.max() + 1))
    return np.array([np.concatenate([own.min(axis=0), own.max(axis=0)]) for own in points])


def _in_body(source: SolutionArrays, cells: Integers, points: Array) -> Array:
    """The displacement of a solution at points of a body by its cells, continued where they are outside."""
    kept, local = np.unique(cells, return_inverse=True)
    d = points.shape[1]
    local = local.reshape(cells.shape)
    mesh = compat.simplex_mesh(MPI.COMM_SELF, local, source.points[kept], _KINDS[d], degree=source.degree)
    at = in_space(points)
    field = fem.Function(fem.functionspace(mesh, ("Lagrange", source.degree, (d,))))
    own = kept[mesh.geometry.input_global_indices[compat.geometry_dofmap(mesh)]]
    assert source.displacement is not None
    field.x.array.reshape(-1, d)[field.function_space.dofmap.list] = source.displacement[own]
    return field.eval(at, transfer.containing_cells(mesh, at).astype(np.int32)).reshape(-1, d)


def on_part(source: SolutionArrays, part: ContactPart, values: Array, points: Array) -> Array:
    """Values at the vertices of a part, at points on it: linear between neighbouring nodes, as tractions, (m, k).

    Args:
        source: the solution.
        part: of it.
        values: (n, k).
        points: m, (m, d).
    """
    kept, local = np.unique(part.facets, return_inverse=True)
    d = points.shape[1]
    line = compat.simplex_mesh(MPI.COMM_SELF, local.reshape(-1, d), source.points[kept], _KINDS[d - 1])
    tree = geometry.bb_tree(line, d - 1)
    middles = geometry.create_midpoint_tree(line, d - 1, np.arange(len(part.facets), dtype=np.int32))
    nearest = geometry.compute_closest_entity(tree, middles, line, in_space(points))
    corners = part.facets[line.topology.original_cell_index[nearest]]
    weights = transfer.clipped(transfer.barycentric_weights(source.points[corners], points))
    everywhere = np.zeros((len(source.points), values.shape[1]))
    everywhere[part.vertices] = values
    return np.einsum("mc,mck->mk", weights, everywhere[corners])
