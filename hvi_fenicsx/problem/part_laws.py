"""The laws at the vertices of boundary parts, nondimensional."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping, Sequence
from typing import Any

import numpy as np
import ufl
from dolfinx import fem

from ..effects import BoundaryLaw, Direction
from ..errors import InputError
from ..laws import Superpotential
from ..mesh import nodes
from ..runtime import forms
from ..typing import Entities
from .contact_surface import Surface
from .domain_forms import DomainForms, ScaledMeasure
from .law_term import LawTerm
from .problem import PlacedContribution
from .scaling import Scales
from .spaces import contact_rule

Modification = Callable[[Superpotential], Superpotential]
"""The law that is solved in the place of a law, SI: the same law, smoothed for example."""


def unchanged(law: Superpotential) -> Superpotential:
    """The law itself."""
    return law


def check_normal_laws(contributions: Sequence[PlacedContribution]) -> None:
    """Refuse two normal laws on one part: together they are one law of the opening, which the user has to state.

    Raises:
        InputError: on all ranks alike.
    """
    normal = [(w, e.key) for w, e, c in contributions for law in c.laws if law.direction is not Direction.SLIP]
    for where in dict.fromkeys(w for w, _ in normal):
        keys = sorted(key for w, key in normal if w == where)
        if len(keys) > 1:
            raise InputError(
                f"boundary.{where}: {' and '.join(keys)} act on the same displacement; state them as one law of the "
                'opening, adhesion = { law = "graph", ... }'
            )


def make_terms(
    context: DomainForms,
    scales: Scales,
    surfaces: Mapping[str, Surface],
    contributions: Sequence[PlacedContribution],
    fixed: Entities,
    modify: Modification,
    interfaces: Collection[str],
) -> tuple[LawTerm, ...]:
    """The laws at the vertices of their parts. Collective.

    Args:
        context: spaces, parts and vertices.
        scales: what one unit is in SI.
        surfaces: by part.
        contributions: of all effects.
        fixed: local scalar dofs that are prescribed.
        modify: the law that is solved in the place of each law.
        interfaces: names of interfaces, whose weights are no vertex rule.

    Raises:
        InputError: on all ranks alike: a law that cannot be solved in 3D.
    """
    laws = [(surfaces[w], e.key, law) for w, e, c in contributions if w is not None for law in c.laws]
    by_rule = nodes.degree(context.space) == 1
    return tuple(
        _term(context, surface, key, law, modify, scales, fixed, by_rule=by_rule and surface.part not in interfaces)
        for surface, key, law in laws
    )


def _term(
    context: DomainForms,
    where: Surface,
    key: str,
    law: BoundaryLaw,
    modify: Modification,
    scales: Scales,
    fixed: Entities,
    *,
    by_rule: bool,
) -> LawTerm:
    directions = {
        Direction.SLIP: where.tangents,
        Direction.OPENING: -where.normals[:, None, :],
        Direction.PENETRATION: where.normals[:, None, :],
    }[law.direction]
    solved, exact = (_scaled(j, scales, f"boundary.{where.part}.{key}") for j in (modify(law.law), law.law))
    if directions.shape[1] > 1 and np.any(solved.convex.kinks > 0):
        raise InputError(
            f'boundary.{where.part}: law = "{law.law.name}" jumps upwards at a slip > 0, which in 3D is a ring that '
            "bounds cannot follow; smooth it: [solver] smoothing and epsilon"
        )
    density = fem.Function(context.space, name="clarke_derivative")
    return LawTerm(
        surface=where,
        direction=law.direction,
        law=solved,
        exact=exact,
        directions=directions,
        free=(~np.isin(where.dofs, fixed)).astype(np.float64),
        density=density,
        residual=forms.compiled(_residual(context, where, density)) if by_rule else None,
    )


def _scaled(law: Superpotential, scales: Scales, place: str) -> Superpotential:
    """The law in the problem's units.

    Raises:
        InputError: its parameters are too large or too small for these.
    """
    try:
        return law.scaled(scales.displacement, scales.stress)
    except InputError as error:
        units = f"beside displacements of {scales.displacement:.0e} m and stresses of {scales.stress:.0e} N/m²"
        raise InputError(f"{place}: {units} it cannot be computed with: {error}") from None


def _residual(context: DomainForms, where: Surface, density: fem.Function) -> Any:
    """∫ density·v ds over a part, nondimensional."""
    area = context.number(context.length ** (1 - context.dimension))
    return ufl.inner(density, context.test) * ScaledMeasure(area, context.boundary(where.part, **contact_rule(1)))
