"""A model on a domain made into an assembled system: one level of the mesh hierarchy, or all there is."""

from __future__ import annotations

from ..mesh.domain import Domain
from ..problem.compose import Model, compose
from ..runtime.timing import Timer
from .system import System, compile_forms


def assemble(domain: Domain, model: Model, timer: Timer) -> System:
    """Forms and assembly. Collective.

    Args:
        domain: the body and its mesh.
        model: what is solved on it.
        timer: where time goes.

    Raises:
        InputError: the model does not fit the mesh, on all ranks alike.
    """
    with timer("jit"):
        problem = compose(domain, model)
        compiled = compile_forms(problem)
    return System(problem, compiled, timer)
