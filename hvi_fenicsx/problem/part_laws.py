"""The laws at the vertices of boundary parts, nondimensional."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from itertools import combinations

import numpy as np
from mpi4py import MPI

from ..effects import BoundaryLaw
from ..errors import InputError
from ..formula import SpatialValue
from ..laws import Superpotential
from ..runtime.mpi import agree
from ..typing import Array, Entities
from .contact_surface import Surface
from .domain_forms import DomainForms
from .law_term import LawTerm
from .scaling import DEFAULT, PlacedContribution, Scales

Modification = Callable[[Superpotential], Superpotential]
"""The law that is solved in the place of a law, SI: the same law, smoothed for example."""


def unchanged(law: Superpotential) -> Superpotential:
    """The law itself."""
    return law


def check_laws(contributions: Sequence[PlacedContribution]) -> None:
    """Refuse two laws of one displacement on one part: together they are one law, which the user has to state.

    Raises:
        InputError: on all ranks alike.
    """
    placed = [(w, e.key, law.direction) for w, e, c in contributions for law in c.laws]
    for (one, key, first), (other, second_key, second) in combinations(placed, 2):
        if one != other or not ((first.normal and second.normal) or (first.tangential and second.tangential)):
            continue
        both = first.normal and first.tangential, second.normal and second.tangential
        mend = 'adhesion = { law = "graph", ... }' if not any(both) else "cohesion alone, or adhesion and friction"
        raise InputError(
            f"boundary.{one}: {key} and {second_key} act on the same displacement; state them as one law: {mend}"
        )


def check_moved(comm: MPI.Comm, contributions: Sequence[PlacedContribution], surfaces: Mapping[str, Surface]) -> None:
    """Refuse laws beside an obstacle that is moved along what they act on: the body's own displacement. Collective.

    Args:
        comm: the ranks.
        contributions: of all effects.
        surfaces: by part.

    Raises:
        InputError: on all ranks alike.
    """
    given = [(w, b.move or b.force) for w, _, c in contributions for b in c.bounds]
    moves = {w: np.array(one.vector) for w, one in given if one is not None}
    for where, effect, contribution in contributions:
        if where is None or where not in moves or not contribution.laws:
            continue
        move, normals = moves[where], surfaces[where].normals
        across = np.linalg.norm(move - (normals @ move)[:, None] * normals, axis=1)
        slips = bool(np.any(across > DEFAULT.turned_to_prescribed * np.linalg.norm(move)))
        normal = any(law.direction.normal for law in contribution.laws)
        if any(agree(comm, normal or slips)):
            mend = "let it stand still" if normal else "move it along the normal, or give it a direction"
            raise InputError(
                f"boundary.{where}.{effect.key}: acts on the displacement of the body, not on that relative to the "
                f"obstacle, which moves along it; {mend}, or prescribe a displacement of the body"
            )


def make_terms(
    context: DomainForms,
    scales: Scales,
    surfaces: Mapping[str, Surface],
    contributions: Sequence[PlacedContribution],
    fixed: Entities,
    modify: Modification,
) -> tuple[LawTerm, ...]:
    """The laws at the vertices of their parts. Collective.

    Args:
        context: spaces, parts and vertices.
        scales: what one unit is in SI.
        surfaces: by part.
        contributions: of all effects.
        fixed: local scalar dofs that are prescribed.
        modify: the law that is solved in the place of each law.

    Raises:
        InputError: on all ranks alike: a law that cannot be solved in 3D.
    """
    laws = [(surfaces[w], e.key, law) for w, e, c in contributions if w is not None for law in c.laws]
    return tuple(_term(context, surface, key, law, modify, scales, fixed) for surface, key, law in laws)


def _term(
    context: DomainForms,
    where: Surface,
    key: str,
    law: BoundaryLaw,
    modify: Modification,
    scales: Scales,
    fixed: Entities,
) -> LawTerm:
    """A law of an effect (its key) on a part. Collective."""
    length = law.direction.length(where.tangents.shape[1], law.slip)
    solved, exact = (_scaled(j, scales, f"boundary.{where.part}.{key}", law.slip) for j in (modify(law.law), law.law))
    if length is not None and np.any(solved.convex.kinks > 0):
        raise InputError(
            f'boundary.{where.part}: law = "{law.law.name}" jumps upwards at a length > 0 of a vector, which is a '
            "ring that bounds cannot follow; smooth it: [solver] smoothing and epsilon"
        )
    if law.contradictions is not None:
        said = agree(context.domain.mesh.comm, law.contradictions(where.points))
        if texts := [text for rank in said for text in rank]:
            raise InputError(f"boundary.{where.part}.{key}: {texts[0]}")
    return LawTerm(
        surface=where,
        direction=law.direction,
        law=solved,
        exact=exact,
        placed=_factor(context, where, f"{key}: multiplier", law.multiplier),
        stretch=_factor(context, where, f"{key}: length_multiplier", law.length_multiplier),
        directions=law.direction.along(where.normals, where.tangents),
        length=length,
        free=(~np.isin(where.dofs, fixed)).astype(np.float64),
        mixity=law.mixity,
        energies=np.ones(len(where.weights)),
    )


def _factor(context: DomainForms, where: Surface, key: str, given: SpatialValue) -> Array:
    """What tractions or lengths of a law are multiplied by at the vertices of its part, (m,). Collective.

    Raises:
        InputError: on all ranks alike: it is not a positive number somewhere.
    """
    found, most = given.at(where.points), DEFAULT.largest_scale
    bad = np.flatnonzero(~((found >= 1.0 / most) & (found <= most)))
    said = [f"{found[i]:g} at {where.spot(i)}" for i in bad[:1]]
    for text in (text for rank in agree(context.domain.mesh.comm, said) for text in rank):
        reason = (
            f"it must be positive at every vertex, from {1.0 / most:g} to {most:g}. Where there is no law, leave that "
            "piece out: `where`"
        )
        raise InputError(f"boundary.{where.part}.{key} = {given.source!r} is {text}; {reason}")
    return found


def _scaled(law: Superpotential, scales: Scales, place: str, slip: float) -> Superpotential:
    """The law in the problem's units.

    Args:
        law: in SI.
        scales: what one unit is in SI.
        place: where the scene states it.
        slip: what its slips are multiplied by.

    Raises:
        InputError: its parameters are too large or too small for these.
    """
    most = DEFAULT.largest_scale
    try:
        scaled = law.scaled(scales.displacement, scales.stress)
        if not all(1.0 / most <= size <= most for size in (scaled.length_scale, slip)) or scaled.energy_scale > most:
            raise InputError(
                f"its displacements are about {law.length_scale / slip:.0e} m; give all numbers in m and N/m²"
            )
        return scaled
    except InputError as error:
        units = f"beside displacements of {scales.displacement:.0e} m and stresses of {scales.stress:.0e} N/m²"
        raise InputError(f"{place}: {units} it cannot be computed with: {error}") from None
