"""Forces divided among carriers: against points whose nearest sum is known in closed form."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from hvi_fenicsx.certify.force_attribution import Carrier, nearest_sum
from hvi_fenicsx.laws import Length
from hvi_fenicsx.typing import Array

VERTICES = 8
PLANES = {"floor": (0, 1), "wall": (0, 2), "end": (1, 2)}


def disc(plane: str, radius: float) -> Carrier:
    """A law of |u_t| at rest."""
    return _at_rest(PLANES[plane], radius, Length.plain(2))


def bond(radius: float, beta: float) -> Carrier:
    """A law of opening (upward) and slip at rest."""
    return _at_rest((2, 0, 1), radius, Length((1.0, beta, beta), opens=True))


def _at_rest(axes: tuple[int, ...], radius: float, length: Length) -> Carrier:
    rows = np.tile(np.eye(3)[list(axes)], (VERTICES, 1, 1))
    disc = {"axes": rows, "counts": np.ones(rows.shape[:2], dtype=bool), "length": length}
    return _carrier(**disc, radius=np.full((VERTICES, 1), radius), at_rest=np.ones((VERTICES, 1), dtype=bool))


def contact(axis: int) -> Carrier:
    """A bound that pushes against an axis."""
    along = np.tile(np.eye(3)[axis], (VERTICES, 1))
    return _carrier(along=along, low=np.full((VERTICES, 1), -np.inf))


def _carrier(**given: Any) -> Carrier:
    rows, zero = np.arange(VERTICES), np.zeros((VERTICES, 1))
    plain: dict[str, Any] = {"along": np.zeros((VERTICES, 3)), "low": zero, "high": zero, "weights": np.ones(VERTICES)}
    plain |= {"axes": np.zeros((VERTICES, 2, 3)), "counts": np.ones((VERTICES, 2), bool), "length": Length.plain(2)}
    plain |= {"radius": zero, "at_rest": zero > 0, "visible": np.ones((VERTICES, 3), dtype=bool)}
    return Carrier(rows=rows, own=rows, **(plain | given))


def farthest(carriers: list[Carrier], outward: Array) -> Array:
    """The sum of the forces that reach farthest along unit vectors: the only point of the boundary with that normal."""
    total = np.zeros_like(outward)
    for c in carriers:
        along = np.einsum("mke,me->mk", c.axes, outward) * np.array(c.length.factors)
        along[:, 0] = np.maximum(along[:, 0], 0.0) if c.length.opens else along[:, 0]
        length = np.linalg.norm(along, axis=1, keepdims=True)
        unit = np.divide(along, length, out=np.zeros_like(along), where=length > 0) * np.array(c.length.factors)
        total += c.radius * np.einsum("mk,mkd->md", unit, c.axes)
    return total


def directions(*, upward: bool = False) -> Array:
    """Unit vectors, with contact only those that it does not pull against."""
    v = np.random.default_rng(3).normal(size=(VERTICES, 3))
    v[:, 2] = np.abs(v[:, 2]) if upward else v[:, 2]
    return np.asarray(v / np.linalg.norm(v, axis=1)[:, None])


def within(carriers: list[Carrier], forces: list[Array]) -> bool:
    """Whether no law gives more than it can, and no contact pulls."""
    laws = [_gauge(c, f) <= c.radius[:, 0] + 1e-14 for c, f in zip(carriers, forces, strict=True)]
    contacts = [np.all(f == np.minimum(f, 0.0)) for c, f in zip(carriers, forces, strict=True) if not np.any(c.at_rest)]
    return all(np.all(w) for c, w in zip(carriers, laws, strict=True) if np.any(c.at_rest)) and all(contacts)


def _gauge(carrier: Carrier, forces: Array) -> Array:
    """The least traction that can give the forces; infinite if none can."""
    along = np.einsum("mkd,md->mk", carrier.axes, forces) / np.array(carrier.length.factors)
    pushes = carrier.length.opens & (along[:, 0] < 0.0)
    return np.asarray(np.where(pushes, np.inf, np.linalg.norm(along, axis=1)))


SUMS = [
    ([disc("floor", 1.0), disc("wall", 1e-3), contact(2)], True),
    pytest.param([disc("floor", 1.0), disc("wall", 0.5), disc("end", 2.0)], False, marks=pytest.mark.long),
    ([bond(1.0, 3.0), disc("wall", 0.5)], True),
]


@pytest.mark.parametrize(("carriers", "upward"), SUMS)
def test_a_force_at_the_limit_of_all_carriers_is_divided_to_rounding(carriers: list[Carrier], upward: bool) -> None:
    limit = farthest(carriers, directions(upward=upward))
    for inside in (0.0, 1e-9, 1e-5, 0.1):
        forces, left = nearest_sum(carriers, (1.0 - inside) * limit)
        assert np.max(np.abs(left)) < 1e-14
        assert np.allclose(sum(forces), (1.0 - inside) * limit, atol=1e-14)
        assert within(carriers, forces)


@pytest.mark.parametrize(("carriers", "upward"), SUMS)
def test_what_exceeds_all_carriers_is_left_over(carriers: list[Carrier], upward: bool) -> None:
    """At least the distance; at most twice as much, because the last steps are slow there."""
    outward = directions(upward=upward)
    limit = farthest(carriers, outward)
    for beyond in (1e-9, 1e-2):
        _, left = nearest_sum(carriers, limit + beyond * outward)
        sizes = np.linalg.norm(left, axis=1) / beyond
        assert np.min(sizes) > 0.999
        assert np.max(sizes) < 2.0
