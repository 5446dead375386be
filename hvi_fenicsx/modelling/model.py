"""A model: a body, and the effects on its sides and in its regions."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

from pydantic import ValidationError

from ..effects import Effect, Place
from ..errors import InputError
from ..mesh.boundary_part import BoundaryPart
from ..problem.interface_sides import Sides
from ..scene import BodyTable, BoundaryTable, InterfaceTable, MaterialTable, Scene
from ..schema import located_error, unknown
from .body import Body
from .placed_effects import OnSide, PlacedEffect

_WHOLE = "whole body"
_Key = tuple[Place, str, str | None]


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
        raise InputError(f"{_name(placed)}: {error}") from error


def _name(placed: PlacedEffect) -> str:
    return f"{type(placed).__name__} on {placed.where or 'the body'}"


def _check_place(body: Body, placed: PlacedEffect) -> None:
    known = [*placed.places(body.domain), *((*body.pieces, *body.interfaces) if isinstance(placed, OnSide) else ())]
    if placed.where is not None and placed.where not in known:
        reason = unknown("place", placed.where, known) if known else f"the body has no place {placed.where!r}"
        raise InputError(f"{type(placed).__name__}: {reason}")


def _key(placed: PlacedEffect, effect: Effect) -> _Key:
    return effect.place, effect.key, placed.where


def _position(places: Sequence[_Key], wanted: _Key) -> int:
    found = [number for number, key in enumerate(places) if key == wanted]
    if len(found) == 1:
        return found[0]
    _, kind, where = wanted
    known = ", ".join(f"{key} on {place or 'the body'}" for _, key, place in places)
    count = "no" if not found else "several effects"
    raise InputError(f"replace: the model has {count} {kind} on {where or 'the body'}; it has {known}")


def _scene(body: Body, effects: Iterable[tuple[str | None, Effect]], title: str) -> Scene:
    tables: dict[Place, list[tuple[str | None, dict[str, Any]]]] = {place: [] for place in Place}
    for where, effect in effects:
        _add(tables[effect.place], where, effect)
    on_interfaces = [table for table in tables[Place.BOUNDARY] if table[0] in body.interfaces]
    on_sides = [table for table in tables[Place.BOUNDARY] if table[0] not in body.interfaces]
    try:
        return Scene(
            title=title,
            domain=body.shape,
            material=_materials(tables[Place.MATERIAL]),
            body={where or _WHOLE: BodyTable(region=where, **own) for where, own in tables[Place.BODY]},
            boundary=dict(_boundary(on_sides, body.pieces)),
            interface={name: _interface(name, sides, on_interfaces) for name, sides in body.interfaces.items()},
        )
    except ValidationError as error:
        raise located_error(error, Scene) from None


def _add(tables: list[tuple[str | None, dict[str, Any]]], where: str | None, effect: Effect) -> None:
    """Put an effect into the first table of its place that has none of its kind."""
    for place, own in tables:
        if place == where and effect.key not in own:
            own[effect.key] = effect
            return
    tables.append((where, {effect.key: effect}))


def _materials(tables: Sequence[tuple[str | None, dict[str, Any]]]) -> Any:
    made = [(where, MaterialTable(region=where, elasticity=e)) for where, own in tables for e in own.values()]
    if len(made) == 1 and made[0][0] is None:
        return made[0][1]
    return {where or f"{_WHOLE} {number}": table for number, (where, table) in enumerate(made)}


def _interface(name: str, sides: Sides, tables: Sequence[tuple[str | None, dict[str, Any]]]) -> InterfaceTable:
    """The table of an interface."""
    found = [own for where, own in tables if where == name]
    if len(found) > 1:
        raise InputError(f"{name}: {next(iter(found[1]))} acts there already; give it once")
    return InterfaceTable(between=(sides.first, sides.second), tied=sides.tied, **(found[0] if found else {}))


def _boundary(
    tables: Sequence[tuple[str | None, dict[str, Any]]], pieces: Mapping[str, BoundaryPart]
) -> Iterable[tuple[str, BoundaryTable]]:
    """Tables by name: that of the side, with a number from the second one on."""
    seen: dict[str | None, int] = {}
    for where, own in tables:
        seen[where] = seen.get(where, 0) + 1
        name = f"{where}" if seen[where] == 1 else f"{where}.{seen[where]}"
        piece = pieces.get(f"{where}", BoundaryPart((f"{where}",)))
        yield name, BoundaryTable(on=piece.on, where=piece.where, **own)
