"""Small problems on unknowns of Γc alone, as arrays, and a judge of their equilibria."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import numpy.typing as npt

from hvi_fenicsx.effects import Direction
from hvi_fenicsx.laws import Graph, Superpotential
from hvi_fenicsx.reduced.condensed_problem import Bonds, CondensedProblem
from hvi_fenicsx.reduced.condensed_stiffness import DenseStiffness

Array = npt.NDArray[np.float64]


def graph(points: Sequence[Sequence[float]], *, one_sided: bool = False) -> Superpotential:
    """A law given by its graph."""
    return Graph(points=[list(p) for p in points], one_sided=one_sided)


def bonds(law: Superpotential, unknowns: Any, weights: Any = 1.0, signs: Any = 1.0) -> Bonds:
    """A law on some unknowns."""
    numbers = np.atleast_1d(np.asarray(unknowns, dtype=np.int64))
    return Bonds(
        law=law,
        unknowns=numbers[:, None],
        signs=np.broadcast_to(np.asarray(signs, dtype=float), numbers.shape)[:, None].copy(),
        weights=np.broadcast_to(np.asarray(weights, dtype=float), numbers.shape).copy(),
        part="glue",
        direction=Direction.SLIP,
        points=np.zeros((len(numbers), 3)),
    )


def problem(
    stiffness: Any,
    rate: Any,
    *laws: Bonds,
    force: Any = 0.0,
    lower: Any = -np.inf,
    upper: Any = np.inf,
) -> CondensedProblem:
    """A problem of dead loads."""
    s, f1 = np.atleast_2d(np.asarray(stiffness, dtype=float)), np.atleast_1d(np.asarray(rate, dtype=float))
    n = len(f1)
    f0, low, high = (np.broadcast_to(np.asarray(v, dtype=float), (n,)).copy() for v in (force, lower, upper))
    return CondensedProblem(
        elastic=DenseStiffness(s),
        force=f0,
        force_rate=f1,
        lower=low,
        upper=high,
        bonds=laws,
        constant=np.zeros(3),
        applied=np.array([f0, f1]),
        applied_constant=np.zeros(3),
        points=np.column_stack([np.arange(n), np.zeros((n, 2))]),
        parts=("floor",) * n,
    )


def chain(n: int, stiffness: float) -> Array:
    """The stiffness of n points in a row, with springs between neighbours."""
    ends = np.r_[1.0, np.full(n - 2, 2.0), 1.0]
    return stiffness * (np.diag(ends) - np.eye(n, k=1) - np.eye(n, k=-1))


def violation(given: CondensedProblem, x: Array, factor: float, size: float, atol: float = 1e-9) -> float:
    """How far f - S x is from the forces that laws and bounds can give, relative to a size of forces."""
    needed = given.load(factor) - given.stiffness @ x
    low, high = np.zeros(given.size), np.zeros(given.size)
    for b in given.bonds:
        at = b.argument(x)
        least, most = b.law.interval(at, atol)
        sides = np.sort(np.stack([least * b.signs[:, 0], most * b.signs[:, 0]]), axis=0)
        np.add.at(low, b.unknowns[:, 0], b.weights * sides[0])
        np.add.at(high, b.unknowns[:, 0], b.weights * sides[1])
    low[x <= given.lower + atol] = -np.inf
    high[x >= given.upper - atol] = np.inf
    far = np.maximum(np.maximum(low - needed, needed - high), 0.0)
    beyond = np.maximum(np.maximum(given.lower - x, x - given.upper), 0.0)
    return float(np.max(far) / size + np.max(beyond))
