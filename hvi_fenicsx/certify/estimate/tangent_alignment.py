"""Components along tangents that jump from one node of a facet to the next, as components along nearly equal ones.

The tangents of files are fixed by the axes of space (:func:`.geometry.tangents`). On a curved part they change
their sign, in space their direction, between two nodes; a component that is interpolated there means nothing.
"""

from __future__ import annotations

import numpy as np

from ...problem.contact_surface import Surface
from ...typing import Array, Integers


def rotations(directions: Array, reference: Integers | int = 0) -> Array:
    """Matrices R of the nodes of facets, (f, n, k, k).

    Components c along a node's directions are Rᵀc along those of one node of the facet. Only tangents are turned, the
    last d - 1 directions at most; a normal stays the node's own.

    Args:
        directions: of the nodes of facets, unit vectors, (f, n, k, d).
        reference: the node of each facet whose tangents the others get, (f,), or the same for all.
    """
    count, d = directions.shape[2:]
    turned = slice(max(count - d + 1, 0), None)
    tangents = directions[:, :, turned]
    one = tangents[np.arange(len(tangents)), reference][:, None]
    left, _, right = np.linalg.svd(tangents @ np.swapaxes(one, 2, 3))
    result = np.tile(np.eye(count), (*directions.shape[:2], 1, 1))
    result[:, :, turned, turned] = left @ right
    return result


def turned(rotations: Array, values: Array) -> Array:
    """The components along the directions of one node of each facet, (f, n, k, ...).

    Args:
        rotations: R, (f, n, k, k).
        values: the components along each node's own directions, or these directions, (f, n, k, ...).
    """
    return np.asarray(np.einsum("fnkl,fnk...->fnl...", rotations, values))


def turned_back(rotations: Array, values: Array) -> Array:
    """The components along each node's own directions, (f, n, k).

    Args:
        rotations: R, (f, n, k, k).
        values: the components along the directions of one node of each facet, (f, n, k).
    """
    return np.asarray(np.einsum("fnkl,fnl->fnk", rotations, values))


def frames(surface: Surface) -> Array:
    """Normal and tangents of the nodes of a part, (m, d, d).

    Args:
        surface: the part.
    """
    return np.concatenate([surface.normals[:, None], surface.tangents], axis=1)


def rotations_between(one: Array, other: Array) -> Array:
    """The rotations that take unit vectors to others the shortest way, (..., d, d); these must not be opposite.

    Args:
        one: unit vectors, (..., d).
        other: unit vectors, (..., d).
    """
    both, cosine = one + other, np.sum(one * other, axis=-1)[..., None, None]
    bent = both[..., :, None] * both[..., None, :] / (1.0 + cosine)
    return np.asarray(np.eye(one.shape[-1]) - bent + 2.0 * other[..., :, None] * one[..., None, :])
