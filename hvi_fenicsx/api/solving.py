"""Solve and check models from Python."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import fields, replace
from typing import Any

from dolfinx import fem
from mpi4py import MPI

from .. import console, workflow
from ..errors import InputError
from ..load_paths import last_borne
from ..mesh.domain import Domain
from ..model import Model, is_portable
from ..paths.load_path import LoadPath
from ..problem import spaces
from ..runtime.log import newton_step
from ..schema import Table
from ..solvers.method import Progress
from ..system import petsc_options
from ..system.thresholds import DEFAULT, Thresholds
from ..workflow import Preparation, Solution
from .solution import ModelSolution


class _Asked(Table):
    progress: Callable[..., None]
    estimate: bool


class ModelPreparation(Preparation):
    """A model before the solve, told in a few lines."""

    def __repr__(self) -> str:
        return "\n".join(console.heading(self, self.system.comm.size))


def solve(
    model: Model,
    comm: MPI.Comm | None = None,
    *,
    progress: Progress = newton_step,
    thresholds: Thresholds = DEFAULT,
    start: ModelSolution | str | Sequence[Any] | None = None,
    estimate: bool = True,
    petsc: Mapping[str, Any] | None = None,
    petsc_prefix: str = "hvi_",
    **options: Any,
) -> ModelSolution:
    """Solve a model, and certify what was found. Collective.

    Args:
        model: what to solve.
        comm: the ranks, if the model is a scene file; by default all. A body from Python has its own.
        progress: called at each Newton step; by default it is logged.
        thresholds: the numbers that tune the solvers.
        start: where to begin: the solution of another model of the same body, such as that of the last load; or what
            ``[solver]`` may have.
        estimate: whether to estimate the error, which takes about as long as the solve.
        petsc: options for PETSc's solvers by name, without dash and prefix, such as ``{"ksp_max_it": 500}``; None for
            an option without value. They hold for this solve.
        petsc_prefix: of these options, and of those that your program or command line has given PETSc already.
        **options: the other keys of the scene's table ``[solver]``, such as ``tolerance=1e-8``.

    Raises:
        InputError: on all ranks alike: an argument or option is not allowed, no solver reads an option for PETSc, or
            the model does not fit its mesh.
    """
    _Asked.made({"progress": progress, "estimate": estimate})
    known = start if isinstance(start, ModelSolution) else None
    if known is None and start is not None:
        options["start"] = start
    prepared = check(model, comm, thresholds=thresholds, **options)
    first = None if known is None else _displacement(known, prepared)
    with petsc_options.chosen(petsc or {}, petsc_prefix):
        found = workflow.find_solution(prepared, progress, start=first)
        solution = last_borne.in_place_of(prepared, found.estimated() if estimate else found.solution)
        if solution.solve_result is not None:
            petsc_options.check_read(petsc or {}, prepared.system.comm)
    found.free()
    return ModelSolution(**fields_of(solution))


def check(
    model: Model,
    comm: MPI.Comm | None = None,
    *,
    thresholds: Thresholds = DEFAULT,
    **options: Any,
) -> ModelPreparation:
    """Assemble a model and say whether a solution can exist; solves nothing. Collective.

    Args:
        model: what to check.
        comm: the ranks, if the model is a scene file; by default all. A body from Python has its own.
        thresholds: the numbers that tune the solvers.
        **options: the keys of the scene's table ``[solver]``.

    Raises:
        InputError: on all ranks alike: an option is not allowed, or the model does not fit its mesh.
    """
    ranks = ranks_of(model, comm)
    domain = None if model.from_file else _domain(model)
    model = _with_options(model, options)
    return ModelPreparation(**fields_of(workflow.prepare(model, ranks, domain=domain, thresholds=thresholds)))


def fields_of(made: Preparation | Solution | LoadPath) -> dict[str, Any]:
    """The fields of what a lower room made, for a class with more to say of it.

    Args:
        made: a dataclass of that room.
    """
    return {field.name: getattr(made, field.name) for field in fields(made)}


def _displacement(known: ModelSolution, prepared: Preparation) -> fem.Function | None:
    """A solution's displacement, as a start; None where there is none, since no solution existed."""
    if known.problem.domain.mesh is not prepared.problem.domain.mesh:
        raise InputError("start: is a solution on another mesh; give one of a model with the same Body")
    if known.solve_result is None:
        return None
    start = spaces.carried_over(known.solve_result.u, prepared.problem.space)
    start.x.array[:] *= known.problem.scales.displacement
    return start


def ranks_of(model: Any, comm: MPI.Comm | None) -> MPI.Comm:
    """The ranks that work on a model.

    Args:
        model: what a user gives.
        comm: the ranks, if it is a scene file; None: all. A body from Python has its own.

    Raises:
        InputError: it is no model.
    """
    if not isinstance(model, Model):
        raise InputError(f"{model!r} is no model; a scene file is read by hvi.read_scene(path)")
    return model.body.comm or comm or MPI.COMM_WORLD


def _with_options(model: Model, options: dict[str, Any]) -> Model:
    return model.with_solver(**options) if options else model


def _domain(model: Model) -> Domain:
    """The body's domain; where an energy has data of its mesh, nothing is kept, no mesh is coarser, no cell is bent.

    The data may change between two solves.
    """
    domain = model.body.domain
    return domain if is_portable(model) else replace(domain, coarsening=None, shared=None, bends=False)
