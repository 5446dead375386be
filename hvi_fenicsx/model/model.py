"""The model: a body, the effects on it, and how to solve; checked in one place, written as a scene file."""

from __future__ import annotations

import functools
import os
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, Self

import tomli_w

from ..effects import Effect, Place, in_words
from ..errors import InputError, of_user
from ..mesh.boundary_part import BoundaryPart
from ..mesh.shapes import DomainShape
from ..schema import Mistake, Table, require_kind, unknown
from . import content
from .body import Body
from .content import TABLES, WHOLE, Content, PathTable, SolverTable, dotted

if TYPE_CHECKING:
    from ..problem.compose import Formulation

_WHOLE_BODY = "whole body"
_LONGEST_NAME = 90
"""Characters of the name of a place; a scene allows 100, and a number may follow."""


class Model(Content):
    """What is solved: effects on a body. Creation is collective.

    A scene file is a model read, ``scene.toml`` one written. Nobody may change it afterwards.

    Args:
        body: the body on its mesh.
        effects: with their places.
        title: one line that names the model.

    Raises:
        InputError: on all ranks alike: a value is not allowed, or effects contradict each other.
    """

    @of_user("model")
    def __init__(self, body: Body, effects: Sequence[Effect], title: str = "") -> None:
        if not isinstance(body, Body):
            raise InputError(f"model: {body!r} is no body; make one of a mesh: hvi.Body(mesh, facets=..., names=...)")
        require_kind("title", title, (str,), "a text")
        self.body, self.title = body, title
        listed = [self._placed(effect) for effect in _listed("model", effects)]
        if not any(effect.place is Place.MATERIAL for effect in listed):
            raise InputError("model: no effect is a material; add one, such as hvi.Isotropic(youngs_modulus=..., ...)")
        named = list(_named(listed))
        for effect in named:
            if effect.where is not None and effect.where[0] in body.interfaces and effect.name not in body.interfaces:
                raise InputError(f"{effect.where[0]}: {effect.key} acts there already; give it once")
        on_sides = [e for e in named if e.place is Place.BOUNDARY and e.name not in body.interfaces]
        parts = {e.name: body.pieces.get(e.name) or BoundaryPart(e.where or ()) for e in on_sides}
        self._complete(named, parts)

    @classmethod
    def of_tables(cls, body: Body, effects: Iterable[Effect], parts: Mapping[str, BoundaryPart], **rest: Any) -> Self:
        """The model that the tables of a scene file are. Not collective.

        Args:
            body: the body.
            effects: with their places, named by their tables.
            parts: where each boundary table stands.
            **rest: title, solver, path, plugins.

        Raises:
            Mistakes: it contradicts itself.
        """
        model = cls.__new__(cls)
        model.__dict__.update(rest, from_file=True, body=body)
        model._complete(effects, parts)
        return model

    def _complete(self, effects: Iterable[Effect], parts: Mapping[str, BoundaryPart]) -> None:
        """With all that it is, checked."""
        self.parts = {**parts, **{name: BoundaryPart((one.first,)) for name, one in self.body.interfaces.items()}}
        order = list(TABLES)
        self.effects = tuple(sorted(effects, key=lambda e: order.index(self.table(e))))
        if mistakes := content.contradictions(self):
            raise Mistakes(mistakes)

    def _placed(self, effect: Effect) -> Effect:
        """An effect of a program on the body's mesh, checked; a refusal names it and its place. Collective."""
        _check_place(self.body, effect)
        try:
            placed = effect.fitted(self.body.dimension).on_mesh(self.body.mesh)
            placed.check(self.body.dimension)
        except InputError as error:
            raise effect.refused(str(error), effect.where) from error
        return placed

    @of_user("replace")
    def replace(self, *effects: Effect) -> Self:
        """The model with other effects in the place of those of the same kind at the same place. Collective.

        Mesh and coarser meshes are kept.

        Args:
            *effects: the new effects.

        Raises:
            InputError: on all ranks alike: the model has no such effect there, or several.
        """
        changed = list(self.effects)
        for one in _listed("replace", effects):
            position = self._position(one)
            old = changed[position]
            placed = self._placed(one) if not self.from_file else one.fitted(self.dimension)
            changed[position] = placed.at(old.where if self.from_file else placed.where, old.name)
        return self._with(changed)

    def _position(self, wanted: Effect) -> int:
        """The number of the effect that another one stands for."""
        places = frozenset(wanted.where or ())
        alike = [i for i, e in enumerate(self.effects) if (e.place, e.key) == (wanted.place, wanted.key)]
        found = [i for i in alike if places in (frozenset(self.effects[i].where or ()), {self.effects[i].name})]
        if len(found) == 1:
            return found[0]
        count = "no" if not found else "several effects"
        raise InputError(f"replace: the model has {count} {wanted.key} on {in_words(wanted.where)}; it is {self!r}")

    def _with(self, effects: Iterable[Effect], **changes: Any) -> Self:
        """A model like it with other effects and attributes, checked."""
        model = self.__new__(type(self))
        model.__dict__.update(self.__dict__, **changes)
        model._complete(effects, self.parts)
        return model

    def changed(
        self,
        domain: DomainShape | None = None,
        solver: SolverTable | None = None,
        path: PathTable | None = None,
    ) -> Self:
        """The model with another mesh, other options or another load path, checked again. Not collective.

        Args:
            domain: the body's shape with its mesh.
            solver: how to solve.
            path: the load path.
        """
        body, old = self.body, self.body
        if domain is not None:
            body = Body.of_places(domain, old.comm, pieces=old.pieces, interfaces=old.interfaces)
        return self._with(self.effects, body=body, solver=solver or self.solver, path=path or self.path)

    def with_solver(self, **values: Any) -> Self:
        """The model with other values in ``[solver]``, validated again. Not collective.

        Args:
            **values: the new values by their keys.

        Raises:
            InputError: the values are not allowed, or do not fit the others.
        """
        return self.changed(solver=self.solver.changed(**values))

    def formulation(self) -> Formulation:
        """The effects and their places, its laws smoothed where it says so, for any mesh. Not collective."""
        from ..laws import smoothing
        from ..problem.compose import Formulation
        from ..problem.law_term import Modification, unchanged

        wanted = self.solver
        modify: Modification = unchanged
        if (kind := wanted.smoothing) is not None:
            epsilon, absolute = wanted.epsilon, wanted.epsilon_absolute
            modify = functools.partial(smoothing.create, kind, epsilon=epsilon, epsilon_absolute=absolute)
        return Formulation(self.parts, list(self.acting()), modify, self.body.interfaces, wanted.degree or 1)

    def tables(self, folder: Path | None = None) -> dict[str, Any]:
        """The tables of the scene file that it is, every default written out. Not collective.

        Args:
            folder: from which the paths of mesh files and plugins are given; None: absolute paths.
        """

        def write(table: Table) -> dict[str, Any]:
            return table.model_dump(mode="json", exclude_none=True, context=folder and {"folder": folder})

        found: dict[str, Any] = {"title": self.title}
        if self.plugins:
            found["plugins"] = [os.path.relpath(path, folder) if folder else path for path in self.plugins]
        found["domain"] = write(self.domain)
        effects: dict[str, dict[str, Any]] = {table: {} for table in TABLES}
        for name, part in self.parts.items():
            if sides := self.body.interfaces.get(name):
                effects["interface"][name] = {"between": [sides.first, sides.second], "tied": sides.tied}
            else:
                piece = {"where": part.where.source} if part.where else {}
                effects["boundary"][name] = {"on": _one_or_list(part.on), **piece}
        for effect in self.effects:
            own = effects[self.table(effect)].setdefault(effect.name, {})
            if effect.place is not Place.BOUNDARY and effect.where is not None:
                own["region"] = _one_or_list(effect.where)
            if effect.place is Place.MATERIAL:
                own |= {"elasticity": effect.key, **write(effect)}
            else:
                own[effect.key] = write(effect)
        found |= {table: named.get(WHOLE, named) for table, named in effects.items() if named}
        found["solver"] = write(self.solver)
        return found | {"path": write(self.path)} if self.path else found

    def __eq__(self, other: object) -> bool:
        """Whether both say the same of the same body."""
        return isinstance(other, Model) and self._content() == other._content()

    def __hash__(self) -> int:
        return hash(self.title)

    def _content(self) -> tuple[Any, ...]:
        body = self.domain, self.parts, self.body.interfaces
        effects = sorted(self.effects, key=lambda effect: (effect.place.value, effect.name, effect.key))
        return body, effects, self.title, self.solver, self.path, self.plugins

    def __repr__(self) -> str:
        names = (f"{type(effect).__name__} on {in_words(effect.where)}" for effect in self.effects)
        return f"Model({self.body!r}: {', '.join(names)})"


class Mistakes(InputError):
    """What is wrong with a model, each at its place.

    Args:
        found: the mistakes.
    """

    def __init__(self, found: Sequence[Mistake]) -> None:
        super().__init__("\n".join(": ".join(filter(None, (dotted(m.where), m.text))) for m in found))
        self.found = tuple(found)


def dump_scene(scene: Model, folder: Path | None = None) -> str:
    """The model as a scene file; read again from that folder it gives an equal one. Not collective.

    Args:
        scene: the model.
        folder: from which the paths of mesh files and plugins are given; None: absolute paths.
    """
    return tomli_w.dumps(scene.tables(folder))


def is_portable(model: Model) -> bool:
    """Whether a model can be assembled on other meshes than its body's: no energy has data of that one.

    Args:
        model: the model.
    """
    return model.from_file or all(effect.is_portable(model.body.mesh) for effect in model.effects)


def _one_or_list(names: Sequence[str]) -> Any:
    return names[0] if len(names) == 1 else list(names)


def _listed(user: str, effects: Any) -> tuple[Effect, ...]:
    """The effects that a model or a replacement, the user of them, is given."""
    if isinstance(effects, Effect) or not isinstance(effects, Iterable):
        raise InputError(f"{user}: effects are a list; write [...] around them")
    listed = tuple(effects)
    for one in listed:
        if not isinstance(one, Effect) or (one.place is Place.BOUNDARY and one.where is None):
            raise InputError(f'{user}: {one!r} is no effect with a place, such as hvi.Friction("floor", law)')
    return listed


def _check_place(body: Body, effect: Effect) -> None:
    """Refuse a name that is no side or region of the body; a piece or an interface stands alone."""
    on_side, names = effect.place is Place.BOUNDARY, effect.where or ()
    known = body.sides if on_side else body.regions if names else ()
    if on_side and len(names) == 1:
        known = (*known, *body.pieces, *body.interfaces)
    for name in names:
        if name not in known:
            raise InputError(f"{type(effect).__name__}: {unknown('place', name, known)}")


def _named(effects: Iterable[Effect]) -> Iterator[Effect]:
    """Effects named by their places; with a number where a place has one of the kind already."""
    taken = Counter[tuple[Place, str, str]]()
    for effect in effects:
        name = "-".join(effect.where or (_WHOLE_BODY,))[:_LONGEST_NAME]
        kind = (effect.place, name, "" if effect.place is Place.MATERIAL else effect.key)
        taken[kind] += 1
        yield effect.at(effect.where, name if taken[kind] == 1 else f"{name}.{taken[kind]}")
