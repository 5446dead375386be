"""What the solvability of a scene depends on, as plain arrays, and its reduction to the kernel.

Everything is nondimensional: lengths by the body's size, tractions by the load's scale. Arrays with a row
for each point are per rank (each rank gives the vertices it owns); all else is the same on all ranks.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from mpi4py import MPI

from ..errors import InputError
from ..laws import Length
from ..laws.base import Directional
from ..typing import Array
from .cutting_planes import Functional, SlipIntegral, merged
from .motions import DEFAULT, JoinedBodies, Mode, kernel


def _parts(law: Directional) -> tuple[float, float]:
    """The a and b of law(s) = a·s + b|s|; b is negative if the function is not convex.

    One side infinite: the sign of s is known, and the law linear.
    """
    if np.isinf(law.plus) or np.isinf(law.minus):
        known = -law.minus if np.isinf(law.plus) else law.plus
        return (0.0 if law.plus == law.minus else known), 0.0
    return 0.5 * (law.plus - law.minus), 0.5 * (law.plus + law.minus)


@dataclass(frozen=True, kw_only=True)
class Resistance:
    """One part that carries a law.

    Attributes:
        fields: the basis motions at its vertices, on an interface the relative ones, (m, motions, d).
        weights: lumped areas (m,).
        directions: (m, r, d). r = 1: the law acts on the scalar slip y·direction (in 2D the tangent; for a
            normal law the inward normal for opening, the outward one for penetration). Else it acts on a length.
        growth: j^∞, the recession function, as its values at -1 and 1; tractions, +inf allowed.
        peak: ĵ = sup over x of j⁰(x; ·), likewise.
        c4: the paper's growth constant, η(-ξ) <= c4|ξ| for η in ∂j(ξ); a traction.
        length: of the r components; None: their Euclidean length.
    """

    fields: Array
    weights: Array
    directions: Array
    growth: Directional
    peak: Directional
    c4: float = 0.0
    length: Length | None = None

    def __post_init__(self) -> None:
        values = (self.growth.minus, self.growth.plus, self.peak.minus, self.peak.plus)
        if not all(value > -np.inf for value in values):  # also refuses nan
            raise InputError(f"growth and peak of a law are numbers or +inf, not {values}")
        if self.directions.shape[1] > 1 and any(f.plus != f.minus for f in (self.growth, self.peak)):
            raise InputError("a law of a length needs the same growth and peak on both sides")

    @cached_property
    def slips(self) -> Array:
        """What the law acts on, of each basis motion, (m, r, motions)."""
        return np.einsum("mrd,mnd->mrn", self.directions, self.fields)

    @property
    def measured(self) -> Length:
        """The length that it acts on; of one component its size."""
        return self.length or Length.plain(self.directions.shape[1])


@dataclass(frozen=True, kw_only=True)
class RigidProblem:
    """What the rigid motions of one body, or of bodies that meet in interfaces, meet.

    Attributes:
        body: the body.
        loads: by name, the work <g, y> (3|6,) on the basis motions.
        fixed: rows (q, motions) that are zero for all motions it can make; each rank gives its own.
        contact: rows y·n, likewise, that unilateral contact keeps from being positive; n is outward, of unit length.
        resistances: the parts that carry laws.
        force: sum of the absolute nodal forces: beside it a work is rounding or not, however well loads balance.
    """

    body: JoinedBodies
    loads: Mapping[str, Array]
    fixed: tuple[Array, ...] = ()
    contact: tuple[Array, ...] = ()
    resistances: tuple[Resistance, ...] = ()
    force: float = 0.0

    def __post_init__(self) -> None:
        for name, work in self.loads.items():
            if not np.isfinite(work).all():
                raise InputError(f"load {name!r}: its work on a rigid motion is not finite")

    def conditions(self) -> tuple[Array, ...]:
        """The fixed conditions, and those of laws whose growth is infinite both ways (linear springs)."""
        rows = [p.slips[:, r] for p in self._springs for r in np.flatnonzero(p.measured.two_sided())]
        return (*self.fixed, *rows)

    def cones(self) -> tuple[Array, ...]:
        """Unilateral contact, and that of springs which resist an opening alone."""
        return (*self.contact, *(p.slips[:, 0] for p in self._springs if p.measured.opens))

    @property
    def _springs(self) -> list[Resistance]:
        return [p for p in self.resistances if np.isinf(p.growth.minus) and np.isinf(p.growth.plus)]


@dataclass(frozen=True, kw_only=True)
class ReducedRows:
    """What some ranks, or all, have of the reduced problem.

    Attributes:
        contact: rows of unit length (c, k); contact admits the motions with contact @ y <= 0.
        slips: the slip integral of each resistance.
        areas: of each resistance, (p,).
        trace: ∫ y·y over the parts whose c4 is positive as a quadratic form, (k, k).
    """

    contact: Array
    slips: tuple[SlipIntegral, ...]
    areas: Array
    trace: Array

    def joined(self, other: ReducedRows) -> ReducedRows:
        """What both have."""
        return ReducedRows(
            contact=np.unique(np.vstack([self.contact, other.contact]), axis=0),
            slips=tuple(a.joined(b) for a, b in zip(self.slips, other.slips, strict=True)),
            areas=self.areas + other.areas,
            trace=self.trace + other.trace,
        )


@dataclass(frozen=True, kw_only=True)
class ReducedProblem(ReducedRows):
    """The problem in the k coefficients of the kernel's basis; on the root rank only.

    Attributes:
        frame: the basis as rigid coefficients (3|6, k).
        moments: ∫ direction·y of each resistance, (p, k).
        loads: by name, the work on the basis motions, (k,).
        load_scale: the largest work of the loads on any basis motion, or the sum of the absolute nodal forces.
    """

    frame: Array
    moments: Array
    loads: Mapping[str, Array]
    load_scale: float

    def functional(self, laws: tuple[Directional, ...]) -> Functional:
        """Σ_p ∫ law_p(slip) ds on the cone of contact and of infinite one-sided laws; factors of any sign."""
        blocked = [
            sign * self.slip_rows(p)
            for p, law in enumerate(laws)
            for sign, side in ((1.0, law.plus), (-1.0, law.minus))
            if np.isinf(side) and not self.slips[p].length.opens
        ]
        linear, even = np.array([_parts(law) for law in laws]).reshape(-1, 2).T
        return Functional(linear @ self.moments, even, np.vstack([self.contact, *blocked]))

    def slip_rows(self, p: int) -> Array:
        """The slips of part p as rows (q, k) of length one; vanishing ones are left out."""
        rows = self.slips[p].rows
        tiny = DEFAULT.exact * float(self.areas[p]) / max(len(rows), 1)
        return unit_rows(rows.reshape(-1, rows.shape[2]), tiny)


def reduce(comm: MPI.Comm, problem: RigidProblem) -> tuple[Array, ReducedProblem | None]:
    """The kernel's basis (3|6, k) everywhere, and on the root the reduced problem if k > 0. Collective.

    Args:
        comm: the ranks of the mesh.
        problem: the body and what it meets.
    """
    basis = kernel(comm, problem.body, problem.conditions())
    if basis.shape[1] == 0:
        return basis, None
    rows = comm.reduce(_own_rows(problem, basis), op=ReducedRows.joined, root=0)  # in a tree
    if rows is None:
        return basis, None
    moments = [g.rows[:, 0].sum(axis=0) if g.rows.shape[1] == 1 else np.zeros(basis.shape[1]) for g in rows.slips]
    works = {name: work @ basis for name, work in problem.loads.items()}
    return basis, ReducedProblem(
        **vars(rows),
        frame=basis,
        moments=np.array(moments).reshape(len(rows.slips), basis.shape[1]),
        loads=works,
        load_scale=max(problem.force, sum(float(np.abs(work).max()) for work in problem.loads.values())),
    )


def _own_rows(problem: RigidProblem, basis: Array) -> ReducedRows:
    """What this rank has of the reduced problem."""
    normals = np.vstack([np.zeros((0, basis.shape[1])), *(rows @ basis for rows in problem.cones())])
    return ReducedRows(
        contact=np.unique(unit_rows(normals, DEFAULT.exact), axis=0),
        slips=tuple(
            SlipIntegral(merged(p.slips @ basis * p.weights[:, None, None]), p.measured) for p in problem.resistances
        ),
        areas=np.array([float(p.weights.sum()) for p in problem.resistances]),
        trace=sum((_trace(p, basis) for p in problem.resistances if p.c4 > 0.0), np.zeros((basis.shape[1],) * 2)),
    )


def unit_rows(rows: Array, tiny: float) -> Array:
    """Rows scaled to length one, without those that are too short.

    Args:
        rows: (m, k).
        tiny: the length up to which a row is left out.
    """
    length = np.linalg.norm(rows, axis=1)
    return rows[length > tiny] / length[length > tiny, None]


def _trace(part: Resistance, basis: Array) -> Array:
    """∫ y·y over this rank's vertices of a part, as a quadratic form on the kernel's basis, (k, k)."""
    fields = np.einsum("mnd,nk->mdk", part.fields, basis)
    return np.einsum("m,mdk,mdl->kl", part.weights, fields, fields)


def pressed(problem: RigidProblem, forces: Mapping[str, float], ways: Sequence[Array]) -> RigidProblem:
    """The problem of a body and of obstacles that forces press on it.

    Args:
        problem: of the body, the obstacles at rest.
        forces: the size of each force, by the name of its obstacle.
        ways: what a unit of each obstacle's way adds to the rows of each contact, (m, obstacles).
    """
    body, places = problem.body, [problem.body.shifts] * len(forces)
    loads = {name: np.insert(work, places, 0.0) for name, work in problem.loads.items()}
    for (name, force), own in zip(forces.items(), np.eye(len(forces)), strict=True):
        loads[name] = np.insert(np.zeros(body.motions), places, force * own)
    return RigidProblem(
        body=JoinedBodies(body.bodies, body.index, tuple(forces)),
        loads=loads,
        fixed=tuple(np.insert(rows, places, 0.0, axis=1) for rows in problem.fixed),
        contact=tuple(np.insert(rows, places, way, axis=1) for rows, way in zip(problem.contact, ways, strict=True)),
        resistances=tuple(
            replace(part, fields=np.insert(part.fields, places, 0.0, axis=1)) for part in problem.resistances
        ),
        force=problem.force + sum(forces.values()),
    )


def without_obstacles(problem: RigidProblem, mode: Mode | None) -> Mode | None:
    """A motion as one of the body alone, with its whole name; None where the body rests.

    Args:
        problem: of the body and its obstacles.
        mode: one of its motions.
    """
    body = problem.body
    if mode is None:
        return mode
    own = np.delete(mode.coefficients, range(body.shifts - len(body.obstacles), body.shifts))
    return replace(mode, coefficients=tuple(map(float, own))) if own.any() else None
