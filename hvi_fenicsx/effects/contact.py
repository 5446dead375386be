"""Contact: unilateral with a gap (paper: K), or bilateral within a slot."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, ClassVar, Literal

import numpy as np
from pydantic import BeforeValidator, PlainSerializer, model_validator
from typing_extensions import override

from ..formula import Formula, SpatialValue
from ..schema import refusal
from ..typing import Array
from .base import BodySizes, Drive, Effect, Evaluate, FormContext, Place, Sides, from_python
from .contribution import Contribution, NormalBounds, ObstacleForce, ObstacleMove
from .obstacles import NonzeroVector, Obstacle, ObstacleField, ObstacleGap, unit
from .values import FormulaField, Value, as_value, require_components

MEASURED = "measured"
"""The gap between two bodies is the distance of their sides as they are meshed."""
Gap = Annotated[
    SpatialValue | Literal["measured"],
    BeforeValidator(lambda value: value if isinstance(value, str) and value == MEASURED else as_value(value)),
    PlainSerializer(lambda gap: gap if isinstance(gap, str) else gap.source),
]
"""A number, a formula in x, y, z (SI), or "measured"."""


def _move(obstacle: Obstacle) -> ObstacleMove | None:
    """The displacement of an obstacle, where it has one."""
    if obstacle.displacement is None:
        return None
    before = ObstacleGap(obstacle.unmoved).negative()
    return ObstacleMove(vector=obstacle.displacement, before=before, straight=obstacle.moves_straight)


def _force(obstacle: Obstacle) -> ObstacleForce | None:
    """The force that presses an obstacle, where there is one."""
    if obstacle.force is None:
        return None
    ahead = ObstacleGap(obstacle.moved(1.0)).negative()
    return ObstacleForce(vector=obstacle.force, ahead=ahead, straight=obstacle.moves_straight)


@dataclass(frozen=True)
class _Straight:
    """One direction, stated by itself."""

    constant: tuple[float, ...]

    def towards(self, points: Array) -> Array:
        """The same everywhere."""
        return np.tile(self.constant, (len(points), 1))


class Contact(Effect):
    """Unilateral contact, gap - u·n ≥ 0, or bilateral contact, lower ≤ -u·n ≤ upper, at every vertex; n points outward.

    With an obstacle n is the direction towards it, and the gap the distance to it.
    """

    key: ClassVar[str] = "contact"
    place: ClassVar[Place] = Place.BOUNDARY
    exclusive: ClassVar[bool] = True
    bounds_normal: ClassVar[bool] = True
    on_interfaces: ClassVar[bool] = True
    drive: ClassVar[Drive] = Drive.KINEMATIC
    term: ClassVar[str] = "K: gap - u·n ≥ 0 on Γc, or lower ≤ -u·n ≤ upper"

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

    @override
    def stress_scale(self, largest: Evaluate, sizes: BodySizes) -> float:
        """The stress of an obstacle's force, or of the largest displacement that is demanded, over the length."""
        bounds = self._bounds()
        demanded = [bounds.lower] if bounds.lower else []
        demanded += [bounds.upper.negative()] if bounds.upper else []
        strained = max(largest(value.positive_part()) for value in demanded) * sizes.modulus / sizes.length
        force = self.obstacle.force if self.obstacle is not None else None
        pressed = 0.0 if force is None else math.hypot(*force) / sizes.length ** (len(force) - 1)
        return max(strained, pressed)

    @override
    def displaces_obstacle(self) -> bool:
        return self.obstacle is not None and self.obstacle.displacement is not None

    @override
    def obstacle_moved(self, way: float) -> Contact:
        """With the obstacle, if a force presses it, moved by so much, m."""
        if self.obstacle is None or self.obstacle.force is None:
            return self
        return self.model_copy(update={"obstacle": self.obstacle.moved(way)})

    @override
    def contribute(self, context: FormContext, where: str | None) -> Contribution:
        """The bounds on the normal displacement."""
        return Contribution(bounds=(self._bounds(),))

    def _bounds(self) -> NormalBounds:
        if self.obstacle is not None:
            least = ObstacleGap(self.obstacle).negative()
            move, force = _move(self.obstacle), _force(self.obstacle)
            return NormalBounds(lower=least, upper=None, towards=self.obstacle, move=move, force=force)
        if isinstance(self.gap, str):
            return NormalBounds(lower=Formula(0.0), upper=None, measured=True)
        towards = _Straight(tuple(map(float, unit(self.direction)))) if self.direction is not None else None
        lower = self.lower if self.gap is None else self.gap.negative()
        return NormalBounds(lower=lower, upper=self.upper, towards=towards)

    @override
    def files(self) -> tuple[Path, ...]:
        """The obstacle's."""
        return () if self.obstacle is None else self.obstacle.files()

    @override
    def check(self, dimension: int) -> None:
        """Vectors have as many components as the scene has dimensions."""
        if self.obstacle is not None:
            self.obstacle.check(dimension)
        if self.direction is not None:
            require_components(self.direction, dimension, "contact.direction")
