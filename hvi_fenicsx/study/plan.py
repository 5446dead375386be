"""What a study runs: the scene along the axes asked for, or along those of the default plan; each point is a scene."""

from __future__ import annotations

import contextlib
import hashlib
import itertools
import tomllib
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from fractions import Fraction
from typing import Any

from ..errors import InputError
from ..laws import smoothing
from ..mesh.shapes import DomainShape
from ..model import Model, SolverTable, dump_scene
from ..report.units import quantity
from ..schema import unknown
from ..solvers import method

EXACT = "exact"
"""The width of a smoothing that is none."""
_UNSMOOTHED = dict.fromkeys(("smoothing", "epsilon", "epsilon_absolute"))
_WIDTHS = ("epsilon", "epsilon_absolute")
LARGEST = {2: 400_000, 3: 250_000}
"""Unknowns of the reference, by dimension, that are affordable."""
Values = Mapping[str, Sequence[Any]]
"""The values by axis; of the mesh also domain shapes."""


@dataclass(frozen=True)
class Point:
    """What one point of a study solves.

    Attributes:
        scene: the scene.
    """

    scene: Model

    @property
    def name(self) -> str:
        """A digest of its scene and the mesh file's content."""
        digest = hashlib.sha256(dump_scene(self.scene).encode())
        for file in self.scene.files():
            digest.update(file.read_bytes())
        return digest.hexdigest()[:16]

    @property
    def mesh(self) -> str:
        """The mesh, as people name it."""
        return self.scene.domain.mesh_text(lambda metres: quantity(metres, "m"))

    @property
    def degree(self) -> int:
        """The degree of the elements."""
        return self.scene.solver.degree or 1

    @property
    def unknowns(self) -> float:
        """About how many there are; of a mesh file, which is not opened for it, a guess."""
        nodes = 1.0 if self.degree == 1 else 2.0**self.scene.dimension
        return nodes * self.scene.domain.unknowns(self.scene.dimension)

    def __str__(self) -> str:
        solver = self.scene.solver
        widths = [f"{name} = {width:g}" for name in _WIDTHS if (width := getattr(solver, name)) is not None]
        law = " ".join([solver.smoothing or "exact law", *widths])
        return f"{self.mesh}, degree {self.degree}, {law}, {solver.method}"


@dataclass(frozen=True)
class Plan:
    """What is run.

    Attributes:
        own: the scene as it is.
        points: all that is measured, cheapest mesh first, on each the exact law; ``own`` is among them.
        reference: what is measured against and the next coarser levels, finest first.
        left_out: combinations that are no scene, in words.
    """

    own: Point
    left_out: tuple[str, ...]
    points: tuple[Point, ...] = ()
    reference: tuple[Point, ...] = ()

    def exact_like(self, point: Point) -> Point:
        """The exact law on a point's mesh and at its degree, by the scene's own method."""
        scene = self.own.scene.changed(domain=point.scene.domain)
        return Point(scene.with_solver(**_UNSMOOTHED, degree=point.degree))


def read_axis(text: str) -> tuple[str, tuple[str, ...]]:
    """The name and the values that ``--axis NAME=VALUE,VALUE`` asks for.

    Raises:
        InputError: an unknown name, no values, or one that is not allowed.
    """
    name, _, rest = text.partition("=")
    values = tuple(dict.fromkeys(v.strip() for v in rest.split(",") if v.strip()))
    axes = ("mesh", *SolverTable.model_fields)
    if name not in axes:
        raise InputError(f"--axis {text}: {unknown('axis', name, axes)}")
    if not values:
        raise InputError(f"--axis {text}: needs values, like --axis epsilon=1,0.1,0.01,exact")
    return name, values


def _combinations(scene: Model, axes: Values, left_out: list[str]) -> Iterator[Point]:
    """The points of all combinations of values; those that are no scenes are noted."""
    for values in itertools.product(*axes.values()):
        pairs = dict(zip(axes, values, strict=True))
        on_mesh = _on_mesh(scene, pairs.pop("mesh", scene.domain))
        try:
            yield Point(_solved(on_mesh, pairs))
        except InputError as error:
            left_out.append(f"{', '.join(f'{name} {value}' for name, value in pairs.items())}: {error}")


def _on_mesh(scene: Model, mesh: str | DomainShape) -> Model:
    try:
        return scene.changed(domain=scene.domain.with_mesh(mesh) if isinstance(mesh, str) else mesh)
    except InputError as error:
        raise InputError(f"--axis mesh: {error}") from None


def _default(scene: Model) -> Iterator[Values]:
    """Meshes by widths; on the scene's own mesh smoothings, methods, tolerances; both degrees."""
    exact, meshes = {"epsilon": (EXACT,)}, {"mesh": _default_meshes(scene)}
    widths = {"epsilon": (EXACT, "0.1", "0.01")} if scene.laws() else exact
    yield {**meshes, **widths}
    if scene.laws():
        yield {"epsilon": ("1", "0.001")}
        yield {**widths, "smoothing": tuple(smoothing.registered())}
    yield {"method": method.available()}
    yield {**exact, "tolerance": ("1e-4", "1e-10")}
    yield {**exact, "linear_solver": ("lu", "gamg")}
    yield {**meshes, **exact, "degree": ("2",)}


def make(scene: Model, axes: Sequence[tuple[str, Sequence[str]]]) -> Plan:
    """The plan for a scene: all combinations of the axes' values; without axes, the default plan.

    The scene's own setting and the exact law on every mesh are always in it: they tell the error of h from that of ε.

    Args:
        scene: what is studied.
        axes: what is varied, by :func:`read_axis`.

    Raises:
        InputError: an axis that the scene has not, or named twice; or none of the combinations is a scene.
    """
    names = [name for name, _ in axes]
    for name in names:
        if names.count(name) > 1:
            raise InputError(f"--axis {name}: is given twice; put its values into one list")
        if name in _UNSMOOTHED and not scene.laws():
            raise InputError(f"--axis {name}: the scene has no law that could be smoothed; leave the axis out")
    if set(_WIDTHS) <= set(names):
        raise InputError("--axis epsilon_absolute: epsilon is given too; leave one of them out")
    scene = scene.with_solver(degree=scene.solver.degree or 1)
    left_out = list[str]()
    products: list[Values] = [dict(axes)] if axes else [*_default(scene)]
    wanted = [point for product in products for point in _combinations(scene, product, left_out)]
    if not wanted:
        raise InputError("--axis: no combination of these is a scene:\n" + "\n".join(left_out))
    own = Point(scene)
    plan = Plan(own, tuple(dict.fromkeys(left_out)))
    everything = [*wanted, own, *map(plan.exact_like, [own, *wanted])]
    distinct = {dump_scene(p.scene): p for p in everything}.values()
    finest = max(everything, key=lambda p: p.scene.domain.unknowns(scene.dimension))
    degree = max(point.degree for point in everything)
    points = tuple(sorted(distinct, key=lambda p: (p.unknowns, p.scene.solver.smoothing is not None)))
    return replace(plan, points=points, reference=_reference(finest, degree))


def _solved(scene: Model, pairs: Mapping[str, str]) -> Model:
    """A scene with other values in its solver table.

    Raises:
        InputError: they contradict each other, or the laws cannot be smoothed so.
    """
    values: dict[str, Any] = dict(pairs)
    for name, text in pairs.items():
        with contextlib.suppress(tomllib.TOMLDecodeError):  # what is no value of TOML is a text
            values[name] = tomllib.loads(f"value = {text}")["value"]
    width = next((name for name in _WIDTHS if name in values), None)
    if width is not None and values[width] == EXACT:
        values |= _UNSMOOTHED
    elif width is not None:
        kind = values.get("smoothing", scene.solver.smoothing) or "quadratic"
        values = {**dict.fromkeys(_WIDTHS), **values, "smoothing": kind}
    found = scene.with_solver(**values)
    solver = found.solver
    method.checked(solver)
    for law in found.laws() if solver.smoothing else ():
        smoothing.create(str(solver.smoothing), law, epsilon=solver.epsilon, epsilon_absolute=solver.epsilon_absolute)
    return found


def _refined(scene: Model, factor: Fraction) -> Model | None:
    """The scene with cells ``factor`` times finer each way; None where there is no such mesh."""
    shape = scene.domain.refined(factor)
    return None if shape is None else scene.changed(domain=shape)


def _with_coarser(scene: Model) -> list[Model]:
    """A scene, and it on the next two coarser meshes that there are."""
    coarser = [_refined(scene, Fraction(1, n)) for n in (2, 4)]
    return [scene, *(one for one in coarser if one is not None)]


def _default_meshes(scene: Model) -> list[DomainShape]:
    """The scene's mesh, two coarser ones, and a finer one if twice finer ones are affordable as references."""
    found = _with_coarser(scene)
    finer, reference = (_refined(scene, Fraction(n)) for n in (2, 4))
    if finer is not None and reference is not None and _affordable(reference):
        found.append(finer)
    return [s.domain for s in found]


def _reference(finest: Point, degree: int) -> tuple[Point, ...]:
    """The exact law on a mesh four times finer, or twice, and on the next two coarser ones."""
    scene = finest.scene.with_solver(**_UNSMOOTHED, degree=degree, method="auto", linear_solver="auto", tolerance=1e-10)
    fine = _refined(scene, Fraction(4))
    if fine is None or not _affordable(fine):
        fine = _refined(scene, Fraction(2)) or scene
    return tuple(map(Point, _with_coarser(fine)))


def _affordable(scene: Model) -> bool:
    return Point(scene).unknowns <= LARGEST[scene.dimension]
