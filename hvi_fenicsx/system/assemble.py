"""A model on a domain as an assembled system: one level of a mesh hierarchy, or the only one."""

from __future__ import annotations

import numpy as np

from ..effects import load_name
from ..errors import InputError
from ..mesh.domain import Domain
from ..problem import scaling
from ..problem.compose import Model, compose
from ..runtime.timing import Timer
from .system import System
from .thresholds import DEFAULT, Thresholds


def assemble(domain: Domain, model: Model, timer: Timer, thresholds: Thresholds = DEFAULT) -> System:
    """Compose a model on a domain, compile its forms and assemble them. Collective.

    Args:
        domain: the body and its mesh.
        model: the effects and their places.
        timer: where time goes.
        thresholds: the numbers that tune the linear solvers.

    Raises:
        InputError: the model does not fit the mesh, on all ranks alike.
    """
    with timer("jit"):
        problem = compose(domain, model)
        problem.compile()
    system = System(problem, timer, thresholds)
    _require_finite(system)
    return system


def _require_finite(system: System) -> None:
    """Refuse loads that are not finite where they are integrated, between the vertices. Collective."""
    stated = [(where, effect) for where, effect, _ in system.problem.contributions]
    for name, force in system.forces.items():
        if not np.isfinite(force.norm()):
            place = next(scaling.place(p) for p in stated if load_name(*p) == name)
            raise InputError(f"{place}: the formula is not finite everywhere there, between the vertices of the mesh")
