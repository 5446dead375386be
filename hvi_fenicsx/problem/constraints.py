"""Bounds on u·n and prescribed displacements: the parts with contact or laws, their surfaces, Dirichlet conditions."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import replace
from itertools import combinations, combinations_with_replacement

import numpy as np
from dolfinx import fem
from petsc4py import PETSc

from ..effects import Condition, Effect, NormalBounds, Towards, load_name
from ..errors import InputError
from ..formula import SpatialValue
from ..geometry import spot
from ..mesh import nodes
from ..runtime.mpi import agree, refuse
from ..typing import Array, Entities, magnitude
from . import contact_surface
from .contact_surface import Surface
from .domain_forms import DomainForms
from .problem import Bounds, BoundsForce, BoundsMove, PrescribedComponent
from .scaling import DEFAULT, PlacedContribution
from .spaces import contact_rule, edge_share


def make_surfaces(
    context: DomainForms, contributions: Sequence[PlacedContribution], fixed: Entities, interfaces: Collection[str]
) -> dict[str, Surface]:
    """The surfaces of the boundary parts with bounds or laws, by part, in the scene's order. Collective.

    Args:
        context: spaces, parts and vertices.
        contributions: of all effects.
        fixed: local scalar dofs that are prescribed.
        interfaces: names of interfaces, which are no boundary parts.

    Raises:
        InputError: on all ranks alike: a facet lies inside the body, two sides of a part face each other, or two
            directions that meet at a vertex are neither orthogonal nor equal.
    """
    found = dict.fromkeys(w for w, _, c in contributions if w is not None and (c.bounds or c.laws))
    parts = [where for where in found if where not in interfaces]
    surfaces = {where: _surface(context, where) for where in parts}
    towards = {w: b.towards for w, _, c in contributions for b in c.bounds if w in parts and b.towards is not None}
    stated = {name: _stated(context, surfaces[name], obstacle) for name, obstacle in towards.items()}
    if not context.domain.one_piece:
        contact_surface.refuse_facing_sides(context.mesh.comm, surfaces.values(), context.length)
    return contact_surface.decide(context.mesh.comm, surfaces, stated, fixed, context.length)


def _surface(context: DomainForms, where: str) -> Surface:
    """The surface of a part, with the mean normals of its facets. Collective."""
    facets, degree = context.part_facets[where], nodes.degree(context.space)
    return context.domain.once(
        f"surface {where} of degree {degree}",
        facets.tobytes(),
        lambda: contact_surface.make_surface(
            where,
            context.space,
            context.points,
            facets,
            context.gathered(facets),
            context.boundary(where, **contact_rule(context.space)),
            context.length ** (context.dimension - 1),
        ),
    )


def _stated(context: DomainForms, where: Surface, obstacle: Towards) -> Array:
    """The unit vectors towards an obstacle at the vertices of a part, (m, d). Collective.

    Raises:
        InputError: on all ranks alike: there is none at a vertex, such as at the centre of a ball.
    """
    found = obstacle.towards(where.points[:, : context.dimension])
    bad = np.flatnonzero(~np.all(np.isfinite(found), axis=1))
    said = f"boundary.{where.part}.contact: no direction leads from {{}} to the obstacle; state one"
    refuse(context.mesh.comm, [said.format(where.spot(i)) for i in bad[:1]])
    return found


def make_bounds(
    context: DomainForms,
    surfaces: Mapping[str, Surface],
    contributions: Sequence[PlacedContribution],
    prescribed: Array,
    gaps: Mapping[str, Array],
) -> tuple[Bounds, ...]:
    """The bounds on u·n. Collective.

    Args:
        context: spaces, parts and vertices.
        surfaces: by part.
        contributions: of all effects.
        prescribed: the prescribed values at the local scalar dofs, zero at the others.
        gaps: of interfaces as they are meshed, m, by name.

    Raises:
        InputError: on all ranks alike: a bound that is not a finite number at some vertex, or a measured gap of a part
            that is no interface.
    """
    wanted = [(surfaces[w], e, b) for w, e, c in contributions if w is not None for b in c.bounds]
    for surface, key, bound in ((surface, effect.key, bound) for surface, effect, bound in wanted):
        if bound.measured and surface.part not in gaps:
            raise InputError(f'boundary.{surface.part}.{key}: gap = "measured" needs two bodies; give a number')
        if bound.towards is not None and surface.part in gaps:
            raise InputError(f'boundary.{surface.part}.{key}: an obstacle is no body; give gap = 0.0 or "measured"')
    return tuple(
        _along_normal(_bounds(context, surface, effect, bounds, gaps), prescribed) for surface, effect, bounds in wanted
    )


def _along_normal(stated: Bounds, prescribed: Array) -> Bounds:
    """The bounds on u·n, from those on u·m along the normal m of the scene.

    u·m = (m·n)(u·n) + u·(m - (m·n) n). Where n was turned towards a prescribed component the last summand is known.
    """
    surface = stated.surface
    along = np.sum(surface.measured * surface.normals, axis=1, keepdims=True)
    known = np.sum(surface.values(prescribed) * (surface.measured - along * surface.normals), axis=1)
    lower, upper = ((bound - known) / along[:, 0] for bound in (stated.lower, stated.upper))
    move = stated.move and replace(stated.move, by=stated.move.by / along[:, 0])
    force = stated.force and replace(stated.force, rate=stated.force.rate / along[:, 0])
    return replace(stated, lower=lower, upper=upper, move=move, force=force)


def _bounds(
    context: DomainForms,
    where: Surface,
    effect: Effect,
    bounds: NormalBounds,
    gaps: Mapping[str, Array],
) -> Bounds:
    """The bounds on u·m, m being the normal of the scene, that an effect puts on a part. Collective."""

    def value(formula: SpatialValue | None) -> Array:
        if formula is None:
            return np.full(len(where.blocks), np.inf)
        found = _coefficients(context, where, formula) / context.scales.displacement
        if not all(agree(context.mesh.comm, bool(np.all(np.isfinite(found))))):
            reason = "the gap is not finite everywhere there; see its formula, or where the obstacle lies"
            raise InputError(f"boundary.{where.part}.{effect.key}: {reason}")
        return found

    # lower ≤ -u·n ≤ upper
    open_by = gaps[where.part] / context.scales.displacement if bounds.measured else 0.0
    upper = open_by - value(bounds.lower) if bounds.lower else value(None)
    move = None
    if bounds.move is not None:
        by = upper + value(bounds.move.lower) if bounds.move.straight else np.zeros(len(upper))
        move = BoundsMove(name=load_name(where.part, effect), by=by, straight=bounds.move.straight)
    force = None
    if bounds.force is not None:
        stated, name = bounds.force, load_name(where.part, effect)
        if not stated.straight:
            raise InputError(
                f"boundary.{name}: this obstacle's gaps do not change in proportion to the way that a force moves it; "
                "give it a direction along the force"
            )
        rate = (-value(stated.lower) - upper) * context.scales.displacement
        if not any(agree(context.mesh.comm, bool(np.any(rate < 0.0)))):
            raise InputError(f"boundary.{name}: the force moves the obstacle away from the body; turn it round")
        size = float(np.linalg.norm(stated.vector))
        direction = np.array(stated.vector) / size
        force = BoundsForce(name=name, rate=rate, force=size / context.scales.force, direction=direction)
    return Bounds(where, -value(bounds.upper), upper, move, force)


def _coefficients(context: DomainForms, where: Surface, formula: SpatialValue) -> Array:
    """The coefficients of a formula at the nodes of a part: bounds of those of the displacement, (m,)."""
    if nodes.degree(context.space) == 1 or formula.is_number:
        return formula.at(where.points)
    points, share = context.points_on_curves, edge_share(context.space)
    found = formula.at(points[where.blocks])
    if share == 0.0:
        return found
    ends = points[nodes.edge_ends(context.space)[where.blocks]]
    return (found - share * (formula.at(ends[:, 0]) + formula.at(ends[:, 1]))) / (1 - 2 * share)


def check_bounds(context: DomainForms, bounds: Sequence[Bounds], prescribed: Array, fixed: Entities) -> None:
    """Refuse bounds that exclude a prescribed value: PETSc would silently change it (solver-notes.md). Collective.

    Args:
        context: spaces, parts and vertices.
        bounds: the bounds.
        prescribed: the prescribed values at the local scalar dofs, zero at the others.
        fixed: local scalar dofs that are prescribed.

    Raises:
        InputError: on all ranks alike.
    """
    bad: list[str] = []
    for b in bounds:
        un = np.sum(b.surface.values(prescribed) * b.surface.normals, axis=1)
        out = np.isin(b.component()[0], fixed) & (b.beyond(un) > DEFAULT.same)
        bad += [
            f"boundary.{b.surface.part} at {b.surface.spot(i)}: the prescribed displacement violates the contact bound "
            "there"
            for i in np.flatnonzero(out)[:1]
        ]
    refuse(context.mesh.comm, bad)


def check_contradictions(context: DomainForms, bounds: Sequence[Bounds]) -> None:
    """Refuse bounds that no displacement satisfies: within a part, or of two parts at a vertex of both. Collective.

    Args:
        context: spaces, parts and vertices.
        bounds: the bounds.

    Raises:
        InputError: on all ranks alike, with the first such vertex.
    """
    pairs = combinations_with_replacement(bounds, 2)
    bad = [text for one, other in pairs for text in _contradiction(one, other, context.scales.displacement)]
    refuse(context.mesh.comm, bad)


def _contradiction(one: Bounds, other: Bounds, unit: float) -> list[str]:
    """The first vertex at which two bounds (or one and itself) contradict each other, in words."""
    _, i, j = np.intersect1d(one.surface.blocks, other.surface.blocks, return_indices=True)
    along = np.sum(one.surface.normals[i] * other.surface.normals[j], axis=1)  # 1, -1, or 0: independent bounds
    low = np.where(along > 0, other.lower[j], -other.upper[j])
    high = np.where(along > 0, other.upper[j], -other.lower[j])
    low, high = np.maximum(low, one.lower[i]), np.minimum(high, one.upper[i])
    bad = np.flatnonzero((np.abs(along) > 0.5) & (low - high > DEFAULT.same * (1.0 + np.abs(low))))
    shared = "" if one is other else f", a vertex of boundary.{other.surface.part} too"
    return [
        f"boundary.{one.surface.part}: at {one.surface.spot(i[k])}{shared}, u·n would have to be at least "
        f"{low[k] * unit:.6g} m and at most {high[k] * unit:.6g} m; change one of them, or leave the vertex out of one "
        "part"
        for k in bad[:1]
    ]


def prescribed_components(
    context: DomainForms, contributions: Sequence[PlacedContribution]
) -> tuple[PrescribedComponent, ...]:
    """The prescribed components, with their conditions. Collective.

    Args:
        context: spaces, parts and vertices.
        contributions: of all effects.

    Raises:
        InputError: on all ranks alike: two parts prescribe different values where they meet.
    """
    found = tuple(
        PrescribedComponent(
            name=load_name(where, effect),
            part=str(where),
            component=stated.component,
            facets=context.part_facets[str(where)],
            value=stated.value,
            condition=_condition(context, context.part_facets[str(where)], stated),
        )
        for where, effect, contribution in contributions
        for stated in contribution.conditions
    )
    _check_agreement(context, found)
    return found


def values(context: DomainForms, prescribed: Sequence[PrescribedComponent]) -> Array:
    """What is prescribed at the local scalar dofs, zero at the others.

    Args:
        context: spaces, parts and vertices.
        prescribed: the components.
    """
    found = np.zeros(len(context.points) * context.dimension)
    for one in prescribed:
        one.condition.set(found)
    return found


def _condition(context: DomainForms, facets: Entities, condition: Condition) -> fem.DirichletBC:
    dim = context.dimension - 1
    component = context.space.sub(condition.component)
    if condition.value.is_number and edge_share(context.space) == 0.0:
        value = PETSc.ScalarType(condition.value.source / context.scales.displacement)  # type: ignore[operator]
        return fem.dirichletbc(value, fem.locate_dofs_topological(component, dim, facets), component)
    collapsed, _ = component.collapse()
    function = fem.Function(collapsed)
    function.interpolate(lambda x: condition.value.at(x.T) / context.scales.displacement)
    return fem.dirichletbc(function, fem.locate_dofs_topological((component, collapsed), dim, facets), component)


def _check_agreement(context: DomainForms, found: Sequence[PrescribedComponent]) -> None:
    """Where two parts meet they must prescribe the same: else the order of the tables would decide."""
    prescribed = [(one.part, one.dofs, values(context, [one])[one.dofs]) for one in found]
    size = max((magnitude(v) for _, _, v in prescribed), default=0.0)
    bad: list[str] = []
    for (one, dofs, these), (other, more, those) in combinations(prescribed, 2):
        shared, i, j = np.intersect1d(dofs, more, assume_unique=True, return_indices=True)
        apart = np.abs(these[i] - those[j]) > DEFAULT.same * size
        for dof, *pair in zip(shared[apart], these[i][apart], those[j][apart], strict=True):
            block, component = divmod(int(dof), context.dimension)
            at, (a, b) = (
                spot(context.points[block][: context.dimension]),
                np.multiply(pair, context.scales.displacement),
            )
            bad.append(
                f"boundary.{one} and boundary.{other} meet at {at} and prescribe displacements along "
                f'{"xyz"[component]} that differ, {a:.6g} and {b:.6g} m; make them equal there, or write "free" in one'
            )
    refuse(context.mesh.comm, bad[:1])
