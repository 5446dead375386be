"""All equilibria of a model, or the lowest with a proof, from Python."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Any

from mpi4py import MPI
from pydantic import Field

from ..equilibrium_search import bodies
from ..model import Model
from ..runtime import log
from ..runtime.mpi import time_over
from ..schema import Positive, Table
from .solution import ModelSolution
from .solving import check, fields_of

_LOG = log.logger("api")


class _Search(Table):
    lowest: bool
    gap: Annotated[float, Field(gt=0, lt=1)]
    limit: Positive | None


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
    _Search.made({"lowest": lowest, "gap": gap, "limit": limit})
    prepared = check(model, comm, **options)
    searched = bodies.Equilibria(prepared)
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
