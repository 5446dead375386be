"""Local frames: at vertices with slanted normals the unknowns are (u_n, u_t), so that bounds are bounds of components.

PETSc's variational inequalities have bounds of components only. At such a vertex û = R u, the rows of R being its local
axes; all other vertices keep the Cartesian components (in the paper, section 5.1, all parts are parallel to an axis).
That the normals of a vertex are orthogonal or equal is decided in ``problem/contact_normals``.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt
from petsc4py import PETSc

from ..problem.bodies import whole
from ..problem.contact_surface import Surface
from ..problem.law_term import LawTerm
from ..problem.problem import Bounds, Problem
from ..problem.vectors import new_vector, null_space, turn
from ..rigid import rigid_fields
from ..runtime.mpi import agree
from ..typing import Array, Entities, Mask
from .thresholds import DEFAULT


@dataclass(frozen=True)
class LocalFrames:
    """The vertices of this rank whose unknowns have local components.

    Attributes:
        blocks: local vertex indices, (k,).
        axes: R at these vertices, rows are the local axes, (k, d, d).
    """

    blocks: Entities
    axes: Array

    def at(self, vertices: npt.NDArray[np.integer]) -> Array:
        """R at vertices of this rank, each once, (m, d, d)."""
        d = self.axes.shape[1]
        result = np.broadcast_to(np.eye(d), (len(vertices), d, d)).copy()
        _, there, here = np.intersect1d(vertices, self.blocks, assume_unique=True, return_indices=True)
        result[there] = self.axes[here]
        return result

    def local_components(self, vectors: Array) -> Array:
        """Vectors at all vertices in local components; of any shape that reshapes to (vertices, d), which is kept."""
        d = self.axes.shape[1]
        result = vectors.copy()
        rows = result.reshape(-1, d)
        rows[self.blocks] = np.einsum("kij,kj->ki", self.axes, rows[self.blocks])
        return result

    def surface(self, surface: Surface) -> Surface:
        """The surface with its normals and tangents in local components."""
        axes = self.at(surface.blocks)
        normals = np.einsum("mij,mj->mi", axes, surface.normals)
        return replace(
            surface,
            normals=np.where(np.abs(normals) > 1 - DEFAULT.rounding, np.round(normals), normals),
            tangents=np.einsum("mij,mkj->mki", axes, surface.tangents),
        )

    def bounds(self, bounds: Bounds) -> Bounds:
        """The bounds with their surface in local components."""
        return replace(bounds, surface=self.surface(bounds.surface))

    def term(self, term: LawTerm) -> LawTerm:
        """The law with its directions in local components; one along a local axis is exactly that axis.

        A slip that a bound holds on a kink is then the kink itself, not the kink but for rounding.
        """
        directions = np.einsum("mij,mkj->mki", self.at(term.surface.blocks), term.directions)
        directions = np.where(np.abs(directions) < DEFAULT.rounding, 0.0, directions)
        directions /= np.linalg.norm(directions, axis=2, keepdims=True)
        return replace(term, surface=self.surface(term.surface), directions=directions)

    def matrix(self, problem: Problem, like: PETSc.Mat) -> PETSc.Mat:
        """The matrix Q with u = Q û: block-diagonal, Rᵀ at the vertices with local components. Collective.

        Args:
            problem: the problem.
            like: a matrix with the same rows.
        """
        d = problem.scales.dimension
        q = PETSc.Mat().createAIJ(like.getSizes(), bsize=d, nnz=d, comm=like.comm)
        start, end = like.getOwnershipRange()
        every = np.arange(start // d, end // d)
        for plain in np.setdiff1d(every, self.blocks + start // d):
            q.setValuesBlocked([plain], [plain], np.eye(d))
        for turned, axes in zip(self.blocks + start // d, self.axes, strict=True):
            q.setValuesBlocked([turned], [turned], np.ascontiguousarray(axes.T))
        q.assemble()
        return q


def frames_of(problem: Problem) -> LocalFrames | None:
    """The local frames of a problem; None where every normal is parallel to an axis. Collective.

    Args:
        problem: the problem.
    """
    d, comm = problem.scales.dimension, problem.domain.mesh.comm
    if not any(agree(comm, any(_slanted(s.normals).any() for s in problem.surfaces))):
        return None
    slanted = _normals_at_slanted(problem)
    fixed = {int(dof) for dof in problem.fixed}
    frames = [_axes(normals, [i for i in range(d) if block * d + i in fixed], d) for block, normals in slanted.items()]
    axes = np.array(frames, dtype=np.float64).reshape(-1, d, d)
    return LocalFrames(np.array(list(slanted), dtype=np.int32), axes)


def _slanted(normals: Array) -> Mask:
    return np.asarray(np.count_nonzero(normals, axis=1) > 1)


def _normals_at_slanted(problem: Problem) -> dict[int, list[Array]]:
    """The normals of all parts at each vertex where one of them is slanted."""
    found: dict[int, list[Array]] = {}
    for surface in problem.surfaces:
        for block, normal in zip(surface.blocks, surface.normals, strict=True):
            found.setdefault(int(block), []).append(np.asarray(normal))
    return {block: normals for block, normals in found.items() if _slanted(np.array(normals)).any()}


def _axes(normals: Sequence[Array], held: Sequence[int], d: int) -> Array:
    """Local axes as rows: the prescribed components, and the normals, which are orthogonal or equal to these."""
    if len(held) == d:
        return np.eye(d)
    rows: dict[int, Array] = {i: np.eye(d)[i] for i in held}
    for normal in normals:
        if all(abs(float(row @ normal)) < 0.5 for row in rows.values()):
            free = [i for i in range(d) if i not in rows]
            rows[max(free, key=lambda i: abs(normal[i]))] = normal
    return _completed(rows, d)


def _completed(rows: dict[int, Array], d: int) -> Array:
    """The rows completed to an orthonormal basis, each new one near its Cartesian axis."""
    frame = np.zeros((d, d))
    for i, row in rows.items():
        frame[i] = row
    for i in (i for i in range(d) if i not in rows):
        known = [row for row in frame if row.any()]
        candidates = np.eye(d) - sum((np.outer(k @ np.eye(d), k) for k in known), np.zeros((d, d)))
        best = candidates[i] if np.linalg.norm(candidates[i]) > 0.1 else max(candidates, key=np.linalg.norm)
        frame[i] = best / np.linalg.norm(best)
    return frame


def rigid_modes(problem: Problem, rotation: PETSc.Mat | None) -> PETSc.NullSpace:
    """All rigid motions of the body without supports, orthonormal, in the components of the unknowns. Collective.

    Args:
        problem: the problem.
        rotation: Q with u = Q û for unknowns û in local components; None where there are none.
    """
    body, vectors = whole(problem.domain), []
    owned = problem.points[: problem.space.dofmap.index_map.size_local]
    fields = rigid_fields(np.asarray(owned / problem.scales.length), body)
    for number in range(body.motions):
        vector = new_vector(problem.space)
        vector.array[:] = problem.relative(fields[:, number].ravel())[: vector.local_size]
        turn(vector, rotation)
        vectors.append(vector)
    return null_space(vectors)
