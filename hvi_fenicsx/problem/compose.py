"""From effects on a domain to the problem: what each contributes, made nondimensional, checked and summed up.

Nothing that no effect names is compiled or stored.
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

from ..effects import BoundaryLaw, Direction, Evaluate, NormalBounds, Place
from ..errors import InputError
from ..formula import Formula
from ..laws import Superpotential
from ..mesh.domain import Domain
from ..runtime.mpi import agree
from ..typing import Array, Entities
from . import bulk, contact_surface, dirichlet, scaling
from .contact_surface import Surface
from .domain_forms import DomainForms, Scaled
from .law_term import LawTerm
from .problem import Bounds, PlacedContribution, Prescribed, Problem
from .scaling import Placed, Scales
from .spaces import CONTACT_RULE

Modification = Callable[[Superpotential], Superpotential]
"""What is solved in the place of a law, SI: the law smoothed, say."""


def unchanged(law: Superpotential) -> Superpotential:
    """The law itself."""
    return law


@dataclass(frozen=True)
class Model:
    """What is solved, on any mesh of the body.

    Attributes:
        parts: the sides that each boundary part lies on.
        effects: (where, effect), where being a boundary part, a region, or None for the whole body.
        modify: what is solved in the place of each law.
    """

    parts: Mapping[str, Sequence[str]]
    effects: Sequence[Placed]
    modify: Modification = unchanged


def compose(domain: Domain, model: Model) -> Problem:
    """The problem of a model on a domain. Collective.

    Args:
        domain: the body and its mesh.
        model: the effects and their places.

    Raises:
        InputError: on all ranks alike: a part without facets, a load that is not finite somewhere on its part, a bound
            that excludes a prescribed displacement.
    """
    parts, effects = model.parts, model.effects
    for name, on in parts.items():
        if not sum(agree(domain.mesh.comm, len(domain.facets(on)))):
            raise InputError(f"boundary.{name}: no facet lies on it; see `on`")
    sizes, evaluate = scaling.sizes(domain.length, effects), functools.partial(_evaluation, domain, parts)
    scales = scaling.choose(sizes, domain.dimension, effects, evaluate)
    context = DomainForms(domain, parts, scales, effects)
    made = [PlacedContribution(where, effect, effect.contribute(context, where)) for where, effect in effects]
    doubts = [f"{_place(e)}: {text}" for e in effects for text in e[1].implausible(evaluate(e), sizes)]
    return _sum(context, scales, made, model.modify, tuple(doubts))


def _place(placed: Placed) -> str:
    """Where the scene states an effect."""
    where, effect = placed
    return ".".join(filter(None, (effect.place.value, where, effect.key)))


def _evaluation(domain: Domain, parts: Mapping[str, Sequence[str]], placed: Placed) -> Evaluate:
    """The function that finds a formula's largest absolute value where an effect acts."""
    return functools.partial(_largest, domain, parts, placed)


def _largest(domain: Domain, parts: Mapping[str, Sequence[str]], placed: Placed, formula: Formula) -> float:
    values = formula.at(_points(domain, _entities(domain, parts, placed)))
    finite = bool(np.all(np.isfinite(values)))
    gathered = agree(domain.mesh.comm, (finite, float(np.max(np.abs(values), initial=0.0))))
    if not all(ok for ok, _ in gathered):
        raise InputError(f"{_place(placed)}: the formula {formula.source!r} is not finite everywhere there")
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
    context: DomainForms,
    scales: Scales,
    made: Sequence[PlacedContribution],
    modify: Modification,
    doubts: tuple[str, ...],
) -> Problem:
    wanted = [(str(where), c) for where, _, contribution in made for c in contribution.conditions]
    prescribed = dirichlet.make_conditions(context, scales, wanted)
    held = tuple((where, bc.dof_indices()[0]) for (where, _), bc in zip(wanted, prescribed, strict=True))
    fixed = np.unique(np.concatenate([np.empty(0, np.int32), *(dofs for _, dofs in held)])).astype(np.int32)
    surfaces = _surfaces(context, made)
    bounds = [_bounds(context, surfaces[w], e.key, b, scales) for w, e, c in made if w is not None for b in c.bounds]
    _check_compatible(context, bounds, prescribed, fixed)
    _check_normal_laws(made)
    terms = [
        _term(context, surfaces[w], law, modify, scales, fixed) for w, _, c in made if w is not None for law in c.laws
    ]
    linear, strains = (_by_name(made, kind) for kind in ("linear", "strains"))
    return Problem(
        domain=context.domain,
        scales=scales,
        space=context.space,
        points=context.points,
        bulk=bulk.make_bulk(context.space, scales, made, strains),
        linear={**linear, **strains},
        conditions=prescribed,
        fixed=fixed,
        prescribed=_prescribed(context, made),
        bounds=tuple(bounds),
        terms=tuple(terms),
        surfaces=tuple(surfaces.values()),
        implausible=doubts,
        made=tuple(made),
        held=held,
    )


def _surfaces(context: DomainForms, made: Sequence[PlacedContribution]) -> dict[str, Surface]:
    """The parts with bounds or laws, in the scene's order. Collective."""
    return {
        where: contact_surface.make_surface(
            where,
            context.space,
            context.points,
            context.part_facets[where],
            context.boundary(where, **CONTACT_RULE),
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
    normal = [(w, e.key) for w, e, c in made for law in c.laws if law.direction is not Direction.SLIP]
    for where in dict.fromkeys(w for w, _ in normal):
        keys = sorted(key for w, key in normal if w == where)
        if len(keys) > 1:
            raise InputError(
                f"boundary.{where}: {' and '.join(keys)} act on the same displacement; state them as one law of the "
                'opening, adhesion = { law = "graph", ... }'
            )


def _prescribed(context: DomainForms, made: Sequence[PlacedContribution]) -> tuple[Prescribed, ...]:
    return tuple(
        Prescribed(c.component, context.part_facets[str(where)], c.value)
        for where, _, contribution in made
        for c in contribution.conditions
    )


def _bounds(context: DomainForms, where: Surface, effect: str, bounds: NormalBounds, scales: Scales) -> Bounds:
    """The bounds that an effect, by its key, puts on a part. Collective.

    Raises:
        InputError: on all ranks alike: a bound that is not a finite number at some vertex.
    """

    def value(formula: Formula | None) -> Array:
        if formula is None:
            return np.full(len(where.blocks), np.inf)
        found = formula.at(where.points) / scales.displacement
        if not all(agree(context.domain.mesh.comm, bool(np.all(np.isfinite(found))))):
            reason = "the gap is not finite everywhere there; see its formula"
            raise InputError(f"boundary.{where.part}.{effect}: {reason}")
        return np.asarray(found)

    # lower ≤ -u·n ≤ upper
    return Bounds(where, -value(bounds.upper), -value(bounds.lower) if bounds.lower else value(None))


def _check_compatible(context: DomainForms, bounds: Sequence[Bounds], conditions: Any, fixed: Any) -> None:
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
    context: DomainForms,
    where: Surface,
    law: BoundaryLaw,
    modify: Modification,
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
    ds = Scaled(context.number(context.length ** (1 - context.dimension)), context.boundary(where.part, **CONTACT_RULE))
    residual = ufl.inner(density, context.test) * ds
    return LawTerm(
        surface=where,
        direction=law.direction,
        law=solved,
        exact=exact,
        directions=directions,
        free=free,
        density=density,
        residual=fem.form(residual),
    )
