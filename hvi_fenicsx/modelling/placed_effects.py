"""Effects with their places, as Python programs write them: each is one of the scene's effects on a named place."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass
from typing import Any, Literal

from dolfinx import mesh as dmesh
from pydantic import ValidationError

from .. import effects
from ..effects import Effect
from ..effects.anisotropic import OrthotropicElasticity, TensorElasticity
from ..errors import InputError
from ..laws import Superpotential
from ..mesh.domain import Domain
from ..schema import input_error
from . import values
from .user_energy import UserEnergy

Value = Any
"""A number, a formula in x, y, z, a Python function of x (3, n), a scalar UFL expression or fem.Function; SI."""
Vector = Any
"""A list of values, one for each component; or a Python function with values (d, n), a UFL vector, a fem.Function."""
Plane = Literal["plane_stress", "plane_strain", "three_dimensional"]


class PlacedEffect(ABC):
    """An effect and its place."""

    @property
    @abstractmethod
    def where(self) -> str | None:
        """A side or region of the body; None: the whole body."""

    @abstractmethod
    def places(self, domain: Domain) -> Collection[str]:
        """The names that its place may have on a body."""

    @abstractmethod
    def effect(self, mesh: dmesh.Mesh) -> Effect:
        """The effect, checked. Collective.

        Args:
            mesh: the body's mesh.

        Raises:
            InputError: a value is not allowed.
        """


class _OnSide(PlacedEffect):
    """An effect on a side.

    Attributes:
        side: a name of the body's.
    """

    side: str

    @property
    def where(self) -> str:
        return self.side

    def places(self, domain: Domain) -> Collection[str]:
        return domain.sides


class _InRegion(PlacedEffect):
    """An effect in a region.

    Attributes:
        region: a name of the body's; None: the whole body.
    """

    region: str | None

    @property
    def where(self) -> str | None:
        return self.region

    def places(self, domain: Domain) -> Collection[str]:
        return domain.regions


@dataclass(frozen=True)
class On(_OnSide):
    """Any effect on a side, such as one of your own class.

    Attributes:
        side: the side's name.
        placed: the effect.
    """

    side: str
    placed: Effect

    def effect(self, mesh: dmesh.Mesh) -> Effect:
        """The effect as it is."""
        return self.placed


@dataclass(frozen=True)
class Displacement(_OnSide):
    """A prescribed displacement.

    Attributes:
        side: the side's name.
        values: m, by component; None leaves a component free.
    """

    side: str
    values: Vector

    def effect(self, mesh: dmesh.Mesh) -> Effect:
        """The conditions."""
        given = ["free" if value is None else value for value in values.components(self.values, mesh)]
        return _checked(effects.loads.PrescribedDisplacement, values=tuple(given))


@dataclass(frozen=True)
class Traction(_OnSide):
    """A surface traction.

    Attributes:
        side: the side's name.
        values: N/m², by component.
    """

    side: str
    values: Vector

    def effect(self, mesh: dmesh.Mesh) -> Effect:
        """The load."""
        return _checked(effects.loads.Traction, values=tuple(values.components(self.values, mesh)))


@dataclass(frozen=True)
class Contact(_OnSide):
    """Contact: unilateral with a gap, bilateral, or with a flat obstacle.

    Attributes:
        side: the side's name.
        gap: how far the side may move outward, m; 0 unless another way is given.
        lower: bilateral contact: the smallest opening -u·n, m.
        upper: bilateral contact: the largest opening -u·n, m.
        obstacle: a point of a flat obstacle (m), and its normal towards the body.
    """

    side: str
    gap: Value | None = None
    lower: Value | None = None
    upper: Value | None = None
    obstacle: tuple[Sequence[float], Sequence[float]] | None = None

    def effect(self, mesh: dmesh.Mesh) -> Effect:
        """The bounds."""
        given = {"gap": self.gap, "lower": self.lower, "upper": self.upper}
        keys: dict[str, Any] = {k: values.spatial_value(v, mesh) for k, v in given.items() if v is not None}
        if self.obstacle is not None:
            point, normal = (tuple(map(float, vector)) for vector in self.obstacle)
            keys["obstacle"] = {"point": point, "normal": normal}
        return _checked(effects.contact.Contact, **(keys or {"gap": 0.0}))


@dataclass(frozen=True)
class _Law(_OnSide):
    """A law on a side.

    Attributes:
        side: the side's name.
        law: one of ``hvi_fenicsx.laws``, or of your own class; SI.
    """

    side: str
    law: Superpotential


class Friction(_Law):
    """A law of the slip u_t (see :class:`_Law`)."""

    def effect(self, mesh: dmesh.Mesh) -> Effect:
        """The law."""
        return _checked(effects.friction.Friction, law=self.law)


class Adhesion(_Law):
    """A law of the opening -u·n (see :class:`_Law`)."""

    def effect(self, mesh: dmesh.Mesh) -> Effect:
        """The law."""
        return _checked(effects.normal_laws.Adhesion, law=self.law)


class Support(_Law):
    """A law of the penetration u·n (see :class:`_Law`)."""

    def effect(self, mesh: dmesh.Mesh) -> Effect:
        """The law."""
        return _checked(effects.normal_laws.Support, law=self.law)


@dataclass(frozen=True)
class BodyForce(_InRegion):
    """A force per volume.

    Attributes:
        values: N/m³, by component.
        region: where; None: in the whole body.
    """

    values: Vector
    region: str | None = None

    def effect(self, mesh: dmesh.Mesh) -> Effect:
        """The load."""
        return _checked(effects.loads.BodyForce, values=tuple(values.components(self.values, mesh)))


@dataclass(frozen=True)
class Temperature(_InRegion):
    """The temperature above that of the stress-free state.

    Attributes:
        value: K.
        region: where; None: in the whole body.
    """

    value: Value
    region: str | None = None

    def effect(self, mesh: dmesh.Mesh) -> Effect:
        """The thermal strain."""
        return _checked(effects.thermal.Temperature, value=values.spatial_value(self.value, mesh))


@dataclass(frozen=True, kw_only=True)
class _Elastic(_InRegion):
    """An elastic material.

    Attributes:
        model: by default plane_stress in 2D and three_dimensional in 3D.
        thermal_expansion: 1/K.
        region: where; None: in the whole body.
    """

    model: Plane | None = None
    thermal_expansion: float = 0.0
    region: str | None = None

    def _material(self, kind: type[Effect], mesh: dmesh.Mesh, **keys: Any) -> Effect:
        usual = "plane_stress" if mesh.geometry.dim == 2 else "three_dimensional"
        common = {"model": self.model or usual, "thermal_expansion": float(self.thermal_expansion)}
        return _checked(kind, **common, **keys)


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
        keys = {"youngs_modulus": float(self.youngs_modulus), "poisson_ratio": float(self.poisson_ratio)}
        return self._material(effects.elasticity.IsotropicElasticity, mesh, **keys)


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
        keys = {name: [float(value) for value in getattr(self, name)] for name in names}
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
        return self._material(TensorElasticity, mesh, matrix=[[float(c) for c in row] for row in self.matrix])


@dataclass(frozen=True)
class Energy(_InRegion):
    """An elasticity of the user's own: twice its energy is form(u, u).

    Attributes:
        form: makes the symmetric bilinear UFL form, in SI (J/m in 2D, J in 3D), of a trial function u and a test
            function v in m. It must depend on their strains only.
        region: where, if other materials are elsewhere; the form itself must then integrate over that region.
    """

    form: Callable[[Any, Any], Any]
    region: str | None = None

    def effect(self, mesh: dmesh.Mesh) -> Effect:
        """The material, after a look at what it does to stretches and rigid motions. Collective."""
        return UserEnergy.examined(self.form, mesh)


def _checked(kind: type[Effect], **keys: Any) -> Effect:
    try:
        return kind(**keys)
    except ValidationError as error:
        raise InputError(f"{kind.key}: {input_error(error, kind)}") from None
