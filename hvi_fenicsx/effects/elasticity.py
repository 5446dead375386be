"""Linear elasticity of a region: stress from strain, a(u, v) = ∫ σ(u):ε(v) dx (paper, section 4)."""

from __future__ import annotations

from abc import abstractmethod
from typing import Annotated, Any, ClassVar, Literal

import numpy as np
from pydantic import Field
from typing_extensions import override

from ..errors import InputError
from ..schema import Finite, Positive
from ..typing import Array
from .base import Effect, FormContext, Place
from .contribution import Averaged, Contribution

_LOCKING = 0.45
"""Poisson's ratio above which P1 cells answer too stiffly (docs/methods.md)."""
_PAIRS = {2: ((0, 0), (1, 1), (0, 1)), 3: ((0, 0), (1, 1), (2, 2), (1, 2), (0, 2), (0, 1))}
"""Voigt's order of tensor components, by dimension."""


def strain(v: Any) -> Any:
    """ε(v), the symmetric gradient."""
    import ufl  # here and below: a scene is read without it

    return ufl.sym(ufl.grad(v))


def voigt(tensor: Any, dimension: int) -> list[Any]:
    """A strain in Voigt's order, shear strains doubled.

    Args:
        tensor: the strain, in UFL.
        dimension: of space.
    """
    return [tensor[i, j] if i == j else 2 * tensor[i, j] for i, j in _PAIRS[dimension]]


class Elasticity(Effect):
    """What every elastic material has, whatever its symmetry.

    Stresses and strains are in Voigt's order 11, 22, 12 or 11, 22, 33, 23, 13, 12, shear strains doubled.
    """

    place: ClassVar[Place] = Place.MATERIAL

    model: Literal["plane_stress", "plane_strain", "three_dimensional"]
    """the kind of elastic problem; the paper uses plane_stress"""
    thermal_expansion: Finite = 0.0
    """the coefficient α of thermal expansion, 1/K; used by `temperature` in a body table"""

    @abstractmethod
    def thermal_stress(self) -> Array:
        """Stress that holds the material back from expanding by 1 K, N/m²; shape (3,) or (6,)."""

    def out_of_plane(self) -> Array:
        """σ_33 of a plane body by unit ε_11, ε_22 and ΔT = -1 K, N/m²; shape (3,). Zero in plane stress."""
        return np.zeros(3)

    def across(self, context: FormContext, cells: Any) -> tuple[Any, ...]:
        """∫ σ_33(u) q dx, nondimensional; nothing where it is zero.

        Args:
            context: what an effect may see of the problem.
            cells: UFL's measure of the material's cells.
        """
        deformation = context.number(context.length) * strain(context.trial)
        found = [(i, float(c)) for i, c in enumerate(self.out_of_plane()[:2] / context.modulus) if c]
        sigma = sum(context.number(c) * deformation[i, i] for i, c in found)
        return (sigma * context.scalar_test * cells,) if found else ()

    @override
    def expansion_scale(self) -> float:
        """|α|."""
        return abs(self.thermal_expansion)

    @override
    def dimension(self) -> int | None:
        """2 for the plane models."""
        return 3 if self.model == "three_dimensional" else 2

    @override
    def check(self, dimension: int) -> None:
        """Plane models are for 2D, the other for 3D."""
        if self.dimension() != dimension:
            allowed = "three_dimensional" if dimension == 3 else "plane_stress or plane_strain"
            raise InputError(f'model = "{self.model}" is not for {dimension}D; use {allowed}')


class IsotropicElasticity(Elasticity):
    """Isotropic linear elasticity. Plane stress is the Hooke law of the paper (equation (tau))."""

    key: ClassVar[str] = "isotropic"
    term: ClassVar[str] = "a(u, v) = ∫ σ(u):ε(v) dx, isotropic"

    youngs_modulus: Positive
    """Young's modulus E, N/m²"""
    poisson_ratio: Annotated[float, Field(gt=-1, lt=0.5, allow_inf_nan=False)]
    """Poisson's ratio ν, between -1 and 0.5"""

    def lame(self) -> tuple[float, float]:
        """λ of the trace term and 2μ, N/m²; plane stress uses the paper's Eν/(1-ν²)."""
        e, nu = self.youngs_modulus, self.poisson_ratio
        trace = e * nu / (1 - nu**2) if self.model == "plane_stress" else e * nu / ((1 + nu) * (1 - 2 * nu))
        return trace, e / (1 + nu)

    def stress(self, deformation: Any, number: Any, modulus: float) -> Any:
        """σ/E0 of a strain tensor, in UFL.

        Args:
            deformation: the strain tensor, in UFL.
            number: makes a constant of a number.
            modulus: E0, N/m².
        """
        import ufl

        lam, two_mu = (number(value / modulus) for value in self.lame())
        return lam * ufl.tr(deformation) * ufl.Identity(len(deformation[0, :])) + two_mu * deformation

    @property
    def locks(self) -> bool:
        """Whether P1 cells would lock: nearly incompressible, and not free to change thickness."""
        return self.model != "plane_stress" and self.poisson_ratio > _LOCKING

    @override
    def contribute(self, context: FormContext, where: str | None) -> Contribution:
        """The bilinear form, strains multiplied by L: nondimensional. Where P1 locks, div u is averaged by vertex."""
        import ufl

        length, cells = context.number(context.length), context.cells(where)
        deformation, virtual = length * strain(context.trial), length * strain(context.test)
        if not self.locks:
            sigma = self.stress(deformation, context.number, context.modulus)
            return Contribution(bilinear=(ufl.inner(sigma, virtual) * cells,), across=self.across(context, cells))
        lam, two_mu = (value / context.modulus for value in self.lame())
        shear = context.number(two_mu) * ufl.inner(deformation, virtual) * cells
        divergence = context.scalar_test * length * ufl.div(context.trial) * cells
        return Contribution(
            bilinear=(shear,), averaged=(Averaged(lam, two_mu, divergence, context.scalar_test * cells),)
        )

    def out_of_plane(self) -> Array:
        """λ, λ, Eα/(1-2ν)."""
        if self.model != "plane_strain":
            return super().out_of_plane()
        return np.array([self.lame()[0], self.lame()[0], self.thermal_stress()[0]])

    def thermal_stress(self) -> Array:
        """Eα/(1-2ν), in plane stress Eα/(1-ν): there the thickness is free."""
        plane = self.model == "plane_stress"
        held = self.youngs_modulus / (1 - (1 if plane else 2) * self.poisson_ratio)
        normal, shear = (2, 1) if self.dimension() == 2 else (3, 3)
        return self.thermal_expansion * held * np.repeat([1.0, 0.0], [normal, shear])

    @override
    def modulus_scale(self) -> float:
        """E."""
        return self.youngs_modulus
