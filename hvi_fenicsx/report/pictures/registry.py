"""Which pictures there are. Add one as a module of ``kinds`` with a function under :func:`picture`.

The function draws a figure of a result, and one of a part of Γc too where the picture is one of a part.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from matplotlib.figure import Figure

from ..reader import Result

Maker = Callable[..., Figure]


@dataclass(frozen=True, kw_only=True)
class Picture:
    """A kind of picture.

    Attributes:
        name: of its file, without the ending.
        caption: what a reader sees under it; ``{part}`` stands for the part.
        dimension: of the bodies that it draws, 2 or 3.
        wanted: whether a result has what it draws.
        of_part: whether there is one for each part of Γc.
        rendered: whether VTK draws for it.
        make: draws it.
    """

    name: str
    caption: str
    dimension: int
    wanted: Callable[[Result], bool]
    of_part: bool
    rendered: bool
    make: Maker


PICTURES: list[Picture] = []
"""All that are registered."""


def picture(
    name: str,
    *,
    caption: str,
    dimension: int,
    wanted: Callable[[Result], bool] = lambda result: True,
    of_part: bool = False,
    rendered: bool = False,
) -> Callable[[Maker], Maker]:
    """Register the function below as a kind of picture.

    Args:
        name: of its file, without the ending; that of the part follows where there are several.
        caption: what a reader sees under it; ``{part}`` stands for the part.
        dimension: of the bodies that it draws, 2 or 3.
        wanted: whether a result has what it draws.
        of_part: whether there is one for each part of Γc.
        rendered: whether VTK draws for it.
    """

    def register(make: Maker) -> Maker:
        PICTURES.append(
            Picture(
                name=name,
                caption=caption,
                dimension=dimension,
                wanted=wanted,
                of_part=of_part,
                rendered=rendered,
                make=make,
            )
        )
        return make

    return register
