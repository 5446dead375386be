"""What there is to draw of a finished folder: its pictures, each with its file."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import partial
from pathlib import Path

from matplotlib.figure import Figure

from .. import searches
from ..errors import PictureError
from ..reader import Result, read
from . import bodies, contact, equilibria  # noqa: F401 (the first two register pictures)
from . import path as path_picture
from .registry import PICTURES


@dataclass(frozen=True)
class Drawing:
    """A picture of one result.

    Attributes:
        path: where it goes.
        caption: what a reader sees under it.
        make: draws it.
        rendered: whether VTK may draw for it.
    """

    path: Path
    caption: str
    make: Callable[[], Figure]
    rendered: bool = False


def drawings_of(folder: Path) -> list[Drawing]:
    """What there is to draw of a finished folder, of whatever kind it is.

    Raises:
        ResultError: the folder is damaged.
        PictureError: there is nothing to draw.
    """
    if (folder / "equilibria.csv").exists():
        search = searches.read_equilibria(folder)
        return [Drawing(folder / equilibria.NAME, equilibria.CAPTION, partial(equilibria.make, search))]
    if (folder / "path.csv").exists():
        path = searches.read_path(folder)
        drawn = path.driven is not None
        return [Drawing(folder / path_picture.NAME, path_picture.CAPTION, partial(path_picture.make, path))] * drawn
    result = read(folder)
    arrays = result.arrays
    if arrays.displacement is None and arrays.escape_mode is None and not arrays.parts:
        raise PictureError(f"{folder}: there is nothing to draw, neither a displacement nor a part of Γc")
    _ = result.body.boundary  # which pictures need: once, for all processes that draw
    return list(drawings(result))


def drawings(result: Result) -> Iterator[Drawing]:
    """What there is to draw of a result."""
    for kind in sorted(PICTURES, key=lambda kind: kind.name):
        if not kind.wanted(result):
            continue
        if not kind.of_part:
            rendered = result.body.dimension == 3
            yield Drawing(result.folder / f"{kind.name}.png", kind.caption, partial(kind.make, result), rendered)
            continue
        alone = len(result.parts) == 1
        for part in result.parts:
            path = result.folder / f"{kind.name if alone else f'{kind.name}_{part.name}'}.png"
            caption = kind.caption.replace("{part}", "the contact part" if alone else f"“{part.name}”")
            yield Drawing(path, caption, partial(kind.make, result, part))
