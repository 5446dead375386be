"""Follow the load path of a model from Python."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
from dolfinx import fem
from matplotlib.figure import Figure
from mpi4py import MPI

from .. import console
from ..errors import InputError, of_user
from ..load_paths import path_files
from ..load_paths.following import PathRun
from ..model import Model, PathTable, SolverTable
from ..paths.load_path import LoadPath
from ..report.reader import PathResult
from ..results import ResultFolder
from ..runtime import log
from ..schema import require_path, unknown
from ..typing import Array
from .solution import GIVEN, displacement
from .solving import check, fields_of

_LOG = log.logger("api")


@dataclass(frozen=True, kw_only=True, repr=False)
class ModelPath(LoadPath):
    """A load path with its columns as arrays, in SI; the same on all ranks. Calls that are collective say so.

    Attributes:
        run: what found it.
    """

    run: PathRun

    @property
    def factor(self) -> Array:
        """The factor λ of all rows, (rows,)."""
        return self.factors

    @property
    def peak_factor(self) -> float:
        """The largest factor that is borne."""
        return self.rows[self.peak].factor

    @property
    def events(self) -> tuple[str, ...]:
        """What happens at each row, as in ``path.csv``."""
        return tuple(row.event for row in self.rows)

    @cached_property
    def stable(self) -> Array:
        """Which rows are stable, (rows,) of booleans."""
        return np.array([row.stable for row in self.rows])

    def force(self, part: str) -> Array:
        """The resultant of what acts on the body at a part, N/m in 2D, N in 3D; (rows, d).

        Args:
            part: a part with a load or a prescribed displacement.

        Raises:
            InputError: there is no such part.
        """
        return self._at_rows("forces", part)

    def displacement(self, part: str) -> Array:
        """The mean displacement of a part, m; (rows, d).

        Args:
            part: a part with a load or a prescribed displacement.

        Raises:
            InputError: there is no such part.
        """
        return self._at_rows("displacements", part)

    @of_user("path")
    def _at_rows(self, what: str, part: str) -> Array:
        if part not in self.parts:
            raise InputError(f"nothing drives or holds {part!r}; there are: {', '.join(self.parts)}")
        return np.array([getattr(row, what)[part] for row in self.rows])

    @of_user("path")
    def u(self, row: int) -> fem.Function:
        """The displacement at a row, m, ghosts updated; as :attr:`.ModelSolution.u`. Collective.

        Args:
            row: its number, from 0; a negative one counts from the end.

        Raises:
            InputError: on all ranks alike: the path has no such row.
        """
        count = len(self.rows)
        if not isinstance(row, int | np.integer) or not -count <= row < count:
            raise InputError(f"there is no row {row!r}; there are rows 0 to {count - 1}")
        found = self.run.displacement(int(row) % count)
        return displacement(found, self.run.prepared.problem.scales)

    def plot(self) -> Figure | None:
        """Force over displacement of the driven part, as a matplotlib figure; None where no part is driven."""
        from ..report.pictures import charts

        shown = self._as_read()
        return None if shown.driven is None else charts.path_chart(shown)

    def _as_read(self) -> PathResult:
        """As the report reads it from its folder."""
        columns = {"factor": self.factors, "stable": self.stable.astype(float)}
        for part in self.parts:
            for kind, rows in (("f", self.force(part)), ("u", self.displacement(part))):
                columns |= {f"{part}.{kind}{'xyz'[i]}": rows[:, i] for i in range(self.dimension)}
        return PathResult(
            folder=Path("."),
            scene={"title": self.run.prepared.scene.title},
            summary={"path": self.summary()},
            columns=columns,
            events=self.events,
        )

    @of_user("write")
    def write(self, folder: str | os.PathLike[str], *, force: bool = False, pictures: bool = True) -> None:
        """Write the folder that ``hvi path`` writes. Collective.

        Args:
            folder: where to.
            force: whether a result that is there already is replaced.
            pictures: whether to draw.

        Raises:
            InputError: on all ranks alike: the folder holds a result or other files, or cannot be written.
        """
        require_path("folder", folder)
        comm = self.run.prepared.system.comm
        with ResultFolder(comm, Path(folder), force=force, kind="path") as target:
            path_files.write(target, self.run, self, GIVEN, _LOG.warning, draw=pictures)
            target.commit(self.run.prepared.scene)

    def free(self) -> None:
        """Free the assembled body; then neither :meth:`u` nor :meth:`write` can be called any more. Collective.

        On one rank Python does so itself; on several, nothing but this frees it.
        """
        self.run.free()
        self.run.prepared.system.free()

    def __repr__(self) -> str:
        return "\n".join(console.path_outcome(self))


@of_user("follow")
def follow(
    model: Model,
    comm: MPI.Comm | None = None,
    *,
    to: float | Sequence[float] | None = None,
    **options: Any,
) -> ModelPath:
    """Follow the equilibria of a model over a load factor. Collective.

    Args:
        model: what to follow.
        comm: the ranks, if the model is a scene file; by default all. A body from Python has its own.
        to: the factor at which the path ends, or a programme with turns; by default what the scene says, else 1.
        **options: the other keys of the scene's table ``[path]`` (scaled, follow, memory), and those of ``[solver]``,
            such as ``degree=2`` or ``smoothing="chks", epsilon=0.01``; ``tolerance`` is that of the certificate.

    Raises:
        InputError: on all ranks alike: an option is not allowed, or the path cannot be followed.
    """
    path, solver = _by_table(options)
    prepared = check(model, comm, **solver)
    table = (prepared.scene.path or PathTable()).changed(**(path if to is None else {**path, "to": to}))
    run = PathRun(replace(prepared, scene=prepared.scene.changed(path=table)), table)
    return ModelPath(**fields_of(run.follow()), run=run)


def _by_table(options: Mapping[str, Any]) -> tuple[dict[str, Any], dict[str, Any]]:
    """The keys of the table ``[path]`` and those of ``[solver]``."""
    tables = PathTable.model_fields, SolverTable.model_fields
    known = [key for table in tables for key in table]
    for key in options:
        if key not in known:
            raise InputError(unknown("key", key, known))
    of_path, of_solver = ({key: value for key, value in options.items() if key in table} for table in tables)
    return of_path, of_solver
