"""The degree of a run to a goal, where the scene states none: the one that is forecast to be cheaper.

Where much is asked for, and the first mesh is small, that is degree 2. Else both degrees are solved on the first mesh.
From its error there each is forecast to converge at its best rate in the number of unknowns, which adaptive meshes
reach.
"""

from __future__ import annotations

import math

import numpy as np

from ..mesh import nodes
from ..mesh.domain import Domain
from ..runtime.mpi import largest
from . import cost_forecast, quantities
from .adaptive_run import AdaptiveRun
from .cost_forecast import Elements
from .goal import DegreeChoice, Goal
from .thresholds import CHOICE, ChoiceThresholds


def at_once(goal: Goal, domain: Domain, thresholds: ChoiceThresholds = CHOICE) -> bool:
    """Whether to begin at degree 2: much is asked for, and the first mesh is small. Collective.

    Args:
        goal: what is asked for.
        domain: the body on the first mesh.
        thresholds: what is much, and what is small.
    """
    if not quantities.find(goal.quantity).estimated:
        return False
    unknowns = domain.dimension * nodes.count(domain.mesh, 2)
    return (goal.accuracy or 0.0) <= thresholds.much and unknowns <= thresholds.small


def worthwhile(run: AdaptiveRun, thresholds: ChoiceThresholds = CHOICE) -> bool:
    """Whether a run of degree 1 leaves something to gain, and degree 2 on its first mesh is affordable. Collective.

    Args:
        run: on its first mesh.
        thresholds: what an unknown of degree 2 costs.
    """
    if not (run.open and run.steps and run.quantity.known_from_one_mesh):
        return False
    quadratic, last = Elements(dimension=run.elements.dimension, degree=2), run.steps[-1]
    dofs = quadratic.dimension * nodes.count(run.level.prepared.problem.domain.mesh, quadratic.degree)
    if cost_forecast.memory(run.steps, dofs, quadratic, run.base) > run.room:
        return False
    ends = largest(run.comm, run.solver.timer.total) + last.seconds * dofs / last.dofs * thresholds.price
    return run.goal.seconds is None or ends < run.goal.seconds * thresholds.budget


def between(one: AdaptiveRun, other: AdaptiveRun, thresholds: ChoiceThresholds = CHOICE) -> DegreeChoice:
    """The cheaper of degree 1 and 2, each on its first mesh.

    Args:
        one: of degree 1, with a known error.
        other: of degree 2.
        thresholds: what an unknown of degree 2 costs.
    """
    errors = [run.steps[-1].error if run.steps else math.inf for run in (one, other)]
    wanted = one.goal.accuracy or min(errors) / 10
    linear, quadratic = (_needed(run, error, wanted) for run, error in zip((one, other), errors, strict=True))
    degree = 2 if thresholds.price * quadratic < linear else 1
    return DegreeChoice(degree=degree, unknowns={1: linear, 2: quadratic})


def _needed(run: AdaptiveRun, error: float, wanted: float) -> float:
    """The unknowns that an error takes."""
    rate = run.elements.rate * run.quantity.power_of_energy
    with np.errstate(over="ignore"):
        return float(run.level.dofs * np.maximum(1.0, np.float64(error) / wanted) ** (1.0 / rate))
