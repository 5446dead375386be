"""From effects on a domain to the problem: the contributions of all effects, nondimensional, checked and added up.

What no effect asks for is neither compiled nor stored.
"""

from __future__ import annotations

import functools
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import dolfinx
import numpy as np

from ..effects import Drive, Evaluate, Place, load_name
from ..errors import InputError
from ..formula import SpatialValue
from ..mesh.boundary_part import BoundaryPart, InterfaceSides
from ..mesh.domain import Domain
from ..runtime.mpi import largest
from ..typing import Entities, magnitude, together
from . import constraints, domain_forms, elastic_operator, interfaces, law_term, scaling
from .contact_surface import Surface
from .domain_forms import DomainForms
from .law_term import Modification, unchanged
from .problem import Problem
from .scaling import Placed, PlacedContribution
from .spaces import coefficients_of


@dataclass(frozen=True)
class Formulation:
    """What is solved, on any mesh of the body.

    Attributes:
        parts: the boundary parts by name; of an interface, the first side.
        effects: (where, effect), where being a boundary part, a region, or None for the whole body.
        modify: what is solved in the place of each law.
        interfaces: the two sides of each, by name.
        degree: of the elements, 1 or 2.
        volumetric_ratio: λ/μ where div u is averaged, at most: a softer body gives a start for a stiffer one.
    """

    parts: Mapping[str, BoundaryPart]
    effects: Sequence[Placed]
    modify: Modification = unchanged
    interfaces: Mapping[str, InterfaceSides] = field(default_factory=dict)
    degree: int = 1
    volumetric_ratio: float = np.inf


def compose(domain: Domain, model: Formulation) -> Problem:
    """The problem of a model on a domain. Collective.

    Args:
        domain: the body and its mesh.
        model: the effects and their places.

    Raises:
        InputError: on all ranks alike: a part without facets, a load that is not finite somewhere on its part, a bound
            that excludes a prescribed displacement.
    """
    effects = model.effects
    facets = domain_forms.find(domain, model.parts, effects)
    sizes = scaling.sizes(domain.length, effects)

    def evaluate(placed: Placed) -> Evaluate:
        return functools.partial(_largest, domain, facets, placed)

    scales = scaling.choose(sizes, domain.dimension, effects, evaluate)
    implausible = [f"{scaling.place(e)}: {text}" for e in effects for text in e[1].implausible(evaluate(e), sizes)]
    while True:
        found = _problem(DomainForms(domain, facets, scales, effects, model.degree), model, tuple(implausible))
        stress = _measured_overlap(found) * scales.modulus / scales.length
        if not stress > scales.stress:
            return found
        scales = replace(scales, stress=stress)  # an overlap that only the mesh knows is the largest load


def _measured_overlap(problem: Problem) -> float:
    """By how much sides overlap of which a gap is measured, m. Collective."""
    measured = [where for where, _, c in problem.contributions if any(bound.measured for bound in c.bounds)]
    depths = [float(np.max(-one.gap, initial=0.0)) for one in problem.interfaces if one.name in measured]
    return largest(problem.comm, max(depths, default=0.0))


def _largest(domain: Domain, facets: Mapping[str, Entities], placed: Placed, formula: SpatialValue) -> float:
    """The largest absolute value of a formula where an effect acts. Collective."""
    dimension, found = _entities(domain, facets, placed)
    points = np.empty((0, 3))
    if len(found):  # dolfinx divides by their number
        points = domain.mesh.geometry.x[np.unique(dolfinx.mesh.entities_to_geometry(domain.mesh, dimension, found))]
        if placed[1].drive is Drive.LOAD or placed[1].place is Place.BODY:  # integrated, not taken at vertices
            points = np.vstack([points, dolfinx.mesh.compute_midpoints(domain.mesh, dimension, found)])
    values = formula.at(points)
    most = largest(domain.mesh.comm, magnitude(np.where(np.isnan(values), np.inf, values)))
    if most == np.inf:
        text = f"the formula {formula.source!r} is not finite everywhere there"
        raise InputError(f"{scaling.place(placed)}: {text}")
    return most


def _entities(domain: Domain, facets: Mapping[str, Entities], placed: Placed) -> tuple[int, Entities]:
    """Dimension and local entities of where an effect acts."""
    where, effect = placed
    if where is not None and effect.place is Place.BOUNDARY:
        return domain.dimension - 1, facets[where]
    if where is not None:
        return domain.dimension, domain.cells([where])
    return domain.dimension, np.arange(domain.mesh.topology.index_map(domain.dimension).size_local, dtype=np.int32)


def _problem(context: DomainForms, model: Formulation, implausible: tuple[str, ...]) -> Problem:
    """All contributions together. Collective."""
    contributions = [PlacedContribution(where, one, one.contribute(context, where)) for where, one in model.effects]
    components = constraints.prescribed_components(context, contributions)
    prescribed = constraints.values(context, components)
    fixed = together(one.dofs for one in components)
    surfaces, found = _surfaces(context, contributions, fixed, model)
    fixed = np.unique(np.concatenate([fixed, *(one.tied for one in found)])).astype(np.int32)
    gaps = {one.name: one.gap for one in found}
    bounds = constraints.make_bounds(context, surfaces, contributions, prescribed, gaps)
    constraints.check_bounds(context, bounds, prescribed, fixed)
    constraints.check_contradictions(context, bounds)
    law_term.check_laws(contributions)
    law_term.check_moved(context.mesh.comm, contributions, surfaces)
    terms = law_term.make_terms(context, surfaces, contributions, fixed, model.modify)
    linear, strains = (_by_name(contributions, kind) for kind in ("linear", "strains"))
    return Problem(
        domain=context.domain,
        scales=context.scales,
        space=context.space,
        points=coefficients_of(context.space, context.points),
        bulk=elastic_operator.make_bulk(
            context.space, context.scales, contributions, strains, context.domain.shared, model.volumetric_ratio
        ),
        linear={**linear, **strains},
        fixed=fixed,
        prescribed=components,
        bounds=bounds,
        terms=terms,
        surfaces=tuple(surfaces.values()),
        implausible=implausible,
        contributions=tuple(contributions),
        part_facets=context.part_facets,
        pieces=model.parts,
        interfaces=found,
    )


def _surfaces(
    context: DomainForms, contributions: Sequence[PlacedContribution], fixed: Entities, model: Formulation
) -> tuple[dict[str, Surface], tuple[interfaces.Interface, ...]]:
    """The parts of Γc by name, those of interfaces too, and the interfaces. Collective."""
    surfaces = constraints.make_surfaces(context, contributions, fixed, model.interfaces)
    occupied = np.concatenate([fixed // context.dimension, *(surface.blocks for surface in surfaces.values())])
    found = interfaces.find(context, model.interfaces, occupied, fixed)
    return surfaces | {one.name: one.surface for one in found}, found


def _by_name(contributions: Sequence[PlacedContribution], kind: str) -> dict[str, Any]:
    """Forms of one kind by the name of their place and effect; several tables may load one place."""
    found: dict[str, Any] = {}
    for where, effect, contribution in contributions:
        for form in getattr(contribution, kind):
            name = load_name(where, effect)
            found[name] = found[name] + form if name in found else form
    return found
