"""A prepared scene followed over its load factor: states, certified, as rows in SI."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Iterable, Iterator
from dataclasses import asdict
from typing import Any

import numpy as np
from dolfinx import fem

from ..errors import InputError
from ..model import PathTable
from ..paths.follower import Follower
from ..paths.load_path import LoadPath, PathRow
from ..paths.state import End, Event, EventPlace, Follow, PathOptions, PathState, Position
from ..problem.problem import FactoredProblem, Problem
from ..reduced import loading
from ..reduced.condensation import Condensation
from ..runtime.writing import Record
from ..solvers import obstacle_force
from ..solvers.method import never
from ..system import existence
from ..workflow import Preparation
from .certifying import Certifier, StateVerdict
from .measures import Measures


class PathRun:
    """The path of a prepared scene. Creation is collective.

    Args:
        prepared: the scene, assembled.
        wanted: what path is wanted.
        interrupted: whether to stop (collective), asked while the body is condensed and files are written.

    Raises:
        InputError: on all ranks alike: the path cannot be followed.
        Interrupted: on all ranks alike: it is to stop.

    Attributes:
        prepared: the scene.
        wanted: what path is wanted.
        scaled: the names of what the factor multiplies.
        condensed: what is followed, on Γc.
        states: those found so far.
    """

    def __init__(self, prepared: Preparation, wanted: PathTable, interrupted: Callable[[], bool] = never) -> None:
        self.prepared, self.wanted, self.interrupted = prepared, wanted, interrupted
        system = prepared.system
        obstacle_force.refuse(system.problem, "no path is followed")
        known = loading.load_names(system)
        self.scaled = known if wanted.scaled is None else wanted.scaled
        if not known:
            raise InputError("path: nothing drives the body; add a load or a prescribed displacement")
        with prepared.timer("setup"):
            self._condensation = Condensation(system, self.scaled, system.thresholds.largest_dense, interrupted)
            self._measures = Measures(system, self._condensation, self.scaled, remember=wanted.memory)
        self.condensed = self._condensation.problem
        self._remember = range(len(self.condensed.bonds) if wanted.memory else 0)
        self._factored = FactoredProblem(system.problem, self.scaled)
        self._certifier = Certifier(
            system,
            self._condensation,
            self._factored,
            prepared.options.tolerance,
            self._remember,
            largest=max(wanted.to, key=abs),
        )
        self.states: list[PathState] = []
        self._verdicts: list[StateVerdict] = []
        self._rows: list[PathRow] = []
        self._reached = 0.0, 0.0

    def follow(
        self,
        known: Iterable[Record] = (),
        keep: Callable[[Record], None] = lambda record: None,
        interrupted: Callable[[], bool] = never,
    ) -> LoadPath:
        """Follow the path to its end. Collective.

        Args:
            known: the records of its first states, from which to go on.
            keep: is given the record of each new state, on all ranks.
            interrupted: whether to stop (collective); asked at each state, and at each step of a jump.

        Raises:
            InputError: on all ranks alike: the path cannot be followed.
        """
        # why it ends is found again
        for one in itertools.takewhile(lambda record: record["event"] != Event.END, known):
            self._take(*_state_of(one))
        wanted = self.wanted
        options = PathOptions(
            programme=wanted.to,
            follow=Follow(wanted.follow),
            remember=self._remember,
            stops=wanted.contact_at,
            **self._limits(),
        )
        resume = self.states[-1] if self.states else None
        follower = Follower(self.condensed, options, resume, interrupted)
        with self.prepared.timer("solve"):
            for state in follower.states():
                if follower.end is End.INTERRUPTED or not np.isfinite([state.factor, *state.x]).all():
                    break  # a last state that is no event: the path goes on from the one before
                with self.prepared.timer("certificate"):
                    verdict = self._certifier.verdict(state, len(self.states))
                self._take(state, verdict)
                keep({**asdict(state), "verdict": asdict(verdict)})
        return LoadPath(
            dimension=self.prepared.problem.dimension,
            scaled=self.scaled,
            rows=tuple(self._rows),
            end=str(follower.end or End.LOST),
            reason=follower.reason,
            examined=sum(verdict.whole for verdict in self._verdicts),
        )

    def _limits(self) -> dict[str, Any]:
        """With which factors there is an equilibrium, and with which none, where rigid motions tell. Collective.

        Where supports and obstacles are moved to does not matter to them, nor do given strains.
        """
        loads = existence.loads_of_rigid_motions(self.prepared.problem, self.prepared.system.forces)
        scaled = sorted(loads.keys() & set(self.scaled))
        if not scaled:
            return {"borne": (np.inf, -np.inf)} if self.prepared.solvability.state == "escapes" else {}
        known = self.prepared.load_factors(*scaled)
        return {"borne": (known.peak_from, known.peak), "held": (known.held_from, known.held)}

    def _take(self, state: PathState, verdict: StateVerdict) -> None:
        """Add a state and its row."""
        self.states.append(state)
        self._verdicts.append(verdict)
        low, high = self._reached
        self._reached = min(low, state.factor), max(high, state.factor)
        scales, place = self.prepared.problem.scales, state.place
        row = PathRow(
            factor=state.factor,
            event=str(state.event),
            part=None if place is None else place.part,
            point=None if place is None else place.point[: scales.dimension],
            energy=state.energy * scales.energy,
            work=state.work * scales.energy,
            dissipated=state.dissipated * scales.energy,
            released=state.released * scales.energy,
            way=state.way,
            unstable=state.unstable,
            forces=self._measures.forces(state.x, state.factor, self._reached),
            displacements=self._measures.displacements(state.x, state.factor),
            certified=verdict.certified,
        )
        self._rows.append(row)

    def displacement(self, number: int) -> fem.Function:
        """The displacement at a row, nondimensional, ghosts updated. Collective.

        Args:
            number: of the row.
        """
        return self._certifier.displacement(self.states[number], self._verdicts[number])

    def state(self, number: int) -> tuple[Problem, fem.Function]:
        """The problem at the factor of a row, and the displacement there. Collective.

        The problem holds until another factor is asked for.

        Args:
            number: of the row.
        """
        return self._factored.at(self.states[number].factor), self.displacement(number)

    def crossings(self, factor: float) -> Iterator[tuple[int, Problem, fem.Function]]:
        """The states at which the path crosses a factor: the row before, problem and displacement. Collective.

        Between two rows the path is straight; one that is not has a row there.

        Args:
            factor: λ.
        """
        for number, (before, after) in enumerate(zip(self.states, self.states[1:], strict=False)):
            low, high = sorted((before.factor, after.factor))
            last = number + 2 == len(self.states)
            if after.event is Event.JUMP or not low <= factor <= high or low == high:
                continue
            if factor == after.factor and not last:
                continue
            share = (factor - before.factor) / (after.factor - before.factor)
            x = before.x + share * (after.x - before.x)
            yield number, self._factored.at(factor), self._condensation.displacement(x, factor)

    def free(self) -> None:
        """Free the condensed body; the rows stay, displacements cannot be asked for any more. Collective."""
        self._condensation.free()


def _state_of(kept: Record) -> tuple[PathState, StateVerdict]:
    """A state and what was found of it, from its record."""
    values = {name: value for name, value in kept.items() if name != "verdict"}
    values |= {"event": Event(kept["event"]), "position": Position(**kept["position"])}
    values["place"] = kept["place"] and EventPlace(**kept["place"])
    return PathState(**values), StateVerdict(**kept["verdict"])
