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
from .messages import unknown
from .tables import WHOLE, Names, Problem, Step, Table, named_or_whole, problems_of, refuse

DEFAULT_ELASTICITY = "isotropic"


class Holder(Table):
    """A table whose further keys are effects, read by the classes registered for its place."""

    model_config = ConfigDict(extra="allow")
    place: ClassVar[Place]

    @property
    def effects(self) -> tuple[Effect, ...]:
        """Its effects, in the order they were given."""
        return tuple((self.__pydantic_extra__ or {}).values())

    @classmethod
    def keys(cls) -> list[str]:
        """All keys it may have."""
        return [*cls.model_fields, *Effect.registry[cls.place]]

    @model_validator(mode="wrap")
    @classmethod
    def _in_plain_words(cls, data: Any, handler: ModelWrapValidatorHandler[Any]) -> Any:
        if not isinstance(data, dict):
            return cls._or_refuse(lambda: handler(data), [])
        problems: list[Problem] = []
        made = {key: cls._read(key, value, problems) for key, value in data.items()}
        return cls._or_refuse(lambda: handler(made), problems)

    @classmethod
    def _read(cls, key: str, value: Any, problems: list[Problem]) -> Any:
        if key in cls.model_fields:
            return value
        if key not in Effect.registry[cls.place]:
            problems.append(Problem((key,), unknown("key", key, cls.keys())))
            return value
        return read_effect(Effect.registry[cls.place][key], value, (key,), problems)


def read_effect(
    kind: type[Effect],
    value: Any,
    where: tuple[str, ...],
    problems: list[Problem],
    also: tuple[str, ...] = (),
) -> Any:
    """An effect read by its class; what is wrong joins ``problems``. ``also``: keys beside its own."""
    try:
        return kind.model_validate(value)
    except ValidationError as error:
        found = problems_of(error, kind, also)
    for problem in found:
        problems.append(Problem((*where, *_inside(problem, value)), problem.text))
    return value


def _inside(problem: Problem, value: Any) -> tuple[Step, ...]:
    """The place within the effect as the scene file has it."""
    if not isinstance(value, dict):
        return problem.where[1:]  # a bare list is kept in a field that the file does not name
    return problem.where or _parameter(problem.text, value)


def _parameter(text: str, table: Mapping[str, Any]) -> tuple[str, ...]:
    """A law refuses its parameters as a whole: the one that its message names first is the place."""
    if text.startswith("unknown law "):
        return ("law",)
    named = re.findall(r"(\w+) = |'(\w+)'", text)
    return next(((name,) for pair in named for name in pair if name in table), ())


class Boundary(Holder):
    """A boundary part and what acts on it."""

    place: ClassVar[Place] = Place.BOUNDARY

    on: Names
    """a side of the shape, a physical group of the mesh file, or a list of them"""

    if TYPE_CHECKING:

        def __init__(self, **keys: Any) -> None:
            """The keys of the scene file; effects as objects or as the scene file writes them."""


class Body(Holder):
    """What acts in the body, or in a region of it."""

    place: ClassVar[Place] = Place.BODY

    region: Names | None = None
    """a physical group of cells, or a list of them; the whole body if it is left out"""

    if TYPE_CHECKING:

        def __init__(self, **keys: Any) -> None:
            """The keys of the scene file; effects as objects or as the scene file writes them."""


class Material(Table):
    """The elasticity of the body, or of a region of it: the further keys are those of the model."""

    region: Names | None = None
    """a physical group of cells, or a list of them; needed where there are several materials"""
    elasticity: Effect
    """the name of the elasticity's model"""

    if TYPE_CHECKING:

        def __init__(self, **keys: Any) -> None:
            """The keys of the scene file, or ``elasticity`` as an object."""

    @model_validator(mode="wrap")
    @classmethod
    def _in_plain_words(cls, data: Any, handler: ModelWrapValidatorHandler[Any]) -> Any:
        if not isinstance(data, dict) or isinstance(data.get("elasticity"), Effect):
            return cls._or_refuse(lambda: handler(data), [])
        own = {key: value for key, value in data.items() if key == "region"}
        problems: list[Problem] = []
        made = _elasticity({key: value for key, value in data.items() if key != "region"}, problems)
        if problems:  # the region is looked at even so: both are reported together
            cls._check_region(own, problems)
            raise refuse(problems)
        return cls._or_refuse(lambda: handler({**own, "elasticity": made}), [])

    @classmethod
    def _check_region(cls, own: Mapping[str, Any], problems: list[Problem]) -> None:
        try:
            Body.model_validate(dict(own))
        except ValidationError as error:
            problems.extend(problems_of(error))

    @model_serializer(mode="wrap")
    def _flat(self, handler: SerializerFunctionWrapHandler) -> dict[str, Any]:
        region = {} if self.region is None else {"region": handler(self)["region"]}
        return {**region, "elasticity": self.elasticity.key, **self.elasticity.model_dump()}


def _elasticity(data: dict[str, Any], problems: list[Problem]) -> Any:
    kinds = Effect.registry[Place.MATERIAL]
    name = data.pop("elasticity", DEFAULT_ELASTICITY)
    if not isinstance(name, str) or name not in kinds:
        problems.append(Problem(("elasticity",), unknown("elasticity", name, kinds)))
        return None
    return read_effect(kinds[name], data, (), problems, also=("region", "elasticity"))


def _whole_or_named(own_keys: Any) -> BeforeValidator:
    return BeforeValidator(lambda data: named_or_whole(data, own_keys()))


def _as_written(tables: Mapping[str, BaseModel]) -> Any:
    return tables[WHOLE] if WHOLE in tables else dict(tables)


def _material_keys() -> Iterator[str]:
    """Keys of any elasticity, so that a table of tables is known for a material."""
    yield from ("region", "elasticity")
    for kind in Effect.registry[Place.MATERIAL].values():
        yield from kind.model_fields


def _at_least_one(materials: dict[str, Material]) -> dict[str, Material]:
    if not materials:
        raise refuse([Problem((), "is empty; give model, youngs_modulus and poisson_ratio")])
    return materials


Materials = Annotated[
    dict[str, Material],
    AfterValidator(_at_least_one),
    _whole_or_named(_material_keys),
    PlainSerializer(_as_written),
]
"""``[material]``, or ``[material.NAME]`` by name."""
Bodies = Annotated[dict[str, Body], _whole_or_named(Body.keys), PlainSerializer(_as_written)]
"""``[body]``, or ``[body.NAME]`` by name."""
