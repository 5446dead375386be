"""The scene: what the user asked for, validated, frozen, in SI."""

from __future__ import annotations

import os
import re
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Annotated, Any, NamedTuple, Self

from pydantic import (
    AfterValidator,
    BeforeValidator,
    Field,
    SerializationInfo,
    SerializeAsAny,
    ValidationError,
    ValidationInfo,
    field_serializer,
    model_validator,
)
from pydantic_core import PydanticCustomError

from ..effects import Effect, Place
from ..mesh.boundary_part import BoundaryPart
from ..mesh.shapes import DomainShape, SeveralBodies
from ..schema import Mistake, Names, Table, choose, located_error, refusal, validation_error
from . import plugins
from .consistency import contradictions
from .effect_tables import Bodies, BoundaryTable, InterfaceTable, Materials
from .path_table import PathTable
from .solver_table import SolverTable

_NAME = re.compile(r"\w[\w.-]{0,99}")


class PlacedEffect(NamedTuple):
    """An effect with its place in the scene.

    Attributes:
        place: the kind of its table.
        where: the name of a boundary table, of a region of the mesh, or None for the whole body.
        effect: the effect.
    """

    place: Place
    where: str | None
    effect: Effect


def _title(text: str) -> str:
    if not text.isprintable():
        raise refusal("must be a single line of printable characters")
    return text


def _shape(value: Any, info: ValidationInfo) -> Any:
    if SeveralBodies.named(value):
        return SeveralBodies.model_validate(value, context=info.context)
    return choose(value, "shape", DomainShape.registry, info.context)


class Scene(Table):
    """The keys outside of all tables.

    Built with keywords, from the tables of a scene file (``Scene.model_validate({...})``), or with
    :func:`read_scene`.
    """

    title: Annotated[str, Field(max_length=200), AfterValidator(_title)] = ""
    """one line that names the scene"""
    plugins: Names | None = None
    """Python files with your own laws, smoothings, effects, methods, domain shapes and target quantities; paths are
    relative to the scene file, see docs/extending.md"""
    domain: Annotated[SerializeAsAny[DomainShape], BeforeValidator(_shape)]
    """the body's shape"""
    material: Materials
    """what the body is made of"""
    body: Bodies = Field(default_factory=dict)
    """what acts in the body's volume"""
    boundary: dict[str, BoundaryTable] = Field(default_factory=dict)
    """parts of the boundary and what acts on them"""
    interface: dict[str, InterfaceTable] = Field(default_factory=dict)
    """where two bodies meet, and what acts between them"""
    solver: SolverTable = SolverTable()
    """how to solve"""
    path: PathTable | None = None
    """the load path that `hvi path` follows; other commands do not look at it"""

    def __init__(self, **keys: Any) -> None:
        """The keys of the scene file; tables as objects or as the scene file writes them.

        Raises:
            InputError: a key is unknown, or a value is not allowed.
        """
        try:
            super().__init__(**keys)
        except ValidationError as error:
            raise located_error(error, Scene) from None

    # The reader of scene files, which validates by the class, needs pydantic's own error.
    __init__.__pydantic_base_init__ = True  # type: ignore[attr-defined]

    @model_validator(mode="before")
    @classmethod
    def _load_plugins(cls, data: Any, info: ValidationInfo) -> Any:
        """First of all, since the tables below may need them."""
        if not isinstance(data, dict) or not data.get("plugins"):
            return data
        try:
            return {**data, "plugins": plugins.load(data["plugins"], (info.context or {}).get("folder", "."))}
        except PydanticCustomError as error:
            raise validation_error([Mistake(("plugins",), error.message())]) from None

    @field_serializer("plugins")
    def _written_plugins(self, paths: tuple[str, ...] | None, info: SerializationInfo) -> list[str] | None:
        """Their paths from the folder that the scene is written into; absolute where that is not known."""
        folder = (info.context or {}).get("folder")
        if paths is None:
            return None
        return [path if folder is None else os.path.relpath(path, folder) for path in paths]

    def __reduce__(self) -> tuple[Any, ...]:
        """Pickled as its tables: another rank must load the plugins before it can know their classes."""
        return _read_again, (self.model_dump(exclude_none=True),)

    @model_validator(mode="after")
    def _consistent(self) -> Scene:
        names = [*_bad_names("boundary", self.boundary), *_bad_names("interface", self.interface)]
        mistakes = names or contradictions(self)
        if mistakes:
            raise validation_error(mistakes)
        return self

    @property
    def dimension(self) -> int:
        """2 or 3: the shape's, or that of the material models where only the mesh knows."""
        if (own := self.domain.space_dimension()) is not None:
            return own
        known = (material.elasticity.dimension() for material in self.material.values())
        return next((dimension for dimension in known if dimension), 2)

    @property
    def parts(self) -> dict[str, BoundaryPart]:
        """Where each boundary table stands, and the first side of each interface."""
        own = {name: BoundaryPart(table.on, table.where) for name, table in self.boundary.items()}
        return own | {name: BoundaryPart((interface.between[0],)) for name, interface in self.interface.items()}

    def with_domain(self, **values: Any) -> Self:
        """The scene with other values in ``[domain]``, validated again.

        Args:
            **values: the new values by their keys.

        Raises:
            ValidationError: the values are not allowed, or do not fit the rest.
        """
        return self.changed(domain=self.domain.changed(**values))

    def with_solver(self, **values: Any) -> Self:
        """The scene with other values in ``[solver]``, validated again.

        Args:
            **values: the new values by their keys.

        Raises:
            ValidationError: the values are not allowed, or do not fit the rest.
        """
        return self.changed(solver=self.solver.changed(**values))

    def effects(self) -> Iterator[PlacedEffect]:
        """All effects with their places; one on several regions comes once for each."""
        for material in self.material.values():
            for region in material.region or (None,):
                yield PlacedEffect(Place.MATERIAL, region, material.elasticity)
        for body in self.body.values():
            for region in body.region or (None,):
                yield from (PlacedEffect(Place.BODY, region, effect) for effect in body.effects)
        for name, table in (*self.boundary.items(), *self.interface.items()):
            yield from (PlacedEffect(Place.BOUNDARY, name, effect) for effect in table.effects)

    def files(self) -> tuple[Path, ...]:
        """The files of its domain and of its effects."""
        return (*self.domain.files(), *(file for placed in self.effects() for file in placed.effect.files()))


def _read_again(tables: dict[str, Any]) -> Scene:
    return Scene.model_validate(tables)


def _bad_names(table: str, parts: Mapping[str, Any]) -> Iterator[Mistake]:
    """Names go into tables and file names."""
    text = "cannot be the name of a part; use letters, digits, _ - . only"
    return (Mistake((table, name), text) for name in parts if not _NAME.fullmatch(name))
