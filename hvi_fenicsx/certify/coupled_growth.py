"""The least growth where a law of a length on a kink couples the components of its vertex, by directions tried."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ..laws import Length
from ..typing import Array, Entities, Integers, Mask

_DIRECTIONS = 256
"""How many directions are tried where components are coupled, beside that of steepest descent."""


@dataclass(frozen=True)
class CoupledVertices:
    """The terms c δ(B v) of one law of a length at vertices on its kinks.

    Attributes:
        blocks: the vertices, (m,).
        factors: c, (m,).
        rows: B, (m, q, d).
        length: δ.
    """

    blocks: Entities
    factors: Array
    rows: Array
    length: Length


@dataclass(frozen=True)
class _Bend:
    """One term c δ(B v) at one vertex.

    Attributes:
        factor: c.
        rows: B, (q, d), or its columns of some components.
        length: δ.
    """

    factor: float
    rows: Array
    length: Length

    def value(self, v: Array) -> Array:
        """The term at directions v (p, d), (p,)."""
        return self.factor * self.length.of(v @ self.rows.T)


@dataclass(frozen=True)
class SideSlopes:
    """The growth by components, by scalar dof, (n,) each.

    Attributes:
        up: in the positive direction; infinite where that is not admissible.
        down: in the negative direction, likewise.
        jump: the sum of both, of the laws.
    """

    up: Array
    down: Array
    jump: Array


def coupled(couplings: Sequence[CoupledVertices], sides: SideSlopes, d: int) -> Iterator[tuple[Integers, float, float]]:
    """For each vertex with couplings: the components that they touch, their least growth, and that of a pair.

    Args:
        couplings: the terms.
        sides: the growth without them.
        d: the dimension.
    """
    at: dict[int, list[_Bend]] = {}
    for one in couplings:
        for i, block in enumerate(one.blocks):
            at.setdefault(int(block), []).append(_Bend(float(one.factors[i]), one.rows[i], one.length))
    for vertex, bends in at.items():
        moved = np.flatnonzero(np.any(np.vstack([b.rows for b in bends]) != 0.0, axis=0))
        dofs = vertex * d + moved
        here = SideSlopes(sides.up[dofs], sides.down[dofs], sides.jump[dofs])
        yield dofs, *_least(here, [replace(b, rows=b.rows[:, moved]) for b in bends])


def _least(sides: SideSlopes, bends: list[_Bend]) -> tuple[float, float]:
    """The least growth of coupled components over their admissible directions, and of opposite ones together."""
    up, down = sides.up, sides.down
    v = _admissible(np.vstack([_steepest(up, down), _sphere(len(up))]), np.isfinite(up), np.isfinite(down))
    ahead, behind = (np.sum([b.value(side) for b in bends], axis=0) for side in (v, -v))
    one_way = np.where(v > 0, np.where(np.isfinite(up), up, 0.0), np.where(np.isfinite(down), down, 0.0))
    both = np.all((v == 0.0) | (np.isfinite(up) & np.isfinite(down)), axis=1)
    rises = np.sum(one_way * np.abs(v), axis=1) + ahead
    pairs = np.abs(v) @ sides.jump + ahead + behind
    return float(np.min(rises, initial=np.inf)), float(np.min(pairs[both], initial=np.inf))


def _steepest(up: Array, down: Array) -> Array:
    """The direction of steepest descent without the coupling."""
    with np.errstate(invalid="ignore"):  # both infinite: the next line
        middle = (down - up) / 2
    found = np.where(np.isfinite(up) & np.isfinite(down), middle, np.where(np.isfinite(up), -up, down))
    return np.where(np.isfinite(found), found, 0.0)


def _admissible(directions: Array, up: Mask, down: Mask) -> Array:
    """Unit directions (q, k) without the components that are not admissible; those left empty are left out."""
    v = np.where(((directions > 0) & ~up) | ((directions < 0) & ~down), 0.0, directions)
    length = np.linalg.norm(v, axis=1)
    return np.asarray(v[length > 0.0] / length[length > 0.0, None])


def _sphere(k: int) -> Array:
    """Directions spread over the sphere in k = 1, 2 or 3 dimensions, the axes among them."""
    axes = np.vstack([np.eye(k), -np.eye(k)])
    if k == 1:
        return axes
    turns = np.arange(_DIRECTIONS) * (np.pi * (3.0 - np.sqrt(5.0)))
    height = np.zeros(_DIRECTIONS) if k == 2 else 1.0 - (2.0 * np.arange(_DIRECTIONS) + 1.0) / _DIRECTIONS
    circle = np.sqrt(1.0 - height**2)
    spread = np.column_stack([circle * np.cos(turns), circle * np.sin(turns), height])
    return np.vstack([axes, spread[:, :k]])
