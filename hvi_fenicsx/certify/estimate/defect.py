"""The defect of u_h in the bubbles: minimise ½a(e, e) - ρ(e) among the bubbles that the constraints admit.

ρ is the residual with all that the body feels pointwise: loads, thermal strain, the laws between the nodes. The
constraints are those of the inequality at the points of the bubbles (Kornhuber 1996; Zou, Veeser, Kornhuber and
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

from ...mesh import nodes
from ...problem.problem import Bounds, Problem
from ...typing import Array, Entities, Mask
from .bubble_stiffness import BubbleStiffness
from .thresholds import DEFAULT, Thresholds

_FAR = 1e30
"""Stands for no bound: an infinite nodal value has no interpolant."""


@dataclass(frozen=True)
class BubbleBounds:
    """Bounds at the points of a part's bubbles (k of them): lower ≤ e·n ≤ upper.

    Attributes:
        blocks: the bubbles' owned blocks, (k,).
        normals: outward unit normals, (k, d).
        lower: lower bounds, (k,).
        upper: upper bounds, (k,).
        side: 1 where e is held on the upper bound, -1 on the lower one, else 0; (k,).
    """

    blocks: Entities
    normals: Array
    lower: Array
    upper: Array
    side: npt.NDArray[np.int8]

    def component(self, e: Array) -> Array:
        """The normal component e·n at the points, (k,)."""
        return np.asarray(np.sum(e[self.blocks] * self.normals, axis=1))

    def updated(self, e: Array, force: Array) -> BubbleBounds:
        """Held where e leaves the bounds, let go where a force draws away from the bound that holds.

        Args:
            e: the bubbles, (n, d).
            force: the force on them, (n, d).
        """
        along, push = self.component(e), self.component(force)
        upper = np.where(self.side == 1, push >= 0, along > self.upper)
        lower = np.where(self.side == -1, push <= 0, along < self.lower)
        return replace(self, side=np.where(upper, 1, np.where(lower, -1, 0)).astype(np.int8))

    def put_on_bounds(self, e: Array) -> None:
        """Put e (n, d) on the bounds that hold it, in place."""
        target = np.where(self.side == 1, self.upper, self.lower)
        change = np.where(self.side == 0, 0.0, target - self.component(e))
        e[self.blocks] += change[:, None] * self.normals

    def project(self, r: Array) -> None:
        """Take out of r (n, d) what the bounds carry, in place."""
        carried = np.where(self.side == 0, 0.0, self.component(r))
        r[self.blocks] -= carried[:, None] * self.normals


def prescribed(problem: Problem, u: fem.Function, space: fem.FunctionSpace) -> tuple[Mask, Array]:
    """Whether a bubble is free (n, d), and what prescribed displacements ask of the others (n, d). Collective.

    Args:
        problem: the prescribed displacements.
        u: the solution, nondimensional.
        space: the bubbles.
    """
    d, owned = problem.scales.dimension, space.dofmap.index_map.size_local
    free, value = np.ones((owned, d), dtype=np.bool_), np.zeros((owned, d))
    points = space.tabulate_dof_coordinates()
    for part in problem.prescribed:
        blocks = _on(space, part.facets)
        free[blocks, part.component] = False
        wanted = part.value.at(points[blocks]) / problem.scales.displacement
        value[blocks, part.component] = wanted - _at(space, blocks, u)[:, part.component]
    return free, value


def _at(space: fem.FunctionSpace, blocks: Entities, u: fem.Function) -> Array:
    """The values (k, d) at some points of the bubbles of a function of another space, from the cells around them."""
    chosen = np.zeros(space.dofmap.index_map.size_local + space.dofmap.index_map.num_ghosts, dtype=np.bool_)
    chosen[blocks] = True
    cells = np.flatnonzero(chosen[space.dofmap.list].any(axis=1)).astype(np.int32)
    found = fem.Function(space)
    found.interpolate(u, cells, cells)
    return np.asarray(found.x.array.reshape(-1, space.dofmap.bs)[blocks])


def bubble_bounds(problem: Problem, u: fem.Function, bounds: Bounds, space: fem.FunctionSpace) -> BubbleBounds:
    """The bounds of a part at the points of its bubbles, interpolated between those at the nodes. Collective.

    Args:
        problem: what was solved.
        u: the solution, nondimensional.
        bounds: at the nodes of the part.
        space: the bubbles.
    """
    d = problem.scales.dimension
    blocks = _on(space, bounds.surface.facets)

    def middle(values: Array) -> Array:
        field = fem.Function(problem.space)
        spread = np.clip(values, -_FAR, _FAR)
        field.x.array.reshape(-1, d)[bounds.surface.blocks] = spread
        field.x.scatter_forward()
        return _at(space, blocks, field)

    normals = middle(bounds.surface.normals)
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    normal = np.sum(bounds.surface.values(u.x.array) * bounds.surface.normals, axis=1)
    lower, upper = (middle((b - normal)[:, None])[:, 0] for b in (bounds.lower, bounds.upper))
    if nodes.degree(problem.space) == 1:  # what is beyond them is rounding; a quadratic function dips
        lower, upper = np.minimum(lower, 0.0), np.maximum(upper, 0.0)
    return BubbleBounds(blocks, normals, lower, upper, np.zeros(len(blocks), np.int8))


def _on(space: fem.FunctionSpace, facets: Entities) -> Entities:
    """Owned blocks on facets, those of a facet of another rank included. Collective."""
    found = fem.locate_dofs_topological(space, space.mesh.topology.dim - 1, facets)
    return np.unique(found[found < space.dofmap.index_map.size_local]).astype(np.int32)


@dataclass(frozen=True, kw_only=True)
class Constraints:
    """What the bubbles must meet.

    Attributes:
        free: where they are not prescribed, (n, d).
        prescribed: what is prescribed elsewhere, (n, d).
        bounds: of the parts with contact.
    """

    free: Mask
    prescribed: Array
    bounds: tuple[BubbleBounds, ...]


def constraints(problem: Problem, u: fem.Function, space: fem.FunctionSpace) -> Constraints:
    """What the bubbles must meet beside a solution. Collective.

    Args:
        problem: what was solved.
        u: the solution, nondimensional.
        space: the bubbles.
    """
    free, value = prescribed(problem, u, space)
    parts = [b for b in problem.bounds if problem.interface_of(b.surface) is None]
    bounds = tuple(bubble_bounds(problem, u, part, space) for part in parts)
    return Constraints(free=free, prescribed=value, bounds=bounds)


def find_least_energy(
    e: fem.Function, stiffness: BubbleStiffness, under: Constraints, load: Array, thresholds: Thresholds = DEFAULT
) -> None:
    """Find the admissible bubbles of least energy under a load. Collective.

    Args:
        e: takes the result, ghosts updated.
        stiffness: a(e, e).
        under: what they must meet.
        load: ρ, (n, d).
        thresholds: how accurately.
    """
    owned = e.x.array[: load.size].reshape(load.shape)
    owned[:] = under.prescribed
    solve(stiffness, load, under.free, owned, under.bounds, thresholds)
    e.x.scatter_forward()


def solve(
    stiffness: BubbleStiffness,
    load: Array,
    free: Mask,
    e: Array,
    parts: Sequence[BubbleBounds],
    thresholds: Thresholds = DEFAULT,
) -> None:
    """The admissible bubbles of least energy, an active set method, a few rounds. Collective.

    Args:
        stiffness: a(e, e).
        load: ρ, (n, d).
        free: where a bubble is not prescribed, (n, d).
        e: what is prescribed, (n, d); the result takes its place.
        parts: the bounds.
        thresholds: how accurately.
    """
    guess = np.where(free, stiffness.diagonal_solve(load), e)
    parts = [part.updated(guess, load) for part in parts]
    del guess
    for _ in range(thresholds.bubble_rounds):
        for part in parts:
            part.put_on_bounds(e)
        project = functools.partial(_project, free, tuple(parts))
        tolerance, steps = thresholds.bubble_tolerance, thresholds.bubble_steps
        force = stiffness.solve(load, e, project, tolerance=tolerance, max_steps=steps)
        changed = [part.updated(e, force) for part in parts]
        same = all(np.array_equal(a.side, b.side) for a, b in zip(parts, changed, strict=True))
        parts = changed
        if stiffness.comm.allreduce(same, op=MPI.LAND):
            break


def _project(free: Mask, parts: Sequence[BubbleBounds], r: Array) -> None:
    """Take out of r (n, d) what is prescribed and what the bounds hold."""
    r *= free
    for part in parts:
        part.project(r)
