"""A superpotential at the vertices of Γc: its nodal forces and their tangent, by vertex quadrature.

The regularised (or selected) Clarke derivative is known at the vertices; the tangent is block-diagonal.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np
from mpi4py import MPI

from ..effects import BoundaryLaw, Direction
from ..errors import InputError
from ..formula import SpatialValue
from ..laws import Length, Mixity, Superpotential
from ..runtime.mpi import agree, refuse
from ..typing import Array, Entities, Mask
from .contact_surface import Surface
from .domain_forms import DomainForms
from .scaling import DEFAULT, PlacedContribution, Scales


@dataclass(frozen=True, kw_only=True)
class LawTerm:
    """One law on one part, nondimensional.

    Attributes:
        surface: its vertices (m).
        direction: which displacement it acts on.
        law: the superpotential j that is solved.
        exact: the unsmoothed one (the same where nothing is smoothed).
        placed: what the scene multiplies the tractions of j by at each vertex, positive, (m,).
        stretch: what the scene multiplies the lengths of j by there, positive: the law is stretch j(· / stretch), (m,).
        directions: unit vectors that the displacement is multiplied with, (m, k, d).
        length: what the law acts on is this length of the k components; None: the signed component, k = 1.
        free: 1 where a component is not prescribed, (m, d).
        mixity: how the energy of separation depends on the mode; None: it does not.
        energies: by what the law is multiplied where it does, frozen at a state: these numbers may change, (m,).
    """

    surface: Surface
    direction: Direction
    law: Superpotential
    exact: Superpotential
    placed: Array
    stretch: Array
    directions: Array
    length: Length | None
    free: Array
    mixity: Mixity | None
    energies: Array

    def energies_of(self, components: Array, near: Array) -> Array:
        """By what the law is multiplied at the mode mixity of a displacement, (m,); where δ is zero, as it is frozen.

        Args:
            components: of the displacement, (m, k).
            near: lengths up to this are zero, (m,).
        """
        if self.mixity is None or self.length is None:
            return self.energies
        share = self.length.slip_share(components, near)
        return np.where(np.isnan(share), self.energies, self.mixity.energy(np.nan_to_num(share)))

    @property
    def weights(self) -> Array:
        """Lumped areas times multiplier, over L^(d-1): j' times these are forces, (m,)."""
        return self.surface.weights * self.multiplier

    @property
    def energy_weights(self) -> Array:
        """What j times these are energies, (m,)."""
        return self.weights * self.stretch

    @property
    def multiplier(self) -> Array:
        """What the tractions of j are multiplied by: by the scene, and by the energy at its mode mixity, (m,)."""
        return self.placed * self.energies

    @property
    def radial(self) -> bool:
        """Whether the law acts on the length of a vector: |u_t| in 3D, or both modes together."""
        return self.length is not None

    @property
    def is_linear(self) -> bool:
        """Whether its forces are proportional to the displacement: what opens must also close."""
        return self.law.is_linear and not (self.length is not None and self.length.opens)

    def slip(self, u: Array) -> Array:
        """The components along the directions, of a local array u; shape (m, k)."""
        return np.einsum("mkd,md->mk", self.directions, self.surface.values(u))

    def argument(self, u: Array) -> Array:
        """What the law's j acts on: the signed component, or the length of the vector, over the stretch, (m,)."""
        return self.argument_of(self.slip(u))

    def argument_of(self, components: Array) -> Array:
        """What the law's j acts on, (m,).

        Args:
            components: along the directions, (m, k).
        """
        argument = components[:, 0] if self.length is None else self.length.of(components)
        if np.any(self.stretch != 1.0):
            argument = argument / self.stretch
            for kink in self.law.convex.kinks:  # a bound may hold it there, where only rounding keeps it off
                argument = np.where(np.abs(argument - kink) <= DEFAULT.rounding * np.abs(kink), kink, argument)
        return argument

    def reach(self, near: float | Array) -> Array:
        """Distances of displacements, one for all or (m,), as distances of what j acts on, (m,)."""
        return near / self.stretch

    def gradient(self, components: Array) -> Array:
        """The derivative of the argument times stretch by the components (m, k); zero where a length is zero."""
        return np.ones_like(components) if self.length is None else self.length.gradient(components)

    def counts(self, u: Array, near: float | Array) -> Mask:
        """Which components a kink at zero may hold, (m, k): an opening that is negative counts for nothing.

        Args:
            u: the displacement, a local array.
            near: distances up to this are zero, one for all or (m,).
        """
        components = self.slip(u)
        if self.length is None:
            return np.ones(components.shape, dtype=bool)
        return self.length.counts_at_zero(components, near)

    def force(self, u: Array, derivative: Array) -> Array:
        """The law's nodal forces, by vertex quadrature, (m, d).

        Args:
            u: the displacement, a local array.
            derivative: of j at u, (m,).
        """
        along = self.gradient(self.slip(u)) * (self.weights * derivative)[:, None]
        return np.einsum("mk,mkd->md", along, self.directions) * self.free

    def rate(self, u: Array, derivative: Array, second: Array) -> Array:
        """The tangent K of j', (m, d, d): times the weights it is that of the forces.

        Args:
            u: the displacement, a local array.
            derivative: of the law at u, (m,).
            second: the law's second derivative at u, (m,).
        """
        steep = second / self.stretch
        local: Array = steep[:, None, None]
        if self.length is not None:
            local = self.length.hessian(self.slip(u), derivative, steep)
        full = np.einsum("mka,mkl,mlb->mab", self.directions, local, self.directions)
        return np.einsum("ma,mab,mb->mab", self.free, full, self.free)


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
        raise InputError(
            f"boundary.{one}: {key} and {second_key} act on the same displacement; state them as one law: one graph, "
            "or cohesion alone, or adhesion and friction"
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
            raise InputError(
                f"boundary.{where}.{effect.key}: acts on the displacement of the body, not on that relative to the "
                "obstacle, which moves along it; let it stand still, or (beside friction) move it along the normal or "
                "give it a direction; or prescribe a displacement of the body"
            )


def make_terms(
    context: DomainForms,
    surfaces: Mapping[str, Surface],
    contributions: Sequence[PlacedContribution],
    fixed: Entities,
    modify: Modification,
) -> tuple[LawTerm, ...]:
    """The laws at the vertices of their parts. Collective.

    Args:
        context: spaces, parts and vertices.
        surfaces: by part.
        contributions: of all effects.
        fixed: local scalar dofs that are prescribed.
        modify: the law that is solved in the place of each law.

    Raises:
        InputError: on all ranks alike: a law that cannot be solved in 3D.
    """
    laws = [(surfaces[w], e.key, law) for w, e, c in contributions if w is not None for law in c.laws]
    return tuple(_term(context, surface, key, law, modify, fixed) for surface, key, law in laws)


def _term(
    context: DomainForms,
    where: Surface,
    key: str,
    law: BoundaryLaw,
    modify: Modification,
    fixed: Entities,
) -> LawTerm:
    """A law of an effect (its key) on a part. Collective."""
    length = law.direction.length(where.tangents.shape[1], law.slip)
    solved, exact = (
        _scaled(j, context.scales, f"boundary.{where.part}.{key}", law.slip) for j in (modify(law.law), law.law)
    )
    if length is not None and np.any(solved.convex.kinks > 0):
        raise InputError(
            f'boundary.{where.part}: law = "{law.law.name}" jumps upwards at a length > 0 of a vector, which is a '
            "ring that bounds cannot follow; smooth it: [solver] smoothing and epsilon"
        )
    if law.contradictions is not None:
        said = law.contradictions(where.points)
        refuse(context.mesh.comm, [f"boundary.{where.part}.{key}: {text}" for text in said])
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
    said = [
        f"boundary.{where.part}.{key} = {given.source!r} is {found[i]:g} at {where.spot(i)}; it must be positive at "
        f"every vertex, from {1.0 / most:g} to {most:g}. Where there is no law, leave that piece out: `where`"
        for i in bad[:1]
    ]
    refuse(context.mesh.comm, said)
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
