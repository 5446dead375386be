"""A model: a body, and the effects on its sides and in its regions."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Sequence
from typing import Any

from mpi4py import MPI

from ..effects import Effect, Place
from ..errors import InputError
from ..scene import Scene
from ..schema import unknown
from .body import Body
from .model_tables import ModelTables, in_python, in_words
from .placed_effects import OnSide, PlacedEffect
from .user_energy import UserEnergy

_Key = tuple[Place, str, frozenset[str]]


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
        tables: the effects by the tables of a scene.
        scene: the same as a scene.
    """

    def __init__(self, body: Body, effects: Sequence[PlacedEffect], title: str = "") -> None:
        self.body, self.effects, self.title = _checked_body(body), _listed("model", effects), title
        for one in self.effects:
            _check_place(body, one)
        self._made = [(one, _effect(one, body)) for one in self.effects]
        if not any(effect.place is Place.MATERIAL for _, effect in self._made):
            raise InputError("model: no effect is a material; add one, such as hvi.Isotropic(youngs_modulus=..., ...)")
        self.tables = ModelTables.of((one.where, effect) for one, effect in self._made)
        self.scene = self.tables.scene(body, title)

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
        effect = placed.effect(body.mesh)
        effect.check(body.mesh.geometry.dim)
    except InputError as error:
        raise InputError(
            "\n".join(f"{_name(placed)}: {line}" for line in in_python(str(error)).splitlines())
        ) from error
    return effect


def _name(placed: PlacedEffect) -> str:
    return f"{type(placed).__name__} on {in_words(placed.where)}"


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


def _key(placed: PlacedEffect, effect: Effect) -> _Key:
    return effect.place, effect.key, frozenset(placed.where or ())


def _position(places: Sequence[_Key], wanted: _Key) -> int:
    found = [number for number, key in enumerate(places) if key == wanted]
    if len(found) == 1:
        return found[0]
    _, kind, where = wanted
    known = "; ".join(f"{key} on {in_words(sorted(place))}" for _, key, place in places)
    count = "no" if not found else "several effects"
    raise InputError(f"replace: the model has {count} {kind} on {in_words(sorted(where))}; it has {known}")
