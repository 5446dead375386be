"""The tables of a scene that a model is, and its effects as messages name them."""

from __future__ import annotations

import re
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any

from pydantic import ValidationError

from ..effects import Effect, Place
from ..errors import InputError
from ..mesh.boundary_part import BoundaryPart
from ..problem.interface_sides import Sides
from ..scene import BodyTable, BoundaryTable, InterfaceTable, MaterialTable, Scene
from ..schema import located_error
from .body import Body
from .places import Names

_WHOLE = "whole body"
_LONGEST_NAME = 90
"""Characters of the name of a place; a scene allows 100, and a number may follow."""
Placed = tuple[Names | None, dict[str, Any]]
"""The place of a table, and its effects by their keys."""


@dataclass(frozen=True, kw_only=True)
class ModelTables:
    """The effects of a model by the tables that a scene has for them.

    Attributes:
        named: the tables of each place by name, those on interfaces too.
    """

    named: Mapping[Place, Mapping[str, Placed]]

    @classmethod
    def of(cls, effects: Iterable[tuple[Names | None, Effect]]) -> ModelTables:
        """The tables of effects.

        Args:
            effects: with the sides or regions where they act; None: the whole body.
        """
        tables: dict[Place, list[Placed]] = {place: [] for place in Place}
        for where, effect in effects:
            _add(tables[effect.place], where, effect)
        tables[Place.MATERIAL] = _one_each(tables[Place.MATERIAL])
        return cls(named={place: _named(found) for place, found in tables.items()})

    def scene(self, body: Body, title: str) -> Scene:
        """The scene.

        Args:
            body: of the model.
            title: one line that names it.

        Raises:
            InputError: effects contradict each other.
        """
        try:
            with self.naming():
                return self._scene(body, title)
        except ValidationError as error:
            raise located_error(error, Scene) from None

    def _scene(self, body: Body, title: str) -> Scene:
        on_sides, on_interfaces = self._by_kind(body.interfaces)
        return Scene(
            title=title,
            domain=body.shape,
            material=_materials(self.named[Place.MATERIAL]),
            body={name: BodyTable(region=where, **own) for name, (where, own) in self.named[Place.BODY].items()},
            boundary=dict(_boundary(on_sides, body.pieces)),
            interface={name: _interface(name, sides, on_interfaces) for name, sides in body.interfaces.items()},
        )

    def _by_kind(self, interfaces: Collection[str]) -> tuple[dict[str, Placed], list[Placed]]:
        """The tables on sides by name, and those on interfaces."""
        seams = [(name,) for name in interfaces]
        boundary = self.named[Place.BOUNDARY]
        on_sides = {name: table for name, table in boundary.items() if table[0] not in seams}
        return on_sides, [table for table in boundary.values() if table[0] in seams]

    @contextmanager
    def naming(self) -> Iterator[None]:
        """Have refusals name effects and their places where they name tables of a scene."""
        try:
            yield
        except InputError as error:
            error.args = (self.in_words(str(error)),)
            raise

    def in_words(self, message: str) -> str:
        """A message in which keys of a scene, as in ``boundary.floor.contact``, are effects and their places.

        Args:
            message: of an error.
        """
        words = dict(self._words())
        keys = "|".join(map(re.escape, sorted(words, key=len, reverse=True)))
        found = re.compile(rf"(?<![\w.])({keys})(?!\w)(?:\.(\w[\w.]*\w|\w))?")
        return found.sub(lambda key: ": ".join(filter(None, (words[key[1]], key[2]))), in_python(message))

    def _words(self) -> Iterator[tuple[str, str]]:
        """The keys of a scene that are effects or their places, each with its words."""
        for place, tables in self.named.items():
            for name, (where, own) in tables.items():
                for table in _TABLES[place]:
                    yield f"{table}.{name}", in_words(where)
                    for key in own:
                        yield f"{table}.{name}.{key}", f"{key} on {in_words(where)}"


_TABLES = {
    Place.BOUNDARY: ("boundary", "interface"),
    Place.BODY: ("body",),
    Place.MATERIAL: ("material",),
}
"""The tables of a scene that hold what acts at a place."""


def in_python(message: str) -> str:
    """A message that advises what a scene file has for a component that is left alone.

    Args:
        message: of an error.
    """
    return message.replace('write "free"', "write None")


def in_words(where: Collection[str] | None) -> str:
    """A place in messages.

    Args:
        where: the sides or regions; None: the whole body.
    """
    return ", ".join(where) if where else "the body"


def _add(tables: list[Placed], where: Names | None, effect: Effect) -> None:
    """Put an effect into the first table of its place that has none of its kind."""
    for place, own in tables:
        if place == where and effect.key not in own:
            own[effect.key] = effect
            return
    tables.append((where, {effect.key: effect}))


def _one_each(tables: Iterable[Placed]) -> list[Placed]:
    """Tables of one effect each."""
    return [(where, {key: effect}) for where, own in tables for key, effect in own.items()]


def _joined(where: Names | None) -> str:
    """The name of a place in results: its sides or regions with hyphens between them."""
    return "-".join(where or (_WHOLE,))[:_LONGEST_NAME]


def _named(tables: Sequence[Placed]) -> dict[str, Placed]:
    """Tables by the names of their places, with a number from the second one of a name on."""
    named: dict[str, Placed] = {}
    for table in tables:
        name = joined = _joined(table[0])
        number = 1
        while name in named:
            number += 1
            name = f"{joined}.{number}"
        named[name] = table
    return named


def _materials(tables: Mapping[str, Placed]) -> Any:
    made = {
        name: MaterialTable(region=where, elasticity=effect)
        for name, (where, own) in tables.items()
        for effect in own.values()
    }
    return next(iter(made.values())) if set(made) == {_WHOLE} else made


def _interface(name: str, sides: Sides, tables: Sequence[Placed]) -> InterfaceTable:
    """The table of an interface."""
    found = [own for where, own in tables if where == (name,)]
    if len(found) > 1:
        raise InputError(f"{name}: {next(iter(found[1]))} acts there already; give it once")
    return InterfaceTable(between=(sides.first, sides.second), tied=sides.tied, **(found[0] if found else {}))


def _boundary(tables: Mapping[str, Placed], pieces: Mapping[str, BoundaryPart]) -> Iterable[tuple[str, BoundaryTable]]:
    """Tables of sides and pieces by name."""
    for name, (where, own) in tables.items():
        sides = where or ()
        piece = pieces.get(sides[0]) if len(sides) == 1 else None
        part = piece or BoundaryPart(sides)
        yield name, BoundaryTable(on=part.on, where=part.where, **own)
