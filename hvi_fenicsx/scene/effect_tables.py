"""Tables that hold effects: a boundary part, a body, a material. Their keys are the registered effects'."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, Annotated, Any, ClassVar

from pydantic import (
    AfterValidator,
    BaseModel,
    BeforeValidator,
    ConfigDict,
    ModelWrapValidatorHandler,
    PlainSerializer,
    SerializerFunctionWrapHandler,
    ValidationError,
    model_serializer,
    model_validator,
)

from ..effects import Effect, Place
from ..errors import InputError
from ..mesh.boundary_part import Inequalities
from ..schema import Keys, Mistake, Names, Table, mistakes_of, refusal, unknown, validation_error, vector
from .named_tables import WHOLE, named_or_whole


def _piece(value: Any) -> Inequalities:
    try:
        return value if isinstance(value, Inequalities) else Inequalities(value)
    except InputError as error:
        raise refusal(str(error)) from None


Piece = Annotated[Inequalities, BeforeValidator(_piece), PlainSerializer(lambda piece: piece.source)]
"""Inequalities, as a field of a table."""
DEFAULT_ELASTICITY = "isotropic"


class EffectTable(Table):
    """A table whose further keys are effects, read by the classes registered for its place."""

    model_config = ConfigDict(extra="allow", arbitrary_types_allowed=True)
    place: ClassVar[Place]

    @property
    def effects(self) -> tuple[Effect, ...]:
        """Its effects, in the order they were given."""
        return tuple((self.__pydantic_extra__ or {}).values())

    @classmethod
    def keys(cls) -> list[str]:
        """All keys it may have."""
        return [*cls.model_fields, *cls.kinds()]

    @classmethod
    def kinds(cls) -> Mapping[str, type[Effect]]:
        """The effects that it may have, by key."""
        return Effect.registry[cls.place]

    @model_validator(mode="wrap")
    @classmethod
    def _in_plain_words(cls, data: Any, handler: ModelWrapValidatorHandler[Any]) -> Any:
        if not isinstance(data, dict):
            return cls._read_or_refuse(lambda: handler(data), [])
        mistakes: list[Mistake] = []
        read = {key: cls._read(key, value, mistakes) for key, value in data.items()}
        return cls._read_or_refuse(lambda: handler(read), mistakes)

    @classmethod
    def _read(cls, key: str, value: Any, mistakes: list[Mistake]) -> Any:
        if key in cls.model_fields:
            return value
        if key not in cls.kinds():
            mistakes.append(Mistake((key,), unknown("key", key, cls.keys())))
            return value
        return read_effect(cls.kinds()[key], value, (key,), mistakes)


def read_effect(
    kind: type[Effect],
    value: Any,
    where: Keys,
    mistakes: list[Mistake],
    also: tuple[str, ...] = (),
) -> Any:
    """An effect read by its class; the value as it is where that refuses it.

    Args:
        kind: the effect's class.
        value: what the scene has for it.
        where: its keys in the table around it.
        mistakes: what is wrong is added to these.
        also: keys that the table may have beside the effect's own.
    """
    try:
        return kind.model_validate(value)
    except ValidationError as error:
        found = mistakes_of(error, kind, also)
    for mistake in found:
        mistakes.append(Mistake((*where, *_inside(mistake, value)), mistake.text))
    return value


def _inside(mistake: Mistake, value: Any) -> Keys:
    """The keys within the effect, as the scene file has it."""
    if not isinstance(value, dict):
        return mistake.where[1:]  # a bare list is kept in a field that the file does not name
    return mistake.where or _parameter(mistake.text, value)


def _parameter(text: str, table: Mapping[str, Any]) -> tuple[str, ...]:
    """The parameter that a law's message names first: a law refuses its parameters as a whole."""
    if text.startswith("unknown law "):
        return ("law",)
    named = re.findall(r"(\w+) = |'(\w+)'", text)
    return next(((name,) for pair in named for name in pair if name in table), ())


class BoundaryTable(EffectTable):
    """A part of the boundary and the effects that act on it. NAME is the name of the part in the results."""

    place: ClassVar[Place] = Place.BOUNDARY

    on: Names
    """a side of the shape, a physical group of the mesh file, or a list of them"""
    where: Piece | None = None
    """only a piece of it: inequalities in x, y, z (m) that hold at the midpoints of its facets, like `"x > 0.3"` or
    `"0.1 < x < 0.2 and y < 1"`"""

    if TYPE_CHECKING:

        def __init__(self, **keys: Any) -> None:
            """The keys of the scene file, the effects as objects or as the scene file writes them."""


class InterfaceTable(EffectTable):
    """Where two bodies meet, and what acts between them, on the displacement of the first relative to the second.

    NAME is the name of the part in the results.
    """

    place: ClassVar[Place] = Place.BOUNDARY

    between: Annotated[tuple[str, str], vector(2)]
    """the two sides, like ["lower.top", "upper.bottom"]; the vertices of the first carry contact and laws, and its
    outward normal counts: the finer one, or the one that lies within the other, should be the first"""
    tied: bool = False
    """whether the sides are glued for ever; then no effect acts between them"""

    if TYPE_CHECKING:

        def __init__(self, **keys: Any) -> None:
            """The keys of the scene file, the effects as objects or as the scene file writes them."""

    @classmethod
    def kinds(cls) -> Mapping[str, type[Effect]]:
        """The effects that may act between two bodies, by key."""
        return {key: kind for key, kind in Effect.registry[cls.place].items() if kind.on_interfaces}

    @model_validator(mode="after")
    def _something_acts(self) -> InterfaceTable:
        if self.between[0] == self.between[1]:
            raise validation_error([Mistake(("between",), "names one side twice; name the sides of two bodies")])
        if self.tied and self.effects:
            keys = ", ".join(effect.key for effect in self.effects)
            raise validation_error([Mistake(("tied",), f"glues the sides for ever: leave out {keys}, or tied")])
        if not self.tied and not self.effects:
            text = f"nothing acts between the sides: give tied = true, or one of {', '.join(self.kinds())}"
            raise validation_error([Mistake((), text)])
        return self


class BodyTable(EffectTable):
    """The effects that act in the body, or in one region of it."""

    place: ClassVar[Place] = Place.BODY

    region: Names | None = None
    """a physical group of cells, or a list of them; without it the whole body"""

    if TYPE_CHECKING:

        def __init__(self, **keys: Any) -> None:
            """The keys of the scene file, the effects as objects or as the scene file writes them."""


class MaterialTable(Table):
    """The elasticity of the body, or of one region of it. The further keys depend on `elasticity`."""

    region: Names | None = None
    """a physical group of cells, or a list of them; required if there are several materials"""
    elasticity: Effect
    """the elastic law: its name is one of those below"""

    if TYPE_CHECKING:

        def __init__(self, **keys: Any) -> None:
            """The keys of the scene file, or ``elasticity`` as an object."""

    @model_validator(mode="wrap")
    @classmethod
    def _in_plain_words(cls, data: Any, handler: ModelWrapValidatorHandler[Any]) -> Any:
        if not isinstance(data, dict) or isinstance(data.get("elasticity"), Effect):
            return cls._read_or_refuse(lambda: handler(data), [])
        own = {key: value for key, value in data.items() if key == "region"}
        mistakes: list[Mistake] = []
        elasticity = _elasticity({key: value for key, value in data.items() if key != "region"}, mistakes)
        if mistakes:  # the region is looked at even so: both are reported together
            cls._check_region(own, mistakes)
            raise validation_error(mistakes)
        return cls._read_or_refuse(lambda: handler({**own, "elasticity": elasticity}), [])

    @classmethod
    def _check_region(cls, own: Mapping[str, Any], mistakes: list[Mistake]) -> None:
        try:
            BodyTable.model_validate(dict(own))
        except ValidationError as error:
            mistakes.extend(mistakes_of(error))

    @model_serializer(mode="wrap")
    def _flat(self, handler: SerializerFunctionWrapHandler) -> dict[str, Any]:
        region = {} if self.region is None else {"region": handler(self)["region"]}
        return {**region, "elasticity": self.elasticity.key, **self.elasticity.model_dump()}


def _elasticity(data: dict[str, Any], mistakes: list[Mistake]) -> Any:
    kinds = Effect.registry[Place.MATERIAL]
    name = data.pop("elasticity", DEFAULT_ELASTICITY)
    if not isinstance(name, str) or name not in kinds:
        mistakes.append(Mistake(("elasticity",), unknown("elasticity", name, kinds)))
        return None
    return read_effect(kinds[name], data, (), mistakes, also=("region", "elasticity"))


def _whole_or_named(own_keys: Any) -> BeforeValidator:
    return BeforeValidator(lambda data: named_or_whole(data, own_keys()))


def _as_written(tables: Mapping[str, BaseModel]) -> Any:
    return tables[WHOLE] if WHOLE in tables else dict(tables)


def _material_keys() -> Iterator[str]:
    """Keys of any elasticity, so that a table of tables is known for a material."""
    yield from ("region", "elasticity")
    for kind in Effect.registry[Place.MATERIAL].values():
        yield from kind.model_fields


def _at_least_one(materials: dict[str, MaterialTable]) -> dict[str, MaterialTable]:
    if not materials:
        raise validation_error([Mistake((), "is empty; give model, youngs_modulus and poisson_ratio")])
    return materials


Materials = Annotated[
    dict[str, MaterialTable],
    AfterValidator(_at_least_one),
    _whole_or_named(_material_keys),
    PlainSerializer(_as_written),
]
"""``[material]``, or ``[material.NAME]`` by name."""
Bodies = Annotated[dict[str, BodyTable], _whole_or_named(BodyTable.keys), PlainSerializer(_as_written)]
"""``[body]``, or ``[body.NAME]`` by name."""
