"""What a model holds: body, effects with their places, and options; and whether these fit together."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Mapping
from itertools import pairwise
from pathlib import Path
from typing import Annotated, Any, Literal, Self

from pydantic import AfterValidator, BeforeValidator, Field, PlainSerializer, model_validator

from ..effects import Drive, Effect, Place, load_name
from ..effects.values import as_value
from ..errors import InputError
from ..laws import Superpotential, smoothing
from ..laws.smoothing import registered as smoothings
from ..mesh.boundary_part import BoundaryPart
from ..mesh.shapes import DomainShape
from ..schema import Count, Keys, Mistake, Names, OneOf, Positive, Table, refusal, shown, unknown, validation_error
from .body import Body

LinearSolver = Literal["auto", "lu", "gamg"]
_STARTS = ("unbroken", "resting", "broken")


def _start_value(value: Any) -> Any:
    if isinstance(value, list | tuple):
        return tuple(map(as_value, value))
    if value not in _STARTS:
        words = ", ".join(map(shown, _STARTS))
        text = f"must be one of {words}, or a list of formulas, one for each component (is {shown(value)})"
        raise refusal(text)
    return value


Start = Annotated[
    Any,
    BeforeValidator(_start_value),
    PlainSerializer(lambda start: start if isinstance(start, str) else [f.source for f in start]),
]
"""The name of a start, or a displacement by component."""


class SolverTable(Table):
    """How the problem is solved. Without `smoothing` and `epsilon` the law itself is solved, not a smoothed one."""

    degree: Annotated[int, Field(ge=1, le=2)] | None = None
    """the degree of the elements: 1, or 2, which needs far fewer unknowns for the same accuracy; without it 1, but with
    `--accuracy` the cheaper one"""
    method: str = "auto"
    """the method: auto chooses linear, convex or branch by the effects; branch solves the exact law; condensed is the
    procedure of the paper; snes_vi is for comparison; or the name of your own method"""
    smoothing: Annotated[str | None, OneOf(smoothings)] = None
    """the plus function that smooths the kinks of the law; paper is the S of the paper; without it the law is exact"""
    epsilon: Positive | None = None
    """width ε of the smoothing, relative to the energy of the law at its kink"""
    epsilon_absolute: Positive | None = None
    """width ε of the smoothing in N/m (J/m²), as in the paper; not together with `epsilon`"""
    start: Start = "unbroken"
    """the start value, which matters if there are several solutions: "unbroken" (no slip), "resting" (the equilibrium
    in which every law is a spring), "broken" (beyond every drop of the laws), or a displacement (m, formulas)"""
    tolerance: Annotated[float, Field(gt=0, lt=1, allow_inf_nan=False)] = 1e-8
    """the iteration ends when the relative residual of the inequality is below it"""
    linear_solver: LinearSolver = "auto"
    """the linear solver; auto chooses by the number of unknowns; PETSc options override it"""
    second_order: bool | None = None
    """if a softening law leaves open whether the solution is a local minimiser, factorise the Hessian; by default up to
    60,000 unknowns in the plane and 15,000 in space"""
    max_iterations: Annotated[Count, Field(le=10**9)] = 100
    """the largest number of Newton iterations"""

    @model_validator(mode="before")
    @classmethod
    def _default_smoothing(cls, data: Any) -> Any:
        smoothed = isinstance(data, dict) and ("epsilon" in data or "epsilon_absolute" in data)
        return {"smoothing": "quadratic", **data} if smoothed else data

    @model_validator(mode="after")
    def _fits(self) -> Self:
        if self.epsilon and self.epsilon_absolute:
            raise validation_error([Mistake(("epsilon_absolute",), "epsilon is given too; leave one of them out")])
        if self.smoothing and not (self.epsilon or self.epsilon_absolute):
            text = (
                "needs its width: add epsilon = 0.01 (relative to the law's energy at its kink) "
                "or epsilon_absolute = 0.1 (N/m), or leave smoothing out to solve the law itself"
            )
            raise validation_error([Mistake(("smoothing",), text)])
        return self


Factor = Annotated[float, Field(ge=-1e100, le=1e100)]
"""A factor beyond this makes work of which squares are no numbers."""
_AS_LIST = BeforeValidator(lambda value: tuple(value) if isinstance(value, list | tuple) else (value,))


def _programme(factors: tuple[float, ...]) -> tuple[float, ...]:
    if not factors:
        raise refusal("is an empty list; give the factor to go to, like 1.5")
    for one, other in pairwise((0.0, *factors)):
        if one == other:
            raise refusal(f"goes from {one:g} to {other:g}, which is no way; a path starts at 0")
    return factors


class PathTable(Table):
    """The load path that `hvi path` follows. A factor grows from 0 and multiplies what drives the body."""

    to: Annotated[
        tuple[Factor, ...],
        _AS_LIST,
        AfterValidator(_programme),
        PlainSerializer(lambda to: to[0] if len(to) == 1 else list(to)),
    ] = (1.0,)
    """the factor at which the path ends; or a programme with turns: [1.0, 0.2, 1.5] loads, unloads, loads again"""
    scaled: Names | None = None
    """what the factor multiplies: loads, prescribed displacements and moved obstacles by name, such as
    ["pull.traction", "lid.contact"]; all others are constant; by default all"""
    follow: Literal["stable", "exact"] = "stable"
    """stable: as a testing machine does, at a limit point on to the next stable equilibrium; exact: the path itself,
    through limit points, where the factor falls and rises again"""
    memory: bool = True
    """whether bonds remember: true: they unload along the secant, and what is broken stays broken; false: the laws as
    they are, which heal"""
    contact_at: Annotated[tuple[Factor, ...], _AS_LIST, PlainSerializer(list)] = ()
    """factors at which the state of Γc is written into path_contact.csv, each time the path crosses them"""
    states: Annotated[int, Field(ge=2)] = 50
    """how many states displacement.pvd shows at most, start, limit points, jumps and end among them"""


WHOLE = ""
"""Name of the only table where ``[material]`` or ``[body]`` is not split into named ones."""
TABLES = ("material", "body", "boundary", "interface")
"""The tables of a scene that hold effects, in the order in which these act."""


class Content:
    """What a model holds.

    Attributes:
        body: the body.
        effects: the effects with their places, in the order of a scene's tables.
        title: one line that names the model.
        solver: how to solve.
        path: the load path; None: nothing is said of it.
        parts: the boundary parts by name; of an interface, the first side.
        plugins: files with classes of the user's own.
        from_file: whether it was read from the tables of a scene file.
    """

    body: Body
    effects: tuple[Effect, ...]
    title: str
    parts: Mapping[str, BoundaryPart]
    solver = SolverTable()
    path: PathTable | None = None
    plugins: tuple[str, ...] | None = None
    from_file = False

    @property
    def domain(self) -> DomainShape:
        """The body's shape with its mesh. Not collective."""
        return self.body.shape

    @property
    def dimension(self) -> int:
        """2 or 3: the shape's, or that of the materials where only the mesh knows it. Not collective."""
        if (own := self.domain.space_dimension()) is not None:
            return own
        known = (e.dimension() for e in self.effects if e.place is Place.MATERIAL)
        return next((dimension for dimension in known if dimension), 2)

    def laws(self) -> list[Superpotential]:
        """The laws of its effects. Not collective."""
        return [law for effect in self.effects for law in effect.superpotentials()]

    def files(self) -> tuple[Path, ...]:
        """The files of its domain and of its effects. Not collective."""
        return (*self.domain.files(), *(file for effect in self.effects for file in effect.files()))

    def acting(self) -> Iterator[tuple[str | None, Effect]]:
        """Each effect at a boundary part or a region; one in several regions comes once for each. Not collective."""
        for effect in self.effects:
            places = (effect.name,) if effect.place is Place.BOUNDARY else effect.where or (None,)
            yield from ((place, effect) for place in places)

    def table(self, effect: Effect) -> str:
        """The table of a scene file in which an effect stands. Not collective.

        Args:
            effect: one of the model's.
        """
        on_interface = effect.place is Place.BOUNDARY and effect.name in self.body.interfaces
        return "interface" if on_interface else effect.place.value

    def key(self, effect: Effect) -> Keys:
        """The keys of a scene file down to an effect. Not collective.

        Args:
            effect: one of the model's.
        """
        own = () if effect.place is Place.MATERIAL else (effect.key,)
        return (self.table(effect), effect.name, *own)


def dotted(key: Keys) -> str:
    """A place as messages name it.

    Args:
        key: the keys of a scene file down to it.
    """
    return ".".join(str(step) for step in key if step != WHOLE)


_NAME = re.compile(r"\w[\w.-]{0,99}")


def contradictions(model: Content) -> list[Mistake]:
    """All that does not fit; the finer checks are made only where the coarse ones find nothing."""
    coarse = (_unknown_sides, _interfaces, _regions, _one_by_one, _start, _path)
    for checks in ((_names,), coarse, (_smoothing, _sides)):
        if found := [mistake for check in checks for mistake in check(model)]:
            return found
    return []


def _names(model: Content) -> Iterator[Mistake]:
    """Names go into tables and file names."""
    text = "cannot be the name of a part; use letters, digits, _ - . only"
    for name in model.parts:
        if not _NAME.fullmatch(name):
            yield Mistake(("interface" if name in model.body.interfaces else "boundary", name), text)


def _sides(model: Content) -> Iterator[Mistake]:
    own = [(model.parts[e.name], e) for e in model.effects if model.table(e) == "boundary"]
    places = dict.fromkeys((side, part.where) for part, _ in own for side in part.on)
    for side, where in places:
        yield from _on_side(model, side, [e for part, e in own if side in part.on and part.where == where])


def _unknown_sides(model: Content) -> Iterator[Mistake]:
    if model.domain.normals is None:
        return
    known, interfaces = list(model.domain.normals), model.body.interfaces
    wanted = [(("boundary", n, "on"), side) for n, p in model.parts.items() if n not in interfaces for side in p.on]
    wanted += [(("interface", n, "between"), side) for n, p in interfaces.items() for side in (p.first, p.second)]
    for key, side in wanted:
        if side not in known:
            yield Mistake(key, f"{unknown('side', side, known)} (a {model.domain.shape})")


def _interfaces(model: Content) -> Iterator[Mistake]:
    """A pair of sides meets once, and something acts between them or they are glued."""
    met: dict[frozenset[str], str] = {}
    for name, part in model.body.interfaces.items():
        sides = frozenset((part.first, part.second))
        if sides in met:
            text = f"these sides meet in interface.{met[sides]} already; give that one all that acts between them"
            yield Mistake(("interface", name, "between"), text)
        met.setdefault(sides, name)
        yield from _on_interface(model, name)


def _on_interface(model: Content, name: str) -> Iterator[Mistake]:
    part, acting = model.body.interfaces[name], [e for e in model.effects if model.key(e)[:2] == ("interface", name)]
    if part.first == part.second:
        yield Mistake(("interface", name, "between"), "names one side twice; name the sides of two bodies")
    if part.tied and acting:
        keys = ", ".join(effect.key for effect in acting)
        yield Mistake(("interface", name, "tied"), f"glues the sides for ever: leave out {keys}, or tied")
    if not part.tied and not acting:
        kinds = ", ".join(key for key, kind in Effect.registry[Place.BOUNDARY].items() if kind.on_interfaces)
        yield Mistake(("interface", name), f"nothing acts between the sides: give tied = true, or one of {kinds}")
    for effect in acting:
        if not effect.on_interfaces:
            yield Mistake(model.key(effect), "acts on one body alone, not between two; put it on a side")


def _regions(model: Content) -> Iterator[Mistake]:
    seen: dict[str, Effect] = {}
    materials = [effect for effect in model.effects if effect.place is Place.MATERIAL]
    for material in materials:
        key = model.key(material)
        if material.where is None and len(materials) > 1:
            text = 'region is missing: each of several materials must say where it is, region = "..."'
            yield Mistake(key, text)
        for region in material.where or ():
            if region in seen:
                other = dotted(model.key(seen[region]))
                text = f"{shown(region)} has a material already, {other}; name it in one of them"
                yield Mistake((*key, "region"), text)
            seen[region] = material
    if model.domain.regions is not None:
        yield from _unknown_regions(model, model.domain.regions)


def _unknown_regions(model: Content, known: Iterable[str]) -> Iterator[Mistake]:
    shape, known = model.domain.shape, list(known)
    tables = {model.key(e)[:2]: e.where or () for e in model.effects if e.place is not Place.BOUNDARY}
    for key, regions in tables.items():
        for region in regions:
            if not known:
                text = f'a {shape} has no regions; leave region out, or use shape = "file"'
                yield Mistake((*key, "region"), text)
            elif region not in known:
                yield Mistake((*key, "region"), f"{unknown('region', region, known)} (a {shape})")


def _one_by_one(model: Content) -> Iterator[Mistake]:
    """What each effect itself refuses in this dimension."""
    for effect in model.effects:
        try:
            effect.check(model.dimension)
        except InputError as error:
            yield Mistake(model.key(effect), str(error))


def _start(model: Content) -> Iterator[Mistake]:
    start = model.solver.start
    if not isinstance(start, str) and len(start) != model.dimension:
        text = f"has {len(start)} components; in {model.dimension}D it has {model.dimension}"
        yield Mistake(("solver", "start"), text)


def _path(model: Content) -> Iterator[Mistake]:
    """What the factor of the load path multiplies must be there."""
    known = dict.fromkeys(
        load_name(where, effect)
        for where, effect in model.acting()
        if effect.displaces_obstacle() or (effect.drive is not Drive.RESISTANCE and not effect.bounds_normal)
    )
    for name in (model.path.scaled if model.path else None) or ():
        if name not in known:
            yield Mistake(("path", "scaled"), unknown("load, prescribed displacement or moved obstacle", name, known))


def _smoothing(model: Content) -> Iterator[Mistake]:
    names = sorted({law.name for law in model.laws()})
    wanted = model.solver.smoothing
    fitting = None if wanted is None else smoothing.registered()[wanted].laws
    if fitting is not None and (others := [n for n in names if n not in fitting]):
        made_for, given = (", ".join(map(shown, kinds)) for kinds in (fitting, others))
        text = f'{shown(wanted)} is made for law = {made_for}, not for {given}; use "quadratic"'
        yield Mistake(("solver", "smoothing"), text)


def _on_side(model: Content, side: str, effects: list[Effect]) -> Iterator[Mistake]:
    prescribed: dict[int, Effect] = {}
    for effect in effects:
        for axis in effect.prescribed():
            if axis in prescribed:
                text = f'"{side}" has {_axis(axis)} prescribed already, by {dotted(model.key(prescribed[axis]))}'
                yield Mistake(model.key(effect), f'{text}; write "free" in one of them')
            prescribed[axis] = effect
    for effect in effects:
        yield from _against(model, effect, side, prescribed)


def _against(model: Content, effect: Effect, side: str, prescribed: Mapping[int, Effect]) -> Iterator[Mistake]:
    """Contact and tractions in a direction that is prescribed anyway."""
    normal = model.domain.normals[side] if model.domain.normals else None
    blocking = normal if normal in prescribed else 0 if len(prescribed) == model.dimension else None
    if effect.bounds_normal and blocking is not None:
        text = f'the displacement normal to "{side}" is prescribed by {dotted(model.key(prescribed[blocking]))}'
        yield Mistake(model.key(effect), f'{text}; leave {effect.key} out or write "free" there')
    load = effect.surface_load()
    if load is not None:
        idle = [i for i, formula in enumerate(load.components) if i in prescribed and formula.source != 0.0]
        for axis in idle:
            reason = f'{_axis(axis)} is prescribed on "{side}" by {dotted(model.key(prescribed[axis]))}'
            text = f'component {axis + 1} does nothing: {reason}; write "free" there or 0 here'
            yield Mistake(model.key(effect), text)


def _axis(axis: int) -> str:
    return f"u_{'xyz'[axis]}"
