"""Effects with their places, as Python programs write them: each is one of the scene's effects on a named place."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Collection, Mapping, Sequence
from dataclasses import asdict, dataclass, field
from typing import Any

from dolfinx import mesh as dmesh
from pydantic import ValidationError

from .. import effects
from ..effects import Effect
from ..errors import InputError
from ..laws import Mixity, Superpotential
from ..mesh.domain import Domain
from ..schema import located_error
from . import values
from .places import Names, read_names

Value = Any
"""A number, a formula in x, y, z, a Python function of x (3, n), a scalar UFL expression or fem.Function; SI."""
Vector = Any
"""A list of values, one for each component; or a Python function with values (d, n), a UFL vector, a fem.Function."""


class PlacedEffect(ABC):
    """An effect and its place."""

    @property
    @abstractmethod
    def where(self) -> Names | None:
        """The names of sides or regions of the body; None: the whole body."""

    @abstractmethod
    def places(self, domain: Domain) -> Collection[str]:
        """The names that its place may have on a body.

        Args:
            domain: of the body.
        """

    @abstractmethod
    def effect(self, mesh: dmesh.Mesh) -> Effect:
        """The effect, checked. Collective.

        Args:
            mesh: the body's mesh.

        Raises:
            InputError: a value is not allowed.
        """


class OnSide(PlacedEffect):
    """An effect on a side.

    Attributes:
        side: a name of the body's, or a list of names.
    """

    side: str | Sequence[str]

    @property
    def where(self) -> Names:
        """The sides."""
        return read_names(self.side)

    def places(self, domain: Domain) -> Collection[str]:
        """The sides.

        Args:
            domain: of the body.
        """
        return domain.sides


class InRegion(PlacedEffect):
    """An effect in a region.

    Attributes:
        region: a name of the body's, or a list of names; None: the whole body.
    """

    region: str | Sequence[str] | None

    @property
    def where(self) -> Names | None:
        """The regions; None: the whole body."""
        return None if self.region is None else read_names(self.region)

    def places(self, domain: Domain) -> Collection[str]:
        """The regions.

        Args:
            domain: of the body.
        """
        return domain.regions


@dataclass(frozen=True)
class Displacement(OnSide):
    """A prescribed displacement.

    Attributes:
        side: the side's name, or a list of sides.
        values: m, by component; None leaves a component free.
    """

    side: str | Sequence[str]
    values: Vector

    def effect(self, mesh: dmesh.Mesh) -> Effect:
        """The conditions."""
        if isinstance(self.values, Sequence) and any(isinstance(v, str) and v == "free" for v in self.values):
            raise InputError('write None in place of "free", the word of scene files')
        return checked(effects.loads.PrescribedDisplacement, values=tuple(values.components(self.values, mesh)))


@dataclass(frozen=True)
class Traction(OnSide):
    """A surface traction.

    Attributes:
        side: the side's name, or a list of sides.
        values: N/m², by component.
    """

    side: str | Sequence[str]
    values: Vector

    def effect(self, mesh: dmesh.Mesh) -> Effect:
        """The load."""
        return checked(effects.loads.Traction, values=tuple(values.components(self.values, mesh)))


@dataclass(frozen=True)
class Contact(OnSide):
    """Contact: unilateral with a gap, bilateral, or with an obstacle.

    Attributes:
        side: the side's name, or a list of sides.
        gap: how far the side may move outward, m; 0 unless another way is given. Between two bodies also
            ``"measured"``: the distance of their sides as they are meshed.
        lower: bilateral contact: the smallest opening -u·n, m.
        upper: bilateral contact: the largest opening -u·n, m.
        obstacle: a point of a flat obstacle (m), and its normal towards the body; or the table of an obstacle, as a
            scene has it: ``{"shape": "sphere", "center": [0, 0], "radius": 1}``.
        direction: with a gap: from the body towards the obstacle; stands for the outward normal.
    """

    side: str | Sequence[str]
    gap: Value | None = None
    lower: Value | None = None
    upper: Value | None = None
    obstacle: tuple[Sequence[float], Sequence[float]] | Mapping[str, Any] | None = None
    direction: Sequence[float] | None = None

    def effect(self, mesh: dmesh.Mesh) -> Effect:
        """The bounds."""
        given = {"gap": self.gap, "lower": self.lower, "upper": self.upper}
        keys: dict[str, Any] = {k: values.spatial_value(v, mesh) for k, v in given.items() if v is not None}
        if isinstance(self.obstacle, Mapping):
            keys["obstacle"] = {key: values.plain(value) for key, value in self.obstacle.items()}
        elif self.obstacle is not None:
            keys["obstacle"] = _flat(self.obstacle)
        keys = keys or {"gap": 0.0}
        if self.direction is not None:
            keys["direction"] = values.numbers(self.direction)
        return checked(effects.contact.Contact, **keys)


def _flat(given: Any) -> dict[str, tuple[float, ...]]:
    """A flat obstacle as a scene has it."""
    if not isinstance(given, Sequence) or len(given) != 2:
        raise InputError(f"obstacle: give a point and a normal, ([0, 0], [0, 1]), or a table, not {given!r}")
    return {"point": values.numbers(given[0]), "normal": values.numbers(given[1])}


@dataclass(frozen=True)
class _Law(OnSide):
    """A law on a side.

    Attributes:
        side: the side's name, or a list of sides.
        law: one of ``hvi_fenicsx.laws``, or of your own class; SI.
        multiplier: what all its tractions are multiplied by, positive.
        length_multiplier: what all its displacements are multiplied by, positive.
    """

    side: str | Sequence[str]
    law: Superpotential
    multiplier: Value = field(default=1.0, kw_only=True)
    length_multiplier: Value = field(default=1.0, kw_only=True)

    def _keys(self, mesh: dmesh.Mesh) -> dict[str, Any]:
        if not isinstance(self.law, Superpotential):
            raise InputError(f"law: give a law as an object, such as hvi.laws.Graph(points), not {self.law!r}")
        given = {"multiplier": self.multiplier, "length_multiplier": self.length_multiplier}
        return {"law": self.law, **{key: values.spatial_value(value, mesh) for key, value in given.items()}}


class Friction(_Law):
    """A law of the slip u_t (see :class:`_Law`)."""

    def effect(self, mesh: dmesh.Mesh) -> Effect:
        """The law."""
        return checked(effects.friction.Friction, **self._keys(mesh))


class Adhesion(_Law):
    """A law of the opening -u·n (see :class:`_Law`)."""

    def effect(self, mesh: dmesh.Mesh) -> Effect:
        """The law."""
        return checked(effects.normal_laws.Adhesion, **self._keys(mesh))


class Support(_Law):
    """A law of the penetration u·n (see :class:`_Law`)."""

    def effect(self, mesh: dmesh.Mesh) -> Effect:
        """The law."""
        return checked(effects.normal_laws.Support, **self._keys(mesh))


@dataclass(frozen=True)
class Cohesion(_Law):
    """A law of opening and slip together (see :class:`_Law`), by the effective displacement.

    Attributes:
        beta: what a slip is multiplied by beside an opening.
        mixity: how the energy of separation depends on the mode, a criterion of ``hvi_fenicsx.laws.mixities()``; None:
            it does not.
    """

    beta: float = 1.0
    mixity: Mixity | None = None

    def effect(self, mesh: dmesh.Mesh) -> Effect:
        """The law."""
        keys = self._keys(mesh)
        if self.mixity is not None and not isinstance(self.mixity, Mixity):
            raise InputError(f"mixity: give a criterion, such as hvi.laws.PowerLaw(...), or None, not {self.mixity!r}")
        if self.mixity is not None:
            keys |= {"mixity": self.mixity.name, **asdict(self.mixity)}
        return checked(effects.cohesion.Cohesion, beta=values.number(self.beta), **keys)


@dataclass(frozen=True)
class BodyForce(InRegion):
    """A force per volume.

    Attributes:
        values: N/m³, by component.
        region: where, a name or a list; None: in the whole body.
    """

    values: Vector
    region: str | Sequence[str] | None = None

    def effect(self, mesh: dmesh.Mesh) -> Effect:
        """The load."""
        return checked(effects.loads.BodyForce, values=tuple(values.components(self.values, mesh)))


@dataclass(frozen=True)
class Temperature(InRegion):
    """The temperature above that of the stress-free state.

    Attributes:
        value: K.
        region: where, a name or a list; None: in the whole body.
    """

    value: Value
    region: str | Sequence[str] | None = None

    def effect(self, mesh: dmesh.Mesh) -> Effect:
        """The thermal strain."""
        return checked(effects.thermal.Temperature, value=values.spatial_value(self.value, mesh))


def checked(kind: type[Effect], **keys: Any) -> Effect:
    """An effect of these keys.

    Args:
        kind: its class.
        **keys: as a scene has them.

    Raises:
        InputError: one of them is not allowed.
    """
    try:
        return kind(**keys)
    except ValidationError as error:
        raise located_error(error, kind) from None
