"""A scene made into an assembled system: mesh, forms, assembly; one rung of the ladder, or all there is."""

from __future__ import annotations

import functools
from collections.abc import Callable
from typing import TYPE_CHECKING

from mpi4py import MPI

from . import domain, problem, smoothing, system
from .domain import Domain
from .laws import Superpotential
from .timing import Timer

if TYPE_CHECKING:
    from .scene import Scene


def assemble(scene: Scene, comm: MPI.Comm, timer: Timer, body: Domain | None = None) -> system.System:
    """Mesh (unless a refined body is given), forms and assembly of a scene. Collective.

    Raises:
        InputError: the scene does not fit its mesh, on all ranks alike.
    """
    with timer("mesh"):
        body = body or domain.build(comm, scene.domain, scene.dimension)
    with timer("jit"):
        placed = [(p.where, p.effect) for p in scene.effects()]
        composed = problem.compose(body, scene.parts, placed, modification(scene))
        compiled = system.compile_forms(composed)
    return system.System(composed, compiled, timer)


def modification(scene: Scene) -> Callable[[Superpotential], Superpotential]:
    """What the scene's solver table does to a law: smooth it, or nothing."""
    wanted = scene.solver
    if wanted.smoothing is None:
        return lambda law: law
    return functools.partial(
        smoothing.create, wanted.smoothing, epsilon=wanted.epsilon, epsilon_absolute=wanted.epsilon_absolute
    )
