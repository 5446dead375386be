"""A scene as tables that a study changes: objects, but the solver table as it stands in a file."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from pydantic import ValidationError

from ..laws import smoothing
from ..scene import Scene
from ..scene_model import options_of
from ..schema import input_error
from .setting import Setting

Tables = dict[str, Any]
WIDTHS = ("epsilon", "epsilon_absolute")
"""The two keys of the solver table for the width of the smoothing."""


def tables_of(scene: Scene) -> Tables:
    """The tables of a scene, as far as they are not left to their defaults."""
    given = {key: value for key, value in scene if key in scene.model_fields_set}
    solver = {key: value for key, value in scene.solver if key in scene.solver.model_fields_set}
    return {**given, "solver": solver}


def setting_of(tables: Mapping[str, Any]) -> Setting:
    """The scene of these tables.

    Raises:
        InputError: the tables contradict each other, or its laws cannot be smoothed as they say.
    """
    try:
        scene = Scene.model_validate(tables)
    except ValidationError as error:
        raise input_error(error, Scene) from None
    wanted = scene.solver
    options_of(wanted)
    for law in laws(scene) if wanted.smoothing else ():
        smoothing.create(str(wanted.smoothing), law, epsilon=wanted.epsilon, epsilon_absolute=wanted.epsilon_absolute)
    return Setting(scene)


def laws(scene: Scene) -> list[Any]:
    """The scene's laws."""
    return [law for placed in scene.effects() for law in placed.effect.superpotentials()]


def with_solver(tables: Mapping[str, Any], **values: Any) -> Tables:
    """The tables with other values in the solver table.

    Args:
        tables: of a scene.
        values: by key.
    """
    return {**tables, "solver": {**tables.get("solver", {}), **values}}


def without(tables: Mapping[str, Any], *keys: str) -> Tables:
    """The tables without some keys of the solver table.

    Args:
        tables: of a scene.
        keys: of the solver table.
    """
    return {**tables, "solver": {k: v for k, v in tables.get("solver", {}).items() if k not in keys}}


def unsmoothed(tables: Mapping[str, Any]) -> Tables:
    """The tables with the exact law."""
    return without(tables, "smoothing", *WIDTHS)


def smooths(tables: Mapping[str, Any]) -> bool:
    """Whether the tables name a width of the smoothing."""
    return any(key in tables.get("solver", {}) for key in WIDTHS)
