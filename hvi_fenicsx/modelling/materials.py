"""Elastic materials of a model, each in a region or in the whole body."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, Literal

from dolfinx import mesh as dmesh

from ..effects import Effect
from ..effects.anisotropic import OrthotropicElasticity, TensorElasticity
from ..effects.elasticity import IsotropicElasticity
from ..errors import InputError
from . import values
from .placed_effects import InRegion, checked
from .user_energy import UserEnergy

Plane = Literal["plane_stress", "plane_strain", "three_dimensional"]


@dataclass(frozen=True, kw_only=True)
class _Elastic(InRegion):
    """An elastic material.

    Attributes:
        model: by default plane_stress in 2D and three_dimensional in 3D.
        thermal_expansion: 1/K.
        region: where, a name or a list; None: in the whole body.
    """

    model: Plane | None = None
    thermal_expansion: float = 0.0
    region: str | Sequence[str] | None = None

    def _material(self, kind: type[Effect], mesh: dmesh.Mesh, **keys: Any) -> Effect:
        usual = "plane_stress" if mesh.geometry.dim == 2 else "three_dimensional"
        common = {
            "model": usual if self.model is None else self.model,
            "thermal_expansion": values.number(self.thermal_expansion),
        }
        return checked(kind, **common, **keys)


@dataclass(frozen=True, kw_only=True)
class Isotropic(_Elastic):
    """Isotropic linear elasticity (see also :class:`_Elastic`).

    Attributes:
        youngs_modulus: N/m².
        poisson_ratio: between -1 and 0.5.
    """

    youngs_modulus: float
    poisson_ratio: float

    def effect(self, mesh: dmesh.Mesh) -> Effect:
        """The material."""
        keys = {
            "youngs_modulus": values.number(self.youngs_modulus),
            "poisson_ratio": values.number(self.poisson_ratio),
        }
        return self._material(IsotropicElasticity, mesh, **keys)


@dataclass(frozen=True, kw_only=True)
class Orthotropic(_Elastic):
    """Orthotropic linear elasticity with the axes x, y, z (see also :class:`_Elastic`).

    Attributes:
        youngs_moduli: along x, y, z, N/m²; plane stress has two.
        poisson_ratios: ν12, ν13, ν23; plane stress has the first only.
        shear_moduli: G12, G13, G23, N/m²; plane models have the first only.
    """

    youngs_moduli: Sequence[float]
    poisson_ratios: Sequence[float]
    shear_moduli: Sequence[float]

    def effect(self, mesh: dmesh.Mesh) -> Effect:
        """The material."""
        names = ("youngs_moduli", "poisson_ratios", "shear_moduli")
        keys = {name: values.numbers(getattr(self, name)) for name in names}
        return self._material(OrthotropicElasticity, mesh, **keys)


@dataclass(frozen=True, kw_only=True)
class Anisotropic(_Elastic):
    """Linear elasticity with any tensor (see also :class:`_Elastic`).

    Attributes:
        matrix: C in Voigt notation, N/m²: 3 rows in 2D (11, 22, 12), 6 rows in 3D (11, 22, 33, 23, 13, 12).
    """

    matrix: Sequence[Sequence[float]]

    def effect(self, mesh: dmesh.Mesh) -> Effect:
        """The material."""
        return self._material(TensorElasticity, mesh, matrix=values.numbers(self.matrix, values.numbers))


@dataclass(frozen=True)
class Energy(InRegion):
    """An elasticity of the user's own: twice its energy is form(u, u).

    Attributes:
        form: makes the symmetric bilinear UFL form, in SI (J/m in 2D, J in 3D), of a trial function u and a test
            function v in m. It must depend on their strains only.
        region: where, if other materials are elsewhere; the form itself must then integrate over that region.
    """

    form: Callable[[Any, Any], Any]
    region: str | Sequence[str] | None = None

    def effect(self, mesh: dmesh.Mesh) -> Effect:
        """The material, after a look at what it does to stretches and rigid motions. Collective."""
        if not callable(self.form):
            raise InputError(f"give a function that returns the UFL form a(u, v), not {self.form!r}")
        return UserEnergy.examined(self.form, mesh)
