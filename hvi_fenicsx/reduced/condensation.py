"""A system condensed to the unknowns of Γc that carry a bound or a law, as a problem of arrays.

All unknowns of Γc's vertices are kept first (:mod:`..system.interior`): with them a body is held. Those that carry
nothing are then eliminated as well, as far as the others hold the body: where a rigid motion leaves all bounds and laws
as they are, one unknown for each such motion stays. Where these are many, the stiffness is not formed
(:mod:`.factorised_stiffness`), and what carries nothing is not kept, as far as the others hold the body.
"""

from __future__ import annotations

from collections.abc import Callable, Collection
from contextlib import suppress
from dataclasses import dataclass

import numpy as np
from dolfinx import fem
from petsc4py import PETSc

from ..errors import SolverError
from ..runtime.mpi import total
from ..system import factorisation
from ..system.factorisation import form_of
from ..system.interior import PREFIX, Interior
from ..system.system import System
from ..typing import Array, Integers
from . import loading
from .condensed_problem import CondensedProblem
from .condensed_stiffness import CondensedStiffness, DenseStiffness
from .elimination import Elimination, balanced
from .factorised_stiffness import FactorisedStiffness
from .loading import Carriers


@dataclass(frozen=True, kw_only=True)
class CondensedForces:
    """Forces on the whole body, condensed.

    Attributes:
        body: on this rank's unknowns off the supports, (local unknowns,).
        kept: on all unknowns of Γc that the body keeps, (n of the interior,).
        condensed: on the condensed unknowns, (n,).
    """

    body: Array
    kept: Array
    condensed: Array


class Condensation:
    """A condensed system, which expands condensed unknowns to the whole body. Creation is collective.

    Args:
        system: the system, nothing held and without tangents of laws.
        scaled: names (``part.effect``) of the loads, prescribed displacements and obstacles that the factor scales;
            None: all but the obstacles, which stay where they have been moved to.
        largest_dense: unknowns of Γc's vertices up to which S is formed, unless factors have far fewer numbers; None:
            it is always formed.
        interrupted: whether to stop (collective), asked while S is formed.

    Attributes:
        problem: the arrays. Its unknowns x are those of Γc without λ times the obstacles' shift: their bounds stand.

    Raises:
        InputError: on all ranks alike: a name in ``scaled`` is none; a law on |u_t| cannot be condensed.
        SolverError: a body without contact is not held.
        Interrupted: on all ranks alike: it is to stop.
    """

    def __init__(
        self,
        system: System,
        scaled: Collection[str] | None = None,
        largest_dense: int | None = None,
        interrupted: Callable[[], bool] = lambda: False,
    ) -> None:
        self._system, self._loading = system, loading.loading_of(system, scaled)
        kept = np.setdiff1d(system.jacobian.rows.dofs, np.union1d(system.problem.fixed, system.pins))
        self._form = form_of(system, PREFIX)
        self._interior = interior = Interior(self._form, kept)
        laws = loading.laws_of(system, interior, self._loading.prescribed)
        found = loading.carriers_of(system, interior, laws, loading.obstacle_shift(system, scaled or ()))
        elastic: CondensedStiffness
        if largest_dense is not None and self._is_large(largest_dense, len(found.carrying)):
            chosen = self._reduce(found.carrying)
            found, laws = found.of(chosen), laws.renumbered(chosen)
            self._elimination = Elimination.of_none(self._interior.size)
            elastic = FactorisedStiffness(self._interior)
        else:
            whole = interior.stiffness(interrupted)
            self._elimination = Elimination.of(whole, found.carrying, system.thresholds.rounding)
            elastic = DenseStiffness(self._elimination.stiffness(whole))
        stay = self._elimination.stay
        self._shift = found.shift[stay]
        self.problem = self._condensed(elastic, found.of(stay), laws.renumbered(stay))

    def _is_large(self, most: int, carrying: int) -> bool:
        """Whether Γc has more unknowns, or products with S of those that carry take longer than solves with factors."""
        entries = 2.0 * factorisation.entries(self._interior.factors.pc) + self._system.thresholds.solve_overhead
        return self._interior.size > most or carrying**2 > entries

    def _reduce(self, carrying: Integers) -> Integers:
        """Keep those unknowns alone that carry something, where they hold the body; which are kept. Collective."""
        interior, every = self._interior, np.arange(self._interior.size)
        own = np.isin(every[interior.here], carrying)
        with suppress(SolverError):
            fewer = Interior(self._form, interior.kept[own])
            if fewer.is_held():
                interior.free()
                self._interior = fewer
                return carrying
            fewer.free()
        return every

    def _condensed(self, elastic: CondensedStiffness, found: Carriers, laws: loading.CondensedLaws) -> CondensedProblem:
        """The problem on the unknowns that stay, x of u = x + λ shift. Collective."""
        force, applied, constant, applied_constant = self._loads()
        if isinstance(elastic, DenseStiffness):
            stay, loads = self._elimination.stay, self._loading.lifted
            stiffness, force = balanced(self._system, self._interior, stay, elastic.array, force, loads)
            elastic = DenseStiffness(stiffness)
        (plain, rate), by = force.T, found.shift
        pull = elastic @ by
        return CondensedProblem(
            elastic=elastic,
            force=plain,
            force_rate=rate - pull,
            lower=found.lower,
            upper=found.upper,
            bonds=laws.bonds,
            prescribed_bonds=laws.prescribed,
            constant=constant + np.array([0.0, -plain @ by, (0.5 * pull - rate) @ by]),
            applied=applied,
            applied_constant=applied_constant,
            points=found.points,
            parts=tuple(found.parts),
        )

    def _loads(self) -> tuple[Array, Array, Array, Array]:
        """Condensed forces (n, 2), loads that do work (2, n), constants of the energy and of these. Collective."""
        interior, load, total = self._interior, self._loading, self._system.comm.allreduce
        fixed = self._system.problem.fixed_here
        inside = interior.solve(load.lifted)
        inside[fixed] = 0.0
        lifted = load.lifted.copy()
        lifted[fixed] = 0.0
        self._force = interior.gathered(lifted) - interior.pulled(inside)
        held = 0.5 * load.prescribed.T @ load.pulled - load.prescribed.T @ load.applied
        constant = total(held - 0.5 * lifted.T @ inside[: len(lifted)]) - 0.5 * self._elimination.works(
            self._force, self._force
        )
        product, outer = self.products(load.working)
        return self._elimination.reduced(self._force), outer, _quadratic(constant), _quadratic(product)

    def products(self, vectors: Array) -> tuple[Array, Array]:
        """The products of vectors c with the body's displacement u: c·u = constants + λ rates + rows x. Collective.

        Args:
            vectors: c as columns, in the components of the unknowns, (local unknowns, k).

        Returns:
            Constants and rates, (k, 2); rows, (k, n).
        """
        interior = self._interior
        outer = interior.loads(vectors)
        inside = interior.solve(self._loading.lifted)[: len(vectors)]
        inside = self._system.comm.allreduce(vectors.T @ inside)
        rows = self._elimination.reduced(outer)
        constants = inside + self._elimination.works(outer, self._force)
        constants[:, 1] += rows.T @ self._shift
        return constants, rows.T

    def expand(self, x: Array, factor: float = 1.0) -> PETSc.Vec:
        """The unknowns of the whole body in equilibrium with condensed ones. Collective.

        Args:
            x: the condensed unknowns, (n,).
            factor: λ.
        """
        found = self._system.load.duplicate()
        weights = np.array([1.0, factor])
        kept = self._elimination.completed(x + factor * self._shift, self._force @ weights)
        found.array[:] = self._interior.expand(kept, self._loading.lifted @ weights)
        return found

    def displacement(self, x: Array, factor: float = 1.0) -> fem.Function:
        """The displacement field of the whole body in equilibrium with condensed unknowns. Collective.

        Args:
            x: the condensed unknowns, (n,).
            factor: λ.
        """
        unknowns = self.expand(x, factor)
        found = self._system.displacement(unknowns)
        unknowns.destroy()
        return found

    def restricted(self, u: fem.Function, factor: float = 1.0) -> Array:
        """The condensed unknowns of a displacement of the whole body, (n,). Collective.

        Args:
            u: the displacement field.
            factor: λ.
        """
        unknowns = self._system.unknowns(u)
        kept = self._interior.gathered(unknowns.array_r)
        unknowns.destroy()
        return kept[self._elimination.stay] - factor * self._shift

    def load(self, factor: float = 1.0) -> PETSc.Vec:
        """The system's load at a factor, prescribed values in their rows, as :attr:`.System.load`. Collective.

        Args:
            factor: λ.
        """
        found = self._system.load.duplicate()
        found.array[:] = self._loading.lifted @ np.array([1.0, factor])
        return found

    def spread(self, forces: Array) -> PETSc.Vec:
        """Forces on the condensed unknowns as forces on the whole body, in the components of the unknowns.

        Args:
            forces: (n,).
        """
        interior, whole = self._interior, np.zeros(self._interior.size)
        whole[self._elimination.stay] = forces
        found = self._system.load.duplicate()
        found.array[interior.kept] = whole[interior.here]
        return found

    def forces(self, body: Array) -> CondensedForces:
        """Forces on the whole body as forces on the condensed unknowns. Collective.

        Args:
            body: on this rank's unknowns, in their components, (local unknowns,); what is on supports these carry.
        """
        body[self._system.problem.fixed_here] = 0.0
        kept = self._interior.loads(body[:, None])[:, 0]
        return CondensedForces(body=body, kept=kept, condensed=self._elimination.reduced(kept))

    def change(self, x: Array, forces: CondensedForces) -> Array:
        """How the unknowns of the whole body change, in balance with forces, where condensed ones do. Collective.

        Args:
            x: change of the condensed unknowns, (n,).
            forces: on the body.

        Returns:
            The change of this rank's unknowns, (local unknowns,).
        """
        return self._interior.expand(self._elimination.completed(x, forces.kept), forces.body)

    def unbalanced(self, reaction: PETSc.Vec, carried: PETSc.Vec) -> float:
        """What is left of forces on the body once contact and laws carry theirs. Collective.

        Args:
            reaction: internal forces minus loads of the whole body, in the components of the unknowns.
            carried: by contact and laws, likewise.

        Returns:
            The Euclidean norm off the supports.
        """
        left = reaction.array - carried.array
        left[np.union1d(self._system.problem.fixed_here, self._system.pins)] = 0.0
        return float(np.sqrt(total(self._system.comm, float(left @ left))))

    def free(self) -> None:
        """Free the PETSc objects, those of the problem's stiffness too. Collective."""
        self.problem.elastic.free()
        self._interior.free()
        self._form.free()


def _quadratic(products: Array) -> Array:
    """c0, c1, c2 of the bilinear form at (1, λ)."""
    return np.array([products[0, 0], products[0, 1] + products[1, 0], products[1, 1]])
