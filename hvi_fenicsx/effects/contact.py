"""Contact, unilateral with a gap (paper: K) or bilateral within a slot, and the rigid obstacles that a body may touch.

A new obstacle is a new subclass of :class:`Obstacle`; it registers itself under its ``shape``.
"""

from __future__ import annotations

import math
from abc import abstractmethod
from collections.abc import Mapping, Sequence
from typing import Annotated, Any, ClassVar, Literal

import numpy as np
from pydantic import AfterValidator, BeforeValidator, PlainSerializer, ValidationInfo, model_validator

from ..class_registry import enter
from ..errors import InputError
from ..formula import Computed, Formula, SpatialValue
from ..geometry import ROUNDING
from ..schema import ExistingFile, Finite, Positive, Table, choose, refusal
from ..typing import Array
from . import surface_file
from .base import BodySizes, Drive, Effect, Evaluate, FormContext, Place, Sides, from_python
from .contribution import Contribution, NormalBounds, ObstacleMotion
from .values import FormulaField, Value, as_value, require_components

Vector = Annotated[
    tuple[Finite, ...], BeforeValidator(lambda value: tuple(value) if isinstance(value, list) else value)
]
"""Components, as many as the scene has dimensions."""


def _not_zero(vector: tuple[float, ...]) -> tuple[float, ...]:
    if not any(vector):
        raise refusal("is zero; give a direction")
    return vector


NonzeroVector = Annotated[Vector, AfterValidator(_not_zero)]
"""A vector that is not zero."""


def unit(vector: Vector) -> Array:
    """The unit vector of a direction, (d,)."""
    return np.asarray(vector, dtype=np.float64) / math.hypot(*vector) + 0.0


class Obstacle(Table):
    """A rigid obstacle. Points are given as (m, d), distances as (m,), in m.

    A field of the type :data:`Vector` must have as many components as the scene has dimensions.

    Class attributes:
        shape: the name in scenes.
        dimensions: of space, in which it makes sense.
    """

    shape: ClassVar[str]
    dimensions: ClassVar[tuple[int, ...]] = (2, 3)
    registry: ClassVar[dict[str, type[Obstacle]]] = {}

    direction: NonzeroVector | None = None
    """from the body towards the obstacle, of any length: gaps are measured along it; by default to the nearest point"""
    displacement: Vector | None = None
    """by which the obstacle is moved from where it is described, m"""
    force: NonzeroVector | None = None
    """instead of a displacement: the force that presses it, N/m in 2D, N in 3D; it slides along it until contact bears
    it, and does not turn"""

    @classmethod
    def __pydantic_init_subclass__(cls, **kwargs: Any) -> None:
        super().__pydantic_init_subclass__(**kwargs)
        if "shape" in cls.__dict__:
            enter(Obstacle.registry, cls, cls.shape, "obstacle")

    @model_validator(mode="after")
    def _moved_in_one_way(self) -> Obstacle:
        if self.force is not None and self.displacement is not None:
            raise refusal("an obstacle is moved by a displacement or pressed by a force; give one of them")
        return self

    def check(self, dimension: int) -> None:
        """Refuse vectors of the wrong length.

        Raises:
            InputError: with what is wanted.
        """
        if dimension not in self.dimensions:
            raise InputError(f'contact.obstacle: shape = "{self.shape}" needs {self.dimensions[0]}D')
        for key, vector in self._vectors().items():
            require_components(vector, dimension, f"contact.obstacle.{key}")

    def _vectors(self) -> dict[str, tuple[float, ...]]:
        """Its vectors by key."""
        return {key: value for key, value in self if isinstance(value, tuple)}

    def moved(self, way: float) -> Obstacle:
        """The obstacle that a force presses, moved along it, and held there.

        Args:
            way: m.
        """
        assert self.force is not None
        along = tuple(map(float, way * unit(self.force)))
        return self.model_copy(update={"force": None, "displacement": along})

    @property
    def moves_straight(self) -> bool:
        """Whether gaps change in proportion to the way it is moved, and no direction changes."""
        moves = self.displacement or self.force
        if moves is None or self.direction is None:
            return moves is None
        move, way = np.asarray(moves), unit(self.direction)
        return bool(np.linalg.norm(move - (move @ way) * way) <= ROUNDING * np.linalg.norm(move))

    @abstractmethod
    def nearest(self, points: Array) -> tuple[Array, Array]:
        """The distances to the nearest points, negative inside, and the unit vectors towards these, (m, d)."""

    @abstractmethod
    def ahead(self, points: Array, direction: Array) -> Array:
        """The distances along a direction; NaN where the obstacle is not met.

        Args:
            points: (m, d).
            direction: unit vector, (d,).
        """

    @property
    def constant(self) -> tuple[float, ...] | None:
        """The unit vector towards it, where that is the same for all points."""
        return None if self.direction is None else tuple(map(float, unit(self.direction)))

    def gap(self, points: Array) -> Array:
        """The distances of points from where it has been moved."""
        points = self._seen(points)
        return self.nearest(points)[0] if self.direction is None else self.ahead(points, unit(self.direction))

    def towards(self, points: Array) -> Array:
        """The unit vectors along which gaps are measured, (m, d)."""
        if self.constant is not None:
            return np.tile(self.constant, (len(points), 1))
        return self.nearest(self._seen(points))[1]

    def _seen(self, points: Array) -> Array:
        return points if self.displacement is None else points - self.displacement

    def lower(self) -> SpatialValue:
        """The lower bound of the opening that it makes: its distance, with the other sign."""
        text = f"-(distance from the obstacle ({self.shape}))"
        dimension = len(next(iter(self._vectors().values())))
        return Computed(text, lambda points: -self.gap(points[:, :dimension]))

    def bounds(self) -> NormalBounds:
        """The bounds that it makes, with what moves or presses it."""
        move = force = None
        if self.displacement is not None:
            before = self.model_copy(update={"displacement": None}).lower()
            move = ObstacleMotion(self.displacement, before, self.moves_straight)
        if self.force is not None:
            force = ObstacleMotion(self.force, self.moved(1.0).lower(), self.moves_straight)
        return NormalBounds(lower=self.lower(), upper=None, towards=self, move=move, force=force)

    def table(self, context: Any = None) -> dict[str, Any]:
        """What a scene would write.

        Args:
            context: has the folder that the scene is written into.
        """
        keys = self.model_dump(mode="json", exclude_none=True, exclude_defaults=True, context=context)
        return {"shape": self.shape, **keys}


class Plane(Obstacle):
    """A plane, behind which the obstacle is."""

    shape = "plane"
    point: Vector
    """a point of its surface, m"""
    normal: NonzeroVector
    """its normal, towards the body; of any length"""

    def nearest(self, points: Array) -> tuple[Array, Array]:
        """Along its normal."""
        normal = unit(self.normal)
        distance = (points - self.point) @ normal
        return distance, np.broadcast_to(0.0 - normal, points.shape)

    def ahead(self, points: Array, direction: Array) -> Array:
        """NaN where the direction leads away from it."""
        steep = float(-unit(self.normal) @ direction)
        return self.nearest(points)[0] / (steep if steep > 0.0 else math.nan)

    @property
    def moves_straight(self) -> bool:
        """A plane does."""
        return True

    @property
    def constant(self) -> tuple[float, ...] | None:
        """Against its normal, unless a direction is given."""
        return super().constant or tuple(map(float, 0.0 - unit(self.normal)))


class _Round(Obstacle):
    """All points up to a distance from a centre, or beyond it."""

    center: Vector
    """its centre, m"""
    radius: Positive
    """m"""
    hollow: bool = False
    """whether the body is inside of it, as in a bearing"""

    @abstractmethod
    def across(self, vectors: Array) -> Array:
        """The components of vectors (m, d) that count for the distance from the centre."""

    def nearest(self, points: Array) -> tuple[Array, Array]:
        away = self.across(points - self.center)
        length = np.linalg.norm(away, axis=1)
        out = np.divide(away, length[:, None], out=np.full_like(away, np.nan), where=length[:, None] > 0.0)
        return (self.radius - length, out) if self.hollow else (length - self.radius, -out)

    def ahead(self, points: Array, direction: Array) -> Array:
        away, along = self.across(points - self.center), self.across(direction[None])[0]
        square, middle = float(along @ along), away @ along
        with np.errstate(all="ignore"):
            length = np.linalg.norm(away, axis=1)
            root = np.sqrt(middle**2 - square * (length - self.radius) * (length + self.radius))
            return (-middle + (root if self.hollow else -root)) / square


class Sphere(_Round):
    """A ball; in the plane a cylinder across it."""

    shape = "sphere"

    def across(self, vectors: Array) -> Array:
        """All of them."""
        return vectors


class Cylinder(_Round):
    """A cylinder without ends, in space."""

    shape = "cylinder"
    dimensions = (3,)
    axis: NonzeroVector
    """along it; of any length"""

    def across(self, vectors: Array) -> Array:
        """Those across the axis."""
        axis = unit(self.axis)
        return vectors - (vectors @ axis)[:, None] * axis


class TriangulatedSurface(Obstacle):
    """A surface of triangles from a file, in space; the gap is measured along `direction`, which it needs."""

    shape = "surface"
    dimensions = (3,)
    file: ExistingFile
    """an STL file, relative to the scene file; its triangles face the body"""
    scale: Positive = 1.0
    """length in m of one unit of the coordinates in the file: 1e-3 for a surface in mm"""

    @model_validator(mode="after")
    def _along(self) -> TriangulatedSurface:
        if self.direction is None:
            raise refusal('shape = "surface" needs a direction, from the body towards it: direction = [0, 0, -1]')
        try:
            surface_file.triangles(self.file, self.file.stat().st_mtime_ns)
        except InputError as error:
            raise refusal(str(error)) from None
        return self

    def nearest(self, points: Array) -> tuple[Array, Array]:
        """Never asked: it has a direction."""
        raise NotImplementedError

    def ahead(self, points: Array, direction: Array) -> Array:
        """By its triangles that face the body."""
        return self.scale * surface_file.distances_along(self.file, points / self.scale, direction)


def _obstacle(value: Any, info: ValidationInfo) -> Obstacle:
    """The obstacle of a table, or of a point and a normal.

    Args:
        value: what a scene has, or an obstacle.
        info: its context has the folder of the scene.
    """
    if isinstance(value, list) and len(value) == 2:
        value = {"point": value[0], "normal": value[1]}
    found: Obstacle = choose(value, "shape", Obstacle.registry, info.context, Plane.shape)
    return found


ObstacleField = Annotated[Obstacle, BeforeValidator(_obstacle), PlainSerializer(lambda o, info: o.table(info.context))]
"""An obstacle as a field of a scene."""


MEASURED = "measured"
"""The gap between two bodies is the distance of their sides as they are meshed."""
Gap = Annotated[
    SpatialValue | Literal["measured"],
    BeforeValidator(lambda value: value if isinstance(value, str) and value == MEASURED else as_value(value)),
    PlainSerializer(lambda gap: gap if isinstance(gap, str) else gap.source),
]
"""A number, a formula in x, y, z (SI), or "measured"."""


class Contact(Effect):
    """Unilateral contact, gap - u·n ≥ 0, or bilateral contact, lower ≤ -u·n ≤ upper, at every vertex; n points outward.

    With an obstacle n is the direction towards it, and the gap the distance to it.
    """

    key = "contact"
    place = Place.BOUNDARY
    exclusive = True
    bounds_normal = True
    on_interfaces = True
    drive = Drive.KINEMATIC
    term = "K: gap - u·n ≥ 0 on Γc, or lower ≤ -u·n ≤ upper"

    gap: Gap | None = None
    """unilateral contact: how far the body may move outward, m, a number or a formula in x, y, z; between two bodies
    also "measured", the distance of their sides as they are meshed"""
    lower: FormulaField | None = None
    """bilateral contact, instead of `gap`: the smallest opening -u·n, m, a number or a formula"""
    upper: FormulaField | None = None
    """bilateral contact, with `lower`: the largest opening -u·n, m, a number or a formula"""

    direction: NonzeroVector | None = None
    """with `gap`: from the body towards the obstacle, of any length; stands for the outward normal"""
    obstacle: ObstacleField | None = None
    """instead of `gap`: a flat obstacle near a curved part, { point = [0, 0], normal = [0, 1] }, or one of another
    `shape`: see docs/obstacles.md"""

    @from_python
    def __init__(
        self,
        side: Sides,
        gap: Value | None = None,
        lower: Value | None = None,
        upper: Value | None = None,
        obstacle: tuple[Sequence[float], Sequence[float]] | Mapping[str, Any] | None = None,
        direction: Sequence[float] | None = None,
    ) -> None:
        ways = {"gap": gap, "lower": lower, "upper": upper, "obstacle": obstacle}
        given = {key: value for key, value in ways.items() if value is not None} or {"gap": 0.0}
        self._make(side, **given, direction=direction)

    @model_validator(mode="after")
    def _one_way(self) -> Contact:
        ways = [w is not None for w in (self.gap, self.lower, self.obstacle)]
        if sum(ways) != 1 or (self.lower is None) != (self.upper is None):
            raise refusal(
                "needs one of gap = 0.0, both lower and upper, or obstacle = { point = [...], normal = [...] }"
            )
        if self.direction is not None and not isinstance(self.gap, SpatialValue):
            raise refusal("direction goes with a gap that is a number or a formula")
        ends = [f.source for f in (self.lower, self.upper) if f is not None and f.is_number]
        if len(ends) == 2 and ends[0] > ends[1]:  # type: ignore[operator]
            raise refusal(f"lower = {ends[0]:g} is above upper = {ends[1]:g}; swap them")
        return self

    def stress_scale(self, largest: Evaluate, sizes: BodySizes) -> float:
        """The stress of an obstacle's force, or of the largest displacement that is demanded, over the length."""
        bounds = self._bounds()
        demanded = [bounds.lower] if bounds.lower else []
        demanded += [bounds.upper.negative()] if bounds.upper else []
        strained = max(largest(value.positive_part()) for value in demanded) * sizes.modulus / sizes.length
        force = self.obstacle.force if self.obstacle is not None else None
        pressed = 0.0 if force is None else math.hypot(*force) / sizes.length ** (len(force) - 1)
        return max(strained, pressed)

    def displaces_obstacle(self) -> bool:
        """Whether its obstacle has a displacement."""
        return self.obstacle is not None and self.obstacle.displacement is not None

    def obstacle_moved(self, way: float) -> Contact:
        """With the obstacle, if a force presses it, moved by so much, m."""
        if self.obstacle is None or self.obstacle.force is None:
            return self
        return self.model_copy(update={"obstacle": self.obstacle.moved(way)})

    def contribute(self, context: FormContext, where: str | None) -> Contribution:
        """The bounds on the normal displacement."""
        return Contribution(bounds=(self._bounds(),))

    def _bounds(self) -> NormalBounds:
        if self.obstacle is not None:
            return self.obstacle.bounds()
        if isinstance(self.gap, str):
            return NormalBounds(lower=Formula(0.0), upper=None, measured=True)
        towards = None
        if (along := self.direction) is not None:
            towards = Plane(point=along, normal=tuple(-c for c in along))
        lower = self.lower if self.gap is None else self.gap.negative()
        return NormalBounds(lower=lower, upper=self.upper, towards=towards)

    def check(self, dimension: int) -> None:
        """Vectors have as many components as the scene has dimensions."""
        if self.obstacle is not None:
            self.obstacle.check(dimension)
        if self.direction is not None:
            require_components(self.direction, dimension, "contact.direction")
