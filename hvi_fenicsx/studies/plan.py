"""What a study runs: the scene along the axes asked for, or a plan of the program's own; each point is a scene."""

from __future__ import annotations

import itertools
import math
import tomllib
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

from pydantic import ValidationError

from ..errors import InputError
from ..laws import smoothing
from ..scene import Scene, dump_scene
from ..schema import input_error, unknown
from ..solvers import registry
from ..workflow import options_of
from . import meshes
from .meshes import Setting

Tables = dict[str, Any]
EXACT = "exact"
_CHOICES: Mapping[str, Callable[[], Sequence[str]]] = {
    "smoothing": smoothing.available,
    "method": registry.available,
    "linear_solver": lambda: ("auto", "lu", "gamg"),
}
_NUMBERS = ("epsilon", "epsilon_absolute", "tolerance", "accuracy")
_SHARES = ("tolerance", "accuracy")
AXES = ("mesh", "epsilon", "epsilon_absolute", "smoothing", "method", "tolerance", "linear_solver", "accuracy")
"""In this order they are applied: the smoothing's width before its kind."""
_WIDTHS = ("exact", "1", "0.1", "0.01", "0.001")
_WIDTHS_ELSEWHERE = ("exact", "0.1", "0.01")
"""On the other meshes, and of the other smoothings."""
_METHODS = ("auto", "snes_vi", "tao", "ssls", "condensed")
_MOST_OF_METHODS = 20_000
"""Unknowns up to which the plan's own compares methods: some of them are slow."""
_TOLERANCES = ("1e-4", "1e-10")
_ACCURACIES = [0.1, 0.03]
"""What the plan's own asks of adaptive refinement, in the energy norm."""
REFERENCE_TOLERANCE = 1e-10


@dataclass(frozen=True)
class Axis:
    """One quantity that is varied, with its values as texts."""

    name: str
    values: tuple[str, ...]


@dataclass(frozen=True)
class Plan:
    """What is run.

    Attributes:
        own: the scene as it is. exact: the same with the law itself (the same where nothing is smoothed).
        points: all that is measured, cheapest mesh first; ``own`` and ``exact`` are among them.
        reference: what is measured against and the next coarser rungs, finest first.
        left_out: combinations that are no scene, in words.
    """

    own: Setting
    exact: Setting
    points: tuple[Setting, ...]
    reference: tuple[Setting, ...]
    left_out: tuple[str, ...]


def axis(text: str) -> Axis:
    """An ``--axis NAME=VALUE,VALUE``.

    Raises:
        InputError: an unknown name, no values, or one that is not allowed.
    """
    name, _, rest = text.partition("=")
    values = tuple(dict.fromkeys(v.strip() for v in rest.split(",") if v.strip()))
    if name not in AXES:
        raise InputError(f"--axis {text}: {unknown('axis', name, AXES)}")
    if not values:
        raise InputError(f"--axis {text}: needs values, like --axis epsilon=1,0.1,0.01,exact")
    for value in values:
        _check(name, value)
    return Axis(name, values)


def _check(name: str, value: str) -> None:
    if name in _CHOICES and value not in _CHOICES[name]():
        raise InputError(f"--axis {name}: {unknown(name, value, _CHOICES[name]())}")
    if name in _NUMBERS and not (value == EXACT and name.startswith("epsilon")):
        try:
            good = 0.0 < float(value) < (1.0 if name in _SHARES else math.inf)
        except ValueError:
            good = False
        if not good:
            also = " and below 1" if name in _SHARES else ""
            also += ", or exact for the law itself" if name.startswith("epsilon") else ""
            raise InputError(
                f"--axis {name}: {value!r} must be a number above 0{' and below 1' if name in _SHARES else also}"
            )


def make(scene: Scene, axes: Sequence[Axis]) -> Plan:
    """The plan for a scene: the product of the axes; without any, one of the program's own.

    The scene's own setting and the unsmoothed law on every mesh are always in it: they tell the error of h from that
    of ε.

    Raises:
        InputError: an axis that the scene has not, or named twice; or none of the combinations is a scene.
    """
    _fits(scene, axes)
    tables = _tables(scene)
    left_out: list[str] = []
    uniform = [a for a in axes if a.name != "accuracy"]
    targets = [float(v) for a in axes if a.name == "accuracy" for v in a.values] if axes else _ACCURACIES
    adaptive = [Setting(scene, accuracy=target) for target in targets]
    wanted = list(_product(tables, uniform, left_out)) if axes else list(_default(scene, tables, left_out))
    if not wanted:
        raise InputError("--axis: no combination of these is a scene:\n" + "\n".join(left_out))
    own, exact = Setting(scene), _setting(_unsmoothed(tables))
    on_each = [replace(s, scene=exact.scene.changed(domain=s.scene.domain)) for s in wanted]
    points = sorted(_distinct([*wanted, own, exact, *on_each, *adaptive]), key=meshes.unknowns)
    finest = max([*wanted, own], key=meshes.unknowns)
    return Plan(own, exact, tuple(points), tuple(_reference(finest)), tuple(dict.fromkeys(left_out)))


def _tables(scene: Scene) -> Tables:
    """The scene's tables as they stand in a file, but the domain as an object."""
    return {**tomllib.loads(dump_scene(scene)), "domain": scene.domain}


def _fits(scene: Scene, axes: Sequence[Axis]) -> None:
    names = [a.name for a in axes]
    for name in names:
        if names.count(name) > 1:
            raise InputError(f"--axis {name}: is given twice; put its values into one list")
        if name in ("epsilon", "epsilon_absolute", "smoothing") and not laws(scene):
            raise InputError(f"--axis {name}: the scene has no law that could be smoothed; leave the axis out")
    if "epsilon" in names and "epsilon_absolute" in names:
        raise InputError("--axis epsilon_absolute: epsilon is given too; leave one of them out")


def laws(scene: Scene) -> list[Any]:
    """The scene's laws."""
    return [law for placed in scene.effects() for law in placed.effect.superpotentials()]


def _product(tables: Tables, axes: Sequence[Axis], left_out: list[str]) -> Iterator[Setting]:
    ordered = sorted(axes, key=lambda a: AXES.index(a.name))
    for values in itertools.product(*(a.values for a in ordered)):
        pairs = list(zip((a.name for a in ordered), values, strict=True))
        try:
            yield _setting(_applied(tables, pairs))
        except InputError as error:
            if all(name == "mesh" for name, _ in pairs) or str(error).startswith("--axis"):
                raise
            left_out.append(f"{', '.join(f'{n} {v}' for n, v in pairs if n != 'mesh')}: {error}")


def _applied(tables: Tables, pairs: Iterable[tuple[str, str]]) -> Tables:
    found = dict(tables)
    for name, value in pairs:
        if name == "mesh":
            found = meshes.at(found, value)
        elif value == EXACT:
            found = _unsmoothed(found)
        elif name != "smoothing" or _smoothed(found) or not any(n.startswith("epsilon") for n, _ in pairs):
            found = {**found, "solver": _solver(dict(found.get("solver", {})), name, value)}
    return found


def _solver(solver: Tables, name: str, value: str) -> Tables:
    if name.startswith("epsilon"):
        solver.pop("epsilon", None)
        solver.pop("epsilon_absolute", None)
    return {**solver, name: float(value) if name in _NUMBERS else value}


def _smoothed(tables: Tables) -> bool:
    return any(key in tables.get("solver", {}) for key in ("epsilon", "epsilon_absolute"))


def _unsmoothed(tables: Tables) -> Tables:
    hidden = ("smoothing", "epsilon", "epsilon_absolute")
    return {**tables, "solver": {k: v for k, v in tables.get("solver", {}).items() if k not in hidden}}


def _setting(tables: Tables) -> Setting:
    """The tables as a scene whose laws can be smoothed as it says.

    Raises:
        InputError: they contradict each other.
    """
    try:
        scene = Scene.model_validate(tables)
    except ValidationError as error:
        raise input_error(error, Scene) from None
    options_of(scene.solver)  # refuses what the method does not take
    wanted = scene.solver
    for law in laws(scene) if wanted.smoothing else ():
        smoothing.create(str(wanted.smoothing), law, epsilon=wanted.epsilon, epsilon_absolute=wanted.epsilon_absolute)
    return Setting(scene)


def _distinct(settings: Iterable[Setting]) -> list[Setting]:
    return list({(dump_scene(s.scene), s.accuracy): s for s in settings}.values())


def _default(scene: Scene, tables: Tables, left_out: list[str]) -> Iterator[Setting]:
    """Meshes by widths; and on the scene's own mesh smoothings, methods and tolerances, one at a time."""
    few = Axis("epsilon", _WIDTHS_ELSEWHERE)
    for rung in meshes.ladder(tables, _setting):
        yield from _product(rung, [few] if laws(scene) else [], left_out)
        yield _setting(rung)
    if laws(scene):
        yield from _product(tables, [Axis("epsilon", _WIDTHS)], left_out)
        yield from _product(tables, [few, Axis("smoothing", smoothing.available())], left_out)
    if meshes.unknowns(Setting(scene)) <= _MOST_OF_METHODS:
        yield from _product(tables, [Axis("method", _METHODS)], left_out)
    yield from _product(_unsmoothed(tables), [Axis("tolerance", _TOLERANCES)], left_out)
    yield from _product(_unsmoothed(tables), [Axis("linear_solver", ("lu", "gamg"))], left_out)


def _reference(finest: Setting) -> Iterator[Setting]:
    """The unsmoothed law, by the default method, on finer meshes."""
    tables = _unsmoothed(_tables(finest.scene))
    solver = {**tables.get("solver", {}), "method": "auto", "linear_solver": "auto", "tolerance": REFERENCE_TOLERANCE}
    for rung in meshes.reference({**tables, "solver": solver}, _setting):
        yield _setting(rung)
