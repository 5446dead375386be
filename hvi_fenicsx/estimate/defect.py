"""The defect of u_h in the bubbles: minimise ½a(e, e) - ρ(e) among the bubbles that the constraints admit.

ρ is the residual with all that the body feels pointwise: loads, thermal strain, the laws between the nodes. The
constraints are supports and contact.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt
import ufl
from dolfinx import fem

from ..geometry import units
from ..mesh import nodes
from ..problem import spaces
from ..problem.problem import Bounds, Problem
from ..problem.scaling import DEFAULT as composition
from ..problem.vectors import nodal_values
from ..runtime import forms
from ..runtime.mpi import agree
from ..typing import Array, Entities, together
from .bubbles import DEFAULT, BubbleStiffness, of_cell
from .dual_norm import DualNorm
from .law_traces import ErrorField, LawSprings, LawTraces


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
        return np.sum(e[self.blocks] * self.normals, axis=1)

    def updated(self, e: Array, force: Array) -> BubbleBounds:
        """Held where e leaves the bounds or both are one array (prescribed), let go where a force draws away from one.

        Args:
            e: the bubbles at the points, (k, d).
            force: the force on them, (k, d).
        """
        along, push = np.sum(e * self.normals, axis=1), np.sum(force * self.normals, axis=1)
        upper = np.where(self.side == 1, push >= 0, along > self.upper) | (self.lower is self.upper)
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


def _prescribed(problem: Problem, u: fem.Function, space: fem.FunctionSpace) -> Iterator[BubbleBounds]:
    """What prescribed displacements ask of the bubbles: equal bounds along an axis. Collective."""
    d = problem.dimension
    for part in problem.prescribed:
        points = _Points(space, _on(space, part.facets))
        wanted = part.value.at(points.positions(needed=not part.value.is_number)) / problem.scales.displacement
        values, count = wanted - points.values(u)[:, part.component], len(points.blocks)
        axes = np.tile(np.eye(d)[part.component], (count, 1))
        yield BubbleBounds(points.blocks, axes, values, values, np.ones(count, np.int8))


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
        return np.einsum("kn,knd->kd", functions, there)

    def positions(self, *, needed: bool) -> Array:
        """Where they are, m, (k, 3); zeros where it does not matter: dolfinx finds the points of all bubbles."""
        if not needed:
            return np.zeros((len(self.blocks), 3))
        return self._space.tabulate_dof_coordinates()[self.blocks]


def bubble_bounds(problem: Problem, u: fem.Function, bounds: Bounds, space: fem.FunctionSpace) -> BubbleBounds:
    """The bounds of a part at the points of its bubbles, interpolated between those at the nodes. Collective.

    Args:
        problem: what was solved.
        u: the solution, nondimensional.
        bounds: at the nodes of the part.
        space: the bubbles.
    """
    d = problem.dimension
    points, field = _Points(space, _on(space, bounds.surface.facets)), fem.Function(problem.space)

    def middle(values: Array) -> Array:
        far = composition.largest_scale  # an infinite nodal value has no interpolant
        spread = np.clip(values, -far, far)
        field.x.array.reshape(-1, d)[bounds.surface.blocks, : spread.shape[1]] = spread
        field.x.scatter_forward()
        return points.values(field)

    normals = units(middle(bounds.surface.normals))
    normal = np.sum(bounds.surface.values(u.x.array) * bounds.surface.normals, axis=1)
    lower, upper = middle(np.column_stack([bounds.lower - normal, bounds.upper - normal]))[:, :2].T
    if nodes.degree(problem.space) == 1:  # what is beyond them is rounding; a quadratic function dips
        lower, upper = np.minimum(lower, 0.0), np.maximum(upper, 0.0)
    return BubbleBounds(points.blocks, normals, lower, upper, np.zeros(len(points.blocks), np.int8))


def _on(space: fem.FunctionSpace, facets: Entities) -> Entities:
    """Owned blocks on facets, those of a facet of another rank included. Collective."""
    found = fem.locate_dofs_topological(space, space.mesh.topology.dim - 1, facets)
    return np.unique(found[found < space.dofmap.index_map.size_local]).astype(np.int32)


def constraints(problem: Problem, u: fem.Function, space: fem.FunctionSpace) -> tuple[BubbleBounds, ...]:
    """What the bubbles must meet beside a solution: bounds of parts with contact, and what is prescribed. Collective.

    Args:
        problem: what was solved.
        u: the solution, nondimensional.
        space: the bubbles.
    """
    parts = [b for b in problem.bounds if problem.interface_of(b.surface) is None]
    return *_prescribed(problem, u, space), *(bubble_bounds(problem, u, part, space) for part in parts)


class LeastEnergy:
    """The admissible bubbles of least energy, an active set method, a few rounds. Creation is collective.

    Args:
        traces: the laws between the nodes.
        bubbles: take the result.
        stiffness: a(e, e).

    Attributes:
        laws: their force on the bubbles, a part of ρ, (n, d).
        unmet: the force on the nodes that the laws are taken for, (n, d).
        residual: ρ - a(e, ·), what is held included, (n, d); a change of the load is to be added to it.
        energy: a(e, e).
    """

    def __init__(self, traces: LawTraces, bubbles: fem.Function, stiffness: BubbleStiffness) -> None:
        problem, u = traces.problem, traces.u
        self._bubbles, self._stiffness, self.energy, self._begun = bubbles, stiffness, 0.0, False
        self.residual = problem.bulk.residual_in(traces.bubbles, u, problem.linear.values())
        self.laws, self.unmet = traces.tested()
        self.residual -= self.laws
        self._parts = constraints(problem, u, traces.bubbles)
        self._e = bubbles.x.array[: self.residual.size].reshape(self.residual.shape)
        self._special = np.unique(together(part.blocks for part in self._parts))

    def find(self) -> None:
        """Find them; from the second time on from those that were found before. Collective."""
        stiffness, e = self._stiffness, self._e
        guess = e if self._begun else self._guess()
        self._parts = tuple(p.updated(guess[p.blocks], self.residual[p.blocks]) for p in self._parts)
        rough = DEFAULT.rough_tolerance[nodes.degree(stiffness.problem.space) - 1]
        tolerance = rough if self._begun else DEFAULT.tolerance
        square = stiffness.dot(self.residual, self._descent(self.residual))
        goal = max(tolerance**2 * square, DEFAULT.rounding**2)
        for _ in range(DEFAULT.rounds):
            self._put_on_bounds()
            steps = DEFAULT.bubble_steps
            self.energy += stiffness.solve(self.residual, e, self._descent, goal=goal, max_steps=steps)
            changed = tuple(p.updated(e[p.blocks], self.residual[p.blocks]) for p in self._parts)
            same = all(np.array_equal(a.side, b.side) for a, b in zip(self._parts, changed, strict=True))
            self._parts = changed
            if all(agree(stiffness.comm, same)):
                break
        self._bubbles.x.scatter_forward()

    def find_beside(self, springs: LawSprings) -> None:
        """Find them while springs answer their growth; the residual and the energy stay those without. Collective.

        Args:
            springs: what answers.
        """
        if not self._stiffness.hold(springs.diagonal(), springs.times):
            self.find()
            return
        before = springs.times(self._bubbles)
        work = self._stiffness.dot(self._e, before) if self._begun else 0.0
        self.find()
        force = springs.times(self._bubbles)
        self.residual += force - before if self._begun else force
        self.energy += work - self._stiffness.dot(self._e, force)

    def _guess(self) -> Array:
        """What the diagonal alone makes of the load, and what is prescribed, (n, d)."""
        found = self.residual * self._stiffness.inverse
        for part in self._parts:
            part.put_on_bounds(found)
        return found

    def _put_on_bounds(self) -> None:
        """Put the bubbles on the bounds that hold them; the residual follows."""
        before = self._e[self._special]
        for part in self._parts:
            part.put_on_bounds(self._e)
        step = self._e[self._special] - before
        self._e[self._special] -= step
        self._begun = True
        self.energy += self._stiffness.move(self.residual, self._e, self._special, step)

    def _descent(self, r: Array) -> Array:
        return self._stiffness.descent(r, self._project, self._special)

    def _project(self, r: Array) -> None:
        """Take out of r (n, d) what is held, in place."""
        for part in self._parts:
            part.project(r)


class VertexStiffness(BubbleStiffness):
    """The bubbles' stiffness with the nodes that follow them and the averaged volumetric energy of both.

    The diagonal is that of the shear alone: a preconditioner. Creation is collective.

    Args:
        problem: whose elastic operator it is.
        bubbles: the space of bubbles.
        inverse: of the system, for the nodes.

    Attributes:
        at_nodes: the nodes' displacement, as :meth:`follow` found it last.
        pressures: the averaged volumetric stress of bubbles and nodes, by region.
    """

    def __init__(self, problem: Problem, bubbles: fem.FunctionSpace, inverse: DualNorm) -> None:
        super().__init__(problem, bubbles)
        self._node_inverse, self._tolerance = inverse, DEFAULT.vertex_tolerance
        self.at_nodes = fem.Function(problem.space)
        bulk, moved = problem.bulk, self._in + self.at_nodes
        self.pressures = bulk.pressures(self.at_nodes)
        self._dilated = [forms.compiled(part.dilated(moved)) for part in bulk.dilatations]
        tests = ufl.TestFunction(problem.space), ufl.TestFunction(bubbles)
        self._on_nodes, self._action = (
            forms.compiled(bulk.between(moved, v) + bulk.pressed(self.pressures, v)) for v in tests
        )

    def _product(self) -> Array:
        """As of :class:`.BubbleStiffness`, the nodes following. Collective."""
        self._let_follow()
        return super()._product()

    def follow(self, e: Array, unmet: Array) -> None:
        """Let the nodes follow the bubbles and a force, and the pressures both. Collective.

        Args:
            e: the bubbles, (n, d).
            unmet: the force on the nodes, (n, d).
        """
        self._owned(self._in)[:] = e
        self._let_follow(unmet)

    def _let_follow(self, unmet: Array | None = None) -> None:
        """As :meth:`follow`, of the bubbles that products are made of. Collective."""
        self._in.x.scatter_forward()
        self.at_nodes.x.array[:] = 0.0
        self._press()
        force = -self.problem.combined(nodal_values(self._on_nodes))
        if unmet is not None:
            force += unmet
        self.at_nodes.x.array[:] = self._node_inverse.solve(force, self._tolerance)[0].x.array
        self._press()

    def _press(self) -> None:
        """The pressures of the bubbles and the nodes as they are. Collective."""
        parts = self.problem.bulk.dilatations
        for pressure, dilated, part in zip(self.pressures, self._dilated, parts, strict=True):
            average = nodal_values(dilated).ravel()
            pressure.x.array[: len(average)] = part.stiffness.array_r * average
            pressure.x.scatter_forward()

    def on_bubbles(self, unmet: Array) -> Array:
        """What a force at the nodes leaves at the bubbles through the nodes, (n, d). Collective.

        Args:
            unmet: the force on the nodes, (n, d).
        """
        self._owned(self._in)[:] = 0.0
        self._let_follow(unmet)
        return super()._product()


def squares(traces: LawTraces, inverse: DualNorm) -> Array:
    """η_K² of the owned cells: shear and volumetric energy of bubbles and nodes. Collective.

    Args:
        traces: the laws between the nodes.
        inverse: of the system.
    """
    problem, u = traces.problem, traces.u
    stiffness = VertexStiffness(problem, traces.bubbles, inverse)
    bubbles = fem.Function(traces.bubbles)
    least = LeastEnergy(traces, bubbles, stiffness)
    if problem.terms:
        least.residual -= stiffness.on_bubbles(least.unmet)
    springs = LawSprings(traces, ErrorField(fem.Function(problem.space), bubbles))
    stiffness.hold(springs.diagonal(), springs.times)
    least.find()
    stiffness.follow(bubbles.x.array[: least.residual.size].reshape(least.residual.shape), least.unmet)
    shear = problem.bulk.energy_by_cell(bubbles + stiffness.at_nodes)
    return shear + problem.bulk.pressure_energy(stiffness.pressures) + problem.bulk.dilatation_error(u)
