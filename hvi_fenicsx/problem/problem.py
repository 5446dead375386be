"""The problem: the sum of what a scene's effects contribute, as nondimensional UFL forms, conditions, bounds and laws.

Nothing that the scene does not name is compiled or stored. Displacements are in units of u0, stresses of p0, lengths of
L (:mod:`.scaling`); the mesh itself stays in SI, the forms carry the factors.
"""

from __future__ import annotations

import functools
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import dolfinx
import numpy as np
import ufl
from dolfinx import fem

from ..effects import BoundaryLaw, Contribution, Direction, Effect, NormalBounds, Place
from ..errors import InputError
from ..formula import Formula
from ..laws import Superpotential
from ..mesh.domain import Domain
from ..runtime.mpi import agree
from ..typing import Array, Entities, Integers
from . import bodies, bulk, scaling
from . import contact_surface as surface
from . import dirichlet as conditions
from .bodies import MeshBodies
from .bulk import Bulk
from .contact_surface import Surface
from .form_context import FormContext, Scaled
from .law_term import LawTerm
from .scaling import Placed, Scales

PlacedContribution = tuple[str | None, Effect, Contribution]
"""An effect with its place and what it contributed."""
_VERTEX = {"quadrature_rule": "vertex", "quadrature_degree": 1}


@dataclass(frozen=True)
class Bounds:
    """lower ≤ u·n ≤ upper at a surface's vertices, nondimensional, shape (m,), infinite where there is none."""

    surface: Surface
    lower: Array
    upper: Array

    def beyond(self, normal: Array) -> Array:
        """How far u·n (m,) is outside of the bounds; negative within."""
        return np.maximum(normal - self.upper, self.lower - normal)

    def component(self) -> tuple[Integers, Array]:
        """The scalar dof (m,) of u·n where n is along an axis of its vertex's frame, and n's sign there (m,)."""
        return surface.component_dofs(self.surface.blocks, self.surface.normals)


@dataclass(frozen=True)
class Prescribed:
    """A displacement component that is prescribed on facets (local), its value in SI."""

    component: int
    facets: Entities
    value: Formula


@dataclass(frozen=True)
class Problem:
    """Minimise ½a(u, u) - <g, u> + Σ laws over the admissible u, nondimensional.

    Attributes:
        domain, scales: as they are. space: P1 vectors. points: its local vertices (owned and ghost), m, (n, 3).
        bulk: the elastic operator, a(u, v).
        linear: UFL forms <g, v> of the loads, by name of their part.
        conditions: Dirichlet conditions, nondimensional values.
        fixed: local scalar dofs (owned and ghost) that they prescribe. prescribed: where and what they prescribe.
        bounds: by part. terms: the laws at their vertices.
        surfaces: of the parts with bounds or laws, in the scene's order.
        made: what each effect contributed. held: the dofs of each condition, with its part.
    """

    domain: Domain
    scales: Scales
    space: fem.FunctionSpace
    points: Array
    bulk: Bulk
    linear: dict[str, Any]
    conditions: tuple[fem.DirichletBC, ...]
    fixed: Entities
    prescribed: tuple[Prescribed, ...]
    bounds: tuple[Bounds, ...]
    terms: tuple[LawTerm, ...]
    surfaces: tuple[Surface, ...]
    made: tuple[PlacedContribution, ...]
    held: tuple[tuple[str, Entities], ...]

    @functools.cached_property
    def fixed_here(self) -> Entities:
        """The scalar dofs that are prescribed and that this rank owns."""
        return self.fixed[self.fixed < self.space.dofmap.index_map.size_local * self.space.dofmap.index_map_bs]

    @functools.cached_property
    def bodies(self) -> MeshBodies:
        """The connected parts of the mesh. Collective when first used."""
        return bodies.find(self.domain, self.space, self.points)


def compose(
    domain: Domain,
    parts: Mapping[str, Sequence[str]],
    effects: Sequence[Placed],
    modify: Callable[[Superpotential], Superpotential] = lambda law: law,
) -> Problem:
    """The problem of a scene's effects on a domain. Collective.

    Args:
        domain: the body.
        parts: the sides that each boundary part lies on.
        effects: (where, effect), where being a part, a region or None.
        modify: what to do with each law (smoothing it, say), in SI.

    Raises:
        InputError: on all ranks alike: a part without facets, a load that is not finite somewhere on its part, a bound
            that excludes a prescribed displacement.
    """
    for name, on in parts.items():
        if not sum(agree(domain.mesh.comm, len(domain.facets(on)))):
            raise InputError(f"boundary.{name}: no facet lies on it; see `on`")
    scales = scaling.choose(
        domain.length, domain.dimension, effects, lambda placed: functools.partial(_largest, domain, parts, placed)
    )
    context = FormContext(domain, parts, scales, effects)
    return _sum(context, scales, [(where, e, e.contribute(context, where)) for where, e in effects], modify)


def _largest(domain: Domain, parts: Mapping[str, Sequence[str]], placed: Placed, formula: Formula) -> float:
    where, effect = placed
    values = formula.at(_points(domain, _entities(domain, parts, placed)))
    finite = bool(np.all(np.isfinite(values)))
    gathered = agree(domain.mesh.comm, (finite, float(np.max(np.abs(values), initial=0.0))))
    if not all(ok for ok, _ in gathered):
        place = effect.place.value if where is None else f"{effect.place.value}.{where}"
        raise InputError(f"{place}.{effect.key}: the formula {formula.source!r} is not finite everywhere there")
    return max(value for _, value in gathered)


def _entities(domain: Domain, parts: Mapping[str, Sequence[str]], placed: Placed) -> tuple[int, Any]:
    """Dimension and local entities of where an effect acts; None: the whole body."""
    where, effect = placed
    if where is None:
        return domain.dimension, None
    if effect.place is Place.BOUNDARY:
        return domain.dimension - 1, domain.facets(parts[where])
    return domain.dimension, domain.cells([where])


def _points(domain: Domain, entities: tuple[int, Any]) -> Array:
    dimension, found = entities
    if found is None:
        return domain.mesh.geometry.x
    if not len(found):
        return np.empty((0, 3))  # dolfinx divides by their number
    return domain.mesh.geometry.x[np.unique(dolfinx.mesh.entities_to_geometry(domain.mesh, dimension, found))]


def _sum(
    context: FormContext,
    scales: Scales,
    made: Sequence[PlacedContribution],
    modify: Callable[[Superpotential], Superpotential],
) -> Problem:
    wanted = [(str(where), c) for where, _, contribution in made for c in contribution.conditions]
    prescribed = conditions.build(context, scales, wanted)
    held = tuple((where, bc.dof_indices()[0]) for (where, _), bc in zip(wanted, prescribed, strict=True))
    fixed = np.unique(np.concatenate([np.empty(0, np.int32), *(dofs for _, dofs in held)])).astype(np.int32)
    surfaces = _surfaces(context, made)
    bounds = [_bounds(context, surfaces[w], b, scales) for w, _, c in made if w is not None for b in c.bounds]
    _check_compatible(context, bounds, prescribed, fixed)
    _check_normal_laws(made)
    terms = [
        _term(context, surfaces[w], law, modify, scales, fixed) for w, _, c in made if w is not None for law in c.laws
    ]
    linear, strains = (_by_name(made, kind) for kind in ("linear", "strains"))
    return Problem(
        context.domain,
        scales,
        context.space,
        context.points,
        bulk.build(context.space, scales, made, strains),
        {**linear, **strains},
        prescribed,
        fixed,
        _prescribed(context, made),
        tuple(bounds),
        tuple(terms),
        tuple(surfaces.values()),
        tuple(made),
        held,
    )


def _surfaces(context: FormContext, made: Sequence[PlacedContribution]) -> dict[str, Surface]:
    """The parts with bounds or laws, in the scene's order. Collective."""
    return {
        where: surface.build(
            where,
            context.space,
            context.points,
            context.part_facets[where],
            context.boundary(where, **_VERTEX),
            context.length ** (context.dimension - 1),
            next((b.direction for w, _, other in made if w == where for b in other.bounds), None),
        )
        for where in dict.fromkeys(w for w, _, c in made if w is not None and (c.bounds or c.laws))
    }


def _by_name(made: Sequence[PlacedContribution], kind: str) -> dict[str, Any]:
    """Forms of one kind by the name of their place and effect; several tables may load one place."""
    found: dict[str, Any] = {}
    for where, effect, contribution in made:
        for form in getattr(contribution, kind):
            name = f"{where or 'body'}.{effect.key}"
            found[name] = found[name] + form if name in found else form
    return found


def _check_normal_laws(made: Sequence[PlacedContribution]) -> None:
    """Two normal laws on one part would be one law of the opening: the user states it."""
    normal = [w for w, _, c in made for law in c.laws if law.direction is not Direction.SLIP]
    for where in normal:
        if normal.count(where) > 1:
            raise InputError(
                f"boundary.{where}: adhesion and support act on the same displacement; state them as one law of the "
                'opening, adhesion = { law = "graph", ... }'
            )


def _prescribed(context: FormContext, made: Sequence[PlacedContribution]) -> tuple[Prescribed, ...]:
    return tuple(
        Prescribed(c.component, context.part_facets[str(where)], c.value)
        for where, _, contribution in made
        for c in contribution.conditions
    )


def _bounds(context: FormContext, where: Surface, bounds: NormalBounds, scales: Scales) -> Bounds:
    """Collective.

    Raises:
        InputError: on all ranks alike: a bound that is not a finite number at some vertex.
    """

    def value(formula: Formula | None) -> Array:
        if formula is None:
            return np.full(len(where.blocks), np.inf)
        found = formula.at(where.points) / scales.displacement
        if not all(agree(context.domain.mesh.comm, bool(np.all(np.isfinite(found))))):
            raise InputError(f"boundary.{where.part}.contact: the gap is not finite everywhere there; see its formula")
        return np.asarray(found)

    # lower ≤ -u·n ≤ upper
    return Bounds(where, -value(bounds.upper), -value(bounds.lower) if bounds.lower else value(None))


def _check_compatible(context: FormContext, bounds: Sequence[Bounds], conditions: Any, fixed: Any) -> None:
    """A bound that excludes a prescribed value would silently change it (solver-notes.md)."""
    prescribed = fem.Function(context.space)
    for condition in conditions:
        condition.set(prescribed.x.array)
    bad: list[str] = []
    for b in bounds:
        un = np.sum(b.surface.values(prescribed.x.array) * b.surface.normals, axis=1)
        axis = np.argmax(np.abs(b.surface.normals), axis=1)
        held = np.isin(b.surface.blocks * context.dimension + axis, fixed)
        out = held & ((un < b.lower - 1e-12) | (un > b.upper + 1e-12))
        bad += [f"{b.surface.part} at {tuple(map(float, b.surface.points[i]))}" for i in np.flatnonzero(out)[:1]]
    found = [b for rank in agree(context.domain.mesh.comm, bad) for b in rank]
    if found:
        raise InputError(f"boundary.{found[0]}: the prescribed displacement violates the contact bound there")


def _term(
    context: FormContext,
    where: Surface,
    law: BoundaryLaw,
    modify: Callable[[Superpotential], Superpotential],
    scales: Scales,
    fixed: Entities,
) -> LawTerm:
    directions = {
        Direction.SLIP: where.tangents,
        Direction.OPENING: -where.normals[:, None, :],
        Direction.PENETRATION: where.normals[:, None, :],
    }[law.direction]
    solved, exact = (j.scaled(scales.displacement, scales.stress) for j in (modify(law.law), law.law))
    if directions.shape[1] > 1 and np.any(solved.convex.kinks > 0):
        raise InputError(
            f'boundary.{where.part}: law = "{law.law.name}" jumps upwards at a slip > 0, which in 3D is a ring that '
            "bounds cannot follow; smooth it: [solver] smoothing and epsilon"
        )
    free = (~np.isin(where.dofs, fixed)).astype(np.float64)
    density = fem.Function(context.space, name="clarke_derivative")
    ds = Scaled(context.number(context.length ** (1 - context.dimension)), context.boundary(where.part, **_VERTEX))
    residual = ufl.inner(density, context.test) * ds
    return LawTerm(where, law.direction, solved, exact, directions, free, density, fem.form(residual))


__all__ = ["Bounds", "Place", "Problem", "compose"]
