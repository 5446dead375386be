"""Linear elasticity of a region: stress from strain, a(u, v) = ∫ σ(u):ε(v) dx (paper, section 4).

Isotropic, orthotropic by engineering constants along the axes, or by the whole tensor.
"""

from __future__ import annotations

from abc import abstractmethod
from typing import Annotated, Any, Literal, Self

import numpy as np
from pydantic import BeforeValidator, Field, model_validator

from ..errors import InputError
from ..geometry import ROUNDING
from ..schema import Finite, Names, Positive, refusal
from ..typing import Array, magnitude
from .base import Effect, FormContext, Place, Sides, from_python
from .contribution import Averaged, Contribution

_LOCKING = 0.45
"""Poisson's ratio above which P1 cells answer too stiffly (docs/methods.md)."""
Plane = Literal["plane_stress", "plane_strain", "three_dimensional"]
COMPONENTS = {2: ((0, 0), (1, 1), (0, 1)), 3: ((0, 0), (1, 1), (2, 2), (1, 2), (0, 2), (0, 1))}
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
    return [tensor[i, j] if i == j else 2 * tensor[i, j] for i, j in COMPONENTS[dimension]]


class Elasticity(Effect):
    """What every elastic material has, whatever its symmetry.

    Stresses and strains are in Voigt's order 11, 22, 12 or 11, 22, 33, 23, 13, 12, shear strains doubled.
    """

    place = Place.MATERIAL

    region: Annotated[Names | None, Field(exclude=True)] = None
    """a physical group of cells, or a list of them; required if there are several materials"""
    model: Plane | None = None
    """the kind of elastic problem, required in a scene; the paper uses plane_stress"""
    thermal_expansion: Finite = 0.0
    """the coefficient α of thermal expansion, 1/K; used by `temperature` in a body table"""

    @from_python
    def __init__(self, **keys: Any) -> None:
        self._make(keys.get("region"), **keys)

    def model_post_init(self, context: Any) -> None:
        """Its place is its region."""
        self._where = self.region

    def at(self, where: Sides | None, name: str = "") -> Self:
        """In another region."""
        placed = super().at(where, name)
        return placed.model_copy(update={"region": placed.where})

    def fitted(self, dimension: int) -> Self:
        """With plane stress in the plane where nothing was said of it."""
        if self.model is not None:
            return self
        usual = "plane_stress" if dimension == 2 else "three_dimensional"
        return self.changed(model=usual).at(self.where, self.name)

    @abstractmethod
    def held(self) -> Array:
        """Normal stresses from normal strains, N/m²; (2, 2) in plane stress, else (3, 3)."""

    def thermal_stress(self) -> Array:
        """Stress that holds the material back from expanding by 1 K, N/m²; shape (3,) or (6,)."""
        normal, shear = (2, 1) if self.dimension() == 2 else (3, 3)
        return np.pad(self.thermal_expansion * self.held().sum(axis=1)[:normal], (0, shear))

    def out_of_plane(self) -> Array:
        """σ_33 of a plane body by unit ε_11, ε_22 and ΔT = -1 K, N/m²; shape (3,). Zero in plane stress."""
        if self.model != "plane_strain":
            return np.zeros(3)
        row = self.held()[2]
        return np.array([row[0], row[1], self.thermal_expansion * row.sum()])

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

    def expansion_scale(self) -> float:
        """|α|."""
        return abs(self.thermal_expansion)

    def dimension(self) -> int | None:
        """2 for the plane models."""
        if self.model is None:
            return None
        return 3 if self.model == "three_dimensional" else 2

    def check(self, dimension: int) -> None:
        """Plane models are for 2D, the other for 3D."""
        if self.dimension() != dimension:
            allowed = "three_dimensional" if dimension == 3 else "plane_stress or plane_strain"
            raise InputError(f'model = "{self.model}" is not for {dimension}D; use {allowed}')


class Isotropic(Elasticity):
    """Isotropic linear elasticity. Plane stress is the Hooke law of the paper (equation (tau))."""

    key = "isotropic"
    term = "a(u, v) = ∫ σ(u):ε(v) dx, isotropic"

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

    def held(self) -> Array:
        """λ + 2μ on the diagonal, λ beside it."""
        trace, twice_shear = self.lame()
        size = 2 if self.model == "plane_stress" else 3
        return trace * np.ones((size, size)) + twice_shear * np.eye(size)

    def modulus_scale(self) -> float:
        """E."""
        return self.youngs_modulus


def _tuples(value: Any) -> Any:
    return tuple(_tuples(v) for v in value) if isinstance(value, list | tuple) else value


Numbers = Annotated[tuple[Positive, ...], BeforeValidator(_tuples)]
Ratios = Annotated[tuple[Finite, ...], BeforeValidator(_tuples)]
Rows = Annotated[tuple[tuple[Finite, ...], ...], BeforeValidator(_tuples)]


class _ByMatrix(Elasticity):
    """An elasticity known by its Voigt matrix."""

    @abstractmethod
    def stiffness(self) -> Array:
        """C with σ = C ε in Voigt's order, N/m²; shape (3, 3) or (6, 6)."""

    def contribute(self, context: FormContext, where: str | None) -> Contribution:
        """The bilinear form, strains multiplied by L. The pattern of zeros of C is compiled, its values are not."""
        length, cells = context.number(context.length), context.cells(where)
        given, virtual = (voigt(length * strain(v), context.dimension) for v in (context.trial, context.test))
        c = self.stiffness() / context.modulus
        density = sum(context.number(c[i, j]) * given[j] * virtual[i] for i, j in np.argwhere(c != 0.0))
        return Contribution(bilinear=(density * cells,), across=self.across(context, cells))

    def modulus_scale(self) -> float:
        """The largest diagonal entry of C."""
        return float(np.max(np.diag(self.stiffness())))


def _definite(matrix: Array, hint: str) -> None:
    largest = magnitude(matrix)
    if not 0.0 < largest < np.inf:
        raise refusal("the elasticity is zero, or its numbers are too large or too far apart; give moduli in N/m²")
    lowest = float(np.linalg.eigvalsh(matrix / largest)[0])
    if lowest <= 1e-12:
        raise refusal(f"the elasticity is not positive definite (relative eigenvalue {lowest:.3g}): {hint}")


class Orthotropic(_ByMatrix):
    """Orthotropic linear elasticity with the axes x, y, z. For rotated axes use `elasticity = "tensor"`."""

    key = "orthotropic"
    term = "a(u, v) = ∫ σ(u):ε(v) dx, orthotropic"

    youngs_moduli: Numbers
    """Young's moduli E1, E2, E3 along x, y, z, N/m²; plane stress has no E3"""
    poisson_ratios: Ratios
    """ratios ν12, ν13, ν23: νij is the contraction along j under tension along i; plane stress has ν12 only"""
    shear_moduli: Numbers
    """shear moduli G12, G13, G23, N/m²; plane models have G12 only"""

    @model_validator(mode="after")
    def _fits(self) -> Orthotropic:
        if self.model is None:
            return self
        plane, solid = self.model == "plane_stress", self.model == "three_dimensional"
        wanted = {"youngs_moduli": 2 if plane else 3, "poisson_ratios": 1 if plane else 3}
        for name, count in {**wanted, "shear_moduli": 3 if solid else 1}.items():
            if len(getattr(self, name)) != count:
                raise refusal(f"{name} has {len(getattr(self, name))} entries; {self.model} wants {count}")
        e = np.sqrt(self.youngs_moduli)  # the ratios decide, however far apart the moduli are
        _definite(self._compliance() * np.outer(e, e), "|νij| must stay below √(Ei/Ej), and in 3D all three together")
        return self

    def _compliance(self) -> Array:
        """Normal strains from normal stresses, shape (2, 2) in plane stress, else (3, 3)."""
        e = self.youngs_moduli
        s = np.diag([1.0 / value for value in e])
        pairs = ((0, 1), (0, 2), (1, 2))[: len(self.poisson_ratios)]
        for (i, j), ratio in zip(pairs, self.poisson_ratios, strict=True):
            s[i, j] = s[j, i] = -ratio / e[i]
        return s

    def held(self) -> Array:
        """Normal stresses from normal strains."""
        return np.linalg.inv(self._compliance())

    def stiffness(self) -> Array:
        """The inverse of the compliance; plane strain leaves out what only z would need."""
        from scipy.linalg import block_diag

        normal = self.dimension() or 2
        return block_diag(self.held()[:normal, :normal], np.diag(self.shear_moduli[::-1]))


class Anisotropic(_ByMatrix):
    """Linear elasticity with any tensor, as a matrix in Voigt notation: σ = C ε, shear strains doubled.

    In 2D it is what the plane model leaves of it: the model's name then changes nothing, and σ_33, which it does not
    tell, is written as zero.
    """

    key = "tensor"
    term = "a(u, v) = ∫ σ(u):ε(v) dx, C given"

    matrix: Rows
    """C in N/m², a list of rows: 3 rows in 2D (order 11, 22, 12), 6 rows in 3D (order 11, 22, 33, 23, 13, 12)"""

    @model_validator(mode="after")
    def _fits(self) -> Anisotropic:
        if self.model is None:
            return self
        size = 6 if self.model == "three_dimensional" else 3
        if len(self.matrix) != size or any(len(row) != size for row in self.matrix):
            raise refusal(f"matrix must have {size} rows of {size} numbers for {self.model}")
        c = self.stiffness()
        if magnitude(c - c.T) > ROUNDING * magnitude(c):
            i, j = np.unravel_index(np.argmax(np.abs(c - c.T)), c.shape)
            raise refusal(f"matrix is not symmetric: C[{i + 1}][{j + 1}] = {c[i, j]:g}, not {c[j, i]:g}")
        _definite(c, "some strain would cost no energy")
        return self

    def stiffness(self) -> Array:
        """As it was given."""
        return np.array(self.matrix)

    def held(self) -> Array:
        """The block of normal stresses and strains."""
        normal = self.dimension() or 2
        return self.stiffness()[:normal, :normal]

    def thermal_stress(self) -> Array:
        """C : αI."""
        return self.thermal_expansion * self.stiffness()[:, : self.dimension() or 2].sum(axis=1)

    def out_of_plane(self) -> Array:
        """Zero: the matrix does not tell it."""
        return np.zeros(3)
