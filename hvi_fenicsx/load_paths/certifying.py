"""Is a state of a path an equilibrium? On Γc for each, for the whole body as often as it costs little.

On Γc: each unknown must be on the graph of its laws and bounds, with the force that the body leaves there; S and f come
from the factorised body. The certificate of the whole body (:mod:`..certify`) reassembles all forces from the forms;
where bonds remember, what was judged on Γc must be what these forces leave there. So it must at states where loads and
what moves the body are nothing beside those of the whole programme, as where an obstacle just touches it, or where no
force acts: there is nothing else by which to measure what is left of forces.

Where rounding alone may speak against a state, its displacement is corrected by Newton steps along the graphs, with
forces by cell; the corrected one is then the state's.
"""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass, replace

import numpy as np
from dolfinx import fem

from ..certify import balance, certificate, contact_state
from ..certify.thresholds import DEFAULT as THRESHOLDS
from ..paths.distances import Distances, StateOnGraphs
from ..paths.state import Event, PathState
from ..problem import references
from ..problem.problem import FactoredProblem, Problem
from ..problem.vectors import product
from ..reduced.condensation import Condensation
from ..runtime.mpi import total
from ..solvers import frozen_mixity
from ..system.system import System
from ..typing import Array, magnitude

ALWAYS = (Event.START, Event.JUMP, Event.TURN, Event.END)
"""The events whose states are examined with the whole body, and that a film shows first."""
FIRST = 100
"""So many states are examined in any case; of twice as many each second one, and so on."""


@dataclass(frozen=True, kw_only=True)
class StateVerdict:
    """What was found of a state.

    Attributes:
        certified: whether all that was looked at is within the tolerance.
        whole: whether the whole body was looked at.
        corrected: whether it is the corrected displacement that is certified.
    """

    certified: bool
    whole: bool
    corrected: bool = False


class Certifier:
    """Certifies the states of one path. Creation is collective.

    Args:
        system: the system.
        condensation: its condensation.
        factored: its problem at any factor.
        tolerance: relative.
        remember: numbers of the condensed problem's bonds that remember.
        largest: factor of the programme, in size.
    """

    def __init__(
        self,
        system: System,
        condensation: Condensation,
        factored: FactoredProblem,
        tolerance: float,
        remember: Collection[int],
        largest: float,
    ) -> None:
        self._system, self._condensation, self._factored = system, condensation, factored
        self._tolerance, self._remember = tolerance, remember
        self._distance = Distances(condensation.problem, remember)
        self._whole_drive, load = self._drive(largest), condensation.load(largest)
        self._whole_load = max(float(np.linalg.norm(condensation.problem.load(largest))), float(load.norm()))
        load.destroy()

    def verdict(self, state: PathState, number: int) -> StateVerdict:
        """What a state is found to be. Collective.

        Args:
            state: the state.
            number: of its row.
        """
        on_graphs = self._distance(state) <= self._tolerance
        # fewer and fewer rows the longer the path is
        if state.event not in ALWAYS and number % (1 << (number // FIRST).bit_length()):
            return StateVerdict(certified=on_graphs, whole=False)
        u = self._condensation.displacement(state.x, state.factor)
        found = self._examination(state, u)
        if (on_graphs or found is not None) and self._passes(state, u, found):
            return StateVerdict(certified=True, whole=True)
        corrected = self._refined(state, found) is not None
        return StateVerdict(certified=corrected, whole=True, corrected=corrected)

    def displacement(self, state: PathState, verdict: StateVerdict) -> fem.Function:
        """The displacement of the whole body that was certified, nondimensional, ghosts updated. Collective.

        Args:
            state: the state.
            verdict: what was found of it.
        """
        u = self._condensation.displacement(state.x, state.factor)
        found = self._refined(state, self._examination(state, u)) if verdict.corrected else None
        return u if found is None else found

    def _examination(self, state: PathState, u: fem.Function) -> certificate.Examination | None:
        """What the certificate of a single run says of a displacement; None: it cannot judge the state. Collective."""
        turned_back = state.memory is not None and np.any(state.memory)  # then bonds are not as the laws say
        if turned_back or self._is_unloaded(state):
            return None
        problem = self._factored.at(state.factor)
        frozen_mixity.freeze(problem, u)
        return certificate.examine(problem, u, self._tolerance)

    def _passes(self, state: PathState, u: fem.Function, found: certificate.Examination | None) -> bool:
        if found is not None:
            return found.certificate.passed
        forces = contact_state.forces(self._factored.at(state.factor), u)
        problem = self._condensation.problem
        carried = problem.elastic @ state.x - problem.load(state.factor)
        return self._in_balance(state, u, forces, carried)

    # -- where rounding speaks against a state

    def _refined(self, state: PathState, found: certificate.Examination | None) -> fem.Function | None:
        """What Newton steps along the graphs, with what bonds remember, leave of rounding; None: it does not help."""
        if found is not None and not found.certificate.is_near:
            return None
        problem = self._factored.at(state.factor)
        try:
            graphs = StateOnGraphs(self._condensation.problem, self._remember, state)
            other = self._stepped(problem, graphs, state.factor)
        except np.linalg.LinAlgError:
            return None
        change, size = (magnitude(x) for x in (other.x - state.x, state.x))
        near = change <= THRESHOLDS.largest_rounding * size  # the steps took out no more than rounding
        return other.u if near and self._is_certified(state, other) else None

    def _stepped(self, problem: Problem, graphs: StateOnGraphs, factor: float) -> Refined:
        """A state after the steps. Collective."""
        system, condensation = self._system, self._condensation
        unknowns = condensation.expand(graphs.x, factor)
        for _ in range(_STEPS):
            forces = contact_state.forces(problem, system.displacement(unknowns))
            left, carried = system.turned(forces.reaction), condensation.spread(-graphs.force)
            left.axpy(-1.0, carried)
            missing = condensation.forces(-left.array_r)
            before = graphs.x
            graphs.take(missing.condensed)
            unknowns.array[:] += condensation.change(graphs.x - before, missing)
            for vector in (left, carried):
                vector.destroy()
        u = system.displacement(unknowns)
        unknowns.destroy()
        return Refined(u=u, x=graphs.x, force=graphs.force, forces=contact_state.forces(problem, u))

    def _is_certified(self, state: PathState, found: Refined) -> bool:
        """Whether forces by cell balance, and those on Γc are on the graphs. Collective."""
        if self._distance(replace(state, x=found.x), found.force) > self._tolerance:
            return False
        judged = self._examination(state, found.u)
        if judged is None:
            return self._in_balance(state, found.u, found.forces, -found.force)
        return judged.certificate.passed

    def _is_unloaded(self, state: PathState) -> bool:
        """Whether what drives the body is less than the tolerance of that in the whole programme. Collective."""
        return self._drive(state.factor) <= self._tolerance * self._whole_drive

    def _drive(self, factor: float) -> float:
        """The norm of loads and prescribed displacements, or what laws and obstacles demand at rest. Collective.

        An obstacle that has not come to the body yet drives nothing, however far it has moved.
        """
        load, demanded = self._condensation.load(factor), references.demanded(self._factored.at(factor))
        found = max(float(load.norm()), float(np.max(demanded)))
        load.destroy()
        return found

    def _in_balance(self, state: PathState, u: fem.Function, forces: contact_state.Forces, carried: Array) -> bool:
        """Whether forces from the forms are those that were judged on Γc, and none are left elsewhere. Collective.

        What bonds remember is in their graphs on Γc, not in the laws that the certificate of a single run knows. As
        there, what rounding makes of the stresses is excused, and no net force.
        """
        acting, spread = self._system.turned(forces.reaction), self._condensation.spread(carried)
        left, given = self._condensation.unbalanced(acting, spread), product(spread, self._system.rotation)
        for vector in (acting, spread):
            vector.destroy()
        size = max(self._norm(f) for f in (forces.load, forces.reaction))
        nothing = self._is_unloaded(state) or size <= self._tolerance * self._whole_load
        size = max(size, self._whole_load if nothing else 0.0) or 1.0
        problem = self._factored.at(state.factor)
        return left <= self._tolerance * size or self._is_rounding(left / size, problem, u, forces, given, size)

    def _is_rounding(
        self, left: float, problem: Problem, u: fem.Function, forces: contact_state.Forces, carried: Array, size: float
    ) -> bool:
        """Whether what is left is no more than the last digits of u make, and the net forces balance. Collective."""
        if left > THRESHOLDS.largest_rounding:
            return False
        sample = balance.unbalanced(problem, balance.rounding_sample(problem, u.x.array), ())
        if left * size > THRESHOLDS.rounding_safety * self._norm(sample):
            return False
        known, given = references.of(problem, forces.load), carried.reshape(forces.load.shape)
        net = balance.net_forces(known, forces, (), u, given)
        return bool(np.all(net <= self._tolerance))

    def _norm(self, values: Array) -> float:
        return float(np.sqrt(total(self._system.comm, float(np.sum(values**2)))))


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
    forces: contact_state.Forces
