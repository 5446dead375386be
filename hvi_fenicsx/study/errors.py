"""How far solutions are from the reference solution: relative errors of the quantities that people ask for.

Every solution is first brought onto the reference's nodes (:mod:`.transfer`), where the energy norm is that of the
reference's stiffness and integrals over Γc are sums over its lumped areas.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from scipy import sparse, spatial

from ..accuracy.quantity_base import ORDERS
from ..problem import spaces
from ..report.solution_arrays import ContactPart, SolutionArrays
from ..runtime.mpi import joined
from ..typing import Array, Mask
from ..workflow import Solution
from .transfer import BodyTransfer, edge_ends, rows_of, surface

NORMS: Mapping[str, tuple[str, str]] = {
    "energy_norm": ("displacement, energy norm", "the energy norm"),
    "u_t_l2": ("u_t on Γc, L2", "u_t (L2)"),
    "u_t_max": ("u_t on Γc, largest", "u_t (largest)"),
    "friction_l1": ("-σ_t on Γc, L1", "-σ_t (L1)"),
    "friction_l2": ("-σ_t on Γc, L2", "-σ_t (L2)"),
    "friction_max": ("-σ_t on Γc, largest away from the law's jumps", "-σ_t (largest, away from jumps)"),
    "pressure_l1": ("-σ_n on Γc, L1", "-σ_n (L1)"),
    "pressure_l2": ("-σ_n on Γc, L2", "-σ_n (L2)"),
    "contact_set": ("area where one is closed and the other open, over the closed area", "the contact set"),
    "resultant": ("resultant of -σ_n, over the integral of its size", "the contact resultant"),
    "friction_force": ("resultant of -σ_t, over the integral of its size", "the friction force"),
}
"""The quantities whose errors are measured, in the order of the tables: what they are, and their names in sentences."""
Errors = Mapping[str, float | None]
"""Relative errors by the keys of :data:`NORMS`; None where there is nothing to measure."""
JUMP_FACETS = 2
"""So many facets of the coarser mesh about a jump of the law count as near it."""
_ROUNDING = 1e-12
"""Relative: no smaller error can be measured."""


@dataclass(frozen=True)
class Fields:
    """A solution on the reference's n nodes, and on the m vertices of all parts of Γc, one part after the other.

    Attributes:
        u: the displacement, m, (n, d).
        slip: m, as vectors, (m, d): tangents may turn their sign from vertex to vertex of a curved part.
        friction: -σ_t, N/m², likewise; zero where no law acts along the part, since the residual there is rounding.
        pressure: σ_n, N/m², (m,); zero where neither contact nor a law acts across the part.
        closed: whether contact is closed, (m,).
        widths: the solution's own mesh width there, m, (m,).
    """

    u: Array
    slip: Array
    friction: Array
    pressure: Array
    closed: Mask
    widths: Array


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
        self._ends, self._transfers = edge_ends(arrays), dict[bytes, _Transfer]()
        self._share = 0.0 if arrays.degree == 1 else spaces.EDGE_SHARE[arrays.points.shape[1]]
        parts, d = arrays.parts.values(), arrays.points.shape[1]
        self._weights = np.concatenate([np.empty(0), *(part.weight for part in parts)])
        self._normals = np.vstack([np.empty((0, d)), *(part.normal for part in parts)])
        self._bounded = any("contact" in part.columns for part in parts)
        self._from_jump = np.concatenate([np.empty(0), *(_from_jump(arrays, part) for part in parts)])
        self.own = self.transfer(arrays)

    def transfer(self, found: SolutionArrays) -> Fields:
        """A solution, which must have a displacement, on the reference's nodes; the way from a mesh is found once."""
        key = found.points.tobytes() + found.cells.tobytes()
        if key not in self._transfers:
            points = {name: self._arrays.points[part.vertices] for name, part in self._arrays.parts.items()}
            along = {name: surface(found, found.parts[name], x) for name, x in points.items()}
            self._transfers = {key: (BodyTransfer(found, self._arrays), along)}
        in_bodies, on_parts = self._transfers[key]
        assert found.displacement is not None
        u = in_bodies(found.displacement)
        rows = [np.empty((0, 2 * u.shape[1] + 3))]
        for name, way in on_parts.items():
            part, width = found.parts[name], np.full((way.shape[0], 1), _width(found, found.parts[name]))
            slip = way @ part.vectors("slip") if name in self._joints else self._slip(name, u)
            rows.append(np.hstack([slip, way @ _tractions(part), width]))
        slip, friction, others = np.split(np.vstack(rows), [u.shape[1], 2 * u.shape[1]], axis=1)
        pressure, contact, widths = others.T
        return Fields(u, slip, friction, pressure, contact > 0.5, widths)

    def _slip(self, name: str, u: Array) -> Array:
        """The tangential part of a displacement on a part, (m, d)."""
        part = self._arrays.parts[name]
        found = u[part.vertices]
        return np.asarray(found - np.sum(found * part.normal, axis=1)[:, None] * part.normal)

    def energy(self, u: Array) -> float:
        """√a(u, u) of a displacement (n, d), up to a factor; the stiffness is that of coefficients in its basis."""
        share = np.where(self._ends[:, :1] == self._ends[:, 1:], 0.0, self._share)
        flat = ((u - share * u[self._ends].sum(axis=1)) / (1 - 2 * share)).ravel()
        return math.sqrt(max(0.0, float(flat @ (self._stiffness @ flat))))

    def near_jump(self, found: Fields) -> Mask:
        """The vertices of Γc within some facets of a solution's mesh from a jump of the law, (m,)."""
        return np.asarray(self._from_jump <= JUMP_FACETS * found.widths)

    def left_out(self, found: Fields) -> float:
        """The part of Γc near jumps of the law, which ``friction_max`` leaves out, over all of Γc."""
        return float(self._weights[self.near_jump(found)].sum() / (self._weights.sum() or 1.0))

    def errors(self, found: Fields, other: Fields | None = None) -> Errors:
        """How far a solution is from another, by quantity, relative to the reference's size.

        Args:
            found: the solution.
            other: from which it is measured; the reference where it is None.
        """
        true, other, weights = self.own, other or self.own, self._weights
        away = ~self.near_jump(found)
        friction, normal = found.friction - other.friction, found.pressure - other.pressure
        slips = _norms(found.slip - other.slip, weights), _norms(true.slip, weights)
        frictions = _norms(friction, weights), _norms(true.friction, weights)
        pressures = _norms(normal[:, None], weights), _norms(true.pressure[:, None], weights)
        largest = _norms(friction[away], weights[away])[2] if away.any() else None
        wrong, closed = weights[found.closed != other.closed].sum(), weights[true.closed].sum()
        forces = [np.linalg.norm(weights @ force) for force in (normal[:, None] * self._normals, friction)]
        return {
            "energy_norm": _ratio(self.energy(found.u - other.u), self.energy(true.u)),
            "u_t_l2": _ratio(slips[0][1], slips[1][1]),
            "u_t_max": _ratio(slips[0][2], slips[1][2]),
            "friction_l1": _ratio(frictions[0][0], frictions[1][0]),
            "friction_l2": _ratio(frictions[0][1], frictions[1][1]),
            "friction_max": None if largest is None else _ratio(largest, frictions[1][2]),
            "pressure_l1": _ratio(pressures[0][0], pressures[1][0]),
            "pressure_l2": _ratio(pressures[0][1], pressures[1][1]),
            "contact_set": _ratio(wrong, closed) if self._bounded else None,
            "resultant": _ratio(float(forces[0]), pressures[1][0]),
            "friction_force": _ratio(float(forces[1]), frictions[1][0]),
        }


_Transfer = tuple[BodyTransfer, Mapping[str, sparse.csr_array]]


def _tractions(part: ContactPart) -> Array:
    """-σ_t as vectors, σ_n and contact at a part's vertices, (m, d + 2)."""
    columns, bounded = part.columns, "contact" in part.columns
    friction = part.vectors("friction") if "friction_t1" in columns else np.zeros_like(part.normal)
    pressure = columns["sigma_n"] * (bounded or "branch_n" in columns)
    return np.column_stack([friction, pressure, columns["contact"] if bounded else np.zeros(len(pressure))])


def _width(arrays: SolutionArrays, part: ContactPart) -> float:
    corners = arrays.points[part.facets]
    return float(np.max(np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2), initial=0.0))


def _from_jump(arrays: SolutionArrays, part: ContactPart) -> Array:
    """How far each vertex of a part is from a facet on which the slip passes a drop of the law, m, (m,)."""
    facets, along = rows_of(arrays, part)[part.facets], part.tangents[:, 0]
    turned = np.sum(along[facets[:, 0]] * along[facets[:, -1]], axis=1) < 0.0
    signed = part.size("slip")
    beyond = np.where(turned[:, None], np.abs(signed)[facets], signed[facets])[:, :, None] - part.drops[facets]
    passed = np.any((beyond.min(axis=1) <= 0.0) & (beyond.max(axis=1) >= 0.0), axis=1)
    if not passed.any():
        return np.full(len(part), np.inf)
    return np.asarray(spatial.KDTree(part.x[facets[passed]].mean(axis=1)).query(part.x)[0])


def _norms(vectors: Array, weights: Array) -> tuple[float, float, float]:
    """L1, L2 and the largest length of vectors (m, d)."""
    lengths = np.linalg.norm(vectors, axis=1)
    return float(weights @ lengths), math.sqrt(float(weights @ lengths**2)), float(np.max(lengths, initial=0.0))


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
    size, comm = matrix.getSize()[0], problem.space.mesh.comm
    matrix.destroy()
    counts, columns, values = (joined(comm, a) for a in (np.diff(starts), columns, values))
    return None if comm.rank else sparse.csr_array((values, columns, np.append(0, np.cumsum(counts))), (size, size))


@dataclass(frozen=True)
class Certainty:
    """How well the reference is known in one quantity.

    Attributes:
        error: the reference's own relative error; None where it is not known.
        order: in h, measured on the next coarser levels; None where it is not known.
    """

    error: float | None
    order: float | None


def certainty(coarser: Sequence[Errors]) -> Mapping[str, Certainty]:
    """How well the reference is known, by quantity, from two coarser levels by Richardson's extrapolation.

    With e' and e'' their errors against it, and errors that fall as C hᵖ, e''/e' = 2ᵖ + 1, and its own is e'/(2ᵖ - 1)
    (Roache 1998, *Verification and Validation in Computational Science and Engineering*). In the energy norm the
    differences of nested Galerkin solutions are orthogonal, so the same holds of the squares, with 4ᵖ for 2ᵖ.

    Args:
        coarser: the errors of the next coarser levels against the reference, finest first.
    """
    return {key: _certainty([e[key] for e in coarser], 2 if key == "energy_norm" else 1) for key in NORMS}


def _certainty(errors: Sequence[float | None], power: int) -> Certainty:
    known = [e**power for e in errors if e is not None]
    if not known or known[0] <= _ROUNDING**power:
        return Certainty(_ROUNDING if known else None, None)
    order = math.log2(known[1] / known[0] - 1.0) / power if len(known) > 1 and known[1] > known[0] else None
    believed = float(np.clip(ORDERS[0] if order is None else order, *ORDERS))
    return Certainty(max(_ROUNDING, (known[0] / (2.0 ** (power * believed) - 1.0)) ** (1.0 / power)), order)
