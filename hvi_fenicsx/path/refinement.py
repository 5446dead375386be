"""Newton steps on Γc with forces by cell, where bonds remember: rounding of the matrix taken out of a state.

As :mod:`..certify.correction`; but a bond that has turned back is on its secant, and what it carries there is known to
the path alone. So the step goes along the graphs on which the path is: contacts and bonds that stand keep their place,
the others their piece.
"""

from __future__ import annotations

from dataclasses import dataclass

from dolfinx import fem
from petsc4py import PETSc

from ..certify import contact_state
from ..certify.contact_state import Forces
from ..equilibrium_paths.kinds import Graphs
from ..problem.problem import Problem
from ..problem.vectors import turn
from ..reduced.condensation import Condensation
from ..system.system import System
from ..typing import Array

_STEPS = 3
"""The first may end where an unknown comes to the end of its piece."""


@dataclass(frozen=True, kw_only=True)
class Refined:
    """A state and its forces by cell.

    Attributes:
        u: the displacement of the whole body, nondimensional, ghosts updated.
        x: of the condensed unknowns, (n,).
        force: of laws and bounds there, (n,).
        forces: of the whole body.
    """

    u: fem.Function
    x: Array
    force: Array
    forces: Forces


def reaction(system: System, forces: Forces) -> PETSc.Vec:
    """Internal forces minus loads in the components of the unknowns.

    Args:
        system: whose unknowns they are.
        forces: by cell.
    """
    found = system.load.duplicate()
    found.array[:] = forces.reaction.ravel()
    turn(found, system.rotation)
    return found


def refined(system: System, condensation: Condensation, problem: Problem, graphs: Graphs, factor: float) -> Refined:
    """A state after the steps. Collective.

    Args:
        system: the system.
        condensation: its condensation.
        problem: at the state's factor.
        graphs: the state.
        factor: λ.

    Raises:
        numpy.linalg.LinAlgError: the equations of the state are singular.
    """
    unknowns = condensation.expand(graphs.x, factor)
    for _ in range(_STEPS):
        forces = contact_state.forces(problem, system.displacement(unknowns))
        left, carried = reaction(system, forces), condensation.forces.spread(-graphs.force)
        left.axpy(-1.0, carried)
        missing = condensation.forces.condensed(-left.array_r)
        before = graphs.x
        graphs.take(missing.condensed)
        unknowns.array[:] += condensation.forces.change(graphs.x - before, missing)
        for vector in (left, carried):
            vector.destroy()
    u = system.displacement(unknowns)
    unknowns.destroy()
    return Refined(u=u, x=graphs.x, force=graphs.force, forces=contact_state.forces(problem, u))
