"""The tables of a scene file, read as a model; effects are keys of them as soon as they are registered."""

from __future__ import annotations

import copyreg
from collections.abc import Callable, Iterable, Iterator
from pathlib import Path
from typing import Annotated, Any, ClassVar, Self

from pydantic import (
    AfterValidator,
    BeforeValidator,
    ConfigDict,
    Field,
    ModelWrapValidatorHandler,
    PlainSerializer,
    PrivateAttr,
    ValidationError,
    ValidationInfo,
    model_validator,
)
from pydantic_core import PydanticCustomError

from ..effects import Effect, Place
from ..errors import InputError
from ..mesh.boundary_part import BoundaryPart, Inequalities, InterfaceSides
from ..mesh.shapes import DomainShape, SeveralBodies
from ..schema import (
    Keys,
    Mistake,
    Names,
    Table,
    choose,
    mistakes_of,
    refusal,
    shown,
    validation_error,
    vector,
)
from . import plugins
from .body import Body
from .content import WHOLE, PathTable, SolverTable
from .model import Mistakes, Model

DEFAULT_ELASTICITY = "isotropic"


def _title(text: str) -> str:
    if not text.isprintable():
        raise refusal("must be a single line of printable characters")
    return text


def _piece(value: Any) -> Inequalities:
    try:
        return value if isinstance(value, Inequalities) else Inequalities(value)
    except InputError as error:
        raise refusal(str(error)) from None


class _EffectTable(Table):
    """A table of a place, with the effects that act there.

    Class attributes:
        place: where they act.
        where_key: the key of its sides or regions; empty: the table's name is the place.
    """

    place: ClassVar[Place]
    where_key: ClassVar[str]
    _acting: tuple[Effect, ...] = PrivateAttr(default=())

    @model_validator(mode="wrap")
    @classmethod
    def _with_effects(cls, data: Any, handler: ModelWrapValidatorHandler[Self], info: ValidationInfo) -> Self:
        """The effects are read by their classes, in the order of the file."""
        if not isinstance(data, dict):
            return handler(data)
        found, wrong, known = [], list[Mistake](), cls.known()
        for key in (key for key in data if key in known):
            try:
                found.append(known[key].model_validate(data[key], context=info.context))
            except ValidationError as error:
                wrong += [Mistake((key, *m.where), m.text) for m in mistakes_of(error, known[key])]
        try:
            table = handler({key: value for key, value in data.items() if key not in known})
        except ValidationError as error:
            raise validation_error([*mistakes_of(error, cls), *wrong]) from None
        if wrong:
            raise validation_error(wrong)
        table._acting = tuple(found)
        return table

    @classmethod
    def allowed_keys(cls) -> list[str]:
        """Its own and those of the effects."""
        return [*cls.model_fields, *cls.known()]

    @classmethod
    def known(cls) -> dict[str, type[Effect]]:
        """The effects that may act there, by key."""
        return Effect.registry[cls.place]

    def effects(self, name: str) -> Iterator[Effect]:
        """Its effects at their place, where its name is this."""
        where = getattr(self, self.where_key) if self.where_key else (name,)
        return (effect.at(where, name) for effect in self._acting)


class BoundaryTable(_EffectTable):
    """A part of the boundary and the effects that act on it. NAME is the name of the part in the results."""

    model_config = ConfigDict(arbitrary_types_allowed=True)
    place = Place.BOUNDARY
    where_key = "on"

    on: Names
    """a side of the shape, a physical group of the mesh file, or a list of them"""
    where: Annotated[Inequalities, BeforeValidator(_piece), PlainSerializer(lambda piece: piece.source)] | None = None
    """only a piece of it: inequalities in x, y, z (m) that hold at the midpoints of its facets, like `"x > 0.3"` or
    `"0.1 < x < 0.2 and y < 1"`"""


class InterfaceTable(_EffectTable):
    """Where two bodies meet, and what acts between them, on the displacement of the first relative to the second.

    NAME is the name of the part in the results.
    """

    place = Place.BOUNDARY
    where_key = ""

    between: Annotated[tuple[str, str], vector(2)]
    """the two sides, like ["lower.top", "upper.bottom"]; the vertices of the first carry contact and laws, and its
    outward normal counts: the finer one, or the one that lies within the other, should be the first"""
    tied: bool = False
    """whether the sides are glued for ever; then no effect acts between them"""

    @classmethod
    def known(cls) -> dict[str, type[Effect]]:
        """Those that may act between two bodies."""
        return {key: kind for key, kind in super().known().items() if kind.on_interfaces}


class BodyTable(_EffectTable):
    """The effects that act in the body, or in one region of it."""

    place = Place.BODY
    where_key = "region"

    region: Names | None = None
    """a physical group of cells, or a list of them; without it the whole body"""


class MaterialTable(Table):
    """The elasticity of the body, or of one region of it. The further keys depend on `elasticity`."""

    place: ClassVar[Place] = Place.MATERIAL

    elasticity: str = DEFAULT_ELASTICITY
    """the elastic law: its name is one of those below"""


def _material(data: Any, info: ValidationInfo) -> Effect:
    """The material of a table, in its region, read by the class that `elasticity` names."""
    found: Effect = choose(data, "elasticity", Effect.registry[Place.MATERIAL], info.context, DEFAULT_ELASTICITY)
    if getattr(found, "model", "") is None:
        raise validation_error([Mistake(("model",), "is missing: the kind of elastic problem, such as plane_stress")])
    return found


def _shape(value: Any, info: ValidationInfo) -> Any:
    if SeveralBodies.named(value):
        return SeveralBodies.model_validate(value, context=info.context)
    return choose(value, "shape", DomainShape.registry, info.context)


def _material_keys() -> list[str]:
    elastic = Effect.registry[Place.MATERIAL].values()
    return [*MaterialTable.model_fields, *(key for kind in elastic for key in kind.model_fields)]


def _named(own_keys: Callable[[], Iterable[str]]) -> BeforeValidator:
    """A table as it stands, with keys of its own, has the name WHOLE among tables by name."""

    def read(given: Any) -> Any:
        if not isinstance(given, dict):
            return given
        named = given and all(isinstance(value, dict) for value in given.values())
        return given if named and not set(own_keys()) & set(given) else {WHOLE: given}

    return BeforeValidator(read)


class TopLevel(Table):
    """The keys outside of all tables."""

    title: Annotated[str, Field(max_length=200), AfterValidator(_title)] = ""
    """one line that names the scene"""
    plugins: Names | None = None
    """Python files with your own laws, smoothings, effects, methods, domain shapes and target quantities; paths are
    relative to the scene file, see docs/extending.md"""


class _SceneTables(TopLevel):
    """All that a scene file has; tables of effects by name."""

    domain: Annotated[DomainShape, BeforeValidator(_shape)]
    """the body's shape"""
    material: Annotated[dict[str, Annotated[Effect, BeforeValidator(_material)]], _named(_material_keys)]
    """what the body is made of"""
    body: Annotated[dict[str, BodyTable], _named(BodyTable.allowed_keys)] = {}  # noqa: RUF012
    boundary: dict[str, BoundaryTable] = {}  # noqa: RUF012
    interface: dict[str, InterfaceTable] = {}  # noqa: RUF012
    solver: SolverTable = SolverTable()
    path: PathTable | None = None

    @model_validator(mode="after")
    def _named_once(self) -> Self:
        text = "boundary.{0} has this name already; choose another"
        twice = [name for name in self.interface if name in self.boundary]
        if twice:
            raise validation_error([Mistake(("interface", name), text.format(name)) for name in twice])
        return self

    def model(self, loaded: tuple[str, ...] | None) -> Model:
        """The model that the tables are.

        Args:
            loaded: the plugins' absolute paths.
        """
        interfaces = {
            name: InterfaceSides(first=table.between[0], second=table.between[1], tied=table.tied)
            for name, table in self.interface.items()
        }
        materials = [material.at(material.where, name) for name, material in self.material.items()]
        tables = [*self.body.items(), *self.boundary.items(), *self.interface.items()]
        return Model.of_tables(
            Body.of_places(self.domain, None, interfaces=interfaces),
            [*materials, *(effect for name, table in tables for effect in table.effects(name))],
            {name: BoundaryPart(table.on, table.where) for name, table in self.boundary.items()},
            title=self.title,
            solver=self.solver,
            path=self.path,
            plugins=loaded,
        )


KEYS = tuple(_SceneTables.model_fields)
"""All that a scene file may have."""


def read_tables(tables: Any, folder: Path | None = None) -> Model:
    """The model of tables as a scene file has them, or with objects in their place. Not collective.

    Args:
        tables: by key.
        folder: where files that they name are looked for; None: the current one.

    Raises:
        Mistakes: with all that is wrong.
    """
    if not isinstance(tables, dict):
        raise Mistakes([Mistake((), f"must be tables (is {shown(tables)})")])
    folder = folder or Path.cwd()
    try:
        loaded = plugins.load(tables["plugins"], folder) if tables.get("plugins") else None
        found = _SceneTables.model_validate(tables, context={"folder": folder})
    except PydanticCustomError as error:
        raise Mistakes([Mistake(("plugins",), error.message())]) from None
    except ValidationError as error:
        said = error.errors(include_url=False)
        raise Mistakes([Mistake(_as_written(e["loc"], tables), e["msg"]) for e in said]) from None
    return found.model(loaded)


def _as_written(place: Keys, value: Any) -> Keys:
    """The steps of a place that the tables have: a bare list is kept in a field that the file does not name."""
    written: list[str | int] = []
    for step in place:
        if step == WHOLE:
            continue
        if isinstance(value, dict):
            written.append(step)
            value = value.get(step)
        elif isinstance(value, list) and isinstance(step, int):
            written.append(step)
            value = value[step] if step < len(value) else None
    return tuple(written)


def _reduced(model: Model) -> tuple[Any, ...]:
    """Pickled as its tables: another rank must load the plugins before it can know their classes."""
    return read_tables, (model.tables(),)


copyreg.pickle(Model, _reduced)
