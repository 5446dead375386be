"""Whether effects, body and options fit together, which none of them can know alone."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Mapping

from ..effects import Drive, Effect, Place, load_name
from ..errors import InputError
from ..laws import smoothing
from ..schema import Mistake, shown, unknown
from .content import Content, dotted

_NAME = re.compile(r"\w[\w.-]{0,99}")


def contradictions(model: Content) -> list[Mistake]:
    """All that does not fit; the finer checks are made only where the coarse ones find nothing."""
    return list(_names(model)) or list(_coarse(model)) or list(_fine(model))


def _names(model: Content) -> Iterator[Mistake]:
    """Names go into tables and file names."""
    text = "cannot be the name of a part; use letters, digits, _ - . only"
    for name in model.parts:
        if not _NAME.fullmatch(name):
            yield Mistake(("interface" if name in model.body.interfaces else "boundary", name), text)


def _coarse(model: Content) -> Iterator[Mistake]:
    yield from _unknown_sides(model)
    yield from _interfaces(model)
    yield from _regions(model)
    yield from _one_by_one(model)
    yield from _start(model)
    yield from _path(model)


def _fine(model: Content) -> Iterator[Mistake]:
    yield from _smoothing(model)
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
    known = list(dict.fromkeys(load_name(where, effect) for where, effect in model.acting() if _drives(effect)))
    for name in (model.path.scaled if model.path else None) or ():
        if name not in known:
            yield Mistake(("path", "scaled"), unknown("load, prescribed displacement or moved obstacle", name, known))


def _drives(effect: Effect) -> bool:
    return effect.displaces_obstacle() or (effect.drive is not Drive.RESISTANCE and not effect.bounds_normal)


def _smoothing(model: Content) -> Iterator[Mistake]:
    names = sorted({law.name for law in model.laws()})
    wanted = model.solver.smoothing
    fitting = None if wanted is None else smoothing.registered()[wanted].laws
    if fitting is not None and (others := [n for n in names if n not in fitting]):
        text = f'{shown(wanted)} is made for law = {_quoted(fitting)}, not for {_quoted(others)}; use "quadratic"'
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


def _quoted(names: Iterable[str]) -> str:
    return ", ".join(map(shown, names))
