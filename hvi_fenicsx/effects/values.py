"""What effects are given by: values in space, one by one or as a list, and effects that are nothing else."""

from __future__ import annotations

import sys
from typing import Annotated, Any, Self

from pydantic import BeforeValidator, PlainSerializer, SerializerFunctionWrapHandler, model_serializer, model_validator
from typing_extensions import override

from ..errors import InputError
from ..formula import Formula, SpatialValue
from ..schema import refusal
from .base import Effect

Value = Any
"""A number, a formula in x, y, z, a Python function of x (3, n), a scalar UFL expression or fem.Function; SI."""
Vector = Any
"""A list of values, one for each component; or a Python function with values (d, n), a UFL vector, a fem.Function."""


def as_value(given: Any) -> SpatialValue:
    """A value in space, for a validator.

    Args:
        given: a number, a formula's text, a value already, or from Python a function or UFL.

    Raises:
        PydanticCustomError: it is none of these.
    """
    try:
        if isinstance(given, SpatialValue):
            return given
        return _of_python(given) if callable(given) or _is_ufl(given) else Formula(given)
    except InputError as error:
        raise refusal(str(error)) from None


def _is_ufl(given: Any) -> bool:
    ufl = sys.modules.get("ufl")  # a scene is read without it
    return ufl is not None and isinstance(given, ufl.core.expr.Expr)


def _of_python(given: Any) -> SpatialValue:
    from . import python_values

    return python_values.expression(given) if _is_ufl(given) else python_values.PythonFunction(given)


FormulaField = Annotated[SpatialValue, BeforeValidator(as_value), PlainSerializer(lambda f: f.source)]
"""A number or a formula in x, y, z (SI), as a field of an effect."""


def require_components(formulas: tuple[Any, ...], dimension: int, key: str) -> None:
    """Refuse a vector of the wrong length.

    Args:
        formulas: its components.
        dimension: how many there must be.
        key: its name in the message.

    Raises:
        InputError: with the number of components wanted.
    """
    if len(formulas) != dimension:
        raise InputError(f"{key} has {len(formulas)} components; in {dimension}D it has {dimension}")


class Bare(Effect):
    """An effect of one field, which a scene writes without its name: ``pressure = 1e5``, ``traction = [1e6, 0]``."""

    @model_validator(mode="before")
    @classmethod
    def _from_bare(cls, data: Any) -> Any:
        (name,) = cls.model_fields
        if isinstance(data, cls):
            return data
        return {name: cls._read(data[name] if isinstance(data, dict) and name in data else data)}

    @classmethod
    def _read(cls, data: Any) -> Any:
        return data

    @model_serializer(mode="wrap")
    def _as_bare(self, handler: SerializerFunctionWrapHandler) -> Any:
        (found,) = handler(self).values()
        return found


class OneValue(Bare):
    """An effect that is one number or formula: ``pressure = 1e5``."""

    value: FormulaField


class Listed(Bare):
    """An effect that is a list, one entry for each component: ``traction = [1e6, 0]``."""

    values: tuple[Any, ...]

    @override
    @classmethod
    def _read(cls, data: Any) -> Any:
        if isinstance(data, list | tuple):
            return tuple(data)
        if callable(data) or _is_ufl(data):
            from . import python_values

            return python_values.components(data)
        raise refusal("must be a list, one entry for each component, like [1e6, 0.0]")

    @override
    def fitted(self, dimension: int) -> Self:
        """With the components of a function that gives them all."""
        given = self.values[0] if len(self.values) == 1 else None
        parts = getattr(given, "components", None)
        return self if parts is None else self.model_copy(update={"values": parts(dimension)})

    @override
    def check(self, dimension: int) -> None:
        """As many components as the scene has dimensions."""
        require_components(self.values, dimension, self.key)
