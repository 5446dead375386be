"""A superpotential at the vertices of Γc, and the UFL boundary term through which it enters the equations.

The regularised (or selected) Clarke derivative is a P1 field τ on Γc; its weak form ∫ τ·v ds, with vertex quadrature,
is compiled once and serves every law. The tangent ∫ (K du)·v ds is then block-diagonal (:mod:`.contact_rows`).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from dolfinx import fem
from dolfinx.fem.petsc import assemble_vector
from petsc4py import PETSc

from ..effects import Direction
from ..laws import Superpotential
from ..typing import Array
from .contact_surface import Surface


@dataclass(frozen=True, kw_only=True)
class LawTerm:
    """One law on one part, nondimensional.

    Attributes:
        surface: its vertices (m).
        direction: which displacement it acts on.
        law: the superpotential j that is solved.
        exact: the unsmoothed one (the same where nothing is smoothed).
        directions: what the displacement is multiplied with, (m, k, d); k = 2 for |u_t| in 3D.
        free: 1 where a component is not prescribed, (m, d).
        density: the P1 field τ.
        residual: the compiled form ∫ τ·v ds; None where no quadrature of the functions lumps it.
    """

    surface: Surface
    direction: Direction
    law: Superpotential
    exact: Superpotential
    directions: Array
    free: Array
    density: fem.Function
    residual: Any | None

    @property
    def radial(self) -> bool:
        """Whether the law acts on the length of a slip vector (|u_t| in 3D)."""
        return self.directions.shape[1] > 1

    def slip(self, u: Array) -> Array:
        """The displacement along the directions, of a local array u; shape (m, k)."""
        return np.einsum("mkd,md->mk", self.directions, self.surface.values(u))

    def argument(self, u: Array) -> Array:
        """What the law's j acts on: the signed slip, or |u_t| in 3D; shape (m,)."""
        slip = self.slip(u)
        return slip[:, 0] if slip.shape[1] == 1 else np.linalg.norm(slip, axis=1)

    def add_force(self, out: PETSc.Vec, u: Array, derivative: Array) -> None:
        """Add the law's nodal forces to a vector, whose ghosts are to be added to their owners. Collective.

        Args:
            out: a vector with ghosts.
            u: the displacement, a local array.
            derivative: of the law at u, (m,).
        """
        if self.residual is not None:
            self.set_traction(u, derivative)
            assemble_vector(out, self.residual)
            return
        force = self.surface.weights[:, None] * self._vector(u, derivative) * self.free
        out.array.reshape(-1, force.shape[1])[self.surface.blocks] += force

    def set_traction(self, u: Array, derivative: Array) -> None:
        """Write τ into ``density``; ghosts are updated. Collective.

        Args:
            u: the displacement, a local array.
            derivative: of the law at u, (m,).
        """
        tau = self._vector(u, derivative) * self.free
        self.density.x.array.reshape(-1, tau.shape[1])[self.surface.blocks] = tau
        self.density.x.scatter_forward()

    def _vector(self, u: Array, derivative: Array) -> Array:
        return np.einsum("mk,mkd->md", self._unit(u) * derivative[:, None], self.directions)

    def _unit(self, u: Array) -> Array:
        slip = self.slip(u)
        if slip.shape[1] == 1:
            return np.ones_like(slip)
        r = np.linalg.norm(slip, axis=1, keepdims=True)
        return np.divide(slip, r, out=np.zeros_like(slip), where=r > 0)

    def rate(self, u: Array, derivative: Array, second: Array) -> Array:
        """The tangent K of the law, (m, d, d).

        Args:
            u: the displacement, a local array.
            derivative: of the law at u, (m,).
            second: the law's second derivative at u, (m,).
        """
        unit = self._unit(u)
        k = unit.shape[1]
        along = np.einsum("mi,mj->mij", unit, unit) if k > 1 else np.ones((len(unit), 1, 1))
        local = second[:, None, None] * along
        if k > 1:
            r = np.linalg.norm(self.slip(u), axis=1)
            across = np.divide(derivative, r, out=np.array(second, dtype=float), where=r > 0)
            local = local + across[:, None, None] * (np.eye(k) - along)
        full = np.einsum("mka,mkl,mlb->mab", self.directions, local, self.directions)
        return np.einsum("ma,mab,mb->mab", self.free, full, self.free)
