"""What the bubbles must meet: prescribed displacements, and the bounds of contact at the points of the bubbles.

The constraints are those of the inequality at these points (Kornhuber 1996; Zou, Veeser, Kornhuber and Gräser 2011).
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt
from dolfinx import fem

from ...mesh import nodes
from ...problem import spaces
from ...problem.problem import Bounds, Problem
from ...typing import Array, Entities, Mask
from .bubbles import of_cell

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
            e: the bubbles at the points, (k, d).
            force: the force on them, (k, d).
        """
        along, push = np.sum(e * self.normals, axis=1), np.sum(force * self.normals, axis=1)
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


@dataclass(frozen=True)
class Prescribed:
    """One prescribed component at the points of a part's bubbles (k of them).

    Attributes:
        blocks: the bubbles' owned blocks, (k,).
        component: number of the component.
        values: what the bubbles are to be, (k,).
    """

    blocks: Entities
    component: int
    values: Array

    def project(self, r: Array) -> None:
        """Take out of r (n, d) what is prescribed, in place."""
        r[self.blocks, self.component] = 0.0


def prescribed(problem: Problem, u: fem.Function, space: fem.FunctionSpace) -> tuple[Prescribed, ...]:
    """What prescribed displacements ask of the bubbles. Collective.

    Args:
        problem: the prescribed displacements.
        u: the solution, nondimensional.
        space: the bubbles.
    """
    found = []
    for part in problem.prescribed:
        points = _Points(space, _on(space, part.facets))
        wanted = part.value.at(points.positions(needed=not part.value.is_number)) / problem.scales.displacement
        found.append(Prescribed(points.blocks, part.component, wanted - points.values(u)[:, part.component]))
    return tuple(found)


class _Points:
    """The points of some bubbles.

    Args:
        space: of the bubbles.
        blocks: their owned blocks, ascending, (k,).

    Attributes:
        blocks: as they are given.
    """

    def __init__(self, space: fem.FunctionSpace, blocks: Entities) -> None:
        self._space, self.blocks = space, blocks
        chosen = np.zeros(space.dofmap.index_map.size_local + space.dofmap.index_map.num_ghosts, dtype=np.bool_)
        chosen[blocks] = True
        of_cells = space.dofmap.list.ravel()
        places = np.flatnonzero(chosen[of_cells])
        _, one = np.unique(of_cells[places], return_index=True)  # any cell around a point knows what is there
        self._cells, self._numbers = np.divmod(places[one], space.dofmap.list.shape[1])

    def values(self, u: fem.Function) -> Array:
        """The values of a displacement of the problem's space, (k, d)."""
        space, degree = u.function_space, nodes.degree(u.function_space)
        places = np.array(of_cell(degree, self._space.mesh.topology.cell_name())) / (2 * degree)
        functions = spaces.simplex_functions(degree, places, spaces.edge_share(space))[self._numbers]
        there = u.x.array.reshape(-1, self._space.dofmap.bs)[space.dofmap.list[self._cells]]
        return np.asarray(np.einsum("kn,knd->kd", functions, there))

    def positions(self, *, needed: bool) -> Array:
        """Where they are, m, (k, 3); zeros where it does not matter: dolfinx finds the points of all bubbles."""
        if not needed:
            return np.zeros((len(self.blocks), 3))
        return np.asarray(self._space.tabulate_dof_coordinates()[self.blocks])


def bubble_bounds(problem: Problem, u: fem.Function, bounds: Bounds, space: fem.FunctionSpace) -> BubbleBounds:
    """The bounds of a part at the points of its bubbles, interpolated between those at the nodes. Collective.

    Args:
        problem: what was solved.
        u: the solution, nondimensional.
        bounds: at the nodes of the part.
        space: the bubbles.
    """
    d = problem.scales.dimension
    points, field = _Points(space, _on(space, bounds.surface.facets)), fem.Function(problem.space)

    def middle(values: Array) -> Array:
        spread = np.clip(values, -_FAR, _FAR)
        field.x.array.reshape(-1, d)[bounds.surface.blocks, : spread.shape[1]] = spread
        field.x.scatter_forward()
        return points.values(field)

    normals = middle(bounds.surface.normals)
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    normal = np.sum(bounds.surface.values(u.x.array) * bounds.surface.normals, axis=1)
    lower, upper = middle(np.column_stack([bounds.lower - normal, bounds.upper - normal]))[:, :2].T
    if nodes.degree(problem.space) == 1:  # what is beyond them is rounding; a quadratic function dips
        lower, upper = np.minimum(lower, 0.0), np.maximum(upper, 0.0)
    return BubbleBounds(points.blocks, normals, lower, upper, np.zeros(len(points.blocks), np.int8))


def _on(space: fem.FunctionSpace, facets: Entities) -> Entities:
    """Owned blocks on facets, those of a facet of another rank included. Collective."""
    found = fem.locate_dofs_topological(space, space.mesh.topology.dim - 1, facets)
    return np.unique(found[found < space.dofmap.index_map.size_local]).astype(np.int32)


@dataclass(frozen=True, kw_only=True)
class Constraints:
    """What the bubbles must meet.

    Attributes:
        prescribed: what is prescribed.
        bounds: of the parts with contact.
    """

    prescribed: tuple[Prescribed, ...]
    bounds: tuple[BubbleBounds, ...]

    def free(self, blocks: Entities) -> Mask:
        """Where bubbles are not prescribed, (k, d).

        Args:
            blocks: the bubbles' owned blocks, with bounds, (k,).
        """
        found = np.ones((len(blocks), self.bounds[0].normals.shape[1]), dtype=np.bool_)
        for given in self.prescribed:
            found[np.isin(blocks, given.blocks), given.component] = False
        return found


def constraints(problem: Problem, u: fem.Function, space: fem.FunctionSpace) -> Constraints:
    """What the bubbles must meet beside a solution. Collective.

    Args:
        problem: what was solved.
        u: the solution, nondimensional.
        space: the bubbles.
    """
    parts = [b for b in problem.bounds if problem.interface_of(b.surface) is None]
    bounds = tuple(bubble_bounds(problem, u, part, space) for part in parts)
    return Constraints(prescribed=prescribed(problem, u, space), bounds=bounds)
