"""What an effect is: one physical contribution, validated data with what it adds to a problem.

A new effect is a new subclass of :class:`Effect` in a module of its own; it registers itself under
its ``key``, which is then a key of the scene file at its ``place``. Nothing else is edited.
"""

from __future__ import annotations

import inspect
from abc import abstractmethod
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from enum import Enum
from typing import Any, ClassVar, Protocol, Self, TypeVar

from pydantic import BaseModel, ConfigDict, PrivateAttr, ValidationError
from pydantic_core import PydanticCustomError

from ..class_registry import enter
from ..errors import InputError, of_user
from ..formula import SpatialValue
from ..laws import Superpotential
from ..schema import Table, located_error, names_of, plain, shown
from ..typing import Array
from .contribution import Contribution

Names = tuple[str, ...]
"""Names of sides or of regions, which are one place."""
Sides = str | Sequence[str]
"""The name of a side, or a list of names that are one place."""
F = TypeVar("F", bound=Callable[..., None])


def from_python(init: F) -> F:
    """Marks the constructor that programs call: tables are read past it, by ``model_validate``."""
    made: F = of_user("effect")(init)
    made.__pydantic_base_init__ = True  # type: ignore[attr-defined]
    return made


class Place(Enum):
    """Where in a scene an effect stands."""

    BOUNDARY = "boundary"
    BODY = "body"
    MATERIAL = "material"


class Drive(Enum):
    """How an effect drives the body; the scales come from what drives it, else from what resists."""

    LOAD = "load"
    KINEMATIC = "prescribed displacement or strain"
    RESISTANCE = "none: it only resists"


@dataclass(frozen=True, kw_only=True)
class SideMoments:
    """A boundary part in numbers, SI.

    Attributes:
        area: m² (m in 2D).
        centroid: (d,).
        second: ∫ r rᵀ ds, r being the position from the centroid, (d, d).
    """

    area: float
    centroid: Array
    second: Array


class FormContext(Protocol):
    """What an effect may see of the problem that is being composed.

    Attributes:
        dimension: of space, 2 or 3.
        trial: UFL argument, the displacement u.
        test: UFL argument, the test function v.
        normal: UFL's outward normal of the boundary.
        length: scale L in m.
        stress: scale p0 in N/m².
        modulus: scale E0 of Young's modulus in N/m².
    """

    dimension: int
    trial: Any
    test: Any
    normal: Any
    length: float
    stress: float
    modulus: float

    @property
    def scalar_test(self) -> Any:
        """A test function of scalar P1."""

    def number(self, value: float) -> Any:
        """A ``fem.Constant``, so that the value is not compiled into the form."""

    def render(self, value: SpatialValue) -> Any:
        """A value in UFL, in the SI coordinates of the mesh."""

    @property
    def materials(self) -> Sequence[tuple[str | None, Effect]]:
        """The elasticities, each with its region (None: the whole body)."""

    def cells(self, *regions: str | None) -> Any:
        """The measure dx/L^d of what regions share (None: the whole body); None where that is nothing."""

    def facets(self, part: str, *values: SpatialValue) -> Any:
        """The measure ds/L^(d-1) of a boundary part; its quadrature sees how values vary within a facet.

        Args:
            part: its name.
            *values: what is integrated.
        """

    def side_moments(self, part: str) -> SideMoments:
        """Area, centroid and second moments of a boundary part. Collective."""


@dataclass(frozen=True, slots=True)
class BodySizes:
    """What an effect's scale may depend on.

    Attributes:
        length: of the body, m.
        modulus: the largest Young's modulus, N/m².
        expansion: the largest |α|, 1/K.
    """

    length: float
    modulus: float
    expansion: float


Evaluate = Callable[[SpatialValue], float]
"""Largest absolute value of a value over the place of an effect."""


@dataclass(frozen=True, slots=True)
class SurfaceLoad:
    """A load on a boundary part as pictures show it: its components, less a pressure along the outward normal.

    Attributes:
        components: N/m², one for each dimension; empty: none.
        pressure: N/m², against the boundary; None: none.
    """

    components: tuple[SpatialValue, ...] = ()
    pressure: SpatialValue | None = None

    @property
    def values(self) -> tuple[SpatialValue, ...]:
        """All that it is given by."""
        return self.components if self.pressure is None else (*self.components, self.pressure)


class Effect(Table):
    """One physical contribution: validated data (SI), what it adds, and where it acts.

    Attributes:
        where: the sides or regions where it acts; None: the whole body.
        name: of its table in a scene file, of its boundary part in results; empty where it has none yet.

    Class attributes:
        key: the scene file's key.
        place: where the key stands.
        term: what it adds, in words and symbols.
        label: what it is, in a few words for a legend; the key where it is empty.
        drive: how it drives the body.
        exclusive: whether a side of the body bears only one of its kind.
        bounds_normal: whether it bounds the normal displacement, as contact does.
        in_files: whether its key may stand in scene files.
        on_interfaces: whether it may act between two bodies, on their relative displacement.
        is_sum: whether it is a load that is stated as a sum over its part; it then says how it is spread.
    """

    model_config = ConfigDict(arbitrary_types_allowed=True)

    key: ClassVar[str]
    place: ClassVar[Place]
    term: ClassVar[str]
    label: ClassVar[str] = ""
    drive: ClassVar[Drive] = Drive.RESISTANCE
    exclusive: ClassVar[bool] = False
    bounds_normal: ClassVar[bool] = False
    in_files: ClassVar[bool] = True
    on_interfaces: ClassVar[bool] = False
    is_sum: ClassVar[bool] = False
    registry: ClassVar[dict[Place, dict[str, type[Effect]]]] = {place: {} for place in Place}
    _where: Names | None = PrivateAttr(default=None)
    _name: str = PrivateAttr(default="")

    @classmethod
    def __pydantic_init_subclass__(cls, **kwargs: Any) -> None:
        super().__pydantic_init_subclass__(**kwargs)
        if "key" in cls.__dict__ and cls.in_files:
            enter(Effect.registry[cls.place], cls, cls.key, "effect")

    @property
    def where(self) -> Names | None:
        """The sides or regions where it acts; None: the whole body."""
        return self._where

    @property
    def name(self) -> str:
        """The name of its table in a scene file."""
        return self._name

    def at(self, where: Sides | None, name: str = "") -> Self:
        """The effect at another place.

        Args:
            where: sides or regions; None: the whole body.
            name: of the place.

        Raises:
            InputError: these are no names.
        """
        placed = self.model_copy()
        placed._where, placed._name = None if where is None else names_in_python(where), name
        return placed

    def _make(self, where: Sides | None, **keys: Any) -> None:
        """Fill in what a program gives; a refusal names the effect and its place."""
        place = None if where is None else names_in_python(where)
        try:
            BaseModel.__init__(self, **plain(keys))
        except ValidationError as error:
            raise self.refused(str(located_error(error)), place) from None
        self._where = place

    @classmethod
    def refused(cls, text: str, where: Names | None) -> InputError:
        """The refusal of an effect in a program: a line for each that is wrong, with the effect and its place.

        Args:
            text: what is wrong.
            where: the place.
        """
        return InputError("\n".join(f"{cls.__name__} on {in_words(where)}: {line}" for line in text.splitlines()))

    def fitted(self, dimension: int) -> Self:
        """Itself in a space of 2 or 3 dimensions: what a program has left open is filled in."""
        return self

    def spatial_values(self) -> Iterator[SpatialValue]:
        """The values in space among its fields."""
        for _, given in self:
            for value in given if isinstance(given, tuple | list) else (given,):
                if isinstance(value, SpatialValue):
                    yield value

    def on_mesh(self, mesh: Any) -> Self:
        """Itself on the mesh of a body. Collective.

        Args:
            mesh: the dolfinx mesh.

        Raises:
            InputError: on all ranks alike: it has data of another mesh.
        """
        for value in self.spatial_values():
            value.check_mesh(mesh)
        return self

    def is_portable(self, mesh: Any) -> bool:
        """Whether it can be assembled on another mesh than a body's: it makes no form with data of that one.

        Args:
            mesh: of the body.
        """
        return True

    @abstractmethod
    def contribute(self, context: FormContext, where: str | None) -> Contribution:
        """What it adds.

        Args:
            context: what it may see of the problem.
            where: a boundary part, a region, or None for the whole body.
        """

    def stress_scale(self, largest: Evaluate, sizes: BodySizes) -> float:
        """The largest stress (N/m²) it brings.

        Args:
            largest: gives the largest absolute value of a spatial value where the effect acts. Collective.
            sizes: of the body and its materials.
        """
        return 0.0

    def modulus_scale(self) -> float:
        """The largest Young's modulus (N/m²) it brings."""
        return 0.0

    def expansion_scale(self) -> float:
        """The largest |α| (1/K) it brings."""
        return 0.0

    def dimension(self) -> int | None:
        """The dimension of space that it is made for; None: any."""
        return None

    def check(self, dimension: int) -> None:
        """Refuse what makes no sense in 2D or 3D.

        Raises:
            InputError: with the reason and how to correct it.
        """

    def implausible(self, largest: Evaluate, sizes: BodySizes) -> tuple[str, ...]:
        """What may be mistakes in its numbers, in sentences. Advice: nothing is refused.

        Args:
            largest: gives the largest absolute value of a spatial value where the effect acts. Collective.
            sizes: of the body and its materials.
        """
        return ()

    def prescribed(self) -> tuple[int, ...]:
        """The displacement components, from 0, that it prescribes."""
        return ()

    def displaces_obstacle(self) -> bool:
        """Whether it gives an obstacle a displacement, which a load path may multiply."""
        return False

    def obstacle_moved(self, way: float) -> Effect:
        """Itself, with its obstacle moved if a force presses one.

        Args:
            way: along the force, m.
        """
        return self

    def surface_load(self) -> SurfaceLoad | None:
        """The load that it puts on its part, for pictures; None: none that has a formula."""
        return None

    def spread_at(self, moments: SideMoments, points: Array) -> Array:
        """The tractions (N/m²) by which a sum is spread over its part, at points of it, (n, d).

        Args:
            moments: of the part.
            points: m, (n, 3).
        """
        raise NotImplementedError

    def superpotentials(self) -> tuple[Superpotential, ...]:
        """The laws that it brings: those among its fields."""
        values = (getattr(self, name) for name in type(self).model_fields)
        return tuple(value for value in values if isinstance(value, Superpotential))

    @classmethod
    def meaning(cls) -> str:
        """What it is, in a sentence or two: the first paragraph of its docstring."""
        text = inspect.cleandoc(cls.__doc__ or "")
        return text.split("\n\n")[0].replace("\n", " ").replace("`", "")


def load_name(where: str | None, effect: Effect) -> str:
    """The name of what drives the body at one place: a load, a prescribed displacement, a given strain.

    Args:
        where: a boundary part, a region, or None for the whole body.
        effect: what drives it.
    """
    return f"{where or 'body'}.{effect.key}"


def names_in_python(given: Any) -> Names:
    """The names that a program gives, read as those of a scene file.

    Args:
        given: a name, or a list of names.

    Raises:
        InputError: it is something else, empty, or has a name twice.
    """
    try:
        return names_of(given)
    except PydanticCustomError as error:
        raise InputError(f"the place {error.message()} (is {shown(given)})") from None


def in_words(where: Names | None) -> str:
    """A place in messages.

    Args:
        where: the sides or regions; None: the whole body.
    """
    return ", ".join(where) if where else "the body"
