"""Anisotropic elasticity: by engineering constants along the axes, or by the whole tensor."""

from __future__ import annotations

from abc import abstractmethod
from typing import Annotated, Any, ClassVar

import numpy as np
from pydantic import BeforeValidator, model_validator
from typing_extensions import override

from ..schema import Finite, Positive, refusal
from ..typing import Array
from .base import FormContext
from .contribution import Contribution
from .elasticity import Elasticity, strain, voigt

_SYMMETRIC = 1e-9
"""Difference of two entries of C, over the largest one, that still counts as none."""


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

    @override
    def contribute(self, context: FormContext, where: str | None) -> Contribution:
        """The bilinear form, strains multiplied by L. The pattern of zeros of C is compiled, its values are not."""
        length, cells = context.number(context.length), context.cells(where)
        given, virtual = (voigt(length * strain(v), context.dimension) for v in (context.trial, context.test))
        c = self.stiffness() / context.modulus
        density = sum(context.number(c[i, j]) * given[j] * virtual[i] for i, j in np.argwhere(c != 0.0))
        return Contribution(bilinear=(density * cells,), across=self.across(context, cells))

    def thermal_stress(self) -> Array:
        """C : αI."""
        normal = self.dimension() or 2
        return np.asarray(self.thermal_expansion * self.stiffness()[:, :normal].sum(axis=1))

    @override
    def modulus_scale(self) -> float:
        """The largest diagonal entry of C."""
        return float(np.max(np.diag(self.stiffness())))


def _definite(matrix: Array, hint: str) -> None:
    largest = float(np.max(np.abs(matrix)))
    if not 0.0 < largest < np.inf:
        raise refusal("the elasticity is zero, or its numbers are too large or too far apart; give moduli in N/m²")
    lowest = float(np.linalg.eigvalsh(matrix / largest)[0])
    if lowest <= 1e-12:
        raise refusal(f"the elasticity is not positive definite (relative eigenvalue {lowest:.3g}): {hint}")


class OrthotropicElasticity(_ByMatrix):
    """Orthotropic linear elasticity with the axes x, y, z. For rotated axes use `elasticity = "tensor"`."""

    key: ClassVar[str] = "orthotropic"
    term: ClassVar[str] = "a(u, v) = ∫ σ(u):ε(v) dx, orthotropic"

    youngs_moduli: Numbers
    """Young's moduli E1, E2, E3 along x, y, z, N/m²; plane stress has no E3"""
    poisson_ratios: Ratios
    """ratios ν12, ν13, ν23: νij is the contraction along j under tension along i; plane stress has ν12 only"""
    shear_moduli: Numbers
    """shear moduli G12, G13, G23, N/m²; plane models have G12 only"""

    @model_validator(mode="after")
    def _fits(self) -> OrthotropicElasticity:
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

    def _held(self) -> Array:
        """Normal stresses from normal strains."""
        return np.asarray(np.linalg.inv(self._compliance()), dtype=np.float64)

    def stiffness(self) -> Array:
        """The inverse of the compliance; plane strain leaves out what only z would need."""
        normal = self._held()
        g = self.shear_moduli
        if self.model == "three_dimensional":
            return _blocks(normal, np.diag([g[2], g[1], g[0]]))
        return _blocks(normal[:2, :2], np.diag(g))

    def thermal_stress(self) -> Array:
        """C : αI; in plane strain with the expansion along z, which is held too."""
        if self.model != "plane_strain":
            return super().thermal_stress()
        normal = self._held()
        return np.append(self.thermal_expansion * normal[:2].sum(axis=1), 0.0)

    def out_of_plane(self) -> Array:
        """The third row of what is held in plane strain."""
        if self.model != "plane_strain":
            return super().out_of_plane()
        row = self._held()[2]
        return np.array([row[0], row[1], self.thermal_expansion * row.sum()])


def _blocks(normal: Array, shear: Array) -> Array:
    n = len(normal)
    c = np.zeros((n + len(shear), n + len(shear)))
    c[:n, :n], c[n:, n:] = normal, shear
    return c


class TensorElasticity(_ByMatrix):
    """Linear elasticity with any tensor, as a matrix in Voigt notation: σ = C ε, shear strains doubled.

    In 2D it is what the plane model leaves of it: the model's name then changes nothing, and σ_33, which it does not
    tell, is written as zero.
    """

    key: ClassVar[str] = "tensor"
    term: ClassVar[str] = "a(u, v) = ∫ σ(u):ε(v) dx, C given"

    matrix: Rows
    """C in N/m², a list of rows: 3 rows in 2D (order 11, 22, 12), 6 rows in 3D (order 11, 22, 33, 23, 13, 12)"""

    @model_validator(mode="after")
    def _fits(self) -> TensorElasticity:
        size = 6 if self.model == "three_dimensional" else 3
        if len(self.matrix) != size or any(len(row) != size for row in self.matrix):
            raise refusal(f"matrix must have {size} rows of {size} numbers for {self.model}")
        c = self.stiffness()
        if np.max(np.abs(c - c.T)) > _SYMMETRIC * np.max(np.abs(c)):
            i, j = np.unravel_index(np.argmax(np.abs(c - c.T)), c.shape)
            raise refusal(f"matrix is not symmetric: C[{i + 1}][{j + 1}] = {c[i, j]:g}, not {c[j, i]:g}")
        _definite(c, "some strain would cost no energy")
        return self

    def stiffness(self) -> Array:
        """As it was given."""
        return np.array(self.matrix)
