"""A start from the load path: the equilibrium to which loading in proportion leads, on the condensed system.

Where laws soften, starts of the iteration are far from the equilibria that loading leads to, and where a state is
metastable there may be none. The path (:mod:`..paths`) tells: it leads to an equilibrium under the whole
load, or it ends before.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass

import numpy as np
from petsc4py import PETSc

from ..errors import InputError, SolverError
from ..laws import Superpotential
from ..laws.smoothing import SmoothedLaw
from ..paths.full_load import FullLoad, at_full_load
from ..paths.state import PathOptions
from ..paths.thresholds import DEFAULT as FOLLOWING
from ..paths.vertex_laws import is_straight
from ..reduced.condensation import Condensation
from ..reduced.condensed_problem import CondensedProblem
from ..runtime.mpi import on_root_asking
from ..system.system import System
from .method import Borne


@dataclass(frozen=True, kw_only=True)
class PathStart:
    """Where the load path leads.

    Attributes:
        x: the displacement under the whole load, in equilibrium; None: the path ends before.
        reason: how it ended.
        borne: where it ends before, the last state that is borne; None where that is not known.
    """

    x: PETSc.Vec | None
    reason: str
    borne: Borne | None = None


def softens(law: Superpotential) -> bool:
    """Whether a law's traction falls other than by jumps, as far as it is known how steeply.

    A jump that is smoothed by a curve is one; one that is smoothed by a line falls along it.

    Args:
        law: the law.
    """
    graph, unsmoothed = law.graph, law.law if isinstance(law, SmoothedLaw) else law
    return 0.0 < unsmoothed.steepest_fall < np.inf if graph is None else bool(np.any(graph.slopes < 0.0))


def first_steps(laws: Sequence[Superpotential], few: int, many: int) -> int | None:
    """Newton steps of a start without the path, before the path is followed; None: any number.

    Args:
        laws: the laws.
        few: of such steps, where the path is straight between events.
        many: of them, where it is a curve, which takes longer.
    """
    if not any(softens(law) for law in laws):
        return None
    return few if _are_straight(laws) else many


def _are_straight(laws: Sequence[Superpotential]) -> bool:
    """Whether the tractions of all laws are piecewise linear."""
    return all(law.graph is not None for law in laws)


def follow(system: System, interrupted: Callable[[], bool]) -> PathStart | None:
    """The start, where its path can be followed in short time; None where it cannot, or is lost. Collective.

    A path of other than piecewise linear equations is followed where laws soften and Γc has few unknowns.

    Args:
        system: the system; its tangent and what it holds are taken away.
        interrupted: whether to stop (collective); then None.
    """
    laws = [term.exact for term in system.terms]
    most = system.thresholds.vertex_unknowns if _are_straight(laws) else _most_on_curve(system)
    if system.comm.allreduce(len(system.jacobian.rows.dofs)) > most:
        return None
    system.jacobian.set_rates([np.zeros_like(rates) for rates in system.jacobian.rates])
    try:
        condensation = Condensation(system)
    except (InputError, SolverError):
        return None
    found = _on_first_rank(system, condensation.problem, interrupted)
    start = None if found is None else _expanded(condensation, found)
    condensation.free()
    return start


def _expanded(condensation: Condensation, found: FullLoad) -> PathStart:
    """The same of the whole body. Collective."""
    borne = None
    if (last := found.borne) is not None:
        borne = Borne(u=condensation.displacement(last.x, last.factor), factor=last.factor)
    x = None if found.x is None else condensation.expand(found.x)
    return PathStart(x=x, reason=found.reason, borne=borne)


def _on_first_rank(system: System, problem: CondensedProblem, interrupted: Callable[[], bool]) -> FullLoad | None:
    """Where the path leads, the same on all ranks to the last digit. Collective."""
    if not is_straight(problem) and problem.size > _most_on_curve(system):
        return None

    def followed(ask: Callable[[], bool]) -> FullLoad | None:
        with suppress(np.linalg.LinAlgError, InputError):  # some edges in space have no path
            options = PathOptions(most_events=FOLLOWING.waits * problem.size)
            return at_full_load(problem, options, ask)
        return None

    return on_root_asking(system.comm, followed, interrupted)


def _most_on_curve(system: System) -> int:
    """The unknowns up to which a curve is followed: none where no law softens, which makes it worth while."""
    return system.thresholds.curve_unknowns if any(softens(term.exact) for term in system.terms) else 0
