"""Models are solved, checked, searched for equilibria and studied from Python."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, fields, replace
from pathlib import Path
from typing import Annotated, Any

from dolfinx import fem
from mpi4py import MPI
from pydantic import Field

from .. import console, workflow
from ..errors import InputError, of_user
from ..load_paths import last_borne
from ..mesh.domain import Domain
from ..mesh.shapes import OnlyMesh
from ..model import Model, is_portable
from ..paths.load_path import LoadPath
from ..problem import spaces
from ..runtime import log
from ..runtime.mpi import time_over
from ..schema import Count, Positive, Table, require_path
from ..solvers.method import Progress
from ..study import plan as study_plan
from ..study.conduct import Measurement
from ..study.table import Study
from ..system import petsc_options
from ..system.thresholds import DEFAULT, Thresholds
from ..workflow import Preparation, Solution
from ..workflow.equilibria import Equilibria
from .solution import ModelSolution


class _Asked(Table):
    progress: Callable[..., None] = log.newton_step
    estimate: bool = True
    lowest: bool = False
    gap: Annotated[float, Field(gt=0, lt=1)] = 0.5
    limit: Positive | None = None
    repeats: Count = 1


class ModelPreparation(Preparation):
    """A model before the solve, told in a few lines."""

    def __repr__(self) -> str:
        return "\n".join(console.heading(self, self.system.comm.size))


@of_user("solve")
def solve(
    model: Model,
    comm: MPI.Comm | None = None,
    *,
    progress: Progress = log.newton_step,
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


@of_user("check")
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
    model = model.with_solver(**options) if options else model
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


def _domain(model: Model) -> Domain:
    """The body's domain; where an energy has data of its mesh, nothing is kept, no mesh is coarser, no cell is bent.

    The data may change between two solves.
    """
    domain = model.body.domain
    model.body.check_unmoved()
    return domain if is_portable(model) else replace(domain, coarsening=None, shared=None, bends=False)


_LOG = log.logger("api")


@dataclass(frozen=True, kw_only=True, repr=False)
class ModelEquilibria:
    """What :func:`equilibria` found; the same on all ranks, not collective.

    Attributes:
        solutions: by energy, each certified; their kind is in ``kinds``.
        kinds: minimiser, saddle or undecided.
        complete: whether these are all equilibria.
        lower_bound: no displacement has a lower energy, J/m or J; None where no bound is known.
        gap: lowest energy minus bound, relative to the energy; None where no bound is known.
        proven: whether what was asked for is proven.
        nodes: boxes that were bounded or tested.
        reason: how the search ended, for people.
    """

    solutions: tuple[ModelSolution, ...]
    kinds: tuple[str, ...]
    complete: bool
    lower_bound: float | None
    gap: float | None
    proven: bool
    nodes: int
    reason: str

    def __repr__(self) -> str:
        found = [f"{kind}: energy {one.energy:.10g}" for one, kind in zip(self.solutions, self.kinds, strict=True)]
        return "\n".join([self.reason, *found])


@of_user("equilibria")
def equilibria(
    model: Model,
    comm: MPI.Comm | None = None,
    *,
    lowest: bool = False,
    gap: float = 1e-8,
    limit: float | None = None,
    **options: Any,
) -> ModelEquilibria:
    """All equilibria of a model, or the lowest with a proof; at level DEBUG progress is logged. Collective.

    Args:
        model: what to search; that all equilibria were found can be proven where the tractions of its laws are
            polylines of one component each.
        comm: the ranks, if the model is a scene file; by default all. A body from Python has its own.
        lowest: the lowest energy with a proof, instead of all equilibria.
        gap: what that proof may leave open, relative to the energy.
        limit: seconds after which the search stops; None: none.
        **options: the keys of the scene's table ``[solver]``.

    Raises:
        InputError: on all ranks alike: a law is of a kind that is not searched, or a number is not allowed.
    """
    _Asked.made({"lowest": lowest, "gap": gap, "limit": limit})
    prepared = check(model, comm, **options)
    searched = Equilibria(prepared)
    stop = time_over(prepared.system.comm, limit)
    found = searched.find(lowest=lowest, gap=gap, stop=stop, report=_LOG.debug)
    solutions = tuple(ModelSolution(**fields_of(searched.solution(point))) for point in found.points)
    searched.free()
    prepared.system.free()
    return ModelEquilibria(
        solutions=solutions,
        kinds=tuple(str(point.kind) for point in found.points),
        complete=found.complete,
        lower_bound=None if found.lower_bound is None else found.lower_bound * prepared.problem.scales.energy,
        gap=found.gap,
        proven=found.proven,
        nodes=found.nodes,
        reason=found.reason,
    )


@of_user("study")
def study(
    model: Model,
    folder: str | os.PathLike[str] | None = None,
    comm: MPI.Comm | None = None,
    *,
    repeats: int = 3,
    force: bool = False,
    **axes: Sequence[Any],
) -> Study:
    """Solve a model along several axes, and compare each solution with a reference. Collective.

    The points are solved in this program, one after the other.

    Args:
        model: what to study.
        folder: where tables, pictures and page go, as by ``hvi study``; None: nowhere.
        comm: the ranks, if the model is a scene file; by default all. A body from Python has its own.
        repeats: of each point at most, for the median of its time; 1 or more.
        force: whether a study that is in the folder already is replaced.
        **axes: values by axis, such as ``epsilon=["exact", 0.1]``, ``mesh=[0, 1, 2]``, ``tolerance``, ``method``,
            ``smoothing``, ``linear_solver``, ``degree``; all combinations are run. Without axes: those of
            the default plan. ``mesh`` counts refinements of a mesh that you bring, and cells along the first side of a
            block.

    Raises:
        InputError: on all ranks alike: there is no such axis or value, the model has not this axis, or ``repeats`` is
            no number of solves.
        NoReferenceError: on all ranks alike: no solution exists, or the reference is not certified.
    """
    if folder is not None:
        require_path("folder", folder)
    ranks = ranks_of(model, comm)
    _Asked.made({"repeats": repeats})
    plan = study_plan.make(_on_its_mesh(model), [_axis(name, values) for name, values in axes.items()])
    measurement = Measurement(plan=plan, comm=ranks, repeats=int(repeats))
    return measurement.conduct(None if folder is None else Path(folder), force=force)[0]


def _axis(name: str, values: Any) -> tuple[str, tuple[str, ...]]:
    if isinstance(values, str) or not isinstance(values, Sequence):
        raise InputError(f"study: {name} is {values!r}; give a list of values")
    return study_plan.read_axis(f"{name}={','.join(map(str, values))}")


def _on_its_mesh(model: Model) -> Model:
    """The model; on its own mesh alone, where it has data on that."""
    values = (value for effect in model.effects for value in effect.spatial_values())
    if model.from_file or (is_portable(model) and all(value.everywhere for value in values)):
        return model
    only = replace(_domain(model), shared=None)
    return model.changed(domain=OnlyMesh(shape="given mesh", given=only))
