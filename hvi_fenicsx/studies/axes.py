"""The axes that a study can vary. To add one, subclass :class:`Axis` here: it is known by its name at once."""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from typing import ClassVar, get_args

from ..class_registry import enter
from ..errors import InputError
from ..laws import smoothing
from ..scene import Scene
from ..scene.solver_table import Degree, LinearSolver
from ..schema import unknown
from ..solvers import registry
from . import meshes
from .scene_tables import WIDTHS, Tables, smooths, unsmoothed, with_solver, without
from .setting import Setting

EXACT = "exact"
"""The width of a smoothing that is none."""


class Axis:
    """One quantity that a study can vary.

    Attributes:
        name: in ``--axis NAME=VALUE,...``; where it is a key of the solver table, nothing else may be needed.
        needs_law: whether the scene must have a law that can be smoothed.
        excludes: the axes that cannot be given beside it.
        combined: whether its values are combined with those of the other axes; else :meth:`setting` is asked.
        of_elements: whether its values are combined with those of the axes that are not combined, too.
    """

    registry: ClassVar[dict[str, type[Axis]]] = {}
    """All axes by name, in the order in which they are applied."""

    name: ClassVar[str]
    needs_law: ClassVar[bool] = False
    excludes: ClassVar[tuple[str, ...]] = ()
    combined: ClassVar[bool] = True
    of_elements: ClassVar[bool] = False

    def __init_subclass__(cls) -> None:
        if "name" in vars(cls):
            enter(Axis.registry, cls, cls.name, "axis")

    def check(self, value: str) -> None:
        """Refuse a value that the axis does not have.

        Raises:
            InputError: with what is allowed.
        """

    def apply(self, tables: Tables, value: str, beside: Collection[str]) -> Tables:
        """The tables of a scene with a value of this axis.

        Args:
            tables: the scene's.
            value: as the user wrote it.
            beside: the names of all axes that are given.

        Raises:
            InputError: the scene does not take it.
        """
        return with_solver(tables, **{self.name: value})

    def setting(self, scene: Scene, value: str) -> Setting:
        """What is solved for a value that is not combined with those of other axes.

        Args:
            scene: the scene.
            value: as the user wrote it.
        """
        raise NotImplementedError


class MeshAxis(Axis):
    """The mesh, in the words of the scene's domain shape."""

    name = "mesh"

    def apply(self, tables: Tables, value: str, beside: Collection[str]) -> Tables:
        """See the base class."""
        return meshes.at(tables, value)


class _Number(Axis):
    """A positive number."""

    below: ClassVar[float] = math.inf
    or_exact: ClassVar[bool] = False

    def check(self, value: str) -> None:
        """See the base class."""
        if self.or_exact and value == EXACT:
            return
        try:
            good = 0.0 < float(value) < self.below
        except ValueError:
            good = False
        if not good:
            also = f" and below {self.below:g}" if math.isfinite(self.below) else ""
            also += f", or {EXACT} for the law itself" if self.or_exact else ""
            raise InputError(f"--axis {self.name}: {value!r} must be a number above 0{also}")

    def apply(self, tables: Tables, value: str, beside: Collection[str]) -> Tables:
        """See the base class."""
        return with_solver(tables, **{self.name: float(value)})


class EpsilonAxis(_Number):
    """The width of the smoothing, relative to the law's energy at its kink."""

    name = "epsilon"
    needs_law = True
    or_exact = True

    def apply(self, tables: Tables, value: str, beside: Collection[str]) -> Tables:
        """See the base class."""
        return unsmoothed(tables) if value == EXACT else super().apply(without(tables, *WIDTHS), value, beside)


class EpsilonAbsoluteAxis(EpsilonAxis):
    """The width of the smoothing in N/m."""

    name = "epsilon_absolute"
    excludes = ("epsilon",)


class _Choice(Axis):
    """One of several names."""

    def allowed(self) -> Sequence[str]:
        """The names."""
        raise NotImplementedError

    def check(self, value: str) -> None:
        """See the base class."""
        if value not in self.allowed():
            raise InputError(f"--axis {self.name}: {unknown(self.name, value, self.allowed())}")


class SmoothingAxis(_Choice):
    """The kind of smoothing. It is applied after the width: where that is exact, nothing is smoothed."""

    name = "smoothing"
    needs_law = True

    def allowed(self) -> Sequence[str]:
        """See the base class."""
        return smoothing.available()

    def apply(self, tables: Tables, value: str, beside: Collection[str]) -> Tables:
        """See the base class."""
        exact = not smooths(tables) and any(width in beside for width in WIDTHS)
        return tables if exact else super().apply(tables, value, beside)


class DegreeAxis(_Choice):
    """The degree of the elements."""

    name = "degree"
    of_elements = True

    def allowed(self) -> Sequence[str]:
        """See the base class."""
        return tuple(map(str, get_args(Degree)))

    def apply(self, tables: Tables, value: str, beside: Collection[str]) -> Tables:
        """See the base class."""
        return with_solver(tables, degree=int(value))


class MethodAxis(_Choice):
    """The method that solves."""

    name = "method"

    def allowed(self) -> Sequence[str]:
        """See the base class."""
        return registry.available()


class ToleranceAxis(_Number):
    """The relative residual at which the iteration ends."""

    name = "tolerance"
    below = 1.0


class LinearSolverAxis(_Choice):
    """The linear solver."""

    name = "linear_solver"

    def allowed(self) -> Sequence[str]:
        """See the base class."""
        return get_args(LinearSolver)


class AccuracyAxis(_Number):
    """Adaptive meshes: what ``hvi run --accuracy`` is asked for in the energy norm."""

    name = "accuracy"
    below = 1.0
    combined = False

    def setting(self, scene: Scene, value: str) -> Setting:
        """See the base class."""
        if not meshes.can_be_refined(scene.domain):
            raise InputError("--axis accuracy: this mesh cannot be refined; leave the axis out")
        return Setting(scene, accuracy=float(value))


@dataclass(frozen=True)
class AxisValues:
    """One axis with the values that a study takes of it.

    Attributes:
        axis: the axis.
        values: as the user wrote them.
    """

    axis: Axis
    values: tuple[str, ...]

    @property
    def name(self) -> str:
        """The axis's name."""
        return self.axis.name


def values_of(name: str, values: Sequence[str]) -> AxisValues:
    """Some values of an axis.

    Args:
        name: of the axis.
        values: of it.
    """
    return AxisValues(Axis.registry[name](), tuple(values))


def read(text: str) -> AxisValues:
    """What ``--axis NAME=VALUE,VALUE`` asks for.

    Raises:
        InputError: an unknown name, no values, or one that is not allowed.
    """
    name, _, rest = text.partition("=")
    values = tuple(dict.fromkeys(v.strip() for v in rest.split(",") if v.strip()))
    if name not in Axis.registry:
        raise InputError(f"--axis {text}: {unknown('axis', name, tuple(Axis.registry))}")
    if not values:
        raise InputError(f"--axis {text}: needs values, like --axis epsilon=1,0.1,0.01,exact")
    asked = values_of(name, values)
    for value in values:
        asked.axis.check(value)
    return asked


def applied(tables: Tables, pairs: Mapping[str, str]) -> Tables:
    """The tables of a scene with a value of each of several axes.

    Args:
        tables: the scene's.
        pairs: the values by axis.

    Raises:
        InputError: the scene does not take one of them.
    """
    for name, axis in Axis.registry.items():
        if name in pairs:
            tables = axis().apply(tables, pairs[name], pairs.keys())
    return tables
