"""What a study runs: the scene along the axes asked for, or along those of the default plan; each point is a scene."""

from __future__ import annotations

import itertools
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass

from ..errors import InputError
from ..laws import smoothing
from ..scene import Scene, dump_scene
from .axes import Axis, AxisValues, applied, values_of
from .meshes import can_be_refined, default_meshes, reference_meshes
from .scene_tables import Tables, laws, setting_of, tables_of, unsmoothed, with_solver
from .setting import Setting
from .thresholds import DEFAULT, Thresholds


@dataclass(frozen=True)
class Plan:
    """What is run.

    Attributes:
        own: the scene as it is.
        exact: the scene with the law itself; the same where nothing is smoothed.
        points: all that is measured, cheapest mesh first; ``own`` and ``exact`` are among them.
        reference: what is measured against and the next coarser levels, finest first.
        left_out: combinations that are no scene, in words.
    """

    own: Setting
    exact: Setting
    points: tuple[Setting, ...]
    reference: tuple[Setting, ...]
    left_out: tuple[str, ...]


def make(scene: Scene, axes: Sequence[AxisValues], thresholds: Thresholds = DEFAULT) -> Plan:
    """The plan for a scene: all combinations of the axes' values; without axes, the default plan.

    The scene's own setting and the unsmoothed law on every mesh are always in it: they tell the error of h from that
    of ε.

    Args:
        scene: what is studied.
        axes: what is varied.
        thresholds: of the default plan, and of the reference.

    Raises:
        InputError: an axis that the scene has not, or named twice; or none of the combinations is a scene.
    """
    _check(scene, axes)
    scene = scene.with_solver(degree=scene.solver.degree or 1)
    tables = tables_of(scene)
    left_out: list[str] = []
    combined = [a for a in axes if a.axis.combined]
    wanted = list(_product(tables, combined, left_out) if axes else _default(scene, tables, thresholds, left_out))
    if not wanted:
        raise InputError("--axis: no combination of these is a scene:\n" + "\n".join(left_out))
    alone = list(_goals(tables, axes or _default_goals(scene, thresholds), left_out))
    own, exact = Setting(scene), setting_of(unsmoothed(tables))
    exact_on_each = [exact_like(exact, s) for s in wanted]
    points = sorted(_distinct([*wanted, own, exact, *exact_on_each, *alone]), key=lambda s: s.unknowns)
    finest = max([*wanted, own], key=lambda s: s.scene.domain.unknowns(scene.dimension))
    highest = max(s.degree for s in (*wanted, own, *alone))
    reference = tuple(_reference(finest.scene.with_solver(degree=highest), thresholds))
    return Plan(own, exact, tuple(points), reference, tuple(dict.fromkeys(left_out)))


def exact_like(exact: Setting, setting: Setting) -> Setting:
    """The exact law on the mesh and at the degree of a setting.

    Args:
        exact: the exact law on the scene's own mesh.
        setting: any.
    """
    scene = exact.scene.changed(domain=setting.scene.domain).with_solver(degree=setting.degree)
    return Setting(scene)


def _check(scene: Scene, axes: Sequence[AxisValues]) -> None:
    names = [a.name for a in axes]
    for a in axes:
        if names.count(a.name) > 1:
            raise InputError(f"--axis {a.name}: is given twice; put its values into one list")
        if a.axis.needs_law and not laws(scene):
            raise InputError(f"--axis {a.name}: the scene has no law that could be smoothed; leave the axis out")
        for other in a.axis.excludes:
            if other in names:
                raise InputError(f"--axis {a.name}: {other} is given too; leave one of them out")


def _product(tables: Tables, axes: Sequence[AxisValues], left_out: list[str]) -> Iterator[Setting]:
    """The scenes of all combinations; those that are none are noted in ``left_out``."""
    names = [a.name for a in _in_order(axes)]
    for values in itertools.product(*(a.values for a in _in_order(axes))):
        pairs = dict(zip(names, values, strict=True))
        try:
            yield setting_of(applied(tables, pairs))
        except InputError as error:
            if pairs.keys() <= {"mesh"} or str(error).startswith("--axis"):
                raise
            left_out.append(f"{', '.join(f'{n} {v}' for n, v in pairs.items() if n != 'mesh')}: {error}")


def _goals(tables: Tables, axes: Sequence[AxisValues], left_out: list[str]) -> Iterator[Setting]:
    """What is solved for the values of axes that are not combined with all others."""
    others = [a for a in axes if not a.axis.combined]
    for base in _product(tables, [a for a in axes if a.axis.of_elements], left_out) if others else ():
        yield from (a.axis.setting(base.scene, value) for a in others for value in a.values)


def _in_order(axes: Sequence[AxisValues]) -> list[AxisValues]:
    """The axes in the order in which they are applied."""
    order = list(Axis.registry)
    return sorted(axes, key=lambda a: order.index(a.name))


def _distinct(settings: Iterable[Setting]) -> list[Setting]:
    return list({(dump_scene(s.scene), s.accuracy): s for s in settings}.values())


def _default(scene: Scene, tables: Tables, thresholds: Thresholds, left_out: list[str]) -> Iterator[Setting]:
    """Meshes by widths; and on the scene's own mesh smoothings, methods and tolerances, one at a time."""
    few = values_of("epsilon", thresholds.widths_elsewhere)
    for level in default_meshes(tables, thresholds):
        yield from _product(level, [few] if laws(scene) else [], left_out)
        yield setting_of(level)
    for level in default_meshes(with_solver(unsmoothed(tables), degree=2), thresholds):
        yield setting_of(level)
    if laws(scene):
        yield from _product(tables, [values_of("epsilon", thresholds.widths)], left_out)
        yield from _product(tables, [few, values_of("smoothing", smoothing.available())], left_out)
    if Setting(scene).unknowns <= thresholds.largest_comparison:
        yield from _product(tables, [values_of("method", thresholds.methods)], left_out)
    exact = unsmoothed(tables)
    yield from _product(exact, [values_of("tolerance", thresholds.tolerances)], left_out)
    yield from _product(exact, [values_of("linear_solver", ("lu", "gamg"))], left_out)


def _default_goals(scene: Scene, thresholds: Thresholds) -> list[AxisValues]:
    axes = [values_of("accuracy", thresholds.accuracies), values_of("degree", thresholds.degrees)]
    return axes if can_be_refined(scene.domain) else []


def _reference(finest: Scene, thresholds: Thresholds) -> Iterator[Setting]:
    """The unsmoothed law, by the default method, on finer meshes."""
    tolerance = thresholds.reference_tolerance
    tables = with_solver(unsmoothed(tables_of(finest)), method="auto", linear_solver="auto", tolerance=tolerance)
    for level in reference_meshes(tables, thresholds):
        yield setting_of(level)
