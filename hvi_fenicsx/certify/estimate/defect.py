"""The defect of u_h in the edge bubbles: minimise ½a(e, e) - ρ(e) among the bubbles that the constraints admit.

ρ is the residual with all that the body feels pointwise: loads, thermal strain, the laws between the vertices. The
constraints are those of the inequality at the midpoints of the edges (Kornhuber 1996; Zou, Veeser, Kornhuber and
Gräser 2011).
"""

from __future__ import annotations

import functools
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt
from dolfinx import fem
from mpi4py import MPI

from ...problem.problem import Bounds, Problem
from ...typing import Array, Entities, Mask
from .edge_bubbles import Stiffness

_RTOL = 0.1
"""Of the bubbles' solve, in the energy norm: their energy is right to about its square."""
_ROUNDS = 4
_FAR = 1e30
"""Stands for no bound: an infinite nodal value has no interpolant."""


@dataclass(frozen=True)
class Midpoints:
    """Edges of a part with bounds (k of them, owned blocks): lower ≤ e·n ≤ upper.

    ``side`` is 1 where e is held on the upper bound, -1 on the lower one, else 0.
    """

    blocks: Entities
    normals: Array
    lower: Array
    upper: Array
    side: npt.NDArray[np.int8]

    def component(self, e: Array) -> Array:
        """E·n, (k,)."""
        return np.asarray(np.sum(e[self.blocks] * self.normals, axis=1))

    def moved(self, e: Array, force: Array) -> Midpoints:
        """Held where e leaves the bounds, let go where the force (n, d) draws away from the bound that holds."""
        along, push = self.component(e), self.component(force)
        upper = np.where(self.side == 1, push >= 0, along > self.upper)
        lower = np.where(self.side == -1, push <= 0, along < self.lower)
        return replace(self, side=np.where(upper, 1, np.where(lower, -1, 0)).astype(np.int8))

    def placed(self, e: Array) -> None:
        """Put e on the bounds that hold it."""
        target = np.where(self.side == 1, self.upper, self.lower)
        change = np.where(self.side == 0, 0.0, target - self.component(e))
        e[self.blocks] += change[:, None] * self.normals

    def project(self, r: Array) -> None:
        """Take out of r what the bounds carry."""
        carried = np.where(self.side == 0, 0.0, self.component(r))
        r[self.blocks] -= carried[:, None] * self.normals


def prescribed(problem: Problem, u: fem.Function, space: fem.FunctionSpace) -> tuple[Mask, Array]:
    """Whether a bubble is free (n, d), and what prescribed displacements ask of the others (n, d). Collective."""
    d, owned = problem.scales.dimension, space.dofmap.index_map.size_local
    free, value = np.ones((owned, d), dtype=np.bool_), np.zeros((owned, d))
    middle = fem.Function(space)
    middle.interpolate(u)
    points = space.tabulate_dof_coordinates()
    for part in problem.prescribed:
        blocks = _on(space, part.facets)
        free[blocks, part.component] = False
        wanted = part.value.at(points[blocks]) / problem.scales.displacement
        value[blocks, part.component] = wanted - middle.x.array.reshape(-1, d)[blocks, part.component]
    return free, value


def midpoints(problem: Problem, u: fem.Function, bounds: Bounds, space: fem.FunctionSpace) -> Midpoints:
    """The bounds of a part at the midpoints of its edges, means of those at their ends. Collective."""
    d = problem.scales.dimension
    blocks = _on(space, bounds.surface.facets)

    def middle(values: Array) -> Array:
        field, result = fem.Function(problem.space), fem.Function(space)
        spread = np.clip(values, -_FAR, _FAR)
        field.x.array.reshape(-1, d)[bounds.surface.blocks] = spread
        field.x.scatter_forward()
        result.interpolate(field)
        return np.asarray(result.x.array.reshape(-1, d)[blocks])

    normals = middle(bounds.surface.normals)
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    normal = np.sum(bounds.surface.values(u.x.array) * bounds.surface.normals, axis=1)
    lower, upper = (middle((b - normal)[:, None])[:, 0] for b in (bounds.lower, bounds.upper))
    return Midpoints(blocks, normals, np.minimum(lower, 0.0), np.maximum(upper, 0.0), np.zeros(len(blocks), np.int8))


def _on(space: fem.FunctionSpace, facets: Entities) -> Entities:
    """Owned blocks on facets, those of a facet of another rank included. Collective."""
    found = fem.locate_dofs_topological(space, space.mesh.topology.dim - 1, facets)
    return np.unique(found[found < space.dofmap.index_map.size_local]).astype(np.int32)


def least(stiffness: Stiffness, u: fem.Function, load: Array) -> fem.Function:
    """The admissible bubbles of least energy under a load (n, d), ghosts updated. Collective."""
    problem, space = stiffness.problem, stiffness.space
    free, value = prescribed(problem, u, space)
    solve(stiffness, load, free, value, [midpoints(problem, u, b, space) for b in problem.bounds], _RTOL)
    e = fem.Function(space)
    e.x.array[: value.size] = value.ravel()
    e.x.scatter_forward()
    return e


def solve(stiffness: Stiffness, load: Array, free: Mask, e: Array, parts: Sequence[Midpoints], rtol: float) -> None:
    """The admissible bubbles of least energy, an active set method, a few rounds. Collective.

    Args:
        stiffness: a(e, e). load: ρ (n, d). free: see :func:`prescribed`. parts: bounds. rtol: of each solve.
        e: (n, d), what is prescribed, which the result takes the place of.
    """
    guess = np.where(free, stiffness.diagonal_solve(load), e)
    parts = [part.moved(guess, load) for part in parts]
    del guess
    for _ in range(_ROUNDS):
        for part in parts:
            part.placed(e)
        force = stiffness.solve(load, e, functools.partial(_project, free, tuple(parts)), rtol)
        changed = [part.moved(e, force) for part in parts]
        same = all(np.array_equal(a.side, b.side) for a, b in zip(parts, changed, strict=True))
        parts = changed
        if stiffness.comm.allreduce(same, op=MPI.LAND):
            break


def _project(free: Mask, parts: Sequence[Midpoints], r: Array) -> None:
    """Take out of r (n, d) what is prescribed and what the bounds hold."""
    r *= free
    for part in parts:
        part.project(r)
