"""A model: a body, and the effects on its sides and in its regions."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping, Sequence
from typing import Any

from mpi4py import MPI
from pydantic import ValidationError

from ..effects import Effect, Place
from ..errors import InputError
from ..mesh.boundary_part import BoundaryPart
from ..problem.interface_sides import Sides
from ..scene import BodyTable, BoundaryTable, InterfaceTable, MaterialTable, Scene
from ..schema import located_error, unknown
from .body import Body
from .placed_effects import OnSide, PlacedEffect
from .places import Names
from .user_energy import UserEnergy

_WHOLE = "whole body"
_LONGEST_NAME = 90
"""Characters of the name of a place; a scene allows 100, and a number may follow."""
_Key = tuple[Place, str, frozenset[str]]
_Placed = tuple[Names | None, dict[str, Any]]
"""The place of a table, and its effects by their keys."""


class Model:
    """What is solved: effects on a body. Creation is collective.

    A scene file and a model are two ways to the same thing: a model has its scene, which is checked as a file is.

    Args:
        body: the body on its mesh.
        effects: with their places.
        title: one line that names the model.

    Raises:
        InputError: on all ranks alike: a value is not allowed, or effects contradict each other.

    Attributes:
        body: the body.
        effects: the effects, with their places.
        scene: the same as a scene.
    """

    def __init__(self, body: Body, effects: Sequence[PlacedEffect], title: str = "") -> None:
        self.body, self.effects, self.title = _checked_body(body), _listed("model", effects), title
        for one in self.effects:
            _check_place(body, one)
        self._made = [(one, _effect(one, body)) for one in self.effects]
        if not any(effect.place is Place.MATERIAL for _, effect in self._made):
            raise InputError("model: no effect is a material; add one, such as hvi.Isotropic(youngs_modulus=..., ...)")
        self.scene = _scene(body, [(one.where, effect) for one, effect in self._made], title)

    def replace(self, *effects: PlacedEffect) -> Model:
        """The model with other effects in the place of those of the same kind at the same place. Collective.

        Mesh and coarser meshes are kept.

        Args:
            *effects: the new effects.

        Raises:
            InputError: on all ranks alike: the model has no such effect there, or several.
        """
        places = [_key(one, effect) for one, effect in self._made]
        changed = list(self.effects)
        for one in _listed("replace", effects):
            changed[_position(places, _key(one, _effect(one, self.body)))] = one
        return Model(self.body, changed, self.title)

    def __repr__(self) -> str:
        return f"Model({self.body!r}: {', '.join(map(_name, self.effects))})"


def scene_and_ranks(model: Model | Scene, comm: MPI.Comm | None) -> tuple[Scene, MPI.Comm]:
    """The scene of what a user gives, and the ranks that work on it.

    Args:
        model: a model or a scene.
        comm: the ranks of a scene; None: all. A model has those of its body.

    Raises:
        InputError: it is neither.
    """
    if isinstance(model, Model):
        return model.scene, model.body.comm
    if not isinstance(model, Scene):
        raise InputError(f"{model!r} is no model and no scene; a file is read by hvi.read_scene(path)")
    return model, comm or MPI.COMM_WORLD


def is_portable(model: Model) -> bool:
    """Whether a model can be assembled on other meshes than its body's: no energy has data of that one.

    Args:
        model: the model.
    """
    own = (material.elasticity for material in model.scene.material.values())
    return all(energy.is_portable(model.body.mesh) for energy in own if isinstance(energy, UserEnergy))


def _checked_body(body: Any) -> Body:
    if not isinstance(body, Body):
        raise InputError(f"model: {body!r} is no body; make one of a mesh: hvi.Body(mesh, facets=..., names=...)")
    return body


def _listed(user: str, effects: Any) -> tuple[PlacedEffect, ...]:
    """The effects that a model or a replacement, the user of them, is given."""
    if isinstance(effects, PlacedEffect) or not isinstance(effects, Iterable):
        raise InputError(f"{user}: effects are a list; write [...] around them")
    listed = tuple(effects)
    for one in listed:
        if not isinstance(one, PlacedEffect):
            raise InputError(f'{user}: {one!r} is no effect with a place, such as hvi.Friction("floor", law)')
    return listed


def _effect(placed: PlacedEffect, body: Body) -> Effect:
    """The effect, checked; a refusal names it and its place. Collective."""
    try:
        return placed.effect(body.mesh)
    except InputError as error:
        raise InputError("\n".join(f"{_name(placed)}: {line}" for line in str(error).splitlines())) from error


def _name(placed: PlacedEffect) -> str:
    return f"{type(placed).__name__} on {_words(placed.where)}"


def _check_place(body: Body, placed: PlacedEffect) -> None:
    alone = (*body.pieces, *body.interfaces) if isinstance(placed, OnSide) else ()
    names, known = placed.where or (), placed.places(body.domain)
    for name in names:
        if name not in (*known, *(alone if len(names) == 1 else ())):
            raise InputError(f"{type(placed).__name__}: {_no_place(name, known, alone)}")


def _no_place(name: str, known: Collection[str], alone: Collection[str]) -> str:
    """Why a name is none of a place, or none in a list."""
    if name in alone:
        return f"{name!r} stands alone, being a piece or an interface; a list is of whole sides: {', '.join(known)}"
    if not known and not alone:
        return f"the body has no place {name!r}"
    return unknown("place", name, [*known, *alone])


def _words(where: Collection[str] | None) -> str:
    """A place in messages."""
    return ", ".join(where) if where else "the body"


def _key(placed: PlacedEffect, effect: Effect) -> _Key:
    return effect.place, effect.key, frozenset(placed.where or ())


def _position(places: Sequence[_Key], wanted: _Key) -> int:
    found = [number for number, key in enumerate(places) if key == wanted]
    if len(found) == 1:
        return found[0]
    _, kind, where = wanted
    known = "; ".join(f"{key} on {_words(sorted(place))}" for _, key, place in places)
    count = "no" if not found else "several effects"
    raise InputError(f"replace: the model has {count} {kind} on {_words(sorted(where))}; it has {known}")


def _scene(body: Body, effects: Iterable[tuple[Names | None, Effect]], title: str) -> Scene:
    tables: dict[Place, list[_Placed]] = {place: [] for place in Place}
    for where, effect in effects:
        _add(tables[effect.place], where, effect)
    seams = [(name,) for name in body.interfaces]
    on_interfaces = [table for table in tables[Place.BOUNDARY] if table[0] in seams]
    on_sides = [table for table in tables[Place.BOUNDARY] if table[0] not in seams]
    try:
        return Scene(
            title=title,
            domain=body.shape,
            material=_materials(tables[Place.MATERIAL]),
            body={name: BodyTable(region=where, **own) for name, (where, own) in _named(tables[Place.BODY]).items()},
            boundary=dict(_boundary(on_sides, body.pieces)),
            interface={name: _interface(name, sides, on_interfaces) for name, sides in body.interfaces.items()},
        )
    except ValidationError as error:
        raise located_error(error, Scene) from None


def _add(tables: list[_Placed], where: Names | None, effect: Effect) -> None:
    """Put an effect into the first table of its place that has none of its kind."""
    for place, own in tables:
        if place == where and effect.key not in own:
            own[effect.key] = effect
            return
    tables.append((where, {effect.key: effect}))


def _joined(where: Names | None) -> str:
    """The name of a place in results: its sides or regions with hyphens between them."""
    return "-".join(where or (_WHOLE,))[:_LONGEST_NAME]


def _named(tables: Sequence[_Placed]) -> dict[str, _Placed]:
    """Tables by the names of their places, with a number from the second one of a name on."""
    named: dict[str, _Placed] = {}
    for table in tables:
        name = joined = _joined(table[0])
        number = 1
        while name in named:
            number += 1
            name = f"{joined}.{number}"
        named[name] = table
    return named


def _materials(tables: Sequence[_Placed]) -> Any:
    each = [(where, {"effect": effect}) for where, own in tables for effect in own.values()]
    made = {n: MaterialTable(region=where, elasticity=own["effect"]) for n, (where, own) in _named(each).items()}
    return next(iter(made.values())) if set(made) == {_WHOLE} else made


def _interface(name: str, sides: Sides, tables: Sequence[_Placed]) -> InterfaceTable:
    """The table of an interface."""
    found = [own for where, own in tables if where == (name,)]
    if len(found) > 1:
        raise InputError(f"{name}: {next(iter(found[1]))} acts there already; give it once")
    return InterfaceTable(between=(sides.first, sides.second), tied=sides.tied, **(found[0] if found else {}))


def _boundary(tables: Sequence[_Placed], pieces: Mapping[str, BoundaryPart]) -> Iterable[tuple[str, BoundaryTable]]:
    """Tables of sides and pieces by name."""
    for name, (where, own) in _named(tables).items():
        sides = where or ()
        piece = pieces.get(sides[0]) if len(sides) == 1 else None
        part = piece or BoundaryPart(sides)
        yield name, BoundaryTable(on=part.on, where=part.where, **own)
