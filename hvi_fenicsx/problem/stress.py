"""Stress tensors of cells: the displacements that tell their components, the tensors, von Mises' stress."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import ufl

from ..typing import Array

COMPONENTS = {2: ((0, 0), (1, 1), (0, 1)), 3: ((0, 0), (1, 1), (2, 2), (1, 2), (0, 2), (0, 1))}
"""The components of stress that the energy knows, by dimension."""


def linear_field(q: Sequence[Any], x: Any) -> Any:
    """The UFL displacement q·x, the entries of the matrix q being those of ``COMPONENTS``, the others zero.

    Args:
        q: its entries, UFL scalars.
        x: the coordinates, a UFL vector.
    """
    d = len(x)
    matrix: list[list[Any]] = [[0.0] * d for _ in range(d)]
    for entry, (i, j) in zip(q, COMPONENTS[d], strict=True):
        matrix[i][j] = entry
    return ufl.dot(ufl.as_matrix(matrix), x)


def tensors(components: Array, across: Array) -> Array:
    """Symmetric tensors, (..., 3, 3).

    Args:
        components: those of ``COMPONENTS``, (..., k).
        across: σ_33 of a plane body, (...); in space it is among the components, and this is not used.
    """
    seen = next(places for places in COMPONENTS.values() if len(places) == components.shape[-1])
    sigma = np.zeros((*across.shape, 3, 3))
    sigma[..., 2, 2] = across
    for number, (i, j) in enumerate(seen):
        sigma[..., i, j] = sigma[..., j, i] = components[..., number]
    return sigma


def von_mises(sigma: Array) -> Array:
    """√(3/2 s:s) of stresses (n, 3, 3) with deviators s, from their components; shape (n,)."""
    first, second, third = (sigma[:, i, i] for i in range(3))
    apart = (first - second) ** 2 + (second - third) ** 2 + (third - first) ** 2
    shear = sigma[:, 0, 1] ** 2 + sigma[:, 1, 2] ** 2 + sigma[:, 0, 2] ** 2
    return np.asarray(np.sqrt(apart / 2 + 3 * shear))
