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
from scipy.linalg import null_space

from ..problem.contact_surface import Surface
from ..problem.law_term import LawTerm
from ..problem.problem import Bounds, Problem
from ..typing import Array, Entities, Integers, together
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
        d = problem.dimension
        q = PETSc.Mat().createAIJ(like.getSizes(), bsize=d, nnz=d, comm=like.comm)
        start, end = like.getOwnershipRange()
        rows = np.arange(start // d, end // d, dtype=PETSc.IntType)
        q.setValuesBlockedRCV(rows[:, None], rows[:, None], self.at(rows - start // d).transpose(0, 2, 1).copy())
        q.assemble()
        return q


def frames_of(problem: Problem) -> LocalFrames:
    """The local frames at the vertices where a normal of one of the parts is not parallel to an axis.

    Args:
        problem: the problem.
    """
    d = problem.dimension
    blocks = together(s.blocks for s in problem.surfaces)
    normals = np.concatenate([np.empty((0, d)), *(s.normals for s in problem.surfaces)])
    here = np.isin(blocks, blocks[np.count_nonzero(normals, axis=1) > 1])
    found: dict[int, list[Array]] = {}
    for block, normal in zip(blocks[here], normals[here], strict=True):
        found.setdefault(int(block), []).append(normal)
    slanted = np.array(list(found), dtype=np.int32)
    held = np.isin(slanted[:, None] * d + np.arange(d), problem.fixed)
    axes = [_axes(each, np.flatnonzero(own), d) for each, own in zip(found.values(), held, strict=True)]
    return LocalFrames(slanted, np.array(axes).reshape(-1, d, d))


def _axes(normals: Sequence[Array], held: Integers, d: int) -> Array:
    """Local axes as rows: the prescribed components, the normals, orthogonal or equal to these; others near axes."""
    rows: dict[int, Array] = {i: np.eye(d)[i] for i in held}
    for normal in normals:
        if all(abs(float(row @ normal)) < 0.5 for row in rows.values()):
            rows[max(set(range(d)) - set(rows), key=lambda i: abs(normal[i]))] = normal
    frame, free = np.zeros((d, d)), [i for i in range(d) if i not in rows]
    frame[list(rows)] = list(rows.values())
    others = null_space(frame)
    left, _, right = np.linalg.svd(others[free])
    frame[free] = left @ right @ others.T
    return frame
