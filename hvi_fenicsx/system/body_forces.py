"""Forces on a whole body whose other unknowns are condensed to some of Γc, and how the body moves with them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from petsc4py import PETSc

from ..runtime.mpi import total
from ..typing import Array
from .elimination import Elimination
from .interior import Interior
from .system import System


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


class BodyForces:
    """Forces on a condensed body.

    Args:
        system: the system.
        interior: the body with unknowns of Γc held.
        elimination: of those of them that carry nothing.
    """

    def __init__(self, system: System, interior: Interior, elimination: Elimination) -> None:
        self._system, self._interior, self._elimination = system, interior, elimination

    def spread(self, forces: Array) -> PETSc.Vec:
        """Forces on the condensed unknowns as forces on the whole body, in the components of the unknowns.

        Args:
            forces: (n,).
        """
        interior, whole = self._interior, np.zeros(self._interior.size)
        whole[self._elimination.stay] = forces
        found = self._system.load.duplicate()
        found.array[interior.kept] = interior.own_part(whole)
        return found

    def condensed(self, forces: Array) -> CondensedForces:
        """Forces on the whole body as forces on the condensed unknowns. Collective.

        Args:
            forces: on this rank's unknowns, in their components, (local unknowns,).
        """
        body = self._free(forces)
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

    def _free(self, forces: Array) -> Array:
        """Forces off the supports, which carry the others, (local unknowns,)."""
        found = np.array(forces)
        found[self._system.problem.fixed_here] = 0.0
        return found

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
