"""A superpotential at the vertices of Γc: its nodal forces and their tangent, by vertex quadrature.

The regularised (or selected) Clarke derivative is known at the vertices; the tangent is block-diagonal.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..effects import Direction
from ..laws import Length, Mixity, Superpotential
from ..typing import Array, Mask
from .contact_surface import Surface

_ROUNDING = 4.0 * float(np.finfo(np.float64).eps)
"""Relative, what dividing a displacement by a stretch may add."""


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
        energies: by what the law is multiplied where it does, frozen at a state: changed by :meth:`freeze`, (m,).
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

    def freeze(self, energies: Array) -> None:
        """Multiply the law by others from now on.

        Args:
            energies: by vertex, (m,).
        """
        self.energies[:] = energies

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
        size = components[:, 0] if self.length is None else self.length.of(components)
        return size if np.all(self.stretch == 1.0) else self._off_rounding(size / self.stretch)

    def _off_rounding(self, argument: Array) -> Array:
        """Arguments (m,), on a convex kink where only rounding keeps them off: a bound may hold them there."""
        for kink in self.law.convex.kinks:
            argument = np.where(np.abs(argument - kink) <= _ROUNDING * np.abs(kink), kink, argument)
        return argument

    def reach(self, near: float | Array) -> Array:
        """Distances of displacements, one for all or (m,), as distances of what j acts on, (m,)."""
        return np.asarray(near / self.stretch, dtype=np.float64)

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
        return np.asarray(np.einsum("mk,mkd->md", along, self.directions) * self.free)

    def rate(self, u: Array, derivative: Array, second: Array) -> Array:
        """The tangent K of j', (m, d, d): times the weights it is that of the forces.

        Args:
            u: the displacement, a local array.
            derivative: of the law at u, (m,).
            second: the law's second derivative at u, (m,).
        """
        steep = second / self.stretch
        local = steep[:, None, None]
        if self.length is not None:
            local = self.length.hessian(self.slip(u), derivative, steep)
        full = np.einsum("mka,mkl,mlb->mab", self.directions, local, self.directions)
        return np.einsum("ma,mab,mb->mab", self.free, full, self.free)
