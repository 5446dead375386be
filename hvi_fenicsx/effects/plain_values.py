"""Effects that a scene file writes without a table: as one value, or as a list."""

from __future__ import annotations

from typing import Any

from pydantic import SerializerFunctionWrapHandler, model_serializer, model_validator
from typing_extensions import override

from ..schema import refusal
from .base import Effect
from .formula_field import FormulaField, require_components


class OneValue(Effect):
    """An effect that is one number or formula: ``pressure = 1e5``."""

    value: FormulaField

    @model_validator(mode="before")
    @classmethod
    def _from_value(cls, data: Any) -> Any:
        return data if isinstance(data, cls | dict) else {"value": data}

    @model_serializer(mode="wrap")
    def _as_value(self, handler: SerializerFunctionWrapHandler) -> Any:
        return handler(self)["value"]


class Listed(Effect):
    """An effect that is a list, one entry for each component: ``traction = [1e6, 0]``."""

    values: tuple[Any, ...]

    @model_validator(mode="before")
    @classmethod
    def _from_list(cls, data: Any) -> Any:
        if isinstance(data, cls) or (isinstance(data, dict) and "values" in data):
            return data
        return {"values": cls._entries(data)}

    @classmethod
    def _entries(cls, data: Any) -> tuple[Any, ...]:
        if isinstance(data, list | tuple):
            return tuple(data)
        raise refusal("must be a list, one entry for each component, like [1e6, 0.0]")

    @model_serializer(mode="wrap")
    def _as_list(self, handler: SerializerFunctionWrapHandler) -> Any:
        return list(handler(self)["values"])

    @override
    def check(self, dimension: int) -> None:
        """As many components as the scene has dimensions."""
        require_components(self.values, dimension, self.key)
