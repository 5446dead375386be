"""Which pictures there are of a result. Add one as a function under :func:`picture`, here beside the others."""

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
        wanted: whether a result has what it draws.
        of_part: whether there is one for each part of Γc.
        make: draws it, of a result, and of a part of Γc too.
    """

    name: str
    caption: str
    wanted: Callable[[Result], bool]
    of_part: bool
    make: Maker


PICTURES: list[Picture] = []
"""All that are registered."""


def picture(
    name: str, *, caption: str, wanted: Callable[[Result], bool] = lambda result: True, of_part: bool = False
) -> Callable[[Maker], Maker]:
    """Register the function below as a kind of picture.

    Args:
        name: of its file, without the ending; that of the part follows where there are several.
        caption: what a reader sees under it; ``{part}`` stands for the part.
        wanted: whether a result has what it draws.
        of_part: whether there is one for each part of Γc.
    """

    def register(make: Maker) -> Maker:
        PICTURES.append(Picture(name=name, caption=caption, wanted=wanted, of_part=of_part, make=make))
        return make

    return register
