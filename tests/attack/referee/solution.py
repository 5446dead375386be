"""Is a displacement a solution of the inequality? Equilibrium, bounds, signs and inclusions, body by body.

Every entry is relative to the body's own size, so that a heavily loaded body excuses nothing on another one. The
motions of a body as a whole are balanced apart, since elasticity takes no part in them.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.optimize import linprog, lsq_linear

from referee.assembly import Bound, LawPoint, Problem
from referee.meshes import Array
from referee.programmes import Body

WRONG = 1e-5
"""A relative violation above this is a contradiction; the program claims its tolerance, 1e-8 as a rule."""
BALANCE = 1e-4
"""The same for the balance of rigid motions, relative to what acts along them."""
FLOOR = 1e-8
"""What a body is judged by at least, in shares of the most loaded one: of a body at rest only rounding moves."""
EPS = float(np.finfo(float).eps)


@dataclass(frozen=True)
class Column:
    """A force that something may exert at a vertex: ``direction`` times a number in [low, high], N/m or N."""

    direction: Array
    low: float
    high: float


def _floored(sizes: Sequence[float] | Array) -> Array:
    """Sizes by body; one that nothing drives has but the rounding of the others."""
    return np.maximum(sizes, FLOOR * np.max(sizes) or 1.0)


class Check:
    """A displacement (n, d) of a problem, and what is wrong with it."""

    def __init__(self, problem: Problem, u: Array, wrong: float = WRONG) -> None:
        self.problem, self.u = problem, u
        self.wrong = max(wrong, 10.0 * problem.tolerance)
        flat = u.ravel()
        self.missing = (problem.force - problem.matrix @ flat).reshape(u.shape)
        sizes = abs(problem.matrix) @ np.abs(flat) + np.abs(problem.load) + np.abs(problem.strain_load)
        self.rounding = 50.0 * EPS * sizes.reshape(u.shape)
        self.free = np.ones(u.size, bool)
        self.free[problem.fixed] = False
        self.free = self.free.reshape(u.shape)

    @cached_property
    def _at(self) -> dict[int, tuple[list[Bound], list[LawPoint]]]:
        found: dict[int, tuple[list[Bound], list[LawPoint]]] = {}
        for b in self.problem.bounds:
            found.setdefault(b.vertex, ([], []))[0].append(b)
        for p in self.problem.laws:
            found.setdefault(p.vertex, ([], []))[1].append(p)
        return found

    @cached_property
    def weights(self) -> Array:
        """A lumped area for every vertex of Γc."""
        w = np.zeros(len(self.u))
        for p in self.problem.laws:
            w[p.vertex] = max(w[p.vertex], p.weight)
        plain = self.problem.mesh.size ** (self.problem.d - 1) / max(len({b.vertex for b in self.problem.bounds}), 1)
        for b in self.problem.bounds:
            w[b.vertex] = w[b.vertex] or plain
        return w

    @cached_property
    def displacement(self) -> Array:
        """Largest displacement of each body."""
        size = np.abs(self.u).max(axis=1)
        return _floored([size[self.problem.labels == k].max() for k in range(self.problem.bodies)])

    @cached_property
    def traction(self) -> Array:
        """What tractions of each body are judged by: what drives it, or the largest that acts on its Γc."""
        found = self.problem.stress.copy()
        for v in self._at:
            carried = float(np.abs(self.missing[v][self.free[v]]).max(initial=0.0))
            lost = float(self.rounding[v].max()) / WRONG  # a rigid motion carries nothing but rounding
            found[self.problem.labels[v]] = max(found[self.problem.labels[v]], max(carried, lost) / self.weights[v])
        return _floored(found)

    @cached_property
    def blur(self) -> float:
        """What rounding alone makes of the tractions on Γc, by what they are judged by."""
        return max((self._share(v, self.rounding[v] / self.weights[v]) for v in self._at), default=0.0)

    def columns(self, vertex: int) -> list[Column]:
        """What may act at a vertex, forces that the rest of the problem has to balance."""
        bounds, laws = self._at[vertex]
        near, touching = self.near(vertex), self.touching(vertex)
        found = []
        for b in bounds:
            un = float(b.normal @ self.u[vertex])
            top, bottom = un >= b.upper - touching, un <= b.lower + touching
            if top or bottom:
                found.append(Column(b.normal, -np.inf if bottom else 0.0, np.inf if top else 0.0))
        for p in laws:
            slip = p.slip(self.u)
            x = self.problem.argument(p, self.u)
            if p.radial and x <= near:
                radius = p.weight * float(np.max(np.abs(p.law.interval(np.array([x]), near))))  # no slip that is known
                found += [Column(t, -radius, radius) for t in p.directions]
                continue
            low, high = (float(v[0]) * p.weight for v in p.law.interval(np.array([x]), near))
            direction = slip @ p.directions / x if p.radial else p.directions[0]
            found.append(Column(direction, low, high))
        return found

    def near(self, vertex: int) -> float:
        """A displacement that is zero at this vertex."""
        body = self.problem.labels[vertex]
        u0 = self.traction[body] * self.problem.mesh.size / self.problem.modulus
        return float(1e-9 * u0 + 4 * EPS * self.displacement[body] + 1e-9 * self.displacement[body])

    def touching(self, vertex: int) -> float:
        """A distance to a bound that counts as none."""
        return self.near(vertex) + 1e-7 * float(self.displacement[self.problem.labels[vertex]])

    def wrongs(self) -> list[str]:
        """One line for each thing that is wrong; empty for a solution."""
        if not np.all(np.isfinite(self.u)):
            return ["displacement is not finite"]
        return self._prescribed() + self._bounds() + self._inner() + self._vertices() + self._rigid()

    def _prescribed(self) -> list[str]:
        p = self.problem
        size = max(np.abs(self.u).max(), np.abs(p.values).max(initial=0.0)) or 1.0
        off = float(np.abs(self.u.ravel()[p.fixed] - p.values).max(initial=0.0)) / size
        return [f"prescribed displacement missed by {off:.1e}"] if off > self.wrong else []

    def _bounds(self) -> list[str]:
        worst, where = 0.0, -1
        for b in self.problem.bounds:
            un = float(b.normal @ self.u[b.vertex])
            size = self.displacement[self.problem.labels[b.vertex]] or 1.0
            beyond = max(un - b.upper, b.lower - un) / size
            if beyond > worst:
                worst, where = beyond, b.vertex
        return [f"penetration {worst:.1e} at {self._place(where)}"] if worst > self.wrong else []

    def _place(self, vertex: int) -> str:
        return "(" + ", ".join(f"{c:.4g}" for c in self.problem.mesh.points[vertex]) + ")"

    def _inner(self) -> list[str]:
        """Unknowns off Γc that nothing prescribes."""
        found = []
        inner = self.free.copy()
        inner[list(self._at)] = False
        for k in range(self.problem.bodies):
            mine = (self.problem.labels == k)[:, None]
            load = np.linalg.norm(self.problem.force.reshape(self.u.shape) * mine)
            carried = np.linalg.norm(self.missing * ~inner * mine)
            rest = np.linalg.norm(np.maximum(np.abs(self.missing) - self.rounding, 0.0) * inner * mine)
            size = max(load, carried, FLOOR * float(np.linalg.norm(self.problem.force)))
            if rest > self.wrong * size:
                found.append(f"equilibrium of body {k} missed by {rest / size:.1e}")
        return found

    def _vertices(self) -> list[str]:
        """At each vertex of Γc the force that is missing must be one that bounds and laws may exert."""
        worst, line = 1.0, ""
        for v in self._at:
            free = self.free[v]
            if not free.any():
                continue
            columns = [c for c in self.columns(v) if np.abs(c.direction[free]).max() > 1e-9]
            rest = self.missing[v][free]
            if columns:
                rest = rest - self._carried(columns, free, rest)
            off = np.zeros(self.problem.d)
            off[free] = np.maximum(np.abs(rest) - self.rounding[v][free], 0.0) * np.sign(rest) / self.weights[v]
            share = self._share(v, off) / self.wrong
            if share > worst:
                state = "closed or on a law" if columns else "nothing acts"
                worst = share
                line = f"force {share * self.wrong:.1e} that nothing carries at {self._place(v)} ({state})"
        return [line] if line else []

    def _carried(self, columns: list[Column], free: Array, wanted: Array) -> Array:
        a = np.stack([c.direction[free] for c in columns], axis=1)
        size = float(np.abs(wanted).max()) or 1.0
        low, high = (np.array([getattr(c, end) for c in columns]) / size for end in ("low", "high"))
        pad = 1e-14 * (1.0 + np.minimum(np.abs(low), np.abs(high)))
        found = lsq_linear(a, wanted / size, (low - pad, high + pad), method="bvls", tol=1e-14)
        return np.asarray(a @ found.x * size)

    def _share(self, vertex: int, off: Array) -> float:
        """A missing traction, along the bound's normal by the body's tractions, else by those of the weakest law."""
        body = float(self.traction[self.problem.labels[vertex]])
        bounds, laws = self._at[vertex]
        finest = max(min((p.law.scale for p in laws if p.law.scale), default=body), 1e-3 * body)
        normal = float(bounds[0].normal @ off) if bounds else 0.0
        rest = off - normal * bounds[0].normal if bounds else off
        return max(abs(normal) / body, float(np.linalg.norm(rest)) / min(finest, body))

    def _rigid(self) -> list[str]:
        found = []
        for k in range(self.problem.bodies):
            off = self._imbalance(k)
            if off > BALANCE:
                found.append(f"body {k} as a whole out of balance by {off:.1e} of what acts along its motions")
        return found

    def _imbalance(self, label: int) -> float:
        """The least possible imbalance of the motions that prescribed components leave, by what acts along each."""
        body = Body(self.problem, label)
        d = self.problem.d
        rows = [body.fields(int(i) // d)[int(i) % d] for i in self.problem.fixed if int(i) // d in body.mine]
        motions = 3 if d == 2 else 6
        kernel = np.eye(motions)
        if rows:
            _, s, v = np.linalg.svd(np.array(rows))
            s = np.concatenate([s, np.zeros(motions - len(s))])
            kernel = v[s <= 1e-9 * s[0]].T
        if not kernel.shape[1]:
            return 0.0
        g = self.problem.load.reshape(self.u.shape)
        work = sum((g[v] @ body.fields(int(v)) for v in body.vertices), np.zeros(motions)) @ kernel
        loads = max(float(np.abs(g[body.vertices]).sum()), 0.1 * float(np.abs(g).sum()))
        columns, ranges = [], []
        for v in (v for v in self._at if v in body.mine):
            for c in self.columns(v):
                columns.append(c.direction @ body.fields(v) @ kernel)
                ranges.append((c.low, c.high))
        k, m = len(work), len(columns)
        ends = np.abs(np.array(ranges).reshape(m, 2))
        largest = np.where(np.isfinite(ends), ends, 0.0).max(axis=1, initial=0.0)
        a = np.array(columns).reshape(m, k).T
        sizes = np.maximum(np.maximum(np.abs(work), np.abs(a) @ largest), 1e-9 * loads)
        sizes = np.where(sizes > 0, sizes, 1.0)
        unit = float(sizes.max())
        rows, right = a * (unit / sizes)[:, None], work / sizes
        full = np.vstack([np.hstack([rows, -np.ones((k, 1))]), np.hstack([-rows, -np.ones((k, 1))])])
        limits = [(low / unit, high / unit) for low, high in ranges] + [(0.0, None)]
        found = linprog(np.append(np.zeros(m), 1.0), full, np.concatenate([right, -right]), bounds=limits)
        if found.x is None:
            return 0.0
        return max(float(found.fun) - float(np.max(1e3 * EPS * loads / sizes)), 0.0)
