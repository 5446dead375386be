"""Whether the tables of a scene fit together, which no single table can know."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from itertools import combinations
from typing import Any, Protocol

from ..effects import Drive, Effect, Place, load_name
from ..errors import InputError
from ..laws import smoothing
from ..mesh.boundary_part import BoundaryPart
from ..mesh.shapes import DomainShape
from ..schema import Keys, Mistake, shown, unknown
from .effect_tables import BodyTable, BoundaryTable, InterfaceTable, MaterialTable
from .named_tables import WHOLE
from .path_table import PathTable
from .solver_table import SolverTable

_Item = tuple[Keys, BoundaryPart, Effect]
"""The place in the scene, the sides or their piece, the effect."""


class Tables(Protocol):
    """The tables of a scene, each of which is right for itself."""

    @property
    def domain(self) -> DomainShape:
        """The body's shape."""

    @property
    def dimension(self) -> int:
        """2 or 3."""

    @property
    def material(self) -> Mapping[str, MaterialTable]:
        """Materials by name."""

    @property
    def body(self) -> Mapping[str, BodyTable]:
        """What acts in the volume, by name."""

    @property
    def boundary(self) -> Mapping[str, BoundaryTable]:
        """Boundary parts by name."""

    @property
    def interface(self) -> Mapping[str, InterfaceTable]:
        """Interfaces by name."""

    @property
    def solver(self) -> SolverTable:
        """How to solve."""

    @property
    def path(self) -> PathTable | None:
        """The load path."""

    def effects(self) -> Iterable[tuple[Place, str | None, Effect]]:
        """All effects with their places."""


def contradictions(scene: Tables) -> list[Mistake]:
    """All that does not fit; the finer checks are made only where the coarse ones find nothing."""
    return list(_coarse(scene)) or list(_fine(scene))


def _coarse(scene: Tables) -> Iterator[Mistake]:
    yield from _unknown_sides(scene)
    yield from _interfaces(scene)
    yield from _regions(scene)
    yield from _one_by_one(scene)
    yield from _start(scene)
    yield from _path(scene)


def _fine(scene: Tables) -> Iterator[Mistake]:
    yield from _smoothing(scene)
    items = [*_on_boundary(scene.boundary)]
    yield from _exclusive(items)
    places = dict.fromkeys((side, part.where) for _, part, _ in items for side in part.on)
    for side, where in places:
        own = [(key, effect) for key, part, effect in items if side in part.on and part.where == where]
        yield from _on_side(side, own, scene)


def _unknown_sides(scene: Tables) -> Iterator[Mistake]:
    if scene.domain.normals is None:
        return
    known = list(scene.domain.normals)
    wanted = [(("boundary", name, "on"), side) for name, part in scene.boundary.items() for side in part.on]
    wanted += [(("interface", n, "between"), side) for n, part in scene.interface.items() for side in part.between]
    for key, side in wanted:
        if side not in known:
            yield Mistake(key, f"{unknown('side', side, known)} (a {scene.domain.shape})")


def _interfaces(scene: Tables) -> Iterator[Mistake]:
    """Interfaces and boundary parts have names of their own, and a pair of sides meets once."""
    met: dict[frozenset[str], str] = {}
    for name, part in scene.interface.items():
        if name in scene.boundary:
            yield Mistake(("interface", name), f"boundary.{name} has this name already; choose another")
        sides = frozenset(part.between)
        if sides in met:
            text = f"these sides meet in interface.{met[sides]} already; give that one all that acts between them"
            yield Mistake(("interface", name, "between"), text)
        met.setdefault(sides, name)


def _regions(scene: Tables) -> Iterator[Mistake]:
    seen: dict[str, str] = {}
    for name, material in scene.material.items():
        if material.region is None and len(scene.material) > 1:
            text = 'region is missing: each of several materials must say where it is, region = "..."'
            yield Mistake(("material", name), text)
        for region in material.region or ():
            if region in seen:
                text = f"{shown(region)} has a material already, material.{seen[region]}; name it in one of them"
                yield Mistake(("material", name, "region"), text)
            seen[region] = name
    if scene.domain.regions is not None:
        yield from _unknown_regions("material", scene.material, scene.domain)
        yield from _unknown_regions("body", scene.body, scene.domain)


def _unknown_regions(table: str, entries: Mapping[str, Any], shape: DomainShape) -> Iterator[Mistake]:
    known = shape.regions or ()
    for name, entry in entries.items():
        for region in entry.region or ():
            if not known:
                text = f'a {shape.shape} has no regions; leave region out, or use shape = "file"'
                yield Mistake((table, name, "region"), text)
            elif region not in known:
                yield Mistake((table, name, "region"), f"{unknown('region', region, known)} (a {shape.shape})")


def _one_by_one(scene: Tables) -> Iterator[Mistake]:
    """What each effect itself refuses in this dimension."""
    materials = [(("material", n), m.elasticity) for n, m in scene.material.items()]
    bodies = [(("body", n, e.key), e) for n, b in scene.body.items() for e in b.effects]
    parts = [(key, effect) for key, _, effect in _on_boundary(scene.boundary)]
    parts += [(("interface", n, e.key), e) for n, part in scene.interface.items() for e in part.effects]
    for key, effect in [*materials, *bodies, *parts]:
        try:
            effect.check(scene.dimension)
        except InputError as error:
            yield Mistake(key, str(error))


def _start(scene: Tables) -> Iterator[Mistake]:
    start = scene.solver.start
    if not isinstance(start, str) and len(start) != scene.dimension:
        text = f"has {len(start)} components; in {scene.dimension}D it has {scene.dimension}"
        yield Mistake(("solver", "start"), text)


def _path(scene: Tables) -> Iterator[Mistake]:
    """What the factor of the load path multiplies must be there."""
    known = list(dict.fromkeys(load_name(where, effect) for _, where, effect in scene.effects() if _drives(effect)))
    for name in (scene.path.scaled if scene.path else None) or ():
        if name not in known:
            yield Mistake(("path", "scaled"), unknown("load, prescribed displacement or moved obstacle", name, known))


def _drives(effect: Effect) -> bool:
    return effect.displaces_obstacle() or (effect.drive is not Drive.RESISTANCE and not effect.bounds_normal)


def _on_boundary(boundary: Mapping[str, BoundaryTable]) -> Iterator[_Item]:
    for name, part in boundary.items():
        yield from (
            (("boundary", name, effect.key), BoundaryPart(part.on, part.where), effect) for effect in part.effects
        )


def _smoothing(scene: Tables) -> Iterator[Mistake]:
    tables = (*scene.boundary.values(), *scene.interface.values())
    names = sorted({law.name for part in tables for effect in part.effects for law in effect.superpotentials()})
    wanted = scene.solver.smoothing
    fitting = None if wanted is None else smoothing.registered()[wanted].laws
    if fitting is not None and (others := [n for n in names if n not in fitting]):
        text = f'{shown(wanted)} is made for law = {_quoted(fitting)}, not for {_quoted(others)}; use "quadratic"'
        yield Mistake(("solver", "smoothing"), text)


def _exclusive(items: Iterable[_Item]) -> Iterator[Mistake]:
    """A side bears one effect of an exclusive kind; whether pieces share facets, only the mesh knows."""
    whole = (item for item in items if item[1].where is None)
    for (key, part, effect), (other, others, second) in combinations(whole, 2):
        shared = sorted(set(part.on) & set(others.on))
        if effect.key == second.key and effect.exclusive and shared:
            text = f"{_quoted(shared)} has {effect.key} already, from {_dotted(key)}; give it once"
            yield Mistake(other, text)


def _on_side(side: str, effects: list[tuple[Keys, Effect]], scene: Tables) -> Iterator[Mistake]:
    prescribed: dict[int, Keys] = {}
    for key, effect in effects:
        for axis in effect.prescribed():
            if axis in prescribed:
                text = f'"{side}" has {_axis(axis)} prescribed already, by {_dotted(prescribed[axis])}'
                yield Mistake(key, f'{text}; write "free" in one of them')
            prescribed[axis] = key
    normal = scene.domain.normals[side] if scene.domain.normals else None
    for key, effect in effects:
        yield from _against(key, effect, side, prescribed, normal, scene.dimension)


def _against(
    key: Keys, effect: Effect, side: str, prescribed: Mapping[int, Keys], normal: int | None, dimension: int
) -> Iterator[Mistake]:
    """Contact and tractions in a direction that is prescribed anyway."""
    blocking = normal if normal in prescribed else 0 if len(prescribed) == dimension else None
    if effect.bounds_normal and blocking is not None:
        text = f'the displacement normal to "{side}" is prescribed by {_dotted(prescribed[blocking])}'
        yield Mistake(key, f'{text}; leave {effect.key} out or write "free" there')
    load = effect.surface_load()
    if load is not None:
        idle = [i for i, formula in enumerate(load.components) if i in prescribed and formula.source != 0.0]
        for axis in idle:
            reason = f'{_axis(axis)} is prescribed on "{side}" by {_dotted(prescribed[axis])}'
            text = f'component {axis + 1} does nothing: {reason}; write "free" there or 0 here'
            yield Mistake(key, text)


def _axis(axis: int) -> str:
    return f"u_{'xyz'[axis]}"


def _quoted(names: Iterable[str]) -> str:
    return ", ".join(map(shown, names))


def _dotted(key: Keys) -> str:
    return ".".join(str(step) for step in key if step != WHOLE)
