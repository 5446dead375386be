"""Γc in coordinates along which bounds and laws separate, and the body condensed to them."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from referee.assembly import LawPoint, Problem
from referee.laws import Law
from referee.meshes import Array, Integers

PARALLEL = 1e-9


@dataclass(frozen=True)
class Coordinate:
    """One direction of movement of one vertex.

    Attributes:
        vertex: the vertex.
        direction: a unit vector, (d,).
        lower: of u·direction.
        upper: of u·direction.
        laws: what acts along it, with the sign of its argument and its weight.
    """

    vertex: int
    direction: Array
    lower: float
    upper: float
    laws: tuple[tuple[Law, float, float], ...]


def _frame(problem: Problem, vertex: int, wanted: list[Array]) -> Array | None:
    """An orthonormal frame of the unprescribed space of a vertex that contains all wanted directions; None if none."""
    d = problem.d
    held = [np.eye(d)[i] for i in range(d) if vertex * d + i in set(problem.fixed.tolist())]
    rows = list(held)
    for direction in wanted:
        along = [abs(float(row @ direction)) for row in rows]
        if any(a > 1 - PARALLEL for a in along):
            continue
        if any(a > 1e-7 for a in along):
            return None
        rows.append(direction)
    for axis in np.eye(d):
        rest = axis - sum((row @ axis * row for row in rows), np.zeros(d))
        if len(rows) < d and np.linalg.norm(rest) > 0.3:
            rows.append(rest / np.linalg.norm(rest))
    return np.array(rows[len(held) :]).reshape(-1, d)


class Floor:
    """The coordinates of Γc of a problem; ``ok`` is false where directions do not separate."""

    def __init__(self, problem: Problem) -> None:
        self.problem = problem
        self.coordinates: list[Coordinate] = []
        self.ok = True
        vertices = sorted({b.vertex for b in problem.bounds} | {p.vertex for p in problem.laws})
        for v in vertices:
            self._add(v)

    def _add(self, v: int) -> None:
        p = self.problem
        bounds, laws = [b for b in p.bounds if b.vertex == v], [q for q in p.laws if q.vertex == v]
        frame = _frame(p, v, [b.normal for b in bounds] + [r for q in laws for r in q.directions])
        if frame is None or any(q.radial for q in laws):
            self.ok = False
            return
        for row in frame:
            lower, upper = -np.inf, np.inf
            for b in bounds:
                s = float(b.normal @ row)
                if s > 0.5:
                    lower, upper = max(lower, b.lower), min(upper, b.upper)
                elif s < -0.5:
                    lower, upper = max(lower, -b.upper), min(upper, -b.lower)
            self.coordinates.append(Coordinate(v, row, lower, upper, tuple(_along(laws, row))))

    @cached_property
    def columns(self) -> Array:
        """The coordinates' directions as dense columns (n d, m)."""
        p = self.problem
        found = np.zeros((p.matrix.shape[0], len(self.coordinates)))
        for j, c in enumerate(self.coordinates):
            found[c.vertex * p.d : (c.vertex + 1) * p.d, j] = c.direction
        return found

    @cached_property
    def inner(self) -> Integers:
        """The unknowns that are neither prescribed nor on Γc."""
        d = self.problem.d
        here = {c.vertex * d + i for c in self.coordinates for i in range(d)}
        return np.array([i for i in self.problem.free if int(i) not in here], dtype=np.int64)

    @cached_property
    def condensed(self) -> tuple[Array, Array, Array, Array]:
        """S, f and (lift, base): u = base + lift x for coordinates x. Dense, for small meshes."""
        p = self.problem
        a = p.matrix.toarray()
        base = np.zeros(a.shape[0])
        base[p.fixed] = p.values
        q, i = self.columns, self.inner
        aii = a[np.ix_(i, i)]
        rhs = np.column_stack([(p.force - a @ base)[i], -(a @ q)[i]])
        inside = np.linalg.lstsq(aii, rhs, rcond=1e-13)[0] if len(i) else rhs
        base[i] += inside[:, 0]
        lift = q.copy()
        lift[i] += inside[:, 1:]
        s = lift.T @ a @ lift
        return (s + s.T) / 2, lift.T @ (p.force - a @ base), lift, base

    @property
    def regular(self) -> bool:
        """Whether Γc and the prescribed components hold the inside."""
        i = self.inner
        if not len(i):
            return True
        aii = self.problem.matrix.toarray()[np.ix_(i, i)]
        values = np.linalg.eigvalsh(aii)
        return bool(values[0] > 1e-11 * values[-1])


def _along(laws: list[LawPoint], row: Array) -> list[tuple[Law, float, float]]:
    return [(q.law, s, q.weight) for q in laws if abs(s := round(float(q.directions[0] @ row), 9)) > 0.5]
