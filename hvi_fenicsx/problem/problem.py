"""The problem: nondimensional forms, conditions, bounds and laws of all effects together.

Displacements are in units of u0, stresses in units of p0, lengths in units of L (:mod:`.scaling`). The mesh stays in
SI; the forms contain the factors.
"""

from __future__ import annotations

import functools
from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass, replace
from typing import Any, TypeVar

import numpy as np
import numpy.typing as npt
from dolfinx import fem
from mpi4py import MPI
from petsc4py import PETSc

from ..formula import SpatialValue
from ..mesh import nodes
from ..mesh.boundary_part import BoundaryPart
from ..mesh.domain import Domain, SharedObjects
from ..rigid import JoinedBodies
from ..runtime import forms
from ..typing import Array, Entities, Integers
from . import bodies, contact_surface, spaces
from .bodies import MeshBodies
from .contact_surface import Surface
from .dual_basis import Coupling, coupled
from .elastic_operator import Bulk
from .interfaces import Interface
from .law_term import LawTerm
from .scaling import PlacedContribution, Scales

T = TypeVar("T")


@dataclass(frozen=True, kw_only=True)
class BoundsMove:
    """By how much the displacement of an obstacle has moved bounds.

    Attributes:
        name: of the obstacle's part and effect, such as ``lid.contact``.
        by: what it added to the bounds on u·n, (m,).
        straight: whether a part of the displacement adds the same part of it.
    """

    name: str
    by: Array
    straight: bool


@dataclass(frozen=True, kw_only=True)
class BoundsForce:
    """The force that presses an obstacle.

    Attributes:
        name: of the obstacle's part and effect, such as ``lid.contact``.
        rate: what a unit of the obstacle's way adds to the bounds on u·n, (m,).
        force: its size, nondimensional.
        direction: its unit vector, (d,).
        way: along it, by which the obstacle has been moved.
    """

    name: str
    rate: Array
    force: float
    direction: Array
    way: float = 0.0


@dataclass(frozen=True)
class Bounds:
    """Bounds on u·n at the m vertices of a surface, nondimensional.

    Attributes:
        surface: the surface.
        lower: lower bounds, -inf where there is none, (m,).
        upper: upper bounds, inf where there is none, (m,).
        move: what the displacement of an obstacle has to do with them; None: nothing.
        force: what presses the obstacle; None: it is held by its position.
    """

    surface: Surface
    lower: Array
    upper: Array
    move: BoundsMove | None = None
    force: BoundsForce | None = None

    def beyond(self, normal: Array) -> Array:
        """The distance of u·n (m,) beyond its bounds, (m,); negative within them."""
        return np.maximum(normal - self.upper, self.lower - normal)

    def moved(self, way: float) -> Bounds:
        """The bounds where an obstacle that a force presses has moved; else these.

        Args:
            way: along the force, from where it is described, in units of u0.
        """
        if self.force is None:
            return self
        more = (way - self.force.way) * self.force.rate
        force = replace(self.force, way=way)
        return replace(self, lower=self.lower + more, upper=self.upper + more, force=force)

    def component(self) -> tuple[Integers, Array]:
        """The scalar dof of u·n where n is along an axis of its vertex's frame, and the sign of n there, (m,) both."""
        return contact_surface.component_dofs(self.surface.blocks, self.surface.normals)


@dataclass(frozen=True)
class PrescribedComponent:
    """A displacement component that is prescribed.

    Attributes:
        name: of its part and effect, such as ``grip.displacement``.
        part: the boundary part.
        component: its number.
        facets: where, local facets.
        value: its value, m.
        condition: the Dirichlet condition, nondimensional.
    """

    name: str
    part: str
    component: int
    facets: Entities
    value: SpatialValue
    condition: fem.DirichletBC

    @property
    def dofs(self) -> Entities:
        """The local scalar dofs that it prescribes."""
        return self.condition.dof_indices()[0]


@dataclass(frozen=True, kw_only=True)
class Problem:
    """Minimise ½a(u, u) - <g, u> + Σ ∫ j(u) over the admissible u, nondimensional.

    Attributes:
        domain: the body.
        scales: of length, stress and displacement.
        space: P1 vectors.
        points: the position's coefficients at the local nodes (owned and ghost), m, (n, 3); rigid motions are made of
            them.
        bulk: the elastic operator, a(u, v).
        linear: UFL forms <g, v> by name of their place and effect.
        fixed: local scalar dofs (owned and ghost) that they prescribe.
        prescribed: the prescribed components.
        bounds: contact bounds, by part.
        terms: the laws at their vertices.
        surfaces: surfaces of the parts with bounds or laws, in the order of the parts.
        implausible: warnings of effects about their own numbers, in sentences.
        contributions: what each effect contributed.
        part_facets: the local facets of each boundary part.
        pieces: the boundary parts as they are stated, whatever the mesh.
        interfaces: where two bodies meet; their relative displacements are unknowns.
    """

    domain: Domain
    scales: Scales
    space: fem.FunctionSpace
    points: Array
    bulk: Bulk
    linear: dict[str, Any]
    fixed: Entities
    prescribed: tuple[PrescribedComponent, ...]
    bounds: tuple[Bounds, ...]
    terms: tuple[LawTerm, ...]
    surfaces: tuple[Surface, ...]
    implausible: tuple[str, ...]
    contributions: tuple[PlacedContribution, ...]
    part_facets: Mapping[str, Entities]
    pieces: Mapping[str, BoundaryPart]
    interfaces: tuple[Interface, ...] = ()

    @property
    def comm(self) -> MPI.Comm:
        """The communicator."""
        return self.domain.mesh.comm

    @property
    def dimension(self) -> int:
        """2 or 3."""
        return self.scales.dimension

    @functools.cached_property
    def fixed_here(self) -> Entities:
        """The scalar dofs that are prescribed and that this rank owns."""
        return self.fixed[self.fixed < self.space.dofmap.index_map.size_local * self.space.dofmap.index_map_bs]

    @functools.cached_property
    def positions(self) -> Array:
        """Where the local nodes (owned and ghost) are, m, (n, 3): ``points`` but for curved cells in space."""
        return spaces.positions(self.space, self.points)

    @functools.cached_property
    def loads(self) -> dict[str, fem.Form]:
        """The compiled forms of ``linear``. Collective when first used."""
        return {name: forms.compiled(form) for name, form in self.linear.items()}

    def compile(self) -> None:
        """Compile what its assembly needs, or take it from the cache. Collective."""
        _ = self.bulk.compiled, self.loads

    @property
    def has_potential(self) -> bool:
        """Whether the laws are derivatives of an energy; else their energies of separation depend on the mode."""
        return all(term.mixity is None for term in self.terms)

    @functools.cached_property
    def bodies(self) -> MeshBodies:
        """The bodies, those that meet in an interface together. Collective when first used."""
        meetings = [one.members for one in self.interfaces]
        return self.once("bodies", None, lambda: bodies.find(self.domain, self.space, self.points, meetings))

    def once(self, name: str, origin: Any, make: Callable[[], T]) -> T:
        """What is made once; problems of a degree without interfaces share it on meshes for many. Collective.

        Args:
            name: what it is.
            origin: what it is made from besides the mesh and the degree, comparable.
            make: makes it; nobody may change it afterwards. Collective.
        """
        shared = self._own if self.interfaces else self.domain.shared or self._own
        return shared.get(self.comm, f"{name} of degree {nodes.degree(self.space)}", origin, make)

    @functools.cached_property
    def _own(self) -> SharedObjects:
        return SharedObjects()

    def forget(self) -> None:
        """Keep nothing that was made once for this problem alone: on several ranks its PETSc objects outlive it."""
        self.__dict__.pop("_own", None)

    @functools.cached_property
    def coupling(self) -> Coupling | None:
        """The way between displacements and unknowns; None where both are the same. Collective when first used."""
        return coupled(self.space, [one.rows for one in self.interfaces])

    def with_obstacle_at(self, way: float) -> Problem:
        """The problem where the obstacle that a force presses has moved.

        Args:
            way: along the force, in units of u0.
        """
        found = replace(self, bounds=tuple(bounds.moved(way) for bounds in self.bounds))
        known = {name: value for name, value in self.__dict__.items() if name not in found.__dict__}
        found.__dict__.update(known)  # what was computed from the mesh alone
        return found

    @functools.cached_property
    def _relative_motions(self) -> tuple[Array, ...]:
        """The basis motions of each body at all local vertices, relative on interfaces, (n, motions, d) each."""
        points, every = self.points / self.scales.length, np.arange(len(self.points))
        found = []
        for body in self.bodies:
            mine = (self.bodies.labels == body.index)[:, None, None]
            fields = np.where(mine, self.bodies.fields(points, every, body), 0.0)
            columns = [self.relative(np.ascontiguousarray(f)).reshape(f.shape) for f in np.moveaxis(fields, 1, 0)]
            found.append(np.stack(columns, axis=1))
        return tuple(found)

    def motions_at(self, blocks: npt.NDArray[np.integer], body: JoinedBodies) -> Array:
        """The basis motions at vertices of a body as bounds and laws see them, (m, motions, d). Collective at first.

        Args:
            blocks: local vertices, (m,).
            body: one of the bodies.
        """
        if self.coupling is not None:
            return self._relative_motions[body.index][blocks]
        return self.bodies.fields(self.points[blocks] / self.scales.length, blocks, body)

    def interface_of(self, surface: Surface) -> Interface | None:
        """The interface whose first side it is; None for a part of the boundary.

        Args:
            surface: one of the problem's.
        """
        return next((one for one in self.interfaces if one.surface is surface), None)

    def relative(self, u: Array) -> Array:
        """A displacement as what bounds and laws see: relative on interfaces; both local arrays. Collective."""
        return u if self.coupling is None else self.coupling.product(self.coupling.inverse.mult, u)

    def combined(self, forces: Array) -> Array:
        """Forces by owned vertex (n, d) as those that bounds and laws balance: Tᵀ f. Collective."""
        return forces if self.coupling is None else self.coupling.product(self.coupling.matrix.multTranspose, forces)

    def on_bodies(self, forces: Array) -> Array:
        """Forces of bounds and laws by owned vertex (n, d) as those that act on the bodies. Collective."""
        return forces if self.coupling is None else self.coupling.product(self.coupling.inverse.multTranspose, forces)


class FactoredProblem:
    """A problem whose parts of some names are multiplied by a factor. Creation is collective.

    Args:
        problem: the problem at the factor 1.
        scaled: the names of what the factor multiplies, such as ``pull.traction`` or ``grip.displacement``.
    """

    def __init__(self, problem: Problem, scaled: Collection[str]) -> None:
        self._factor = fem.Constant(problem.space.mesh, PETSc.ScalarType(1.0))
        prescribed, self._values = list(problem.prescribed), list[tuple[fem.Function, Array]]()
        for number, one in enumerate(problem.prescribed):
            if one.name in scaled:
                prescribed[number], values = _scaled(problem, one)
                self._values.append((values, values.x.array.copy()))
        bounds = [
            replace(once, lower=once.lower.copy(), upper=once.upper.copy())
            if once.move is not None and once.move.name in scaled
            else once
            for once in problem.bounds
        ]
        self._bounds = [(own, once) for own, once in zip(bounds, problem.bounds, strict=True) if own is not once]
        self._problem = replace(
            problem,
            linear=self._times_factor(problem.linear, scaled),
            bulk=replace(problem.bulk, strains=self._times_factor(problem.bulk.strains, scaled)),
            prescribed=tuple(prescribed),
            bounds=tuple(bounds),
        )

    def _times_factor(self, named: Mapping[str, Any], scaled: Collection[str]) -> dict[str, Any]:
        return {name: self._factor * form if name in scaled else form for name, form in named.items()}

    def at(self, factor: float) -> Problem:
        """The problem at a factor. It holds until the next call, which changes its loads.

        Args:
            factor: λ.
        """
        self._factor.value = factor
        for values, once in self._values:
            values.x.array[:] = factor * once
        for own, stated in self._bounds:
            assert stated.move is not None
            back = (1.0 - factor) * stated.move.by
            own.lower[:], own.upper[:] = stated.lower - back, stated.upper - back
        return self._problem


def _scaled(problem: Problem, prescribed: PrescribedComponent) -> tuple[PrescribedComponent, fem.Function]:
    """A component with a condition of its own, and its values, which will be changed. Collective."""
    component = problem.space.sub(prescribed.component)
    collapsed, _ = component.collapse()
    dofs = fem.locate_dofs_topological((component, collapsed), problem.domain.dimension - 1, prescribed.facets)
    everywhere = np.zeros(len(problem.points) * problem.dimension)
    prescribed.condition.set(everywhere)
    values = fem.Function(collapsed)
    values.x.array[dofs[1]] = everywhere[dofs[0]]
    return replace(prescribed, condition=fem.dirichletbc(values, dofs, component)), values
