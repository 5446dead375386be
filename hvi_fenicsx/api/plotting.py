"""Pictures of a solution that is still in memory: those of a result folder, as matplotlib figures."""

from __future__ import annotations

import io
from types import MethodType

from matplotlib.figure import Figure

from ..errors import InputError
from ..report.pictures.xserver import x_server
from ..report.reader import Result
from ..results import gathering
from ..runtime.mpi import on_root
from ..workflow import Solution


def draw(solution: Solution, picture: str) -> Figure | None:
    """One picture of a solution. Collective.

    Args:
        solution: what was found.
        picture: its name.

    Returns:
        The figure on rank 0, None elsewhere.

    Raises:
        InputError: on all ranks alike: there is no such picture of this solution.
    """
    result, figures = gathering.result(solution), list[Figure]()

    def make() -> None:
        assert result is not None
        figures.append(_figure(result, picture))

    on_root(solution.problem.domain.mesh.comm, make)
    return figures[0] if figures else None


def _figure(result: Result, wanted: str) -> Figure:
    """Draw on rank 0."""
    from ..report.pictures.drawings import drawings

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
