"""A system condensed to the unknowns of Γc that carry a bound or a law, as a dense problem of arrays.

All unknowns of Γc's vertices are kept first (:mod:`.interior`): with them a body is held. Those that carry nothing are
then eliminated as well, as far as the others hold the body: where a rigid motion leaves all bounds and laws as they
are, one unknown for each such motion stays.
"""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass, replace

import numpy as np
from petsc4py import PETSc
from scipy.linalg import cho_factor, cho_solve
from scipy.linalg.lapack import dpstrf

from ..errors import InputError
from ..runtime.mpi import agree
from ..typing import Array, Integers
from . import condensed_laws, loading
from .condensed_problem import CondensedProblem
from .interior import Interior
from .system import System


@dataclass(frozen=True, kw_only=True)
class _Carriers:
    """The vertices' unknowns, the same on all ranks.

    Attributes:
        lower: bounds, (n,).
        upper: bounds, (n,).
        points: vertices, m, (n, 3).
        parts: the part whose contact bounds the unknown, (n,).
        carrying: numbers of those that carry a bound or a law.
        shift: by how much obstacles that the factor moves have moved the bounds, which are those without, (n,).
    """

    lower: Array
    upper: Array
    shift: Array
    points: Array
    parts: tuple[str, ...]
    carrying: Integers


class Condensation:
    """A condensed system, which expands condensed unknowns to the whole body. Creation is collective.

    Args:
        system: the system, nothing held and without tangents of laws.
        scaled: names (``part.effect``) of the loads, prescribed displacements and obstacles that the factor scales;
            None: all but the obstacles, which stay where they have been moved to.

    Attributes:
        problem: the arrays. Its unknowns x are those of Γc without λ times the obstacles' shift: their bounds stand.

    Raises:
        InputError: on all ranks alike: a name in ``scaled`` is none; a law on |u_t| cannot be condensed.
        SolverError: a body without contact is not held.
    """

    def __init__(self, system: System, scaled: Collection[str] | None = None) -> None:
        self._system, self._loading = system, loading.make(system, scaled)
        kept = np.setdiff1d(system.jacobian.rows.dofs, np.union1d(system.problem.fixed, system.pins))
        self._interior = Interior(system, kept)
        laws = condensed_laws.make(system, self._interior, self._loading.prescribed)
        carriers = _carriers(system, self._interior, laws, loading.obstacle_shift(system, scaled or ()))
        whole = self._interior.stiffness()
        self._split(whole, carriers.carrying)
        self.problem = self._condensed(whole, carriers, laws)

    def _split(self, whole: Array, carrying: Integers) -> None:
        """Which of Γc's unknowns are eliminated, and their factorised stiffness."""
        rest = np.setdiff1d(np.arange(len(whole)), carrying)
        gone = rest[_regular(whole[np.ix_(rest, rest)], len(whole) * self._system.thresholds.rounding)]
        self._gone, self._stay = np.sort(gone), np.setdiff1d(np.arange(len(whole)), gone)
        self._factor = cho_factor(whole[np.ix_(self._gone, self._gone)]) if self._gone.size else None
        self._coupling = whole[np.ix_(self._gone, self._stay)]

    def _eliminated(self, right: Array) -> Array:
        """The inverse stiffness of the eliminated unknowns times columns."""
        return right if self._factor is None else np.asarray(cho_solve(self._factor, right))

    def _condensed(self, whole: Array, carriers: _Carriers, laws: condensed_laws.CondensedLaws) -> CondensedProblem:
        """The problem on the unknowns that stay. Collective."""
        stay, at = self._stay, self._coupling
        stiffness = whole[np.ix_(stay, stay)] - at.T @ self._eliminated(at)
        self._shift = carriers.shift[stay]
        force, applied, constant, applied_constant = self._loads()
        laws = laws.renumbered(stay, len(whole))
        return _shifted(
            self._shift,
            CondensedProblem(
                stiffness=0.5 * (stiffness + stiffness.T),
                force=force[:, 0],
                force_rate=force[:, 1],
                lower=carriers.lower[stay],
                upper=carriers.upper[stay],
                bonds=laws.bonds,
                prescribed_bonds=laws.prescribed,
                constant=constant,
                applied=applied.T,
                applied_constant=applied_constant,
                points=carriers.points[stay],
                parts=tuple(carriers.parts[i] for i in stay),
            ),
        )

    def _loads(self) -> tuple[Array, Array, Array, Array]:
        """Condensed forces and applied loads (n, 2), and the constants of the energy and of <g, u>. Collective."""
        interior, load, total = self._interior, self._loading, self._system.comm.allreduce
        fixed = self._system.problem.fixed_here
        inside = interior.solve(load.lifted)
        inside[fixed] = 0.0
        lifted = load.lifted.copy()
        lifted[fixed] = 0.0
        self._force = interior.gathered(lifted) - interior.pulled(inside)
        held = 0.5 * load.prescribed.T @ load.pulled - load.prescribed.T @ load.applied
        moved = self._eliminated(self._force[self._gone])
        constant = total(held - 0.5 * lifted.T @ inside) - 0.5 * self._force[self._gone].T @ moved
        force = self._force[self._stay] - self._coupling.T @ moved
        product, outer = self.products(load.applied)
        return force, outer.T, _quadratic(constant), _quadratic(product)

    def products(self, vectors: Array) -> tuple[Array, Array]:
        """The products of vectors c with the body's displacement u: c·u = constants + λ rates + rows x. Collective.

        Args:
            vectors: c as columns, in the components of the unknowns, (local unknowns, k).

        Returns:
            Constants and rates, (k, 2); rows, (k, n).
        """
        interior = self._interior
        outer = interior.gathered(vectors) - interior.pulled(interior.solve(vectors))
        gone = self._eliminated(outer[self._gone])
        inside = self._system.comm.allreduce(vectors.T @ interior.solve(self._loading.lifted))
        rows = outer[self._stay] - self._coupling.T @ gone
        constants = np.asarray(inside + gone.T @ self._force[self._gone])
        constants[:, 1] += rows.T @ self._shift
        return constants, np.asarray(rows.T)

    def values(self, x: Array, factor: float = 1.0) -> Array:
        """The displacements of all unknowns of Γc that the body keeps, (n of the interior,).

        Args:
            x: the condensed unknowns, (n,).
            factor: λ.
        """
        found = np.empty(self._interior.size)
        found[self._stay] = x + factor * self._shift
        load = self._force[self._gone] @ np.array([1.0, factor])
        found[self._gone] = self._eliminated(load - self._coupling @ found[self._stay])
        return found

    def expand(self, x: Array, factor: float = 1.0) -> PETSc.Vec:
        """The unknowns of the whole body in equilibrium with condensed ones. Collective.

        Args:
            x: the condensed unknowns, (n,).
            factor: λ.
        """
        found = self._system.load.duplicate()
        right = self._loading.lifted @ np.array([1.0, factor])
        found.array[:] = self._interior.expand(self.values(x, factor), right)
        return found

    def load(self, factor: float = 1.0) -> PETSc.Vec:
        """The system's load at a factor, prescribed values in their rows, as :attr:`.System.load`. Collective.

        Args:
            factor: λ.
        """
        found = self._system.load.duplicate()
        found.array[:] = self._loading.lifted @ np.array([1.0, factor])
        return found

    def reactions(self, u: PETSc.Vec, factor: float = 1.0) -> Array:
        """Forces A u - g at this rank's unknowns: where a support, contact or a law holds the body. Collective.

        Args:
            u: the unknowns of the whole body, as :meth:`expand` finds them.
            factor: λ.
        """
        weights, fixed, out = np.array([1.0, factor]), self._system.problem.fixed_here, u.duplicate()
        self._system.jacobian.elastic_product(u, out)
        found = np.asarray(out.array_r - self._loading.lifted @ weights)
        applied = self._loading.applied @ weights
        found[fixed] = self._system.holding.at_prescribed(u, self._system.rotation) - applied[fixed]
        return found

    def unbalanced(self, reaction: PETSc.Vec, x: Array, factor: float) -> float:
        """What is left of forces on the body once contact and laws carry S x - f at their unknowns. Collective.

        Args:
            reaction: internal forces minus loads of the whole body, in the components of the unknowns.
            x: the condensed unknowns, (n,).
            factor: λ.

        Returns:
            The Euclidean norm off the supports.
        """
        interior, carried = self._interior, np.zeros(self._interior.size)
        carried[self._stay] = self.problem.stiffness @ x - self.problem.load(factor)
        left = reaction.array.copy()
        left[interior.kept] -= carried[interior.first : interior.first + len(interior.kept)]
        left[np.union1d(self._system.problem.fixed_here, self._system.pins)] = 0.0
        return float(np.sqrt(self._system.comm.allreduce(float(left @ left))))

    def free(self) -> None:
        """Free the PETSc objects."""
        self._interior.free()


def _regular(matrix: Array, tolerance: float) -> Integers:
    """Numbers of the unknowns in a greatest regular part of a semidefinite matrix (pivoted Cholesky)."""
    if not matrix.size:
        return np.empty(0, np.int64)
    _, pivots, rank, _ = dpstrf(matrix, tol=tolerance * float(np.max(np.diag(matrix))), lower=1)
    return np.asarray(pivots[:rank] - 1, dtype=np.int64)


def _shifted(by: Array, problem: CondensedProblem) -> CondensedProblem:
    """The problem in the unknowns x of u = x + λ shift, from that in u."""
    pull = problem.stiffness @ by
    energy = [0.0, -float(problem.force @ by), float((0.5 * pull - problem.force_rate) @ by)]
    return replace(
        problem,
        force_rate=problem.force_rate - pull,
        constant=problem.constant + np.array(energy),
    )


def _quadratic(products: Array) -> Array:
    """c0, c1, c2 of the bilinear form at (1, λ)."""
    return np.array([products[0, 0], products[0, 1] + products[1, 0], products[1, 1]])


def _refuse_laws(laws: condensed_laws.CondensedLaws, shift: Array) -> None:
    """Laws act on the body's own displacement, which is not that relative to an obstacle."""
    for bonds in laws.bonds:
        if np.any(shift[bonds.unknowns] != 0.0):
            raise InputError(
                f"boundary.{bonds.part}: the path moves an obstacle along the displacement that this "
                "law acts on; leave the vertices that both parts share out of one of them (where)"
            )


def _carriers(system: System, interior: Interior, laws: condensed_laws.CondensedLaws, moved: Array) -> _Carriers:
    """What the kept unknowns carry. Collective."""
    lower, upper, shift = (interior.gathered(v) for v in (system.lower.array_r, system.upper.array_r, moved))
    bounded = np.isfinite(lower) | np.isfinite(upper)
    with_law = [b.unknowns.ravel() for b in laws.bonds]
    d = system.problem.scales.dimension
    named = np.full(system.load.local_size, "", dtype=object)
    for bounds in system.bounds:
        named[bounds.component()[0]] = bounds.surface.part
    _refuse_laws(laws, shift)
    return _Carriers(
        lower=lower - shift,
        upper=upper - shift,
        shift=shift,
        points=np.concatenate(agree(system.comm, system.problem.points[interior.kept // d])),
        parts=tuple(str(p) if b else "" for p, b in zip(interior.gathered(named), bounded, strict=True)),
        carrying=np.unique(np.concatenate([np.flatnonzero(bounded), *with_law])).astype(np.int64),
    )
