"""Places of effects: one side or region of a body, or several that count as one, as in a scene file."""

from __future__ import annotations

from collections.abc import Sequence

from pydantic_core import PydanticCustomError

from ..errors import InputError
from ..schema import names_of, shown

Names = tuple[str, ...]
"""Names of sides or of regions, which are one place."""


def read_names(given: str | Sequence[str]) -> Names:
    """The names that a program gives, read as those of a scene file.

    Args:
        given: a name, or a list of names.

    Raises:
        InputError: it is something else, empty, or has a name twice.
    """
    try:
        return names_of(given)
    except PydanticCustomError as error:
        raise InputError(f"the place {error.message()} (is {shown(given)})") from None
