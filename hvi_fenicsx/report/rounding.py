"""What is rounding in a result, and is shown as zero."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from ..typing import Array
from .body_mesh import BodyMesh

ROUNDING = 1e-9
"""Values whose largest is so small a part of what is beside them are rounding."""
_STRESSES = ("sigma_n", "friction_t1", "friction_t2")
_DISPLACEMENTS = ("u_n", "u_t1", "u_t2", "gap")


def without_noise(columns: Mapping[str, Array], body: BodyMesh) -> dict[str, Array]:
    """The columns of a contact part; those that are rounding beside others, or beside the body's field, are zero.

    Args:
        columns: by their names, (m,) each.
        body: with the fields that were found.
    """
    kept = dict(columns)
    for names, field in ((_STRESSES, body.von_mises), (_DISPLACEMENTS, body.displacement)):
        own = {name: _largest(kept[name]) for name in names if name in kept}
        least = ROUNDING * max([*own.values(), 0.0 if field is None else _largest(field)], default=0.0)
        kept |= {name: 0.0 * kept[name] for name, largest in own.items() if largest <= least}
    return kept


def unless_noise(value: float, beside: float) -> float:
    """A value; zero where it is rounding.

    Args:
        value: it.
        beside: the largest size of what is beside it.
    """
    return value if abs(value) > ROUNDING * beside else 0.0


def _largest(values: Array) -> float:
    return float(np.nanmax(np.abs(values), initial=0.0))
