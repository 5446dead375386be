"""Laws by name, from plain data such as a scene file's table; and checks of the numbers that they are made of."""

from __future__ import annotations

import inspect
import json
import sys
from collections.abc import Mapping
from numbers import Real
from typing import Any, get_type_hints

from pydantic import ConfigDict, ValidationError, create_model

from ..class_registry import hint
from ..errors import InputError, of_user
from .base import Superpotential, registered

_STRICT = ConfigDict(strict=True, extra="forbid", allow_inf_nan=False, arbitrary_types_allowed=True)


_FOLLOWS_PRESSURE = ("coulomb", "amontons", "mohr_coulomb")
"""Names of friction laws in which the friction follows the contact pressure."""


def available() -> tuple[str, ...]:
    """Names of all laws, the user's own among them."""
    return tuple(registered())


@of_user("law")
def create(name: str, parameters: Mapping[str, Any]) -> Superpotential:
    """The law `name` with the given parameters, checked as strictly as a scene file's.

    Integers serve as floats; strings, booleans, infinities and unknown parameters do not.

    Args:
        name: of the law.
        parameters: by name, as plain data.

    Raises:
        InputError: with what is allowed, and the closest match of a misspelt name.
    """
    law = registered().get(name)
    if law is None and name.lower() in _FOLLOWS_PRESSURE:
        raise InputError(
            f"law {name!r}: a friction that grows with the contact pressure is no derivative of an energy, so it has "
            'no place in a hemivariational inequality. Use the friction of a known pressure p: law = "tresca" with '
            "the traction μ p"
        )
    if law is None:
        raise InputError(f"unknown law {name!r}{hint(name, available())}; available: {', '.join(available())}")
    allowed = inspect.signature(law).parameters
    _check_keys(name, parameters, allowed)
    return law(**_checked(law, parameters, allowed))


def describe(law: Superpotential) -> dict[str, Any]:
    """The table of a scene file that `create` makes this law from: its name and parameters, as plain data."""
    parameters = {key: getattr(law, key) for key in inspect.signature(type(law)).parameters}
    return {"law": law.name} | json.loads(json.dumps({k: v for k, v in parameters.items() if v is not None}))


def _check_keys(name: str, given: Mapping[str, Any], allowed: Mapping[str, inspect.Parameter]) -> None:
    listing = f"law {name!r} takes {', '.join(allowed) or 'no parameters'}"
    for key in given:
        if key not in allowed:
            raise InputError(f"law {name!r}: unknown parameter {key!r}{hint(key, allowed)}; {listing}")
    missing = [key for key, p in allowed.items() if p.default is p.empty and key not in given]
    if missing:
        raise InputError(f"law {name!r}: {', '.join(missing)} missing; {listing}")


def _checked(
    law: type[Superpotential], given: Mapping[str, Any], allowed: Mapping[str, inspect.Parameter]
) -> dict[str, Any]:
    """The given values in the types that the law's constructor declares."""
    hints = get_type_hints(law.__init__)
    fields: dict[str, Any] = {key: (hints.get(key, Any), ...) for key in allowed if key in given}
    model = create_model(law.__name__, __config__=_STRICT, **fields)
    try:
        # As JSON, strict means what a scene file means by it: a list is a tuple, an integer is a float.
        checked = model.model_validate_json(json.dumps(dict(given), default=_plain))
    except ValidationError as error:
        raise InputError(_message(law.name, error)) from error
    return {key: getattr(checked, key) for key in fields}


def _plain(value: Any) -> Any:
    """Numpy's numbers and arrays, and tomlkit's wrappers, as plain data."""
    if hasattr(value, "tolist"):
        return value.tolist()
    raise InputError(f"{value!r} is not plain data; give numbers, booleans, strings or lists of them")


def _message(name: str, error: ValidationError) -> str:
    """One line for the first thing that is wrong."""
    first = error.errors()[0]
    where = "".join(f"[{part}]" if isinstance(part, int) else str(part) for part in first["loc"])
    return f"law {name!r}: {where} = {first['input']!r} is not usable: {first['msg']}"


def require_number(owner: str, **parameters: Any) -> None:
    """Refuse anything but finite real numbers.

    Args:
        owner: whose they are, for the message: ``law 'tresca'``.
        parameters: by name.

    Raises:
        InputError: with the first that is none.
    """
    for key, value in parameters.items():
        if isinstance(value, bool) or not isinstance(value, Real) or not abs(value) <= sys.float_info.max:  # type: ignore[operator]
            raise InputError(f"{owner}: {key} = {value!r} is not usable; give a finite number")


def require_positive(owner: str, **parameters: object) -> None:
    """Refuse anything but finite numbers > 0.

    Args:
        owner: whose they are, for the message: ``law 'tresca'``.
        parameters: by name.

    Raises:
        InputError: with the first that is none.
    """
    require_number(owner, **parameters)
    for key, value in parameters.items():
        if not float(value) > 0.0:  # type: ignore[arg-type]
            raise InputError(f"{owner}: {key} = {value!r} must be > 0; give its magnitude")


def require_ordered(owner: str, **parameters: float) -> None:
    """Refuse a residual below 0 or above the peak.

    Args:
        owner: whose they are, for the message: ``law 'tresca'``.
        parameters: the residual and the peak, in this order, by name.

    Raises:
        InputError: they are not 0 ≤ residual ≤ peak, peak > 0.
    """
    require_number(owner, **parameters)
    (low_name, low), (high_name, high) = parameters.items()
    if not 0.0 <= low <= high or high == 0.0:
        raise InputError(
            f"{owner}: {low_name} = {low!r} and {high_name} = {high!r} do not fit; "
            f"allowed is 0 <= {low_name} <= {high_name} with {high_name} > 0"
        )
