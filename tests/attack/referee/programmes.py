"""The existence question of docs/solvability.md as linear programmes of our own, body by body.

f(y) = ∫ (growth or peak)(y_t) ds - <g, y> over the rigid motions that conditions and contact admit. In space |y_t| is
bounded below by its tangents, which are added until bound and value meet.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.linalg import null_space
from scipy.optimize import linprog

from referee.assembly import LawPoint, Problem
from referee.meshes import Array

TIE = 1e-7
"""Nearer to zero than this, relative to loads and laws, nothing is claimed."""


@dataclass(frozen=True)
class Row:
    """One law at one vertex in the coordinates of the kernel: slips (k, q), growth or peak to either side."""

    slips: Array
    minus: float
    plus: float

    def value(self, y: Array) -> float:
        """The resistance to a motion."""
        s = self.slips @ y
        if len(s) > 1:
            return float(self.plus * np.linalg.norm(s))
        return float(self.plus * s[0] if s[0] >= 0 else -self.minus * s[0])

    def tangent(self, y: Array) -> Array:
        """A subgradient at y."""
        s = self.slips @ y
        if len(s) > 1:
            r = float(np.linalg.norm(s))
            return self.plus * (s / r if r > 0 else s) @ self.slips
        return (self.plus if s[0] >= 0 else -self.minus) * self.slips[0]

    @property
    def convex(self) -> bool:
        """Whether it is a convex function of y."""
        return self.plus + self.minus >= 0 if len(self.slips) == 1 else self.plus >= 0


@dataclass(frozen=True)
class Verdict:
    """What the programmes say of one body.

    Attributes:
        state: held, escapes, metastable, or unclear (a tie, or a growth that is not convex).
        growth: least value of f with the growth over the unit box, divided by the size of works and laws.
        peak: the same with the peak.
        equal: the documented tie, 1e-9 of the loads' sum, in the same unit: below it the program may say borderline.
    """

    state: str
    growth: float
    peak: float
    equal: float = 0.0


class Body:
    """The rigid motions of one body of a problem."""

    def __init__(self, problem: Problem, label: int, factor: float = 1.0) -> None:
        self.problem, self.factor = problem, factor
        self.vertices = np.flatnonzero(problem.labels == label)
        self.points = problem.mesh.points[self.vertices]
        self.centre = self.points.mean(axis=0)
        self.length = float(np.ptp(self.points, axis=0).max())
        self.mine = set(self.vertices.tolist())

    def fields(self, vertex: int) -> Array:
        """The rigid motions at a vertex, (d, 3|6), rotations per length."""
        x = (self.problem.mesh.points[vertex] - self.centre) / self.length
        if len(x) == 2:
            return np.array([[1.0, 0.0, -x[1]], [0.0, 1.0, x[0]]])
        turn = np.array([[0.0, x[2], -x[1]], [-x[2], 0.0, x[0]], [x[1], -x[0], 0.0]])
        return np.hstack([np.eye(3), turn])

    @cached_property
    def _prescribed(self) -> Array:
        d, p = self.problem.d, self.problem
        rows = [self.fields(int(i) // d)[int(i) % d] for i in p.fixed if int(i) // d in self.mine]
        return np.array(rows).reshape(-1, 3 if d == 2 else 6)

    @cached_property
    def _fixed_rows(self) -> Array:
        d, p = self.problem.d, self.problem
        rows = list(self._prescribed)
        rows += [
            b.normal @ self.fields(b.vertex)
            for b in p.bounds
            if b.vertex in self.mine and np.isfinite(b.lower) and np.isfinite(b.upper)
        ]
        rows += [r for law in self._laws if law.law.stiffness for r in law.directions @ self.fields(law.vertex)]
        return np.array(rows).reshape(-1, 3 if d == 2 else 6)

    @cached_property
    def _laws(self) -> list[LawPoint]:
        return [p for p in self.problem.laws if p.vertex in self.mine]

    @cached_property
    def basis(self) -> Array | None:
        """The kernel's basis as columns; None if its dimension is in doubt."""
        rows = self._fixed_rows
        if not len(rows):
            return np.eye(rows.shape[1])
        _, s, v = np.linalg.svd(rows)
        s = np.concatenate([s, np.zeros(v.shape[0] - len(s))])
        if np.any((s > 1e-12 * s[0]) & (s < 1e-7 * s[0])):
            return None
        return np.asarray(v[s <= 1e-12 * s[0]].T)

    @cached_property
    def cone(self) -> Array:
        """Rows c with c·y ≤ 0."""
        assert self.basis is not None
        one_way = [b for b in self.problem.bounds if b.vertex in self.mine]
        rows = [b.normal @ self.fields(b.vertex) @ self.basis for b in one_way if np.isfinite(b.upper)]
        return np.array(rows).reshape(-1, self.basis.shape[1])

    @cached_property
    def work(self) -> Array:
        """<g, y> of the basis."""
        assert self.basis is not None
        return self._total @ self.basis

    @cached_property
    def _total(self) -> Array:
        """<g, y> of all rigid motions."""
        g = self.problem.load.reshape(-1, self.problem.d)
        total = sum((g[v] @ self.fields(int(v)) for v in self.vertices), np.zeros(self._fixed_rows.shape[1]))
        return self.factor * np.asarray(total)

    @cached_property
    def loads(self) -> float:
        """Sum of the absolute nodal forces."""
        return float(self.factor * np.abs(self.problem.load.reshape(-1, self.problem.d)[self.vertices]).sum())

    @cached_property
    def size(self) -> float:
        """What f is judged by: the loads' works and the laws' tractions."""
        return float(np.abs(self.work).max(initial=0.0) + sum(p.weight * p.law.scale for p in self._laws)) or 1.0

    def rows(self, kind: str) -> list[Row]:
        """The laws' growth or peak."""
        assert self.basis is not None
        found = []
        for p in self._laws:
            law = p.law.exact or p.law
            minus, plus = law.growth() if kind == "growth" else law.peak()
            if np.isfinite(minus) and np.isfinite(plus):
                ends = p.weight / self.size * np.array([minus, plus])
                if p.radial and kind == "peak":
                    ends[:] = ends.max()
                found.append(Row(p.directions @ self.fields(p.vertex) @ self.basis, ends[0], ends[1]))
        return found

    def least(self, rows: list[Row], face: tuple[int, float] | None = None) -> tuple[float, float]:
        """Lower bound and value of min f over |y| ≤ 1, or over one face of that box; inf where the face is empty."""
        q, m = len(self.work), len(rows)
        cost = np.concatenate([-self.work / self.size, np.ones(m)])
        bounds = [(-1.0, 1.0)] * q + [(None, None)] * m
        if face is not None:
            bounds[face[0]] = (face[1], face[1])
        a, b = np.hstack([self.cone, np.zeros((len(self.cone), m))]), np.zeros(len(self.cone))
        cuts: list[Array] = []

        def add(y: Array) -> None:
            for i, row in enumerate(rows):
                cut = np.zeros(q + m)
                cut[:q], cut[q + i] = row.tangent(y), -1.0
                cuts.append(cut)

        for start in (*np.eye(q), *-np.eye(q)):
            add(start)
        for i, row in enumerate(rows):
            if len(row.slips) == 1:
                for sign in (1.0, -1.0):
                    cut = np.zeros(q + m)
                    cut[:q], cut[q + i] = row.tangent(sign * row.slips[0]), -1.0
                    cuts.append(cut)
        best = np.inf
        for _ in range(60):
            full = np.vstack([a, *cuts]) if cuts else a
            right = np.concatenate([b, np.zeros(len(cuts))])
            found = linprog(cost, full if len(full) else None, right if len(full) else None, bounds=bounds)
            if found.status == 2:
                return np.inf, np.inf
            if found.x is None:
                return -np.inf, np.inf
            y = found.x[:q]
            best = min(best, float(-self.work @ y / self.size + sum(row.value(y) for row in rows)))
            if best - found.fun < TIE / 10:
                break
            add(y)
        return float(found.fun), best

    def sphere(self, rows: list[Row]) -> float:
        """Lower bound of min f over |y| = 1."""
        faces = [(i, sign) for i in range(len(self.work)) for sign in (1.0, -1.0)]
        return min(self.least(rows, face)[0] for face in faces)

    def sampled(self, rows: list[Row]) -> float:
        """The smallest value of f over many admissible motions."""
        q = len(self.work)
        y = np.vstack([np.eye(q), -np.eye(q), np.random.default_rng(0).standard_normal((4000, q))])
        y /= np.abs(y).max(axis=1, keepdims=True)
        y = y[np.all(y @ self.cone.T <= 0, axis=1)] if len(self.cone) else y
        return min((float(-self.work @ v / self.size + sum(r.value(v) for r in rows)) for v in y), default=np.inf)

    def amplification(self) -> float:
        """The least possible sum of forces over that of the loads: a wedge of slope s needs 1/s.

        Forces of contact and of laws without a peak (springs) count. All motions that prescribed values leave count:
        bilateral contact along uneven normals is a wedge too, and so are springs along a tilted floor.
        """
        rows = self._prescribed
        free = null_space(rows, rcond=1e-9) if len(rows) else np.eye(rows.shape[1])
        forces = self._one_way_forces()
        if not forces or not self.loads or not free.shape[1]:
            return 0.0
        columns = np.array([column for column, _ in forces]) @ free
        limits = [(0.0, most / self.loads if np.isfinite(most) else None) for _, most in forces]
        cost = [float(np.isinf(most)) for _, most in forces]
        found = linprog(cost, A_eq=columns.T, b_eq=self._total @ free / self.loads, bounds=limits)
        return float(found.fun) if found.x is not None else 0.0

    def _one_way_forces(self) -> list[tuple[Array, float]]:
        """What contact and laws can carry: works on the rigid motions per force, and the largest force."""
        found = []
        for b in self.problem.bounds:
            if b.vertex in self.mine:
                work = b.normal @ self.fields(b.vertex)
                found += [(s * work, np.inf) for s, end in ((1.0, b.upper), (-1.0, b.lower)) if np.isfinite(end)]
        for p in self._laws:
            ends = p.weight * np.array((p.law.exact or p.law).peak())
            works = p.directions @ self.fields(p.vertex)
            found += [(s * w, max(0.0, float(end))) for w in works for s, end in ((-1.0, ends[0]), (1.0, ends[1]))]
        return found

    def verdict(self) -> Verdict:
        """The state of this body."""
        if self.basis is None:
            return Verdict("unclear", np.nan, np.nan)
        if not self.basis.shape[1]:
            return Verdict("held", np.inf, np.inf)
        if 1e3 * np.finfo(float).eps * self.loads > TIE * self.size:
            return Verdict("unclear", np.nan, np.nan, np.inf)
        return self._state(3e-9 * self.loads / self.size)

    def _state(self, equal: float) -> Verdict:
        growth, peak = self.rows("growth"), self.rows("peak")
        low, value = self.least(peak)
        if value < -TIE:
            return Verdict("escapes", np.nan, value, equal)
        if all(r.convex for r in growth):
            margin, attained = self.least(growth)
            if attained >= -TIE:
                margin = self.sphere(growth)
                return Verdict("held" if margin > TIE else "unclear", margin, low, equal)
        else:
            attained = self.sampled(growth)
        strict = attained < -TIE and self.sphere(peak) > TIE
        return Verdict("metastable" if strict else "unclear", attained, low, equal)


ORDER = ("held", "unclear", "metastable", "escapes")


def verdict(problem: Problem, factor: float = 1.0) -> Verdict:
    """That of the worst body.

    Args:
        problem: the assembled scene.
        factor: of the load.
    """
    return max(
        (Body(problem, label, factor).verdict() for label in range(problem.bodies)), key=lambda v: ORDER.index(v.state)
    )
