"""A model on a domain as an assembled system: one level of a mesh hierarchy, or the only one."""

from __future__ import annotations

from ..mesh.domain import Domain
from ..problem.compose import Model, compose
from ..runtime.timing import Timer
from .system import System, compile_forms
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
        compiled = compile_forms(problem)
    return System(problem, compiled, timer, thresholds)
