"""How far the surface of a half-space gives way to a traction in waves, for any elastic material.

A traction t cos(k m·x) on a half-space with the normal n moves its surface by L⁻¹ t cos(k m·x)/k along t. L is the
tensor of Barnett and Lothe, an integral over the angle in the plane of m and n (T. C. T. Ting: Anisotropic Elasticity,
Oxford 1996, section 7.6). In an isotropic body L is E/(2(1 - ν²)) along m and n (E/2 in plane stress) and μ across that
plane.
"""

from __future__ import annotations

import numpy as np

from ...typing import Array

_ANGLES = 32
"""Angles of the rectangle rule on a periodic integrand; an isotropic material is met to 1e-12."""

_DIRECTIONS = 4
"""Directions of the waves on a surface in space, over which the compliance is averaged."""


def surface_compliance(stiffness: Array, corners: Array) -> Array:
    """Diagonal of L⁻¹, surface displacement by traction for k = 1, along each axis, (f, d).

    Args:
        stiffness: C_ijkl below each facet, (f, d, d, d, d).
        corners: of the facets, (f, d, 3); in space, the mean of all waves along the facet.
    """
    d = corners.shape[1]
    sides = np.asarray((corners[:, 1:] - corners[:, :1])[:, :, :d], dtype=np.float64)
    along = _unit(sides[:, 0])
    normals = (
        np.stack([along[:, 1], -along[:, 0]], axis=1)
        if d == 2
        else _unit(np.asarray(np.cross(along, sides[:, 1]), dtype=np.float64))
    )
    waves = [along]
    if d == 3:
        across, angles = np.cross(normals, along), np.arange(_DIRECTIONS) * np.pi / _DIRECTIONS
        waves = [np.cos(a) * along + np.sin(a) * across for a in angles]
    inverses = np.linalg.inv(np.array([_barnett_lothe(stiffness, wave, normals) for wave in waves]))
    return np.asarray(np.einsum("wfii->fi", inverses) / len(waves))


def _unit(vectors: Array) -> Array:
    return np.asarray(vectors / np.linalg.norm(vectors, axis=1, keepdims=True))


def _barnett_lothe(stiffness: Array, wave: Array, normal: Array) -> Array:
    """L of waves and normals (f, d), (f, d, d)."""
    along, across = (np.einsum("fijkl,fj->fikl", stiffness, one) for one in (wave, normal))
    ww, nw = (np.einsum("fikl,fl->fik", one, wave) for one in (along, across))
    wn, nn = (np.einsum("fikl,fl->fik", one, normal) for one in (along, across))
    angles = (np.arange(_ANGLES) * np.pi / _ANGLES)[:, None, None, None]
    c, s = np.cos(angles), np.sin(angles)  # of m = c wave + s normal, n = c normal - s wave
    q = c * c * ww + c * s * (wn + nw) + s * s * nn
    r = c * c * wn + c * s * (nn - ww) - s * s * nw
    t = c * c * nn - c * s * (wn + nw) + s * s * ww
    return np.asarray(np.mean(q - r @ np.linalg.solve(t, np.swapaxes(r, -1, -2)), axis=0))
