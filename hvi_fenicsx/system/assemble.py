"""A scene made into an assembled system: mesh, forms, assembly; one rung of the ladder, or all there is."""

from __future__ import annotations

import functools
from collections.abc import Callable
from typing import TYPE_CHECKING

from mpi4py import MPI

from ..laws import Superpotential, smoothing
from ..mesh import coarsening_2d, refinement
from ..mesh.domain import Domain
from ..problem import problem
from ..runtime.timing import Timer
from . import system

if TYPE_CHECKING:
    from ..scene import Scene


def assemble(scene: Scene, comm: MPI.Comm, timer: Timer, body: Domain | None = None) -> system.System:
    """Mesh (unless a refined body is given), forms and assembly of a scene. Collective.

    Raises:
        InputError: the scene does not fit its mesh, on all ranks alike.
    """
    with timer("mesh"):
        body = body or mesh(scene, comm)
    with timer("jit"):
        placed = [(p.where, p.effect) for p in scene.effects()]
        composed = problem.compose(body, scene.parts, placed, modification(scene))
        compiled = system.compile_forms(composed)
    return system.System(composed, compiled, timer)


def mesh(scene: Scene, comm: MPI.Comm) -> Domain:
    """The body of a scene; a mesh file's is refined as often as the scene says. Collective.

    What gmsh meshed gets coarser meshes below it; built-in blocks have their own.

    Raises:
        InputError: on all ranks alike, when a file cannot be read or is no usable mesh, or memory cannot suffice.
    """
    whole = scene.domain.build(comm, scene.dimension)
    if not hasattr(scene.domain, "cells"):
        whole = coarsening_2d.founded(whole)
    return refinement.repeated(whole, getattr(scene.domain, "refinements", 0))


def modification(scene: Scene) -> Callable[[Superpotential], Superpotential]:
    """What the scene's solver table does to a law: smooth it, or nothing."""
    wanted = scene.solver
    if wanted.smoothing is None:
        return lambda law: law
    return functools.partial(
        smoothing.create, wanted.smoothing, epsilon=wanted.epsilon, epsilon_absolute=wanted.epsilon_absolute
    )
