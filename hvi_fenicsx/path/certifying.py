"""Is a state of a path an equilibrium? On Γc for each, for the whole body as often as it costs little.

On Γc: each unknown must be on the graph of its laws and bounds, with the force that the body leaves there; S and f come
from the factorised body. The certificate of the whole body (:mod:`.certify`) reassembles all forces from the forms.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..certify import certificate
from ..problem.factored_problem import FactoredProblem
from ..system.condensation import Condensation
from ..system.system import System
from ..typing import Array
from .bonds import BondTable
from .segments import Segment
from .state import Event, PathState

ALWAYS = frozenset({Event.START, Event.JUMP, Event.TURN, Event.END})
"""The events whose states are examined with the whole body."""
FIRST = 100
"""So many states are examined in any case; of twice as many each second one, and so on."""


@dataclass(frozen=True, kw_only=True)
class Verdict:
    """What was found of a state.

    Attributes:
        certified: whether all that was looked at is within the tolerance.
        whole: whether the whole body was looked at.
    """

    certified: bool
    whole: bool


class Certifier:
    """Certifies the states of one path. Creation is collective.

    Args:
        system: the system.
        condensation: its condensation.
        factored: its problem at any factor.
        tolerance: relative.
        remember: numbers of the problem's bonds that remember.
    """

    def __init__(
        self,
        system: System,
        condensation: Condensation,
        factored: FactoredProblem,
        tolerance: float,
        remember: range,
    ) -> None:
        self._system, self._condensation, self._factored = system, condensation, factored
        self._tolerance, self._bonds = tolerance, BondTable(condensation.problem, remember)
        self._rows: list[list[int]] = [[] for _ in range(condensation.problem.size)]
        for row, bond in enumerate(self._bonds.bonds):
            self._rows[bond.unknown].append(row)
        self._chains: dict[tuple[int, bytes], tuple[Segment, ...]] = {}

    def verdict(self, state: PathState, number: int) -> Verdict:
        """What a state is found to be. Collective.

        Args:
            state: the state.
            number: of its row.
        """
        on_surface = self._distance(state) <= self._tolerance
        whole = _plain(state) and (state.event in ALWAYS or is_examined(number))
        return Verdict(certified=on_surface and (not whole or self._examined(state)), whole=whole)

    def _distance(self, state: PathState) -> float:
        """How far the state is from the graphs, relative to the forces."""
        problem = self._condensation.problem
        elastic, load = problem.stiffness @ state.x, problem.load(state.factor)
        force, diagonal = load - elastic, np.diag(problem.stiffness)
        size = max(float(np.max(np.abs(f), initial=0.0)) for f in (elastic, load, problem.force_rate)) or 1.0
        chains = self._all_chains(state.memory)
        values = zip(chains, *(map(float, v) for v in (state.x, force, diagonal)), strict=True)
        away = (min(segment.distance(x, f, k) for segment in chain) for chain, x, f, k in values)
        return max(away, default=0.0) / size

    def _all_chains(self, memory: Array | None) -> list[tuple[Segment, ...]]:
        """The graphs of all unknowns; those with an equal memory are made once."""
        if memory is not None:
            self._bonds.restore(memory)
        return [self._chain(i, memory) for i in range(self._condensation.problem.size)]

    def _chain(self, unknown: int, memory: Array | None) -> tuple[Segment, ...]:
        key = unknown, b"" if memory is None else memory[self._rows[unknown]].tobytes()
        if key not in self._chains:
            self._chains[key] = self._bonds.chain(unknown)
        return self._chains[key]

    def _examined(self, state: PathState) -> bool:
        """Whether the certificate of the whole body passes. Collective."""
        u = self._system.displacement(self._condensation.expand(state.x, state.factor))
        found = certificate.examine(self._factored.at(state.factor), u, self._tolerance)
        return found.certificate.passed


def is_examined(number: int) -> bool:
    """Whether a row is among those whose whole body is examined: fewer and fewer of them the longer a path is.

    Args:
        number: of the row, from 0.
    """
    return number % (1 << (number // FIRST).bit_length()) == 0


def _plain(state: PathState) -> bool:
    """Whether the bonds are as the laws say: none has turned back so far."""
    return state.memory is None or not np.any(state.memory)
