"""What accuracy costs in time, from Python: a model solved along several axes."""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from mpi4py import MPI

from ..errors import InputError
from ..mesh.shapes import OnlyMesh
from ..model import Model, is_portable
from ..results.output_folder import existing
from ..schema import require_path
from ..study import plan as study_plan
from ..study.conduct import conduct
from ..study.table import Study
from .solving import ranks_of


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
    if isinstance(repeats, bool) or not isinstance(repeats, int | np.integer) or repeats < 1:
        raise InputError(f"study: repeats must be a whole number, 1 or more (is {repeats!r})")
    plan = study_plan.make(_on_its_mesh(model), [_axis(name, values) for name, values in axes.items()])
    found, _ = conduct(
        plan, ranks, None if folder is None else Path(folder), repeats=repeats, existing=existing(force=force)
    )
    return found


def _axis(name: str, values: Any) -> tuple[str, tuple[str, ...]]:
    if isinstance(values, str) or not isinstance(values, Sequence):
        raise InputError(f"study: {name} is {values!r}; give a list of values")
    return study_plan.read_axis(f"{name}={','.join(map(str, values))}")


def _on_its_mesh(model: Model) -> Model:
    """The model; on its own mesh alone, where it has data on that."""
    portable = is_portable(model)
    values = (value for effect in model.effects for value in effect.spatial_values())
    if model.from_file or (portable and all(value.everywhere for value in values)):
        return model
    domain = replace(model.body.domain, shared=None)
    only = domain if portable else replace(domain, coarsening=None, bends=False)
    return model.changed(domain=OnlyMesh(shape="given mesh", given=only))
