"""What accuracy costs in time, from Python: a model solved along several axes."""

from __future__ import annotations

import os
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from html import escape
from pathlib import Path
from typing import Any

import numpy as np
from mpi4py import MPI

from ..errors import InputError
from ..mesh.shapes import OnlyMesh
from ..model import Model, is_portable
from ..model.argument_checks import require_path
from ..results.output_folder import existing
from ..study import plan as study_plan
from ..study.conduct import conduct
from ..study.table import Row
from .solving import ranks_of


@dataclass(frozen=True, kw_only=True, repr=False)
class ModelStudy:
    """What accuracy costs in time; the same on all ranks.

    Attributes:
        rows: the points, cheapest mesh first.
        sentences: what they say.
        uncertainty: how far the reference may be from the truth, relative, by quantity; None where it is not known.
    """

    rows: tuple[Row, ...]
    sentences: tuple[str, ...]
    uncertainty: Mapping[str, float | None]

    def __repr__(self) -> str:
        return "\n".join(self.sentences)

    def _repr_html_(self) -> str:
        head = "".join(f"<th>{name}</th>" for name in ("point", "unknowns", "s", "error, energy norm"))
        rows = "".join(
            "<tr>" + "".join(f"<td>{escape(cell)}</td>" for cell in _cells(row)) + "</tr>" for row in self.rows
        )
        return f"<p>{escape(' '.join(self.sentences))}</p><table><tr>{head}</tr>{rows}</table>"


def _cells(row: Row) -> Iterator[str]:
    yield row.text
    yield "" if row.dofs is None else f"{row.dofs:,}"
    yield "" if row.seconds is None else f"{row.seconds:.3g}"
    yield f"{error:.2g}" if (error := row.error("energy_norm")) is not None else row.reason


def study(
    model: Model,
    folder: str | os.PathLike[str] | None = None,
    comm: MPI.Comm | None = None,
    *,
    repeats: int = 3,
    force: bool = False,
    **axes: Sequence[Any],
) -> ModelStudy:
    """Solve a model along several axes, and compare each solution with a reference. Collective.

    The points are solved in this program, one after the other.

    Args:
        model: what to study.
        folder: where tables, pictures and page go, as by ``hvi study``; None: nowhere.
        comm: the ranks, if the model is a scene file; by default all. A body from Python has its own.
        repeats: of each point at most, for the median of its time; 1 or more.
        force: whether a study that is in the folder already is replaced.
        **axes: values by axis, such as ``epsilon=["exact", 0.1]``, ``mesh=[0, 1, 2]``, ``tolerance``, ``method``,
            ``smoothing``, ``linear_solver``, ``degree``, ``accuracy``; all combinations are run. Without axes: those of
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
    _check_repeats(repeats)
    with _in_python_words():
        plan = study_plan.make(_on_its_mesh(model), [_axis(name, values) for name, values in axes.items()])
    found, _ = conduct(
        plan, ranks, None if folder is None else Path(folder), repeats=repeats, existing=existing(force=force)
    )
    return ModelStudy(
        rows=found.rows,
        sentences=tuple(found.sentences()),
        uncertainty={name: known.error for name, known in found.certain.items()},
    )


def _check_repeats(given: Any) -> None:
    if isinstance(given, bool) or not isinstance(given, int | np.integer) or given < 1:
        raise InputError(f"study: repeats must be a whole number, 1 or more (is {given!r}); 1 solves each point once")


def _axis(name: str, values: Any) -> tuple[str, tuple[str, ...]]:
    if isinstance(values, str) or not isinstance(values, Sequence):
        raise InputError(f"study: {name} is {values!r}; give a list of values")
    return study_plan.read_axis(f"{name}={','.join(map(str, values))}")


@contextmanager
def _in_python_words() -> Iterator[None]:
    try:
        yield
    except InputError as error:
        raise InputError(str(error).replace("--axis ", "study: ")) from None


def _on_its_mesh(model: Model) -> Model:
    """The model; on its own mesh alone, where it has data on that."""
    portable = is_portable(model)
    values = (value for effect in model.effects for value in effect.spatial_values())
    if model.from_file or (portable and all(value.everywhere for value in values)):
        return model
    domain = replace(model.body.domain, shared=None)
    only = domain if portable else replace(domain, coarsening=None, bends=False)
    return model.changed(domain=OnlyMesh(shape="given mesh", given=only))
