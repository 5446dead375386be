"""The tables of a scene file, read as a model: each by the class that its key names, all mistakes together."""

from __future__ import annotations

import copyreg
import re
from collections.abc import Callable, Iterable, Iterator, Mapping
from pathlib import Path
from typing import Annotated, Any, ClassVar, TypeVar

from pydantic import AfterValidator, BaseModel, BeforeValidator, ConfigDict, Field, PlainSerializer, ValidationError
from pydantic_core import PydanticCustomError

from ..class_registry import closest
from ..effects import Effect, Place
from ..errors import InputError
from ..mesh.boundary_part import BoundaryPart, Inequalities, InterfaceSides
from ..mesh.shapes import DomainShape, SeveralBodies
from ..schema import Keys, Mistake, Names, Table, choose, mistakes_of, refusal, shown, unknown, vector
from . import plugins
from .body import Body
from .content import WHOLE
from .model import Mistakes, Model
from .options import PathTable, SolverTable

T = TypeVar("T")
B = TypeVar("B", bound=BaseModel)
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


class TopLevel(Table):
    """The keys outside of all tables."""

    title: Annotated[str, Field(max_length=200), AfterValidator(_title)] = ""
    """one line that names the scene"""
    plugins: Names | None = None
    """Python files with your own laws, smoothings, effects, methods, domain shapes and target quantities; paths are
    relative to the scene file, see docs/extending.md"""


class BoundaryTable(Table):
    """A part of the boundary and the effects that act on it. NAME is the name of the part in the results."""

    model_config = ConfigDict(arbitrary_types_allowed=True)
    place: ClassVar[Place] = Place.BOUNDARY

    on: Names
    """a side of the shape, a physical group of the mesh file, or a list of them"""
    where: Annotated[Inequalities, BeforeValidator(_piece), PlainSerializer(lambda piece: piece.source)] | None = None
    """only a piece of it: inequalities in x, y, z (m) that hold at the midpoints of its facets, like `"x > 0.3"` or
    `"0.1 < x < 0.2 and y < 1"`"""


class InterfaceTable(Table):
    """Where two bodies meet, and what acts between them, on the displacement of the first relative to the second.

    NAME is the name of the part in the results.
    """

    place: ClassVar[Place] = Place.BOUNDARY

    between: Annotated[tuple[str, str], vector(2)]
    """the two sides, like ["lower.top", "upper.bottom"]; the vertices of the first carry contact and laws, and its
    outward normal counts: the finer one, or the one that lies within the other, should be the first"""
    tied: bool = False
    """whether the sides are glued for ever; then no effect acts between them"""


class BodyTable(Table):
    """The effects that act in the body, or in one region of it."""

    place: ClassVar[Place] = Place.BODY

    region: Names | None = None
    """a physical group of cells, or a list of them; without it the whole body"""


class MaterialTable(Table):
    """The elasticity of the body, or of one region of it. The further keys depend on `elasticity`."""

    place: ClassVar[Place] = Place.MATERIAL

    region: Names | None = None
    """a physical group of cells, or a list of them; required if there are several materials"""
    elasticity: str = DEFAULT_ELASTICITY
    """the elastic law: its name is one of those below"""


TABLES = ("domain", "material", "body", "boundary", "interface", "solver", "path")
KEYS = (*TopLevel.model_fields, *TABLES)
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
        raise Mistakes(None, [Mistake((), f"must be tables (is {shown(tables)})")])
    return _Reader(tables, folder).model()


class Scene(Model):
    """A model from the tables of a scene file as keywords, as objects or as the file writes them. Not collective.

    Raises:
        InputError: a key is unknown, or a value is not allowed.
    """

    def __init__(self, **tables: Any) -> None:
        self.__dict__.update(read_tables(tables).__dict__)

    @staticmethod
    def of(tables: Any) -> Model:
        """The model of tables in one dictionary.

        Args:
            tables: by key.

        Raises:
            InputError: a key is unknown, or a value is not allowed.
        """
        return read_tables(tables)

    model_validate = of


def _reduced(model: Model) -> tuple[Any, ...]:
    """Pickled as its tables: another rank must load the plugins before it can know their classes."""
    return read_tables, (model.tables(),)


copyreg.pickle(Model, _reduced)
copyreg.pickle(Scene, _reduced)


class _Reader:
    """Reads tables, and keeps what is wrong."""

    def __init__(self, tables: Mapping[str, Any], folder: Path | None) -> None:
        self._tables, self._mistakes = tables, list[Mistake]()
        self._context = {"folder": folder or Path()}
        self._effects, self._parts = list[Effect](), dict[str, BoundaryPart]()
        self._interfaces: dict[str, InterfaceSides] = {}

    def model(self) -> Model:
        """The model that the tables are.

        Raises:
            Mistakes: with all that is wrong.
        """
        loaded = self._plugins()  # first of all, since the tables below may need them
        self._check_keys()
        top = self._table(TopLevel, {key: self._tables[key] for key in ("title",) if key in self._tables}, ())
        shape = self._try(("domain",), lambda: _shape(self._tables["domain"], self._context))
        self._materials()
        for name, table in self._named("body", [*BodyTable.model_fields, *Effect.registry[Place.BODY]]):
            self._acting(BodyTable, ("body", name), table)
        for name, table in self._named("boundary"):
            self._acting(BoundaryTable, ("boundary", name), table)
        for name, table in self._named("interface"):
            self._acting(InterfaceTable, ("interface", name), table)
        solver = self._table(SolverTable, self._tables.get("solver", {}), ("solver",))
        path = self._table(PathTable, self._tables["path"], ("path",)) if self._tables.get("path") is not None else None
        if self._mistakes or shape is None or top is None or solver is None:
            raise Mistakes(None, self._mistakes)
        body = Body.of_file(shape, self._interfaces)
        rest = {"title": top.title, "solver": solver, "path": path, "plugins": loaded}
        return Model.of_tables(body, self._effects, self._parts, **rest)

    def _plugins(self) -> tuple[str, ...] | None:
        given = self._tables.get("plugins")
        try:
            return plugins.load(given, self._context["folder"]) if given else None
        except PydanticCustomError as error:
            raise Mistakes(None, [Mistake(("plugins",), error.message())]) from None

    def _check_keys(self) -> None:
        """Unknown keys; what is missing, unless it is misspelt."""
        meant = set()
        for key in self._tables:
            if key not in KEYS:
                self._mistakes.append(Mistake((key,), unknown("key", key, KEYS)))
                meant.add(closest(str(key), KEYS))
        for key in ("domain", "material"):
            if key not in self._tables and key not in meant:
                self._mistakes.append(Mistake((key,), f"is missing: {_WANTED[key]}"))
        for key in ("body", "boundary", "interface"):
            if not isinstance(self._tables.get(key, {}), dict):
                self._mistakes.append(Mistake((key,), f"must be a table (is {shown(self._tables[key])})"))
        for name in {*self._dict("boundary")} & {*self._dict("interface")}:
            text = f"boundary.{name} has this name already; choose another"
            self._mistakes.append(Mistake(("interface", name), text))

    def _dict(self, key: str) -> dict[str, Any]:
        found = self._tables.get(key, {})
        return found if isinstance(found, dict) else {}

    def _try(self, where: Keys, read: Callable[[], T], kind: type[BaseModel] | None = None) -> T | None:
        """What can be read; what is wrong with it is kept."""
        if where[0] not in self._tables and where[0] in ("domain", "material"):
            return None
        try:
            return read()
        except ValidationError as error:
            self._mistakes += [Mistake((*where, *m.where), m.text) for m in mistakes_of(error, kind)]
        return None

    def _table(self, kind: type[B], data: Any, where: Keys) -> B | None:
        if not isinstance(data, dict | kind):
            self._mistakes.append(Mistake(where, f"must be a table (is {shown(data)})"))
            return None
        return self._try(where or ("",), lambda: kind.model_validate(data, context=self._context), kind)

    def _named(self, table: str, own_keys: Iterable[str] | None = None) -> Iterator[tuple[str, Any]]:
        """Tables by name; one table as it stands has the name WHOLE, if it may have keys of its own."""
        given = self._dict(table)
        named = all(isinstance(value, dict | BaseModel) for value in given.values())
        if own_keys is not None and given and (not named or set(own_keys) & set(given)):
            given = {WHOLE: given}
        yield from given.items()

    def _materials(self) -> None:
        given = self._tables.get("material", {})
        if "material" in self._tables and not given:
            text = "is empty; give model, youngs_modulus and poisson_ratio"
            self._mistakes.append(Mistake(("material",), text))
        keys = [*MaterialTable.model_fields]
        keys += [key for kind in Effect.registry[Place.MATERIAL].values() for key in kind.model_fields]
        tables = self._named("material", keys) if isinstance(given, dict) else iter([(WHOLE, given)])
        for name, table in tables:
            self._material(("material", name), table)

    def _material(self, where: Keys, table: Any) -> None:
        if not isinstance(table, dict):
            self._mistakes.append(Mistake(where, f"must be a table (is {shown(table)})"))
            return
        own = self._table(BodyTable, {key: table[key] for key in ("region",) if key in table}, where)
        kinds, named = Effect.registry[Place.MATERIAL], table.get("elasticity", DEFAULT_ELASTICITY)
        if isinstance(named, Effect):
            found: Effect | None = named
        elif not isinstance(named, str) or named not in kinds:
            self._mistakes.append(Mistake((*where, "elasticity"), unknown("elasticity", named, kinds)))
            return
        else:
            rest = {key: value for key, value in table.items() if key not in MaterialTable.model_fields}
            found = self._effect(kinds[named], rest, where, also=("region", "elasticity"))
        if found is not None and own is not None:
            self._effects.append(found.at(own.region, str(where[1])))

    def _acting(self, kind: type[BoundaryTable | InterfaceTable | BodyTable], where: Keys, table: Any) -> None:
        """The effects of a table, and where it stands."""
        if not isinstance(table, dict):
            self._mistakes.append(Mistake(where, f"must be a table (is {shown(table)})"))
            return
        effects = Effect.registry[kind.place]
        if kind is InterfaceTable:
            effects = {key: effect for key, effect in effects.items() if effect.on_interfaces}
        allowed = [*kind.model_fields, *effects]
        wrong = [key for key in table if key not in allowed]
        self._mistakes += [Mistake((*where, key), unknown("key", key, allowed)) for key in wrong]
        own = {key: table[key] for key in kind.model_fields if key in table}
        meant = {closest(str(key), allowed) for key in wrong}
        missing = [key for key in kind.model_fields if kind.model_fields[key].is_required() and key not in own]
        if set(missing) & meant:
            return
        place = self._stands(kind, where, own)
        for key in table:
            if key in effects and (effect := self._effect(effects[key], table[key], (*where, key))) is not None:
                self._effects.append(effect.at(place, str(where[1])))

    def _stands(self, kind: type[Table], where: Keys, own: dict[str, Any]) -> Names | None:
        """The sides or regions of a table, noted by its name."""
        found, name = self._table(kind, own, where), str(where[1])
        if isinstance(found, BoundaryTable):
            self._parts[name] = BoundaryPart(found.on, found.where)
            return found.on
        if isinstance(found, InterfaceTable):
            self._interfaces[name] = InterfaceSides(first=found.between[0], second=found.between[1], tied=found.tied)
            return (name,)
        return found.region if isinstance(found, BodyTable) else None

    def _effect(self, kind: type[Effect], value: Any, where: Keys, also: tuple[str, ...] = ()) -> Effect | None:
        """An effect read by its class; None where that refuses it."""
        try:
            return kind.model_validate(value, context=self._context)
        except ValidationError as error:
            found = mistakes_of(error, kind, also)
        self._mistakes += [Mistake((*where, *_inside(mistake, value)), mistake.text) for mistake in found]
        return None


_WANTED = {"domain": "the body's shape", "material": "what the body is made of"}
"""What the tables are that a scene must have."""


def _shape(value: Any, context: Any) -> DomainShape:
    if SeveralBodies.named(value):
        return SeveralBodies.model_validate(value, context=context)
    found: DomainShape = choose(value, "shape", DomainShape.registry, context)
    return found


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
