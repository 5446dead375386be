"""Obstacles as fields of a scene, and the distance from one as a value in space."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Annotated, Any

from pydantic import BeforeValidator, ValidationInfo
from typing_extensions import override

from ..formula import SpatialValue
from ..schema import refusal, unknown
from ..typing import Array
from .obstacles import Obstacle, Plane


class ObstacleGap(SpatialValue):
    """The distance of points from an obstacle, as a value in space."""

    __slots__ = ("_obstacle", "source")

    def __init__(self, obstacle: Obstacle) -> None:
        self._obstacle, self.source = obstacle, f"distance from the obstacle ({obstacle.shape})"

    @override
    def at(self, points: Array) -> Array:
        return self._obstacle.gap(points[:, : self._obstacle.dimension])

    @override
    def in_ufl(self, mesh: Any, number: Callable[[float], Any]) -> Any:
        raise NotImplementedError("bounds are evaluated at vertices")


def read(value: Any, info: ValidationInfo) -> Obstacle:
    """The obstacle of a table.

    Args:
        value: what a scene has, or an obstacle.
        info: its context has the folder of the scene.

    Raises:
        PydanticCustomError: there is no such shape.
        ValidationError: the table does not fit the shape.
    """
    if isinstance(value, Obstacle):
        return value
    if not isinstance(value, Mapping):
        raise refusal("must be a table, like { point = [0, 0], normal = [0, 1] }")
    keys = dict(value)
    name = keys.pop("shape", Plane.shape)
    if not isinstance(name, str) or name not in Obstacle.registry:
        raise refusal(unknown("shape", name, Obstacle.registry))
    return Obstacle.registry[name].model_validate(keys, context=info.context)


ObstacleField = Annotated[Obstacle, BeforeValidator(read)]
"""An obstacle as a field of a scene."""
