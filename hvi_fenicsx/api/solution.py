"""What was found, for people: fields and tables in SI."""

from __future__ import annotations

import io
import os
from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from types import MethodType
from typing import Self, TypeVar

from dolfinx import fem
from matplotlib.figure import Figure

from .. import console
from ..errors import InputError, of_user
from ..problem import spaces
from ..problem.scaling import Scales
from ..problem.stress import cell_stress, space_of_stress
from ..report.reader import Result
from ..report.solution_arrays import ContactPart
from ..results import ResultFolder, gathering
from ..results.whole import write_whole
from ..runtime import log
from ..runtime.mpi import on_root
from ..schema import require_kind, require_path
from ..typing import Array
from ..workflow import Solution

_LOG = log.logger("api")
T = TypeVar("T")
GIVEN = {"command": None, "petsc": None}
"""The entries of ``summary.json`` for the command line, which a program has not."""


class _ContactParts(dict[str, ContactPart]):
    """The parts of Γc by name."""

    def __missing__(self, part: str) -> ContactPart:
        raise KeyError(f"no contact and no law acts on {part!r}; there are: {', '.join(self) or 'none'}")


def displacement(u: fem.Function, scales: Scales) -> fem.Function:
    """A displacement in m, with its values at the nodes as coefficients. Collective.

    Args:
        u: in units of u0, ghosts updated.
        scales: with u0.
    """
    found = spaces.in_lagrange_basis(u)
    found.name = "displacement"
    found.x.array[:] *= scales.displacement
    return found


@dataclass(frozen=True, kw_only=True, repr=False)
class ModelSolution(Solution):
    """A solution with its fields in SI, on the body's mesh.

    ``u``, ``stress``, ``contact`` and resultants are computed when they are first used; that is collective. They are
    the same on all ranks but for the fields, of which each rank has its own part.
    """

    @cached_property
    def u(self) -> fem.Function:
        """The displacement, m, ghosts updated; Lagrange's elements of ``solver.degree``. Collective when first used.

        Raises:
            InputError: on all ranks alike: no solution under the whole load exists, or none was found.
        """
        return displacement(self._known(self.solve_result).u, self.problem.scales)

    @cached_property
    def stress(self) -> fem.Function:
        """The stress, N/m², tension positive: (3, 3), at degree 1 constant in each cell, at degree 2 linear.

        Collective when first used.

        Raises:
            InputError: on all ranks alike: no solution under the whole load exists, or none was found.
        """
        field = fem.Function(space_of_stress(self.problem.space, (3, 3)), name="stress")
        values = cell_stress(self.problem.bulk, self._known(self.solve_result).u)
        field.x.array[: values.size] = values.ravel()
        field.x.scatter_forward()
        return field

    @property
    def energy(self) -> float:
        """The potential energy, J/m in 2D, J in 3D; the same on all ranks, not collective.

        Raises:
            InputError: on all ranks alike: no solution under the whole load exists, or none was found.
        """
        return self._known(self.examination).energy * self.problem.scales.energy

    @cached_property
    def contact(self) -> Mapping[str, ContactPart]:
        """The parts with contact or laws, by name; the same on all ranks. Collective when first used.

        Raises:
            InputError: on all ranks alike: no solution under the whole load exists, or none was found.
        """
        parts = gathering.contact_parts(self.problem, self._known(self.examination).states)
        return self.problem.comm.bcast(_ContactParts(parts), root=0)

    @cached_property
    def resultants(self) -> Mapping[str, Array]:
        """The forces on the body by the side or region they act on, N/m in 2D, N in 3D; (d,) each.

        Loads, reactions of supports, contact and laws of a place are added up; all places together are in balance.
        The same on all ranks. Collective when first used.

        Raises:
            InputError: on all ranks alike: no solution under the whole load exists, or none was found.
        """
        found = self._known(self.forces).resultants(self.problem.comm)
        return {name: force * self.problem.scales.force for name, force in found.items()}

    @of_user("resultant")
    def resultant(self, part: str) -> Array:
        """The force on the body at a side or region, N/m in 2D, N in 3D; (d,). Collective when first used.

        Args:
            part: the name; "body" for a load on the whole body.

        Raises:
            InputError: on all ranks alike: there is no such place, or no solution under the whole load.
        """
        if part not in self.resultants:
            raise InputError(f"nothing acts on {part!r}; there are: {', '.join(self.resultants)}")
        return self.resultants[part]

    @of_user("plot")
    def plot(self, picture: str | None = None) -> Figure | None:
        """A picture of it as a matplotlib figure, which a notebook shows. Collective; None on ranks other than 0.

        Args:
            picture: one of those that a result folder has: body, stress, scene, contact, escape; with several contact
                parts contact_NAME. None: body, or escape where no solution exists.

        Raises:
            InputError: on all ranks alike: there is no such picture of it.
        """
        require_kind("picture", picture, (str, type(None)), "the name of a picture, or None")
        result, figures = gathering.result(self), list[Figure]()
        wanted = picture or ("escape" if self.solve_result is None else "body")
        on_root(self.problem.comm, lambda: figures.append(_figure(result, wanted)))
        return figures[0] if figures else None

    @of_user("write")
    def write(self, folder: str | os.PathLike[str], *, force: bool = False, pictures: bool = True) -> None:
        """Write the folder that ``hvi run`` writes. Collective.

        ``scene.toml`` can be run again where the model has nothing that only Python knows.

        Args:
            folder: where to.
            force: whether a result that is there already is replaced.
            pictures: whether to draw.

        Raises:
            InputError: on all ranks alike: the folder holds a result or other files, or cannot be written.
        """
        require_path("folder", folder)
        with ResultFolder(self.problem.comm, Path(folder), force=force) as target:
            write_whole(target, self, GIVEN, self.timer, _LOG.warning, pictures=pictures)
            target.commit(self.scene)

    @cached_property
    def borne(self) -> Self:
        """The last state that is borne, at the factor ``last_borne.factor``; else itself. Not collective."""
        return replace(self, last_borne=None)

    def _known(self, found: T | None) -> T:
        """A part of the solution under the whole load; never that of another load in its place."""
        if found is None or self.last_borne is not None:
            way = self.solvability.direction
            raise InputError(f"nothing was solved under the load: {self.reason}" + (f" ({way.name})" if way else ""))
        return found

    def __repr__(self) -> str:
        return "\n".join([*console.outcome(self), *console.warnings(self.warnings)])


def _figure(result: Result | None, wanted: str) -> Figure:
    """Draw on rank 0."""
    from ..report.pictures.drawings import drawings, x_server

    assert result is not None
    known = {drawing.path.stem: drawing for drawing in drawings(result)}
    if wanted not in known:
        raise InputError(f"plot: there is no picture {wanted!r} of this solution; there are: {', '.join(known)}")
    with x_server(wanted=known[wanted].rendered):
        figure = known[wanted].make()
    # A figure that pyplot did not make has no other way to show itself in a notebook.
    figure._repr_png_ = MethodType(_png, figure)  # type: ignore[attr-defined]
    return figure


def _png(figure: Figure) -> bytes:
    buffer = io.BytesIO()
    figure.savefig(buffer, format="png")
    return buffer.getvalue()
